"""Many studies in one go: order, skipping, resuming, failures, and the page that lists them."""

import json
import re
import shutil
import signal
import tomllib
from pathlib import Path

import numba
import pytest
import tomli_w
from support.pages import Page
from support.refusals import refused

import bayesub as bs
from bayesub.cli import app
from bayesub.findings.verdicts import STATUS
from bayesub.io.atomic import write_text
from bayesub.io.terminal import SILENT
from bayesub.study import provenance, sources
from bayesub.study.after.finished_run import redraw
from bayesub.study.run import runs
from bayesub.study.run.result import load_result
from bayesub.study.run.run_folder import open_folder
from bayesub.study.run.script import FUNCTIONS, Script

HOLDS = '''"""Does it hold?"""
def compute(run):
    run.progress.stage("counting")
    for k in range(3):
        run.progress.update(k + 1, 3, "steps")
    return {"quick": run.quick}
def draw(run, numbers):
    run.page([f"quick: {numbers['quick']}"])
def claims(numbers):
    yield True, "it does"
'''
FAILS = '''"""Is <script>alert(1)</script> & "this" a claim?"""
def compute(run):
    return {"answer": 42}
def draw(run, numbers):
    run.page(["drawn"])
def claims(numbers):
    yield numbers["answer"] == 42, "said of nothing"
    yield numbers["answer"] == 43, "not <b>this</b> time"
'''
DRAWS = '''"""Is it drawn?"""
FIGURES = {"first": "What is first."}
ANSWER = "It is {off_m; max; .1f} m."
def compute(run):
    run.save_arrays("arrays", x=[1.0])
    return {"off_m": [2.0, 3.5]}
def draw(run, numbers):
    run.page(["a table"])
    for name in ("first", "second"):
        for path in run.figure(name):
            path.write_bytes(b"")
        run.load_arrays("arrays")
def claims(numbers): yield True, ""
'''
BREAKS = '''"""Is a bug a reason to stop?"""
def compute(run):
    assert False, "two\\nlines"
def draw(run, numbers): ...
def claims(numbers): ...
'''
PROCESSES = '''"""Are the parts done in processes of their own?"""
import os
import numba
def half(k):
    return {"half": k / 2}
def square(k):
    return k * k, os.getpid(), numba.get_num_threads()
def compute(run):
    squares, processes, threads = zip(*run.in_processes(square, range(6)), strict=True)
    run.progress.stage("halves")
    halves = [r["half"] for r in run.repeat("halves", half, 4)]
    return {"squares": squares, "here": os.getpid() in processes, "threads": max(threads), "halves": halves}
def draw(run, numbers): ...
def claims(numbers): yield True, ""
'''


def run(*arguments, capsys):
    """Exit status and standard output of the command line."""
    app.console.quiet = False
    status = app.app.main(["run", *map(str, arguments)], prog_name="bayesub", standalone_mode=False)
    return status or 0, capsys.readouterr().out


def report(*arguments, capsys):
    """As `run`, of the command `report`, which may run the script."""
    status = app.app.main(["report", "--run-code", *map(str, arguments)], prog_name="bayesub", standalone_mode=False)
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
    assert "AssertionError: two\\nlines" in out
    kept = tmp_path / "out" / "a_breaks" / "traceback.txt"
    assert f"see {kept}" in out
    assert 'assert False, "two' in kept.read_text()
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
    status, out_text = run(studies, "-o", out, capsys=capsys)
    assert (status, "done before: CLAIM HOLDS" in out_text) == (0, True)
    status, out_text = run(studies, "-o", out, "--quick", capsys=capsys)
    assert status == 1
    assert "holds the full version, not the small version (--quick); use --force to replace it" in out_text
    assert (out / "b_holds" / "numbers.json").stat().st_mtime_ns == before
    assert run(studies, "-o", out, "--quick", "--force", capsys=capsys)[0] == 0
    assert json.loads((out / "b_holds" / "numbers.json").read_text()) == {"quick": True}
    assert "done before" in run(studies, "-o", out, "--quick", "--force", capsys=capsys)[1]


