"""The linear form of the equations of motion (model manual, section 9): forces on coefficients, axis by axis."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.equations import AXES
from bayesub.model.trajectory import Trajectory

_REGRESSOR_ROUNDING = 3 * np.finfo(float).eps  # six roundings of half an epsilon: nu, four factors, the dimension
_ROUND_OFF_ONLY = 0.1  # relative error of a column that holds no motion


@dataclass(frozen=True)
class LinearSystem:
    """One axis of the linear form ``matrix @ xi = load`` (model manual, section 9), in N or N m."""

    axis: str  # one of X, Y, Z, K, M, N
    names: tuple[str, ...]  # coefficients, n_columns of them
    matrix: np.ndarray  # (n_samples, n_columns) dimensional regressors
    load: np.ndarray  # (n_samples,)
    rounding: float | np.ndarray = _REGRESSOR_ROUNDING  # relative error (root mean square) of all or each column


def linear_systems(
    trajectory: Trajectory, member: int = 0, free: Iterable[str] | None = None
) -> dict[str, LinearSystem]:
    """The linear form of each axis from the states and accelerations of a motion.

    The load is rigid-body inertia minus hydrostatics minus propulsion; forces that the equations leave out stay in it.
    Columns are the coefficients that play a part (:meth:`bayesub.model.equations.EquationSet.active`). Columns that
    vanish throughout, such as those of planes that do not move, are left out, and so are axes without columns.

    The regressors are exact functions of the given states but for round-off. Simulated accelerations come from the
    equations of motion at these very states, so that integration errors do not enter; their round-off is what the
    equations are then short of, and a column of which a tenth is round-off counts as vanishing. Of measured motion
    every column that moves stays. The `trajectory` is simulated, or anything measured with the same attributes;
    coefficients that are not among the `free`, by default all, move to the load with their values there.
    """
    simulator, xi = trajectory.simulator, trajectory.xi[member]
    states, accelerations = trajectory.states[member], trajectory.accelerations[member]
    equations, mass_matrix = simulator.vehicle.equations, simulator.kernels.mass_matrix
    active = set(equations.active(None, simulator.manoeuvre, simulator.subproblem))
    free = active if free is None else active & set(free)
    held = simulator.dimensional(np.where(np.isin(equations.names, list(free)), 0.0, xi))[0]
    body, factors = simulator.vehicle.body, simulator.vehicle.dimensional_factors
    # What the free coefficients have to explain is how the motion differs from that of a boat without them.
    without = simulator.accelerations(held / factors, trajectory.states[member : member + 1])[0]
    loads = (accelerations - without) @ mass_matrix(held, body).T
    controls = simulator.controls_at(trajectory.times)[:, : len(equations.controls) + 1]
    columns = equations.regressors(states, accelerations, controls, simulator.vehicle.constants)
    noise = {}
    if isinstance(trajectory, Trajectory):
        dimensional = simulator.dimensional(xi)[0]
        of_axes = {axis: equations.columns(equations.names_of_axis(axis)) for axis in columns}
        forces = [block @ (dimensional - held)[of_axes[axis]] for axis, block in columns.items()]
        short = np.stack(forces, axis=1) - loads
        errors = np.linalg.norm(np.linalg.solve(mass_matrix(dimensional, body), short.T), axis=1)
        # An acceleration is what two forces leave over, and no better than the round-off of either.
        errors += np.finfo(float).eps * np.linalg.norm(without, axis=0)
        sizes = np.linalg.norm(accelerations, axis=0)
        noise = np.divide(errors, sizes, out=np.zeros(6), where=sizes > 0)
        noise = dict(zip(ACCELERATIONS, noise, strict=True))
    if simulator.forces is not None:  # of which the equations know nothing
        loads = loads + simulator.forces.at(trajectory.times)

    systems = {}
    for axis, block in columns.items():
        terms = [term for term in equations.terms if term.axis == axis]
        rounding = np.array([noise.get(term.regressor, 0.0) for term in terms])
        moves = (np.abs(block).max(axis=0) > 0) & (rounding < _ROUND_OFF_ONLY)
        wanted = np.array([term.name in free for term in terms], dtype=bool) & moves
        if wanted.any():
            names = tuple(terms[k].name for k in np.flatnonzero(wanted))
            matrix = block[:, wanted] * factors[equations.columns(names)]
            load = loads[:, AXES.index(axis)]
            systems[axis] = LinearSystem(axis, names, matrix, load, _REGRESSOR_ROUNDING + rounding[wanted])
    return systems


def stacked(trials: Sequence[dict[str, LinearSystem]], order: Sequence[str]) -> dict[str, LinearSystem]:
    """The linear form of each axis from those of several trials of one vehicle; a null vector is one of all of them.

    A column that vanishes in a trial is zero in its rows. Columns are in the `order` of the equations' coefficients.
    """
    first, *others = trials
    if not others:
        return first
    stacks = {}
    for axis in AXES:
        systems = [trial[axis] for trial in trials if axis in trial]
        if not systems:
            continue
        present = {name for system in systems for name in system.names}
        names = tuple(name for name in order if name in present)
        matrix = np.zeros((sum(len(system.matrix) for system in systems), len(names)))
        errors = np.zeros_like(matrix[: len(systems)])
        end = 0
        for k, system in enumerate(systems):
            begin, end = end, end + len(system.matrix)
            places = [names.index(name) for name in system.names]
            matrix[begin:end, places] = system.matrix
            errors[k, places] = system.rounding * np.linalg.norm(system.matrix, axis=0)
        rounding = np.linalg.norm(errors, axis=0) / np.linalg.norm(matrix, axis=0)
        stacks[axis] = LinearSystem(axis, names, matrix, np.concatenate([s.load for s in systems]), rounding)
    return stacks
