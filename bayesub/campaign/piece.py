"""One piece of a campaign: done with one thread, it has a result or a failure."""

import pickle
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

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
        The traceback.
    """

    cause: str
    details: str

    @classmethod
    def of(cls, error: BaseException) -> "Failure":
        """That of a piece that raised an error."""
        cause = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        return cls(one_line(cause), "".join(traceback.format_exception(error)))


class Misfit(InputError):
    """A worker has other code or more threads, so that what it returns is not to be used."""


def done(work: bytes, argument: Any) -> bytes:
    """What a function returns for an argument; function and result are pickled, the function afresh for each piece."""
    import cloudpickle

    with one_thread():
        return cloudpickle.dumps(pickle.loads(work)(argument))


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
