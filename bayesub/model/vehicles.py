"""Vehicles: the non-dimensional coefficients, the rigid body, the propulsion and the actuators, from a TOML file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import pydantic
from pydantic_core import PydanticCustomError

from bayesub.io import toml_files
from bayesub.io.errors import InputError, error_source, nearest
from bayesub.io.toml_files import Length, Positive, Section, Speed, WaterDensity
from bayesub.kernels import workspace
from bayesub.model import actuator_files, mass
from bayesub.model.actuator_files import ActuatorArray, ActuatorsSection
from bayesub.model.actuators import Actuators
from bayesub.model.equations import EquationSet, load_equations
from bayesub.model.equations.files import DEFAULT, beside, equation_files
from bayesub.model.equations.generate import directory

if TYPE_CHECKING:
    from bayesub.kernels import families

GRAVITY_MPS2 = 9.81

Vector3 = Annotated[tuple[float, float, float], pydantic.Field(description="three numbers")]
Vector9 = Annotated[tuple[float, ...], pydantic.Field(min_length=9, max_length=9)]


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
    def _one_buoyancy(self):
        if self.neutrally_buoyant == (self.buoyancy_n is not None):
            raise ValueError("give either neutrally_buoyant = true or neutrally_buoyant = false with buoyancy_n")
        return self

    @pydantic.model_validator(mode="after")
    def _centres_aboard(self):
        for key in ("centre_of_gravity_m", "centre_of_buoyancy_m"):
            if max(map(abs, getattr(self, key))) > self.length_m:
                raise ValueError(f"{key} lies further than length_m from the origin")
        return self


class PropulsionSection(Section):
    """What all propulsion models share."""

    thrust_line_z_m: float = 0.0
    torque: tuple[float, float] = (0.0, 0.0)  # K_n1 in N m per rpm^2, K_n2 in N m s per (rpm m)

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:
        """b1 .. b9 and k0 (rpm per m/s).

        Parameters
        ----------
        body : BodySection
        speed : float
            At which trials begin, m/s.
        drag : float
            In straight flight at that speed, on (rho/2) l^2 speed^2.
        """
        raise NotImplementedError


class NoPropulsionSection(PropulsionSection):
    """The equation set has thrust and resistance in its own terms."""

    model: Literal["none"]

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """Nothing, and a propeller speed that means nothing."""
        return (0.0,) * 9, 1.0


class ThrustSection(PropulsionSection):
    """A known thrust and torque at a known propeller speed, of which they follow the square."""

    model: Literal["thrust"]
    thrust_n: Positive
    torque_nm: float = 0.0
    rpm: Positive

    @pydantic.model_validator(mode="after")
    def _one_torque(self):
        if any(self.torque):
            raise ValueError("give torque_nm, not torque")
        return self

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """Of the square of the propeller speed, backwards if that turns astern."""
        b = self.thrust_n / (0.5 * body.water_density_kgm3 * body.length_m**2 * speed**2)
        return (0.0, 0.0, b, 0.0, 0.0, b, 0.0, 0.0, -b), self.rpm / speed


class PolynomialSection(PropulsionSection):
    """Three branches in n' = n/(k0 u) (model manual, section 5)."""

    model: Literal["polynomial"] = "polynomial"
    b: Vector9
    rpm_per_mps: Positive

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """Those of the file."""
        return self.b, self.rpm_per_mps


class OpenWaterSection(PropulsionSection):
    """A propeller by its open-water diagram: T = (1 - t) rho D^4 K_T n|n|, n in rev/s (thesis section 3.7).

    k0 follows from self-propulsion: at n' = 1 the thrust is the straight-line drag. Going ahead (u >= 0) both models
    are polynomials in u and n, and are flown as such.
    """

    diameter_m: Positive
    thrust_deduction: float = pydantic.Field(default=0.0, ge=0.0, lt=1.0)

    @property
    def diagram(self) -> tuple[float, float, float]:
        """K_T without advance, its slope with J, and the wake fraction."""
        raise NotImplementedError

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """Those with which the boat propels itself at n' = 1."""
        scale = 2.0 * (1.0 - self.thrust_deduction) * self.diameter_m**4 / body.length_m**2
        offset, slope, wake = self.diagram
        # Self-propulsion with x = n/u in rev/m: scale (offset x^2 + slope (1 - wake) x / D) = drag.
        linear = slope * (1.0 - wake) / self.diameter_m
        x = (-linear + np.sqrt(linear**2 + 4.0 * offset * drag / scale)) / (2.0 * offset)
        square, cross = scale * offset * x**2, scale * linear * x
        return (0.0, cross, square, 0.0, cross, square, 0.0, -cross, -square), 60.0 * x


