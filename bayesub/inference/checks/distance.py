"""How far two posteriors are apart, in one parameter and in several together."""

import numpy as np
from scipy import linalg, stats


def pooled_sd(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(..) root of the mean variance of draws (n, ..) and (m, ..)."""
    return np.sqrt(0.5 * (first.var(axis=0, ddof=1) + second.var(axis=0, ddof=1)))


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
    covariances = [np.atleast_2d(np.cov((draws / scale).T)) for draws in (first, second)]
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
