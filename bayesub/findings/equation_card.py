"""The card of an equation set: its terms by axis, its sub-problems and controls, and what else it asks of a vehicle."""

from collections.abc import Sequence
from dataclasses import dataclass

from bayesub.model.equations import AXES, EquationSet

_RIGID_BODY = {
    "separate": "apart from the coefficients",
    "in_coefficients": "its velocity terms are part of the coefficients; only its mass matrix is apart",
}
_SPEEDS = {"trial": "that of the vehicle's trials", "instantaneous": "that of the moment"}


@dataclass(frozen=True)
class EquationCard:
    """An equation set in lines of text."""

    equations: EquationSet

    def lines(self) -> list[str]:
        """The card in words, a line a subject."""
        equations = self.equations
        axes = {axis: equations.names_of_axis(axis) for axis in AXES}
        texts = {f"{axis}, {len(names)} terms": " ".join(names) for axis, names in axes.items() if names}
        texts |= {plane: f"{len(names)} terms" for plane, names in equations.subproblems.items()}
        controls = ", ".join(f"{control.symbol} {control.column}" for control in equations.controls)
        texts["controls"] = controls or "none"
        texts["added masses"] = " ".join(equations.added_masses) or "none"
        texts["dimensional"] = ", ".join(f"{name} {unit}" for name, unit in self._units.items()) or "none"
        texts["rigid body"] = _RIGID_BODY[equations.rigid_body_terms]
        if any(term.speed_power for term in equations.terms):
            texts["speed"] = _SPEEDS[equations.speed]
        if equations.has_crossflow:
            texts["cross-flow"] = f"integrals at {equations.stations} points of the hull: vehicles need [hull]"
        texts["reference"] = equations.reference or "none"
        return [f"  {subject:<17} {text}" for subject, text in texts.items()]

    @property
    def _units(self) -> dict[str, str]:
        return {term.name: term.unit for term in self.equations.terms if term.unit is not None}

    def to_json(self) -> dict:
        """The card as JSON types."""
        equations = self.equations
        return {
            "equations": equations.name,
            **{key: getattr(equations, key) for key in ("title", "reference", "degrees_of_freedom")},
            "terms": {axis: list(equations.names_of_axis(axis)) for axis in AXES},
            "subproblems": {plane: list(names) for plane, names in equations.subproblems.items()},
            "controls": {control.symbol: control.column for control in equations.controls},
            "added_masses": list(equations.added_masses),
            "units": self._units,
            **{key: getattr(equations, key) for key in ("rigid_body_terms", "speed")},
            "crossflow_points": equations.stations if equations.has_crossflow else None,
        }


def glossary(equations: EquationSet, names: Sequence[str] | None = None) -> list[dict[str, str]]:
    """What coefficients are, all of a set unless some are named: symbol, what each multiplies, and its meaning."""
    terms = equations.terms if names is None else map(equations.term, names)
    keys = ("name", "label", "factor", "regressor", "meaning")
    return [dict(zip(keys, (t.name, t.label, t.scale, t.regressor, t.meaning), strict=True)) for t in terms]
