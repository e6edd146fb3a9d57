"""Predicting a trial from the others."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.findings.unseen import leave_one_out
from bayesub.inference.checks.prediction import chi_squares, laplace
from bayesub.problem.joint import JointProblem
from bayesub.study.run import infer

FREE = ("Xuu", "Yuv", "Yuu_dr", "Nuv", "Nuu_dr", "Nur")
MANOEUVRES = ("turning_circle", "zigzag_10_10", "zigzag_20_20")
SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw"))


@pytest.fixture(scope="module")
def tracks(suboff):
    return {name: bs.simulate(suboff, bs.load_manoeuvre(name, suboff), dt=1.0) for name in MANOEUVRES}


def posed(tracks, suboff, seed, adrift=None, current=None):
    """Three trials, of which `adrift` was flown in a current that nobody knows of."""
    rng, problems = np.random.default_rng(seed), {}
    prior = bs.priors.relative_normal(0.25, centre=bs.priors.perturbed(suboff.xi, 0.2, rng))
    for name, track in tracks.items():
        record = bs.observe(track, SENSOR, rng, current_mps=(0.1, 0.0) if name == adrift else (0.0, 0.0))
        nuisance = {"yaw0_deg": bs.priors.normal(0.0, 0.01)} | (current or {})
        manoeuvre = track.simulator.manoeuvre
        problems[name] = bs.Problem(suboff, manoeuvre, record, free=FREE, prior=prior, nuisance=nuisance, dt=1.0)
    return JointProblem(problems)


@pytest.mark.slow
def test_a_right_model_predicts_as_well_as_it_says(tracks, suboff):
    """Over fifteen predictions: p-values anywhere, chi-squares about one, 90 % intervals that hold nine in ten."""
    found = [
        one
        for seed in range(5)
        for one in leave_one_out(posed(tracks, suboff, seed), np.random.default_rng(seed)).values()
    ]
    p_values = np.array([one.p_value for one in found])
    assert 0.25 < p_values.mean() < 0.75  # three standard errors of the mean of fifteen uniform numbers
    assert p_values.min() > 0.01
    assert np.mean([one.chi_square_per_reading for one in found]) == pytest.approx(1.0, abs=0.1)
    # the coverage of one trial varies by 0.06, as its readings err together: three standard errors of the mean
    assert np.mean([one.coverage[0.9] for one in found]) == pytest.approx(0.9, abs=0.05)
    assert sum(one.n_failed for one in found) == 0


def test_a_current_that_one_trial_had_shows(tracks, suboff, rng):
    """Left out, that trial is not what the others predict, by the smallest p-value that 400 replicates can give."""
    found = leave_one_out(posed(tracks, suboff, 1, adrift="zigzag_20_20"), rng)["zigzag_20_20"]
    assert found.p_value == pytest.approx(1 / 401)
    assert found.chi_square_per_reading > 3


def test_draws_of_the_laplace_approximation_and_of_priors(tracks, suboff, rng):
    """A given sampler is asked for the others only; with draws of the prior a prediction is wide, and right."""
    joint, asked = posed(tracks, suboff, 2), []

    def of_prior(problem, rng, n):
        asked.append(tuple(problem.problems))
        return problem.prior.sample(rng, n)

    found = leave_one_out(joint, rng, draw=of_prior, n_draws=100)
    assert asked == [MANOEUVRES[1:], MANOEUVRES[::2], MANOEUVRES[:2]]
    assert all(one.p_value > 0.01 for one in found.values())
    draws = laplace(joint, rng, 4000)
    mode = bs.baselines.gauss_newton(joint)
    sds = np.sqrt(np.diag(mode.covariance))
    # means and sds of 4000 draws: four standard errors
    assert np.all(np.abs(draws.mean(axis=0) - mode.values) < 4 * sds / np.sqrt(4000))
    np.testing.assert_allclose(draws.std(axis=0), sds, rtol=4 / np.sqrt(8000))


@pytest.mark.slow
def test_the_function_and_the_command_are_one_computation(tracks, suboff, tmp_path):
    """Of posteriors that a run has kept: the same numbers, after a warm-up that tells current and start of each."""
    joint = posed(tracks, suboff, 3, current={"current_north_mps": bs.priors.normal(0.0, 0.3)})
    (tmp_path / "left_out").mkdir()
    kept = {}
    for name in joint.problems:
        others, rng = joint.without(name), np.random.default_rng(4)
        chain = laplace(others, rng, 4 * 60 * 8).reshape(4, 60, 8, -1)
        about = others.prior.mean, others.prior.sd, 10, 0.5, 100, 1.0, {"diverged": 0}
        bs.Posterior(others.names, chain, np.zeros(chain.shape[:3]), *about).save(tmp_path / "left_out" / f"{name}.nc")
        kept[tuple(others.problems)] = bs.Posterior.load(tmp_path / "left_out" / f"{name}.nc")
    setup = SimpleNamespace(
        problem=joint, trials=joint.problems, unseen=(), generator=lambda _: np.random.default_rng(5)
    )
    by_command = infer._predictions(setup, tmp_path, [], None)
    found = leave_one_out(joint, np.random.default_rng(5), draw=lambda others, *_: kept[tuple(others.problems)])
    assert [one.trial.name for one in by_command] == list(found)
    for one in by_command:
        mine, theirs = found[one.trial.name], one.posterior
        assert one.trial.warm_up_s == mine.warm_up > 0.0
        assert (mine.p_value, mine.coverage, mine.rms, mine.crps) == (
            theirs.p_value,
            theirs.coverage,
            theirs.rms,
            theirs.crps,
        )
    assert min(one.p_value for one in found.values()) > 0.01


def test_chi_squares_are_those_of_the_whole_covariance(rng):
    errors, directions = rng.standard_normal((3, 12)), 5.0 * rng.standard_normal((4, 12))
    inverse = np.linalg.inv(np.eye(12) + directions.T @ directions)
    np.testing.assert_allclose(chi_squares(errors, directions), np.einsum("ij,jk,ik->i", errors, inverse, errors))


def test_one_trial_cannot_be_left_out(tracks, suboff, rng):
    joint = posed(tracks, suboff, 1).without("zigzag_10_10").without("zigzag_20_20")
    with refused("missing", "problems"):
        leave_one_out(joint, rng)
