"""The kinds of manoeuvre file: each says which plane angles a vehicle is ordered, and when."""

from functools import cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Length, Positive, Section, Speed
from bayesub.logs import log_files
from bayesub.model import closed_loop
from bayesub.model.actuators import Orders
from bayesub.model.vehicles import Vehicle, load_vehicle

RUDDER, BOW_PLANE, STERN_PLANE = "rudder_deg", "bow_plane_deg", "stern_plane_deg"
SAMPLE_S = 0.1  # spacing of a built control history on the boat of its time scale (thesis section 4.5)

MAX_SAMPLES = 100_000  # of a control history, nearly three hours; longer ones come as CSV
MAX_EXECUTES = 100

Angle = Annotated[float, pydantic.Field(ge=-90.0, le=90.0)]  # of a plane, degrees


class TimeScaleSection(Section):
    """The boat whose lengths and seconds those of the file are."""

    length_m: Length
    speed_mps: Speed


class TimedSection(Section):
    """Columns of orders, of which at least one is given, with the time at which each row is ordered."""

    time_s: tuple[float, ...] = pydantic.Field(min_length=1)

    @property
    def columns(self) -> dict[str, tuple[float, ...] | None]:
        """The columns of orders."""
        return {key: column for key, column in self if key != "time_s"}

    @pydantic.model_validator(mode="after")
    def _consistent(self):
        if any(b <= a for a, b in zip(self.time_s, self.time_s[1:], strict=False)) or self.time_s[0] < 0:
            raise ValueError("time_s must ascend from zero or later")
        columns = self.columns
        if not any(columns.values()):
            raise ValueError(f"give at least one of {', '.join(columns)}")
        for key, column in columns.items():
            if column is not None and len(column) != len(self.time_s):
                raise ValueError(f"{key} has {len(column)} entries, time_s has {len(self.time_s)}")
        return self


class StepsSection(TimedSection):
    """Orders by the columns of a log; besides the planes those of any other control that the vehicle has."""

    model_config = pydantic.ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, tuple[float, ...]]

    rudder_deg: tuple[Angle, ...] | None = None
    bow_plane_deg: tuple[Angle, ...] | None = None
    stern_plane_deg: tuple[Angle, ...] | None = None


class RudderAndDepthSection(TimedSection):
    """Rudder angles, and depths for the autopilot."""

    rudder_deg: tuple[Angle, ...]
    depth_m: tuple[float, ...]


def _in_time(given, info: pydantic.ValidationInfo):
    for when in given.time_s if isinstance(given, TimedSection) else [given]:
        if when > (end := info.data.get("duration_s", np.inf)):
            raise ValueError(f"an order at {when} s comes after the end, duration_s = {end:g}")
    return given


IN_TIME = pydantic.AfterValidator(_in_time)  # of times of orders, or tables that have them


class ManoeuvreFile(Section):
    """What every manoeuvre file has. Times and lengths are those of the boat of the time scale, if there is one.

    A kind of manoeuvre says which plane angles are ordered when; the vehicle's actuators turn orders into angles.
    """

    name: str
    description: str = ""
    reference: str = ""
    subproblem: Literal["horizontal", "vertical"] | None = None
    duration_s: float = pydantic.Field(gt=0, le=MAX_SAMPLES * SAMPLE_S)
    start_depth_m: float | None = None  # if left out, that of the vehicle's trials
    time_scale: TimeScaleSection | None = None

    @property
    def n_samples(self) -> int:
        """Intervals of the control history."""
        return max(1, round(self.duration_s / SAMPLE_S))

    def length_scale(self, vehicle: Vehicle) -> float:
        """Metres of `vehicle` in a metre of the file."""
        return 1.0 if self.time_scale is None else vehicle.length_m / self.time_scale.length_m

    def clock(self, vehicle: Vehicle) -> float:
        """Seconds of `vehicle` in a second of the file: ship lengths travelled are the same."""
        if self.time_scale is None:
            return 1.0
        return vehicle.length_m / vehicle.speed_mps / (self.time_scale.length_m / self.time_scale.speed_mps)

    def initial_state(self, vehicle: Vehicle) -> np.ndarray:
        """State (12,) at the start: straight and level, at the depth of the file or of the vehicle's trials."""
        state = straight_and_level(vehicle)
        if self.start_depth_m is not None:
            state[closed_loop.DEPTH] = self.start_depth_m * self.length_scale(vehicle)
        return state

    def orders(self, vehicle: Vehicle) -> Orders:
        """What is ordered of `vehicle`: column -> times (m,) in seconds of the file, and orders (m,) in SI units."""
        raise NotImplementedError

    def times(self, vehicle: Vehicle) -> np.ndarray:
        """Times (n_samples + 1,) of the control history, s."""
        return np.linspace(0.0, self.duration_s, self.n_samples + 1) * self.clock(vehicle)

    def responses(self, vehicle: Vehicle, orders: Orders) -> np.ndarray:
        """Values (n_samples + 1, n_actuators): the answer of the actuators to `orders`, SI units.

        InputError for a control that the vehicle does not have.
        """
        orders = {column: (at * self.clock(vehicle), ordered) for column, (at, ordered) in orders.items()}
        return vehicle.actuators.responses(self.times(vehicle), orders, f"manoeuvre '{self.name}'")


