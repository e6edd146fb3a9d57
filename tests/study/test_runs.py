"""Many studies in one go: order, skipping, resuming, failures, and the page that lists them."""

import html.parser
import json
import signal

import numba
import pytest

from bayesub.cli import app
from bayesub.io.errors import InputError
from bayesub.study import runs

HOLDS = '''"""Does it hold?"""
def run(folder, *, quick, progress):
    progress.stage("counting")
    for k in range(3):
        progress.update((k + 1) / 3, f"{k + 1} of 3")
    return {"quick": quick}
'''
FAILS = '''"""Is <script>alert(1)</script> & "this" a claim?"""
def run(folder, *, quick, progress):
    assert False, "not <b>this</b> time"
'''
BREAKS = (
    '"""Is a bug a reason to stop?"""\ndef run(folder, *, quick, progress):\n    raise RuntimeError("two\\nlines")\n'
)


PROCESSES = '''"""Are the parts done in processes of their own?"""
import os
import numba
from bayesub.script import in_processes, repeated
def half(k):
    return {"half": k / 2}
def square(k):
    return k * k, os.getpid(), numba.get_num_threads()
def run(folder, *, quick, progress):
    squares, processes, threads = zip(*in_processes(square, range(6)), strict=True)
    own = os.getpid() in processes
    progress.stage("halves")
    halves = [r["half"] for r in repeated(folder / "halves.jsonl", half, 4, progress)]
    return {"squares": squares, "own": own, "threads": max(threads), "halves": halves}
'''


def run(*arguments, capsys):
    """Exit status and standard output of the command line."""
    app.console.quiet = False
    status = app.app.main(["run", *map(str, arguments)], prog_name="bayesub", standalone_mode=False)
    return status or 0, capsys.readouterr().out


@pytest.fixture
def studies(tmp_path):
    folder = tmp_path / "studies"
    folder.mkdir()
    for name, text in (("b_holds.py", HOLDS), ("c_fails.py", FAILS), ("a_breaks.py", BREAKS), ("_shared.py", "x = 1")):
        (folder / name).write_text(text)
    (folder / "d_bad.toml").write_text('vehicle = "suboff"\nsead = 3\n')
    (folder / "boat.toml").write_text('name = "a vehicle is no study"\n')
    return folder


def test_every_study_runs_in_order_and_one_that_fails_does_not_stop_the_others(studies, tmp_path, capsys):
    status, out = run(studies, "-o", tmp_path / "out", capsys=capsys)
    assert status == 1
    words = [
        "a_breaks.py",
        "FAILED",
        "b_holds.py",
        "CLAIM HOLDS",
        "c_fails.py",
        "CLAIM FAILED: not <b>",
        "d_bad.toml",
        "FAILED",
    ]
    places = [out.index(words[0])]
    for word in words[1:]:
        places.append(out.index(word, places[-1]))
    assert "RuntimeError: two\\nlines" in out
    assert "unknown key 'sead': did you mean 'seed'?" in out
    table = out[out.index("verdict ") :].splitlines()
    assert [line.split("  ")[0] for line in table[1:5]] == ["FAILED", "CLAIM HOLDS", "CLAIM FAILED", "FAILED"]
    assert json.loads((tmp_path / "out" / "b_holds" / "numbers.json").read_text()) == {"quick": False}


def test_what_is_done_is_skipped_until_it_changes(studies, tmp_path, capsys):
    """A changed study is replaced only if told so; the others are not run again."""
    for path in studies.iterdir():
        if path.name != "b_holds.py":
            path.unlink()
    out = tmp_path / "out"
    assert run(studies, "-o", out, capsys=capsys)[0] == 0
    before = (out / "b_holds" / "numbers.json").stat().st_mtime_ns
    status, said = run(studies, "-o", out, capsys=capsys)
    assert (status, "done before: CLAIM HOLDS" in said) == (0, True)
    status, said = run(studies, "-o", out, "--quick", capsys=capsys)
    assert status == 1
    assert "quick_run was False and is now True; use --force" in said
    assert (out / "b_holds" / "numbers.json").stat().st_mtime_ns == before
    assert run(studies, "-o", out, "--quick", "--force", capsys=capsys)[0] == 0
    assert json.loads((out / "b_holds" / "numbers.json").read_text()) == {"quick": True}
    assert "done before" in run(studies, "-o", out, "--quick", "--force", capsys=capsys)[1]


