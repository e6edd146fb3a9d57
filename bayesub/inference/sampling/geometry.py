"""Coordinates in which an ill-conditioned, bent posterior looks like a standard normal.

The coordinates x, z and y stand in the table of :mod:`bayesub.inference.sampling`.

*Whitening.* In the scaled coordinates x, in which the standard deviations of the prior are one, the residuals have at
the mode the Jacobian ``U diag(s) V'``. In ``z = sqrt(s^2 + 1) V' (x - x_mode)`` the Laplace approximation is N(0, I);
coordinates run from the stiffest to the sloppiest. Of those that the data leave to the prior any rotation will do: they
are rotated to the axes of the parameters (varimax: Kaiser 1958), where bounds are walls.

*Straightening.* The posterior is a thin sheet around a curved surface: far along the sloppy coordinates the stiff
ones sit many of their own standard deviations away from the mode. The stiff coordinates z_B of one decade of singular
values are therefore measured from a polynomial in all that follow,

    z_B = q_B(z_after) + L_B y_B,

fitted by least squares to draws from near the sheet. The map is block triangular, so it is inverted by substitution
and its Jacobian is a constant: sampling in y is exact whatever the fit, and the better the fit the nearer the density
is to N(0, I). (Triangular transport maps: Parno & Marzouk 2018.)

*Active directions.* Of all directions few bend the sheet: those along which the Jacobian changes (the active subspace
of Constantine 2015, for what is not linear). Only these have squares and products in the polynomial.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import linalg

from bayesub.inference.identifiability.linalg import complete_svd, varimax
from bayesub.inference.interface import Emulated, InferencePrior, LeastSquares, mostly_bounded
from bayesub.inference.sampling.moves import crank_nicolson
from bayesub.inference.sampling.polynomial import (
    PLACES,
    PLAIN,
    Polynomials,
    add,
    columns,
    compiled,
    copy,
    fitted,
    inline,
    pullback_at,
    put,
    values_at,
)

_STIFF = 1.0  # singular value above which the data say more than the prior
_DECADE = 10.0  # ratio of singular values within which coordinates do not bend one another
_BEND_WORTH = 0.3  # of the sd of what is left, that products of a bend must explain
# Change of the residuals' slope, in posterior sd per posterior sd, that is worth a quadratic.
_ACTIVE = 0.1  # at first
_ACTIVE_WITHIN_BOUNDS = 1.0  # in bends, through which the normal of each wall that is hit is taken
_FINELY_ACTIVE = 0.04  # in the end
_MOST_ACTIVE = 64  # directions, with whose products a polynomial of the residuals has some 2700 terms
_JACOBIANS = 16  # that show in which directions they change; before 24
# Of the Crank-Nicolson walk from the mode to draws of the Laplace approximation.
_STEPS = (0.1, 0.3, 1.0)
_SWEEPS = 100
_BLOCKS = 0.9  # share of the sweeps that move few coordinates, within walls
_FAR = 1e6  # prior sd; outside any bounds
_STORED = ("mode", "singular_values", "basis", "active")


def _active(changes, worth: float) -> np.ndarray:
    """(n, n_active) eigenvectors of changes (n, n) whose root eigenvalue is worth a quadratic, largest first."""
    squares, vectors = np.linalg.eigh(changes)
    return np.ascontiguousarray(vectors[:, squares > worth**2][:, ::-1])


class Geometry:
    """The map from sampling coordinates y to parameters.

    The posterior `mode` (n_params,) is in x, and `singular_values` (n_params,) are those of the Jacobian by x, stiffest
    first, below one before the rotation. Column i of the `basis` (n_params, n_params) is the step in x for a unit of
    z_i. `changes` (n_params, n_params) are the mean of C'C with C the change of the Jacobian between the mode and a
    draw, `active` (n_params, n_active) orthonormal directions in z along which the Jacobian changes, most active first,
    and `bends` one :class:`Bend` for each decade of stiff coordinates, stiffest first.
    """

    def __init__(
        self,
        prior: InferencePrior,
        mode: np.ndarray,
        singular_values: np.ndarray,
        basis: np.ndarray,
        active: np.ndarray,
        bends: Sequence["Bend"] = (),
    ):
        self.prior, self.mode, self.singular_values, self.basis = prior, mode, singular_values, basis
        self.active, self.bends = np.ascontiguousarray(active), list(bends)
        self._packed: tuple[list[Bend], tuple[np.ndarray, ...]] | None = None
        self.changes = np.zeros((self.n_params, self.n_params))

    @classmethod
    def whitened(cls, problem: LeastSquares, mode: np.ndarray, prior: InferencePrior | None = None) -> "Geometry":
        """The map that whitens the posterior of a problem at its mode (n_params,) in parameters, without bends.

        The `prior` is that of the problem, or the same in other coordinates.
        """
        prior = prior or problem.prior
        x = prior.scaled(np.asarray(mode, dtype=float))
        _, s, directions = complete_svd(prior.scaled_chain(problem.jacobian(mode), x))
        basis = directions.T / np.sqrt(s**2 + 1.0)
        n_stiff = np.count_nonzero(s > _STIFF)
        basis[:, n_stiff:] = basis[:, n_stiff:] @ varimax(basis[:, n_stiff:])
        return cls(prior, x, s, basis, np.zeros((len(x), 0)))

    @property
    def n_params(self) -> int:
        """Number of parameters."""
        return len(self.mode)

    @property
    def blocks(self) -> float:
        """Fraction of the sweeps in which a walker moves few coordinates: nine tenths within walls, none without."""
        far = np.full((1, self.n_params), _FAR)
        return 0.0 if np.isfinite(self.prior.scaled_log_density(far)).all() else _BLOCKS

    def bent(self, y: np.ndarray) -> np.ndarray:
        """Whitened coordinates z (n, n_params) of sampling coordinates y (n, n_params)."""
        return bent(np.asarray(y, dtype=float), *self.packed)

    @property
    def packed(self) -> tuple[np.ndarray, ...]:
        """The bends as arrays for what is compiled, until there are others."""
        if self._packed is None or self._packed[0] is not self.bends:
            self._packed = self.bends, packed(self.bends)
        return self._packed[1]

    def straightened(self, z: np.ndarray) -> np.ndarray:
        """Sampling coordinates y (n, n_params) of whitened coordinates z (n, n_params)."""
        y = np.array(z, dtype=float)
        for bend in self.bends:
            block = slice(bend.start, bend.stop)
            y[:, block] = linalg.solve_triangular(bend.factor, (z[:, block] - bend(z)).T, lower=True).T
        return y

    def pullback(self, z: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """(n, n_params) gradient by the sampling coordinates of what has the gradient slopes (n, n_params) by z."""
        result = np.ascontiguousarray(slopes.T)
        pull_back_at(np.ascontiguousarray(z.T), result, *self.packed)
        return result.T

    def scaled(self, z: np.ndarray) -> np.ndarray:
        """Whitened coordinates z (n, n_params) in the scaled coordinates x."""
        return self.mode + z @ self.basis.T

    def parameters(self, y: np.ndarray) -> np.ndarray:
        """Parameters (n, n_params) of sampling coordinates y (n, n_params)."""
        return self.prior.unscaled(self.scaled(self.bent(y)))

    def log_prior(self, y: np.ndarray) -> np.ndarray:
        """Log prior density (n,) in the sampling coordinates, up to a constant."""
        return self.prior.scaled_log_density(self.scaled(self.bent(y)))

    def log_prob(self, problem: Emulated, y: np.ndarray) -> np.ndarray:
        """Log posterior density (n,) in the sampling coordinates y (n, n_params), up to a constant.

        Nothing is simulated outside the support of the prior.
        """
        x = self.scaled(self.bent(y))
        log_prob = self.prior.scaled_log_density(x)
        inside = np.isfinite(log_prob)
        if inside.any():
            log_prob[inside] += problem.log_likelihood(self.prior.unscaled(x[inside]))
        return log_prob

    def with_gradient(self, problem: Emulated, y: np.ndarray) -> tuple[float, np.ndarray]:
        """:meth:`log_prob` at sampling coordinates y (n_params,), and its gradient (n_params,).

        Minus infinity and zeros outside the support of the prior and where the simulation fails.
        """
        z = self.bent(y[None])
        x = self.scaled(z)
        (value,) = self.prior.scaled_log_density(x)
        if np.isfinite(value):
            (parameters,) = self.prior.unscaled(x)
            (residuals,), (log_likelihood,) = problem.misfit_about(parameters, parameters[None])
            value += log_likelihood
        if not np.isfinite(value):
            return -np.inf, np.zeros(self.n_params)
        jacobian = self.prior.scaled_chain(problem.jacobian(parameters), x[0])
        by_scaled = self.prior.scaled_slope(x) - residuals @ jacobian
        return float(value), self.pullback(z, by_scaled @ self.basis)[0]

    def draws(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """Sampling coordinates (n, n_params): standard normal draws within the support of the prior."""

        def log_prob(y):
            inside = np.isfinite(self.log_prior(y))
            return np.where(inside, -0.5 * np.einsum("ij,ij->i", y, y), -np.inf)

        mode = np.zeros((n, self.n_params))
        sweep = partial(crank_nicolson, log_prob, steps=_STEPS, n_sweeps=_SWEEPS, blocks=self.blocks)
        return sweep(mode, log_prob(mode), rng)[0]

    def find_active(self, problem: LeastSquares, rng: np.random.Generator) -> None:
        """Find the active directions from Jacobians at draws of the Laplace approximation."""
        at_mode = self._slopes(problem, self.mode)
        gram = np.zeros((self.n_params, self.n_params))
        for x in self.scaled(self.bent(self.draws(rng, _JACOBIANS))):
            change = np.nan_to_num(self._slopes(problem, x) - at_mode)
            gram += change.T @ change / _JACOBIANS
        self.changes, self.active = gram, _active(gram, _ACTIVE)

    def _slopes(self, problem, x) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals by z at x (n_params,) in the scaled coordinates x."""
        return self.prior.scaled_chain(problem.jacobian(self.prior.unscaled(x)), x) @ self.basis

    def finely_active(self) -> np.ndarray:
        """(n_params, n_active) the active directions, and those along which the Jacobian changes less."""
        return np.ascontiguousarray(_active(self.changes, _FINELY_ACTIVE)[:, :_MOST_ACTIVE])

    def straighten(self, z: np.ndarray) -> None:
        """Fit the bends to draws z (n, n_params) from near the posterior."""
        stiff = self.singular_values[self.singular_values > _STIFF]
        self.bends, start = [], 0
        worth = _ACTIVE_WITHIN_BOUNDS if mostly_bounded(self.prior) else _ACTIVE
        while start < len(stiff):
            stop = start + int(np.count_nonzero(stiff[start:] > stiff[start] / _DECADE))
            self.bends.append(Bend.fitted(z, start, stop, _active(self.changes[stop:, stop:], worth)))
            start = stop

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything that the map consists of but the prior, to be stored."""
        whitening = {key: getattr(self, key) for key in _STORED}
        bends = {f"bend_{n}_{key}": a for n, bend in enumerate(self.bends) for key, a in bend.arrays().items()}
        return whitening | bends

    @classmethod
    def restored(cls, prior: InferencePrior, arrays: dict[str, np.ndarray]) -> "Geometry":
        """The map that :meth:`arrays` describe, bit for bit; it can no longer be straightened."""
        bends: list[Bend] = []
        while f"bend_{len(bends)}_block" in arrays:
            prefix = f"bend_{len(bends)}_"
            bends.append(Bend.restored({k.removeprefix(prefix): a for k, a in arrays.items() if k.startswith(prefix)}))
        mode, singular_values, basis, active = (arrays[key] for key in _STORED)
        return cls(prior, mode, singular_values, basis, active, bends)


def draws_like(geometry: Geometry, known: np.ndarray, rng: np.random.Generator, n: int) -> np.ndarray:
    """Coordinates (n, n_params) from near parameters (n_known, n_params), within the support of the prior.

    What is not a number, in whole columns, is drawn as by the Laplace approximation given the others. The geometry has
    no bends yet. If most of all this lies outside of the support, the Laplace approximation is drawn from.
    """
    rows = rng.choice(known, n, replace=n > len(known))
    missing = np.isnan(rows[0])
    rows[:, missing] = geometry.prior.unscaled(geometry.mode)[missing]
    steps, white = geometry.basis[~missing], rng.standard_normal(rows.shape)
    ahead = (geometry.prior.scaled(rows) - geometry.mode)[:, ~missing] - white @ steps.T
    y = white + ahead @ np.linalg.pinv(steps).T
    inside = y[np.isfinite(geometry.log_prior(y))]
    return rng.choice(inside, n, replace=len(inside) < n) if 2 * len(inside) > n else geometry.draws(rng, n)


def redrawn(
    geometry: Geometry, positions: np.ndarray, y: np.ndarray, random: np.random.RandomState
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates y (n, n_params or more) with one parameter of each drawn anew from its prior given the others.

    It is one of those at the `positions`. The second are logarithms (n,) of what the acceptance has besides the ratio
    of densities in y, which leave that of the likelihoods. Coordinates after these parameters stay.
    """
    n, prior = geometry.n_params, geometry.prior
    t = prior.standard(geometry.parameters(y[:, :n]))
    t[np.arange(len(t)), random.choice(positions, len(t))] = random.standard_normal(len(t))
    x = prior.scaled(prior.parameters(t))
    moved = geometry.straightened(np.linalg.solve(geometry.basis, (x - geometry.mode).T).T)
    return np.hstack([moved, y[:, n:]]), geometry.log_prior(y[:, :n]) - prior.scaled_log_density(x)


