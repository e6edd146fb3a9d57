"""The null space of a problem: the directions in which the motion stays the same, whatever the sensors.

There is one way to it: the linear form of the equations of motion along the motion at given parameters
(:func:`bayesub.inference.identifiability.rank`). Spectra, profiles, reports and studies take the null directions from
here. Jacobians of several manoeuvres show the same: a direction that none sees belongs to the equations (structural);
one that some manoeuvre sees, however faintly, is a matter of accuracy (practical) and of the manoeuvre.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesub.inference.identifiability.linalg import complete_svd, null_basis
from bayesub.inference.identifiability.rank import ACCURACY, AxisRank, rank
from bayesub.inference.interface import (
    Identifiable,
    InferencePrior,
    PointEstimate,
    parameter_vector,
)

RANK_DRAWS = 12  # of the posterior, at which a rank is taken beside that of one point
_LINES, _REACH, _POINTS = 250, np.arcsinh(50.0), 161  # draws, and places on the line through each, in prior sds


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


def null_space(
    problem: Identifiable, at: PointEstimate | ArrayLike, *, accuracy: float = ACCURACY, draws: np.ndarray | None = None
) -> NullSpace:
    """The null space of a problem.

    The coefficients of a problem are in it as far as they are free. Relations between coefficients and nuisance
    parameters are not looked for: nuisance parameters have no part in a null vector.

    Parameters
    ----------
    problem : with linear systems; without them there are no null directions
    at : Estimate or parameter vector (n_params,), of whose motion the equations are taken
    accuracy : relative accuracy of the best readings, below which a direction is weak
    draws : (n, n_params) of the posterior; what is round-off at `at`, and not at all of some of these, is not null
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

    Where the data do not tell the points of a line, the posterior on it is the prior on it. With means and variances
    of the prior on the lines through draws, by the law of total variance, draws of a right posterior have this sd,
    whatever the prior: of a normal one that is its own, of a uniform one it is wider in the middle of the box
    and narrower in a corner.

    Parameters
    ----------
    draws : (n_draws, n_params) of the posterior
    steps : (n_null, n_params) along each null direction, in parameters
    coordinates : (n_null, n_params) such that ``parameters @ coordinates.T`` counts steps along each
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


@dataclass(frozen=True)
class Structure:
    """What several Jacobians of the same parameters cannot see together.

    Attributes
    ----------
    singular_values : (n_params,) of all Jacobians together, columns scaled to unit length, descending
    threshold : singular values below it are round-off
    structural : (n_structural, n_params) unit vectors, in the coordinates of the columns, that stay at round-off in
        every Jacobian
    practical : (n_practical, n_params) unit vectors above round-off but below the accuracy of readings, faintest first
    alone : one count a Jacobian, the directions at round-off there; what exceeds n_structural is its own blindness
    spectra : (n_jacobians, n_params) singular values of each Jacobian by itself over the largest
    """

    singular_values: np.ndarray
    threshold: float
    structural: np.ndarray
    practical: np.ndarray
    alone: tuple[int, ...]
    spectra: np.ndarray

    @property
    def n_structural(self) -> int:
        """Number of directions that no Jacobian sees."""
        return len(self.structural)

    @property
    def n_practical(self) -> int:
        """Number of directions that are seen, but below the accuracy of readings."""
        return len(self.practical)

    @property
    def gap(self) -> float | None:
        """Smallest singular value above round-off over the largest below it; None without structural directions."""
        if self.n_structural == 0:
            return None
        first = len(self.singular_values) - self.n_structural
        return float(self.singular_values[first - 1] / max(self.singular_values[first], np.finfo(float).tiny))


def structure(jacobians: Iterable[np.ndarray], *, noise: float | None = None, accuracy: float = ACCURACY) -> Structure:
    """Directions that stay at round-off in all of several Jacobians, and those that are merely faint.

    The Jacobians are divided by their norms and stacked. What a vector gives in the stack is the root of the sum of
    squares of what it gives in each, so that the null space of the stack holds exactly the directions that are null in
    every one: the same directions, where equal counts could belong to different ones.

    Parameters
    ----------
    jacobians : sequence of (n_readings, n_params), readings differing; columns of comparable size, such as derivatives
        in prior standard deviations. The null directions of a submarine change with its coefficients (a multiple of
        what the coefficients are short of the rigid body's own terms), so these are manoeuvres of one coefficient set
    noise : error of a Jacobian over its largest singular value. By default ten machine epsilons a reading, for exact
        derivatives: the hundred or so roundings of a step add up as a random walk, the steps add up in line, and there
        are about as many readings as steps. Differences need more: theirs is the round-off of the track over the step
    accuracy : relative accuracy of the best readings, below which a direction is practical

    Raises
    ------
    ValueError : for Jacobians that differ in their number of columns, or that are not finite
    """
    jacobians = [np.asarray(jacobian, dtype=float) for jacobian in jacobians]
    if len({jacobian.shape[1] for jacobian in jacobians}) != 1:
        raise ValueError("structure needs at least one Jacobian, and all of them of the same parameters")
    if noise is None:
        noise = 10 * np.finfo(float).eps * max(len(jacobian) for jacobian in jacobians)
    parts = [jacobian / np.linalg.norm(jacobian) for jacobian in jacobians]
    lengths = np.linalg.norm(np.vstack(parts), axis=0)
    lengths[lengths == 0.0] = 1.0
    parts = [np.linalg.qr(part / lengths, mode="r") for part in parts]  # the same singular values and directions

    _, s, vt = complete_svd(np.vstack(parts))
    # Each Jacobian brings its own error; together they are a root of their number larger.
    threshold = float(noise * np.sqrt(len(parts)) * s[0])
    spectra = np.array([complete_svd(part)[1] for part in parts])
    spectra /= spectra[:, :1]
    null, faint = s <= threshold, (s > threshold) & (s <= accuracy * s[0])
    return Structure(
        singular_values=s,
        threshold=threshold,
        structural=_units(vt[null] / lengths),
        practical=_units(vt[faint][::-1] / lengths),
        alone=tuple(int(n) for n in np.count_nonzero(spectra <= noise, axis=1)),
        spectra=spectra,
    )


def _units(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
