"""The simulator against independent numbers: energy, linear stability roots, steady turns, and itself without JIT."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, optimize

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.model.coefficients import NAMES

VEHICLES = ("suboff", "auv690", "npsauv")


def still(duration, state):
    """No controls, no propeller, from a given state."""
    times = np.array([0.0, duration])
    return bs.Manoeuvre("still", times, np.zeros((2, 3)), np.zeros(2), np.asarray(state, dtype=float))


def named(xi):
    return dict(zip(NAMES, xi, strict=True))


@pytest.mark.parametrize("added_mass", [False, True])
def test_energy_is_conserved_where_nothing_dissipates(full, added_mass):
    """A body with every offset and product of inertia, heavier than its buoyancy, in an ideal fluid.

    Without hydrodynamics it is a rigid body; with diagonal added masses and the velocity terms that Kirchhoff's
    equations pair with them (all in the table of 101) the energy is that of body and fluid. Weight acts at CG, buoyancy
    at CB.
    """
    c = dict.fromkeys(NAMES, 0.0)
    if added_mass:
        x, y, z, k, m, n = -0.0005, -0.018, -0.016, -6e-6, -9e-4, -1e-3
        c |= {"Xudot": x, "Yvdot": y, "Zwdot": z, "Kpdot": k, "Mqdot": m, "Nrdot": n}
        c |= {"Xwq": z, "Xvr": -y, "Yur": x, "Ywp": -z, "Zvp": y, "Zuq": -x}
        c |= {"Kvw": z - y, "Kqr": n - m, "Muw": x - z, "Mrp": k - n, "Nuv": y - x, "Npq": m - k}
    body = full.body.copy()
    body[workspace.B1 : workspace.B9 + 1] = body[workspace.KN1] = body[workspace.KN2] = 0.0
    vehicle = replace(full, xi=np.array([c[name] for name in NAMES]), body=body)
    state = [0, 0, 100, 0.3, -0.2, 0.5, 7.5, 0.8, -0.6, 0.02, -0.015, 0.03]
    energies = []
    for dt in (0.125, 0.0625):
        states = bs.simulate(vehicle, still(60.0, state), dt=dt, sample=0.5).states[0]
        energy = kinetic(vehicle, states) + potential(body, states)
        energies.append(np.abs(energy / energy[0] - 1.0).max())
    assert energies[0] < 1e-6
    assert energies[0] / energies[1] > 12  # what is lost is the integrator's fourth-order error
    c["Yuv"] -= 1e-3  # negative control: lift without the moment that goes with it
    damped = replace(vehicle, xi=np.array([c[name] for name in NAMES]))
    states = bs.simulate(damped, still(60.0, state), dt=0.25, sample=0.5).states[0]
    energy = kinetic(vehicle, states) + potential(body, states)
    assert np.abs(energy / energy[0] - 1.0).max() > 1e-4


def kinetic(vehicle, states):
    """Half the velocity of every mass element squared: body about its CG, and the diagonal added masses."""
    m, xg, yg, zg = vehicle.body[[workspace.MASS, workspace.XG, workspace.YG, workspace.ZG]]
    velocity, omega = states[:, 6:9], states[:, 9:]
    of_origin = np.array([xg, yg, zg])
    of_cg = velocity + np.cross(omega, of_origin)
    ixx, iyy, izz, ixy, iyz, izx = vehicle.body[workspace.IXX : workspace.IZX + 1]
    about_origin = np.array([[ixx, -ixy, -izx], [-ixy, iyy, -iyz], [-izx, -iyz, izz]])
    about_cg = about_origin - m * (of_origin @ of_origin * np.eye(3) - np.outer(of_origin, of_origin))
    c = named(vehicle.xi * vehicle.dimensional_factors)
    added = -np.array([c[name] for name in ("Xudot", "Yvdot", "Zwdot", "Kpdot", "Mqdot", "Nrdot")])
    return 0.5 * (
        m * np.sum(of_cg**2, axis=1) + np.einsum("ni,ij,nj->n", omega, about_cg, omega) + states[:, 6:] ** 2 @ added
    )


def potential(body, states):
    """Minus weight times the depth of CG plus buoyancy times the depth of CB."""
    phi, theta = states[:, 3], states[:, 4]
    down = np.stack([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=1)
    cg = states[:, 2] + down @ body[[workspace.XG, workspace.YG, workspace.ZG]]
    cb = states[:, 2] + down @ body[[workspace.XB, workspace.YB, workspace.ZB]]
    return -body[workspace.WEIGHT] * cg + body[workspace.BUOYANCY] * cb


@pytest.mark.parametrize("name", VEHICLES)
def test_small_disturbances_grow_and_decay_with_the_linear_stability_roots(name):
    """Sway and yaw about straight flight: (M - A) [v, r]' = D [v, r], from the derivatives of the vehicle file."""
    vehicle = bs.load_vehicle(name)
    c, u = named(vehicle.xi * vehicle.dimensional_factors), vehicle.speed_mps
    m, izz = vehicle.body[workspace.MASS], vehicle.body[workspace.IZZ]
    inertia = np.array([[m - c["Yvdot"], -c["Yrdot"]], [-c["Nvdot"], izz - c["Nrdot"]]])
    damping = u * np.array([[c["Yuv"], c["Yur"] - m], [c["Nuv"], c["Nur"]]])
    roots, vectors = linalg.eig(damping, inertia)
    time = vehicle.length_m / u
    for root, vector in zip(roots, vectors.T, strict=True):
        assert root.imag == 0.0
        state = np.zeros(12)
        state[6], state[7], state[11] = u, *(1e-7 * u * vector.real / np.abs(vector.real).max())
        spiral = bs.load_manoeuvre("horizontal", vehicle)
        times = np.array([0.0, 3 * time])
        flown = bs.Manoeuvre("free", times, np.zeros((2, 3)), spiral.rpm[:2].copy(), state, "horizontal")
        states = bs.simulate(vehicle, flown, dt=time / 200, sample=time / 10).states[0]
        left = linalg.eig(damping.T, inertia.T)[1][:, np.argmin(np.abs(roots - root))].real @ inertia
        amplitude = states[:, [7, 11]] @ left
        rate = np.log(amplitude[1:] / amplitude[:-1]) / np.diff(np.arange(len(states)) * time / 10)
        # The quadratic terms are 1e-7 of the linear ones; a Runge-Kutta step of T/200 adds less.
        np.testing.assert_allclose(rate, root.real, rtol=1e-5, atol=1e-7 / time)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("rudder_deg", [10.0, 20.0])