@dataclass(frozen=True)
class Bend:
    """``z_B = polynomials(z_after) + factor y_B`` for the coordinates ``start .. stop``."""

    start: int
    stop: int
    polynomials: Polynomials
    factor: np.ndarray

    def __call__(self, z) -> np.ndarray:
        """The curved surface q_B (n, stop - start) under whitened coordinates z (n, n_params)."""
        return self.polynomials(z[:, self.stop :])

    @classmethod
    def fitted(cls, z: np.ndarray, start: int, stop: int, active: np.ndarray) -> "Bend":
        """The bend of draws z (n, n_params)."""
        polynomials, misfit = fitted(z[:, stop:], active, z[:, start:stop], _BEND_WORTH)
        n_terms = len(polynomials.linear) + polynomials.bent.size / (stop - start)
        return cls(start, stop, polynomials, np.linalg.cholesky(misfit.T @ misfit / (len(z) - n_terms)))

    def arrays(self) -> dict[str, np.ndarray]:
        """Its arrays by name."""
        block = np.array([self.start, self.stop])
        return {"block": block, "factor": self.factor, **self.polynomials.arrays()}

    @classmethod
    def restored(cls, arrays: dict[str, np.ndarray]) -> "Bend":
        """The bend of :meth:`arrays`."""
        start, stop = arrays["block"]
        return cls(int(start), int(stop), Polynomials.restored(arrays), arrays["factor"])


