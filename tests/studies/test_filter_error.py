"""The filter-error estimate: against the joint density of linear processes, and of the readings of a boat."""

import sys

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import block_diag
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import Estimate, gauss_newton
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem.base import Costs
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.priors import Normal, normal, relative_normal
from bayesub.sensors.record import Channel, Record
from disturbed.filter_error import filter_error
from disturbed.innovations import Innovations
from disturbed.state_space import StateSpace

DEGREE = np.pi / 180.0


class Process:
    """Position and speed under an input of unknown gain, a drift of unknown sd, and readings at some of the times.

    Its parameters are the gain, the sd of the random acceleration and the damping of the speed.
    """

    def __init__(self, rng, n_times=25, fails=None):
        self.names = ("gain", "sd", "damping")
        self.prior = Normal(np.array([1.0, 0.5, 0.2]), np.array([0.5, 0.1, 0.05]))
        self.costs = Costs()
        self.inputs = rng.standard_normal(n_times)
        self.rows = [np.eye(2)[: k % 3] for k in range(n_times)]  # nothing, the position, or both
        self.variances = [np.array([0.04, 0.09])[: len(rows)] for rows in self.rows]
        self.readings = [rng.standard_normal(len(rows)) for rows in self.rows]
        self.fails = fails

    def members(self, parameters):
        self.costs.simulations += len(parameters)
        return Members(self, parameters)

    def joint(self, parameters):
        """Mean and covariance of all readings: every reading as a sum of the start and all noises before it."""
        (transition,), (force,) = Members(self, parameters[None]).matrices()
        size, n = 2 + len(self.inputs), len(self.inputs)
        weights, mean = np.zeros((2, size)), np.array([0.5, -0.2])
        weights[:, :2] = np.diag(np.sqrt([0.3, 0.1]))
        means, rows = [], []
        for k in range(n):
            mean = transition @ mean + force * parameters[0] * self.inputs[k]
            weights = transition @ weights
            weights[:, 2 + k] += force * parameters[1]
            means.append(self.rows[k] @ mean)
            rows.append(self.rows[k] @ weights)
        rows = np.vstack(rows)
        return np.concatenate(means), rows @ rows.T + block_diag(*map(np.diag, self.variances))


class Members:
    def __init__(self, process, parameters):
        self.process, self.parameters = process, parameters
        self.states = np.tile([0.5, -0.2], (len(parameters), 1))
        self.covariances = np.tile(np.diag([0.3, 0.1]), (len(parameters), 1, 1))

    def matrices(self):
        decay = np.exp(-self.parameters[:, 2])
        zeros, ones = np.zeros_like(decay), np.ones_like(decay)
        return np.moveaxis([[ones, ones], [zeros, decay]], 2, 0), np.stack([0.5 * ones, ones], axis=1)

    def advance(self, k, states):
        transition, force = self.matrices()
        process, (gain, sd, _) = self.process, self.parameters.T
        ahead = np.einsum("bij,bj->bi", transition, states) + (gain * process.inputs[k])[:, None] * force
        if process.fails is not None:
            ahead[process.fails(self.parameters)] = np.nan
        both = np.vstack([np.eye(2), process.rows[k]])
        return ahead @ both.T, both @ transition, both @ (sd[:, None] * force)[:, :, None]


def test_innovations_have_the_density_of_all_readings(rng):
    """The product over the times is the joint normal density of the readings, with their whole covariance."""
    process = Process(rng)
    parameters = process.prior.sample(rng, 5)
    found = Innovations(process).log_likelihood(parameters)
    readings = np.concatenate(process.readings)
    expected = [stats.multivariate_normal(*process.joint(member)).logpdf(readings) for member in parameters]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_residuals_and_jacobian_make_the_gradient(rng):
    """Of the deviance, whether a parameter moves the means or the covariances; misfits are those of the density."""
    process = Process(rng)
    problem, at = Innovations(process), np.array([1.2, 0.55, 0.18])
    (residuals,), (deviance,) = problem.misfit(at)
    gradient = 2.0 * problem.jacobian(at).T @ residuals
    steps = 1e-5 * np.eye(3)
    expected = (problem.misfit(at + steps)[1] - problem.misfit(at - steps)[1]) / 2e-5
    np.testing.assert_allclose(gradient, expected, rtol=1e-6)
    constant = np.sum(np.log(2.0 * np.pi * np.concatenate(process.variances)))
    assert -2.0 * problem.log_likelihood(at)[0] == pytest.approx(deviance + constant)


