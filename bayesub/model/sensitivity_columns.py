"""Which columns the kernel of sensitivities is asked for, by the names of parameters."""

from collections.abc import Iterable

import numpy as np

from bayesub.io import log_files
from bayesub.io.errors import InputError, nearest
from bayesub.kernels import workspace
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle


def sensitivity_columns(parameters: Iterable[str], vehicle: Vehicle, subproblem: str | None, width: int) -> tuple:
    """What the kernel needs to know of parameters.

    A coefficient is one column, an entry of the body vector or something unknown of an actuator six, one for the force
    along each axis; a state at the start has none but its own start.

    Parameters
    ----------
    parameters : iterable of str
        Names as for :meth:`bayesub.model.simulate.Simulator.sensitivities`.
    vehicle : Vehicle
    subproblem : str or None
        Plane to which the motion is confined.
    width : int
        Padded number of states of the kernel.

    Returns
    -------
    tuple
        First column of each parameter; names of those of actuators; and the arguments `parameters`, `sources`,
        `factors`, `axes` and `initial` of the kernel.

    Raises
    ------
    InputError
        For an unknown name.
    """
    equations, idle, factors_of = vehicle.equations, vehicle.idle(subproblem), vehicle.dimensional_factors
    thrust_factor = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
    of_actuators = [name for name in parameters if name in vehicle.actuators.parameters]
    after_body = len(equations.names) + 6 * sum(name in workspace.BODY for name in parameters)
    body, columns, firsts = [], [], []
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
        elif name in of_actuators:
            first = after_body + 6 * of_actuators.index(name)
            columns += [(first + axis, 1.0, axis, None) for axis in range(6)]
        elif name[-1:] == "0" and name[:-1] in log_files.STATES:
            columns.append((0, 0.0, 0, log_files.STATES.index(name[:-1])))
        else:
            valid = [*equations.names, *workspace.BODY, *(f"{state}0" for state in log_files.STATES)]
            valid += vehicle.actuators.parameters
            raise InputError(f"unknown parameter '{name}'{nearest(name, valid)}")
    sources, factors, axes, starts = zip(*columns, strict=True)
    initial = np.zeros((len(columns), width))
    for column, start in enumerate(starts):
        if start is not None:
            initial[column, start] = 1.0
    return (
        firsts,
        of_actuators,
        np.array(body, dtype=int),
        np.array(sources),
        np.array(factors),
        np.array(axes),
        initial,
    )
