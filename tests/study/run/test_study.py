"""Studies from file to report, through the command line."""

import errno
import json
import os
import shutil
import signal
import tomllib

import numpy as np
import pytest
import tomli_w
from support import refusals, small_study
from support.pages import Page

import bayesub as bs
from bayesub.findings.verdicts import STATUS, in_words
from bayesub.inference.sampling import posterior_file
from bayesub.io import toml_files
from bayesub.io.terminal import Bars
from bayesub.logs import log_files
from bayesub.report import report
from bayesub.study.after.finished_run import redraw, saved_study
from bayesub.study.run import infer
from bayesub.study.run import prepare as preparation
from bayesub.study.run.prepare import prepare
from bayesub.study.run.result import load_result
from bayesub.study.run.run_folder import RunContext, open_folder, saved_config
from bayesub.study.schema.study_file import load_study

QUESTION = "Is <script>alert(1)</script> & 'this' a question?"
PRIOR = {"centre": "perturbed", "perturbation_sd": 0.1}
SMALL = small_study.text(question=QUESTION, prior=PRIOR, baselines={"sqp_starts": 2})


@pytest.fixture
def small(tmp_path):
    """A study of four coefficients that converges in seconds."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.mark.slow
def test_a_study_runs_from_file_to_report_and_is_never_overwritten(bayesub, small, tmp_path, draw_only):
    folder = tmp_path / "run"
    status, out, _ = bayesub("run", small, "-o", folder)
    assert status == 0
    assert out.splitlines()[-1] == "CONVERGED AND FITS"
    config = tomllib.loads((folder / "config.toml").read_text())
    criteria = {"rhat": 1.01, "ess": 400.0, "taus": 25.0}
    assert config["sampler"] == {"n_ensembles": 4, "max_steps": 20000, "max_misfit": 4.0} | criteria
    assert {"python", "numpy", "emcee"} <= config["versions"].keys()
    numbers = json.loads((folder / "numbers.json").read_text())
    posterior = posterior_file.load(folder / "posterior.nc")
    assert posterior.converged
    assert [p["sd"] for p in numbers["parameters"]] == pytest.approx(posterior.sd, rel=0.02)  # thinned against whole
    for row in numbers["parameters"]:  # the truth is a plausible draw: within five posterior sd
        assert abs(row["mean"] - row["reference"]) < 5 * row["sd"]

    assert numbers["criticism"]["fits"]
    page = (folder / "report.html").read_text()
    assert "<script>alert" not in page
    assert "Is &lt;script&gt;alert(1)&lt;/script&gt; &amp;" in page
    for _, attributes in Page(page).elements:  # nothing is loaded
        assert attributes.get("src", "data:").startswith("data:")
        assert attributes.get("href", "#").startswith(("#", "data:"))
    assert page.index("sampling: converged") < page.index("<img")
    for name in ("coefficients", "fan", "criticism", "ladder", "correlation", "directions"):
        assert (folder / f"{name}.png").stat().st_size > 5000
        assert not (folder / f"{name}.pdf").exists()

    draw_only("ladder")
    assert bayesub("run", small, "-o", folder)[0] == 2
    refusals.check(bayesub.error, "state")

    before = (folder / "posterior.nc").read_bytes(), posterior.chain
    status, out, _ = bayesub("run", small, "-o", folder, "--resume")
    assert status == 0
    np.testing.assert_array_equal(posterior_file.load(folder / "posterior.nc").chain, before[1])

    (folder / "report.html").unlink()
    assert bayesub("report", folder, "--pdf")[0] == 0
    assert (folder / "report.html").exists()
    assert (folder / "ladder.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.usefixtures("few_figures")
@pytest.mark.slow
def test_a_page_drawn_again_is_the_same_to_the_byte(bayesub, small, tmp_path, monkeypatch):
    """Also when what is random in it is asked for in another order."""
    folder = tmp_path / "run"
    small.write_text(
        SMALL.replace('kind = "relative_normal"\nsd = 0.25', 'kind = "relative_hierarchical"\nlog_sd = 0.25')
    )
    assert bayesub("run", small, "-o", folder)[0] == 0
    names = ("report.html", "report.md", "numbers.json", "outcome.json")
    before = {name: (folder / name).read_bytes() for name in names}
    numbers_of = report.numbers_of

    def other_order(results):
        assert all(map(len, (results.derived.values, results.prior_predictive, results.residuals)))
        return numbers_of(results)

    monkeypatch.setattr(report, "numbers_of", other_order)
    assert bayesub("report", folder)[0] == 0
    assert {name: (folder / name).read_bytes() for name in names} == before


def test_resume_names_the_first_difference(bayesub, small, tmp_path):
    loaded = load_study(small)
    with open_folder(tmp_path / "run", loaded.config(), resume=False, force=False):
        pass
    small.write_text(SMALL.replace("position_sd_m = 0.2", "position_sd_m = 0.3"))
    assert bayesub("run", small, "-o", tmp_path / "run", "--resume")[0] == 2
    refusals.check(bayesub.error, "state", "--resume")


@pytest.mark.usefixtures("few_figures")
@pytest.mark.slow
def test_an_interrupted_run_resumes_to_the_same_bits(bayesub, small, tmp_path):
    longer = SMALL + "[sampler]\ness = 6000.0\n"
    small.write_text(longer)
    assert bayesub("run", small, "-o", tmp_path / "whole")[0] == 0
    small.write_text(longer + "max_steps = 100\n")
    status, out, _ = bayesub("run", small, "-o", tmp_path / "part")
    assert (status, out.splitlines()[-1]) == (STATUS["not converged"], in_words("not converged"))
    assert "NOT CONVERGED" in (tmp_path / "part" / "report.html").read_text()
    assert "ESS" in next(line for line in out.splitlines() if line.startswith("  sampling"))
    small.write_text(longer)  # the stopping rule may change
    assert bayesub("run", small, "-o", tmp_path / "part", "--resume")[0] == 0
    whole, part = (posterior_file.load(tmp_path / name / "posterior.nc") for name in ("whole", "part"))
    np.testing.assert_array_equal(whole.chain, part.chain)
    np.testing.assert_array_equal(whole.rhat, part.rhat)


def test_quick_applies_the_quick_table(small):
    small.write_text(SMALL + "[quick]\nseed = 9\nbaselines = { sqp_starts = 1 }\n")
    assert load_study(small, quick=True).baselines.sqp_starts == 1
    assert load_study(small, quick=True).seed == 9
    assert load_study(small).baselines.sqp_starts == 2


def test_the_same_study_gives_the_same_trial_bit_for_bit(small):
    first, second = (prepare(load_study(small)).problem for _ in range(2))
    np.testing.assert_array_equal(first.readings, second.readings)
    np.testing.assert_array_equal(first.prior.mean, second.prior.mean)


@pytest.mark.parametrize(
    ("change", "kind", "key"),
    [
        (("seed = 3", "seed = -3"), "value", "seed"),
        (("seed = 3", "sead = 3"), "unknown", "sead"),
        (('"Yuv"', '"Yuw"'), "unknown", "Yuw"),
        (("position_sd_m = 0.2", "position_sd_m = nan"), "value", "sensors.0.position_sd_m"),
        (("position_sd_m = 0.2", "position_sd_m = 0.0"), "value", "sensors.0.position_sd_m"),
        (("interval_s = 2.0", "interval_s = 2000.0"), "value", "interval_s"),
        (('"yaw"', '"yow"'), "unknown", "sensors.0"),
        (('vehicle = "auv690"', 'vehicle = "auv960"'), "unknown", "auv960"),
        (("sqp_starts = 2", "sqp_starts = 2\n[sampler]\nn_walkers = 3"), "value", "sampler.n_walkers"),
        (("[prior]", "[prior"), "format", ""),
    ],
)
def test_a_bad_study_is_one_line_on_standard_error_and_status_2(bayesub, small, tmp_path, change, kind, key):
    small.write_text(SMALL.replace(*change))
    status, _, err = bayesub("run", small, "-o", tmp_path / "run")
    assert status == 2
    assert err.count("\n") == 1
    refusals.check(bayesub.error, kind, key)


def test_contradictory_options_and_foreign_folders_are_refused(bayesub, small, tmp_path):
    assert bayesub("run", small, "--resume", "--force")[0] == 2
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "thesis.doc").write_text("mine")
    assert bayesub("run", small, "-o", tmp_path / "run", "--force")[0] == 2
    refusals.check(bayesub.error, "state")
    assert (tmp_path / "run" / "thesis.doc").exists()
    assert bayesub("run", small, "-o", tmp_path / "none", "--resume")[0] == 2
    assert bayesub("report", tmp_path / "none")[0] == 2
    assert bayesub("run", tmp_path / "absent.toml")[0] == 2
    assert bayesub("sail")[0] == 2
    assert bayesub("simulate", "suboff")[0] == 2


def test_list_and_check_know_everything_built_in(bayesub, small):
    status, out, _ = bayesub("list")
    assert status == 0
    assert all(name in out for name in ("suboff", "auv690", "npsauv", "horizontal"))
    assert bayesub("list", "boats")[0] == 2
    files = [path for kind in ("vehicles", "manoeuvres") for path in toml_files.built_in(kind).values()]
    status, out, _ = bayesub("check", *files, small)
    assert status == 0
    assert "4 free coefficients" in out


@pytest.mark.rendered
def test_simulate_writes_a_track_that_reads_back_and_flies_again(bayesub, tmp_path):
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    status, out, _ = bayesub(
        "simulate", "suboff", "horizontal", "-o", first, "--dt", 0.5, "--plot", tmp_path / "track.png"
    )
    assert status == 0
    assert "ok" in out
    assert (tmp_path / "track.png").stat().st_size > 5000
    log = log_files.read_log(first)
    assert log["time"][-1] == 600.0
    assert log["u"][0] == 7.5
    # The controls in the track are the manoeuvre: flown again they give the same track to the digits of the file.
    columns = {name: log[name] for name in ("time", *log_files.CONTROLS, "rpm")}
    log_files.write_log(tmp_path / "controls.csv", columns)
    assert bayesub(
        "simulate", "suboff", tmp_path / "controls.csv", "-o", second, "--dt", 0.5, "--subproblem", "horizontal"
    )[0] == 0  # fmt: skip
    again = log_files.read_log(second)
    for name in ("x", "y", "psi", "r"):
        np.testing.assert_allclose(again[name], log[name], rtol=1e-9, atol=1e-6)


def test_simulate_says_when_a_boat_leaves_the_envelope(bayesub, tmp_path):
    times = np.linspace(0.0, 200.0, 201)
    log_files.write_log(tmp_path / "loop.csv", {"time": times, "delta_s": np.where(times > 1, -1.5, 0.0)})
    status, out, _ = bayesub("simulate", "npsauv", tmp_path / "loop.csv", "-o", tmp_path / "track.csv")
    assert status == STATUS["does not complete the manoeuvre"]
    assert "left_envelope" in out


@pytest.mark.usefixtures("few_figures")
def test_ctrl_c_prints_the_command_that_continues(bayesub, small, tmp_path, monkeypatch):
    """Before sampling and during it: one line, exit status 130, and the command works."""
    small.write_text(SMALL + "[sampler]\ness = 6000.0\n")  # more than the first look finds
    folder = tmp_path / "a run"
    command = f"bayesub run {small} -o '{folder}' --resume"

    def press(*_, **__):
        signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as during:
        during.setattr(infer.baselines, "sqp", press)
        status, _, err = bayesub("run", small, "-o", folder)
    assert (status, err) == (130, f"bayesub: interrupted; what is done is saved, continue with: {command}\n")

    with monkeypatch.context() as during:
        during.setattr(Bars, "update", lambda *_: press() if "steps" in _ else None)
        status, _, err = bayesub("run", small, "-o", folder, "--resume")
    assert (status, err.splitlines()[-1].endswith(command)) == (130, True)
    assert len(list((folder / "chain").glob("[0-9]*.block"))) == 2  # up to the first look, and the step after it
    status, out, _ = bayesub("run", small, "-o", folder, "--resume")
    assert (status, out.splitlines()[-1]) == (0, "CONVERGED AND FITS")


def test_a_folder_at_work_is_refused(bayesub, small, tmp_path):
    """Also by --force, which leaves it as it is; a folder in which nothing was begun is not in the way."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "config.toml.partial").write_text("killed while writ")
    with open_folder(tmp_path / "run", {"quick_run": False}, resume=False, force=False):
        for option in ("--resume", "--force"):
            config = load_study(small).config()
            (tmp_path / "run" / "config.toml").write_text(tomli_w.dumps(config))
            status, _, err = bayesub("run", small, "-o", tmp_path / "run", option)
            assert status == 2
            refusals.check(bayesub.error, "state")
            assert err.count("\n") == 1
    assert (tmp_path / "run" / "config.toml").exists()


