"""Coefficients in the conventions of other simulators: forces are ours, and nothing is left out unsaid."""

import json
import re
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import simulator_conventions as conventions
from bayesub.study.after.knowledge import of_moments

ROOT = Path(__file__).parents[2]
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


def fly_mss(text, vehicle, manoeuvre, times):
    """Track (n, 2) in the plane by the forces of npsauv.m and the masses of the file; the thrust is that of suboff."""
    c, length, rho = struct(text), vehicle.length_m, vehicle.water_density_kgm3
    inverse = np.linalg.inv((matrix(text, "MRB") + matrix(text, "MA"))[np.ix_([0, 1, 5], [0, 1, 5])])
    b1, b2, b3 = -0.00072709, -0.0033326, 0.0050597  # of suboff.toml, above and below self-propulsion
    rudder, n = manoeuvre.log["delta_r"], 7.5  # m/s, n/k0

    def slope(time, state):
        _, _, psi, u, v, r = state
        dr = np.interp(time, manoeuvre.times, rudder)
        f = healey_lienard(c, (u, v, 0.0, 0.0, 0.0, r), (dr, 0.0, 0.0), length, rho)
        thrust = 0.5 * rho * length**2 * (b1 * u * u + b2 * u * n + b3 * n * n)
        sums = np.array([f["X"] + thrust + c["mass"] * v * r, f["Y"] - c["mass"] * u * r, f["N"]])
        turned = [u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r]
        return np.concatenate([turned, inverse @ sums])

    state = np.array([0.0, 0.0, 0.0, vehicle.speed_mps, 0.0, 0.0])
    track = [state[:2]]
    for time, dt in zip(times[:-1], np.diff(times), strict=True):
        a = slope(time, state)
        b = slope(time + 0.5 * dt, state + 0.5 * dt * a)
        d = slope(time + 0.5 * dt, state + 0.5 * dt * b)
        e = slope(time + dt, state + dt * d)
        state = state + dt / 6.0 * (a + 2.0 * b + 2.0 * d + e)
        track.append(state[:2])
    return np.array(track)


@pytest.mark.parametrize("name", ["zigzag_10_10", "zigzag_20_20", "turning_circle"])
def test_a_boat_flies_by_npsauv_as_simulated(suboff, name):
    """Terms with counterparts repeat the track in the plane to 0.1 % of the path; a wrong yaw moment does not."""
    known = of_moments(suboff.equations.names[:1], suboff.xi[:1], np.eye(1) * 1e-12)
    boat = conventions.Boat(suboff, known)
    text = conventions.written("mss", boat, "test")
    xi = boat.xi.copy()
    xi[suboff.equations.columns([row["from"] for row in boat.others({"": ""})])] = 0.0
    manoeuvre = bs.load_manoeuvre(name, suboff)
    flown = bs.simulate(suboff, manoeuvre, xi=xi, sample=0.5)
    ours = flown.states[0, :, :2]
    way = np.linalg.norm(np.diff(ours, axis=0), axis=1).sum()
    assert np.linalg.norm(fly_mss(text, suboff, manoeuvre, flown.times) - ours, axis=1).max() < 1e-3 * way
    value = re.search(r"vehicle\.Ndr\s*= (\S+);", text)[1]
    wrong = text.replace(f"= {value};", f"= {1.05 * float(value):.9g};")
    assert np.linalg.norm(fly_mss(wrong, suboff, manoeuvre, flown.times) - ours, axis=1).max() > 1e-3 * way


