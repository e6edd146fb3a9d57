"""The forces of the hull along a motion: what unmodelled forces are compared with."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.equations import AXES

if TYPE_CHECKING:  # the simulator needs numba, of which importing takes a second
    from bayesub.model.simulator import Simulator
    from bayesub.model.trajectory import Trajectory

_N_TIMES = 2001  # of a flight, equidistant


def hull_forces(trajectory: Trajectory, member: int = 0) -> np.ndarray:
    """Hydrodynamic forces and moments along a motion, by the terms of velocities.

    Rudder, planes and propeller are left out: in a steady turn the rudder balances the moment of the hull. So are added
    masses, hydrostatics and the forces of actuators from outside, and the terms of the rigid body unless they are in
    the coefficients of the equation set.

    Parameters
    ----------
    trajectory : Trajectory
    member : int
        Which of the batch.

    Returns
    -------
    (n_times, 6) array
        X Y Z K M N, N and N m; zero on the axes that a sub-problem does not have.
    """
    simulator = trajectory.simulator
    vehicle, equations = simulator.vehicle, simulator.vehicle.equations
    controls = simulator.controls_at(trajectory.times)[:, : len(equations.controls) + 1]
    resting = np.zeros((len(trajectory.times), len(AXES)))  # accelerations
    blocks = equations.regressors(trajectory.states[member], resting, controls, vehicle.constants)
    commands = {control.symbol for control in equations.controls} | {"uc", "duc"}
    steered = [bool(term.symbols & commands) for term in equations.terms]
    dimensional = np.where(steered, 0.0, simulator.dimensional(trajectory.xi[member])[0])
    return np.stack([blocks[axis] @ dimensional[equations.columns(equations.names_of_axis(axis))] for axis in AXES], 1)


def hull_force_rms(simulators: Iterable[Simulator]) -> np.ndarray:
    """Root mean square over time of the forces of the hull of a vehicle on its manoeuvres, undisturbed.

    Parameters
    ----------
    simulators : iterable of Simulator
        Of one vehicle, whose coefficients are flown; several manoeuvres count by their durations.

    Returns
    -------
    (6,) array
        X Y Z K M N, N and N m.

    Raises
    ------
    InputError
        If the vehicle fails on a manoeuvre.
    """
    squares, total = np.zeros(len(AXES)), 0.0
    for simulator in simulators:
        manoeuvre = simulator.manoeuvre
        times = np.linspace(0.0, manoeuvre.duration, _N_TIMES)
        trajectory = simulator.at(times).undisturbed.trajectory(simulator.vehicle.xi)
        if trajectory.status[0] != "ok":
            status = trajectory.status[0].replace("_", " ")
            raise InputError(
                f"disturbance: a share is of the forces of '{simulator.vehicle.name}' on {manoeuvre.name}, where the "
                f"boat {status}; give sd, or sd_n and sd_nm",
                "model",
                "share",
            )
        squares += manoeuvre.duration * np.mean(hull_forces(trajectory) ** 2, axis=0)
        total += manoeuvre.duration
    return np.sqrt(squares / total)