def test_a_full_disk_is_one_line(bayesub, small, tmp_path, monkeypatch):
    """Wherever in a study it happens."""

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(infer.baselines, "sqp", full)
    status, _, err = bayesub("run", small, "-o", tmp_path / "run")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "file")


TANK = "coefficient,mean,sd\nXuu,-0.005,0.0005\n"


def beside_files(folder):
    """The path of a study that stops after 100 steps, beside its vehicle, manoeuvre and table of priors."""
    beside = folder / "beside"
    beside.mkdir()
    (beside / "boat.toml").write_bytes(toml_files.built_in("vehicles")["auv690"].read_bytes())
    (beside / "history.csv").write_text(
        "time_s,rudder_deg\n" + "".join(f"{t},{8 if 20 < t < 60 else -5}\n" for t in range(0, 121, 2))
    )
    (beside / "tank.csv").write_text(TANK)
    return small_study.write(
        folder / "small.toml",
        vehicle="beside/boat.toml",
        manoeuvre="beside/history.csv",
        prior=PRIOR | {"table": "beside/tank.csv"},
        baselines={"sqp_starts": 2},
        sampler={"ess": 11_000.0, "max_steps": 100},
    )


@pytest.fixture
def with_files(tmp_path):
    return beside_files(tmp_path)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """The folder of such a study and of its run, what the run returned, and how many problems it has posed."""
    study, posed = beside_files(tmp_path_factory.mktemp("stopped")), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preparation, "Problem", lambda *a, **k: posed.append(1) or bs.Problem(*a, **k))
        result = small_study.run(bs.load_study(study), study.parent / "run")
    return study.parent, result, len(posed)


