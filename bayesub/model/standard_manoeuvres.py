"""Standard manoeuvres of a batch of boats, and what is measured of them, a number for each boat.

They begin straight and level at the trial speed, with the answer of the actuators to an order at 0 s. Turns and
zig-zags are confined to the horizontal plane, dives to the vertical one. Measures of turns, zig-zags and stopping are
those of IMO resolution MSC.137(76), Standards for ship manoeuvrability (2002). Where a boat does not reach what is
measured, such as 180 degrees of heading, or its simulation fails before, the measure is not a number.
"""

import numpy as np

from bayesub.logs.log_files import VELOCITIES, positions
from bayesub.model.boats import Boats
from bayesub.model.manoeuvre_files import RUDDER, STERN_PLANE
from bayesub.model.manoeuvres import of_inputs

TURN, DIVE, ZIGZAG, STOP, JAM = 60.0, 4.0, 20.0, 60.0, 60.0  # ship lengths travelled at the trial speed
RUDDER_DEG, DIVE_DEG = 35.0, 10.0  # at most; a smaller limit of the boat counts
REACTION = 2.0  # ship lengths from the jam of the stern planes until the propeller turns astern
STILL = 0.01  # of the trial speed
STEP = 0.04  # integration step in ship lengths travelled
_FINE, _SAMPLE = 4, 2  # parts of a step between which controls are linear, and steps between two outputs
_BEFORE = 1e3  # ship lengths before the start, in which a plane has come to rest where it was ordered
X, Y, Z, PSI, U, V, R = positions("x", "y", "z", "psi", "u", "v", "r")
_TRACK = list(positions("x", "y", "z"))

N_RATES = 24  # of turn of a spiral, on each side
_NUDGE = 1e-6  # of the speed and of 1 rad, for derivatives
_TOLERANCE, _ITERATIONS = 1e-9, 12  # accelerations, on U^2 / l and U^2 / l^2
_BALANCED = [VELOCITIES.index(name) for name in "uvr"]


def fly(
    boats: Boats,
    lengths: float,
    plane: str,
    orders: dict[str, tuple[float, float]],
    *,
    astern: float | None = None,
    initial: np.ndarray | None = None,
) -> np.ndarray:
    """States (n, n_times, 12) of a flight whose planes are put over at 0 s, every STEP * _SAMPLE ship lengths.

    It goes as many ship lengths as are travelled at the trial speed, confined to a plane. `orders` are by the columns
    of controls where these have come to rest before, and where they are ordered, deg, or to their limits. After
    `astern` ship lengths the propeller turns astern, as fast as it turned ahead. `initial` (n, 12): states at start.
    """
    vehicle = boats.vehicle
    scale = vehicle.length_m / vehicle.speed_mps
    times = np.linspace(0.0, lengths * scale, _FINE * round(lengths / STEP) + 1)
    given = {}
    for column, degrees in orders.items():
        largest = vehicle.actuators.limits[vehicle.equations.control(column, "quantities")]
        given[column] = np.array([-_BEFORE * scale, 0.0]), np.clip(np.radians(degrees), -largest, largest)
    inputs = vehicle.actuators.responses(times, given, "quantities")
    rpm = np.full(len(times), vehicle.rpm_per_mps * vehicle.speed_mps)
    if astern is not None:
        rpm[times >= astern * scale] *= -1.0
    manoeuvre = of_inputs("quantities", times, inputs, rpm, boats.straight()[0], vehicle, subproblem=plane)
    return boats.fly(manoeuvre, times[:: _FINE * _SAMPLE], STEP * vehicle.length_m / vehicle.speed_mps, initial)


def turn(boats: Boats) -> np.ndarray:
    """States (n, n_times, 12) of a turn with all rudder there is, up to RUDDER_DEG."""
    return fly(boats, TURN, "horizontal", {RUDDER: (0.0, RUDDER_DEG)})


def _turned_by(boats, degrees):
    return at_heading(boats.once(turn), degrees)


def advance(boats: Boats) -> np.ndarray:
    """Distance (n,) ahead at 90 degrees of heading in a turn, m."""
    return boats.once(_turned_by, 90.0)[:, X]


def transfer(boats: Boats) -> np.ndarray:
    """Distance (n,) to the side at 90 degrees of heading in a turn, m."""
    return np.abs(boats.once(_turned_by, 90.0)[:, Y])


def tactical_diameter(boats: Boats) -> np.ndarray:
    """Distance (n,) to the side at 180 degrees of heading in a turn, m."""
    return np.abs(boats.once(_turned_by, 180.0)[:, Y])


def at_heading(states: np.ndarray, degrees: float) -> np.ndarray:
    """States (n, 12) of turns (n, n_times, 12) where the heading has changed by some degrees to either side."""
    return at(states, np.abs(states[..., PSI]), np.radians(degrees))


