"""The examinations of a vehicle in flight: its balance, stability and first answers to the planes.

Each takes a vehicle and gives its part of the card (:class:`bayesub.findings.vehicle_card.VehicleCard`). They ask
the equations which coefficients act in straight flight; what the equations do not have is not examined.
"""

from dataclasses import dataclass

import numpy as np

from bayesub.findings.coefficient_examinations import Examination, number_or_none
from bayesub.findings.zeros import STEADY
from bayesub.io.words import listed
from bayesub.logs.log_files import STATES, VELOCITIES, positions
from bayesub.model.boats import Boats
from bayesub.model.equations import AXES
from bayesub.model.linear_motion import motion_matrix, regressor_slopes, regressors, stability_index, straight
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.quantities import GLIDES, PUSHED, absence
from bayesub.model.simulator import Simulator
from bayesub.model.standard_manoeuvres import at_heading, circle_diameter
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

RUDDER_DEG = 15.0
PLANE_DEG = 5.0
STRAIGHT, TURN, DIVE = 20.0, 60.0, 10.0  # ship lengths travelled at the trial speed

SPEED_TOLERANCE = 0.01  # of the trial speed, and of the drag for the thrust
STRAY_DEG = 1.0  # heading, pitch and roll of straight flight
STRAY_LENGTHS = 0.1  # depth, in ship lengths
GROWTH = 1e-3  # per ship length: round-off and motions that neither grow nor decay stay below
DIAMETERS = (1.0, 20.0)  # of turning circles with 15 degrees of rudder, ship lengths

STEP = 0.02  # integration step in ship lengths travelled; a flight that fails, as by its step, is repeated with a tenth
LONGEST_S = 1e9  # for a ship length; beyond it nothing is flown
Y, U, V, R = positions("y", "u", "v", "r")
VELOCITY = positions("u", "v", "w")
RUDDER, STERN_PLANE = "rudder_deg", "stern_plane_deg"
PLANAR = "the equations have three degrees of freedom"
THRUST = {"du", "uc", "duc"}  # those by which terms of an equation set balance thrust and resistance


def fly(vehicle: Vehicle, lengths: float, orders: dict[str, float], subproblem: str | None) -> Trajectory | None:
    """The vehicle from straight flight at its trial speed so many ship lengths on, planes ordered over at once.

    `orders`: column of a control -> SI units; `subproblem`: plane to which the motion is confined. None if a ship
    length takes so long or short that times or steps are no numbers.
    """
    scale = np.float64(vehicle.length_m) / vehicle.speed_mps
    rpm = np.float64(vehicle.rpm_per_mps) * vehicle.speed_mps
    if not (1.0 / LONGEST_S < scale < LONGEST_S and np.isfinite(rpm) and rpm > 0.0):
        return None
    times = np.linspace(0.0, lengths, round(lengths / STEP) + 1) * scale
    actuators = vehicle.actuators
    given = {column: (np.zeros(1), np.full(1, angle)) for column, angle in orders.items()}
    inputs = actuators.responses(times, given, "check")
    for i, (_, demand) in actuators.demands(given, "check").items():
        inputs[:, i] = np.where(np.isfinite(inputs[:, i]), inputs[:, i], np.clip(demand, *actuators.members[i].range))
    start, ordered = straight_and_level(vehicle), np.full(len(times), rpm)
    flown = of_inputs("check", times, inputs, ordered, start, vehicle, subproblem=subproblem)
    for step in (STEP * scale, 0.1 * STEP * scale):
        trajectory = Simulator(vehicle, flown, times, dt=step).trajectory(vehicle.xi)
        if trajectory.status[0] == "ok":
            break
    return trajectory


def stability_indices(vehicle: Vehicle) -> dict[str, float | None]:
    """G_h and G_v of :func:`bayesub.model.linear_motion.stability_index`; None where a damping is not negative.

    Equations of three degrees of freedom have no G_v.
    """
    boat, planes = Boats(vehicle, vehicle.xi[None]), {"horizontal_G_h": "horizontal", "vertical_G_v": "vertical"}
    return {
        key: number_or_none(stability_index(boat, plane)[0])
        for key, plane in planes.items()
        if plane == "horizontal" or vehicle.equations.degrees_of_freedom == 6
    }


