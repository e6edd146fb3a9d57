"""Records that a model did not make."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.problem.likelihoods import Normal, StudentT
from thesis.wrong_models import Departure, warnings

SENSORS = bs.sensors.Track(0.5, 0.1, interval_s=4.0, channels=("x", "y", "yaw"))


@pytest.fixture(scope="module")
def motion():
    boat = bs.load_vehicle("suboff")
    return bs.simulate(boat, bs.load_manoeuvre("horizontal", boat))


def test_a_problem_knows_only_what_it_should(motion, rng):
    """Noise of another model stays unknown unless the problem knows it; what is held is off and not free."""

    def heavy(channel):
        return StudentT(channel.sd, 4.0)

    unknown = Departure(noise=heavy).problem(motion, SENSORS, 0.25, rng)
    assert all(isinstance(noise, Normal) for noise in unknown.noises)
    known = Departure(noise=heavy, known_noise=True).problem(motion, SENSORS, 0.25, rng)
    assert all(isinstance(noise, StudentT) for noise in known.noises)
    held = Departure(held={"Xuu": 1.1}).problem(motion, SENSORS, 0.25, rng)
    assert "Xuu" not in held.names
    place = bs.coefficients.INDEX["Xuu"]
    assert held.xi[place] == 1.1 * motion.simulator.vehicle.xi[place]


def test_a_bias_is_found_and_noise_of_the_model_is_not(motion):
    rates = {}
    for name, departure in {"right": Departure(right=True), "biased": Departure({"bias": 2.0})}.items():
        rng = np.random.default_rng(7)
        rates[name] = warnings((departure.problem(motion, SENSORS, 0.25, rng) for _ in range(2)), rng, 0.9)
    assert rates["right"]["warned"] == rates["right"]["warned_at_truth"] == 0.0
    assert rates["biased"]["warned"] == 1.0
    assert rates["biased"]["faults"]
    assert rates["biased"]["coverage"] < rates["right"]["coverage"]
