"""Workers of Dask, which hands out pieces, tries them again, and copes with lost workers; what ``--dask`` names."""

import contextlib
import importlib.util
import logging
import math
import re
import signal
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any
from uuid import uuid4

from bayesub.campaign import beside
from bayesub.campaign.executors import Executor, Misfit, Pool, pickled_result
from bayesub.io.errors import InputError, check_known, one_line
from bayesub.io.terminal import duration
from bayesub.io.toml_files import read_text

RETRIES = 2  # of a piece that raises an exception
ANSWER_S = 10.0  # in which a scheduler must answer
WORKER_S = 300.0  # that a campaign waits for a worker
QUEUE_S = 7 * 24 * 3600.0  # the same, for one whose job must wait for its turn
CLASSES = {"slurm": "SLURM", "pbs": "PBS", "lsf": "LSF", "sge": "SGE", "oar": "OAR", "moab": "Moab"}  # of dask-jobqueue
CLASSES |= {"htcondor": "HTCondor", "local": "local.Local"}
# Text of a preload script: Ctrl-C at a terminal goes to the workers too.
_DEAF = "from bayesub.campaign.executors import ignore_interrupt; ignore_interrupt()"
# What Dask does beside the pieces of workers of this machine, which took a seventh of their time: less often, or not.
_SELDOM: dict[str, Any] = {"distributed.admin.tick.interval": "3s", "distributed.admin.system-monitor.interval": "5s"}
_SELDOM |= {"distributed.worker.profile.enabled": False}
Code = Callable[[], dict[str, str]]


class Cluster(Pool):
    """The workers of a Dask scheduler, each with one thread and the code of this process.

    The function of a campaign travels to each worker once. Each piece sees to it that its worker has the same code:
    what `code` gives, name -> version, here and there. `patience` are the seconds to wait for a first worker, and for
    others when all have gone; `name` is that of the cluster in messages.
    """

    def __init__(self, client: Any, name: str, code: Code, patience: float):
        self.client, self.name, self.code, self.patience = client, name, code, patience

    @property
    def n(self) -> int:
        """Number of workers."""
        return len(self.client.nthreads())

    def _submitter(self, work):
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
        submit = partial(self.client.submit, remote, shared, self.code, wanted, retries=RETRIES, pure=False)
        return lambda argument: submit(pickled(argument))

    def _stop(self, futures):
        if self.client.status == "running":
            with contextlib.suppress(OSError, TimeoutError):
                self.client.cancel(list(futures))

    def _look(self):
        try:
            n = self.n
        except (OSError, TimeoutError):
            raise self._lost() from None
        if n == 0:
            raise self._nobody()

    def _nobody(self):
        help_ = f"start workers (dask worker {self.name} --nthreads 1) and use --resume"
        return self._error(f"no worker for {duration(self.patience or 0.0)}; what is done is saved; {help_}")

    def _lost(self):
        return self._error("the scheduler has gone or was started again; what is done is saved, use --resume")

    def _error(self, text):
        return InputError(f"{self.name}: {text}", "state", "--dask")


def check(code: Code, wanted: dict[str, str], dask_worker: Any = None) -> None:
    """Raise Misfit unless the worker that does this has the code that is wanted, and one thread."""
    from distributed import get_worker

    worker, present = dask_worker or get_worker(), code()
    reasons = [f"{k}: {present.get(k, 'none')} there, {wanted[k]} here" for k in wanted if present.get(k) != wanted[k]]
    if worker.state.nthreads != 1:
        reasons.append(f"it has {worker.state.nthreads} threads; start it with --nthreads 1")
    if reasons:
        raise Misfit(f"worker {worker.address} is refused: {reasons[0]}", "state", "--dask")


def remote(work: bytes, code: Code, wanted: dict[str, str], argument: bytes) -> bytes:
    """Done by a worker: the pickled result of a piece."""
    check(code, wanted)
    return pickled_result(None, work, argument)


