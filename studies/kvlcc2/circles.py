"""Advance and tactical diameter of turning circles, and what was published of those of this tanker.

Advance is how far the ship has gone ahead when the heading has changed by 90 degrees, tactical diameter how far to the
side when it has by 180, both from the first row of a file, in the axes of the file, heading from that row too. So the
published study has it; its MARIN records are smoothed by its filter and thinned to one row in two seconds of the ship.
"""

from collections.abc import Iterator

import numpy as np
from scipy.signal import savgol_filter

from kvlcc2.trials import CIRCLES, Tanker

# Alexandersson et al. 2022, table of turning circles of KVLCC2: of the test, predicted; m of the model.
PUBLISHED = {
    "port": {"advance_m": (21.59, 21.21), "diameter_m": (21.72, 23.07)},
    "starboard": {"advance_m": (22.54, 22.10), "diameter_m": (23.55, 24.29)},
}
MEASURES = {"advance_m": (90.0, 0), "diameter_m": (180.0, 1)}  # change of heading, and the axis of the way
SMOOTH_S = 2.2  # window of headings, which MARIN's files give in whole degrees above 100
PUT_DEG = {"rudder leaves its mean": 2.0, "rudder half over": 17.5, "rudder hard over": 34.0}


def measured(x: np.ndarray, y: np.ndarray, yaw: np.ndarray, turned: bool = False) -> dict[str, float]:
    """Advance and tactical diameter of a track, m; not a number if it does not turn so far.

    The place x and y (n,) is in m, yaw (n,) in deg without jumps; ahead is the x axis, or the first heading if the
    track is `turned`.
    """
    change, course = np.abs(yaw - yaw[0]), np.radians(yaw[0]) if turned else 0.0
    ways = np.array([[np.cos(course), np.sin(course)], [-np.sin(course), np.cos(course)]]) @ [x - x[0], y - y[0]]
    result = {}
    for key, (angle, axis) in MEASURES.items():
        after = int(np.argmax(change > angle))
        pair = slice(after - 1, after + 1)
        result[key] = float(abs(np.interp(angle, change[pair], ways[axis][pair]))) if after else np.nan
    return result


def of_log(log: dict[str, np.ndarray], first: int = 0, turned: bool = False) -> dict[str, float]:
    """Advance and tactical diameter of a log from one of its rows on."""
    row = log["time_s"][1] - log["time_s"][0]
    yaw = savgol_filter(log["yaw_deg"], 2 * round(0.5 * SMOOTH_S / row) + 1, 1)
    return measured(log["x_m"][first:], log["y_m"][first:], yaw[first:], turned)


def error(measure: dict) -> float:
    """Of what the posterior predicts of a measure, over the test."""
    return measure["posterior"] / measure["test"] - 1.0


def definitions(tanker: Tanker) -> dict[str, dict]:
    """Advance and diameter of the tests by start and axes, and as published."""
    result: dict[str, dict] = {}
    for side, name in CIRCLES.items():
        log = tanker.log(name)
        rudder = np.abs(log["rudder_deg"])
        starts = {"first row": 0} | {key: int(np.argmax(rudder > angle)) for key, angle in PUT_DEG.items()}
        axes = {"of the file": False, "of the first heading": True}
        result[side] = {
            start: {axis: of_log(log, row, turned) for axis, turned in axes.items()} for start, row in starts.items()
        }
        result[side]["published"] = {key: test for key, (test, _) in PUBLISHED[side].items()}
    return result


def table(numbers: dict) -> Iterator[dict]:
    """Rows of the tests by definition."""
    for side, starts in numbers.items():
        for start, content in starts.items():
            for axis, values in {"": content}.items() if start == "published" else content.items():
                yield {"circle": side, "from": start, "axes": axis} | values
