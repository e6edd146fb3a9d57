"""Manoeuvres: control histories to fly, built from a TOML description for a vehicle or read from a CSV file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import toml_files
from bayesub.io.arguments import checked
from bayesub.io.equality import ByContent
from bayesub.io.errors import InputError, error_source
from bayesub.logs import log_files
from bayesub.model.actuator import with_water
from bayesub.model.actuators import command_column, values_of_log, with_commands
from bayesub.model.manoeuvre_files import ManoeuvreFile, RandomFile, read_manoeuvre, straight_and_level
from bayesub.model.prescribed import Prescribed
from bayesub.model.vehicles import Vehicle


@dataclass(frozen=True, eq=False)
class Manoeuvre(ByContent):
    """A control history, the same for every coefficient set that flies it."""

    name: str
    times: np.ndarray  # (n,) ascending from zero, s
    # (n, n_controls) of the vehicle's equations, SI units: of submarines rudder, bow and stern plane, rad
    controls: np.ndarray
    rpm: np.ndarray  # (n,) propeller speed
    # (12,) straight and level, at the vehicle's trial speed, and at its trial depth or that of the file
    initial_state: np.ndarray
    # plane to which the motion is confined unless the caller says otherwise, "horizontal" or "vertical"
    subproblem: str | None = None
    description: str = ""
    # short names of the controls, by default those of the submarine's three
    columns: tuple[str, ...] = log_files.CONTROLS
    # (n, n_actuators) of the actuators in the columns of a log, SI units, of which `controls` are the mix; None of a
    # vehicle whose actuators are the controls themselves
    inputs: np.ndarray | None = None
    input_columns: tuple[str, ...] = ()  # short names of these columns
    # short names of the controls or actuators whose histories are commands, which hold until the next
    commanded: tuple[str, ...] = ()
    prescribed: tuple[Prescribed, ...] = ()  # angles that the boat follows instead of being turned by moments

    def __post_init__(self):
        for array in (self.times, self.controls, self.rpm, self.initial_state, self.inputs):
            if array is not None:
                array.setflags(write=False)

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return float(self.times[-1])

    @property
    def log(self) -> dict[str, np.ndarray]:
        """Short name -> (n,) histories as a log has them: of actuators or controls, and the propeller speed."""
        names, inputs = (self.columns, self.controls) if self.inputs is None else (self.input_columns, self.inputs)
        return dict(zip(map(self.logged, names), inputs.T, strict=True)) | {"rpm": self.rpm}

    def logged(self, name: str) -> str:
        """Name in memory of the column of a log that has a control or actuator, or what is ordered of it."""
        return command_column(log_files.HEADERS.get(name, name)) if name in self.commanded else name

    def check(self, vehicle: Vehicle) -> None:
        """InputError if the manoeuvre moves other controls or actuators than a vehicle has."""
        moved, present = self.columns, tuple(control.short for control in vehicle.equations.controls)
        if not vehicle.actuators.direct:
            present = vehicle.actuators.shorts
            moved = moved if self.inputs is None else self.input_columns
        if moved != present:
            fault = f"manoeuvre '{self.name}' moves {', '.join(moved) or 'nothing'}"
            text = f"{fault}, '{vehicle.name}' is moved by {', '.join(present) or 'nothing'}; load it for this vehicle"
            raise InputError(text, "conflict", self.name)


@checked
def load_manoeuvre(name: str | Path, vehicle: Vehicle) -> Manoeuvre:
    """Build a manoeuvre for `vehicle` from a built-in name, a TOML file or a control-history CSV.

    ``random:17`` is the random manoeuvre of seed 17. A CSV has the columns ``time_s``, those of the vehicle's actuators
    such as ``rudder_deg, bow_plane_deg, stern_plane_deg``, and ``rpm``; what is missing rests at zero, and without
    ``rpm`` the propeller keeps its self-propelled speed. InputError with file, key and remedy.
    """
    if str(name).startswith("random:"):
        seed = str(name).removeprefix("random:")
        if not seed.isdecimal():
            raise InputError(f"the seed in '{name}' must be a whole number, as in random:17", "value", "seed")
        return _build(_random_file(seed=int(seed)), vehicle)
    path = toml_files.find(str(name), "manoeuvres")
    if path.suffix.lower() == ".csv":
        return _from_csv(path, vehicle)
    with error_source(str(path)):
        return _build(read_manoeuvre(path), vehicle)


@checked
def random_manoeuvre(vehicle: Vehicle, rng: np.random.Generator, **changes: object) -> Manoeuvre:
    """A random manoeuvre (thesis section 8.2), like ``load_manoeuvre("random", vehicle)`` with a seed drawn from `rng`.

    The name of the manoeuvre holds the seed, and loads it again if there are no `changes`, keys of a manoeuvre file of
    kind "random", such as ``interval_s=50.0`` or ``rudder_limit_deg=15.0``.
    """
    return _build(_random_file(seed=int(rng.integers(2**32)), **changes), vehicle)


def _random_file(seed: int, **changes) -> RandomFile:
    content = toml_files.read_toml_table(toml_files.find("random", "manoeuvres"))
    content = content | {"name": f"random:{seed}", "seed": seed} | changes
    return toml_files.validate(content, RandomFile, "random manoeuvre")


def _build(file: ManoeuvreFile, vehicle: Vehicle) -> Manoeuvre:
    times, inputs = file.times(vehicle), file.responses(vehicle, file.orders(vehicle))
    rpm, start = np.full(len(times), vehicle.rpm_per_mps * vehicle.speed_mps), file.initial_state(vehicle)
    about = {"subproblem": file.subproblem, "description": file.description}
    return of_inputs(file.name, times, inputs, rpm, start, vehicle, **about)


def of_inputs(
    name: str,
    times: np.ndarray,
    inputs: np.ndarray,
    rpm: np.ndarray,
    initial_state: np.ndarray,
    vehicle: Vehicle,
    **others: Any,
) -> Manoeuvre:
    """The manoeuvre of inputs (n, n_actuators) to the actuators of a vehicle; the rest as for :class:`Manoeuvre`.

    Where the propeller speed is a control of the equations, it is that of the inputs.
    """
    actuators = vehicle.actuators
    if "rpm" in actuators.shorts:
        rpm = inputs[:, actuators.shorts.index("rpm")]
    columns = tuple(control.short for control in vehicle.equations.controls)
    if not actuators.direct:
        others |= {"inputs": inputs, "input_columns": actuators.shorts}
    return Manoeuvre(name, times, actuators.mixed(inputs), rpm, initial_state, columns=columns, **others)


def _from_csv(path: Path, vehicle: Vehicle) -> Manoeuvre:
    actuators = vehicle.actuators
    log = with_water(log_files.read_log(path, actuators.log_columns), actuators.members)
    log, commanded = with_commands(log, actuators)
    times = log.pop("time")
    values = values_of_log(actuators, log, len(times), str(path))
    if log and not any(name in log for name in vehicle.inputs):
        expected = ", ".join(log_files.HEADERS.get(name, name) for name in vehicle.inputs)
        raise InputError(f"{path}: has no control column; expected some of {expected}", "missing")
    if times[0] != 0.0:
        raise InputError(f"{path}: a control history begins at time_s = 0, found {times[0]:g}", "data", "time_s")
    if len(times) < 2:
        raise InputError(f"{path}: a control history needs at least two rows", "data", "time_s")
    rpm = vehicle.propeller_speed(log, len(times))
    if not (np.isfinite(values).all() and np.isfinite(rpm).all()):
        raise InputError(f"{path}: a control column has empty cells; every row needs its controls", "data")
    return of_inputs(path.stem, times, values, rpm, straight_and_level(vehicle), vehicle, commanded=commanded)
