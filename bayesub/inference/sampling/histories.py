"""Sampling coordinates of problems with histories: those of the other parameters, and after them y.

The others have the geometry and the surrogate of the marginalised problem
(:mod:`bayesub.inference.sampling.marginalised`); y is standard normal for the surrogate, and a step moves both.
"""

import time
from functools import partial

import numpy as np
import threadpoolctl

from bayesub.inference.baselines import Estimate, gauss_newton, posterior_mode
from bayesub.inference.interface import Forced, Progress
from bayesub.inference.sampling.geometry import Geometry
from bayesub.inference.sampling.marginalised import Marginalised
from bayesub.inference.sampling.surrogate import Surrogate, learn

_TOLERANCE = 0.3  # posterior sd, of the search for the marginal mode, which only has to be near
# Of the walk in y.
_STEPS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1)  # of Crank-Nicolson; the best is taken, of which one is a new draw
_SHORTER = 0.3  # times that in a short walk
_TRIED = 128  # draws with which they are tried
_EVALUATIONS = 40_000  # of a density, all in all, that a posterior of some twenty coefficients took


class HistoryGeometry:
    """The map from sampling coordinates to parameters; `geometry` is that of the others."""

    def __init__(self, geometry: Geometry, marginalised: Marginalised):
        self.geometry, self.marginalised = geometry, marginalised

    @property
    def blocks(self) -> float:
        """Fraction of the sweeps in which a walker moves few coordinates, of the geometry of the others."""
        return self.geometry.blocks

    def evaluate(self, problem: Forced, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log posterior densities (n,) in sampling coordinates y (n, n_all), up to a constant; parameters (n, n_all).

        Nothing is simulated outside the support of the prior, and the parameters there are not a number.
        """
        n = self.marginalised.n_params
        x = self.geometry.scaled(self.geometry.bent(y[:, :n]))
        log_prob, parameters = self.geometry.prior.scaled_log_density(x), np.full(y.shape, np.nan)
        inside = np.isfinite(log_prob)
        if inside.any():
            others = self.geometry.prior.unscaled(x[inside])
            density, parameters[inside] = self.marginalised.density(problem, others, y[inside, n:])
            log_prob[inside] += density
        return log_prob, parameters

    def log_prob(self, problem: Forced, y: np.ndarray) -> np.ndarray:
        """(n,) log posterior densities in sampling coordinates y (n, n_all), up to a constant."""
        return self.evaluate(problem, y)[0]

    def arrays(self) -> dict[str, np.ndarray]:
        """What determines the map, to be stored."""
        return self.geometry.arrays() | self.marginalised.arrays()

    @classmethod
    def restored(cls, problem: Forced, arrays: dict[str, np.ndarray]) -> "HistoryGeometry":
        """The map that :meth:`arrays` describe, bit for bit."""
        marginalised = Marginalised(problem, arrays["centre"], arrays)
        return cls(Geometry.restored(marginalised.prior, arrays), marginalised)


class HistorySurrogate:
    """A surrogate of the density of the others, times a standard normal one of y, which moves by a `step` at a time."""

    def __init__(self, surrogate: Surrogate, step: float):
        self.surrogate, self.step, self.n_others = surrogate, step, surrogate.geometry.n_params

    def arrays(self) -> dict[str, np.ndarray]:
        """Its state besides the geometry, to be stored."""
        return self.surrogate.arrays() | {"step": np.array(self.step)}

    @classmethod
    def restored(cls, geometry: Geometry, arrays: dict[str, np.ndarray]) -> "HistorySurrogate":
        """The surrogate that :meth:`arrays` describe, bit for bit."""
        return cls(Surrogate.restored(geometry, arrays), float(arrays["step"]))

    def log_prob(self, y: np.ndarray) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_all)."""
        white = y[:, self.n_others :]
        return self.surrogate.log_prob(y[:, : self.n_others]) - 0.5 * np.einsum("ij,ij->i", white, white)

    def walks(self) -> tuple[partial, list[partial]]:
        """A short walk that leaves it invariant, and long ones; each moves the others, and then y."""
        short, long = self.surrogate.walks()
        return partial(self._walk, short, _SHORTER * self.step), [partial(self._walk, walk, self.step) for walk in long]

    def _walk(self, walk, step, coords, random, taken):
        others, white = coords[:, : self.n_others], coords[:, self.n_others :]
        others, *_ = walk(others, random, taken)
        white = np.sqrt(1.0 - step**2) * white + step * random.standard_normal(white.shape)
        moved = np.hstack([others, white[taken]])
        return moved, self.log_prob(moved)


def with_process(problem: Forced, mode: Estimate) -> np.ndarray:
    """(n_all,) all parameters: the mode of the problem with a wide process, and that process.

    There is no mode of the process and the histories together: with ever larger sds the latter need ever less. And with
    too small ones a search ends at local modes, because the histories cannot follow the motion.
    """
    values = problem.prior.parameters(np.zeros(problem.n_params))
    places = {name: k for k, name in enumerate(problem.names)}
    values[[places[name] for name in mode.names]] = mode.values
    for history in problem.histories:
        values[history.process] = history.wide_process
    return values


@threadpoolctl.threadpool_limits.wrap(1, "blas")  # its threads wait for those that solve members
def marginal_mode(problem: Forced, mode: np.ndarray) -> tuple[Marginalised, np.ndarray]:
    """The marginalised problem, expanded at its own mode, and that (n_params,), from all parameters near the mode.

    With the response to forces at one place, it is wrong at others and rises to a boat without mass; so it is exact.
    """
    exact = Marginalised(problem, mode, exact=True)
    values = gauss_newton(exact, exact.centre[exact.others], tolerance=_TOLERANCE).values
    return Marginalised(problem, exact.full(values)), values


def search_marginal_mode(problem: Forced, smooth: Forced, rng: np.random.Generator) -> tuple[Marginalised, np.ndarray]:
    """The marginal mode of the smooth problem, from the posterior mode of the problem with a wide process."""
    return marginal_mode(smooth, with_process(problem, posterior_mode(problem.with_wide_process(), rng=rng)))


def foretold_seconds(problem: Forced) -> float:
    """About how long sampling takes, s, measured in a second at the middle of the prior."""
    marginalised = Marginalised(problem, problem.prior.parameters(np.zeros(problem.n_params)))
    others = np.repeat(marginalised.centre[None, marginalised.others], _TRIED, axis=0)
    white = np.zeros((_TRIED, len(marginalised.white)))
    marginalised.density(problem, others, white)  # compiled on first use
    began = time.perf_counter()
    marginalised.density(problem, others, white)
    return (time.perf_counter() - began) / _TRIED * _EVALUATIONS


def learn_with_histories(
    marginalised: Marginalised, others: np.ndarray, rng: np.random.Generator, progress: Progress | None
) -> tuple[HistoryGeometry, HistorySurrogate, np.ndarray]:
    """Sampling coordinates, a surrogate, and draws (n, n_others) of it, of a marginalised problem and its mode."""
    geometry = Geometry.whitened(marginalised, others)

    def adapt(draws):
        marginalised.fit(rng.permutation(draws)[: marginalised.n_draws], rng)

    surrogate, draws = learn(marginalised, geometry, rng, progress, adapt)
    histories = HistoryGeometry(geometry, marginalised)
    return histories, HistorySurrogate(surrogate, _step(histories, draws, rng)), draws


def _step(geometry, draws, rng) -> float:
    """The step in y that leads farthest, by what is accepted of it at draws (n, n_others) of the surrogate."""
    others = rng.permutation(draws)[:_TRIED]
    n_white = len(geometry.marginalised.white)
    white, shocks = rng.standard_normal((2, len(others), n_white))
    problem, best = geometry.marginalised.problem, (0.0, _STEPS[-1])

    def excess(y):
        return geometry.log_prob(problem, np.hstack([others, y])) + 0.5 * np.einsum("ij,ij->i", y, y)

    before = excess(white)
    for step in _STEPS:
        gains = excess(np.sqrt(1.0 - step**2) * white + step * shocks) - before
        accepted = np.mean(np.exp(np.minimum(np.nan_to_num(gains, nan=-np.inf), 0.0)))
        best = max(best, (accepted * step**2, step))
        if step**2 < best[0]:  # no shorter one leads as far
            break
    return best[1]