def steady_diameter(boats: Boats) -> np.ndarray:
    """Twice the speed over the rate of turn (n,) at the end of a turn, m."""
    return circle_diameter(boats.once(turn)[:, -1])


def circle_diameter(states: np.ndarray) -> np.ndarray:
    """Twice the speed in the plane over the rate of turn (n,) of states (n, 12), m."""
    with np.errstate(divide="ignore"):
        return 2.0 * np.hypot(states[:, U], states[:, V]) / np.abs(states[:, R])


def speed_loss(boats: Boats) -> np.ndarray:
    """Share (n,) of the trial speed that is lost at the end of a turn."""
    end = boats.once(turn)[:, -1]
    return 1.0 - np.hypot(end[:, U], end[:, V]) / boats.vehicle.speed_mps


def overshoots(boats: Boats, degrees: float) -> np.ndarray:
    """First and second overshoot (n, 2) of heading, deg, in a zig-zag with as many degrees of rudder as of heading.

    Boats reverse the rudder at times of their own: a leg begins with the state of each at its reversal.
    """
    states = fly(boats, ZIGZAG, "horizontal", {RUDDER: (0.0, degrees)})
    towards, angle, found = np.sign(states[:, -1:, PSI]), np.radians(degrees), []
    for rudder in (degrees, -degrees):
        start = at(states, towards * states[..., PSI], angle)
        reached = np.isfinite(start).all(axis=1)[:, None]
        initial = np.where(reached, start, boats.straight())
        states = fly(boats, ZIGZAG, "horizontal", {RUDDER: (rudder, -rudder)}, initial=initial)
        states = np.where(reached[..., None], states, np.nan)
        found.append(np.degrees(peak(towards * states[..., PSI]) - angle))
        towards = -towards
    return np.stack(found, axis=1)


