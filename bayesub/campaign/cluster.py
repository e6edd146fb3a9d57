"""Workers of Dask as executor of a campaign."""

import contextlib
import queue
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import cloudpickle
from distributed import Client, Future, KilledWorker, get_worker

from bayesub.campaign.beside import by_value
from bayesub.campaign.executors import ENDED, Executor
from bayesub.campaign.piece import Failure, Packed, attempt, become_remote
from bayesub.io.errors import InputError, one_line
from bayesub.io.terminal import duration

ATTEMPTS = 3  # at a piece that raises an exception
LOSSES = 10  # of a piece that comes back without an answer
# Pieces at the scheduler for each worker, so that none waits for the coordinator; and Dask takes the function away from
# a worker that has no piece of it.
AHEAD = 3
LOOK_S = 5.0  # between looks at the workers
TICK_S = 0.5
_LOST = (OSError, TimeoutError)  # of a connection; the errors of Dask are among them


@dataclass(frozen=True)
class Refusal:
    """The answer of a worker that must not take part.

    Attributes
    ----------
    worker : str
        Its address.
    reason : str
        What is wrong with it.
    """

    worker: str
    reason: str


@dataclass(frozen=True)
class Patience:
    """How long a campaign waits, s.

    Attributes
    ----------
    workers : float
        For a scheduler that does not answer, and for a first worker.
    straggler : float
        For the last pieces, at least, before idle workers do copies of them.
    """

    workers: float = 300.0
    straggler: float = 60.0


class Cluster(Executor):
    """The workers of a Dask scheduler, each with one thread.

    The function of a campaign travels to each worker once, and a piece is no more than its name and argument. Pieces
    of a worker that has died, or of a scheduler that was started again, are done again. A worker with other code is
    refused. When nothing is left to hand out and the last pieces take three times as long as any before, idle
    workers do copies of them, and the first answer counts.

    Parameters
    ----------
    connect : callable
        Gives a client; called again when the connection is lost.
    address : str
        Of the scheduler, for messages.
    code : callable
        Gives what a worker must have in common with this process, name -> version; called here and there.
    remark : callable
        Called with a sentence for the user, such as that a worker is refused.
    patience : Patience
        How long to wait.
    """

    def __init__(
        self,
        connect: Callable[[], Client],
        address: str,
        code: Callable[[], dict[str, str]],
        *,
        remark: Callable[[str], None] = lambda _: None,
        patience: Patience | None = None,
    ):
        self.connect, self.address, self.code, self.remark = connect, address, code, remark
        self.patience = patience or Patience()
        self.client = connect()
        self.refused: dict[str, str] = {}
        self.workers: list[str] = []
        self._looked = self._last_worker = 0.0

    def note(self) -> str:
        """The number of workers."""
        return f"{len(self.workers)} workers"

    def close(self) -> None:
        """Let go of the cluster; what a busy host does not answer in time does not matter any more."""
        with contextlib.suppress(*_LOST):
            self.client.close()

    def results(self, work, pieces):
        """As :meth:`Executor.results`."""
        campaign = _Campaign(self, Packed.by_value(work), pieces)
        self._last_worker = time.monotonic()
        try:
            while campaign.is_unfinished():
                if not campaign.is_connected():
                    self._reconnect()
                    campaign.begin_again()
                self._look()
                campaign.hand_out()
                yield from campaign.arrivals()
        finally:
            campaign.cancel()

    def _reconnect(self):
        """Connect again, which a lost connection needs; InputError if the scheduler stays away."""
        if self.client.status == "running":
            return
        until = time.monotonic() + self.patience.workers
        while True:
            try:
                self.client.close(timeout=1)
                self.client = self.connect()
            except (*_LOST, InputError):
                if time.monotonic() > until:
                    raise InputError(
                        f"{self.address}: the scheduler has not answered for {duration(self.patience.workers)}; what "
                        "is done is saved, start it again and use --resume",
                        "state",
                        "--dask",
                    ) from None
                time.sleep(TICK_S)
            else:
                self._looked = 0.0
                self._last_worker = time.monotonic()
                return

    def _look(self):
        """See which workers there are and examine new ones; InputError if there is none for long."""
        now = time.monotonic()
        if now - self._looked < (LOOK_S if self.workers else TICK_S):
            return
        self._looked = now
        try:
            present = self.client.nthreads()
            self._examine([address for address in present if address not in (*self.workers, *self.refused)], present)
        except _LOST:
            return  # the next look is at another connection
        self.workers = [address for address in present if address not in self.refused]
        if self.workers:
            self._last_worker = now
        elif now - self._last_worker > self.patience.workers:
            raise InputError(self._nobody(), "state", "--dask")

    def _examine(self, addresses: list[str], threads: dict[str, int]):
        """Refuse those of some workers that cannot take part."""
        if not addresses:
            return
        answers = self.client.run(self.code, workers=addresses, on_error="return")
        for address, answer in answers.items():
            if isinstance(answer, _LOST):  # it is gone already
                continue
            if isinstance(answer, BaseException):
                self.refuse(address, f"it cannot load this bayesub ({type(answer).__name__}: {answer})")
            elif reason := misfit(answer, self.code(), threads[address]):
                self.refuse(address, reason)

    def refuse(self, address: str, reason: str) -> None:
        """Give a worker nothing more to do."""
        if address not in self.refused:
            self.refused[address] = one_line(reason)
            self.remark(f"worker {address} is refused: {self.refused[address]}")
        self.workers = [worker for worker in self.workers if worker != address]

    def examine_again(self) -> None:
        """Look at all workers anew, because a piece failed before it began."""
        self.workers, self._looked = [], 0.0

    def _nobody(self) -> str:
        refusals = "".join(f"; {worker} is refused: {reason}" for worker, reason in list(self.refused.items())[:2])
        return (
            f"{self.address}: no worker for {duration(self.patience.workers)}{refusals}; what is done is saved; start "
            f"workers (dask worker {self.address} --nthreads 1) and use --resume"
        )


