"""The table of the 101 terms and what is read from it."""

import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support import slow_twin
from support.refusals import refused

import bayesub as bs
from bayesub.model.coefficients import (
    ADDED_MASSES,
    AXES,
    EQUATIONS,
    HORIZONTAL,
    NAMES,
    TERMS,
    VERTICAL,
    columns,
    names_of_axis,
)

# As printed in the model description, section 4.
PRINTED_HORIZONTAL = """
    Xuu Xvv Xuu_drdr Xudot Xvr Xrr Yuu Yuv Yv_absnu Yuu_dr Yvdot Yur Yv_absr Yu_absr_dr Yrdot
    Nuu Nuv Nv_absnu Nuu_dr Nvdot Nur Nabsnu_r Nu_absr_dr Nrdot Nr_absr"""
PRINTED_VERTICAL = """
    Xuu Xww Xuu_dbdb Xuu_dsds Xudot Xwq Xqq Zuu Zuw Zuu_db Zuu_ds Zw_absnu Zu_absw Zabsw_nu Zwdot Zuq Zu_absq_ds
    Zw_absq Zqdot Muu Muw Muu_db Muu_ds Mw_absnu Mu_absw Mabsw_nu Mwdot Muq Mu_absq_ds Mabsnu_q Mqdot Mq_absq"""
PRINTED_ADDED_MASSES = """
    Xudot Yvdot Ypdot Yrdot Zwdot Zqdot Kvdot Kpdot Krdot Mwdot Mqdot Nvdot Npdot Nrdot"""


def test_counts_are_those_of_the_thesis():
    """X 12, Y 18, Z 18, K 16, M 19, N 18 make 101 coefficients with names of their own."""
    assert Counter(term.axis for term in TERMS) == dict(zip("XYZKMN", (12, 18, 18, 16, 19, 18), strict=True))
    assert len(set(NAMES)) == len(NAMES) == 101


def test_printed_lists():
    """25 coefficients in the horizontal plane, 32 in the vertical, 14 added masses: those that are printed."""
    for found, printed, count in (
        (HORIZONTAL, PRINTED_HORIZONTAL, 25),
        (VERTICAL, PRINTED_VERTICAL, 32),
        (ADDED_MASSES, PRINTED_ADDED_MASSES, 14),
    ):
        assert set(found) == set(printed.split())
        assert len(found) == count


def test_dimensions():
    """(rho/2) l^power times its regressor makes every term a force, or a moment on the axes K, M and N."""
    lengths = {"u": 1, "v": 1, "w": 1, "nu": 1, "udot": 1, "vdot": 1, "wdot": 1}  # powers of length; rates have none
    for term in TERMS:
        symbols = re.findall(r"[a-z]+", re.sub(r"sgn\([a-z]+\)|abs", "", term.regressor))
        # rho l^2 (m/s)^2 is a force, and a rate is a velocity over a length; moments have one length more.
        assert term.length_power + sum(lengths.get(symbol, 0) for symbol in symbols) == 4 + (term.axis in "KMN"), (
            term.name
        )


def test_regressors_times_coefficients_are_the_forces(full, boat, motions, rng):
    """The linear form gives the forces of the twin, also the accelerations' share."""
    states, controls, _ = motions
    accelerations = rng.standard_normal((len(states), 6)) * [1, 1, 1, 0.1, 0.01, 0.01]
    blocks = bs.regressors(states, accelerations, controls)
    expected = np.array(
        [
            slow_twin.hydrodynamics(boat, state[6:], acceleration, planes)
            for state, acceleration, planes in zip(states, accelerations, controls, strict=True)
        ]
    )
    dimensional = full.xi * full.dimensional_factors
    for j, axis in enumerate(AXES):
        terms = blocks[axis] * dimensional[columns(names_of_axis(axis))]
        # Round-off of a sum of at most 19 terms.
        assert np.all(np.abs(terms.sum(axis=1) - expected[:, j]) <= 1e-14 * np.abs(terms).sum(axis=1))


