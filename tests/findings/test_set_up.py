"""The box at the top of a report says what was done, in the units of the files."""

import dataclasses

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings import set_up
from bayesub.problem import likelihoods
from bayesub.problem.joint import JointProblem
from bayesub.study.provenance import origin

FREE = ("Xuu", "Yuv", "Nuv", "Nur", "Nuu_dr")
SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))


def posed(track, sensors=SENSOR, current_mps=(0.0, 0.0), **given):
    record = bs.observe(track, sensors, np.random.default_rng(0), current_mps=current_mps)
    given = {"free": FREE, "prior": bs.priors.relative_normal(0.25), "dt": 1.0} | given
    return bs.Problem(track.simulator.vehicle, track.simulator.manoeuvre, record, **given)


def test_boat_manoeuvre_sensors_and_equations(spiral_track):
    rows = set_up.rows(posed(spiral_track))
    assert rows["vehicle"].startswith("suboff (DARPA SUBOFF")
    assert "102.3 m long, 7.5 m/s at the start, water of 1025 kg/m³" in rows["vehicle"]
    assert rows["manoeuvre"] == "horizontal (simulated), 600 s"
    assert rows["sensors"] == "x, y: sd 0.5 m, 300 readings, every 2 s; yaw: sd 0.1 deg, 300 readings, every 2 s"
    assert rows["truth"] == "coefficients of the vehicle file"
    assert rows["equations"] == "booth, 101 terms, 5 free, horizontal plane only; integrated in steps of 1 s"
    assert rows["disturbances"] == "none inferred"
    assert "other unknowns" not in rows


def test_noise_models_and_unknowns_in_the_units_of_their_columns(spiral_track):
    noise = {"yaw": likelihoods.AR1(np.radians(0.1), 6.0), "x": likelihoods.StudentT(0.4, 5.0)}
    nuisance = {
        "yaw0_deg": bs.priors.normal(0.0, 1.0),
        "sd_y_m": bs.priors.log_normal(0.5, 0.3),
        "current_north_mps": bs.priors.uniform(-0.2, 0.2),
    }
    sensors = [SENSOR, bs.sensors.Sensor("u_mps", sd=0.01, resolution=0.05, interval_s=5.0)]
    rows = set_up.rows(posed(spiral_track, sensors, (0.1, 0.0), noise=noise, nuisance=nuisance))
    assert rows["sensors"].split("; ") == [
        "x: Student t, sd 0.4 m, 5 degrees of freedom, 300 readings, every 2 s",
        "y: sd 0.5 m, 300 readings, every 2 s",
        "yaw: first-order autoregressive, sd 0.1 deg, correlation time 6 s, 300 readings, every 2 s",
        "u: sd 0.01 m/s, rounded to 0.05 m/s, 120 readings, every 5 s",
    ]
    assert rows["truth"] == "coefficients of the vehicle file, current north (m/s) 0.1"
    assert rows["other unknowns"].split("; ") == [
        "yaw0 (deg): 0 ± 1, normal",
        "sd y (m): 0.5, log-normal with an sd of 30 %",
        "current north (m/s): -0.2 to 0.2, uniform",
    ]


def test_priors(spiral_track):
    """Of every kind, and how far a guess is off: of five coefficients one by 20 %, the middle one by 10 %."""
    boat, priors = spiral_track.simulator.vehicle, bs.priors
    guess = boat.xi.copy()
    guess[boat.equations.columns(FREE)] *= [1.0, 1.0, 0.9, 1.15, 1.2]
    given = priors.Given(priors.relative_uniform(0.75), {"Xuu": priors.normal(-0.001, 1e-4)})
    expected = {
        priors.relative_normal(0.25): "normal with an sd of 25 % about the truth",
        priors.relative_uniform(0.75): "uniform within 75 % about the truth",
        priors.relative_log_normal(0.3): "log-normal with an sd of 30 % about the truth",
        priors.relative_hierarchical(0.25): "log-normal with an unknown sd near 25 %, one for all, about the truth",
    }
    for prior, text in expected.items():
        assert set_up.rows(posed(spiral_track, prior=prior))["prior"] == text
    off = set_up.rows(posed(spiral_track, prior=priors.relative_normal(0.25, guess)))["prior"]
    assert off == "normal with an sd of 25 % about a guess that is off the truth by up to 20 % (median 10 %)"
    text = set_up.rows(posed(spiral_track, prior=given))["prior"]
    assert text == "given one by one for 1 coefficients; uniform within 75 % for the other 4"


def test_trials_by_name_where_they_differ(spiral_track):
    log = posed(spiral_track, bs.sensors.Track(0.5, 0.1, interval_s=4.0, channels=("x", "y", "yaw")))
    record = dataclasses.replace(log.record, truth=None)
    prior = bs.priors.relative_normal(0.25)
    start = {"yaw0_deg": bs.priors.normal(0.0, 1.0)}  # of this trial alone
    log = bs.Problem(log.vehicle, log.manoeuvre, record, free=FREE, prior=prior, nuisance=start, dt=1.0)
    first = bs.Problem(log.vehicle, log.manoeuvre, posed(spiral_track).record, free=FREE, prior=prior, dt=1.0)
    rows = set_up.rows(JointProblem({"first": first, "second": log}))
    assert rows["manoeuvres"] == "first: horizontal (simulated), 600 s; second: horizontal (a log), 600 s"
    assert rows["sensors"].startswith("first: x, y: sd 0.5 m, 300 readings")
    assert "second: x, y: sd 0.5 m, 150 readings" in rows["sensors"]
    assert rows["disturbances"] == "none inferred"
    assert "truth" not in rows
    assert rows["prior"].endswith("about the vehicle file")


def test_unmodelled_forces(spiral_track):
    unknown = bs.UnknownDisturbance(("Y", "N"), {"Y": 1e-5, "N": 1e-6}, 60.0)
    rows = set_up.rows(posed(spiral_track, disturbance=unknown))
    assert rows["disturbances"] == "unknown histories on Y, N, 21 knots each"


def test_what_made_a_run_and_what_an_older_one_says_of_it():
    config = {
        "sources_sha256": "0123456789abcdef",
        "commit": "c0ffee",
        "versions": {"python": "3.11.7", "bayesub": "9.8", "numpy": "2.4"},
        "begun": "2026-11-23 08:00 UTC",
    }
    assert origin(config) == {
        "bayesub": "9.8, commit c0ffee, digest of the sources 0123456789ab",
        "with": "python 3.11.7, numpy 2.4",
        "begun": "2026-11-23 08:00 UTC",
    }
    assert origin({"commit": "unknown", "versions": {"bayesub": "0.1"}}) == {"bayesub": "0.1"}
    assert origin({}) == {}


@pytest.mark.parametrize("name", ["suboff", "remus100"])
def test_dimensional_values_are_those_of_the_simulator(name):
    """A coefficient that is dimensional already stays as it is."""
    boat = bs.load_vehicle(name)
    manoeuvre = bs.load_manoeuvre("turning_circle", boat)
    problem = posed(bs.simulate(boat, manoeuvre, dt=0.1), free=("Xuu", "Yuv"), dt=0.1)
    rows = set_up.dimensional(problem)
    assert [row["si_unit"] for row in rows] == ["kg/m", "kg/m"]
    drag = 0.5 * boat.water_density_kgm3 * boat.length_m**2
    assert rows[0]["si_factor"] == pytest.approx(drag if name == "suboff" else 1.0)
