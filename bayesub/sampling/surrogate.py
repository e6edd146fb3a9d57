"""A surrogate of the posterior density that costs a hundredth of a simulation.

In whitened coordinates z (the table of :mod:`bayesub.sampling`) the residuals are emulated by a polynomial
(:mod:`bayesub.sampling.polynomial`), fitted by least squares to simulations at draws from near the posterior. With the
misfit of the fit as additional noise (Kaipio & Somersalo 2007) the k emulated residuals r are standard normal, but for
the emulator's own errors, which are larger in the tails. Their density is therefore that of a t distribution of nu = 30
+ 3 k degrees of freedom,

    log S = log prior - (nu + k) / 2 log(1 + q / nu),    q = |r|^2 - |r_mode|^2,

continued by its tangent below q = 0. (At the mode the residuals balance the pull of the prior. Where prior and data
disagree they are large, and without r_mode all of the posterior would lie in the tails.)

The draws come from the surrogate before: first of all from the Laplace approximation, which is a wide and flat sheet
where the posterior is a thin and bent one. Each round brings them nearer, until they no longer spread, and in the end
it is fitted once more to many of them. It is fitted to draws at twice the variance of the readings, so that it holds in
the tails as well.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numba
import numpy as np

from bayesub.identifiability.interface import InferenceProblem, Progress
from bayesub.sampling.geometry import Geometry
from bayesub.sampling.moves import crank_nicolson, hamiltonian
from bayesub.sampling.polynomial import features, n_features, pullback

STEPS = (0.1, 0.2, 0.4, 0.8)  # of the Crank-Nicolson sweeps on the surrogate
LEAPS, LEAP_STEPS = 8, (0.1, 0.2, 0.4)  # of the flights on it, which are about a quarter of a turn long
_DRAWS, _LAST_DRAWS = 2, 6  # simulations for each feature of the polynomial, in the rounds and in the end
_MORE = 300  # walkers and simulations besides
_FLIGHTS, _WALKS = (1, 2, 4), (100, 400)  # flights, or sweeps, before each simulation
_EXPLORERS, _EXPLORATIONS, _STEPS_OF_EXPLORERS, _VISITS = 256, 3, 20, 5
_GOOD = 0.6  # acceptance of explorers with which there is nothing left to explore
_FLYING = 0.5  # acceptance on the surrogate below which flights end outside bounds too often
_ROUNDS, _MAX_ROUNDS = 3, 12
_STEADY = 1.2  # growth of the draws' spread in one coordinate while they walk on, below which rounds may end
_HOT = 2.0  # temperature of the draws that the surrogate is fitted to
_WALKERS = 4  # for each feature, which find the draws
_SWEEPS, _STOPS = 100, 3  # of a walk; walks in a round that show how the sheet bends
_FREEDOM = (30.0, 3.0)  # degrees of freedom, and those for each emulated residual
_SPAN = 0.03  # posterior sd; directions of the residuals that vary less are left out
_SPANNING = 300  # simulations that show which
_BATCH = 512
_FEW = 512  # walkers that one thread moves together


class Surrogate:
    """Emulated posterior density.

    Attributes
    ----------
    geometry : its whitening and active directions stay as they are; its bends may change later
    coefficients : (n_features, k) of the polynomials of the emulated residuals
    flies : whether flights on it are worth their gradients; bounds stop them
    """

    def __init__(self, geometry: Geometry, coefficients: np.ndarray, *, flies: bool = True):
        self.geometry, self.coefficients, self.flies = geometry, coefficients, flies

    @classmethod
    def fitted(cls, geometry: Geometry, z, residuals, at_mode) -> "Surrogate":
        """The surrogate fitted to residuals (n, n_readings) at whitened coordinates z (n, n_params).

        Those at the mode are at_mode (n_readings,).
        """
        changes = residuals - at_mode
        some = changes[:_SPANNING]
        _, s, vt = np.linalg.svd(some, full_matrices=False)
        span = vt[s > _SPAN * np.sqrt(len(some))]
        known = features(z, geometry.active)
        coefficients = np.linalg.lstsq(known, changes @ span.T)[0]
        misfit = changes @ span.T - known @ coefficients
        noise = np.eye(len(span)) + misfit.T @ misfit / (len(z) - known.shape[1])
        coefficients[0] += span @ at_mode
        return cls(geometry, np.linalg.solve(np.linalg.cholesky(noise), coefficients.T).T)

    def arrays(self) -> dict[str, np.ndarray]:
        """What it consists of besides its geometry, to be stored."""
        return {"surrogate": self.coefficients, "flies": np.array(self.flies)}

    @classmethod
    def restored(cls, geometry: Geometry, arrays: dict[str, np.ndarray]) -> "Surrogate":
        """The surrogate that :meth:`arrays` describe, bit for bit."""
        return cls(geometry, arrays["surrogate"], flies=bool(arrays["flies"]))

    def log_prob(self, y, temperature: float = 1.0) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_params), the likelihood to the power 1 / temperature."""
        z = self.geometry.bent(y)
        log_prior = self.geometry.prior.scaled_log_density(self.geometry.scaled(z))
        _, excess, n_degrees, n = self._residuals(z)
        tail = np.log1p(np.maximum(excess, 0.0) / n_degrees) + np.minimum(excess, 0.0) / n_degrees
        return log_prior - 0.5 / temperature * (n_degrees + n) * tail

    def _residuals(self, z):
        """Those emulated (n, k), how much more their squares sum to than at the mode (n,), degrees of freedom, k."""
        residuals = features(z, self.geometry.active) @ self.coefficients
        at_mode, n = self.coefficients[0], residuals.shape[1]
        excess = np.einsum("ij,ij->i", residuals, residuals) - at_mode @ at_mode
        return residuals, excess, _FREEDOM[0] + _FREEDOM[1] * n, n

    def walks(self) -> list:
        """As :func:`walks`."""
        return walks(self)

    def gradient(self, y) -> np.ndarray:
        """(n, n_params) gradient of :meth:`log_prob` within the support of the prior."""
        z = self.geometry.bent(y)
        residuals, excess, n_degrees, n = self._residuals(z)
        weights = (n_degrees + n) / (n_degrees + np.maximum(excess, 0.0))
        by_features = -self.coefficients @ (weights[:, None] * residuals).T
        slopes = pullback(z, self.geometry.active, by_features.T)
        slopes += self.geometry.prior.scaled_slope(self.geometry.scaled(z)) @ self.geometry.basis
        return self.geometry.pullback(z, slopes)


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
        surrogate = _fitted(problem, geometry, y[:n_fitted])
        y, growth = _straightened(surrogate, y, _HOT, rng)
        if n + 1 >= _ROUNDS and growth < _STEADY:
            break
    surrogate = _fitted(problem, geometry, y[:n_fitted])
    y, _ = _straightened(surrogate, y, 1.0, rng)
    seen = [np.concatenate(_wandered(surrogate, y, 2, _HOT, rng))[-n_last:]]
    surrogate = _fitted(problem, geometry, seen[0])
    draws = _wandered(surrogate, y, 2, 1.0, rng)[-1]
    explorers, accepted = _flown(surrogate, draws[:_EXPLORERS], rng)
    flies = surrogate.flies = bool(np.mean(accepted) > _FLYING)
    for _ in range(_EXPLORATIONS):
        explorers, visited, accepted = _explored(problem, surrogate, explorers, rng)
        seen += visited
        surrogate = _fitted(problem, geometry, np.concatenate(seen))
        surrogate.flies = flies
        if accepted > _GOOD:
            break
    return surrogate, draws


