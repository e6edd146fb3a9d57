"""Prior and data: where they disagree, and which marginal posteriors depend on which of them.

*Conflict.* In the standard coordinates t of a normal prior, and for readings that are linear in them, the posterior
mean m varies from data set to data set, drawn as the prior expects, with the covariance ``1 - V``, where V is that of
the posterior. So every contracted direction w of the posterior has a standard normal

    z = w.m / sqrt(w.(1 - V) w),

and their squares together are chi-square (the prior-predictive check of Evans and Moshonov 2006, in closed form). For
one coefficient the same z compares its prior with what all else says of it (Marshall and Spiegelhalter 2007).

*Sensitivity.* The posterior is ``prior^a likelihood`` or ``prior likelihood^a`` with a power a of one. Draws are
weighted as if it were one per cent more or less, and the sensitivity of a parameter is how fast its distribution
changes with log2 a, by the cumulative Jensen-Shannon distance (Kallioinen et al. 2024). No new posterior is needed, and
the weights are so even that they are not smoothed: their logarithms have a hundredth of the spread of log prior or log
likelihood. Of a parameter that has kept a normal prior the sensitivity is 0.075 to the prior and none to the
likelihood; where data and prior agree the two add up to that, and where they pull it apart both are larger.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from bayesub.inference.interface import InferencePrior

# Probabilities that anything is said, and that the prior is called refuted, where it is right
FALSE_ALARMS, REFUTED = 0.01, 1e-4
CONTRACTED = 0.8  # posterior sd over prior sd below which the data have a say
POWERS = (0.99, 1.01)
SENSITIVE = 0.05  # from which a distribution depends on prior or likelihood (Kallioinen et al. 2024)
_NOISE = 0.32  # mean sensitivity of n normal draws to what does not concern them, times root n over its sd


@dataclass(frozen=True)
class Conflict:
    """The conflict between prior and data."""

    # parameter -> z, largest first, of those that no prior would be off by in one of a hundred studies
    named: dict[str, float]
    probability: float  # of directions further off than these, all together, if the prior is right
    n_directions: int  # that the data have contracted
    # Of the whole: half for the names (Bonferroni), half for the sum. At most as often small as it says, if it is right
    p_value: float

    @property
    def disagree(self) -> bool:
        """Whether prior and data disagree."""
        return self.p_value < FALSE_ALARMS

    @property
    def refuted(self) -> bool:
        """Whether they disagree so far that the posterior is not to be used before the prior has been looked at."""
        return self.p_value < REFUTED


def find_conflict(prior: InferencePrior, draws: np.ndarray, names: Sequence[str]) -> Conflict:
    """Compare a prior with draws (n_draws, n_params) of its posterior, of parameters of these names."""
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
    of_each = 2.0 * max(len(known), 1) * stats.norm.sf(np.abs(z))
    order = [k for k in np.argsort(of_each) if of_each[k] < 0.5 * FALSE_ALARMS]
    p_value = min(1.0, 2.0 * float(min([probability, *of_each])))
    named = {names[known[k]]: float(z[k]) for k in order}
    return Conflict(named, probability, int(np.count_nonzero(seen)), p_value)


def sensitivity(draws: np.ndarray, log_density: np.ndarray) -> np.ndarray:
    """How fast marginal posteriors (n_params,) change with log2 of the power of a part of the density.

    Of draws (n_draws, n_params) of the posterior, and the part `log_density` (n_draws,) there, up to a constant: log
    prior or log likelihood.
    """
    order, n = np.argsort(draws, axis=0), len(draws)
    widths, from_mean = np.diff(np.take_along_axis(draws, order, axis=0), axis=0), log_density - log_density.mean()
    # Cumulative probabilities between neighbouring draws, even ones and weighted ones.
    even, rates = np.linspace(1.0 / n, 1.0 - 1.0 / n, n - 1)[:, None], []
    for power in POWERS:
        log_weights = (power - 1.0) * from_mean
        weights = np.exp(log_weights - log_weights.max())[order]
        weighted = np.minimum(np.cumsum(weights / weights.sum(axis=0), axis=0)[:-1], 1.0)  # but for round-off
        # The larger one of the distances of a variable and of its negative.
        sides = _distance(widths, even, weighted), _distance(widths, 1.0 - even, 1.0 - weighted)
        rates.append(np.maximum(*sides) / np.abs(np.log2(power)))
    return np.mean(rates, axis=0)


def sensitivity_noise(log_density: np.ndarray, n_effective: float | np.ndarray) -> np.ndarray:
    """The sensitivity that so many effective draws of a parameter show to a part (n_draws,) that does not concern it.

    The part has a spread of root n/2 if n directions are normal in it.
    """
    return _NOISE * np.std(log_density) / np.sqrt(n_effective)


def _distance(widths, p, q):
    """(n_params,) cumulative Jensen-Shannon distances by cumulative probabilities p and q (n_draws - 1, n_params).

    They are symmetrised Kullback-Leibler divergences from their mean; draws are `widths` (n_draws - 1, n_params) apart.
    """
    middle = 0.5 * (p + q)
    divergence = np.sum(widths * (special.rel_entr(p, middle) + special.rel_entr(q, middle)), axis=0) / np.log(2.0)
    spread = np.sum(widths * (p + q), axis=0)  # none of what never moves
    return np.sqrt(np.maximum(divergence, 0.0) / np.where(spread > 0.0, spread, 1.0))
