"""A manoeuvre or a log as a run predicts it: bands of every state, where the boat is, and of a log its scores."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bayesub.findings import unseen
from bayesub.findings.unseen import POSTERIOR, PRIOR, SQP, TrialPrediction
from bayesub.findings.verdicts import DOES_NOT_PREDICT, FITS, NOT_FLOWN, worst
from bayesub.inference.checks.prediction import INTERVALS, LEAST_FLOWN, band
from bayesub.io.words import cell
from bayesub.logs.log_files import HEADERS, STATES, positions, si_factor
from bayesub.model.vehicles import Vehicle
from bayesub.problem.nuisance import CURRENTS, MOVING

MANY = 8  # names that are listed
X, Y, Z = positions("x", "y", "z")
WIDEST = max(INTERVALS)
_LEAST_SD = 1e-9  # m; along which all draws are in one place


@dataclass(frozen=True)
class Region:
    """Ellipses, one at each time, each of which holds the same share of the draws."""

    centres: np.ndarray  # (n_times, 2), m
    # (n_times, 2, 2), ``centre + root @ (cos t, sin t)`` is the ellipse, m. They are symmetric, so that t stays in its
    # place from one ellipse to the next
    roots: np.ndarray


@dataclass(frozen=True)
class PredictedMotion:
    """A motion as draws predict it."""

    times: np.ndarray  # (n_times,), s
    median: np.ndarray  # (n_times, 12) of the states over the ground, SI units
    bands: dict[float, np.ndarray]  # (2, n_times, 12), probability -> ends of the central intervals
    above: dict[float, Region]  # probability -> of east and north
    aside: dict[float, Region]  # probability -> of north and depth
    distance: np.ndarray  # (n_times,) from the mean place, within which nine of ten draws are, m
    n_flown: int  # draws that complete the motion, of which all this is
    n_failed: int  # draws that do not

    @property
    def is_flown(self) -> bool:
        """Whether most draws complete the motion, and enough of them for bands."""
        return self.n_flown >= max(LEAST_FLOWN, self.n_failed)

    @cached_property
    def half_widths(self) -> np.ndarray:
        """(n_times, 12) half of the widest bands, SI units."""
        return 0.5 * np.diff(self.bands[WIDEST], axis=0)[0]


def predicted_motion(times: np.ndarray, states: np.ndarray) -> PredictedMotion:
    """Summarise the states (n_draws, n_times, 12) of draws; a draw that fails is left out and counted."""
    flown = np.isfinite(states).all(axis=(1, 2))
    n_failed = int(np.count_nonzero(~flown))
    if flown.sum() < LEAST_FLOWN:
        empty = np.full((len(times), len(STATES)), np.nan)
        return PredictedMotion(times, empty, {}, {}, {}, empty[:, 0], int(flown.sum()), n_failed)
    states = states[flown]
    places = states[:, :, [X, Y, Z]]
    return PredictedMotion(
        times=times,
        median=np.median(states, axis=0),
        bands={probability: band(states, probability) for probability in INTERVALS},
        above={probability: region(states[:, :, [Y, X]], probability) for probability in INTERVALS},
        aside={probability: region(states[:, :, [X, Z]], probability) for probability in INTERVALS},
        distance=np.quantile(np.linalg.norm(places - places.mean(axis=0), axis=2), WIDEST, axis=0),
        n_flown=len(states),
        n_failed=n_failed,
    )


def region(places: np.ndarray, probability: float) -> Region:
    """The ellipses of the covariance of places (n_draws, n_times, 2), each so large that it holds a share of them."""
    centres = places.mean(axis=0)
    off = places - centres
    variances, directions = np.linalg.eigh(np.einsum("nti,ntj->tij", off, off) / (len(places) - 1.0))
    sds = np.sqrt(np.maximum(variances, _LEAST_SD**2))
    sizes = np.linalg.norm(np.einsum("nti,tij->ntj", off, directions) / sds, axis=2)
    radii = np.quantile(sizes, probability, axis=0)
    return Region(centres, np.einsum("tij,tj,tkj->tik", directions, sds * radii[:, None], directions))


def motion_table(motions: Mapping[str, PredictedMotion], states: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Column -> (n_times,) of medians and bands of states, by whom, in the units of files, for a CSV.

    The columns are named as ``x_m_posterior_q5``; the first is ``time_s``.
    """
    columns = {"time_s": next(iter(motions.values())).times}
    for name in states:
        k, factor = STATES.index(name), 1.0 / si_factor(name)
        for by, motion in motions.items():
            stem = f"{HEADERS[name]}_{by.replace(' ', '_')}"
            columns[f"{stem}_median"] = factor * motion.median[:, k]
            columns |= {f"{stem}_{q}": factor * end[:, k] for q, end in quantiles(motion.bands).items()}
    return columns


