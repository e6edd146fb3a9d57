"""The null space of a problem: the directions in which the motion stays the same, whatever the sensors.

There is one way to it: the linear form of the equations of motion along the motion at given parameters
(:func:`bayesub.inference.identifiability.rank`). Spectra, profiles, reports and studies take the null directions from
here.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.identifiability.directions import null_basis
from bayesub.inference.identifiability.rank import ACCURACY, AxisRank, rank
from bayesub.inference.interface import Identifiable, PointEstimate, parameter_vector


@dataclass(frozen=True)
class NullSpace:
    """Null directions of a problem at one parameter vector.

    Attributes
    ----------
    names : (n_params,) parameters of the problem; those that are in no equation have no part in a null vector
    ranks : axis -> what is unique among its coefficients
    """

    names: tuple[str, ...]
    ranks: dict[str, AxisRank]

    @property
    def vectors(self) -> tuple[dict[str, float], ...]:
        """The null vectors of all axes: parameter -> change, largest entries first."""
        return tuple(vector for axis in self.ranks.values() for vector in axis.null_vectors)

    @property
    def pivots(self) -> tuple[str, ...]:
        """A parameter for each null vector: held fixed, they make the rest unique."""
        return tuple(name for axis in self.ranks.values() for name in axis.pivots)

    def __len__(self) -> int:
        return len(self.vectors)

    def basis(self, scale: np.ndarray) -> np.ndarray:
        """(n_null, n_params) orthonormal null directions in the coordinates ``parameters / scale`` (n_params,)."""
        return null_basis(self.names, self.vectors, np.asarray(scale, dtype=float))


def null_space(problem: Identifiable, at: PointEstimate | ArrayLike, *, accuracy: float = ACCURACY) -> NullSpace:
    """The null space of a problem.

    The coefficients of a problem are in it as far as they are free. Relations between coefficients and nuisance
    parameters are not looked for: nuisance parameters have no part in a null vector.

    Parameters
    ----------
    problem : with linear systems; without them there are no null directions
    at : Estimate or parameter vector (n_params,), of whose motion the equations are taken
    accuracy : relative accuracy of the best readings, below which a direction is weak
    """
    parameters = parameter_vector(at)
    systems = problem.linear_systems(parameters)
    return NullSpace(problem.names, rank(systems, prefer=problem.preferred_pivots, accuracy=accuracy))


def null_vectors(
    problem: Identifiable, at: PointEstimate | ArrayLike, null: Iterable[dict[str, float]] | None
) -> tuple[dict[str, float], ...]:
    """Null vectors that were handed in, or where `null` is None those of the null space of the problem."""
    return null_space(problem, at).vectors if null is None else tuple(null)
