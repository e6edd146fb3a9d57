"""Vehicles: the non-dimensional coefficients, the rigid body, the propulsion and the actuators, from a TOML file."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pydantic
from pydantic_core import PydanticCustomError

from bayesub.io import toml_files
from bayesub.io.errors import InputError, nearest
from bayesub.io.toml_files import Length, Positive, Section, Speed, WaterDensity
from bayesub.kernels import workspace
from bayesub.model import coefficients

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


class PolynomialSection(PropulsionSection):
    """Three branches in n' = n/(k0 u) (model manual, section 5)."""

    model: Literal["polynomial"] = "polynomial"
    b: Vector9
    rpm_per_mps: Positive

    def thrust(self, length: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """b1 .. b9 and k0 (rpm per m/s) for a boat of `length` (m) with the drag coefficient -Xuu."""
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

    def thrust(self, length: float, drag: float) -> tuple[tuple[float, ...], float]:
        """b1 .. b9 and k0 (rpm per m/s) for a boat of `length` (m) with the drag coefficient -Xuu."""
        scale = 2.0 * (1.0 - self.thrust_deduction) * self.diameter_m**4 / length**2
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


class ActuatorsSection(Section):
    """Dynamics and limits of rudder and planes."""

    rate_deg_s: Positive
    time_constant_s: Positive
    rudder_limit_deg: float = pydantic.Field(gt=0, le=90)
    plane_limit_deg: float = pydantic.Field(gt=0, le=90)


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
    trial: TrialSpeedSection
    body: BodySection
    propulsion: Annotated[
        Annotated[PolynomialSection, pydantic.Tag("polynomial")]
        | Annotated[ConstantKTSection, pydantic.Tag("constant_kt")]
        | Annotated[LinearKTSection, pydantic.Tag("linear_kt")],
        pydantic.Discriminator(_model_of),
    ]
    actuators: ActuatorsSection
    coefficients: dict[str, Annotated[CoefficientSection, pydantic.BeforeValidator(_as_section)]]

    @pydantic.field_validator("coefficients")
    @classmethod
    def _all_named(cls, sections: dict[str, CoefficientSection]) -> dict[str, CoefficientSection]:
        for name in sections:
            if name not in coefficients.INDEX:
                raise ValueError(f"unknown coefficient '{name}'{nearest(name, coefficients.NAMES)}")
        missing = [name for name in coefficients.NAMES if name not in sections]
        if missing:
            listed = ", ".join(missing[:5]) + (", ..." if len(missing) > 5 else "")
            raise ValueError(f"{len(missing)} of the 101 coefficients missing ({listed}); write 0 where there is none")
        return sections


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
    plane_rate_radps : float
    plane_time_constant_s : float
    plane_limits_rad : (3,) array
        Of rudder, bow plane and stern plane.
    body : (N_BODY,) array
        All else that moves the boat, in the order of :data:`bayesub.kernels.workspace.BODY`.
    xi : (101,) array
        Non-dimensional coefficients in the order of :data:`bayesub.model.coefficients.NAMES`.
    sd : (101,) array
        Their standard deviations, not a number where the file gives none.
    """

    name: str
    description: str
    reference: str
    length_m: float
    water_density_kgm3: float
    speed_mps: float
    depth_m: float
    rpm_per_mps: float
    plane_rate_radps: float
    plane_time_constant_s: float
    plane_limits_rad: np.ndarray
    body: np.ndarray
    xi: np.ndarray
    sd: np.ndarray

    def __post_init__(self):
        for array in (self.plane_limits_rad, self.body, self.xi, self.sd):
            array.setflags(write=False)

    @property
    def dimensional_factors(self) -> np.ndarray:
        """(rho/2) l^power of the 101 terms."""
        return coefficients.dimensional_factors(self.length_m, self.water_density_kgm3)

    def restricted(self, subproblem: str | None) -> "Vehicle":
        """The vehicle confined to a plane, without the coefficients and mechanical couplings of other motions.

        As in the model manual, section 4, the horizontal sub-problem drops products of inertia and all offsets of CG,
        CB and thrust line, and balances weight; the vertical one keeps the offsets in its own plane. None returns the
        vehicle itself.
        """
        if subproblem is None:
            return self
        idle = self.idle(subproblem)
        xi = np.where([name in idle for name in coefficients.NAMES], 0.0, self.xi)
        body = {key: 0.0 if key in idle else value for key, value in zip(workspace.BODY, self.body, strict=True)}
        if subproblem == "horizontal":
            body["weight"] = body["buoyancy"] = self.body[workspace.WEIGHT]
        return replace(self, xi=xi, body=np.array(list(body.values())))

    @staticmethod
    def idle(subproblem: str | None) -> frozenset[str]:
        """Names of the coefficients and of the entries of `body` that have no part in a sub-problem."""
        if subproblem is None:
            return frozenset()
        idle = {"Ixy", "Iyz", "Izx", "yG", "yB", "Kn1", "Kn2"}
        idle |= set(coefficients.NAMES) - set(coefficients.active_coefficients(subproblem=subproblem))
        if subproblem == "horizontal":
            idle |= {"xG", "zG", "xB", "zB", "zP", "weight", "buoyancy"}
        return frozenset(idle)


def load_vehicle(name: str | Path) -> Vehicle:
    """Load a built-in vehicle by name or a vehicle file by path.

    Raises
    ------
    InputError
        With file, key and remedy.
    """
    path = toml_files.find(str(name), "vehicles")
    file = toml_files.read_toml(path, VehicleFile)
    try:
        with np.errstate(all="ignore"):
            vehicle = _built(file)
            sizes = [*vehicle.body, *(vehicle.xi * vehicle.dimensional_factors), vehicle.rpm_per_mps]
    except OverflowError:
        sizes = [math.inf]
    if not np.isfinite(sizes).all() or not vehicle.rpm_per_mps > 0.0 or not vehicle.dimensional_factors.all():
        raise InputError(
            f"{path}: masses, forces or thrust are too large, too small or undefined; check the units in [body], the "
            "sign of Xuu (negative) and the size of the coefficients"
        )
    return vehicle


def _built(file: VehicleFile) -> Vehicle:
    body, trial, propulsion, actuators = file.body, file.trial, file.propulsion, file.actuators
    values = {name: section.value for name, section in file.coefficients.items()}
    sds = {name: math.nan if section.sd is None else section.sd for name, section in file.coefficients.items()}
    weight = body.mass_kg * GRAVITY_MPS2
    thrust_factor = 0.5 * body.water_density_kgm3 * body.length_m**2
    kn1, kn2 = propulsion.torque
    thrust, rpm_per_mps = propulsion.thrust(body.length_m, -values["Xuu"])
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
    limits = (actuators.rudder_limit_deg, actuators.plane_limit_deg, actuators.plane_limit_deg)
    return Vehicle(
        name=file.name,
        description=file.description,
        reference=file.reference,
        length_m=body.length_m,
        water_density_kgm3=body.water_density_kgm3,
        speed_mps=trial.speed_mps,
        depth_m=trial.depth_m,
        rpm_per_mps=rpm_per_mps,
        plane_rate_radps=np.radians(actuators.rate_deg_s).item(),
        plane_time_constant_s=actuators.time_constant_s,
        plane_limits_rad=np.radians(limits),
        body=np.array([row[key] for key in workspace.BODY]),
        xi=np.array([values[key] for key in coefficients.NAMES]),
        sd=np.array([sds[key] for key in coefficients.NAMES]),
    )
