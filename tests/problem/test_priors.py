"""Priors."""

from copy import deepcopy

import numpy as np
import pytest
from scipy import stats
from support.refusals import refused

from bayesub.inference.baselines import gauss_newton
from bayesub.model.coefficients import EQUATIONS
from bayesub.problem import priors
from bayesub.problem.priors import (
    CorrelatedNormal,
    Joint,
    LogNormal,
    Normal,
    Uniform,
    from_vehicle,
    perturbed,
    relative_log_normal,
    relative_normal,
    relative_uniform,
)
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe

N_DRAWS = 20_000
FACTOR = np.linalg.cholesky([[4.0, 1.5], [1.5, 1.0]])
NORMAL = Normal(mean=np.array([1e-3, -2.0]), sd=np.array([1e-4, 5.0]))
PRIORS = {
    "normal": NORMAL,
    "log-normal": LogNormal(median=np.array([3e-3, -0.2]), log_sd=np.array([0.3, 0.5])),
    "uniform": Uniform(lower=np.array([-1e-3, 2.0]), upper=np.array([4e-3, 3.0])),
    "correlated": CorrelatedNormal(mean=np.array([1.0, -3.0]), factor=FACTOR),
    "joint": Joint((Uniform(np.zeros(1), np.ones(1)), NORMAL), (np.array([1]), np.array([2, 0]))),
}
# Written out with scipy.stats, a parameter at a time.
DENSITIES = {
    "normal": lambda x: stats.norm.logpdf(x, [1e-3, -2.0], [1e-4, 5.0]).sum(axis=-1),
    "log-normal": lambda x: stats.lognorm.logpdf(x * [1, -1], [0.3, 0.5], scale=[3e-3, 0.2]).sum(axis=-1),
    "uniform": lambda x: stats.uniform.logpdf(x, [-1e-3, 2.0], [5e-3, 1.0]).sum(axis=-1),
    "correlated": lambda x: stats.multivariate_normal.logpdf(x, [1.0, -3.0], [[4.0, 1.5], [1.5, 1.0]]),
    "joint": lambda x: (
        stats.norm.logpdf(x[..., [2, 0]], [1e-3, -2.0], [1e-4, 5.0]).sum(axis=-1) + stats.uniform.logpdf(x[..., 1])
    ),
}


@pytest.fixture(params=PRIORS)
def kind(request):
    return request.param


def test_copies_are_equal_and_others_are_not(kind):
    """Their arrays are compared by number."""
    prior = PRIORS[kind]
    assert deepcopy(prior) == prior
    assert hash(deepcopy(prior)) == hash(prior)
    assert [name for name, other in PRIORS.items() if other == prior] == [kind]
    centre = np.array([1.0, 2.0])
    assert relative_normal(0.25, centre) == relative_normal(0.25, centre.copy())
    assert relative_normal(0.25, centre) != relative_normal(0.25, centre[::-1])
    assert relative_normal(0.25, centre) != relative_normal(0.25)


def test_density(kind, rng):
    """Densities are normalised products of the textbook's, inside the support and outside."""
    prior = PRIORS[kind]
    points = np.vstack([prior.sample(rng, 7), 100 * prior.sample(rng, 3), -prior.sample(rng, 3)])
    with np.errstate(divide="ignore"):
        expected = DENSITIES[kind](points)
    np.testing.assert_allclose(prior.log_density(points), expected, rtol=1e-12)


def test_standard_coordinates(kind, rng):
    """The map to standard normal coordinates and back is the identity."""
    prior = PRIORS[kind]
    t = rng.standard_normal((50, len(prior.mean)))
    np.testing.assert_allclose(prior.standard(prior.parameters(t)), t, rtol=1e-9, atol=1e-12)


def test_change_of_variables(kind, rng):
    """Density times the slope of the map is the standard normal density: what is sampled in t has this prior."""
    prior = PRIORS[kind]
    n = len(prior.mean)
    for t in rng.standard_normal((5, n)):
        slopes = prior.chain(np.eye(n), t)
        offsets = 1e-5 * np.eye(n)
        numerical = (prior.parameters(t + offsets) - prior.parameters(t - offsets)).T / 2e-5
        np.testing.assert_allclose(slopes, numerical, rtol=1e-7, atol=1e-9 * np.abs(slopes).max())
        density = prior.log_density(prior.parameters(t)[None])[0] + np.linalg.slogdet(slopes)[1]
        assert density == pytest.approx(stats.norm.logpdf(t).sum(), rel=1e-12)


