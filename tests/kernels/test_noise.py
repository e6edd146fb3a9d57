"""Noise kernels against arithmetic of 450 digits, SciPy and closed forms."""

import decimal
import functools
from decimal import Decimal

import numba
import numpy as np
import pytest
from scipy import special, stats

from bayesub.kernels import noise
from bayesub.kernels.noise import LOG_2, exponential, mills_ratio, split

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="what is compiled is what is tested")
HALF_WIDTHS = [5e-7, 5e-4, 1e-2, 0.3, 0.99, 1.0, 1.01, 2.5, 12.0, 500.0]


@numba.njit(error_model="numpy", fastmath={"contract"})
def compiled(x):
    result = np.empty((4, len(x)))
    for i in range(len(x)):
        mantissa, exponent = split(x[i])
        result[0, i], result[1, i] = exponential(-x[i]), mills_ratio(x[i])
        result[2, i], result[3, i] = mantissa, exponent
    return result


@functools.cache
def normal_integral(x: float) -> Decimal:
    """Integral of exp(-t^2 / 2) from 0 to x, by its series of positive terms."""
    with decimal.localcontext(prec=450):
        term = total = x = Decimal(x)
        k = 1
        while abs(term) > abs(total) * Decimal(10) ** -440:
            k += 2
            term *= x * x / k
            total += term
        return total * (-x * x / 2).exp()


def slow_log_probability(distance: float, half: float) -> float:
    """log of Phi(distance + half) - Phi(distance - half); beyond 48 nothing is left of a tail that starts below 41."""
    with decimal.localcontext(prec=450):
        a, b = (max(min(Decimal(distance) + s * Decimal(half), Decimal(48)), Decimal(-48)) for s in (-1, 1))
        return float((normal_integral(b) - normal_integral(a)).ln()) - 0.5 * np.log(2 * np.pi)


def distances(half):
    """Inside, at the edge, outside and up to 40 sd from the interval, on both sides of every change of formula."""
    some = [0.0, 0.3, 1.0, 3.7, 9.0, 20.0, 39.9, 0.999 / half, 1.001 / half]
    some += [half + step for step in (-6.0, -1.0, -1e-6, 0.0, 1e-6, 1.0, 7.0, 40.0)]
    return np.array([c for c in some if 0.0 <= c <= half + 40.0])


def log_probabilities(distances, half, sd=1.0):
    """Log probability of one reading of zero for each prediction."""
    predicted = np.asarray(distances, dtype=float)[:, None]
    return noise.rounded_log_probabilities(predicted, np.zeros(1), half, np.full(len(predicted), sd))


def test_exponential_and_mills_ratio():
    """They agree with the library within a few units in the last place, from zero to far tails."""
    x = np.concatenate([np.linspace(0.0, 700.0, 20_001), 10.0 ** np.arange(-300.0, 2.8, 0.1)])
    found = compiled(x)
    np.testing.assert_allclose(found[0], np.exp(-x), rtol=5e-16)
    np.testing.assert_allclose(found[1], np.sqrt(np.pi / 2) * special.erfcx(x / np.sqrt(2)), rtol=2e-15)


def test_exponential_of_the_far_tail_is_zero():
    """Below the smallest normal number the result is zero, not rubbish, for the infinite too."""
    np.testing.assert_array_equal(compiled(np.array([708.5, 1e4, 1e300, np.inf]))[0], 0.0)


def test_split_is_exact():
    """x = mantissa 2^exponent with a mantissa in [1, 2), to the last bit; what is not a number stays so."""
    x = np.concatenate([10.0 ** np.arange(-300.0, 300.0, 0.7), [1.0, 2.0, np.nextafter(2.0, 0.0)]])
    mantissa, exponent = compiled(x)[2:]
    assert ((mantissa >= 1.0) & (mantissa < 2.0)).all()
    np.testing.assert_array_equal(np.ldexp(mantissa, exponent.astype(int)), x)
    assert np.isnan(compiled(np.array([np.nan]))[2, 0])
    assert pytest.approx(np.log(2.0), rel=1e-16) == LOG_2


@pytest.mark.parametrize("half", HALF_WIDTHS)
def test_rounded_probabilities_to_40_sigma(half):
    """The log probability is right to 1e-12 of itself or 1e-13, whichever is more, at 1e-3 to 1e3 steps per sd."""
    c = distances(half)
    expected = np.array([slow_log_probability(one, half) for one in c])
    np.testing.assert_array_less(np.abs(log_probabilities(c, half) - expected), np.maximum(1e-12 * -expected, 1e-13))


def test_textbook_difference_of_cdfs_fails_where_the_kernel_does_not():
    """Negative control: Phi(b) - Phi(a) is lost 40 sd away and has lost three digits at narrow steps."""
    with np.errstate(divide="ignore"):
        assert np.log(stats.norm.cdf(40.5) - stats.norm.cdf(39.5)) == -np.inf
    textbook = np.log(stats.norm.cdf(6.0 + 5e-4) - stats.norm.cdf(6.0 - 5e-4))
    assert abs(textbook - slow_log_probability(6.0, 5e-4)) > 1e-9