def _explored(problem, surrogate, y, rng):
    """Walkers y (n, n_params) after steps that leave the posterior itself invariant, where they were, the acceptance.

    They stay long where the surrogate is too low, which is where it must be fitted better.
    """
    walk, *_ = walks(surrogate)
    density, visited, accepted = surrogate.geometry.log_prob(problem, y), [], []
    for n in range(1, _STEPS_OF_EXPLORERS + 1):
        before = surrogate.log_prob(y)
        proposed, after, _ = walk(y, before, rng)
        new = surrogate.geometry.log_prob(problem, proposed)
        with np.errstate(invalid="ignore"):  # a walker may start where the simulation fails
            ratio = new - after - (density - before)
        taken = np.log(rng.random(len(y))) < ratio
        y, density = np.where(taken[:, None], proposed, y), np.where(taken, new, density)
        accepted.append(np.mean(taken))
        if n % _VISITS == 0:
            visited.append(y)
    return y, visited, np.mean(accepted)


def walks(surrogate) -> list:
    """Walks on a surrogate, of different lengths: flights, or sweeps where it does not fly.

    Each takes coordinates y (n, n_params), their log densities (n,) and a source of random numbers.
    """
    if surrogate.flies:
        fly = partial(hamiltonian, surrogate.log_prob, surrogate.gradient, steps=LEAP_STEPS, n_leaps=LEAPS)
        return [partial(fly, n_flights=n) for n in _FLIGHTS]
    sweep = partial(crank_nicolson, surrogate.log_prob, steps=STEPS, blocks=surrogate.geometry.blocks)
    return [partial(sweep, n_sweeps=n) for n in _WALKS]