class ConstantKTSection(OpenWaterSection):
    """K_T does not depend on the advance (Healey & Lienard 1993; thesis C.1)."""

    model: Literal["constant_kt"]
    kt: Positive

    @property
    def diagram(self) -> tuple[float, float, float]:
        """K_T without advance, its slope with J, and the wake fraction."""
        return self.kt, 0.0, 0.0


class LinearKTSection(OpenWaterSection):
    """K_T = kt0 + kt1 J with J = (1 - w) u / (n D) (Fossen & Blanke 2000; thesis C.2)."""

    model: Literal["linear_kt"]
    kt0: Positive
    kt1: float = pydantic.Field(le=0.0)
    wake_fraction: float = pydantic.Field(default=0.0, ge=0.0, lt=1.0)

    @property
    def diagram(self) -> tuple[float, float, float]:
        """K_T without advance, its slope with J, and the wake fraction."""
        return self.kt0, self.kt1, self.wake_fraction


def _model_of(section) -> str | None:
    return section.get("model", "polynomial") if isinstance(section, dict) else getattr(section, "model", None)


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


def _as_section(entry):
    """A plain number is a coefficient without a standard deviation."""
    if isinstance(entry, dict | CoefficientSection):
        return entry
    number = isinstance(entry, int | float) and not isinstance(entry, bool)
    if not number or not abs(entry) < math.inf:
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
    hull: HullSection | None = None
    propulsion: Annotated[
        Annotated[PolynomialSection, pydantic.Tag("polynomial")]
        | Annotated[ConstantKTSection, pydantic.Tag("constant_kt")]
        | Annotated[LinearKTSection, pydantic.Tag("linear_kt")]
        | Annotated[ThrustSection, pydantic.Tag("thrust")]
        | Annotated[NoPropulsionSection, pydantic.Tag("none")],
        pydantic.Discriminator(_model_of),
    ]
    actuators: Annotated[
        Annotated[ActuatorsSection, pydantic.Tag("table")] | Annotated[ActuatorArray, pydantic.Tag("array")],
        pydantic.Discriminator(_table_or_array),
    ]
    coefficients: dict[str, Annotated[CoefficientSection, pydantic.BeforeValidator(_as_section)]]