def growth(vehicle: Vehicle) -> float:
    """Growth of the least stable small motion about straight flight, per ship length travelled; negative is stable.

    The largest real part of eigenvalues of u v w p q r, roll and pitch, righting moment included; of u v r in a plane.
    """
    names = ("phi", "theta", *VELOCITIES) if vehicle.equations.degrees_of_freedom == 6 else ("u", "v", "r")
    (matrix,) = motion_matrix(Boats(vehicle, vehicle.xi[None]), None, names)
    if not np.isfinite(matrix).all():
        return np.nan
    try:
        return np.linalg.eigvals(matrix).real.max() * np.float64(vehicle.length_m) / vehicle.speed_mps
    except np.linalg.LinAlgError:
        return np.nan


def turning_circle(vehicle: Vehicle, states: np.ndarray, rudder: float) -> dict:
    """Measures of a turn: steady ones from its end, the tactical diameter at 180 deg of heading.

    `vehicle`: for its length and speed; `states` (n, 12): of the turn; `rudder`: deg.
    """
    end, length = states[-1], vehicle.length_m
    speed, rate = np.linalg.norm(end[[U, V]]), end[R]
    steady = abs(rate) * length > 1e-3 * speed
    return {
        "rudder_deg": rudder,
        "diameter_lengths": number_or_none(circle_diameter(end[None])[0] / length) if steady else None,
        "tactical_diameter_lengths": number_or_none(abs(at_heading(states[None], 180.0)[0, Y]) / length),
        "speed_ratio": number_or_none(speed / vehicle.speed_mps),
        "drift_angle_deg": number_or_none(abs(np.degrees(np.arctan2(-end[V], end[U])))),
        "positive_rudder_turns": ("to starboard" if rate > 0.0 else "to port") if steady else None,
    }


@dataclass(frozen=True)
class Contributions:
    """Hydrodynamic forces, or their slopes by one variable, in straight flight at the trial speed."""

    names: dict[str, list[str]]  # axis -> coefficients that contribute, whatever their values
    values: dict[str, float]  # axis -> sum, N and N m for a force, and that per unit of the variable for a slope

    def of(self, *axes: str) -> list[str]:
        """The coefficients that contribute to some axes."""
        return [name for axis in axes for name in self.names[axis]]


def forces(vehicle: Vehicle, speed_ratio: float = 1.0) -> Contributions:
    """The forces of straight flight, at a ratio of the trial speed; the propeller keeps turning as at that speed."""
    states, controls = straight(vehicle, 1)
    states[0, positions("u")] *= speed_ratio
    return _summed(vehicle, regressors(vehicle, states, controls)[0])


def slopes(vehicle: Vehicle, variable: str) -> Contributions:
    """The slopes by a velocity other than u (per m/s, rad/s), or by a control by its column (per rad)."""
    return _summed(vehicle, regressor_slopes(vehicle, variable))


def _summed(vehicle: Vehicle, regressors: np.ndarray) -> Contributions:
    names, values = {}, {}
    for axis in AXES:
        positions_of_axis = vehicle.equations.columns(vehicle.equations.names_of_axis(axis))
        used = positions_of_axis[regressors[positions_of_axis] != 0.0]
        names[axis] = [vehicle.equations.names[k] for k in used]
        values[axis] = float(vehicle.xi[used] @ regressors[used])
    return Contributions(names, values)