def test_draws_have_the_stated_moments_and_quantiles(kind, rng):
    """Means, standard deviations and quantiles are those of the draws, within their Monte Carlo error."""
    prior = PRIORS[kind]
    draws = prior.sample(rng, N_DRAWS)
    assert np.abs((draws.mean(axis=0) - prior.mean) / prior.sd).max() < 4 / np.sqrt(N_DRAWS)
    # The variance of a variance is (kurtosis - 1) / n; the log-normal with 0.5 has a kurtosis of 9.
    np.testing.assert_allclose(draws.std(axis=0), prior.sd, rtol=4 * np.sqrt(8 / 4 / N_DRAWS))
    for probability in (0.05, 0.5, 0.9):
        below = np.mean(draws < prior.quantiles(probability), axis=0)
        assert np.abs(below - probability).max() < 4 * np.sqrt(probability * (1 - probability) / N_DRAWS)


def test_spreads_about_a_centre(rng):
    """A relative prior has the size of its centre, whatever its sign, and the thesis's bounds are 75 % of it."""
    xi, centre, columns = rng.standard_normal(101), rng.standard_normal(101), np.array([3, 90, 7])
    for given, expected in ((None, xi[columns]), (centre, centre[columns])):
        normal = relative_normal(0.25, given).on(columns, xi, EQUATIONS)
        np.testing.assert_array_equal(normal.mean, expected)
        np.testing.assert_array_equal(normal.sd, 0.25 * np.abs(expected))
        uniform = relative_uniform(0.75, given).on(columns, xi, EQUATIONS)
        np.testing.assert_allclose(np.sort([0.25 * expected, 1.75 * expected], axis=0), [uniform.lower, uniform.upper])
        signed = relative_log_normal(0.3, given).on(columns, xi, EQUATIONS)
        np.testing.assert_array_equal(np.sign(signed.sample(rng, 100)), np.tile(np.sign(expected), (100, 1)))


class Boat:
    """What a vehicle file gives: seven coefficients with an sd, one of them zero, and the rest without."""

    equations, correlation = EQUATIONS, None

    def __init__(self, rng):
        self.xi, self.sd = rng.standard_normal(101), np.full(101, np.nan)
        self.xi[[5, 80]] = 0.0
        self.sd[[0, 5, 7, 20, 40, 60, 100]] = rng.uniform(0.1, 1.0, 7)


def test_a_vehicles_own_uncertainties(rng):
    """What has an sd has that normal prior, the rest another, and what has no scale at all stays fixed."""
    boat, columns = Boat(rng), np.arange(101)
    prior = from_vehicle(boat, relative_normal(0.2))
    scaled = prior.has_scale(columns, boat.xi, EQUATIONS)
    np.testing.assert_array_equal(np.flatnonzero(~scaled), [80])
    free = columns[scaled]
    drawn = prior.on(free, boat.xi, EQUATIONS)
    np.testing.assert_allclose(drawn.mean, boat.xi[free])
    sd = np.where(np.isfinite(boat.sd), boat.sd, 0.2 * np.abs(boat.xi))[free]
    np.testing.assert_allclose(drawn.sd, sd)
    points = drawn.sample(rng, 5)
    np.testing.assert_allclose(drawn.log_density(points), stats.norm.logpdf(points, boat.xi[free], sd).sum(axis=1))
    alone = from_vehicle(boat)
    np.testing.assert_array_equal(alone.has_scale(columns, boat.xi, EQUATIONS), np.isfinite(boat.sd))
    elsewhere = from_vehicle(boat, centre=np.ones(101)).on(np.array([7, 60]), boat.xi, EQUATIONS)
    np.testing.assert_array_equal(elsewhere.mean, [1.0, 1.0])


def test_perturbed_keeps_signs_and_zeros(rng):
    """A guess has the signs of the truth, also when it is off by more than its size."""
    xi = np.tile([1.0, -2.0, 0.0], 1000)
    guess = perturbed(xi, 1.5, rng)
    np.testing.assert_array_equal(np.sign(guess), np.sign(xi))
    assert perturbed(np.ones(20_000), 0.1, rng).std() == pytest.approx(0.1, rel=4 / np.sqrt(2 * 20_000))


@pytest.mark.parametrize("value", [0.0, -0.25, np.nan, np.inf])
def test_bad_spreads(value):
    """A prior needs a positive spread."""
    for make, key in ((relative_normal, "sd"), (relative_uniform, "half_width"), (relative_log_normal, "log_sd")):
        with refused("value", key):
            make(value)


