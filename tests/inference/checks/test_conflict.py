"""Conflicts of prior and data: quiet where the prior is right, and named where it is not."""

import importlib
import warnings

import numpy as np
import pytest
from scipy import special, stats

from bayesub.inference.checks.conflict import (
    FALSE_ALARMS,
    POWERS,
    REFUTED,
    SENSITIVE,
    find_conflict,
    sensitivity,
    sensitivity_noise,
)
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
    assert sum(conflict.disagree for conflict in found) <= stats.binom.isf(0.001, N_STUDIES, FALSE_ALARMS)
    assert sum(conflict.refuted for conflict in found) <= stats.binom.isf(0.001, N_STUDIES, REFUTED)
    assert stats.kstest([conflict.probability for conflict in found], "uniform").pvalue > 0.001


def test_a_mild_conflict_is_named_and_does_not_refute(study):
    """An error of four prior sds is one in 16,000, of nine coefficients one in a thousand or two; of six none."""
    prior, truth = Normal(np.zeros(N_PARAMS), np.ones(N_PARAMS)), np.zeros(N_PARAMS)
    for size, refuted in ((4.0, False), (6.0, True)):
        truth[0] = size * np.sqrt(1 + STIFFNESS[0] ** -2)
        conflict = find_conflict(prior, study(prior, truth, mixed=False), NAMES)
        assert list(conflict.named) == ["a"]
        assert (conflict.disagree, conflict.refuted) == (True, refuted)


def test_what_is_wrong_is_named_and_nothing_else(study):
    """A coefficient whose guess has the wrong sign is named; those that the data do not see never are."""
    prior = Normal(np.ones(N_PARAMS), np.full(N_PARAMS, 0.25))
    truth = np.ones(N_PARAMS)
    assert not find_conflict(prior, study(prior, truth, mixed=False), NAMES).disagree
    truth[1] = -1.0
    conflict = find_conflict(prior, study(prior, truth, mixed=False), NAMES)
    assert list(conflict.named) == ["b"]
    stiff = 0.25 * STIFFNESS[1]  # an error of eight prior sds, and noise of this share of one
    assert conflict.named["b"] == pytest.approx(-8.0 * stiff / np.sqrt(1 + stiff**2), abs=4 / np.sqrt(1 + stiff**2))
    truth[[1, 7]] = 1.0, -1.0
    assert not find_conflict(prior, study(prior, truth, mixed=False), NAMES).disagree


def test_many_small_errors_are_found_together(study):
    """Each within what one prior allows, and all of them together far beyond."""
    prior = Normal(np.zeros(N_PARAMS), np.ones(N_PARAMS))
    conflict = find_conflict(prior, study(prior, np.where(STIFFNESS > 2.0, 2.7, 0.0), mixed=False), NAMES)
    assert conflict.disagree
    assert not conflict.named
    assert conflict.probability < 0.5 * FALSE_ALARMS


N = 40_000


def quantiles(n=N):
    """(n,) of the standard normal: draws without noise."""
    return special.ndtri((np.arange(n) + 0.5) / n)


def posterior(precision, mean):
    """Draws of a posterior whose prior is N(0, 1), log prior and log likelihood; the data have this precision."""
    draws = mean + quantiles() / np.sqrt(1.0 + precision)
    reading = mean * (1.0 + precision) / precision if precision else 0.0
    return draws[:, None], -0.5 * draws**2, -0.5 * precision * (draws - reading) ** 2


def closed_form(mean, sd, scaled):
    """Sensitivity of N(mean, sd^2), which a power turns into N(*scaled(power)), by quadrature of the distances."""
    x, rates = mean + sd * np.linspace(quantiles()[0], quantiles()[-1], 20_001), []
    for power in POWERS:
        by_side = []
        for side in (1.0, -1.0):
            p, q = (special.ndtr(side * (x - m) / s) for m, s in ((mean, sd), scaled(power)))
            middle = 0.5 * (p + q)
            divergence = np.trapezoid(special.xlogy(p, p / middle) + special.xlogy(q, q / middle), x) / np.log(2.0)
            by_side.append(np.sqrt(divergence / np.trapezoid(p + q, x)))
        rates.append(max(by_side) / abs(np.log2(power)))
    return np.mean(rates)


