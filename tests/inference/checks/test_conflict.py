"""Conflicts of prior and data: quiet where the prior is right, and named where it is not."""

import numpy as np
import pytest
from scipy import stats

from bayesub.inference.checks.conflict import FALSE_ALARMS, find_conflict
from bayesub.problem.distributions import CorrelatedNormal, Normal

N_PARAMS, N_READINGS, N_STUDIES, N_DRAWS = 8, 30, 400, 2000
NAMES = tuple("abcdefgh")
STIFFNESS = np.geomspace(30.0, 0.01, N_PARAMS)


@pytest.fixture
def study(rng):
    """study(prior, truth): draws of the posterior of a linear problem that knows half of the directions well."""
    matrix = rng.standard_normal((N_READINGS, N_PARAMS)) @ np.diag(STIFFNESS)
    matrix = matrix @ np.linalg.qr(rng.standard_normal((N_PARAMS, N_PARAMS)))[0]

    def draws(prior, truth, mixed=True):
        own = matrix if mixed else STIFFNESS * np.eye(N_READINGS, N_PARAMS)
        readings = own @ truth + rng.standard_normal(N_READINGS)
        lower = prior.chain(np.eye(N_PARAMS), np.zeros(N_PARAMS))
        scaled = own @ lower
        precision = scaled.T @ scaled + np.eye(N_PARAMS)
        mean = np.linalg.solve(precision, scaled.T @ (readings - own @ prior.mean))
        t = mean + np.linalg.solve(np.linalg.cholesky(precision).T, rng.standard_normal((N_PARAMS, N_DRAWS))).T
        return prior.parameters(t)

    return draws


PRIORS = {
    "independent": Normal(np.linspace(-3.0, 3.0, N_PARAMS), np.geomspace(0.1, 10.0, N_PARAMS)),
    "correlated": CorrelatedNormal(np.ones(N_PARAMS), np.tril(np.full((N_PARAMS, N_PARAMS), 0.4)) + np.eye(N_PARAMS)),
}


@pytest.mark.parametrize("kind", PRIORS)
def test_right_priors_are_called_into_question_as_often_as_intended(kind, study, rng):
    """With truths of the prior: one in a hundred, and probabilities that are uniform."""
    prior = PRIORS[kind]
    found = [find_conflict(prior, study(prior, truth), NAMES) for truth in prior.sample(rng, N_STUDIES)]
    assert sum(conflict.found for conflict in found) <= stats.binom.isf(0.001, N_STUDIES, FALSE_ALARMS)
    assert stats.kstest([conflict.probability for conflict in found], "uniform").pvalue > 0.001


def test_what_is_wrong_is_named_and_nothing_else(study):
    """A coefficient whose guess has the wrong sign is named; those that the data do not see never are."""
    prior = Normal(np.ones(N_PARAMS), np.full(N_PARAMS, 0.25))
    truth = np.ones(N_PARAMS)
    assert not find_conflict(prior, study(prior, truth, mixed=False), NAMES).found
    truth[1] = -1.0
    conflict = find_conflict(prior, study(prior, truth, mixed=False), NAMES)
    assert list(conflict.named) == ["b"]
    stiff = 0.25 * STIFFNESS[1]  # an error of eight prior sds, and noise of this share of one
    assert conflict.named["b"] == pytest.approx(-8.0 * stiff / np.sqrt(1 + stiff**2), abs=4 / np.sqrt(1 + stiff**2))
    truth[[1, 7]] = 1.0, -1.0
    assert not find_conflict(prior, study(prior, truth, mixed=False), NAMES).found


def test_many_small_errors_are_found_together(study):
    """Each within what one prior allows, and all of them together far beyond."""
    prior = Normal(np.zeros(N_PARAMS), np.ones(N_PARAMS))
    conflict = find_conflict(prior, study(prior, np.where(STIFFNESS > 2.0, 2.7, 0.0), mixed=False), NAMES)
    assert conflict.found
    assert not conflict.named
    assert conflict.probability < 0.5 * FALSE_ALARMS