def test_widths_beyond_numbers_are_refused():
    """So narrow beside what it is about that sensitivities are rounding errors, or so wide that it is no number."""
    for make, key in (("relative_normal", "sd"), ("relative_uniform", "half_width"), ("relative_log_normal", "log_sd")):
        for value in (1e-300, 0.9 * priors.NARROWEST, 2.0 * priors.WIDEST_SPREAD[key], 1e300):
            with refused("value", key):
                getattr(priors, make)(value)
        getattr(priors, make)(priors.NARROWEST)
    for mean in (0.0, -3.0):
        for sd in (1e-300, 1e300):
            with refused("value", "sd"):
                priors.normal(mean, sd)
    with refused("value", "upper - lower"):
        priors.uniform(1.0, 1.0 + 1e-15)
    with refused("value", "upper - lower"):
        priors.uniform(-1e300, 1e300)
    for median, log_sd, key in ((1.0, 1e-300, "log_sd"), (1.0, 100.0, "log_sd"), (-1e-300, 1.0, "log_sd times median")):
        with refused("value", key):
            priors.log_normal(median, log_sd)
    priors.normal(0.0, 1e-12)  # of a small coefficient that may be nothing


def test_coefficients_are_tied_by_a_correlation_near_one(suboff, spiral, spiral_track):
    """The mode keeps to it as the manual says, and says less of the pair than of two; a looser tie is the control."""
    record = observe(spiral_track, Track(0.5, 0.1, 2.0), np.random.default_rng(1))
    middle, sd, off, sds = 7e-4, 2e-4, {}, {}
    pair = {name: priors.normal(middle, sd) for name in ("Yrdot", "Nvdot")}
    for correlation in (0.9, 0.999999, 0.99999999):
        prior = priors.Given(relative_normal(0.25), pair, ((*pair, correlation),))
        found = gauss_newton(Problem(suboff, spiral, record, free=[*pair, "Yuv", "Nuv"], prior=prior, dt=2.0))
        first, second = (found.names.index(name) for name in pair)
        off[correlation] = abs(found.values[first] - found.values[second]) / sd
        sds[correlation] = np.sqrt(found.covariance[first, first])
    assert off[0.999999] < 2.0 * np.sqrt(2e-6) < off[0.9]
    assert off[0.99999999] < 2.0 * np.sqrt(2e-8)
    assert sds[0.999999] == pytest.approx(sds[0.99999999], rel=1e-2)
    assert sds[0.999999] < 0.9 * sds[0.9]


@pytest.mark.parametrize("mean", ["0", None, np.zeros(2), float("nan")])
def test_a_mean_that_is_no_number_is_refused(mean):
    with refused("value", "mean"):
        priors.normal(mean, 1.0)


def test_a_correlation_that_is_given_twice_is_refused():
    """The second would be taken, in whichever order it has its names; other pairs of the same coefficients are kept."""
    given = {name: priors.normal(1.0, 0.1) for name in ("Yuv", "Nuv", "Nur")}
    priors.Given(relative_normal(0.25), given, (("Yuv", "Nuv", 0.5), ("Nuv", "Nur", 0.3), ("Nur", "Yuv", 0.2)))
    for again in (("Yuv", "Nuv", -0.3), ("Nuv", "Yuv", 0.5)):
        with refused("conflict", "correlations"):
            priors.Given(relative_normal(0.25), given, (("Yuv", "Nuv", 0.5), ("Nuv", "Nur", 0.3), again))


def wrong_sets(xi):
    return xi[:5], np.append(xi, 1.0), xi[None], np.where(np.arange(len(xi)) == 3, np.nan, xi), xi * np.inf, "Xuu"


def test_a_coefficient_set_that_is_none_is_refused(suboff, spiral, spiral_track, rng):
    """Of another length or not of numbers, as values of what is fixed, a centre, means, or what is perturbed."""
    record, free = observe(spiral_track, Track(0.5, 0.1, 2.0), rng), ["Xuu", "Nuv"]
    with np.errstate(invalid="ignore"):
        wrong = wrong_sets(suboff.xi)
    for number, one in enumerate(wrong):
        with refused("value", "xi"):
            Problem(suboff, spiral, record, free=free, prior=relative_normal(0.25), xi=one, dt=2.0)
        with refused("value", "centre"):
            Problem(suboff, spiral, record, free=free, prior=relative_normal(0.25, one), dt=2.0)
        with refused("value", "centre"):
            from_vehicle(suboff, relative_normal(0.25), one)
        if number > 1:  # of any length
            with refused("value", "xi"):
                perturbed(one, 0.1, rng)
    straight = priors.Spread("normal", 0.25, suboff.xi[:5])
    with refused("value", "centre"):
        Problem(suboff, spiral, record, free=free, prior=straight, dt=2.0)
