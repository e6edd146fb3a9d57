"""Checkpoints: what is saved, what is refused, and what happens when disks fill and files are damaged."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused
from support.toys import Banana

import bayesub as bs
from bayesub.inference.sampling import checkpoint, sampler
from bayesub.inference.sampling.posterior import Criteria
from bayesub.io import atomic
from bayesub.io.atomic import locked

ENDLESS = Criteria(ess=1e12)  # never met, so that the length is max_steps


def run(path, max_steps=160, problem=None, seed=7, **options):
    rng = np.random.default_rng(seed)
    problem = problem or Banana()
    return bs.sample(problem, rng=rng, n_walkers=16, max_steps=max_steps, criteria=ENDLESS, checkpoint=path, **options)


@pytest.fixture
def short_blocks(monkeypatch):
    """A block for every step or two."""
    monkeypatch.setattr(sampler, "BLOCK_SECONDS", 0.0)


@pytest.fixture(scope="module")
def straight():
    """The run that was never stopped."""
    return run(None)


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """The checkpoint of its first forty steps, in a block for every step or two."""
    path = tmp_path_factory.mktemp("begun") / "chain"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampler, "BLOCK_SECONDS", 0.0)
        run(path, 40)
    return path


def same(resumed, straight):
    np.testing.assert_array_equal(resumed.chain, straight.chain)
    np.testing.assert_array_equal(resumed.log_prob, straight.log_prob)
    assert resumed.acceptance == straight.acceptance
    assert resumed.n_warmup == straight.n_warmup


def test_resuming_is_bit_identical(tmp_path, straight):
    """A run that was stopped, and stopped again, and resumed is the run that was not, evaluations included."""
    path = tmp_path / "chain"
    run(path, 130)
    run(path, 150)
    resumed = run(path)
    same(resumed, straight)
    assert resumed.evaluations == straight.evaluations
    assert resumed.jacobians == straight.jacobians > 0
    assert not list(tmp_path.rglob("*.partial"))


def test_the_geometry_is_not_computed_again(tmp_path, straight, monkeypatch):
    """A resumed run takes coordinates and surrogate from the checkpoint, whatever the machine now makes of them."""
    run(tmp_path / "chain", 130)
    monkeypatch.setattr(sampler, "learn_coordinates", None)
    same(run(tmp_path / "chain"), straight)


@pytest.mark.parametrize(
    ("change", "kind", "key"),
    [
        ({"seed": 8}, "state", "seed"),
        ({"problem": Banana(reach=2.0)}, "state", "prior"),
        ({"n_ensembles": 5}, "state", "n_ensembles"),
        ({"problem": Banana(width=0.06)}, "state", "checkpoint"),
    ],
)
def test_another_run_is_refused_by_its_first_difference(tmp_path, change, kind, key):
    """And the files stay as they were."""
    path = tmp_path / "chain"
    run(path, 20)
    before = {file: file.read_bytes() for file in path.iterdir()}
    with refused(kind, key):
        run(path, 20, **change)
    assert {file: file.read_bytes() for file in path.iterdir()} == before


def test_a_checkpoint_of_a_former_version_is_refused(tmp_path, monkeypatch):
    """Its settings lack what the present ones have."""
    settings = sampler._settings
    monkeypatch.setattr(sampler, "_settings", lambda *a: {k: v for k, v in settings(*a).items() if "format" not in k})
    run(tmp_path / "chain", 20)
    monkeypatch.setattr(sampler, "_settings", settings)
    with refused("state", "checkpoint format"):
        run(tmp_path / "chain", 20)


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "removed"])
@pytest.mark.parametrize("victim", ["last", "third", "start.block"])
@pytest.mark.usefixtures("short_blocks")
def test_a_damaged_block_is_noticed_and_computed_again(tmp_path, begun, straight, victim, damage):
    """One bit is enough; the run continues from the blocks before it and ends in the same bits."""
    path = shutil.copytree(begun, tmp_path / "chain")
    blocks = sorted(path.glob("[0-9]*.block"))
    file = {"last": blocks[-1], "third": blocks[2], "start.block": path / "start.block"}[victim]
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    {
        "cut": lambda: file.write_bytes(content[:-100]),
        "flipped": lambda: file.write_bytes(content),
        "empty": lambda: file.write_bytes(b""),
        "removed": file.unlink,
    }[damage]()
    if victim == "third" or (victim == "last" and damage != "removed"):
        with pytest.warns(UserWarning, match=f"{file.name} is damaged or missing: continued from block"):
            resumed = run(path)
    else:
        resumed = run(path)
    same(resumed, straight)


@pytest.mark.usefixtures("short_blocks")
def test_a_full_disk_loses_nothing(tmp_path, straight, monkeypatch):
    """Writing the fifth block fails as it does on a full disk: one line, and the run resumes from the fourth."""
    path = tmp_path / "chain"

    @contextmanager
    def replacing(file):
        if file.name == "000005.block":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with atomic.replacing(file) as partial:
            yield partial

    with monkeypatch.context() as full, refused("file", "checkpoint"):
        full.setattr(checkpoint, "replacing", replacing)
        run(path)
    assert len(list(path.glob("[0-9]*.block"))) == 4
    same(run(path), straight)


def test_where_nothing_can_be_written(tmp_path):
    """A folder that cannot be made, and a file in its place."""
    (tmp_path / "file").write_text("mine")
    with refused("file", "checkpoint"):
        run(tmp_path / "file")
    with refused("file"):
        run(tmp_path / "file" / "chain")
    assert (tmp_path / "file").read_text() == "mine"
    with pytest.raises(bs.InputError, match="/proc/chain: cannot be written: ") as caught:  # each system has its reason
        run(Path("/proc/chain"))  # read-only, even for root
    assert caught.value.kind == "file"


def test_a_folder_at_work_is_refused(tmp_path):
    """A second run in the same folder is one line; the lock ends with the process that held it, kill or not."""
    path = tmp_path / "chain"
    path.mkdir()
    with locked(path), refused("state"):
        run(path, 20)
    script = "import sys, time\nfrom pathlib import Path\nfrom bayesub.io.atomic import locked\n"
    script += "with locked(Path(sys.argv[1])): print('held', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", script, path], stdout=subprocess.PIPE, text=True) as holder:
        holder.stdout.readline()
        with refused("state"):
            run(path, 20)
        holder.kill()
    run(path, 20)


def test_ctrl_c_saves_the_step_in_hand(tmp_path, straight):
    """Pressed once, the run stops within a step and has it saved; twice, at once."""

    class Pressing(Banana):
        """Presses Ctrl-C `times` times during one of its evaluations."""

        calls = 0

        def log_likelihood(self, parameters):
            Pressing.calls += 1
            if Pressing.calls == 90:
                for _ in range(self.times):
                    signal.raise_signal(signal.SIGINT)
            return super().log_likelihood(parameters)

    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    for times, n_blocks in ((1, 1), (2, 0)):
        Pressing.calls, Pressing.times = 0, times
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / f"{times}", problem=Pressing())
        assert len(list((tmp_path / f"{times}").glob("[0-9]*.block"))) == n_blocks
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        same(run(tmp_path / f"{times}"), straight)


def test_in_a_thread_signals_are_left_alone(tmp_path, straight):
    """Only the main thread may set handlers."""
    found = []
    thread = threading.Thread(target=lambda: found.append(run(tmp_path / "chain")))
    thread.start()
    thread.join()
    same(found[0], straight)


def test_a_long_chain_is_thinned(tmp_path, monkeypatch):
    """Where a chain takes too much room every second step is forgotten, and lengths still count in steps."""
    whole = run(None, 400)
    monkeypatch.setattr(sampler, "CHAIN_BYTES", 200 * 1024)  # a step has 4 ensembles of 16 walkers of 2 numbers
    thinned = run(tmp_path / "chain", 400)
    assert thinned.thin == 2
    np.testing.assert_array_equal(thinned.chain, whole.chain[:, 1::2])
    assert (thinned.n_steps, thinned.n_warmup) == (360, 40)
    assert thinned.acceptance == pytest.approx(whole.acceptance, abs=1e-3)  # of the steps that were kept at first
    same(run(tmp_path / "chain", 400), thinned)
