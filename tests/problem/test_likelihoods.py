"""Likelihoods against SciPy, quadrature and what simulated readings do."""

import numpy as np
import pytest
from scipy import integrate, stats
from support.refusals import refused

from bayesub.problem.likelihoods import AR1, Normal, Rounded, SetMembership, StudentT, UnknownSd, reading_noise

SMOOTH = [Normal(0.3), Rounded(0.3, 0.1), Rounded(0.3, 1.0), StudentT(0.3, 4.0), AR1(0.3, 2.5)]
NOISES = [*SMOOTH, SetMembership(1.0)]
NAMES = [f"{type(noise).__name__}{i}" for i, noise in enumerate(NOISES)]


@pytest.fixture
def times(rng):
    """Forty times with gaps from a tenth of a second to half a minute."""
    return np.cumsum(10.0 ** rng.uniform(-1, 1.5, 40))


@pytest.fixture
def truth(times):
    return np.sin(times)


def covariance(noise, times):
    return noise.sd**2 * np.exp(-np.abs(times[:, None] - times) / noise.correlation_time_s)


@pytest.mark.parametrize("noise", NOISES, ids=NAMES)
@pytest.mark.parametrize("column", [0, 17, 39])
def test_members_that_failed_are_impossible(noise, column, truth, times, rng):
    """A member with a missing prediction has likelihood zero; its neighbours keep theirs."""
    predicted = np.stack([truth] * 3)
    readings = noise.sample(truth, times, rng)
    alone = noise.log_density(predicted, readings, times)
    predicted[1, column] = np.nan
    np.testing.assert_array_equal(noise.log_density(predicted, readings, times), [alone[0], -np.inf, alone[2]])
    assert np.isfinite(alone).all()
    missing = np.isnan(noise.residuals(predicted, readings, times))
    assert missing[1, column]
    assert not missing[[0, 2]].any()


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_log_densities_are_those_of_scipy(noise, truth, times, rng):
    """Each model against SciPy's distribution, with its own sd and with one for each member."""
    readings, predicted = noise.sample(truth, times, rng), truth + 0.2 * rng.standard_normal((5, 40))
    sds = 10.0 ** rng.uniform(-1, 1, 5)

    def slow(member, sd):
        if isinstance(noise, AR1):
            other = AR1(sd, noise.correlation_time_s)
            return stats.multivariate_normal.logpdf(readings, member, covariance(other, times))
        if isinstance(noise, Rounded):
            ends = (readings + s * noise.resolution / 2 - member for s in (-1, 1))
            lower, upper = (stats.norm.logcdf(end / sd) for end in ends)
            return np.sum(np.log1p(-np.exp(lower - upper)) + upper)
        if isinstance(noise, StudentT):
            return stats.t.logpdf(readings, noise.dof, member, sd).sum()
        return stats.norm.logpdf(readings, member, sd).sum()

    expected = [slow(member, noise.sd) for member in predicted]
    np.testing.assert_allclose(noise.log_density(predicted, readings, times), expected, rtol=1e-10)
    expected = [slow(*pair) for pair in zip(predicted, sds, strict=True)]
    np.testing.assert_allclose(noise.of_members(sd=sds).log_density(predicted, readings, times), expected, rtol=1e-10)


