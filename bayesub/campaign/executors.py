"""What does the pieces of a campaign: this process, or other processes of this machine; :mod:`.cluster` has Dask's."""

import atexit
import pickle
import queue
import signal
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping
from concurrent import futures
from contextlib import closing, contextmanager
from functools import partial
from typing import Any, NamedTuple

from bayesub.campaign import beside
from bayesub.io.errors import InputError, one_line
from bayesub.io.interrupts import interruptible

_THREADS = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
_IDLE_S = 300  # after which processes without work end
_place = {"remote": False}
_pools: dict[int, Any] = {}


@atexit.register
def _end_pools() -> None:
    """End the processes before the interpreter takes apart what their threads need."""
    for pool in _pools.values():
        pool.shutdown(kill_workers=True)


class Failure(NamedTuple):
    """Why a piece has no result: the cause in one line, such as ``ValueError: negative depth``, and the traceback."""

    cause: str
    details: str


def _failure(error: BaseException) -> Failure:
    cause = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    return Failure(one_line(cause), "".join(traceback.format_exception(error)))


Results = Generator[tuple[str, Any], None, None]  # name -> result or Failure of each piece


class Misfit(InputError):
    """A worker has other code or more threads, so that what it returns is not to be used."""


class Executor(ABC):
    """Does pieces of work.

    A piece is a call of a function that depends on its argument alone: results are the same whatever executes them.
    """

    @abstractmethod
    def results(self, work: Callable[[Any], Any], pieces: Mapping[str, Any]) -> Results:
        """The name of each piece with what `work` returns for its argument or a :class:`Failure`, as they come.

        Of the pieces, name -> argument, those named first begin first.
        """

    def map(self, work: Callable[[Any], Any], items: Iterable[Any]) -> list[Any]:
        """The results of `work` for each item, in order; InputError if a piece fails."""
        pieces = {str(k): item for k, item in enumerate(items)}
        results = {}
        with closing(self.results(work, pieces)) as stream:
            for name, result in stream:
                if isinstance(result, Failure):
                    raise InputError(f"piece {name} of {len(pieces)} failed: {result.cause}", "state", name)
                results[name] = result
        return [results[name] for name in pieces]


class Serial(Executor):
    """One piece after the other in this process."""

    def results(self, work: Callable[[Any], Any], pieces: Mapping[str, Any]) -> Results:
        """Name and result, or :class:`Failure`, of each piece, in order."""
        for name, argument in pieces.items():
            try:
                with one_thread(), interruptible():  # Ctrl-C that compiled code turned into another error ends all
                    result = work(argument)
            except Exception as error:
                result = _failure(error)
            yield name, result


class Pool(Executor):
    """Pieces go to workers, all of them at once, and come back as futures of pickled results."""

    patience: float | None = None  # seconds without a result after which the workers are looked at

    @abstractmethod
    def _submitter(self, work: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """The function that submits a piece by its argument and returns its future."""

    @abstractmethod
    def _stop(self, futures: Collection[Any]) -> None:
        """Call back what was handed over and is not done."""

    @abstractmethod
    def _lost(self) -> InputError:
        """The error when pieces do not come back."""

    def _look(self) -> None:
        """Raise InputError if no worker is left."""

    def results(self, work: Callable[[Any], Any], pieces: Mapping[str, Any]) -> Results:
        """Name and result, or :class:`Failure`, of each piece as they come; InputError if the workers are lost."""
        if not pieces:
            return
        names: dict[Any, str] = {}
        arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
        is_lost = False
        try:
            submit = self._submitter(work)
            for name, argument in pieces.items():
                future = submit(argument)
                names[future] = name
                future.add_done_callback(arrived.put)
            while names:
                try:
                    future = arrived.get(timeout=self.patience)
                except queue.Empty:
                    self._look()
                    continue
                name = names.pop(future)
                try:
                    result = pickle.loads(future.result())
                except (futures.CancelledError, futures.BrokenExecutor):
                    is_lost = True  # those that are done come as well
                    continue
                except Misfit:
                    raise
                except Exception as error:
                    result = _failure(error)
                yield name, result
        except futures.BrokenExecutor:  # while pieces are handed over
            is_lost = True
        finally:
            if names or is_lost:
                self._stop(names)
        if is_lost:
            raise self._lost()


class Processes(Pool):
    """So many processes of this machine with one thread each; all campaigns share them, and joblib's are others."""

    def __init__(self, n: int):
        self.n = n

    def _submitter(self, work):
        import cloudpickle

        if self.n not in _pools:
            from joblib.externals.loky import ProcessPoolExecutor

            threads = {f"{name}_NUM_THREADS": "1" for name in _THREADS}
            _pools[self.n] = ProcessPoolExecutor(self.n, timeout=_IDLE_S, initializer=ignore_interrupt, env=threads)
        submit = partial(_pools[self.n].submit, pickled_result, beside.folders(), cloudpickle.dumps(work))
        return lambda argument: submit(cloudpickle.dumps(argument))

    def _stop(self, futures):  # noqa: ARG002 - they end with their processes
        if self.n in _pools:
            _pools.pop(self.n).shutdown(kill_workers=True)

    def _lost(self):
        text = "a process that did pieces was ended, by lack of memory or from outside"
        return InputError(f"{text}; what is done is saved, and --resume does the rest", "state")


def pickled_result(folders: tuple[str, ...] | None, work: bytes, argument: bytes) -> bytes:
    """What a function returns for an argument, all three pickled; the function is made afresh for each piece.

    Modules are imported from folders of studies, too; None where a coordinator may be on another machine.
    """
    import cloudpickle

    _place["remote"] = folders is None
    beside.importable(*(folders or ()))
    with one_thread():
        return cloudpickle.dumps(pickle.loads(work)(pickle.loads(argument)))


def is_remote() -> bool:
    """Whether this process works for a coordinator that may be on another machine, with other folders."""
    return _place["remote"]


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread for the kernels and for the BLAS, so that a piece has the same bits wherever it is done."""
    import numba
    import threadpoolctl

    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        with threadpoolctl.threadpool_limits(1):
            yield
    finally:
        numba.set_num_threads(before)


def ignore_interrupt() -> None:
    """Leave Ctrl-C to the process that has started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def local() -> Executor:
    """Processes of this machine, one for each thread that numba may use; with ``NUMBA_NUM_THREADS=1`` this process."""
    import numba

    n = numba.get_num_threads()
    return Serial() if n == 1 else Processes(n)
