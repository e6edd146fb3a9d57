"""Where prior and data disagree.

In the standard coordinates t of a normal prior, and for readings that are linear in them, the posterior mean m varies
from data set to data set, drawn as the prior expects, with the covariance ``1 - V``, where V is that of the posterior.
So every contracted direction w of the posterior has a standard normal

    z = w.m / sqrt(w.(1 - V) w),

and their squares together are chi-square (the prior-predictive check of Evans and Moshonov 2006, in closed form). For
a single coefficient the same z compares its prior with what everything but this prior says of it (the conflict measure
of Marshall and Spiegelhalter 2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

FALSE_ALARMS = 0.01  # probability that anything is said where the prior is right: half for the sum, half for the names
CONTRACTED = 0.8  # posterior sd over prior sd below which the data have a say


@dataclass(frozen=True)
class Conflict:
    """What is found.

    Attributes
    ----------
    named : parameter -> z, largest first, of those that no prior would be off by in one of a hundred studies
    probability : of directions further off than these, all together, if the prior is right
    n_directions : that the data have contracted
    """

    named: dict[str, float]
    probability: float
    n_directions: int

    @property
    def found(self) -> bool:
        """Whether prior and data disagree."""
        return bool(self.named) or self.probability < 0.5 * FALSE_ALARMS


def find_conflict(prior, draws: np.ndarray, names: Sequence[str]) -> Conflict:
    """Compare a prior with draws (n_draws, n_params) of its posterior.

    Parameters
    ----------
    prior : of the parameters (:class:`bayesub.inference.interface.InferencePrior`)
    draws : (n_draws, n_params)
    names : of the n_params parameters
    """
    t = prior.standard(draws)
    mean, covariance = t.mean(axis=0), np.atleast_2d(np.cov(t.T))
    variances, directions = np.linalg.eigh(covariance)
    seen = variances < CONTRACTED**2
    square = np.sum((mean @ directions[:, seen]) ** 2 / (1.0 - variances[seen]))
    probability = float(stats.chi2.sf(square, np.count_nonzero(seen))) if seen.any() else 1.0
    # Of priors that correlate parameters, each in its own standard deviation.
    own = prior.chain(np.eye(len(mean)), np.zeros(len(mean)))
    own = own / np.linalg.norm(own, axis=1, keepdims=True) * np.sign(np.diag(own))[:, None]
    left = np.einsum("ij,jk,ik->i", own, covariance, own)
    known = np.flatnonzero(left < CONTRACTED**2)
    z = (own @ mean)[known] / np.sqrt(1.0 - left[known])
    limit = stats.norm.isf(0.25 * FALSE_ALARMS / max(len(known), 1))
    order = [k for k in np.argsort(-np.abs(z)) if abs(z[k]) > limit]
    return Conflict({names[known[k]]: float(z[k]) for k in order}, probability, int(np.count_nonzero(seen)))
