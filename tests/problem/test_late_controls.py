"""Controls that act late, or behind a command: gradients, refusals, and truths that come out."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support import gradients

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.problem.priors import log_normal, normal

SENSORS = bs.sensors.Track(0.5, 0.1, interval_s=2.0)
FREE = ["Yuu_dr", "Nuu_dr"]
SETTINGS = {"free": FREE, "prior": bs.priors.relative_normal(0.1), "dt": 0.5}
LATE = {"delay_rudder_s": normal(0.5, 0.3), "bias_rudder_deg": normal(0.0, 1.0)}
BEHIND = {"lag_rudder_s": log_normal(2.0, 0.3), "bias_rudder_deg": normal(0.0, 1.0)}


@pytest.fixture(scope="module")
def zigzag(suboff):
    manoeuvre = bs.load_manoeuvre("zigzag_20_20", suboff)
    upto = manoeuvre.times <= 200.0
    parts = {key: getattr(manoeuvre, key)[upto] for key in ("times", "controls", "rpm")}
    return replace(manoeuvre, subproblem="horizontal", **parts)


@pytest.fixture(scope="module")
def orders(zigzag):
    """The zigzag as commands that hold for 12.7 s each."""
    times = np.append(np.arange(0.0, 200.0, 12.7), 200.0)
    controls = np.zeros((len(times), 3))
    controls[:, 0] = np.interp(times, zigzag.times, zigzag.controls[:, 0])
    return replace(
        zigzag, times=times, controls=controls, rpm=np.full(len(times), zigzag.rpm[0]), commanded=("delta_r",)
    )


def record_of(vehicle, manoeuvre, actuators, rng):
    return bs.observe(bs.simulate(vehicle, manoeuvre, dt=0.1, actuators=actuators), SENSORS, rng)


@pytest.mark.parametrize("case", ["late", "behind"])
def test_gradient(suboff, zigzag, orders, case, rng):
    """J'z is the gradient of minus the log likelihood."""
    manoeuvre, nuisance = {"late": (zigzag, LATE), "behind": (orders, BEHIND | LATE)}[case]
    record = record_of(suboff, manoeuvre, {}, rng)
    problem = bs.Problem(suboff, manoeuvre, record, nuisance=nuisance, **SETTINGS)
    parameters = problem.prior.parameters(0.3 * rng.standard_normal(problem.n_params))
    gradient, expected = gradients.both(problem, parameters, 1e-4)
    np.testing.assert_allclose(gradient, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("case", ["late", "behind"])
def test_truths_come_out(suboff, zigzag, orders, case):
    """Truths drawn from the prior come out within the posterior's standard deviations.

    Thirty-two squares of standard normal errors; the probability of a sum outside is 1 in 1000. Without the nuisance
    parameters the same fits are wrong by many standard deviations.
    """
    manoeuvre, nuisance = {"late": (zigzag, LATE), "behind": (orders, BEHIND)}[case]
    positions, errors, blind = suboff.equations.columns(FREE), [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        truth = {name: float(prior.sample(rng, 1).item()) for name, prior in nuisance.items()}
        xi = suboff.xi.copy()
        xi[positions] *= 1.0 + 0.1 * rng.standard_normal(2)
        flown = bs.simulate(suboff, manoeuvre, xi=xi, dt=0.1, actuators=truth)
        record = bs.observe(flown, SENSORS, rng)
        fit = gauss_newton(bs.Problem(suboff, manoeuvre, record, nuisance=nuisance, **SETTINGS))
        values = np.array([*xi[positions], *truth.values()])
        errors.append((fit.values - values) / np.sqrt(np.diag(fit.covariance)))
        others = {"bias_rudder_deg": nuisance["bias_rudder_deg"]}
        fit = gauss_newton(bs.Problem(suboff, manoeuvre, record, nuisance=others, **SETTINGS))
        blind.append((fit.values - np.delete(values, 2)) / np.sqrt(np.diag(fit.covariance)))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 32)
    assert low < np.sum(np.square(errors)) < high
    assert np.median(np.abs(blind)) > 3.0
