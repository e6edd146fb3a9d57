"""Coefficients in the conventions of other simulators: forces are ours, and nothing is left out unsaid."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import simulator_conventions as conventions
from bayesub.study.after.knowledge import of_moments

KNOWN = of_moments(("Xuu", "Nuv"), np.array([-0.0011, -0.013]), np.diag([1e-5, 1e-3]) ** 2)


def written(kind, vehicle, known=KNOWN, source="test"):
    return conventions.written(kind, conventions.Boat(vehicle, known), source)


def struct(text):
    """The numbers of a Matlab script that makes a struct: name -> value."""
    pairs = re.findall(r"(?m)^vehicle\.(\w+)\s*= ([-\d.e+]+);", text)
    return {name: float(value) for name, value in pairs}


def matrix(text, name):
    block = re.search(rf"vehicle\.{name} = \[\n(.*?)\];", text, re.DOTALL)[1]
    return np.array([[float(x) for x in line.split()] for line in block.strip().splitlines()])


def healey_lienard(c, x, controls, length, rho):
    """Forces of the hull that npsauv.m has, written from the paper's equations (Healey & Lienard 1993, eqs. 1 to 6).

    Without mass, weight, cross-flow, and the race of the propeller; each bow plane has half of the coefficient.
    """
    u, v, w, p, q, r = x
    dr, db, ds = controls
    g = lambda name: c.get(name, 0.0)  # noqa: E731
    r2, r3, r4, r5 = (0.5 * rho * length**k for k in (2, 3, 4, 5))
    side = r4 * (g("Ypq") * p * q + g("Yqr") * q * r)
    side += r3 * (g("Yp") * u * p + g("Yr") * u * r + g("Yvq") * v * q + g("Ywp") * w * p + g("Ywr") * w * r)
    side += r2 * (g("Yv") * u * v + g("Yvw") * v * w + g("Ydr") * u * u * dr)
    down = r4 * (g("Zpp") * p * p + g("Zpr") * p * r + g("Zrr") * r * r)
    down += r3 * (g("Zq") * u * q + g("Zvp") * v * p + g("Zvr") * v * r)
    down += r2 * (g("Zw") * u * w + g("Zvv") * v * v + u * u * (g("Zds") * ds + 2.0 * g("Zdb2") * db))
    yaw = r5 * (g("Npq") * p * q + g("Nqr") * q * r)
    yaw += r4 * (g("Np") * u * p + g("Nr") * u * r + g("Nvq") * v * q + g("Nwp") * w * p + g("Nwr") * w * r)
    yaw += r3 * (g("Nv") * u * v + g("Nvw") * v * w + g("Ndr") * u * u * dr)
    surge = r4 * (g("Xpp") * p * p + g("Xqq") * q * q + g("Xrr") * r * r + g("Xpr") * p * r)
    surge += r3 * (g("Xwq") * w * q + g("Xvp") * v * p + g("Xvr") * v * r)
    surge += r3 * u * (q * (g("Xqds") * ds + 2.0 * g("Xqdb2") * db) + g("Xrdr") * r * dr)
    surge += r2 * (g("Xvv") * v * v + g("Xww") * w * w - g("Cd0") * u * u)
    surge += r2 * u * (v * g("Xvdr") * dr + w * (g("Xwds") * ds + 2.0 * g("Xwdb2") * db))
    surge += r2 * u * u * (g("Xdsds") * ds * ds + g("Xdrdr") * dr * dr)
    return {"X": surge, "Y": side, "Z": down, "N": yaw}


@pytest.mark.parametrize("name", ["suboff", "npsauv", "auv690"])
def test_forces_in_the_convention_of_mss_are_ours(name, rng):
    """Ours with the terms without counterpart set to zero; the coefficients that are known take part."""
    vehicle = bs.load_vehicle(name)
    text = written("mss", vehicle)
    c, boat = struct(text), conventions.Boat(vehicle, KNOWN)
    assert c["Cd0"] == pytest.approx(0.0011)
    without = {line.split()[1] for line in text.split("Without counterpart:")[1].strip().splitlines()}
    xi = np.array([0.0 if n in without else x for n, x in zip(vehicle.equations.names, boat.xi, strict=True)])
    states = np.zeros((1, 12))
    states[0, 6:] = vehicle.speed_mps * rng.uniform(0.5, 1.0, 6) * [1.0, 0.2, 0.2, 0.01, 0.01, 0.01]
    by_column = dict(zip(conventions._COLUMNS.values(), rng.uniform(-0.2, 0.2, 3), strict=True))
    controls = [[*(by_column.get(control.column, 0.0) for control in vehicle.equations.controls), 0.0]]
    columns = vehicle.equations.regressors(states, np.zeros((1, 6)), controls, vehicle.constants)
    planes = [by_column[conventions._COLUMNS[key]] for key in ("dr", "db", "ds")]
    of_mss = healey_lienard(c, states[0, 6:], planes, vehicle.length_m, vehicle.water_density_kgm3)
    for axis, force in of_mss.items():
        places = vehicle.equations.columns(vehicle.equations.names_of_axis(axis))
        ours = columns[axis][0] @ (xi * vehicle.dimensional_factors)[places]
        assert force == pytest.approx(ours, rel=1e-6), axis


def test_masses_are_those_of_the_boat():
    """M = MRB + MA, in Matlab, JSON and Python alike."""
    vehicle = bs.load_vehicle("npsauv")
    text, content = written("mss", vehicle), json.loads(written("mss-json", vehicle))
    for one in (matrix(text, "MRB") + matrix(text, "MA"), np.array(content["MRB"]) + content["MA"]):
        np.testing.assert_allclose(one, vehicle.mass_matrix, rtol=1e-8, atol=1e-6)
    rows = {row["name"]: row for row in content["coefficients"]}
    assert rows["Nv"]["value"] == -0.013
    assert rows["Nv"]["sd"] == pytest.approx(1e-3)
    assert rows["Yv"]["sd"] is None
    named = {row["from"] for row in rows.values()} | {row["name"] for row in content["without_counterpart"]}
    assert {n for n, x in zip(vehicle.equations.names, vehicle.xi, strict=True) if x != 0.0} <= named


def test_a_remus_of_pythonvehiclesimulator_becomes_the_boat():
    """Its formulas with what `apply` sets: drag ahead, and forces and moments of both fins, are ours."""
    vehicle = bs.load_vehicle("suboff")
    module = {}
    exec(compile(written("pvs", vehicle), "boat.py", "exec"), module)
    remus = SimpleNamespace(S=0.2, A_r=0.005, A_s=0.01, MRB=np.eye(6), MA=np.eye(6))
    module["apply"](remus)
    xi = dict(zip(vehicle.equations.names, (vehicle.xi * vehicle.dimensional_factors).tolist(), strict=True))
    drag = 0.0011 / 0.001 * xi["Xuu"]
    u, dr, ds = 5.0, 0.1, -0.07
    assert -0.5 * 1026.0 * u**2 * remus.S * remus.CD_0 == pytest.approx(drag * u**2, rel=1e-6)
    rudder = -0.5 * remus.rho * u**2 * remus.A_r * remus.CL_delta_r * -dr  # positive to the other side
    assert (rudder, remus.x_r * rudder) == pytest.approx((xi["Yuu_dr"] * u**2 * dr, xi["Nuu_dr"] * u**2 * dr), rel=1e-6)
    plane = -0.5 * remus.rho * u**2 * remus.A_s * remus.CL_delta_s * ds
    assert (plane, remus.x_s * plane) == pytest.approx((xi["Zuu_ds"] * u**2 * ds, xi["Muu_ds"] * u**2 * ds), rel=1e-6)
    np.testing.assert_allclose(remus.Minv @ vehicle.mass_matrix, np.eye(6), atol=1e-6)


def test_a_set_of_three_degrees_of_freedom_leaves_the_masses_of_heave_roll_and_pitch():
    vehicle = bs.load_vehicle("mariner")
    module, own, moving = {}, np.diag(np.arange(1.0, 7.0)), np.ix_([0, 1, 5], [0, 1, 5])
    known = of_moments(vehicle.equations.names[:1], vehicle.xi[:1], np.eye(1) * 1e-12)
    exec(compile(written("pvs", vehicle, known), "boat.py", "exec"), module)
    remus = SimpleNamespace(S=0.2, A_r=0.005, A_s=0.01, MRB=own.copy(), MA=own.copy())
    module["apply"](remus)
    np.testing.assert_array_equal(remus.MA[[2, 3, 4]], own[[2, 3, 4]])
    np.testing.assert_allclose(remus.M[moving], vehicle.mass_matrix[moving], rtol=1e-8)


@pytest.mark.parametrize("name", ["remus100", "mariner", "phoenix", "slocum_comet", "npsauv_crossflow"])
def test_boats_of_other_equations(name):
    """Of no set is anything said that it has not; every term that is not zero is named."""
    vehicle = bs.load_vehicle(name)
    known = of_moments(vehicle.equations.names[:1], vehicle.xi[:1], np.eye(1) * 1e-12)
    text = written("mss", vehicle, known, "a 'quoted' source")
    for n, x in zip(vehicle.equations.names, vehicle.xi, strict=True):
        if x != 0.0 and n not in vehicle.equations.added_masses:
            assert re.search(rf"\b{re.escape(n)}\b", text), n
    compile(written("pvs", vehicle, known), "boat.py", "exec")
    json.loads(written("mss-json", vehicle, known))
    if vehicle.equations.rigid_body_terms == "in_coefficients":
        assert "velocity terms of the rigid body are part" in text
