"""The stopping rule: chains that have not converged are refused, whatever hides it, and stationary ones are not."""

import numpy as np
import pytest
from scipy.signal import lfilter
from support.toys import ill_conditioned

import bayesub as bs
from bayesub.inference.checks import convergence
from bayesub.inference.sampling.posterior import Criteria, Posterior

A = 0.8  # of the autoregressive chains
TAU = (1 + A) / (1 - A)


def stationary(rng, shape):
    """Chains x_t = A x_{t-1} + noise along axis 1, standard normal from the first step on."""
    noise = rng.standard_normal(shape) * np.sqrt(1 - A**2)
    noise[:, 0] /= np.sqrt(1 - A**2)
    return lfilter([1.0], [1.0, -A], noise, axis=1)


def posterior(chain, **changes):
    n = chain.shape[-1]
    names = tuple(f"c{k}" for k in range(n))
    return Posterior(names, chain, np.zeros(chain.shape[:3]), np.zeros(n), np.ones(n), 100, 0.5, 1, 1.0, {}, **changes)


@pytest.fixture
def chain(rng):
    """Four ensembles of 40 walkers, 50 autocorrelation times long, three parameters."""
    return stationary(rng, (4, round(50 * TAU), 40, 3))


def test_a_stationary_chain_is_accepted(chain):
    assert posterior(chain).shortcomings == ()
    assert posterior(np.exp(3.0 * chain)).shortcomings == ()  # and with heavy tails, as only ranks count


def test_a_parameter_that_never_moves_is_named(chain):
    """It has not converged, is correlated with nothing, and leaves the numbers of the others as they are."""
    still = chain.copy()
    still[..., 1] = 0.3
    one, whole = posterior(still), posterior(chain)
    assert (one.constants, whole.constants) == (("c1",), ())
    assert "all draws of c1 are the same" in one.shortcomings[0]
    assert np.isinf(one.rhat[1])
    assert one.variance_trend[1] == 0.0
    np.testing.assert_array_equal(one.rhat[[0, 2]], whole.rhat[[0, 2]])
    np.testing.assert_array_equal(one.correlation[1], [0.0, 1.0, 0.0])
    np.testing.assert_allclose(whole.correlation, np.corrcoef(whole.draws.T), atol=1e-12)
    np.testing.assert_array_equal(posterior(chain[..., :1]).correlation, [[1.0]])


def test_one_ensemble_stuck_is_refused(chain):
    """Elsewhere, or in a part of the posterior."""
    away, narrow = chain.copy(), chain.copy()
    away[2, ..., 1] += 0.5
    narrow[2, ..., 1] *= 0.4
    for stuck in (away, narrow):
        (sentence,) = posterior(stuck).shortcomings
        assert sentence.startswith("c1: R-hat")
        assert "resume with max_steps of about" in sentence
        assert "narrow the prior" in sentence


def test_a_slow_drift_is_refused(chain):
    """All ensembles move together, so that they agree with each other at any time."""
    drifting = chain.copy()
    drifting[..., 2] += np.linspace(-1.0, 1.0, chain.shape[1])[:, None]
    assert any(sentence.startswith("c2: ") for sentence in posterior(drifting).shortcomings)


def test_a_growing_variance_is_refused(rng):
    """Ensembles that spread together, by 6 % in sd a half, agree in R-hat; the trend of the variance shows it."""
    chain = stationary(rng, (4, round(50 * TAU), 100, 3))
    chain[..., 0] *= np.linspace(0.88, 1.12, chain.shape[1])[:, None]
    judged = posterior(chain)
    assert judged.rhat.max() < 1.01
    (sentence,) = judged.shortcomings
    assert sentence.startswith("c0: the variance changes by")
    assert judged.variance_trend[0] > 0


