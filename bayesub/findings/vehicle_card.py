"""The card of a vehicle, which says whether its file describes a boat."""

from dataclasses import dataclass

import numpy as np

from bayesub.findings import vehicle_lines
from bayesub.findings.actuator_examination import actuators
from bayesub.findings.coefficient_examinations import inertia, sizes_and_signs
from bayesub.findings.examination import CardWarning
from bayesub.findings.vehicle_examinations import balance, dive, hydrostatics, stability, straight_flight, turn
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

EXAMINATIONS = (balance, straight_flight, stability, turn, dive, inertia, hydrostatics, sizes_and_signs, actuators)


@dataclass(frozen=True)
class VehicleCard:
    """Balance, stability and first answers to the planes of a vehicle, in the field's words.

    Attributes
    ----------
    vehicle : Vehicle
        Of the file.
    numbers : dict
        Section -> name -> number (None where there is none), word or list; the unit is in the name. The section
        "skipped" says why the equations of the vehicle leave others out.
    warnings : tuple of CardWarning
        What is unlike a boat.
    flights : dict of str to Trajectory
        "straight", "turn", "dive", as far as the vehicle can be flown.
    """

    vehicle: Vehicle
    numbers: dict
    warnings: tuple[CardWarning, ...]
    flights: dict[str, Trajectory]

    def lines(self) -> list[str]:
        """The card in words: a line a subject, then the warnings, each with its remedy."""
        return vehicle_lines.lines(self.numbers, self.warnings)

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
