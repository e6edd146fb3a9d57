"""Quantities of a boat that follow from its coefficients: turning circle, zig-zag, stability, dive.

Each is a number for a coefficient set, not a number where a boat has no such quantity (:meth:`Quantity.reason`) or does
not reach what is measured, such as 180 degrees of heading. Turns are confined to the horizontal plane and dives to the
vertical one; they begin straight and level at the trial speed, with the answer of the actuators to an order at 0 s.
Measures of turns and zig-zags are those of IMO resolution MSC.137(76).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.io.log_files import positions
from bayesub.model.manoeuvre_files import RUDDER, STERN_PLANE, straight_and_level
from bayesub.model.manoeuvres import of_inputs
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle

TURN, DIVE, ZIGZAG = 60.0, 4.0, 20.0  # ship lengths travelled at the trial speed
RUDDER_DEG, DIVE_DEG, ZIGZAG_DEG = 35.0, 10.0, 10.0  # at most; a smaller limit of the boat counts
STEP = 0.02  # integration step in ship lengths travelled
_SAMPLE = 5  # steps between two outputs
_BEFORE = 1e3  # ship lengths before the start, in which a plane has come to rest where it was ordered
NUDGE = 1e-7  # of the speed, the speed per length and 1 rad, for derivatives of accelerations: forces of v|v| vanish
RELATIVE_STEP = 1e-3  # of a coefficient, for derivatives by it
X, Y, PSI, U, V, R, Z = positions("x", "y", "psi", "u", "v", "r", "z")


@dataclass(frozen=True)
class Quantity:
    """A number that follows from the coefficients of a boat.

    Attributes
    ----------
    name : str
        A key of :data:`QUANTITIES`.
    unit : str
        Empty for a ratio.
    meaning : str
        One sentence.
    needs : tuple of str
        Columns of the controls that it takes.
    subproblem : str
        Plane in which it is measured.
    function : callable
        Vehicle and coefficient sets (n, n_terms) -> (n,) values.
    """

    name: str
    unit: str
    meaning: str
    needs: tuple[str, ...]
    subproblem: str
    function: Callable[[Vehicle, np.ndarray], np.ndarray]

    def reason(self, vehicle: Vehicle) -> str:
        """Why a boat has no such quantity; empty if it has."""
        if self.subproblem not in vehicle.equations.subproblems:
            return "the equations have three degrees of freedom"
        return next(filter(None, (absence(vehicle, column) for column in self.needs)), "")

    def values(self, vehicle: Vehicle, xi: np.ndarray) -> np.ndarray:
        """The quantity (n,) of coefficient sets (n, n_terms), in one batch."""
        xi = np.atleast_2d(xi)
        return np.full(len(xi), np.nan) if self.reason(vehicle) else self.function(vehicle, xi)


def gradient(vehicle: Vehicle, quantity: Quantity, columns: Sequence[int] | np.ndarray) -> np.ndarray:
    """Derivatives (n_columns,) of a quantity by some coefficients of a vehicle, in its unit over theirs.

    They are central differences over a thousandth of a coefficient, flown in one batch; a coefficient that is zero is
    moved by a thousandth of the median size of those that are not.

    Parameters
    ----------
    vehicle : Vehicle
    quantity : Quantity
    columns : (n_columns,) array of int
        Positions of the coefficients among those of the equations.
    """
    columns, sizes = np.asarray(columns, dtype=int), np.abs(vehicle.xi)
    typical = np.median(sizes[sizes > 0.0]) if sizes.any() else 1.0
    steps = RELATIVE_STEP * np.where(sizes > 0.0, sizes, typical)[columns]
    sets = np.tile(vehicle.xi, (2, len(columns), 1))
    rows = np.arange(len(columns))
    sets[0, rows, columns] += steps
    sets[1, rows, columns] -= steps
    upper, lower = np.split(quantity.values(vehicle, sets.reshape(-1, len(vehicle.xi))), 2)
    return (upper - lower) / (2.0 * steps)


def absence(vehicle: Vehicle, column: str) -> str:
    """Why a control cannot be ordered; empty if the equations have it and an actuator moves it."""
    columns = [control.column for control in vehicle.equations.controls]
    if column not in columns:
        return f"the equations '{vehicle.equations.name}' know no {column}"
    return "" if vehicle.actuators.allocation[:, columns.index(column)].any() else f"no actuator moves {column}"


def _simulator(vehicle, lengths, column, degrees, subproblem, before=0.0):
    """Simulator of a plane that is ordered over at 0 s, as far as it goes, from where `before` degrees had put it."""
    scale = vehicle.length_m / vehicle.speed_mps
    times = np.linspace(0.0, lengths * scale, round(lengths / STEP) + 1)
    largest = vehicle.actuators.limits[vehicle.equations.control(column, "quantities")]
    angles = np.clip(np.radians([before, degrees]), -largest, largest)
    orders = {column: (np.array([-_BEFORE * scale, 0.0]), angles)}
    inputs = vehicle.actuators.responses(times, orders, "quantities")
    rpm = np.full(len(times), vehicle.rpm_per_mps * vehicle.speed_mps)
    manoeuvre = of_inputs("quantities", times, inputs, rpm, straight_and_level(vehicle), vehicle, subproblem=subproblem)
    return Simulator(vehicle, manoeuvre, times[::_SAMPLE], dt=STEP * scale)


def _turn(vehicle, xi):
    """States (n, n_times, 12) of a turn, not a number from a failure on."""
    return _simulator(vehicle, TURN, RUDDER, RUDDER_DEG, "horizontal").run(xi)[0]


def _at(states, histories, values):
    """States (n, 12) where histories (n, n_times) first reach values (n,), by cubic inverse interpolation."""
    beyond = histories >= values[:, None]
    n_times = histories.shape[1]
    first = np.clip(beyond.argmax(axis=1) - 2, 0, n_times - 4)
    places, rows = first[:, None] + np.arange(4), np.arange(len(states))[:, None]
    at, around = histories[rows, places], states[rows, places]
    weights = np.ones_like(at)
    for i in range(4):
        for j in range(4):
            if i != j:
                with np.errstate(all="ignore"):
                    weights[:, i] *= (values - at[:, j]) / (at[:, i] - at[:, j])
    found = np.einsum("ni,nik->nk", weights, around)
    return np.where(beyond.any(axis=1)[:, None], found, np.nan)


def _at_heading(vehicle, xi, degrees):
    states = _turn(vehicle, xi)
    return _at(states, np.abs(states[..., PSI]), np.full(len(states), np.radians(degrees)))


def _tactical_diameter(vehicle, xi):
    return np.abs(_at_heading(vehicle, xi, 180.0)[:, Y])


def _advance(vehicle, xi):
    return _at_heading(vehicle, xi, 90.0)[:, X]


def _transfer(vehicle, xi):
    return np.abs(_at_heading(vehicle, xi, 90.0)[:, Y])


def _steady_diameter(vehicle, xi):
    end = _turn(vehicle, xi)[:, -1]
    with np.errstate(divide="ignore"):
        return 2.0 * np.hypot(end[:, U], end[:, V]) / np.abs(end[:, R])


def _speed_loss(vehicle, xi):
    end = _turn(vehicle, xi)[:, -1]
    return 1.0 - np.hypot(end[:, U], end[:, V]) / vehicle.speed_mps


def _overshoot(vehicle, xi):
    """Members reverse the rudder at times of their own, each from its state at that time."""
    angle = np.radians(ZIGZAG_DEG)
    states = _simulator(vehicle, ZIGZAG, RUDDER, ZIGZAG_DEG, "horizontal").run(xi)[0]
    start = _at(states, np.abs(states[..., PSI]), np.full(len(states), angle))
    reached = np.isfinite(start).all(axis=1)
    reverse = _simulator(vehicle, ZIGZAG, RUDDER, -ZIGZAG_DEG, "horizontal", before=ZIGZAG_DEG)
    initial = np.where(reached[:, None], start, straight_and_level(vehicle))
    headings = reverse.run(xi, initial=initial, outputs=("psi",))[0][..., 0] * np.sign(start[:, [PSI]])
    return np.where(reached, np.degrees(_peak(headings) - angle), np.nan)


def _peak(histories):
    """(n,) largest values of histories (n, n_times), of the parabola through three; not a number at an end."""
    finite = np.where(np.isfinite(histories), histories, -np.inf)
    k = finite.argmax(axis=1)
    inside = (k > 0) & (k < histories.shape[1] - 1)
    rows, k = np.arange(len(histories)), np.clip(k, 1, histories.shape[1] - 2)
    before, top, after = (histories[rows, k + j] for j in (-1, 0, 1))
    with np.errstate(all="ignore"):
        return np.where(inside, top - (after - before) ** 2 / (8.0 * (after - 2.0 * top + before)), np.nan)


def _dive_depth(vehicle, xi):
    depths = _simulator(vehicle, DIVE, STERN_PLANE, DIVE_DEG, "vertical").run(xi, outputs=("z",))[0][..., 0]
    return depths[:, -1] - depths[:, 0]


def _growth(vehicle, xi, subproblem, velocities, angles):
    """(n,) largest real part of the roots of the linearised motion of velocities, and of angles with their rates."""
    speed, length = vehicle.speed_mps, vehicle.length_m
    scales = dict.fromkeys("vw", speed) | dict.fromkeys("qr", speed / length) | dict.fromkeys(angles, 1.0)
    names = (*velocities, *angles)
    steps = NUDGE * np.array([scales[name] for name in names])
    states = np.tile(straight_and_level(vehicle), (2, len(names), 1))
    for k, place in enumerate(positions(*names)):
        states[:, k, place] += [steps[k], -steps[k]]
    times = np.array([0.0, length / speed])
    rest, rpm = np.tile(vehicle.actuators.rest, (2, 1)), np.full(2, vehicle.rpm_per_mps * speed)
    still = of_inputs("quantities", times, rest, rpm, straight_and_level(vehicle), vehicle, subproblem=subproblem)
    simulator = Simulator(vehicle, still, np.zeros(2 * len(names)), dt=STEP * times[1])
    rates = simulator.accelerations(xi, np.repeat(states.reshape(1, -1, 12), len(xi), axis=0))
    upper, lower = np.split(rates[..., [place - U for place in positions(*velocities)]], 2, axis=1)
    matrices = np.zeros((len(xi), len(names), len(names)))
    matrices[:, : len(velocities)] = ((upper - lower) / (2.0 * steps[:, None])).swapaxes(1, 2)
    for k, rate in enumerate(angles.values(), start=len(velocities)):
        matrices[:, k, names.index(rate)] = 1.0
    whole = np.isfinite(matrices).all(axis=(1, 2))
    roots = np.linalg.eigvals(np.where(whole[:, None, None], matrices, 0.0))
    return np.where(whole, roots.real.max(axis=1), np.nan)


def _straight_line(vehicle, xi):
    return _growth(vehicle, xi, "horizontal", ("v", "r"), {})


def _vertical(vehicle, xi):
    return _growth(vehicle, xi, "vertical", ("w", "q"), {"theta": "q"})


_TURNING = f"with {RUDDER_DEG:g} degrees of rudder, or as far as it goes"
QUANTITIES: dict[str, Quantity] = {
    quantity.name: quantity
    for quantity in (
        Quantity(
            "tactical_diameter_m", "m", f"Distance to the side at 180 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", _tactical_diameter,
        ),
        Quantity(
            "advance_m", "m", f"Distance ahead at 90 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", _advance,
        ),
        Quantity(
            "transfer_m", "m", f"Distance to the side at 90 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", _transfer,
        ),
        Quantity(
            "steady_turning_diameter_m", "m",
            f"Twice the speed over the rate of turn {TURN:g} lengths into a turn {_TURNING}.",
            (RUDDER,), "horizontal", _steady_diameter,
        ),
        Quantity(
            "turning_speed_loss", "", f"Share of the speed that is lost {TURN:g} lengths into a turn {_TURNING}.",
            (RUDDER,), "horizontal", _speed_loss,
        ),
        Quantity(
            "straight_line_stability", "1/s", "Largest real part of the roots of sway and yaw; negative is stable.",
            (), "horizontal", _straight_line,
        ),
        Quantity(
            "vertical_stability", "1/s",
            "Largest real part of the roots of heave and pitch, with the righting moment; negative is stable.",
            (), "vertical", _vertical,
        ),
        Quantity(
            "zigzag_overshoot_deg", "deg",
            "First overshoot of heading in a zig-zag with 10 degrees of rudder and heading.",
            (RUDDER,), "horizontal", _overshoot,
        ),
        Quantity(
            "dive_depth_m", "m",
            f"Change of depth {DIVE:g} lengths after an order of {DIVE_DEG:g} degrees to the stern planes.",
            (STERN_PLANE,), "vertical", _dive_depth,
        ),
    )
}  # fmt: skip
