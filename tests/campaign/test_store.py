"""Results are kept as they come, in whatever order and after a kill."""

import json

import numpy as np
import pytest

from bayesub.campaign.store import Files, Lines

NAMES = ["a", "b", "c"]


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
        store.add("b", np.ones(2))
    assert Lines(store.file, NAMES).results == {"a": 1}


def test_a_part_with_arrays_has_them_before_it_counts_as_done(tmp_path):
    store = Files({"one": tmp_path / "stage_one_0.5"})
    store.add("one", ({"n": 2}, {"x": np.arange(2)}))
    assert Files(store.files).results == {"one": {"n": 2}}
    assert np.load(tmp_path / "stage_one_0.5.npz")["x"].tolist() == [0, 1]
    with pytest.raises(TypeError, match=r"part stage_one_0\.5 must return JSON types"):
        store.add("one", {"n": {1}})