def test_ctrl_c_says_how_to_go_on_and_going_on_finds_what_was_done(studies, tmp_path, capsys):
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    out = tmp_path / "out"
    (studies / "c_fails.py").write_text(
        HOLDS.replace("    progress", "    import signal; signal.raise_signal(2)\n    progress", 1)
    )
    with pytest.raises(SystemExit) as stop:
        run(studies, "-o", out, capsys=capsys)
    assert stop.value.code == 130
    captured = capsys.readouterr()
    assert (
        captured.err == f"bayesub: interrupted; what is done is saved, continue with: bayesub run {studies} -o {out}\n"
    )
    assert "not finished" in runs.write_index(out).read_text()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    (out / "c_fails" / "a_part.json").write_text("{}")
    with pytest.raises(SystemExit):
        run(studies, "-o", out, capsys=capsys)
    assert "done before: CLAIM HOLDS" in capsys.readouterr().out
    assert (out / "c_fails" / "a_part.json").exists()  # resumed, not begun again


class Page(html.parser.HTMLParser):
    """Tags, links and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.text = [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for key, value in attributes if key in ("href", "src")]

    def handle_data(self, data):
        self.text += data


def test_the_index_lists_runs_and_escapes_what_studies_say(studies, tmp_path, capsys):
    """Self-contained, verdicts first, links that lead somewhere; texts of studies stay texts."""
    run(studies, "-o", tmp_path / "out", capsys=capsys)
    text = (tmp_path / "out" / "index.html").read_text()
    page = Page(text)
    assert "script" not in page.tags
    assert "b" not in page.tags
    assert '<script>alert(1)</script> & "this" a claim?' in page.text
    assert "not <b>this</b> time" in page.text
    assert "1 of 4 converged or hold" in page.text
    assert "prefers-color-scheme: dark" in text
    assert page.links
    assert all((tmp_path / "out" / link).exists() for link in page.links)


def test_verdicts_as_json(studies, tmp_path, capsys):
    status, out = run(studies, "-o", tmp_path / "out", "--json", capsys=capsys)
    assert status == 1
    assert [(o["name"], o["good"]) for o in json.loads(out)] == [
        ("a_breaks", False),
        ("b_holds", True),
        ("c_fails", False),
        ("d_bad", False),
    ]
    app.console.quiet = False


def test_parts_in_processes_of_their_own(tmp_path, capsys):
    """They come back in order; each process has one thread, however many there are."""
    (tmp_path / "parts.py").write_text(PROCESSES)
    assert run(tmp_path / "parts.py", "-o", tmp_path / "run", capsys=capsys)[0] == 0
    (tmp_path / "run/halves.jsonl").write_text('{"half": 7}\n{"half": {}')  # as a kill leaves it
    status, _ = run(tmp_path / "parts.py", "-o", tmp_path / "run", "--resume", capsys=capsys)
    numbers = json.loads((tmp_path / "run/numbers.json").read_text())
    assert status == 0
    assert numbers["squares"] == [0, 1, 4, 9, 16, 25]
    assert numbers["own"] == (numba.get_num_threads() == 1)
    assert numbers["threads"] == 1
    assert numbers["halves"] == [7, 0.5, 1.0, 1.5]


def test_a_folder_without_studies(tmp_path, capsys):
    with pytest.raises(InputError, match="holds no study"):
        run(tmp_path, capsys=capsys)


def test_two_files_of_one_name_have_two_folders(tmp_path):
    found = runs.folders([tmp_path / "x.py", tmp_path / "x.toml", tmp_path / "y.py"], tmp_path)
    assert [folder.name for folder in found.values()] == ["x.py", "x.toml", "y"]