def balance(boat: Vehicle) -> Examination:
    """Thrust over drag at n' = 1 on both branches: b1 + b2 + b3 = b4 + b5 + b6 = -Xuu (model manual, section 5).

    Propellers among the actuators push with the revolutions of their file.
    """
    body = boat.rigid_body
    pushed = boat.actuators.wrenches(boat.actuators.rest[None], None)[0, [0, 6]] @ [1.0, boat.speed_mps]
    thrusts = {
        " + ".join(branch): sum(body[key] for key in branch) * boat.speed_mps**2 + pushed
        for branch in (("b1", "b2", "b3"), ("b4", "b5", "b6"))
    }
    others: dict[str, list] = {"thrust and resistance are terms of the equations": _thrust_terms(boat)}
    others[GLIDES] = [actuator for actuator in boat.actuators.members if actuator.weight.any()]
    others[PUSHED] = [actuator for actuator in boat.actuators.members if actuator.force[0]]
    reasons = [reason for reason, drive in others.items() if drive]
    if reasons and not any(thrusts.values()):
        return Examination({"thrust_over_drag": None}, skipped={"thrust_over_drag": reasons[0]})
    straight = forces(boat)
    drag, symbol = -straight.values["X"], "" if pushed else _drag_symbol(boat, straight)
    ratios = [number_or_none(thrust / drag) if drag else None for thrust in thrusts.values()]
    found = Examination({})
    if not drag:
        zero = f": {listed(straight.names['X'])} is zero" if straight.names["X"] else ""
        remedy = f"set {symbol}, and {' = '.join(thrusts)} = -{symbol} with it"
        found.warn(f"the boat has no drag{zero}", remedy if symbol else "set its drag, and a thrust to balance it")
    branches = thrusts if symbol or ratios[0] != ratios[1] else list(thrusts)[:1]  # the same without their names
    for ratio, names in zip(ratios, branches, strict=False):
        if ratio is not None and abs(ratio - 1.0) > SPEED_TOLERANCE:
            text = f"at self-propulsion the thrust is {ratio:.3g} times the drag"
            if symbol:
                xuu = float(boat.xi[boat.equations.index[symbol]])
                text += f": {names} = {ratio * -xuu:.4g}, -{symbol} = {-xuu:.4g}"
                remedy = f"scale b so that {names} = -{symbol}, or change rpm_per_mps, to which b refers"
            else:
                text += f" of {drag:.4g} N"
                remedy = "scale the thrust (b or thrust_n), or change the propeller speed to which it refers"
                remedy = "change rpm of the propellers" if pushed else remedy
            found.warn(text, remedy)
    found.numbers["thrust_over_drag"] = {"above_self_propulsion": ratios[0], "below_self_propulsion": ratios[1]}
    return found


def _thrust_terms(boat: Vehicle) -> list[str]:
    """The coefficients by which an equation set balances thrust and resistance itself."""
    terms = boat.equations.terms
    return [t.name for t in terms if t.axis == "X" and t.symbols <= STEADY and t.symbols & THRUST]


def _drag_symbol(boat: Vehicle, straight: Contributions) -> str:
    """The coefficient that is the drag on (rho/2) l^2 U^2, as b1 .. b9 are; empty if there is none."""
    names = straight.names["X"]
    term = boat.equations.term(names[0]) if len(names) == 1 else None
    return term.name if term and (term.unit, term.length_power, term.speed_power) == (None, 2, 0) else ""


def _flight(
    boat: Vehicle, lengths: float, orders: dict[str, float], subproblem: str | None, section: str, name: str, what: str
) -> tuple[Examination, np.ndarray | None]:
    """A section with a flight and no numbers yet, and the states (n, 12); None and a warning if the flight fails."""
    trajectory, found = fly(boat, lengths, orders, subproblem), Examination({section: None})
    if trajectory is None:
        text = f"{what} is not simulated: a ship length at trial speed takes no sensible time"
        found.warn(text, "check the units of length_m, speed_mps and rpm_per_mps")
        return found, None
    found.flights[name] = trajectory
    if trajectory.status[0] == "ok":
        return found, trajectory.states[0]
    end = trajectory.times[np.isnan(trajectory.states[0, :, 0]).argmax()]
    reason = {"diverged": "speeds grow without bound", "left_envelope": "pitch passes 85 degrees"}[trajectory.status[0]]
    text = f"{what} fails after {end * boat.speed_mps / boat.length_m:.2g} ship lengths: {reason}"
    found.warn(text, "look at the stability indices, the mass matrix and the signs of damping")
    return found, None


