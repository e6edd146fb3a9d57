"""New study files: of a manoeuvre that is simulated, or of a log."""

from pathlib import Path

import numpy as np

from bayesub.io import templates
from bayesub.io.errors import InputError
from bayesub.io.units import TURN
from bayesub.kernels import workspace
from bayesub.logs import log_files
from bayesub.model.actuator import with_water
from bayesub.model.actuators import values_of_log, with_commands
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem.nuisance import MOVING, PROPELLER
from bayesub.sensors import velocity
from bayesub.sensors.sensor import QUANTITIES, channel_name
from bayesub.study.new import files

FEW, MANY_STARTS = 40, 5  # up to so many coefficients so many searches, which take 4 s; five of 83 took 27, two 12
STILL = 1e-9  # rad, and of the largest force: round-off in a control or a force that actuators do not move
_ACROSS = {"Y": "horizontal", "N": "horizontal", "Z": "vertical", "M": "vertical", "K": None}  # planes of forces
_NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal
_ROUND_OFF = 1e-9  # of the range of a column
_VARIES = 3.0  # times as large as the finest is the step of a column that is written with so many digits, not decimals
_MANY = 5000  # readings up to which all are taken
_OVER_GROUND = {"x", "y", "u_ground", "v_ground", *velocity.OVER_GROUND}

_SENSOR = """
[[sensors]]
kind = "sensor"
column = "{column}"
"""
_NOISE = "sd = {:<24.2g} # CHANGE: {}; the data sheet knows\n"
_RESOLUTION = "resolution = {:<16.4g} # the step of the file; a reading is an interval (page noise-and-rounding)\n"
_INTERVAL = """interval_s = {:<16.2g} # one of {:,} readings in a tenth of a ship length travelled, between which the
                              # boat hardly moves and errors are rarely independent; all take {:.0f} times as long.
                              # Where errors are independent, average = true in a map of bayesub convert is better"""
_TRACK = """
[[sensors]]                   # "track", "pressure", "compass", "ins", "dvl", "adcp", "sensor", or a preset
kind = "track"
position_sd_m = 0.5
attitude_sd_deg = 0.1
interval_s = 1.0
"""
_IN_PLANE = 'channels = ["x", "y", "yaw"]\n'
_NUISANCE = """# [nuisance]                  # what else is unknown
# bias_yaw_deg = { mean = 0.0, sd = 2.0 }"""
_IN_CURRENT = """[nuisance]                    # what else is unknown; the start needs no entry
current_north_mps = { mean = 0.0, sd = 0.3 }"""
_CLOCK = """
# clock_{0}_s = {{ mean = 0.0, sd = 0.2 }}  # how far its clock is ahead; lever_{0}_x_m: where it is"""
_SCALE = "\n# {} = {{ mean = 1.0, sd = {} }}  # {}"
_EAST = "\ncurrent_east_mps = { mean = 0.0, sd = 0.3 }"
_HEADING = "\nyaw0_deg = { mean = 0.0, sd = 5.0 }  # CHANGE: no sensor measures it"
_GUESS = """centre = "perturbed"          # a guess: the truth times (1 + perturbation_sd * normal); or "vehicle"
perturbation_sd = 0.15"""


def simulated(name: str, path: Path, vehicle: str, manoeuvre: str) -> str:
    """The text of a study file `path` that simulates a vehicle on a manoeuvre and measures its track."""
    equations, plane = load_vehicle(vehicle).equations, manoeuvre if manoeuvre in MOVING else None
    n_starts, cost = MANY_STARTS, "under a second each"
    if len(equations.active(load_vehicle(vehicle), subproblem=plane)) > FEW:
        n_starts, cost = 2, "some 6 s each of 83 coefficients"
    return _text(
        name,
        path,
        vehicle,
        what=f"the manoeuvre {manoeuvre}",
        source=f'manoeuvre = "{files.seen_from(path, manoeuvre)}"',
        sensors=_TRACK + (_IN_PLANE if equations.degrees_of_freedom == 3 else ""),
        column="x_m",
        free=plane or "all",
        centre=_GUESS,
        nuisance=_NUISANCE + _CLOCK.format("track"),
        searches=f"sqp_starts = {n_starts}                # deterministic searches to compare with, {cost}",
    )