@pytest.fixture
def copied(stopped, tmp_path):
    """The same study and run, to be changed."""
    return shutil.copytree(stopped[0], tmp_path, dirs_exist_ok=True) / "small.toml"


@pytest.mark.usefixtures("few_figures")
def test_a_run_moves_and_is_drawn_again_from_what_its_folder_keeps(bayesub, stopped, copied, tmp_path):
    """Paths are relative to the study, copies of its files are in the folder, and a changed copy is refused by name."""
    folder, (home, result, _) = tmp_path / "run", stopped
    config = tomllib.loads((folder / "config.toml").read_text())
    assert config["vehicle"] == "beside/boat.toml"
    assert str(home) not in (folder / "config.toml").read_text()
    before = json.loads((folder / "numbers.json").read_text())
    moved = tmp_path / "elsewhere" / "run"
    shutil.copytree(folder, moved)
    shutil.rmtree(copied.parent / "beside")
    copied.unlink()
    for name in ("report.html", "numbers.json"):
        (folder / name).unlink()
    (moved / "report.html").unlink()
    status, out, _ = bayesub("report", moved)
    assert (status, out.splitlines()[-1]) == (STATUS["not converged"], in_words("not converged"))
    after = json.loads((moved / "numbers.json").read_text())
    assert after == before
    assert after["manoeuvre"] == "history"
    assert load_result(moved).seconds == result.seconds

    assert bayesub("report", folder)[0] == 2
    refusals.check(bayesub.error, "state", "numbers.json")
    (copy,) = (moved / "inputs").glob("*-tank.csv")
    copy.write_text(TANK.replace("0.0005", "0.0006"))
    assert bayesub("report", moved)[0] == 2
    refusals.check(bayesub.error, "state")
    (moved / "posterior.nc").unlink()
    status, _, err = bayesub("report", moved)
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "state", "posterior.nc")


