"""The vehicle file of a posterior, read back as the prior of a second trial: in two steps as both trials together."""

from pathlib import Path

import numpy as np
import pytest
from support import small_study
from support.toys import Linear

import bayesub as bs
from bayesub.inference.identifiability import fisher
from bayesub.problem.distributions import CorrelatedNormal, Normal
from bayesub.study.after.finished_run import FinishedRun
from bayesub.study.after.knowledge import known as known_after
from bayesub.study.after.knowledge import of_draws, of_moments, vehicle_file
from bayesub.study.run import infer
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

FREE = ("Xuu", "Yuv", "Yur", "Nuv", "Nur")
SENSORS = [small_study.track(position_sd_m=0.5, interval_s=10.0)]
RELATIVE = {"sd": 0.2}
FROM_FILE = {"kind": "vehicle", "sd": None}
STILL = ("x0_m", "y0_m", "v0_mps", "r0_degps")


@pytest.fixture(scope="module")
def logs(tmp_path_factory, suboff):
    """Two trials of the boat, as logs."""
    manoeuvres = {"first": "zigzag_20_20", "second": "turning_circle"}
    return small_study.save_logs(tmp_path_factory.mktemp("logs"), suboff, manoeuvres)


def study(folder, name, logs, prior, vehicle="suboff", free=FREE, **more):
    """A study of one or of several of the logs."""
    trials = [{"name": log, "data": f"{log}.csv", "subproblem": "horizontal"} for log in logs]
    head = {key: value for key, value in trials[0].items() if key != "name"} if len(logs) == 1 else {"trials": trials}
    more |= {"vehicle": str(vehicle), "sensors": SENSORS, "free": {"coefficients": free}, "prior": prior}
    changes = small_study.SUBOFF | {"name": name, "manoeuvre": None} | head | more
    return load_study(small_study.write(folder / f"{name}.toml", **changes))


def run_of(one, mean, covariance, rng, n=4000):
    """A finished run of a study whose draws have this mean and covariance, to the last digits.

    They are of the first parameters; the others have those of their prior.
    """
    problem = prepare(one).problem
    prior, k = problem.prior, len(mean)
    whole = np.diag(prior.sd**2)
    whole[:k, :k] = covariance
    plain = rng.standard_normal((n, problem.n_params))
    plain -= plain.mean(axis=0)
    plain = np.linalg.solve(np.linalg.cholesky(np.cov(plain.T)), plain.T).T
    draws = np.append(mean, prior.mean[k:]) + plain @ np.linalg.cholesky(whole).T
    chain = draws.reshape(4, -1, 25, problem.n_params)
    posterior = bs.Posterior(problem.names, chain, np.zeros(chain.shape[:3]), prior.mean, prior.sd,
                             n_warmup=0, acceptance=0.5, evaluations=1, seconds=1.0, failures={})  # fmt: skip
    return FinishedRun(Path(one.source).parent, {}, one, "converged and fits", posterior, ())


def test_two_trials_in_two_steps_are_both_together(logs, rng):
    """Both linear about the truth, where everything is in closed form: files, correlations and prior lose nothing."""
    problem = prepare(study(logs, "one", ["first"], RELATIVE)).problem
    at = np.append(problem.reference[:5], problem.prior.mean[5:])
    jacobian = problem.jacobian(at)
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.diag(problem.prior.sd**-2.0))
    first = run_of(study(logs, "one", ["first"], RELATIVE), at, covariance, rng)
    known = logs / "known.toml"
    known.write_text(vehicle_file(first, known))
    second = prepare(study(logs, "two", ["second"], FROM_FILE, vehicle=known)).problem
    assert second.names[:5] == FREE
    np.testing.assert_allclose(second.prior.sd[:5], np.sqrt(np.diag(covariance))[:5], rtol=1e-10)

    def sds(one):
        """Of the coefficients by the linearised problem, the unknown starts of the trials integrated out."""
        where = np.append(at[:5], one.prior.mean[5:])
        return fisher(one, where).posterior_sd[:5]

    joint = sds(prepare(study(logs, "both", ["first", "second"], RELATIVE)).problem)
    np.testing.assert_allclose(sds(second), joint, rtol=1e-6)
    # The first trial has told something that the second does not.
    assert np.max(sds(prepare(study(logs, "alone", ["second"], RELATIVE)).problem) / joint) > 1.05
    # Its coefficients alone, without the correlations, would not do.
    text = known.read_text()
    known.write_text(text[: text.index("[correlations]")])
    without = sds(prepare(study(logs, "three", ["second"], FROM_FILE, vehicle=known)).problem)
    assert np.abs(without / joint - 1.0).max() > 0.05