def test_a_steady_turn_is_the_algebraic_solution(name, rudder_deg):
    """Long after the rudder is laid, u, v and r solve the horizontal equations without accelerations."""
    vehicle = bs.load_vehicle(name)
    c, m, u0 = named(vehicle.xi * vehicle.dimensional_factors), vehicle.body[workspace.MASS], vehicle.speed_mps
    b = vehicle.body[workspace.B1 : workspace.B9 + 1]
    rudder, time = np.radians(rudder_deg), vehicle.length_m / u0

    def unbalanced(unknown):
        u, v, r = unknown * [u0, u0, 1 / time]
        thrust = b[0] * u * u + b[1] * u * u0 + b[2] * u0 * u0  # the boat slows down in a turn, so n' > 1
        x = c["Xuu"] * u * u + c["Xvv"] * v * v + c["Xuu_drdr"] * (u * rudder) ** 2
        x += c["Xvr"] * v * r + c["Xrr"] * r * r
        y = c["Yuv"] * u * v + c["Yv_absnu"] * v * abs(v) + c["Yuu_dr"] * u * u * rudder + c["Yur"] * u * r
        y += c["Yv_absr"] * v * abs(r)
        n = c["Nuv"] * u * v + c["Nv_absnu"] * v * abs(v) + c["Nuu_dr"] * u * u * rudder + c["Nur"] * u * r
        n += c["Nabsnu_r"] * abs(v) * r + c["Nr_absr"] * r * abs(r)
        force = m * u0**2 / vehicle.length_m
        return np.array([x + thrust + m * v * r, y - m * u * r, n / vehicle.length_m]) / force

    duration = 400 * time
    times = np.array([0.0, time, 1.1 * time, duration])
    controls = np.zeros((4, 3))
    controls[2:, 0] = rudder
    start = np.zeros(12)
    start[6] = u0
    rpm = np.full(4, vehicle.rpm_per_mps * u0)
    turn = bs.Manoeuvre("turn", times, controls, rpm, start, "horizontal")
    states = bs.simulate(vehicle, turn, dt=0.02 * time, sample=0.1 * time).states[0]
    u, v, r = states[-1, [6, 7, 11]]
    guess = [1.05 * u / u0, 0.9 * v / u0, 1.1 * r * time]
    solution, _, found, _ = optimize.fsolve(unbalanced, guess, full_output=True, xtol=1e-13)
    assert found == 1
    np.testing.assert_allclose([u / u0, v / u0, r * time], solution, rtol=1e-7)
    # The track is a circle of that radius: three points of the last turn against sqrt(u^2 + v^2) / r.
    a, q, e = (complex(*states[k, :2]) for k in (-21, -11, -1))
    radius = abs((a - q) * (q - e) * (e - a)) / abs(2 * ((q - a).conjugate() * (e - a)).imag)
    u, v, r = solution * [u0, u0, 1 / time]
    assert radius == pytest.approx(np.hypot(u, v) / abs(r), rel=1e-6)


@pytest.mark.slow
def test_without_jit_the_numbers_are_the_same(tmp_path):
    """The same kernels as plain Python: equal up to fused multiply-adds, that is to round-off."""
    program = (
        "import sys, numpy as np, bayesub as bs\n"
        "boat = bs.load_vehicle('npsauv')\n"
        "spiral = bs.load_manoeuvre('horizontal', boat)\n"
        "sets = boat.xi * (1 + 0.1 * np.random.default_rng(1).standard_normal((3, 101)))\n"
        "from bayesub.model.simulator import Simulator\n"
        "for attitude in ('euler', 'quaternion'):\n"
        "    sim = Simulator(boat, spiral, [0.0, 1.3, 4.0, 6.0], dt=0.5, subproblem=None, attitude=attitude)\n"
        "    states, status = sim.run(sets, parallel=False)\n"
        "    np.save(sys.argv[1] + attitude, states)\n"
    )
    for jit in "01":
        environment = os.environ | {"NUMBA_DISABLE_JIT": "1" if jit == "0" else "0"}
        subprocess.run([sys.executable, "-c", program, tmp_path / f"{jit}-"], env=environment, check=True)
    for attitude in ("euler", "quaternion"):
        plain, compiled = (np.load(tmp_path / f"{jit}-{attitude}.npy") for jit in "01")
        np.testing.assert_allclose(plain, compiled, rtol=1e-11, atol=1e-13)
