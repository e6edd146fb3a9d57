"""The profile likelihood of a coefficient, which shows a flat valley for what it is (Raue et al. 2009)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from bayesub.inference.identifiability.linalg import null_basis, orthonormal, split_svd
from bayesub.inference.identifiability.null_space import null_vectors
from bayesub.inference.interface import Identifiable, PointEstimate, parameter_vector

LEVEL_95 = float(stats.chi2.ppf(0.95, 1))  # likelihood-ratio interval of one coefficient
_DAMPING = np.concatenate([[0.0], 10.0 ** np.arange(-6.0, 9.0, 1.5)])
_TOLERANCE = 1e-3  # stop when a step gains, or promises, less than this of the rise, or of the level if that is lower
_FLAT = 1e-7  # a rise below this is flat
_MAX_ITERATIONS = 15


@dataclass(frozen=True)
class Profile:
    """-2 log likelihood along one coefficient, the others at their best.

    Attributes
    ----------
    name : the coefficient
    value : where it is best
    grid : (n_grid,) values
    cost : (n_grid,) rise of -2 log likelihood (with the prior, if asked) above its value at the best; not a number
        beyond a value at which no simulation completes
    laplace : (n_grid,) the same of the Gaussian approximation at the best, a parabola, or zero in a null direction
    path : (n_grid, n_params) the parameters at the best of each value
    """

    name: str
    value: float
    grid: np.ndarray
    cost: np.ndarray
    laplace: np.ndarray
    path: np.ndarray

    def interval(self, level: float = LEVEL_95) -> tuple[float, float]:
        """Ends of the likelihood-ratio interval, infinite where the grid does not reach it.

        Between grid values the root of the cost is interpolated, which is exact for a parabola.
        """
        ends = []
        for side in (-1, 1):
            outwards = np.argsort(side * self.grid)
            outwards = outwards[side * (self.grid[outwards] - self.value) >= 0]
            grid = np.concatenate([[self.value], self.grid[outwards]])
            root = np.sqrt(np.maximum(np.concatenate([[0.0], self.cost[outwards]]), 0.0))
            above = np.flatnonzero(root > np.sqrt(level))
            if above.size:
                k = above[0]
                ends.append(np.interp(np.sqrt(level), root[k - 1 : k + 1], grid[k - 1 : k + 1]))
            else:
                ends.append(side * np.inf)
        return float(ends[0]), float(ends[1])


def profile(
    problem: Identifiable,
    at: PointEstimate | ArrayLike,
    name: str,
    grid: ArrayLike,
    *,
    null: Iterable[dict[str, float]] | None = None,
    prior: bool = False,
) -> Profile:
    """Profile of one coefficient over `grid`, marching outwards from the best with warm starts.

    At each value the others are brought to their best by Gauss-Newton steps. The prior takes no part unless asked. A
    direction in which the others are null is not moved along at all, and in sloppy ones a ladder of dampings, tried in
    one batch of simulations, keeps a step within reach. A coefficient with a part in the null space takes the others
    along in it, and the simulations say whether the valley is as flat as the equations have it.

    Parameters
    ----------
    at : Estimate or parameter vector (n_params,) of the best fit: of the likelihood, or with `prior` the posterior mode
    name : the coefficient
    grid : (n_grid,) values of the coefficient
    null : null vectors, as in :func:`bayesub.inference.identifiability.fisher`; by default those of the problem
    prior : whether the prior takes part; nothing is null then
    """
    parameters = parameter_vector(at)
    grid = np.asarray(grid, dtype=float)
    search = _Search(
        problem, problem.names.index(name), () if prior else null_vectors(problem, parameters, null), prior
    )
    best = (parameters - problem.prior.mean) / problem.prior.sd
    reference, curvature = search.cost(best[None])[0], search.curvature(best)
    targets = (grid - problem.prior.mean[search.k]) / problem.prior.sd[search.k]
    cost, path = np.full(len(grid), np.nan), np.full((len(grid), problem.n_params), np.nan)
    offsets = targets - best[search.k]
    for side in (-1, 1):
        t = best
        for i in sorted(np.flatnonzero(side * offsets >= 0), key=lambda i: abs(offsets[i])):
            t, value = search.best_at(t, targets[i], reference)
            if not np.isfinite(value):
                break
            cost[i], path[i] = value - reference, problem.prior.mean + problem.prior.sd * t
    return Profile(name, float(parameters[search.k]), grid, cost, curvature * offsets**2, path)


class _Search:
    """Best values of all but coefficient k, in prior-scaled coordinates t."""

    def __init__(self, problem, k, null, prior):
        self.problem, self.k, self.prior = problem, k, prior
        self.others = np.delete(np.arange(problem.n_params), k)
        basis = null_basis(problem.names, null, problem.prior.sd)
        # The null directions of all that do not move coefficient k, as directions of the others.
        self.null, column = np.delete(basis, k, axis=1), basis[:, k]
        if np.any(column):
            turn = np.linalg.qr(column[:, None], mode="complete")[0][:, 1:]
            rows = turn.T @ self.null
            self.null = orthonormal(rows) if len(rows) else rows
        # The shortest way along the null space that moves coefficient k by one.
        part = basis[:, k] @ basis[:, k]
        self.along = basis[:, k] @ basis / part if part > 0.0 else None

    def residuals(self, t: np.ndarray) -> np.ndarray:
        residuals = self.problem.residuals(self.problem.prior.mean + self.problem.prior.sd * t)
        return np.hstack([residuals, t]) if self.prior else residuals

    def jacobian(self, t: np.ndarray) -> np.ndarray:
        jacobian = self.problem.jacobian(self.problem.prior.mean + self.problem.prior.sd * t) * self.problem.prior.sd
        return np.vstack([jacobian, np.eye(self.problem.n_params)]) if self.prior else jacobian

    def cost(self, t: np.ndarray) -> np.ndarray:
        residuals = self.residuals(t)
        cost = np.einsum("ij,ij->i", residuals, residuals)
        return np.where(np.isnan(cost), np.inf, cost)

    def _linear(self, t):
        """Residuals, sensitivity to coefficient k, and the decomposition of that to the others without their null.

        The readings are rotated so that at most n_params + 1 of them are left; lengths and angles stay. Directions
        whose singular value is round-off are left out like null ones: a step along them would be round-off over
        round-off, so long that the readings themselves are lost in the rounding of the parameters.
        """
        jacobian = self.jacobian(t)
        rows = np.asarray(np.linalg.qr(np.column_stack([jacobian, self.residuals(t[None])[0]]), mode="r"))
        u, s, vt = split_svd(rows[:, self.others], self.null)
        s = s[: len(s) - len(self.null)]
        informed = np.flatnonzero(s > len(jacobian) * np.finfo(float).eps * s.max(initial=0.0))
        return rows[:, -1], rows[:, self.k], u[:, informed], s[informed], vt[informed]

    def curvature(self, t: np.ndarray) -> float:
        """Second derivative of the profile over two: what of the sensitivity the others cannot imitate, squared."""
        if self.along is not None:
            return 0.0
        _, column, u, _, _ = self._linear(t)
        rest = column - u @ (u.T @ column)
        return rest @ rest

    def best_at(self, t: np.ndarray, target: float, reference: float) -> tuple[np.ndarray, float]:
        """Best t with ``t[k] = target`` from a nearby best t, and its cost (infinite if no simulation completes).

        The search ends when little of the rise above the cost `reference` is left to gain.
        """
        if self.along is not None:
            t = t + self.along * (target - t[self.k])
            return t, self.cost(t[None])[0]
        residuals, column, u, s, vt = self._linear(t)
        # Along the tangent of the path to the new value; from there on the readings say what is left.
        residuals = residuals + column * (target - t[self.k])
        t, cost = np.where(np.arange(len(t)) == self.k, target, t), np.inf
        for _ in range(_MAX_ITERATIONS):
            gains = s / (s**2 + _DAMPING[:, None])
            trials = np.repeat(t[None], len(_DAMPING), axis=0)
            trials[:, self.others] -= (gains * (u.T @ residuals)) @ vt
            costs = self.cost(trials)
            best = np.argmin(costs)
            gained = cost - costs[best]
            if not gained > 0.0:
                break
            t, cost = trials[best], costs[best]
            enough = _TOLERANCE * np.clip(cost - reference, _FLAT, LEVEL_95)
            residuals, _, u, s, vt = self._linear(t)
            if gained < enough or np.sum((u.T @ residuals) ** 2) < enough:
                break
        return t, cost
