"""New study files: of a manoeuvre that is simulated, or of a log."""

from pathlib import Path

import numpy as np

from bayesub.io import templates
from bayesub.io.errors import InputError
from bayesub.io.units import TURN
from bayesub.kernels import workspace
from bayesub.logs import log_files
from bayesub.logs.columns import SMOOTH
from bayesub.model.actuator import with_water
from bayesub.model.actuators import values_of_log, with_commands
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem.nuisance import MOVING, PROPELLER
from bayesub.sensors import velocity
from bayesub.sensors.sensor import QUANTITIES, channel_name
from bayesub.study.new import files

FEW = 40  # coefficients up to which five searches take 4 s; of 83 five took 27, and two 12
STILL = 1e-9  # rad, and of the largest force: round-off in a control or a force that actuators do not move
_ACROSS = {"Y": "horizontal", "N": "horizontal", "Z": "vertical", "M": "vertical", "K": None}  # planes of forces
_NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal
_ROUND_OFF = 1e-9  # of the range of a column
_VARIES = 3.0  # times as large as the finest is the step of a column that is written with so many digits, not decimals
_WHOLE = 0.01  # steps off a whole number of them, within which half of the readings are multiples of a step
_FINEST, _SMOOTHED = (1e-5, "no instrument is finer"), (1e-3, "it was smoothed")  # least noise, of the range
_MANY = 5000  # readings up to which all are taken
_OVER_GROUND = {"x", "y", "u_ground", "v_ground", *velocity.OVER_GROUND}


def simulated(name: str, path: Path, vehicle: str, manoeuvre: str) -> str:
    """The text of a study file `path` that simulates a vehicle on a manoeuvre and measures its track."""
    boat, plane = load_vehicle(vehicle), manoeuvre if manoeuvre in MOVING else None
    about = {"what": f"the manoeuvre {manoeuvre}", "manoeuvre": files.seen_from(path, manoeuvre)}
    is_few = len(boat.equations.active(boat, subproblem=plane)) <= FEW
    asked = {"column": "x_m", "instrument": "track", "free": plane or "all", "is_few": is_few}
    return _text(name, path, boat, vehicle, **about, **asked)


def of_log(name: str, path: Path, vehicle: str, data: Path) -> str:
    """The text of a study file `path` on the log `data`, with a sensor for each of its columns.

    Planes that rest confine the motion to the horizontal or the vertical; what does not change in it is ignored.
    """
    boat = load_vehicle(vehicle)
    log = log_files.read_log(data, boat.actuators.log_columns, weight_density=boat.weight_density_npm3)
    boat.check_log(log, str(data))
    log, _ = with_commands(with_water(log, boat.actuators.members), boat.actuators)
    plane = _plane(boat, np.nan_to_num(values_of_log(boat.actuators, log, len(log["time"]), str(data))))
    known = [key for key in log_files.HEADERS if key in log and key in QUANTITIES]
    measured = [key for key in known if np.isfinite(log[key]).sum() >= 3]
    if not any(QUANTITIES[key].changes(MOVING.get(plane, log_files.STATES)) for key in measured):
        plane = "all"  # what is measured moves in another plane than the controls
    changing = MOVING.get(plane, log_files.STATES)
    of_use = [key for key in measured if QUANTITIES[key].changes(changing)]
    if not of_use:
        raise InputError(f"{data}: has no column with three readings or more", "data")
    times = [log["time"][np.isfinite(log[key])] for key in of_use]
    n, tenth = sum(map(len, times)), 0.1 * boat.length_m / boat.speed_mps
    kept = sum(min(len(one), np.ptp(one) / tenth) for one in times)
    has_thrust = boat.body[[workspace.BODY.index(key) for key in workspace.THRUST]].any()
    scales = [name for name, (_, kind) in boat.actuators.parameters.items() if kind == "scale"]
    moving = [name for name in scales if boat.actuators.moves(name, plane if plane in MOVING else None)]
    return _text(
        name,
        path,
        boat,
        vehicle,
        what=f"the log {data.name}",
        data=files.relative(path, data),
        ignored=[log_files.HEADERS[key] for key in log if key in QUANTITIES and key not in of_use],
        interval=(tenth, n, n / kept) if n > max(_MANY, 2.0 * kept) else None,
        sensors={log_files.HEADERS[key]: _noise(key, log, data) for key in of_use},
        column=log_files.HEADERS[of_use[0]],
        instrument=channel_name(of_use[0]),
        free=plane,
        in_current=not _OVER_GROUND.isdisjoint(of_use),
        turns="psi" in changing,
        heading_is_read=any(QUANTITIES[key].heading for key in of_use),
        speeds=[channel_name(key) for key in of_use if log_files.HEADERS[key].endswith("_mps")],
        pushers=[PROPELLER] * bool(has_thrust) + moving,
    )


