"""The null space of a problem: the directions in which the motion stays the same, whatever the sensors.

There is one way to it: the linear form of the equations of motion along the motion at given parameters
(:func:`bayesub.inference.identifiability.rank`). All that need null directions take them from here.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.identifiability.linalg import null_basis
from bayesub.inference.identifiability.rank import ACCURACY, AxisRank, rank
from bayesub.inference.interface import Identifiable, InferencePrior, PointEstimate, parameter_vector

RANK_DRAWS = 12  # of the posterior, at which a rank is taken beside that of one point
_LINES, _REACH, _POINTS = 250, np.arcsinh(50.0), 161  # draws, and places on the line through each, in prior sds


@dataclass(frozen=True)
class NullSpace:
    """Null directions of a problem at one parameter vector."""

    names: tuple[str, ...]  # (n_params,) of the problem; those that are in no equation have no part in a null vector
    ranks: dict[str, AxisRank]  # axis -> what is unique among its coefficients

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


def null_space(
    problem: Identifiable, at: PointEstimate | ArrayLike, *, accuracy: float = ACCURACY, draws: np.ndarray | None = None
) -> NullSpace:
    """The null space of a problem.

    The coefficients of a problem are in it as far as they are free. Relations between coefficients and nuisance
    parameters are not looked for: nuisance parameters have no part in a null vector. The equations are taken of the
    motion of `at`, an Estimate or a parameter vector (n_params,); a problem without linear systems has no null
    directions. A direction is weak below `accuracy`, the relative accuracy of the best readings. `draws` (n, n_params)
    are of the posterior: what is round-off at `at`, and not at all of some of these, is not null.
    """
    some = () if draws is None else draws[np.linspace(0, len(draws) - 1, RANK_DRAWS).astype(int)]
    systems, *others = (problem.linear_systems(one) for one in (parameter_vector(at), *some))
    return NullSpace(problem.names, rank(systems, problem.preferred_pivots, accuracy, others))


def null_vectors(
    problem: Identifiable,
    at: PointEstimate | ArrayLike,
    null: Iterable[dict[str, float]] | None,
    draws: np.ndarray | None = None,
) -> tuple[dict[str, float], ...]:
    """Null vectors that were handed in, or where `null` is None those of the null space of the problem."""
    return null_space(problem, at, draws=draws).vectors if null is None else tuple(null)


def kept(prior: InferencePrior, draws: np.ndarray, steps: np.ndarray, coordinates: np.ndarray) -> np.ndarray:
    """The sd (n_null,) that the prior alone gives null directions beside what the data say of all else.

    Where the data do not distinguish the points of a line, the posterior on it is the prior on it. With means and
    variances of the prior on the lines through draws, by the law of total variance, draws of a right posterior have
    this sd, whatever the prior: of a normal one that is its own, of a uniform one it is wider in the middle of the box
    and narrower in a corner. `draws` (n_draws, n_params) are of the posterior; `steps` (n_null, n_params) are along
    each null direction, in parameters; with `coordinates` (n_null, n_params) ``parameters @ coordinates.T`` counts
    steps along each.
    """
    some = draws[np.linspace(0, len(draws) - 1, min(_LINES, len(draws))).astype(int)]
    s = np.linspace(-_REACH, _REACH, _POINTS)
    t = np.sinh(s)  # close to each other at a draw, and far enough for the tail of a log-normal
    sds = []
    for step, coordinate in zip(steps, coordinates, strict=True):
        logs = np.array([prior.log_density(one + t[:, None] * step) for one in some])
        weights = np.cosh(s) * np.exp(logs - logs.max(axis=1, keepdims=True))
        weights /= weights.sum(axis=1, keepdims=True)
        shift = weights @ t
        sds.append(np.sqrt(np.mean(weights @ t**2 - shift**2) + (some @ coordinate + shift).var()))
    return np.array(sds)
