"""A batch of boats: one vehicle with many coefficient sets, bodies and actuators, such as the draws of a posterior."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np

from bayesub.kernels import workspace
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle

T = TypeVar("T")


@dataclass(frozen=True)
class Boats:
    """Boats that differ from a vehicle in their coefficients, and perhaps in their bodies and actuators."""

    vehicle: Vehicle  # what they have in common: equations, kinds of actuators, length, trial speed
    xi: np.ndarray  # (n, n_terms) coefficients
    body_changes: np.ndarray | None = None  # (n, N_BODY) what body vectors are more than the vehicle's, SI units
    # Whether motions in a plane are flown with the kernels of all degrees of freedom, which give the same and take up
    # to twice as long: for whoever has compiled only those.
    in_six: bool = False
    # Bias, scale or delay of an actuator (Actuators.parameters) -> (n,) how much that of each boat is more than the
    # nominal one. Orders are what a log has; lags are those of the vehicle.
    actuator_changes: Mapping[str, np.ndarray] = field(default_factory=dict)
    _kept: dict = field(default_factory=dict, repr=False, compare=False)

    def __len__(self) -> int:
        """How many they are, n."""
        return len(self.xi)

    @cached_property
    def vehicle_alone(self) -> "Boats":
        """A batch of the vehicle itself."""
        return Boats(self.vehicle, self.vehicle.xi[None], in_six=self.in_six)

    def once(self, function: Callable[..., T], *arguments) -> T:
        """What a function of these boats and hashable arguments returns; computed at the first call only."""
        key = function, *arguments
        if key not in self._kept:
            self._kept[key] = function(self, *arguments)
        return self._kept[key]

    def fly(
        self, manoeuvre: Manoeuvre, times: np.ndarray, dt: float | None = None, initial: np.ndarray | None = None
    ) -> np.ndarray:
        """States (n, n_times, 12) of a manoeuvre, SI units and radians; not a number from the failure of a boat on.

        The manoeuvre is loaded for the vehicle; the motion is confined to its plane, if it has one. `times` (n_times,)
        are within it, s; the step `dt` (s) is by default the simulator's, and `initial` (n, 12) the manoeuvre's.
        """
        plane = manoeuvre.subproblem
        varied = self.varied(plane)
        simulator = Simulator(self.vehicle, manoeuvre, times, dt=dt, subproblem=self._kernels_of(plane), varied=varied)
        amounts = np.column_stack([self.actuator_changes[name] for name in varied]) if varied else None
        return simulator.run(self.confined(plane), body=self.bodies(plane), initial=initial, amounts=amounts)[0]

    def accelerations(self, plane: str | None, states: np.ndarray, controls: np.ndarray) -> np.ndarray:
        """Body accelerations (n, n_states, 6), m/s^2 and rad/s^2, of a motion that is confined to a plane.

        States (n_states, 12) are of all boats, or (n, n_states, 12) of each; controls as :meth:`controls` gives them.
        """
        kernel = self.vehicle.kernels(self._kernels_of(plane)).body_accelerations
        dimensional = self.confined(plane) * self.vehicle.dimensional_factors
        bodies = np.hstack([self.bodies(plane), np.tile(self.vehicle.constants, (len(self), 1))])
        states = np.broadcast_to(states, (len(self), *states.shape[-2:])).copy()
        if controls.ndim == 2:
            return kernel(dimensional, bodies, states, controls)
        parts = zip(dimensional, bodies, states, controls, strict=True)
        return np.concatenate([kernel(xi[None], body[None], at[None], moved) for xi, body, at, moved in parts])

    def controls(self, plane: str | None, orders: dict[str, np.ndarray] | None = None, n: int = 1) -> np.ndarray:
        """What the kernels take as controls, with the propeller of straight flight and all else at rest but for orders.

        `orders` are (n,) of all boats, or (n_boats, n) of each, SI units, by the columns of controls. The result is
        (n, n_kernel_controls), the same of all boats; (n_boats, n, n_kernel_controls) if they have their own.
        """
        actuators, orders = self.vehicle.actuators, orders or {}
        values = np.tile(actuators.rest, (n, 1))
        for column, angles in orders.items():
            values = values + angles[..., None] * actuators.share(column, "quantities")
        steady = [name for name in self.varied(plane) if actuators.parameters[name][1] != "delay"]
        if values.ndim == 2 and not steady:
            return actuators.kernel_controls(values, np.full(n, self.vehicle.speed_mps), plane)
        values = np.broadcast_to(values, (len(self), n, len(actuators.rest))).reshape(len(self) * n, -1)
        controls = actuators.kernel_controls(values, np.full(len(values), self.vehicle.speed_mps), plane)
        for name in steady:
            amounts = np.repeat(self.actuator_changes[name], n)[:, None]
            controls = controls + amounts * actuators.variation(name, values, plane)
        return controls.reshape(len(self), n, -1)

    def varied(self, plane: str | None) -> tuple[str, ...]:
        """The names of :attr:`actuator_changes` that have a part in a plane."""
        return tuple(name for name in self.actuator_changes if self.vehicle.actuators.moves(name, plane))

    def straight(self, n: int = 1) -> np.ndarray:
        """(n, 12) states of straight and level flight at the trial speed."""
        return np.tile(straight_and_level(self.vehicle), (n, 1))

    def confined(self, plane: str | None) -> np.ndarray:
        """(n, n_terms) coefficients, zero where they have no part in a plane."""
        idle = self.vehicle.idle(plane)
        return np.where([name in idle for name in self.vehicle.equations.names], 0.0, self.xi)

    def bodies(self, plane: str | None) -> np.ndarray:
        """(n, N_BODY) body vectors, confined to a plane as those of :meth:`bayesub.model.vehicles.Vehicle.restricted`.

        The weight of a boat in the horizontal plane is balanced.
        """
        body = np.tile(self.vehicle.restricted(plane).body, (len(self), 1))
        if self.body_changes is not None:
            idle = self.vehicle.idle(plane)
            body += np.where([key in idle for key in workspace.BODY], 0.0, self.body_changes)
        return body

    def _kernels_of(self, plane):
        """Sub-problem whose kernels fly a plane; forces from outside are confined to it by those of the plane only."""
        return None if self.in_six and not self.vehicle.actuators.external else plane
