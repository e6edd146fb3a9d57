"""The tanker, its trials, and the problems that they pose."""

import tempfile
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import bayesub as bs
from bayesub.io.errors import InputError
from bayesub.study.schema.trial_log import Trial, read_trial
from kvlcc2 import published

FOLDER = Path(__file__).parent
FITTED = ("10_10_P", "10_10_S", "20_10_P", "20_10_S")
ZIGZAGS = ("05_01", "10_01", "10_05", "15_01", "15_05", "20_05", "25_05", "30_05", "35_05")
CIRCLES = {"starboard": "tc_-35_m", "port": "tc_35_m"}  # a positive rudder turns the ship to port
MARIN = ("zz_-10_m", "zz_10_m", "zz_-20_m", "zz_20_m", *CIRCLES.values())
HSVA, UNSEEN = FITTED + ZIGZAGS, ZIGZAGS + MARIN
SCALE = 45.714  # of MARIN's numbers, which are of the ship
HELD = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")  # added masses
SDS = {"x_m": 0.1, "y_m": 0.1, "yaw_deg": 0.5, "u_mps": 0.01, "v_mps": 0.01, "r_degps": 0.05}
# Of the start, which is a straight line through the rows until the rudder is put.
START_S, START_SDS = 0.6, {"x_m": 0.02, "y_m": 0.02, "yaw_deg": 0.1, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.03}
ROW_S, READING_S, STEP_S = 0.2, 4.0, 0.2  # rows of the logs; readings: neighbours of less are correlated; time step
ZERO = "bias_rudder_deg"
# Of the rudder in one run, degrees; what all have in common is Y0 and N0. MARIN's model had a rudder of its own, and
# the neutral angle of the sister ship's was one degree (HSVA's report).
RUN_ZERO, OTHER_ZERO = bs.priors.normal(0.0, 0.3), bs.priors.normal(0.0, 1.0)
COLUMNS = ("time_s", "x_m", "y_m", "yaw_deg", "u_mps", "v_mps", "r_degps", "rudder_deg")


def read(file: Path) -> dict[str, np.ndarray]:
    """Column -> values of a file of HSVA or MARIN, of the model; velocities over the ground are turned to u and v."""
    text = file.read_text(encoding="latin-1")
    lines = [line.split() for line in text.splitlines() if _is_row(line)]
    if len({len(line) for line in lines}) != 1:
        raise InputError(f"{file}: has no rows of numbers, or rows of unequal length; copy the file again", "data")
    rows = np.array(lines, dtype=float).T
    scale = SCALE if "MARIN" in file.name else 1.0
    if scale == SCALE:  # stamps of three digits; 50 Hz of the model
        _, x, y, _, psi, dx, dy, _, r, rudder, _ = rows
        times = 0.02 * np.arange(len(x))
    else:
        times, x, y, psi, dx, dy, r, _, rudder, *_ = rows
    cos, sin, speed = np.cos(np.radians(psi)), np.sin(np.radians(psi)), np.sqrt(scale)
    u, v = (dx * cos + dy * sin) / speed, (dy * cos - dx * sin) / speed
    return dict(zip(COLUMNS, (times, x / scale, y / scale, psi, u, v, r * speed, rudder), strict=True))


def file_of(folder: Path, name: str) -> Path:
    """The file of a trial."""
    return folder / f"{'MARIN_FREE_KVLCC2_' if name in MARIN else 'HSVA_CPMC_KVLCC2_Z_'}{name}.dat"


def _start(log):
    """Name -> prior of each state at the start."""
    n, priors = round(START_S / ROW_S) + 1, {}
    for column, sd in START_SDS.items():
        at_zero = np.polyfit(log["time_s"][:n], log[column][:n], 1)[1]
        priors["0_".join(column.rsplit("_", 1))] = bs.priors.normal(float(at_zero), sd)
    return priors


def _is_row(line):
    try:
        return len([float(cell) for cell in line.split()]) > 10
    except ValueError:
        return False


class Tanker:
    """The boat, and the problems that its trials pose."""

    def __init__(self, folder: Path, form: float = published.FORM):
        self.folder = folder
        boat = bs.load_vehicle(FOLDER / "vehicle.toml")
        xi, self.prior = published.prior(boat, form)
        self.boat = replace(boat, xi=xi)
        self.free = [name for name in self.boat.equations.names if name not in HELD]
        self.trial = cache(self._trial)

    def log(self, name: str) -> dict[str, np.ndarray]:
        """Column -> values every 0.2 s."""
        log = read(file_of(self.folder, name))
        every = round(ROW_S / np.median(np.diff(log["time_s"])))
        return {column: values[::every] for column, values in log.items()}

    def _trial(self, name: str, interval_s: float = READING_S) -> Trial:
        """The log as a trial, with a reading in each interval."""
        sensors = [bs.sensors.Sensor(column, sd=sd) for column, sd in SDS.items()]
        with tempfile.TemporaryDirectory() as folder:
            path, log = Path(folder) / f"{name}.csv", self.log(name)
            rows = np.column_stack(list(log.values()))
            np.savetxt(path, rows, delimiter=",", comments="", fmt="%.6g", header=",".join(log))
            trial = read_trial(path, self.boat, sensors, subproblem="horizontal", nuisance=_start(log))
        every = round(interval_s / ROW_S)
        thinned = [replace(c, times=c.times[::every], values=c.values[::every]) for c in trial.record.channels]
        return replace(trial, record=bs.Record(tuple(thinned)))

    def problem(
        self,
        name: str,
        disturbance: bs.UnknownDisturbance | None = None,
        interval_s: float = READING_S,
        terms: Iterable[str] | None = None,
    ) -> bs.Problem:
        """A trial with unknown start and rudder zero, with unmodelled forces or without, with all terms or some."""
        trial, equations = self.trial(name, interval_s), self.boat.equations
        free = self.free if terms is None else list(terms)
        zero = OTHER_ZERO if name in MARIN else RUN_ZERO
        xi = np.where(np.isin(equations.names, [*free, *HELD]), self.boat.xi, 0.0)
        options = {"free": free, "xi": xi, "prior": self.prior, "nuisance": trial.nuisance | {ZERO: zero}}
        return bs.Problem(self.boat, trial.manoeuvre, trial.record, disturbance=disturbance, dt=STEP_S, **options)

    def joint(self, names: Iterable[str], *options: Any) -> bs.JointProblem:
        """Some trials, each with a rudder zero of its own; options are those of :meth:`problem`."""
        return bs.JointProblem({name: self.problem(name, *options) for name in names}, own=(ZERO,))
