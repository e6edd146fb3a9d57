"""Zeros of actuators, and the terms of steady forces that stand in for them.

A rudder that stands a degree off, and coefficients such as Yuu and Nuu, push a boat alike. A trial knows little more
than their sum, which a study says that infers both, and may take the one for the other if it infers one of them only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayesub.model.equations import AXES, EquationSet
from bayesub.model.simulator import Simulator
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

if TYPE_CHECKING:  # a vehicle is checked without problems
    from bayesub.findings.set_up import AnyProblem

STEADY = frozenset({"u", "V", "U", "du", "uc", "duc"})  # symbols of the speed of boat and propeller
TOGETHER = 2.0  # how many times better a coefficient is known if the zeros are held: then they trade off
EXACT = 1e-9  # round-off in such a share
ALIKE = 0.1  # share of the force of a zero that no steady term makes, below which they are hard to tell apart


def steady(equations: EquationSet) -> dict[str, str]:
    """Coefficient of each term that pushes a boat sideways, up or round in steady straight flight -> its axis."""
    return {term.name: term.axis for term in equations.terms if term.axis != "X" and term.symbols <= STEADY}


def biases(vehicle: Vehicle, subproblem: str | None) -> dict[str, frozenset[str]]:
    """Name of the bias of each actuator that has a part in a sub-problem -> axes on which it pushes, X left out."""
    actuators, equations, axes = vehicle.actuators, vehicle.equations, {}
    for name, (i, kind) in actuators.parameters.items():
        if kind == "bias" and actuators.moves(name, subproblem):
            pairs = zip(equations.controls, actuators.members[i].mixing, strict=True)
            symbols = {control.symbol for control, share in pairs if share}
            pushed = {term.axis for term in equations.terms if term.symbols & symbols}
            pushed |= {axis for axis, force in zip(AXES, actuators.members[i].force, strict=True) if force}
            axes[name] = frozenset(pushed - {"X"})
    return axes


def equivalents(trajectory: Trajectory, parameter: str) -> tuple[dict[str, float], float]:
    """The steady coefficients that push along a motion as a unit of the bias of an actuator does.

    `trajectory`: its first member; `parameter`: such as "bias_rudder_deg".

    Returns `changes`: coefficient -> change that is like the bias, by least squares of the forces on each axis; `rest`:
    share of the force that the coefficients do not make, root mean square, on the axis where it is largest.
    """
    simulator = trajectory.simulator
    vehicle, equations = simulator.vehicle, simulator.vehicle.equations
    n = len(equations.controls) + 1
    flown = np.isfinite(trajectory.states[0]).all(axis=1)
    states, still = trajectory.states[0][flown], np.zeros((np.count_nonzero(flown), len(AXES)))
    controls = simulator.controls_at(trajectory.times)[flown]
    inputs = simulator.histories.at(trajectory.times)[flown]
    unit = vehicle.actuators.variation(parameter, inputs, simulator.subproblem)
    plus, minus = (
        equations.regressors(states, still, (controls[:, : unit.shape[1]] + sign * unit)[:, :n], vehicle.constants)
        for sign in (0.5, -0.5)
    )
    dimensional = simulator.dimensional(trajectory.xi[0])[0]
    active = set(equations.active(None, None, simulator.subproblem))
    changes: dict[str, float] = {}
    rest = 0.0
    columns = steady(equations)
    for axis in AXES[1:]:
        force = (plus[axis] - minus[axis]) @ dimensional[equations.columns(equations.names_of_axis(axis))]
        if unit.shape[1] > n:
            force = force + unit[:, n + AXES.index(axis)]
        names = [name for name in equations.names_of_axis(axis) if columns.get(name) == axis and name in active]
        if not force.any() or not names:
            continue
        places = [equations.names_of_axis(axis).index(name) for name in names]
        matrix = plus[axis][:, places] * vehicle.dimensional_factors[equations.columns(names)]
        solution, *_ = np.linalg.lstsq(matrix, force, rcond=1e-6)
        changes |= dict(zip(names, map(float, solution), strict=True))
        rest = max(rest, float(np.linalg.norm(force - matrix @ solution) / np.linalg.norm(force)))
    return changes, rest


def rank_lines(trajectory: Trajectory) -> list[str]:
    """Which zeros of actuators a motion hardly distinguishes from steady coefficients, a line each."""
    simulator, lines = trajectory.simulator, []
    for parameter in biases(simulator.vehicle, simulator.subproblem):
        changes, rest = equivalents(trajectory, parameter)
        if changes and rest < ALIKE:
            text = ", ".join(f"{name} {change:+.3g}" for name, change in changes.items())
            how = "exactly" if rest < EXACT else f"but for {100.0 * rest:.2g} % of its force"
            lines.append(f"not unique with {parameter} unknown: a unit of it is {how} like {text}")
    return lines


def together(names: Sequence[str], covariance: np.ndarray, vehicle: Vehicle) -> list[dict]:
    """Steady coefficients that are known only with zeros of actuators.

    `names`: n_params, of a trial with its name in brackets; `covariance` (n_params, n_params): of the posterior.

    Returns for each such coefficient: "coefficient"; "with", zero -> factor, such that the coefficient plus the factors
    times the zeros is known to "sd"; "alone", the sd of the coefficient itself.
    """
    axes, of_terms, rows = biases(vehicle, None), steady(vehicle.equations), []
    for k, name in enumerate(names):
        zeros = [j for j, other in enumerate(names) if of_terms.get(name) in axes.get(other, ())]
        if not zeros:
            continue
        factors = np.linalg.lstsq(covariance[np.ix_(zeros, zeros)], covariance[zeros, k], rcond=None)[0]
        variance = covariance[k, k] - factors @ covariance[zeros, k]
        sd, alone = np.sqrt([max(variance, 0.0), covariance[k, k]])
        if alone > TOGETHER * sd:
            parts = {names[j]: -float(factor) for j, factor in zip(zeros, factors, strict=True)}
            rows.append({"coefficient": name, "with": parts, "sd": float(sd), "alone": float(alone)})
    return rows


def sentence(rows: Sequence[Mapping]) -> str:
    """A sentence on the coefficients of :func:`together`, at least one."""
    texts = []
    for row in rows:
        parts = " ".join(f"{factor:+.3g} {zero}" for zero, factor in row["with"].items())
        name = row["coefficient"]
        texts.append(f"{name} {parts} to {row['sd']:.2g} ({name} alone to {row['alone']:.2g})")
    return f"Known only together with the zeros of actuators: {', '.join(texts)}."


def advice(problem: AnyProblem) -> str:
    """Zeros of actuators that a study of logs should infer besides steady coefficients; empty if none."""
    trials = [trial for _, trial, _ in problem.each_trial(problem.prior.mean)]
    free = {name: axis for name, axis in steady(problem.equations).items() if name in problem.names}
    if not free or any(trial.record.truth is not None for trial in trials):
        return ""
    first = trials[0].simulator
    zeros = biases(problem.vehicle, first.subproblem)
    known = frozenset().union(*(axes for name, axes in zeros.items() if name in problem.names))
    missing = [name for name, axes in zeros.items() if (axes - known) & set(free.values())]
    pushed = frozenset().union(*(zeros[name] for name in missing)) - known
    free = {name: axis for name, axis in free.items() if axis in pushed}
    if not missing:
        return ""
    still = Simulator(first.vehicle, first.manoeuvre, first.times, dt=first.step).trajectory(first.vehicle.xi)
    changes = {name: change for name, change in equivalents(still, missing[0])[0].items() if name in free}
    like = ", ".join(f"{name} {change:+.2g}" for name, change in changes.items())
    zero, names = f"1 {missing[0].rpartition('_')[2]} of {missing[0]}", ", ".join(free)
    remedy = f"give {' or '.join(missing)} a prior in [nuisance], or hold {names}"
    text = f"{names} {'are' if len(free) > 1 else 'is'} free, and no zero of an actuator is: {zero} is like "
    return f"{text}{like or 'them'}, and would be taken for it; {remedy}"
