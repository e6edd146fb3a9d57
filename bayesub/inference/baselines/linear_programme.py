"""Linear programming on the equations of motion (thesis section 9.3): the smallest largest residual, axis by axis."""

import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from scipy import optimize

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.linear_least_squares import estimate, scaled
from bayesub.inference.identifiability.linalg import complete_svd
from bayesub.inference.interface import LinearForm
from bayesub.io.errors import InputError

_TOLERANCE = 1e-10  # the tightest that HiGHS takes, on rows and columns of order one
_EXACT = 1e-6  # data whose residuals come down to this are so exact that the tolerance of HiGHS shows
_REFINEMENTS = 2
_METHODS = ("highs-ipm", "highs-ds", "highs")  # in this order, until one of them finds the optimum
_NULL = 1e-12  # singular value over the largest below which a direction of an axis is not determined
_INFEASIBLE, _UNBOUNDED = 2, 3


def linear_programme(
    systems: Mapping[str, LinearForm],
    guess: dict[str, float],
    *,
    held: Iterable[str] = (),
    bounds: dict[str, tuple[float | None, float | None]] | None = None,
    constraints: Iterable[tuple[dict[str, float], float]] = (),
) -> Estimate:
    """Minimise the largest absolute residual of ``matrix @ xi = load`` of each axis.

    The programme is ``min t, -t <= row @ z - load <= t`` for every row, solved by the interior point method of HiGHS
    followed by its crossover to a vertex, and by its simplex methods where that fails. The unknowns z are those in
    which the columns of the matrix are orthogonal and of the same size (from the singular value decomposition), and
    the rows are scaled to a largest load of one: with the coefficients themselves as unknowns the condition number of
    an axis is 1e5, and on which processors the interior point method then succeeds is a matter of rounding. On data
    without noise the tolerance of HiGHS would cost digits, so that the programme is solved again for what the first
    solution leaves (iterative refinement; Gleixner, Steffy & Wolter 2016).

    `systems`, `guess` and `held` are as of :func:`bayesub.inference.baselines.linear_least_squares`; `bounds` are
    coefficient name -> (low, high), either of them None for no bound. In each pair (weights, upper) of the
    `constraints`, the sum of weight * coefficient over weights, whose names are of one axis, is at most upper.

    The cost of the Estimate is the largest residual relative to the largest load, largest over the axes. Where the rank
    is deficient the solution stays at the guess along what is not determined, unless bounds or constraints forbid it:
    hold an added mass of the axis. The coefficients of an axis that has no solution are not a number, the cost is then
    infinite, and the status says why.
    """
    began = time.perf_counter()
    constraints = list(constraints)
    forms = scaled(systems, guess, held)
    names = [name for form in forms for name in form.names]
    for weights, _ in constraints:
        axes = {form.axis for form in forms if weights.keys() & set(form.names)}
        if len(axes) != 1 or not weights.keys() <= set(names):
            text = f"constraint on {', '.join(weights)}: name coefficients of one axis that are not held"
            raise InputError(text, "conflict", "constraints")
    values, costs, statuses = [], [], []
    for form in forms:
        solution, cost, status = _solve(form, bounds or {}, [c for c in constraints if c[0].keys() & set(form.names)])
        values.append(solution)
        costs.append(cost)
        statuses += [status] if status else []
    return estimate("linear programming", forms, values, costs, "; ".join(statuses) or "optimal", None, began)


def _solve(form, bounds, constraints):
    """Coefficients of an axis, its largest residual relative to its largest load, and why there are none, or ""."""
    whole = np.abs(form.load + form.matrix @ (form.centre * form.lengths)).max()
    values, residuals = form.centre, form.load
    for refinement in range(_REFINEMENTS + 1):
        size = np.abs(residuals).max()
        result, step = _programme(form, values, residuals, bounds, constraints)
        if step is None:
            if refinement:  # what is to be refined is a solution
                break
            impossible = result.status in (_INFEASIBLE, _UNBOUNDED)
            remedy = "relax bounds or constraints" if impossible else "hold a coefficient or give bounds"
            status = f"{form.axis}: no solution: {result.message.strip()}; {remedy}"
            return np.full(len(values), np.nan), np.inf, status
        trial = form.load - form.matrix @ ((values + step - form.centre) * form.lengths)
        if refinement and np.abs(trial).max() > size:
            break
        values, residuals = values + step, trial
        if np.abs(residuals).max() > _EXACT * size:
            break
    return values, np.abs(residuals).max() / whole, ""


def _programme(form, values, load, bounds, constraints):
    """The result of HiGHS and the change of `values` (n_columns,) that makes the largest residual smallest, or None."""
    unit = np.abs(load).max() or 1.0
    u, s, vt = complete_svd(form.matrix)
    s = np.where(s > _NULL * s[0], s, np.inf)  # along the others nothing changes the residuals
    size = np.sqrt(len(u))  # of a column of entries of order one
    matrix, load = size * u * np.isfinite(s), load / unit
    reach = np.where(np.isfinite(s), size / s, 1.0)
    back = unit * vt.T * reach / form.lengths[:, None]  # change of the coefficients per unknown of the programme
    one = np.ones((len(matrix), 1))
    rows, uppers = [np.hstack([matrix, -one]), np.hstack([-matrix, -one])], [load, -load]
    # Weights (n_columns,) of a sum of coefficients, and its upper limit: of each constraint and each bound.
    limits = [(np.array([weights.get(name, 0.0) for name in form.names]), upper) for weights, upper in constraints]
    for k, name in enumerate(form.names):
        signed = zip((-1.0, 1.0), bounds.get(name, (None, None)), strict=True)
        limits += [(sign * np.eye(len(form.names))[k], sign * limit) for sign, limit in signed if limit is not None]
    for weights, upper in limits:
        row = weights @ back
        largest = np.abs(row).max()
        rows.append(np.append(row / largest, 0.0)[None])
        uppers.append([(upper - weights @ values) / largest])
    given: dict[str, Any] = {"A_ub": np.concatenate(rows), "b_ub": np.concatenate(uppers)}
    given |= {"bounds": [*[(None, None)] * matrix.shape[1], (0.0, None)]}
    given |= {"options": {f"{kind}_feasibility_tolerance": _TOLERANCE for kind in ("primal", "dual")}}
    for method in _METHODS:
        result = optimize.linprog(np.append(np.zeros(matrix.shape[1]), 1.0), method=method, **given)
        if result.status == 0:
            return result, back @ result.x[:-1]
        if result.status == _INFEASIBLE:
            break
    return result, None
