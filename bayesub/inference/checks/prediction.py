"""Does a posterior predict readings that were not fitted? Errors against bands, scores, and a verdict.

Parameters that the fit does not know (the start of the log, its current, biases of its sensors) are drawn given the
readings of a warm-up: for each draw of the others from the normal approximation at their conditional mode. The readings
of the warm-up say nothing about the others, and they are not judged.

The readings of a log err together, since they have the parameters in common: 90 % bands of a right posterior hold 90 %
of the readings on average, and 60 % of one log now and then. Replicated readings err together in the same way, and the
p-value is the share of them, and the log, whose errors are as large. It is uniform if the posterior is right.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability.linalg import complete_svd
from bayesub.inference.interface import SMOOTH, Searchable, TrialInference

N_DRAWS = 800
INTERVALS = (0.5, 0.9)
FALSE_ALARMS = 0.05  # of right posteriors; measured, 4 of 120 logs with a warm-up (page `results`)
LEAST_FLOWN = 20  # draws; of fewer there are no bands
_ITERATIONS, _TOLERANCE = 30, 1e-2  # of searches; in posterior standard deviations
_LONGEST = 1.0  # step of a coordinate, whose prior sd is one


@dataclass(frozen=True)
class Prediction:
    """Readings of a log as draws of parameters predict them."""

    slices: Mapping[str, slice]  # channel -> its readings
    times: np.ndarray  # (n_readings,) s
    readings: np.ndarray  # (n_readings,) measured values
    sds: np.ndarray  # (n_readings,) of their noise
    predicted: np.ndarray  # (n_flown, n_readings) noise-free readings of the draws whose simulation did not fail
    replicated: np.ndarray  # (n_flown, n_readings) readings that these draws could have made
    n_failed: int  # draws whose simulation failed, which are left out
    warm_up: float = 0.0  # readings until then are not judged, s

    @cached_property
    def n_flown(self) -> int:
        """Draws whose simulation did not fail."""
        return len(self.predicted)

    @cached_property
    def is_flown(self) -> bool:
        """Whether most draws complete the log, and enough of them for bands."""
        return self.n_flown >= max(LEAST_FLOWN, self.n_failed)

    @cached_property
    def judged(self) -> np.ndarray:
        """(n_readings,) whether a reading is later than the warm-up."""
        return _later(self.times, self.warm_up)

    @property
    def n_readings(self) -> int:
        """Number of readings that are judged."""
        return int(np.count_nonzero(self.judged))

    @cached_property
    def mean(self) -> np.ndarray:
        """(n_readings,) mean of the predictions."""
        return self.predicted.mean(axis=0)

    @cached_property
    def bands(self) -> dict[float, np.ndarray]:
        """Probability -> (2, n_readings) ends of the central intervals of the readings."""
        return {probability: band(self.replicated, probability) for probability in INTERVALS}

    @property
    def held(self) -> dict[float, np.ndarray]:
        """Probability -> (n_readings,) whether the band holds a reading."""
        return {p: (self.readings >= low) & (self.readings <= high) for p, (low, high) in self.bands.items()}

    @property
    def coverage(self) -> dict[float, float]:
        """Probability -> share of the judged readings within their bands; the probability on average over many logs."""
        return {probability: float(held[self.judged].mean()) for probability, held in self.held.items()}

    def by_channel(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Channel -> (.., n) of values (.., n_readings) of those readings that are judged; channels that have any."""
        parts = {name: values[..., part][..., self.judged[part]] for name, part in self.slices.items()}
        return {name: part for name, part in parts.items() if part.shape[-1]}

    @cached_property
    def rms(self) -> dict[str, float]:
        """Channel -> root mean square of readings less mean prediction."""
        return {name: float(np.sqrt(np.mean(e**2))) for name, e in self.by_channel(self.readings - self.mean).items()}

    @cached_property
    def crps(self) -> dict[str, float]:
        """Channel -> continuous ranked probability score, in the unit of the readings; less is better.

        It is E|y - r| - E|y - y'| / 2 of a reading r and independent predictive draws y and y' (Gneiting & Raftery
        2007), averaged over the readings; the absolute error, if all draws are the same.
        """
        n, scores = len(self.replicated), {}
        weights = (2.0 * np.arange(1, n + 1) - n - 1.0) / (n * (n - 1.0))  # of the mean of |y - y'| / 2 of all pairs
        readings = self.by_channel(self.readings)
        for name, draws in self.by_channel(self.replicated).items():
            distances = np.abs(draws - readings[name]).mean(axis=0) - weights @ np.sort(draws, axis=0)
            scores[name] = float(distances.mean())
        return scores

    @cached_property
    def chi_square_per_reading(self) -> float:
        """Squared errors over their own covariance and that of the noise; about one if all is as said."""
        half = len(self.predicted) // 2
        known = self.predicted[:half][:, self.judged]
        mean, sds = known.mean(axis=0), self.sds[self.judged]
        directions = (known - mean) / sds / np.sqrt(half - 1.0)
        return float(chi_squares((self.readings[None, self.judged] - mean) / sds, directions)[0] / self.n_readings)

    @cached_property
    def _excess(self) -> dict[str, np.ndarray]:
        """Channel -> (1 + n,) size of the errors of the log, and of n replicated ones, among replicated ones.

        The size is the mean of |error| over the half-width of the 90 % band, or over the sd of the noise where
        rounding makes most replicates the same. The first half of draws makes bands and sizes, the others replicates.
        """
        half = len(self.predicted) // 2
        low, high = band(self.replicated[:half], 0.9)
        sizes = np.abs(np.vstack([self.readings, self.replicated]) - self.predicted[:half].mean(axis=0))
        sizes /= np.maximum(0.5 * (high - low), self.sds)
        excess = {}
        for name, part in self.by_channel(sizes).items():
            of_log, *others = part.mean(axis=1)
            known = np.array(others[:half])
            excess[name] = (np.array([of_log, *others[half:]]) - known.mean()) / (known.std() or 1.0)
        return excess

    @cached_property
    def worst(self) -> str:
        """The channel whose errors are largest beside those of replicated readings."""
        return max(self._excess, key=lambda name: self._excess[name][0])

    @cached_property
    def p_value(self) -> float:
        """Share of replicated readings, and the log, whose errors are as large in their worst channel."""
        if not self.is_flown:
            return 0.0
        largest = np.max(list(self._excess.values()), axis=0)
        return float(np.mean(largest >= largest[0]))

    def predicts(self, false_alarms: float = FALSE_ALARMS) -> bool:
        """Whether the errors are as small as the draws say; of right posteriors, but for a share of `false_alarms`.

        The share is at least that of the log alone among the replicates.
        """
        return self.is_flown and self.p_value >= max(false_alarms, 1.5 * self._smallest)

    @cached_property
    def _smallest(self) -> float:
        """The p-value of a log beside whose errors those of all replicates are small."""
        return 1.0 / (1 + len(self.predicted) - len(self.predicted) // 2)

    def without_draws(self) -> "Prediction":
        """The same prediction, computed, without its draws, which fill the memory if the log is long."""
        names = ["n_flown", "is_flown", "_smallest"]
        if self.is_flown:
            names += ["mean", "bands", "rms", "crps", "worst", "p_value"]
        values = {name: getattr(self, name) for name in names}
        result = replace(self, predicted=self.predicted[:0], replicated=self.replicated[:0])
        vars(result).update(values)
        return result


def predict(
    problem: TrialInference, parameters: np.ndarray, rng: np.random.Generator, *, warm_up: float = 0.0
) -> Prediction:
    """Predict the readings of a trial by draws (n, n_params) of its parameters, with noise from `rng`.

    They know the readings until the end of the `warm_up`, s, at most (:func:`given_warm_up`), which are not judged.
    """
    predicted = problem.predicted(parameters)
    flown = np.isfinite(predicted).all(axis=1)
    replicated = problem.replicated(parameters[flown], rng) if flown.any() else predicted[flown]
    n_failed = int(np.count_nonzero(~flown))
    about = problem.rows, problem.times, problem.readings, problem.sds
    return Prediction(*about, predicted[flown], replicated, n_failed, warm_up)


def given_warm_up(
    problem: TrialInference,
    parameters: np.ndarray,
    rng: np.random.Generator,
    own: Sequence[int] | np.ndarray,
    warm_up: float,
) -> np.ndarray:
    """Parameters (n, n_params) with `own` ones drawn given the readings until `warm_up`, s, or none if that is zero.

    `own`: positions of parameters of the trial that draws of a posterior do not know, independent of all others in the
    prior; what stands there is not used. `rng` is their source.

    The steps of a search at the mean of the draws have a Jacobian each; the steps of the draws have the last of these
    in common. If the boat of the mean does not complete the log, own parameters are drawn from the prior.
    """
    positions, shocks = np.asarray(own, dtype=int), rng.standard_normal((len(parameters), len(own)))
    warm = _WarmUp(problem.smoothed(SMOOTH), positions, np.flatnonzero(~_later(problem.times, warm_up)))
    centre, t = parameters.mean(axis=0)[None], np.zeros((1, len(own)))
    if not (warm.early.size and positions.size and np.isfinite(problem.predicted(centre)).all()):
        return warm.placed(parameters, shocks)
    for _ in range(_ITERATIONS):
        svd = warm.jacobian_svd(centre, t)
        t, size = warm.improved(centre, t, *svd)
        if size < _TOLERANCE:
            break
    t = np.repeat(t, len(parameters), axis=0)
    for _ in range(_ITERATIONS):
        t, size = warm.improved(parameters, t, *svd)
        if size < _TOLERANCE:
            break
    _, s, vt = svd
    return warm.placed(parameters, t + (shocks / np.sqrt(s**2 + 1.0)) @ vt)


@dataclass(frozen=True)
class _WarmUp:
    """The posterior of `own` parameters given the others and the residuals at positions `early`.

    Own parameters are in their standard normal coordinates t (n, n_own).
    """

    problem: TrialInference
    own: np.ndarray
    early: np.ndarray

    def placed(self, parameters: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Parameters (n, n_params) with own ones at t."""
        whole, result = np.zeros(parameters.shape), parameters.copy()
        whole[:, self.own] = t
        result[:, self.own] = self.problem.prior.parameters(whole)[:, self.own]
        return result

    def jacobian_svd(self, centre: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the residuals by t (1, n_own)."""
        whole = np.zeros(centre.shape[1])
        whole[self.own] = t[0]
        jacobian = self.problem.jacobian(self.placed(centre, t)[0])[self.early]
        return complete_svd(self.problem.prior.chain(jacobian, whole)[:, self.own])

    def improved(
        self, parameters: np.ndarray, t: np.ndarray, u: np.ndarray, s: np.ndarray, vt: np.ndarray
    ) -> tuple[np.ndarray, float]:
        """t after a Gauss-Newton step with a decomposed Jacobian, and the longest step in posterior sds."""
        residuals = self.problem.residuals(self.placed(parameters, t))[:, self.early]
        force = s * (residuals @ u) + t @ vt.T
        force[~np.isfinite(force).all(axis=1)] = 0.0  # where the simulation failed
        step = (force / (s**2 + 1.0)) @ vt
        shortened = _LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), _LONGEST)
        return t - shortened * step, float(np.linalg.norm(force / np.sqrt(s**2 + 1.0), axis=1).max())


