"""The examinations of a vehicle on paper: its mass matrix, and the sizes and signs of its coefficients."""

from dataclasses import dataclass, field
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from bayesub.io import toml_files
from bayesub.logs.log_files import ACCELERATIONS, VELOCITIES
from bayesub.model.equations import AXES, EquationSet, Term
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle, load_vehicle

ASYMMETRY = 0.5  # of the larger of two added masses that are one in ideal fluid
DECADE = 10.0  # either side of the built-in vehicles; most degrees for radians and wrong powers of length are outside
RADII = (0.15, 0.35)  # radius of gyration in pitch and yaw; a homogeneous cylinder has 0.29, an ellipsoid 0.22
AHEAD = {"u", "V", "U", "uc"}  # symbols that are positive in any flight ahead

built_in_vehicle = cache(load_vehicle)  # by name


@dataclass(frozen=True)
class CardWarning:
    """A finding that is unlike a boat, with its remedy."""

    text: str  # what is wrong, with the numbers that show it
    remedy: str  # what to look at


@dataclass(frozen=True)
class Examination:
    """One part of a card."""

    numbers: dict  # section of the card -> its content; None where there is none
    warnings: list[CardWarning] = field(default_factory=list)  # what is unlike a boat
    flights: dict[str, Trajectory] = field(default_factory=dict)  # what was flown
    skipped: dict[str, str] = field(default_factory=dict)  # section -> why the equations of the vehicle leave it out

    def warn(self, text: str, remedy: str) -> None:
        """Add a warning."""
        self.warnings.append(CardWarning(text, remedy))


def number_and_unit(value: float, term: Term) -> str:
    """The value of a coefficient, with the unit of a dimensional one."""
    return f"{value:.3g} {term.unit}" if term.unit else f"{value:.3g}"


def number_or_none(value: Any) -> float | None:
    """A float, or None for what is not finite."""
    return float(value) if np.isfinite(value) else None


def pairs(equations: EquationSet) -> list[tuple[Term, Term]]:
    """Added masses that are equal in ideal fluid: of force i by acceleration j, and of j by i; those of roll last."""
    terms = {(term.axis, term.regressor): term for term in equations.terms if term.is_added_mass}
    motions = dict(zip(AXES, ACCELERATIONS, strict=True))
    places = [((i, motions[j]), (j, motions[i])) for i, j in combinations(AXES, 2)]
    both = [(terms[one], terms[other]) for one, other in places if one in terms and other in terms]
    return sorted(both, key=lambda pair: "K" in (pair[0].axis, pair[1].axis))


def inertia(boat: Vehicle) -> Examination:
    """The mass matrix, symmetry of the added masses, and radii of gyration."""
    body, found = boat.rigid_body, Examination({})
    spatial = boat.equations.degrees_of_freedom == 6
    matrix = boat.mass_matrix if spatial else boat.mass_matrix[np.ix_([0, 1, 5], [0, 1, 5])]
    scale = np.sqrt(np.abs(np.diag(matrix)))
    symmetric = 0.5 * (matrix + matrix.T) / np.where(scale > 0.0, np.outer(scale, scale), 1.0)
    smallest = np.linalg.eigvalsh(symmetric)[0] if np.isfinite(symmetric).all() else np.nan
    differences = {}
    for one, other in pairs(boat.equations):
        k, j = boat.equations.columns([one.name, other.name])
        first, second = float(boat.xi[k]), float(boat.xi[j])
        alike = second * float(boat.dimensional_factors[j] / boat.dimensional_factors[k])  # on the scale of the first
        larger = max(abs(first), abs(alike))
        differences[f"{one.name}-{other.name}"] = difference = abs(first - alike) / larger if larger else 0.0
        if difference > ASYMMETRY:
            values = f"{one.name} = {number_and_unit(first, one)}, {other.name} = {number_and_unit(second, other)}"
            found.warn(
                f"the added-mass matrix is not symmetric: {values}",
                "in ideal fluid they are equal; use one for both, or their mean",
            )
    numbers: dict = {
        "smallest_eigenvalue_scaled": number_or_none(smallest),
        "positive_definite": bool(smallest > 0.0),
        "added_mass_differences": differences,
    }
    if not smallest > 0.0:
        example = next((t.name for t in boat.equations.terms if (t.axis, t.regressor) == ("Y", "vdot")), "")
        found.warn(
            "the mass matrix is not positive definite: some push would accelerate the boat backwards",
            f"added masses on the diagonal are negative{f' ({example} < 0)' if example else ''}; check the size of "
            "inertias and couplings",
        )
    moments = sorted((body["Ixx"], body["Iyy"], body["Izz"]))
    if spatial and moments[0] + moments[1] < moments[2] * (1.0 - 1e-9):
        found.warn(
            "the moments of inertia are not those of a body: one exceeds the sum of the others", "check their units"
        )
    rotations = ("Iyy", "Izz") if spatial else ("Izz",)
    radii = {key: np.sqrt(body[key] / body["mass"]) / boat.length_m for key in rotations}
    numbers["radii_of_gyration_lengths"] = {key: number_or_none(r) for key, r in radii.items()}
    for key, radius in radii.items():
        if not RADII[0] <= radius <= RADII[1]:
            found.warn(
                f"{key} is that of a radius of gyration of {radius:.2g} ship lengths, where hulls have "
                f"{RADII[0]:g} to {RADII[1]:g}",
                f"check mass_kg, length_m and {key} (kg m2)",
            )
    found.numbers["mass_matrix"] = numbers
    return found