class StepsFile(ManoeuvreFile):
    """Plane angles ordered in steps."""

    kind: Literal["steps"]
    demands: Annotated[StepsSection, IN_TIME]

    def orders(self, _vehicle: Vehicle) -> Orders:
        """The angles of the file."""
        at = np.array(self.demands.time_s)
        given = {column: orders for column, orders in self.demands.columns.items() if orders is not None}
        return {column: (at, log_files.si_factor(column) * np.array(orders)) for column, orders in given.items()}


class RandomFile(ManoeuvreFile):
    """Random steps of rudder and stern planes (thesis section 8.2), uniform within limits that the planes can reach."""

    kind: Literal["random"]
    start_s: Annotated[float, pydantic.Field(ge=0), IN_TIME]
    interval_s: float = pydantic.Field(ge=SAMPLE_S)
    rudder_limit_deg: float = pydantic.Field(ge=0, le=90)
    stern_plane_limit_deg: float = pydantic.Field(ge=0, le=90)
    seed: int = pydantic.Field(ge=0)

    def orders(self, vehicle: Vehicle) -> Orders:
        """Angles drawn from the seed of the file."""
        rng = np.random.default_rng(self.seed)
        at = np.arange(self.start_s, self.duration_s, self.interval_s)
        limits = np.radians([self.rudder_limit_deg, self.stern_plane_limit_deg])
        places = [vehicle.equations.control(column, f"manoeuvre '{self.name}'") for column in (RUDDER, STERN_PLANE)]
        limits = np.minimum(limits, vehicle.actuators.limits[places])
        rudder, stern = (limits * rng.uniform(-1.0, 1.0, (len(at), 2))).T
        return {RUDDER: (at, rudder), STERN_PLANE: (at, stern)}


def _is_built_in(name: str) -> str:
    if name not in toml_files.built_in("vehicles"):
        raise ValueError(f"expected one of {', '.join(toml_files.built_in('vehicles'))}")
    return name


class ClosedLoopFile(ManoeuvreFile):
    """Orders that depend on the motion: those of the vehicle itself, or those that the vehicle `recorded_on` got."""

    recorded_on: Annotated[str, pydantic.AfterValidator(_is_built_in)] | None = None

    def orders(self, vehicle: Vehicle) -> Orders:
        """Those that `vehicle` gets in closed loop, or that the vehicle `recorded_on` got."""
        return self.recorded(vehicle) if self.recorded_on is None else _recorded(self, self.recorded_on)

    def recorded(self, vehicle: Vehicle) -> Orders:
        """The orders that `vehicle` gets when it flies in closed loop."""
        sample, clock = self.duration_s / self.n_samples, self.clock(vehicle)
        inputs, start = self.responses(vehicle, self.fixed), self.initial_state(vehicle)
        fixed = {column: (at * clock, ordered) for column, (at, ordered) in self.fixed.items()}
        source = f"manoeuvre '{self.name}'"
        flight = closed_loop.Flight(vehicle, self.subproblem, sample * clock, inputs, start, fixed, source)
        self.steer(flight)
        recorded = {j: (np.array(at) * sample, np.array(angles)) for j, (at, angles) in flight.orders.items()}
        return self.fixed | recorded

    @property
    def fixed(self) -> Orders:
        """Orders that do not depend on the motion."""
        return {}

    def steer(self, flight: closed_loop.Flight) -> None:
        """Fly to the end."""
        raise NotImplementedError