def test_look_alikes_differ_in_sign_only_with_v_and_r(motions):
    """sgn(v) nu |r| of Yv_absr and nu r of Nabsnu_r agree where v and r agree in sign, and are opposite elsewhere."""
    states, controls, _ = motions
    blocks = bs.regressors(states, np.zeros((len(states), 6)), controls)
    y = blocks["Y"][:, names_of_axis("Y").index("Yv_absr")]
    n = blocks["N"][:, names_of_axis("N").index("Nabsnu_r")]
    v, r = states[:, 7], states[:, 11]
    np.testing.assert_array_equal(y, np.where(v == 0, 0.0, np.sign(v * r) * n))


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("Yv_absnu", r"$Y'_{v|\nu|}$"),
        ("Xuu_drdr", r"$X'_{uu\delta_r\delta_r}$"),
        ("Nrdot", r"$N'_{\dot{r}}$"),
        ("Zu_absq_ds", r"$Z'_{u|q|\delta_s}$"),
    ],
)
def test_labels(name, label):
    """Labels are in the notation of the field."""
    assert TERMS[NAMES.index(name)].label == label


def test_which_coefficients_play_a_part(suboff, spiral):
    """Those in the equations of the sub-problem, of planes that move, and that are not zero: in that order asked."""
    assert EQUATIONS.active() == NAMES
    for subproblem, names in (("horizontal", HORIZONTAL), ("vertical", VERTICAL)):
        assert EQUATIONS.active(subproblem=subproblem) == names
    resting = replace(spiral, controls=spiral.controls * [1, 0, 1])
    assert not resting.controls[:, 2].any()
    of_planes = {name for name in NAMES if "_db" in name or "_ds" in name}
    assert len(of_planes) == 8
    assert set(EQUATIONS.active(None, resting)) == set(NAMES) - of_planes
    zero = {name for name, value in zip(NAMES, suboff.xi, strict=True) if value == 0}
    assert set(EQUATIONS.active(suboff, resting)) == set(NAMES) - of_planes - zero
    assert EQUATIONS.active(suboff, spiral, "horizontal") == tuple(n for n in HORIZONTAL if n not in zero)


def test_all_ask_the_same(full, coupled):
    """Vehicle, simulator, linear form and problem agree on which coefficients play a part."""
    for subproblem in ("horizontal", "vertical", None):
        flown = replace(coupled, subproblem=subproblem, controls=coupled.controls * [1, 0, 1])
        names = set(EQUATIONS.active(full, flown, subproblem))
        in_equations = set(EQUATIONS.active(subproblem=subproblem))
        track = bs.simulate(full, flown, dt=0.5, sample=1.0)
        assert {name for name, xi in zip(NAMES, full.restricted(subproblem).xi, strict=True) if xi} == in_equations
        assert {NAMES[k] for k in np.flatnonzero(track.simulator.dimensional(full.xi)[0])} == in_equations
        assert {name for system in bs.linear_systems(track).values() for name in system.names} == names
        record = bs.observe(track, bs.sensors.Track(0.5, 0.1), None)
        problem = bs.Problem(full, flown, record, free=NAMES, prior=bs.priors.relative_normal(0.25), dt=0.5)
        assert set(problem.names) == names


def test_regressors_are_the_products_of_their_factors(motions, rng):
    """Each is what Python makes of its formula, to the last bit."""
    states, controls, _ = motions
    accelerations = rng.standard_normal((len(states), 6))
    names = ("u", "v", "w", "p", "q", "r", "udot", "vdot", "wdot", "pdot", "qdot", "rdot", "dr", "db", "ds")
    values = dict(zip(names, np.hstack([states[:, 6:], accelerations, controls]).T, strict=True))
    values |= {"nu": np.hypot(values["v"], values["w"]), "sgn": np.sign, "abs": np.abs}
    blocks = bs.regressors(states, accelerations, controls)
    for term in TERMS:
        column = blocks[term.axis][:, names_of_axis(term.axis).index(term.name)]
        np.testing.assert_array_equal(column, eval(term.regressor, values.copy()))


def test_unknown_coefficient_suggests_the_nearest():
    """A mistyped name is an error that says what was meant."""
    with refused("unknown", "Nabsnur"):
        columns(["Yuv", "Nabsnur"])
