"""A finished run predicts what it has not seen: against flights of its draws, with readings held back, from a seed."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from support import refusals, small_study
from support.fins import weaker

import bayesub as bs
from bayesub.findings.verdicts import STATUS, in_words
from bayesub.model.autopilot import SteeredSimulator, load_autopilot
from bayesub.model.simulator import Simulator
from bayesub.report import page
from bayesub.study.after import design
from bayesub.study.after.compare import compare
from bayesub.study.after.finished_run import finished_run
from bayesub.study.after.predict import Request, _flown, predict_by_run
from bayesub.study.after.update import updated
from bayesub.study.run.infer import suggest
from bayesub.study.run.prepare import prepare
from bayesub.study.run.run import run as run_study
from bayesub.study.run.run_folder import open_folder
from bayesub.study.schema.study_file import load_study
from bayesub.study.sources import file_digest

TRACK = small_study.track(attitude_sd_deg=0.2, interval_s=1.0)
TIMES = 40.0  # s, after the warm-up of all logs here
FEW = ("--draws", 60)  # for what does not depend on the bands
COARSE = (*FEW, "--sample", 2)
PILOT = """
name = "pilot"
interval_s = 0.2
[heading]
heading_deg = [40.0]
rudder_per_heading = 1.0
rudder_per_yaw_rate = 1.0
plane_limit_deg = 20.0
plane_rate_degps = 10.0
"""
PATH = PILOT.replace("heading_deg = [40.0]", "waypoints_m = [[90.0, 9.0]]\nlookahead_m = 5.0\nacceptance_m = 2.0")


@pytest.fixture(autouse=True)
def quick(request, monkeypatch):
    """Figures are drawn in tests that ask for `drawn`; in the others their files are empty."""

    def draw_all(figures, folder, **_):
        pictures = {}
        for figure in figures:
            (folder / f"{figure.name}.png").touch()
            pictures[figure.name] = figure.caption, b'<svg viewBox="0 0 1 1"></svg>'
        return pictures

    if "drawn" not in request.fixturenames:
        monkeypatch.setattr(page, "draw_all", draw_all)


@pytest.fixture
def drawn():
    """Draw figures, which are not rendered even so."""


@pytest.fixture
def run(finished):
    return finished()


@pytest.fixture(scope="module")
def flown():
    """Options -> the log that was flown with them."""
    return {}


@pytest.fixture
def log(tmp_path, bayesub, flown):
    """log(perturbation): readings of a zig-zag by the boat of the file, or by one that is off by so much."""

    def fly(*options):
        if options not in flown:
            sensors = small_study.write_sensors(tmp_path / "sensors.toml", TRACK)
            given = ["zigzag_20_20", "--sensors", sensors, "--seed", "3", "--sample", "0.5", *options]
            assert bayesub("simulate", "auv690", *given, "-o", tmp_path / "log.csv")[0] == 0
            flown[options] = (tmp_path / "log.csv").read_bytes()
        (tmp_path / "log.csv").write_bytes(flown[options])
        return tmp_path / "log.csv"

    return fly


def numbers_of(folder):
    return json.loads((folder / "numbers.json").read_text())


def bands(folder, column, by="posterior"):
    table = pd.read_csv(folder / "states.csv")
    return table["time_s"].to_numpy(), table[[f"{column}_{by}_{q}" for q in ("q5", "median", "q95")]].to_numpy().T


@pytest.mark.usefixtures("drawn")
def test_bands_of_a_manoeuvre_are_those_of_flights_of_its_draws(run, tmp_path, bayesub):
    """Flown one by one by `simulate` with another step: medians and quantiles within what 2,000 draws leave open."""
    duration = bs.load_manoeuvre("zigzag_20_20", bs.load_vehicle("auv690")).duration
    options = ("--draws", 2000, "--sample", duration / 20)
    status, out, _ = bayesub("predict", run, "zigzag_20_20", "-o", tmp_path / "p", *options)
    assert status == 0
    assert re.search(r"motion +After \S+ s the boat is within \S+ m of where it is expected", out)
    boat, posterior = bs.load_vehicle("auv690"), bs.Posterior.load(run / "posterior.nc")
    sets = np.tile(boat.xi, (2000, 1))
    sets[:, boat.equations.columns(posterior.names)] = posterior.draws[:: len(posterior.draws) // 2000][:2000]
    times, (low, median, high) = bands(tmp_path / "p", "x_m")
    flown = bs.simulate(boat, bs.load_manoeuvre("zigzag_20_20", boat), xi=sets, dt=0.1, sample=times[-1] / 10)
    at = np.rint(flown.times[1:] / times[1]).astype(int)
    spread = flown.states[:, 1:, 0].std(axis=0)
    for ends, share, height in ((low, 0.05, 0.103), (median, 0.5, 0.399), (high, 0.95, 0.103)):
        error = np.sqrt(share * (1 - share) * 2 / 2000) / height  # of a quantile of a normal, in its sds, of both
        off = ends[at] - np.quantile(flown.states[:, 1:, 0], share, axis=0)
        assert np.all(np.abs(off) < 5 * error * spread + 1e-3)
    said = numbers_of(tmp_path / "p")["motion"]
    half_width = said["states"]["x_m"]["posterior"]["half_width_at_end"]
    digits = 5e-8 * np.abs((high, low)).max()  # of the file
    assert half_width == pytest.approx(0.5 * (high - low)[-1], abs=digits)
    assert said["distance_m"]["posterior"]["at_end"] < 0.3 * said["distance_m"]["prior"]["at_end"]


def test_a_current_carries_the_boat_and_turns_it_nowhere(run, tmp_path, bayesub):
    """All bands of the place move by current times time; attitude, rates and what draws differ by stay as they are."""
    tables = []
    for name, options in (("still", ()), ("carried", ("--current-north-mps", 0.3, "--current-east-mps", -0.7))):
        assert bayesub("predict", run, "zigzag_20_20", "-o", tmp_path / name, *COARSE, *options)[0] == 0
        tables.append(pd.read_csv(tmp_path / name / "states.csv"))
    still, carried = tables
    times, moved = still["time_s"], carried - still
    assert times.iloc[-1] > 100.0
    for column in still.columns:
        digits = 1e-7 * max(np.abs(still[column]).max(), np.abs(carried[column]).max())
        if column.startswith(("time_s", "yaw_deg", "r_degps")):
            np.testing.assert_array_equal(carried[column], still[column])
        elif column.startswith("x_m"):
            np.testing.assert_allclose(moved[column], 0.3 * times, rtol=0.0, atol=digits)
        elif column.startswith("y_m"):
            np.testing.assert_allclose(moved[column], -0.7 * times, rtol=0.0, atol=digits)
        else:  # over the ground, on the heading 0 at the start
            assert column.startswith(("u_mps", "v_mps"))
            assert moved[column][0] == pytest.approx(0.3 if column.startswith("u") else -0.7, abs=digits)
    still, carried = (numbers_of(tmp_path / name)["motion"]["distance_m"] for name in ("still", "carried"))
    assert carried["posterior"]["at_end"] == pytest.approx(still["posterior"]["at_end"], rel=1e-9)
    page = (tmp_path / "carried" / "prediction.html").read_text()
    assert "a known current of 0.3 m/s to the north and -0.7 m/s to the east" in page


@pytest.mark.slow
def test_under_an_autopilot_each_draw_is_steered_by_its_own_motion(run, tmp_path, bayesub):
    """The bands are those of draws that are flown one by one; the heading is known where the prior knows nothing."""
    (tmp_path / "pilot.toml").write_text(PILOT)
    folder, options = tmp_path / "p", ("--autopilot", tmp_path / "pilot.toml")
    assert bayesub("predict", run, "zigzag_20_20", "-o", folder, *FEW, *options)[0] == 0
    free = tmp_path / "free"
    assert bayesub("predict", run, "zigzag_20_20", "-o", free, *FEW)[0] == 0
    times, (low, median, high) = bands(folder, "yaw_deg", "prior")
    assert abs(median[-1] - 40.0) < 1.0
    _, (free_low, _, free_high) = bands(free, "yaw_deg", "prior")
    assert (high - low)[-1] < 0.05 * (free_high - free_low)[-1]
    assert numbers_of(folder)["name"] == "zigzag_20_20 under pilot"
    assert "zigzag_20_20 under pilot" in (folder / "prediction.html").read_text()
    posterior, boat = bs.Posterior.load(run / "posterior.nc"), bs.load_vehicle("auv690")
    draws = posterior.draws[np.random.default_rng(3).choice(len(posterior.draws), 60)]
    sets = np.tile(boat.xi, (60, 1))
    sets[:, boat.equations.columns(posterior.names)] = draws
    pilot, manoeuvre = load_autopilot(tmp_path / "pilot.toml"), bs.load_manoeuvre("zigzag_20_20", boat)
    inside = np.minimum(times[1:], manoeuvre.duration)
    flown = [SteeredSimulator(boat, manoeuvre, inside, autopilot=pilot).run(one)[0][0, :, 0] for one in sets[:5]]
    spread = np.max([np.ptp(bands(folder, "x_m")[1], axis=0)[1:].max(), 0.05])
    assert np.abs(np.mean(flown, axis=0) - bands(folder, "x_m")[1][1][1:]).max() < 2.0 * spread


def test_a_scale_of_the_rudder_that_was_inferred_counts(tmp_path):
    """Each draw flies the manoeuvre with its own, as a boat whose coefficients of the rudder are so many times its."""
    scaled = small_study.TINY | {"nuisance": {"scale_rudder": {"mean": 1.0, "sd": 0.2}}}
    setup = prepare(bs.load_study(small_study.write(tmp_path / "scaled.toml", **scaled)))
    name, manoeuvre = "zigzag_20_20", bs.load_manoeuvre("zigzag_20_20", setup.vehicle)
    trial = _flown(setup, name, Request(tmp_path, name, sample_s=manoeuvre.duration / 20))
    draws = setup.problem.prior.sample(np.random.default_rng(3), 4)
    states = trial.problem.motion(trial.transferred(setup.problem, draws, np.random.default_rng(4)))
    sets = weaker(setup.vehicle, setup.problem.coefficient_sets(draws), "dr", draws[:, 3])
    times, step = trial.problem.simulator.times, trial.problem.simulator.step
    flown = Simulator(setup.vehicle, manoeuvre, times, dt=step)
    np.testing.assert_allclose(states, flown.run(sets)[0], rtol=1e-9, atol=1e-9)
    without = flown.run(setup.problem.coefficient_sets(draws))[0]
    assert np.abs(states - without)[..., :2].max() > 1.0


def test_the_same_seed_gives_the_same_bits(run, tmp_path, bayesub):
    for name, seed in (("one", 5), ("two", 5), ("three", 6)):
        assert bayesub("predict", run, "zigzag_10_10", "-o", tmp_path / name, *COARSE, "--seed", seed)[0] == 0
    for file in ("numbers.json", "states.csv"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    assert (tmp_path / "one" / "states.csv").read_bytes() != (tmp_path / "three" / "states.csv").read_bytes()


@pytest.mark.usefixtures("drawn")
def test_a_log_of_the_boat_is_predicted_and_of_another_is_not(run, log, tmp_path, bayesub):
    """Posterior beside prior and SQP; and a boat that is off by a third as negative control, exit status 1."""
    status, out, _ = bayesub("predict", run, log(), "-o", tmp_path / "right", "--draws", 200)
    assert status == 0, out
    (said,) = numbers_of(tmp_path / "right")["predictions"]
    assert 0.75 < said["coverage_by"]["posterior"]["90 %"] <= 1.0
    assert {"posterior", "prior", "SQP"} <= said["coverage_by"].keys()
    assert said["crps_over"]["prior"] < 0.7
    readings = pd.read_csv(tmp_path / "right" / "readings.csv")
    judged = readings[readings["judged"] == 1]
    held = (judged["reading"] >= judged["q5"]) & (judged["reading"] <= judged["q95"])
    assert held.mean() == pytest.approx(said["coverage"]["90 %"], abs=2 / len(judged))
    status, out, _ = bayesub("predict", run, log("--perturb", "0.3"), "-o", tmp_path / "wrong", "--draws", 200)
    assert (status, out.splitlines()[-1]) == (STATUS["does not predict"], in_words("does not predict"))
    assert "NOT PREDICTED" in out
    assert "DOES NOT PREDICT" in (tmp_path / "wrong" / "prediction.html").read_text()


def test_readings_that_are_held_back_change_nothing(run, log, tmp_path, bayesub):
    """Only the warm-up is read: with all later readings wrong, bands of states and of readings are the same bits."""
    path = log()
    assert bayesub("predict", run, path, "-o", tmp_path / "one", *FEW)[0] == 0
    table = pd.read_csv(path)
    late = table["time_s"] > TIMES
    assert late.any()
    for column in ("x_m", "y_m"):
        table.loc[late, column] += 1000.0
    table.to_csv(path, index=False)
    status, out, _ = bayesub("predict", run, path, "-o", tmp_path / "two", *FEW)
    assert (status, "NOT PREDICTED" in out) == (STATUS["does not predict"], True)
    assert (tmp_path / "one" / "states.csv").read_bytes() == (tmp_path / "two" / "states.csv").read_bytes()
    one, two = (pd.read_csv(tmp_path / name / "readings.csv").drop(columns="reading") for name in ("one", "two"))
    pd.testing.assert_frame_equal(one, two)


def test_columns_without_a_sensor_are_named_and_left_out(run, log, tmp_path, bayesub):
    path = log()
    table = pd.read_csv(path)
    table["depth_m"] = 3.0
    table.to_csv(path, index=False)
    _, out, _ = bayesub("predict", run, path, "-o", tmp_path / "p", *FEW)
    assert "not read: depth_m; the run has no sensor of these" in out
    few = small_study.write_sensors(tmp_path / "few.toml", TRACK | {"channels": ["yaw"]})
    _, out, _ = bayesub("predict", run, path, "-o", tmp_path / "q", *FEW, "--sensors", few)
    assert "not read: x_m, y_m, depth_m" in out


def test_coefficients_that_nobody_inferred_are_named(run, tmp_path, bayesub):
    _, out, _ = bayesub("predict", run, "coupled", "-o", tmp_path / "p", *COARSE)
    assert re.search(r"held +\d+ coefficients that act on this motion are not inferred", out)
    assert "TOO NARROW" in (tmp_path / "p" / "prediction.html").read_text()


def test_a_control_history_keeps_to_the_plane_of_the_run(run, tmp_path, bayesub):
    (tmp_path / "orders.csv").write_text("time_s,rudder_deg\n0,0\n5,10\n60,10\n")
    assert bayesub("predict", run, tmp_path / "orders.csv", "-o", tmp_path / "p", *COARSE)[0] == 0
    said = numbers_of(tmp_path / "p")
    assert list(said["motion"]["states"]) == ["x_m", "y_m", "yaw_deg", "u_mps", "v_mps", "r_degps"]
    assert len(pd.read_csv(tmp_path / "p" / "states.csv")) == 31
    assert any((tmp_path / "p" / "inputs").iterdir())


def test_a_posterior_that_has_not_converged_predicts_with_its_status(run, tmp_path, bayesub):
    short = shutil.copytree(run, tmp_path / "short")
    posterior = bs.Posterior.load(run / "posterior.nc")
    replace(posterior, criteria=bs.Criteria(ess=1e7)).save(short / "posterior.nc")
    outcome = json.loads((short / "outcome.json").read_text())
    outcome["files_sha256"]["posterior.nc"] = file_digest(short / "posterior.nc")
    (short / "outcome.json").write_text(json.dumps(outcome))
    status, out, _ = bayesub("predict", short, "zigzag_20_20", "-o", tmp_path / "p", *COARSE)
    assert status == STATUS["not converged"]
    assert "NOT CONVERGED: " in out.splitlines()[-1]
    assert "NOT CONVERGED" in (tmp_path / "p" / "prediction.html").read_text()


@pytest.mark.parametrize(
    ("source", "options", "kind", "key"),
    [
        ("zigzag_20", (), "unknown", "zigzag_20"),
        ("none.csv", (), "file", ""),
        ("none.toml", (), "file", ""),
        ("zigzag_20_20", ("--sample", "1e9"), "value", "--sample"),
        ("zigzag_20_20", ("--sample", "nan"), "value", "--sample"),
        ("zigzag_20_20", ("--sensors", "tracking_range"), "conflict", "--sensors"),
        ("zigzag_20_20", ("--current-east-mps", "nan"), "value", "--current-east-mps"),
        ("vertical", ("--current-east-mps", "0.1"), "conflict", "--current-east-mps"),
        ("log.csv", ("--current-north-mps", "0.1"), "conflict", "--current-north-mps"),
        ("log.csv", ("--sample", "1"), "conflict", "--sample"),
        ("log.csv", ("--sensors", "gps"), "unknown", "gps"),
        ("log.csv", ("--sensors", "faulty.toml"), "conflict", "dropout"),
        ("short.csv", (), "data", "warm_up_s"),
        ("other.csv", (), "missing", "y_m"),
        ("text.csv", (), "unknown", "hello"),
        ("log.csv", ("--autopilot", "pilot.toml"), "conflict", "--autopilot"),
        ("zigzag_20_20", ("--autopilot", "none.toml"), "file", ""),
        ("zigzag_20_20", ("--autopilot", "log.csv"), "format", ""),
        ("zigzag_20_20", ("--autopilot", "path.toml", "--current-north-mps", "0.1"), "conflict", "waypoints_m"),
    ],
)
def test_what_does_not_fit_is_one_line(run, log, tmp_path, monkeypatch, bayesub, source, options, kind, key):
    monkeypatch.chdir(tmp_path)
    table = pd.read_csv(log())
    table[table["time_s"] < 10.0].to_csv("short.csv", index=False)
    table.drop(columns="y_m").to_csv("other.csv", index=False)
    (tmp_path / "text.csv").write_text("hello\nworld\n")
    (tmp_path / "pilot.toml").write_text(PILOT)
    (tmp_path / "path.toml").write_text(PATH)
    small_study.write_sensors(tmp_path / "faulty.toml", TRACK | {"dropout": 0.1})
    status, out, err = bayesub("predict", run, source, "-o", "p", *options)
    assert (status, out, err.count("\n")) == (2, "", 1)
    refusals.check(bayesub.error, kind, key)
    assert not (tmp_path / "p").exists()


def test_a_fitted_log_is_refused(run, log, tmp_path, bayesub):
    """By the digest of the file: the run of a study of that log, which is read under another name."""
    of_log = small_study.TINY | small_study.LOG | {"data": str(log())}
    study = bs.load_study(small_study.write(tmp_path / "of_log.toml", **of_log))
    with open_folder(tmp_path / "of_log", study.config(), study.copies()):
        for name in ("posterior.nc", "estimates.json", "outcome.json"):
            shutil.copy(run / name, tmp_path / "of_log")
        small_study.forget_config(tmp_path / "of_log")
    copy = log().rename(tmp_path / "copy.csv")
    assert bayesub("predict", tmp_path / "of_log", copy, "-o", tmp_path / "p")[0] == 2
    refusals.check(bayesub.error, "conflict", "check.data")


@pytest.mark.parametrize("command", [("predict",), ("compare",)])
def test_folders_that_hold_no_finished_run_are_one_line(run, tmp_path, bayesub, command):
    """Not a run, unfinished, without digest or draws, damaged, of a script, a prediction; nothing is written."""
    (tmp_path / "empty").mkdir()
    names = ("begun", "old", "bare", "odd", "script", "keys")
    spoiled = {name: shutil.copytree(run, tmp_path / name) for name in names}
    (spoiled["begun"] / "outcome.json").unlink()
    (spoiled["bare"] / "posterior.nc").unlink()
    (spoiled["odd"] / "posterior.nc").write_bytes(b"no draws")
    for name, old, new in (
        ("old", "sources_sha256", "source"),
        ("script", "sources_sha256", "script_sha256"),
        ("keys", "dt_s", "dt_seconds"),
    ):
        config = spoiled[name] / "config.toml"
        config.write_text(config.read_text().replace(old, new))
        small_study.forget_config(spoiled[name])
    assert bayesub("predict", run, "zigzag_10_10", "-o", tmp_path / "done", *COARSE)[0] == 0
    for name, kind, key in (
        ("nothing", "state", "config.toml"),
        ("empty", "state", "config.toml"),
        ("begun", "state", ""),
        ("old", "state", ""),
        ("bare", "state", "posterior.nc"),
        ("odd", "format", "posterior.nc"),
        ("script", "state", ""),
        ("keys", "unknown", "dt_seconds"),
        ("done", "state", "prediction"),
    ):
        others = ("zigzag_20_20",) if command == ("predict",) else (run,)
        status, out, err = bayesub(*command, tmp_path / name, *others, "-o", tmp_path / "p")
        assert (status, out, err.count("\n")) == (2, "", 1), (name, err)
        refusals.check(bayesub.error, kind, key)
        assert not (tmp_path / "p").exists()


def test_a_folder_that_is_not_free_is_refused(run, tmp_path, bayesub):
    arguments = ("predict", run, "zigzag_10_10", "-o", tmp_path / "p", *COARSE)
    assert bayesub(*arguments)[0] == 0
    assert bayesub(*arguments)[0] == 2
    refusals.check(bayesub.error, "state")
    assert bayesub(*arguments, "--force")[0] == 0
    assert bayesub("predict", run, "zigzag_10_10", "-o", run)[0] == 2
    (tmp_path / "p" / "prediction.html").unlink()  # as Ctrl-C leaves it
    assert bayesub(*arguments)[0] == 0
    assert bayesub("report", tmp_path / "p")[0] == 2
    refusals.check(bayesub.error, "state", "prediction")
    assert finished_run(run).study.name == "tiny"


@pytest.mark.parametrize(
    ("command", "options"),
    [
        ("predict", ("zigzag_10_10",)),
        ("compare", ("OTHER",)),
        ("update", ("LOG",)),
        ("design", ("--after", "RUN", "--judgements", 120)),
    ],
)
def test_a_run_that_is_read_is_not_replaced(run, log, tmp_path, bayesub, command, options):
    """Whatever --force says; the folder stays as it is."""
    folder, other = (shutil.copytree(run, tmp_path / name) for name in ("one", "two"))
    kept = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    named = {"OTHER": other, "LOG": log(), "RUN": folder}
    first = "auv690" if command == "design" else folder
    status, out, err = bayesub(command, first, *(named.get(o, o) for o in options), "-o", folder, "--force")
    assert (status, out, err.count("\n")) == (2, "", 1)
    refusals.check(bayesub.error, "conflict", "-o")
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == kept


@pytest.mark.parametrize("name", ["predict", "compare", "update", "design", "suggested"])
def test_functions_replace_no_run_that_they_read(run, log, tmp_path, name):
    """As the commands; nor does a study that lies among what it would replace."""
    folder, other = (shutil.copytree(run, tmp_path / one) for one in ("one", "two"))
    study = load_study(small_study.write(tmp_path / "tiny.toml", **small_study.TINY))
    suggested = suggest(study, "[sampler]\nmax_misfit = 9.0\n", folder)
    kept = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    tasks = {
        "predict": lambda: predict_by_run(Request(folder, "zigzag_10_10"), folder, force=True),
        "compare": lambda: compare([other, folder], folder, force=True),
        "update": lambda: run_study(updated(folder, log()), folder, force=True),
        "design": lambda: design.design(design.Request("auv690", after=folder), folder, force=True),
        "suggested": lambda: run_study(suggested, folder, force=True),
    }
    with refusals.refused("conflict", "-o"):
        tasks[name]()
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == kept
