"""Every command and every Python block of README and manual runs, and answers as the page shows.

A page is worked through from top to bottom in one folder, as a reader would. A slow part has a quick one in a comment
above its block (``<!-- quick: slow => quick -->``); nothing is left out.
"""

import doctest
import json
import shlex
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from manual.pages import PAGES, ROOT, blocks
from support import torpedo, vehicle_logs

import bayesub as bs
from bayesub.cli import learn
from bayesub.io import toml_files
from bayesub.study.schema.study_file import Study

pytestmark = pytest.mark.docs

TINY = """
name = "tiny"
question = "Does a command run?"
vehicle = "auv690"
manoeuvre = "turning_circle"
seed = 1
dt_s = 0.4
sensors = [{ kind = "track", channels = ["x", "y"], position_sd_m = 0.1, attitude_sd_deg = 0.1, interval_s = 5.0 }]
free = { coefficients = ["Xuu", "Nuv"] }
prior = { kind = "relative_normal", sd = 0.25 }
baselines = { linear_least_squares = false, sqp_starts = 0 }
"""
TEXT = ("synopsis",)  # shown, not run; tests/manual/test_pages.py compares it with the commands
SHELL = ("python3 ", "git ", "pip ")  # set-up, which .ci/run reads from the README and runs
CHANGE = "# change of "  # and the name of a file that the page has written: its sections take the place of those there
LIKE = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the studies of the repository and quick ones."""
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "few").mkdir()
    (tmp_path / "few" / "tiny.toml").write_text(TINY)
    (tmp_path / "few" / "other.toml").write_text(TINY.replace('"tiny"', '"other"').replace("seed = 1", "seed = 2"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_page_shows_runs(page, folder, bayesub):
    """In order, and each block is one of those that are run, checked or set-up."""
    names = {}
    if page.stem in ("convert", "logs-explained"):
        logs_of_vehicles(folder, bayesub)
    for block in blocks(page):
        if block.commands:
            for command, shown in block.commands:
                status, out, err = bayesub(*shlex.split(command, comments=True)[1:])
                assert status == 0, f"{command}\n{err}"
                assert doctest.OutputChecker().check_output(shown, out, LIKE), f"{command}\n{out}\nis not\n{shown}"
        elif block.language == "python" and block.file:
            (folder / block.file).write_text(block.run)
        elif block.language == "python":
            exec(compile(block.run, page.name, "exec"), names)
        elif block.language == "toml":
            check_toml(block.run, folder)
        elif block.language == "yaml":
            check_dask(block.run)
        else:
            assert block.language in TEXT or block.text.startswith(SHELL), block.text


def check_dask(text):
    """Keys of batch jobs are those of dask-jobqueue."""
    import dask.config
    import dask_jobqueue  # noqa: F401 - whose keys it adds to Dask's
    import yaml

    settings = yaml.safe_load(text)
    assert settings.keys() <= {"workers", "jobqueue", "scheduler-address", "distributed"}
    for queue, options in settings.get("jobqueue", {}).items():
        assert options.keys() <= dask.config.get(f"jobqueue.{queue}").keys()


def logs_of_vehicles(folder, bayesub):
    """An example of each kind that can be converted, and the bag of a torpedo AUV that was simulated."""
    for write in vehicle_logs.WRITERS.values():
        write(folder)
    (folder / "ambiguous.csv").write_text("Time,yaw_deg,r_degps\n03/01/2021 10:00:00,1,2\n03/01/2021 10:00:01,2,3\n")
    rows = [f"{1_700_000_000_000_000_000 + k * 50_000_000},{k}" for k in range(3)]
    (folder / "wrench.csv").write_text("\n".join(["%time,field.rudder", *rows]))
    rows = [f"{1_700_000_001},{1_700_000_000_020_000_000 + k * 50_000_000},{k}" for k in range(3)]
    (folder / "navigation.csv").write_text("\n".join(["%time,field.header.stamp,field.yaw", *rows]))
    content = toml_files.read_toml_table(toml_files.find("auv690", "vehicles"))
    (folder / "flown.toml").write_text(tomli_w.dumps(torpedo.boat(content)))
    assert bayesub("simulate", "flown.toml", "zigzag_20_20", "-o", "flown.csv", "--sample", "0.1")[0] == 0
    torpedo.bag(folder, folder / "flown.csv", np.random.default_rng(1))


def check_toml(text, folder):
    """A file of its own or a change of one is written for the commands below it; fragments are read in another file."""
    first = text.splitlines()[0]
    content = tomllib.loads(text)
    if first == "# fragment of a study":
        whole = tomllib.loads(TINY) | content
        if "data" in content:
            del whole["manoeuvre"]
        toml_files.validate(whole, Study, first)
    elif first == "# fragment of a vehicle file":
        whole = changed(toml_files.find("auv690", "vehicles"), content)
        (folder / "fragment.toml").write_text(tomli_w.dumps(whole))
        bs.load_vehicle(folder / "fragment.toml")
    elif first.startswith(CHANGE):
        file = folder / first.removeprefix(CHANGE)
        file.write_text(tomli_w.dumps(changed(file, content)))
    else:
        name = first.removeprefix("# ")
        assert name.endswith(".toml"), f"a block of TOML begins with the name of its file: {first}"
        (folder / name).write_text(text)


def changed(file, content):
    """The content of a vehicle file with other sections; coefficients are added to those that it has."""
    whole = toml_files.read_toml_table(file)
    return whole | content | {"coefficients": whole["coefficients"] | content.get("coefficients", {})}


def test_a_set_written_from_the_manual_converges(folder, bayesub):
    """Three terms added to booth, from the page alone: its blocks as they stand, to a posterior that has converged."""
    own = False
    for block in blocks(learn.pages()["equations"].path):
        own = own or block.text.startswith("# my_equations.toml")
        if own and block.language == "toml":
            check_toml(block.text, folder)
        for command, _ in replace(block, run=block.text).commands if own else ():
            if command.startswith("bayesub run"):  # the searches beside the posterior are tested elsewhere
                study = (folder / "mystudy.toml").read_text()
                (folder / "mystudy.toml").write_text(study.replace("sqp_starts = 5", "sqp_starts = 0"))
            status, out, err = bayesub(*shlex.split(command)[1:])
            assert status == 0, f"{command}\n{out}{err}"
    numbers = json.loads((folder / "runs" / "mystudy" / "numbers.json").read_text())
    assert numbers["convergence"]["converged"]
    parameters = {parameter["name"]: parameter for parameter in numbers["parameters"]}
    surge, side, yaw = (parameters[name] for name in ("Xur_dr", "Yr_absr", "Nuu_drdrdr"))
    assert abs(yaw["mean"] - yaw["reference"]) < 4.0 * yaw["sd"]
    # What the page says of the three: one is informed, two are not.
    assert yaw["contraction"] < 0.5
    assert min(surge["contraction"], side["contraction"]) > 0.9
