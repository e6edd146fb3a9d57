"""The coefficients of a boat as two other simulators take them.

*MSS*, the Marine Systems Simulator of Fossen in Matlab and Octave: its submarine model npsauv.m has the terms of
Healey & Lienard (1993) with the names of SNAME, from which the u of u v, u r, .. is dropped, scaled by rho/2 L^2 to
rho/2 L^5.
*PythonVehicleSimulator*, by the same author: remus100.py has no derivatives but mass, drag and fins. Each term is found
by its regressor; one that has no counterpart is said so in a comment of the file.
"""

import json
from importlib import metadata
from typing import Any, Protocol

import numpy as np

from bayesub.io.errors import printable
from bayesub.io.words import matlab
from bayesub.model.equations.equation_set import Term
from bayesub.model.equations.regressors import parse
from bayesub.model.vehicles import Vehicle, mass_matrix

_COLUMNS = {"dr": "rudder_deg", "ds": "stern_plane_deg", "db": "bow_plane_deg"}
# Axis -> regressors and their names in npsauv.m, which has each bow plane by itself, so that theirs are halves of ours.
_MSS = {
    "X": "p*p=pp q*q=qq r*r=rr p*r=pr udot=udot w*q=wq v*p=vp v*r=vr v*v=vv w*w=ww u*q*ds=qds u*q*db=qdb2 u*r*dr=rdr "
    "u*v*dr=vdr u*w*ds=wds u*w*db=wdb2 u*u*ds*ds=dsds u*u*dr*dr=drdr",
    "Y": "pdot=pdot rdot=rdot p*q=pq q*r=qr vdot=vdot u*p=p u*r=r v*q=vq w*p=wp w*r=wr u*v=v v*w=vw u*u*dr=dr",
    "Z": "qdot=qdot p*p=pp p*r=pr r*r=rr wdot=wdot u*q=q v*p=vp v*r=vr u*w=w v*v=vv u*u*ds=ds u*u*db=db2",
    "K": "pdot=pdot rdot=rdot p*q=pq q*r=qr vdot=vdot u*p=p u*r=r v*q=vq w*p=wp w*r=wr u*v=v v*w=vw",
    "M": "qdot=qdot p*p=pp p*r=pr r*r=rr wdot=wdot u*q=uq v*p=vp v*r=vr u*w=uw v*v=vv u*u*ds=ds u*u*db=db2",
    "N": "pdot=pdot rdot=rdot p*q=pq q*r=qr vdot=vdot u*p=p u*r=r v*q=vq w*p=wp w*r=wr u*v=v v*w=vw u*u*dr=dr",
}
_PVS_DENSITY = 1026.0  # kg/m^3, written into the function of PythonVehicleSimulator that computes the drag


class Known(Protocol):
    """What is known of coefficients, n of them."""

    names: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray


class Boat:
    """The numbers of a boat with means and sds of its coefficients.

    `known`: of some coefficients; the others have the values of the vehicle.
    """

    def __init__(self, vehicle: Vehicle, known: Known):
        self.vehicle, self.equations = vehicle, vehicle.equations
        self.xi, self.sd = vehicle.xi.copy(), vehicle.sd.copy()
        places = self.equations.columns(known.names)
        self.xi[places], self.sd[places] = known.mean, known.sd
        none = np.zeros(len(self.xi))
        self.rigid_mass = mass_matrix(self.equations, none, vehicle.body)
        dimensional = self.xi * vehicle.dimensional_factors
        self.added_mass = mass_matrix(self.equations, dimensional, vehicle.body) - self.rigid_mass

    def term(self, axis: str, regressor: str) -> Term | None:
        """The term with a regressor, whose controls are dr, ds and db; None if the equations have none."""
        symbols = {control.column: control.symbol for control in self.equations.controls}
        parts = regressor.split("*")
        if any(part in _COLUMNS and _COLUMNS[part] not in symbols for part in parts):
            return None
        own = "*".join(symbols[_COLUMNS[part]] if part in _COLUMNS else part for part in parts)
        return self.equations.find(axis, parse(own, symbols.values()))

    def prime(self, term: Term) -> tuple[float, float, int]:
        """Value and sd of a coefficient over (rho/2) l^k, and that power k, with which it is non-dimensional."""
        k, vehicle = self.equations.index[term.name], self.vehicle
        dimensions = {control.symbol: control.dimension for control in self.equations.controls}
        power = (4 if term.axis in "XYZ" else 5) - term.parsed.dimension(dimensions)[0]
        factor = vehicle.dimensional_factors[k] / (0.5 * vehicle.water_density_kgm3 * vehicle.length_m**power)
        return float(self.xi[k] * factor), float(self.sd[k] * factor), power


