"""The coefficients of a boat as other simulators take them, and what it costs to leave out those that they do not take.

Each simulator has a template in the folder `simulators`, which says program, formula and axes. It asks the boat for the
terms that have a counterpart there, by their regressors, whatever equations the boat has; the other terms are named in
the file with the reason, and with the metres by which the track changes without them.
"""

import html
import re
from collections.abc import Sequence
from contextlib import suppress
from importlib import metadata
from typing import Any

import numpy as np

from bayesub.design.knowledge import Knowledge
from bayesub.io import templates
from bayesub.io.errors import InputError, printable
from bayesub.io.words import listed, matlab
from bayesub.logs.log_files import VELOCITIES
from bayesub.model.added_mass import products_of
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import Term
from bayesub.model.equations.regressors import parse
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import Vehicle, mass_matrix

STANDARD = ("turning_circle", "vertical", "coupled", "zigzag_20_20", "zigzag_10_10")  # the first three of a boat count
_SAMPLES = 500  # output times of a manoeuvre
_NOTHING = 1e-12  # of the largest added mass: round-off in a parameter
_COLUMNS = {"dr": "rudder_deg", "ds": "stern_plane_deg", "db": "bow_plane_deg"}
_TURNED = dict(zip(VELOCITIES, (1.0, -1.0, -1.0) * 2, strict=True))  # to axes forward, left and up
Row = dict[str, Any]  # a term: its name under "from", regressor and scale, its own value, and value and sd elsewhere
Losses = dict[str, list[float]]  # name of a term -> how far the boat is from its track without it; "" without all


class Boat:
    """The numbers of a boat with means and sds of its coefficients, and which terms a template has taken.

    `known`: of some coefficients; the others have the values of the vehicle. `lost`: their :func:`losses`.
    """

    def __init__(self, vehicle: Vehicle, known: Knowledge, lost: Losses | None = None):
        self.vehicle, self.equations, self.lost = vehicle, vehicle.equations, lost or {}
        self.xi, self.sd = vehicle.xi.copy(), vehicle.sd.copy()
        places = self.equations.columns(known.names)
        self.xi[places], self.sd[places] = known.mean, known.sd
        self.rigid_mass = mass_matrix(self.equations, np.zeros(len(self.xi)), vehicle.body)
        dimensional = self.xi * vehicle.dimensional_factors
        self._added_mass = mass_matrix(self.equations, dimensional, vehicle.body) - self.rigid_mass
        self.taken: set[str] = set()

    @property
    def added_mass(self) -> np.ndarray:
        """(6, 6) of the water, kg, kg m and kg m^2; who asks for it takes its terms."""
        self.taken |= set(self.equations.added_masses)
        return self._added_mass

    def take(self, axis: str, *regressors: str, by: float = 1.0, prime: bool = False) -> Row | None:
        """The term with the first of some regressors, in dr, ds and db, that the equations have; None without one.

        Value and sd are multiplied by a number, and with `prime` non-dimensional by length and density alone.
        """
        symbols = {control.column: control.symbol for control in self.equations.controls}
        for parts in (regressor.split("*") for regressor in regressors):
            if all(_COLUMNS.get(part) in (None, *symbols) for part in parts):
                own = "*".join(symbols[_COLUMNS[part]] if part in _COLUMNS else part for part in parts)
                if term := self.equations.find(axis, parse(own, symbols.values())):
                    self.taken.add(term.name)
                    return self._row(term, by, prime=prime)
        return None

    def named(self, table: dict[str, str]) -> list[Row]:
        """The terms of a table that the equations have: axis -> ``regressor=name:factor``, without dimension."""
        rows = []
        for axis, entries in table.items():
            for regressor, name, factor in (re.split("[=:]", f"{entry}:1")[:3] for entry in entries.split()):
                if row := self.take(axis, *regressor.split("|"), by=float(factor), prime=True):
                    row |= {"name": name if name[0].isupper() else axis + name, "scale": f"r{row['power']}"}
                    rows.append(row | {"regressor": f"{'-' * (factor == '-1')}{row['regressor']}"})
        return rows

    def gazebo(self) -> tuple[np.ndarray, list[Row]]:
        """What gz-sim has, in axes forward, left and up: the added mass (6, 6), and the parameters of its plugin.

        To the added mass, which is symmetric, the engine adds its products of speeds in an ideal fluid: they are taken
        off here. The plugin has velocities, and products of two of which the second may be its size.
        """
        turned, rows = np.array([*_TURNED.values()]), {}
        matrix = self.added_mass * np.outer(turned, turned)
        fluid = 0.5 * (matrix + matrix.T)
        for term in self.equations.terms:
            factors = sorted(term.parsed.canonical, key=lambda one: (one[2], one[0]))
            letters = [symbol for symbol, power, _ in factors for _ in range(power)]
            sizes = sum(odd for *_, odd in factors)
            if sizes < len(letters) <= 2 and set(letters) <= set(_TURNED) and all(power > 0 for _, power, _ in factors):
                self.taken.add(term.name)
                signs = [turned[AXES.index(term.axis)], *(_TURNED[one] for one in letters[: len(letters) - sizes])]
                name = term.axis.lower() + ("abs" if sizes else "").join(letter.upper() for letter in letters)
                rows[name] = self._row(term, float(np.prod(signs))) | {"name": name}
        for (i, j, k), force in np.ndenumerate(products_of(fluid)):
            name = AXES[k].lower() + "".join(sorted((VELOCITIES[i], VELOCITIES[j]))).upper()
            row = rows.setdefault(name, {"name": name, "from": "added mass", "value": 0.0, "sd": None})
            row["value"] -= float(force)
        for (k, j), rest in np.ndenumerate(fluid - matrix):
            name = f"{AXES[k].lower()}Dot{VELOCITIES[j].upper()}"
            rows[name] = {"name": name, "from": "added mass, not symmetric", "value": float(rest), "sd": None}
        return fluid, [row for row in rows.values() if abs(row["value"]) > _NOTHING * np.abs(matrix).max()]

    def others(self, reasons: dict[str, str]) -> list[Row]:
        """The terms that are not zero and were not taken, the dearest first.

        `reasons`: by a symbol or function in the regressor, "control" for any control, and "" for any other term.
        """
        rows, controls = [], {control.symbol for control in self.equations.controls}
        for term, x in zip(self.equations.terms, self.xi, strict=True):
            if x and term.name not in self.taken:
                words = {*term.symbols, *(f.function for f in term.parsed.factors)}
                words.add("control" if term.symbols & controls else "")
                why = next((reason for word, reason in reasons.items() if word in words), reasons[""])
                rows.append(self._row(term) | {"why": why, "metres": self.metres(term.name)})
        return sorted(rows, key=lambda row: -np.nan_to_num(max(self.lost.get(row["from"], [0.0])), nan=np.inf))

    def metres(self, name: str = "") -> str:
        """What it costs to leave out a term, or all, on each manoeuvre."""
        return ", ".join(f"{far:.2g}" if np.isfinite(far) else "fails" for far in self.lost.get(name, []))

    def spatial(self, kind: str) -> str:
        """Nothing; InputError for a boat of which a simulator of bodies in space cannot add the rigid body."""
        if self.equations.degrees_of_freedom == 3 or self.equations.rigid_body_terms == "in_coefficients":
            what = f"--as {kind}: adds the rigid body in six degrees of freedom; the equations '{self.equations.name}'"
            raise InputError(f"{what} have three, or hold it in coefficients; choose mss", "conflict", "--as")
        return ""

    def _row(self, term: Term, by: float = 1.0, *, prime: bool = False) -> Row:
        k, vehicle = self.equations.index[term.name], self.vehicle
        dimensions = {control.symbol: control.dimension for control in self.equations.controls}
        power = (4 if term.axis in "XYZ" else 5) - term.parsed.dimension(dimensions)[0]
        size = by * vehicle.dimensional_factors[k]
        if prime:
            size /= 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**power
        sd = float(abs(self.sd[k] * size)) if np.isfinite(self.sd[k]) else None
        row = {"from": term.name, "regressor": term.regressor, "scale": term.scale, "power": power}
        return row | {"own": float(self.xi[k]), "value": float(self.xi[k] * size), "sd": sd}


