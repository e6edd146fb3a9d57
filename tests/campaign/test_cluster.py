"""Campaigns on a real scheduler with two worker processes, and everything that may go wrong there."""

import shutil
import subprocess
import time
from functools import partial
from types import SimpleNamespace

import cloudpickle
import pytest
from support import pieces
from support.clusters import PACKAGE, machines
from support.refusals import refused

pytest.importorskip("distributed", reason="Dask is in pip install 'bayesub[cluster]'")

from distributed import KilledWorker

from bayesub.campaign import connection
from bayesub.campaign.campaign import complete
from bayesub.campaign.cluster import ATTEMPTS, Cluster, Patience, _piece, misfit
from bayesub.campaign.executors import ENDED
from bayesub.campaign.piece import Failure
from bayesub.campaign.store import Lines
from bayesub.io.errors import InputError
from bayesub.study.provenance import code

NUMBERS = {str(k): k for k in range(12)}
RESULTS = {name: pieces.number(k) for name, k in NUMBERS.items()}
pytestmark = [
    pytest.mark.cluster,
    pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"),
]


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A scheduler and two workers."""
    with machines(tmp_path_factory.mktemp("two")) as started:
        yield started


@pytest.fixture
def remarks():
    return []


@pytest.fixture
def cluster(two, remarks):
    """The executor that a user gets for the address."""
    with connection.connect(two.address, code, remarks.append) as executor:
        executor.client.wait_for_workers(2)  # a test before may have killed one
        yield executor


def test_results_are_those_of_this_process_with_one_thread(cluster):
    assert dict(cluster.results(pieces.number, NUMBERS)) == RESULTS
    assert cluster.note() == "2 workers"
    assert cluster.map(pieces.threads, range(2)) == [(1, 1), (1, 1)]
    assert list(cluster.results(pieces.number, {})) == []


def test_a_large_input_travels_once(cluster):
    """A function of ten megabytes comes to one worker, and from there to the other, again only if that had no piece."""
    before = sum(cluster.client.run(pieces.received).values())
    functions = set()
    for _, size in cluster.results(partial(pieces.size, bytes(10_000_000)), {str(k): k for k in range(40)}):
        assert size == 10_000_000
        functions.add(cluster.client.run_on_scheduler(pieces.functions))
    assert functions == {1}
    assert sum(cluster.client.run(pieces.received).values()) - before <= 5  # of 40 pieces


def test_a_worker_that_is_killed_takes_nothing_with_it(cluster, tmp_path):
    assert dict(cluster.results(partial(pieces.deadly_once, tmp_path), NUMBERS)) == RESULTS
    assert (tmp_path / "killed").exists()


def test_a_piece_that_kills_every_worker_is_listed_and_the_others_are_done(cluster):
    results = dict(cluster.results(pieces.deadly, NUMBERS))
    failure = results.pop("3")
    assert failure.cause.startswith(f"{ENDED}, on several workers, last on tcp://127.0.0.1:")
    assert results == {name: result for name, result in RESULTS.items() if name != "3"}


class Doomed:
    """A client of two workers that both die, with all that they have, whenever one of them tries the third piece."""

    status = "running"

    def __init__(self):
        self.under_way = []

    def submit(self, work, *arguments, key, **_):
        future = SimpleNamespace(key=key, status="pending")
        future.add_done_callback = lambda call: setattr(future, "call", call)
        if work is _piece:
            future.argument = arguments[1]
            self.under_way.append(future)
        return future

    def nthreads(self):
        """Asked before pieces are handed out: those that were are answered."""
        futures, self.under_way = self.under_way, []
        died = any(future.argument == 3 for future in futures)
        killed = KilledWorker("x", SimpleNamespace(address="w"), 3)
        for future in futures:
            future.status, future.exception = "error" if died else "finished", lambda: killed
            future.call(future)
        return {"a": 1, "b": 1}

    def run(self, function, workers, **_):
        return dict.fromkeys(workers, function())

    def gather(self, futures):
        return [cloudpickle.dumps(pieces.number(future.argument)) for future in futures]

    def cancel(self, _):
        pass


def test_who_dies_beside_a_deadly_piece_is_tried_without_it(monkeypatch):
    """The most unhappy neighbourhood: whatever is under way together with it dies with it, again and again."""
    monkeypatch.setattr("bayesub.campaign.cluster.LOOK_S", 0.0)
    executor = Cluster(Doomed, "tcp://nowhere", code)
    results = dict(executor.results(pieces.deadly, NUMBERS))
    assert results.pop("3") == Failure(f"{ENDED}, on several workers, last on w", is_final=True)
    assert results == {name: result for name, result in RESULTS.items() if name != "3"}


def test_a_piece_that_always_fails_is_tried_three_times_and_listed(cluster, tmp_path):
    store = Lines(tmp_path / "x.jsonl", NUMBERS)
    with refused("state", "3"):
        complete(cluster, partial(pieces.failing_and_counted, tmp_path), NUMBERS, store, failures=tmp_path / "x.txt")
    assert Lines(store.file, NUMBERS).results == {name: r for name, r in RESULTS.items() if name != "3"}
    assert len(list(tmp_path.glob("tried-*"))) == ATTEMPTS
    assert "in failing" in (tmp_path / "x.txt").read_text()


def test_a_result_that_cannot_be_sent_is_a_failure(cluster):
    ((_, failure),) = cluster.results(pieces.unsendable, {"x": 0})
    assert isinstance(failure, Failure)
    assert "pickle" in failure.cause


@pytest.fixture
def other_sources(tmp_path):
    """A folder with a bayesub of which one number is another."""
    ignored = shutil.ignore_patterns("__pycache__", "manual", "*.csv.gz")
    shutil.copytree(PACKAGE, tmp_path / "bayesub", ignore=ignored)
    file = tmp_path / "bayesub" / "model" / "water.py"
    file.write_text(file.read_text() + "\nSALINITY = 36.0\n")
    return tmp_path


def test_workers_with_other_sources_or_more_threads_are_refused_by_name(two, cluster, remarks, other_sources):
    """They come while the campaign is under way, and the others do all of it."""
    processes = [two.workers(1, sources=other_sources), two.workers(1, "--nthreads", 2)]
    try:
        until = time.monotonic() + 60.0
        while len(cluster.refused) < 2 and time.monotonic() < until:
            assert dict(cluster.results(partial(pieces.slow, 0.1), NUMBERS)) == RESULTS
    finally:
        for process in processes:
            two.end(process)
    reasons = sorted(cluster.refused.values())
    assert reasons[0] == "it has 2 threads; start it with --nthreads 1"
    assert reasons[1].startswith("sources of bayesub: ")
    assert reasons[1].endswith(f" there, {code()['sources of bayesub']} here")
    for address, reason in cluster.refused.items():
        assert f"worker {address} is refused: {reason}" in remarks


def test_a_straggler_holds_up_nobody_and_is_done_elsewhere(cluster, tmp_path):
    """The last test of these workers, of which one is stuck from now on."""
    cluster.patience = Patience(straggler=1.0)
    names = [name for name, _ in cluster.results(partial(pieces.stuck_once, tmp_path), NUMBERS)]
    assert "3" in names[-3:]  # and what its worker had been given besides
    assert sorted(names) == sorted(NUMBERS)


def test_versions_are_named():
    assert misfit({"bayesub": "0.1"}, {"bayesub": "0.2"}, 1) == "bayesub: 0.1 there, 0.2 here"
    assert misfit({}, {"numpy": "2.0"}, 1) == "numpy: none there, 2.0 here"


def test_a_scheduler_that_is_started_again_gets_what_is_left(tmp_path):
    """And one that stays away is one line; what was done is kept and not done again."""
    with machines(tmp_path, 2) as started, connection.connect(started.address, code, print) as executor:
        store, marks = Lines(tmp_path / "x.jsonl", NUMBERS), tmp_path / "marks"
        marks.mkdir()
        results = executor.results(partial(pieces.counted, marks, 0.2), NUMBERS)
        for _ in range(4):
            store.add(*next(results))
        for process in started.processes:
            started.end(process)
        started.scheduler()
        started.workers(2)
        for name, result in results:
            store.add(name, result)
        assert store.results == RESULTS
        assert len(list(marks.iterdir())) <= 12 + 2 * 2  # those under way once more

        executor.patience = Patience(workers=1.0)
        results = executor.results(partial(pieces.slow, 0.2), NUMBERS)
        next(results)
        started.end_all()
        with refused("state", "--dask"):
            list(results)


def test_no_worker_is_one_line_in_the_end(tmp_path):
    with machines(tmp_path, 0) as started, connection.connect(started.address, code, print) as executor:
        executor.patience = Patience(workers=1.0)
        with refused("state", "--dask"):
            dict(executor.results(pieces.number, NUMBERS))


@pytest.fixture
def certificates(tmp_path):
    """An authority, and a certificate that it has signed; the names of the three files."""
    if not shutil.which("openssl"):
        pytest.skip("there is no openssl to make certificates with")
    names = ("ca.pem", "ca.key", "cert.pem", "cert.key", "request.pem")
    ca, ca_key, cert, key, request = (str(tmp_path / name) for name in names)
    new = ("-newkey", "rsa:2048", "-nodes", "-subj")
    signing = ("-CA", ca, "-CAkey", ca_key, "-CAcreateserial", "-days", "2")
    for command in (
        ("req", "-x509", *new, "/CN=authority", "-keyout", ca_key, "-out", ca, "-days", "2"),
        ("req", *new, "/CN=localhost", "-keyout", key, "-out", request),
        ("x509", "-req", "-in", request, *signing, "-out", cert),
    ):
        subprocess.run(["openssl", *command], check=True, capture_output=True)
    return {"ca_file": ca, "cert": cert, "key": key}


def test_tls_by_the_security_object_of_dask(certificates, tmp_path, monkeypatch):
    """All connections are encrypted, and who has no certificate gets no answer."""
    words = [word for name, file in certificates.items() for word in (f"--tls-{name.replace('_', '-')}", file)]
    with machines(tmp_path, protocol="tls", certificates=words) as started:
        keys = "".join(f"  {name}: {file}\n" for name, file in certificates.items())
        (tmp_path / "cluster.yaml").write_text(f"scheduler: {started.address}\ntls:\n{keys}")
        with connection.connect(str(tmp_path / "cluster.yaml"), code, print) as executor:
            assert executor.client.security.require_encryption
            assert dict(executor.results(pieces.number, NUMBERS)) == RESULTS
            assert all(worker.startswith("tls://") for worker in executor.workers)
        monkeypatch.setattr(connection, "ANSWER_S", 1.0)
        with pytest.raises(InputError, match=r"--dask tls://127.0.0.1:\d+: no scheduler answers there") as caught:
            connection.connect(started.address, code, print)
        assert (caught.value.kind, caught.value.key) == ("state", "--dask")  # the rest of the sentence is Dask's
