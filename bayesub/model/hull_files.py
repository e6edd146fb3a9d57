"""Hull geometry files: outline of a boat and its fins, from which :mod:`bayesub.model.hulls` estimates coefficients.

Distances in a file count aft from the nose.
"""

from typing import Annotated, Literal

import numpy as np
import pydantic

from bayesub.io.toml_files import Length, Positive, Section, WaterDensity

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


class EllipsoidHull(Section):
    """An ellipsoid.

    Every shape says where its outline changes from one curve to the next, or is widest, from nose to end (`joints`),
    and how wide it is at distances aft of the nose (`half_widths`), all in m.
    """

    shape: Literal["ellipsoid"]
    length_m: Length
    beam_m: Length
    height_m: Length

    @property
    def joints(self) -> tuple[float, ...]:
        """Nose, middle and end."""
        return (0.0, 0.5 * self.length_m, self.length_m)

    def half_widths(self, aft: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Half the beam and half the height at distances `aft` of the nose."""
        fullness = np.sqrt(np.maximum(1.0 - (2.0 * aft / self.length_m - 1.0) ** 2, 0.0))
        return 0.5 * self.beam_m * fullness, 0.5 * self.height_m * fullness


class TorpedoHull(Section):
    """A cylinder between an elliptical nose and a parabolic tail."""

    shape: Literal["torpedo"]
    length_m: Length
    diameter_m: Length
    nose_m: Positive
    tail_m: Positive

    @pydantic.model_validator(mode="after")
    def _fits(self):
        if self.nose_m + self.tail_m > self.length_m:
            raise ValueError(f"nose_m and tail_m must not exceed length_m = {self.length_m:g} together")
        return self

    @property
    def joints(self) -> tuple[float, ...]:
        """Where nose, cylinder and tail begin and end."""
        return tuple(dict.fromkeys((0.0, self.nose_m, self.length_m - self.tail_m, self.length_m)))

    def half_widths(self, aft: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The radius at distances `aft` of the nose, twice."""
        nose = np.sqrt(np.maximum(1.0 - np.minimum(aft / self.nose_m - 1.0, 0.0) ** 2, 0.0))
        tail = 1.0 - np.maximum((aft - self.length_m) / self.tail_m + 1.0, 0.0) ** 2
        radius = 0.5 * self.diameter_m * np.maximum(np.minimum(nose, tail), 0.0)
        return radius, radius


class OffsetsHull(Section):
    """A body of revolution by its radii at stations, straight between them."""

    shape: Literal["offsets"]
    station_m: tuple[Annotated[float, pydantic.Field(le=1000.0)], ...] = pydantic.Field(min_length=2)
    radius_m: tuple[Annotated[float, pydantic.Field(ge=0.0, le=1000.0)], ...]

    @pydantic.model_validator(mode="after")
    def _fits(self):
        if self.station_m[0] != 0.0 or any(b <= a for a, b in zip(self.station_m, self.station_m[1:], strict=False)):
            raise ValueError("station_m must ascend from 0, the nose")
        if len(self.radius_m) != len(self.station_m) or max(self.radius_m) == 0.0:
            raise ValueError(f"radius_m needs {len(self.station_m)} radii, one a station, not all zero")
        return self

    @property
    def length_m(self) -> float:
        """Distance of the last station."""
        return self.station_m[-1]

    @property
    def joints(self) -> tuple[float, ...]:
        """The stations."""
        return self.station_m

    def half_widths(self, aft: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The radius at distances `aft` of the nose, twice."""
        radius = np.interp(aft, self.station_m, self.radius_m, right=0.0)
        return radius, radius


class FinsSection(Section):
    """Fins at one place along the hull: tips are distances from the axis, 0 where there is no fin."""

    name: str
    from_m: float = pydantic.Field(ge=0.0)
    to_m: float
    top_m: float = pydantic.Field(default=0.0, ge=0.0)
    bottom_m: float = pydantic.Field(default=0.0, ge=0.0)
    side_m: float = pydantic.Field(default=0.0, ge=0.0)

    @pydantic.model_validator(mode="after")
    def _fits(self):
        if not self.from_m < self.to_m:
            raise ValueError(f"fins '{self.name}': from_m must be less than to_m, both aft of the nose")
        if not max(self.top_m, self.bottom_m, self.side_m) > 0.0:
            raise ValueError(f"fins '{self.name}': give at least one of top_m, bottom_m, side_m")
        return self


class HullFile(Section):
    """The content of a hull geometry file."""

    description: str = ""
    water_density_kgm3: WaterDensity = 1025.0
    origin_m: float | None = None  # of the body axes, aft of the nose; if left out, the centre of buoyancy
    hull: Annotated[EllipsoidHull | TorpedoHull | OffsetsHull, pydantic.Field(discriminator="shape")]
    fins: tuple[FinsSection, ...] = ()

    @pydantic.field_validator("fins")
    @classmethod
    def _reach_out(cls, sections: tuple[FinsSection, ...], info: pydantic.ValidationInfo) -> tuple[FinsSection, ...]:
        if "hull" not in info.data:
            return sections
        for fins in sections:
            if fins.from_m >= info.data["hull"].length_m:
                raise ValueError(f"fins '{fins.name}': from_m is behind the hull, which ends at its length_m")
            at = nodes(fins.from_m, fins.to_m)[0]
            breadth, height = (radius.min() for radius in info.data["hull"].half_widths(at))
            for key, radius in (("top_m", height), ("bottom_m", height), ("side_m", breadth)):
                if 0.0 < getattr(fins, key) <= radius:
                    message = f"fins '{fins.name}': {key} must exceed the radius of the hull there, {radius:.3g}"
                    raise ValueError(message)
        return sections

    @pydantic.model_validator(mode="after")
    def _proportions(self):
        widest = 2.0 * max(np.max(radius) for radius in self.hull.half_widths(np.array(self.hull.joints)))
        if widest > self.hull.length_m:
            raise ValueError(f"hull: is {widest:g} m wide or high and {self.hull.length_m:g} m long; is one in mm?")
        if self.origin_m is not None and not 0.0 <= self.origin_m <= self.hull.length_m:
            raise ValueError(f"origin_m must lie on the hull, 0 to {self.hull.length_m:g}, found {self.origin_m:g}")
        return self


def nodes(first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights between two distances."""
    return 0.5 * (first + last) + 0.5 * (last - first) * _NODES, 0.5 * (last - first) * _WEIGHTS