def _flown(surrogate, y, rng):
    """Where walkers y (n, n_params) are after one flight on a surrogate, and the fraction accepted (n,)."""
    fly = walks(surrogate)[0]
    y, _, accepted = fly(y, surrogate.log_prob(y), rng)
    return y, accepted


def _fitted(problem, geometry, y) -> Surrogate:
    """The surrogate fitted to simulations at y (n, n_params), in batches; those that fail are left out."""
    z = geometry.bent(y)
    parameters = geometry.prior.unscaled(geometry.scaled(z))
    inside = np.isfinite(geometry.prior.scaled_log_density(geometry.scaled(z)))
    z, parameters = z[inside], parameters[inside]
    chunks = [parameters[first : first + _BATCH] for first in range(0, len(z), _BATCH)]
    mode = geometry.prior.unscaled(geometry.mode)
    (at_mode,) = problem.residuals_about(mode, mode[None])
    residuals = np.concatenate([problem.residuals_about(mode, chunk) for chunk in chunks])
    done = np.isfinite(residuals).all(axis=1)
    return Surrogate.fitted(geometry, z[done], residuals[done], at_mode)


def _straightened(surrogate, y, temperature, rng):
    """Draws (n, n_params) of a surrogate at a temperature from draws of another, in coordinates straightened by them.

    And by how much they have spread in one coordinate since these were.
    """
    geometry = surrogate.geometry
    z = [geometry.bent(stop) for stop in _wandered(surrogate, y, _STOPS, temperature, rng)]
    geometry.straighten(np.concatenate(z), len(y))
    before = geometry.straightened(z[-1])
    (y,) = _wandered(surrogate, before, 1, temperature, rng)
    return y, np.max(np.std(y, axis=0) / np.std(before, axis=0))


def _wandered(surrogate, y, n_stops, temperature, rng):
    """Where walkers y (n, n_params) stop after each of some walks on a surrogate at a temperature: (n, n_params).

    A few at a time in each thread, with random numbers of their own, so that the number of threads changes nothing.
    """
    log_prob = partial(surrogate.log_prob, temperature=temperature)
    sweep = partial(crank_nicolson, log_prob, steps=STEPS, n_sweeps=_SWEEPS, blocks=surrogate.geometry.blocks)

    def walked(few, stream):
        density, stops = log_prob(few), []
        for _ in range(n_stops):
            few, density, _ = sweep(few, density, stream)
            stops.append(few)
        return stops

    parts = np.array_split(y, -(-len(y) // _FEW))
    with ThreadPoolExecutor(numba.get_num_threads()) as threads:
        stops = list(threads.map(walked, parts, rng.spawn(len(parts))))
    return [np.concatenate(stop) for stop in zip(*stops, strict=True)]
