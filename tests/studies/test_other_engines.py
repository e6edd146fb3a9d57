"""Samplers that users reach for: right on a known posterior, within their budget, and in words where it is short."""

import sys

import numpy as np
import pytest
from support.refusals import refused
from support.toys import ill_conditioned

import bayesub as bs
from bayesub.inference.checks import convergence
from bayesub.inference.sampling import nuts
from bayesub.inference.sampling.moments import Moments
from other_engines import samplers

ENGINES = {
    "nutpie": (samplers.nutpie_draws, 60_000, {}),
    "dynesty": (samplers.dynesty_draws, 100_000, {"nlive": 500}),
}


def toy():
    """Three normal parameters, of which one is known five times better than its prior."""
    return ill_conditioned(singular_values=np.array([5.0, 2.0, 0.0]))[0]


@pytest.fixture(scope="module", params=ENGINES)
def drawn(request):
    engine, budget, settings = ENGINES[request.param]
    problem = toy()
    return problem, budget, engine(problem, np.random.default_rng(2), budget, **settings)


def test_an_engine_samples_the_posterior_within_its_budget(drawn):
    """Mean and sd of every parameter lie within the error that the effective sample size states."""
    problem, budget, draws = drawn
    cost = draws.cost(jacobian_price=5.0)
    assert cost["rhat"] < nuts.MOST_RHAT, cost["reached"]
    assert cost["ess"] > samplers.TARGET
    assert draws.simulations <= 1.01 * budget
    assert draws.jacobians <= budget
    white = problem.standardised(draws.chain)
    for feature, truth in ((white, 0.0), (white**2, 1.0)):
        error = feature.std(axis=(0, 1)) / np.sqrt(convergence.ess(feature[:, :, None]))
        assert np.abs((feature.mean(axis=(0, 1)) - truth) / error).max() < 4.0  # of six, passed once in 2500
    assert all(len(np.unique(chain[:, 0])) > 0.5 * len(chain) for chain in draws.chain)


def test_costs_are_counted_and_the_first_draws_that_suffice_cost_less(drawn):
    problem, _, draws = drawn
    cost = draws.cost(jacobian_price=5.0)
    assert (problem.costs.simulations, problem.costs.jacobians) == (cost["simulations"], cost["jacobians"])
    assert cost["work"] == cost["simulations"] + 5.0 * cost["jacobians"]
    seconds, work = cost["to_target"]
    assert seconds / cost["seconds"] == pytest.approx(work / cost["work"])
    if cost["jacobians"]:
        assert 0.3 * cost["work"] < work < 0.9 * cost["work"]  # the adaptation, and a part of the draws
    else:
        assert work == cost["work"]  # a nested run is of use when it has ended


def test_its_posterior_agrees_with_ours_and_a_shifted_one_does_not(drawn):
    problem, _, draws = drawn
    ours = bs.sample(toy(), rng=np.random.default_rng(4))
    assert nuts.compare(ours, Moments.of_chain(draws.chain), engine="it").verdict == "agree"
    shifted = draws.chain + 0.4 * np.sqrt(np.diag(problem.covariance))
    moved = nuts.compare(ours, Moments.of_chain(shifted), engine="it")
    assert moved.verdict == "disagree"
    assert moved.sentence.startswith("it disagrees beyond Monte Carlo error")


@pytest.mark.parametrize("engine", [samplers.nutpie_draws, samplers.dynesty_draws])
def test_a_budget_that_is_too_small_gives_no_draws_and_says_how_far_it_came(engine):
    problem = toy()
    draws = engine(problem, np.random.default_rng(2), 2000)
    cost = draws.cost(jacobian_price=5.0)
    assert draws.chain.shape[1:] == (0, 3)
    assert (cost["ess"], cost["rhat"], cost["to_target"]) == (0.0, None, None)
    assert draws.simulations < 2600  # the points that begin, and those of a move
    assert draws.reached.endswith((" of 400 draws of the adaptation", " nats"))


def test_runs_that_disagree_reach_nothing(drawn):
    """Negative control: one chain elsewhere, whatever the effective sizes are."""
    problem, _, draws = drawn
    chain = draws.chain.copy()
    chain[0] += np.sqrt(np.diag(problem.covariance))
    apart = samplers.EngineDraws(**(vars(draws) | {"chain": chain})).cost(jacobian_price=5.0)
    assert apart["rhat"] > 1.1
    assert apart["to_target"] is None


def exactly(problem, rng, n_draws, shift=0.0):
    """An engine that draws from the posterior itself, but for a shift in posterior sds."""
    white = rng.standard_normal((4, n_draws, problem.n_params)) + shift
    chain = problem.mean + white @ np.linalg.cholesky(problem.covariance).T
    return samplers.EngineDraws(chain, 1.0, np.linspace(0.2, 1.0, n_draws), 7000, 90, 1.0, "all of them")


def test_engines_are_compared_with_ours_and_one_that_is_missing_is_named():
    """An exact engine agrees, one half an sd off disagrees, too few draws are not judged."""

    def absent(*_):
        return samplers.require_dynesty()

    engines = {
        "exact": (exactly, 1000, {}),
        "off": (exactly, 1000, {"shift": 0.5}),
        "short": (exactly, 60, {}),
        "absent": (absent, 1, {}),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "dynesty", None)
        results = samplers.compared(toy(), engines, seed=1, ess=2000.0)
    assert [results[name]["verdict"] for name in ("exact", "off", "short")] == ["agree", "disagree", None]
    assert results["absent"] == {"skipped": "this needs dynesty; install it with: pip install 'bayesub[cross-check]'"}
    assert list(samplers.rivals(results)) == ["exact", "off", "short"]
    ours, price = results[samplers.OURS], results["jacobian_price"]
    assert ours["to_target"] == [ours["seconds"], ours["simulations"] + price * ours["jacobians"]]
    assert results["exact"]["to_target"][1] < 0.5 * (7000 + 90 * price)
    lines = samplers.table({"toy": results})
    assert len(lines) == 2 + 4 + 2  # a heading, four engines, and who is missing
    assert "| not reached |" in lines[5]
    assert lines[-1].startswith("toy, absent: this needs dynesty")


def test_without_dynesty_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "dynesty", None)
    with refused("install", "dynesty"):
        samplers.require_dynesty()
