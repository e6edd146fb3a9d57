"""Times of functions."""

import os
import subprocess
import sys
import timeit
from collections.abc import Callable, Iterator

import numba
import numpy as np


def shortest(*functions: Callable, seconds: float, least: int = 3) -> list[float]:
    """The shortest run (s) of each function, run in turn so that a slow moment of the machine falls on all alike."""
    durations = []
    while len(durations) < least or np.sum(durations) < seconds:
        durations.append([timeit.timeit(function, number=1) for function in functions])
    return np.min(durations, axis=0).tolist()


def each_number_of_threads() -> Iterator[int]:
    """One thread and then two, if there are two; afterwards as many as before."""
    before = numba.get_num_threads()
    try:
        for threads in sorted({1, min(2, numba.config.NUMBA_NUM_THREADS)}):
            numba.set_num_threads(threads)
            yield threads
    finally:
        numba.set_num_threads(before)


def with_python(*arguments: str, **environment: str) -> None:
    """Run another Python with these arguments, and these environment variables besides."""
    subprocess.run([sys.executable, *arguments], check=True, env=os.environ | environment, stdout=subprocess.PIPE)
