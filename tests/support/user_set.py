"""An equation set with every kind of symbol, a boat for it, and the families that are compiled of it.

The set has six degrees of freedom, controls of every unit, and a few terms an axis. The families are its own, and that
of a set that extends it, whose coefficients contain the velocity terms of the rigid body, with forces from outside.
"""

import tempfile
from pathlib import Path

import tomli_w

from bayesub.kernels.families import Family, family
from bayesub.model.equations import EquationSet, load_equations
from bayesub.model.equations.generate import source

SET = """
name = "every_symbol"
title = "Every kind of symbol"
description = "Of no boat."
stations = 5

[controls]
dr = "rudder_deg"
ds = "stern_plane_deg"
da = "aileron_deg"
T  = "thruster_n"
n  = "rpm"

[terms.X]
Xudot = { regressor = "udot", length_power = 3, label = "X'_{\\\\dot{u}}", meaning = "added mass" }
Xuu   = { regressor = "u*abs(u)", length_power = 2, label = "X'_{u|u|}", meaning = "resistance" }
Xdu   = { regressor = "U*du", length_power = 2, label = "X'_{\\\\Delta u}", meaning = "resistance of a speed loss" }
Xdudu = { regressor = "abs(du)*du", length_power = 2, label = "X'_{\\\\Delta u|\\\\Delta u|}", meaning = "squared" }
Xduc  = { regressor = "duc*abs(duc)", length_power = 2, label = "X'_{\\\\Delta c}", meaning = "thrust of slip" }
Xnn   = { regressor = "n^2", length_power = 4, label = "X'_{nn}", meaning = "thrust of revolutions" }
XT    = { regressor = "T", unit = "1", label = "X_T", meaning = "thruster ahead" }
X0    = { regressor = "1", length_power = 2, speed_power = 2, label = "X'_0", meaning = "constant pull" }
Xvr   = { regressor = "v*r", length_power = 3, label = "X'_{vr}", meaning = "drift while turning" }

[terms.Y]
Yvdot  = { regressor = "vdot", length_power = 3, label = "Y'_{\\\\dot{v}}", meaning = "added mass" }
Yuv    = { regressor = "u*v", length_power = 2, label = "Y'_{uv}", meaning = "drift" }
Yvvv   = { regressor = "v^3", length_power = 2, speed_power = -1, label = "Y'_{vvv}", meaning = "drift, cubed" }
Yslope = { regressor = "V^-2*u^2*v*abs(v)", length_power = 2, label = "Y'_{uuv|v|}", meaning = "drift by angle" }
Ycross = { regressor = "crossflow_y", length_power = 0, label = "C_y", meaning = "cross-flow drag" }
Yur    = { regressor = "u*r", length_power = 3, label = "Y'_{ur}", meaning = "turning" }
Yvr    = { regressor = "sgn(v)*nu*abs(r)", length_power = 3, label = "Y'_{v|r|}", meaning = "cross-flow while turning" }
Ydr    = { regressor = "u^2*dr", length_power = 2, label = "Y'_{\\\\delta r}", meaning = "rudder" }
Yrdot  = { regressor = "rdot", length_power = 4, label = "Y'_{\\\\dot{r}}", meaning = "added mass" }

[terms.Z]
Zwdot  = { regressor = "wdot", length_power = 3, label = "Z'_{\\\\dot{w}}", meaning = "added mass" }
Zuw    = { regressor = "u*w", length_power = 2, label = "Z'_{uw}", meaning = "angle of attack" }
Zcross = { regressor = "crossflow_z", length_power = 0, label = "C_z", meaning = "cross-flow drag" }
Zds    = { regressor = "uc*u*ds", length_power = 2, label = "Z'_{\\\\delta s}", meaning = "planes in the slipstream" }
Zuq    = { regressor = "u*q", length_power = 3, label = "Z'_{uq}", meaning = "pitching" }

[terms.K]
Kpdot = { regressor = "pdot", length_power = 5, label = "K'_{\\\\dot{p}}", meaning = "added inertia" }
Kp    = { regressor = "V*p", length_power = 4, label = "K'_p", meaning = "roll damping" }
Kda   = { regressor = "abs(u)*u*da", length_power = 3, label = "K'_{\\\\delta a}", meaning = "ailerons" }
Knn   = { regressor = "n*abs(n)", length_power = 5, label = "K'_{nn}", meaning = "propeller torque" }

[terms.M]
Mqdot  = { regressor = "qdot", length_power = 5, label = "M'_{\\\\dot{q}}", meaning = "added inertia" }
Muw    = { regressor = "w*u", length_power = 3, label = "M'_{uw}", meaning = "angle of attack" }
Mcross = { regressor = "crossflow_m", length_power = 0, label = "C_m", meaning = "cross-flow drag" }
Muq    = { regressor = "u*q", length_power = 4, label = "M'_{uq}", meaning = "pitch damping" }
Mds    = { regressor = "u*U*ds", length_power = 3, label = "M'_{\\\\delta s}", meaning = "planes" }

[terms.N]
Nrdot  = { regressor = "rdot", length_power = 5, label = "N'_{\\\\dot{r}}", meaning = "added inertia" }
Nuv    = { regressor = "abs(V)*v", length_power = 3, label = "N'_{uv}", meaning = "drift" }
Ncross = { regressor = "crossflow_n", length_power = 0, label = "C_n", meaning = "cross-flow drag" }
Nur    = { regressor = "u*r", length_power = 4, label = "N'_{ur}", meaning = "yaw damping" }
Ndr    = { regressor = "V^2*dr", length_power = 3, label = "N'_{\\\\delta r}", meaning = "rudder" }
Ndrdr  = { regressor = "u^2*dr^3", length_power = 3, label = "N'_{\\\\delta r^3}", meaning = "rudder, cubed" }
NTdr   = { regressor = "T*dr", unit = "m", label = "N_{T\\\\delta r}", meaning = "thruster turned by the rudder" }
Nrrr   = { regressor = "r^3", length_power = 6, speed_power = -1, label = "N'_{rrr}", meaning = "yaw damping, cubed" }
"""
INCLUDED = """
name = "every_symbol_included"
title = "Every kind of symbol, the rigid body in the coefficients, and the speed of the moment"
extends = "every_symbol.toml"
rigid_body_terms = "in_coefficients"

[terms]
"""
COLUMNS = ("delta_r", "delta_s", "aileron_deg", "thruster_n", "rpm")
VALUES = {
    **{"Xudot": -2e-4, "Xuu": -1e-3, "Xdu": -3e-4, "Xdudu": -7e-4, "Xduc": 8e-4, "Xnn": 2e-9, "XT": 0.9, "X0": 1e-4},
    **{"Xvr": 0.01, "Yvdot": -0.014, "Yuv": -0.03, "Yvvv": -0.05, "Yslope": -0.04, "Ycross": 0.5, "Yur": 0.005},
    **{"Yvr": -0.006, "Ydr": 0.006, "Yrdot": -2e-4, "Zwdot": -0.012, "Zuw": -0.02, "Zcross": 0.6, "Zds": -0.005},
    **{"Zuq": -0.006, "Kpdot": -2e-6, "Kp": -2e-5, "Kda": -3e-5, "Knn": 1e-11, "Mqdot": -7e-4, "Muw": 0.008},
    **{"Mcross": 0.4, "Muq": -0.004, "Mds": -0.003, "Nrdot": -7e-4, "Nuv": -0.01, "Ncross": 0.45, "Nur": -0.004},
    **{"Ndr": 0.003, "Ndrdr": 0.001, "NTdr": 30.0, "Nrrr": -0.01},
}
HULL = {"x_m": [-48.0, -40.0, 35.0, 52.0], "height_m": [1.5, 10.0, 11.0, 2.0], "breadth_m": [1.0, 9.0, 10.0, 3.0]}


def write(folder: Path) -> Path:
    """Write both files; the path of that with the rigid body apart."""
    (folder / "included.toml").write_text(INCLUDED)
    path = folder / "every_symbol.toml"
    path.write_text(SET)
    return path


def content(boat: dict, equations: str) -> dict:
    """A vehicle file like that of `boat` with these equations."""
    return boat | {"equations": equations, "hull": HULL, "coefficients": VALUES}


def vehicle(boat: str) -> str:
    """The text of a vehicle file like that of `boat` with the first set."""
    top, _ = boat.split("[coefficients]")
    parts = {"hull": HULL, "coefficients": VALUES}
    return f'equations = "every_symbol.toml"\n{top}{tomli_w.dumps(parts)}'


def sets() -> tuple[EquationSet, EquationSet]:
    """The set with the rigid body apart, and that whose coefficients contain it."""
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder))
        return load_equations(path), load_equations(path.with_name("included.toml"))


def families() -> tuple[Family, Family]:
    """The two families; the forces of the second come from outside too."""
    apart, included = sets()
    return family(source(apart, None)), family(source(included, None, external=True))
