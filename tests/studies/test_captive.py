"""Captive runs: forces by a second computation, tables that come back, a posterior in closed form, and ranks."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.design.captive import known_by
from bayesub.model.equations import AXES
from captive.runs import BALANCE, TEXTBOOK, TWO, Knowledge, Tank, catalogue, choose, write


@pytest.fixture(scope="module")
def tank():
    return Tank(bs.load_vehicle("suboff"), catalogue())


def test_forces_are_those_that_hold_the_boat_in_a_steady_turn(tank):
    """Force of the hull = rigid-body inertia of the free boat there, less hydrostatics and propulsion.

    The free boat's accelerations give it the other way round: with M the whole mass matrix and a boat without
    coefficients, M a - M0 a0 is what the coefficients do.
    """
    boat = tank.boat
    k = next(k for k, run in enumerate(tank.runs) if run.kind == "rotating arm" and run.velocities[0, 1] != 0.0)
    run, states = tank.runs[k], np.zeros((1, 12))
    states[0, 6:] = run.velocities[0] * np.repeat([boat.speed_mps, boat.speed_mps / boat.length_m], 3)
    controls = np.array([run.planes])
    rpm = boat.rpm_per_mps * boat.speed_mps
    mass = boat.kernels(None).mass_matrix
    bare = boat.xi * 0.0
    factors = boat.dimensional_factors

    def load(xi):
        rates = bs.accelerations(replace(boat, xi=xi), states, controls, rpm, controls)[0]
        return mass(xi * factors, boat.body) @ rates

    expected = load(boat.xi) - load(bare)
    scale = 0.5 * boat.water_density_kgm3 * boat.speed_mps**2 * boat.length_m**2
    units = scale * np.repeat([1.0, boat.length_m], 3)
    found = units * [tank.matrices[k][axis][0] @ boat.xi[tank.columns[axis]] for axis in AXES]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-6 * np.abs(expected).max())


def test_a_usual_tank_misses_products_of_two_rotations_only(tank):
    ranks = [
        sum(int(np.count_nonzero(s > 1e-9)) for s in tank.spectra(k).values()) for k in (TEXTBOOK, (*TEXTBOOK, TWO))
    ]
    assert ranks == [92, 101]
    unseen = [t.regressor for t in tank.boat.equations.terms if t.regressor in ("r*p", "p*q", "q*r")]
    assert len(unseen) == 9


def test_a_table_comes_back_and_gives_the_truth_without_errors(tank, tmp_path, rng):
    """With a wide prior; with errors the mean is the truth within its sds."""
    boat = tank.boat
    chosen = list(range(0, len(tank.runs), 2))
    names = [n for n, x in zip(boat.equations.names, boat.xi, strict=True) if x]
    places = boat.equations.columns(names)
    exact = [{a: m[a] @ boat.xi[tank.columns[a]] for a in AXES} for m in (tank.matrices[k] for k in chosen)]
    write(tmp_path / "captive.csv", tank, chosen, exact)
    sizes = np.where(boat.xi == 0.0, np.nan, np.abs(boat.xi))
    guess = boat.xi * (1.0 + 0.3 * rng.standard_normal(len(boat.xi)))
    known, _, _ = known_by(replace(boat, xi=guess, sd=1e6 * sizes), tmp_path / "captive.csv")
    assert known.names == tuple(names)
    narrow = known.sd < 10.0 * sizes[places]
    assert narrow.sum() > 70
    np.testing.assert_allclose(known.mean[narrow], boat.xi[places][narrow], rtol=1e-5)
    write(tmp_path / "noisy.csv", tank, chosen, [tank.measure(k, boat.xi, rng) for k in chosen])
    known, _, _ = known_by(replace(boat, xi=guess, sd=sizes), tmp_path / "noisy.csv")
    z = (known.mean - boat.xi[places]) / known.sd
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.3


def test_knowledge_is_that_of_the_whole_table(tank):
    """Run after run, against one inversion; the best first is at least as good as any other."""
    names = list(tank.boat.equations.names)
    scales = np.where(tank.boat.xi == 0.0, 1e-4, np.abs(tank.boat.xi))
    rows = [tank.rows(k, names, scales) for k in (0, 40, 150, 200)]
    prior = Knowledge(0.0625 * np.eye(len(names)))
    state = prior
    for some in rows:
        state = state.after(some)
    whole = np.concatenate(rows)
    inverse = np.linalg.inv(np.eye(len(names)) / 0.0625 + whole.T @ whole)
    np.testing.assert_allclose(state.covariance, inverse, rtol=0.0, atol=1e-10)
    (first,), states = choose(prior, rows, 1, 0.05)
    worths = [prior.worth(some, 0.05) for some in rows]
    assert first == int(np.argmin(worths))
    after = np.maximum(states[-1].sds, 0.05)
    assert np.mean(np.log(after)) == pytest.approx(worths[first], abs=1e-9)


def test_the_balance_errs_by_its_share_of_the_largest_force(tank):
    largest = max(np.abs(m["N"] @ tank.boat.xi[tank.columns["N"]]).max() for m in tank.matrices)
    assert tank.sds["N"] == pytest.approx(BALANCE * largest)
