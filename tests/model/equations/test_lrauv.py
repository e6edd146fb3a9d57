"""The vehicle `lrauv` beside the program that its derivatives come from (Raanan 2015), typed here once more.

Its equations are those of Prestero (`support.prestero`) with the derivatives of `vehicle_coeffs.m` and X of `lrauv.m`;
`fins` is `robsFins.m`: lift and drag of each of four fins by the flow at it, without limits of small angles.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import prestero

import bayesub as bs
from bayesub.model.manoeuvres import Manoeuvre

DENSITY, AREA, SLOPE, ASPECT, CROSS_FLOW, DRAG, OSWALD = 1025.0, 1.15e-2, 4.13, 6.5, 0.6, 0.03, 0.9
FINS = [(-0.633, 0.012, -0.152), (-0.633, -0.152, 0.0), (-0.633, 0.012, 0.152), (-0.633, 0.152, 0.0)]  # m
ADDED, LEVER, MUNK = 126.324739, 7.117842, 105.660262
C = {"Xuu": -6.2282, "Xudot": -4.876161, "Xwq": -ADDED, "Xqq": LEVER, "Xvr": ADDED, "Xrr": LEVER, "Xprop": 6.2282}
C |= {"Yvv": -601.274653, "Yrr": 0.0, "Yuv": -23.954759, "Yvdot": -ADDED, "Yrdot": -LEVER, "Yur": 8.719853}
C |= {"Ywp": ADDED, "Ypq": -LEVER, "Yuudr": 0.0, "Zww": -601.274653, "Zqq": 0.0, "Zuw": -23.954759, "Zwdot": -ADDED}
C |= {"Zqdot": LEVER, "Zuq": -8.719853, "Zvp": -ADDED, "Zrp": -LEVER, "Zuuds": 0.0, "Kpp": -0.191601, "Kpdot": 0.0}
C |= {"Kprop": 0.23, "Mww": -58.113144, "Mqq": -632.698957, "Muw": MUNK, "Mwdot": LEVER, "Mqdot": -33.463086}
C |= {"Muq": -61.182063, "Mvp": LEVER, "Mrp": 33.463086, "Muuds": 0.0, "Nvv": 58.113144, "Nrr": -632.698957}
C |= {"Nuv": -MUNK, "Nvdot": -LEVER, "Nrdot": -33.463086, "Nur": -61.182063, "Nwp": LEVER, "Npq": -33.463086}
C |= {"Nuudr": 0.0}
Xvv = Xww = -54.370919


@pytest.fixture(autouse=True)
def _body(monkeypatch):
    """Mass, weight and inertia of the program in the equations of Prestero."""
    for name, value in {"MASS": 147.8671, "ZG": 0.006794, "IXX": 3.0, "IYY": 41.980233, "IZZ": 41.980233}.items():
        monkeypatch.setattr(prestero, name, value)
    monkeypatch.setattr(prestero, "WEIGHT", 147.8671 * 9.81)


def fins(state, rudder, elevator):
    """Forces (3,) and moments (3,) of the fins: lower, port, upper, starboard; 1 and 3 are the rudder."""
    total = np.zeros(6)
    for k, place in enumerate(FINS):
        u, v, w = state[:3] + np.cross(state[3:6], place)
        angle, attack = (rudder, rudder - v / u) if k % 2 == 0 else (elevator, elevator + w / u)
        lift = SLOPE * attack + CROSS_FLOW / ASPECT * attack * abs(attack)
        drag = DRAG + lift**2 / (np.pi * ASPECT * OSWALD)
        pressure = 0.5 * DENSITY * AREA * (u**2 + v**2 + w**2)
        normal = pressure * (lift * np.cos(attack) + drag * np.sin(attack))
        aft = pressure * (drag * np.cos(attack) - lift * np.sin(attack))
        across, ahead = normal * np.cos(angle) - aft * np.sin(angle), -normal * np.sin(angle) - aft * np.cos(angle)
        force = [ahead, across, 0.0] if k % 2 == 0 else [ahead, 0.0, -across]
        total += [*force, *np.cross(place, force)]
    return total


def derivative(state, rudder, elevator):
    forces = prestero.forces(state, rudder, elevator, C, prestero.WEIGHT) + fins(state, rudder, elevator)
    forces[0] += Xvv * state[1] ** 2 + Xww * state[2] ** 2
    return np.array([*np.linalg.solve(prestero.mass_matrix(C), forces), *prestero.rates(state)])


def test_accelerations_are_those_of_the_program(rng):
    """In small motions, but for the drag of the fins: 0.7 N at 1 m/s and what grows with the square of their lift."""
    boat = bs.load_vehicle("lrauv")
    states = rng.normal(size=(50, 12)) * [1, 1, 1, 0.3, 0.3, 2, 0, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3]
    states[:, 6] = rng.uniform(0.7, 1.3, 50)
    controls = rng.uniform(-2e-3, 2e-3, (50, 2))
    ours = bs.accelerations(boat, states, controls, 283.0)
    theirs = np.array([derivative([*s[6:], *s[:6]], *c)[:6] for s, c in zip(states, controls, strict=True)])
    drag = 4.0 * 0.5 * DENSITY * AREA * DRAG * states[:, 6] ** 2 / (147.8671 + 4.876161)
    np.testing.assert_allclose(ours[:, 0] - drag, theirs[:, 0], atol=2e-5)
    np.testing.assert_allclose(ours[:, 1:], theirs[:, 1:], atol=2e-4)


@pytest.mark.parametrize(("rudder", "elevator"), [(10.0, 0.0), (-5.0, 3.0)])
def test_it_turns_and_dives_as_in_the_program(rudder, elevator):
    """Rate of turn, speed and depth after 60 s within 5 per cent."""
    boat = bs.load_vehicle("lrauv")
    times = np.arange(0.0, 60.05, 0.1)
    controls, initial = np.radians(np.tile([rudder, elevator], (len(times), 1))), np.zeros(12)
    initial[6] = 1.0
    columns = tuple(control.short for control in boat.equations.controls)
    trial = Manoeuvre("step", times, controls, np.full(len(times), 283.0), initial, columns=columns)
    ours = bs.simulate(boat, trial, dt=0.1).states[0, -1]
    theirs = solve_ivp(lambda _, s: derivative(s, *controls[0]), (0.0, 60.0), [1.0, *[0.0] * 11], rtol=1e-6).y[:, -1]
    np.testing.assert_allclose(ours[[6, 11]], theirs[[0, 5]], rtol=0.05)
    np.testing.assert_allclose(ours[2], theirs[8], rtol=0.05, atol=0.1)
