"""The examinations of a vehicle: its balance, stability and first answers to the planes.

Each takes a vehicle and gives its part of the card (:class:`bayesub.report.vehicle_card.VehicleCard`).
"""

from dataclasses import dataclass, field

import numpy as np

from bayesub.io import log_files, toml_files
from bayesub.kernels import workspace
from bayesub.model import coefficients
from bayesub.model.coefficients import AXES, INDEX, NAMES, TERMS
from bayesub.model.simulate import Trajectory
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.report.flights import fly, growth, number_or_none, stability_indices, turning_circle

RUDDER_DEG = 15.0
PLANE_DEG = 5.0
STRAIGHT, TURN, DIVE = 20.0, 60.0, 10.0  # ship lengths travelled at the trial speed

SPEED_TOLERANCE = 0.01  # of the trial speed, and of the drag for the thrust
STRAY_DEG = 1.0  # heading, pitch and roll of straight flight
STRAY_LENGTHS = 0.1  # depth, in ship lengths
ASYMMETRY = 0.5  # of the larger of two added masses that are one in ideal fluid
GROWTH = 1e-3  # per ship length: round-off and motions that neither grow nor decay stay below
DECADE = 10.0  # either side of the built-in vehicles; most degrees for radians and wrong powers of length are outside
DIAMETERS = (1.0, 20.0)  # of turning circles with 15 degrees of rudder, ship lengths
RADII = (0.15, 0.35)  # radius of gyration in pitch and yaw; a homogeneous cylinder has 0.29, an ellipsoid 0.22

VELOCITY = log_files.positions("u", "v", "w")  # among the states
PAIRS = (("Yrdot", "Nvdot"), ("Zqdot", "Mwdot"), ("Ypdot", "Kvdot"), ("Krdot", "Npdot"))
NEGATIVE = {
    "drag": ("Xuu", "Xuu_drdr", "Xuu_dbdb", "Xuu_dsds"),
    "damping": ("Yuv", "Yv_absnu", "Zuw", "Zw_absnu", "Kup", "Kp_absp", "Muq", "Mq_absq", "Nur", "Nr_absr"),
    "added mass": ("Xudot", "Yvdot", "Zwdot", "Kpdot", "Mqdot", "Nrdot"),
}


@dataclass(frozen=True)
class CardWarning:
    """What is unlike a boat.

    Attributes
    ----------
    text : str
        What is wrong, with the numbers that show it.
    remedy : str
        What to look at.
    """

    text: str
    remedy: str


@dataclass(frozen=True)
class Examination:
    """One part of a card.

    Attributes
    ----------
    numbers : dict
        Section of the card -> its content.
    warnings : list of CardWarning
        What is unlike a boat.
    flights : dict of str to Trajectory
        What was flown.
    """

    numbers: dict
    warnings: list[CardWarning] = field(default_factory=list)
    flights: dict[str, Trajectory] = field(default_factory=dict)


def _value(vehicle: Vehicle, *names: str) -> list[float]:
    return [float(vehicle.xi[INDEX[name]]) for name in names]


def _body(vehicle: Vehicle) -> dict[str, float]:
    return dict(zip(workspace.BODY, map(float, vehicle.body), strict=True))


def balance(boat: Vehicle) -> Examination:
    """Thrust over drag at n' = 1 on both branches: b1 + b2 + b3 = b4 + b5 + b6 = -Xuu (model manual, section 5)."""
    (xuu,), body, warnings = _value(boat, "Xuu"), _body(boat), []
    drag = -xuu * boat.dimensional_factors[INDEX["Xuu"]]
    sums = [sum(body[f"b{j}"] for j in branch) for branch in ((1, 2, 3), (4, 5, 6))]
    ratios = [number_or_none(total / drag) if drag else None for total in sums]
    if not xuu:
        warnings.append(
            CardWarning("the boat has no drag: Xuu is zero", "set Xuu, and b1 + b2 + b3 = b4 + b5 + b6 = -Xuu with it")
        )
    for ratio, names in zip(ratios, ("b1 + b2 + b3", "b4 + b5 + b6"), strict=True):
        if ratio is not None and abs(ratio - 1.0) > SPEED_TOLERANCE:
            warnings.append(
                CardWarning(
                    f"at self-propulsion the thrust is {ratio:.3g} times the drag: {names} = {ratio * -xuu:.4g}, "
                    f"-Xuu = {-xuu:.4g}",
                    f"scale b so that {names} = -Xuu, or change rpm_per_mps, to which b refers",
                )
            )
    branches = {"above_self_propulsion": ratios[0], "below_self_propulsion": ratios[1]}
    return Examination({"thrust_over_drag": branches}, warnings)


