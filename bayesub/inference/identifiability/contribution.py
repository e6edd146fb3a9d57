"""Contribution: what each coefficient alone does to the readings (thesis section 7.8.1, Figures 60 to 67)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.interface import Identifiable, PointEstimate, parameter_vector


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
