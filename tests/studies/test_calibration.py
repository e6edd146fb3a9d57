"""Ranks, their simulated band and coverage; a normal model that is calibrated, and two that are not."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from bayesub.inference.sampling import Posterior
from bayesub.model.coefficients import EQUATIONS
from calibration import plots
from thesis import calibration

N_TRIALS = 200


def ranks(rng, sd_factor=1.0, shift=0.0):
    """Of truths among draws from the exact posterior of a normal mean, whose sd and mean are wrong by so much."""
    truth = rng.standard_normal(N_TRIALS)
    reading = truth + 0.5 * rng.standard_normal(N_TRIALS)
    sd = np.sqrt(0.25 / 1.25)
    draws = reading / 1.25 + sd * (shift + sd_factor * rng.standard_normal((calibration.N_DRAWS, N_TRIALS)))
    return calibration.rank(truth, draws)


def inside(ranks, limits):
    ecdf = calibration.ecdf(ranks)
    return np.all((ecdf >= limits[0]) & (ecdf <= limits[1]))


def test_the_band_has_its_false_alarm_rate(rng):
    """Of a thousand sets of uniform ranks a tenth leaves a band of 10 %, at whatever rank."""
    limits = calibration.band(N_TRIALS, 0.1, rng)
    sets = rng.integers(calibration.N_DRAWS + 1, size=(1000, N_TRIALS))
    alarms = np.mean([not inside(one, limits) for one in sets])
    # The standard deviation of 1000 is 0.0095; the band's levels are discrete, which makes it a little wide.
    assert 0.06 < alarms < 0.13
    lower, upper = limits
    points = np.arange(1, calibration.N_DRAWS + 1) / (calibration.N_DRAWS + 1)
    assert np.all((lower < points) & (points < upper))


def test_a_right_posterior_is_calibrated_and_wrong_ones_are_not(rng):
    """An sd two thirds of what it should be and a mean off by half an sd leave the band; exact draws do not."""
    limits = calibration.band(N_TRIALS, 0.001, rng)
    assert inside(ranks(rng), limits)
    assert not inside(ranks(rng, sd_factor=1 / 1.5), limits)
    assert not inside(ranks(rng, sd_factor=1.6), limits)
    assert not inside(ranks(rng, shift=0.5), limits)


def test_coverage_of_whole_ranks():
    """Each rank once: exactly 50, 90 and 95 % of them lie inside."""
    assert calibration.coverage(np.arange(calibration.N_DRAWS + 1)) == {0.5: 0.5, 0.9: 0.9, 0.95: 0.95}


def test_coverage_of_a_narrow_posterior(rng):
    """Intervals two thirds as wide as they should be hold the truth as often as the normal law says."""
    found = calibration.coverage(np.concatenate([ranks(rng, sd_factor=1 / 1.5) for _ in range(20)]))
    for level, fraction in found.items():
        expected = 2 * stats.norm.cdf(stats.norm.ppf(0.5 + level / 2) / 1.5) - 1
        # 4000 trials know a fraction to 0.008.
        assert fraction == pytest.approx(expected, abs=0.03)


def test_draws_come_from_different_walkers(rng):
    """A chain that holds the number of the walker everywhere gives each number at most once."""
    walkers = np.arange(200.0).reshape(4, 1, 50, 1) * np.ones((1, 30, 1, 1))
    posterior = Posterior(("c0",), walkers, walkers[..., 0], np.zeros(1), np.ones(1), 0, 0.5, 1, 1.0, {})
    draws = calibration.independent_draws(posterior, rng)
    assert draws.shape == (calibration.N_DRAWS, 1)
    assert len(np.unique(draws)) == calibration.N_DRAWS


class OneMean:
    """A normal mean, and a simulation that fails for every truth below zero."""

    names = ("c0",)
    prior = SimpleNamespace(sample=lambda rng, n: rng.standard_normal((n, 1)))

    def trajectory(self, truth):
        return SimpleNamespace(status=("ok" if truth[0] >= 0 else "diverged",), truth=truth)

    def log_likelihood(self, parameters):
        return -0.5 * parameters[:, 0] ** 2


def test_truths_whose_simulation_fails_are_drawn_again(rng):
    counts = []
    for _ in range(100):
        truth, trajectory, n_failed = calibration.prior_trajectory(OneMean(), rng)
        assert truth[0] >= 0
        assert trajectory.truth is truth
        counts.append(n_failed)
    # Failures before a success of probability one half: one on average, with a variance of two.
    assert np.mean(counts) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 100))


def test_ranks_of_a_posterior(rng):
    """Of draws 0 to 199 the truth 49.5 has rank 50 or 49, and nearly as many draws are less likely as are larger."""
    walkers = np.arange(200.0).reshape(4, 1, 50, 1) * np.ones((1, 30, 1, 1))
    posterior = Posterior(("c0",), walkers, walkers[..., 0], np.zeros(1), np.ones(1), 0, 0.5, 1, 1.0, {})
    ranks = calibration.posterior_ranks(OneMean(), posterior, np.array([49.5]), rng)
    assert set(ranks) == {"c0", "log likelihood"}
    assert ranks["c0"] in (49, 50)
    assert ranks["c0"] + ranks["log likelihood"] == calibration.N_DRAWS


def test_uniformity_finds_the_quantity_that_is_not(rng):
    good, bad = ranks(rng), ranks(rng, sd_factor=1 / 1.5)
    result = calibration.uniformity({"good": good, "bad": bad}, 0.001, np.random.default_rng(1))
    assert result["quantities"]["good"]["inside"]
    assert not result["quantities"]["bad"]["inside"]
    assert result["quantities"]["good"]["mean_rank"] == pytest.approx(np.mean(good) / calibration.N_DRAWS)
    assert result["quantities"]["bad"]["coverage"]["90 %"] == calibration.coverage(bad)[0.9]
    # The band is that of one quantity at half the rate: it holds the good ranks and is left by the bad ones.
    limits = np.array(result["band"]["lower"]), np.array(result["band"]["upper"])
    assert inside(good, limits)
    assert not inside(bad, limits)


@pytest.mark.rendered
def test_pictures(rng, tmp_path, monkeypatch):
    monkeypatch.setattr(calibration, "_SIMULATED", 200)  # a band that is only looked at
    found = {"Xuu": ranks(rng), "log likelihood": ranks(rng)}
    limits = calibration.band(N_TRIALS, 0.01, rng)
    plots.draw_ecdf(tmp_path / "ecdf.png", {name: calibration.ecdf(r) for name, r in found.items()}, limits, EQUATIONS)
    assert (tmp_path / "ecdf.png").stat().st_size > 5000
