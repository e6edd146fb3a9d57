"""Gauss-Newton with the prior as extra residuals: the posterior mode and its Laplace approximation."""

from collections.abc import Callable

import numpy as np

from bayesub.inference.baselines.estimate import Estimate, meter
from bayesub.inference.identifiability.linalg import complete_svd, triangle
from bayesub.inference.identifiability.linear_model import LinearModel
from bayesub.inference.interface import Searchable

_SHARES = 0.5 ** np.arange(1, 9)  # of a step with histories of forces
_LONGEST = 1.0  # step of any coordinate; its prior sd is one, and the bounds of a prior are far away and flat
_DAMPING = np.concatenate([[0.0], 10.0 ** np.arange(-4.0, 9.0)])


@np.errstate(over="ignore", invalid="ignore")  # what runs away has an infinite cost, from which a search steps back
def gauss_newton(
    problem: Searchable,
    start: np.ndarray | None = None,
    *,
    tolerance: float = 1e-3,
    max_iterations: int = 60,
    enough: Callable[[float], bool] | None = None,
) -> Estimate:
    """Minimise ``deviance + |t|^2``, minus twice the log posterior but for a constant, by damped Gauss-Newton steps.

    In the coordinates t, in which the prior is standard normal, the residuals have the Jacobian ``U diag(s) V'``, and
    the step with damping ``lam`` is ``-V (s^2 + 1 + lam)^-1 (s U' r + V' t)``. One batch of simulations tries a ladder
    of dampings and the best is taken, so that a bad start costs no more than a good one; no coordinate moves by more
    than a prior standard deviation at a time.

    Where a damped step is the best, the valley is bent and straight steps leave it. To each step d of the ladder is
    then added ``-V (s^2 + 1 + lam)^-1 V' J' b``, with ``b = r(t + d) - r - J d`` what the residuals bend by along it:
    the geodesic acceleration of Transtrum & Sethna (2012), of simulations that are there already. It costs a second
    batch, and on the spiral with uniform priors saves six Jacobians of seven.

    White coordinates of forces take no part in the ladder. They follow each step as fits best, and the step is that of
    the readings without them (:mod:`bayesub.inference.identifiability.linear_model`).

    `start` (n_params,) is by default the middle of the prior. The search stops when an undamped step is shorter than
    `tolerance` posterior standard deviations, or when no step lowers the cost by as much as such a step would: at a
    jump of the forces, undamped steps stay long. It stops too where its cost is `enough`. The Estimate has the
    covariance of the Laplace approximation, of all parameters that are no white coordinates; its cost is the minimised
    sum of squares. ValueError if the start fails.
    """
    spent, prior = meter(problem.costs), problem.prior
    t = np.zeros(problem.n_params) if start is None else prior.standard(np.asarray(start))
    (residuals,), (cost,) = _misfit(problem, t[None])
    status = f"stopped after {max_iterations} iterations; start nearer to the truth or narrow the prior"
    if not np.isfinite(cost):
        raise ValueError("the simulation fails at the start of the search; choose a start that completes the manoeuvre")
    for _ in range(max_iterations):
        linear = LinearModel(problem, t, residuals)
        # Of both together the triangle has all inner products, and a row a parameter where they have one a reading.
        reduced = triangle(np.column_stack([linear.jacobian, linear.residuals]))
        u, s, vt = complete_svd(reduced[:, :-1])
        force = s * (u.T @ reduced[:, -1]) + vt @ t[linear.others]
        if np.sqrt(np.sum(force**2 / (s**2 + 1.0)) + linear.gain) < tolerance or (enough is not None and enough(cost)):
            status = "converged"
            break
        stiffness = s**2 + 1.0 + _DAMPING[:, None]
        steps = _within_reach((-force / stiffness) @ vt)
        ends = linear.after(steps)
        trials = [(ends, *_misfit(problem, ends))]
        if np.argmin(trials[0][2]) > 0:  # a damped step
            kept = np.isfinite(trials[0][2])
            bends = trials[0][1][kept] - linear.expected(steps[kept], ends[kept])
            turned = steps[kept] + _within_reach((-(linear.out(bends) @ linear.jacobian @ vt.T) / stiffness[kept]) @ vt)
            ends = linear.after(turned, bends)
            trials.append((ends, *_misfit(problem, ends)))
        if linear.gain and not min(costs.min() for *_, costs in trials) < cost:  # damping holds no history back
            ends = t + _SHARES[:, None] * (linear.after(steps[:1]) - t)
            trials.append((ends, *_misfit(problem, ends)))
        nearest = min(trials, key=lambda batch: batch[2].min())
        best = np.argmin(nearest[2])
        gain = cost - nearest[2][best]
        if gain > 0.0:
            t, residuals, cost = (part[best] for part in nearest)
        if not gain >= tolerance**2:
            status = "converged to a jump or to round-off"
            break
    of_others = linear.prior
    slopes = of_others.chain(np.eye(len(linear.others)), t[linear.others])
    covariance = slopes @ (vt.T / (s**2 + 1.0)) @ vt @ slopes.T
    found = problem.names, prior.parameters(t)[None], np.array([cost]), (status,), covariance
    return Estimate("Gauss-Newton posterior mode", *found, **spent())


def _within_reach(steps):
    """Steps (n, n_params), shortened to the longest that one may take."""
    return steps * (_LONGEST / np.maximum(_LONGEST, np.abs(steps).max(axis=1, keepdims=True, initial=0.0)))


def _misfit(problem, t):
    """Residuals (n, n_readings) and costs (n,) at t (n, n_params)."""
    residuals, deviances = problem.misfit(problem.prior.parameters(t))
    costs = deviances + np.einsum("ij,ij->i", t, t)
    return residuals, np.where(np.isnan(costs), np.inf, costs)