@dataclass(frozen=True)
class Vehicle:
    """A vehicle in SI units and radians.

    Attributes
    ----------
    name : str
    description : str
    reference : str
        Where the numbers come from.
    length_m : float
    water_density_kgm3 : float
    speed_mps : float
        At which trials begin.
    depth_m : float
        At which trials begin.
    rpm_per_mps : float
        Propeller speed that self-propels, for a speed of 1 m/s.
    actuators : Actuators
        What moves the controls of the equations, and pushes from outside.
    body : (N_BODY,) array
        All else that moves the boat, in the order of :data:`bayesub.kernels.workspace.BODY`.
    xi : (n_terms,) array
        Coefficients in the order and the units of the equations.
    sd : (n_terms,) array
        Their standard deviations, not a number where the file gives none.
    equations : EquationSet
    hull : (3, n) array or None
        Positions from tail to nose, heights and breadths, m.
    """

    name: str
    description: str
    reference: str
    length_m: float
    water_density_kgm3: float
    speed_mps: float
    depth_m: float
    rpm_per_mps: float
    actuators: Actuators
    body: np.ndarray
    xi: np.ndarray
    sd: np.ndarray
    equations: EquationSet
    hull: np.ndarray | None = None

    def __post_init__(self):
        for array in (self.body, self.xi, self.sd):
            array.setflags(write=False)

    @cached_property
    def dimensional_factors(self) -> np.ndarray:
        """(n_terms,) what makes each coefficient dimensional."""
        return self.equations.factors(self.length_m, self.water_density_kgm3, self.speed_mps)

    @cached_property
    def constants(self) -> np.ndarray:
        """What the equations need besides coefficients and body (:meth:`EquationSet.constants`)."""
        return self.equations.constants(self.speed_mps, self.hull)

    def kernel_folder(self, subproblem: str | None = None) -> str:
        """Where the forces are for which the kernels are compiled."""
        return str(directory(self.equations, subproblem, self.actuators.external))

    def kernels(self, subproblem: str | None = None) -> families.Family:
        """The compiled kernels of the equations, with the terms of a sub-problem."""
        from bayesub.kernels import families  # importing numba takes a second

        return families.compiled(self.kernel_folder(subproblem))

    @property
    def mass_matrix(self) -> np.ndarray:
        """(6, 6) mass and added mass, kg, kg m and kg m^2 (model manual, section 6)."""
        return mass.mass_matrix(self.equations, self.xi * self.dimensional_factors, self.body)

    def restricted(self, subproblem: str | None) -> Vehicle:
        """The vehicle confined to a plane, without the coefficients and mechanical couplings of other motions.

        As in the model manual, section 4, the horizontal sub-problem drops products of inertia and all offsets of CG,
        CB and thrust line, and balances weight; the vertical one keeps the offsets in its own plane. None returns the
        vehicle itself. A boat of three degrees of freedom keeps xG, and has no weight that could pitch it.
        """
        subproblem = self.equations.subproblem(subproblem)
        if subproblem is None:
            return self
        idle = self.idle(subproblem)
        xi = np.where([name in idle for name in self.equations.names], 0.0, self.xi)
        body = {key: 0.0 if key in idle else value for key, value in zip(workspace.BODY, self.body, strict=True)}
        if subproblem == "horizontal" and self.equations.degrees_of_freedom == 6:
            body["weight"] = body["buoyancy"] = self.body[workspace.WEIGHT]
        return replace(self, xi=xi, body=np.array(list(body.values())))

    def idle(self, subproblem: str | None) -> frozenset[str]:
        """Names of the coefficients and of the entries of `body` that have no part in a sub-problem."""
        subproblem = self.equations.subproblem(subproblem)
        if subproblem is None:
            return frozenset()
        idle = {"Ixy", "Iyz", "Izx", "yG", "yB", "Kn1", "Kn2"}
        idle |= set(self.equations.names) - set(self.equations.active(subproblem=subproblem))
        if subproblem == "horizontal":
            idle |= {"zG", "xB", "zB", "zP", "weight", "buoyancy"}
            if self.equations.degrees_of_freedom == 6:
                idle |= {"xG"}
        return frozenset(idle)


def load_vehicle(name: str | Path, located: Callable[[str], str] = str) -> Vehicle:
    """Load a built-in vehicle by name or a vehicle file by path.

    Parameters
    ----------
    name : str or Path
        Built-in name, or path.
    located : callable
        Where a file is, by its path; a run folder has copies. By default there.

    Raises
    ------
    InputError
        With file, key and remedy.
    """
    path = toml_files.find(located(str(name)), "vehicles")
    lines = {line.partition("#")[0].strip() for line in toml_files.read_text(path).splitlines()}
    if {"[actuators]", "[[actuators]]"} <= lines:  # which TOML itself refuses in other words
        raise InputError(f"{path}: has both [actuators] and [[actuators]]; keep one of them")
    file = toml_files.read_toml(path, VehicleFile)
    with error_source(f"{path}: equations"):
        equations = load_equations(beside(str(name), file.equations), located)
    wrong = _misfit(file, equations)
    if wrong:
        raise InputError(f"{path}: {wrong}")
    try:
        with np.errstate(all="ignore"):
            vehicle = _built(file, equations)
            sizes = [*vehicle.body, *(vehicle.xi * vehicle.dimensional_factors), vehicle.rpm_per_mps]
            sizes += [*vehicle.actuators.wrenches(vehicle.actuators.rest[None], None)[0]]
    except OverflowError:
        sizes = [math.inf]
    if not np.isfinite(sizes).all() or not vehicle.rpm_per_mps > 0.0 or not vehicle.dimensional_factors.all():
        raise InputError(
            f"{path}: masses, forces or thrust are too large, too small or undefined; check the units in [body], that "
            "straight flight has a drag (a negative Xuu), and the size of the coefficients"
        )
    motion = mass.without_inertia(vehicle.mass_matrix, vehicle.length_m, equations.degrees_of_freedom)
    if motion:
        raise InputError(
            f"{path}: the mass matrix is singular: nothing resists an acceleration in {motion}; check mass and inertia "
            f"in [body] and the added masses {', '.join(equations.added_masses)}, which are negative on the diagonal"
        )
    return vehicle


