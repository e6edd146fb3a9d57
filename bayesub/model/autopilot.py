"""Autopilots of heading, depth and waypoints, and boats of which each is steered by its own motion.

Gains are in ship lengths travelled at the trial speed (U over L), so that one file suits boats of every size:

    rudder = a (psi - psi_o) + b r' + c I(psi - psi_o)
    pitch ordered = a (z - z_o)' + b I(z - z_o)', within a limit
    stern plane = a (theta - theta_o) + b theta_dot', the bow plane the same the other way, if it is used

with r' = r L / U, (z - z_o)' in ship lengths and I the integral over ship lengths travelled, which waits while its
output is at its limit. A positive rudder turns to port, a positive stern plane pitches the bow down (model manual,
section 7). Waypoints order the heading of the line of sight: to the point of a leg that is a lookahead further on than
the boat's projection on it (Fossen 2011, section 10.3.2).
"""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.toml_files import Positive, Section
from bayesub.kernels import workspace
from bayesub.kernels.variations import Variations, of_entries
from bayesub.logs import log_files
from bayesub.model.control_histories import PARTS, features
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import MAX_SPEED_RATIO, OF_MANOEUVRE, Simulator, choose_step
from bayesub.model.vehicles import Vehicle

PARALLEL = 2000  # steps of all boats in an interval, from which threads are worth their start
RUDDER, STERN, BOW = "rudder_deg", "stern_plane_deg", "bow_plane_deg"
PLANES = {"heading": "horizontal", "depth": "vertical"}  # a section -> the only sub-problem in which it has a part
Gain = pydantic.NonNegativeFloat
X, Y, Z, PHI, THETA, PSI, Q, R = log_files.positions("x", "y", "z", "phi", "theta", "psi", "q", "r")


class _Servo(Section):
    """What sections have in common: when orders begin to hold, and how far and fast planes move."""

    time_s: tuple[pydantic.NonNegativeFloat, ...] = pydantic.Field((0.0,), min_length=1)
    plane_limit_deg: float = pydantic.Field(gt=0, le=90)
    plane_rate_degps: Positive

    ORDERS: ClassVar[str]  # the key that has them

    def _check(self) -> None:
        if list(self.time_s) != sorted(set(self.time_s)) or self.time_s[0] != 0.0:
            raise ValueError("time_s must ascend from 0")
        orders = getattr(self, self.ORDERS)
        if orders is not None and len(orders) != len(self.time_s):
            raise ValueError(f"there must be an order for each of the {len(self.time_s)} times in time_s")


class HeadingSection(_Servo):
    """Orders and gains of the rudder: headings from given times on, or waypoints, one after the other."""

    heading_deg: tuple[float, ...] | None = None
    waypoints_m: tuple[tuple[float, float], ...] | None = pydantic.Field(None, min_length=1)  # north, east
    lookahead_m: Positive | None = None
    acceptance_m: Positive | None = None  # distance to a waypoint at which the next one is made for
    rudder_per_heading: Positive
    rudder_per_yaw_rate: Gain = 0.0
    rudder_per_heading_travelled: Gain = 0.0

    ORDERS: ClassVar[str] = "heading_deg"

    def _check(self) -> None:
        super()._check()
        if len({part is None for part in (self.waypoints_m, self.lookahead_m, self.acceptance_m)}) > 1:
            raise ValueError("waypoints_m, lookahead_m and acceptance_m go together")
        if (self.heading_deg is None) == (self.waypoints_m is None):
            raise ValueError("it needs heading_deg or waypoints_m, and not both")
        if self.waypoints_m is not None and "time_s" in self.model_fields_set:
            raise ValueError("time_s is of heading_deg, and waypoints_m are made for one after the other; leave it out")


class DepthSection(_Servo):
    """Orders and gains of the pitch and of the stern planes."""

    depth_m: tuple[float, ...]
    pitch_per_depth: Positive  # rad for a ship length
    pitch_per_depth_travelled: Gain = 0.0
    pitch_limit_deg: float = pydantic.Field(gt=0, le=80)
    plane_per_pitch: Positive
    plane_per_pitch_rate: Gain = 0.0
    bow_planes: bool = False

    ORDERS: ClassVar[str] = "depth_m"


