"""What does the pieces of a campaign: this process, processes of this machine; a cluster has a module of its own."""

import signal
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent import futures
from contextlib import closing
from functools import partial
from typing import Any

from bayesub.campaign.piece import Failure, Packed, attempt
from bayesub.io.errors import InputError
from bayesub.io.interrupts import interruptible

_THREADS = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
_IDLE_S = 300  # after which processes without work end
ENDED = "the process that did it was ended, by lack of memory or from outside"


class Executor(ABC):
    """Does pieces of work.

    A piece is a call of a function that depends on its argument alone: results have the same bits whatever executes
    the pieces, and in whichever order.
    """

    @abstractmethod
    def results(self, work: Callable[[Any], Any], pieces: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
        """The name of each piece with what `work` returns for it or a :class:`Failure`, as they come.

        Parameters
        ----------
        work : callable
            A function of one argument.
        pieces : mapping
            Name -> argument; those named first begin first.
        """

    def note(self) -> str:
        """What progress says of the executor, such as the number of workers; may be empty."""
        return ""

    def map(self, work: Callable[[Any], Any], items: Iterable) -> list:
        """What `work` returns for each item, in order; InputError if a piece fails."""
        pieces = {str(k): item for k, item in enumerate(items)}
        results = {}
        with closing(self.results(work, pieces)) as stream:
            for name, result in stream:
                if isinstance(result, Failure):
                    raise InputError(f"piece {name} of {len(pieces)} failed: {result.cause}", "state", name)
                results[name] = result
        return [results[name] for name in pieces]

    def close(self) -> None:  # noqa: B027 - most have taken nothing
        """Give back what the executor has taken."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class Serial(Executor):
    """One piece after the other in this process."""

    def results(self, work, pieces):
        """As :meth:`Executor.results`."""
        for name, argument in pieces.items():
            yield name, attempt(partial(_interruptible, work), argument)


def _interruptible(work, argument):
    """What work returns; Ctrl-C that compiled code turned into another error ends the campaign and not the piece."""
    with interruptible():
        return work(argument)


class Processes(Executor):
    """As many pieces at a time as there are processes, with one thread each.

    A process that is ended takes its piece with it. Those that were under way are done again, one at a time, so that
    a piece that ends its process twice is known; the others go on.

    Parameters
    ----------
    n : int
        Number of processes.
    """

    def __init__(self, n: int):
        self.n = n

    def results(self, work, pieces):
        """As :meth:`Executor.results`."""
        queue, suspects, running, pool, packed = deque(pieces), set(), {}, None, Packed.of(work)
        try:
            while queue or running:
                while queue and len(running) < (1 if suspects else 2 * self.n):
                    name, pool = queue.popleft(), self._pool()
                    running[pool.submit(attempt, packed, pieces[name])] = name
                done, _ = futures.wait(running, return_when=futures.FIRST_COMPLETED)
                ended = []
                for future in done:
                    name = running.pop(future)
                    error = future.exception()
                    if isinstance(error, futures.process.BrokenProcessPool):
                        ended.append(name)
                    else:
                        suspects.discard(name)
                        yield name, future.result() if error is None else _failure(error)
                if ended:
                    _pools.pop(self.n, None)
                    ended += running.values()
                    running.clear()
                    if len(ended) == 1 and ended[0] in suspects:
                        suspects.remove(ended[0])
                        yield ended[0], Failure(ENDED)
                    else:
                        suspects.update(ended)
                        queue.extendleft(reversed(ended))
        finally:
            if running:
                _pools.pop(self.n, None)
                pool.shutdown(kill_workers=True)

    def _pool(self):
        """The processes of all campaigns of this size; those of joblib itself cannot be shared with it."""
        if self.n not in _pools:
            from joblib.externals.loky import ProcessPoolExecutor

            threads = {f"{name}_NUM_THREADS": "1" for name in _THREADS}
            _pools[self.n] = ProcessPoolExecutor(self.n, timeout=_IDLE_S, initializer=ignore_interrupt, env=threads)
        return _pools[self.n]


_pools: dict[int, Any] = {}


def ignore_interrupt() -> None:
    """Leave Ctrl-C to the process that has started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _failure(error: BaseException) -> Failure:
    """Of a piece that could not be sent or whose result could not be sent back."""
    return Failure(f"{type(error).__name__}: {error}", repr(error), is_final=True)


def local() -> Executor:
    """Processes of this machine, one for each thread that numba may use; with ``NUMBA_NUM_THREADS=1`` this process."""
    import numba

    n = numba.get_num_threads()
    return Serial() if n == 1 else Processes(n)
