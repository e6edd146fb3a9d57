"""Draws of the posterior of all trials, weighted as such of all but one."""

import warnings

import numpy as np

from bayesub.problem.joint import JointProblem

TRUSTED = 0.7  # shape of the tail of importance weights up to which they are (Vehtari et al. 2017)


def reweighted(joint: JointProblem, draws: np.ndarray, trial: str) -> tuple[np.ndarray, float]:
    """Weights that make draws of a posterior such of all other trials, smoothed (PSIS), and whether to trust them.

    Parameters
    ----------
    joint : JointProblem
        Of all trials.
    draws : (n, n_params) array
        Of its posterior.
    trial : str
        The one to leave out.

    Returns
    -------
    weights : (n,) array
        That sum to one.
    k_hat : float
        Shape of the tail of the raw weights; above :data:`TRUSTED` they are of no use, and the others need a posterior
        of their own (Vehtari et al. 2017).
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # ArviZ announces its successor once a day
        import arviz as az
    log_likelihood = sum(part for name, part in joint.log_likelihoods(draws).items() if name.endswith(f"[{trial}]"))
    if az.__version__.startswith("0."):
        smoothed, k_hat = az.psislw(-log_likelihood)
    else:  # which changes the sign itself
        from arviz_stats.base import array_stats

        smoothed, k_hat = array_stats.psislw(log_likelihood)
    weights = np.exp(np.asarray(smoothed) - np.max(smoothed))
    return weights / weights.sum(), float(k_hat)
