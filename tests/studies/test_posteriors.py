"""Identified sets beside posteriors: the measures on posteriors that are known."""

import json

import numpy as np
import pytest
from support.toys import SINGULAR_VALUES, ill_conditioned

from bayesub.inference.identifiability import Spectrum, fisher
from bayesub.inference.sampling import Posterior
from bayesub.inference.sampling import posterior as criteria
from posteriors import plots, trials
from posteriors.trials import GROUPS
from thesis import cases


def test_distances_are_those_of_a_standard_normal_whatever_the_units(rng):
    """Distances of draws squared have the mean of chi-square, and a change of coordinates changes nothing."""
    draws, points = rng.standard_normal((20_000, 4)), rng.standard_normal((30, 4))
    root = rng.standard_normal((4, 4)) * 10.0 ** np.arange(4)[:, None]
    distances = trials.mahalanobis(draws, points)
    # Means and covariances of so many draws are off by less than 1 %; three standard errors of them.
    np.testing.assert_allclose(distances, np.linalg.norm(points, axis=1), atol=0.03 * (1 + distances.max()))
    moved = trials.mahalanobis(draws @ root.T + 3.0, points @ root.T + 3.0)
    np.testing.assert_allclose(moved, distances, rtol=1e-6)  # the condition of the map is 1e4


@pytest.fixture(scope="module")
def known():
    """A linear problem, draws of its posterior, and the direction of which the data say nothing."""
    problem, null = ill_conditioned()
    draws = np.random.default_rng(7).multivariate_normal(problem.mean, problem.covariance, 4000, method="cholesky")
    return problem, draws, null


def test_the_region_holds_95_per_cent_of_draws(known, rng):
    problem, draws, _ = known
    fresh = rng.multivariate_normal(problem.mean, problem.covariance, 4000, method="cholesky")
    places = trials.places(problem, draws, {"same": draws, "fresh": fresh})
    # Four standard errors of a share of 4,000, and as many of the limit, which rests on as many draws.
    error = 4 * np.sqrt(2 * 0.95 * 0.05 / 4000)
    for measure in trials.MEASURES:
        assert np.mean(places["same"][measure] <= 1.0) == pytest.approx(0.95, abs=1e-3)
        assert np.mean(places["fresh"][measure] <= 1.0) == pytest.approx(0.95, abs=error)


def test_what_the_data_do_not_see_is_told_from_what_they_do(known):
    """Ten prior sd along the null direction keep the fit and leave the posterior; across it, a hundredth spoils it."""
    problem, draws, null = known
    stiffest = np.linalg.svd(problem.matrix * problem.prior.sd)[2][0]
    moves = np.array([10.0 * null, 0.02 * stiffest])  # the latter twenty sd of the data
    places = trials.places(problem, draws, {"moved": problem.mean + problem.prior.sd * moves})["moved"]
    assert (places["chi_square"] <= 1.0).tolist() == [True, False]
    assert not np.any(places["distance"] <= 1.0)
    assert not np.any(places["density"] <= 1.0)


def test_shares_are_by_kind_of_direction():
    """Three stiff directions, two sloppy ones and a null one; a singular value of one is not above one."""
    names = tuple("abcdef")
    spectrum = Spectrum(names, SINGULAR_VALUES, np.eye(6), np.ones(6), n_null=1)
    assert trials.shares(spectrum, np.array([0, 0, 1.0, 0, 2.0, 2.0])) == pytest.approx(
        {"stiff": 1 / 9, "sloppy": 4 / 9, "null": 4 / 9}
    )
    assert trials.shares(spectrum, np.ones(6)) == pytest.approx({"stiff": 3 / 6, "sloppy": 2 / 6, "null": 1 / 6})


