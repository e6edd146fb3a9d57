"""Campaigns on a real scheduler with two worker processes, and everything that may go wrong there."""

import shutil
import subprocess
from functools import partial

import pytest
from support import pieces
from support.clusters import PACKAGE, machines
from support.refusals import refused

pytest.importorskip("distributed", reason="Dask is in pip install 'bayesub[cluster]'")

from bayesub.campaign import cluster as clusters
from bayesub.campaign.campaign import Lines, complete
from bayesub.campaign.cluster import RETRIES, connect, remote
from bayesub.campaign.executors import Failure, Misfit
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
def cluster(two):
    """The executor that a user gets for the address."""
    with connect(two.address, code, print) as executor:
        executor.client.wait_for_workers(2)  # a test before may have killed one
        yield executor


def test_results_are_those_of_this_process_with_one_thread(cluster):
    assert dict(cluster.results(pieces.number, NUMBERS)) == RESULTS
    assert cluster.n == 2
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


def test_a_piece_that_kills_every_worker_is_listed(cluster):
    results = dict(cluster.results(pieces.deadly, NUMBERS))
    assert results.keys() == NUMBERS.keys()
    assert results["3"].cause.startswith("KilledWorker: ")
    assert all(isinstance(result, Failure) or result == RESULTS[name] for name, result in results.items())


def test_a_piece_that_always_fails_is_tried_three_times_and_listed(cluster, tmp_path):
    store = Lines(tmp_path / "x.jsonl", NUMBERS)
    with refused("state", "3"):
        complete(cluster, partial(pieces.failing_and_counted, tmp_path), NUMBERS, store, failures=tmp_path / "x.txt")
    assert Lines(store.file, NUMBERS).results == {name: r for name, r in RESULTS.items() if name != "3"}
    assert len(list(tmp_path.glob("tried-*"))) == 1 + RETRIES
    assert "in failing" in (tmp_path / "x.txt").read_text()


def test_a_result_that_cannot_be_sent_is_a_failure(cluster):
    ((_, failure),) = cluster.results(pieces.unsendable, {"x": 0})
    assert isinstance(failure, Failure)
    assert "pickle" in failure.cause


@pytest.fixture
def other_sources(tmp_path):
    """A folder with a bayesub of which one number is another."""
    ignored = shutil.ignore_patterns("__pycache__", "manual")
    shutil.copytree(PACKAGE, tmp_path / "bayesub", ignore=ignored)
    file = tmp_path / "bayesub" / "kernels" / "mass.py"
    file.write_text(file.read_text() + "\nSALINITY = 36.0\n")
    return tmp_path


@pytest.mark.parametrize("options", [(), ("--nthreads", 2)], ids=["sources", "threads"])
def test_a_worker_that_does_not_fit_is_refused_by_name(two, cluster, other_sources, options):
    """There from the beginning, or come while the campaign is under way: nothing of it counts."""
    process = two.workers(1, *options, **({} if options else {"sources": other_sources}))
    try:
        cluster.client.wait_for_workers(3)
        with pytest.raises(Misfit) as caught:
            list(cluster.results(pieces.number, NUMBERS))
        (worker,) = (w for w in cluster.client.nthreads() if str(caught.value).startswith(f"worker {w} is refused: "))
        with pytest.raises(Misfit):
            cluster.client.submit(remote, b"", code, code(), 0, workers=[worker], pure=False).result()
    finally:
        two.end(process)
    here = f" there, {code()['sources of bayesub']} here"
    assert str(caught.value).endswith("it has 2 threads; start it with --nthreads 1" if options else here)


def test_a_scheduler_that_goes_is_one_line_and_what_is_done_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(clusters, "ANSWER_S", 4.0)
    with machines(tmp_path, 2) as started:
        store, marks = Lines(tmp_path / "x.jsonl", NUMBERS), tmp_path / "marks"
        marks.mkdir()
        work = partial(pieces.counted, marks, 0.2)
        with connect(started.address, code, print) as executor:
            results = executor.results(work, NUMBERS)
            for _ in range(4):
                store.add(*next(results))
            started.end_all()
            with refused("state", "--dask"):
                list(results)
        started.scheduler()
        started.workers(2)
        with connect(started.address, code, print) as executor:
            complete(executor, work, NUMBERS, store, failures=tmp_path / "x.txt")
    assert store.results == RESULTS
    assert len(list(marks.iterdir())) <= 12 + 2 * 2  # those under way once more


def test_workers_that_go_are_one_line(tmp_path):
    with machines(tmp_path, 0) as started:
        process = started.workers(1)
        with connect(started.address, code, print) as executor:
            executor.patience = 20.0
            results = executor.results(partial(pieces.slow, 0.2), NUMBERS)
            next(results)
            executor.patience = 1.0
            started.end(process)
            with refused("state", "--dask"):
                list(results)


def test_no_worker_is_one_line_in_the_end(tmp_path):
    with machines(tmp_path, 0) as started, connect(started.address, code, print) as executor:
        executor.patience = 1.0
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


def test_tls_by_the_configuration_of_dask(certificates, tmp_path, monkeypatch):
    """All connections are encrypted, and who has no certificate gets no answer."""
    words = [word for name, file in certificates.items() for word in (f"--tls-{name.replace('_', '-')}", file)]
    with machines(tmp_path, protocol="tls", certificates=words) as started:
        pair = f"{{cert: {certificates['cert']}, key: {certificates['key']}}}"
        tls = f"{{ca-file: {certificates['ca_file']}, client: {pair}}}"
        settings = f"distributed: {{comm: {{require-encryption: true, tls: {tls}}}}}"
        (tmp_path / "cluster.yaml").write_text(f"scheduler-address: {started.address}\n{settings}\n")
        with connect(str(tmp_path / "cluster.yaml"), code, print) as executor:
            assert executor.client.security.require_encryption
            assert dict(executor.results(pieces.number, NUMBERS)) == RESULTS
            assert all(worker.startswith("tls://") for worker in executor.client.nthreads())
        monkeypatch.setattr(clusters, "ANSWER_S", 1.0)
        failure = pytest.raises(InputError, match=r"--dask tls://127.0.0.1:\d+: no scheduler answers there")
        with failure as caught, connect(started.address, code, print):
            pass
        assert (caught.value.kind, caught.value.key) == ("state", "--dask")  # the rest of the sentence is Dask's