@pytest.mark.parametrize("noise", NOISES, ids=NAMES)
def test_batch_equals_one_by_one_bitwise(noise, truth, times, rng):
    """Members know nothing of each other, and an array that is a slice of another gives the same."""
    predicted, readings = truth + rng.standard_normal((7, 40)), noise.sample(truth, times, rng)
    together = noise.log_density(predicted, readings, times)
    alone = [noise.log_density(member[None], readings, times)[0] for member in predicted]
    np.testing.assert_array_equal(together, alone)
    np.testing.assert_array_equal(together, noise.log_density(np.repeat(predicted, 2, 1)[:, ::2], readings, times))
    whitened = noise.residuals(predicted, readings, times)
    np.testing.assert_array_equal(whitened[2:3], noise.residuals(predicted[2:3], readings, times))


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_weighed_residuals_are_the_gradient(noise, truth, times, rng):
    """J'z is the gradient of minus the log density, here by central differences."""
    jacobian, readings = rng.standard_normal((40, 3)), noise.sample(truth, times, rng)
    predicted, step = truth + 0.5 * rng.standard_normal(40), 1e-4
    moves = step * np.array([-2, -1, 1, 2])[:, None, None] * jacobian.T
    values = -noise.log_density((predicted + moves).reshape(-1, 40), readings, times).reshape(4, 3)
    expected = np.array([1, -8, 8, -1]) @ values / (12 * step)
    z = noise.residuals(predicted[None], readings, times)[0]
    found = noise.weigh(jacobian, predicted, readings, times).T @ z
    # round-off of a log density of a few hundred over the step
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_weighed_jacobians_are_the_information(noise, truth, times, rng):
    """The mean of J'J over simulated readings is the covariance of the score: the Fisher information."""
    jacobian, n = rng.standard_normal((40, 2)), 4000
    scores, information = np.empty((n, 2)), np.zeros((2, 2))
    for i in range(n):
        readings = noise.sample(truth, times, rng)
        weighed = noise.weigh(jacobian, truth, readings, times)
        scores[i] = weighed.T @ noise.residuals(truth[None], readings, times)[0]
        information += weighed.T @ weighed / n
    scale = np.sqrt(np.diag(information))
    # The variance of n scores that are nearly normal has a relative sd of sqrt(2 / n) = 0.022: four of them.
    np.testing.assert_allclose(
        np.cov(scores.T) / np.outer(scale, scale), information / np.outer(scale, scale), atol=0.09
    )
    assert (np.abs(scores.mean(axis=0)) < 4 * scale / np.sqrt(n)).all()


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_sd_given_is_the_model_with_that_sd(noise, truth, times, rng):
    """Residuals and weights with another sd are those of another model."""
    other = type(noise)(**{**vars(noise), "sd": 0.7})
    readings, predicted, jacobian = truth + 0.1, truth[None] + 0.3, rng.standard_normal((40, 2))
    given = noise.of_members(sd=np.array([noise.sd, 0.7])).residuals(np.repeat(predicted, 2, 0), readings, times)
    np.testing.assert_allclose(given[0], noise.residuals(predicted, readings, times)[0], rtol=1e-14)
    np.testing.assert_allclose(given[1], other.residuals(predicted, readings, times)[0], rtol=1e-14)
    found = noise.of_members(sd=0.7).weigh(jacobian, predicted[0], readings, times)
    np.testing.assert_allclose(found, other.weigh(jacobian, predicted[0], readings, times), rtol=1e-14)


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_an_sd_that_is_not_positive_is_impossible(noise, truth, times):
    """A sampler that proposes one gets minus infinity, without a warning."""
    found = noise.of_members(sd=np.array([0.0, -1.0, np.nan, 1.0])).log_density(np.stack([truth] * 4), truth, times)
    np.testing.assert_array_equal(np.isfinite(found), [False, False, False, True])
    assert (found[:3] == -np.inf).all()


@pytest.mark.parametrize("sd", [0.003, 0.3, 30.0])
def test_rounded_probabilities_add_up_to_one(sd):
    """Some multiple of the resolution is read for certain, wherever the truth lies between two of them."""
    noise = Rounded(sd, 0.5)
    readings = 0.5 * np.arange(-1000, 1001)
    for truth in (0.0, 0.1, 0.25, 0.3):
        log_densities = [noise.log_density(np.array([[truth]]), [reading])[0] for reading in readings]
        assert np.exp(log_densities).sum() == pytest.approx(1.0, abs=1e-12)


def test_rounded_becomes_normal_at_fine_steps(truth, rng):
    """The density tends to the normal one times the step; what is left is step^2 / 24 times the sum of z^2 - 1."""
    readings, predicted = truth + rng.standard_normal(40), np.stack([truth, truth + 1.0])
    plain, z = Normal(1.0).log_density(predicted, readings), Normal(1.0).residuals(predicted, readings)
    for step in (1e-1, 1e-2):
        left = Rounded(1.0, step).log_density(predicted, readings) - len(readings) * np.log(step) - plain
        # The next term has a factor of step^2 / 24 and sums of z^4 in place of z^2.
        np.testing.assert_allclose(left, step**2 / 24 * np.sum(z**2 - 1, axis=1), rtol=step**2)
    found = Rounded(1.0, 1e-7).log_density(predicted, readings) - len(readings) * np.log(1e-7)
    np.testing.assert_allclose(found, plain, rtol=1e-13)
    np.testing.assert_allclose(Rounded(1.0, 1e-7).residuals(predicted, readings), z, rtol=1e-11)


def test_rounded_becomes_set_membership_at_small_noise(truth, times, rng):
    """With the noise the probability tends to one inside every interval, and to zero if one prediction is outside."""
    exact = SetMembership(0.1)
    readings = exact.sample(truth, times, rng)
    clear = readings + 0.04 * rng.uniform(-1, 1, (3, 40))
    clear[1, 5] = readings[5] + 0.0501
    expected = exact.log_density(clear, readings)
    np.testing.assert_array_equal(expected, [0.0, -np.inf, 0.0])
    found = Rounded(1e-6, 0.1).log_density(clear, readings)
    np.testing.assert_allclose(found[[0, 2]], 0.0, atol=1e-13)
    assert -1e4 < found[1] < -4e3  # 100 sd outside: finite


