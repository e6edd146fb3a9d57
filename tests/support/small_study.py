"""The small study that tests change, as a table, as text and as a file; and runs of it that are soon over."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import bayesub as bs
from bayesub.io.atomic import replacing

_TRACK = {
    "kind": "track",
    "channels": ["x", "y", "yaw"],
    "position_sd_m": 0.2,
    "attitude_sd_deg": 0.1,
    "interval_s": 2.0,
}
_STUDY = {
    "name": "small",
    "vehicle": "auv690",
    "manoeuvre": "horizontal",
    "seed": 3,
    "dt_s": 0.4,
    "sensors": [_TRACK],
    "free": {"coefficients": ["Xuu", "Yuv", "Nuv", "Yuu_dr"]},
    "prior": {"kind": "relative_normal", "sd": 0.25},
}
SUBOFF = {"vehicle": "suboff", "dt_s": 1.0}
LOG = {"manoeuvre": None, "data": "log.csv", "subproblem": "horizontal"}  # in place of a simulated trial


def merged(table: dict, changes: dict) -> dict:
    """A table with changes: tables within it are merged too, and None removes a key."""
    found = table | {k: merged(table.get(k, {}), new) if isinstance(new, dict) else new for k, new in changes.items()}
    return {key: value for key, value in found.items() if value is not None}


def track(**changes) -> dict:
    """The sensor of the study."""
    return merged(_TRACK, changes)


TINY = {  # whose run takes a second or two
    "manoeuvre": "turning_circle",
    "seed": 1,
    "sensors": [track(attitude_sd_deg=0.2, interval_s=5.0)],
    "free": {"coefficients": ["Xuu", "Nuv", "Nuu_dr"]},
    "baselines": {"linear_least_squares": False, "sqp_starts": 1},
    "sampler": {"max_steps": 5000},
}


def content(**changes) -> dict:
    """The study as a table."""
    return merged(_STUDY, changes)


def text(**changes) -> str:
    """The study as the text of a file. Tables stand last, so that others can be appended."""
    return tomli_w.dumps(content(**changes))


def write(path: Path, **changes) -> Path:
    """Write the study; gives the path."""
    path.write_text(text(**changes))
    return path


def write_sensors(path: Path, *sensors: dict) -> Path:
    """Write a file of sensors, as ``bayesub simulate --sensors`` reads it; gives the path."""
    path.write_text(tomli_w.dumps({"sensors": sensors}))
    return path


def save_logs(folder: Path, boat: bs.Vehicle, manoeuvres: dict[str, str]) -> Path:
    """Fly a boat in the plane, and save its track by the sensors of a study as a log of each name; gives the folder."""
    rng = np.random.default_rng(7)
    for name, manoeuvre in manoeuvres.items():
        truth = bs.simulate(boat, bs.load_manoeuvre(manoeuvre, boat), dt=0.5, subproblem="horizontal")
        record = bs.observe(truth, bs.sensors.Track(0.5, 0.1, 10.0, ("x", "y", "yaw")), rng)
        record.save(folder / f"{name}.csv", truth)
    return folder


def leave_empty(paths) -> None:
    """Files in place of a figure that no test looks at."""
    for path in map(Path, [paths] if isinstance(paths, str | Path) else paths):
        with replacing(path) as partial:
            partial.write_bytes(b'<svg viewBox="0 0 1 1"></svg>' if path.suffix == ".svg" else b"")


def run(study: Path | bs.Study, folder: Path) -> bs.StudyResult:
    """Run a study with a report whose figures are empty and whose derived quantities are of few boats."""
    from bayesub.findings import derived  # loads Matplotlib
    from bayesub.report import report  # loads Matplotlib

    figures = report.figures
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "figures", lambda *given: (replace(f, draw=leave_empty) for f in figures(*given)))
        patch.setattr(derived, "N_DRAWS", 16)
        return bs.run(study, folder)


def forget_config(folder: Path) -> None:
    """Have the run of a folder not know its settings by their digest, as runs of former versions do not."""
    outcome = json.loads((folder / "outcome.json").read_text())
    del outcome["files_sha256"]["config.toml"]
    (folder / "outcome.json").write_text(json.dumps(outcome))
