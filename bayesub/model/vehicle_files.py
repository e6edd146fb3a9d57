"""The content of a vehicle file; every key carries its unit."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pydantic
from pydantic_core import PydanticCustomError

from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Length, Positive, Section, Speed, WaterDensity
from bayesub.model import actuator_files
from bayesub.model.actuator_files import ActuatorArray, ActuatorsSection, DisplacementSection, Vector3
from bayesub.model.equations import EquationSet
from bayesub.model.equations.files import DEFAULT
from bayesub.model.propulsion import AnyPropulsion, MeasuredSection, NoPropulsionSection


class TrialSpeedSection(Section):
    """Speed and depth at which a manoeuvre begins."""

    speed_mps: Speed
    depth_m: float = 0.0


class InertiaSection(Section):
    """Moments and products of inertia about the body origin."""

    Ixx: Positive
    Iyy: Positive
    Izz: Positive
    Ixy: float = 0.0
    Iyz: float = 0.0
    Izx: float = 0.0


class BodySection(Section):
    """The rigid body, its weight and its buoyancy."""

    length_m: Length
    water_density_kgm3: WaterDensity
    mass_kg: Positive
    neutrally_buoyant: bool = True
    buoyancy_n: Positive | None = None
    inertia_kgm2: InertiaSection
    centre_of_gravity_m: Vector3
    centre_of_buoyancy_m: Vector3

    @pydantic.model_validator(mode="after")
    def _consistent(self):
        if self.neutrally_buoyant == (self.buoyancy_n is not None):
            raise ValueError("give either neutrally_buoyant = true or neutrally_buoyant = false with buoyancy_n")
        for key in ("centre_of_gravity_m", "centre_of_buoyancy_m"):
            if max(map(abs, getattr(self, key))) > self.length_m:
                raise ValueError(f"{key} lies further than length_m from the origin")
        return self


def _table_or_array(section) -> str | None:
    if isinstance(section, dict | ActuatorsSection):
        return "table"
    return "array" if isinstance(section, tuple) else None


class HullSection(Section):
    """Height and breadth of the hull at stations along it, for equations that integrate the cross-flow."""

    x_m: tuple[float, ...] = pydantic.Field(min_length=2)
    height_m: tuple[float, ...]
    breadth_m: tuple[float, ...]

    @pydantic.model_validator(mode="after")
    def _consistent(self):
        if any(b <= a for a, b in zip(self.x_m, self.x_m[1:], strict=False)):
            raise ValueError("x_m must ascend from tail to nose")
        for key in ("height_m", "breadth_m"):
            column = getattr(self, key)
            if len(column) != len(self.x_m):
                raise ValueError(f"{key} has {len(column)} entries, x_m has {len(self.x_m)}")
            if min(column) < 0.0:
                raise ValueError(f"{key} must not be negative")
        return self


class CoefficientSection(Section):
    """A non-dimensional coefficient with its standard deviation, if that is known."""

    value: float
    sd: Positive | None = None


class CorrelationsSection(Section):
    """Correlations of coefficients that have an sd; all others are independent of these and of each other."""

    coefficients: tuple[str, ...] = pydantic.Field(min_length=2)
    matrix: tuple[tuple[float, ...], ...]

    @pydantic.model_validator(mode="after")
    def _of_a_distribution(self):
        n = len(self.coefficients)
        if len(set(self.coefficients)) < n:
            twice = next(name for name in self.coefficients if self.coefficients.count(name) > 1)
            raise ValueError(f"coefficient '{twice}' is named twice")
        if [len(row) for row in self.matrix] != [n] * n:
            raise ValueError(f"matrix must have {n} rows of {n} numbers, as there are {n} coefficients")
        matrix = np.array(self.matrix)
        if not np.all(np.diag(matrix) == 1.0) or not np.all(np.abs(matrix) <= 1.0):
            raise ValueError("matrix must have ones on its diagonal, and no entry beyond -1 and 1")
        if (matrix != matrix.T).any():
            i, j = np.argwhere(matrix != matrix.T)[0]
            first, second = self.coefficients[i], self.coefficients[j]
            found = f"{matrix[i, j]:.6g} and {matrix[j, i]:.6g}"
            raise ValueError(f"matrix must be symmetric, found {found} of {first} and {second}")
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            shares = np.abs(np.linalg.eigh(matrix)[1][:, 0]).round(6)  # equal ones in the order of the file
            most = np.argsort(-shares, kind="stable")[:3]
            names = ", ".join(self.coefficients[k] for k in most)
            text = f"matrix is not positive definite: correlations of {names} contradict each other"
            raise ValueError(f"{text}; keep all digits of the matrix that they were taken from") from None
        return self


def _as_section(entry):
    """A plain number is a coefficient without a standard deviation."""
    if isinstance(entry, dict | CoefficientSection):
        return entry
    if isinstance(entry, bool) or not isinstance(entry, int | float) or not abs(entry) < math.inf:
        raise PydanticCustomError("coefficient", "should be a finite number or { value = .., sd = .. }")
    return {"value": entry}


class VehicleFile(Section):
    """The content of a vehicle file; every key carries its unit."""

    name: str
    description: str = ""
    reference: str = ""
    equations: str = DEFAULT
    trial: TrialSpeedSection
    body: BodySection
    displacement: DisplacementSection | None = None
    hull: HullSection | None = None
    propulsion: AnyPropulsion
    actuators: Annotated[
        Annotated[ActuatorsSection, pydantic.Tag("table")] | Annotated[ActuatorArray, pydantic.Tag("array")],
        pydantic.Discriminator(_table_or_array),
    ]
    coefficients: dict[str, Annotated[CoefficientSection, pydantic.BeforeValidator(_as_section)]]
    correlations: CorrelationsSection | None = None


def check_fit(file: VehicleFile, equations: EquationSet) -> None:
    """InputError for what the file has too much or lacks for its equations."""
    for name in file.coefficients:
        of = "" if equations.name == DEFAULT else f" of the equations '{equations.name}'"
        message = f"coefficients: unknown coefficient '{name}'{of}"
        check_known(name, equations.names, message, key=f"coefficients.{name}")
    if missing := [name for name in equations.names if name not in file.coefficients]:
        listed = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        total = f"{len(missing)} of the {len(equations.names)} coefficients"
        text = f"coefficients: {total} missing ({listed}); write 0 where there is none"
        raise InputError(text, "missing", f"coefficients.{missing[0]}")
    for name in () if file.correlations is None else file.correlations.coefficients:
        message = f"correlations: unknown coefficient '{name}'"
        check_known(name, equations.names, message, key="correlations.coefficients")
        if file.coefficients[name].sd is None:
            text = f"correlations: '{name}' has no sd; write {name} = {{ value = .., sd = .. }} in [coefficients]"
            raise InputError(text, "missing", f"coefficients.{name}.sd")
    if equations.has_crossflow and file.hull is None:
        message = f"hull: is missing; the equations '{equations.name}' integrate the cross-flow along it"
        raise InputError(message, "missing", "hull")
    turned = [t.name for t in equations.terms if t.symbols & {"uc", "duc"} and file.coefficients[t.name].value]
    if turned and isinstance(file.propulsion, NoPropulsionSection) and file.propulsion.rpm is None:
        text = f"propulsion: rpm is missing, the propeller speed at the speed of trials; {turned[0]} has a term of it"
        raise InputError(text, "missing", "propulsion.rpm")
    if isinstance(file.propulsion, MeasuredSection) and isinstance(file.actuators, tuple):
        taken = {one.header for one in file.actuators} & set(MeasuredSection.COLUMNS)
        if taken:
            text = f"actuators: column '{min(taken)}' is that of the measured propulsion; rename it"
            raise InputError(text, "conflict", min(taken))
    actuator_files.check_fit(file.actuators, equations, file.body.length_m, file.displacement is not None)
