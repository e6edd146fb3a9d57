"""Work that is done in copies of this process, beside it."""

import os
import select
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numba

PATIENCE_S = 60.0  # with a copy that does not end: a lock that was held when it was made is never released in it
_here = threading.local()  # of each thread `running`, processes and what they do, within a block


@contextmanager
def beside() -> Iterator[None]:
    """A block in which what is given to :func:`do` is done beside it, and at whose end all is done.

    By as many processes as numba has threads, on Linux, where a copy of a process with threads can draw and write
    files. What fails there is done again here, where its error is raised.
    """
    if sys.platform != "linux" or numba.get_num_threads() == 1 or hasattr(_here, "running"):
        yield
        return
    _here.running = []
    try:
        yield
        while _here.running:
            _end()
    finally:
        for process, _ in _here.running:  # of a block that ended early, whose files are made whole
            _has_done(process)
        del _here.running


def do(work: Callable[[], None]) -> None:
    """Do what leaves nothing but files: beside this process in a block of :func:`beside`, otherwise here."""
    if not hasattr(_here, "running"):
        work()
        return
    if len(_here.running) >= numba.get_num_threads():
        _end()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of copies of a process with threads
        process = os.fork()
    if process:
        _here.running.append((process, work))
        return
    status = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # which is for the process that waits
        work()
        status = 0
    finally:
        os._exit(status)


def _end():
    process, work = _here.running.pop(0)
    if not _has_done(process):
        work()


def _has_done(process):
    """Whether a process ends in time, and well."""
    ended = os.pidfd_open(process)
    if not select.select([ended], [], [], PATIENCE_S)[0]:
        os.kill(process, signal.SIGKILL)
    os.close(ended)
    return os.waitpid(process, 0)[1] == 0
