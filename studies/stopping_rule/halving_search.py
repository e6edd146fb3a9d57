"""The SQP search of thesis section 7.2.2 as its text has it: halved steps, and a rule on the step of the programme.

:func:`bayesub.inference.baselines.sqp` is SciPy's search with the same two tolerances. Here are, each an option, the
parts that the text gives and that a library decides otherwise.
"""

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.starts import Normalised, search_from
from bayesub.problem.problem import Problem

CRASHED = 1e12  # cost of a simulation that fails (section 7.2.2; its exponent is garbled), above that of any start
SMALLEST = 1e-6  # fraction of the step below which the direction is reversed (its exponent is garbled)
STUCK = 1e-12  # fraction at which the thesis's loop would go on for ever (section 7.7.3)
EPSILON = float(np.finfo(float).eps)
SOLVED, LIMIT, LOOP = "stopped by the tolerances", "iteration limit", "endless line search"


@dataclass(frozen=True)
class Reading:
    """A reading of section 7.2.2.

    Attributes
    ----------
    tolerances : tuple of float
        parTol in units of the normalised coefficients, and funcTol in m^2 + deg^2.
    difference : float
        Step of the forward differences in units of the normalised coefficients, which the text calls small.
    logarithm : bool
        Whether the logarithm of the cost is minimised instead of the cost; the rule is on the cost in both.
    accepted : bool
        Whether the rule is on the step that the line search accepts, instead of on that of the quadratic programme.
    max_iterations : int
    """

    tolerances: tuple[float, float] = (0.1, 0.01)
    difference: float = 1e-10
    logarithm: bool = False
    accepted: bool = False
    max_iterations: int = 500


def search(
    problem: Problem, starts: np.ndarray, reading: Reading, bounds: float = 0.75, history: list[float] | None = None
) -> Estimate:
    """Search from every start.

    Parameters
    ----------
    problem : Problem
        Whose sum of squared residuals is the cost.
    starts : (n_starts, n_params) array
        Ratios to the prior mean.
    reading : Reading
    bounds : float
        Half width of the bounds in the same ratios.
    history : list of float, optional
        Is extended by the cost of every evaluation, in order if there is one start.

    Returns
    -------
    Estimate
        Best solution first; its statuses are SOLVED, LIMIT or LOOP.
    """
    unknowns = Normalised(problem)
    stencil = np.vstack([np.zeros(problem.n_params), reading.difference * np.eye(problem.n_params)])

    def answers(questions):
        points = [x + stencil if wanted else x[None] for x, wanted in questions]
        costs = unknowns.costs(np.concatenate(points))
        costs = np.where(np.isfinite(costs), costs, CRASHED)
        if history is not None:
            history.extend(costs.tolist())
        return [(v, len(v)) for v in np.split(costs, np.cumsum([len(p) for p in points])[:-1])]

    def one(start, ask):
        return _search(start, ask, reading, (1.0 - bounds, 1.0 + bounds))

    return search_from(starts, one, answers, method="SQP, halved steps", unknowns=unknowns)


def _search(x, ask, reading, limits):
    hessian, previous = None, None
    for _ in range(reading.max_iterations):
        costs = ask((x, True))
        gradient = (costs[1:] - costs[0]) / reading.difference
        slope = gradient / costs[0] if reading.logarithm else gradient
        hessian = np.eye(len(x)) if previous is None else _updated(hessian, x - previous[0], slope - previous[1])
        step = _programme(hessian, slope, limits[0] - x, limits[1] - x)
        fraction = _line_search(x, step, costs[0], ask)
        if fraction is None:
            return x, LOOP
        previous, x = (x, slope), np.clip(x + fraction * step, *limits)
        moved = fraction * step if reading.accepted else step
        if np.abs(moved).max() < reading.tolerances[0] and abs(gradient @ moved) < reading.tolerances[1]:
            return x, SOLVED
    return x, LIMIT


def _line_search(x, step, cost, ask):
    """The fraction of the step with the same or a lower cost; None if the thesis's loop would not end."""
    fraction = 1.0
    while ask((x + fraction * step, False))[0] > cost:
        fraction /= 2.0
        if abs(fraction) < STUCK:
            return None
        if fraction < SMALLEST:
            fraction = -fraction
    return fraction


def _updated(hessian, moved, change):
    """BFGS, damped so that the matrix stays positive definite (Fletcher 1987, after Powell)."""
    product = hessian @ moved
    curvature, least = moved @ change, 0.2 * (moved @ product)
    if least <= 0.0:
        return hessian
    if curvature < least:
        share = 4.0 * least / (5.0 * least - curvature)
        change = share * change + (1.0 - share) * product
    return hessian - np.outer(product, product) / (moved @ product) + np.outer(change, change) / (moved @ change)


def _programme(hessian, slope, low, high):
    """The step within its limits that minimises the quadratic model."""
    sizes, axes = np.linalg.eigh(hessian)
    root = np.sqrt(np.maximum(sizes, EPSILON * sizes[-1]))
    step = -axes @ ((axes.T @ slope) / root**2)
    if np.all(step >= low) and np.all(step <= high):
        return step
    limits = np.minimum(low, -EPSILON), np.maximum(high, EPSILON)
    return optimize.lsq_linear(root[:, None] * axes.T, -(axes.T @ slope) / root, limits, method="bvls").x
