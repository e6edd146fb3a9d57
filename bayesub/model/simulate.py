"""Simulate trials: a vehicle, a manoeuvre and a batch of coefficient sets give a batch of trajectories."""

from collections.abc import Mapping
from typing import TypedDict, Unpack

import numpy as np

from bayesub.io.arguments import checked
from bayesub.io.errors import InputError, check_known
from bayesub.model.disturbance import Disturbance, ForceHistory
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import MAX_STEPS, Simulator, true_step
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle


class Integration(TypedDict, total=False):
    """How a motion is integrated, as :class:`bayesub.model.simulator.Simulator` takes it."""

    dt: float | None
    controls: str
    subproblem: str | None
    attitude: str


@checked
def simulate(
    vehicle: Vehicle,
    manoeuvre: Manoeuvre,
    *,
    xi: np.ndarray | None = None,
    sample: float | None = None,
    actuators: Mapping[str, float] | None = None,
    disturbance: Disturbance | ForceHistory | None = None,
    rng: np.random.Generator | None = None,
    **integration: Unpack[Integration],
) -> Trajectory:
    """Simulate a manoeuvre.

    A member that fails has its states up to the failure, and the reason in its status. InputError for an option or
    coefficients that cannot be, and if no step is short enough.

    Parameters
    ----------
    xi : (n_terms,) or (n_batch, n_terms) non-dimensional coefficients; by default the vehicle's own
    sample : output interval, s; by default the spacing of the control history
    actuators : what is wrong with their log: nuisance parameters -> values, such as ``{"delay_rudder_s": 0.4}``
    disturbance : forces that the equations leave out, for all members: a process, of which one history is sampled at
        the integration step, or the history itself
    rng : of that history
    dt : integration step, s; by default a tenth (:func:`true_step`) of the one that keeps the position within 5 cm
        (:func:`choose_step`), so that a record of the motion does not come from the integrator that fits it
    controls : "linear" or "hold", as for :class:`Simulator`
    subproblem : "horizontal", "vertical" or None for all six degrees of freedom; by default the manoeuvre's own
    attitude : "euler" or "quaternion"
    """
    xi = vehicle.xi if xi is None else np.asarray(xi, dtype=float)
    n = len(vehicle.xi)
    if xi.shape[-1:] != (n,) or xi.ndim > 2 or not np.isfinite(xi).all():
        message = f"xi must be finite with shape ({n},) or (n_batch, {n}), found shape {xi.shape}"
        raise InputError(message, "value", "xi")
    if sample is None:
        times = manoeuvre.times
    elif np.isfinite(sample) and 0 < sample <= manoeuvre.duration:
        if not manoeuvre.duration / sample <= MAX_STEPS:
            text = f"an output interval of {sample:g} s gives more than {MAX_STEPS:,} rows; give a longer one"
            raise InputError(text, "limit", "sample")
        times = np.arange(int(manoeuvre.duration / sample * (1 + 1e-12)) + 1) * sample
    else:
        message = f"the output interval must lie between 0 and {manoeuvre.duration:g} s, found {sample}"
        raise InputError(message, "value", "sample")
    times = np.minimum(times, manoeuvre.duration)
    changes, known = {}, vehicle.actuators.parameters
    for name, value in (actuators or {}).items():
        check_known(name, known, f"actuators: there is no '{name}'")
        if not np.isfinite(value):
            raise InputError(f"actuators: '{name}' must be a finite number, found {value}", "value", name)
        i, kind = known[name]
        changes[name] = value - vehicle.actuators.members[i].nominal(kind)
    if integration.get("dt") is None:
        model = Simulator(vehicle, manoeuvre, times, changes=changes, **integration)
        integration["dt"] = true_step(model.step, manoeuvre)
    simulator = Simulator(vehicle, manoeuvre, times, changes=changes, **integration)
    if disturbance is not None:
        simulator = simulator.disturbed(disturbance, rng)
    return simulator.trajectory(xi)


def accelerations(
    vehicle: Vehicle,
    states: np.ndarray,
    controls: np.ndarray,
    rpm: np.ndarray | float,
    inputs: np.ndarray | None = None,
) -> np.ndarray:
    """Body accelerations (n, 6) at given states, from all six equations of motion (model manual, section 6).

    They are udot vdot wdot (m/s^2), pdot qdot rdot (rad/s^2), at `states` (n, 12), `controls` (n, n_controls) of the
    equations, SI units, and `rpm` (n,), or one number. Of the actuators' `inputs` (n, n_actuators), by default at rest,
    propellers and thrusters push.
    """
    states = np.ascontiguousarray(states, dtype=float)
    ordered = np.empty((len(states), len(vehicle.equations.controls) + 1))
    ordered[:, :-1] = controls
    ordered[:, -1] = np.asarray(rpm, dtype=float) / vehicle.rpm_per_mps
    if vehicle.actuators.external:
        inputs = np.tile(vehicle.actuators.rest, (len(states), 1)) if inputs is None else inputs
        pushed = vehicle.actuators.wrenches(inputs, None), vehicle.actuators.weights(inputs, None)
        ordered = np.hstack([ordered, *pushed])
    dimensional = (vehicle.xi * vehicle.dimensional_factors)[None]
    body = np.concatenate([vehicle.restricted(None).body, vehicle.constants])[None]
    return vehicle.kernels().body_accelerations(dimensional, body, states[None], ordered)[0]
