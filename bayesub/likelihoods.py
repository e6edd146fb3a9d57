"""Log likelihoods of readings given predictions."""

import numpy as np


def gaussian(residuals, sds) -> np.ndarray:
    """Log density of independent normal readings,

        log p = -1/2 sum_i r_i^2 - sum_i log sd_i - n/2 log(2 pi),   r_i = (predicted_i - reading_i) / sd_i.

    Parameters
    ----------
    residuals : (n_batch, n_readings) standardised residuals r; not a number where a simulation failed
    sds : (n_readings,) standard deviations

    Returns
    -------
    (n_batch,) log likelihoods, -inf for failed simulations.
    """
    constant = -np.log(sds).sum() - 0.5 * len(sds) * np.log(2.0 * np.pi)
    log_density = constant - 0.5 * np.einsum("ij,ij->i", residuals, residuals)
    return np.where(np.isnan(log_density), -np.inf, log_density)
