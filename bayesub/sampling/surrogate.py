"""A surrogate of the posterior density that costs a hundredth of a simulation.

In whitened coordinates z (the table of :mod:`bayesub.sampling`) the residuals are emulated by a polynomial
(:mod:`bayesub.sampling.polynomial`), fitted by least squares to simulations at draws from near the posterior. With the
misfit of the fit as additional noise (Kaipio & Somersalo 2007) the k emulated residuals r are standard normal, but for
the emulator's own errors, which are larger in the tails. Their density is therefore that of a t distribution of nu = 30
+ 3 k degrees of freedom,

    log S = log prior - power (nu + k) / 2 log(1 + q / nu),    q = |r|^2 - |r_mode|^2,

continued by its tangent below q = 0. The power is just below one (:meth:`Surrogate.temper`). (At the mode the residuals
balance the pull of the prior. Where prior and data disagree they are large, and without r_mode all of the posterior
would lie in the tails.)

The draws come from the surrogate before: first of all from the Laplace approximation, which is a wide and flat sheet
where the posterior is a thin and bent one. Each round brings them nearer, until they no longer spread, and in the end
it is fitted once more to those of the last round and as many more. It is fitted to draws at twice the variance of the
readings, so that it holds in the tails as well, and then to where walkers in the posterior come.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial

import numba
import numpy as np
from scipy import linalg

from bayesub.identifiability.interface import InferenceProblem, Progress
from bayesub.sampling.flights import bounced, log_densities, turned, with_gradients
from bayesub.sampling.geometry import Geometry
from bayesub.sampling.polynomial import fitted, n_features

TURNS, KICKS = (0.8, 1.4, 1.8), 3  # of the flights on it, up to a quarter of a turn long
_SHORT_TURNS = (0.2, 0.8, 1.6)  # before it is straight, where short ones get on where long ones are refused
_DRAWS, _LAST_DRAWS = 2, 4  # simulations for each feature of the polynomial, in the rounds and in the end
_MORE = 300  # walkers and simulations besides
LEAPS = (0.2, 0.3, 0.4), 16  # of the flights between walls, angles and number
_PACES, _MOVING, _SCOUTS = (1.0, 0.5, 0.25, 0.125), 0.6, 64  # shorter ones until most flights of some walkers lead away
_FLIGHTS, _BOUNCING = (6,), (2, 4)  # flights before each simulation, without walls and between them
_NEAR, _NEAR_TURNS, _NEAR_LEAPS = 0.1, (0.05, 0.2, 0.5), ((0.02, 0.1), 3)  # how often one flight does not lead far
_EXPLORERS, _EXPLORATIONS, _STEPS_OF_EXPLORERS = 128, 8, 5
_BETTER = 0.02  # rise of the explorers' acceptance with which they explore on
_LEAST_POWER = 0.5  # of the emulated likelihood
_FLYING = 0.5  # acceptance on the surrogate below which flights end outside bounds too often
_ROUNDS, _MAX_ROUNDS = 2, 12
_STEADY = 1.2  # growth of the draws' spread in one coordinate while they walk on, below which rounds may end
_HOT = 2.0  # temperature of the draws that the surrogate is fitted to
_WALKERS = 2  # for each feature, which find the draws
_LONG, _LONG_BOUNCING = 5, 4  # flights of a walk, without walls and between them
_STOPS, _MAX_WALKS = 3, 6  # walks that show how the sheet bends; as often until walkers spread no further
_FREEDOM = (30.0, 3.0)  # degrees of freedom, and those for each emulated residual
_SPAN = 0.03  # posterior sd; directions of the residuals that vary less are left out
_SPANNING = 300  # simulations that show which
_RIDGE = 1e-10  # relative
_BATCH = 512
_FEW, _PARTS = 32, 8  # walkers that one thread moves together, at least, and into how many parts at most
_LAST_STOPS, _DRAWN = 3, 512  # where the last simulations are; walkers that go on from there


class Surrogate:
    """Emulated posterior density.

    Attributes
    ----------
    geometry : its whitening and active directions stay as they are; its bends may change later
    coefficients : (n_features, k) of the polynomials of the emulated residuals
    flies : whether flights on it are worth their gradients; bounds stop them
    power : of the emulated likelihood, with which it is nearest to that of the posterior
    """

    def __init__(self, geometry: Geometry, coefficients: np.ndarray, *, flies: bool = True, power: float = 1.0):
        self.geometry, self.coefficients = geometry, np.ascontiguousarray(coefficients)
        self.flies, self.power = flies, power
        self._basis, self._prior = np.ascontiguousarray(geometry.basis), geometry.prior.scaled_form()

    def arrays(self) -> dict[str, np.ndarray]:
        """What it consists of besides its geometry, to be stored."""
        return {"surrogate": self.coefficients, "flies": np.array(self.flies), "power": np.array(self.power)}

    @classmethod
    def restored(cls, geometry: Geometry, arrays: dict[str, np.ndarray]) -> "Surrogate":
        """The surrogate that :meth:`arrays` describe, bit for bit."""
        return cls(geometry, arrays["surrogate"], flies=bool(arrays["flies"]), power=float(arrays["power"]))

    def packed(self, temperature: float = 1.0) -> tuple[tuple, tuple]:
        """Surrogate and prior for what is compiled, with the likelihood to the power 1 / temperature."""
        geometry, n_degrees = self.geometry, _FREEDOM[0] + _FREEDOM[1] * self.coefficients.shape[1]
        polynomials = (*geometry.packed, geometry.active, self.coefficients)
        return (geometry.mode, self._basis, *polynomials, self.power / temperature, n_degrees), self._prior

    def log_prob(self, y, temperature: float = 1.0) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_params), the likelihood to the power 1 / temperature."""
        return log_densities(y, *self.packed(temperature))

    def with_gradient(self, y, temperature: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """:meth:`log_prob`, and its gradient (n, n_params) within the support of the prior."""
        return with_gradients(y, *self.packed(temperature))

    def temper(self, y, log_prob) -> None:
        """Set the power by places y (n, n_params) of walkers in the posterior and its log densities (n,) there.

        The emulator's errors add to the squares of the residuals, which therefore differ more from place to place than
        those of the simulation do: the regression of these on those has a slope below one.
        """
        known = np.isfinite(log_prob)
        log_prior = self.geometry.log_prior(y[known])
        ours, simulated = (self.log_prob(y[known]) - log_prior) / self.power, log_prob[known] - log_prior
        covariance = np.cov(ours, simulated)
        self.power = float(np.clip(covariance[0, 1] / covariance[0, 0], _LEAST_POWER, 1.0))

    def walks(self) -> list[tuple[Callable, float]]:
        """Walks on it and how often each is taken: long ones, and short ones for walkers where it is too low.

        Each takes coordinates y (n, n_params) and a source of random numbers. From a place where the surrogate is too
        low a long walk is refused nearly always, but the next places have the same error.
        """
        near = partial(_walked, self, length=1, turns=_NEAR_TURNS, leaps=_NEAR_LEAPS), _NEAR
        lengths = _FLIGHTS if self.flies else _BOUNCING
        return [near, *((partial(_walked, self, length=length), (1.0 - _NEAR) / len(lengths)) for length in lengths)]


class _Simulations:
    """Residuals where they have been simulated, of the directions in which they vary.

    Attributes
    ----------
    span : (k, n_readings) these directions, orthonormal
    z : list of (n, n_params) places, one for each batch
    changes : list of (n, k) residuals less those at the mode
    """

    def __init__(self, problem: InferenceProblem, geometry: Geometry, y):
        self.problem, self.geometry = problem, geometry
        self._mode = geometry.prior.unscaled(geometry.mode)
        (self.at_mode,), _ = problem.misfit_about(self._mode, self._mode[None])
        self.span, self.z, self.changes = None, [], []
        self.add(y)

    def add(self, y) -> np.ndarray:
        """Simulate at y (n, n_params), in batches; log posterior densities (n,), up to a constant.

        What fails or lies outside of bounds is left out, and has minus infinity.
        """
        z = self.geometry.bent(y)
        x = self.geometry.scaled(z)
        log_prob = self.geometry.prior.scaled_log_density(x)
        inside = np.isfinite(log_prob)
        log_likelihoods = []
        z, parameters = z[inside], self.geometry.prior.unscaled(x[inside])
        for first in range(0, len(z), _BATCH):
            some = slice(first, first + _BATCH)
            residuals, log_likelihood = self.problem.misfit_about(self._mode, parameters[some])
            log_likelihoods.append(log_likelihood)
            changes = residuals - self.at_mode
            done = np.isfinite(changes).all(axis=1)
            if not done.all():
                changes = changes[done]
            if self.span is None:
                self.span = _span(changes[:_SPANNING])
            self.z.append(z[some][done])
            self.changes.append(changes @ self.span.T)
        log_prob[inside] += np.concatenate([np.empty(0), *log_likelihoods])
        return log_prob

    def surrogate(self, *, flies: bool | None = None) -> "Surrogate":
        """The surrogate that is fitted to all of them; it flies if there are no bounds, unless it is told."""
        z, changes = np.concatenate(self.z), np.concatenate(self.changes)
        coefficients, misfit = fitted(z, self.geometry.active, changes, _RIDGE)
        noise = np.eye(len(self.span)) + misfit.T @ misfit / max(len(z) - len(coefficients), 1)
        coefficients[0] += self.span @ self.at_mode
        whitened = linalg.solve_triangular(np.linalg.cholesky(noise), coefficients.T, lower=True).T
        flies = not self.geometry.blocks if flies is None else flies
        return Surrogate(self.geometry, whitened, flies=flies)


def _span(changes):
    """(k, n_readings) orthonormal directions along which changes (n, n_readings) of the residuals vary."""
    squares, members = np.linalg.eigh(changes @ changes.T)
    seen = squares > _SPAN**2 * len(changes)
    return (members[:, seen] / np.sqrt(squares[seen])).T @ changes


def learn(
    problem: InferenceProblem, geometry: Geometry, rng: np.random.Generator, progress: Progress | None = None
) -> tuple[Surrogate, np.ndarray]:
    """Find the active directions, straighten the geometry and fit a surrogate.

    Parameters
    ----------
    problem : to be emulated
    geometry : whitened at the mode of the problem; it is straightened in place
    rng : source of all random numbers
    progress : object with ``update(done, total, unit, note)``, or None

    Returns
    -------
    The surrogate, and draws of it (n, n_params) in sampling coordinates.
    """
    geometry.find_active(problem, rng)
    n_terms = n_features(*geometry.active.shape)
    n_fitted, n_last = _DRAWS * n_terms + _MORE, _LAST_DRAWS * n_terms + _MORE
    y = geometry.draws(rng, _WALKERS * n_terms + _MORE)
    for n in range(_MAX_ROUNDS):
        if progress is not None:
            progress.update(n, n + _ROUNDS, "rounds", "surrogate")
        seen = _Simulations(problem, geometry, y[:n_fitted])
        surrogate = seen.surrogate()
        y, growth = _straightened(surrogate, y, _HOT, rng)
        if n + 1 >= _ROUNDS and growth < _STEADY:
            break
    y, _ = _straightened(surrogate, y, 1.0, rng)
    seen.add(np.concatenate(_wandered(surrogate, y, _LAST_STOPS, _HOT, rng))[n_fitted - n_last :])
    surrogate = seen.surrogate()
    draws = _wandered(surrogate, y[:_DRAWN], 2, 1.0, rng)[-1]
    surrogate.flies = True
    explorers, _, accepted = _walked(surrogate, draws[:_EXPLORERS], rng, length=1)
    surrogate.flies = bool(np.mean(accepted) > _FLYING)
    return _explored(seen, surrogate, explorers, rng), draws


def _explored(seen, surrogate, y, rng):
    """The surrogate fitted, again and again, to where walkers y (n, n_params) come that leave the posterior invariant.

    They stay long where it is too low, which is where it must be fitted better. They walk until no more of their
    proposals are taken than before.
    """
    density, best = seen.add(y), 0.0
    for _ in range(_EXPLORATIONS):
        walk, _ = surrogate.walks()[-1]
        accepted, places, densities = [], [], []
        for _ in range(_STEPS_OF_EXPLORERS):
            before = surrogate.log_prob(y)
            proposed, after, _ = walk(y, rng)
            new = seen.add(proposed)
            with np.errstate(invalid="ignore"):  # a walker may start where the simulation fails
                taken = np.log(rng.random(len(y))) < new - after - (density - before)
            y, density = np.where(taken[:, None], proposed, y), np.where(taken, new, density)
            accepted.append(np.mean(taken))
            places.append(y)
            densities.append(density)
        surrogate = seen.surrogate(flies=surrogate.flies)
        surrogate.temper(np.concatenate(places), np.concatenate(densities))
        if np.mean(accepted) < best + _BETTER:
            break
        best = np.mean(accepted)
    return surrogate


def _walked(surrogate, y, random, *, length, temperature=1.0, turns=TURNS, leaps=LEAPS):
    """Where walkers y (n, n_params) are after flights; log densities there; the fraction accepted (n,).

    A few at a time in each thread, with random numbers of their own, so that the number of threads changes nothing.
    """
    n_parts = min(-(-len(y) // _FEW), _PARTS)
    streams = np.random.SeedSequence(int.from_bytes(random.bytes(16))).spawn(n_parts)
    target, (steps, n_leaps) = surrogate.packed(temperature), leaps

    def walked(few, stream):
        rng, each = np.random.default_rng(stream), (length, len(few))
        momenta = rng.standard_normal((*each, few.shape[1]))
        if surrogate.flies:
            angles, thresholds = rng.choice(turns, each) / KICKS, np.log(rng.random(each))
            return turned(few, angles, momenta, thresholds, KICKS, *target)
        thresholds = np.log(rng.random((length, n_leaps, len(few))))
        before = rng.integers(n_leaps + 1, size=each)  # leaps of the trajectory that lead to the start
        return bounced(few, rng.choice(steps, each), momenta, before, thresholds, *target)

    ends = list(_threads(numba.get_num_threads()).map(walked, np.array_split(y, n_parts), streams))
    return tuple(np.concatenate(parts) for parts in zip(*ends, strict=True))


@cache
def _threads(n):
    """So many threads, that wait for one walk after another."""
    return ThreadPoolExecutor(n, "walks")


os.register_at_fork(after_in_child=_threads.cache_clear)  # where there are no threads


def _straightened(surrogate, y, temperature, rng):
    """Draws (n, n_params) of a surrogate at a temperature from draws of another, in coordinates straightened by them.

    And by how much they have spread in one coordinate since these were. Walkers go on until they spread no further.
    """
    geometry = surrogate.geometry
    for _ in range(_MAX_WALKS):
        stops = _wandered(surrogate, y, _STOPS, temperature, rng)
        spread, y = _growth(y, stops[-1]), stops[-1]
        if spread < _STEADY:
            break
    z = [geometry.bent(stop) for stop in stops]
    geometry.straighten(np.concatenate(z), len(y))
    before = geometry.straightened(z[-1])
    (y,) = _wandered(surrogate, before, 1, temperature, rng)
    return y, _growth(before, y)


def _growth(before, after):
    """Ratio of spreads of walkers (n, n_params), of the coordinate in which it is largest."""
    return np.max(np.std(after, axis=0) / np.std(before, axis=0))


def _wandered(surrogate, y, n_stops, temperature, rng):
    """Where walkers y (n, n_params) stop after each of some walks on a surrogate at a temperature: (n, n_params)."""
    length, stops = _LONG if surrogate.flies else _LONG_BOUNCING, []
    walk = partial(_walked, surrogate, temperature=temperature, turns=_SHORT_TURNS)
    leaps = LEAPS if surrogate.flies else _even_leaps(walk, y[:_SCOUTS], rng)
    for _ in range(n_stops):
        y, _, _ = walk(y, rng, length=length, leaps=leaps)
        stops.append(y)
    return stops


def _even_leaps(walk, scouts, rng):
    """The longest leaps with which most flights of scouts (n, n_params) lead away.

    Before the surrogate is straight, long ones lead so far out of the walls that its polynomials explode.
    """
    angles, n_leaps = LEAPS
    for pace in _PACES:
        leaps = tuple(pace * angle for angle in angles), n_leaps
        if np.mean(walk(scouts, rng, length=1, leaps=leaps)[2]) > _MOVING:
            break
    return leaps
