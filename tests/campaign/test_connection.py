"""What --dask may say, and the one line for what it may not."""

import builtins
import json
import os
import platform
from pathlib import Path

import pytest
from support import pieces, refusals

from bayesub.campaign import cluster
from bayesub.io.errors import InputError
from bayesub.study.provenance import code

pytestmark = pytest.mark.cluster

SLURM = """
workers: 64
jobqueue:
  slurm:
    cores: 16
    memory: 32GB
    walltime: "04:00:00"
    queue: short
    job-script-prologue: [module load python, source ~/venv/bin/activate]
    job-extra-directives: ["--exclusive"]
"""
STUDY = '''"""Are results those of one process?

Claim: yes, in every bit that is kept.
"""
from functools import partial
from pathlib import Path

import numpy as np

import bayesub as bs
from bayesub.inference.baselines import sqp
from bayesub.design import families, information, judge, limits
from bayesub.design.search import Cost, search
from thesis import cases
from bayesub.study.run.script import load

CALIBRATION = load(Path({studies!r}) / "calibration.py")
CALIBRATION.MAX_STEPS = 300
DISTURBED = load(Path({studies!r}) / "disturbed.py")


def compute(run):
    run.progress.stage("calibration")
    experiment = CALIBRATION.planar(CALIBRATION.FEW)["track"]
    trials = run.repeat("calibration", partial(CALIBRATION.trial, experiment, 0), 2)
    parts = run.parts("SQP", {{f"start {{k}}": partial(searched, k) for k in range(2)}})
    return {{
        "ranks": [t["ranks"] for t in trials],
        "SQP": parts,
        "spectra": [float(run.load_arrays(f"SQP_start_{{k}}")["solution"].sum()) for k in range(2)],
        "design": designed(run),
    }}


def searched(k):
    boat = bs.load_vehicle("suboff")
    problem = cases.track_problem(boat, "horizontal", ("Xuu", "Yuv", "Nuv"))
    estimate = sqp(problem, rng=np.random.default_rng(k), n_starts=1, max_iterations=4)
    return {{"costs": estimate.costs.tolist()}}, {{"solution": estimate.solutions[0]}}


def designed(run):
    boat = bs.load_vehicle("suboff")
    limit = limits.Limits(duration_s=60.0)
    family = families.Family("steps", boat, limit, families.controls(boat, limit)[:1], "horizontal", 4)
    sensors = bs.sensors.Track(0.5, 0.1, 5.0, ("x", "y", "yaw"))
    judged = judge.Judge(boat, (sensors,), ("Xuu", "Yuv"), subproblem="horizontal", step_s=2.0)
    within = limits.Range(boat, limit, boat.xi[None], "horizontal", 2.0)
    cost = Cost(judged, within, (family,), information.d_optimality)
    best = search(cost, np.random.default_rng(1), n_judgements=10, start=np.zeros(4), mapped=run.executor.map)
    return {{"numbers": best.numbers.tolist(), "cost": best.cost}}


def draw(run, numbers): ...
def claims(numbers): yield True, ""
'''

MEMORY = '''"""Do workers keep the memory of arrays that are gone?

Claim: yes.
"""
import resource

import numpy as np


def faults(k):
    np.ones(1_000_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(50):
        np.ones(1_000_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


def compute(run): return {"faults": run.repeat("faults", faults, 2)}
def draw(run, numbers): ...
def claims(numbers): yield max(numbers["faults"]) < 10_000, "pages are asked for again"
'''


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other libraries give memory back by other rules")
def test_workers_of_this_machine_keep_memory(bayesub, tmp_path):
    """Fifty arrays of 2000 pages one after the other; Dask has its workers give back each."""
    pytest.importorskip("distributed")
    (tmp_path / "study.py").write_text(MEMORY)
    status, out, err = bayesub("run", tmp_path / "study.py", "-o", tmp_path / "run", "--dask", "local:2")
    assert (status, out.splitlines()[-1]) == (0, "CLAIM HOLDS"), out + err


def test_three_executors_give_the_same_bits(bayesub, tmp_path, monkeypatch):
    """Calibration, SQP and the search for a manoeuvre, in this process, in others and on a cluster."""
    pytest.importorskip("distributed")
    from bayesub.campaign import executors

    (tmp_path / "study.py").write_text(STUDY.format(studies=str(Path(__file__).parents[2] / "studies")))
    contents = []
    for name, executor in (("serial", executors.Serial), ("processes", lambda: executors.Processes(2)), ("dask", None)):
        if executor:
            monkeypatch.setattr(executors, "local", executor)
        words = () if executor else ("--dask", "local:2")
        status, out, err = bayesub("run", tmp_path / "study.py", "-o", tmp_path / name, *words)
        assert status == 0, err
        assert out.splitlines()[-1] == "CLAIM HOLDS"
        assert out.startswith("dashboard: http") != bool(executor)
        contents.append((tmp_path / name / "numbers.json").read_bytes())
    assert contents[0] == contents[1] == contents[2]
    assert len(json.loads(contents[0])["ranks"]) == 2
    files = [(tmp_path / name / "SQP_start_1.json").read_bytes() for name in ("serial", "processes", "dask")]
    assert files[0] == files[1] == files[2]