def test_information_is_that_of_the_joint_density(rng):
    """The mean over records of J'J is the information of all readings, of the sd of the process too."""
    process, at, step = Process(rng, n_times=12), np.array([1.2, 0.55, 0.18]), 1e-5
    mean, covariance = process.joint(at)
    moments = [process.joint(at + sign * step * unit) for unit in np.eye(3) for sign in (1.0, -1.0)]
    slopes = [(up[0] - down[0]) / (2 * step) for up, down in zip(moments[::2], moments[1::2], strict=True)]
    changes = [(up[1] - down[1]) / (2 * step) for up, down in zip(moments[::2], moments[1::2], strict=True)]
    inverse = np.linalg.inv(covariance)
    expected = np.array(
        [
            [
                slopes[i] @ inverse @ slopes[j] + 0.5 * np.trace(inverse @ changes[i] @ inverse @ changes[j])
                for j in range(3)
            ]
            for i in range(3)
        ]
    )
    ends = np.cumsum([len(part) for part in process.readings])[:-1]
    found = []
    for readings in rng.multivariate_normal(mean, covariance, 300):
        process.readings = np.split(readings, ends)
        jacobian = Innovations(process).jacobian(at)
        found.append(jacobian.T @ jacobian)
    errors = np.std(found, axis=0) / np.sqrt(len(found))
    assert np.all(np.abs(np.mean(found, axis=0) - expected) < 4.0 * errors + 1e-5 * np.abs(expected))


def test_of_a_linear_process_the_posterior_is_exact(rng):
    """With the gain alone unknown: mean and sd of generalised least squares with the prior."""
    process = Process(rng)
    process.prior = Normal(process.prior.mean, process.prior.sd * [1.0, 1e-9, 1e-9])
    mean, covariance = process.joint(process.prior.mean)
    slope = process.joint(process.prior.mean + np.eye(3)[0])[0] - mean
    weighed = np.linalg.solve(covariance, slope)
    precision = slope @ weighed + 1.0 / process.prior.sd[0] ** 2
    found = filter_error(process, rng=rng)
    best = process.prior.mean[0] + weighed @ (np.concatenate(process.readings) - mean) / precision
    assert found.values[0] == pytest.approx(best, rel=1e-6)
    assert found.covariance[0, 0] == pytest.approx(1.0 / precision, rel=1e-6)
    assert found.statuses[0] == "converged"
    assert len(found.costs) == 2
    assert Estimate.from_json(found.to_json()).to_json() == found.to_json()


def test_starts_that_fail_are_passed_over(rng):
    """One of those given fails; a single search that converges may be enough; if all fail, the message says so."""
    start, agreed = np.array([2.0, 0.5, 0.2]), {"agreement": 1}
    process = Process(rng, fails=lambda parameters: parameters[:, 0] > 1.9)
    found = filter_error(process, rng=rng, starts=[start], **agreed)
    np.testing.assert_array_equal(found.starts, process.prior.mean[None])
    assert found.evaluations == process.costs.simulations
    assert filter_error(Process(rng), rng=rng, starts=[start], **agreed).starts[0, 0] == 2.0
    with refused("model", "prior"):
        filter_error(Process(rng, fails=lambda parameters: parameters[:, 0] < 100.0), rng=rng)


def test_the_status_says_if_searches_do_not_agree(rng, monkeypatch):
    """As many searches as there are starts, and the lowest cost only once."""
    process, costs = Process(rng), iter(range(100, 0, -1))
    one = filter_error(process, rng=rng, agreement=1)

    def search(*_):
        return Estimate(**vars(one) | {"costs": np.array([float(next(costs))])})

    monkeypatch.setattr(sys.modules[filter_error.__module__], "gauss_newton", search)
    found = filter_error(process, rng=rng)
    assert found.statuses[0] == "converged; 1 of 13 searches agree on it, start nearer or narrow the prior"
    assert np.all(np.diff(found.costs) > 0)


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("auv690")


