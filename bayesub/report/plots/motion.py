"""Predicted motions: bands of every state against time, and regions along the track."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

from bayesub.findings.predicted_trial import PredictedMotion
from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.report.plots import style
from bayesub.report.plots.track import ALPHA, STRAIGHT, X, Y, Z, draw_actuators

_SHADE = {0.9: 0.65, 0.5: 0.35}  # how far regions are from their colour to white; they lie over each other
_CORNERS = 24  # of an ellipse
_CIRCLE = np.stack([np.cos(t := np.linspace(0.0, 2.0 * np.pi, _CORNERS)), np.sin(t)])
_ELLIPSES = 200  # along a track, about
_DASH = 5.0  # points
_TRACK, _EDGE, _LEAST = (7.0, 5.0), 0.9, 3.8  # inches: largest figure of a track, what is beside its axes, least side


@dataclass(frozen=True)
class Drawn:
    """A motion as it is drawn."""

    label: str
    colour: str
    motion: PredictedMotion
    probabilities: tuple[float, ...] = (0.9, 0.5)  # of its bands, widest first; without any it is a line
    is_framed: bool = True  # whether differences are shown, and whole. Of others only lines are, cut where these end
    # Place of its line among so many. All but the first are dashed, each in its turn, so that all are seen where they
    # are the same:
    turn: tuple[int, int] = (0, 1)

    @property
    def labels(self) -> list[str]:
        """Of its bands, the last with the line of the median, or of its line."""
        *others, last = [f"{self.label}, {100 * probability:g} %" for probability in self.probabilities] or [self.label]
        return [*others, f"{last}, median" if self.probabilities else last]

    @property
    def line(self) -> dict:
        """How its line looks."""
        place, n = self.turn
        dashes = ((n - place) * _DASH, (_DASH, (n - 1) * _DASH)) if place else "-"
        return {"color": self.colour, "lw": 1.0, "ls": dashes, "zorder": 2.6 if place else 2.5}


def draw_states(
    path: style.Paths,
    drawn: Sequence[Drawn],
    of: str,
    states: Sequence[str],
    manoeuvre: Any,
    actuators: Any,
    warm_up: float = 0.0,
) -> None:
    """A row for each state: its bands, and these less the median of one of `drawn`; the orders below.

    `drawn`: what lies on top last; `of`: label of the one from whose median differences are; `states`: short names;
    `manoeuvre` and `actuators`: whose orders are drawn; `warm_up`: s; shaded, and left out of the range of differences.
    """
    base = next(one.motion for one in drawn if one.label == of)
    with style.figure(path, 9.0, 1.6 + 1.25 * (len(states) + 1)) as figure:
        rows = figure.subplots(len(states) + 1, 2, squeeze=False, sharex=True, width_ratios=[1.0, 1.6])
        for (left, right), name in zip(rows, states, strict=False):
            k, factor = log_files.STATES.index(name), 1.0 / log_files.si_factor(name)
            shown: dict[Axes, list[np.ndarray]] = {left: [], right: []}
            for one in drawn:
                shown[left] += _draw_bands(left, one, k, factor, 0.0)
                if one.is_framed or not one.probabilities:
                    centre = np.interp(one.motion.times, base.times, base.median[:, k], right=np.nan)
                    ends = _draw_bands(right, one, k, factor, centre)
                    shown[right] += [end[one.motion.times >= warm_up] for end in ends] if one.is_framed else []
            for axis, ends in shown.items():
                style.show_whole(axis, np.concatenate(ends))
                style.shade_warm_up(axis, warm_up)
            left.set_ylabel(with_unit(log_files.HEADERS[name]))
            if name == "z":
                left.invert_yaxis()
        rows[0, 0].set_title("states; grey ground: warm-up" if warm_up else "states", fontsize=9)
        rows[0, 1].set_title(f"less the median of {of}", fontsize=9)
        orders, empty = rows[-1]
        draw_actuators(orders, actuators, manoeuvre, manoeuvre.times, manoeuvre.log)
        handles = orders.get_legend_handles_labels()
        empty.legend(*handles, loc="lower left", fontsize=8, title="orders", alignment="left")
        empty.set_axis_off()
        rows[-2, 1].tick_params(labelbottom=True)
        for axis in (orders, rows[-2, 1]):
            axis.set_xlabel("time (s)")
        _add_legend(figure, rows[0, 0], drawn)


def _add_legend(figure, axis, drawn: Sequence[Drawn]) -> None:
    """Below all: bands and lines, the median's over the band that it is in."""
    shown = dict(zip(*axis.get_legend_handles_labels()[::-1], strict=True))
    banded = [one for one in drawn if one.probabilities]
    medians = {one.labels[-1]: (shown[one.labels[-1]], Line2D([], [], **one.line)) for one in banded}
    handles = [medians.get(label, shown[label]) for one in drawn for label in one.labels]
    labels = [label for one in drawn for label in one.labels]
    columns = style.legend_columns(labels, figure.get_figwidth())
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)


