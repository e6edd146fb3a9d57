"""Quantities of a boat that follow from its coefficients: turns, zig-zags, stability, dives, stopping.

Each is a number for each boat of a batch (:class:`bayesub.model.boats.Boats`), not a number where a boat has no such
quantity (:meth:`Quantity.reason`) or does not reach what is measured (:attr:`Quantity.none`). Definitions with their
sources stand in :mod:`bayesub.model.standard_manoeuvres` and :mod:`bayesub.model.linear_motion`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesub.kernels import workspace
from bayesub.model import linear_motion, standard_manoeuvres
from bayesub.model.boats import Boats
from bayesub.model.manoeuvre_files import RUDDER, STERN_PLANE
from bayesub.model.standard_manoeuvres import DIVE, DIVE_DEG, JAM, REACTION, RUDDER_DEG, STILL, STOP, TURN, ZIGZAG
from bayesub.model.vehicles import Vehicle

PROPELLER = "rpm"
GLIDES = "the boat has no thrust and is driven by its weight"
PUSHED = "thrusters drive the boat, and rest until they are ordered"
RELATIVE_STEP = 1e-3  # of a coefficient, for derivatives by it
_THRUST = [workspace.BODY.index(key) for key in workspace.THRUST]


@dataclass(frozen=True)
class Quantity:
    """A number that follows from the coefficients of a boat."""

    name: str  # a key of QUANTITIES, or that of a study
    unit: str  # empty for a ratio, and where the name ends with it
    meaning: str  # one sentence
    needs: tuple[str, ...]  # columns of the controls that it takes, and PROPELLER
    subproblem: str  # plane in which it is measured; empty if all coefficients may count
    function: Callable[[Boats], np.ndarray]  # n boats -> (n,) values
    none: str = "the simulation fails"  # what is so of a boat that has no such value

    def reason(self, vehicle: Vehicle) -> str:
        """Why a boat has no such quantity; empty if it has."""
        if self.subproblem and self.subproblem not in vehicle.equations.subproblems:
            return "the equations have three degrees of freedom"
        reason = next(filter(None, (absence(vehicle, column) for column in self.needs)), "")
        return reason or (GLIDES if self.subproblem and glides(vehicle) else "")

    def of(self, boats: Boats) -> np.ndarray:
        """The quantity (n,) of boats, in one batch."""
        return np.full(len(boats), np.nan) if self.reason(boats.vehicle) else self.function(boats)

    def values(self, vehicle: Vehicle, xi: np.ndarray) -> np.ndarray:
        """The quantity (n,) of coefficient sets (n, n_terms) of a vehicle, in one batch."""
        return self.of(Boats(vehicle, np.atleast_2d(xi)))


def recorded(quantity: Quantity, values: list[list[float]]) -> Quantity:
    """The same, which adds what it gives of each batch to a list."""

    def function(boats: Boats) -> np.ndarray:
        found = quantity.function(boats)
        values.append(found.tolist())
        return found

    return replace(quantity, function=function)


def replayed(quantity: Quantity, reference: list, prior: list, posterior: list) -> Quantity:
    """The same, which gives what was :func:`recorded` of these batches, in their order, and runs no function."""
    batches = iter([np.array(values, dtype=float) for values in (reference, prior, posterior)])
    return replace(quantity, function=lambda _: next(batches))


def gradient(vehicle: Vehicle, quantity: Quantity, columns: Sequence[int] | np.ndarray) -> np.ndarray:
    """Derivatives (n_columns,) of a quantity by coefficients of a vehicle, in its unit over theirs, by their positions.

    They are central differences over a thousandth of a coefficient, flown in one batch; a coefficient that is zero is
    moved by a thousandth of the median size of those that are not.
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


def glides(vehicle: Vehicle) -> bool:
    """Whether a boat has no straight and level flight, since its weight drives it and nothing else."""
    return any(a.weight.any() for a in vehicle.actuators.members) and not vehicle.body[_THRUST].any()


def absence(vehicle: Vehicle, column: str) -> str:
    """Why a control cannot be ordered; empty if the equations have it and an actuator moves it."""
    if column == PROPELLER:
        reason = "no thrust polynomial says what a propeller does that turns astern"
        return "" if vehicle.body[_THRUST].any() else reason
    columns = [control.column for control in vehicle.equations.controls]
    if column not in columns:
        return f"the equations '{vehicle.equations.name}' know no {column}"
    return "" if vehicle.actuators.allocation[:, columns.index(column)].any() else f"no actuator moves {column}"


def _overshoot(degrees, k):
    return lambda boats: boats.once(standard_manoeuvres.overshoots, degrees)[:, k]


def _root(plane, k):
    return lambda boats: boats.once(linear_motion.roots, plane)[:, k].real


def _index(plane):
    return lambda boats: linear_motion.stability_index(boats, plane)