@pytest.mark.parametrize("precision", [0.0, 0.25, 1.0, 20.0])
@pytest.mark.parametrize("mean", [0.0, 1.0])
def test_normal_posteriors_have_the_sensitivities_of_the_closed_form(precision, mean):
    if precision == 0.0 and mean != 0.0:
        return
    draws, log_prior, log_likelihood = posterior(precision, mean)

    def with_powers(of_prior, of_data):
        total = of_prior + of_data * precision
        return of_data * mean * (1.0 + precision) / total, 1.0 / np.sqrt(total)

    sd = 1.0 / np.sqrt(1.0 + precision)
    by_prior = closed_form(mean, sd, lambda power: with_powers(power, 1.0))
    np.testing.assert_allclose(sensitivity(draws, log_prior), by_prior, rtol=5e-3)
    by_data = closed_form(mean, sd, lambda power: with_powers(1.0, power))
    np.testing.assert_allclose(sensitivity(draws, log_likelihood), by_data, rtol=5e-3, atol=1e-6)  # a root of round-off


def test_what_hangs_on_the_prior_the_data_or_both():
    """Unknown: the prior alone. Known: the data alone. Pulled by a reading two sds off the prior: both."""
    for precision, mean, hangs in [(0.0, 0.0, (True, False)), (50.0, 0.5, (False, True)), (1.0, 1.0, (True, True))]:
        draws, *parts = posterior(precision, mean)
        assert tuple(sensitivity(draws, part)[0] > SENSITIVE for part in parts) == hangs


def test_agreement_is_never_taken_for_a_pull():
    """Where prior and data agree in the mean, the two sensitivities share what one alone has, less than 0.08."""
    for precision in (0.1, 0.5, 1.0, 3.0, 10.0):
        draws, *parts = posterior(precision, 0.0)
        by_prior, by_data = (sensitivity(draws, part)[0] for part in parts)
        assert by_prior / by_data == pytest.approx(1.0 / precision, rel=0.02)
        assert by_prior + by_data == pytest.approx(0.0752, rel=0.01)
        assert min(by_prior, by_data) < SENSITIVE


def test_units_and_offsets_do_not_count(rng):
    draws = rng.standard_normal((1000, 2))
    log_density = rng.standard_normal(1000)
    values = sensitivity(draws, log_density)
    np.testing.assert_allclose(sensitivity(-1e4 * draws + 3.0, log_density - 700.0), values, rtol=1e-6)


@pytest.mark.parametrize("n_others", [2, 40])
def test_noise_is_what_independent_draws_show(n_others, rng):
    """A prior of other parameters concerns none of a hundred that are independent of them."""
    log_prior = -0.5 * np.sum(rng.standard_normal((2000, n_others)) ** 2, axis=1)
    values = sensitivity(rng.standard_normal((2000, 100)), log_prior)
    assert values.mean() == pytest.approx(sensitivity_noise(log_prior, 2000), rel=0.15)  # sd of the mean 4 %
    assert np.mean(values > 2.0 * sensitivity_noise(log_prior, 2000)) < 0.08  # rarely twice as large


def arviz():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)
        return importlib.import_module("arviz")


@pytest.mark.skipif(not hasattr(arviz(), "psense"), reason="ArviZ has psense from version 1 on, for Python 3.12")
def test_the_values_are_those_of_arviz(rng):
    """Which smooths the tail of its weights; these are so even that it moves nothing by a hundredth."""
    import xarray as xr

    x = rng.standard_normal((4, 1000, 5))
    log_prior = -0.5 * np.sum(x**2, axis=-1)
    x[..., 0] += 0.3 * x[..., 1] ** 2
    dimensions = ("chain", "draw")
    variables = {f"x{k}": (dimensions, x[..., k]) for k in range(5)}
    tree = {"posterior": xr.Dataset(variables), "log_prior": xr.Dataset({"log_prior": (dimensions, log_prior)})}
    theirs = arviz().psense(xr.DataTree.from_dict(tree))
    ours = sensitivity(x.reshape(-1, 5), log_prior.ravel())
    np.testing.assert_allclose(ours, [float(theirs[f"x{k}"]) for k in range(5)], rtol=0.01)