def test_a_file_that_the_study_names_makes_a_run_stale(with_files, tmp_path):
    """So does its own content; the message names what has changed."""
    folder = tmp_path / "run"
    with open_folder(folder, load_study(with_files).config()):
        pass
    table = with_files.parent / "beside" / "tank.csv"
    table.write_text(TANK.replace("0.0005", "0.0006"))
    with refusals.refused("state", "--resume"):
        bs.run(with_files, folder, resume=True)
    with refusals.refused("state"):
        bs.run(with_files, folder)
    table.write_text(TANK)
    with_files.write_text(with_files.read_text().replace("seed = 3", "seed = 4"))
    with refusals.refused("state", "--resume"):
        bs.run(with_files, folder, resume=True)


@pytest.fixture
def with_equations(with_files):
    """The study whose vehicle names equations in another folder, a file that extends a copy of `booth`."""
    folder = with_files.parent / "sets"
    folder.mkdir()
    (folder / "base.toml").write_bytes(toml_files.built_in("equations")["booth"].read_bytes())
    (folder / "mine.toml").write_text('name = "mine"\ntitle = ""\nextends = "base.toml"\n[terms.X]\n')
    boat = with_files.parent / "beside" / "boat.toml"
    boat.write_text('equations = "../sets/mine.toml"\n' + boat.read_text())
    return with_files