def test_set_membership_admits_the_truth(rng):
    """Exact values never lie outside the interval they round to, not for the round-off of many steps either."""
    for resolution in (1e-3, 0.01, 0.1, 0.3):
        noise = SetMembership(resolution)
        edges = resolution * (rng.integers(-100_000, 100_000, 2000) + 0.5)
        truth = np.concatenate([edges, np.nextafter(edges, 0), rng.uniform(-1e3, 1e3, 2000)])
        assert noise.log_density(truth[None], noise.sample(truth, None, rng))[0] == 0.0


def test_set_membership_residuals_lead_into_the_set(times, rng):
    """Gauss-Newton steps on them find a feasible line among rounded readings, and refuse none inside."""
    design = np.stack([np.ones(40), times], axis=1)
    noise = SetMembership(0.5)
    readings = noise.sample(design @ [1.3, 0.11], times, rng)
    line = np.zeros(2)
    assert noise.log_density((design @ line)[None], readings)[0] == -np.inf
    for _ in range(200):
        z = noise.residuals((design @ line)[None], readings)[0]
        weighed = noise.weigh(design, design @ line, readings)
        # Aiming a little beyond the walls makes the steps end.
        line -= np.linalg.lstsq(weighed, z + 0.01 * np.sign(z), rcond=None)[0]
        if not noise.residuals((design @ line)[None], readings).any():
            break
    assert noise.log_density((design @ line)[None], readings)[0] == 0.0


def test_marginal_density_is_the_integral_over_sd(truth, rng):
    """Against quadrature over log sd, on which the prior 1/sd is uniform."""
    noise, readings = Normal(1.0), truth + 0.2 * rng.standard_normal(40)
    predicted = np.stack([truth, truth + 0.3])
    found = UnknownSd(1.0).log_density(predicted, readings)
    for member, value in zip(predicted, found, strict=True):
        peak = noise.of_members(sd=np.sqrt(np.mean((member - readings) ** 2))).log_density(member[None], readings)[0]

        def density(log_sd, member=member, peak=peak):
            return np.exp(noise.of_members(sd=np.exp(log_sd)).log_density(member[None], readings)[0] - peak)

        total, _ = integrate.quad(density, -6, 4, points=[-1.5, -1.0], epsabs=0, epsrel=1e-10)
        assert value == pytest.approx(np.log(total) + peak, abs=1e-8)


def test_correlation_time_of_each_member(truth, times, rng):
    """Correlation times may be sampled; a long one leaves what is common, a short one nothing."""
    readings = AR1(0.3, 2.5).sample(truth, times, rng)
    correlation_times = np.array([1e-3, 0.5, 20.0, 1e4])
    predicted = np.stack([truth] * 4)
    found = AR1(0.3, 2.5).of_members(correlation_time_s=correlation_times).log_density(predicted, readings, times)
    expected = [AR1(0.3, t).log_density(truth[None], readings, times)[0] for t in correlation_times]
    np.testing.assert_array_equal(found, expected)
    assert found[0] == pytest.approx(Normal(0.3).log_density(truth[None], readings)[0], rel=1e-12)
    dense = [stats.multivariate_normal.logpdf(readings, truth, covariance(AR1(0.3, t), times)) for t in (20.0, 1e4)]
    np.testing.assert_allclose(found[2:], dense, rtol=1e-7)  # condition number of the dense matrix times epsilon
    assert AR1(0.3, 2.5).of_members(correlation_time_s=-1.0).log_density(truth[None], readings, times)[0] == -np.inf


def test_whitened_autoregressive_noise_is_white(times):
    """W C W' = 1 with W the whitening matrix and C the dense covariance."""
    noise = AR1(0.3, 2.5)
    whitening = noise.weigh(np.eye(40), np.zeros(40), np.zeros(40), times)
    np.testing.assert_allclose(whitening @ covariance(noise, times) @ whitening.T, np.eye(40), atol=1e-12)


