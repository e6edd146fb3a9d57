"""Standard deviations of coefficients that a spectrum foretells: from the data alone, and with sharper sensors."""

from dataclasses import replace

import numpy as np
from scipy import optimize

from bayesub.inference.identifiability import Spectrum


def null_part(spectrum: Spectrum) -> np.ndarray:
    """(n_params,) length of the part of each coefficient that lies in the null space, from 0 to 1."""
    return np.linalg.norm(spectrum.directions[_n_known(spectrum) :], axis=0)


def alone_sd(spectrum: Spectrum) -> np.ndarray:
    """(n_params,) standard deviation of each coefficient from the data if all the others were known."""
    with np.errstate(divide="ignore"):
        return spectrum.prior_sd / np.linalg.norm(spectrum.signal[:, None] * spectrum.coordinates, axis=0)


def held_sd(spectrum: Spectrum) -> np.ndarray:
    """(n_params,) Cramer-Rao bound of the data alone with the null directions held where they are.

    That is the root of the diagonal of the pseudo-inverse of the Fisher information. It is a bound on the coefficient
    itself only where :func:`null_part` is zero.
    """
    known = slice(_n_known(spectrum))
    squares = spectrum.directions[known] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):  # 0/0 is nothing, 1/0 is infinite
        variances = np.where(squares > 0.0, squares / spectrum.signal[known, None] ** 2, 0.0).sum(axis=0)
    return spectrum.prior_sd * np.sqrt(variances)


def cramer_rao_sd(spectrum: Spectrum) -> np.ndarray:
    """(n_params,) Cramer-Rao bound of the data alone; infinite for every coefficient with a part in the null space.

    No unbiased estimate has a smaller standard deviation.
    """
    return np.where(null_part(spectrum) > 0.0, np.inf, held_sd(spectrum))


def sharper_sensors(spectrum: Spectrum, relative_sd: float) -> np.ndarray:
    """How many times smaller all noise would have to be for each coefficient to be known to `relative_sd`.

    The factor f solves ``posterior sd(noise / f) = relative_sd * |value|``, prior included. It is below one where
    today's sensors do better than asked, zero where the prior alone does, and infinite where the part in the null
    space keeps the prior's uncertainty however good the sensors.

    Returns
    -------
    (n_params,)
    """
    sds = relative_sd * np.abs(spectrum.values)
    wanted = (sds / spectrum.prior_sd) ** 2
    never = (spectrum.directions[spectrum.signal == 0.0] ** 2).sum(axis=0)
    factors, signal = np.where(wanted < 1.0, np.inf, 0.0), spectrum.signal[spectrum.signal > 0.0]

    def excess(log_factor, k):
        sharper = replace(spectrum, singular_values=np.exp(log_factor) * spectrum.singular_values)
        return 2.0 * np.log(sharper.posterior_sd[k] / sds[k])

    for k in np.flatnonzero((wanted < 1.0) & (never < wanted)):
        # Too small and too large: all directions as sharp as the stiffest, or the sloppiest.
        low = np.log(np.sqrt(1.0 / wanted[k] - 1.0) / signal.max()) - 1e-9
        high = np.log(np.sqrt(1.0 / (wanted[k] - never[k])) / signal.min()) + 1e-9
        factors[k] = np.exp(optimize.brentq(excess, low, high, (k,)))
    return factors


def _n_known(spectrum: Spectrum) -> int:
    """Directions, the first ones, that are not null."""
    return len(spectrum.names) - spectrum.n_null
