"""What ``--dask`` names: the address of a scheduler, workers on this machine, or a file about a cluster."""

import contextlib
import logging
import math
import re
import signal
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from bayesub.campaign.executors import Executor
from bayesub.io.errors import InputError
from bayesub.io.toml_files import Section, read_text, validate

ANSWER_S = 10.0  # in which a scheduler must answer
QUEUE_S = 7 * 24 * 3600.0  # that a job may wait for its turn
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+")
_CLASSES = {  # of dask-jobqueue
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "lsf": "LSFCluster",
    "sge": "SGECluster",
    "oar": "OARCluster",
    "moab": "MoabCluster",
    "htcondor": "HTCondorCluster",
    "local": "local.LocalCluster",
}
# Text of a preload script: Ctrl-C at a terminal goes to the workers too.
_DEAF = "from bayesub.campaign.executors import ignore_interrupt; ignore_interrupt()"
_FORMS = "expected tcp://host:port, tls://host:port, local:N, or a YAML file"
Count = Annotated[int, pydantic.Field(ge=1)]


class Tls(Section):
    """Certificates, PEM files: what :class:`distributed.Security` takes.

    Attributes
    ----------
    ca_file : str
        The authority whose certificates are trusted.
    cert : str
        The certificate of this process and of workers that it starts.
    key : str
        Its private key.
    """

    ca_file: str
    cert: str
    key: str


class ClusterFile(Section):
    """A cluster: a scheduler that runs, or a queue of batch jobs.

    Attributes
    ----------
    scheduler : str
        Address of a scheduler; then there is no queue.
    queue : str
        The batch system.
    workers : int
        Processes in all, one core each.
    cores : int
        Cores of a job.
    memory : str
        Of a job, such as 32GB.
    walltime : str
        Of a job, such as 04:00:00.
    account, partition, interface, log_directory : str
        What the batch system and the network ask for.
    setup : list of str
        Lines of the job script before the workers start.
    options : dict
        Whatever else the class of dask-jobqueue takes.
    tls : Tls
        Certificates; with them nothing goes over the network in the clear.
    """

    scheduler: str | None = None
    queue: Literal[tuple(_CLASSES)] | None = None
    workers: Count | None = None
    cores: Count = 1
    memory: str | None = None
    walltime: str | None = None
    account: str | None = None
    partition: str | None = None
    interface: str | None = None
    log_directory: str | None = None
    setup: tuple[str, ...] = ()
    options: dict[str, Any] = pydantic.Field(default_factory=dict)
    tls: Tls | None = None

    @pydantic.model_validator(mode="after")
    def _is_one(self):
        if (self.scheduler is None) == (self.queue is None):
            raise InputError("either 'scheduler' or 'queue' must be given", "conflict")
        if self.scheduler is not None and not _ADDRESS.fullmatch(self.scheduler):
            raise ValueError("scheduler must be tcp://host:port or tls://host:port")
        if self.queue is not None and (self.workers is None or self.memory is None):
            raise InputError("'workers' and 'memory' must be given with 'queue'", "missing")
        return self


def connect(text: str, code: Callable[[], dict[str, str]], remark: Callable[[str], None]) -> Executor:
    """The executor that ``--dask`` names; InputError if there is none.

    Parameters
    ----------
    text : str
        ``tcp://host:port``, ``tls://host:port``, ``local:N`` or the path of a YAML file (:class:`ClusterFile`).
    code : callable
        Gives the versions that a worker must have in common with this process.
    remark : callable
        Called with sentences for the user, of which the first is where the dashboard is.
    """
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError("--dask needs Dask: pip install 'bayesub[cluster]'", "install", "dask") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what is lost is said by the campaign
    if _ADDRESS.fullmatch(text):
        return _scheduler(text, None, code, remark)
    if match := re.fullmatch(r"local:([1-9]\d*)", text):
        return _on_this_machine(int(match[1]), code, remark)
    if Path(text).suffix not in (".yaml", ".yml"):
        raise InputError(f"--dask {text}: {_FORMS}", "value", "--dask")
    file = cluster_file(Path(text))
    if file.scheduler is not None:
        return _scheduler(file.scheduler, _security(file.tls), code, remark)
    return _jobs(file, text, code, remark)


