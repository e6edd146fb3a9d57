"""The card of a vehicle, which says whether its file describes a boat."""

from dataclasses import dataclass

import numpy as np

from bayesub.findings.coefficient_examinations import (
    CardWarning,
    Examination,
    built_in_values,
    inertia,
    sizes_and_signs,
)
from bayesub.findings.vehicle_examinations import GROWTH, balance, dive, hydrostatics, stability, straight_flight, turn
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


EXAMINATIONS = (balance, straight_flight, stability, turn, dive, inertia, hydrostatics, sizes_and_signs, actuators)


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
        sections = {
            "thrust": ("thrust_over_drag", _thrust_line),
            "straight flight": ("straight_flight", _straight_line),
            "stability": ("stability", _stability_line),
            "turning circle": ("turning_circle", _turn_line),
            "stern planes": ("stern_plane", _dive_line),
            "mass matrix": ("mass_matrix", _mass_line),
            "hydrostatics": ("hydrostatics", _hydrostatics_line),
        }
        skipped = self.numbers.get("skipped", {})
        texts = {
            subject: f"not examined: {skipped[section]}" if section in skipped else line(self.numbers)
            for subject, (section, line) in sections.items()
        }
        texts |= {column: _actuator_line(column, parts) for column, parts in self.numbers.get("actuators", {}).items()}
        texts |= {
            f"zero in {axis}": " ".join(names) or "none" for axis, names in self.numbers["zero_coefficients"].items()
        }
        remedies = [f"  warning: {warning.text}; {warning.remedy}" for warning in self.warnings]
        return [*(f"  {subject:<17} {text}" for subject, text in texts.items()), *(remedies or ["  no warnings"])]

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
    return VehicleCard(
        vehicle,
        numbers,
        tuple(warning for e in examinations for warning in e.warnings),
        {name: trajectory for e in examinations for name, trajectory in e.flights.items()},
    )


def _formatted(value: float | None, form: str = "z.3g", factor: float = 1.0) -> str:
    return "undefined" if value is None else format(factor * value, form)


def _thrust_line(numbers):
    if None in numbers["thrust_over_drag"].values():
        return "no drag to balance it"
    above, below = (_formatted(ratio, ".4g") for ratio in numbers["thrust_over_drag"].values())
    return f"{above} times the drag at self-propulsion" + ("" if above == below else f", {below} just below it")


def _straight_line(numbers):
    flight = numbers["straight_flight"]
    if flight is None:
        return "not flown to the end"
    deeper = "depth_change_lengths"  # absent, as roll and pitch, with three degrees of freedom
    angles = ", ".join(
        f"{name} {_formatted(flight[f'{name}_deg'], 'z.1f')} deg"
        for name in ("roll", "pitch", "heading")
        if f"{name}_deg" in flight
    )
    percent = _formatted(flight["speed_ratio"], ".4g", 100.0)
    return f"after {flight['lengths']:g} ship lengths {percent} % of the speed, {angles}" + (
        f", {_formatted(flight[deeper], 'z.2f')} ship lengths deeper" if deeper in flight else ""
    )


def _stability_line(numbers):
    indices = numbers["stability"]
    rate = indices["growth_per_length"]
    fate = "undefined" if rate is None else f"{'grows' if rate > GROWTH else 'decays'} by {abs(rate):.2g} a ship length"
    values = ", ".join(
        f"{key.partition('_')[2]} = {_formatted(index, 'z.2f')}"
        for key, index in indices.items()
        if key != "growth_per_length"
    )
    return f"{values} (above 0: stable without righting moment); the slowest disturbance {fate}"


def _turn_line(numbers):
    turn = numbers["turning_circle"]
    if turn is None:
        return "not flown to the end"
    if turn["diameter_lengths"] is None:
        return f"{turn['rudder_deg']:g} deg of rudder do not turn it"
    percent = _formatted(turn["speed_ratio"], factor=100.0)
    return (
        f"{turn['rudder_deg']:g} deg of rudder: diameter {_formatted(turn['diameter_lengths'])} ship lengths "
        f"(tactical {_formatted(turn['tactical_diameter_lengths'])}), {percent} % of the speed, drift "
        f"{_formatted(turn['drift_angle_deg'])} deg; positive rudder turns {turn['positive_rudder_turns']}"
    )


def _dive_line(numbers):
    dive = numbers["stern_plane"]
    if dive is None:
        return "not flown to the end"
    return (
        f"{dive['angle_deg']:+g} deg: {dive['positive_angle_pitches'] or 'no answer in pitch'}, pitch "
        f"{_formatted(dive['pitch_after_two_lengths_deg'], '+z.2g')} deg after two ship lengths"
    )


def _mass_line(numbers):
    mass = numbers["mass_matrix"]
    pairs = {pair: difference for pair, difference in mass["added_mass_differences"].items() if difference > 0.01}
    differ = ", ".join(f"{pair.replace('-', ' and ')} by {100 * share:.0f} %" for pair, share in pairs.items())
    definite = "positive definite" if mass["positive_definite"] else "NOT positive definite"
    return f"{definite}; added mass {f'not symmetric: {differ}' if differ else 'symmetric'}"


def _hydrostatics_line(numbers):
    balance = numbers["hydrostatics"]
    percent, below = _formatted(balance["buoyancy_over_weight"], ".5g", 100.0), _formatted(balance["BG_m"])
    return f"buoyancy {percent} % of the weight, centre of gravity {below} m below that of buoyancy"


def _actuator_line(column: str, parts: dict) -> str:
    unit = _UNITS[column.rpartition("_")[2]]
    texts = [f"at {parts['angle_deg']:g} deg from the top"] if "angle_deg" in parts else []
    texts += [f"to {parts['limit']:.4g} {unit}"] if "limit" in parts else []
    texts += [f"{share:+.3g} {control.removesuffix('_deg')}" for control, share in parts["controls"].items()]
    forces = (
        f"{axis} {force:.3g} {'N' if axis in 'XYZ' else 'N m'}" for axis, force in parts.get("forces", {}).items()
    )
    texts += [f"{parts['at']:g} {unit} make {', '.join(forces)}"] if "at" in parts else []
    return ", ".join(texts)
