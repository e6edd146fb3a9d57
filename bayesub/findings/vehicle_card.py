"""The card of a vehicle, which says whether its file describes a boat."""

from dataclasses import dataclass

import numpy as np

from bayesub.findings import coefficient_examinations as on_paper
from bayesub.findings.coefficient_examinations import CardWarning, Examination, built_in_values
from bayesub.findings.vehicle_examinations import GROWTH, balance, dive, hydrostatics, stability, straight_flight, turn
from bayesub.io import templates
from bayesub.model.actuator import Actuator
from bayesub.model.equations import AXES
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

_UNITS = {"deg": "deg", "n": "N", "nm": "N m", "rpm": "rpm", "counts": "counts", "percent": "%", "us": "us"}
_UNITS |= {"m": "m", "mps": "m/s", "cm3": "cm3", "kgm3": "kg/m3", "bar": "bar"}


def actuators(boat: Vehicle) -> Examination:
    """What a unit angle adds to the controls of the equations, and what propellers, thrusters and weights push.

    A propeller pushes with the revolutions of its file at the speed of trials, all others with a unit of their column,
    and a weight with the boat on even keel.
    """
    if boat.actuators.direct:
        return Examination({})
    return Examination({"actuators": {a.column: _actuator_numbers(boat, a) for a in boat.actuators.members}})


def _actuator_numbers(boat: Vehicle, actuator: Actuator) -> dict:
    factor = np.pi / 180.0 if actuator.unit == "deg" else 1.0
    numbers: dict = {"angle_deg": actuator.angle_deg} if actuator.angle_deg is not None else {}
    if np.isfinite(actuator.limit):
        numbers["limit"] = actuator.limit / factor
    shares = zip(boat.equations.controls, actuator.mixing, strict=True)
    degrees = 180.0 / np.pi * factor  # of a control, for a unit of the column
    numbers["controls"] = {control.column: float(share * degrees) for control, share in shares if share}
    value = 1.0 if actuator.is_linear else actuator.rest
    push = actuator.force * value + actuator.force_of_square * value * abs(value)
    push = push + actuator.force_of_speed * abs(value) * boat.speed_mps
    weight, x, y, _ = actuator.weight * value
    push = push + np.array([0.0, 0.0, weight, y, -x, 0.0])
    if push.any():
        numbers["at"] = value
        numbers["forces"] = {axis: float(force) for axis, force in zip(AXES, push, strict=True) if force}
    return numbers


_IN_FLIGHT = (balance, straight_flight, stability, turn, dive)
EXAMINATIONS = (*_IN_FLIGHT, on_paper.inertia, hydrostatics, on_paper.sizes_and_signs, actuators)


@dataclass(frozen=True)
class VehicleCard:
    """Balance, stability and first answers to the planes of a vehicle, in the field's words."""

    vehicle: Vehicle  # of the file
    # Section -> name -> number (None where there is none), word or list; the unit is in the name. The section "skipped"
    # says why the equations of the vehicle leave others out
    numbers: dict
    warnings: tuple[CardWarning, ...]  # what is unlike a boat
    flights: dict[str, Trajectory]  # "straight", "turn", "dive", as far as the vehicle can be flown

    @property
    def others(self) -> dict[str, np.ndarray]:
        """Name of each other built-in vehicle of the same equations -> (n_terms,) coefficients."""
        values = built_in_values(self.vehicle.equations)
        return {name: xi for name, xi in values.items() if name != self.vehicle.name}

    def lines(self) -> list[str]:
        """The card in words: a line a subject, then the warnings, each with its remedy."""
        actuators = self.numbers.get("actuators", {})
        values = {"numbers": self.numbers, "skipped": self.numbers.get("skipped", {}), "warnings": self.warnings}
        values |= {"actuators": {column: _actuator_line(column, parts) for column, parts in actuators.items()}}
        text = templates.fill("bayesub.findings", "vehicle_card.txt", shown=_formatted, growth=GROWTH, **values)
        return text.removesuffix("\n").split("\n")

    def to_json(self) -> dict:
        """Numbers and warnings as JSON types."""
        return {"vehicle": self.vehicle.name, **self.numbers, "warnings": [vars(w) for w in self.warnings]}


def check(vehicle: Vehicle) -> VehicleCard:
    """Examine a vehicle on paper and in three short flights; whatever the numbers, the answer is a card."""
    with np.errstate(all="ignore"):
        examinations = [examine(vehicle) for examine in EXAMINATIONS]
    numbers = {section: numbers for e in examinations for section, numbers in e.numbers.items()}
    if skipped := {section: reason for e in examinations for section, reason in e.skipped.items()}:
        numbers["skipped"] = skipped
    warnings = tuple(warning for e in examinations for warning in e.warnings)
    flights = {name: trajectory for e in examinations for name, trajectory in e.flights.items()}
    return VehicleCard(vehicle, numbers, warnings, flights)


def _formatted(value: float | None, form: str = "z.3g", factor: float = 1.0) -> str:
    return "undefined" if value is None else format(factor * value, form)


def _actuator_line(column: str, parts: dict) -> str:
    unit = _UNITS[column.rpartition("_")[2]]
    texts = [f"at {parts['angle_deg']:g} deg from the top"] if "angle_deg" in parts else []
    texts += [f"to {parts['limit']:.4g} {unit}"] if "limit" in parts else []
    texts += [f"{share:+.3g} {control.removesuffix('_deg')}" for control, share in parts["controls"].items()]
    forces = (f"{axis} {push:.3g} {'N' if axis in 'XYZ' else 'N m'}" for axis, push in parts.get("forces", {}).items())
    texts += [f"{parts['at']:g} {unit} make {', '.join(forces)}"] if "at" in parts else []
    return ", ".join(texts)
