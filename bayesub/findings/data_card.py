"""The card of a study's data: what every channel covers in time, what looks wrong in it, and what it informs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.findings import feedback, zeros
from bayesub.findings.set_up import AnyProblem
from bayesub.inference.checks import convergence
from bayesub.inference.identifiability.fisher import correlation_factor
from bayesub.inference.identifiability.linear_model import marginal_jacobian
from bayesub.io.errors import InputError
from bayesub.io.terminal import aligned
from bayesub.logs import log_files
from bayesub.model.equations import EquationSet

GAP = 3.0  # median intervals between two readings, beyond which readings are missing rather than dropped
FALSE_ALARMS = 0.01  # probability that a channel of smooth motion and normal noise has a candidate for an outlier
NAMED = 3  # coefficients that a row names
HEADS = ("channel", "readings", "at s", "gaps, outliers", "informs", "alone, % of prior sd")


@dataclass(frozen=True)
class ChannelCard:
    """One channel of one trial."""

    name: str  # that of the channel, with the trial in brackets if there are several
    column: str  # in its file
    times: np.ndarray  # (n,), s
    interval_s: float  # the median between two readings
    gaps: tuple[tuple[float, float], ...]  # start and end in s of each time without readings
    outliers: np.ndarray  # times in s of readings unlike their neighbours
    n_directions: int  # of parameter space that this channel alone determines better than the prior
    contraction: np.ndarray  # (n_params,), posterior over prior sd by its Fisher information at the prior centre alone

    def row(self, names: Sequence[str]) -> tuple[str, ...]:
        """The card of the channel as cells below :data:`HEADS`, with the names (n_params,) of the parameters."""
        faults = [f"gap {start:.4g}-{end:.4g} s" for start, end in self.gaps[:2]] + [".."] * (len(self.gaps) > 2)
        if len(self.outliers):
            at = ", ".join(f"{time:.4g}" for time in self.outliers[:3]) + (" .." if len(self.outliers) > 3 else "")
            faults.append(f"outlier? at {at} s")
        span = f"{self.times[0]:.4g}-{self.times[-1]:.4g} by {self.interval_s:.3g}"
        best = [k for k in np.argsort(self.contraction) if self.contraction[k] < 0.5][:NAMED]
        known = ", ".join(f"{names[k]} {100.0 * self.contraction[k]:.2g}" for k in best) or "none below 50"
        return self.name, str(len(self.times)), span, ", ".join(faults) or "none", str(self.n_directions), known


@dataclass(frozen=True)
class DataCard:
    """Coverage and information of the data of a study."""

    title: str  # study and vehicle
    equations: EquationSet  # of the vehicle
    names: tuple[str, ...]  # the n_params parameters, forces at knots not among them
    n_coefficients: int  # how many of them are coefficients; they come first
    channels: tuple[ChannelCard, ...]  # of all trials
    durations: dict[str, float]  # name of a trial ("" for the only one) -> seconds covered by its controls
    n_directions: int  # as that of a channel, by all of them together
    contraction: np.ndarray  # (n_params,), as that of a channel, by all of them together
    zeros: list[dict]  # coefficients that are known only with zeros of actuators, by zeros.together
    advice: str  # what the study should infer besides or heed; empty if nothing

    def lines(self) -> list[str]:
        """The card as a table, a row a channel, and what trades off with zeros of actuators."""
        n, total = self.n_directions, len(self.names)
        lines = aligned([HEADS, *(channel.row(self.names) for channel in self.channels)])
        lines.append(f"together they inform {n} of {total} directions ({100 * n / total:.0f} %)")
        lines += [zeros.sentence(self.zeros)] if self.zeros else []
        return [*lines, f"advice: {self.advice}"] if self.advice else lines

    def to_json(self) -> dict:
        """Everything but the times of the readings."""
        channels = [
            {key: getattr(c, key) for key in ("name", "column", "interval_s", "n_directions")}
            | {"n_readings": len(c.times), "first_s": float(c.times[0]), "last_s": float(c.times[-1])}
            | {"gaps_s": [list(gap) for gap in c.gaps], "outlier_candidates_s": c.outliers.tolist()}
            | {"contraction": dict(zip(self.names, c.contraction.tolist(), strict=True))}
            for c in self.channels
        ]
        together = dict(zip(self.names, self.contraction.tolist(), strict=True))
        of_zeros = {"zeros": self.zeros, "advice": self.advice}
        return {"channels": channels, "n_directions": self.n_directions, "contraction": together} | of_zeros


def check(problem: AnyProblem, title: str) -> DataCard:
    """The card of a problem of one trial or several, at the centre of its prior.

    `title`: study and vehicle. InputError if the simulation fails there, or readings weigh more than can be squared.
    """
    channels, rows, durations = [], [], {}
    positions, others = np.arange(problem.n_params), problem.others
    factor = correlation_factor(problem.prior, others)
    for trial, part, places in problem.each_trial(positions):
        whitened = _whitened(problem, part, places)
        with np.errstate(over="ignore", invalid="ignore"):
            size = np.sum(whitened**2)
        if not np.isfinite(size):
            text = f"{title}: the boat of the prior centre does not complete the trial, or a sensor has an sd of next "
            text += "to nothing; check the vehicle and the sensors"
            raise InputError(text, "model")
        rows.append(whitened)
        durations[trial] = part.manoeuvre.duration
        for channel in part.record.channels:
            name = f"{channel.name}[{trial}]" if trial else channel.name
            times, steps = channel.times, np.diff(channel.times)
            interval = float(np.median(steps)) if len(steps) else 0.0
            gaps = tuple((float(times[k]), float(times[k + 1])) for k in np.flatnonzero(steps > GAP * interval))
            outliers = times[outlier_candidates(times, channel.values, channel.total_sd)]
            rows_of_one = part.rows[channel.name]
            alone = _whitened(problem, part, places, rows_of_one) if part.histories else whitened[rows_of_one]
            informed = _information(alone, factor)
            column = log_files.HEADERS[channel.quantity]
            channels.append(ChannelCard(name, column, times, interval, gaps, outliers, *informed))
    whitened = np.concatenate(rows)
    informed = _information(whitened, factor)
    steps = problem.prior.sd[others, None] * factor
    covariance = steps @ np.linalg.solve(np.eye(len(others)) + (whitened @ factor).T @ (whitened @ factor), steps.T)
    n, names = problem.n_coefficients, tuple(problem.names[k] for k in others)
    of_zeros = zeros.together(names, covariance, problem.vehicle), feedback.advice(problem)
    return DataCard(title, problem.equations, names, n, tuple(channels), durations, *informed, *of_zeros)


def _whitened(problem, trial, places, rows=None) -> np.ndarray:
    """Jacobian of a trial by all parameters (n_others,) in prior sds, forces integrated out; of some rows or all."""
    read = np.zeros(trial.n_rows, dtype=bool)
    read[slice(None) if rows is None else rows] = True
    with np.errstate(over="ignore", invalid="ignore"):
        jacobian = marginal_jacobian(trial, problem.prior.mean[places], read)
    whitened = np.zeros((len(jacobian), len(problem.others)))
    whitened[:, np.searchsorted(problem.others, places[trial.others])] = jacobian
    return whitened * problem.prior.sd[problem.others]


def _information(whitened, factor) -> tuple[int, np.ndarray]:
    """Directions known better than by the prior, and posterior sd over prior sd (n_others,).

    They are of a Jacobian by parameters in prior sds, whose correlations have the factor (n_others, n_others).
    """
    _, s, vt = np.linalg.svd(whitened @ factor, full_matrices=False)
    gained = (vt @ factor.T) ** 2 * (s**2 / (1.0 + s**2))[:, None]
    return int(np.count_nonzero(s > 1.0)), np.sqrt(np.clip(1.0 - gained.sum(axis=0), 0.0, 1.0))


def outlier_candidates(times: np.ndarray, values: np.ndarray, sd: float) -> np.ndarray:
    """Positions of single readings that are far from the cubic through the two on either side.

    Far is beyond what normal noise does once in a hundred channels, in standard deviations of `sd` or of the robust
    spread of the channel itself (1.4826 median absolute deviations), if that is larger; of neighbours that are far only
    the farthest counts. Where readings are missing none is a candidate. Motion that bends between readings,
    as after a step of the rudder, makes candidates too if the sensor is that good.

    `times` (n,): s, ascending; `values` (n,): readings; `sd`: of their noise, in their unit.
    """
    if len(times) < 5:
        return np.empty(0, dtype=int)
    inner = np.arange(2, len(times) - 2)
    stencil = inner[:, None] + np.array([-2, -1, 1, 2])
    at, nodes = times[inner, None], times[stencil]
    weights = np.ones_like(nodes)
    for j in range(4):
        others = [k for k in range(4) if k != j]
        weights[:, j] = np.prod((at - nodes[:, others]) / (nodes[:, [j]] - nodes[:, others]), axis=1)
    scale = np.sqrt(1.0 + np.sum(weights**2, axis=1))
    off = np.abs(values[inner] - np.sum(weights * values[stencil], axis=1)) / scale
    whole = nodes[:, 3] - nodes[:, 0] <= 2.0 * GAP * np.median(np.diff(times))
    off = np.where(whole, off, 0.0)
    spread = max(sd, 1.4826 * np.median(off))
    padded = np.pad(off, 2)
    largest = off >= np.max([padded[k : k + len(off)] for k in range(5)], axis=0)
    return inner[largest & (off > spread * convergence.threshold(len(off), FALSE_ALARMS))]