@pytest.mark.slow
def test_two_runs_by_commands_are_both_logs_in_one(logs, suboff, bayesub, monkeypatch):
    """Sampled, exported and sampled again: means and sds of the run of both logs within Monte Carlo error.

    Each run has an unknown of each of its logs too, the heading at the start, which is integrated out.
    """
    monkeypatch.setattr(
        infer, "write_report", lambda *_, **__: {"outcome": {"verdict": "converged and fits"}, "verdict": {}}
    )
    free, known = ("Yuv", "Nuv", "Nur"), {"u0_mps": suboff.speed_mps} | dict.fromkeys(STILL, 0.0)
    more = {
        "nuisance": {name: {"value": value} for name, value in known.items()},
        "baselines": {"sqp_starts": 0, "linear_least_squares": False},
    }

    def sampled(name, *given):
        study(logs, name, *given, free=free, **more)
        assert bayesub("run", logs / f"{name}.toml", "-o", logs / name)[0] == 0
        return bs.Posterior.load(logs / name / "posterior.nc")

    first = sampled("first", ["first"], RELATIVE)
    status, out, _ = bayesub("export", logs / "first", "-o", logs / "by_first.toml")
    assert (status, "close to normal" in out) == (0, True)
    second = sampled("then_second", ["second"], FROM_FILE, "by_first.toml")
    joint = sampled("together", ["first", "second"], RELATIVE)
    assert first.names[:3] == second.names[:3] == joint.names[:3] == free
    assert joint.names[3:] == ("yaw0_deg[first]", "yaw0_deg[second]")
    # 5 standard errors of three runs, each of the least effective size; those of sds are smaller than those of means.
    ess = min(np.min((one.bulk_ess, one.tail_ess)) for one in (first, second, joint))
    error = 5.0 * np.sqrt(3.0 / ess)
    assert error < 0.2
    np.testing.assert_allclose((second.mean[:3] - joint.mean[:3]) / joint.sd[:3], 0.0, atol=error)
    np.testing.assert_allclose(second.sd[:3] / joint.sd[:3], 1.0, atol=error)
    # Neither log alone would do.
    alone = prepare(study(logs, "alone", ["second"], RELATIVE, free=free, **more)).problem
    sd = fisher(alone, np.append(second.mean[:3], alone.prior.mean[3:])).posterior_sd[:3]
    assert np.max(sd / joint.sd[:3]) > 1.0 + error
    assert np.max(first.sd[:3] / joint.sd[:3]) > 1.0 + error


def test_the_file_says_what_it_is(logs, rng):
    """The boat with values, sds and correlations; what the posterior has not touched is called so."""
    first = study(logs, "one", ["first"], RELATIVE)
    problem = prepare(first).problem
    sds = problem.prior.sd[:5] * [0.01, 1.0, 0.5, 0.5, 0.97]
    run = run_of(first, problem.reference[:5], np.diag(sds**2), rng)
    path = logs / "said.toml"
    path.write_text(vehicle_file(run, path))
    vehicle, before = bs.load_vehicle(path), bs.load_vehicle("suboff")
    places = vehicle.equations.columns(FREE)
    np.testing.assert_allclose(vehicle.xi[places], run.posterior.mean[:5], rtol=1e-13)
    np.testing.assert_allclose(vehicle.sd[places], sds, rtol=1e-10)
    assert np.isnan(np.delete(vehicle.sd, places)).all()
    np.testing.assert_array_equal(np.delete(vehicle.xi, places), np.delete(before.xi, places))
    assert vehicle.name == before.name
    assert vehicle.reference.endswith("posterior of the study 'one' by bayesub " + bs.__version__)
    lines = path.read_text().splitlines()
    (xuu,), (yuv,) = ([line for line in lines if line.startswith(f"{name} ")] for name in ("Xuu", "Yuv"))
    assert xuu.endswith("# 0.01 of the prior's sd")
    assert yuv.endswith("# by the prior alone: 1 of its sd")
    assert any("close to normal" in line for line in lines)
    assert any("NOT CONVERGED" in line for line in lines)  # these draws have 40 steps only
    assert max(map(len, lines[:5])) <= 120


