"""kill -9 at random moments of a run, a prediction, a design and a campaign: the next life ends as if nothing had been.

BAYESUB_KILLS=40 pytest -m slow -s tests/study/run/test_kills.py kills forty times each.
"""

import json
import multiprocessing
import os
import re
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support import killed

from bayesub.io.atomic import LEDGER

KILLS = int(os.environ.get("BAYESUB_KILLS", "2"))
COSTS = re.compile(
    "seconds|price|_per_|evaluations|jacobians|simulations|begun|commit|folder|path|time taken|files_sha256"
)


def content(folder: Path) -> dict[str, object]:
    """What is in a folder, by place, without what it took; of pages and of blocks of a chain that they are there."""
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    return {name: _found(path) for name, path in files.items() if path.suffix != ".block" and name != "pace.json"}


def _found(path):
    if path.suffix == ".json":
        return _without_costs(json.loads(path.read_text()))
    if path.suffix == ".nc":
        import h5py

        found = {}

        def add(name, one):
            if isinstance(one, h5py.Dataset) and one.dtype.kind in "fiu":
                found[name] = one[()].tobytes()

        with h5py.File(path) as file:
            file.visititems(add)
        return found
    if path.suffix in (".html", ".md"):
        return len(path.read_bytes()) > 1000
    lines = [line for line in path.read_bytes().splitlines() if not line.startswith((b"begun", b"commit"))]
    return {line for line in lines if not line.endswith((b".block", b"pace.json"))} if path.name == LEDGER else lines


def _without_costs(value):
    if isinstance(value, dict):
        return {key: _without_costs(one) for key, one in value.items() if not re.search(COSTS, key)}
    return [_without_costs(one) for one in value] if isinstance(value, list) else value


def kept(folder: Path) -> dict[str, object]:
    """Pieces of work that were saved, by name: lines of a campaign and of a search, and blocks of a chain."""
    lines = [path.read_bytes() for path in (folder / "campaign.jsonl", *folder.glob("costs/*.txt")) if path.exists()]
    whole = [line for text in lines for line in text[: text.rfind(b"\n") + 1].splitlines()]
    blocks = {path.name: path.read_bytes() for path in folder.glob("chain/*.block")}
    return dict.fromkeys(whole) | blocks


@pytest.fixture(scope="module")
def server():
    """A process that has loaded and compiled all, of which every life is a copy."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["support.killed"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BAYESUB_WARM", "1")
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))  # which it does not take over otherwise
        first = context.Process(target=os.getpid)
        first.start()
        first.join()
    return context


@pytest.mark.slow
@pytest.mark.parametrize("kind", killed.KINDS)
def test_kill_9_at_a_random_moment_changes_nothing(kind, server, tmp_path):
    """The same files and numbers, nothing that was saved is lost, and nothing half written stays."""

    def live(work, *folders, seconds=None):
        process = server.Process(target=work, args=(tmp_path, *folders))
        began = time.perf_counter()
        process.start()
        process.join(seconds)
        took, ended = time.perf_counter() - began, process.exitcode
        process.kill()
        process.join()
        assert ended in (None, 0)
        return took

    live(killed.make)
    took = live(killed.KINDS[kind], tmp_path / "whole")
    expected, rng, n_at_work = content(tmp_path / "whole"), np.random.default_rng([690, KILLS]), 0
    for k in range(KILLS):
        folder = tmp_path / f"cut_{k}"
        live(killed.KINDS[kind], folder, seconds=rng.uniform(0.0, took))
        before = kept(folder)
        n_at_work += bool(before)
        live(killed.KINDS[kind], folder)
        found = content(folder)
        assert sorted(found) == sorted(expected)  # no file that ends in .partial either
        assert [name for name in found if found[name] != expected[name]] == []
        assert not before.keys() - kept(folder).keys()
    print(f"{kind}: {KILLS} kills within {took:.2f} s, {n_at_work} of them after work was saved")