def _flight(
    boat: Vehicle, lengths: float, orders: dict[str, float], subproblem: str | None, what: str
) -> tuple[Trajectory | None, np.ndarray | None, list[CardWarning]]:
    """A flight, its states (n, 12) unless it failed, and a warning if it did."""
    trajectory = fly(boat, lengths, orders, subproblem)
    if trajectory is None:
        text = f"{what} is not simulated: a ship length at trial speed takes no sensible time"
        return None, None, [CardWarning(text, "check the units of length_m, speed_mps and rpm_per_mps")]
    if trajectory.status[0] == "ok":
        return trajectory, trajectory.states[0], []
    end = trajectory.times[np.isnan(trajectory.states[0, :, 0]).argmax()]
    reason = {"diverged": "speeds grow without bound", "left_envelope": "pitch passes 85 degrees"}[trajectory.status[0]]
    text = f"{what} fails after {end * boat.speed_mps / boat.length_m:.2g} ship lengths: {reason}"
    remedy = "look at the stability indices, the mass matrix and the signs of damping"
    return trajectory, None, [CardWarning(text, remedy)]


def straight_flight(boat: Vehicle) -> Examination:
    """Speed, depth and attitude at the end of a flight with planes amidships."""
    trajectory, states, warnings = _flight(boat, STRAIGHT, {}, None, "straight flight")
    flights = {} if trajectory is None else {"straight": trajectory}
    if states is None:
        return Examination({"straight_flight": None}, warnings, flights)
    end, z = states[-1], log_files.STATES.index("z")
    ratio = number_or_none(np.linalg.norm(end[VELOCITY]) / boat.speed_mps)
    strays = {"depth_change_lengths": number_or_none((end[z] - states[0, z]) / boat.length_m)}
    for name, state in (("roll", "phi"), ("pitch", "theta"), ("heading", "psi")):
        strays[f"{name}_deg"] = number_or_none(np.degrees(end[log_files.STATES.index(state)]))
    if ratio is not None and abs(ratio - 1.0) > SPEED_TOLERANCE:
        warnings.append(
            CardWarning(
                f"straight flight does not hold its speed: {100 * ratio:.3g} % of it after {STRAIGHT:g} ship lengths",
                "balance thrust and drag; see the line 'thrust'",
            )
        )
    limits = {
        "depth_change_lengths": (STRAY_LENGTHS, "ship lengths deeper"),
        "roll_deg": (STRAY_DEG, "deg of roll"),
        "pitch_deg": (STRAY_DEG, "deg of pitch"),
        "heading_deg": (STRAY_DEG, "deg of heading"),
    }
    off = [f"{strays[key]:.3g} {unit}" for key, (most, unit) in limits.items() if abs(strays[key] or 0.0) > most]
    if off:
        warnings.append(
            CardWarning(
                f"with planes amidships the boat does not fly straight: {', '.join(off)} after {STRAIGHT:g} "
                "ship lengths",
                "look at trim (weight and buoyancy, their centres), Zuu, Muu, Yuu, Nuu, Kuu, thrust line and torque",
            )
        )
    numbers = {"lengths": STRAIGHT, "speed_ratio": ratio, **strays}
    return Examination({"straight_flight": numbers}, warnings, flights)


def stability(boat: Vehicle) -> Examination:
    """Indices of stability in the two planes, and the growth of small disturbances."""
    indices, rate, warnings = stability_indices(boat), growth(boat), []
    grows = rate > GROWTH
    righted = "which does not suffice at trial speed" if grows else "which suffices at trial speed"
    planes = (
        ("horizontal_G_h", "G_h", "and it holds no course with the rudder amidships", "Nuv", "Yuv and Nur"),
        ("vertical_G_v", "G_v", f"but for the righting moment, {righted}", "Muw", "Zuw and Muq"),
    )
    unstable = False
    for key, symbol, what, munk, damping in planes:
        index = indices[key]
        if index is None:
            warnings.append(
                CardWarning(
                    f"{symbol} is undefined: {damping} (less the moment of the mass) are not both negative",
                    f"set {damping} from captive tests or a similar boat",
                )
            )
        elif index <= 0.0:
            warnings.append(
                CardWarning(
                    f"{symbol} = {index:.2f}: straight flight is unstable {what}",
                    f"check {munk} (the Munk moment, which stern fins reduce), and {damping}",
                )
            )
        unstable |= index is None or index <= 0.0
    if grows and not unstable:
        warnings.append(
            CardWarning(
                f"small disturbances of straight flight grow {np.exp(min(rate, 50.0)):.3g}-fold a ship length",
                "check damping in roll (Kup), the coupling of roll with sway (Kuv, Kvdot) and the mass matrix",
            )
        )
    return Examination({"stability": {**indices, "growth_per_length": number_or_none(rate)}}, warnings)