def test_without_dask_the_command_says_what_to_install(bayesub, tmp_path, monkeypatch):
    (tmp_path / "study.py").write_text(STUDY)
    real = builtins.__import__

    def without(name, *rest, **given):
        if name == "distributed":
            raise ImportError(name)
        return real(name, *rest, **given)

    monkeypatch.setattr(builtins, "__import__", without)
    status, _, err = bayesub("run", tmp_path / "study.py", "-o", tmp_path / "run", "--dask", "local:2")
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "install", "dask")
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs the table of sockets of Linux")
def test_a_cluster_of_this_machine_is_reached_from_it_alone_and_with_its_certificate():
    """Every socket that listens is on the loopback interface; a client without the certificate is not answered."""
    from distributed import Client

    before = _listening()
    with cluster.connect("local:2", code, lambda _: None) as executor:
        assert executor.map(len, ["abc", ""]) == [3, 0]
        opened = _listening() - before
        assert len(opened) >= 4  # scheduler, dashboard, two workers
        assert {address for address, _ in opened} == {"0100007F"}
        address = executor.client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        for scheme in ("tcp", "tls"):
            with pytest.raises((OSError, TimeoutError, TypeError)):
                Client(f"{scheme}://{address.partition('//')[2]}", timeout=1.0, set_as_default=False)


def _listening():
    """Address and port, in hexadecimal digits, of the sockets that listen on this machine."""
    lines = [
        line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
    ]
    return {tuple(line[1].split(":")) for line in lines if line[3] == "0A"}


@pytest.mark.parametrize("text", ["local", "local:0", "tcp://host", "http://host:1", "cluster.toml", "local:two"])
def test_what_is_no_cluster_is_one_line(text):
    pytest.importorskip("distributed")
    with refusals.refused("value", "--dask"), cluster.connect(text, code, print):
        pass


def test_a_scheduler_that_is_not_there_is_one_line(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "ANSWER_S", 0.3)
    refused = pytest.raises(InputError, match=r"--dask tcp://127.0.0.1:9: no scheduler answers there")
    with refused as caught, cluster.connect("tcp://127.0.0.1:9", code, print):
        pass
    assert (caught.value.kind, caught.value.key) == ("state", "--dask")  # the rest of the sentence is Dask's


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        ("worker: 3\njobqueue: {slurm: {}}", "missing", "workers"),
        ("workers: many\njobqueue: {slurm: {}}", "missing", "workers"),
        ("workers: 1\njobqueue: {slurn: {}}", "unknown", "jobqueue.slurn"),
        ("workers: 3", "missing", "jobqueue"),
        ("- 1", "format", ""),
        ("a: [1", "format", ""),
    ],
)
def test_a_wrong_file_is_one_line_with_its_key(tmp_path, text, kind, key):
    pytest.importorskip("distributed")
    (tmp_path / "c.yaml").write_text(text)
    with refusals.refused(kind, key) as error, cluster.connect(str(tmp_path / "c.yaml"), code, print):
        pass
    assert str(error.value).startswith(f"{tmp_path / 'c.yaml'}: ")


@pytest.mark.filterwarnings("ignore")
def test_jobs_of_slurm_have_what_the_file_says(tmp_path, monkeypatch):
    """The job script of dask-jobqueue, without a batch system to hand it to."""
    jobqueue = pytest.importorskip("dask_jobqueue")
    yaml = pytest.importorskip("yaml")
    asked = []
    monkeypatch.setattr(jobqueue.SLURMCluster, "adapt", lambda _, **jobs: asked.append(jobs))
    jobs, patience = cluster.configured(yaml.safe_load(SLURM), "slurm.yaml")
    script = jobs.job_script()
    jobs.close()
    assert asked == [{"minimum_jobs": 4, "maximum_jobs": 4}]
    assert patience == cluster.QUEUE_S
    for line in (
        "-p short",
        "-t 04:00:00",
        "--mem=30G",
        "-n 1",
        "--cpus-per-task=16",
        "--exclusive",
        "module load python",
    ):
        assert line in script
    assert "--nthreads 1 " in script
    assert "--nworkers 16 " in script
    (tmp_path / "slurm.yaml").write_text(SLURM.replace("job-extra-directives", "no-such-key"))
    refused = pytest.raises(InputError, match=r"SLURMCluster of dask-jobqueue does not start: .*no_such_key")
    with refused as caught, cluster.connect(str(tmp_path / "slurm.yaml"), code, print):
        pass
    assert (caught.value.kind, caught.value.key) == ("state", "jobqueue")  # the rest of the sentence is dask-jobqueue's


@pytest.mark.filterwarnings("ignore")
def test_workers_of_a_batch_system_do_a_campaign(tmp_path, monkeypatch):
    """That of dask-jobqueue for tests, whose jobs are processes of this machine."""
    pytest.importorskip("dask_jobqueue")
    monkeypatch.chdir(tmp_path)
    tests = Path(__file__).parents[1]
    monkeypatch.setenv("PYTHONPATH", f"{tests.parent}{os.pathsep}{tests}")  # where workers find package and pieces
    (tmp_path / "jobs.yaml").write_text("workers: 1\njobqueue: {local: {memory: 1GB}}\n")
    with cluster.connect("jobs.yaml", code, print) as executor:
        assert dict(executor.results(pieces.number, {"a": 1})) == {"a": pieces.number(1)}
