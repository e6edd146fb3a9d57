"""Linear programming on the equations of motion (thesis section 9.3): the smallest largest residual, axis by axis."""

import time

import numpy as np
from scipy import optimize

from bayesub.baselines.estimate import Estimate
from bayesub.baselines.scaled_axis import estimate, scaled
from bayesub.io.errors import InputError

_TOLERANCE = 1e-10  # the tightest that HiGHS takes, on rows and columns of order one
_EXACT = 1e-6  # data whose residuals come down to this are so exact that the tolerance of HiGHS shows
_REFINEMENTS = 2


def linear_programme(systems, guess: dict[str, float], *, held=(), bounds=None, constraints=()) -> Estimate:
    """Minimise the largest absolute residual of ``matrix @ xi = load`` of each axis.

    In scaled unknowns z the programme is ``min t, -t <= row @ z - load <= t`` for every row, solved by the interior
    point method of HiGHS followed by its crossover to a vertex: more exact on data without noise than its dual
    simplex. Columns are scaled to a largest entry of one, the rows and the load to a largest load of one. On data
    without noise its tolerance would cost digits, so that the programme is solved again for what the first solution
    leaves (iterative refinement; Gleixner, Steffy & Wolter 2016).

    Parameters
    ----------
    systems : from :func:`bayesub.model.linear_form.linear_systems`
    guess : coefficient name -> value
    held : names of coefficients that keep the value of the guess
    bounds : coefficient name -> (low, high), either of them None for no bound
    constraints : pairs (weights, upper): the sum of weight * coefficient over the dictionary `weights`, which names
        coefficients of one axis, is at most `upper`

    Returns
    -------
    Estimate whose cost is the largest residual relative to the largest load, largest over the axes. Where the rank is
    deficient, any of the best solutions is returned: hold an added mass of the axis.
    """
    began = time.perf_counter()
    forms = scaled(systems, guess, held)
    names = [name for form in forms for name in form.names]
    for weights, _ in constraints:
        axes = {form.axis for form in forms if weights.keys() & set(form.names)}
        if len(axes) != 1 or not weights.keys() <= set(names):
            raise InputError(f"constraint on {', '.join(weights)}: name coefficients of one axis that are not held")
    values, costs, statuses = [], [], []
    for form in forms:
        solution, cost, status = _solve(form, bounds or {}, [c for c in constraints if c[0].keys() & set(form.names)])
        values.append(solution)
        costs.append(cost)
        statuses += [status] if status else []
    return estimate("linear programming", forms, values, costs, "; ".join(statuses) or "optimal", None, began)


def _solve(form, bounds, constraints):
    """Coefficients of an axis, its largest residual relative to its largest load, and what went wrong, if anything."""
    whole = np.abs(form.load + form.matrix @ (form.centre * form.lengths)).max()
    values, status = form.centre, ""
    residuals = form.load
    for _ in range(_REFINEMENTS + 1):
        size = np.abs(residuals).max()
        result, step = _programme(form, values, residuals, bounds, constraints)
        if result.x is None:
            remedy = "relax bounds or constraints" if result.status == 2 else "hold a coefficient or give bounds"
            return values, np.inf, f"{form.axis}: {result.message.strip()}; {remedy}"
        status = "" if result.status == 0 else f"{form.axis}: {result.message.strip()}"
        trial = form.load - form.matrix @ ((values + step - form.centre) * form.lengths)
        if np.abs(trial).max() > size:
            break
        values, residuals = values + step, trial
        if np.abs(residuals).max() > _EXACT * size:
            break
    return values, np.abs(residuals).max() / whole, status


def _programme(form, values, load, bounds, constraints):
    """The result of HiGHS and the change of `values` (n_columns,) that makes the largest residual smallest."""
    peaks, unit = np.abs(form.matrix).max(axis=0), np.abs(load).max() or 1.0
    matrix, load = form.matrix / peaks, load / unit
    factors = unit / (form.lengths * peaks)  # change of a coefficient per unknown of the programme
    one = np.ones((len(matrix), 1))
    rows, uppers = [np.hstack([matrix, -one]), np.hstack([-matrix, -one])], [load, -load]
    for weights, upper in constraints:
        weight = np.array([weights.get(name, 0.0) for name in form.names])
        size = np.abs(weight * factors).max()
        rows.append(np.append(weight * factors / size, 0.0)[None])
        uppers.append([(upper - weight @ values) / size])
    limits = [
        [None if limit is None else (limit - value) / factor for limit in bounds.get(name, (None, None))]
        for name, value, factor in zip(form.names, values, factors, strict=True)
    ]
    result = optimize.linprog(
        np.append(np.zeros(matrix.shape[1]), 1.0),
        A_ub=np.concatenate(rows),
        b_ub=np.concatenate(uppers),
        bounds=[*limits, (0.0, None)],
        method="highs-ipm",
        options={"primal_feasibility_tolerance": _TOLERANCE, "dual_feasibility_tolerance": _TOLERANCE},
    )
    return result, None if result.x is None else factors * result.x[:-1]