def test_walkers_stuck_in_a_heavy_tail_are_refused(rng):
    """A tail of one draw in twenty whose walkers hardly ever return: the bulk mixes, the tail does not."""
    chain = stationary(rng, (4, round(50 * TAU), 40, 1))
    chain[:, :, ::20] = 8.0 + 3.0 * stationary(rng, chain[:, :, ::20].shape)
    assert "c0: tail ESS" in " ".join(posterior(chain).shortcomings) or not posterior(chain).converged
    one = stationary(rng, chain.shape)
    one[1, :, :6] = 8.0 + 3.0 * np.abs(one[1, :, :6])  # and the same in one ensemble only
    assert not posterior(one).converged


def test_each_criterion_is_named_with_a_remedy(chain):
    """Length, ESS of bulk and tails; the parameter that is worst and how many more there are."""
    strict = posterior(chain, criteria=Criteria(ess=1e6)).shortcomings
    assert [sentence.split(": ")[1].split()[:2] for sentence in strict] == [["bulk", "ESS"], ["tail", "ESS"]]
    assert all("and 2 more: " in sentence for sentence in strict)
    (short,) = posterior(chain[:, : round(10 * TAU)]).shortcomings
    assert "autocorrelation times long, 25 are needed; resume with max_steps of about" in short
    assert posterior(chain[:, :40]).shortcomings == ("only 40 steps were kept; raise max_steps",)
    lonely = posterior(chain[:3]).shortcomings
    assert lonely == ("only 3 independent ensembles; at least 4 are needed for R-hat",)


def test_the_trend_test_has_its_false_alarm_rate(rng):
    """On stationary chains it is a standard normal: one run in a hundred is refused, however many its parameters."""
    trends = np.concatenate(
        [convergence.variance_trend(stationary(rng, (4, round(26 * TAU), 16, 50))) for _ in range(20)]
    )
    # Of 1000 values: sd 1 to within 2 % a standard deviation, plus a few per cent for the error of tau; 4.6 % beyond 2
    # to within 0.7 %.
    assert trends.std() == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.abs(trends) > 2.0) == pytest.approx(0.0455, abs=0.025)
    assert np.abs(trends).max() < convergence.threshold(1000, 0.01)
    assert convergence.threshold(100, 0.01) == pytest.approx(3.89, abs=0.01)  # normal tables: 5e-5 on each side


def test_thinning_changes_no_verdict(rng):
    """R-hat, tau and effective sizes of a chain of a thousand steps, thinned to 250, are those of all its draws."""
    a = 0.95
    noise = rng.standard_normal((4, 1500, 40, 2)) * np.sqrt(1 - a**2)
    chain = lfilter([1.0], [1.0, -a], noise, axis=1)[:, 500:]
    judged = posterior(chain)
    np.testing.assert_allclose(judged.tau.max(axis=0), convergence.autocorrelation_time(chain).max(axis=0), rtol=0.1)
    np.testing.assert_allclose(judged.bulk_ess, convergence.bulk_ess(chain), rtol=0.1)
    np.testing.assert_allclose(judged.tail_ess, convergence.tail_ess(chain), rtol=0.1)
    np.testing.assert_allclose(judged.rhat - 1, convergence.rhat(chain) - 1, atol=1e-3)


def test_a_sampler_that_stops_early_says_so():
    """From a real run: too few steps, too few ensembles, too short."""
    problem, _ = ill_conditioned()

    def shortcomings(**options):
        return bs.sample(problem, rng=np.random.default_rng(0), **options).shortcomings

    assert shortcomings(max_steps=30) == ("only 27 steps were kept; raise max_steps",)
    assert "500 are needed" in shortcomings(max_steps=100, criteria=Criteria(taus=500.0))[0]
    assert "only 2 independent ensembles" in shortcomings(n_ensembles=2, max_steps=100)[0]


def test_a_part_keeps_the_convergence_that_was_judged_among_all(chain):
    whole = posterior(chain)
    part = whole.part(np.array([2, 0]))
    assert part.names == ("c2", "c0")
    assert np.array_equal(part.draws, whole.draws[:, [2, 0]])
    for key in ("rhat", "bulk_ess", "tail_ess", "tau"):
        assert np.array_equal(getattr(part, key), getattr(whole, key)[..., [2, 0]])
    assert part.n_steps == whole.n_steps
    assert list(part.summary().index) == ["c2", "c0"]