def turn(boat: Vehicle) -> Examination:
    """The turning circle."""
    rudder = min(RUDDER_DEG, float(np.degrees(boat.plane_limits_rad[0])))
    orders = {"rudder_deg": np.radians(rudder)}
    trajectory, states, warnings = _flight(boat, TURN, orders, "horizontal", "the turning circle")
    flights = {} if trajectory is None else {"turn": trajectory}
    if states is None:
        return Examination({"turning_circle": None}, warnings, flights)
    circle = turning_circle(boat, states, rudder)
    diameter = circle["diameter_lengths"]
    if diameter is None:
        warnings.append(CardWarning("the boat does not answer its rudder", "set Yuu_dr and Nuu_dr"))
    elif not DIAMETERS[0] <= diameter <= DIAMETERS[1]:
        warnings.append(
            CardWarning(
                f"with {rudder:g} deg of rudder it turns in {diameter:.3g} ship lengths, where boats need "
                f"{DIAMETERS[0]:g} to {DIAMETERS[1]:g}",
                "check Nuu_dr and Yuu_dr (per radian), Nur and Nuv",
            )
        )
    side, yaw = _value(boat, "Yuu_dr", "Nuu_dr")
    if side * yaw > 0.0:
        warnings.append(
            CardWarning("the rudder acts ahead of the centre: Yuu_dr and Nuu_dr have the same sign", "check both signs")
        )
    return Examination({"turning_circle": circle}, warnings, flights)


def dive(boat: Vehicle) -> Examination:
    """The answer to the stern planes."""
    plane = min(PLANE_DEG, float(np.degrees(boat.plane_limits_rad[2])))
    trajectory, states, warnings = _flight(boat, DIVE, {2: np.radians(plane)}, "vertical", "the dive")
    flights = {} if trajectory is None else {"dive": trajectory}
    if states is None:
        return Examination({"stern_plane": None}, warnings, flights)
    # The planes act against straight flight, which may itself pitch.
    still = fly(boat, DIVE, {}, "vertical").states[0]
    ahead, theta, z = len(states) // 5, log_files.STATES.index("theta"), log_files.STATES.index("z")
    pitch = np.degrees(states[ahead, theta] - still[ahead, theta])
    answers = np.isfinite(pitch) and abs(pitch) > 1e-3 * plane
    numbers = {
        "angle_deg": plane,
        "pitch_after_two_lengths_deg": number_or_none(pitch),
        "positive_angle_pitches": ("bow up" if pitch > 0.0 else "bow down") if answers else None,
        "depth_change_lengths": number_or_none((states[-1, z] - states[0, z]) / boat.length_m),
    }
    if not answers and np.isfinite(pitch):
        warnings.append(CardWarning("the boat does not answer its stern planes", "set Zuu_ds and Muu_ds"))
    elif answers and pitch > 0.0:
        warnings.append(
            CardWarning(
                "a positive stern plane pitches the bow up; manoeuvres expect bow down",
                "change the signs of Zuu_ds and Muu_ds (trailing edge down is positive)",
            )
        )
    force, moment = _value(boat, "Zuu_ds", "Muu_ds")
    if force * moment < 0.0:
        warnings.append(
            CardWarning(
                "the stern planes act ahead of the centre: Zuu_ds and Muu_ds differ in sign", "check both signs"
            )
        )
    return Examination({"stern_plane": numbers}, warnings, flights)