@contextlib.contextmanager
def connect(text: str, code: Code, remark: Callable[[str], None]) -> Iterator[Executor]:
    """The executor that ``--dask`` names, as long as the block lasts; InputError if there is none.

    `text`: ``tcp://host:port``, ``tls://host:port``, ``local:N`` or the path of a YAML file (:func:`configured`);
    `code`: gives the versions that a worker must have in common with this process; `remark`: called with sentences for
    the user, of which the first is where the dashboard is.
    """
    try:
        import dask.config
        from distributed import Client
    except ImportError:
        raise InputError("--dask needs Dask: pip install 'bayesub[cluster]'", "install", "dask") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what is lost is said by the campaign
    settings = _settings(Path(text)) if Path(text).suffix in (".yaml", ".yml") else {}
    with dask.config.set(dask.config.merge(dask.config.config, settings)), dask.config.set({} if settings else _SELDOM):
        target, patience = configured(settings, text) if settings else _target(text)
        try:
            client = Client(target, timeout=ANSWER_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError) as error:
            reason = f"no scheduler answers there ({type(error).__name__}: {error})"
            raise InputError(f"--dask {text}: {reason}", "state", "--dask") from None
        if client.dashboard_link:
            remark(f"dashboard: {client.dashboard_link}")
        try:
            yield Cluster(client, target if isinstance(target, str) else text, code, patience)
        finally:
            for one in (client, target):
                if not isinstance(one, str):  # what a busy host does not answer in time does not matter any more
                    with contextlib.suppress(OSError, TimeoutError):
                        one.close()


def _target(text: str) -> tuple[Any, float]:
    """Address of a scheduler, or a cluster of this machine that is started; seconds to wait for workers."""
    if re.fullmatch(r"(tcp|tls)://[^\s/]+:\d+", text):
        return text, WORKER_S
    if match := re.fullmatch(r"local:([1-9]\d*)", text):
        from distributed import LocalCluster
        from distributed.security import Security

        if importlib.util.find_spec("cryptography") is None:
            text = "--dask local:N needs cryptography for its certificates: pip install 'bayesub[cluster]'"
            raise InputError(text, "install", "cryptography")
        # Other users of the host reach the loopback interface: certificates that only this process has keep them out.
        options = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "security": Security.temporary()}
        options |= {"threads_per_worker": 1, "processes": True, "silence_logs": "CRITICAL", "preload": [_DEAF]}
        return LocalCluster(int(match[1]), protocol="tls", **options), WORKER_S
    message = f"--dask {text}: expected tcp://host:port, tls://host:port, local:N, or a YAML file"
    raise InputError(message, "value", "--dask")


def _settings(path: Path) -> dict[str, Any]:
    """The content of a YAML file."""
    import yaml

    try:
        content = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise InputError(one_line(f"{path}: is not valid YAML: {error}"), "format") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: is not a table of keys and values", "format")
    return content


def configured(settings: dict[str, Any], name: str) -> tuple[Any, float]:
    """The address, or the cluster of batch jobs, that Dask's configuration names; seconds to wait for workers.

    The content of a file as in ``~/.config/dask``, with ``scheduler-address``, or with one section of ``jobqueue`` and
    ``workers``, processes in all; the page `cluster` of the manual has examples. InputErrors name the file.
    """
    if address := settings.get("scheduler-address"):
        return address, WORKER_S
    queues, workers = settings.get("jobqueue") or {}, settings.get("workers")
    if len(queues) != 1 or not isinstance(workers, int) or workers < 1:
        text = f"{name}: needs one section of 'jobqueue' with 'workers', a whole number, or 'scheduler-address'"
        raise InputError(text, "missing", "workers" if queues else "jobqueue")
    ((queue, given),) = queues.items()
    expected, key = f"expected {', '.join(CLASSES)}", f"jobqueue.{queue}"
    check_known(queue, CLASSES, f"{name}: unknown key '{key}'", hint=expected, key=key)
    interrupt = signal.getsignal(signal.SIGINT)
    import dask_jobqueue
    import dask_jobqueue.local

    signal.signal(signal.SIGINT, interrupt)  # which the import replaces
    options: dict[str, Any] = {"cores": 1, "scheduler_options": {"dashboard_address": "127.0.0.1:0"}}
    options |= {key.replace("-", "_"): value for key, value in given.items()}
    kind = f"{CLASSES[queue]}Cluster"
    try:
        jobs = math.ceil(workers / options["cores"])
        cluster = attrgetter(kind)(dask_jobqueue)(**options | {"processes": options["cores"]})
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        raise InputError(f"{name}: {kind} of dask-jobqueue does not start: {error}", "state", "jobqueue") from None
    cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)  # a job that ends is submitted again
    return cluster, QUEUE_S
