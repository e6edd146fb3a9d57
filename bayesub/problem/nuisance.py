"""Nuisance parameters: what the readings depend on besides the hydrodynamic coefficients.

A nuisance parameter is named with its unit, and is given, sampled and reported in it:

- ``yaw0_deg``, ``u0_mps``, ..: a state at the start of the manoeuvre
- ``current_north_mps``, ``current_east_mps``: a constant current
- ``bias_yaw_deg``, ``bias_u_ground_mps``, ..: what a channel reads too much, all the time
- ``scale_u_ground``, ``scale_r``, ..: by what a sensor of a speed, a rate or an acceleration multiplies, before its
  bias
- ``sd_yaw_deg``, ..; ``dof_x``; ``correlation_time_yaw_s``: of its noise (:mod:`bayesub.problem.likelihoods`)
- ``mass_kg``, ``buoyancy_n``, ``Ixx_kgm2`` .. ``Izx_kgm2``, ``xG_m`` .. ``zB_m``, ``zP_m``: of the body. The weight
  goes with the mass, and the buoyancy goes with the weight, so that the trim stays; ``buoyancy_n`` changes the trim,
  and so does ``weighed_mass_kg``, the mass with its weight alone
- ``volume_cm3``, ``compressibility_per_bar``: of a hull whose buoyancy follows the water, ``[displacement]``
- ``b1`` .. ``b9``: of the thrust polynomial, non-dimensional; ``scale_propeller``: of all of it, and of the torque
- ``bias_rudder_deg``, ``scale_rudder``, ``bias_fin_1_deg``, ..: of an actuator, by its name, which acts with
  ``scale * value + bias`` where the log has `value`. The scale of a propeller is that of its thrust and torque.
- ``delay_rudder_s``, ..: how much later it acts than the log has the value; ``lag_rudder_s``, ..: with which it follows
  the command that the log has (model manual, equation 7.3)
- ``clock_dvl_s``, ``lever_dvl_x_m``, ..: clock and place of an instrument (:mod:`bayesub.problem.mounting`)
- ``sd_disturbance_Y``, ``correlation_time_disturbance_s``, ``disturbance_Y_0``, ..: of forces that the equations leave
  out (:mod:`bayesub.problem.disturbances`)
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.kernels import workspace
from bayesub.logs import log_files
from bayesub.model.actuator_files import COMPRESSIBILITY, VOLUME
from bayesub.model.actuators import command_column
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.vehicles import GRAVITY_MPS2, Vehicle
from bayesub.problem import mounting
from bayesub.problem.disturbances import of_process
from bayesub.sensors.record import Channel

_UNITS = {"I": "kgm2", "x": "m", "y": "m", "z": "m"}
CURRENTS = ("current_north_mps", "current_east_mps")
ON_READINGS = ("bias", "scale")  # attributes of a channel that are not its noise
_SCALED = ("mps", "degps", "mps2", "degps2")  # units of the columns whose sensors have a scale

# Name -> entries of the body vector and what a unit of the parameter adds to each; b1 .. b9 in their own unit.
BODY = {"mass_kg": {"mass": 1.0, "weight": GRAVITY_MPS2, "buoyancy": GRAVITY_MPS2}, "buoyancy_n": {"buoyancy": 1.0}}
BODY |= {f"{key}_{_UNITS[key[0]]}": {key: 1.0} for key in workspace.BODY if key[0] in _UNITS}
BODY |= {key: {key: 1.0} for key in workspace.THRUST}
BODY["weighed_mass_kg"] = {"mass": 1.0, "weight": GRAVITY_MPS2}
OF_HULL = ("volume_cm3", "compressibility_per_bar")
PROPELLER = "scale_propeller"
CM3 = 1e-6  # m^3


# Name -> state at the start, and its SI units for a unit of the parameter.
INITIAL = {
    "0_".join(log_files.HEADERS[state].rsplit("_", 1)): {f"{state}0": log_files.si_factor(state)}
    for state in log_files.STATES
}

MOVING: dict[str | None, tuple[str, ...]] = {
    "horizontal": ("x", "y", "psi", "u", "v", "r"),
    "vertical": ("x", "z", "theta", "u", "w", "q"),
}


@dataclass(frozen=True)
class Nuisance:
    """One nuisance parameter."""

    name: str
    value: float  # where it is if it is not inferred, in its unit
    factor: float = 1.0  # SI units in its unit
    # parameters of :meth:`bayesub.model.simulator.Simulator.sensitivities` -> SI units for a unit of this one
    motion: dict[str, float] = field(default_factory=dict)
    channel: str = ""  # name of the channel, for parameters of one
    attribute: str = ""  # of the noise of the channel, or "bias" or "scale"
    mount: mounting.Mount | None = None  # what it is of an instrument
    # of a clock, how much later than the record says readings may have been taken, at least and at most
    later_s: tuple[float, float] = (0.0, 0.0)


def find(name: str, vehicle: Vehicle, manoeuvre: Manoeuvre, channels: Sequence[Channel], noises: Sequence) -> Nuisance:
    """The nuisance parameter of a name, for a vehicle on a manoeuvre and channels, each with its noise model.

    Raises InputError for a name that does not exist, or that has no part in the sub-problem of the manoeuvre.
    """
    if name in BODY:
        idle = vehicle.idle(manoeuvre.subproblem)
        first = next(iter(BODY[name]))
        if first in idle:
            raise _refused(name, f"has no part in the {manoeuvre.subproblem} sub-problem; leave it out")
        value = vehicle.body[workspace.BODY.index(first)]
        if first in workspace.THRUST:
            value /= 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
        return Nuisance(name, float(value), motion=BODY[name])
    if name in INITIAL:
        ((start, factor),) = INITIAL[name].items()
        state = start[:-1]
        if state not in MOVING.get(manoeuvre.subproblem, log_files.STATES):
            raise _refused(name, f"stays zero in the {manoeuvre.subproblem} sub-problem; leave it out")
        for one in manoeuvre.prescribed:
            if state in one.states:
                raise _refused(name, f"follows from the {one.angle} that is prescribed; leave it out")
        value = manoeuvre.initial_state[log_files.STATES.index(state)] / factor
        return Nuisance(name, value, factor, INITIAL[name])
    if name in OF_HULL:
        return _of_hull(name, vehicle, manoeuvre)
    if name in vehicle.actuators.parameters:
        return _of_actuator(name, vehicle, manoeuvre)
    if name == PROPELLER:
        return _of_propeller(vehicle, manoeuvre)
    if name in CURRENTS:
        if not any(channel.over_ground for channel in channels):
            raise _refused(name, "no channel is measured over the ground, so that a current has no effect")
        return Nuisance(name, 0.0)
    mounts = mounting.mounts(channels)
    if name in mounts:
        mounting.check(name, mounts[name], channels, MOVING.get(manoeuvre.subproblem, log_files.STATES))
        return Nuisance(name, mounts[name].value, mount=mounts[name])
    of_channels = _of_channels(channels, noises)
    if name not in of_channels:
        valid = [*BODY, *OF_HULL, PROPELLER, *INITIAL, *CURRENTS, *vehicle.actuators.parameters, *of_channels, *mounts]
        raise _refused(name, f"there is no such parameter{nearest(name, valid)}", "unknown")
    return of_channels[name]


def _refused(name: str, reason: str, kind: str = "conflict") -> InputError:
    return InputError(f"nuisance '{name}': {reason}", kind, name)


def of_boat(name: str, vehicle: Vehicle) -> bool:
    """Whether all trials share a nuisance parameter: of the boat, the process that disturbs it, a place or a scale."""
    of_hull = name in BODY or name in OF_HULL or name == PROPELLER or name in vehicle.actuators.parameters
    return of_hull or of_process(name) or of_instrument(name, vehicle)


def of_instrument(name: str, vehicle: Vehicle) -> bool:
    """Whether a parameter is a place or a scale, which an instrument has in every trial in which it reads."""
    of_body = {PROPELLER, *vehicle.actuators.parameters}
    return mounting.of_place(name) or (name.startswith("scale_") and name not in of_body)


def _of_hull(name: str, vehicle: Vehicle, manoeuvre: Manoeuvre) -> Nuisance:
    """The volume of a hull whose buoyancy follows the water, or its compressibility.

    Both act by scales of what follows the water; with the volume the buoyancy in the water of the file changes too.
    """
    members = {actuator.name: actuator for actuator in vehicle.actuators.members}
    if VOLUME not in members:
        raise _refused(name, "the vehicle has no [displacement], the section of a hull that follows the water")
    if vehicle.equations.subproblem(manoeuvre.subproblem) == "horizontal":
        raise _refused(name, "has no part in the horizontal sub-problem; leave it out")
    lift = vehicle.body[workspace.BUOYANCY]
    volume = lift / (vehicle.water_density_kgm3 * GRAVITY_MPS2) / CM3
    if name == "volume_cm3":
        return Nuisance(name, float(volume), motion={"buoyancy": lift / volume, f"scale_{VOLUME}": 1.0 / volume})
    compressibility = float(members[COMPRESSIBILITY].weight[0] / lift)
    if compressibility == 0.0:
        raise _refused(name, "displacement.compressibility_per_bar is zero; give a value to begin with", "value")
    return Nuisance(name, compressibility, motion={f"scale_{COMPRESSIBILITY}": 1.0 / compressibility})


def _of_propeller(vehicle: Vehicle, manoeuvre: Manoeuvre) -> Nuisance:
    """The scale of thrust and torque of [propulsion]."""
    idle = vehicle.idle(manoeuvre.subproblem)
    parts = {key: float(vehicle.body[workspace.BODY.index(key)]) for key in (*workspace.THRUST, "Kn1", "Kn2")}
    unit = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
    parts = {key: value / (unit if key in workspace.THRUST else 1.0) for key, value in parts.items() if value}
    if not parts.keys() - idle:
        raise _refused(PROPELLER, "the vehicle has no [propulsion] that follows the rpm")
    return Nuisance(PROPELLER, 1.0, motion={key: value for key, value in parts.items() if key not in idle})


def _of_actuator(name: str, vehicle: Vehicle, manoeuvre: Manoeuvre) -> Nuisance:
    position, kind = vehicle.actuators.parameters[name]
    actuator = vehicle.actuators.members[position]
    subproblem = vehicle.equations.subproblem(manoeuvre.subproblem)
    if not vehicle.actuators.moves(name, subproblem):
        raise _refused(name, f"has no part in the {subproblem} sub-problem; leave it out")
    history = manoeuvre.log.get(manoeuvre.logged(actuator.short))
    if kind == "scale" and history is not None and not (history != actuator.zero).any():
        raise _refused(name, f"{actuator.column} is zero throughout the manoeuvre; leave it out")
    if kind == "delay" and history is not None and not np.ptp(history):
        raise _refused(name, f"{actuator.column} does not move in the manoeuvre; leave it out")
    if kind == "lag" and actuator.short not in manoeuvre.commanded:
        raise _refused(
            name,
            f"a lag is between a command and the actuator; the controls have {actuator.column}, not "
            f"{command_column(actuator.column)}; leave it out",
        )
    return Nuisance(name, actuator.nominal(kind), motion={name: 1.0})


def _of_channels(channels, noises) -> dict[str, Nuisance]:
    nuisances = []
    for channel, noise in zip(channels, noises, strict=True):
        column = log_files.HEADERS[channel.quantity]
        factor = log_files.si_factor(column)
        nuisances.append(Nuisance(f"bias_{column}", 0.0, factor, channel=channel.name, attribute="bias"))
        if column.rpartition("_")[2] in _SCALED:
            nuisances.append(Nuisance(f"scale_{channel.name}", 1.0, channel=channel.name, attribute="scale"))
        for attribute in noise.SAMPLED:
            stem = attribute.removesuffix("_s")
            name, factor_of = f"{stem}_{channel.name}{attribute.removeprefix(stem)}", 1.0
            if attribute == "sd":
                name, factor_of = f"sd_{column}", factor
            value = getattr(noise, attribute) / factor_of
            nuisances.append(Nuisance(name, value, factor_of, channel=channel.name, attribute=attribute))
    return {nuisance.name: nuisance for nuisance in nuisances}


class Nuisances:
    """All nuisance parameters of a problem: (n,) `held` if they are not inferred, and what of actuators is `varied`."""

    def __init__(self, parameters: tuple[Nuisance, ...], vehicle: Vehicle, manoeuvre: Manoeuvre):
        self.parameters = parameters
        self.names = tuple(parameter.name for parameter in parameters)
        self.held = np.array([parameter.value for parameter in parameters])
        self._body, self._initial = vehicle.body, manoeuvre.initial_state
        # What a unit of each adds to the body vector, in which thrust is dimensional, and to the state at the start.
        thrust = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
        units = np.where(np.isin(workspace.BODY, workspace.THRUST), thrust, 1.0)
        self._on_body = self._effects(workspace.BODY) * units
        self._on_start = self._effects([f"{state}0" for state in log_files.STATES])
        moved = dict.fromkeys(key for parameter in parameters for key in parameter.motion)
        self.varied = tuple(name for name in moved if name in vehicle.actuators.parameters)
        self._on_actuators = self._effects(self.varied)
        self._of_channels: dict[str, list[tuple[str, int, float]]] = {}
        for k, parameter in enumerate(parameters):
            if parameter.channel:
                self._of_channels.setdefault(parameter.channel, []).append((parameter.attribute, k, parameter.factor))

    def __len__(self) -> int:
        return len(self.names)

    def _effects(self, keys) -> np.ndarray:
        """(n, n_keys) what a unit of each parameter adds to parameters of the simulator."""
        rows = [[p.motion.get(key, 0.0) for key in keys] for p in self.parameters]
        return np.reshape(rows, (len(self.parameters), len(keys)))

    def on_motion(self) -> tuple[tuple[str, ...], np.ndarray]:
        """The parameters of the simulator that any of these moves, and (n_moved, n) how much a unit of each does."""
        moved = tuple(dict.fromkeys(key for parameter in self.parameters for key in parameter.motion))
        return moved, self._effects(moved).T

    def body(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, N_BODY) body vectors of values (n_batch, n), or None if they are all the vehicle's."""
        return self._changed(values, self._body, self._on_body)

    def initial(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, 12) states at the start of values (n_batch, n), or None if they are all the manoeuvre's."""
        return self._changed(values, self._initial, self._on_start)

    def amounts(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, n_varied) by how much parameters of actuators differ from those held, or None if there are none."""
        return self._changed(values, 0.0, self._on_actuators)

    def _changed(self, values, base, effects):
        return base + (values - self.held) @ effects if effects.any() else None

    def currents(self, values: np.ndarray) -> np.ndarray | None:
        """(n_batch, 2) currents to the north and east, m/s, of values (n_batch, n), or None if there is none."""
        if not self.current_columns():
            return None
        currents = np.zeros((len(values), 2))
        for k, towards in self.current_columns():
            currents[:, towards] = values[:, k]
        return currents

    def current_columns(self) -> list[tuple[int, int]]:
        """Position among these, and 0 for north or 1 for east, of each component of the current."""
        return [(k, CURRENTS.index(name)) for k, name in enumerate(self.names) if name in CURRENTS]

    def on_readings(self, of: str, channels: Sequence[Channel]) -> list[tuple[int, int, float]]:
        """Position of the channel, position among these and factor to SI, for each "bias" or each "scale"."""
        return [
            (i, k, factor)
            for i, channel in enumerate(channels)
            for attribute, k, factor in self._of_channels.get(channel.name, ())
            if attribute == of
        ]

    def of_noise(self, channel: Channel) -> list[tuple[str, int, float]]:
        """Attribute, position among these and factor to SI of each unknown of the noise of a channel."""
        return [entry for entry in self._of_channels.get(channel.name, ()) if entry[0] not in ON_READINGS]
