"""The Fisher information in prior-scaled coordinates: which directions the data sharpen, and by how much."""

from dataclasses import dataclass

import numpy as np

from bayesub.linalg import complete_svd


@dataclass(frozen=True)
class Spectrum:
    """Singular values and directions of the whitened Jacobian at one parameter vector.

    A singular value s says that along its direction the data alone have a standard deviation of 1/s prior standard
    deviations, so with s well above one the data rule and with s well below one the prior does.

    Attributes
    ----------
    names : (n_params,)
    singular_values : (n_params,) descending
    directions : (n_params, n_params), row i the unit direction of singular value i in prior standard deviations
    prior_sd : (n_params,)
    """

    names: tuple[str, ...]
    singular_values: np.ndarray
    directions: np.ndarray
    prior_sd: np.ndarray

    @property
    def n_informed(self) -> int:
        """Directions in which the data are sharper than the prior."""
        return int(np.count_nonzero(self.singular_values > 1.0))


def fisher(problem, at) -> Spectrum:
    """Spectrum of ``problem`` at an Estimate or a parameter vector (n_params,)."""
    parameters = np.asarray(getattr(at, "values", at), dtype=float)
    prior = problem.prior
    _, s, vt = complete_svd(prior.chain(problem.jacobian(parameters), prior.standard(parameters)))
    return Spectrum(problem.names, s, vt, problem.prior.sd)