def test_ctrl_c_says_how_to_go_on_and_going_on_finds_what_was_done(studies, tmp_path, capsys):
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    out = tmp_path / "out"
    (studies / "c_fails.py").write_text(
        HOLDS.replace("    run.progress", "    import signal; signal.raise_signal(2)\n    run.progress", 1)
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


def links(page):
    """What a page refers to; an empty icon keeps a browser from asking for one."""
    found = [attributes.get(key) for _, attributes in page.elements for key in ("href", "src")]
    return [link for link in found if link not in (None, "data:,")]


def test_the_index_lists_runs_and_escapes_what_studies_say(studies, tmp_path, capsys):
    """Self-contained, verdicts first, links that lead somewhere; texts of studies stay texts."""
    run(studies, "-o", tmp_path / "out", capsys=capsys)
    text = (tmp_path / "out" / "index.html").read_text()
    page = Page(text)
    assert not page.all("script")
    assert not page.all("b")
    assert '<script>alert(1)</script> & "this" a claim?' in page.text
    assert "not <b>this</b> time" in page.text
    assert "1 of 4 converged and fit" in page.text
    assert "prefers-color-scheme: dark" in text
    assert links(page)
    assert all((tmp_path / "out" / link).exists() for link in links(page))


def test_a_study_is_shown_by_what_was_found(tmp_path):
    """Not by the orders, which come first on its page, nor by a picture that is missing."""
    (tmp_path / "report.md").write_text("![a](orders.png)\n![b](missing.png)\n![c](coefficients.png)\n")
    for name in ("orders.png", "coefficients.png"):
        (tmp_path / name).touch()
    assert runs.entry(tmp_path).picture == f"{tmp_path.name}/coefficients.png"


def test_the_index_shows_the_first_picture_of_a_page(studies, tmp_path):
    """And links the page; arrays that are missing leave the pictures that are there, and the page is written anew."""
    (studies / "b_holds.py").write_text(DRAWS)
    folder = tmp_path / "out" / "b_holds"
    bs.run(studies / "b_holds.py", folder)
    page = Page(runs.write_index(tmp_path / "out").read_text())
    assert set(links(page)) == {"b_holds/b_holds.md", "b_holds/first.png"}
    (folder / "arrays.npz").unlink()
    (folder / "b_holds.md").unlink()
    with refused("state", "arrays.npz"):
        redraw(folder, run_code=True)
    text = (folder / "b_holds.md").read_text()
    for words in (
        "*first.* What is first.",
        "*second.* Second.",
        "a table",
        "**Answer.** It is 3.5 m.",
        "The claim holds",
    ):
        assert words in text


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


def test_all_failing_claims_are_listed_and_the_gravest_verdict_is_the_status(studies, tmp_path, capsys):
    """Each in a line and on the page; a study that failed for a bug can be run again in its folder."""
    (studies / "c_fails.py").write_text(FAILS + '    yield False, "nor that"\n')
    broken = studies / "a_breaks.py"
    status, out = run(studies / "c_fails.py", "-o", tmp_path / "run", capsys=capsys)
    assert status == STATUS["claim failed"]
    assert out.splitlines()[-1] == "CLAIM FAILED: 2 of 3, listed above"
    assert {"claim failed: not <b>this</b> time", "claim failed: nor that"} <= set(out.splitlines())
    assert "not &lt;b>this&lt;/b> time; nor that." in (tmp_path / "run/c_fails.md").read_text()
    (studies / "d_bad.toml").unlink()
    assert run(studies, "-o", tmp_path / "out", capsys=capsys)[0] == STATUS["failed"]
    broken.write_text(HOLDS)
    assert run(studies, "-o", tmp_path / "out", capsys=capsys)[0] == STATUS["claim failed"]
    assert not (tmp_path / "out" / "a_breaks" / "traceback.txt").exists()
    assert load_result(tmp_path / "out" / "a_breaks").status == 0


def test_parts_in_processes_of_their_own(tmp_path, capsys):
    """They come back in order; each process has one thread, however many there are."""
    (tmp_path / "parts.py").write_text(PROCESSES)
    assert run(tmp_path / "parts.py", "-o", tmp_path / "run", capsys=capsys)[0] == 0
    kept = '{"piece": "0", "result": {"half": 7}}\n{"piece": "1", "result": {"half": {'  # as a kill leaves it
    (tmp_path / "run/halves.jsonl").write_text(kept)
    status, _ = run(tmp_path / "parts.py", "-o", tmp_path / "run", "--resume", capsys=capsys)
    numbers = json.loads((tmp_path / "run/numbers.json").read_text())
    assert status == 0
    assert numbers["squares"] == [0, 1, 4, 9, 16, 25]
    assert numbers["here"] == (numba.get_num_threads() == 1)
    assert numbers["threads"] == 1
    assert numbers["halves"] == [7, 0.5, 1.0, 1.5]


def test_a_folder_without_studies(tmp_path, capsys):
    with refused("missing"):
        run(tmp_path, capsys=capsys)


def test_two_files_of_one_name_have_two_folders(tmp_path):
    folders = runs.folders([tmp_path / "x.py", tmp_path / "x.toml", tmp_path / "y.py"], tmp_path)
    assert [folder.name for folder in folders.values()] == ["x.py", "x.toml", "y"]


def test_a_failed_claim_leaves_numbers_and_figures(studies, tmp_path, capsys):
    """The claim is judged last; a bug is none."""
    status, out = run(studies / "c_fails.py", "-o", tmp_path / "run", capsys=capsys)
    assert (status, out.splitlines()[-1]) == (STATUS["claim failed"], "CLAIM FAILED: not <b>this</b> time")
    assert json.loads((tmp_path / "run/numbers.json").read_text()) == {"answer": 42}
    page = (tmp_path / "run/c_fails.md").read_text()
    assert "\n\ndrawn\n" in page
    assert "**Verdict.** The claim fails: not &lt;b>this&lt;/b> time." in page
    with pytest.raises(AssertionError, match="two"):
        run(studies / "a_breaks.py", "-o", tmp_path / "other", capsys=capsys)
    assert not (tmp_path / "other/outcome.json").exists()


def test_a_script_lacks_a_function(studies):
    """It is said before anything runs."""
    (studies / "b_holds.py").write_text('"""Question?"""\ndef run(folder): ...\n')
    with refused("missing", "compute, draw, claims"):
        bs.run(studies / "b_holds.py", studies / "run")
    assert not (studies / "run").exists()


@pytest.fixture
def only(studies):
    """The folder of studies with the one that holds."""
    for path in studies.iterdir():
        if path.name != "b_holds.py":
            path.unlink()
    return studies


def test_what_is_stale_runs_again_and_says_why(only, tmp_path, capsys, monkeypatch):
    """After a change of the sources or of the study; --keep-stale leaves it."""
    out = tmp_path / "out"
    run(only, "-o", out, capsys=capsys)
    write_text(out / "b_holds" / "mark", "")  # one of ours, which goes with its run
    with monkeypatch.context() as changed:
        changed.setattr(sources, "digest", lambda _: "other")
        _, text = run(only, "-o", out, "--keep-stale", capsys=capsys)
        assert "left as it is, though stale (the sources of bayesub have changed since): CLAIM HOLDS" in text
        assert (out / "b_holds" / "mark").exists()
        _, text = run(only, "-o", out, capsys=capsys)
        assert "stale, run again: the sources of bayesub have changed since" in text
        assert not (out / "b_holds" / "mark").exists()
        assert "done before" in run(only, "-o", out, capsys=capsys)[1]
    (only / "b_holds.py").write_text(HOLDS.replace("it does", "it does so"))
    run(only, "-o", out, capsys=capsys)
    (only / "b_holds.py").write_text(HOLDS)
    assert "stale, run again: the script has changed since" in run(only, "-o", out, capsys=capsys)[1]


def test_a_run_of_other_versions_or_without_digest_is_stale(only, tmp_path, capsys):
    """Alone it is refused with what to do; resumed with --keep-stale it stays stale."""
    folder = tmp_path / "run"
    run(only / "b_holds.py", "-o", folder, capsys=capsys)
    config = folder / "config.toml"
    text = config.read_text()
    config.write_text(re.sub(r'numpy = ".*"', 'numpy = "1.0"', text))
    with refused("state"):
        run(only / "b_holds.py", "-o", folder, capsys=capsys)
    config.write_text(re.sub(r"sources_sha256 = .*\n", "", text))
    with refused("state", "--keep-stale"):
        run(only / "b_holds.py", "-o", folder, "--resume", capsys=capsys)
    assert run(only / "b_holds.py", "-o", folder, "--resume", "--keep-stale", capsys=capsys)[0] == 0
    assert "sources_sha256" not in config.read_text()
    assert run(only / "b_holds.py", "-o", folder, "--force", capsys=capsys)[0] == 0
    assert "sources_sha256" in config.read_text()


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A copy of the package, of which the digests are taken."""
    folder = tmp_path / "bayesub"
    shutil.copytree(Path(bs.__file__).parent, folder, ignore=shutil.ignore_patterns("__pycache__", "manual"))
    monkeypatch.setattr(sources, "_ROOT", folder)
    monkeypatch.setattr(sources.compiled_files, "save", lambda *_: None)
    kept = sources._package, sources._built_in
    for function in kept:
        function.cache_clear()
    yield folder
    for function in kept:
        function.cache_clear()


def rooms_of_all():
    """Rooms of a study of suboff, of one of the built-in log, of a script that simulates, and of all that computes."""
    roots = ["bayesub.study.run.infer", "bayesub.study.run.prepare"]
    boat, log = (sources.rooms(roots, [text]) for text in ('vehicle = "suboff"', 'data = "slocum_comet"'))
    script = sources.rooms(["bayesub.simulate", "bayesub.study.run.script"])
    return {"boat": boat, "log": log, "script": script, "workers": sources.rooms([sources.EVERYTHING])}


def changed(before, now):
    """Who is stale, by which rooms."""
    return {
        name: {room for room in rooms | now[name] if rooms.get(room) != now[name].get(room)}
        for name, rooms in before.items()
        if rooms != now[name]
    }


def edit(file, old, new):
    """Replace a text that is in a file once at least."""
    text = file.read_text(encoding="utf-8")
    assert old in text, file
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_sentences_and_pages_make_no_run_stale(package):
    """A docstring, a comment, layout, ends of lines, a sentence of a page, a template, a style, a command, a list of
    files, what type checkers read, and a comment in a file of data."""
    before = rooms_of_all()
    edit(package / "kernels" / "mass.py", '"""', '"""Said otherwise. ')
    edit(package / "kernels" / "integrate.py", "\nimport ", "\n# a comment\n\n\nimport ")
    (package / "__init__.py").write_bytes((package / "__init__.py").read_bytes().replace(b"\n", b"\r\n"))
    edit(package / "report" / "report.py", '"report.html"', '"other.html"')
    for name in ("report/report.html", "report/style.css", "report/widgets.js", "data/vehicles/suboff.toml"):
        (package / name).write_text((package / name).read_text(encoding="utf-8") + "\n# other\n", encoding="utf-8")
    (package / "cli" / "app.py").write_text("other = 1")
    edit(package / "study" / "run" / "run.py", "if TYPE_CHECKING:", "if TYPE_CHECKING:\n    import other")
    (package / "data" / "vehicles" / "README.md").write_text("other")
    sources._package.cache_clear()
    sources._built_in.cache_clear()
    assert rooms_of_all() == before


EVERY = {"boat", "log", "script", "workers"}
CHANGES = {  # what is changed -> file, text there, other text, room, who is stale
    "a kernel": ("kernels/mass.py", "= m * z", "= m * y", "kernels", EVERY),
    "a table of regressors": ("model/equations/regressors.py", '"p', '"q', "model", EVERY),
    "a prior": ("problem/priors.py", "4.0 **", "5.0 **", "problem", EVERY - {"script"}),
    "draws of the sampler": ("inference/sampling/sampler.py", "20_000", "10_000", "inference", EVERY - {"script"}),
    "draws of predictions": (
        "inference/checks/prediction.py",
        "N_DRAWS = ",
        "N_DRAWS = 1 + ",
        "inference",
        EVERY - {"script"},
    ),
    "numbers for pages": ("findings/run_numbers.py", "100.0", "1000.0", "findings", EVERY - {"script"}),
    "how numbers are kept": ("study/run/script.py", "plain, 9", "plain, 8", "study", {"script", "workers"}),
    "a boat": (
        "data/vehicles/suboff.toml",
        "mass_kg = ",
        "mass_kg = 1",
        "data/vehicles",
        {"boat", "script", "workers"},
    ),
    "another boat": ("data/vehicles/auv690.toml", "mass_kg = ", "mass_kg = 1", "data/vehicles", {"script", "workers"}),
    "an equation set": ("data/equations/glider.toml", 'title = "', 'title = "A ', "data/equations", EVERY - {"boat"}),
    "a log": ("data/logs/slocum_comet/log.csv.gz", None, None, "data/logs", EVERY - {"boat"}),
}


def test_what_computes_makes_runs_stale(package):
    """Of those who use it, wherever in their imports it is, and the room is named."""
    before = rooms_of_all()
    for what, (name, old, new, room, who) in CHANGES.items():
        if old is None:
            (package / name).write_bytes((package / name).read_bytes() + b"\0")
        else:
            edit(package / name, old, new)
        (sources._built_in if name.startswith("data") else sources._package).cache_clear()
        now = rooms_of_all()
        assert changed(before, now) == {key: {room} for key in who}, what
        before = now


def test_list_says_which_runs_are_current_and_why_others_are_not(only, tmp_path, capsys, monkeypatch):
    """By sources, versions, commit and study; also of a run whose study is not there, or that has no record."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(provenance, "_git", lambda *_: "false")
    bs.run(only / "b_holds.py", Path("figures/b_holds"))
    saved = tomllib.loads(Path("figures/b_holds/config.toml").read_text())
    saved["commit"] = "c0ffee"

    def listed(name="b_holds", **changes):
        Path("figures", name).mkdir(exist_ok=True)
        Path("figures", name, "config.toml").write_text(tomli_w.dumps(saved | changes))
        app.app.main(["list", "studies", "--json"], prog_name="bayesub", standalone_mode=False)
        return json.loads(capsys.readouterr().out)["runs"][f"figures/{name}"]

    assert listed() == "current"
    other = {"sources_sha256": "other", "sources": saved["sources"] | {"kernels": "other", "problem": "other"}}
    assert listed(**other) == "stale: the sources of bayesub have changed since (kernels, problem)"
    numpy = saved["versions"]["numpy"]
    other = {"versions": saved["versions"] | {"numpy": "1.0"}, "commit": "c0ffee-dirty"}
    why = f"versions.numpy was '1.0' and is now '{numpy}'; made of changes that were not committed (c0ffee-dirty)"
    assert listed(**other) == f"stale: {why}"
    assert listed(commit="unknown") == "stale: made of no commit that is known"
    assert listed(script_sha256="other") == "stale: the script has changed since"
    assert listed("gone") == "stale: its study is not there"
    saved.pop("sources")
    old = listed(sources_sha256="other", script_sha256="other")
    assert old == "stale: the sources that made it were not recorded room by room"


def test_a_commit_that_is_gone_is_a_flaw(monkeypatch):
    """Where there is a repository with its history, and it lacks it."""
    answers = {"rev-parse": "false", "cat-file": ""}
    monkeypatch.setattr(provenance, "_git", lambda *given: answers[given[0]])
    assert provenance.commit_flaw("c0ffee") == "commit c0ffee is not in the repository"
    for reply in ("true", ""):
        answers["rev-parse"] = reply
        assert provenance.commit_flaw("c0ffee") == provenance.commit_flaw("unknown") == ""


def test_seconds_add_up_over_sessions(only, tmp_path, capsys):
    """Those of the sessions before count, also after one that was killed."""
    folder = tmp_path / "run"
    run(only / "b_holds.py", "-o", folder, capsys=capsys)
    first = json.loads((folder / "outcome.json").read_text())["seconds"]
    (folder / "seconds.json").write_text('{"seconds": 100.0}')
    (folder / "outcome.json").unlink()
    run(only / "b_holds.py", "-o", folder, "--resume", capsys=capsys)
    assert 100.0 < json.loads((folder / "outcome.json").read_text())["seconds"] < 100.0 + 100.0 * max(first, 0.1)


def test_a_run_is_drawn_again_by_its_script(studies, tmp_path, capsys):
    """From a copy of its folder, while the script is where it was; one that has changed or gone has to be named."""
    bs.run(studies / "c_fails.py", tmp_path / "run")
    folder = tmp_path / "elsewhere" / "copy"
    shutil.copytree(tmp_path / "run", folder)
    (folder / "c_fails.md").unlink()
    status, out = report(folder, capsys=capsys)
    assert (status, out.splitlines()[-1]) == (STATUS["claim failed"], "CLAIM FAILED: not <b>this</b> time")
    assert (folder / "c_fails.md").exists()
    script = studies / "c_fails.py"
    script.write_text(script.read_text().replace("== 43", "== 42"))
    with refused("state", "--study"):
        report(folder, capsys=capsys)
    script.rename(tmp_path / "mine.py")
    with refused("missing", "--study"):
        report(folder, capsys=capsys)
    assert report(folder, "--study", tmp_path / "mine.py", capsys=capsys)[0] == 0


def test_a_result_is_what_a_run_returns_and_keeps(studies, tmp_path):
    """The same object, from memory and from the folder."""
    result = bs.run(studies / "b_holds.py", tmp_path / "run", progress=SILENT)
    assert (result.verdict, result.good, result.name, result.question) == (
        "claim holds",
        True,
        "b_holds",
        "Does it hold?",
    )
    assert load_result(tmp_path / "run") == result
    assert result.seconds > 0.0


@pytest.mark.parametrize("study", [None, "mine.py"])
def test_a_folder_from_elsewhere_runs_no_code_unless_that_is_said(tmp_path, bayesub, study):
    """It names the script, and its digest is right, since whoever makes the folder makes both."""
    code = '"""Is it?"""\nfrom pathlib import Path\nPath("ran").touch()\n' + "".join(
        f"def {name}(*_): ...\n" for name in FUNCTIONS
    )
    path = tmp_path / "gift.py"
    path.write_text(
        code.replace('"ran"', repr(str(tmp_path / "ran"))).replace(
            "def claims(*_): ...", "def claims(_): yield True, ''"
        )
    )
    folder = tmp_path / "gift"
    with open_folder(folder, Script(path).config()):
        write_text(folder / "numbers.json", "{}")
    for _ in range(2):
        status, _, error = bayesub("report", folder)
        assert (status, error.count("\n")) == (2, 1)
        assert str(path) in error
        assert "--run-code" in error
        assert not (tmp_path / "ran").exists()
    told = ("--run-code",) if study is None else ("--study", path)
    assert bayesub("report", folder, *told)[0] == 0
    assert (tmp_path / "ran").exists()
