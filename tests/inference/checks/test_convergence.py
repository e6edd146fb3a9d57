"""Autocorrelation times, effective sample sizes and R-hat on chains whose law is known."""

import importlib
import warnings
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import lfilter

from bayesub.inference.checks import convergence
from bayesub.inference.checks.convergence import jump_sentence, largest_jump
from thesis import sampler_cost


def iid(rng, shape=(4, 1000, 16, 3)):
    return rng.standard_normal(shape)


def autoregressive(rng, a, shape):
    """Chains x_t = a x_{t-1} + noise along axis 1, from their stationary law: tau = (1 + a) / (1 - a)."""
    noise = rng.standard_normal(shape) * np.sqrt(1 - a**2)
    noise[:, 0] /= np.sqrt(1 - a**2)
    return lfilter([1.0], [1.0, -a], noise, axis=1)


def test_rhat_of_independent_draws_is_one(rng):
    """Ensembles that agree have R-hat 1, to within the noise of their means."""
    rhat = convergence.rhat(iid(rng))
    assert rhat.shape == (3,)
    # R-hat - 1 is half the variance of 8 means of 8000 draws over that of a draw, about 6e-5.
    assert np.all(np.abs(rhat - 1) < 5e-4)


def test_rhat_sees_a_shift(rng):
    """One of four ensembles off by a standard deviation gives more than 1.05, in that parameter alone."""
    chain = iid(rng)
    chain[2, ..., 1] += 1.0
    rhat = convergence.rhat(chain)
    assert rhat[1] > 1.05
    assert rhat[[0, 2]].max() < 1.001


def test_rhat_sees_a_drift(rng):
    """Ensembles that all drift by a standard deviation over their length agree with each other, not with themselves."""
    chain = iid(rng) + np.linspace(-0.5, 0.5, 1000)[:, None, None]
    assert convergence.rhat(chain).min() > 1.02  # halves half a sd apart: sqrt(1 + 0.25^2 * 8/7) = 1.03


def test_rhat_sees_an_ensemble_that_is_too_narrow(rng):
    """An ensemble with 61 % of the variance has the right mean: only the folded version sees it, as 1.006 to 1.01."""
    chain = iid(rng)
    chain[0] *= np.sqrt(0.61)
    rhat = convergence.rhat(chain)
    assert np.all((rhat > 1.005) & (rhat < 1.02))
    assert np.all(convergence._split_rhat(convergence.rank_normalised(chain)) < 1.001)


def test_rhat_does_not_depend_on_a_monotone_change_of_scale(rng):
    """The bulk version sees ranks only, so that heavy tails do not fool it."""
    chain = iid(rng)
    ranks = convergence.rank_normalised(chain)
    np.testing.assert_array_equal(convergence.rank_normalised(np.exp(5 * chain)), ranks)
    assert abs(ranks.mean()) < 1e-10
    assert ranks.std() == pytest.approx(1.0, abs=1e-3)  # normal scores of 64,000 ranks


@pytest.mark.parametrize("a", [0.0, 0.5, 0.9, 0.97])
def test_autocorrelation_time(rng, a):
    """That of an autoregressive chain is (1 + a) / (1 - a)."""
    tau = convergence.autocorrelation_time(autoregressive(rng, a, (4, 4000, 128, 2)))
    assert tau.shape == (4, 2)
    # With a window of 5 tau the relative variance is 20 tau over the number of draws (Sokal 1997), 2.5 % squared for
    # the longest; the window cuts off exp(-10) of the sum.
    np.testing.assert_allclose(tau.mean(axis=0), (1 + a) / (1 - a), rtol=0.1)


def test_an_ensemble_that_stands_still_spoils_the_mean_of_all(rng):
    """Its autocorrelation time is its length; half of the mean of all draws is then worth its four walkers."""
    chain = iid(rng, (2, 100, 4, 1))
    chain[1] = 3.0
    assert convergence.autocorrelation_time(chain)[1] == 100.0
    # var = (1/2)^2 (1/4 + 1/400) = 1/15.8
    assert convergence.ess(chain)[0] == pytest.approx(15.8, rel=0.02)


def test_ess_counts_independent_draws(rng):
    """Number of draws over autocorrelation time, whichever way the walkers are counted."""
    chain = autoregressive(rng, 0.8, (4, 4000, 8, 1))
    assert convergence.ess(chain)[0] == pytest.approx(chain.size / 9, rel=0.1)
    assert convergence.bulk_ess(chain)[0] == pytest.approx(chain.size / 9, rel=0.1)
    assert convergence.ess(chain)[0] == pytest.approx(
        chain.size / convergence.autocorrelation_time(chain).mean(), rel=1e-12
    )
    assert convergence.ess(iid(rng)).max() <= 64_000


def test_ess_predicts_the_scatter_of_means(rng):
    """The means of many chains scatter as sd / sqrt(ess) says."""
    chains = autoregressive(rng, 0.8, (400, 500, 1, 1))
    scatter = chains.mean(axis=(1, 2, 3)).std(ddof=1)
    predicted = 1 / np.sqrt(convergence.ess(chains)[0] / 400)
    # A standard deviation of 400 means is known to 1 / sqrt(800) = 3.5 %; tau of short chains is 3 % optimistic.
    assert scatter == pytest.approx(predicted, rel=0.15)


def test_tail_ess_is_of_the_tails(rng):
    """Independent draws have independent tails; where the spread wanders slowly only the tails notice."""
    assert np.all(convergence.tail_ess(iid(rng)) > 0.85 * 64_000)
    chain = iid(rng, (4, 4000, 8, 1))
    spread = np.exp(autoregressive(rng, 0.99, chain.shape))
    assert convergence.tail_ess(spread * chain)[0] < 0.1 * convergence.bulk_ess(spread * chain)[0]