def standard(vehicle: Vehicle) -> list[Manoeuvre]:
    """The first three manoeuvres of STANDARD that a boat can fly; none of a boat without rudder."""
    found = []
    for name in STANDARD:
        with suppress(InputError):  # a control or a plane that the boat does not have
            found.append(load_manoeuvre(name, vehicle))
    return found[:3]


def losses(kind: str, boat: Boat, manoeuvres: Sequence[Manoeuvre]) -> Losses:
    """Name of a term without counterpart -> how far (m) the boat is from its track, at most, without it.

    A number for each manoeuvre, not a number where the boat does not fly it to its end; "" is without all these terms.
    """
    written(kind, boat, "")
    names = [row["from"] for row in boat.others({"": ""})]
    xi = np.tile(boat.xi, (len(names) + 2, 1))  # the last but one without all, the last with all
    places, far = boat.equations.columns(names), []
    xi[np.arange(len(names)), places] = xi[-2, places] = 0.0
    for one in manoeuvres:
        tracks = simulate(boat.vehicle, one, xi=xi, sample=one.duration / _SAMPLES).states[:, :, :3]
        far.append(np.linalg.norm(tracks[:-1] - tracks[-1], axis=2).max(axis=1))
    return dict(zip([*names, ""], np.transpose(far).tolist(), strict=True))


def written(kind: str, boat: Boat, source: str, manoeuvres: Sequence[Manoeuvre] = ()) -> str:
    """The file of a simulator: "mss", "mss-json", "pvs", "gazebo", "stonefish" or "holoocean".

    `source`: where the coefficients come from, in words; `manoeuvres`: those of the losses of the boat. InputError for
    a boat that a simulator cannot have (:meth:`Boat.spatial`).
    """

    def numbers(values: Any, between: str = " ") -> str:  # nine digits, and no negative zero
        return between.join(f"{value + 0.0:.9g}" for value in np.ravel(values))

    def xml(text: str) -> str:  # also inside a comment, which has no two hyphens, and between double quotes
        return re.sub("-(?=-)", "- ", html.escape(printable(text)).replace("&#x27;", "'"))

    head = [f"{boat.vehicle.name}, {source}, bayesub {metadata.version('bayesub')}"]
    head.append(f"Equations '{boat.equations.name}' of bayesub; axes of SNAME, angles in rad, SI units.")
    if boat.equations.rigid_body_terms == "in_coefficients":
        head.append("The velocity terms of the rigid body are part of these coefficients: leave them out elsewhere.")
    given = {"boat": boat, "head": head, "flown": listed([one.name for one in manoeuvres]), "pi": np.pi}
    given |= {"turned": np.array([1.0, -1.0, -1.0]), "cross": np.cross, "numbers": numbers}
    return templates.fill("bayesub.findings", f"simulators/{kind}.txt", safe=printable, matlab=matlab, xml=xml, **given)
