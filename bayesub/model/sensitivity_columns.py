"""Which columns the kernel of sensitivities is asked for, by the names of parameters."""

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.kernels import workspace
from bayesub.logs import log_files
from bayesub.model.disturbance import Knots
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle


def sensitivity_columns(
    parameters: tuple[str, ...], vehicle: Vehicle, subproblem: str | None, knots: Knots | None
) -> tuple:
    """What the kernel needs to know of parameters (:meth:`bayesub.model.simulator.Simulator.sensitivities`).

    A coefficient is one column, an entry of the body vector or something unknown of an actuator six, one for the force
    along each axis; a force at a knot is one, and a state at the start has none but its own start. Returned are the
    first column of each parameter; names of those of actuators and knots; and the arguments `slots`, `parameters`,
    `sources`, `factors`, `axes` and `initial` of the kernel. InputError for an unknown name.
    """
    equations, idle, factors_of = vehicle.equations, vehicle.idle(subproblem), vehicle.dimensional_factors
    thrust_factor = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
    forces = {}
    if knots is not None:
        of_axes = [axis for axis in knots.axes for _ in knots.times]
        forces = dict(zip(knots.parameters, of_axes, strict=True))
    varied = [name for name in parameters if name in vehicle.actuators.parameters or name in forces]
    after_body = len(equations.names) + 6 * sum(name in workspace.BODY for name in parameters)
    body: list[int] = []
    columns: list[tuple[int, float, int, int | None]] = []
    firsts, slots, n_slots = [], [], 0
    for name in parameters:
        firsts.append(len(columns))
        used = name not in idle
        if name in equations.index:
            k = equations.index[name]
            columns.append((k, used * factors_of[k], AXES.index(equations.terms[k].axis), None))
        elif name in workspace.BODY:
            first = len(equations.names) + 6 * len(body)
            factor = used * (thrust_factor if name in workspace.THRUST else 1.0)
            columns += [(first + axis, factor, axis, None) for axis in range(6)]
            body.append(workspace.BODY.index(name))
        elif name in varied:
            along = range(6) if name not in forces else (AXES.index(forces[name]),)
            columns += [(after_body + n_slots + k, 1.0, axis, None) for k, axis in enumerate(along)]
            slots.append([n_slots + along.index(axis) if axis in along else -1 for axis in range(6)])
            n_slots += len(along)
        elif name[-1:] == "0" and name[:-1] in log_files.STATES:
            columns.append((0, 0.0, 0, log_files.STATES.index(name[:-1])))
        else:
            valid = [*equations.names, *workspace.BODY, *(f"{state}0" for state in log_files.STATES)]
            valid += vehicle.actuators.parameters
            raise InputError(f"unknown parameter '{name}'{nearest(name, valid)}", "unknown", name)
    sources, factors, axes, starts = zip(*columns, strict=True)
    initial = np.zeros((len(columns), workspace.N_STATES))
    for column, start in enumerate(starts):
        if start is not None:
            initial[column, start] = 1.0
    of_slots, of_body = np.array(slots, dtype=int).reshape(-1, 6), np.array(body, dtype=int)
    return firsts, varied, of_slots, of_body, *map(np.array, (sources, factors, axes)), initial