def _later(times, warm_up) -> np.ndarray:
    """(n,) whether times (n,) are later than a warm-up; all are if there is none."""
    return times > warm_up if warm_up > 0.0 else np.ones(len(times), dtype=bool)


def band(draws: np.ndarray, probability: float) -> np.ndarray:
    """(2, ..) quantiles of draws (n_draws, ..) that a share `probability` of them is between."""
    tail = 0.5 - 0.5 * probability
    return np.quantile(draws, [tail, 1.0 - tail], axis=0)


def chi_squares(errors: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) e'(I + A'A)^-1 e of errors e (n, n_readings) with A (n_draws, n_readings) the directions."""
    _, s, vt = np.linalg.svd(directions, full_matrices=False)
    return np.sum(errors**2, axis=1) - (errors @ vt.T) ** 2 @ (s**2 / (s**2 + 1.0))


def laplace(problem: Searchable, rng: np.random.Generator, n: int, start: np.ndarray | None = None) -> np.ndarray:
    """(n, n_params) draws of the Laplace approximation at the mode, made where the prior is standard normal.

    The mode is searched from `start` (n_params,), left out from the middle of the prior.
    """
    mode = gauss_newton(problem, start).values
    t = problem.prior.standard(mode)
    _, s, vt = complete_svd(problem.prior.chain(problem.jacobian(mode), t))
    return problem.prior.parameters(t + (rng.standard_normal((n, len(t))) / np.sqrt(s**2 + 1.0)) @ vt)