def test_what_the_trial_does_not_move_follows_by_its_correlations(logs, rng, suboff_file):
    """A vertical coefficient that an earlier trial correlated with the drag; and one that was held is as it was."""
    text = suboff_file
    for name, value, sd in (("Xuu", -0.001, 1e-4), ("Zuw", -0.018456, 1e-3), ("Nuv", -0.012107, 1e-3)):
        start = text.index(f"\n{name} ") + 1
        text = text[:start] + f"{name} = {{ value = {value}, sd = {sd} }}" + text[text.index("\n", start) :]
    matrix = [[1.0, 0.6, 0.5], [0.6, 1.0, 0.0], [0.5, 0.0, 1.0]]
    text += f'[correlations]\ncoefficients = ["Xuu", "Zuw", "Nuv"]\nmatrix = {matrix}\n'
    boat = logs / "known_before.toml"
    boat.write_text(text)
    one = study(logs, "again", ["first"], FROM_FILE | {"sd": 0.2}, vehicle=boat, free=("Xuu", "Yuv"))
    mean, sds = np.array([-0.00105, -0.03]), np.array([2e-5, 1e-3])
    covariance = np.array([[1.0, -0.3], [-0.3, 1.0]]) * np.outer(sds, sds)
    known = known_after(run_of(one, mean, covariance, rng))
    assert known.names == ("Xuu", "Yuv", "Zuw")  # Nuv moves the boat and was held: nothing new is known of it
    slope = 0.6 * 1e-3 / 1e-4
    expected = of_moments(known.names, [*mean, -0.018456 + slope * (mean[0] + 0.001)], np.array([
        [*covariance[0], slope * covariance[0, 0]],
        [*covariance[1], slope * covariance[0, 1]],
        [slope * covariance[0, 0], slope * covariance[0, 1], 1e-6 + slope**2 * (covariance[0, 0] - 1e-8)],
    ]))  # fmt: skip
    np.testing.assert_allclose(known.mean, expected.mean, rtol=1e-9)
    np.testing.assert_allclose(known.covariance, expected.covariance, rtol=1e-7)


def test_sampled_two_steps_of_a_linear_toy(rng):
    """Draws of the first posterior, their moments as prior of the second: within Monte Carlo error the joint one."""
    n = 4
    prior = Normal(np.ones(n), np.array([1.0, 0.1, 10.0, 1.0]))
    matrix = rng.standard_normal((6, n)) / prior.sd
    matrix[:, 3] = 0.0  # of which neither trial tells anything
    readings = matrix @ prior.sample(rng, 1)[0] + 0.3 * rng.standard_normal(6)
    first, joint = (Linear(matrix[:k], readings[:k], prior, 0.3) for k in (3, 6))
    draws = bs.sample(first, rng=rng, n_ensembles=4).draws
    known = of_draws(first.names, draws)
    factor = known.sd[:, None] * np.linalg.cholesky(known.correlation)
    second = Linear(matrix[3:], readings[3:], CorrelatedNormal(known.mean, factor), 0.3)
    posterior = bs.sample(second, rng=rng, n_ensembles=4)
    assert posterior.converged
    sd = np.sqrt(np.diag(joint.covariance))
    # Both steps have errors: 5 standard errors of two means, and of two sds, of the least effective size.
    error = 5.0 * np.sqrt(2.0 / posterior.bulk_ess.min())
    np.testing.assert_allclose((posterior.mean - joint.mean) / sd, 0.0, atol=error)
    np.testing.assert_allclose(posterior.sd / sd, 1.0, atol=error)
    assert posterior.contraction[3] == pytest.approx(1.0, abs=error)