def straight_flight(boat: Vehicle) -> Examination:
    """Speed, depth and attitude at the end of a flight with controls amidships; of a ship speed and heading."""
    if (reason := balance(boat).skipped.get("thrust_over_drag")) in (GLIDES, PUSHED):
        return Examination({"straight_flight": None}, skipped={"straight_flight": reason})
    found, states = _flight(boat, STRAIGHT, {}, None, "straight_flight", "straight", "straight flight")
    if states is None:
        return found
    end, z = states[-1], STATES.index("z")
    ratio = number_or_none(np.linalg.norm(end[VELOCITY]) / boat.speed_mps)
    strays, angles, planar = {}, {"heading": "psi"}, boat.equations.degrees_of_freedom == 3
    if not planar:
        strays["depth_change_lengths"] = number_or_none((end[z] - states[0, z]) / boat.length_m)
        angles = {"roll": "phi", "pitch": "theta"} | angles
    for name, state in angles.items():
        strays[f"{name}_deg"] = number_or_none(np.degrees(end[STATES.index(state)]))
    own = _thrust_terms(boat) if "thrust_over_drag" in balance(boat).skipped else []
    if ratio is not None and abs(ratio - 1.0) > SPEED_TOLERANCE:
        found.warn(
            f"straight flight does not hold its speed: {100 * ratio:.3g} % of it after {STRAIGHT:g} ship lengths",
            f"look at {listed(own)}" if own else "balance thrust and drag; see the line 'thrust'",
        )
    limits = {f"{name}_deg": (STRAY_DEG, f"deg of {name}") for name in angles}
    limits["depth_change_lengths"] = STRAY_LENGTHS, "ship lengths deeper"
    if off := [f"{stray:.3g} {limits[key][1]}" for key, stray in strays.items() if abs(stray or 0.0) > limits[key][0]]:
        causes = forces(boat).of(*"ZMYNK")
        if not planar:
            causes = ["trim (weight and buoyancy, their centres)", *causes, "thrust line", "torque"]
        found.warn(
            f"with {'rudder' if planar else 'planes'} amidships the boat does not "
            f"{'run' if planar else 'fly'} straight: {', '.join(off)} after {STRAIGHT:g} ship lengths",
            f"look at {listed(causes, 'the forces of straight flight')}",
        )
    found.numbers["straight_flight"] = {"lengths": STRAIGHT, "speed_ratio": ratio, **strays}
    return found


def stability(boat: Vehicle) -> Examination:
    """Indices of stability in the planes that the equations have, and the growth of small disturbances."""
    indices, rate = stability_indices(boat), growth(boat)
    found = Examination({"stability": {**indices, "growth_per_length": number_or_none(rate)}})
    grows = rate > GROWTH
    righted = "which does not suffice at trial speed" if grows else "which suffices at trial speed"
    planes = {
        "horizontal_G_h": ("v", "r", ("Y", "N"), "and it holds no course with the rudder amidships"),
        "vertical_G_v": ("w", "q", ("Z", "M"), f"but for the righting moment, {righted}"),
    }
    unstable = False
    for key, index in indices.items():
        across, rotation, (force, moment), what = planes[key]
        drift, turning = slopes(boat, across), slopes(boat, rotation)
        symbol = key.partition("_")[2]
        damping = listed([*drift.of(force), *turning.of(moment)], "the damping derivatives")
        if index is None:
            is_force = drift.values[force] >= 0.0
            axis, variable, slope = (force, across, drift) if is_force else (moment, rotation, turning)
            names = slope.of(axis)
            less = "" if is_force else " (less the moment of the mass)"
            why = f"{axis} has no term in {variable} that damps"
            why = f"{listed(names, '')}{less} {'are' if len(names) > 1 else 'is'} not negative" if names else why
            remedy = f"set {listed(names, '')}" if names else f"add a term such as {axis}u{variable}, and set it"
            found.warn(f"{symbol} is undefined: {why}", f"{remedy} from captive tests or a similar boat")
        elif index <= 0.0:
            munk = listed(drift.of(moment), f"the slope of {moment} by {across}")
            found.warn(
                f"{symbol} = {index:.2f}: straight flight is unstable {what}",
                f"check {munk} (the Munk moment, which stern fins reduce), and {damping}",
            )
        unstable |= index is None or index <= 0.0
    if grows and not unstable:
        found.warn(
            f"small disturbances of straight flight grow {np.exp(min(rate, 50.0)):.3g}-fold a ship length",
            f"check {_roll_terms(boat)}the mass matrix",
        )
    return found


def _roll_terms(boat: Vehicle) -> str:
    """What makes roll grow besides the mass matrix, as words before it; empty for equations without roll."""
    if boat.equations.degrees_of_freedom == 3:
        return ""
    coupling = slopes(boat, "v").of("K")
    coupling += [t.name for t in boat.equations.terms if (t.axis, t.regressor) == ("K", "vdot")]
    words = ("damping in roll", slopes(boat, "p").of("K")), ("the coupling of roll with sway", coupling)
    texts = (what + (f" ({', '.join(names)})" if names else "") for what, names in words)
    return f"{', '.join(texts)} and "


def _angle(boat: Vehicle, column: str, largest: float) -> float:
    """An angle in degrees to which the actuators can bring a control."""
    return min(largest, float(np.degrees(boat.actuators.limits[boat.equations.control(column, "check")])))


