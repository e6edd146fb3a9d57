"""Workers of Dask as executor of a campaign; Dask hands out pieces, tries them again, and copes with lost workers."""

import contextlib
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any
from uuid import uuid4

from bayesub.campaign import beside
from bayesub.campaign.executors import Misfit, Pool, become_remote, done
from bayesub.io.errors import InputError
from bayesub.io.terminal import duration

RETRIES = 2  # of a piece that raises an exception
WORKER_S = 300.0  # that a campaign waits for a worker


class Cluster(Pool):
    """The workers of a Dask scheduler, each with one thread and the code of this process.

    The function of a campaign travels to each worker once. Each piece sees to it that its worker has the same code.

    Parameters
    ----------
    client : distributed.Client
        Of the scheduler.
    name : str
        Of the cluster, for messages.
    code : callable
        Gives what a worker must have in common with this process, name -> version; called here and there.
    own : object
        A cluster of Dask that is closed with this one.
    patience : float
        Seconds to wait for a first worker, and for others when all have gone.
    """

    def __init__(
        self, client, name: str, code: Callable[[], dict[str, str]], own: Any = None, patience: float = WORKER_S
    ):
        self.client, self.name, self.code, self.own, self.patience = client, name, code, own, patience
        self.executor = client.get_executor(retries=RETRIES, pure=False)

    @property
    def n(self) -> int:
        """Number of workers."""
        return len(self.client.nthreads())

    def _begin(self, work):
        """As of a pool; InputError if there is no worker, or one that does not fit."""
        wanted, pickled = self.code(), beside.by_value()
        try:
            self.client.wait_for_workers(1, timeout=self.patience)
            self.client.run(check, self.code, wanted)
        except Misfit:
            raise
        except TimeoutError:
            raise self._nobody() from None
        except Exception as error:
            raise self._error(f"its workers cannot do pieces ({type(error).__name__}: {error})") from None
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")
            shared = self.client.submit(bytes, pickled(work), key=f"function-{uuid4().hex}", pure=False)
        submit = partial(self.executor.submit, remote, shared, self.code, wanted)
        return lambda argument: submit(pickled(argument))

    def _stop(self):
        if self.client.status == "running":
            with contextlib.suppress(OSError, TimeoutError):
                self.executor.shutdown(wait=False)
        self.executor = self.client.get_executor(retries=RETRIES, pure=False)

    def _look(self):
        try:
            n = self.n
        except (OSError, TimeoutError):
            raise self._lost() from None
        if n == 0:
            raise self._nobody()

    def _nobody(self):
        help_ = f"start workers (dask worker {self.name} --nthreads 1) and use --resume"
        return self._error(f"no worker for {duration(self.patience)}; what is done is saved; {help_}")

    def _lost(self):
        return self._error("the scheduler has gone or was started again; what is done is saved, use --resume")

    def _error(self, text: str) -> InputError:
        return InputError(f"{self.name}: {text}", "state", "--dask")

    def close(self):
        """Let go of the cluster; what a busy host does not answer in time does not matter any more."""
        for one in (self.client, self.own):
            if one is not None:
                with contextlib.suppress(OSError, TimeoutError):
                    one.close()


def check(code: Callable[[], dict[str, str]], wanted: dict[str, str], dask_worker: Any = None) -> None:
    """Raise Misfit unless the worker that does this has the code that is wanted, and one thread."""
    from distributed import get_worker

    worker, found = dask_worker or get_worker(), code()
    reasons = [f"{k}: {found.get(k, 'none')} there, {wanted[k]} here" for k in wanted if found.get(k) != wanted[k]]
    if worker.state.nthreads != 1:
        reasons.append(f"it has {worker.state.nthreads} threads; start it with --nthreads 1")
    if reasons:
        raise Misfit(f"worker {worker.address} is refused: {reasons[0]}", "state", "--dask")


def remote(work: bytes, code: Callable[[], dict[str, str]], wanted: dict[str, str], argument: bytes) -> bytes:
    """Done by a worker: the pickled result of a piece."""
    check(code, wanted)
    become_remote()
    return done((), work, argument)
