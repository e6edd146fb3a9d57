"""Which marginal posteriors hang on the prior, and which on the data? Power-scaling of prior and likelihood.

The posterior is ``prior^a likelihood`` or ``prior likelihood^a`` with a power a of one. Draws are weighted as if it
were one per cent more or less, and the sensitivity of a parameter is how fast its distribution changes with log2 a, by
the cumulative Jensen-Shannon distance (Kallioinen et al. 2024). No new posterior is needed, and the weights are so even
that they are not smoothed: their logarithms have a hundredth of the spread of log prior or log likelihood.

Of a parameter that has kept a normal prior the sensitivity is 0.075 to the prior and none to the likelihood; where data
and prior agree the two add up to that, and where they pull it apart both are larger.
"""

import numpy as np
from scipy import special

POWERS = (0.99, 1.01)
SENSITIVE = 0.05  # from which a distribution hangs on prior or likelihood (Kallioinen et al. 2024)
_NOISE = 0.32  # mean sensitivity of n normal draws to what does not concern them, times root n over its sd


def sensitivity(draws: np.ndarray, log_density: np.ndarray) -> np.ndarray:
    """How fast marginal posteriors change with the logarithm to base 2 of the power of a part of the density.

    Parameters
    ----------
    draws : (n_draws, n_params) array
        Of the posterior.
    log_density : (n_draws,) array
        That part at the draws, up to a constant: log prior or log likelihood.

    Returns
    -------
    (n_params,) array
    """
    order = np.argsort(draws, axis=0)
    widths, from_mean = np.diff(np.take_along_axis(draws, order, axis=0), axis=0), log_density - log_density.mean()
    rates = []
    for power in POWERS:
        log_weights = (power - 1.0) * from_mean
        weights = np.exp(log_weights - log_weights.max())[order]
        rates.append(_distance(widths, np.cumsum(weights / weights.sum(axis=0), axis=0)[:-1]) / np.abs(np.log2(power)))
    return np.mean(rates, axis=0)


def noise(log_density: np.ndarray, n_effective) -> np.ndarray:
    """The sensitivity that so many effective draws of a parameter show to a part that does not concern it.

    Parameters
    ----------
    log_density : (n_draws,) array
        That part at draws; it has a spread of root n/2 if n directions are normal in it.
    n_effective : float or array
        Effective draws.

    Returns
    -------
    float or array
    """
    return _NOISE * np.std(log_density) / np.sqrt(n_effective)


def _distance(widths, weighted):
    """(n_params,) cumulative Jensen-Shannon distances, the larger of those of a variable and of its negative.

    Of the distribution of draws that are `widths` (n_draws - 1, n_params) apart, and one that has the cumulative
    probabilities `weighted` (n_draws - 1, n_params) between them.
    """
    n = len(widths) + 1
    even = np.linspace(1.0 / n, 1.0 - 1.0 / n, n - 1)[:, None]
    weighted = np.minimum(weighted, 1.0)  # but for round-off
    return np.maximum(_one_sided(widths, even, weighted), _one_sided(widths, 1.0 - even, 1.0 - weighted))


def _one_sided(widths, p, q):
    """The distance by cumulative probabilities p and q: symmetrised Kullback-Leibler divergences from their mean."""
    middle = 0.5 * (p + q)
    divergence = np.sum(widths * (special.rel_entr(p, middle) + special.rel_entr(q, middle)), axis=0) / np.log(2.0)
    return np.sqrt(np.maximum(divergence, 0.0) / np.sum(widths * (p + q), axis=0))
