"""How far a posterior is from a normal one, and two posteriors from each other.

A mean and a covariance are all of a posterior that a normal prior of the next trial takes up. What they leave out is
seen in draws: by the skewness of each parameter and by the distance of its quantiles from those of a normal with the
same mean and standard deviation. That of principal directions of the covariance sees what bends between normal ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, special, stats

_ROUND_OFF = 1e-12
PROBABILITIES = np.array([0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95])
CLOSE = 0.25  # standard deviations between quantiles that are those of a normal distribution for most purposes


@dataclass(frozen=True)
class Normality:
    """Distances of draws from a normal distribution."""

    names: tuple[str, ...]  # (n_params,)
    skewness: np.ndarray  # (n_params,) of each parameter
    distance: np.ndarray  # (n_params,) largest difference of its 5 to 95 % quantiles from those of a normal, in its sd
    skewness_along: np.ndarray  # (n_params,) the same along the principal directions, in prior sds, from the stiffest
    distance_along: np.ndarray  # (n_params,)
    noise: float  # standard error of a quantile at 5 or 95 % by the number of effective draws, in sds

    @property
    def close(self) -> bool:
        """Whether all quantiles are within :data:`CLOSE` of those of a normal."""
        return bool(max(self.distance.max(), self.distance_along.max()) < CLOSE)

    @property
    def sentence(self) -> str:
        """The finding in words."""
        k, i = int(np.argmax(self.distance)), int(np.argmax(np.abs(self.skewness)))
        along = f"{self.distance_along.max():.2g} along its principal directions"
        distances = (
            f"quantiles from 5 to 95 % are at most {self.distance[k]:.2g} standard deviations from those of a normal "
            f"({self.names[k]}; {along}; noise of the draws {self.noise:.1g}), and the largest skewness is "
            f"{self.skewness[i]:+.2g} ({self.names[i]})"
        )
        if self.close:
            return f"The posterior is close to normal: {distances}."
        far = [self.names[k] for k in np.argsort(-self.distance) if self.distance[k] >= CLOSE]
        if not far:
            return f"Each coefficient is close to normal, but together they are not (it is curved): {distances}."
        return f"The posterior is not normal in {', '.join(far[:5])}{' ..' if len(far) > 5 else ''}: {distances}."

    def to_json(self) -> dict:
        """The numbers as JSON types."""
        rows = zip(self.names, self.skewness.tolist(), self.distance.tolist(), strict=True)
        return {
            "close": self.close,
            "sentence": self.sentence,
            "parameters": [{"name": name, "skewness": s, "quantile_distance": d} for name, s, d in rows],
            "directions": {"skewness": self.skewness_along.tolist(), "quantile_distance": self.distance_along.tolist()},
            "noise": self.noise,
        }


def posterior_normality(posterior: Any) -> Normality:
    """How normal a posterior is, its draws counted by the parameter that has the fewest effective ones."""
    ess = min(posterior.bulk_ess.min(), posterior.tail_ess.min())
    return normality(posterior.names, posterior.draws, posterior.prior_sd, float(ess))


def normality(names: Sequence[str], draws: np.ndarray, scale: np.ndarray, ess: float) -> Normality:
    """Compare draws (n_draws, n_params) with normal distributions of the same mean and covariance.

    Principal directions are in units of `scale` (n_params,), prior standard deviations; `ess` is the effective number.
    """
    scaled = (draws - draws.mean(axis=0)) / scale
    _, directions = np.linalg.eigh(np.atleast_2d(np.cov(scaled.T)))
    noise = np.sqrt(0.05 * 0.95 / ess) / (np.exp(-0.5 * special.ndtri(0.05) ** 2) / np.sqrt(2.0 * np.pi))
    return Normality(tuple(names), *_distances(scaled), *_distances(scaled @ directions), float(noise))


def _distances(values) -> tuple[np.ndarray, np.ndarray]:
    """Skewness (n_params,) and quantile distance (n_params,) of values (n_draws, n_params)."""
    sd = values.std(axis=0)
    standard = (values - values.mean(axis=0)) / np.where(sd > 0.0, sd, 1.0)
    quantiles = np.quantile(standard, PROBABILITIES, axis=0)
    return np.mean(standard**3, axis=0), np.abs(quantiles - special.ndtri(PROBABILITIES)[:, None]).max(axis=0)


def pooled_sd(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(..) root of the mean variance of draws (n, ..) and (m, ..); one where neither moves."""
    sd = np.sqrt(0.5 * (first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)))
    return np.where(sd > 0.0, sd, 1.0)


def wasserstein(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(n_params,) Wasserstein distances of draws (n, n_params) and (m, n_params), in pooled sds.

    It is how far, on average, one distribution must be moved to become the other: of two that differ by a shift it is
    the shift, of normal ones with equal means it is sqrt(2 / pi) times the difference of their sds.
    """
    pairs = zip(first.T, second.T, strict=True)
    distances = np.array([stats.wasserstein_distance(one, other) for one, other in pairs])
    return distances / pooled_sd(first, second)


def hellinger(first: np.ndarray, second: np.ndarray) -> float:
    """Hellinger distance of the normal approximations of draws (n, n_params) and (m, n_params): 0 the same, 1 apart.

    With means m and covariances C its square is

        1 - det(C1)^(1/4) det(C2)^(1/4) det(C)^(-1/2) exp(-(m1 - m2)' C^-1 (m1 - m2) / 8),   C = (C1 + C2) / 2.
    """
    scale = pooled_sd(first, second)
    # Widened by round-off, so that what draws never leave is a direction like others.
    n = first.shape[1]
    covariances = [np.cov((draws / scale).T).reshape(n, n) + _ROUND_OFF * np.eye(n) for draws in (first, second)]
    middle = 0.5 * sum(covariances)
    off = (first.mean(axis=0) - second.mean(axis=0)) / scale
    logs = [np.linalg.slogdet(covariance)[1] for covariance in (*covariances, middle)]
    exponent = 0.25 * (logs[0] + logs[1]) - 0.5 * logs[2] - 0.125 * off @ linalg.solve(middle, off, assume_a="pos")
    return float(np.sqrt(max(0.0, -np.expm1(exponent))))


def halves(chain: np.ndarray) -> float:
    """Hellinger distance of the draws of half of the ensembles of a chain (n_ensembles, .., n_params) to the others.

    Two runs of one problem are as far apart by chance; it is not a number of a single ensemble.
    """
    n = len(chain) // 2
    if not n:
        return float("nan")
    return hellinger(*(part.reshape(-1, chain.shape[-1]) for part in (chain[:n], chain[n:])))
