"""Propulsion in a vehicle file: thrust and torque as polynomials of three branches (model manual, section 5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
import pydantic

from bayesub.io.toml_files import Positive, Section

if TYPE_CHECKING:
    from bayesub.model.vehicle_files import BodySection

Vector9 = Annotated[tuple[float, ...], pydantic.Field(min_length=9, max_length=9)]


class PropulsionSection(Section):
    """Common base of the propulsion models."""

    thrust_line_z_m: float = 0.0
    torque: tuple[float, float] = (0.0, 0.0)  # K_n1 in N m per rpm^2, K_n2 in N m s per (rpm m)

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:
        """b1 .. b9 and k0 (rpm per m/s).

        Trials begin at the speed (m/s), at which the drag in straight flight is on (rho/2) l^2 speed^2.
        """
        raise NotImplementedError


class TurningSection(PropulsionSection):
    """A propeller whose thrust does not follow from its revolutions here, but terms of an equation set may."""

    rpm: Positive | None = None  # at the speed of trials

    def thrust(self, body: BodySection, speed: float, drag: float) -> tuple[tuple[float, ...], float]:  # noqa: ARG002
        """Nothing, and the propeller speed of the file, or one that means nothing."""
        return (0.0,) * 9, 1.0 if self.rpm is None else self.rpm / speed


class NoPropulsionSection(TurningSection):
    """The equation set has thrust and resistance in its own terms."""

    model: Literal["none"]


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


class MeasuredSection(TurningSection):
    """A thrust and a torque that logs have, in the columns ``thrust_n`` and ``torque_nm``.

    Without its column the thrust is that which balances the drag at the speed of trials.
    """

    model: Literal["measured"]
    thrust_deduction: float = pydantic.Field(default=0.0, ge=0.0, lt=1.0)
    handedness: Literal["right", "left"] = "right"

    COLUMNS: ClassVar[tuple[str, ...]] = ("thrust_n", "torque_nm")

    @pydantic.model_validator(mode="after")
    def _no_torque(self):
        if any(self.torque):
            raise ValueError("the torque is a column of the log, torque_nm; leave torque out")
        return self

    def wrenches(self, body: BodySection, speed: float, drag: float) -> Iterator[tuple[str, np.ndarray, float]]:
        """Column, (6,) forces of its unit, and value at rest; parameters as of :meth:`thrust`.

        The hull feels the torque the other way round: a right-handed propeller turns clockwise, seen from astern.
        """
        share = 1.0 - self.thrust_deduction
        balanced = 0.5 * body.water_density_kgm3 * (body.length_m * speed) ** 2 * drag / share
        side = -1.0 if self.handedness == "right" else 1.0
        thrust, torque = self.COLUMNS
        yield thrust, share * np.array([1.0, 0.0, 0.0, 0.0, self.thrust_line_z_m, 0.0]), balanced
        yield torque, side * np.eye(6)[3], 0.0


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


AnyPropulsion = Annotated[
    Annotated[PolynomialSection, pydantic.Tag("polynomial")]
    | Annotated[ConstantKTSection, pydantic.Tag("constant_kt")]
    | Annotated[LinearKTSection, pydantic.Tag("linear_kt")]
    | Annotated[ThrustSection, pydantic.Tag("thrust")]
    | Annotated[MeasuredSection, pydantic.Tag("measured")]
    | Annotated[NoPropulsionSection, pydantic.Tag("none")],
    pydantic.Discriminator(_model_of),
]
