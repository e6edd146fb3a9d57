"""Estimates of added masses from the geometry of a hull and its fins (thesis section 3.5.1).

Hull: displaced volume and inertia times Lamb's factors of the ellipsoid of the same length, beam and height, which is
strip theory with its correction for finite length. Fins: strips of the finned section less the bare one, corrected for
their span. Axes are those of the body, x forward, y to starboard, z down.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.model import added_mass
from bayesub.model.equations import EquationSet, Term
from bayesub.model.hull_files import FinsSection, HullFile, nodes

HULL_SD = 0.10  # relative: hulls against the ellipsoid of the same slenderness
FIN_SD = 0.30  # relative: strips and span correction; plates of aspect ratio one are known no better
ROLL_SD = 0.50  # relative: cruciform, plate and finned circle differ by this (thesis figure 5)
MUNK_SD = 0.50  # relative: fins and viscosity take away about half of the Munk moment
ROUND_OFF = 1e-14  # non-dimensional, of sums that vanish by symmetry; coefficients are above 1e-7
CENTRE_SD = 0.04  # of the length: where added mass is centred; Yrdot/Yvdot and the like are 0.007 to 0.065 if measured


@dataclass(frozen=True)
class CoefficientEstimate:
    """The estimate of one coefficient."""

    value: float  # non-dimensional
    sd: float  # standard deviation of the value
    source: str  # where they come from


class Hull:
    """A hull geometry that was read from a source, with what follows from it.

    At the nodes of integration `breadth` (n,) is half the beam and `height` (n,) half the height, m; the volume is in
    m^3, and the centre of buoyancy so far aft of the nose, m.
    """

    def __init__(self, file: HullFile, source: str = "geometry"):
        self.file, self.source = file, source
        pairs = zip(file.hull.joints, file.hull.joints[1:], strict=False)
        aft, weights = (np.concatenate(part) for part in zip(*(nodes(*pair) for pair in pairs), strict=True))
        self.breadth, self.height = file.hull.half_widths(aft)
        slices = weights * np.pi * self.breadth * self.height
        self.volume = float(slices.sum())
        self.centre = float(slices @ aft / self.volume)
        self._slices, self._from_centre = slices, self.centre - aft

    @property
    def origin(self) -> float:
        """Of the body axes, aft of the nose, m."""
        return self.centre if self.file.origin_m is None else self.file.origin_m

    @property
    def mass_kg(self) -> float:
        """Of the displaced water."""
        return self.file.water_density_kgm3 * self.volume

    @cached_property
    def displaced_inertia(self) -> np.ndarray:
        """(3,) moments of inertia of the displaced volume about its centre, m^5."""
        y, z, x = self.breadth**2 / 4.0, self.height**2 / 4.0, self._from_centre**2
        return np.array([self._slices @ (y + z), self._slices @ (x + z), self._slices @ (x + y)])

    def parts(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The parts of the added-mass matrix, each with its error of one standard deviation, all (6, 6) per density.

        Parts err independently, but what belongs to one part errs together, so that what vanishes by symmetry stays
        zero. The last part is nothing but an error, that of where the added mass of the hull is centred; the first, in
        surge, may be off by as much as a hull with the ends of Rankine's ovoid differs from an ellipsoid.
        """
        hull = self.file.hull
        widest = [2.0 * half.max() for half in hull.half_widths(np.array(hull.joints))]
        along, about = added_mass.ellipsoid(hull.length_m, *widest)
        surge, sway, heave = along * self.volume
        turning = np.diag([0.0, 0.0, 0.0, *about * self.displaced_inertia])
        ahead = np.diag([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        blunter = added_mass.long_ovoid(0.5 * np.sqrt(widest[0] * widest[1])) - surge
        parts = [(_crosswise(sway, heave, self.origin - self.centre), HULL_SD), (turning, HULL_SD)]
        for fins in self.file.fins:
            crosswise, rolling = self._fins(fins)
            parts += [(crosswise, FIN_SD), (rolling, ROLL_SD)]
        off_centre = _crosswise(sway, heave, CENTRE_SD * hull.length_m) - _crosswise(sway, heave, 0.0)
        off_centre[[4, 5], [4, 5]] = 0.0  # second order
        surging = surge * ahead, np.hypot(HULL_SD * surge, blunter) * ahead
        return [surging, *((part, sd * part) for part, sd in parts), (np.zeros((6, 6)), off_centre)]

    def _fins(self, fins: FinsSection) -> tuple[np.ndarray, np.ndarray]:
        """Contributions of fins to the added-mass matrix, by moving crosswise and by rolling."""
        aft, weights = nodes(fins.from_m, fins.to_m)
        x = self.origin - aft
        breadth, height = self.file.hull.half_widths(aft)
        chord = fins.to_m - fins.from_m
        sway = weights * self._strip(height, fins.top_m, fins.bottom_m, chord)
        heave = weights * self._strip(breadth, fins.side_m, fins.side_m, chord)
        # The centre of what each vertical fin adds is taken at half its span.
        above, below = (self._strip(height, tip, 0.0, chord) for tip in (fins.top_m, fins.bottom_m))
        offset = (below * (fins.bottom_m + height) - above * (fins.top_m + height)) / 2.0
        offset = np.where(above + below > 0.0, offset / np.maximum(above + below, 1e-300), 0.0)
        crosswise = sum((_crosswise(*masses) for masses in zip(sway, heave, x, strict=True)), start=np.zeros((6, 6)))
        rolling = np.zeros((6, 6))
        rolling[1, 3] = rolling[3, 1] = -(sway @ offset)
        rolling[3, 5] = rolling[5, 3] = -(sway @ (offset * x))
        rolling[3, 3] = weights @ [self._roll(fins, radius, chord) for radius in np.sqrt(breadth * height)]
        return crosswise, rolling

    @staticmethod
    def _strip(radius, first, second, chord):
        """Added mass per length of two opposite fins beyond that of the hull, corrected for their span."""
        span = 2.0 * np.maximum([first - radius, second - radius], 0.0).max(axis=0)
        bare = np.pi * radius**2
        return (added_mass.section(radius, first, second) - bare) * added_mass.finite_span(span, chord)

    @staticmethod
    def _roll(fins, radius, chord):
        """Roll added inertia per length; unequal fins of a cross count with the mean of their fourth powers."""
        span = 2.0 * max(max(fins.top_m, fins.bottom_m, fins.side_m) - radius, 0.0)
        if fins.side_m and (fins.top_m or fins.bottom_m):
            tip = np.mean(np.array([fins.top_m, fins.bottom_m, fins.side_m, fins.side_m]) ** 4) ** 0.25
            inertia = added_mass.cruciform_roll(radius, tip)
        elif fins.side_m:
            inertia = added_mass.section_roll(radius, fins.side_m, fins.side_m)
        else:
            inertia = added_mass.section_roll(radius, fins.top_m, fins.bottom_m)
        return inertia * added_mass.finite_span(span, chord)

    def estimates(self, equations: EquationSet) -> dict[str, CoefficientEstimate]:
        """Coefficient of a set -> estimate: added masses, what follows from them without speed ahead, Munk's moments.

        Where speed ahead makes lift (Yuv, Nur, ..) ideal fluid has little to say, and nothing is estimated. InputError
        if a number is not finite. They are not looked at before, because a geometry is checked without SciPy.
        """
        terms, density = equations.terms, self.file.water_density_kgm3
        values, variances = np.zeros(len(terms)), np.zeros(len(terms))
        munk = [_is_munk(term) for term in terms]
        try:
            with np.errstate(all="ignore"):
                for part, error in self.parts():
                    values += added_mass.coefficients_of(part, equations)
                    variances += added_mass.coefficients_of(error, equations) ** 2
                variances[munk] = (MUNK_SD * values[munk]) ** 2
                scale = density / equations.factors(self.file.hull.length_m, density, 1.0)  # none has a power of U
                values[np.abs(values * scale) < ROUND_OFF] = 0.0
                values, sds = values * scale, np.sqrt(variances) * scale
        except OverflowError:
            raise _extreme(self.source) from None
        estimated = [sd > ROUND_OFF and (m or "u" not in t.symbols) for t, m, sd in zip(terms, munk, sds, strict=True)]
        if not np.isfinite([values[estimated], sds[estimated]]).all():
            raise _extreme(self.source)
        return {
            terms[k].name: CoefficientEstimate(float(values[k]), float(sds[k]), _source(terms[k]))
            for k in np.flatnonzero(estimated)
        }


def _crosswise(sway: float, heave: float, x: float) -> np.ndarray:
    """Added-mass matrix (6, 6) of what is added at `x` on the axis to crosswise motion."""
    matrix = np.diag([0.0, sway, heave, 0.0, heave * x**2, sway * x**2])
    matrix[1, 5] = matrix[5, 1] = sway * x
    matrix[2, 4] = matrix[4, 2] = -heave * x
    return matrix


def _is_munk(term: Term) -> bool:
    """Whether a term is the moment of a body at an angle to the flow."""
    return (term.axis, *sorted(term.symbols)) in {("M", "u", "w"), ("N", "u", "v")} and len(term.parsed.factors) == 2


def _source(term: Term) -> str:
    if _is_munk(term):
        return "Munk moment in ideal fluid, before lift (Munk 1924)"
    if (term.axis, term.regressor) == ("X", "udot"):
        return "ellipsoid of the same slenderness (Lamb 1932, article 114)"
    if (term.axis, term.regressor) == ("K", "pdot"):
        return "finned sections (Newman 1977, table 4.3; thesis figure 5)"
    if not term.is_added_mass:
        return "follows from the added masses (Kirchhoff; Lamb article 124)"
    return "strips of hull and fins (Newman 1977, section 4.17), hull by Lamb's factors"


def load_hull(path: str | Path) -> Hull:
    """Read a hull geometry file; InputError with file, key and remedy."""
    try:
        with np.errstate(all="ignore"):
            hull = Hull(toml_files.read_toml(Path(path), HullFile), str(path))
            sizes = [hull.centre, *hull.displaced_inertia]
    except OverflowError:
        sizes = [np.inf]
    if not np.isfinite(sizes).all() or not hull.volume > 0.0:
        raise _extreme(str(path))
    return hull


def _extreme(source: str) -> InputError:
    message = f"{source}: volume or added masses are too large, too small or undefined; check the units"
    return InputError(message, "model")