def quantiles(bands: Mapping[float, np.ndarray]) -> dict[str, np.ndarray]:
    """``q5`` and so on -> ends of bands (2, ..), ascending."""
    percents = {50.0 * (1.0 + sign * p): ends[k] for p, ends in bands.items() for k, sign in enumerate((-1.0, 1.0))}
    return {f"q{percent:g}": percents[percent] for percent in sorted(percents)}


def motion_numbers(motions: Mapping[str, PredictedMotion], states: tuple[str, ...]) -> dict:
    """What there is to say of the motion that a posterior predicts, beside others, as JSON types, in units of files.

    Of each state: the median at the end, and the largest distance of the median to that of the posterior; by posterior
    and prior half of the 90 % band, at the end and at its widest, and the same of :attr:`PredictedMotion.distance`.
    """
    main = motions[POSTERIOR]
    result: dict = {
        "last_s": float(main.times[-1]),
        "draws": {by: motion.n_flown for by, motion in motions.items()},
        "failed_draws": {by: motion.n_failed for by, motion in motions.items()},
        "is_flown": main.is_flown,
        "distance_m": {},
        "states": {},
    }
    if not main.is_flown:
        return result
    flown = {by: motion for by, motion in motions.items() if motion.is_flown}
    wide = {by: motion for by, motion in flown.items() if by in (POSTERIOR, PRIOR)}
    result["distance_m"] = {
        by: {"at_end": float(m.distance[-1]), "largest": float(m.distance.max())} for by, m in wide.items()
    }
    for name in states:
        k, factor = STATES.index(name), 1.0 / si_factor(name)
        result["states"][HEADERS[name]] = by_whom = {}
        for by, motion in flown.items():
            off = np.abs(motion.median - main.median)[:, k].max()
            by_whom[by] = {"median_at_end": factor * float(motion.median[-1, k]), "off": factor * float(off)}
        for by, motion in wide.items():
            half = factor * motion.half_widths[:, k]
            by_whom[by] |= {"half_width_at_end": float(half[-1]), "half_width": float(half.max())}
    return result


