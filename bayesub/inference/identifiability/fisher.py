"""The Fisher information in prior-scaled coordinates: which directions the data determine, and how well."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.identifiability.linalg import null_basis, orthonormal, signed, split_svd
from bayesub.inference.identifiability.linear_model import marginal_jacobian
from bayesub.inference.identifiability.null_space import RANK_DRAWS, null_vectors
from bayesub.inference.interface import Identifiable, InferencePrior, PointEstimate, parameter_vector
from bayesub.io.notebook import Displayed


@dataclass(frozen=True)
class Spectrum(Displayed):
    """Singular values and directions of the whitened Jacobian at one parameter vector.

    A singular value s says that along its direction the data alone have a standard deviation of 1/s prior standard
    deviations, so with s well above one the data rule and with s well below one the prior does. Directions that are
    null by the equations stand last, after the sloppiest one that is not; their s is round-off and counts as zero.
    """

    names: tuple[str, ...]  # (n_params,)
    singular_values: np.ndarray  # (n_params,) descending, apart from those of the null directions
    # (n_params, n_params), row i the step of one standard deviation of the prior along direction i, in the prior
    # standard deviations of each parameter, its largest entry positive; the rows are orthonormal if the prior has no
    # correlations
    directions: np.ndarray
    prior_sd: np.ndarray  # (n_params,)
    n_null: int = 0  # directions, the last ones, that are null whatever the sensors
    values: np.ndarray | None = None  # (n_params,) where the Jacobian was taken, histories of forces left out

    @property
    def n_informed(self) -> int:
        """Directions that the data determine better than the prior."""
        return int(np.count_nonzero(self.signal > 1.0))

    @property
    def signal(self) -> np.ndarray:
        """(n_params,) singular values, zero in the null directions."""
        known = np.arange(len(self.names)) < len(self.names) - self.n_null
        return np.where(known, self.singular_values, 0.0)

    @property
    def coordinates(self) -> np.ndarray:
        """(n_params, n_params) matrix whose row i gives the coordinate along direction i of a step in prior sds.

        Coordinates of draws of the prior are independent with an sd of one, also if the prior correlates parameters.
        """
        return np.linalg.inv(self.directions).T

    @property
    def posterior_sd(self) -> np.ndarray:
        """(n_params,) standard deviation of data and prior together (Laplace approximation)."""
        variances = self.directions**2 / (self.signal[:, None] ** 2 + 1.0)
        return self.prior_sd * np.sqrt(variances.sum(axis=0))

    def direction(self, i: int) -> dict[str, float]:
        """Direction i in names: coefficient -> prior standard deviations, largest entries first."""
        order = np.argsort(-np.abs(self.directions[i]), kind="stable")
        return {self.names[k]: float(self.directions[i, k]) for k in order}


def fisher(
    problem: Identifiable,
    at: PointEstimate | ArrayLike,
    null: Iterable[dict[str, float]] | None = None,
    draws: np.ndarray | None = None,
) -> Spectrum:
    """Spectrum of a problem at a parameter vector, with its null directions last.

    Histories of forces are integrated out: the spectrum is that of all other parameters, and an effect on the readings
    that the forces may have had as well says little about them.

    `at` is an Estimate or a parameter vector (n_params,). The vectors `null`, dicts of parameter -> change, are as of
    :attr:`bayesub.inference.identifiability.NullSpace.vectors`; by default they are those of
    :func:`bayesub.inference.identifiability.null_space` at `at`. If there are none every direction counts as one that
    better sensors could see, and singular values that are only the error of the Jacobian are taken at their word. The
    `draws` (n, n_params) of the posterior say an unknown scale of the prior, and what is not null at all of them.
    """
    parameters = parameter_vector(at)
    prior = problem.prior if draws is None else problem.prior.found(draws)
    others, whitened = _whitened(problem, parameters, prior.sd)
    names, sd = tuple(problem.names[k] for k in others), prior.sd[others]
    basis = null_basis(names, null_vectors(problem, parameters, null, draws), sd)
    factor = correlation_factor(prior, others)
    _, s, vt = split_svd(whitened @ factor, orthonormal(np.linalg.solve(factor, basis.T).T))
    return Spectrum(names, s, signed(vt @ factor.T), sd, len(basis), parameters[others])


def conditional_sd(problem: Identifiable, draws: np.ndarray) -> np.ndarray:
    """Posterior standard deviation (n_others,) of each parameter if all the others were known, histories left out.

    It is the root of 1 / (information of the data on the parameter + precision of the prior), which is well conditioned
    where the covariance of the draws is not; its square is averaged over some draws (n, n_params) of the posterior. The
    multiple correlation R of a parameter with all others, of which this and its posterior sd are the two sides, is
    ``R^2 = 1 - (conditional sd / posterior sd)^2``, 1 / (1 - R^2) its variance inflation (Belsley, Kuh & Welsch 1980).
    """
    prior = problem.prior.found(draws)
    variances = []
    for at in draws[np.linspace(0, len(draws) - 1, RANK_DRAWS).astype(int)]:
        others, whitened = _whitened(problem, at, prior.sd)
        by_prior = np.linalg.inv(correlation_factor(prior, others))
        variances.append(1.0 / (np.sum(whitened**2, axis=0) + np.sum(by_prior**2, axis=0)))
    return prior.sd[others] * np.sqrt(np.mean(variances, axis=0))


def _whitened(problem, at, sd) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) of the parameters but white coordinates of histories, and the Jacobian in sds (n_params,)."""
    white = [history.columns for history in problem.histories]
    others = np.delete(np.arange(problem.n_params), np.concatenate(white) if white else [])
    return others, marginal_jacobian(problem, at) * sd[others]


def correlation_factor(prior: InferencePrior, members: np.ndarray) -> np.ndarray:
    """A factor L (n, n) of the correlations L L' that the prior gives parameters at positions `members`, at its middle.

    The others are independent of these. It is the unit matrix if the prior has no correlations.
    """
    n = len(prior.mean)
    factor = prior.chain(np.eye(n)[members], np.zeros(n))[:, members]
    return factor / np.linalg.norm(factor, axis=1, keepdims=True) * np.sign(np.diag(factor))[:, None]


def integrated_out(by_others: np.ndarray, by_white: np.ndarray) -> np.ndarray:
    """Jacobian of the same information on some parameters if others, standard normal, are integrated out.

    With A (n_rows, n_others) and B (n_rows, n_white) the derivatives by both, the information is
    ``A'A - A'B (B'B + 1)^-1 B'A``, and the Jacobian (n_rows + n_white, n_others).
    """
    n_white = by_white.shape[1]
    basis = np.linalg.qr(np.vstack([by_white, np.eye(n_white)]))[0]
    stacked = np.vstack([by_others, np.zeros((n_white, by_others.shape[1]))])
    return stacked - basis @ (basis.T @ stacked)
