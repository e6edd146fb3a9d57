"""Sampling coordinates of problems with histories: those of the other parameters, and after them y.

The others have the geometry and the surrogate of the collapsed problem (:mod:`bayesub.inference.sampling.collapsed`); y
is standard normal for the surrogate, and a step of the sampler moves both.
"""

from functools import partial

import numpy as np
import threadpoolctl

from bayesub.inference.baselines import Estimate, gauss_newton, posterior_mode
from bayesub.inference.interface import Forced
from bayesub.inference.sampling.collapsed import Collapsed
from bayesub.inference.sampling.geometry import Geometry
from bayesub.inference.sampling.moves import crank_nicolson
from bayesub.inference.sampling.surrogate import Surrogate, learn

_EXPANSIONS, _HALVINGS = 12, 6  # on the way to the mode, and of a step
_NEAR = 0.5  # posterior sd from the mode, a parameter
_STEPS = (0.3, 0.6, 1.0)  # of Crank-Nicolson in y
_TOLERANCE = 0.1  # posterior sd, of the search for the mode, which only has to be near


class HistoryGeometry:
    """The map from sampling coordinates to parameters.

    Parameters
    ----------
    geometry : of the others
    collapsed : Collapsed
    """

    def __init__(self, geometry: Geometry, collapsed: Collapsed):
        self.geometry, self.collapsed = geometry, collapsed

    @property
    def blocks(self) -> float:
        """As of :class:`bayesub.inference.sampling.geometry.Geometry`."""
        return self.geometry.blocks

    def evaluated(self, problem, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log posterior densities (n,) in sampling coordinates y (n, n_all), up to a constant; parameters (n, n_all).

        Nothing is simulated outside the support of the prior, and the parameters there are not a number.
        """
        n = self.collapsed.n_params
        x = self.geometry.scaled(self.geometry.bent(y[:, :n]))
        log_prob, parameters = self.geometry.prior.scaled_log_density(x), np.full(y.shape, np.nan)
        inside = np.isfinite(log_prob)
        if inside.any():
            others = self.geometry.prior.unscaled(x[inside])
            density, parameters[inside] = self.collapsed.density(problem, others, y[inside, n:])
            log_prob[inside] += density
        return log_prob, parameters

    def log_prob(self, problem, y: np.ndarray) -> np.ndarray:
        """(n,) log posterior densities, as of :meth:`evaluated`."""
        return self.evaluated(problem, y)[0]

    def arrays(self) -> dict[str, np.ndarray]:
        """What determines the map, to be stored."""
        return self.geometry.arrays() | {"centre": self.collapsed.centre}

    @classmethod
    def restored(cls, problem, arrays: dict[str, np.ndarray]) -> "HistoryGeometry":
        """The map that :meth:`arrays` describe, bit for bit."""
        collapsed = Collapsed(problem, arrays["centre"])
        return cls(Geometry.restored(collapsed.prior, arrays), collapsed)


class HistorySurrogate:
    """A surrogate of the density of the others, times a standard normal one of y."""

    def __init__(self, surrogate: Surrogate):
        self.surrogate, self.n_others = surrogate, surrogate.geometry.n_params

    def arrays(self) -> dict[str, np.ndarray]:
        """What it consists of besides its geometry, to be stored."""
        return self.surrogate.arrays()

    def log_prob(self, y: np.ndarray) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_all)."""
        white = y[:, self.n_others :]
        return self.surrogate.log_prob(y[:, : self.n_others]) - 0.5 * np.einsum("ij,ij->i", white, white)

    def walks(self) -> tuple:
        """Walks that leave it invariant, as :meth:`bayesub.inference.sampling.surrogate.Surrogate.walks`."""
        short, long = self.surrogate.walks()
        return partial(self._walk, short), [partial(self._walk, walk) for walk in long]

    def _walk(self, walk, coords, random, taken):
        others, white = coords[:, : self.n_others], coords[:, self.n_others :]
        others, *_ = walk(others, random, taken)
        white, *_ = crank_nicolson(_normal, white, _normal(white), random, steps=_STEPS, n_sweeps=1)
        moved = np.hstack([others, white[taken]])
        return moved, self.log_prob(moved)


def _normal(y):
    return -0.5 * np.einsum("ij,ij->i", y, y)


def with_process(problem: Forced, mode: Estimate) -> np.ndarray:
    """(n_all,) all parameters, of the mode (an estimate) of the problem with a wide process, and that process.

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
def marginal_mode(problem: Forced, mode: np.ndarray) -> tuple[Collapsed, np.ndarray]:
    """The collapsed problem, expanded near its own mode, and that (n_params,), from all parameters near the mode.

    Far from where it was expanded a collapsed density is wrong, and its mode may be far away. Therefore each place on
    the way is judged by the expansion about itself, and a step that leads to less is halved.
    """
    collapsed = Collapsed(problem, mode)
    x = collapsed.prior.scaled(collapsed.centre[collapsed.others])
    height, share = _log_density(collapsed, x), 1.0
    for _ in range(_EXPANSIONS):
        estimate = gauss_newton(collapsed, collapsed.prior.unscaled(x), tolerance=_TOLERANCE)
        lower = np.linalg.cholesky(estimate.covariance)
        moved = np.linalg.solve(lower, estimate.values - collapsed.prior.unscaled(x))
        if np.linalg.norm(moved) < _NEAR * np.sqrt(len(moved)):
            return Collapsed(problem, collapsed.full(estimate.values)), estimate.values
        step = collapsed.prior.scaled(estimate.values) - x
        for share in min(1.0, 2.0 * share) * 0.5 ** np.arange(_HALVINGS):  # noqa: B020
            there = Collapsed(problem, collapsed.full(collapsed.prior.unscaled(x + share * step)))
            reached = _log_density(there, x + share * step)
            if reached > height:
                break
        else:
            break
        collapsed, x, height = there, x + share * step, reached
    return collapsed, collapsed.prior.unscaled(x)


def _log_density(collapsed, x) -> float:
    """Log posterior density at scaled coordinates x (n_params,), minus infinity where it cannot be computed."""
    log_likelihood = collapsed.log_likelihood(collapsed.prior.unscaled(x[None]))
    return float((log_likelihood + collapsed.prior.scaled_log_density(x[None]))[0])


def searched(problem: Forced, smooth: Forced, rng: np.random.Generator) -> tuple[Collapsed, np.ndarray]:
    """As :func:`marginal_mode` of the smooth problem, from the posterior mode of a problem with a wide process."""
    return marginal_mode(smooth, with_process(problem, posterior_mode(problem.with_wide_process(), rng=rng)))


def straightened(
    collapsed: Collapsed, others: np.ndarray, rng, progress
) -> tuple[HistoryGeometry, HistorySurrogate, np.ndarray]:
    """Sampling coordinates, a surrogate, and draws (n, n_others) of it, of a collapsed problem and its mode."""
    geometry = Geometry.whitened(collapsed, others)
    surrogate, draws = learn(collapsed, geometry, rng, progress)
    return HistoryGeometry(geometry, collapsed), HistorySurrogate(surrogate), draws
