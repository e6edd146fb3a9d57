"""The lines that are proposed for correlated residuals are those of a study file, and with them the model fits."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from support import small_study

import bayesub as bs
from bayesub.findings import remedies
from bayesub.inference import identifiability
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.discrepancy import Discrepancy, find_discrepancies
from bayesub.inference.checks.fit import criticise
from bayesub.inference.sampling.histories import search_marginal_mode
from bayesub.problem.alternatives import LeftOut
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

FREE = '[free]\ncoefficients = ["Xuu", "Yuv", "Yur", "Nuv", "Nur", "Nuu_dr"]\n'


def study(**of_compass):
    """The text of the study without coefficients that are free; its compass may be wrong."""
    position = small_study.track(channels=["x", "y"], position_sd_m=0.1, interval_s=None)
    compass = {"kind": "sensor", "column": "yaw_deg", "sd": 0.1} | of_compass
    return small_study.text(name="pushed", seed=4, dt_s=0.2, sensors=[position, compass], free=None)


def posed(path, text):
    path.write_text(text)
    return prepare(load_study(path)).problem


def fitted(problem, rng):
    """Quantile residuals at a draw of the Laplace approximation, judged; and the mode."""
    mode = gauss_newton(problem)
    if problem.histories:  # given the others the forces are almost normal, with them they are not
        marginal, others = search_marginal_mode(problem, problem, rng)
        _, (draw,) = marginal.density(problem, others[None], rng.standard_normal((1, len(marginal.white))))
    else:
        draw = mode.values + np.linalg.cholesky(mode.covariance) @ rng.standard_normal(problem.n_params)
    residuals = problem.quantile_residuals(draw, rng)
    return criticise(residuals, {name: problem.channels[name][0].times for name in residuals}), mode.values


@pytest.mark.parametrize(
    ("made", "kind", "line"),
    [
        ({"truth": '[truth.disturbance]\naxes = ["X", "Y"]\nshare = 0.05\ncorrelation_time_s = 4.0\n'},
         "disturbance", "[disturbance]"),
        ({"compass": {"bias": 0.5}}, "bias", "[nuisance]"),
        ({"truth": "[truth]\ncurrent_mps = [0.03, -0.02]\n"}, "current", "current_north_mps"),
    ],
)  # fmt: skip
@pytest.mark.slow
def test_the_lines_are_read_and_the_model_then_fits(made, kind, line, tmp_path, rng):
    text = study(**made.get("compass", {})) + FREE + made.get("truth", "")
    problem = posed(tmp_path / "first.toml", text)
    criticism, mode = fitted(problem, rng)
    assert not criticism.fits
    best, *others = find_discrepancies(LeftOut(problem), problem.prior.standard(mode))
    assert best.kind == kind
    lines = remedies.lines_to_add(best, problem, mode)
    assert line in lines
    sentence = remedies.look_like([best, *others])
    assert "the lines to add infer" in sentence
    second = posed(tmp_path / "second.toml", f"{text}{lines}\n")
    assert second.n_params > problem.n_params
    assert fitted(second, rng)[0].fits


def test_a_coefficient_is_freed_and_slow_noise_is_given(tmp_path):
    problem = posed(tmp_path / "first.toml", study() + FREE)
    freed = remedies.lines_to_add(
        Discrepancy("coefficient", {"Xuu": 0.1, "Yuu_dr": 0.1}, {}, 50.0), problem, problem.prior.mean
    )
    slow = remedies.lines_to_add(
        Discrepancy("slow noise", {"x": 2.0, "yaw": 1.0}, {"x": 4.0, "yaw": 9.0}, 50.0), problem, problem.prior.mean
    )
    again = posed(tmp_path / "again.toml", study() + f"{freed}\n{slow}\n")
    assert set(again.names) == {*problem.names, "Yuu_dr"}
    noises = {name: noise for name, (_, noise) in again.channels.items()}
    assert noises["x"].sd == pytest.approx(0.2)
    assert noises["yaw"].sd == pytest.approx(np.radians(0.1))
    assert [noises[name].correlation_time_s for name in ("x", "yaw")] == [4.0, 9.0]


def test_slow_noise_is_as_large_as_the_noise_that_the_study_gives(tmp_path):
    """Not as large as the sensors say, whose sd of x is 0.1 m."""
    text = study() + FREE + '[noise.x_m]\nkind = "normal"\nsd = 0.7\n'
    problem = posed(tmp_path / "own.toml", text)
    found = Discrepancy("slow noise", {"x": 2.0}, {"x": 4.0}, 50.0)
    assert "sd = 1.4\n" in remedies.lines_to_add(found, problem, problem.prior.mean)


def test_a_log_whose_control_moves_in_each_of_its_rows_has_no_steps():
    times = np.arange(0.0, 60.0, 10.0)
    rudder = np.radians(np.where(np.arange(len(times)) % 2, 10.0, -10.0))
    manoeuvre = SimpleNamespace(times=times, log={"dr": rudder}, commanded=(), logged=str)
    channels = (SimpleNamespace(name="yaw", times=np.arange(1.0, 50.0)),)
    trial = SimpleNamespace(manoeuvre=manoeuvre, record=SimpleNamespace(truth=None, channels=channels))
    problem = SimpleNamespace(each_trial=lambda _: [("", trial, None)], prior=SimpleNamespace(mean=None))
    assert remedies.on_steps(problem, {"yaw": np.full((2, 49), 9.0)}) == ""


def test_sentences_name_the_second_where_it_is_near():
    forces = Discrepancy("disturbance", {"X": 1e-5, "Y": 2e-5, "N": 1e-6}, dict.fromkeys("XYN", 4.0), 80.0)
    slow = Discrepancy("slow noise", {"x": 1.5}, {"x": 4.0}, 45.0)
    near = Discrepancy("coefficient", {"Xuu": 0.1}, {}, 78.0)
    assert "forces on X, Y and N were missing (35 nats better than slow sensors)" in remedies.look_like([forces, slow])
    assert "nearly as well (2 nats less) as if Xuu were held" in remedies.look_like([forces, near, slow])
    assert "(45 nats better than by their noise)" in remedies.look_like([slow])


def test_several_trials_share_the_process_and_biases_are_of_each(tmp_path):
    """The forces of one trial do not move the readings of the other."""
    truth = '[truth.disturbance]\naxes = ["X"]\nshare = 0.05\ncorrelation_time_s = 4.0\n'
    problem = posed(tmp_path / "one.toml", study() + FREE + truth)
    joint = bs.JointProblem({"a": problem, "b": problem})
    mode = gauss_newton(joint).values
    about = LeftOut(joint).about(joint.prior.standard(mode))
    n = about.forces["X"].shape[1] // 2
    first, second = np.vsplit(about.forces["X"], 2)
    np.testing.assert_allclose(first[:, :n], second[:, n:], rtol=1e-9, atol=1e-12)
    assert not first[:, n:].any()
    assert find_discrepancies(LeftOut(joint), joint.prior.standard(mode))[0].kind == "disturbance"


def test_columns_are_derivatives_of_the_residuals(tmp_path):
    """By differences of simulations, of every kind."""
    problem = posed(tmp_path / "first.toml", study() + FREE)
    left_out, standard = LeftOut(problem), np.full(problem.n_params, 0.1)
    about = left_out.about(standard)
    columns = {("disturbance", axis): part for axis, part in about.forces.items()}
    columns |= {(kind, name): c for kind, parts in about.effects.items() for name, c in parts.items()}
    assert {kind for kind, _ in columns} == {"disturbance", "bias", "current", "coefficient"}
    for (kind, name), part in columns.items():
        k = part.shape[1] // 2
        step = 1e-6 if kind == "disturbance" else 1e-3
        unit = step * np.eye(part.shape[1])[k : k + 1]
        sides = [left_out.residuals(standard[None], {(kind, name): sign * unit})[0] for sign in (1.0, -1.0)]
        scale = np.abs(part[:, k]).max()
        np.testing.assert_allclose((sides[0] - sides[1]) / (2 * step), part[:, k], rtol=0, atol=1e-3 * scale + 1e-9)


@pytest.mark.slow
def test_the_report_has_sentence_and_lines_where_the_check_fails(tmp_path, rng):
    text = study(bias=0.5) + FREE
    problem = posed(tmp_path / "first.toml", text)
    mode = gauss_newton(problem)
    draws = mode.values + rng.standard_normal((4, 60, 8, problem.n_params)) @ np.linalg.cholesky(mode.covariance).T
    log_prob = problem.log_prob(draws.reshape(-1, problem.n_params)).reshape(4, 60, 8)
    prior = problem.prior
    posterior = bs.Posterior(problem.names, draws, log_prob, prior.mean, prior.sd, 10, 0.5, 100, 1.0, {})
    spectrum = identifiability.fisher(problem, posterior.best)
    numbers = bs.write_report(tmp_path / "run", problem, [], spectrum, posterior)
    assert "bias_yaw_deg" in numbers["verdict"]["fit"]
    assert numbers["verdict"]["lines_to_add"].startswith("[nuisance]\nbias_")
    page = (tmp_path / "run" / "report.html").read_text()
    assert "<pre>[nuisance]" in page
    saved = json.loads((tmp_path / "run" / "numbers.json").read_text())
    assert saved["criticism"]["explanations"][0]["kind"] == "bias"
