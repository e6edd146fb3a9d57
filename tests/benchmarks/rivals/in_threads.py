"""Times of functions that several threads run at once."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from bayesub.study.before.bench import shortest


def in_threads(function: Callable, threads: int, seconds: float) -> float:
    """The shortest time (s) that a run of a function takes if so many threads run it at once, each for itself."""
    if threads == 1:
        return shortest(function, seconds=seconds)[0]
    with ThreadPoolExecutor(threads) as pool:
        return shortest(lambda: [*pool.map(lambda _: function(), range(threads))], seconds=seconds)[0] / threads
