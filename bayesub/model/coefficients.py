"""The table of the 101 hydrodynamic coefficients, the one description of the force model.

Every hydrodynamic force is linear in its coefficients,

    F_axis = sum over the terms of  (rho / 2) l^power * coefficient * regressor,

with non-dimensional coefficients (Gertler & Hagen 1967, Feldman 1979; thesis appendix E). The simulator's force
kernel is generated from this table (:mod:`bayesub.model.generate_kernel`), and the linear regressors, the labels and
the sub-problems are read from it, so that a term stands in one place.

In a regressor ``u v w p q r`` are the body velocities and rates, a trailing ``dot`` marks an acceleration, ``dr db
ds`` are rudder, bow plane and stern plane, ``nu = sqrt(v^2 + w^2)`` is the cross-flow speed and ``sgn`` the sign.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.io.log_files import ACCELERATIONS, VELOCITIES, positions

if TYPE_CHECKING:
    from bayesub.model.manoeuvres import Manoeuvre
    from bayesub.model.vehicles import Vehicle

AXES = ("X", "Y", "Z", "K", "M", "N")
PLANES = ("dr", "db", "ds")


@dataclass(frozen=True)
class Term:
    """One row of the table: ``(rho/2) l^power * coefficient * regressor`` acts along `axis`.

    Attributes
    ----------
    name : str
        Of the coefficient.
    axis : str
        One of X, Y, Z, K, M, N.
    power : int
        Of the length in the dimensional factor.
    regressor : str
        Product of factors such as ``u``, ``abs(r)`` or ``sgn(v)``, joined by ``*``.
    """

    name: str
    axis: str
    power: int
    regressor: str

    @property
    def factors(self) -> list[str]:
        """The factors of the regressor."""
        return self.regressor.split("*")

    @property
    def symbols(self) -> frozenset[str]:
        """Motion variables and controls that the regressor contains."""
        return frozenset(re.findall(r"[a-z]+", self.regressor)) - {"abs", "sgn"}

    @property
    def is_added_mass(self) -> bool:
        """Whether the force is proportional to an acceleration."""
        return self.regressor in ACCELERATIONS

    @property
    def label(self) -> str:
        r"""LaTeX label in the notation of the field, such as ``$Y'_{v|\\nu|}$``."""
        symbols = {"dr": r"\delta_r", "db": r"\delta_b", "ds": r"\delta_s", "nu": r"\nu"}
        letters = re.findall(r"abs(?:nu|[a-z])|[a-z]dot|d[rbs]|nu|[a-z]", self.name[1:])
        parts = []
        for letter in letters:
            if letter.startswith("abs"):
                parts.append(f"|{symbols.get(letter[3:], letter[3:])}|")
            elif letter.endswith("dot"):
                parts.append(rf"\dot{{{letter[0]}}}")
            else:
                parts.append(symbols.get(letter, letter))
        return rf"${self.axis}'_{{{''.join(parts)}}}$"


