"""The actuators of a vehicle that has ``[[actuators]]``: what each does, as numbers and as lines of its card."""

import numpy as np

from bayesub.findings.examination import Examination
from bayesub.model.actuator import Actuator
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle

_UNITS = {"deg": "deg", "n": "N", "nm": "N m", "rpm": "rpm", "counts": "counts", "percent": "%", "us": "us"}
_UNITS |= {"m": "m", "cm3": "cm3", "kgm3": "kg/m3", "bar": "bar"}


def actuators(boat: Vehicle) -> Examination:
    """What a unit angle adds to the controls of the equations, and what propellers, thrusters and weights push.

    A propeller pushes with the revolutions of its file at the speed of trials, all others with a unit of their column,
    and a weight with the boat on even keel.
    """
    if boat.actuators.direct:
        return Examination({})
    return Examination({"actuators": {a.column: _numbers(boat, a) for a in boat.actuators.members}})


def _numbers(boat: Vehicle, actuator: Actuator) -> dict:
    factor = np.pi / 180.0 if actuator.unit == "deg" else 1.0
    numbers = {"angle_deg": actuator.angle_deg} if actuator.angle_deg is not None else {}
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


def lines(numbers: dict) -> dict[str, str]:
    """Column of each actuator -> what it does, in words."""
    return {column: _line(column, parts) for column, parts in numbers.get("actuators", {}).items()}


def _line(column: str, parts: dict) -> str:
    unit = _UNITS[column.rpartition("_")[2]]
    texts = [f"at {parts['angle_deg']:g} deg from the top"] if "angle_deg" in parts else []
    texts += [f"to {parts['limit']:.4g} {unit}"] if "limit" in parts else []
    texts += [f"{share:+.3g} {control.removesuffix('_deg')}" for control, share in parts["controls"].items()]
    forces = (
        f"{axis} {force:.3g} {'N' if axis in 'XYZ' else 'N m'}" for axis, force in parts.get("forces", {}).items()
    )
    texts += [f"{parts['at']:g} {unit} make {', '.join(forces)}"] if "at" in parts else []
    return ", ".join(texts)