def test_moments_of_simulated_readings(rng):
    """Means, variances and correlations are those of the formulas, within four standard errors."""
    n = 100_000
    times, truth = np.arange(n) * 0.5, np.zeros(n)
    draws = {
        0.09: Normal(0.3).sample(truth, times, rng),
        # Sheppard: the rounding of a wide distribution adds a uniform error of the step
        0.09 + 0.3**2 / 12: Rounded(0.3, 0.3).sample(truth, times, rng),
        0.09 * 10 / 8: StudentT(0.3, 10.0).sample(truth, times, rng),
    }
    for variance, errors in draws.items():
        assert abs(errors.mean()) < 4 * np.sqrt(variance / n)
        assert errors.var() == pytest.approx(variance, rel=4 * np.sqrt(3 / n))  # t with ten dof: kurtosis 4
    correlated = AR1(0.3, 2.5).sample(truth, times, rng)
    n_independent = n * np.tanh(0.5 / 2.5)  # of the squares, whose correlation is exp(-2 lag / time)
    assert correlated.var() == pytest.approx(0.09, rel=4 * np.sqrt(2 / n_independent))
    lag_one = np.corrcoef(correlated[1:], correlated[:-1])[0, 1]
    assert lag_one == pytest.approx(np.exp(-0.2), abs=4 * np.sqrt((1 - np.exp(-0.4)) / n))


def test_rounded_readings_are_multiples_of_the_step(truth, times, rng):
    for noise in (Rounded(0.3, 0.25), SetMembership(0.25)):
        readings = noise.sample(truth, times, rng)
        np.testing.assert_array_equal(readings / 0.25, np.round(readings / 0.25))
    assert np.abs(readings - truth).max() <= 0.125


def posterior_moments(log_densities, grid):
    weights = np.exp(log_densities - log_densities.max())
    mean = np.sum(weights * grid) / weights.sum()
    return mean, np.sqrt(np.sum(weights * (grid - mean) ** 2) / weights.sum())


@pytest.fixture(scope="module")
def slope_problem():
    """Readings of a line through the origin in steps six times the noise, and candidate slopes."""
    x = np.linspace(0.1, 3.0, 25)
    noise, truth = Rounded(0.05, 0.3), 0.4
    return x, noise, noise.sample(truth * x, x, np.random.default_rng(6)), np.linspace(0.2, 0.6, 4001)


def test_rounded_posterior_is_that_of_quadrature(slope_problem):
    """The posterior of a slope, with each interval's probability integrated from the normal density."""
    x, noise, readings, grid = slope_problem
    nodes, weights = np.polynomial.legendre.leggauss(60)
    values = readings[:, None] + 0.5 * noise.resolution * nodes
    density = stats.norm.pdf(values[None], (grid[:, None] * x)[..., None], noise.sd)
    slow = np.log(0.5 * noise.resolution * density @ weights).sum(axis=1)
    found = noise.log_density(grid[:, None] * x, readings)
    np.testing.assert_allclose(found, slow, rtol=1e-9)
    np.testing.assert_allclose(posterior_moments(found, grid), posterior_moments(slow, grid), rtol=1e-9)


def test_naive_normal_posterior_is_wider(slope_problem, rng):
    """Negative control: normal noise with the variance of rounding added wastes what the edges tell.

    At steps h much larger than the noise the mean information of a reading is 1.81 / (h sd), that of a probit for
    each edge, in place of 12 / h^2: with h = 30 sd it is 4.5 times as much, and the posterior 2.1 times narrower.
    """
    x, _, _, grid = slope_problem
    noise = Rounded(0.01, 0.3)
    naive = Normal(np.hypot(noise.sd, noise.resolution / np.sqrt(12)))
    sds = np.empty((2, 40))
    for i in range(40):
        readings = noise.sample(rng.uniform(0.35, 0.45) * x, x, rng)
        for row, model in zip(sds, (noise, naive), strict=True):
            row[i] = posterior_moments(model.log_density(grid[:, None] * x, readings), grid)[1]
    assert 1.5 < np.median(sds[1] / sds[0]) < 3.0


def test_newton_finds_the_mode_of_rounded_readings(slope_problem):
    """Steps -(J'J)^-1 J'z converge quadratically, J'J being the Hessian of the minus log density."""
    x, noise, readings, grid = slope_problem
    slope = 0.45
    for _ in range(8):
        z = noise.residuals((slope * x)[None], readings)[0]
        weighed = noise.weigh(x[:, None], slope * x, readings)[:, 0]
        step = -(weighed @ z) / (weighed @ weighed)
        slope += step
    assert abs(step) < 1e-12
    assert slope == pytest.approx(grid[np.argmax(noise.log_density(grid[:, None] * x, readings))], abs=1e-4)


