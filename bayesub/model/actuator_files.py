"""The actuators of a vehicle file: the table ``[actuators]``, or an array ``[[actuators]]`` of fins and propellers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pydantic

from bayesub.io.errors import InputError, nearest
from bayesub.io.toml_files import Positive, Section
from bayesub.logs.log_files import COLUMNS, CONTROL_COLUMNS, si_factor
from bayesub.model.actuator import ANOMALY, GRAVITY_MPS2, PRESSURE, Actuator, WaterColumn
from bayesub.model.actuators import AILERON, Actuators
from bayesub.model.equations import AXES, EquationSet

RUDDER, BOW_PLANE, STERN_PLANE, *_ = CONTROL_COLUMNS
RAW_UNITS = ("counts", "percent", "us")  # of columns as a computer commands them; us are microseconds
VOLUME, COMPRESSIBILITY = "volume", "compressibility"  # of the hull; names of parameters begin with scale_
_SNAPPED = 1e-9  # sines and cosines of right angles

Vector3 = Annotated[tuple[float, float, float], pydantic.Field(description="three numbers")]
Limit = Annotated[float, pydantic.Field(gt=0, le=90)]
Name = Annotated[str, pydantic.Field(pattern=r"^[a-z][a-z0-9_]*$")]


class ActuatorsSection(Section):
    """Dynamics and limits of rudder and planes, which are the controls of the equations themselves."""

    rate_deg_s: Positive
    time_constant_s: Positive
    rudder_limit_deg: Limit
    plane_limit_deg: Limit | None = None


class DisplacementSection(Section):
    """A hull whose buoyancy follows the density and the pressure of the water that a log has."""

    # Share of the volume that a bar of pressure takes away.
    compressibility_per_bar: float = pydantic.Field(default=0.0, ge=0.0, le=0.01)


class ActuatorSection(Section):
    """Keys of all kinds of ``[[actuators]]``."""

    name: Name
    column: str | None = None
    sign: Literal[1, -1] = 1
    zero: float = 0.0  # of the column, where it does nothing

    UNIT: ClassVar[str] = ""

    @property
    def unit(self) -> float | None:
        """SI units in one unit of a column of counts and the like, if the file says it."""
        unit = getattr(self, f"unit_{self.UNIT}", None)
        return np.radians(unit).item() if unit is not None and self.UNIT == "deg" else unit

    @property
    def header(self) -> str:
        """Its column of a log."""
        return f"{self.name}_{self.UNIT}" if self.column is None else self.column

    @pydantic.model_validator(mode="after")
    def _column_of_its_own(self):
        header = self.header
        if self.zero and self.UNIT == "rpm":
            raise ValueError("a propeller has no zero; leave it out")
        units = self.UNIT if self.unit is None else "|".join(RAW_UNITS)
        if not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]*_({units})", header):
            if header.rpartition("_")[2] in RAW_UNITS and self.UNIT != "rpm":
                raise ValueError(f"column '{header}': give unit_{self.UNIT}, how much one unit of it is")
            raise ValueError(f"column '{header}' does not end with the unit of the actuator; write it as ..._{units}")
        if header in COLUMNS and header not in CONTROL_COLUMNS:
            raise ValueError(f"column '{header}' is that of the motion of the boat; choose another")
        return self


class FinSection(ActuatorSection):
    """A control surface by its angle, positive with the trailing edge moved counterclockwise, seen from astern."""

    kind: Literal["fin"]
    x_m: float | None = None
    angle_deg: float | None = pydantic.Field(default=None, ge=-360.0, le=360.0)
    limit_deg: Limit
    rate_deg_s: Positive
    time_constant_s: Positive
    mixing: dict[str, float] | None = None
    unit_deg: Positive | None = None

    UNIT: ClassVar[str] = "deg"

    @pydantic.model_validator(mode="after")
    def _mixed_somehow(self):
        if self.mixing is None and self.angle_deg is None:
            raise ValueError("a fin needs angle_deg, where it stands around the hull, or mixing")
        if self.mixing is None and (self.x_m or 0.0) > 0.0:
            text = f"x_m = {self.x_m:g} is ahead of the origin, where an angle says no control"
            raise ValueError(f"{text}; give mixing, such as {{ {BOW_PLANE} = 0.5 }}")
        if self.mixing is not None and not any(self.mixing.values()):
            raise ValueError("mixing is zero throughout, so that the fin does nothing")
        return self

    @property
    def shares(self) -> dict[str, float]:
        """What a unit angle does to each control: as its mixing says, or in proportion by where it stands.

        By where it stands it is the force on that of the fin of a positive control.
        """
        if self.mixing is not None or self.angle_deg is None:
            return self.mixing or {}
        angle = np.radians(self.angle_deg)
        parts = {RUDDER: np.cos(angle), STERN_PLANE: -np.sin(angle), AILERON: 1.0}
        return {column: 0.0 if abs(part) < _SNAPPED else float(part) for column, part in parts.items()}


class PushingSection(ActuatorSection):
    """An actuator that pushes along an axis at a place."""

    position_m: Vector3
    direction: Vector3

    @pydantic.model_validator(mode="after")
    def _directed(self):
        if not any(self.direction):
            raise ValueError("direction has no length; give the axis along which a positive value pushes, as [0, 1, 0]")
        return self

    @property
    def axis(self) -> np.ndarray:
        """(3,) unit vector along which a positive value pushes."""
        direction = np.array(self.direction) / np.abs(self.direction).max()
        return direction / np.linalg.norm(direction)

    @property
    def push(self) -> np.ndarray:
        """(6,) forces and moments of 1 N."""
        return np.concatenate([self.axis, np.cross(self.position_m, self.axis)])


class ThrusterSection(PushingSection):
    """A thruster by its force, positive along its direction."""

    kind: Literal["thruster"]
    limit_n: Positive | None = None
    unit_n: Positive | None = None

    UNIT: ClassVar[str] = "n"

    def build(self, n_controls: int, _water_density_kgm3: float) -> Actuator:
        """The actuator."""
        limit = np.inf if self.limit_n is None else self.limit_n
        return _actuator(self.header, np.zeros(n_controls), self.name, limit=limit, force=self.sign * self.push)


class PropellerSection(PushingSection):
    """A propeller by its revolutions: K_T and K_Q linear in the advance ratio (model manual, section 5)."""

    kind: Literal["propeller"]
    direction: Vector3 = (1.0, 0.0, 0.0)
    rpm: float  # at the speed of trials
    limit_rpm: Positive | None = None
    diameter_m: Positive
    kt0: Positive
    kt1: float = pydantic.Field(default=0.0, le=0.0)
    kq0: float = pydantic.Field(default=0.0, ge=0.0)
    kq1: float = pydantic.Field(default=0.0, le=0.0)
    wake_fraction: float = pydantic.Field(default=0.0, ge=0.0, lt=1.0)
    thrust_deduction: float = pydantic.Field(default=0.0, ge=0.0, lt=1.0)
    handedness: Literal["right", "left"] = "right"

    UNIT: ClassVar[str] = "rpm"

    def build(self, n_controls: int, water_density_kgm3: float) -> Actuator:
        """The actuator.

        The advance is along its axis, by the surge velocity alone. The hull feels the torque of the shaft the other way
        round: a right-handed propeller turns clockwise, seen along its direction, and the hull counterclockwise.
        """
        square = water_density_kgm3 * self.diameter_m**4 / 3600.0  # n in rev/s, the column in rev/min
        advance = water_density_kgm3 * self.diameter_m**3 * (1.0 - self.wake_fraction) * self.axis[0] / 60.0
        push = (1.0 - self.thrust_deduction) * self.push
        side = -1.0 if self.handedness == "right" else 1.0
        reaction = side * self.diameter_m * np.append(np.zeros(3), self.axis)
        return _actuator(
            self.header,
            np.zeros(n_controls),
            self.name,
            rest=self.rpm,
            limit=np.inf if self.limit_rpm is None else self.limit_rpm,
            force_of_square=self.sign * square * (self.kt0 * push + self.kq0 * reaction),
            force_of_speed=advance * (self.kt1 * push + self.kq1 * reaction),
        )


class BallastSection(ActuatorSection):
    """A ballast pump or tank by its lift in N, or in a log by the volume that it displaces, ``NAME_cm3``."""

    kind: Literal["ballast"]
    position_m: Vector3 = (0.0, 0.0, 0.0)

    UNIT: ClassVar[str] = "n"

    def build(self, n_controls: int, water_density_kgm3: float) -> Actuator:
        """The actuator."""
        weight = -self.sign * np.array([1.0, *self.position_m])
        water = WaterColumn(f"{self.header.removesuffix('_n')}_cm3", water_density_kgm3)
        return _actuator(self.header, np.zeros(n_controls), self.name, weight=weight, water=water)


class SlidingMassSection(ActuatorSection):
    """A mass that slides, by its way from where the centre of gravity of the vehicle file has it."""

    kind: Literal["sliding_mass"]
    mass_kg: Positive
    direction: Vector3 = (1.0, 0.0, 0.0)

    UNIT: ClassVar[str] = "m"

    def build(self, n_controls: int, _water_density_kgm3: float) -> Actuator:
        """The actuator, whose inertia stays where it was."""
        way = np.array(self.direction) / np.linalg.norm(self.direction)
        weight = self.sign * self.mass_kg * GRAVITY_MPS2 * np.append(0.0, way)
        return _actuator(self.header, np.zeros(n_controls), self.name, weight=weight)


AnyActuator = Annotated[
    FinSection | ThrusterSection | PropellerSection | BallastSection | SlidingMassSection,
    pydantic.Field(discriminator="kind"),
]
ActuatorArray = tuple[AnyActuator, ...]


def check_fit(
    section: ActuatorsSection | tuple, equations: EquationSet, length_m: float, displaced: bool = False
) -> None:
    """InputError for what is wrong with the actuators of a boat of a length with these equations.

    `displaced` says whether the buoyancy of its hull follows the water.
    """
    if isinstance(section, ActuatorsSection):
        others = [c.column for c in equations.controls if c.column.endswith("_deg") and c.column != RUDDER]
        if displaced:
            raise InputError("displacement: needs [[actuators]] in place of [actuators]", "conflict", "displacement")
        if others and section.plane_limit_deg is None:
            text = f"actuators: plane_limit_deg is missing; the equations '{equations.name}' have {', '.join(others)}"
            raise InputError(text, "missing", "actuators.plane_limit_deg")
        return
    if not section:
        message = "actuators: there are none; add [[actuators]], or give the table [actuators]"
        raise InputError(message, "missing", "actuators")
    for key in ("name", "header"):
        values = [getattr(one, key) for one in section]
        repeated = next((value for value in values if values.count(value) > 1), None)
        if repeated is not None:
            text = f"actuators: two have the {'column' if key == 'header' else key} '{repeated}'; give one another"
            raise InputError(text, "conflict", repeated)
    of_equations = {control.column for control in equations.controls}
    known = of_equations | {RUDDER, BOW_PLANE, STERN_PLANE, AILERON}
    for one in section:
        where = f"actuators: {one.kind} '{one.name}'"
        if displaced and one.name in (VOLUME, COMPRESSIBILITY):
            message = f"{where}: the name is that of the hull's {one.name}; give it another"
            raise InputError(message, "conflict", one.name)
        if one.kind == "fin":
            for column in one.mixing or ():
                if column not in known or not column.endswith("_deg"):
                    message = f"{where}: mixing knows no control '{column}'{nearest(column, known)}"
                    raise InputError(message, "unknown", column)
            if not any(share for column, share in one.shares.items() if column in of_equations):
                raise InputError(f"{where}: moves no control of the equations '{equations.name}'", "model", one.name)
        elif one.header in of_equations:
            text = f"{where}: column '{one.header}' is a control of the equations; leave the actuator out or rename it"
            raise InputError(text, "conflict", one.header)
        elif max(map(abs, getattr(one, "position_m", (0.0,)))) > length_m:
            raise InputError(f"{where}: position_m lies further than length_m from the origin", "value", "position_m")


def build(
    section: ActuatorsSection | tuple,
    equations: EquationSet,
    water_density_kgm3: float,
    rpm: float,
    hull: tuple[Actuator, ...] = (),
    forces: Iterable[tuple[str, np.ndarray, float]] = (),
) -> Actuators:
    """The actuators of a vehicle file, which fit its equations (:func:`check_fit`).

    A control that is the propeller speed rests at `rpm`, with which the boat propels itself. Those of a `hull` whose
    buoyancy follows the water come after, and last one for each column of a log that is a force or a moment from
    outside: `forces` are the column, (6,) forces and moments of its unit, and its value at rest.
    """
    columns = [control.column for control in equations.controls]
    still = np.zeros(len(columns))
    pushing = [_actuator(column, still, force=force, rest=rest) for column, force, rest in forces]
    if isinstance(section, ActuatorsSection):
        return Actuators((*_planes(section, equations, rpm), *pushing), equations, direct=not pushing)
    mixing = _mixing(section, columns)
    members = []
    for one, row in zip(section, mixing, strict=True):
        if one.kind == "fin":
            limit, rate = np.radians([one.limit_deg, one.rate_deg_s]).tolist()
            dynamics = {"limit": limit, "rate": rate, "time_constant": one.time_constant_s}
            turns = one.sign if one.mixing is None else 0
            members.append(_actuator(one.header, row, one.name, **dynamics, angle_deg=one.angle_deg, turns=turns))
        else:
            members.append(one.build(len(columns), water_density_kgm3))
        if one.zero or one.unit is not None:
            unit, si = (1.0, si_factor(one.header)) if one.unit is None else (one.unit, 1.0)
            members[-1] = members[-1].by_column(one.header, unit, one.zero * si)
    # What is no angle and no actuator moves is what the log says it is.
    for column, row, parts in zip(columns, np.eye(len(columns)), mixing.T, strict=True):
        if not (parts.any() or column.endswith("_deg")):
            members.append(_actuator(column, row, rest=rpm if column == "rpm" else 0.0))
    return Actuators((*members, *hull, *pushing), equations)


def hull_members(
    displacement: DisplacementSection, buoyancy_n: float, centre: Vector3, water_density_kgm3: float, n_controls: int
) -> tuple[Actuator, ...]:
    """What the density and the pressure of the water do to the buoyancy of a hull (model manual, equation 3.8)."""
    lift, still = -buoyancy_n * np.array([1.0, *centre]), np.zeros(n_controls)
    water = WaterColumn(None, water_density_kgm3)
    return (
        _actuator(ANOMALY, still, VOLUME, weight=lift / water_density_kgm3, water=water),
        _actuator(PRESSURE, still, COMPRESSIBILITY, weight=-lift * displacement.compressibility_per_bar),
    )


def _planes(section: ActuatorsSection, equations: EquationSet, rpm: float) -> Iterator[Actuator]:
    """An actuator for each control of the equations; what is no angle answers at once and has no limit."""
    for control, row in zip(equations.controls, np.eye(len(equations.controls)), strict=True):
        dynamics: dict[str, float] = {}
        if control.column.endswith("_deg"):
            limit = section.rudder_limit_deg if control.column == RUDDER else section.plane_limit_deg or np.nan
            dynamics |= {"limit": np.radians(limit).item(), "rate": np.radians(section.rate_deg_s).item()}
            dynamics["time_constant"] = section.time_constant_s
        yield _actuator(control.column, row, rest=rpm if control.column == "rpm" else 0.0, **dynamics)


def _actuator(column: str, mixing: np.ndarray, name: str | None = None, /, **parts: Any) -> Actuator:
    """An actuator without forces but those given; its name is by default that of the column without the unit."""
    forces = dict.fromkeys(("force", "force_of_square", "force_of_speed"), np.zeros(len(AXES)))
    return Actuator(name or column.rpartition("_")[0] or column, column, mixing=mixing, **(forces | parts))


def _mixing(section: ActuatorArray, columns: Sequence[str]) -> np.ndarray:
    """(n_actuators, n_controls) what a unit angle of each adds to the controls.

    By geometry a control is the angle of fins that all stood in its plane and made the same forces: the forces of the
    fins along its direction, each in proportion to its angle, over those of the fins at the angles that it orders.
    """
    mixing = np.zeros((len(section), len(columns)))
    fins = {i: one for i, one in enumerate(section) if isinstance(one, FinSection)}
    for j, column in enumerate(columns):
        size = sum(fin.shares.get(column, 0.0) ** 2 for fin in fins.values() if fin.mixing is None)
        for i, fin in fins.items():
            if column in fin.shares:
                share = fin.shares[column]
                mixing[i, j] = fin.sign * (share / size if fin.mixing is None and share else share)
    return mixing
