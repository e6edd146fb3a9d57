"""What single coefficients do: to the readings, each alone, and to the force along an axis, all together.

Contribution is the change of the readings (thesis section 7.8.1, Figures 60 to 67). Error cancellation is large force
errors of single terms that add up to a small one (thesis section 7.8.2).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.interface import Identifiable, LinearForm, PointEstimate, parameter_vector


@dataclass(frozen=True)
class Contribution:
    """Cost of changing one coefficient at a time.

    Attributes
    ----------
    names : (n_params,)
    fractions : (n_fractions,) of its value that a coefficient is moved to
    costs : (n_fractions, n_params) sum over the readings of the squared change in noise standard deviations; infinite
        where the simulation fails
    """

    names: tuple[str, ...]
    fractions: tuple[float, ...]
    costs: np.ndarray


def contribution(
    problem: Identifiable, at: PointEstimate | ArrayLike, fractions: Sequence[float] = (0.25, 0.99)
) -> Contribution:
    """Move each coefficient to fractions of its value, the others staying, in one batch of simulations.

    With position noise of 1 m and attitude noise of 1 degree the cost is that of the thesis in m^2 + deg^2 (model
    manual, section 10). The noise of the record drops out.

    Parameters
    ----------
    problem : whose readings change
    at : Estimate or parameter vector (n_params,) to move away from
    fractions : of the value of a coefficient that it is moved to
    """
    parameters = parameter_vector(at)
    moved = parameters * (1.0 - (1.0 - np.array(fractions))[:, None, None] * np.eye(problem.n_params))
    changes = problem.residuals(moved.reshape(-1, problem.n_params)) - problem.residuals(parameters[None])
    costs = np.einsum("ij,ij->i", changes, changes)
    costs = np.where(np.isfinite(costs), costs, np.inf).reshape(len(fractions), -1)
    return Contribution(problem.names, tuple(fractions), costs)


@dataclass(frozen=True)
class Cancellation:
    """What wrong coefficients do to the force along one axis, on the true motion.

    Attributes
    ----------
    axis : such as "X"
    names : (n_terms,) coefficients
    errors : (n_samples, n_terms) force error of each term, N (moments: N m)
    """

    axis: str
    names: tuple[str, ...]
    errors: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """(n_samples,) error of the whole force, the sum over the terms."""
        return self.errors.sum(axis=1)

    @property
    def largest(self) -> dict[str, float]:
        """Coefficient -> largest size of its error over the manoeuvre, largest first (thesis Table 28)."""
        sizes = np.abs(self.errors).max(axis=0)
        return {self.names[k]: float(sizes[k]) for k in np.argsort(-sizes, kind="stable")}

    @property
    def ratio(self) -> float:
        """Largest error of a term over the largest error of the sum."""
        return float(np.abs(self.errors).max() / np.abs(self.total).max())


def cancellation(system: LinearForm, changes: dict[str, float]) -> Cancellation:
    """Force errors on one axis of the linear form.

    Parameters
    ----------
    system : with axis, names (n_terms,) and matrix (n_samples, n_terms) of dimensional regressors on the true motion
    changes : coefficient -> wrong minus true value; a term of the axis that is not named is right
    """
    return Cancellation(system.axis, system.names, system.matrix * [changes.get(name, 0.0) for name in system.names])
