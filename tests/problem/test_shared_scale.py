"""A log-normal prior whose scale is unknown and shared."""

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from bayesub.model.coefficients import EQUATIONS
from bayesub.problem.priors import SCALES, Joint, SharedScale, relative_hierarchical, relative_log_normal

KNOWN, UNKNOWN = np.array([0.3]), 0.25 * SCALES
N_DRAWS = 20_000


def prior_of(n, scales=UNKNOWN):
    """Of n parameters of different signs and sizes."""
    return SharedScale(np.where(np.arange(n) % 2, -0.02, 3.0) * np.arange(1, n + 1), scales)


def textbook(prior, points):
    """(n,) log densities by scipy.stats: the mean of log-normal densities over the scales."""
    each = [
        stats.lognorm.logpdf(points / prior.median, scale).sum(axis=-1) - np.log(np.abs(prior.median)).sum()
        for scale in prior.scales
    ]
    return np.logaddexp.reduce(each, axis=0) - np.log(len(each))


@pytest.mark.parametrize("n", [1, 2, 21, 101])
@pytest.mark.parametrize("scales", [KNOWN, UNKNOWN])
def test_change_of_variables(n, scales, rng):
    """Parameters of standard normal coordinates have the density of the textbook; the map has an inverse."""
    prior = prior_of(n, scales)
    t = 1.2 * rng.standard_normal((20, n))
    parameters = prior.parameters(t)
    np.testing.assert_allclose(prior.standard(parameters), t, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(prior.log_density(parameters), textbook(prior, parameters), rtol=1e-12, atol=1e-10)
    for row, log_density in zip(t[:4], prior.log_density(parameters), strict=False):
        slopes, offsets = prior.chain(np.eye(n), row), 1e-5 * np.eye(n)
        numerical = (prior.parameters(row + offsets) - prior.parameters(row - offsets)).T / 2e-5
        np.testing.assert_allclose(slopes, numerical, rtol=1e-6, atol=1e-8 * np.abs(slopes).max())
        # The map is interpolated.
        normal = stats.norm.logpdf(row).sum()
        assert log_density + np.linalg.slogdet(slopes)[1] == pytest.approx(normal, abs=1e-6)


def test_a_known_scale_is_log_normal(rng):
    """With one scale it is the log-normal prior, and the chain at the middle is the scale times the guess."""
    prior = relative_log_normal(0.3).on(np.arange(5), np.linspace(-1.0, 1.5, 101), EQUATIONS)
    t = rng.standard_normal((10, 5))
    np.testing.assert_allclose(prior.parameters(t), prior.median * np.exp(0.3 * t), rtol=1e-12)
    np.testing.assert_allclose(prior.chain(np.eye(5), np.zeros(5)), np.diag(0.3 * prior.median), rtol=1e-12)


def test_sampling_coordinates_are_linear_and_their_slope_exact(rng):
    """Density and gradient in x agree with the parameters; beyond zero there is nothing."""
    prior = prior_of(6)
    x = prior.scaled(prior.sample(rng, 5))
    np.testing.assert_allclose(prior.unscaled(x + 1.0) - prior.unscaled(x), np.tile(prior._unit, (5, 1)), rtol=1e-9)
    for row, slope in zip(x, prior.scaled_slope(x), strict=True):
        numerical = optimize.approx_fprime(row, lambda x: prior.scaled_log_density(x[None])[0], 1e-7)
        np.testing.assert_allclose(slope, numerical, rtol=1e-4, atol=1e-5)
    np.testing.assert_array_equal(prior.scaled_chain(np.eye(6), x[0]), np.diag(prior._unit))
    beyond = prior.scaled(np.where(np.arange(6) == 2, -1.0, 1.0) * prior.median)
    assert prior.scaled_log_density(beyond[None])[0] == -np.inf
    assert prior.log_density(-prior.median[None])[0] == -np.inf
    assert np.isnan(prior.standard(-prior.median)).all()


def test_draws_have_the_stated_moments_and_quantiles(rng):
    """Means, standard deviations and quantiles are those of the draws, within their Monte Carlo error."""
    prior = prior_of(3)
    draws = prior.sample(rng, N_DRAWS)
    assert np.abs((draws.mean(axis=0) - prior.mean) / prior.sd).max() < 4 / np.sqrt(N_DRAWS)
    second, fourth = (np.mean(np.exp(0.5 * k**2 * prior.scales**2)) for k in (2, 4))  # of the ratio to the median
    error = np.sqrt((fourth - second**2) / N_DRAWS)
    assert np.abs(np.mean((draws / prior.median) ** 2, axis=0) - second).max() < 4 * error
    np.testing.assert_allclose(prior.sd**2 + prior.mean**2, second * prior.median**2, rtol=1e-12)
    for probability in (0.05, 0.5, 0.9):
        below = np.mean(draws < prior.quantiles(probability), axis=0)
        assert np.abs(below - probability).max() < 4 * np.sqrt(probability * (1 - probability) / N_DRAWS)


def test_what_some_parameters_say_of_the_scale_holds_for_the_others():
    """Of two parameters the second, given the first, has the sd that Bayes' theorem gives it by integration."""
    prior = SharedScale(np.ones(2), UNKNOWN)

    def of_second(first):
        """Sd of the logarithm of the second."""
        moments = [
            integrate.quad(lambda u, k=k: u**k * np.exp(prior.log_density(np.exp([[first, u]]))[0] + first + u), -9, 9)[
                0
            ]
            for k in (0, 2)
        ]
        return np.sqrt(moments[1] / moments[0])

    for first in (0.0, 0.8):
        weights = stats.norm.pdf(first, 0.0, UNKNOWN)
        assert of_second(first) == pytest.approx(np.sqrt(np.average(UNKNOWN**2, weights=weights)), rel=1e-6)
        np.testing.assert_allclose(
            SharedScale(np.ones(1), UNKNOWN).scale_probabilities(np.exp([first])), weights / weights.sum(), rtol=1e-12
        )
    assert of_second(0.0) < 0.5 * of_second(0.8)


def test_the_scale_is_found(rng):
    """Of forty parameters that are known, drawn with an sd of 0.5, the scale is known as well as an sd can be."""
    prior = prior_of(40)
    truth = prior.median * np.exp(0.5 * rng.standard_normal(40))
    below = np.cumsum(prior.scale_probabilities(truth))
    low, high = prior.scales[np.searchsorted(below, [0.01, 0.99])]
    assert low < 0.5 < high
    assert high < low * np.exp(
        2 * 2.5 / np.sqrt(2 * 40)
    )  # n normal draws know the logarithm of their sd to 1 / sqrt(2 n)


def test_one_scale_for_all_or_for_an_axis():
    """By axis there is a part for each, in the order of the coefficients."""
    columns = EQUATIONS.columns(["Xuu", "Yuv", "Nuv", "Nur", "Yur"])
    xi = np.linspace(1.0, 2.0, 101)
    whole = relative_hierarchical(0.25).on(columns, xi, EQUATIONS)
    assert isinstance(whole, Joint)
    assert [len(part.median) for part in whole.parts] == [5]
    split = relative_hierarchical(0.25, by_axis=True).on(columns, xi, EQUATIONS)
    axes = [{EQUATIONS.terms[columns[k]].axis for k in place} for place in split.positions]
    assert sorted(map(len, axes)) == [1, 1, 1]
    np.testing.assert_allclose(split.quantiles(0.5), xi[columns], rtol=1e-9)
    np.testing.assert_array_equal(split.guess, xi[columns])
    np.testing.assert_allclose([split.parts[0].scales.min(), split.parts[0].scales.max()], [0.0625, 1.0])


def test_contraction_is_one_where_the_data_say_nothing(rng):
    """A parameter that the data leave alone keeps a contraction of one, though the others tell it the scale."""
    prior = SharedScale(np.ones(20), UNKNOWN)
    seen = np.exp(0.15 * rng.standard_normal(19))
    weights = SharedScale(np.ones(19), UNKNOWN).scale_probabilities(seen)
    scales = rng.choice(UNKNOWN, 4000, p=weights)
    draws = np.column_stack([np.tile(seen, (4000, 1)), np.exp(scales * rng.standard_normal(4000))])
    contraction = draws.std(axis=0) / prior.found(draws).sd
    assert contraction[-1] == pytest.approx(1.0, abs=0.1)
    assert contraction[:-1].max() < 0.3
    assert draws[:, -1].std() < 0.4 * prior.sd[-1]