def test_losses_are_distances_from_the_track(suboff):
    """Each that of a simulation without the term, and one without all; a boat of which nothing is lost loses none."""
    known = of_moments(suboff.equations.names[:1], suboff.xi[:1], np.eye(1) * 1e-12)
    manoeuvre = bs.load_manoeuvre("zigzag_20_20", suboff)
    lost = conventions.losses("mss", conventions.Boat(suboff, known), [manoeuvre])
    assert {"Yv_absnu", "Yv_absr", ""} < lost.keys()
    sample = manoeuvre.duration / 500

    def track(*names):
        xi = suboff.xi.copy()
        xi[suboff.equations.columns(names)] = 0.0
        return bs.simulate(suboff, manoeuvre, xi=xi, sample=sample).states[0, :, :3]

    for names in (("Yv_absnu",), ("Yv_absr",), tuple(lost.keys() - {""})):
        far = np.linalg.norm(track(*names) - track(), axis=1).max()
        assert lost[names[0] if len(names) == 1 else ""] == pytest.approx([far], rel=1e-6)
    assert all(lost[name] == [0.0] for name in lost if name and suboff.equations.term(name).axis in "ZKM")
    text = conventions.written("mss", conventions.Boat(suboff, known, lost), "test", [manoeuvre])
    named = re.findall(r"(?m)^% (\w+) = .*; ([\d.e+-]+) m$", text)
    assert len(named) == len(lost) - 1
    sizes = [float(metres) for _, metres in named]
    assert sizes == sorted(sizes, reverse=True)
    assert "on zigzag_20_20; without all" in text
    rov = bs.load_vehicle("bluerov2")
    own = of_moments(rov.equations.names[:1], rov.xi[:1], np.eye(1) * 1e-12)
    assert conventions.standard(rov) == []
    steps = bs.load_manoeuvre(ROOT / "studies" / "trial" / "rov_thrusters.toml", rov)
    assert conventions.losses("gazebo", conventions.Boat(rov, own), [steps]) == {"": [0.0]}


def test_a_torpedo_of_holoocean_has_the_drag_and_the_fins_of_the_boat():
    """By its formulas: drag rho/2 Cd pi (diam/2)^2 V^2 ahead, and two fins of rho/2 a CL delta V^2 each."""
    remus = bs.load_vehicle("remus100")
    known = of_moments(remus.equations.names[:1], remus.xi[:1], np.eye(1) * 1e-12)
    agent = json.loads(written("holoocean", remus, known))
    d, a, speed, delta = agent["dynamics"], agent["actuator"], 1.3, 0.1
    drag = 0.5 * d["rho"] * d["Cd"] * np.pi * (0.5 * d["diam"]) ** 2 * speed**2
    assert drag == pytest.approx(1.62 * speed**2, rel=1e-9)
    fins = 2 * 0.5 * d["rho"] * a["fin_area"] * a["CL_delta"] * delta * speed**2
    assert fins == pytest.approx(9.64 * delta * speed**2, rel=1e-9)
    spheroid = 4.0 / 3.0 * np.pi * d["rho"] * 0.5 * d["length"] * (0.5 * d["diam"]) ** 2
    assert spheroid == pytest.approx(d["mass"], rel=1e-9)
    named = {row["name"] for row in agent["without_counterpart"]}
    nonzero = {n for n, x in zip(remus.equations.names, remus.xi, strict=True) if x}
    assert named == nonzero - {"Xuu", "Yuudr"}


def test_stonefish_gets_mass_and_inertia_and_says_that_it_takes_no_coefficients():
    remus = bs.load_vehicle("remus100")
    known = of_moments(remus.equations.names[:1], remus.xi[:1], np.eye(1) * 1e-12)
    text = written("stonefish", remus, known)
    body = ElementTree.fromstring(text)
    assert float(body.find("mass").get("value")) == pytest.approx(remus.body[0])
    shift = remus.body[0] * 0.0196**2  # Steiner: the file has it about the centre of gravity
    inertia = [float(x) for x in body.find("inertia").get("xyz").split()]
    np.testing.assert_allclose(inertia, [0.177 - shift, 3.45 - shift, 3.45], rtol=1e-8)
    assert body.find("cg").get("xyz") == "0 0 0.0196"
    assert "takes no hydrodynamic coefficients" in text
    assert all(f"{n} = " in text for n, x in zip(remus.equations.names, remus.xi, strict=True) if x)
