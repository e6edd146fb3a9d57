"""Closed loops: plane orders that depend on how the vehicle moves, flown once by the kernels and recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError
from bayesub.kernels import workspace
from bayesub.kernels.variations import of_dense
from bayesub.logs.log_files import positions
from bayesub.model.actuators import Orders
from bayesub.model.vehicles import Vehicle

if TYPE_CHECKING:  # which imports this module
    from bayesub.model.manoeuvre_files import AutopilotSection

BOW_PLANE, STERN_PLANE = "bow_plane_deg", "stern_plane_deg"
DEPTH, ROLL, PITCH = positions("z", "phi", "theta")
PITCH_RATE, YAW_RATE = positions("q", "r")


class Flight:
    """A vehicle under way, steered by orders that hold for whole samples of its control history.

    Between samples (`sample` s apart) the planes move linearly and the integrator takes one step, so that flying the
    recorded history again with a step of one sample gives the same track. It begins with a state (12,). Of the `inputs`
    (n + 1, n_actuators) to the actuators, SI units, those that are not ordered stay as they are, the others are
    overwritten. The orders `fixed` are given, and `inputs` are the answer to them; `source` names them in errors.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        subproblem: str | None,
        sample: float,
        inputs: np.ndarray,
        state: np.ndarray,
        fixed: Orders,
        source: str,
    ):
        self.vehicle, self.subproblem = vehicle.restricted(subproblem), subproblem
        self.sample, self.inputs, self.state, self.fixed, self.source = sample, inputs, state, fixed, source
        self.now = 0  # samples flown
        self.orders: dict[str, tuple[list[int], list[float]]] = {}  # column -> (samples of the orders, orders)
        self._dimensional = (self.vehicle.xi * vehicle.dimensional_factors)[None]
        self._body = np.concatenate([self.vehicle.body, vehicle.constants])[None]

    @property
    def remaining(self) -> int:
        """Samples left."""
        return len(self.inputs) - 1 - self.now

    def ahead(self, orders: dict[str, float], n: int) -> np.ndarray:
        """States (n, 12) of the next `n` samples if the planes are given these orders (rad) now."""
        elapsed, actuators = np.arange(n + 1) * self.sample, self.vehicle.actuators
        inputs = self.inputs[self.now : self.now + n + 1]
        given = {column: (elapsed[:1], np.array([order])) for column, order in orders.items()}
        fixed = {}  # by the time from now, of those before now the last one
        for column, (times, ordered) in self.fixed.items():
            times = times - self.now * self.sample
            first = max(0, np.count_nonzero(times <= 0.0) - 1)
            fixed[column] = np.maximum(times[first:], 0.0), ordered[first:]
        demands = actuators.demands(fixed | given, self.source)
        for i in actuators.demands(given, self.source):
            inputs[:, i] = actuators.members[i].response(elapsed, *demands[i], start=inputs[0, i])
        self_propelled = np.full(n + 1, self.vehicle.speed_mps)  # n/k0
        span = actuators.kernel_controls(inputs, self_propelled, self.subproblem)
        following = np.concatenate([span[1:], span[-1:]])
        stages = np.stack([span, 0.5 * (span + following), following], axis=1)
        unchanged = of_dense(np.zeros((*stages.shape[:2], 0, stages.shape[2]))), np.zeros((1, 0))
        boat, outputs = (self._dimensional, self._body, self.state[None]), np.arange(workspace.N_STATES)
        integrate = self.vehicle.kernels(self.subproblem).integrate
        states, _ = integrate(*boat, stages, *unchanged, self.sample, elapsed[1:], np.inf, outputs)
        return states[0]

    def hold(self, orders: dict[str, float], n: int) -> None:
        """Give these orders (rad) and fly `n` samples."""
        if n == 0:
            return
        for plane, order in orders.items():
            samples, angles = self.orders.setdefault(plane, ([], []))
            samples.append(self.now)
            angles.append(order)
        self.state = self.ahead(orders, n)[-1]
        self.now += n
        if not np.isfinite(self.state).all():
            fault = f"vehicle '{self.vehicle.name}' does not survive this closed-loop manoeuvre"
            raise InputError(f"{fault}: it fails before {self.now * self.sample:.4g} s", "model", self.vehicle.name)


def zigzag(flight: Flight, plane: str, angle: float, watched: int, reversal: float, executes: int, first: int) -> None:
    """Put a plane over, and to the other side whenever heading or pitch has followed far enough; then amidships.

    The plane, a column of a control, is put over `executes` times to an `angle` (rad), from the sample `first` on, and
    `watched` is the position of heading or pitch in the state, which must go to its side by `reversal` (rad).
    """
    flight.hold({plane: 0.0}, first)
    sign = 0.0
    for execute in range(executes):
        if not flight.remaining:
            return
        order = {plane: angle if execute % 2 == 0 else -angle}
        motion = flight.ahead(order, flight.remaining)[:, watched]
        # The first leg shows to which side the plane sends the boat.
        reached = np.flatnonzero((np.abs(motion) if execute == 0 else sign * motion) >= reversal)
        n = reached[0] + 1 if reached.size else flight.remaining
        flight.hold(order, n)
        sign = -np.sign(motion[n - 1])
    flight.hold({plane: 0.0}, flight.remaining)


def control_depth(flight: Flight, autopilot: AutopilotSection, depths: np.ndarray, every: int) -> None:
    """Let an autopilot bring the boat to ordered depths.

    The depth error in ship lengths orders a pitch, up to a limit, and the pitch error and the pitch rate (per ship
    length travelled) order the stern planes, of which a positive angle pitches the bow down; the bow planes, if used,
    mirror them. `depths` (n + 1,) are ordered at each sample, m; an order follows the one before after `every` samples.
    """
    length, speed = flight.vehicle.length_m, flight.vehicle.speed_mps
    limit = np.radians(autopilot.pitch_limit_deg)
    while flight.remaining:
        roll, pitch = flight.state[ROLL], flight.state[PITCH]
        q, r = flight.state[[PITCH_RATE, YAW_RATE]]
        pitch_rate = (q * np.cos(roll) - r * np.sin(roll)) * length / speed
        too_deep = (flight.state[DEPTH] - depths[flight.now]) / length
        ordered_pitch = np.clip(autopilot.pitch_per_depth * too_deep, -limit, limit)
        stern = autopilot.plane_per_pitch * (pitch - ordered_pitch) + autopilot.plane_per_pitch_rate * pitch_rate
        orders = {STERN_PLANE: stern, BOW_PLANE: -stern} if autopilot.bow_planes else {STERN_PLANE: stern}
        flight.hold(orders, min(every, flight.remaining))