def built_in_values(equations: EquationSet) -> dict[str, np.ndarray]:
    """Name of each built-in vehicle of a set -> (n_terms,) coefficients."""
    vehicles = {name: built_in_vehicle(name) for name in toml_files.built_in("vehicles")}
    return {name: boat.xi for name, boat in vehicles.items() if boat.equations == equations}


def typical_ranges(equations: EquationSet) -> np.ndarray:
    """Smallest and largest size of each coefficient in the built-in vehicles of a set.

    They are (n_terms, 2), not a number where all are zero, or no vehicle has these equations.
    """
    sizes = np.abs([*built_in_values(equations).values()]).reshape(-1, len(equations.terms))
    smallest = np.min(np.where(sizes > 0.0, sizes, np.inf), axis=0, initial=np.inf)
    largest = sizes.max(axis=0, initial=0.0)
    return np.where(np.isfinite(smallest)[:, None], np.stack([smallest, largest], axis=1), np.nan)


def negative(equations: EquationSet) -> dict[str, list[str]]:
    """Coefficients that are negative because their force takes energy from a boat that moves ahead, by kind."""
    terms = equations.terms
    return {
        "drag": [term.name for term in terms if _is_drag(term)],
        "damping": [term.name for term in terms if _is_damping(term)],
        "added mass": [term.name for term in terms if term.regressor == ACCELERATIONS[AXES.index(term.axis)]],
    }


def _is_drag(term: Term) -> bool:
    """Whether a surge force is against the motion ahead, whichever way controls are turned."""
    even = all(symbol in AHEAD or (power + sign) % 2 == 0 for symbol, power, sign in term.parsed.canonical)
    others = term.symbols & {*VELOCITIES, *ACCELERATIONS, "nu", "du", "duc"} - AHEAD
    return term.axis == "X" and bool(term.symbols) and even and not others


def _is_damping(term: Term) -> bool:
    """Whether a force is against the velocity of its own axis: by it, its powers, speed ahead, and nu for a force.

    In surge it is the force of the loss of speed. Of nu in a moment the sign is not certain: it grows with the drift.
    """
    own = "du" if term.axis == "X" else VELOCITIES[AXES.index(term.axis)]
    powers = {symbol: (power, sign) for symbol, power, sign in term.parsed.canonical}
    power, sign = powers.pop(own, (0, 0))
    if term.axis == "X" and (power, sign) != (1, 0):
        return False
    return (power + sign) % 2 == 1 and powers.keys() <= AHEAD | ({"nu"} if term.axis in "YZ" else set())


def _is_of_second_order(term: Term) -> bool:
    """Whether a force grows with products of velocities across the flight, so that it may hardly matter.

    Ships have such coefficients that are a hundredth of those of submarines: Xvr of a tanker, without the added mass
    that others count with it, is 0.0001 (Yasukawa & Yoshimura 2015), where built-in boats have 0.0098 to 0.02.
    """
    across = {*VELOCITIES, "nu"} - AHEAD
    return sum(power for symbol, power, _ in term.parsed.canonical if symbol in across) >= 2


def sizes_and_signs(boat: Vehicle) -> Examination:
    """Coefficients that are zero, of an unusual size, or of the wrong sign."""
    equations, found = boat.equations, Examination({})
    values = dict(zip(equations.names, boat.xi.tolist(), strict=True))
    axes = [axis for axis in AXES if equations.names_of_axis(axis)]
    zeros = {axis: [name for name in equations.names_of_axis(axis) if not values[name]] for axis in axes}
    ranges, sizes = typical_ranges(equations), np.abs(boat.xi)
    small = (sizes > 0.0) & (sizes < ranges[:, 0] / DECADE)
    small &= ~np.array([_is_of_second_order(term) for term in equations.terms])
    large = sizes > ranges[:, 1] * DECADE
    outside = np.flatnonzero(small | large)
    for k in outside:
        term, (low, high) = equations.terms[k], ranges[k]
        scale = f"in {term.unit}" if term.unit else f"non-dimensional on {term.scale}"
        found.warn(
            f"{term.name} = {number_and_unit(values[term.name], term)} is out of the ordinary: built-in boats have "
            f"{low:.2g} to {high:.2g}",
            f"check that it is {scale}, and per radian",
        )
    kinds = negative(equations)
    for what, names in kinds.items():
        if wrong := [name for name in names if values[name] > 0.0]:
            found.warn(
                f"{what} has the wrong sign: {', '.join(wrong)} positive", "it takes energy from the boat: negative"
            )
    if needed := [name for name in kinds["added mass"] if not values[name]]:
        found.warn(f"no added mass: {', '.join(needed)} zero", "estimate it: bayesub new vehicle NAME --geometry HULL")
    found.numbers["zero_coefficients"] = zeros
    found.numbers["outside_typical_range"] = [equations.names[k] for k in outside]
    return found
