"""What does the pieces of a campaign: this process, or a pool; that of a cluster has a module of its own."""

import pickle
import queue
import signal
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent import futures
from contextlib import closing
from functools import partial
from typing import Any

from bayesub.campaign.piece import Failure, Misfit, done, one_thread
from bayesub.io.errors import InputError
from bayesub.io.interrupts import interruptible

_THREADS = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
_IDLE_S = 300  # after which processes without work end


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
            try:
                with one_thread(), interruptible():  # Ctrl-C that compiled code turned into another error ends all
                    result = work(argument)
            except Exception as error:
                result = Failure.of(error)
            yield name, result


class Pool(Executor):
    """Pieces go to an executor of :mod:`concurrent.futures`, all of them at once.

    Attributes
    ----------
    patience : float or None
        Seconds without a result after which the pool is looked at; None for never.
    """

    patience: float | None = None

    @abstractmethod
    def begin(self, work: bytes) -> Callable[[Any], futures.Future]:
        """What hands a piece over, for a pickled function; the future is of a pickled result."""

    @abstractmethod
    def stop(self) -> None:
        """Call back what was handed over and is not done."""

    @abstractmethod
    def lost(self) -> InputError:
        """The error when pieces do not come back."""

    def is_empty(self) -> bool:
        """Whether nobody is left who does pieces."""
        return False

    def results(self, work, pieces):
        """As :meth:`Executor.results`."""
        import cloudpickle

        names: dict[futures.Future, str] = {}
        arrived: queue.SimpleQueue[futures.Future] = queue.SimpleQueue()
        n_lost = 0
        try:
            submit = self.begin(cloudpickle.dumps(work)) if pieces else None
            for name, argument in pieces.items():
                future = submit(argument)
                names[future] = name
                future.add_done_callback(arrived.put)
            while names:
                try:
                    future = arrived.get(timeout=self.patience)
                except queue.Empty:
                    if self.is_empty():
                        raise self.lost() from None
                    continue
                name = names.pop(future)
                try:
                    result = pickle.loads(future.result())
                except (futures.CancelledError, futures.BrokenExecutor):
                    n_lost += 1  # those that are done come as well
                    continue
                except Misfit:
                    raise
                except Exception as error:
                    result = Failure.of(error)
                yield name, result
        except futures.BrokenExecutor:  # while pieces are handed over
            n_lost += 1
        finally:
            if names or n_lost:
                self.stop()
        if n_lost:
            raise self.lost()


class Processes(Pool):
    """As many pieces at a time as there are processes, with one thread each.

    Parameters
    ----------
    n : int
        Number of processes.
    """

    def __init__(self, n: int):
        self.n = n

    def begin(self, work):
        """As :meth:`Pool.begin`; all campaigns of this size share processes, and joblib's own are not theirs."""
        if self.n not in _pools:
            from joblib.externals.loky import ProcessPoolExecutor

            threads = {f"{name}_NUM_THREADS": "1" for name in _THREADS}
            _pools[self.n] = ProcessPoolExecutor(self.n, timeout=_IDLE_S, initializer=ignore_interrupt, env=threads)
        return partial(_pools[self.n].submit, done, work)

    def stop(self):
        """As :meth:`Pool.stop`."""
        if self.n in _pools:
            _pools.pop(self.n).shutdown(kill_workers=True)

    def lost(self):
        """As :meth:`Pool.lost`."""
        return InputError(
            "a process that did pieces was ended, by lack of memory or from outside; what is done is saved, and "
            "--resume does the rest",
            "state",
        )


_pools: dict[int, Any] = {}


def ignore_interrupt() -> None:
    """Leave Ctrl-C to the process that has started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def local() -> Executor:
    """Processes of this machine, one for each thread that numba may use; with ``NUMBA_NUM_THREADS=1`` this process."""
    import numba

    n = numba.get_num_threads()
    return Serial() if n == 1 else Processes(n)