def test_student_t_shrugs_off_an_outlier(times, rng):
    """Negative control of the normal model: one wild reading moves its mode, and not that of the t."""
    readings = 0.1 * rng.standard_normal(40)
    grid = np.linspace(-1, 3, 4001)
    clean = {noise: noise.log_density(grid[:, None] + 0 * times, readings) for noise in (Normal(0.1), StudentT(0.1, 3))}
    readings[7] = 20.0
    moved = {noise: noise.log_density(grid[:, None] + 0 * times, readings) for noise in clean}
    shift = {type(noise): np.ptp(grid[[clean[noise].argmax(), moved[noise].argmax()]]) for noise in clean}
    assert shift[Normal] == pytest.approx(0.5, abs=0.01)  # 20 / 40
    assert shift[StudentT] < 0.02


@pytest.mark.parametrize(
    ("make", "kind", "key"),
    [
        (lambda: Normal(0.0), "value", "sd"),
        (lambda: Normal(-0.1), "value", "sd"),
        (lambda: Normal(np.nan), "value", "sd"),
        (lambda: Rounded(0.0, 0.0), "value", "sd"),
        (lambda: Rounded(-0.1, 0.1), "value", "sd"),
        (lambda: Rounded(0.1, -0.1), "value", "resolution"),
        (lambda: Rounded(0.1, 0.0), "value", "resolution"),
        (lambda: Rounded(0.0, 0.1), "value", "sd"),
        (lambda: SetMembership(0.0), "value", "resolution"),
        (lambda: StudentT(1.0, 0.0), "value", "dof"),
        (lambda: AR1(1.0, -3.0), "value", "correlation_time_s"),
        (lambda: reading_noise(0.0, 0.0), "value", "sd"),
        (lambda: reading_noise(-1.0, 0.1), "value", "sd"),
        (lambda: AR1(1.0, 1.0).log_density(np.zeros((1, 3)), np.zeros(3), [0.0, 2.0, 2.0]), "value", "times"),
        (lambda: AR1(1.0, 1.0).sample(np.zeros(2), [1.0, 0.0], np.random.default_rng(0)), "value", "times"),
        (lambda: Normal(1.0).log_density(np.zeros((2, 3)), np.zeros(4)), "value", "readings"),
        (lambda: Normal(1.0).residuals(np.zeros((2, 3)), np.zeros(3), np.zeros(2)), "value", "readings"),
        (lambda: Rounded(1.0, 1.0).log_density(np.zeros(3), np.zeros(3)), "value", "readings"),
    ],
)
def test_bad_noise_is_refused_with_the_reason(make, kind, key):
    with refused(kind, key):
        make()


def test_reading_noise_picks_the_model():
    """Zero sd or zero resolution are limits with models of their own."""
    models = [reading_noise(0.0, 0.1), reading_noise(0.2), reading_noise(0.2, 0.1)]
    assert models == [SetMembership(0.1), Normal(0.2), Rounded(0.2, 0.1)]


@pytest.mark.parametrize("noise", [*SMOOTH, UnknownSd(0.3)], ids=[*NAMES[:-1], "UnknownSd"])
def test_quantile_residuals_at_the_truth_are_standard_normal_and_independent(noise, truth, times, rng):
    """Over 2000 simulated records: uniform probabilities, no correlation of neighbours, sums of squares chi-square."""
    found = [noise.quantile_residuals(truth[None], noise.sample(truth, times, rng), times, rng)[0] for _ in range(2000)]
    found = np.array(found)
    assert stats.kstest(found.ravel(), "norm").pvalue > 1e-3
    assert stats.kstest(np.sum(found**2, axis=1), stats.chi2(40).cdf).pvalue > 1e-3
    # a correlation of 78,000 pairs: four standard errors
    assert abs(np.mean(found[:, 1:] * found[:, :-1])) < 4 / np.sqrt(78_000)


@pytest.mark.parametrize("noise", SMOOTH, ids=NAMES[:-1])
def test_quantile_residuals_grow_with_the_reading_into_the_far_tails(noise, rng):
    """Signs are those of reading less prediction; forty sd out they are finite and large."""
    times, errors = np.arange(5.0), np.array([-12.0, -1.5, 0.0, 1.5, 12.0])
    (found,) = noise.quantile_residuals(np.zeros((1, 5)), errors, times, rng)
    assert np.isfinite(found).all()
    assert found[0] < -3
    assert found[-1] > 3
    if isinstance(noise, Normal):
        np.testing.assert_allclose(found, errors / noise.sd, rtol=1e-14)
    if isinstance(noise, Rounded):
        assert np.all(np.abs(noise.sd * found[[0, -1]] - errors[[0, -1]]) <= 0.5 * noise.resolution)
    if isinstance(noise, StudentT):
        np.testing.assert_allclose(stats.norm.cdf(found), stats.t.cdf(errors / noise.sd, noise.dof), rtol=1e-9)
