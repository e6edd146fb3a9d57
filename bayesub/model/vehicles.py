"""Vehicles: coefficients, the rigid body, the propulsion and the actuators, in SI units and radians."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io import toml_files
from bayesub.io.equality import ByContent
from bayesub.io.errors import InputError, error_source
from bayesub.io.notebook import Displayed
from bayesub.kernels import workspace
from bayesub.logs.log_files import ACCELERATIONS, HEADERS
from bayesub.model import actuator_files
from bayesub.model.actuator import GRAVITY_MPS2, Actuator
from bayesub.model.actuators import Actuators
from bayesub.model.equations import AXES, EquationSet, load_equations
from bayesub.model.equations.files import DEFAULT, beside, equation_files
from bayesub.model.equations.generate import source
from bayesub.model.propulsion import MeasuredSection, ThrustSection
from bayesub.model.vehicle_files import VehicleFile, check_fit

if TYPE_CHECKING:
    from bayesub.kernels import families

MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
SINGULAR = 1e-12  # smallest singular value over the largest, in units of length and mass of the boat; hulls have 1e-3

FASTEST, CURRENT = 10.0, 10.0  # trial speeds, and m/s, of which a boat does the larger at most
_COASTS = 0.8  # speed in the last fifth of a log over that in the first, below which a boat loses speed
_SPEEDS = ("u", "v", "w", "u_ground", "v_ground", "w_ground", "north", "east", "down", "sog", "stw")


@dataclass(frozen=True, eq=False)
class Vehicle(ByContent, Displayed):
    """A vehicle in SI units and radians."""

    name: str
    description: str
    reference: str  # where the numbers come from
    length_m: float
    water_density_kgm3: float
    speed_mps: float  # at which trials begin
    depth_m: float  # at which trials begin
    rpm_per_mps: float  # propeller speed that self-propels, for a speed of 1 m/s
    actuators: Actuators  # what moves the controls of the equations, and pushes from outside
    body: np.ndarray  # (N_BODY,) all else that moves the boat, in the order of :data:`bayesub.kernels.workspace.BODY`
    xi: np.ndarray  # (n_terms,) coefficients in the order and the units of the equations
    sd: np.ndarray  # (n_terms,) their standard deviations, not a number where the file gives none
    equations: EquationSet
    hull: np.ndarray | None = None  # (3, n) positions from tail to nose, heights and breadths, m
    # (n_terms, n_terms) of what has a standard deviation; None if the file gives none
    correlation: np.ndarray | None = None

    def __post_init__(self):
        for array in (self.body, self.xi, self.sd):
            array.setflags(write=False)

    @cached_property
    def dimensional_factors(self) -> np.ndarray:
        """(n_terms,) what makes each coefficient dimensional."""
        return self.equations.factors(self.length_m, self.water_density_kgm3, self.speed_mps)

    @property
    def rigid_body(self) -> dict[str, float]:
        """The entries of `body` by name (:data:`bayesub.kernels.workspace.BODY`)."""
        return dict(zip(workspace.BODY, self.body.tolist(), strict=True))

    @property
    def weight_density_npm3(self) -> float:
        """Of the water, N/m^3."""
        return self.water_density_kgm3 * GRAVITY_MPS2

    @cached_property
    def constants(self) -> np.ndarray:
        """What the equations need besides coefficients and body (:meth:`EquationSet.constants`)."""
        return self.equations.constants(self.speed_mps, self.hull)

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Short names of the columns of a log that move the boat: actuators, and the propeller speed if it acts."""
        propeller = self.body[[*(workspace.BODY.index(b) for b in workspace.THRUST), workspace.KN1, workspace.KN2]]
        acts = propeller.any() or any(term.symbols & {"uc", "duc"} for term in self.equations.terms)
        return tuple(dict.fromkeys((*self.actuators.shorts, *(("rpm",) if acts else ()))))

    def propeller_speed(self, log: dict[str, np.ndarray], n: int) -> np.ndarray:
        """(n,) rpm of a log; those of self-propulsion if it has none, or if they do not act."""
        steady = np.full(n, self.rpm_per_mps * self.speed_mps)
        return log.get("rpm", steady) if "rpm" in self.inputs else steady

    def check_log(self, log: dict[str, np.ndarray], source: str) -> None:
        """InputError with its `source` for a log (n,), in SI units, of what this boat cannot have done.

        It moves, through the water or over the ground, and has its propeller turn for a speed, of more than
        ten trial speeds and ten metres a second; or its propeller stands still all the time, nothing else drives it,
        and it does not lose speed, as in a coast-down.
        """
        most = max(FASTEST * self.speed_mps, CURRENT)
        limits = dict.fromkeys((name for name in _SPEEDS if name in log), most)
        if "rpm" in log and "rpm" in self.inputs and "rpm" not in self.actuators.shorts:
            limits["rpm"] = most * self.rpm_per_mps
            pushes = (a.force[0] or a.force_of_square[0] or a.force_of_speed[0] for a in self.actuators.members)
            drives = any(pushes) or any(a.unit == "mps" for a in self.actuators.members)  # the wind
            if not drives and not np.nan_to_num(log["rpm"]).any() and not _loses_speed(log):
                message = f"{source}: column 'rpm': is 0 in all rows, nothing else drives '{self.name}', and no column "
                remedy = "shows that it loses speed; log it, or delete the column, which is self-propulsion"
                raise InputError(message + remedy, "data", "rpm")
        for name, limit in limits.items():
            for row in np.flatnonzero(np.abs(log[name]) > limit)[:1]:
                header = HEADERS[name]
                found = f"{log[name][row]:.4g} at {log['time'][row]:.6g} s is beyond {limit:.4g}"
                message = f"{source}: column '{header}': {found}; '{self.name}', whose trial speed is "
                remedy = f"{self.speed_mps:g} m/s, does {most:g} m/s at most; check the unit, or empty the cell"
                raise InputError(message + remedy, "unit", header)

    def kernels(self, subproblem: str | None = None, *, external: bool = False) -> families.Family:
        """The kernels of the equations with the terms of a sub-problem, and with forces from outside if there are any.

        They are compiled, or loaded, when they are first used.
        """
        from bayesub.kernels import families  # importing numba takes a second

        plane = self.equations.subproblem(subproblem)
        return families.family(source(self.equations, plane, external or self.actuators.external))

    @property
    def mass_matrix(self) -> np.ndarray:
        """(6, 6) mass and added mass, kg, kg m and kg m^2 (model manual, section 6)."""
        return mass_matrix(self.equations, self.xi * self.dimensional_factors, self.body)

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


