"""The step of a fit: no longer than its sensors allow, and no shorter."""

from itertools import product

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.model import simulator
from bayesub.model.coefficients import NAMES
from bayesub.model.simulator import MAX_STEPS, Simulator, steps, true_step
from bayesub.problem import problem as module
from bayesub.problem.likelihoods import Normal
from bayesub.problem.problem import Problem
from bayesub.sensors import unread
from thesis.cases import VEHICLES

PRIOR = bs.priors.relative_normal(0.25)
TIGHT = bs.sensors.DVL(sd_mps=0.001)
LOOSE = bs.sensors.Track(0.5, 0.1)
N_FRESH = 24  # draws of the prior that the choice has not seen


def posed(vehicle, sensors, manoeuvre="horizontal", prior=PRIOR, **given) -> Problem:
    """A problem whose readings are still to come."""
    boat = bs.load_vehicle(vehicle) if isinstance(vehicle, str) else vehicle
    flown = bs.load_manoeuvre(manoeuvre, boat)
    return Problem(boat, flown, unread(sensors, flown.duration), free=NAMES, prior=prior, **given)


def at(problem, step) -> Problem:
    """The same problem with another step."""
    given = {"nuisance": problem.nuisance_priors, "prior": problem.spread, "dt": step}
    return Problem(
        problem.vehicle, problem.manoeuvre, problem.record, free=problem.names[: problem.n_coefficients], **given
    )


def error(problem) -> float:
    """The largest of the step, in standard deviations of the readings: fresh draws against a step 20 times finer."""
    draws = problem.prior.sample(np.random.default_rng(2026), N_FRESH)
    coarse, fine = (p.predicted(draws) for p in (problem, at(problem, problem.simulator.step / 20)))
    assert np.array_equal(np.isfinite(coarse), np.isfinite(fine))
    return float(np.nanmax(np.abs(coarse - fine) / problem.sds))


@pytest.mark.parametrize(("vehicle", "sensors"), list(product(VEHICLES, (TIGHT, LOOSE))))
def test_the_error_is_below_a_tenth_of_every_sd(vehicle, sensors):
    assert error(posed(vehicle, sensors)) < 0.1


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_in_six_degrees_of_freedom_too(vehicle):
    """Where forces jump and the error of the method falls as slowly as the step."""
    assert error(posed(vehicle, LOOSE, "coupled")) < 0.1


def test_the_next_longer_step_does_not_do():
    """The choice is not shorter than it need be, but for the factor of two that a kink may cost."""
    problem = posed("npsauv", TIGHT)
    ladder = steps(problem.vehicle, problem.manoeuvre)
    longer = ladder[ladder.index(problem.simulator.step) - 1]
    assert error(at(problem, longer)) > 0.25 * module.TOLERANCE


def test_sensors_that_see_more_ask_for_a_shorter_step():
    """Down to the track of a micrometre, and a loose one gets the longest there is: a tenth of a ship length."""
    sensors = [bs.sensors.Track(sd, 100.0 * sd, channels=("x", "y", "yaw")) for sd in (10.0, 0.05, 1e-3, 1e-6)]
    chosen = [posed("npsauv", sensor).simulator.step for sensor in sensors]
    assert chosen == sorted(chosen, reverse=True)
    assert len(set(chosen)) == len(chosen)
    assert chosen[0] == 0.2 <= 0.1 * 5.3 / 1.8


def test_the_former_rule_would_not_do():
    """Position within 5 cm for the vehicle itself, which a tight sensor and a draw from the prior refute."""
    problem = posed("auv690", TIGHT, "coupled")
    former = Simulator(problem.vehicle, problem.manoeuvre, [1.0]).step
    assert problem.simulator.step < former
    assert error(at(problem, former)) > module.TOLERANCE
    assert error(problem) < module.TOLERANCE


def test_the_noise_model_counts_and_not_the_sensor():
    """A model of the noise that is given takes the place of what the sensor says."""
    names = [channel.name for channel in posed("npsauv", LOOSE, dt=0.2).record.channels]
    tight = {name: Normal(1e-5) for name in names}
    assert posed("npsauv", LOOSE, noise=tight).simulator.step < posed("npsauv", LOOSE).simulator.step


def test_an_unknown_sd_counts_as_the_prior_draws_it():
    nuisance = {"sd_x_m": bs.priors.log_normal(1e-5, 0.1)}
    assert posed("npsauv", LOOSE, nuisance=nuisance).simulator.step < posed("npsauv", LOOSE).simulator.step


def test_an_unknown_sd_may_have_a_prior_that_reaches_below_zero():
    """There the density is zero, and no step need be short for it."""
    nuisance = {"sd_x_m": bs.priors.normal(0.5, 0.5)}
    assert posed("npsauv", LOOSE, nuisance=nuisance).simulator.step >= 0.02


def test_rounding_without_noise_has_the_sd_of_its_interval():
    """A resolution of a metre counts as 0.29 m."""
    coarse, fine = (
        posed("npsauv", bs.sensors.Sensor("x_m", resolution=resolution)).simulator.step for resolution in (1.0, 1e-3)
    )
    assert fine < coarse
    noisy = posed("npsauv", bs.sensors.Sensor("x_m", sd=1.0 / np.sqrt(12.0)))
    assert noisy.simulator.step == coarse


def test_a_sensor_far_from_the_origin_counts_its_lever_arm():
    """A kilometre ahead, a velocity is a turn rate."""
    near, far = (
        posed("npsauv", bs.sensors.Sensor("v_mps", sd=0.05, lever_arm_m=arm)).simulator.step
        for arm in (None, (1000.0, 0.0, 0.0))
    )
    assert far < near


def test_the_choice_is_reproducible_and_takes_no_random_number_from_anyone():
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    assert posed("auv690", TIGHT).simulator.step == posed("auv690", TIGHT).simulator.step
    np.testing.assert_array_equal(state, np.random.get_state()[1])  # noqa: NPY002


def test_a_step_that_is_given_is_taken():
    assert posed("suboff", TIGHT, dt=7.0).simulator.step == 7.0


def test_no_step_is_short_enough(monkeypatch):
    """For readings that are exact to a femtometre; the message names the channel and the remedy."""
    monkeypatch.setattr(simulator, "MAX_STEPS", 20_000)  # or it takes ten seconds
    with refused("model", "dt"):
        posed("npsauv", bs.sensors.Sensor("x_m", sd=1e-15))


def test_the_truth_is_flown_at_a_tenth(suboff, spiral):
    """And as finely as the number of steps allows, but never more coarsely than the model."""
    assert true_step(0.5, spiral) == 0.05
    assert true_step(1e-3, spiral) == 2.0 * spiral.duration / MAX_STEPS
    assert true_step(1e-5, spiral) == 1e-5
    own = Simulator(suboff, spiral, [1.0]).step
    assert bs.simulate(suboff, spiral).simulator.step == 0.1 * own