def packed(bends: Sequence[Bend]) -> tuple[np.ndarray, np.ndarray]:
    """Bends as arrays, for what is compiled.

    The first (n_bends, 10) has of each its start, stop, numbers of active directions, of products and of combinations
    that have these, and where among all numbers its active directions, the three parts of its polynomials and its
    factor begin; the second has these numbers in a row.
    """
    sizes, parts, first = np.empty((len(bends), 10), dtype=np.int64), [np.empty(0)], 0
    for size, bend in zip(sizes, bends, strict=True):
        size[:5] = bend.start, bend.stop, bend.polynomials.active.shape[1], *bend.polynomials.bent.shape
        for k, part in enumerate((*bend.polynomials[:4], bend.factor), start=5):
            size[k] = first
            first += part.size
            parts.append(np.ravel(part))
    return sizes, np.concatenate(parts)


@inline
def _part(numbers, first, n_rows, n_columns):
    return numbers[first : first + n_rows * n_columns].reshape(n_rows, n_columns)


@compiled
def _bend(n_params, size, numbers):
    """Block, polynomials and factor of a bend."""
    start, stop, n_active, n_products, n_bent, at_active, at_linear, at_bent, at_mix, at_factor = size
    n_after, n_block = n_params - stop, stop - start
    polynomials = Polynomials(
        _part(numbers, at_active, n_after, n_active),
        _part(numbers, at_linear, 1 + n_after, n_block),
        _part(numbers, at_bent, n_products, n_bent),
        _part(numbers, at_mix, n_bent, n_block),
        PLAIN,
        np.ones(n_products, dtype=np.bool_),
    )
    return start, stop, polynomials, _part(numbers, at_factor, n_block, n_block)