def _loses_speed(log: Mapping[str, np.ndarray]) -> bool:
    """Whether a log (n,), in SI units, shows a boat that slows down from its first to its last fifth."""
    speeds = [np.abs(log[name]) for name in ("u", "u_ground", "stw", "sog") if name in log]
    if {"x", "y"} <= log.keys():
        fixed = np.isfinite(log["x"]) & np.isfinite(log["y"])
        steps = np.diff([log["x"][fixed], log["y"][fixed]], axis=1)
        speeds.append(np.hypot(*steps) / np.diff(log["time"][fixed]))
    known = (some[np.isfinite(some)] for some in speeds)
    return any(n and one[-n:].mean() < _COASTS * one[:n].mean() for one in known if (n := len(one) // 5 or len(one)))


def mass_matrix(equations: EquationSet, dimensional: np.ndarray, body: np.ndarray) -> np.ndarray:
    """The mass matrix M = M_rb - M_a (6, 6), kg, kg m and kg m^2 (model manual, sections 2 and 6), without kernels.

    It is that of dimensional coefficients (n_terms,) and of a body vector (N_BODY,) in the order of
    :data:`bayesub.kernels.workspace.BODY`. Kernels have their own (:mod:`bayesub.kernels.mass`); a test compares them.
    """
    mass, (x, y, z) = body[workspace.MASS], body[[workspace.XG, workspace.YG, workspace.ZG]]
    ixx, iyy, izz, ixy, iyz, izx = body[workspace.IXX : workspace.IZX + 1]
    lever = mass * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # the cross product with the centre of gravity
    inertia = np.array([[ixx, -ixy, -izx], [-ixy, iyy, -iyz], [-izx, -iyz, izz]])
    matrix = np.block([[mass * np.eye(3), -lever], [lever, inertia]])
    for term, coefficient in zip(equations.terms, dimensional, strict=True):
        if term.is_added_mass:
            matrix[AXES.index(term.axis), ACCELERATIONS.index(term.regressor)] -= coefficient
    return matrix


def without_inertia(matrix: np.ndarray, length_m: float, degrees_of_freedom: int) -> str:
    """The motion whose acceleration costs no force, "surge" to "yaw"; empty if the matrix (6, 6) is regular."""
    moving = [0, 1, 5] if degrees_of_freedom == 3 else list(range(6))
    size = np.array([1.0] * 3 + [length_m] * 3)
    _, values, motions = np.linalg.svd((matrix / np.outer(size, size))[np.ix_(moving, moving)])
    return MOTIONS[moving[np.argmax(np.abs(motions[-1]))]] if values[-1] <= SINGULAR * values[0] else ""


def load_vehicle(name: str | Path, located: Callable[[str], str] = str) -> Vehicle:
    """Load a built-in vehicle by name or a vehicle file by path, which is where `located` says.

    InputError with file, key and remedy.
    """
    path = toml_files.find(located(str(name)), "vehicles")
    lines = {line.partition("#")[0].strip() for line in toml_files.read_text(path).splitlines()}
    if {"[actuators]", "[[actuators]]"} <= lines:  # which TOML itself refuses in other words
        raise InputError(f"{path}: has both [actuators] and [[actuators]]; keep one of them", "conflict", "actuators")
    file = toml_files.read_toml(path, VehicleFile)
    with error_source(f"{path}: equations"):
        equations = load_equations(beside(str(name), file.equations), located)
    with error_source(str(path)):
        check_fit(file, equations)
    try:
        with np.errstate(all="ignore"):
            vehicle = _built(file, equations)
            sizes = [*vehicle.body, *(vehicle.xi * vehicle.dimensional_factors), vehicle.rpm_per_mps]
            sizes += [*vehicle.actuators.wrenches(vehicle.actuators.rest[None], None)[0]]
    except OverflowError:
        sizes = [math.inf]
    if not np.isfinite(sizes).all() or not vehicle.rpm_per_mps > 0.0 or not vehicle.dimensional_factors.all():
        fault = f"{path}: masses, forces or thrust are too large, too small or undefined"
        checks = "the units in [body], that straight flight has a drag (a negative Xuu)"
        raise InputError(f"{fault}; check {checks}, and the size of the coefficients", "model")
    if motion := without_inertia(vehicle.mass_matrix, vehicle.length_m, equations.degrees_of_freedom):
        text = f"{path}: the mass matrix is singular: nothing resists an acceleration in {motion}; check mass and "
        text += f"inertia in [body] and the added masses {', '.join(equations.added_masses)}, which are negative on "
        text += "the diagonal"
        raise InputError(text, "model", "body")
    return vehicle


def files_of_equations(name: str | Path, located: Callable[[str], str] = str) -> list[str]:
    """The paths of the equation files that a vehicle file names; its parameters are those of :func:`load_vehicle`."""
    table = toml_files.read_toml_table(toml_files.find(located(str(name)), "vehicles"))
    return equation_files(beside(str(name), str(table.get("equations", DEFAULT))), located)


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
    hull_members: tuple[Actuator, ...] = ()
    if file.displacement is not None:
        lift = weight if body.buoyancy_n is None else body.buoyancy_n
        water = lift, body.centre_of_buoyancy_m, body.water_density_kgm3
        hull_members = actuator_files.hull_members(file.displacement, *water, len(equations.controls))
    forces = propulsion.wrenches(body, trial.speed_mps, drag) if isinstance(propulsion, MeasuredSection) else ()
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
    correlation = None
    if file.correlations is not None:
        columns, correlation = equations.columns(file.correlations.coefficients), np.eye(len(equations.names))
        correlation[np.ix_(columns, columns)] = file.correlations.matrix
    return Vehicle(
        name=file.name,
        description=file.description,
        reference=file.reference,
        length_m=body.length_m,
        water_density_kgm3=body.water_density_kgm3,
        speed_mps=trial.speed_mps,
        depth_m=trial.depth_m,
        rpm_per_mps=rpm_per_mps,
        actuators=actuator_files.build(
            file.actuators, equations, body.water_density_kgm3, rpm_per_mps * trial.speed_mps, hull_members, forces
        ),
        body=np.array([row[key] for key in workspace.BODY]),
        xi=xi,
        sd=np.array([sds[key] for key in equations.names]),
        equations=equations,
        hull=hull,
        correlation=correlation,
    )
