"""A Dask scheduler and workers on the loopback interface, as users start them: processes of their own."""

import os
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import bayesub

ROOT = Path(__file__).parents[2]
PACKAGE = Path(bayesub.__file__).parent


def free_port():
    """A port that nobody listens to."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Machines:
    """Processes of a scheduler and its workers, ended one by one or all together.

    Attributes
    ----------
    address : str
        Of the scheduler.
    """

    def __init__(self, folder, protocol="tcp", certificates=()):
        self.folder, self.certificates = folder, certificates
        self.port, self.processes = free_port(), []
        self.address = f"{protocol}://127.0.0.1:{self.port}"

    def start(self, *command, sources=ROOT):
        """A process of Dask with the package in a folder."""
        settings = {
            "PYTHONPATH": os.pathsep.join([str(sources), str(ROOT / "tests")]),
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
            "DASK_DISTRIBUTED__DASHBOARD__LINK": "http://{host}/status",
        }
        with (self.folder / f"{len(self.processes)}.log").open("w") as log:
            command = [sys.executable, "-m", *map(str, command), *self.certificates]
            process = subprocess.Popen(
                command, env=os.environ | settings, stdout=log, stderr=log, start_new_session=True, cwd=self.folder
            )
        self.processes.append(process)
        return process

    def scheduler(self):
        """The scheduler, on the port of the address."""
        address = (
            "--protocol",
            self.address.partition(":")[0],
            "--host",
            "127.0.0.1",
            "--port",
            self.port,
            "--idle-timeout",
            600,
        )
        return self.start("distributed.cli.dask_scheduler", *address, "--no-dashboard")

    def workers(self, n, *options, sources=ROOT):
        """So many workers with a nanny each."""
        options = ("--nworkers", n, "--no-dashboard", "--memory-limit", 0, *(options or ("--nthreads", 1)))
        return self.start("distributed.cli.dask_worker", self.address, *options, sources=sources)

    def end(self, process):
        """End a process and its children without a word."""
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def end_all(self):
        """End whatever was started."""
        for process in self.processes:
            self.end(process)


@contextmanager
def machines(folder, n_workers=2, **given):
    """A scheduler and workers, as long as the block lasts."""
    started = Machines(folder, **given)
    try:
        started.scheduler()
        if n_workers:
            started.workers(n_workers)
        yield started
    finally:
        started.end_all()
