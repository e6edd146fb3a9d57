"""Sequential quadratic programming on the track, the thesis's method (chapter 7), from random starts."""

from collections.abc import Collection
from typing import Any

import numpy as np
from scipy import optimize

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.starts import Normalised, search_from
from bayesub.inference.interface import LeastSquares, Progress
from bayesub.io.arguments import checked
from bayesub.io.errors import InputError

BOUNDS = 0.75  # half width of the search in the unknowns, unless another is asked for
_STEP = float(np.sqrt(np.finfo(float).eps))  # of forward differences, in unknowns of order one
_LEAST = np.finfo(float).tiny  # the logarithm of a cost below it is round-off
_TOLERANCE = 1e-10  # change of the logarithm of the cost at which SLSQP stops
_REMEDIES = {8: "the gradient is round-off: use exact gradients", 9: "raise max_iterations"}  # by status of SLSQP


@checked
def sqp(
    problem: LeastSquares,
    *,
    rng: np.random.Generator,
    informed: Collection[str] = (),
    n_starts: int = 5,
    start_spread: float = 0.10,
    bounds: float = BOUNDS,
    gradients: str = "exact",
    tolerances: tuple[float, float] | None = None,
    max_iterations: int = 200,
    progress: Progress | None = None,
) -> Estimate:
    """Minimise the logarithm of the sum of squared residuals by SciPy's SLSQP, from starts that advance side by side.

    The unknowns are x_i = xi_i / guess_i with the prior mean as the guess; the starts are uniform within ``1 +-
    start_spread`` and the bounds ``1 +- bounds`` (thesis section 7.4). On the sum of squares itself SLSQP's line search
    fails at once, because it spans ten decades; its logarithm is what works. A simulation that fails costs infinity:
    the line search steps back from it ten-fold. With sensors whose standard deviations are 1 m and 1 degree the sum of
    squares is the thesis's cost function (model manual, section 10), and the cost of the estimate.

    Parameters
    ----------
    rng : source of the starts
    informed : names of parameters, such as currents and clocks, whose priors count as residuals and that are searched
        in units of these (:class:`bayesub.inference.baselines.starts.Normalised`): the starts are uniform within 0.4
        prior standard deviations, and the bounds three
    start_spread : half width of the starts in the unknowns
    bounds : half width of the bounds in the unknowns
    gradients : "exact" from the Jacobian of the problem, or "forward" differences as in the thesis
    tolerances : (parTol, funcTol) of the thesis, which had (0.1, 0.01): also stop when no unknown changes by parTol
        in an iteration and the gradient predicts a change of the cost below funcTol for it (section 7.2.2)
    max_iterations : of each search
    progress : object with ``update(done, total, unit)``, called with the number of finished starts; or None
    """
    if gradients not in ("exact", "forward"):
        raise InputError(f"unknown gradients '{gradients}': expected exact or forward", "unknown", "gradients")
    unknowns = Normalised(problem, informed)
    limits = optimize.Bounds(*np.full((2, problem.n_params), [[1.0 - bounds], [1.0 + bounds]]))

    def search(start, ask):
        watch = _Watch(ask, tolerances, start)
        try:
            settings: dict[str, Any] = {"options": {"maxiter": max_iterations, "ftol": _TOLERANCE}, "method": "SLSQP"}
            result = optimize.minimize(watch.objective, start, jac=watch.gradient, bounds=limits, **settings)
        except _Stop:
            return watch.best[1], "stopped by the tolerances"
        remedy = _REMEDIES.get(result.status)
        return watch.best[1], f"{result.message.strip().rstrip('.')}{f'; {remedy}' if remedy else ''}"

    def answers(questions):
        return _answer(unknowns, questions, gradients)

    starts = unknowns.draw(rng, n_starts, start_spread)
    return search_from(starts, search, answers, method="SQP", unknowns=unknowns, progress=progress)


class _Stop(Exception):
    """The thesis's stopping rule is met."""


class _Watch:
    """The objective and gradient of one search, its best point so far, and the thesis's stopping rule.

    SciPy asks for a gradient once an iteration, at the point that the iteration accepted.
    """

    def __init__(self, ask, tolerances, start):
        self.ask, self.tolerances = ask, tolerances
        self.best = (np.inf, start)
        self.previous: tuple[np.ndarray, np.ndarray] | None = None

    def objective(self, x: np.ndarray) -> float:
        """The logarithm of the cost."""
        value, _ = self.ask((x.copy(), False))
        if value < self.best[0]:
            self.best = (value, x.copy())
        return value

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Its derivatives, or the end of the search by the rule of the thesis."""
        if self.tolerances is not None and self.previous is not None:
            step = x - self.previous[0]
            predicted = abs(self.previous[1] @ step)
            if np.abs(step).max() < self.tolerances[0] and predicted < self.tolerances[1]:
                raise _Stop
        value, slope = self.ask((x.copy(), True))
        self.previous = (x.copy(), np.exp(value) * slope)
        return slope


def _answer(unknowns, questions, gradients):
    """Questions (x, wanted) -> ((logarithm of the cost, its gradient if wanted), effort)."""
    if gradients == "exact":
        values = unknowns.residuals(np.array([x for x, _ in questions]))
        replies = []
        for (x, wanted), residuals in zip(questions, values, strict=True):
            cost = residuals @ residuals
            finite, least = np.isfinite(cost), max(cost, _LEAST)
            slope = 2.0 / least * (unknowns.jacobian(x).T @ residuals) if finite and wanted else np.zeros_like(x)
            replies.append(((np.log(least) if finite else np.inf, slope), 2 if finite and wanted else 1))
        return replies
    stencil = np.vstack([np.zeros(len(unknowns.guess)), _STEP * np.eye(len(unknowns.guess))])
    points = [x + stencil if wanted else x[None] for x, wanted in questions]
    logs = np.log(np.maximum(unknowns.costs(np.concatenate(points)), _LEAST))
    replies = []
    for values in np.split(logs, np.cumsum([len(p) for p in points])[:-1]):
        # A neighbour that fails where the point does not says nothing about the slope.
        rise = np.where(np.isfinite(values[1:]), values[1:] - values[0], 0.0)
        replies.append(((values[0], rise / _STEP), len(values)))
    return replies
