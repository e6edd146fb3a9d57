"""A log as a trial: the controls that were flown, what the sensors read, and what is unknown of the start."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayesub.io import toml_files
from bayesub.io.errors import InputError, nearest
from bayesub.logs import log_files
from bayesub.model.actuator import with_water
from bayesub.model.actuators import values_of_log, with_commands
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import Manoeuvre, of_inputs
from bayesub.model.prescribed import STATES, Prescribed, check, smoothed
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.mounting import mounts
from bayesub.problem.nuisance import CURRENTS, INITIAL, MOVING
from bayesub.sensors import QUANTITIES, Record, Sensor, velocity
from bayesub.sensors.velocity import TURNING

CONTROL_COLUMNS = (*log_files.CONTROLS, "rpm")

# The prior of the start, where it is not given. From readings it is this many times as wide as their own standard
# error, so that using them again in the likelihood counts them no more than one per cent twice.
WIDENED = 10.0
# Of a state without a sensor: about straight and level, with a standard deviation of
UNREAD_SPEED = 0.1  # trial speeds, for u v w
UNREAD_TURN = 0.1  # rad in a ship length travelled, for p q r
UNREAD_TILT = np.radians(5.0)  # for roll and pitch
# What stands for a state without a sensor, and about how far a boat goes from where it points.
INSTEAD = {"psi": ("cog",), "u": ("stw", "sog")}
UNREAD_DRIFT = np.radians(10.0)


@dataclass(frozen=True)
class Trial:
    """One trial of a study."""

    manoeuvre: Manoeuvre  # the controls that were flown
    record: Record
    # Name (:mod:`bayesub.problem.nuisance`) -> prior, the unknown start of a log included
    nuisance: dict[str, priors.Prior] = field(default_factory=dict)
    truth: Trajectory | None = None  # the motion behind a simulated trial
    n_left_out: int = 0  # readings of the log before its first or after its last control


def read_trial(
    path: str | Path,
    vehicle: Vehicle,
    sensors: Sensor | Iterable,
    *,
    nuisance: Mapping[str, priors.Prior | float] | None = None,
    subproblem: str | None = None,
    max_control_gap_s: float | None = None,
    ignore: Sequence[str] = (),
    name: str | None = None,
    prescribed: Sequence[str] = (),
    window_s: tuple[float, float] | None = None,
) -> Trial:
    """Read the log of a trial (:mod:`bayesub.logs.log_files`).

    The trial begins when every control has its first cell, which is time zero from then on, and ends when the first of
    them has its last. Lines join the cells of a control, commands hold until the next; readings outside are left out.

    The start is unknown: every state of the motion that the readings depend on becomes a nuisance parameter. Its prior
    is `nuisance`, or else a straight line through the readings of the first ship length travelled, at the start and
    widened ten times, or else, without a sensor, about straight and level (constants of this module). InputError for a
    file that does not fit, a gap in the controls, and a channel of a motion that the sub-problem does not have.

    Parameters
    ----------
    path : the log, CSV, also compressed (.csv.gz); or the name of a built-in one
    sensors : as of :meth:`bayesub.sensors.Record.load`
    nuisance : name -> prior, of the start and of anything else; or the value of a state at the start that is known, as
        in ``{"u0_mps": 1.5}``
    subproblem : plane to which the motion was confined
    max_control_gap_s : longest time between two cells of a control; by default that of a ship length travelled, in
        which the boat answers little to what a plane does unseen
    ignore : columns that are not used
    name : of the manoeuvre; by default the name of the file
    prescribed : angles that the boat follows as they were read, "pitch" or "yaw": they are smoothed by as much as their
        sensor is noisy, and are no readings any more
    window_s : first and last time of the part of the log that is used, s of the log; by default all of it
    """
    path, given = toml_files.find_log(path), dict(nuisance or {})
    known = {name: one for name, one in given.items() if not isinstance(one, priors.Prior)}
    unknown = {name: one for name, one in given.items() if isinstance(one, priors.Prior)}
    subproblem = vehicle.equations.subproblem(subproblem)
    columns = vehicle.actuators.shorts
    log = log_files.read_log(path, vehicle.actuators.log_columns, weight_density=vehicle.weight_density_npm3)
    if window_s is not None:
        rows = (log["time"] >= window_s[0]) & (log["time"] <= window_s[1])
        if rows.sum() < 2:
            first, last = log["time"][[0, -1]]
            what = f"{path}: window_s [{window_s[0]:g}, {window_s[1]:g}] holds {rows.sum()} rows of a log"
            text = f"{what} from {first:g} to {last:g} s; give two of its times"
            raise InputError(text, "data", "window_s")
        log = {name: cells[rows] for name, cells in log.items()}
    for column in ignore:
        short = log_files.short_name(column)
        if short not in log or column == "time_s":
            listed = (log_files.HEADERS.get(name, name) for name in log)
            raise InputError(f"{path}: ignore names '{column}', no column{nearest(column, listed)}", "unknown", column)
        del log[short]
    vehicle.check_log(log, str(path))
    log = with_water(log, vehicle.actuators.members)
    length_time = vehicle.length_m / vehicle.speed_mps
    log, commanded = with_commands(log, vehicle.actuators)
    begin, times, inputs, rpm = _controls(log, commanded, vehicle, path, max_control_gap_s or length_time)
    readings = {name: values for name, values in log.items() if name not in (*CONTROL_COLUMNS, *columns)}
    readings["time"] = readings["time"] - begin
    whole = Record.of_log(readings, sensors, path)
    followed = [_prescribed(angle, whole, subproblem, path) for angle in prescribed]
    states = [one.states[0] for one in followed]
    whole = Record(tuple(channel for channel in whole.channels if channel.state not in states))
    flown = [(channel.times >= 0.0) & (channel.times <= times[-1]) for channel in whole.channels]
    moving = MOVING.get(subproblem, log_files.STATES)
    for channel, kept in zip(whole.channels, flown, strict=True):
        column = log_files.HEADERS[channel.quantity]
        if not kept.any():
            raise InputError(f"{path}: no reading of '{column}' lies within the controls", "data", column)
        if not QUANTITIES[channel.quantity].changes(moving):
            what = f"{path}: '{column}' does not change in the {subproblem} sub-problem"
            raise InputError(f"{what}; leave out its sensor and put the column under ignore", "conflict", column)
    record = whole.of_readings(flown)
    initial = straight_and_level(vehicle)
    initial[log_files.STATES.index("u")] = rpm[0] / vehicle.rpm_per_mps
    for start, ((short, factor),) in ((name, entry.items()) for name, entry in INITIAL.items()):
        state = short[:-1]
        if state not in moving or any(state in one.states for one in followed):
            continue
        if not _matters(state, record, unknown):
            continue
        if start in known:
            initial[log_files.STATES.index(state)] = factor * known.pop(start)
            continue
        if start not in unknown:
            about = _start(state, record, unknown, initial, vehicle, path)
            unknown[start] = priors.normal(*(float(x) / factor for x in about))
        initial[log_files.STATES.index(state)] = factor * unknown[start].mean[0]
    for start in known:
        text = f"nuisance.{start}: a value is for the start, of a state that the readings depend on; leave it out"
        raise InputError(text, "conflict", f"nuisance.{start}")
    others = {"subproblem": subproblem, "prescribed": tuple(followed), "commanded": commanded}
    manoeuvre = of_inputs(name or path.stem, times, inputs, rpm, initial, vehicle, **others)
    return Trial(manoeuvre, record, unknown, n_left_out=whole.n_readings - record.n_readings)


def _prescribed(angle, record, subproblem, path) -> Prescribed:
    """An angle as its channel read it, smoothed."""
    check(angle, subproblem)
    state = STATES[angle][0]
    channel = next((channel for channel in record.channels if channel.state == state), None)
    column, what = log_files.HEADERS[state], f"{path}: {angle} is prescribed, and no"
    if channel is None:
        raise InputError(f"{what} sensor reads '{column}'; add one", "missing", column)
    if len(record.channels) == 1:
        raise InputError(f"{what} other sensor is left to be fitted; add one", "missing", "sensors")
    return smoothed(angle, channel.times, channel.values, channel.total_sd)


def _controls(log, commanded, vehicle, path, max_gap):
    """Start (s of the log), times (n,) from zero, values (n, n_actuators) of the actuators and rpm (n,)."""
    cells, columns = {}, {name: log_files.HEADERS.get(name, name) for name in vehicle.inputs}
    for name in vehicle.inputs:
        if name in log:
            given = np.isfinite(log[name])
            if given.sum() < 2:
                text = f"{path}: control column '{columns[name]}' needs two cells at least; delete it if unused"
                raise InputError(text, "data", columns[name])
            cells[name] = log["time"][given], log[name][given]
    values_of_log(vehicle.actuators, log, len(log["time"]), str(path))  # refuses controls of another boat
    if not cells:
        expected = ", ".join(columns.values())
        raise InputError(f"{path}: has no control column; expected some of {expected}", "missing", expected)
    begin, end = max(times[0] for times, _ in cells.values()), min(times[-1] for times, _ in cells.values())
    if not begin < end:
        raise InputError(f"{path}: its control columns have no time in common", "data", "time_s")
    for name, (times, _) in cells.items():
        long = (np.diff(times) > max_gap) & (times[1:] > begin) & (times[:-1] < end)
        if long.any():
            k = np.flatnonzero(long)[0]
            what = f"{path}: control column '{columns[name]}' has a gap from {times[k]:.6g} to {times[k + 1]:.6g} s"
            remedy = f"raise max_control_gap_s ({max_gap:.3g}) if a straight line is what was flown"
            raise InputError(f"{what}; cut the log there, or {remedy}", "data", columns[name])
    times = np.unique(np.concatenate([times for times, _ in cells.values()]))
    times = times[(times >= begin) & (times <= end)]
    joined = {name: np.interp(times, *cell) for name, cell in cells.items()}
    for since, values, name in ((*cells[name], name) for name in cells.keys() & commanded):  # which hold until the next
        joined[name] = values[np.searchsorted(since, times, side="right") - 1]
    inputs = values_of_log(vehicle.actuators, joined, len(times), str(path))
    return begin, times - begin, inputs, vehicle.propeller_speed(joined, len(times))


def _matters(state, record, nuisance) -> bool:
    """Whether any reading depends on a state at the start."""
    moved = {mount.instrument for name, mount in mounts(record.channels).items() if mount.axis and name in nuisance}
    away = [any(c.lever_arm_m) or c.instrument in moved for c in record.channels]
    read = {state for far, c in zip(away, record.channels, strict=True) for state in velocity.causes(c.state, far)}
    if state in ("x", "y", "z"):
        return state in read
    if state == "psi":
        turned = any(name in nuisance for name in CURRENTS) and any(c.over_ground for c in record.channels)
        return bool(read & {"x", "y", "psi"}) or turned
    return True


def _start(state, record, nuisance, initial, vehicle, path) -> tuple[float, float]:
    """Mean and sd of the prior of a state at the start, SI units."""
    channels = sorted((c for c in record.channels if c.state == state), key=lambda c: c.over_ground)
    rough = [c for name in INSTEAD.get(state, ()) for c in record.channels if c.state == name and c.direction is None]
    if not channels and rough:
        value, sd, rate = _at_zero(rough[0], vehicle.length_m / vehicle.speed_mps)
        drift = UNREAD_DRIFT if state == "psi" else UNREAD_SPEED * vehicle.speed_mps
        late = _by_mounting(rough[0], nuisance, rate, 0.0)
        return value, float(np.linalg.norm([sd * WIDENED, drift, *_by_current(rough[0], nuisance, vehicle), *late]))
    if not channels:
        if state == "psi":
            text = f"{path}: no sensor measures the heading, and the readings depend on it; give nuisance.yaw0_deg"
            raise InputError(text, "missing", "nuisance.yaw0_deg")
        turn = UNREAD_TURN * vehicle.speed_mps / vehicle.length_m
        rough_sd = UNREAD_SPEED * vehicle.speed_mps if state in "uvw" else turn if state in "pqr" else UNREAD_TILT
        return initial[log_files.STATES.index(state)], rough_sd
    channel = channels[0]
    value, sd, rate = _at_zero(channel, vehicle.length_m / vehicle.speed_mps)
    column = log_files.HEADERS[channel.quantity]
    besides = [sd * WIDENED, _size(nuisance, f"bias_{column}") * log_files.si_factor(column)]
    besides.append(_size(nuisance, f"scale_{channel.name}", 1.0) * abs(value))
    if state in "uvw":
        besides += _by_current(channel, nuisance)
    turning = 1.0 if state in "xyz" else UNREAD_TURN * vehicle.speed_mps / vehicle.length_m
    if channel.displaced:
        besides.append(turning * float(np.linalg.norm(channel.lever_arm_m)))
    besides += _by_mounting(channel, nuisance, rate, turning if state in TURNING else 0.0)
    return value, float(np.linalg.norm(besides))


def _by_current(channel, nuisance, vehicle=None) -> list[float]:
    """How far currents may turn a course (rad, of a `vehicle` at its speed), or change a speed (m/s)."""
    if not channel.over_ground:
        return []
    speed = vehicle.speed_mps if vehicle is not None and channel.state == "cog" else 1.0
    return [_size(nuisance, name) / speed for name in CURRENTS]


def _by_mounting(channel, nuisance, rate, by_place) -> list[float]:
    """How far an unknown clock and place may change readings with a rate and a derivative by the place."""
    sizes = []
    for name, mount in mounts((channel,)).items():
        if name in nuisance:
            off = float(np.hypot(nuisance[name].mean - mount.value, nuisance[name].sd)[0])
            sizes.append(off * (by_place if mount.axis else abs(rate)))
    return sizes


def _size(nuisance, name, held=0.0) -> float:
    """How far a nuisance parameter may well be from where it is held; zero if there is none of that name."""
    return float(np.hypot(nuisance[name].mean - held, nuisance[name].sd)[0]) if name in nuisance else 0.0


def _at_zero(channel, window) -> tuple[float, float, float]:
    """Where a straight line through the readings of the first `window` seconds, or the first three, is at the start.

    With its standard error, which counts residuals and how far it is drawn back, and its slope.
    """
    n = max(3, np.count_nonzero(channel.times <= window))
    times, values = channel.times[:n], channel.values[:n]
    if len(times) < 3:
        return values[0], channel.total_sd, 0.0
    lines = np.stack([np.ones_like(times), times], axis=1)
    (value, slope), *_ = np.linalg.lstsq(lines, values, rcond=None)
    off = np.sqrt(np.sum((values - lines @ [value, slope]) ** 2) / (len(times) - 2))
    error = max(channel.total_sd, off) * np.sqrt(np.linalg.inv(lines.T @ lines)[0, 0])
    return value, float(np.hypot(error, slope * times[0])), float(slope)
