"""Which terms do data need? The order in which terms can be set to zero, each with the odds against it.

Everything is about a normal approximation in coordinates t in which the prior is standard normal: residuals r with the
Jacobian J at the mode. The odds are Savage-Dickey ratios: the density of the posterior at the value of t where the term
is zero over that of the prior, which is the evidence of the model without the term over that of the model with it
(Dickey 1971). Terms that are gone stay gone, so that the ratios multiply.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import linalg, stats

from bayesub.inference.identifiability.linalg import triangle

BEYOND = 0.005  # share of the draws, below which a kernel density says little


@dataclass(frozen=True)
class Removal:
    """A term set to zero.

    Attributes
    ----------
    position : int
        Of the term among all.
    log_ratio : float
        Evidence without the term over evidence with it, natural logarithm, those before it being gone.
    t : (n_params,) array
        Mode without it; where a term is gone, its zero.
    """

    position: int
    log_ratio: float
    t: np.ndarray


class Approximation:
    """A normal posterior in t by rows: ``|A t - y|^2`` is minus twice its logarithm, but for a constant.

    Parameters
    ----------
    jacobian : (n_rows, n_params) array
        Of the residuals by t.
    residuals : (n_rows,) array
    at : (n_params,) array
        Where both were taken.
    """

    def __init__(self, jacobian: np.ndarray, residuals: np.ndarray, at: np.ndarray):
        n = len(at)
        rows = np.vstack([jacobian, np.eye(n)])
        target = np.concatenate([jacobian @ at - residuals, np.zeros(n)])
        self._rows = triangle(np.column_stack([rows, target]))

    def ratios(self, zeros: np.ndarray) -> np.ndarray:
        """(n_params,) log Savage-Dickey ratios of each term by itself, the others free; `zeros` (n_params,) in t."""
        mean, inverse = self._solved(self._rows)
        return log_ratio(zeros, mean, np.linalg.norm(inverse, axis=1))

    def ratios_alone(self, zeros: np.ndarray) -> np.ndarray:
        """As :meth:`ratios`, of each term if all others were held at the mode: what the data see of it at all."""
        mean, _ = self._solved(self._rows)
        return log_ratio(zeros, mean, 1.0 / np.linalg.norm(self._rows[:, :-1], axis=0))

    def removals(self, zeros: np.ndarray) -> Iterator[Removal]:
        """Terms one after another, that which is missed least first."""
        rows, left, t = self._rows, list(range(len(zeros))), np.array(zeros, dtype=float)
        while left:
            mean, inverse = self._solved(rows)
            ratios = log_ratio(zeros[left], mean, np.linalg.norm(inverse, axis=1))
            k = int(np.argmax(ratios))
            gone = left.pop(k)
            rows = np.delete(rows, k, axis=1), rows[:, -1] - rows[:, k] * zeros[gone]
            rows = triangle(np.column_stack([rows[0][:, :-1], rows[1]]))
            if left:
                t[left] = self._solved(rows)[0]
            t[gone] = zeros[gone]
            yield Removal(gone, float(ratios[k]), t.copy())

    @staticmethod
    def _solved(rows):
        """Mean (n,) and inverse (n, n) of the triangle of A."""
        n = rows.shape[1] - 1
        inverse = linalg.solve_triangular(rows[:n, :n], np.eye(n))
        return inverse @ rows[:n, n], inverse


def log_ratio(zero, mean, sd) -> np.ndarray:
    """Log Savage-Dickey ratio at `zero` of a normal posterior (mean, sd) and a standard normal prior."""
    return stats.norm.logpdf(zero, mean, sd) - stats.norm.logpdf(zero)


def log_ratio_of_draws(zero: float, t: np.ndarray) -> float:
    """The same of draws t (n,), by a kernel density estimate; not a number where few of them are beyond `zero`."""
    if min(np.mean(t < zero), np.mean(t > zero)) < BEYOND:
        return float("nan")
    return float(stats.gaussian_kde(t).logpdf(zero)[0] - stats.norm.logpdf(zero))
