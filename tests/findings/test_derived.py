"""Derived quantities: the prior beside the posterior, what does not exist, and what hangs on nothing inferred."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support.fins import weaker

import bayesub as bs
from bayesub.findings import derived
from bayesub.inference.baselines import gauss_newton
from bayesub.model.quantities import QUANTITIES, Quantity
from bayesub.report.plots import derived as plot

SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw"))
FREE = ("Xuu", "Yuv", "Yur", "Nuv", "Nur", "Nuu_dr", "Yuu_dr")


def posed(track, free=FREE, **given):
    record = bs.observe(track, SENSOR, np.random.default_rng(3))
    given = {"free": free, "prior": bs.priors.relative_normal(0.25), "dt": 2.0} | given
    return bs.Problem(track.simulator.vehicle, track.simulator.manoeuvre, record, **given)


@pytest.fixture(scope="module")
def problem(spiral_track):
    return posed(spiral_track)


@pytest.fixture(scope="module")
def without_data(problem):
    """Of a posterior that is the prior."""
    return derived.derive(problem, problem.prior.sample(np.random.default_rng(5), 2000), np.random.default_rng(6))


@pytest.fixture(scope="module")
def with_data(problem):
    mode, rng = gauss_newton(problem), np.random.default_rng(7)
    draws = mode.values + rng.standard_normal((1000, problem.n_params)) @ np.linalg.cholesky(mode.covariance).T
    return derived.derive(problem, draws, rng)


def test_without_data_the_posterior_is_the_prior(without_data):
    assert len(without_data.values) > 10
    for name, values in without_data.values.items():
        prior, posterior = (values[which][np.isfinite(values[which])] for which in ("prior", "posterior"))
        assert len(prior) == pytest.approx(len(posterior), abs=0.12 * derived.N_DRAWS), name
        if len(prior):
            assert stats.ks_2samp(prior, posterior).pvalue > 1e-3, name


def test_data_tell_the_turn_and_intervals_hold_the_truth(with_data):
    rows = {row["name"]: row for row in derived.numbers(with_data)["quantities"]}
    assert rows["tactical_diameter_m"]["width_ratio"] < 0.05
    for name in ("tactical_diameter_m", "zigzag_overshoot_deg", "straight_line_stability", "stopping_distance_m"):
        interval = rows[name]["posterior"]
        reach = interval["q95"] - interval["q5"]
        assert interval["q5"] - reach < rows[name]["reference"] < interval["q95"] + reach, name
        assert interval["q5"] < interval["q25"] < interval["median"] < interval["q75"] < interval["q95"]


def test_numbers_are_json_and_a_stable_boat_has_no_loop(with_data):
    found = json.loads(json.dumps(derived.numbers(with_data), allow_nan=False))
    (loop,) = (row for row in found["quantities"] if row["name"] == "spiral_loop_width_deg")
    assert loop["reference"] is None
    assert loop["posterior"] == dict.fromkeys(derived.QUANTILES) | {"share": 0.0}
    assert 0.0 < loop["prior"]["share"] < 1.0
    assert loop["width_ratio"] is None
    assert "no loop" in loop["none"]
    assert found["stable"]["straight_line_stability"]["posterior"] == 1.0
    assert found["stable"]["straight_line_stability"]["prior"] == pytest.approx(1.0 - loop["prior"]["share"], abs=0.02)
    said = derived.sentence(found)
    assert "tactical diameter" in said
    assert "Stable on a straight course with probability 100 %" in said


def test_a_horizontal_trial_says_nothing_of_dives(with_data):
    assert with_data.absent["dive_depth_m"] == derived.CONFINED
    assert "dive_depth_m" not in with_data.values
    assert set(with_data.roots) == {"horizontal"}
    assert len(with_data.spiral[1]["posterior"]) == derived.N_DRAWS


def test_what_follows_from_nothing_inferred_is_said_with_its_value(spiral_track, monkeypatch):
    monkeypatch.setattr(derived, "N_DRAWS", 8)
    problem = posed(spiral_track, free=("Nuu_dr", "Yuu_dr"))
    draws = problem.prior.sample(np.random.default_rng(0), 20)
    found = derived.numbers(derived.derive(problem, draws, np.random.default_rng(1)))
    reasons = {one["name"]: one["reason"] for one in found["absent"]}
    assert reasons["stopping_distance_m"] == f"{derived.HELD}: 301.3"
    assert "straight_line_stability" in reasons
    assert {row["name"] for row in found["quantities"]} >= {"tactical_diameter_m", "zigzag_overshoot_deg"}
    assert "Stable" not in derived.sentence(found)


def test_a_ship_has_no_depth_and_no_stopping_and_says_why(monkeypatch):
    monkeypatch.setattr(derived, "N_DRAWS", 8)
    ship = bs.load_vehicle("mariner")
    track = bs.simulate(ship, bs.load_manoeuvre("turning_circle", ship), sample=10.0)
    problem = posed(track, free=("Yv", "Nr"))
    found = derived.derive(problem, problem.prior.sample(np.random.default_rng(0), 20), np.random.default_rng(1))
    assert found.absent["dive_depth_m"] == "the equations have three degrees of freedom"
    assert "thrust polynomial" in found.absent["stopping_distance_m"]
    assert np.isfinite(found.values["tactical_diameter_m"]["posterior"]).all()


def test_an_unknown_mass_counts(spiral_track, monkeypatch):
    """The boats of a prior differ as those of vehicles whose file has another mass."""
    monkeypatch.setattr(derived, "N_DRAWS", 3)
    mass = spiral_track.simulator.vehicle.body[0]
    problem = posed(spiral_track, free=("Xuu",), nuisance={"mass_kg": bs.priors.normal(mass, 0.1 * mass)})
    found = derived.derive(problem, problem.prior.sample(np.random.default_rng(0), 20), np.random.default_rng(1))
    vehicle, quantity = found.prior.vehicle, QUANTITIES["stopping_distance_m"]
    for k, changes in enumerate(found.prior.body_changes):
        other = replace(vehicle, body=vehicle.body + changes)
        expected = quantity.values(other, found.prior.xi[k])[0]
        assert found.values["stopping_distance_m"]["prior"][k] == pytest.approx(expected, rel=1e-9)
    assert np.ptp(found.prior.body_changes[:, 0]) > 0.0


def test_an_unknown_scale_of_the_rudder_counts(spiral_track, monkeypatch):
    """The boats of a prior differ as those on which the rudder does so much more or less."""
    monkeypatch.setattr(derived, "N_DRAWS", 3)
    nuisance = {"scale_rudder": bs.priors.normal(1.0, 0.2), "bias_rudder_deg": bs.priors.normal(0.0, 1e-12)}
    problem = posed(spiral_track, free=("Xuu",), nuisance=nuisance)
    found = derived.derive(problem, problem.prior.sample(np.random.default_rng(0), 20), np.random.default_rng(1))
    vehicle, prior = found.prior.vehicle, found.prior
    sets = weaker(vehicle, prior.xi, "dr", 1.0 + prior.actuator_changes["scale_rudder"])
    for name in ("tactical_diameter_m", "zigzag_overshoot_deg"):
        expected = QUANTITIES[name].values(vehicle, sets)
        np.testing.assert_allclose(found.values[name]["prior"], expected, rtol=1e-6)
    diameters = found.values["tactical_diameter_m"]
    assert np.ptp(diameters["prior"]) > 0.05 * diameters["reference"][0]


def test_a_quantity_of_ones_own_and_the_picture(problem, monkeypatch, tmp_path):
    monkeypatch.setattr(derived, "N_DRAWS", 40)
    own = Quantity("double_drag_n", "", "Twice the drag.", (), "", lambda boats: -2.0 * boats.xi[:, 0] * 1e6)
    draws = problem.prior.sample(np.random.default_rng(0), 100)
    found = derived.derive(problem, draws, np.random.default_rng(1), [own])
    row = derived.numbers(found)["quantities"][-1]
    assert row["label"] == "double drag (N)"
    assert row["reference"] == pytest.approx(-2e6 * problem.vehicle.xi[0])
    plot.draw([tmp_path / "derived.png"], found, "truth")
    assert (tmp_path / "derived.png").stat().st_size < 80_000


def test_intervals_are_written_to_two_digits_of_their_width():
    assert derived.in_words(640.123, 663.4) == ("640", "663")
    assert derived.in_words(-0.024153, -0.023721) == ("-0.02415", "-0.02372")
    assert derived.in_words(2.0, 2.0) == ("2", "2")


def test_it_is_said_how_many_boats_have_what_is_quoted(with_data):
    """An interval of the third of the prior that has a turn is not one of the prior."""
    numbers = derived.numbers(with_data)
    whole = derived.sentence(numbers)
    assert "which ha" not in whole
    (row,) = (row for row in numbers["quantities"] if row["name"] == "tactical_diameter_m")
    row["prior"]["share"] = 1.0 / 3.0
    assert "of 33 % of the prior, which has one" in derived.sentence(numbers)
    row["posterior"]["share"] = 0.5
    assert "of 50 % of the posterior and 33 % of the prior, which have one" in derived.sentence(numbers)
