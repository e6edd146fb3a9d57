"""Trust-region least squares on the readings: what a user would choose today."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy import optimize

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.starts import Normalised, search_from
from bayesub.inference.identifiability.linalg import complete_svd
from bayesub.inference.identifiability.null_space import null_space
from bayesub.inference.interface import Identifiable, Progress
from bayesub.io.arguments import checked


@checked
def trust_region(
    problem: Identifiable,
    *,
    rng: np.random.Generator,
    informed: Collection[str] = (),
    n_starts: int = 1,
    start_spread: float = 0.10,
    bounds: float | None = 0.75,
    max_iterations: int = 200,
    progress: Progress | None = None,
) -> Estimate:
    """Minimise the sum of squared residuals by Gauss-Newton steps within a trust region and bounds (SciPy's "trf").

    Unknowns, starts and bounds are those of :func:`bayesub.inference.baselines.sqp`; `bounds` may be None. The prior
    enters only as their scale, in which the trust region is a sphere: directions in which the track says little move
    last. The search goes on until steps are round-off, because the last digits of the coefficients are in the last
    digits of the track. A simulation that fails shrinks the trust region four-fold.

    `bounds` are half the width of the bounds in the unknowns, `max_iterations` are evaluations of each search, and the
    other arguments are as of sqp. The best solution is the first; the cost is the sum of squared residuals. The
    covariance is ``(J'J)^-1`` at the best solution. It is None where the problem has null directions, or J lacks rank.
    """
    unknowns = Normalised(problem, informed)
    limits = (-np.inf, np.inf) if bounds is None else (1.0 - bounds, 1.0 + bounds)

    def search(start, ask):
        options = {"bounds": limits, "ftol": None, "gtol": None, "xtol": 1e-15, "max_nfev": max_iterations}
        misfit, slopes = (lambda x: ask((x.copy(), False))), (lambda x: ask((x.copy(), True)))
        result = optimize.least_squares(misfit, start, slopes, **options)
        remedy = "; raise max_iterations" if result.status == 0 else ""
        return result.x, f"{result.message.strip().rstrip('.')}{remedy}"

    def answers(questions):
        wanted = [x for x, jacobian in questions if not jacobian]
        residuals = iter(unknowns.residuals(np.array(wanted)) if wanted else ())
        return [(unknowns.jacobian(x) if jacobian else next(residuals), 1) for x, jacobian in questions]

    starts = unknowns.draw(rng, n_starts, start_spread)
    estimate = search_from(
        starts, search, answers, method="trust-region least squares", unknowns=unknowns, progress=progress
    )
    if len(null_space(problem, estimate)):
        return estimate
    x = unknowns.unknowns(estimate.values)
    return replace(estimate, covariance=_covariance(unknowns.jacobian(x), unknowns.scales(x)))


@np.errstate(over="ignore", invalid="ignore")  # squares of what runs away
def _covariance(jacobian, scales):
    """(J'J)^-1 in coefficients, or None where a singular value of the equilibrated J is round-off."""
    lengths = np.linalg.norm(jacobian, axis=0)
    if not lengths.all():
        return None
    _, s, vt = complete_svd(jacobian / lengths)
    if s[-1] <= max(jacobian.shape) * np.finfo(float).eps * s[0]:
        return None
    inverse = (vt.T / s) * (scales / lengths)[:, None]
    return inverse @ inverse.T
