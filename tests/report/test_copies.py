"""Work beside the process: the same files, and the same errors."""

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import numba
import pytest

from bayesub.io.errors import InputError
from bayesub.report import copies

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies of a process are made on Linux only")


@pytest.fixture
def several(monkeypatch):
    """As with two threads, which test workers do not have."""
    monkeypatch.setattr(numba, "get_num_threads", lambda: 2)


SEVERAL = pytest.mark.usefixtures("several")


def name_the_process(file):
    """Write which process writes."""
    file.write_text(str(os.getpid()))


@SEVERAL
def test_work_is_done_by_others_and_all_at_the_end(tmp_path):
    files = [tmp_path / str(k) for k in range(5)]
    with copies.beside():
        for file in files:
            copies.do(partial(name_the_process, file))
    assert len({file.read_text() for file in files} - {str(os.getpid())}) == 5


@pytest.mark.parametrize("is_inside", [False, True])
def test_with_one_thread_and_outside_of_a_block_it_is_done_here(tmp_path, monkeypatch, is_inside):
    monkeypatch.setattr(numba, "get_num_threads", lambda: 1 if is_inside else 2)
    if is_inside:
        with copies.beside():
            copies.do(partial(name_the_process, tmp_path / "file"))
    else:
        copies.do(partial(name_the_process, tmp_path / "file"))
    assert (tmp_path / "file").read_text() == str(os.getpid())


@SEVERAL
def test_what_fails_there_fails_here():
    def fail():
        raise InputError("disk: is full", "file")

    with pytest.raises(InputError, match="disk: is full"), copies.beside():
        copies.do(fail)


@SEVERAL
@pytest.mark.parametrize("ill", ["killed", "asleep"])
def test_a_process_that_dies_or_hangs_is_replaced(tmp_path, monkeypatch, ill):
    here, file = os.getpid(), tmp_path / "file"
    monkeypatch.setattr(copies, "PATIENCE_S", 0.2)

    def work():
        if os.getpid() != here and ill == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if os.getpid() != here:
            time.sleep(60.0)
        name_the_process(file)

    with copies.beside():
        copies.do(work)
    assert file.read_text() == str(here)


@SEVERAL
def test_a_block_that_is_interrupted_leaves_whole_files_and_no_process(tmp_path):
    def work():
        time.sleep(0.3)
        name_the_process(tmp_path / "file")

    def interrupted():
        copies.do(work)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), copies.beside():
        interrupted()
    process = int((tmp_path / "file").read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@SEVERAL
def test_threads_have_blocks_of_their_own_and_one_within_another_adds_nothing(tmp_path):
    """A block that ends in one thread, or within another, leaves the other its processes."""
    begun, ended = threading.Event(), threading.Event()

    def other():
        with copies.beside():
            copies.do(partial(name_the_process, tmp_path / "other"))
            begun.set()
            ended.wait(10.0)
            copies.do(partial(name_the_process, tmp_path / "later"))

    thread = threading.Thread(target=other)
    thread.start()
    begun.wait(10.0)
    with copies.beside():
        copies.do(partial(name_the_process, tmp_path / "one"))
        with copies.beside():
            copies.do(partial(name_the_process, tmp_path / "two"))
        copies.do(partial(name_the_process, tmp_path / "three"))
    ended.set()
    thread.join()
    named = [(tmp_path / name).read_text() for name in ("one", "two", "three", "other", "later")]
    assert len({*named, str(os.getpid())}) == 6


DRAWN = """
import sys
from pathlib import Path
from bayesub.report import copies
from bayesub.report.plots import style
with copies.beside():
    for name in ("one", "two"):
        files = [Path(sys.argv[1]) / f"{name}.{kind}" for kind in ("png", "svg", "pdf")]
        with style.figure(files, 3.0, 2.0) as drawing:
            drawing.subplots().plot([1.0, 3.0, 2.0], label=f"$Y_{{{name}}}$")
"""


def test_pictures_are_the_same_however_many_draw_them(tmp_path):
    files = {}
    for n in (1, 2):
        (tmp_path / str(n)).mkdir()
        environment = os.environ | {"NUMBA_NUM_THREADS": str(n), "SOURCE_DATE_EPOCH": "0"}
        subprocess.run(
            [sys.executable, "-W", "error", "-c", DRAWN, str(tmp_path / str(n))], env=environment, check=True
        )
        files[n] = {file.name: file.read_bytes() for file in (tmp_path / str(n)).iterdir()}
    assert len(files[1]) == 6
    assert files[1] == files[2]
