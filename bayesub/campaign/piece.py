"""One piece of a campaign: done with one thread, it has a result or a failure, and never an exception."""

import pickle
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from bayesub.campaign import beside
from bayesub.io.errors import InputError, one_line

_place = {"remote": False}


@dataclass(frozen=True)
class Failure:
    """Why a piece has no result.

    Attributes
    ----------
    cause : str
        One line, such as ``ValueError: negative depth``.
    details : str
        The traceback; empty if the process ended without one.
    is_final : bool
        Whether the same would come of another attempt.
    """

    cause: str
    details: str = ""
    is_final: bool = False


def attempt(work: Callable[[Any], Any], argument: Any) -> Any:
    """What `work` returns for an argument, or a :class:`Failure`."""
    try:
        with one_thread():
            return work(argument)
    except Exception as error:
        is_input = isinstance(error, InputError)
        cause = str(error) if is_input else f"{type(error).__name__}: {error}"
        return Failure(one_line(cause), traceback.format_exc(), is_final=is_input)


@dataclass(frozen=True)
class Packed:
    """A function that is pickled once for a campaign, and unpacked afresh for each piece.

    Attributes
    ----------
    content : bytes
        The pickled function.
    folders : tuple of str
        Of studies, from which a process that unpacks it imports modules.
    """

    content: bytes
    folders: tuple[str, ...] = ()

    @classmethod
    def of(cls, work: Callable[[Any], Any]) -> "Packed":
        """A function, packed for this machine; those of a study script too, which no other process can import."""
        import cloudpickle

        return cls(cloudpickle.dumps(work), beside.folders())

    @classmethod
    def by_value(cls, work: Callable[[Any], Any]) -> "Packed":
        """A function, packed for another machine, with the modules that lie beside its study."""
        return cls(beside.by_value(work))

    def __setstate__(self, state):
        """Folders are there before what follows, such as an argument, is unpacked."""
        self.__dict__.update(state)
        beside.importable(*self.folders)

    def __call__(self, argument: Any) -> Any:
        """What the function returns."""
        return pickle.loads(self.content)(argument)


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


def is_remote() -> bool:
    """Whether this process works for a coordinator that may be on another machine, with other folders."""
    return _place["remote"]


def become_remote() -> None:
    """Say that it does."""
    _place["remote"] = True