def test_the_equation_files_of_a_vehicle_are_among_those_of_its_study(with_equations, tmp_path):
    """Also those that they extend; a change of either makes a run stale."""
    study = load_study(with_equations)
    names = ["beside/../sets/mine.toml", "beside/../sets/base.toml"]
    assert list(study.config()["files_sha256"])[-2:] == names
    assert {path.name for path in study.copies().values()} >= {"mine.toml", "base.toml"}
    folder = tmp_path / "run"
    with open_folder(folder, study.config(), study.copies()):
        pass
    base = with_equations.parent / "sets" / "base.toml"
    base.write_text(base.read_text().replace("surge force of drift, to either side", "drag of drift"))
    with refusals.refused("state", "--resume"):
        bs.run(with_equations, folder, resume=True)
    (with_equations.parent / "sets" / "mine.toml").unlink()
    with refusals.refused("file"):
        load_study(with_equations).config()


def test_a_vehicle_whose_set_is_built_in_has_no_file_of_equations(with_files):
    assert list(load_study(with_files).config()["files_sha256"]) == load_study(with_files).files


def test_a_run_with_equations_of_its_own_is_prepared_from_what_its_folder_keeps(with_equations, tmp_path):
    """Far from where the files were, from their copies side by side."""
    folder = tmp_path / "elsewhere" / "run"
    study = load_study(with_equations)
    with open_folder(folder, study.config(), study.copies()):
        pass
    for name in ("sets", "beside"):
        shutil.rmtree(with_equations.parent / name)
    saved = saved_study(folder, saved_config(folder))
    boat = bs.load_vehicle(saved.vehicle, saved.path)
    assert (boat.name, boat.equations.name) == ("auv690", "mine")
    assert boat.equations.names == bs.load_equations("booth").names
    (copy,) = (folder / "inputs").glob("*-base.toml")
    copy.write_text("")
    with refusals.refused("state"):
        saved_study(folder, saved_config(folder))


def test_a_damaged_file_of_a_run_is_named(copied):
    for name in ("estimates.json", "numbers.json"):
        file = copied.parent / "run" / name
        whole = file.read_text()
        file.write_text(whole[:20])
        with refusals.refused("format", name):
            redraw(file.parent)
        file.write_text(whole)