def test_the_strongest_trade_offs_are_chosen(rng):
    """Pairs that were planted come first, and there are no other coefficients."""
    draws = rng.standard_normal((5000, 20))
    for a, b in ((3, 17), (4, 9), (0, 12)):
        draws[:, b] = -draws[:, a] + 0.1 * draws[:, b]
    chosen = trials.trade_off_group(np.corrcoef(draws.T))
    assert chosen.tolist() == [0, 3, 4, 9, 12, 17]


def test_sqp_knows_the_added_masses():
    """Its sets are in the coordinates of the posterior, the coefficients that it does not identify at the truth."""
    problem = cases.trial("npsauv", "horizontal")
    sets = trials.searches(problem, 2, 3)
    known = np.isin(problem.names, cases.held("horizontal"))
    assert known.sum() == 3
    for values in map(np.array, sets.values()):
        np.testing.assert_array_equal(values[:, known], np.tile(problem.reference[known], (2, 1)))
        assert np.all(values[:, ~known] != problem.reference[~known])
    ratios = np.array(sets["starts"]) / problem.reference
    assert np.abs(ratios - 1).max() <= 0.1


def test_null_directions_leave_the_readings():
    """Along the null directions of the spectrum predictions stay, to second order in the change; along others not."""
    problem = cases.trial("npsauv", "horizontal")
    spectrum = fisher(problem, problem.reference)
    assert spectrum.n_null == 2
    at = problem.prior.standard(problem.reference)
    moved = problem.prior.parameters(at + 1e-3 * spectrum.directions[[-1, -2, 0]])
    off = (problem.predicted(moved) - problem.predicted(problem.reference)) / problem.sds
    assert np.abs(off[:2]).max() < 1e-6
    assert np.abs(off[2]).max() > 1e-2


def test_a_posterior_is_sampled_once(tmp_path):
    """It is read back, and one that has not converged says so."""
    problem, _ = ill_conditioned()
    file = tmp_path / "posterior.nc"
    first = cases.sampled(problem, file, max_steps=40)
    spent = problem.costs.simulations
    again = cases.sampled(problem, file)
    assert problem.costs.simulations == spent
    np.testing.assert_array_equal(again.draws, first.draws)
    assert not again.converged
    assert first.n_steps < criteria.JUDGED_STEPS


def test_figures_need_no_more_than_what_is_saved():
    """The arrays of a case are small, and hold what its figures show: draws of the strongest trade-offs, all sets."""
    problem = cases.trial("npsauv", "horizontal")
    rng = np.random.default_rng(5)
    draws = problem.prior.sample(rng, 2 * trials.N_DRAWS)
    posterior = Posterior(
        names=problem.names,
        chain=draws.reshape(2, -1, 40, problem.n_params),
        log_prob=np.zeros((2, len(draws) // 80, 40)),
        prior_mean=problem.prior.mean,
        prior_sd=problem.prior.sd,
        n_warmup=0,
        acceptance=0.5,
        evaluations=0,
        seconds=0.0,
        failures={},
    )
    sets = {group: (problem.reference * rng.uniform(0.9, 1.1, (3, problem.n_params))).tolist() for group in GROUPS}
    numbers, arrays = trials.compare(problem, posterior, sets)
    json.dumps(numbers)
    assert sum(array.nbytes for array in arrays.values()) < 300_000
    assert arrays["draws"].shape == (trials.N_DRAWS, len(arrays["chosen"]))
    np.testing.assert_array_equal(arrays["noisy"], sets["noisy"])
    np.testing.assert_allclose(numbers["contraction"], 1.0, atol=0.05)  # 4.5 standard errors of a sd of 8,000 draws


def test_what_sqp_held_is_not_drawn_as_found():
    """A coefficient at the truth in every set was held there; one that is there once was found."""
    sets = np.array([[1.0, 2.0, 3.0], [1.0, 2.5, 3.0], [1.5, 2.5, 3.0]])
    drawn = plots.identified(sets, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(np.isnan(drawn), [[False, False, True]] * 3)
    np.testing.assert_array_equal(drawn[:, :2], sets[:, :2])