@compiled
def bend_at(y: np.ndarray, sizes: np.ndarray, numbers: np.ndarray) -> None:
    """Make straight coordinates y (n_params, n) whitened ones, in place."""
    for b in range(len(sizes) - 1, -1, -1):
        start, stop, polynomials, factor = _bend(len(y), sizes[b], numbers)
        moved = np.dot(factor, y[start:stop])
        add(values_at(y[stop:], polynomials), moved)
        copy(moved, y[start:stop])


@compiled
def pull_back_at(z: np.ndarray, slopes: np.ndarray, sizes: np.ndarray, numbers: np.ndarray) -> None:
    """Make a gradient `slopes` (n_params, n) by whitened coordinates z one by straight coordinates, in place."""
    for b in range(len(sizes)):
        start, stop, polynomials, factor = _bend(len(z), sizes[b], numbers)
        add(pullback_at(z[stop:], polynomials, slopes[start:stop]), slopes[stop:])
        copy(np.dot(factor.T, slopes[start:stop]), slopes[start:stop])


@compiled
def bent(y: np.ndarray, sizes: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Whitened coordinates z (n, n_params) of straight ones y (n, n_params)."""
    z = np.empty(y.shape)
    for first in range(0, len(y), PLACES):
        some = columns(y, first)
        bend_at(some, sizes, numbers)
        put(some, z, first)
    return z
