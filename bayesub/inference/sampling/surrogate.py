"""A surrogate of the posterior density that costs far less than a simulation.

In whitened coordinates z (the table of :mod:`bayesub.inference.sampling`) the residuals are emulated by a polynomial
(:mod:`bayesub.inference.sampling.polynomial`), fitted by least squares to simulations at draws from near the posterior.
With the misfit of the fit as additional noise (Kaipio & Somersalo 2007) the k emulated residuals r are standard normal,
but for the emulator's own errors, which are larger in the tails: it is where the surrogate is too low that walkers are
held. The misfit is taken twice, and their density is that of a t distribution of nu = 30 + k degrees of freedom,

    log S = log prior - power (nu + k) / 2 log(1 + q / nu),    q = |r|^2 - |r_mode|^2,

continued by its tangent below q = 0. The power is just below one (:meth:`Surrogate.temper`). (At the mode the residuals
balance the pull of the prior. Where prior and data disagree they are large: without r_mode all would lie in the tails.)

The draws come from the surrogate before: first of all from the Laplace approximation, which is a wide and flat sheet
where the posterior is a thin and bent one. Each round brings them nearer, until they no longer spread. In the end a
richer polynomial, with more active directions and products of four, is fitted to draws of the last round; within bounds
it keeps the products that explain something, a third to a half, and is less often too low between the draws. All draws
that it is fitted to are such at twice the variance of the readings (a tenth more, of a density without residuals), so
that it holds in the tails as well: fitted to draws of the posterior it is better in the middle, and walkers are held
where it is too low.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial

import numba
import numpy as np
from scipy import linalg

from bayesub.inference.interface import Emulated, Modal, Progress, mostly_bounded
from bayesub.inference.sampling.geometry import Geometry, draws_like
from bayesub.inference.sampling.hmc import log_densities, reflecting_trajectories, trajectories, with_gradients
from bayesub.inference.sampling.polynomial import PLAIN, RICH, RICHER, Polynomials, features, fitted, n_features

Reflecting = tuple[tuple[float, ...], int]

# "sd" is a posterior standard deviation; "before" names earlier values that did worse.
# Trajectories without walls.
ANGLES = (1.2, 1.6, 2.0)  # radians of a trajectory, about a quarter of a turn; before 0.8, 1.4 and 1.8
LEAPFROG_STEPS = 4  # of a trajectory; before 3
_LEARNING_ANGLES = (0.3, 0.9, 1.6)  # until it is straight, where short ones get on where long ones are refused
_NEAR_ANGLES = (0.05, 0.2, 0.5)  # of the one trajectory of a short walk, which does not lead far
_TRAJECTORIES = 4  # of a walk before each simulation; before 3, then 6
_LEARNING_TRAJECTORIES = 4  # of a walk that finds draws; before 5
# Trajectories that are reflected at walls.
REFLECTING: Reflecting = (0.1, 0.15, 0.2), 48  # radians of a leapfrog step, and steps; before 0.2, 0.3 and 0.4, and 16
_NEAR_REFLECTING = (0.02, 0.1), 3  # of a short walk
_REFLECTING_TRAJECTORIES = 1, 2  # of a walk before each simulation, and if most parameters have bounds; before 2 or 4
_LEARNING_REFLECTING_TRAJECTORIES = 1  # of a walk that finds draws; before 4 shorter ones
_PACES = (1.0, 0.5, 0.25, 0.125)  # by which angles are shortened until most trajectories lead away
_MOVING = 0.6  # share of them that is most
_SCOUTS = 64  # walkers that try the paces
_ACCEPTED = 0.5  # acceptance on the surrogate below which trajectories without reflection end outside bounds too often
# Rounds in which draws and surrogate approach the posterior.
_WALKERS = 512  # that find the draws; before 2 or 4 for each term of a polynomial
_DRAWS = 2  # for each term, to which the surrogate is fitted; in the end before 6, then 4
_BENDING = 3  # draws for each term, to which the bends are fitted
_MORE = 300  # draws besides
_ROUNDS, _MAX_ROUNDS = 2, 12  # at least and at most; before 3 at least, or 4 always
_ADAPTED = 3  # rounds, at most, before which the problem is adapted
_STOPS, _MAX_WALKS = 3, 6  # walks that show how the sheet bends; as often until walkers spread no further
_STEADY = 1.2  # ratio of the draws' spreads in one coordinate while they walk on, below which rounds may end
_HOT = 2.0  # temperature of the draws that it is fitted to; of draws at one it is too low in the tails
_WARM = 1.1  # that of a density without residuals, whose rows go astray far out
# The fit.
_SPAN = 0.03  # sd; directions of the residuals that vary less are left out
_SPANNING = 300  # simulations that show which
_WORTH = 0.03  # sd; combinations of residuals that bend less have no products
_LEAST = 0.017  # sd; products of a richer fit within bounds that explain less are left out
_DOUBTED = 2.0  # variance of the misfit that is taken for noise, over that where the surrogate is fitted; before 1
_FREEDOM = 30.0, 1.0  # degrees of freedom, and those for each emulated residual; before 30 and 3, lighter tails
_LEAST_POWER = 0.5  # of the emulated likelihood
# Richer fits in the end.
_REFINEMENTS = 6  # at most
_JUDGED = 256  # draws of each that are simulated
_GOOD = 0.8  # acceptance of these that is good enough
_GOOD_WITHIN_BOUNDS = 0.7  # where a fit costs more, and those before are as rich
_BETTER = 0.02  # rise of the acceptance with which refining goes on
_LONG, _NORMAL = 100.0, 0.5  # length of the residuals and acceptance of draws with which a normal surrogate does
# How it is computed.
_BATCH = 512  # simulations at once
_FEW, _PARTS = 32, 8  # walkers that one thread moves together, at least, and into how many parts at most
_FEW_WITHIN_BOUNDS = 16  # whose walks are longer


class Surrogate:
    """Emulated posterior density.

    The whitening and active directions of its geometry stay as they are; its bends may change later. The polynomials
    are of the k emulated residuals. It `flies` if trajectories without reflection, which bounds stop, are worth their
    gradients. With the `power` the emulated likelihood is nearest to that of the posterior.
    """

    def __init__(self, geometry: Geometry, polynomials: Polynomials, *, flies: bool = True, power: float = 1.0):
        self.geometry, self.polynomials = geometry, polynomials
        self.flies, self.power = flies, power
        self._basis, self._prior = np.ascontiguousarray(geometry.basis), geometry.prior.scaled_form()
        self.bounded = mostly_bounded(geometry.prior)

    @property
    def walled(self) -> bool:
        """Whether its density ends somewhere."""
        return self.geometry.blocks > 0.0

    def arrays(self) -> dict[str, np.ndarray]:
        """Its state besides the geometry, to be stored."""
        polynomials = {f"surrogate_{key}": part for key, part in self.polynomials.arrays().items()}
        return polynomials | {"flies": np.array(self.flies), "power": np.array(self.power)}

    @classmethod
    def restored(cls, geometry: Geometry, arrays: dict[str, np.ndarray]) -> "Surrogate":
        """The surrogate that :meth:`arrays` describe, bit for bit."""
        polynomials = Polynomials.restored({key.removeprefix("surrogate_"): part for key, part in arrays.items()})
        return cls(geometry, polynomials, flies=bool(arrays["flies"]), power=float(arrays["power"]))

    def packed(self, temperature: float = 1.0) -> tuple[tuple, tuple]:
        """Surrogate and prior for what is compiled, with the likelihood to the power 1 / temperature."""
        geometry, n_degrees = self.geometry, _FREEDOM[0] + _FREEDOM[1] * self.polynomials.linear.shape[1]
        parts = (geometry.mode, self._basis, *geometry.packed, self.polynomials, self.power / temperature, n_degrees)
        return parts, self._prior

    def log_prob(self, y: np.ndarray, temperature: float = 1.0) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_params), the likelihood to the power 1 / temperature."""
        return log_densities(y, *self.packed(temperature))

    def with_gradient(self, y: np.ndarray, temperature: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """:meth:`log_prob`, and its gradient (n, n_params) within the support of the prior."""
        return with_gradients(y, *self.packed(temperature))

    def temper(self, y: np.ndarray, log_prob: np.ndarray) -> None:
        """Set the power by places y (n, n_params) of walkers in the posterior and its log densities (n,) there.

        The emulator's errors add to the squares of the residuals, which therefore differ more from place to place than
        those of the simulation do: the regression of these on those has a slope below one.
        """
        known = np.isfinite(log_prob)
        log_prior = self.geometry.log_prior(y[known])
        ours, simulated = (self.log_prob(y[known]) - log_prior) / self.power, log_prob[known] - log_prior
        covariance = np.cov(ours, simulated)
        if covariance[0, 0] > 0.0:  # otherwise the data say nothing
            self.power = float(np.clip(covariance[0, 1] / covariance[0, 0], _LEAST_POWER, 1.0))

    def walks(self) -> tuple[partial, list[partial]]:
        """A short walk on it, and long ones.

        Each takes coordinates y (n, n_params), a source of random numbers, and which of them walk (n,). From a corner
        between walls only those lead away that are reflected.
        """
        short = partial(_walk, self, reflects=self.walled, length=1, angles=_NEAR_ANGLES, reflecting=_NEAR_REFLECTING)
        reflected = [partial(_walk, self, reflects=True, length=_REFLECTING_TRAJECTORIES[self.bounded])] * self.walled
        free = [partial(_walk, self, reflects=False, length=_TRAJECTORIES)] * (self.flies or not self.walled)
        return short, reflected + free


class _Simulations:
    """Residuals where they have been simulated, of the directions in which they vary.

    These are orthonormal, `span` (k, n_readings). For each batch `z` has the places (n, n_params) and `changes` the
    residuals (n, k) less those at the mode.
    """

    def __init__(self, problem: Emulated, geometry: Geometry):
        self.problem, self.geometry = problem, geometry
        self._mode = geometry.prior.unscaled(geometry.mode)
        (self.at_mode,), _ = problem.misfit_about(self._mode, self._mode[None])
        self.z: list[np.ndarray] = []
        self.changes: list[np.ndarray] = []
        self.log_likelihoods: list[np.ndarray] = []

    @property
    def n(self) -> int:
        """Their number."""
        return sum(map(len, self.z))

    def add(self, y: np.ndarray) -> None:
        """Simulate at y (n, n_params), in batches. What fails or lies outside of bounds is left out."""
        z = self.geometry.bent(y)
        x = self.geometry.scaled(z)
        inside = np.isfinite(self.geometry.prior.scaled_log_density(x))
        z, parameters = z[inside], self.geometry.prior.unscaled(x[inside])
        for first in range(0, len(z), _BATCH):
            some = slice(first, first + _BATCH)
            residuals, log_likelihoods = self.problem.misfit_about(self._mode, parameters[some])
            changes = residuals - self.at_mode
            done = np.isfinite(changes).all(axis=1)
            if not done.all():
                changes = changes[done]
            if not self.z:
                # Orthonormal combinations of changes, along which they vary.
                some_changes = changes[:_SPANNING]
                squares, members = np.linalg.eigh(some_changes @ some_changes.T)
                seen = squares > _SPAN**2 * len(some_changes)
                self.span = (members[:, seen] / np.sqrt(squares[seen])).T @ some_changes
            self.z.append(z[some][done])
            self.log_likelihoods.append(log_likelihoods[done])
            self.changes.append(changes @ self.span.T)

    def normal(self) -> Surrogate:
        """A surrogate with a normal likelihood, nearest to theirs: of a long record, a fit to residuals is worse."""
        log_likelihoods, n_params = np.concatenate(self.log_likelihoods), self.geometry.n_params
        known, none = np.isfinite(log_likelihoods), np.empty((n_params, 0))
        terms = features(np.concatenate(self.z)[known], np.eye(n_params), (0, 0))
        _, *slopes = linalg.lstsq(terms, 2.0 * (log_likelihoods[known].max() - log_likelihoods[known]))[0]
        form = np.zeros((n_params, n_params))
        form[np.triu_indices(n_params)] = slopes[n_params:]
        squares, axes = np.linalg.eigh(form + form.T)
        lengths = np.sqrt(np.maximum(0.5 * squares, 1e-6))
        linear = np.vstack([0.5 * (slopes[:n_params] @ axes) / lengths, axes * lengths])
        return Surrogate(
            self.geometry, Polynomials(none, linear, np.empty((0, 0)), none.T.copy(), PLAIN, np.empty(0, dtype=bool))
        )

    def surrogate(self, active: np.ndarray, degrees: tuple[int, int] = PLAIN, least: float = 0.0) -> Surrogate:
        """The surrogate that is fitted to all of them, with products that explain more than `least`."""
        z, changes, unit = np.concatenate(self.z), np.concatenate(self.changes), np.eye(len(self.span))
        polynomials, misfit = fitted(z, active, changes, _WORTH, unit=unit, degrees=degrees, least=least)
        n_terms = len(polynomials.linear) + len(polynomials.bent)
        noise = unit + _DOUBTED * misfit.T @ misfit / max(len(z) - n_terms, 1)
        polynomials.linear[0] += self.span @ self.at_mode
        whitened = polynomials.mixed(linalg.inv(np.linalg.cholesky(noise)).T)
        return Surrogate(self.geometry, whitened)


def learn(
    problem: Emulated,
    geometry: Geometry,
    rng: np.random.Generator,
    progress: Progress | None = None,
    adapt: Callable[[np.ndarray], None] | None = None,
    near: np.ndarray | None = None,
) -> tuple[Surrogate, np.ndarray]:
    """Find the active directions, straighten the geometry in place and fit a surrogate of the problem.

    The geometry is whitened at the mode of the problem. An `adapt` changes the problem by parameters (n, n_params)
    that are draws of what is known by then; then a normal surrogate may do. With it come draws (n, n_params). The first
    round begins from parameters `near` the posterior (n, n_params) if there are any, which saves rounds.
    """
    if adapt is not None:
        adapt(geometry.parameters(geometry.draws(rng, _WALKERS)))
        seen = _Simulations(problem, geometry)
        if np.linalg.norm(seen.at_mode) > _LONG:
            seen.add(geometry.draws(rng, _DRAWS * n_features(geometry.n_params, geometry.n_params, (0, 0)) + _MORE))
            *_, y = _wander(normal := seen.normal(), geometry.draws(rng, _WALKERS), _STOPS, 1.0, rng)
            if _judged(problem, normal, y, rng) > _NORMAL:
                return normal, y
    geometry.find_active(problem, rng)
    n_terms = n_features(*geometry.active.shape)
    n_fitted, n_bent = _DRAWS * n_terms + _MORE, _BENDING * n_terms + _MORE
    heat = _WARM if isinstance(problem, Modal) else _HOT
    y = draws_like(geometry, near, rng, n_fitted) if near is not None and len(near) else geometry.draws(rng, n_fitted)
    for n in range(_MAX_ROUNDS):
        if progress is not None:
            progress.update(n, n + _ROUNDS, "rounds", "surrogate")
        if adapt is not None and 0 < n < _ADAPTED:
            adapt(geometry.parameters(y[-n_fitted:]))
        seen = _Simulations(problem, geometry)
        seen.add(y[-n_fitted:])
        surrogate = seen.surrogate(geometry.active)
        y, change = _straighten(surrogate, y, n_bent, n_fitted, heat, rng)
        if n + 1 >= _ROUNDS and change < _STEADY:
            break
    y, _ = _straighten(surrogate, y, n_bent, _WALKERS, 1.0, rng)
    return _refine(problem, surrogate, y, rng, seen, heat)


def _refine(problem, surrogate, y, rng, seen, heat):
    """A richer surrogate from draws y (n, n_params) of a plain one and what was `seen` to fit that, and draws of it.

    It is fitted to draws of the one before at a temperature `heat` besides, and again to as many more, until enough of
    its own draws would be accepted, proposed one after another, or no more than before.
    """
    geometry, best = surrogate.geometry, 0.0
    active = geometry.finely_active()
    degrees, good, least = (RICHER, _GOOD_WITHIN_BOUNDS, _LEAST) if surrogate.bounded else (RICH, _GOOD, 0.0)
    n_wanted = _DRAWS * n_features(active.shape[0], active.shape[1], degrees) + _MORE
    for k in range(1, _REFINEMENTS + 1):
        n_stops = max(-(-(k * n_wanted - seen.n) // len(y)), 1)
        _, *stops = _wander(surrogate, y, 1 + n_stops, heat, rng)
        seen.add(np.concatenate(stops))
        surrogate = seen.surrogate(active, degrees, least)
        surrogate.flies = bool(np.mean(_walk(surrogate, y, rng, reflects=False, length=1)[2]) > _ACCEPTED)
        *_, y = _wander(surrogate, y, 2, 1.0, rng)
        accepted = _judged(problem, surrogate, y[:_JUDGED], rng)
        if accepted > good or accepted < best + _BETTER:
            break
        best = accepted
    return surrogate, y


def _judged(problem, surrogate, y, rng) -> float:
    """The share of its draws y (n, n_params) that would be accepted, one after another; sets its power before."""
    density = surrogate.geometry.log_prob(problem, y)
    surrogate.temper(y, density)
    known = np.isfinite(density)
    weights = density[known] - surrogate.log_prob(y[known])
    return float(np.sum(np.exp(np.minimum(rng.permutation(weights) - weights, 0.0))) / len(known))


def _walk(surrogate, y, random, taken=None, *, reflects, length, temperature=1.0, angles=ANGLES, reflecting=REFLECTING):
    """Where walkers y (n, n_params) are after `length` trajectories; log densities there; the fraction accepted (n,).

    Of those that are `taken` (n,), by default all. A few at a time in each thread, with random numbers of their own, so
    that the number of threads changes nothing, nor does which others are taken.
    """
    n_parts = min(-(-len(y) // (_FEW_WITHIN_BOUNDS if surrogate.bounded else _FEW)), _PARTS)
    streams = np.random.SeedSequence(int.from_bytes(random.bytes(16))).spawn(n_parts)
    target, (step_angles, n_steps) = surrogate.packed(temperature), reflecting
    taken = np.ones(len(y), dtype=bool) if taken is None else taken

    def walked(few, chosen, stream):
        rng, each = np.random.default_rng(stream), (length, len(few))

        def of_chosen(numbers):
            return numbers.compress(chosen, axis=1)  # row by row in memory, whatever the mask

        momenta = of_chosen(rng.standard_normal((*each, few.shape[1])))
        if not reflects:
            steps, thresholds = (
                of_chosen(rng.choice(angles, each) / LEAPFROG_STEPS),
                of_chosen(np.log(rng.random(each))),
            )
            return trajectories(few[chosen], steps, momenta, thresholds, LEAPFROG_STEPS, *target)
        thresholds = np.log(rng.random((length, n_steps, len(few)))).compress(chosen, axis=2)
        before = of_chosen(rng.integers(n_steps + 1, size=each))  # steps of the trajectory that lead to the start
        steps = of_chosen(rng.choice(step_angles, each))
        return reflecting_trajectories(few[chosen], steps, momenta, before, thresholds, *target)

    parts = np.array_split(y, n_parts), np.array_split(taken, n_parts), streams
    ends = list(_threads(numba.get_num_threads()).map(walked, *parts))
    return tuple(np.concatenate(parts) for parts in zip(*ends, strict=True))


@cache
def _threads(n):
    """So many threads, that wait for one walk after another."""
    return ThreadPoolExecutor(n, "walks")


os.register_at_fork(after_in_child=_threads.cache_clear)  # where there are no threads


def _straighten(surrogate, y, n_bent, n_draws, temperature, rng):
    """Draws of a surrogate at a temperature from draws y (n, n_params) of another, in coordinates straightened by them.

    The last of `y` walk on until they spread or shrink no further, and then until they have left `n_bent` draws, to
    which the bends are fitted. From there they leave `n_draws` more, which are returned.

    And by how much the first of these draws differ in spread from y.
    """
    geometry, changes = surrogate.geometry, []
    for _ in range(_MAX_WALKS):
        reached = np.concatenate(_wander(surrogate, y[-_WALKERS:], _STOPS, temperature, rng))
        ratios = np.log(np.std(reached, axis=0) / np.std(y, axis=0))
        changes.append(np.exp(np.max(np.abs(ratios))))  # of the coordinate in which they have grown or shrunk most
        y = reached
        if changes[-1] < _STEADY:
            break
    n_stops = max(n_bent - len(y), 0) // _WALKERS
    z = geometry.bent(np.concatenate([y, *_wander(surrogate, y[-_WALKERS:], n_stops, temperature, rng)]))
    geometry.straighten(z)
    y = geometry.straightened(z[-_WALKERS:])
    return np.concatenate(_wander(surrogate, y, -(-n_draws // _WALKERS), temperature, rng)), changes[0]


def _wander(surrogate, y, n_stops, temperature, rng):
    """Where walkers y (n, n_params) stop after each of some walks on a surrogate at a temperature: (n, n_params)."""
    stops, length, reflecting = [], _LEARNING_TRAJECTORIES, REFLECTING
    walk = partial(_walk, surrogate, reflects=surrogate.walled, temperature=temperature, angles=_LEARNING_ANGLES)
    if surrogate.walled:
        length, (angles, n_steps) = _LEARNING_REFLECTING_TRAJECTORIES, REFLECTING
        # Before the surrogate is straight, long steps lead so far out of the walls that its polynomials explode.
        for pace in _PACES:
            reflecting = tuple(pace * angle for angle in angles), n_steps
            if np.mean(walk(y[:_SCOUTS], rng, length=1, reflecting=reflecting)[2]) > _MOVING:
                break
    for _ in range(n_stops):
        y, _, _ = walk(y, rng, length=length, reflecting=reflecting)
        stops.append(y)
    return stops