def spiral(boats: Boats, fastest: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates of turn (2 N_RATES + 1,) up to the fastest (rad/s), and the rudder (n, 2 N_RATES + 1) that holds them, rad.

    It is the result of Bech's reversed spiral, which stands on the unstable branch too; Dieudonne's direct spiral jumps
    over that, and its loop lies between the two folds of the curve (IMO circular MSC/Circ.1053, explanatory notes to
    the standards for ship manoeuvrability, 2002). The boat turns in the horizontal plane with the propeller speed of
    straight flight. Steady turns are solved for, not waited for; not a number where none is found.
    """
    rates = np.linspace(-fastest, fastest, 2 * N_RATES + 1)
    start = boats.vehicle_alone.once(_curve_of_one, fastest)
    return rates, _steady_turns(boats, rates, np.tile(start, (len(boats), 1, 1)))[..., 2]


def _curve_of_one(boat, fastest):
    """(1, n_rates, 3) speeds u and v and the rudder of a boat, from straight flight outwards."""
    rates = np.linspace(-fastest, fastest, 2 * N_RATES + 1)
    curve = np.full((1, len(rates), 3), np.nan)
    for side in (1, -1):
        before = here = np.array([boat.vehicle.speed_mps, 0.0, 0.0])
        for k in range(N_RATES + 1):
            place = N_RATES + side * k
            guess = 2.0 * here - before if k > 1 else here
            found = _steady_turns(boat, rates[place : place + 1], guess[None, None])[0, 0]
            before, here = here, found
            curve[0, place] = found
    return curve


def _steady_turns(boats, rates, guess):
    """(n, n_rates, 3) u, v and rudder without acceleration, by Newton's method from a guess; else not a number."""
    speed, length = boats.vehicle.speed_mps, boats.vehicle.length_m
    n, m, _ = guess.shape
    steps = _NUDGE * np.array([speed, speed, 1.0])
    scales = np.array([length / speed**2, length / speed**2, length**2 / speed**2])
    unknown = guess.copy()
    for _ in range(_ITERATIONS):
        probes = np.repeat(unknown[:, :, None], 4, axis=2)  # as it is, and a step of each
        probes[:, :, [1, 2, 3], [0, 1, 2]] += steps
        flat = probes.reshape(n, 4 * m, 3)
        states = np.tile(boats.straight()[0], (n, 4 * m, 1))
        states[..., [U, V]], states[..., R] = flat[..., :2], np.repeat(rates, 4)
        controls = boats.controls("horizontal", {RUDDER: flat[..., 2]}, 4 * m)
        balance = boats.accelerations("horizontal", states, controls)[..., _BALANCED].reshape(n, m, 4, 3) * scales
        slopes = (balance[:, :, 1:] - balance[:, :, :1]) / steps[:, None]  # by u, v and rudder, of three accelerations
        size = np.abs(balance[:, :, 0]).max(axis=2)
        whole = np.isfinite(slopes).all(axis=(2, 3))
        going = whole & (np.linalg.det(np.where(whole[..., None, None], slopes, 0.0)) != 0.0) & ~(size <= _TOLERANCE)
        if not going.any():
            break
        systems = np.where(going[..., None, None], slopes.swapaxes(2, 3), np.eye(3))
        unknown -= np.where(going[..., None], np.linalg.solve(systems, balance[:, :, 0, :, None])[..., 0], 0.0)
    return np.where((size <= _TOLERANCE)[..., None], unknown, np.nan)


def spiral_curve(boats: Boats) -> tuple[np.ndarray, np.ndarray]:
    """The :func:`spiral` up to the rate of turn that all rudder gives the vehicle."""
    return spiral(boats, abs(float(boats.vehicle_alone.once(turn)[0, -1, R])))


def spiral_loop_width(boats: Boats) -> np.ndarray:
    """Rudder (n,) between the folds of the spiral curve, deg; not a number of a boat whose curve has no folds."""
    rudder = boats.once(spiral_curve)[1]
    rudder = rudder * np.sign(rudder[:, -1:] - rudder[:, :1])  # positive for a turn to starboard
    return np.degrees(peak(rudder[:, : N_RATES + 1]) + peak(-rudder[:, N_RATES:]))


def stopping_distance(boats: Boats) -> np.ndarray:
    """Way (n,) along the track until the boat has stopped, m, its propeller turning astern from 0 s on.

    It turns as fast as it has turned ahead ("track reach" of the full astern stopping test). A boat has stopped at
    STILL of its speed: propulsion models are not good for a boat that moves astern.
    """
    states = fly(boats, STOP, "horizontal", {}, astern=0.0)
    way = np.cumsum(np.linalg.norm(np.diff(states[..., _TRACK], axis=1, prepend=states[:, :1, _TRACK]), axis=2), axis=1)
    return at(way[..., None], -states[..., U], -STILL * boats.vehicle.speed_mps, points=2)[:, 0]


def dive_depth(boats: Boats) -> np.ndarray:
    """Change of depth (n,), m, DIVE ship lengths after an order to the stern planes, which is not taken back."""
    depths = fly(boats, DIVE, "vertical", {STERN_PLANE: (0.0, DIVE_DEG)})[..., Z]
    return depths[:, -1] - depths[:, 0]


def jam_depth_excursion(boats: Boats) -> np.ndarray:
    """Greatest change of depth (n,), m, if the stern planes jam at DIVE_DEG and the propeller is then reversed.

    It turns astern, as fast as it has turned ahead, from REACTION ship lengths after the order on; nothing else is
    done. Tanks are not blown, which the equations do not know. Not a number of a boat whose depth still changes at the
    end. How submarines are brought back from a jam: Renilson, Submarine Hydrodynamics, 2015, chapter 3.
    """
    depths = fly(boats, JAM, "vertical", {STERN_PLANE: (0.0, DIVE_DEG)}, astern=REACTION)[..., Z]
    a_length_before = round(1.0 / (STEP * _SAMPLE)) + 1
    arrested = np.abs(depths[:, -1] - depths[:, -a_length_before]) < STILL * boats.vehicle.length_m
    return np.where(arrested, np.abs(depths - depths[:, :1]).max(axis=1), np.nan)


def at(states: np.ndarray, histories: np.ndarray, value: float, points: int = 4) -> np.ndarray:
    """States (n, k) of (n, n_times, k) where histories (n, n_times) first reach a value, by inverse interpolation.

    Of histories that do not reach it the states are not a number. The polynomial goes through 4 points for a smooth
    history and 2 for one that has a kink nearby.
    """
    beyond = histories >= value
    first = np.clip(beyond.argmax(axis=1) - points // 2, 0, histories.shape[1] - points)
    places, rows = first[:, None] + np.arange(points), np.arange(len(states))[:, None]
    near, around = histories[rows, places], states[rows, places]
    weights = np.ones_like(near)
    for i in range(points):
        for j in range(points):
            if i != j:
                with np.errstate(all="ignore"):
                    weights[:, i] *= (value - near[:, j]) / (near[:, i] - near[:, j])
    return np.where(np.any(beyond, axis=1, keepdims=True), np.einsum("ni,nik->nk", weights, around), np.nan)


def peak(histories: np.ndarray) -> np.ndarray:
    """(n,) largest values of histories (n, n_times), of the parabola through three; not a number at an end."""
    k = np.where(np.isfinite(histories), histories, -np.inf).argmax(axis=1)
    inside = (k > 0) & (k < histories.shape[1] - 1)
    rows, k = np.arange(len(histories)), np.clip(k, 1, histories.shape[1] - 2)
    before, top, after = (histories[rows, k + j] for j in (-1, 0, 1))
    with np.errstate(all="ignore"):
        return np.where(inside, top - (after - before) ** 2 / (8.0 * (after - 2.0 * top + before)), np.nan)