def _draw_bands(axis, one: Drawn, k: int, factor: float, centre) -> list[np.ndarray]:
    """Draw bands and median of a state less a centre; what is to be seen whole."""
    motion, ends = one.motion, []
    for probability, label in zip(one.probabilities, one.labels, strict=False):
        low, high = (factor * (end[:, k] - centre) for end in motion.bands[probability])
        axis.fill_between(motion.times, low, high, color=one.colour, alpha=ALPHA[probability], lw=0, label=label)
        ends += [low, high]
    median = factor * (motion.median[:, k] - centre)
    axis.plot(motion.times, median, **one.line, label=None if one.probabilities else one.label)
    return ends or [median]


def draw_track(path: style.Paths, drawn: Sequence[Drawn]) -> None:
    """The track from above, or from aside if it does not turn: medians, and where the boat is with each probability."""
    states = drawn[-1].motion.median
    turns = np.ptp(states[:, Y]) > STRAIGHT * np.ptp(states[:, X]) or not np.ptp(states[:, Z])
    with style.figure(path, *_TRACK) as figure:
        axis = figure.subplots()
        for one in sorted(drawn, key=lambda one: -one.motion.distance.max()):  # the narrow ones lie on top
            regions = one.motion.above if turns else one.motion.aside
            own = np.array(to_rgb(one.colour))
            for probability, label in zip(one.probabilities, one.labels, strict=False):
                _draw_region(axis, regions[probability], tuple(own + _SHADE[probability] * (1.0 - own)), label)
        across, along = (Y, X) if turns else (X, Z)
        for one in drawn:
            median = one.motion.median[:, [across, along]].T
            axis.plot(*median, **one.line, label=None if one.probabilities else one.label)
        axis.plot(*states[0, [across, along]], "o", color=style.TRUTH, ms=4)
        if turns:
            size = np.array([np.ptp(ends) for ends in (axis.get_xlim(), axis.get_ylim())])  # m
            scale = np.min((np.array(_TRACK) - _EDGE) / size)
            least = _LEAST, style.legend_column([label for one in drawn for label in one.labels])
            figure.set_size_inches(np.maximum(scale * size + _EDGE, (max(least), _LEAST)))
            axis.set_aspect("equal", adjustable="datalim")
        else:
            axis.invert_yaxis()
        axis.set(xlabel="east (m)" if turns else "north (m)", ylabel="north (m)" if turns else "depth (m)")
        _add_legend(figure, axis, drawn)


def _draw_region(axis, region, colour, label) -> None:
    """Ellipses, and what they sweep from one to the next: quadrangles between their sides."""
    every = max(1, len(region.centres) // _ELLIPSES)
    corners = region.centres[::every, None] + np.swapaxes(region.roots[::every] @ _CIRCLE, 1, 2)
    sides = np.stack([corners[:, :-1], corners[:, 1:]], axis=2)
    swept = np.concatenate([sides[:-1], sides[1:, :, ::-1]], axis=2).reshape(-1, 4, 2)
    look: dict[str, Any] = {"facecolors": [colour], "edgecolors": [colour], "linewidths": 0.3}
    axis.add_collection(PolyCollection(list(corners), **look, label=label))
    axis.add_collection(PolyCollection(list(swept), **look))
    axis.autoscale_view()
