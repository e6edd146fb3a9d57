"""What ``--dask`` names: the address of a scheduler, workers on this machine, or a file about a cluster."""

import logging
import math
import re
import signal
from collections.abc import Callable
from itertools import product
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from bayesub.campaign.cluster import WORKER_S, Cluster
from bayesub.campaign.executors import Executor
from bayesub.io.errors import InputError
from bayesub.io.toml_files import Section, read_text, validate

ANSWER_S = 10.0  # in which a scheduler must answer
QUEUE_S = 7 * 24 * 3600.0  # that a job may wait for its turn
_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d+")
_CLASSES = {
    "slurm": "SLURM",
    "pbs": "PBS",
    "lsf": "LSF",
    "sge": "SGE",
    "oar": "OAR",
    "moab": "Moab",
}  # of dask-jobqueue
_CLASSES |= {"htcondor": "HTCondor", "local": "local.Local"}
# Text of a preload script: Ctrl-C at a terminal goes to the workers too.
_DEAF = "from bayesub.campaign.executors import ignore_interrupt; ignore_interrupt()"
_FORMS = "expected tcp://host:port, tls://host:port, local:N, or a YAML file"
Count = Annotated[int, pydantic.Field(ge=1)]


class Tls(Section):
    """PEM files: of an authority, of the certificate that it has signed for this process, and of its private key."""

    ca_file: str
    cert: str
    key: str


class ClusterFile(Section):
    """A scheduler that runs, or a queue of batch jobs; the page `cluster` of the manual says what the keys mean."""

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
        from distributed import Client
    except ImportError:
        raise InputError("--dask needs Dask: pip install 'bayesub[cluster]'", "install", "dask") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what is lost is said by the campaign
    target, security, patience = _target(text)
    try:
        client = Client(target, security=security, timeout=ANSWER_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise InputError(
            f"--dask {text}: no scheduler answers there ({type(error).__name__}: {error})", "state", "--dask"
        ) from None
    if client.dashboard_link:
        remark(f"dashboard: {client.dashboard_link}")
    name, own = (target, None) if isinstance(target, str) else (text, target)
    return Cluster(client, name, code, own, patience)


def _target(text: str) -> tuple[Any, Any, float]:
    """Address of a scheduler, or a cluster that is started here; its certificates; seconds to wait for workers."""
    if _ADDRESS.fullmatch(text):
        return text, None, WORKER_S
    if match := re.fullmatch(r"local:([1-9]\d*)", text):
        from distributed import LocalCluster

        options = {"threads_per_worker": 1, "processes": True, "dashboard_address": ":0", "silence_logs": "CRITICAL"}
        return LocalCluster(int(match[1]), **options, preload=[_DEAF]), None, WORKER_S
    if Path(text).suffix not in (".yaml", ".yml"):
        raise InputError(f"--dask {text}: {_FORMS}", "value", "--dask")
    file = cluster_file(Path(text))
    security = _security(file.tls)
    return (file.scheduler, security, WORKER_S) if file.scheduler else (_jobs(file, text, security), None, QUEUE_S)


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


def _jobs(file: ClusterFile, name: str, security) -> Any:
    """Workers that a batch system starts; a job that ends is submitted again."""
    interrupt = signal.getsignal(signal.SIGINT)
    import dask_jobqueue
    import dask_jobqueue.local

    signal.signal(signal.SIGINT, interrupt)  # which the import replaces

    kind = f"{_CLASSES[file.queue]}Cluster"
    given = file.model_dump(include={"account", "walltime", "interface", "log_directory", "memory"})
    given |= {"queue": file.partition, "cores": file.cores, "processes": file.cores}
    given |= {"job_script_prologue": list(file.setup) or None, "security": security}
    given |= {"protocol": "tls://" if security else None, "scheduler_options": {"dashboard_address": ":0"}}
    given |= {key: list(value) if isinstance(value, tuple) else value for key, value in file.options.items()}
    given = {key: value for key, value in given.items() if value is not None}
    try:
        cluster = attrgetter(kind)(dask_jobqueue)(**given)
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        raise InputError(f"{name}: {kind} of dask-jobqueue does not start: {error}", "state", "queue") from None
    jobs = math.ceil(file.workers / file.cores)
    cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
    return cluster