def test_ranks_are_even_where_ensembles_agree(rng):
    """As uneven as chance makes them: of 4000 bars of independent draws 1 % are beyond 2.576 sd."""
    n_bins, chain = 20, rng.standard_normal((4, 50, 10, 50))
    ranks = convergence.rank_histograms(chain, n_bins)
    np.testing.assert_allclose(ranks.mean(axis=0), 1.0, atol=1e-12)  # a bin has its share of all draws
    np.testing.assert_allclose(ranks.mean(axis=1), 1.0, atol=1e-12)  # an ensemble has all its draws in some bin
    sd = convergence.rank_spread(2000, 4, n_bins)
    assert ranks.std() == pytest.approx(sd, rel=0.05)
    assert np.mean(np.abs(ranks - 1.0) > 2.5758 * sd) == pytest.approx(0.01, abs=0.005)


def test_ranks_see_an_ensemble_elsewhere_and_one_that_is_too_narrow(rng):
    chain = rng.standard_normal((4, 50, 10, 2))
    chain[0, ..., 0] += 1.0
    chain[0, ..., 1] *= 0.5
    shifted, narrow = convergence.rank_histograms(chain, 20)[0].T
    assert shifted[0] < 0.5 < 2.0 < shifted[-1]
    assert max(narrow[0], narrow[-1]) < 0.5
    assert narrow[9:11].min() > 1.2


@pytest.fixture(scope="module")
def arviz():
    """ArviZ, whose 0.23 announces its successor with a warning on import."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"\s*ArviZ is undergoing a major refactor", category=FutureWarning)
        return importlib.import_module("arviz")


@pytest.mark.parametrize("a", [0.0, 0.7])
@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_rhat_equals_that_of_arviz(rng, arviz, a, shift):
    """With one walker an ensemble is a chain, and R-hat that of ArviZ."""
    chain = autoregressive(rng, a, (4, 1000))
    chain[0] += shift
    chain[1] *= 1 + shift
    # The same formula; round-off only.
    assert convergence.rhat(chain[:, :, None, None])[0] == pytest.approx(float(arviz.rhat(chain)), rel=1e-10)


@pytest.mark.parametrize("a", [0.0, 0.7])
def test_ess_agrees_with_arviz(rng, arviz, a):
    """Bulk and tail effective sizes agree with ArviZ, which sums the correlations in another way."""
    chain = autoregressive(rng, a, (8, 4000))
    ours = [f(chain[:, :, None, None])[0] for f in (convergence.bulk_ess, convergence.tail_ess)]
    theirs = [float(arviz.ess(chain, method="bulk")), float(arviz.ess(chain, method="tail", prob=(0.05, 0.95)))]
    # Windows of 8 chains of 4000: each estimate of tau has a standard deviation of about 5 %.
    np.testing.assert_allclose(ours, theirs, rtol=0.2)


@dataclass
class Stairs:
    """A log likelihood that is smooth, but for stairs along the first parameter."""

    height: float
    width: float = 0.5

    def log_likelihood(self, parameters):
        bent = parameters[:, 1] - 0.1 * parameters[:, 0] ** 2
        return -0.5 * bent**2 + self.height * np.floor(parameters[:, 0] / self.width)


@pytest.fixture
def draws():
    return np.random.default_rng(0).standard_normal((500, 2))


@pytest.mark.parametrize("height", [0.5, 5.0, 50.0])
def test_a_jump_is_as_high_as_it_is(draws, height):
    """Less what a cubic makes of it, and where a piece has one jump only."""
    found = largest_jump(Stairs(height), draws, np.random.default_rng(1))
    assert 0.6 * height < found < 1.2 * height


def test_a_smooth_density_has_none(draws):
    """Negative control: the bent one without stairs."""
    assert largest_jump(Stairs(0.0), draws, np.random.default_rng(1)) < 1e-4


def test_what_is_not_finite_is_left_out(draws):
    """Places where simulations fail are no jumps."""

    class Cliff(Stairs):
        def log_likelihood(self, parameters):
            return np.where(parameters[:, 0] > 1.0, -np.inf, super().log_likelihood(parameters))

    assert largest_jump(Cliff(0.0), draws, np.random.default_rng(1)) < 1e-4
    assert largest_jump(Cliff(5.0), draws, np.random.default_rng(1)) > 3.0


@pytest.mark.slow
def test_jumps_are_lower_with_shorter_steps(monkeypatch):
    """Of a force with sg(w), in the normal approximation of a posterior that rounded and precise readings make."""
    found = []
    for finer in (1.0, 8.0):
        monkeypatch.setattr(sampler_cost, "FINER", finer)
        problem = sampler_cost.pose("auv690", "coupled", "rounded")
        jacobian = problem.jacobian(problem.reference) * problem.prior.sd
        covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(problem.n_params))
        rng = np.random.default_rng(0)
        steps = rng.multivariate_normal(np.zeros(problem.n_params), covariance, 500, method="cholesky")
        found.append(largest_jump(problem, problem.reference + 0.3 * steps * problem.prior.sd, rng))
    assert found[0] > 3.0
    assert found[1] < 0.5 * found[0]


@pytest.mark.parametrize(
    ("jump", "said"), [(0.5, None), (1.0, "dt_s = 0.2 "), (3.0, "dt_s = 0.05 "), (9.0, "dt_s = 0.02 ")]
)
def test_what_to_try(jump, said):
    """The next shorter of the usual steps with which jumps are not noticed; of little ones nothing is said."""
    text = jump_sentence(jump, 0.2)
    assert said in text if said else not text
