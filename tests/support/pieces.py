"""Pieces of work for the tests of campaigns; workers import this module."""

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np


def number(k):
    """A number that depends on nothing but k."""
    return {"k": k, "value": float(np.random.default_rng(k).standard_normal())}


def slow(seconds, k):
    """A number, after a while."""
    time.sleep(seconds)
    return number(k)


def counted(folder, seconds, k):
    """A number, after a while, and a file for each time that it is computed."""
    (Path(folder) / f"{k}-{os.getpid()}-{time.time_ns()}").touch()
    time.sleep(seconds)
    return number(k)


def deadly_once(folder, k):
    """The third piece kills its process without a word, the first time."""
    mark = Path(folder) / "killed"
    if k == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.05)
    return number(k)


def deadly(k):
    """The third piece kills its process whenever it is tried."""
    if k == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number(k)


def failing(k):
    """The third piece always fails."""
    if k == 3:
        raise ValueError("the log\nends early")
    return number(k)


def threads(_):
    """Threads of numba and, at most, of the BLAS."""
    import numba
    import threadpoolctl

    pools = threadpoolctl.threadpool_info()
    return numba.get_num_threads(), max((pool["num_threads"] for pool in pools), default=1)


def failing_and_counted(folder, k):
    """As :func:`failing`, with a file for each attempt at the third piece."""
    if k == 3:
        (Path(folder) / f"tried-{time.time_ns()}").touch()
    return failing(k)


def unsendable(_):
    """A result that cannot be pickled."""
    return threading.Lock()


def size(content, _):
    """The length of something large, after a moment."""
    time.sleep(0.05)
    return len(content)


def functions(dask_scheduler):
    """How many functions of campaigns a scheduler has."""
    return sum(key.startswith("function-") for key in dask_scheduler.tasks)


def received(dask_worker):
    """How often a worker has had something from other workers."""
    return dask_worker.state.transfer_incoming_count_total