@pytest.mark.parametrize("half", HALF_WIDTHS)
def test_rounded_probabilities_fall_off_for_ever(half):
    """They are finite, fall with distance and do so by a^2 / 2 far beyond any quadrature."""
    a = 10.0 ** np.arange(2.0, 100.0)
    found = log_probabilities(half + a, half)
    assert np.isfinite(found).all()
    assert (np.diff(found) < 0).all()
    # what is left is log a and the log of the step, with a known to the rounding of half + a
    np.testing.assert_allclose(found, -0.5 * a * a, rtol=1e-2)
    np.testing.assert_allclose(found[5:], -0.5 * a[5:] ** 2, rtol=1e-8)


def test_even_and_without_scale(rng):
    """Mirrored errors are equally likely to the last bit, and so is the same problem in units twice as large."""
    for half in HALF_WIDTHS:
        c = rng.uniform(0, half + 10, 50)
        np.testing.assert_array_equal(log_probabilities(c, half), log_probabilities(-c, half))
        np.testing.assert_array_equal(log_probabilities(c, half), log_probabilities(2 * c, 2 * half, sd=2.0))


@pytest.mark.parametrize("half", [1e-2, 0.3, 0.99, 1.01, 2.5, 12.0])
def test_slopes_are_derivatives(half):
    """The slope is the derivative of minus the log probability and the information that of the slope."""
    c, zero = distances(half), np.zeros(1)
    # Points at which a difference would straddle nothing but smooth function: all are, whatever the formula.
    step = 1e-4
    around = (c[:, None] + step * np.array([-2, -1, 0, 1, 2]))[..., None]
    weights = np.array([1, -8, 0, 8, -1]) / (12 * step)
    slopes, information = noise.rounded_slopes(around.reshape(-1, 1), zero, half, np.ones(around.size))
    slopes, information = slopes.reshape(-1, 5), information.reshape(-1, 5)
    values = -log_probabilities(around.ravel(), half).reshape(-1, 5)
    # round-off of the values over the step, and the fifth derivative times step^4
    np.testing.assert_allclose(values @ weights, slopes[:, 2], rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(slopes @ weights, information[:, 2], atol=1e-8)


@pytest.mark.parametrize("half", [0.3, 0.99, 1.01, 2.5, 12.0])
def test_information_is_one_minus_the_truncated_variance(half):
    """Information in units of 1/sd^2 is what rounding leaves of it: one minus the variance within the interval."""
    c = np.linspace(0.0, half + 3.0, 40)
    _, information = noise.rounded_slopes(c[:, None], np.zeros(1), half, np.ones(len(c)))
    expected = [1.0 - stats.truncnorm.var(one - half, one + half) for one in c]
    np.testing.assert_allclose(information[:, 0], expected, atol=1e-9)  # SciPy's truncated moments cancel


@pytest.mark.parametrize("half", HALF_WIDTHS)
def test_information_lies_between_zero_and_one(half):
    """Everywhere, far away too, where it becomes that of the unrounded reading."""
    c = np.concatenate([distances(half), half + 10.0 ** np.arange(1.0, 150.0)])
    slopes, information = noise.rounded_slopes(c[:, None], np.zeros(1), half, np.ones(len(c)))
    assert np.isfinite(slopes).all()
    assert ((information >= 0) & (information <= 1)).all()
    np.testing.assert_allclose(information[-140:], 1.0, atol=1e-7)


@pytest.mark.parametrize("n", [1, 2, 63, 64, 65, 500])
def test_batch_equals_one_by_one_bitwise(rng, n):
    """A member's log density depends on nothing but the member, and has every one of n readings in it once."""
    predicted, readings = rng.standard_normal((9, n)) * 3, rng.standard_normal(n)
    sds, times = 10.0 ** rng.uniform(-2, 2, 9), np.cumsum(rng.uniform(0.1, 2.0, n))
    calls = {
        "squares": lambda p, _: noise.sums_of_squares(p, readings),
        "student": lambda p, s: noise.student_t_logarithms(p, readings, s, np.full(len(s), 3.0)),
        "rounded": lambda p, s: noise.rounded_log_probabilities(p, readings, 0.5, s),
        "autoregressive": lambda p, s: noise.autoregressive_sums(p, readings, times, s),
    }
    for call in calls.values():
        together = call(predicted, sds)
        for i in range(9):
            np.testing.assert_array_equal(together[i : i + 1], call(predicted[i : i + 1], sds[i : i + 1]))
    single = [log_probabilities((predicted[0] - readings)[k : k + 1], 0.5, sds[0])[0] for k in range(n)]
    np.testing.assert_allclose(calls["rounded"](predicted, sds)[0], sum(single), rtol=1e-12)
