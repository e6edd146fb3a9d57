"""The command as a process: interrupted, killed, out of disk, not alone. One line each, and nothing is lost.

BAYESUB_INTERRUPTIONS=50 pytest tests/test_processes.py interrupts at fifty random moments.
"""

import fcntl
import os
import resource
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.cli import app
from bayesub.inference.sampling.posterior import Criteria
from bayesub.io import seeds
from bayesub.io.atomic import LOCK
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

pytestmark = pytest.mark.slow

INTERRUPTIONS = int(os.environ.get("BAYESUB_INTERRUPTIONS", "2"))
COMMAND = [sys.executable, "-c", "from bayesub.__main__ import main; main()"]


class Run:
    """`bayesub run` as a process."""

    def __init__(self, *arguments, **options):
        words = [*COMMAND, "run", *map(str, arguments)]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(words, **streams, **options)

    def wait_for(self, file):
        while not file.exists():
            assert self.process.poll() is None, self.process.stderr.read()
            time.sleep(0.005)

    def end(self):
        """Exit status and standard error."""
        _, err = self.process.communicate(timeout=120)
        return self.process.returncode, err


def in_process(*arguments):
    return app.app.main(["run", *map(str, arguments)], prog_name="bayesub", standalone_mode=False)


def sampled(file, checkpoint):
    """The posterior of the study, without figures and report."""
    setup = prepare(load_study(file))
    sampler = setup.study.sampler
    options = {"n_ensembles": sampler.n_ensembles, "n_walkers": sampler.n_walkers, "max_steps": sampler.max_steps}
    criteria = Criteria(sampler.rhat, sampler.ess, sampler.taus)
    return bs.sample(
        setup.problem, rng=setup.generator(seeds.SAMPLER), criteria=criteria, checkpoint=checkpoint, **options
    )


def held(folder) -> bool:
    """Whether another process works in a run folder."""
    with (folder / LOCK).open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


@pytest.fixture
def small(tmp_path):
    return small_study.write(
        tmp_path / "small.toml",
        sensors=[small_study.track(interval_s=4.0)],
        free={"coefficients": ["Xuu", "Yuv", "Nuv"]},
        baselines={"sqp_starts": 0},
        sampler={"ess": 1000.0},
    )


def test_a_life_of_accidents_ends_with_the_same_bits(small, tmp_path):
    """Killed, out of disk, disturbed by a second run, interrupted; resumed, it is the run that nothing happened to."""
    folder, first = tmp_path / "run", tmp_path / "run" / "chain" / "start.block"
    killed = Run(small, "-o", folder)
    killed.wait_for(first)
    killed.process.kill()
    assert killed.end() == (-signal.SIGKILL, "")

    limit = first.stat().st_size // 2
    cut = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (limit, limit))
    whole = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}  # no beginnings of compiled modules (tests/io/test_atomic.py)
    full = Run(small, "-o", folder, "--resume", preexec_fn=cut, env=whole)
    status, err = full.end()
    assert (status, err.count("\n")) == (2, 1)
    assert "file too large" in err

    disturbed = Run(small, "-o", folder, "--resume")
    while not held(folder):
        time.sleep(0.005)
    with refused("state"):
        in_process(small, "-o", folder, "--resume")
    disturbed.process.send_signal(signal.SIGINT)
    status, err = disturbed.end()
    assert (status, err.count("\n")) == (130, 1)
    assert err.endswith("--resume\n")

    resumed, whole = (sampled(small, checkpoint) for checkpoint in (folder / "chain", None))
    assert resumed.converged
    np.testing.assert_array_equal(resumed.chain, whole.chain)


@pytest.mark.parametrize("word", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("moment", range(INTERRUPTIONS))
def test_ctrl_c_and_kill_are_one_line_at_any_moment(small, tmp_path, moment, word):
    """During imports, while compiled code runs, anywhere: exit status 130, and what to do next."""
    rng = np.random.default_rng([690, moment, INTERRUPTIONS])
    started = Run(small, "-o", tmp_path / "run")
    time.sleep(rng.uniform(0.1, 1.0 if moment % 2 == 0 else 5.0))
    started.process.send_signal(word)
    status, err = started.end()
    if status == 0:  # it had come to its end
        assert err == ""
        return
    assert (status, err.strip().count("\n")) == (130, 0), err  # the first line may be empty, after the ^C of a terminal
    assert "run the same command again" in err or "--resume" in err


def test_no_worker_outlives_a_run_that_is_told_to_end(tmp_path):
    """Pieces that take an hour are not gone on with."""
    marks, script = tmp_path / "marks", tmp_path / "long.py"
    marks.mkdir()
    script.write_text(
        f'''"""Does it end?"""
from functools import partial
from support import pieces
def compute(run):
    return {{"numbers": run.repeat("pieces", partial(pieces.counted, {str(marks)!r}, 3600.0), 20)}}
def draw(run, numbers): ...
def claims(numbers): yield True, ""
'''
    )
    env = os.environ | {"NUMBA_NUM_THREADS": "2", "PYTHONPATH": str(Path(__file__).parents[1])}
    started = Run(script, "-o", tmp_path / "run", start_new_session=True, env=env)
    while not any(marks.iterdir()):
        assert started.process.poll() is None, started.process.stderr.read()
        time.sleep(0.005)
    started.process.send_signal(signal.SIGTERM)
    status, err = started.end()
    assert (status, err.strip().count("\n"), err.strip().endswith("--resume")) == (130, 0, True), err
    for _ in range(100):  # what loky keeps books with ends after it
        try:
            os.killpg(started.process.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    pytest.fail("processes of the run are left")


def test_a_place_that_cannot_be_written_is_one_line(small):
    with pytest.raises(bs.InputError, match="/proc/bayesub: cannot be written: ") as caught:  # systems differ in why
        in_process(small, "-o", "/proc/bayesub")
    assert caught.value.kind == "file"