class Autopilot(Section):
    """An autopilot file."""

    name: str
    description: str = ""
    interval_s: Positive  # between orders
    heading: HeadingSection | None = None
    depth: DepthSection | None = None

    def _check(self) -> None:
        if self.heading is None and self.depth is None:
            raise ValueError("it needs a table [heading] or [depth]")

    @property
    def steered(self) -> dict[str, _Servo]:
        """Column of each control that it orders -> limit and rate."""
        found: dict[str, _Servo] = {} if self.heading is None else {RUDDER: self.heading}
        if self.depth is not None:
            found |= {STERN: self.depth} | ({BOW: self.depth} if self.depth.bow_planes else {})
        return found


def load_autopilot(path: str | Path) -> Autopilot:
    """Read an autopilot file; InputError with file, key and remedy."""
    return toml_files.read_toml(Path(path), Autopilot)


class Helm:
    """The memory of an autopilot for each boat of a batch: integrals, and the leg of the path."""

    def __init__(self, autopilot: Autopilot, vehicle: Vehicle, start: np.ndarray):
        self._autopilot, self._length = autopilot, vehicle.length_m
        self._second = vehicle.speed_mps / vehicle.length_m  # ship lengths travelled in it
        self._integrals = {"heading": np.zeros(len(start)), "depth": np.zeros(len(start))}
        self._from, self._leg = start[:, [X, Y]].copy(), np.zeros(len(start), dtype=int)

    def orders(self, states: np.ndarray, time: float) -> np.ndarray:
        """(n_batch, n_steered) orders at states (n_batch, 12), rad, in the order of :attr:`Autopilot.steered`."""
        heading, depth, columns = self._autopilot.heading, self._autopilot.depth, []
        if heading is not None:
            error = states[:, PSI] - self._course(heading, states, time)
            error = (error + np.pi) % (2.0 * np.pi) - np.pi
            rudder = heading.rudder_per_heading * error + heading.rudder_per_yaw_rate * states[:, R] / self._second
            limit = np.radians(heading.plane_limit_deg)
            columns.append(self._with_integral("heading", rudder, error, heading.rudder_per_heading_travelled, limit))
        if depth is not None:
            error = (states[:, Z] - _now(depth.depth_m, depth, time)) / self._length
            limit, gain = np.radians(depth.pitch_limit_deg), depth.pitch_per_depth_travelled
            pitch = self._with_integral("depth", depth.pitch_per_depth * error, error, gain, limit)
            rate = states[:, Q] * np.cos(states[:, PHI]) - states[:, R] * np.sin(states[:, PHI])
            stern = depth.plane_per_pitch * (states[:, THETA] - pitch)
            stern += depth.plane_per_pitch_rate * rate / self._second
            columns += [stern, -stern] if depth.bow_planes else [stern]
        return np.stack(columns, axis=1)

    def _with_integral(self, name, output, error, gain, limit) -> np.ndarray:
        """An output within a limit, with an integral that waits while the output is there."""
        total = output + gain * self._integrals[name]
        lengths = self._second * self._autopilot.interval_s
        self._integrals[name] += np.where(np.abs(total) < limit, error, 0.0) * lengths
        return np.clip(total, -limit, limit)

    def _course(self, heading: HeadingSection, states: np.ndarray, time: float) -> np.ndarray | float:
        """(n_batch,) or one ordered heading, rad."""
        if heading.heading_deg is not None:
            return np.radians(_now(heading.heading_deg, heading, time))
        points, places = np.array(heading.waypoints_m), states[:, [X, Y]]
        near = np.linalg.norm(places - points[self._leg], axis=1) < heading.acceptance_m
        near &= self._leg < len(points) - 1
        self._from[near] = points[self._leg[near]]
        self._leg += near
        north, east = (points[self._leg] - self._from).T
        bearing, off = np.arctan2(east, north), places - self._from
        aside = off[:, 1] * np.cos(bearing) - off[:, 0] * np.sin(bearing)
        return bearing - np.arctan2(aside, heading.lookahead_m or np.inf)


def _now(orders: tuple[float, ...], servo: _Servo, time: float) -> float:
    return orders[np.searchsorted(servo.time_s, time, side="right") - 1]