def of_log(name: str, path: Path, vehicle: str, data: Path) -> str:
    """The text of a study file `path` on the log `data`, with a sensor for each of its columns.

    Planes that rest confine the motion to the horizontal or the vertical; what does not change in it is ignored.
    """
    boat = load_vehicle(vehicle)
    log = log_files.read_log(data, boat.actuators.log_columns, weight_density=boat.weight_density_npm3)
    boat.check_log(log, str(data))
    log, _ = with_commands(with_water(log, boat.actuators.members), boat.actuators)
    plane = _plane(boat, np.nan_to_num(values_of_log(boat.actuators, log, len(log["time"]), str(data))))
    changing = MOVING.get(plane, log_files.STATES)
    measured = [
        key for key in log_files.HEADERS if key in log and key in QUANTITIES and np.isfinite(log[key]).sum() >= 3
    ]
    of_use = [key for key in measured if QUANTITIES[key].changes(changing)]
    if not of_use:
        raise InputError(f"{data}: has no column with three readings or more", "data")
    source = [f'data = "{files.relative(path, data)}"']
    if plane != "all":
        source.append(f'subproblem = "{plane}"     # the plane that the boat kept to, by its controls')
    if rest := [f'"{log_files.HEADERS[key]}"' for key in log if key in QUANTITIES and key not in of_use]:
        source.append(f"ignore = [{', '.join(rest)}]")
    times = [log["time"][np.isfinite(log[key])] for key in of_use]
    n, tenth = sum(map(len, times)), 0.1 * boat.length_m / boat.speed_mps
    kept = sum(min(len(one), np.ptp(one) / tenth) for one in times)
    source += [_INTERVAL.format(tenth, n, n / kept)] if n > max(_MANY, 2.0 * kept) else []
    nuisance = _IN_CURRENT if _OVER_GROUND & set(of_use) else _NUISANCE
    if nuisance is _IN_CURRENT and "psi" in changing:
        read = any(QUANTITIES[key].heading for key in of_use)
        nuisance += _EAST + ("" if read else _HEADING)
    nuisance += _CLOCK.format(channel_name(of_use[0]))
    for key in of_use:
        if log_files.HEADERS[key].endswith("_mps"):
            nuisance += _SCALE.format(f"scale_{channel_name(key)}", 0.01, "1 % of a speed is 2 % of a drag")
    has_thrust = boat.body[[workspace.BODY.index(key) for key in workspace.THRUST]].any()
    scales = [name for name, (_, kind) in boat.actuators.parameters.items() if kind == "scale"]
    moving = [name for name in scales if boat.actuators.moves(name, plane if plane in MOVING else None)]
    for scale in [PROPELLER] * bool(has_thrust) + moving:
        nuisance += _SCALE.format(scale, 0.05, "how effective it is: trades off with its coefficients, or the drag")
    return _text(
        name,
        path,
        vehicle,
        what=f"the log {data.name}",
        source="\n".join(source),
        sensors="".join(_SENSOR.format(column=log_files.HEADERS[key]) + _noise(key, log, data) for key in of_use),
        column=log_files.HEADERS[of_use[0]],
        free=plane,
        centre='centre = "vehicle"',
        nuisance=nuisance,
        searches="sqp_starts = 0                # deterministic searches to compare with",
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


def _text(name, path, vehicle, **parts) -> str:
    files.check_name(name)
    return templates.fill(
        "bayesub.study.new",
        "new_study.toml",
        name=name,
        file=path,
        vehicle=files.seen_from(path, vehicle),
        example=load_vehicle(vehicle).equations.names[0],
        axes=", ".join(f'"{axis}"' for axis in PLANES.get(parts["free"], (AXES,))[0]),
        **parts,
    )


def _noise(key: str, log: dict[str, np.ndarray], data: Path) -> str:
    """The lines of the noise of a column and of its rounding, in its unit.

    Of a smooth signal with independent noise the median second difference, over the root of six, is its sd. Where most
    readings repeat the one before, the others differ by a rounding step: one for all, or, in a file with so many
    digits, one that grows with the value. The sd of an error of rounding is the step over the root of twelve.
    """
    header = log_files.HEADERS[key]
    present = np.isfinite(log[key])
    readings, times = log[key][present] / log_files.si_factor(header), log["time"][present]
    if QUANTITIES[key].heading:
        readings = np.unwrap(readings, period=TURN / log_files.si_factor(header))
    steps = np.abs(np.diff(readings))
    changes = steps > _ROUND_OFF * np.ptp(readings)
    if not changes.any():
        text = f"{data}: column '{header}' never changes; give its sd yourself or leave it out of the log"
        raise InputError(text, "data", header)
    apart = np.diff(np.sort(readings))
    finest = float(apart[apart > _ROUND_OFF * np.ptp(readings)].min())
    scatter = float(np.median(np.abs(np.diff(readings, 2))) / (_NORMAL_MEDIAN * np.sqrt(6.0)))
    if np.mean(changes) < 0.5:
        held = np.diff(times[1:][changes], prepend=times[0])
        step = float(np.sqrt(np.average(steps[changes] ** 2, weights=held)))
        if step > _VARIES * finest:
            return _NOISE.format(step / np.sqrt(12.0), f"so many digits, in steps of up to {steps.max():.2g}")
    if scatter < finest:
        return _NOISE.format(finest / np.sqrt(12.0), "hidden by the rounding") + _RESOLUTION.format(finest)
    return _NOISE.format(scatter, "guessed from its scatter")