_TURNING = f"with {RUDDER_DEG:g} degrees of rudder, or its limit"
_ASTERN = "the propeller turns astern as fast as it has turned ahead"
_NO_TURN = f"the heading does not change so far in {TURN:g} ship lengths"
_NO_REVERSAL = f"the heading does not follow within {ZIGZAG:g} ship lengths"
_NO_DAMPING = "a damping derivative is not negative"
QUANTITIES: dict[str, Quantity] = {
    quantity.name: quantity
    for quantity in (
        Quantity("tactical_diameter_m", "m", f"Distance to the side at 180 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", standard_manoeuvres.tactical_diameter, _NO_TURN),
        Quantity("advance_m", "m", f"Distance ahead at 90 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", standard_manoeuvres.advance, _NO_TURN),
        Quantity("transfer_m", "m", f"Distance to the side at 90 degrees of heading in a turn {_TURNING}.",
            (RUDDER,), "horizontal", standard_manoeuvres.transfer, _NO_TURN),
        Quantity("steady_turning_diameter_m", "m",
            f"Twice the speed over the rate of turn {TURN:g} lengths into a turn {_TURNING}.",
            (RUDDER,), "horizontal", standard_manoeuvres.steady_diameter),
        Quantity("turning_speed_loss", "", f"Share of the speed that is lost {TURN:g} lengths into a turn {_TURNING}.",
            (RUDDER,), "horizontal", standard_manoeuvres.speed_loss),
        Quantity("zigzag_overshoot_deg", "deg",
            "First overshoot of heading in a zig-zag with 10 degrees of rudder and heading.",
            (RUDDER,), "horizontal", _overshoot(10.0, 0), _NO_REVERSAL),
        Quantity("zigzag_second_overshoot_deg", "deg", "Second overshoot of heading in the same zig-zag.",
            (RUDDER,), "horizontal", _overshoot(10.0, 1), _NO_REVERSAL),
        Quantity("zigzag_20_overshoot_deg", "deg",
            "First overshoot of heading in a zig-zag with 20 degrees of rudder and heading.",
            (RUDDER,), "horizontal", _overshoot(20.0, 0), _NO_REVERSAL),
        Quantity("spiral_loop_width_deg", "deg",
            "Rudder between the folds of the spiral curve, within which the boat turns to either side.",
            (RUDDER,), "horizontal", standard_manoeuvres.spiral_loop_width,
            "a boat that is stable on a straight course has no loop"),
        Quantity("horizontal_stability_index", "",
            "G_h, margin of stability of a straight course; above zero is stable.",
            (), "horizontal", _index("horizontal"), _NO_DAMPING),
        Quantity("straight_line_stability", "1/s",
            "Largest real part of the roots of sway and yaw; negative is stable.",
            (), "horizontal", _root("horizontal", 0)),
        Quantity("straight_line_second_root", "1/s", "Real part of the other root of sway and yaw.",
            (), "horizontal", _root("horizontal", 1)),
        Quantity("stopping_distance_m", "m",
            f"Way along the track until {100 * STILL:g} % of the speed is left while {_ASTERN}.",
            (PROPELLER,), "horizontal", standard_manoeuvres.stopping_distance,
            f"the boat does not stop in the time of {STOP:g} ship lengths"),
        Quantity("vertical_stability_index", "",
            "G_v, margin of stability in the vertical plane without the righting moment; above zero is stable.",
            (), "vertical", _index("vertical"), _NO_DAMPING),
        Quantity("vertical_stability", "1/s",
            "Largest real part of the roots of heave and pitch, with the righting moment; negative is stable.",
            (), "vertical", _root("vertical", 0)),
        Quantity("vertical_second_root", "1/s", "Real part of the second root of heave and pitch.",
            (), "vertical", _root("vertical", 1)),
        Quantity("vertical_third_root", "1/s", "Real part of the third root of heave and pitch.",
            (), "vertical", _root("vertical", 2)),
        Quantity("vertical_period_s", "s", "Period of the oscillation of heave and pitch.",
            (), "vertical", linear_motion.period, "all roots are real and nothing oscillates"),
        Quantity("critical_speed_mps", "m/s", "Speed above which oscillations of heave and pitch grow.",
            (), "vertical", linear_motion.critical_speed,
            "a boat with a righting moment and G_v above zero is stable at every speed"),
        Quantity("inversion_speed_mps", "m/s",
            "Speed at which the stern planes do not change the depth; below it they act the other way round.",
            (STERN_PLANE,), "vertical", linear_motion.inversion_speed, "the planes act the same way at every speed"),
        Quantity("dive_depth_m", "m",
            f"Change of depth {DIVE:g} lengths after an order of {DIVE_DEG:g} degrees to the stern planes.",
            (STERN_PLANE,), "vertical", standard_manoeuvres.dive_depth),
        Quantity("jam_depth_excursion_m", "m",
            f"Greatest change of depth after the stern planes jam at {DIVE_DEG:g} degrees; "
            f"from {REACTION:g} lengths on {_ASTERN}.",
            (STERN_PLANE, PROPELLER), "vertical", standard_manoeuvres.jam_depth_excursion,
            f"the depth still changes after the time of {JAM:g} ship lengths, or the simulation fails"),
    )
}  # fmt: skip
