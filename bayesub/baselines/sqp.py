"""Sequential quadratic programming on the track, the thesis's method (chapter 7), from random starts."""

import time

import numpy as np
from scipy import optimize

from bayesub.baselines.estimate import Estimate


def sqp(
    problem,
    *,
    rng: np.random.Generator,
    n_starts: int = 5,
    start_spread: float = 0.10,
    bounds: float = 0.75,
    max_iterations: int = 200,
    progress=None,
) -> Estimate:
    """Minimise the logarithm of the sum of squared residuals with SciPy's SLSQP.

    The unknowns are x_i = xi_i / guess_i with the prior mean as the guess, the starts are uniform within
    ``1 +- start_spread`` and the bounds ``1 +- bounds`` (thesis section 7.4). On the sum of squares itself SLSQP's line
    search fails at once, because it spans ten decades; its logarithm is what works.

    Parameters
    ----------
    rng : source of the starts
    progress : called with the number of finished starts

    Returns
    -------
    Estimate, best solution first; the cost is the sum of squared residuals.
    """
    began, evaluations = time.perf_counter(), problem.evaluations
    guess = problem.prior.mean

    def objective(x):
        residuals = problem.residuals((guess * x)[None])[0]
        cost = residuals @ residuals
        if not np.isfinite(cost):
            return np.inf, np.zeros_like(x)
        return np.log(cost), 2.0 / cost * (problem.jacobian(guess * x).T @ residuals) * guess

    results = []
    for n in range(n_starts):
        result = optimize.minimize(
            objective,
            rng.uniform(1.0 - start_spread, 1.0 + start_spread, problem.n_params),
            jac=True,
            method="SLSQP",
            bounds=[(1.0 - bounds, 1.0 + bounds)] * problem.n_params,
            options={"maxiter": max_iterations, "ftol": 1e-10},
        )
        results.append(result)
        if progress is not None:
            progress(n + 1)
    results.sort(key=lambda result: result.fun)
    return Estimate(
        method="SQP",
        names=problem.names,
        solutions=np.array([guess * result.x for result in results]),
        costs=np.exp([result.fun for result in results]),
        statuses=tuple(str(result.message) for result in results),
        covariance=None,
        evaluations=problem.evaluations - evaluations,
        seconds=time.perf_counter() - began,
    )