def _plane(boat: Vehicle, inputs: np.ndarray) -> str:
    """The plane of motion of the actuators that move: "horizontal", "vertical", or "all" for both."""
    actuators = boat.actuators
    forces = actuators.wrenches(inputs, None).reshape(-1, 2, len(AXES))
    changes = np.ptp(forces, axis=0).max(axis=0) > STILL * np.abs(forces).max(axis=(0, 1))
    moving = {plane for axis, plane in _ACROSS.items() if changes[AXES.index(axis)]}
    turned = np.ptp(actuators.mixed(inputs), axis=0) > STILL
    moving |= {control.subproblem for control, moves in zip(boat.equations.controls, turned, strict=True) if moves}
    if boat.equations.degrees_of_freedom == 3 or moving <= {"horizontal"}:
        return "horizontal"
    return "vertical" if moving == {"vertical"} else "all"


def _text(name: str, path: Path, boat: Vehicle, vehicle: str, **parts) -> str:
    files.check_name(name)
    return templates.fill(
        "bayesub.study.new",
        "new_study.toml",
        name=name,
        file=path,
        vehicle=files.seen_from(path, vehicle),
        equations=boat.equations,
        axes=", ".join(f'"{axis}"' for axis in PLANES.get(parts["free"], (AXES,))[0]),
        **parts,
    )


def _noise(key: str, log: dict[str, np.ndarray], data: Path) -> tuple[float, str, float | None]:
    """The sd of the noise of a column, where it is from, and the step of its rounding if that matters, in its unit.

    Of a smooth signal with independent noise the median second difference, over the root of six, is its sd, but no less
    than a share of the range. Where most readings repeat the one before, the others differ by a rounding step: one
    for all, or, in a file with so many digits, one that grows with the value; the sd of an error of rounding is the
    step over the root of twelve. Steps that are not multiples of one are motion.
    """
    header = log_files.HEADERS[key]
    present = np.isfinite(log[key])
    readings, times = log[key][present] / log_files.si_factor(header), log["time"][present]
    if QUANTITIES[key].heading:
        readings = np.unwrap(readings, period=TURN / log_files.si_factor(header))
    steps, bends, extent = np.abs(np.diff(readings)), np.diff(readings, 2), float(np.ptp(readings))
    changes = steps > _ROUND_OFF * extent
    if not changes.any():
        text = f"{data}: column '{header}' never changes; give its sd yourself or leave it out of the log"
        raise InputError(text, "data", header)
    apart = np.diff(np.sort(readings))
    finest = float((apart := apart[apart > _ROUND_OFF * extent]).min())
    scatter = float(np.median(np.abs(bends)) / (_NORMAL_MEDIAN * np.sqrt(6.0)))
    if np.mean(changes) < 0.5:
        held = np.diff(times[1:][changes], prepend=times[0])
        step = float(np.sqrt(np.average(steps[changes] ** 2, weights=held)))
        if step > _VARIES * finest:
            return step / np.sqrt(12.0), f"so many digits, in steps of up to {steps.max():.2g}", None
    if scatter < finest and np.median(np.abs(apart / finest - np.round(apart / finest))) < _WHOLE:
        return finest / np.sqrt(12.0), "hidden by the rounding", finest
    is_smooth = np.count_nonzero(bends[1:] * bends[:-1] > 0.0) > SMOOTH * len(bends)
    share, why = _SMOOTHED if is_smooth else _FINEST
    if scatter < share * extent:
        return share * extent, f"{100.0 * share:g}% of the range; {why}", None
    return scatter, "guessed from its scatter", None