def turn(boat: Vehicle) -> Examination:
    """The turning circle."""
    if reason := absence(boat, RUDDER):
        return Examination({"turning_circle": None}, skipped={"turning_circle": reason})
    rudder = _angle(boat, RUDDER, RUDDER_DEG)
    orders = {RUDDER: np.radians(rudder)}
    found, states = _flight(boat, TURN, orders, "horizontal", "turning_circle", "turn", "the turning circle")
    if states is None:
        return found
    circle, effect = turning_circle(boat, states, rudder), slopes(boat, RUDDER)
    diameter = circle["diameter_lengths"]
    if diameter is None:
        remedy = f"set {listed(effect.of('Y', 'N'), 'coefficients of the rudder')}"
        found.warn("the boat does not answer its rudder", remedy)
    elif not DIAMETERS[0] <= diameter <= DIAMETERS[1]:
        damping = listed([*slopes(boat, "r").of("N"), *slopes(boat, "v").of("N")], "the damping in yaw")
        found.warn(
            f"with {rudder:g} deg of rudder it turns in {diameter:.3g} ship lengths, where boats need "
            f"{DIAMETERS[0]:g} to {DIAMETERS[1]:g}",
            f"check {listed(effect.of('N', 'Y'), 'the rudder')} (per radian), {damping}",
        )
    if effect.values["Y"] * effect.values["N"] > 0.0:
        names = listed(effect.of("Y", "N"))
        found.warn(f"the rudder acts ahead of the centre: {names} have the same sign", "check both signs")
    found.numbers["turning_circle"] = circle
    return found


def dive(boat: Vehicle) -> Examination:
    """The answer to the stern planes."""
    if reason := PLANAR if boat.equations.degrees_of_freedom == 3 else absence(boat, STERN_PLANE):
        return Examination({"stern_plane": None}, skipped={"stern_plane": reason})
    plane = _angle(boat, STERN_PLANE, PLANE_DEG)
    orders = {STERN_PLANE: np.radians(plane)}
    found, states = _flight(boat, DIVE, orders, "vertical", "stern_plane", "dive", "the dive")
    if states is None:
        return found
    # The planes act against straight flight, which may itself pitch.
    straight = fly(boat, DIVE, {}, "vertical")
    assert straight is not None  # as the flight above
    ahead, theta, z = len(states) // 5, STATES.index("theta"), STATES.index("z")
    pitch = np.degrees(states[ahead, theta] - straight.states[0, ahead, theta])
    answers = np.isfinite(pitch) and abs(pitch) > 1e-3 * plane
    found.numbers["stern_plane"] = {
        "angle_deg": plane,
        "pitch_after_two_lengths_deg": number_or_none(pitch),
        "positive_angle_pitches": ("bow up" if pitch > 0.0 else "bow down") if answers else None,
        "depth_change_lengths": number_or_none((states[-1, z] - states[0, z]) / boat.length_m),
    }
    effect = slopes(boat, STERN_PLANE)
    names = listed(effect.of("Z", "M"), "coefficients of the stern planes")
    if not answers and np.isfinite(pitch):
        found.warn("the boat does not answer its stern planes", f"set {names}")
    elif answers and pitch > 0.0:
        found.warn(
            "a positive stern plane pitches the bow up; manoeuvres expect bow down",
            f"change the signs of {names} (trailing edge down is positive)",
        )
    if effect.values["Z"] * effect.values["M"] < 0.0:
        found.warn(f"the stern planes act ahead of the centre: {names} differ in sign", "check both signs")
    return found


def hydrostatics(boat: Vehicle) -> Examination:
    """Buoyancy over weight, and the righting arm."""
    if boat.equations.degrees_of_freedom == 3:
        return Examination({"hydrostatics": None}, skipped={"hydrostatics": PLANAR})
    body = boat.rigid_body
    ratio, arm = body["buoyancy"] / body["weight"], body["zG"] - body["zB"]
    found = Examination({"hydrostatics": {"buoyancy_over_weight": number_or_none(ratio), "BG_m": number_or_none(arm)}})
    if abs(ratio - 1.0) > SPEED_TOLERANCE:
        found.warn(
            f"buoyancy is {100 * ratio:.4g} % of the weight", "check buoyancy_n; neutrally_buoyant = true equals both"
        )
    if not arm > 0.0:
        height = f"{-arm:.3g} m above" if arm else "at the height of"
        found.warn(
            f"no righting moment: the centre of gravity lies {height} that of buoyancy",
            "z points down: zG of centre_of_gravity_m must exceed zB of centre_of_buoyancy_m",
        )
    return found
