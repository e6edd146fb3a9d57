"""Commands that compute nothing begin at once: what they import is looked at in a process of its own."""

import subprocess
import sys

import pytest
from support import mutations

HEAVY = ("numba", "scipy", "matplotlib", "arviz", "pandas")
PROGRAM = f"""
import sys
sys.argv[0] = "bayesub"
from bayesub.__main__ import main
try:
    main()
except SystemExit as stop:
    status = stop.code or 0
print("imported:", *[name for name in {HEAVY} if name in sys.modules])
sys.exit(status)
"""
SCRIPT = '"""Is it checked?"""\ndef compute(run): ...\ndef draw(run, numbers): ...\ndef claims(numbers): ...\n'
FILES = {
    "manoeuvre.toml": next(t for k, suffix, t in mutations.corpus() if k == "manoeuvre" and suffix == ".toml"),
    "hull.toml": mutations.TORPEDO,
    "instruments.toml": '[[sensors]]\nkind = "dvl"\nsd_mps = 0.01\n',
    "gusts.toml": mutations.DISTURBANCE,
    "map.toml": 'kind = "ros"\n[columns.x_m]\nsignal = "/odom.pose.pose.position.x"\n',
    "script.py": SCRIPT,
}
WRONG = {
    "bad_study.toml": mutations.STUDY.replace("seed = 3", "sead = 3"),
    "bad_prior.toml": mutations.STUDY.replace("[prior]", "[prior]\nfoo = 1"),
    "bad_disturbance.toml": mutations.DISTURBED.replace("[disturbance]", "[disturbance]\nfoo = 1"),
    "bad_vehicle.toml": "name = 'x'\n[coefficients]\nXuu = 1.0\n",
    "bad_manoeuvre.toml": "kind = 'steps'\n",
    "bad_map.toml": 'kind = "ros"\n[columns.x_m]\nsignl = "/x"\n',
    "broken.toml": "kind = [\n",
}
COMMANDS = [
    ["--help"],
    ["--version"],
    ["list"],
    ["completion", "bash"],
    *[[name, "--help"] for name in ("check", "convert", "simulate", "rank", "run", "report", "bench")],
    ["new", "map", "ros"],
    ["new", "study", "--help"],
    ["new", "vehicle", "mine", "--from", "suboff"],
    ["new", "geometry", "mine"],
]


def imports(arguments, folder):
    """Exit status, and the heavy libraries that a command imported."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout.splitlines()[-1].removeprefix("imported:").split(), done.stderr


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_commands_that_compute_nothing(tmp_path, arguments):
    assert imports(arguments, tmp_path) == (0, [], "")


@pytest.mark.parametrize("name", FILES)
def test_check_of_a_file_that_need_not_fly(tmp_path, name):
    (tmp_path / name).write_text(FILES[name])
    assert imports(["check", name], tmp_path) == (0, [], "")


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_shows_at_once(tmp_path, name):
    (tmp_path / name).write_text(WRONG[name])
    status, heavy, err = imports(["check", name], tmp_path)
    assert (status, heavy, err.count("\n")) == (2, [], 1)
    assert name in err


@pytest.mark.parametrize("words", ["report", "export -o x.toml", "next", "compare -o x", "design auv690 -o x --after"])
def test_a_folder_that_is_no_run_is_refused_at_once(tmp_path, words):
    status, heavy, err = imports([*words.split(), "nowhere"], tmp_path)
    assert (status, heavy, err.count("\n")) == (2, [], 1)
    assert "nowhere: is not a run folder" in err