def test_what_was_changed_after_a_run_is_named(copied):
    """Its settings and its readings are what its result is of."""
    for name in ("config.toml", "record.csv"):
        file = copied.parent / "run" / name
        whole = file.read_text()
        file.write_text(whole.replace("seed = 3", "seed = 4") if name == "config.toml" else whole[: len(whole) // 2])
        assert file.read_text() != whole
        with refusals.refused("format", name):
            load_result(file.parent)
        file.write_text(whole)
    assert load_result(copied.parent / "run").name == "small"


def test_one_coefficient_has_a_report(tmp_path):
    """There is nothing with which it could trade off."""
    path = small_study.write(tmp_path / "one.toml", **small_study.TINY | {"free": {"coefficients": ["Nuu_dr"]}})
    result = small_study.run(path, tmp_path / "run")
    assert (result.verdict, result.text) == ("converged and fits", "")
    assert result.sentences["trade_offs"].startswith("No two coefficients are correlated")
    saved = json.loads((tmp_path / "run" / "outcome.json").read_text())
    assert (saved["status"], saved["good"]) == (0, True)
    (tmp_path / "run" / "outcome.json").write_text(json.dumps(saved | {"verdict": "converged"}))  # as version 0.2 wrote
    assert load_result(tmp_path / "run").verdict == "converged and fits"


def test_a_search_is_not_done_twice(copied, monkeypatch):
    """Its estimates are kept when it ends, and read by the next session of the run."""
    folder = copied.parent / "run"
    before = infer.saved_estimates(folder)
    assert before
    monkeypatch.setattr(infer.baselines, "sqp", None)
    found = infer._baselines(prepare(load_study(copied)), RunContext(folder))
    assert [estimate.to_json() for estimate in found] == [estimate.to_json() for estimate in before]


def test_the_problem_is_prepared_once(stopped):
    """And the verdict is not read from a file that was just written."""
    home, result, n_posed = stopped
    assert n_posed == 1
    assert (result.verdict, result.good) == ("not converged", False)
    assert result.shortcomings
    assert set(result.sentences) == set(json.loads((home / "run/numbers.json").read_text())["verdict"])


def test_force_replaces_a_run_and_touches_nothing_else(tmp_path, finished):
    """What is beside the files of the run stays, a link is unlinked, and the run is whole."""
    run = shutil.copytree(finished(), tmp_path / "run", symlinks=True)
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "precious").write_text("mine")
    (run / "thesis.md").write_text("mine")
    (run / "chain").rename(tmp_path / "outside" / "chain")
    (run / "chain").symlink_to(tmp_path / "outside" / "chain")
    blocks = sorted((tmp_path / "outside" / "chain").iterdir())
    config = bs.load_study(small_study.write(tmp_path / "tiny.toml", **small_study.TINY)).config()
    with open_folder(run, config, force=True):
        left = {path.name for path in run.iterdir()}
    assert left == {"thesis.md", "config.toml", ".lock", ".files"}
    assert (run / "thesis.md").read_text() == "mine"
    assert sorted((tmp_path / "outside" / "chain").iterdir()) == blocks


@pytest.mark.parametrize("config", ["baseURL = 'https://example.org'", ""])
@pytest.mark.parametrize("option", [(), ("--force",), ("--resume",)])
def test_the_configuration_of_another_program_makes_no_run_folder(bayesub, tmp_path, config, option):
    (tmp_path / "site" / "content").mkdir(parents=True)
    (tmp_path / "site" / "config.toml").write_text(config)
    (tmp_path / "site" / "content" / "thesis.md").write_text("mine")
    study = small_study.write(tmp_path / "tiny.toml", **small_study.TINY)
    status, _, error = bayesub("run", study, "-o", tmp_path / "site", *option)
    assert status == 2
    assert ("already holds other files" if option != ("--resume",) else "holds no run") in error
    assert "--force" not in error
    assert (tmp_path / "site" / "content" / "thesis.md").read_text() == "mine"
