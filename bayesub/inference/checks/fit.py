"""Does the model fit? Posterior predictive checks of the residuals of every channel.

The quantile residual of a reading is the standard normal quantile of the probability that the noise model gives to what
is below it, at one draw of the posterior and given the readings before it (Dunn & Smyth 1996; for a rounded reading a
random point of its interval). At the true parameters quantile residuals are independent and standard normal, whatever
the noise model, and over repeated trials they are so at a draw from the posterior too (Johnson 2007). Residuals of
replicated readings therefore have the same distribution at every draw, and the posterior predictive p-value of a
discrepancy, the share of replicates that exceed it, is the mean over the draws of a known tail probability: no
replicate need be drawn. A mean of p-values is below a small limit at most twice as often as it should be (Meng 1994),
and about as often as it should be if there are many more readings than parameters.

Discrepancies of a channel with n readings, each with its tail probability (and its error):

- ``chi_square``: the sum of squares, on both sides; exact
- ``largest``: the largest in size; exact
- ``outliers``: the number beyond three; exact
- ``anderson_darling``: A^2 against the standard normal, with P = sqrt(3) erfc(A), the upper tail of its limit as
  a weighted sum of chi-squares (Zolotarev 1961); an eighth too small at 5 %, a tenth at 1 %
- ``lag_1``: correlation of successive readings about zero, on both sides; normal with its exact variance
- ``drift``: squares along the 20 slowest cosines of the time, the constant among them, over those of the rest; an
  F test, exact at any times

The last two do not depend on the size of the noise. The Ljung-Box sum of squared correlations is not among them: of 600
readings it exceeds the 0.025 % point of chi-square twice as often as that, of 100 ten times. A pair of readings counts
for the lag, in median intervals, that is nearest to their distance in time, so that missing readings and gaps leave
fewer pairs and nothing else. Where a channel has fewer than five readings the last two are left out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import special

N_LAGS = N_WAVES = 20
_TINY = 1e-300  # in place of a sum of squares that vanishes
_READINGS = 5  # at least for a lag or a wave
OUTLIER = 3.0
FALSE_ALARMS = 0.01
FAR_TOO_SMALL = 0.5  # chi-square per reading, below which what a large sd lets draws do is all that correlates
CORRELATED = ("lag_1", "drift")
SIZED = ("chi_square", "largest", "outliers")
_SPREAD_ERROR = 1.17  # standard error of the spread of normal residuals, times the root of their number


@dataclass(frozen=True)
class Check:
    """The residuals of one channel."""

    n_readings: int  # of the channel
    chi_square_per_reading: float  # mean over the draws
    n_outliers: float  # mean over the draws
    spread: float  # median size of the residuals over that of a standard normal, which a few outliers leave alone
    interval_s: float  # between readings, the median one
    correlations: np.ndarray  # (n_lags,) means over the draws, lag 1 first
    p_values: dict[str, float]  # discrepancy -> posterior predictive p-value
    threshold: float  # the p-value below which a discrepancy counts

    @property
    def failed(self) -> tuple[str, ...]:
        """The discrepancies that the noise model does not explain."""
        return tuple(name for name, p in self.p_values.items() if p < self.threshold)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong, of "correlated", "outliers", "large", "small" and "shape", gravest first; empty if nothing.

        Large residuals are outliers if most are not, or noise as large as most had not so many beyond three (Poisson).
        """
        failed, faults = self.failed, []
        if any(name in failed for name in CORRELATED):
            faults.append("correlated")
        if any(name in failed for name in SIZED):
            expected = expected_outliers(self.n_readings, self.spread)
            widened = self.spread > 1.0 + 3.0 * _SPREAD_ERROR / np.sqrt(self.n_readings)
            tailed = special.pdtrc(max(self.n_outliers - 1.0, 0.0), expected) < self.threshold
            too_large = self.chi_square_per_reading > 1.0 or "chi_square" not in failed
            faults.append(("outliers" if tailed or not widened else "large") if too_large else "small")
            if faults[-1] == "small" and self.chi_square_per_reading < FAR_TOO_SMALL:
                faults.reverse()
        return tuple(faults) if faults or not failed else ("shape",)

    def to_json(self) -> dict:
        """Everything as JSON types."""
        content = vars(self) | {"correlations": self.correlations.tolist(), "faults": list(self.faults)}
        return {key: value for key, value in content.items() if key != "threshold"}


@dataclass(frozen=True)
class Criticism:
    """The checks of all channels."""

    checks: dict[str, Check]  # by channel
    # Probability, at most, that anything is found in a record of the model (Bonferroni: each p-value is held against it
    # over the number of tests)
    false_alarms: float

    @property
    def n_tests(self) -> int:
        """Number of p-values."""
        return sum(len(check.p_values) for check in self.checks.values())

    @cached_property
    def suspects(self) -> dict[str, Check]:
        """The checks of the channels that do not look like their noise model."""
        return {name: check for name, check in self.checks.items() if check.failed}

    @property
    def fits(self) -> bool:
        """Whether every channel looks like its noise model."""
        return not self.suspects

    def to_json(self) -> dict:
        """Everything as JSON types."""
        content = {key: getattr(self, key) for key in ("fits", "false_alarms", "n_tests")}
        return content | {"channels": {name: check.to_json() for name, check in self.checks.items()}}