def misfit(code: dict[str, str], wanted: dict[str, str], n_threads: int) -> str:
    """Why a worker must not take part, by its code and threads; empty if it may."""
    for name, version in wanted.items():
        if code.get(name) != version:
            return f"{name}: {code.get(name, 'none')} there, {version} here"
    return f"it has {n_threads} threads; start it with --nthreads 1" if n_threads != 1 else ""


def _shared(work: Packed) -> Packed:
    """The function of a campaign, which Dask can compute again wherever it is needed."""
    return work


def _piece(
    work: Packed, argument: bytes, code: Callable[[], dict[str, str]], wanted: dict[str, str]
) -> bytes | Refusal:
    """Done by a worker: the pickled result of a piece."""
    worker = get_worker()
    if reason := misfit(code(), wanted, worker.state.nthreads):
        return Refusal(worker.address, reason)
    become_remote()
    result = attempt(lambda packed: work(cloudpickle.loads(packed)), argument)
    try:
        return cloudpickle.dumps(result)
    except Exception as error:  # of a result that cannot be sent
        return cloudpickle.dumps(Failure(f"{type(error).__name__}: {error}", is_final=True))


class _Campaign:
    """The pieces of one campaign that wait, and those that are under way."""

    def __init__(self, cluster: Cluster, work: Packed, pieces):
        self.cluster, self.work, self.pieces = cluster, work, pieces
        self.token, self.wanted = uuid4().hex[:12], cluster.code()
        self.waiting, self.attempts, self.losses = deque(pieces), Counter(), Counter()
        self.suspects: set[str] = set()  # beside which several workers died
        self.under_way: dict[str, tuple[str, Future, float]] = {}  # key -> name, future, when it was submitted
        self.arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.done: set[str] = set()
        self.shared: Future | None = None
        self.n_submitted, self.longest, self.last = 0, 0.0, time.monotonic()

    def is_unfinished(self) -> bool:
        """Whether pieces wait or are under way."""
        return len(self.done) < len(self.pieces)

    def is_connected(self) -> bool:
        """Whether the scheduler still knows this campaign."""
        running = self.cluster.client.status == "running"
        return running and self.shared is not None and self.shared.status not in ("cancelled", "error")

    def begin_again(self) -> None:
        """Share the function with a scheduler that does not know it; all pieces wait."""
        names = dict.fromkeys(name for name, *_ in self.under_way.values())
        self.under_way.clear()
        self.waiting.extendleft(reversed(list(names)))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")
            key = f"function-{self.token}-{self.n_submitted}"
            self.shared = self.cluster.client.submit(_shared, self.work, key=key, pure=False)

    def hand_out(self) -> None:
        """Submit pieces as long as workers may want them, and copies of the last ones if these take too long."""
        while self._has_next() and len(self.under_way) < AHEAD * len(self.cluster.workers):
            self._submit(self.waiting.popleft())
        late = time.monotonic() - self.last > max(self.cluster.patience.straggler, 3.0 * self.longest)
        if late and not self._has_next():
            self.last = time.monotonic()
            self._copy_stragglers()

    def _has_next(self) -> bool:
        """Whether a piece may go: a suspect alone, so that no other dies with it, and none beside a suspect."""
        others = {name for name, *_ in self.under_way.values()} - self.done
        return bool(self.waiting) and not (others and self.suspects & {self.waiting[0], *others})

    def _copy_stragglers(self):
        """Submit the pieces under way once more, to workers that have nothing to do."""
        processing = self.cluster.client.processing()
        idle = [worker for worker in self.cluster.workers if not processing.get(worker)]
        copies = Counter(name for name, *_ in self.under_way.values())
        for name in [name for name, n in copies.items() if n == 1 and idle]:
            self._submit(name, idle)

    def _submit(self, name: str, workers: list[str] | None = None):
        self.n_submitted += 1
        key = f"piece-{self.token}-{name}-{self.n_submitted}"
        workers = workers or (self.cluster.workers if self.cluster.refused else None)
        where = {"workers": workers, "allow_other_workers": True} if workers else {}
        arguments = (self.shared, by_value(self.pieces[name]), self.cluster.code, self.wanted)
        future = self.cluster.client.submit(_piece, *arguments, key=key, pure=False, **where)
        self.under_way[key] = name, future, time.monotonic()
        future.add_done_callback(lambda _: self.arrived.put(key))

    def arrivals(self) -> Iterator[tuple[str, Any]]:
        """The results that have come; waits a moment for the first."""
        keys = []
        try:
            keys.append(self.arrived.get(timeout=TICK_S))
            while True:
                keys.append(self.arrived.get_nowait())
        except queue.Empty:
            pass
        for key, answer in zip(keys, self._answers(keys), strict=True):
            if key not in self.under_way:
                continue
            name, _, began = self.under_way.pop(key)
            if name in self.done or answer is None:
                self._lost(name)
                continue
            if isinstance(answer, Refusal):
                self.cluster.refuse(answer.worker, answer.reason)
                self.waiting.appendleft(name)
                continue
            self.last = time.monotonic()
            if isinstance(answer, Failure) and not answer.is_final and self.attempts[name] + 1 < ATTEMPTS:
                self.attempts[name] += 1
                self.waiting.append(name)
                continue
            self.longest = max(self.longest, self.last - began)
            self.done.add(name)
            yield name, answer

    def _answers(self, keys: list[str]) -> list:
        """Result, failure or refusal of each future; None of one that was cancelled or is not known any more."""
        futures = {key: self.under_way[key][1] for key in keys if key in self.under_way}
        finished = [future for future in futures.values() if future.status == "finished"]
        try:
            contents = dict(zip([f.key for f in finished], self.cluster.client.gather(finished), strict=True))
        except Exception:  # of the connection, or of a worker that died with its result
            contents = {}
        return [self._answer(key, futures[key], contents) if key in futures else None for key in keys]

    def _answer(self, key: str, future: Future, contents: dict):
        if future.key in contents:
            content = contents[future.key]
            return content if isinstance(content, Refusal) else cloudpickle.loads(content)
        if future.status != "error":
            return None
        error = future.exception()
        if isinstance(error, KilledWorker):  # at first perhaps only beside the piece that killed it
            name, *_ = self.under_way[key]
            alone = name in self.suspects
            self.suspects.add(name)
            return Failure(f"{ENDED}, on several workers, last on {error.last_worker.address}", is_final=alone)
        self.cluster.examine_again()
        return Failure(one_line(f"{type(error).__name__}: {error}"), repr(error))

    def _lost(self, name: str):
        """Let a piece without an answer wait again, unless it is done or a copy of it is under way."""
        if name in self.done or any(name == other for other, *_ in self.under_way.values()):
            return
        self.losses[name] += 1
        if self.losses[name] > LOSSES:
            raise InputError(
                f"{self.cluster.address}: piece {name} was lost {LOSSES} times; what is done is saved",
                "state",
                "--dask",
            )
        self.waiting.appendleft(name)

    def cancel(self) -> None:
        """Call back what is under way."""
        if self.cluster.client.status == "running":
            with contextlib.suppress(*_LOST):
                self.cluster.client.cancel([future for _, future, _ in self.under_way.values()])
        self.under_way.clear()
        self.shared = None