TERMS = (
    # Surge
    Term("Xuu", "X", 2, "u*u"),
    Term("Xvv", "X", 2, "v*v"),
    Term("Xww", "X", 2, "w*w"),
    Term("Xuu_drdr", "X", 2, "u*u*dr*dr"),
    Term("Xuu_dbdb", "X", 2, "u*u*db*db"),
    Term("Xuu_dsds", "X", 2, "u*u*ds*ds"),
    Term("Xudot", "X", 3, "udot"),
    Term("Xvr", "X", 3, "v*r"),
    Term("Xwq", "X", 3, "w*q"),
    Term("Xqq", "X", 4, "q*q"),
    Term("Xrr", "X", 4, "r*r"),
    Term("Xrp", "X", 4, "r*p"),
    # Sway
    Term("Yuu", "Y", 2, "u*u"),
    Term("Yuv", "Y", 2, "u*v"),
    Term("Yvw", "Y", 2, "v*w"),
    Term("Yv_absnu", "Y", 2, "v*nu"),
    Term("Yuu_dr", "Y", 2, "u*u*dr"),
    Term("Yvdot", "Y", 3, "vdot"),
    Term("Yup", "Y", 3, "u*p"),
    Term("Yur", "Y", 3, "u*r"),
    Term("Yvq", "Y", 3, "v*q"),
    Term("Ywp", "Y", 3, "w*p"),
    Term("Ywr", "Y", 3, "w*r"),
    Term("Yv_absr", "Y", 3, "sgn(v)*nu*abs(r)"),
    Term("Yu_absr_dr", "Y", 3, "u*abs(r)*dr"),
    Term("Ypdot", "Y", 4, "pdot"),
    Term("Yrdot", "Y", 4, "rdot"),
    Term("Yp_absp", "Y", 4, "p*abs(p)"),
    Term("Ypq", "Y", 4, "p*q"),
    Term("Yqr", "Y", 4, "q*r"),
    # Heave
    Term("Zuu", "Z", 2, "u*u"),
    Term("Zuw", "Z", 2, "u*w"),
    Term("Zvv", "Z", 2, "v*v"),
    Term("Zuu_db", "Z", 2, "u*u*db"),
    Term("Zuu_ds", "Z", 2, "u*u*ds"),
    Term("Zw_absnu", "Z", 2, "w*nu"),
    Term("Zu_absw", "Z", 2, "u*abs(w)"),
    Term("Zabsw_nu", "Z", 2, "abs(w)*nu"),
    Term("Zwdot", "Z", 3, "wdot"),
    Term("Zuq", "Z", 3, "u*q"),
    Term("Zvp", "Z", 3, "v*p"),
    Term("Zvr", "Z", 3, "v*r"),
    Term("Zu_absq_ds", "Z", 3, "u*abs(q)*ds"),
    Term("Zw_absq", "Z", 3, "sgn(w)*nu*abs(q)"),
    Term("Zqdot", "Z", 4, "qdot"),
    Term("Zpp", "Z", 4, "p*p"),
    Term("Zrr", "Z", 4, "r*r"),
    Term("Zrp", "Z", 4, "r*p"),
    # Roll
    Term("Kuu", "K", 3, "u*u"),
    Term("Kuv", "K", 3, "u*v"),
    Term("Kvw", "K", 3, "v*w"),
    Term("Kv_absnu", "K", 3, "v*nu"),
    Term("Kuu_dr", "K", 3, "u*u*dr"),
    Term("Kvdot", "K", 4, "vdot"),
    Term("Kup", "K", 4, "u*p"),
    Term("Kur", "K", 4, "u*r"),
    Term("Kvq", "K", 4, "v*q"),
    Term("Kwp", "K", 4, "w*p"),
    Term("Kwr", "K", 4, "w*r"),
    Term("Kpdot", "K", 5, "pdot"),
    Term("Krdot", "K", 5, "rdot"),
    Term("Kqr", "K", 5, "q*r"),
    Term("Kpq", "K", 5, "p*q"),
    Term("Kp_absp", "K", 5, "p*abs(p)"),
    # Pitch
    Term("Muu", "M", 3, "u*u"),
    Term("Muw", "M", 3, "u*w"),
    Term("Mvv", "M", 3, "v*v"),
    Term("Muu_db", "M", 3, "u*u*db"),
    Term("Muu_ds", "M", 3, "u*u*ds"),
    Term("Mw_absnu", "M", 3, "w*nu"),
    Term("Mu_absw", "M", 3, "u*abs(w)"),
    Term("Mabsw_nu", "M", 3, "abs(w)*nu"),
    Term("Mwdot", "M", 4, "wdot"),
    Term("Muq", "M", 4, "u*q"),
    Term("Mvp", "M", 4, "v*p"),
    Term("Mvr", "M", 4, "v*r"),
    Term("Mu_absq_ds", "M", 4, "u*abs(q)*ds"),
    Term("Mabsnu_q", "M", 4, "nu*q"),
    Term("Mqdot", "M", 5, "qdot"),
    Term("Mpp", "M", 5, "p*p"),
    Term("Mrr", "M", 5, "r*r"),
    Term("Mrp", "M", 5, "r*p"),
    Term("Mq_absq", "M", 5, "q*abs(q)"),
    # Yaw
    Term("Nuu", "N", 3, "u*u"),
    Term("Nuv", "N", 3, "u*v"),
    Term("Nvw", "N", 3, "v*w"),
    Term("Nv_absnu", "N", 3, "v*nu"),
    Term("Nuu_dr", "N", 3, "u*u*dr"),
    Term("Nvdot", "N", 4, "vdot"),
    Term("Nup", "N", 4, "u*p"),
    Term("Nur", "N", 4, "u*r"),
    Term("Nvq", "N", 4, "v*q"),
    Term("Nwp", "N", 4, "w*p"),
    Term("Nwr", "N", 4, "w*r"),
    Term("Nabsnu_r", "N", 4, "nu*r"),
    Term("Nu_absr_dr", "N", 4, "u*abs(r)*dr"),
    Term("Npdot", "N", 5, "pdot"),
    Term("Nrdot", "N", 5, "rdot"),
    Term("Npq", "N", 5, "p*q"),
    Term("Nqr", "N", 5, "q*r"),
    Term("Nr_absr", "N", 5, "r*abs(r)"),
)