def criticise(residuals: dict, times: dict, false_alarms: float = FALSE_ALARMS) -> Criticism:
    """Check quantile residuals (n_draws, n_readings) of channels by name, read at ascending times (n_readings,) s.

    Draws whose simulation failed are left out.
    """
    usable = {name: part[np.isfinite(part).all(axis=1)] for name, part in residuals.items()}
    p_values = {name: tail_probabilities(part, times[name]) for name, part in usable.items()}
    threshold = false_alarms / max(1, sum(map(len, p_values.values())))
    checks = {}
    for name, part in usable.items():
        steps = np.diff(times[name])
        checks[name] = Check(
            n_readings=part.shape[1],
            interval_s=float(np.median(steps)) if len(steps) else 0.0,
            chi_square_per_reading=float(np.mean(part**2)),
            n_outliers=float(np.mean(np.sum(np.abs(part) > OUTLIER, axis=1))),
            spread=float(np.median(np.abs(part)) / special.ndtri(0.75)),
            correlations=autocorrelations(part, times[name])[0].mean(axis=0),
            p_values={key: float(np.mean(value)) for key, value in p_values[name].items()},
            threshold=threshold,
        )
    return Criticism(checks, false_alarms)


def expected_outliers(n_readings: int, spread: float = 1.0) -> float:
    """Number of normal residuals of standard deviation `spread` that count as outliers."""
    return n_readings * 2.0 * float(special.ndtr(-OUTLIER / spread)) if spread > 0 else 0.0


def tail_probabilities(residuals: np.ndarray, times: np.ndarray) -> dict[str, np.ndarray]:
    """Discrepancy -> (n_draws,) probability that standard normal residuals exceed that of residuals (n_draws, n)."""
    n = residuals.shape[1]
    sizes = np.abs(residuals)
    squares, largest = np.sum(sizes**2, axis=1), sizes.max(axis=1)
    outliers = np.sum(sizes > OUTLIER, axis=1)
    more = special.chdtrc(n, squares)
    probabilities = {
        "chi_square": 2.0 * np.minimum(more, 1.0 - more),
        "largest": special.bdtrc(0.0, n, 2.0 * special.ndtr(-largest)),
        "outliers": special.bdtrc(outliers - 1.0, n, 2.0 * special.ndtr(-OUTLIER)),
        "anderson_darling": np.minimum(1.0, np.sqrt(3.0) * special.erfc(np.sqrt(anderson_darling(residuals)))),
    }
    correlations, variances = autocorrelations(residuals, times)
    if correlations.shape[1]:
        probabilities["lag_1"] = 2.0 * special.ndtr(-np.abs(correlations[:, 0]) / np.sqrt(variances[0]))
        waves = slow_waves(times)
        slow, freedom = np.sum((residuals @ waves) ** 2, axis=1), waves.shape[1]
        rest = np.maximum(squares - slow, _TINY) / (n - freedom)
        probabilities["drift"] = special.fdtrc(freedom, n - freedom, slow / freedom / rest)
    return probabilities


def slow_waves(times: np.ndarray) -> np.ndarray:
    """(n, n_waves) orthonormal functions of the times (n,) that span the slowest cosines, at most a fifth as many."""
    phases = (times - times[0]) / (times[-1] - times[0])
    return np.linalg.qr(np.cos(np.pi * np.outer(phases, np.arange(min(N_WAVES, len(times) // _READINGS)))))[0]


def anderson_darling(residuals: np.ndarray) -> np.ndarray:
    """(n_draws,) A^2 of residuals (n_draws, n) against the standard normal distribution."""
    ordered = np.sort(residuals, axis=1)
    n = ordered.shape[1]
    weights = (2.0 * np.arange(n) + 1.0) / n
    return -n - (special.log_ndtr(ordered) + special.log_ndtr(-ordered[:, ::-1])) @ weights


def autocorrelations(residuals: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Correlations (n_draws, n_lags) about zero of residuals (n_draws, n), and their variances (n_lags,).

    Lags are in median intervals of the ascending times (n,), at most a fifth as many as readings. With n_k pairs the
    variance is n_k / (n (n + 2)), exact for independent normal residuals.
    """
    n = residuals.shape[1]
    squares = np.maximum(np.sum(residuals**2, axis=1), _TINY)
    correlations, variances = [], []
    for first, second in _pairs(times, min(N_LAGS, n // _READINGS)):
        correlations.append(np.einsum("ij,ij->i", residuals[:, first], residuals[:, second]) / squares)
        variances.append(len(first) / (n * (n + 2.0)))
    return np.reshape(correlations, (-1, len(residuals))).T, np.array(variances)


def _pairs(times, n_lags):
    """Positions of the earlier and the later readings of the pairs of each lag, up to the first lag without any."""
    interval = np.median(np.diff(times)) if len(times) > 1 else 0.0
    for lag in range(1, n_lags + 1):
        later = np.searchsorted(times, times + (lag - 0.5) * interval)
        within = np.append(times, np.inf)[later] < times + (lag + 0.5) * interval
        if not within.any():
            return
        yield np.flatnonzero(within), later[within]