def inertia(boat: Vehicle) -> Examination:
    """The mass matrix, symmetry of the added masses, and radii of gyration."""
    body, warnings = _body(boat), []
    matrix = boat.mass_matrix
    scale = np.sqrt(np.abs(np.diag(matrix)))
    symmetric = 0.5 * (matrix + matrix.T) / np.where(scale > 0.0, np.outer(scale, scale), 1.0)
    smallest = np.linalg.eigvalsh(symmetric)[0] if np.isfinite(symmetric).all() else np.nan
    differences = {}
    for one, other in PAIRS:
        first, second = _value(boat, one, other)
        larger = max(abs(first), abs(second))
        differences[f"{one}-{other}"] = difference = abs(first - second) / larger if larger else 0.0
        if difference > ASYMMETRY:
            warnings.append(
                CardWarning(
                    f"the added-mass matrix is not symmetric: {one} = {first:.3g}, {other} = {second:.3g}",
                    "in ideal fluid they are equal; use one for both, or their mean",
                )
            )
    numbers = {
        "smallest_eigenvalue_scaled": number_or_none(smallest),
        "positive_definite": bool(smallest > 0.0),
        "added_mass_differences": differences,
    }
    if not smallest > 0.0:
        warnings.append(
            CardWarning(
                "the mass matrix is not positive definite: some push would accelerate the boat backwards",
                "added masses on the diagonal are negative (Yvdot < 0); check the size of inertias and couplings",
            )
        )
    moments = sorted((body["Ixx"], body["Iyy"], body["Izz"]))
    if moments[0] + moments[1] < moments[2] * (1.0 - 1e-9):
        warnings.append(
            CardWarning(
                "the moments of inertia are those of no body: one exceeds the sum of the others", "check their units"
            )
        )
    radii = {key: np.sqrt(body[key] / body["mass"]) / boat.length_m for key in ("Iyy", "Izz")}
    numbers["radii_of_gyration_lengths"] = {key: number_or_none(r) for key, r in radii.items()}
    for key, radius in radii.items():
        if not RADII[0] <= radius <= RADII[1]:
            warnings.append(
                CardWarning(
                    f"{key} is that of a radius of gyration of {radius:.2g} ship lengths, where hulls have "
                    f"{RADII[0]:g} to {RADII[1]:g}",
                    f"check mass_kg, length_m and {key} (kg m2)",
                )
            )
    return Examination({"mass_matrix": numbers}, warnings)


def hydrostatics(boat: Vehicle) -> Examination:
    """Buoyancy over weight, and the righting arm."""
    body, warnings = _body(boat), []
    ratio, arm = body["buoyancy"] / body["weight"], body["zG"] - body["zB"]
    if abs(ratio - 1.0) > SPEED_TOLERANCE:
        warnings.append(
            CardWarning(
                f"buoyancy is {100 * ratio:.4g} % of the weight",
                "check buoyancy_n; neutrally_buoyant = true equals both",
            )
        )
    if not arm > 0.0:
        height = f"{-arm:.3g} m above" if arm else "at the height of"
        warnings.append(
            CardWarning(
                f"no righting moment: the centre of gravity lies {height} that of buoyancy",
                "z points down: zG of centre_of_gravity_m must exceed zB of centre_of_buoyancy_m",
            )
        )
    numbers = {"buoyancy_over_weight": number_or_none(ratio), "BG_m": number_or_none(arm)}
    return Examination({"hydrostatics": numbers}, warnings)


def typical_ranges() -> np.ndarray:
    """(101, 2) smallest and largest size of each coefficient in the built-in vehicles; not a number if all are zero."""
    sizes = np.abs([load_vehicle(name).xi for name in toml_files.built_in("vehicles")])
    smallest = np.min(np.where(sizes > 0.0, sizes, np.inf), axis=0)
    return np.where(np.isfinite(smallest)[:, None], np.stack([smallest, sizes.max(axis=0)], axis=1), np.nan)


def sizes_and_signs(boat: Vehicle) -> Examination:
    """Coefficients that are zero, of an unusual size, or of the wrong sign."""
    xi, warnings = boat.xi, []
    zeros = {axis: [t.name for t in TERMS if t.axis == axis and not xi[INDEX[t.name]]] for axis in AXES}
    ranges, sizes = typical_ranges(), np.abs(xi)
    small = (sizes > 0.0) & (sizes < ranges[:, 0] / DECADE)
    large = sizes > ranges[:, 1] * DECADE
    outside = [NAMES[k] for k in np.flatnonzero(small | large)]
    for name in outside:
        low, high = ranges[INDEX[name]]
        warnings.append(
            CardWarning(
                f"{name} = {xi[INDEX[name]]:.3g} is out of the ordinary: built-in boats have {low:.2g} to {high:.2g}",
                f"check that it is non-dimensional on (rho/2) l^{TERMS[INDEX[name]].power}, and per radian",
            )
        )
    for what, names in NEGATIVE.items():
        wrong = [name for name in names if xi[INDEX[name]] > 0.0]
        if wrong:
            warnings.append(
                CardWarning(
                    f"{what} has the wrong sign: {', '.join(wrong)} positive", "it takes energy from the boat: negative"
                )
            )
    needed = [name for name in coefficients.ADDED_MASSES if name in NEGATIVE["added mass"] and not xi[INDEX[name]]]
    if needed:
        warnings.append(
            CardWarning(
                f"no added mass: {', '.join(needed)} zero",
                "estimate it: bayesub new vehicle NAME --geometry HULL",
            )
        )
    return Examination({"zero_coefficients": zeros, "outside_typical_range": outside}, warnings)


EXAMINATIONS = (balance, straight_flight, stability, turn, dive, inertia, hydrostatics, sizes_and_signs)