@dataclass(frozen=True)
class PredictedTrial:
    """A manoeuvre or a log as a run predicts it."""

    run: str  # name of the study
    vehicle: Vehicle
    motions: dict[str, PredictedMotion]  # by whom; the posterior first
    readings: TrialPrediction  # the trial; of a manoeuvre without predictions
    held: tuple[str, ...] = ()  # coefficients that act and that the run does not infer
    shortcomings: tuple[str, ...] = ()  # why the posterior has not converged; empty if it has
    verdict: str = FITS  # on the run (:data:`bayesub.findings.verdicts.STATUS`)
    current_mps: tuple[float, float] | None = None  # north and east, if it was given

    @property
    def name(self) -> str:
        """Of the trial."""
        return self.readings.trial.name

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Short names of those that move, in their order."""
        manoeuvre = self.readings.trial.problem.manoeuvre
        moving = MOVING.get(self.vehicle.equations.subproblem(manoeuvre.subproblem), STATES)
        return tuple(name for name in STATES if name in moving)

    @cached_property
    def numbers(self) -> dict:
        """Everything there is to say, as JSON types."""
        motion = motion_numbers(self.motions, self.states)
        result: dict[str, Any] = {
            **{key: getattr(self, key) for key in ("run", "name", "verdict")},
            "vehicle": self.vehicle.name,
            "converged": not self.shortcomings,
            "shortcomings": list(self.shortcomings),
            "held": list(self.held),
            "motion": motion,
            "predictions": [],
        }
        if self.current_mps is not None:
            result["current_mps"] = list(self.current_mps)
        if self.readings.predictions:
            (log,) = unseen.numbers([self.readings])
            flown = {by: one for by, one in self.readings.predictions.items() if one.is_flown}
            log["coverage_by"] = {by: unseen.by_percent(one.coverage) for by, one in flown.items()}
            if POSTERIOR in flown:
                scores = flown.pop(POSTERIOR).crps
                log["crps_over"] = {by: unseen.mean_ratio(scores, one.crps) for by, one in flown.items()}
            result["predictions"] = [log]
        predicts = all(log["predicts"] for log in result["predictions"])
        wrong = {NOT_FLOWN: not motion["is_flown"], DOES_NOT_PREDICT: not predicts}
        result["outcome"] = worst([self.verdict, *(words for words, is_wrong in wrong.items() if is_wrong)])
        result["sentences"] = self._sentences(result)
        return result

    def _sentences(self, numbers: dict) -> dict[str, str]:
        """The sentences by topic."""
        sentences = {"motion": _of_motion(numbers["motion"], self.name)}
        if self.held:
            listed = ", ".join(self.held[:MANY]) + (" .." if len(self.held) > MANY else "")
            text = f"{len(self.held)} coefficients that act on this motion are not inferred by the run and stand at "
            text += f"the values of the vehicle file, as if they were known: {listed}."
            sentences["held"] = f"{text} The bands leave out their uncertainty."
        for log in numbers["predictions"]:
            ratio = log.get("crps_over", {}).get(SQP)
            also = "" if ratio is None else f" Its score is {cell(ratio, 2)} of SQP's."
            sentences["prediction"] = log["sentence"] + also
        return sentences

    @property
    def water(self) -> str:
        """The sentence on the current."""
        if not set(CURRENTS).isdisjoint(self.readings.trial.problem.names):
            return "a current that the warm-up determines"
        if self.current_mps is None:
            return "no steady current"
        north, east = self.current_mps
        return f"a known current of {north:g} m/s to the north and {east:g} m/s to the east"


def _of_motion(motion: dict, name: str) -> str:
    if not motion["is_flown"]:
        return f"With most draws of the posterior the boat does not complete {name}."
    distance, states = motion["distance_m"], motion["states"]

    def other(values, key, unit):
        return f" (prior: {cell(values[PRIOR][key], 2)}{unit})" if PRIOR in values else ""

    text = f"After {motion['last_s']:.4g} s the boat is within {cell(distance[POSTERIOR]['at_end'], 2)} m of where "
    text += f"it is expected with 90 % probability{other(distance, 'at_end', ' m')}"
    for column, word in ((HEADERS["psi"], "heading"), (HEADERS["theta"], "pitch")):
        if column in states:
            half = states[column]
            text += f", its {word} known to within {cell(half[POSTERIOR]['half_width_at_end'], 2)} deg"
            text += other(half, "half_width_at_end", " deg")
    if SQP in next(iter(states.values())):
        off = max(states[HEADERS[name]][SQP]["off"] for name in "xyz" if HEADERS[name] in states)
        text += f"; SQP is off the median by up to {cell(off, 2)} m"
    failed = motion["failed_draws"][POSTERIOR]
    return f"{text}.{unseen.not_flown(failed, motion['draws'][POSTERIOR] + failed, name)}"


def readings_table(prediction: TrialPrediction) -> Mapping[str, np.ndarray]:
    """Column -> (n_readings,) of the readings and their bands, channel after channel, for a CSV."""
    posterior = prediction.posterior
    channels = prediction.trial.problem.record.channels
    lengths = [len(channel.times) for channel in channels]
    factors = np.repeat([1.0 / si_factor(channel.quantity) for channel in channels], lengths)
    columns = {"column": np.repeat([HEADERS[channel.quantity] for channel in channels], lengths)}
    columns |= {"time_s": posterior.times, "judged": posterior.judged.astype(int)}
    columns["reading"] = posterior.readings * factors
    if posterior.is_flown:
        columns["mean"] = posterior.mean * factors
        columns |= {name: end * factors for name, end in quantiles(posterior.bands).items()}
    return columns