@pytest.fixture(scope="module")
def trial(boat):
    """A function that poses a problem of half a minute, with or without disturbance, and says the truth behind it."""
    manoeuvre = bs.load_manoeuvre("horizontal", boat)
    times, slow = np.arange(1.0, 31.0), np.arange(0.0, 30.1, 3.0)
    channels = [Channel(name, times, 0.0 * times, 0.1) for name in "xy"]
    channels += [Channel("psi", slow, 0.0 * slow, 0.1 * DEGREE), Channel("r", times, 0.0 * times, 0.05 * DEGREE)]
    channels += [Channel(f"{name}_ground", times, 0.0 * times, 0.005) for name in "uv"]

    def problem(disturbance=None, seed=3, **options):
        posed = bs.Problem(
            boat,
            manoeuvre,
            Record(tuple(channels)),
            free=HORIZONTAL,
            prior=relative_normal(0.1),
            disturbance=disturbance,
            **options,
        )
        rng = np.random.default_rng(seed)
        truth = posed.prior.sample(rng, 1)
        return posed.with_readings(posed.replicated(truth, rng)[0]), truth[0]

    return problem


def test_without_disturbance_it_is_the_posterior_mode(trial):
    """Noise only: the innovations are the residuals."""
    problem, _ = trial()
    found, mode = filter_error(StateSpace(problem), rng=np.random.default_rng(1), agreement=1), gauss_newton(problem)
    sd = np.sqrt(np.diag(mode.covariance))
    np.testing.assert_array_less(np.abs(found.values - mode.values), 0.01 * sd)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), sd, rtol=1e-4)
    assert found.costs[0] == pytest.approx(mode.costs[0], abs=1e-4)


def test_small_disturbances_have_their_joint_density(trial):
    """The likelihood is that of readings whose covariance is noise and response to the forces at knots."""
    sds = {"X": 4e-5, "Y": 4e-5, "N": 2e-5}
    problem, truth = trial(UnknownDisturbance(("X", "Y", "N"), sds, 4.0, knot_interval_s=1.0))
    space = StateSpace(problem)
    without_forces = np.concatenate([truth[: space.n_params], np.zeros(problem.n_params - space.n_params)])
    response = (problem.jacobian(without_forces) * problem.sds[:, None])[:, space.n_params :]
    predicted, covariance = problem.predicted(without_forces)[0], response @ response.T + np.diag(problem.sds**2)
    expected = stats.multivariate_normal(predicted, covariance).logpdf(problem.readings)
    found = Innovations(space).log_likelihood(truth[: space.n_params])[0]
    noise_only = stats.norm.logpdf(problem.readings, predicted, problem.sds).sum()
    assert found > noise_only + 50.0
    assert found == pytest.approx(expected, abs=0.1)


def test_the_process_is_estimated_too(trial):
    """With priors of its sd and time these are parameters; the estimate is near the truth, and it says how near."""
    sds = {"Y": bs.priors.log_normal(1e-4, 0.7), "N": 3e-5}
    time = bs.priors.log_normal(4.0, 0.3)
    problem, truth = trial(UnknownDisturbance(("Y", "N"), sds, time))
    space = StateSpace(problem)
    assert space.names[-2:] == ("sd_disturbance_Y", "correlation_time_disturbance_s")
    found = filter_error(space, rng=np.random.default_rng(1), agreement=1)
    z = (found.values - truth[: space.n_params]) / np.sqrt(np.diag(found.covariance))
    assert found.statuses == ("converged",)
    assert np.abs(z).max() < 4.0
    assert np.sqrt(found.covariance[-2, -2]) < 0.5 * found.values[-2]


def test_what_the_filter_does_not_know_is_refused(trial):
    """A smoother process, and noise whose sd is inferred."""
    with refused("conflict", "kind"):
        StateSpace(trial(UnknownDisturbance(("Y",), {"Y": 1e-4}, 4.0, "matern_3_2"))[0])
    with refused("conflict", "sd_yaw_deg"):
        StateSpace(trial(nuisance={"sd_yaw_deg": normal(0.1, 0.01)})[0])
