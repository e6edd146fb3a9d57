"""Campaigns in this process and in others: every piece once, failures listed, nothing finished lost."""

import errno
import json
import os
from functools import partial

import numpy as np
import pytest
from support import pieces, refusals

from bayesub.campaign.campaign import HOPELESS, Files, Lines, complete
from bayesub.campaign.executors import Processes, Serial

EXECUTORS = [Serial(), Processes(2)]
NAMES = ["a", "b", "c"]
NUMBERS = {str(k): k for k in range(6)}


class Reports:
    """A progress that keeps what it is told."""

    def __init__(self):
        self.updates = []

    def update(self, *report):
        self.updates.append(report)


def whole(executor, work, folder, progress=None):
    """A campaign of six pieces that are kept in a folder."""
    store = Lines(folder / "pieces.jsonl", NUMBERS)
    given = {"failures": folder / "failures.txt", "progress": progress or Reports(), "unit": "trials"}
    return complete(executor, work, NUMBERS, store, **given)


@pytest.mark.parametrize("executor", EXECUTORS, ids=["serial", "processes"])
def test_a_piece_that_fails_is_listed_and_the_others_are_kept(executor, tmp_path):
    progress = Reports()
    with refusals.refused("state", "3"):
        whole(executor, pieces.failing, tmp_path, progress)
    assert "in failing" in (tmp_path / "failures.txt").read_text()
    assert progress.updates[-1][:3] == (5, 6, "trials")
    assert "1 failed" in progress.updates[-1][3]

    marks = tmp_path / "marks"
    marks.mkdir()
    assert whole(executor, partial(pieces.counted, marks, 0.0), tmp_path) == {
        n: pieces.number(k) for n, k in NUMBERS.items()
    }
    assert [mark.name.split("-")[0] for mark in marks.iterdir()] == ["3"]
    assert not (tmp_path / "failures.txt").exists()


def test_a_campaign_without_hope_ends(tmp_path):
    """Ten failures and no result: a bug in the study, not in its data."""
    tried = []

    def work(k):
        tried.append(k)
        raise RuntimeError(f"bug {k}")

    numbers = {str(k): k for k in range(100)}
    with refusals.refused("state", "0"):
        complete(Serial(), work, numbers, Lines(tmp_path / "x.jsonl", numbers), failures=tmp_path / "x.txt")
    assert len(tried) == HOPELESS


def test_a_full_disk_is_one_line_and_loses_nothing_that_is_finished(tmp_path, bayesub, monkeypatch):
    """Of the fourth result only half is written."""
    (tmp_path / "study.py").write_text(
        f'''"""Is there room?"""
from functools import partial
from support import pieces
def compute(run):
    return {{"numbers": run.repeat("pieces", partial(pieces.counted, {str(tmp_path)!r} + "/marks", 0.0), 6)}}
def draw(run, numbers): ...
def claims(numbers): yield True, ""
'''
    )
    (tmp_path / "marks").mkdir()
    run, add = tmp_path / "run", Lines.add

    def full(store, name, result):
        if len(store.results) == 3:
            with store.file.open("a") as stream:
                stream.write('{"piece": "')
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(store.file))
        add(store, name, result)

    with monkeypatch.context() as small:
        small.setattr(Lines, "add", full)
        status, _, err = bayesub("run", tmp_path / "study.py", "-o", run)
    assert (status, err.count("\n")) == (2, 1)
    refusals.check(bayesub.error, "file")
    for mark in (tmp_path / "marks").iterdir():
        mark.unlink()
    assert bayesub("run", tmp_path / "study.py", "-o", run, "--resume")[0] == 0
    assert len(list((tmp_path / "marks").iterdir())) == 3
    assert json.loads((run / "numbers.json").read_text())["numbers"][5]["k"] == 5


@pytest.mark.parametrize("executor", EXECUTORS, ids=["serial", "processes"])
def test_a_piece_has_one_thread(executor):
    assert executor.map(pieces.threads, range(2)) == [(1, 1), (1, 1)]


def test_a_process_that_is_killed_is_one_line_and_what_is_done_is_kept(tmp_path):
    with refusals.refused("state"):
        whole(Processes(2), partial(pieces.deadly_once, tmp_path), tmp_path)
    assert len(whole(Processes(2), pieces.number, tmp_path)) == 6


def test_a_map_is_in_order_and_a_failure_ends_it():
    executor = Processes(2)
    assert [r["k"] for r in executor.map(partial(pieces.slow, 0.01), [4, 2, 9])] == [4, 2, 9]
    with refusals.refused("state", "3"):
        executor.map(pieces.failing, range(4))


def test_results_that_cannot_be_sent_back_are_failures():
    ((name, failure),) = Processes(2).results(pieces.unsendable, {"x": 0})
    assert name == "x"
    assert "pickle" in failure.cause


def kept(file):
    return [json.loads(line) for line in file.read_text().splitlines()]


def test_lines_come_in_any_order_and_are_put_into_that_of_the_pieces(tmp_path):
    """The file of a whole campaign does not show who was first."""
    store = Lines(tmp_path / "x.jsonl", NAMES)
    store.add("c", {"n": 3})
    store.add("a", {"n": 1})
    assert [line["piece"] for line in kept(store.file)] == ["c", "a"]
    again = Lines(store.file, NAMES)
    assert again.results == {"c": {"n": 3}, "a": {"n": 1}}
    again.add("b", [0.1 + 0.2])
    assert [line["piece"] for line in kept(store.file)] == NAMES
    assert Lines(store.file, NAMES).results["b"] == [0.1 + 0.2]


def test_a_line_that_is_half_written_is_left_out_and_one_that_is_there_twice_counts_once(tmp_path):
    file = tmp_path / "x.jsonl"
    file.write_text('{"piece": "b", "result": 2}\n{"piece": "b", "result": 7}\n{"piece": "c", "res')
    store = Lines(file, NAMES)
    assert store.results == {"b": 2}
    assert file.read_text() == '{"piece": "b", "result": 2}\n'


def test_what_is_no_json_is_said_and_leaves_the_file_as_it_was(tmp_path):
    store = Lines(tmp_path / "x.jsonl", NAMES)
    store.add("a", 1)
    with pytest.raises(TypeError, match="piece b must return JSON types"):
        store.add("b", {np.float64})
    assert Lines(store.file, NAMES).results == {"a": 1}


def test_a_part_with_arrays_has_them_before_it_counts_as_done(tmp_path):
    store = Files({"one": tmp_path / "stage_one_0.5"})
    store.add("one", ({"n": 2}, {"x": np.arange(2)}))
    assert Files(store.files).results == {"one": {"n": 2}}
    assert np.load(tmp_path / "stage_one_0.5.npz")["x"].tolist() == [0, 1]
    with pytest.raises(TypeError, match=r"part stage_one_0\.5 must return JSON types"):
        store.add("one", {"n": {1}})