@cache
def _recorded(file: ClosedLoopFile, vehicle: str) -> Orders:
    return file.recorded(load_vehicle(vehicle))


class ZigzagFile(ClosedLoopFile):
    """A plane put over to the other side whenever heading or pitch has followed far enough; then amidships."""

    kind: Literal["zigzag"]
    plane: Literal["rudder", "stern_plane"]
    angle_deg: float = pydantic.Field(gt=0, le=90)
    reversal_deg: float = pydantic.Field(gt=0, le=360)
    executes: int = pydantic.Field(ge=1, le=MAX_EXECUTES)
    start_s: Annotated[float, pydantic.Field(ge=0), IN_TIME]

    def steer(self, flight: closed_loop.Flight) -> None:
        """Put the plane over again and again."""
        watched = log_files.STATES.index("psi" if self.plane == "rudder" else "theta")
        first = min(round(self.start_s / SAMPLE_S), self.n_samples)
        angles = np.radians([self.angle_deg, self.reversal_deg])
        closed_loop.zigzag(flight, f"{self.plane}_deg", angles[0], watched, angles[1], self.executes, first)


class AutopilotSection(Section):
    """Gains of :func:`bayesub.model.closed_loop.control_depth`."""

    interval_s: Positive
    pitch_limit_deg: float = pydantic.Field(gt=0, le=90)
    pitch_per_depth: Positive  # rad of pitch for a ship length of depth
    plane_per_pitch: Positive
    plane_per_pitch_rate: float  # rad of stern plane for 1 rad of pitch in a ship length travelled
    bow_planes: bool = False


class DepthControlFile(ClosedLoopFile):
    """Rudder steps, while an autopilot goes to the ordered depths with stern planes and, if set, bow planes."""

    kind: Literal["depth_control"]
    autopilot: AutopilotSection
    demands: Annotated[RudderAndDepthSection, IN_TIME]

    @property
    def fixed(self) -> Orders:
        """The rudder angles of the file."""
        return {RUDDER: (np.array(self.demands.time_s), np.radians(self.demands.rudder_deg))}

    def steer(self, flight: closed_loop.Flight) -> None:
        """Let the autopilot go to the ordered depths."""
        depths = np.full(self.n_samples + 1, flight.state[closed_loop.DEPTH])
        for time, depth in zip(self.demands.time_s, self.demands.depth_m, strict=True):
            depths[round(time / SAMPLE_S) :] = depth * self.length_scale(flight.vehicle)
        closed_loop.control_depth(flight, self.autopilot, depths, max(1, round(self.autopilot.interval_s / SAMPLE_S)))


KINDS: dict[str, type[ManoeuvreFile]] = {
    "steps": StepsFile,
    "zigzag": ZigzagFile,
    "depth_control": DepthControlFile,
    "random": RandomFile,
}


def read_manoeuvre(path: Path) -> ManoeuvreFile:
    """Read a manoeuvre file of any kind; InputError with file, key and remedy."""
    content = toml_files.read_toml_table(path)
    kind = content.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        expected = f"expected one of {', '.join(KINDS)}"
        if kind is not None:
            check_known(str(kind), KINDS, f"{path}: key 'kind' is '{kind}'", hint=expected, key="kind")
        raise InputError(f"{path}: key 'kind' is missing; {expected}", "missing", "kind")
    return toml_files.validate(content, KINDS[kind], str(path))


def straight_and_level(vehicle: Vehicle) -> np.ndarray:
    """State (12,) at the vehicle's trial speed and depth."""
    state = np.zeros(len(log_files.STATES))
    state[log_files.positions("z", "u")] = vehicle.depth_m, vehicle.speed_mps
    return state