def _counterparts(boat: Boat) -> tuple[list[dict], list[Term]]:
    """Terms with a name in npsauv.m, each as a row, and terms that are not zero and have none."""
    rows, taken = [], set()
    for axis, pairs in _MSS.items():
        for regressor, name in (pair.split("=") for pair in pairs.split()):
            term = boat.term(axis, regressor)
            if term is not None:
                taken.add(term.name)
                value, sd, power = boat.prime(term)
                half = 0.5 if "db" in regressor else 1.0
                rows.append({"name": axis + name, "value": half * value, "sd": half * sd, "scale": f"r{power}",
                             "regressor": regressor, "from": term.name})  # fmt: skip
    drag = boat.term("X", "u*u")
    if drag is not None:
        value, sd, power = boat.prime(drag)
        taken.add(drag.name)
        row = {"name": "Cd0", "value": -value, "sd": sd, "scale": f"r{power}", "regressor": "-u*u", "from": drag.name}
        rows.append(row)
    others = [t for k, t in enumerate(boat.equations.terms) if t.name not in taken and boat.xi[k] != 0.0]
    return rows, others


def _why_not(term: Term) -> str:
    """Why a term has no counterpart."""
    symbols = {factor.symbol for factor in term.parsed.factors}
    if symbols & {"nu", "V"} or any(symbol.startswith("crossflow") for symbol in symbols):
        return "cross-flow, which MSS integrates along the hull (Cdy, Cdz)"
    if symbols & {"uc", "duc"}:
        return "the propeller race, which MSS has by epsilon"
    if any(factor.function in ("abs", "sgn") for factor in term.parsed.factors):
        return "a modulus, which npsauv.m has not"
    return "no such term in npsauv.m"


def _head(boat: Boat, source: str) -> list[str]:
    lines = [
        f"{boat.vehicle.name}, {source}: posterior means, bayesub {metadata.version('bayesub')}",
        f"Equations '{boat.equations.name}' of bayesub; axes of SNAME, angles in rad, SI units.",
    ]
    if boat.equations.rigid_body_terms == "in_coefficients":
        lines.append("The velocity terms of the rigid body are part of these coefficients: leave them out elsewhere.")
    return lines


def _scalars(boat: Boat) -> dict[str, Any]:
    vehicle = boat.vehicle
    body = vehicle.rigid_body
    return {
        "L": vehicle.length_m,
        "rho": vehicle.water_density_kgm3,
        "U": vehicle.speed_mps,
        "mass": body["mass"],
        "W": body["weight"],
        "B": body["buoyancy"],
        "r_bg": [body[key] for key in ("xG", "yG", "zG")],
        "r_bb": [body[key] for key in ("xB", "yB", "zB")],
    }


