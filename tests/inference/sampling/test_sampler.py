"""The sampler on problems with a known posterior; its checkpoints and its verdicts."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from support.refusals import refused
from support.toys import AGREE, Banana, Cliff, Linear, disagreement, ill_conditioned, second_moments, standardised

import bayesub as bs
from bayesub.inference.checks import convergence
from bayesub.inference.sampling.posterior import Criteria
from bayesub.inference.sampling.sampler import search_from, search_mode
from bayesub.io.errors import InputError
from bayesub.problem.priors import Joint, Normal, Uniform

ENDLESS = Criteria(ess=1e12)  # never met, so that the length is max_steps


@pytest.fixture(scope="module")
def linear():
    """A linear problem of condition 1e5 with a null direction, and its sampled posterior."""
    problem, null = ill_conditioned()
    criteria = Criteria(ess=4000.0)
    return problem, null, bs.sample(problem, rng=np.random.default_rng(2), n_walkers=32, criteria=criteria)


def test_reproduces_a_normal_posterior(linear):
    """Mean and covariance are the closed form within Monte Carlo error, over five decades of scale."""
    problem, _, posterior = linear
    assert posterior.converged
    assert disagreement(second_moments(standardised(posterior.chain, problem.mean, problem.covariance))) < AGREE


def test_the_check_fails_against_a_wrong_noise(linear):
    """Negative control: the same chain is not the posterior of noise half as large again."""
    problem, _, posterior = linear
    wrong = Linear(problem.matrix, problem.readings, problem.prior, sd=1.5)
    features = second_moments(standardised(posterior.chain, problem.mean, wrong.covariance))
    assert disagreement(features) > 3 * AGREE


def test_a_null_direction_keeps_its_prior(linear):
    """Of a direction that the data do not see the prior comes back, mean and standard deviation."""
    problem, null, posterior = linear
    along = (posterior.chain - problem.prior.mean) / problem.prior.sd @ null
    n = convergence.ess(along[..., None])[0]
    assert abs(along.mean()) < AGREE / np.sqrt(n)
    assert along.std() == pytest.approx(1.0, abs=AGREE / np.sqrt(2 * n))
    assert n > 2000


def test_posterior_summaries(linear):
    """Contraction, correlation and quantiles describe the draws."""
    problem, _, posterior = linear
    sd = np.sqrt(np.diag(problem.covariance))
    error = AGREE / np.sqrt(posterior.bulk_ess)
    assert np.all(np.abs(posterior.mean - problem.mean) < error * sd)
    assert np.all(np.abs(posterior.sd / sd - 1) < error / np.sqrt(2))
    np.testing.assert_allclose(posterior.contraction, posterior.sd / problem.prior.sd)
    assert np.abs(posterior.correlation - problem.covariance / np.outer(sd, sd)).max() < error.max()
    # 5 % quantile of a normal; its standard error is sqrt(0.05 * 0.95) / 0.103 = 2.1 sd of a mean.
    low = posterior.quantiles([0.05])[0]
    assert np.all(np.abs(low - problem.mean + 1.6449 * sd) < 2.2 * error * sd)
    assert posterior.draws.shape == (posterior.chain[..., 0].size, 6)
    assert posterior.evaluations == problem.costs.simulations


def test_samples_a_banana():
    """A sheet 20 times thinner than its bend is deep gives both marginals, tails included."""
    problem = Banana()
    posterior = bs.sample(problem, rng=np.random.default_rng(4), n_walkers=16, criteria=Criteria(ess=4000.0))
    assert posterior.converged
    x, weights, mean, variance = problem.marginals()
    x0, x1 = posterior.chain[..., 0], posterior.chain[..., 1]
    far = 2.0
    features = np.stack(
        [
            x0,
            x0**2 - weights @ x**2,
            (np.abs(x0) > far) - weights @ (np.abs(x) > far),
            x1 - weights @ mean,
            x1**2 - weights @ (mean**2 + variance),
            x1 + x0**2 - weights @ (mean + x**2),
            (x1 + x0**2) ** 2 - weights @ ((mean + x**2) ** 2 + variance),
        ],
        axis=-1,
    )
    assert disagreement(features) < AGREE
    # Negative control: the sheet of a boat measured half as accurately.
    features[..., -1] += variance - 4 * variance
    assert disagreement(features) > AGREE


@pytest.mark.parametrize(
    ("n_ensembles", "n_walkers", "key"), [(0, 16, "n_ensembles"), (4, 1, "n_walkers"), (4, 0, "n_walkers")]
)
def test_bad_numbers_of_walkers(n_ensembles, n_walkers, key):
    """There must be an ensemble, and walkers in it."""
    with refused("value", key):
        bs.sample(ill_conditioned()[0], rng=np.random.default_rng(0), n_ensembles=n_ensembles, n_walkers=n_walkers)


def test_the_same_seed_gives_the_same_chain():
    """Every random number comes from the generator that was passed in."""

    def run(seed):
        return bs.sample(Banana(), rng=np.random.default_rng(seed), n_walkers=16, max_steps=40).chain

    np.testing.assert_array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def test_failing_simulations_do_not_enter_the_chain():
    """Where the log posterior is -inf nobody starts and nobody goes."""
    posterior = bs.sample(Cliff(), rng=np.random.default_rng(3), n_walkers=16, max_steps=300, criteria=ENDLESS)
    assert posterior.draws[:, 0].max() <= 1.0
    assert posterior.draws[:, 0].max() > 0.9
    assert np.isfinite(posterior.log_prob).all()


def test_samples_a_boat(suboff, spiral, spiral_track):
    """On a record of a spiral the sampler agrees with the Laplace approximation where that is good, and moves well."""
    record = bs.observe(spiral_track, bs.sensors.Track(0.5, 0.1, 5.0, ("x", "y", "yaw")), np.random.default_rng(8))
    names = ("Xuu", "Xuu_drdr", "Yuv", "Nuv", "Nuu_dr", "Nur")
    prior = bs.priors.relative_normal(0.1)
    problem = bs.Problem(suboff, spiral, record, free=names, prior=prior, dt=2.0)
    mode = bs.baselines.gauss_newton(problem)
    posterior = bs.sample(problem, rng=np.random.default_rng(9), max_steps=400)
    assert posterior.converged
    sd = np.sqrt(np.diag(mode.covariance))
    # Six coefficients of a linear-looking problem: skewness shifts the mean by a few per cent of a standard deviation.
    assert np.abs((posterior.mean - mode.values) / sd).max() < 0.3
    np.testing.assert_allclose(posterior.sd, sd, rtol=0.2)
    assert posterior.acceptance > 0.3
    truth = (suboff.xi[problem.columns] - posterior.mean) / posterior.sd
    assert np.abs(truth).max() < 4.0


def test_simulations_and_jacobians_are_all_counted(suboff, spiral, spiral_track, rng):
    """Also those of the search and the surrogate where a channel says only an interval; Jacobians at their price."""
    record = bs.observe(spiral_track, bs.sensors.Sensor("u_mps", sd=0.0, resolution=0.05, interval_s=20.0), rng)
    problem = bs.Problem(suboff, spiral, record, free=("Xuu",), prior=bs.priors.relative_uniform(0.5), dt=2.0)
    runs, flights = [], []
    flown, slopes = problem.forward.predicted, problem.forward.slopes
    problem.forward.predicted = lambda sets, values: (runs.append(len(sets)), flown(sets, values))[1]
    problem.forward.slopes = lambda *arguments, **options: (flights.append(1), slopes(*arguments, **options))[1]
    posterior = bs.sample(problem, rng=np.random.default_rng(9), max_steps=20)
    # A Jacobian of a problem that is not normal has a simulation in it, which is in its price.
    assert posterior.evaluations == sum(runs) - len(flights)
    assert posterior.jacobians == len(flights) > 20
    assert posterior.jacobian_price > 0.0
    assert posterior.work == posterior.evaluations + posterior.jacobians * posterior.jacobian_price


@pytest.mark.parametrize(("bounded", "n_walkers"), [(0, 16), (1, 16), (2, 8), (3, 8)])
def test_ensembles_within_bounds_have_half_the_walkers(bounded, n_walkers):
    """By default, if most parameters have bounds; a number that is given counts."""
    of_each = [Uniform(-np.ones(1), np.ones(1))] * bounded + [Normal(np.zeros(1), np.ones(1))] * (3 - bounded)
    problem = Linear(np.eye(3), np.zeros(3), Joint(tuple(of_each), tuple(np.arange(3)[:, None])))
    assert bs.sample(problem, rng=np.random.default_rng(1), max_steps=20).chain.shape[2] == n_walkers
    assert bs.sample(problem, rng=np.random.default_rng(1), max_steps=20, n_walkers=5).chain.shape[2] == 5


class Recorder:
    """Progress that keeps what it is told."""

    def __init__(self):
        self.updates = []

    def update(self, done, total, unit="", note=""):
        self.updates.append((done, total, unit, note))


def test_progress_is_numbers():
    """Steps out of how many, after the rounds of the surrogate; never more than all."""
    progress = Recorder()
    posterior = bs.sample(Banana(), rng=np.random.default_rng(3), n_walkers=16, max_steps=500, progress=progress)
    units = [unit for _, _, unit, _ in progress.updates]
    assert units[0] == ""
    assert "rounds" in units
    assert units[-1] == "steps"
    assert all(0 <= done <= total for done, total, _, _ in progress.updates)
    assert progress.updates[-1][0] == posterior.n_warmup + posterior.n_steps
    assert re.fullmatch(r"R-hat 1\.\d{4}, ESS \d+", progress.updates[-1][3])


def test_the_mode_is_searched_before_a_step_is_taken_and_overflow_is_not_spoken_of():
    """What searches the mode may end the run; densities that overflow far out are refused without a warning."""
    modes, states = [], []

    def search(problem, rng):
        modes.append(search_mode(problem, rng))
        states.append(np.geterr())
        raise InputError("does not fit")

    with pytest.raises(InputError, match="does not fit"):
        bs.sample(Banana(), rng=np.random.default_rng(3), max_steps=100, search=search)
    assert modes[0].shape == (Banana().n_params,)
    assert (states[0]["over"], states[0]["invalid"]) == ("ignore", "ignore")


def test_a_posterior_of_fewer_readings_is_where_a_run_begins(linear):
    """The posterior of all readings is the closed form, wherever the run begins; some parameters may be new."""
    problem, _, _ = linear
    half = Linear(problem.matrix[::2], problem.readings[::2], problem.prior)
    before = bs.sample(half, rng=np.random.default_rng(4))
    kept = before.part(np.array([0, 1, 3]))
    for known, n_new in ((before, 0), (kept, problem.n_params - 3)):
        found = search_from(known, problem, np.random.default_rng(5))
        assert found.shape == (1 + len(known.draws), problem.n_params)
        assert np.isnan(found).any(axis=0).sum() == n_new
        np.testing.assert_allclose((found[0] - problem.mean) / np.sqrt(np.diag(problem.covariance)), 0.0, atol=1e-3)
        posterior = bs.sample(problem, rng=np.random.default_rng(6), search=partial(search_from, known))
        assert posterior.converged
        assert disagreement(second_moments(standardised(posterior.chain, problem.mean, problem.covariance))) < AGREE
    with refused("conflict", "start"):
        search_from(replace(kept, names=("Xuu", "Yuv", "Nuv")), problem, np.random.default_rng(7))


def test_convergence_is_looked_at_as_often_as_is_asked():
    """A run ends at the first look at which it has converged, and its steps are those of a longer one."""
    problem = Linear(np.eye(2), np.ones(2), Normal(mean=np.zeros(2), sd=np.ones(2)))
    often, seldom = (bs.sample(problem, rng=np.random.default_rng(5), criteria=Criteria(look=n)) for n in (20, 100))
    ends = [posterior.n_warmup + posterior.n_steps for posterior in (often, seldom)]
    assert all(posterior.converged for posterior in (often, seldom))
    assert ends[0] < ends[1] == 100
    assert ends[0] % 20 == 0
    both = slice(seldom.n_warmup, ends[0])
    of_each = [
        posterior.chain[:, both.start - posterior.n_warmup :][:, : ends[0] - both.start]
        for posterior in (often, seldom)
    ]
    np.testing.assert_array_equal(*of_each)


def test_no_steps_are_refused():
    """They would never end."""
    with refused("value", "max_steps"):
        bs.sample(Banana(), rng=np.random.default_rng(1), max_steps=0)


def test_ctrl_c_in_a_density_prints_nothing(capsys):
    """emcee prints a traceback of its own, whatever becomes of the error."""

    class Interrupted(Banana):
        def log_likelihood(self, parameters):
            if len(parameters) == 4 * 16:  # of a step
                raise KeyboardInterrupt
            return super().log_likelihood(parameters)

    with pytest.raises(KeyboardInterrupt):
        bs.sample(Interrupted(), rng=np.random.default_rng(3), n_walkers=16)
    assert capsys.readouterr() == ("", "")
