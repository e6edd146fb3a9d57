"""What depends on the prior, of toys whose posterior is known, and the sentence about it."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.toys import Linear

from bayesub.findings import conflicts
from bayesub.inference.sampling.posterior import Posterior
from bayesub.problem.distributions import CorrelatedNormal, Joint, LogNormal, Normal, Uniform

NAMES = ("unseen", "known", "pulled")


def told(prior, slopes, readings, rng, histories=()):
    """Words and numbers of the posterior of readings of each parameter by itself; draws by weights of a wide grid."""
    toy = Linear(np.diag(slopes), np.array(readings), Normal(prior.mean, prior.sd))
    toy.prior, toy.histories, toy.others, toy.prior_of_others = prior, histories, np.arange(3), prior
    columns = []
    for k in range(3):
        t = rng.standard_normal((200_000, 3))
        weights = np.exp(-0.5 * (prior.parameters(t)[:, k] * slopes[k] - readings[k]) ** 2)
        columns.append(t[rng.choice(len(t), 8000, p=weights / weights.sum()), k])
    draws = prior.parameters(np.stack(columns, axis=1))
    log_prob = prior.scaled_log_density(prior.scaled(draws)) + toy.log_likelihood(draws)
    shape = (4, 100, 20)
    posterior = Posterior(
        NAMES, draws.reshape(*shape, 3), log_prob.reshape(shape), prior.mean, prior.sd, 0, 0.5, 1, 1.0, {}
    )
    return conflicts.power_scaling(toy, posterior, np.full(3, 8000.0)), toy


@pytest.mark.parametrize("first", ["normal", "uniform"])
def test_a_parameter_depends_on_prior_data_or_both(first, rng):
    """Also of a uniform prior: a power of it is the same, so that it is scaled where it is standard normal."""
    unseen = {"normal": Normal(np.ones(1), np.ones(1)), "uniform": Uniform(np.zeros(1), np.ones(1))}[first]
    others = LogNormal(np.array([2.0]), np.array([0.3])), Normal(np.zeros(1), np.ones(1))
    prior = Joint((unseen, *others), tuple(np.array([k]) for k in range(3)))
    found, toy = told(prior, [0.0, 50.0, 1.0], [0.0, 110.0, 3.0], rng)
    assert list(found["hangs_on"]) == ["prior", "likelihood", "both"]
    assert found["prior_sensitivity"][0] == pytest.approx(0.075, rel=0.25 if first == "normal" else 0.6)
    assert found["likelihood_sensitivity"][0] < 0.02
    assert found["prior_sensitivity"][1] < 0.05
    toy_costs = toy.costs.simulations
    assert toy_costs == 8000  # those of the test: the log likelihood is that of the posterior


def test_forces_at_knots_need_the_likelihood_of_the_readings(rng):
    """Of few draws, for they are simulated."""
    prior = Joint((Normal(np.zeros(3), np.ones(3)),), (np.arange(3),))
    found, toy = told(prior, [0.0, 50.0, 1.0], [0.0, 20.0, 3.0], rng, histories=(SimpleNamespace(),))
    assert toy.costs.simulations == 8000 + conflicts.FLOWN_DRAWS
    assert list(found["hangs_on"]) == ["prior", "likelihood", "both"]


def test_few_effective_draws_do_not_say_what_they_do_not_know(rng):
    """A parameter that has kept its prior is not named if a hundred draws of many others could show as much."""
    prior = Joint((Normal(np.zeros(40), np.ones(40)),), (np.arange(40),))
    draws = rng.standard_normal((4, 5, 20, 40))
    log_prob = prior.scaled_log_density(draws)
    posterior = Posterior(tuple("c" * 40), draws, log_prob, prior.mean, prior.sd, 0, 0.5, 1, 1.0, {})
    problem = SimpleNamespace(histories=(), others=np.arange(40), prior_of_others=prior)
    words = {n: list(conflicts.power_scaling(problem, posterior, np.full(40, n))["hangs_on"]) for n in (20.0, 400.0)}
    assert words[20.0].count("prior") < 4
    assert words[400.0].count("prior") > 10


def test_a_prior_half_as_wide_changes_a_normal_posterior_as_it_must(rng):
    """Beside the posterior of the same readings with half the sd, also where one combination alone is known."""
    rows = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0]]) / 0.01
    data = rows @ np.array([1.5, -0.2, 1.0])
    ends = []
    for precision in (1.0, 4.0):
        covariance = np.linalg.inv(rows.T @ rows + precision * np.eye(3))
        ends.append((covariance @ rows.T @ data, covariance))
    (mean, covariance), (half_mean, half_covariance) = ends
    t = rng.standard_normal((4000, 3))
    t = np.linalg.solve(np.linalg.cholesky(np.cov(t.T)), (t - t.mean(axis=0)).T).T  # of these moments to the last digit
    prior = Normal(np.zeros(3), np.ones(3))
    shift, width = conflicts.half_prior(prior, mean + t @ np.linalg.cholesky(covariance).T)
    sd = np.sqrt(np.diag(covariance))
    assert shift == pytest.approx((half_mean - mean) / sd, abs=1e-7)
    assert width == pytest.approx(np.sqrt(np.diag(half_covariance)) / sd, rel=1e-7)
    assert width[:2] == pytest.approx(0.5, abs=1e-3)  # each as wide as the prior makes it
    assert width[2] == pytest.approx(1.0, abs=1e-3)


def test_a_prior_half_as_wide_keeps_its_correlations(rng):
    """Of a parameter that only its correlation with a measured one tells, beside the posterior with a quarter of the
    prior covariance."""
    before = np.array([[1.0, 0.98, 0.0], [0.98, 1.0, 0.0], [0.0, 0.0, 1.0]])
    rows, data = np.array([[0.0, 1.0 / 0.3, 0.0], [0.0, 0.0, 2.0]]), np.array([2.0 / 0.3, 0.0])
    ends = []
    for scale in (1.0, 0.25):
        covariance = np.linalg.inv(rows.T @ rows + np.linalg.inv(scale * before))
        ends.append((covariance @ rows.T @ data, covariance))
    (mean, covariance), (half_mean, half_covariance) = ends
    prior = CorrelatedNormal(np.zeros(3), np.linalg.cholesky(before))
    draws = rng.multivariate_normal(mean, covariance, 100_000)
    shift, width = conflicts.half_prior(prior, prior.standard(draws))
    sd = np.sqrt(np.diag(covariance))
    assert shift == pytest.approx((half_mean - mean) / sd, abs=0.02)
    assert width == pytest.approx(np.sqrt(np.diag(half_covariance)) / sd, abs=0.02)


def test_what_never_moves_has_no_shift():
    assert conflicts.half_prior(Normal(np.zeros(1), np.ones(1)), np.full((9, 1), 0.3)) == (0.0, 0.0)


def test_the_sentence_says_what_priors_half_as_wide_would_change():
    effects = {"unseen": (0.1, 0.5), "known": (0.0, 1.0), "pulled": (-0.9, 0.8)}
    rows = [{"name": name, "half_prior_shift": d, "half_prior_width": w} for name, (d, w) in effects.items()]
    text = conflicts.sensitivity_sentence(rows)
    assert "intervals of 1 of 3 coefficients" in text
    assert "pulled by 0.9 (" in text
    assert conflicts.sensitivity_sentence(rows[1:2]) == ""
