"""Files that are written whole or not at all, and the ledger of what was written."""

import csv
import resource
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.refusals import refused

from bayesub.io import atomic
from bayesub.io.atomic import LEDGER, entered, remove, replacing, write_csv, write_text
from bayesub.io.errors import printable


def test_a_link_is_replaced_and_what_it_leads_to_stays(tmp_path):
    """Also the link at the place of the partial file, which a folder from elsewhere may have."""
    (tmp_path / "precious").write_text("mine")
    for name in ("a.json", f"b.json{atomic.PARTIAL}"):
        (tmp_path / name).symlink_to(tmp_path / "precious")
    write_text(tmp_path / "a.json", "new")
    write_text(tmp_path / "b.json", "new")
    assert [(tmp_path / name).read_text() for name in ("precious", "a.json", "b.json")] == ["mine", "new", "new"]
    assert not (tmp_path / "a.json").is_symlink()


def test_what_is_no_file_is_not_replaced_by_one(tmp_path):
    (tmp_path / "device").mkdir()
    with refused("file"):
        write_text(tmp_path / "device", "new")
    assert (tmp_path / "device").is_dir()


def test_nothing_stays_of_what_could_not_be_written(tmp_path):
    (tmp_path / "old.csv").write_text("old")

    def stopped(path):
        with replacing(path) as partial:
            partial.write_text("half")
            raise OSError(28, "full")

    for name in ("old.csv", "new.csv"):
        with pytest.raises(OSError, match="full"):
            stopped(tmp_path / name)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("old.csv", "old")]


def test_the_ledger_has_what_was_written_and_removal_keeps_to_it(tmp_path):
    """Foreign files, what links lead to, and what a ledger from elsewhere names outside of the folder stay."""
    folder, outside = tmp_path / "run", tmp_path / "outside"
    for path in (folder / "inner", outside):
        path.mkdir(parents=True)
    (folder / LEDGER).touch()
    for name in ("numbers.json", "inner/a.block", "numbers.json"):
        write_text(folder / name, "x")
    assert entered(folder) == ["numbers.json", "inner/a.block"]
    (folder / "notes.md").write_text("mine")
    (outside / "a.block").write_text("mine")
    (folder / "linked").symlink_to(outside)
    with (folder / LEDGER).open("a") as ledger:
        ledger.write(f"../outside/a.block\n{outside}/a.block\nlinked/a.block\n")
    remove(folder, entered(folder))
    assert sorted(path.name for path in folder.iterdir()) == [LEDGER, "notes.md"]
    assert (outside / "a.block").read_text() == "mine"


@pytest.fixture
def full(monkeypatch):
    """full(): from now on no file of this process gets longer than 300 bytes, as on a disk that fills up.

    Python before 3.12.8 would keep the beginning of what it compiles as if it were the whole.
    """
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(
    ("command", "file"),
    [
        ("simulate auv690 turning_circle -o FILE", "s.csv"),
        ("check auv690 --card FILE", "c.png"),
        ("new vehicle mine -o FILE", "mine.toml"),
        ("export RUN -o FILE", "e.nc"),
        ("export RUN -o FILE", "e.csv"),
        ("export RUN -o FILE", "e.toml"),
    ],
)
@pytest.mark.rendered
def test_on_a_full_disk_nothing_older_is_lost_and_nothing_stays(bayesub, tmp_path, finished, full, command, file):
    """One line, status 2; NetCDF too, at which HDF5 ended in a segmentation fault."""
    path, run = tmp_path / file, finished() if "RUN" in command else ""
    if not command.startswith("new"):
        path.write_text("older")
    before = {path.name: path.read_text() for path in tmp_path.iterdir()}
    words = [{"FILE": path, "RUN": run}.get(word, word) for word in command.split()]
    full()
    status, _, error = bayesub(*words)
    assert status == 2
    assert error.startswith(f"bayesub: {path}: cannot be ")
    assert error.count("\n") == 1
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before


@given(st.lists(st.tuples(st.text(), st.floats(allow_nan=False)), min_size=1, max_size=5))
def test_a_table_is_read_as_it_was_written(rows):
    """Whatever its texts are, each row is one line, and each cell holds its text as one line."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        write_csv(path, [{"text": text, "number": number} for text, number in rows], digits=None)
        with path.open(newline="", encoding="utf-8") as file:
            _, *found = csv.reader(file)
        assert len(path.read_bytes().split(b"\n")) == len(rows) + 2
    assert [(text, float(number)) for text, number in found] == [(printable(text), number) for text, number in rows]