@dataclass(eq=False, repr=False)
class SteeredSimulator(Simulator):
    """A vehicle under an autopilot, which steers each member of a batch by the motion of that member.

    Of the manoeuvre remain its duration, start and propeller, and the planes that the autopilot does not order. Planes
    move to an order at a steady rate in each interval; delays and lags of fins have no part, their scales have. The
    motion has no derivatives. InputError for what the vehicle cannot do, and for a sub-problem in which it has no part.
    """

    autopilot: Autopilot = field(kw_only=True)

    def __post_init__(self):
        vehicle, manoeuvre, autopilot = self.vehicle, self.manoeuvre, self.autopilot
        wanted = manoeuvre.subproblem if self.subproblem == OF_MANOEUVRE else self.subproblem
        plane = vehicle.equations.subproblem(wanted)
        for name, only in PLANES.items():
            if getattr(autopilot, name) is not None and plane not in (None, only):
                text = f"autopilot '{autopilot.name}': [{name}] has no part in the {plane} sub-problem; leave it out"
                raise InputError(text, "conflict", name)
        source = f"autopilot '{autopilot.name}'"
        self._shares = np.array([vehicle.actuators.share(column, source) for column in autopilot.steered])
        self._moved = [int(i) for i in np.flatnonzero(self._shares.any(axis=0))]
        for actuator in (vehicle.actuators.members[i] for i in self._moved):
            if not actuator.is_linear:
                raise InputError(f"{source}: steers by fins, found {actuator.column}", "model", actuator.column)
        longest = choose_step(vehicle, manoeuvre, plane, self.attitude) if self.dt is None else self.dt
        self._n = max(1, int(np.ceil(autopilot.interval_s / longest * (1 - 1e-12))))
        self.dt = autopilot.interval_s / self._n
        self.manoeuvre = self._with_planes(manoeuvre.times, np.zeros((len(manoeuvre.times), len(self._shares))))
        super().__post_init__()

    def _with_planes(self, times: np.ndarray, planes: np.ndarray) -> Manoeuvre:
        """The manoeuvre at times (n,), with what is steered at planes (n, n_steered), rad."""
        manoeuvre, actuators = self.manoeuvre, self.vehicle.actuators
        inputs = manoeuvre.controls if manoeuvre.inputs is None else manoeuvre.inputs
        inputs = np.stack([np.interp(times, manoeuvre.times, column) for column in inputs.T], axis=1)
        inputs[:, self._moved] = actuators.zeros[self._moved]
        inputs += planes @ self._shares
        rpm = np.interp(times, manoeuvre.times, manoeuvre.rpm)
        if manoeuvre.inputs is None:
            return replace(manoeuvre, times=times, controls=inputs, rpm=rpm)
        return replace(manoeuvre, times=times, controls=actuators.mixed(inputs), inputs=inputs, rpm=rpm)

    @classmethod
    def of(cls, simulator: Simulator, autopilot: Autopilot) -> "SteeredSimulator":
        """A simulator as it is, but steered."""
        parts = {part.name: getattr(simulator, part.name) for part in fields(Simulator) if part.init}
        return cls(**parts | {"dt": simulator.step}, autopilot=autopilot)

    def recorded(self, xi: np.ndarray | None = None) -> Manoeuvre:
        """The control history of coefficients (n_terms,), by default of the vehicle itself, as a manoeuvre.

        InputError if that boat does not complete it.
        """
        _, status, planes = self.steered(self.vehicle.xi if xi is None else xi)
        if status[0]:
            text = f"'{self.vehicle.name}' does not complete {self.manoeuvre.name} under autopilot"
            raise InputError(f"{text} '{self.autopilot.name}'", "model", self.autopilot.name)
        ends = np.arange(planes.shape[1]) * self.autopilot.interval_s
        times = np.union1d(self.manoeuvre.times, np.minimum(ends, self.manoeuvre.duration))
        followed = self._with_planes(times, np.stack([np.interp(times, ends, one) for one in planes[0].T], axis=1))
        return replace(followed, name=f"{followed.name} under {self.autopilot.name}")

    def run(self, xi: np.ndarray, **given: Any) -> tuple[np.ndarray, np.ndarray]:
        """As :meth:`Simulator.run`, each member steered by its own motion; there is no other steering."""
        if given.pop("steering", None) is not None:
            raise InputError("an autopilot steers, and no policy of forces besides", "conflict", "steering")
        return self.steered(xi, **given)[:2]

    def steered(
        self,
        xi: np.ndarray,
        *,
        body: np.ndarray | None = None,
        initial: np.ndarray | None = None,
        amounts: np.ndarray | None = None,
        outputs: tuple[str, ...] = log_files.STATES,
        parallel: bool = True,
        times: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """States and status as of :meth:`run`, and where the planes are, (n_batch, n_intervals + 1, n_steered), rad."""
        dimensional = self.dimensional(xi)
        times = self.times if times is None else np.asarray(times)
        n_batch, interval = len(dimensional), self.autopilot.interval_s
        bodies, states = self._bodies(body, n_batch), self._initials(initial, n_batch)
        amounts = np.zeros((n_batch, len(self._varied))) if amounts is None else amounts
        given, scales = self._stage_changes.numbers(amounts), self._scales(amounts)
        intervals = np.maximum(np.ceil(times / interval * (1 - 1e-9)).astype(int) - 1, 0)
        n_intervals = intervals[-1] + 1
        helm, servos = Helm(self.autopilot, self.vehicle, states), self.autopilot.steered.values()
        limits = np.radians([servo.plane_limit_deg for servo in servos])
        furthest = np.radians([servo.plane_rate_degps for servo in servos]) * interval
        planes = np.zeros((n_batch, n_intervals + 1, len(limits)))
        motion = np.full((n_batch, len(times), len(outputs)), np.nan)
        status, rows = np.zeros(n_batch, dtype=np.int8), np.arange(workspace.N_STATES + 6)
        for k in range(n_intervals):
            begin, now = k * interval, planes[:, k]
            orders = np.clip(np.nan_to_num(helm.orders(states, begin)), -limits, limits)
            planes[:, k + 1] = now + np.clip(orders - now, -furthest, furthest)
            ends = [scales * (some @ self._shares[:, self._moved]) for some in (now, planes[:, k + 1])]
            inside = np.flatnonzero(intervals == k)
            at = np.minimum(times[inside] - begin, interval)
            flown, fate = self.kernels.integrate(
                dimensional, bodies, states, self._stages_of(k), self._changes_of(k, given.shape[1]),
                np.hstack([given, *ends]), self.step, np.append(at, interval),
                MAX_SPEED_RATIO * self.vehicle.speed_mps, rows,
                quaternions=self.attitude == "quaternion", parallel=parallel and len(dimensional) * self._n > PARALLEL,
            )  # fmt: skip
            motion[:, inside] = flown[:, :-1, log_files.positions(*outputs)]
            states = flown[:, -1, : workspace.N_STATES].copy()
            status = np.where(status == 0, fate, status)
        motion[~np.isfinite(motion).all(axis=2)] = np.nan
        if self.attitude == "quaternion":
            angles = np.isin(outputs, log_files.ANGLES)
            motion[..., angles] = np.unwrap(motion[..., angles], axis=1)
        return motion, status, planes

    def _scales(self, amounts) -> np.ndarray:
        """(n_batch, n_moved) what fins do of what they are ordered to."""
        scales = np.ones((len(amounts), len(self._moved)))
        for name, (i, kind) in self.vehicle.actuators.parameters.items():
            if kind == "scale" and i in self._moved:
                changed = amounts[:, self._varied.index(name)] if name in self._varied else 0.0
                scales[:, self._moved.index(i)] += changed + self.changes.get(name, 0.0)
        return scales

    def _stages_of(self, k: int) -> np.ndarray:
        """(n + 1, 3, n_columns) the stages of the steps of an interval; after the last one the last stays."""
        return self._stages[np.minimum(k * self._n + np.arange(self._n + 1), len(self._stages) - 1)]

    @cached_property
    def _lines(self) -> tuple[np.ndarray, ...]:
        """Entries of the stages of an interval: begins and ends of a straight line of each fin that is moved."""
        stages = np.arange(3 * (self._n + 1))
        rest = np.minimum((stages // 3 + PARTS[stages % 3, 1]) / self._n, 1.0)
        rows = [features(self.vehicle.actuators, i, self.subproblem)[0].row for i in self._moved]
        lines = list(enumerate(product((1.0 - rest, rest), rows)))
        parts = [
            (stages, np.full(len(stages), number), np.full(len(stages), column), row[column] * share)
            for number, (share, row) in lines
            for column in np.flatnonzero(row)
        ]
        return tuple(np.concatenate(part) for part in zip(*parts, strict=True))

    def _changes_of(self, k: int, n_given: int) -> Variations:
        """What members change in an interval: what the simulator has of n_given changes, and the lines of the fins."""
        starts, *entries = self._stage_changes.variations
        first, last = (min(3 * (k * self._n + n), len(starts) - 1) for n in (0, self._n + 1))
        before = np.repeat(np.arange(last - first), np.diff(starts[first : last + 1]))
        given = before, *(part[starts[first] : starts[last]] for part in entries)
        stages, numbers, *others = self._lines
        both = zip(given, (stages, n_given + numbers, *others), strict=True)
        return of_entries(self._n + 1, *(np.concatenate(parts) for parts in both))