def cluster_file(path: Path) -> ClusterFile:
    """The content of a YAML file; InputError names the key that is wrong."""
    import yaml

    try:
        content = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        line = getattr(error, "problem_mark", None)
        where = f"line {line.line + 1}: " if line else ""
        raise InputError(f"{path}: {where}is not valid YAML: {getattr(error, 'problem', error)}", "format") from None
    if not isinstance(content, dict):
        raise InputError(f"{path}: is not a table of keys and values", "format")
    return validate(content, ClusterFile, str(path))


def _security(tls: Tls | None):
    """Dask's security object; None where its own configuration decides."""
    if tls is None:
        return None
    from distributed import Security

    for name, file in tls:
        if not Path(file).is_file():
            raise InputError(f"--dask: key 'tls.{name}': there is no file {file}", "file", f"tls.{name}")
    pairs = product(("client", "scheduler", "worker"), ("cert", "key"))
    roles = {f"tls_{role}_{part}": getattr(tls, part) for role, part in pairs}
    return Security(tls_ca_file=tls.ca_file, require_encryption=True, **roles)


def _client(target, name: str, security=None):
    """A client of a scheduler or of a cluster object; InputError if it does not answer."""
    from distributed import Client

    try:
        return Client(target, security=security, timeout=ANSWER_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise InputError(
            f"--dask {name}: no scheduler answers there ({type(error).__name__}: {error})", "state", "--dask"
        ) from None


def _scheduler(address: str, security, code, remark) -> Executor:
    from bayesub.campaign.cluster import Cluster

    executor = Cluster(partial(_client, address, address, security), address, code, remark=remark)
    _announce(executor, remark)
    return executor


def _on_this_machine(n: int, code, remark) -> Executor:
    from distributed import LocalCluster

    options = {"threads_per_worker": 1, "processes": True, "dashboard_address": ":0", "silence_logs": "CRITICAL"}
    cluster = LocalCluster(n, **options, preload=[_DEAF])
    return _own(cluster, f"local:{n}", code, remark)


def _jobs(file: ClusterFile, name: str, code, remark) -> Executor:
    """Workers that a batch system starts; a job that ends is submitted again."""
    from operator import attrgetter

    interrupt = signal.getsignal(signal.SIGINT)
    import dask_jobqueue
    import dask_jobqueue.local

    signal.signal(signal.SIGINT, interrupt)  # which the import replaces

    from bayesub.campaign.cluster import Patience

    security = _security(file.tls)
    given = {"scheduler_options": {"dashboard_address": ":0"}}  # any free port
    given |= {"queue": file.partition, "account": file.account, "walltime": file.walltime, "interface": file.interface}
    given |= {"log_directory": file.log_directory, "job_script_prologue": list(file.setup) or None}
    given |= {"security": security, "protocol": "tls://"} if security else {}
    given |= {key: list(value) if isinstance(value, tuple) else value for key, value in file.options.items()}
    given = {key: value for key, value in given.items() if value is not None}
    try:
        cluster = attrgetter(_CLASSES[file.queue])(dask_jobqueue)(
            cores=file.cores, processes=file.cores, memory=file.memory, **given
        )
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        raise InputError(
            f"{name}: {_CLASSES[file.queue]} of dask-jobqueue does not start: {error}", "state", "queue"
        ) from None
    jobs = math.ceil(file.workers / file.cores)
    cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
    return _own(cluster, name, code, remark, Patience(workers=QUEUE_S))


def _own(cluster, name: str, code, remark, patience=None) -> Executor:
    """The executor of a cluster that this process has started, and ends."""
    from bayesub.campaign.cluster import Cluster

    class OwnCluster(Cluster):
        """A cluster that is closed with its executor."""

        def close(self):
            super().close()
            with contextlib.suppress(OSError, TimeoutError):  # of a host too busy; its processes end with this one
                cluster.close()

    executor = OwnCluster(partial(_client, cluster, name), name, code, remark=remark, patience=patience)
    _announce(executor, remark)
    return executor


def _announce(executor, remark) -> None:
    if executor.client.dashboard_link:
        remark(f"dashboard: {executor.client.dashboard_link}")