def mss(vehicle: Vehicle, known: Known, source: str) -> str:
    """A Matlab script that makes a struct `vehicle` with the names of npsauv.m.

    `source`: where the coefficients come from, in words.
    """
    boat = Boat(vehicle, known)
    rows, others = _counterparts(boat)
    lines = [f"% {printable(line)}" for line in _head(boat, source)]
    lines += ["% Names and scales of npsauv.m in MSS: r2 = rho/2 L^2 .. r5 = rho/2 L^5; what is not here is zero.", ""]
    lines.append(f"vehicle.name = {matlab(vehicle.name)};")
    for key, value in _scalars(boat).items():
        text = f"[{' '.join(map(_number, value))}]" if isinstance(value, list) else _number(value)
        lines.append(f"vehicle.{key} = {text};")
    for key, matrix in (("MRB", boat.rigid_mass), ("MA", boat.added_mass)):
        lines += [f"vehicle.{key} = [", *(f"    {' '.join(map(_number, row))}" for row in matrix.tolist()), "];"]
    lines.append("")
    for row in rows:
        sd = f", sd {row['sd']:.2g}" if np.isfinite(row["sd"]) else ""
        note = f"{row['scale']} {row['regressor']}, {row['from']}{sd}"
        lines.append(f"vehicle.{row['name']:<5} = {_number(row['value'])}; % {note}")
    if others:
        lines += ["", "% Without counterpart:"]
    for term in others:
        k = boat.equations.index[term.name]
        what = f"{term.name} = {_number(boat.xi[k])} on {term.scale} {term.regressor}: {_why_not(term)}"
        lines.append(f"% {printable(what)}")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Nine digits, and no negative zero."""
    return f"{value + 0.0:.9g}"


def mss_json(vehicle: Vehicle, known: Known, source: str) -> str:
    """The content of :func:`mss` as JSON."""
    boat = Boat(vehicle, known)
    rows, others = _counterparts(boat)
    for row in rows:
        row["sd"] = row["sd"] if np.isfinite(row["sd"]) else None
    content: dict[str, Any] = {"convention": "MSS, npsauv.m: r2 = rho/2 L^2 .. r5 = rho/2 L^5"}
    content["about"] = _head(boat, source)
    content |= {"name": vehicle.name} | _scalars(boat)
    content |= {"MRB": boat.rigid_mass.tolist(), "MA": boat.added_mass.tolist(), "coefficients": rows}
    content["without_counterpart"] = [
        {"name": t.name, "value": float(boat.xi[boat.equations.index[t.name]]), "scale": t.scale,
         "regressor": t.regressor, "why": _why_not(t)}
        for t in others
    ]  # fmt: skip
    return json.dumps(content, indent=1) + "\n"


def pvs(vehicle: Vehicle, known: Known, source: str) -> str:
    """A Python module whose function `apply` changes a remus100 of PythonVehicleSimulator into the boat."""
    boat = Boat(vehicle, known)
    scalars, used, lines = _scalars(boat), set(boat.equations.added_masses), []
    lines += [f"vehicle.{key} = {_number(scalars[key])}" for key in ("L", "rho", "W", "B")]
    lines += [f"vehicle.{key} = np.array([{', '.join(map(_number, scalars[key]))}])" for key in ("r_bg", "r_bb")]
    moving = [0, 1, 5] if boat.equations.degrees_of_freedom == 3 else list(range(6))
    for key, matrix in (("MRB", boat.rigid_mass), ("MA", boat.added_mass)):
        lines += [
            f"vehicle.{key}[np.ix_({moving}, {moving})] = np.array([",
            *(f"    [{', '.join(map(_number, row))}]," for row in matrix[np.ix_(moving, moving)].tolist()),
            "])",
        ]
    lines += [
        "vehicle.M = vehicle.MRB + vehicle.MA",
        "vehicle.Minv = np.linalg.inv(vehicle.M)",
        "righting = vehicle.W * (vehicle.r_bg[2] - vehicle.r_bb[2])",
        "vehicle.w_roll, vehicle.w_pitch = np.sqrt(righting / vehicle.M[3, 3]), np.sqrt(righting / vehicle.M[4, 4])",
    ]
    area = vehicle.length_m**2
    drag = boat.term("X", "u*u")
    if drag is not None:
        used.add(drag.name)
        size = -boat.prime(drag)[0] * area * vehicle.water_density_kgm3 / _PVS_DENSITY
        lines.append(
            f"vehicle.CD_0 = {_number(size)} / vehicle.S  # {drag.name}; the drag has the density {_PVS_DENSITY:g}"
        )
    # Its rudder turns the other way round; both fins push by -CL_delta A, at x, which is then moment over force.
    for axis, moment, fin, sign in (("Y", "N", "r", 1.0), ("Z", "M", "s", -1.0)):
        force, turning = boat.term(axis, f"u*u*d{fin}"), boat.term(moment, f"u*u*d{fin}")
        if force is None or turning is None or not boat.prime(force)[0]:
            continue
        used |= {force.name, turning.name}
        size, arm = boat.prime(force)[0] * area, boat.prime(turning)[0] / boat.prime(force)[0] * vehicle.length_m
        turned = "; its rudder is positive to the other side" if sign > 0 else ""
        lines.append(f"vehicle.CL_delta_{fin} = {_number(sign * size)} / vehicle.A_{fin}  # {force.name}{turned}")
        lines.append(f"vehicle.x_{fin} = {_number(arm)}  # {turning.name} over {force.name}")
    others = [t for k, t in enumerate(boat.equations.terms) if t.name not in used and boat.xi[k] != 0.0]
    values = ((t, float(boat.xi[boat.equations.index[t.name]])) for t in others)
    comments = [f"# {printable(f'{t.name} = {_number(value)} on {t.scale} {t.regressor}')}" for t, value in values]
    head = [
        *_head(boat, source),
        "",
        "apply(vehicle) changes a remus100 of PythonVehicleSimulator into this boat: size, weight, mass, added mass,",
        "drag and fins. Lift, damping, cross-flow and propeller stay those of that vehicle"
        + (", and the masses of heave, roll and pitch." if len(moving) == 3 else "."),
    ]
    body = [f"    {line}" for line in lines]
    rest = ["", "# Without counterpart in remus100.py:", *comments] if comments else []
    imports = ["", "import numpy as np", "", "", "def apply(vehicle):"]
    return "\n".join([*(f"# {printable(line)}".rstrip() for line in head), *imports, *body, *rest]) + "\n"
