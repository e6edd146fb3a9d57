"""Manoeuvres: control histories to fly, built from a TOML description for a vehicle or read from a CSV file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pydantic

from bayesub import inputs, logs
from bayesub.errors import InputError
from bayesub.inputs import Positive, Section
from bayesub.kernels import actuators
from bayesub.vehicles import Vehicle

PLANES = ("rudder", "bow_plane", "stern_plane")
SAMPLE_S = 0.1  # spacing of a built control history on the boat of its time scale (thesis section 4.5)


class TimeScaleSection(Section):
    length_m: Positive
    speed_mps: Positive


class DemandsSection(Section):
    time_s: tuple[float, ...] = pydantic.Field(min_length=1)
    rudder_deg: tuple[float, ...] | None = None
    bow_plane_deg: tuple[float, ...] | None = None
    stern_plane_deg: tuple[float, ...] | None = None

    @pydantic.model_validator(mode="after")
    def _consistent(self):
        if any(b <= a for a, b in zip(self.time_s, self.time_s[1:], strict=False)) or self.time_s[0] < 0:
            raise ValueError("time_s must ascend from zero or later")
        given = {f"{p}_deg": getattr(self, f"{p}_deg") for p in PLANES if getattr(self, f"{p}_deg") is not None}
        if not given:
            raise ValueError("give at least one of rudder_deg, bow_plane_deg, stern_plane_deg")
        for key, angles in given.items():
            if len(angles) != len(self.time_s):
                raise ValueError(f"{key} has {len(angles)} entries, time_s has {len(self.time_s)}")
        return self


class ManoeuvreFile(Section):
    """The content of a manoeuvre file: plane angles ordered in steps and reached through the vehicle's actuators."""

    name: str
    description: str = ""
    reference: str = ""
    kind: Literal["steps"]
    subproblem: Literal["horizontal", "vertical"] | None = None
    duration_s: Positive
    time_scale: TimeScaleSection | None = None
    demands: DemandsSection


@dataclass(frozen=True)
class Manoeuvre:
    """A control history, the same for every coefficient set that flies it.

    Attributes
    ----------
    times : (n,) ascending from zero, s
    controls : (n, 3) rudder, bow plane, stern plane, rad
    rpm : (n,) propeller speed
    initial_state : (12,) straight and level, at the vehicle's trial speed and depth
    subproblem : plane to which the motion is confined unless the caller says otherwise, or None
    """

    name: str
    times: np.ndarray
    controls: np.ndarray
    rpm: np.ndarray
    initial_state: np.ndarray
    subproblem: str | None = None
    description: str = ""

    def __post_init__(self):
        for array in (self.times, self.controls, self.rpm, self.initial_state):
            array.setflags(write=False)

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return float(self.times[-1])


def load_manoeuvre(name: str | Path, vehicle: Vehicle) -> Manoeuvre:
    """Build a manoeuvre for `vehicle` from a built-in name, a TOML file or a control-history CSV.

    A CSV has the columns ``time_s, rudder_deg, bow_plane_deg, stern_plane_deg, rpm``; missing plane columns are zero
    and without ``rpm`` the propeller keeps its self-propelled speed. InputError names file, key and remedy.
    """
    path = inputs.find(str(name), "manoeuvres")
    if path.suffix.lower() == ".csv":
        return _from_csv(path, vehicle)
    file = inputs.read_toml(path, ManoeuvreFile)
    scale = 1.0
    if file.time_scale is not None:
        reference = file.time_scale.length_m / file.time_scale.speed_mps
        scale = vehicle.length_m / vehicle.speed_mps / reference
    n = round(file.duration_s / SAMPLE_S)
    times = np.linspace(0.0, file.duration_s, n + 1) * scale
    demand_times = np.array(file.demands.time_s) * scale
    controls = np.zeros((n + 1, 3))
    for j, plane in enumerate(PLANES):
        angles = getattr(file.demands, f"{plane}_deg")
        if angles is not None:
            controls[:, j] = actuators.response(
                times,
                demand_times,
                np.radians(angles),
                vehicle.plane_rate_radps,
                vehicle.plane_time_constant_s,
                vehicle.plane_limits_rad[j],
            )
    return Manoeuvre(
        name=file.name,
        times=times,
        controls=controls,
        rpm=np.full(n + 1, vehicle.rpm_per_mps * vehicle.speed_mps),
        initial_state=_straight_and_level(vehicle),
        subproblem=file.subproblem,
        description=file.description,
    )


def _from_csv(path: Path, vehicle: Vehicle) -> Manoeuvre:
    log = logs.read_log(path)
    times = log.pop("time")
    unknown = [name for name in log if name not in (*logs.CONTROLS, "rpm")]
    if unknown and not any(name in log for name in (*logs.CONTROLS, "rpm")):
        raise InputError(f"{path}: has no control column; expected some of {', '.join(logs.CONTROL_COLUMNS)}")
    if times[0] != 0.0:
        raise InputError(f"{path}: a control history begins at time_s = 0, found {times[0]:g}")
    if len(times) < 2:
        raise InputError(f"{path}: a control history needs at least two rows")
    zero = np.zeros(len(times))
    controls = np.column_stack([log.get(name, zero) for name in logs.CONTROLS])
    rpm = log.get("rpm", np.full(len(times), vehicle.rpm_per_mps * vehicle.speed_mps))
    if not (np.isfinite(controls).all() and np.isfinite(rpm).all()):
        raise InputError(f"{path}: a control column has empty cells; every row needs its controls")
    return Manoeuvre(path.stem, times, controls, rpm, _straight_and_level(vehicle))


def _straight_and_level(vehicle: Vehicle) -> np.ndarray:
    state = np.zeros(12)
    state[2], state[6] = vehicle.depth_m, vehicle.speed_mps
    return state