NAMES = tuple(term.name for term in TERMS)
INDEX = {name: k for k, name in enumerate(NAMES)}


def _confined(axes: str, symbols: set[str]) -> tuple[str, ...]:
    return tuple(t.name for t in TERMS if t.axis in axes and t.symbols <= symbols)


ADDED_MASSES = tuple(term.name for term in TERMS if term.is_added_mass)
HORIZONTAL = _confined("XYN", {"u", "v", "r", "nu", "dr", "udot", "vdot", "rdot"})
VERTICAL = _confined("XZM", {"u", "w", "q", "nu", "db", "ds", "udot", "wdot", "qdot"})
SUBPROBLEMS = {"horizontal": HORIZONTAL, "vertical": VERTICAL}


def active_coefficients(
    vehicle: Vehicle | None = None, manoeuvre: Manoeuvre | None = None, subproblem: str | None = None
) -> tuple[str, ...]:
    """Names of the coefficients that play a part in a motion, in the order of the table.

    Those of other axes and of motions that a sub-problem does not have play none, nor do those of planes that rest at
    zero throughout a manoeuvre, nor do coefficients that are zero.

    Parameters
    ----------
    vehicle : Vehicle, optional
        Leaves out the coefficients that are zero for it. Without it coefficients may have any values, as where a prior
        or a measurement is to say what they are.
    manoeuvre : Manoeuvre, optional
        Leaves out the coefficients of planes that it does not move. Its own sub-problem is not asked.
    subproblem : str, optional
        "horizontal", "vertical", or None for all six degrees of freedom.

    Raises
    ------
    InputError
        For a sub-problem that does not exist.
    """
    resting = set()
    if manoeuvre is not None:
        resting = {plane for plane, angles in zip(PLANES, manoeuvre.controls.T, strict=True) if not angles.any()}
    if subproblem is not None and subproblem not in SUBPROBLEMS:
        raise InputError(f"unknown sub-problem '{subproblem}': expected horizontal or vertical")
    in_equations = NAMES if subproblem is None else SUBPROBLEMS[subproblem]
    return tuple(
        term.name
        for k, term in enumerate(TERMS)
        if term.name in in_equations
        and not (resting and term.symbols & resting)
        and (vehicle is None or vehicle.xi[k] != 0.0)
    )


def columns(names: Iterable[str]) -> np.ndarray:
    """Positions in ``xi`` of coefficients given by name; InputError for an unknown name."""
    names = tuple(names)
    for name in names:
        if name not in INDEX:
            raise InputError(f"unknown coefficient '{name}'{nearest(name, NAMES)}")
    return np.array([INDEX[name] for name in names], dtype=int)


def dimensional_factors(length_m: float, water_density_kgm3: float) -> np.ndarray:
    """The ``(rho/2) l^power`` of each of the 101 terms, shape (101,)."""
    powers = np.array([term.power for term in TERMS])
    return 0.5 * water_density_kgm3 * length_m**powers


def regressors(states: np.ndarray, accelerations: np.ndarray, controls: np.ndarray) -> dict[str, np.ndarray]:
    """The regressors of each axis, the columns of the linear form ``A xi = b`` (model manual, section 9).

    Parameters
    ----------
    states : (n, 12) array
        m, rad, m/s, rad/s.
    accelerations : (n, 6) array
        Body accelerations, m/s^2 and rad/s^2.
    controls : (n, 3) array
        Angles of rudder, bow plane and stern plane, rad.

    Returns
    -------
    dict of str to array
        Axis -> (n, n_columns); columns in the order of the table, without the factor (rho/2) l^power.
    """
    states, accelerations, controls = np.asarray(states), np.asarray(accelerations), np.asarray(controls)
    values = dict(zip(VELOCITIES, states[:, positions(*VELOCITIES)].T, strict=True))
    values |= dict(zip(ACCELERATIONS, accelerations.T, strict=True))
    values |= dict(zip(PLANES, controls.T, strict=True))
    values["nu"] = np.hypot(values["v"], values["w"])
    values |= {f"abs({name})": np.abs(column) for name, column in values.items()}
    values |= {f"sgn({name})": np.sign(values[name]) for name in VELOCITIES}
    return {
        axis: np.column_stack([reduce(np.multiply, [values[f] for f in t.factors]) for t in TERMS if t.axis == axis])
        for axis in AXES
    }


def names_of_axis(axis: str) -> tuple[str, ...]:
    """The coefficient names of one axis, in the column order of :func:`regressors`."""
    return tuple(term.name for term in TERMS if term.axis == axis)