def files_of_equations(name: str | Path, located: Callable[[str], str] = str) -> list[str]:
    """The paths of the equation files that a vehicle file names; its parameters are those of :func:`load_vehicle`."""
    table = toml_files.read_toml_table(toml_files.find(located(str(name)), "vehicles"))
    return equation_files(beside(str(name), str(table.get("equations", DEFAULT))), located)


def _misfit(file: VehicleFile, equations: EquationSet) -> str:
    """What the file has too much or lacks for its equations; empty if nothing."""
    for name in file.coefficients:
        if name not in equations.index:
            of = "" if equations.name == DEFAULT else f" of the equations '{equations.name}'"
            return f"coefficients: unknown coefficient '{name}'{of}{nearest(name, equations.names)}"
    missing = [name for name in equations.names if name not in file.coefficients]
    if missing:
        listed = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
        total = f"{len(missing)} of the {len(equations.names)} coefficients"
        return f"coefficients: {total} missing ({listed}); write 0 where there is none"
    if equations.has_crossflow and file.hull is None:
        return f"hull: is missing; the equations '{equations.name}' integrate the cross-flow along it"
    return actuator_files.misfit(file.actuators, equations, file.body.length_m)


def _built(file: VehicleFile, equations: EquationSet) -> Vehicle:
    body, trial, propulsion = file.body, file.trial, file.propulsion
    xi = np.array([file.coefficients[name].value for name in equations.names])
    hull = None if file.hull is None else np.array([file.hull.x_m, file.hull.height_m, file.hull.breadth_m])
    sds = {name: math.nan if section.sd is None else section.sd for name, section in file.coefficients.items()}
    weight = body.mass_kg * GRAVITY_MPS2
    thrust_factor = 0.5 * body.water_density_kgm3 * body.length_m**2
    kn1, kn2 = propulsion.torque
    drag = equations.drag(xi, body.length_m, body.water_density_kgm3, trial.speed_mps, hull)
    thrust, rpm_per_mps = propulsion.thrust(body, trial.speed_mps, drag)
    if isinstance(propulsion, ThrustSection):
        kn1 = propulsion.torque_nm / propulsion.rpm**2
    row = {
        "mass": body.mass_kg,
        **body.inertia_kgm2.model_dump(),
        **dict(zip(("xG", "yG", "zG"), body.centre_of_gravity_m, strict=True)),
        "weight": weight,
        "buoyancy": weight if body.buoyancy_n is None else body.buoyancy_n,
        **dict(zip(("xB", "yB", "zB"), body.centre_of_buoyancy_m, strict=True)),
        **{f"b{j}": b * thrust_factor for j, b in enumerate(thrust, start=1)},
        "zP": propulsion.thrust_line_z_m,
        "Kn1": kn1 * rpm_per_mps**2,
        "Kn2": kn2 * rpm_per_mps,
    }
    return Vehicle(
        name=file.name,
        description=file.description,
        reference=file.reference,
        length_m=body.length_m,
        water_density_kgm3=body.water_density_kgm3,
        speed_mps=trial.speed_mps,
        depth_m=trial.depth_m,
        rpm_per_mps=rpm_per_mps,
        actuators=actuator_files.build(file.actuators, equations, body.water_density_kgm3),
        body=np.array([row[key] for key in workspace.BODY]),
        xi=xi,
        sd=np.array([sds[key] for key in equations.names]),
        equations=equations,
        hull=hull,
    )
