"""The command line as a whole: help, completion, colours, silence."""

import io
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete
from rich.console import Console

from bayesub.cli import app
from bayesub.io import terminal
from bayesub.io.terminal import duration, pace

COLOUR = re.compile(r"\x1b\[[0-9;]*\b(3[0-8]|4[0-8]|9[0-7]|10[0-7])\b[0-9;]*m")


def commands(command=app.app, path=("bayesub",)):
    """Every command with its words."""
    yield path, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from commands(command.get_command(context, name), (*path, name))


@pytest.mark.parametrize(
    ("path", "command"), list(commands()), ids=lambda value: "-".join(value) if isinstance(value, tuple) else ""
)
def test_every_command_explains_itself_with_an_example(path, command):
    """Of its own words and options, each of which has a sentence."""
    context = click.Context(command, info_name=" ".join(path))
    text = command.get_help(context)
    example = re.search(rf"Example: ({' '.join(path)} .*)", text)
    assert example, text
    options = {name for p in command.params for name in (*p.opts, *p.secondary_opts)}
    if not getattr(command, "commands", None):
        assert {word for word in example[1].split() if word.startswith("-")} <= options
    assert all(p.help for p in command.params if isinstance(p, click.Option))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["report"], "bayesub: Missing argument 'DIR'; see bayesub report --help\n"),
        (["new", "vehicle"], "bayesub: Missing argument 'NAME'; see bayesub new vehicle --help\n"),
        (["nosuch"], "bayesub: No such command 'nosuch'; see bayesub --help\n"),
        (["rnu"], "bayesub: No such command 'rnu': did you mean 'run'? See bayesub --help\n"),
        (["new", "studdy"], "bayesub: No such command 'studdy': did you mean 'study'? See bayesub new --help\n"),
        (["run", "x", "--quik"], "bayesub: No such option '--quik'. Did you mean '--quick'? See bayesub run --help\n"),
        (["new", "study", "x"], "bayesub: a study needs --vehicle and one of --manoeuvre and --data\n"),
    ],
)
def test_an_error_of_a_command_names_its_help(bayesub, words, said):
    status, out, err = bayesub(*words)
    assert (status, out, err) == (2, "", said)


@pytest.mark.parametrize("words", [(), ("new",)])
def test_without_arguments_there_is_the_help(bayesub, words):
    status, out, err = bayesub(*words)
    assert (status, out) == (2, "")
    assert err.splitlines()[0].startswith("Usage: bayesub")
    assert "\\n" not in err


def completed(*words):
    """What bash would offer for the last of the words; the word "file" where it offers files."""
    found = BashComplete(app.app, {}, "bayesub", "_BAYESUB_COMPLETE").get_completions(list(words[:-1]), words[-1])
    return [item.value if item.type == "plain" else item.type for item in found]


def test_completion_knows_commands_options_and_what_is_built_in():
    assert completed("si") == ["simulate"]
    assert completed("simulate", "su") == ["suboff"]
    assert completed("rank", "suboff", "zig") == ["zigzag_10_10", "zigzag_20_20"]
    assert completed("simulate", "./my") == ["file"]
    assert completed("check", "") == ["file"]
    assert completed("list", "m") == ["manoeuvres"]
    assert "--quick" in completed("run", "--q")
    assert completed("new", "vehicle", "x", "--from", "s") == ["slocum_comet", "suboff"]
    assert completed("new", "vehicle", "x", "--equations", "b") == ["booth"]
    assert completed("convert", "ma") == ["matlab", "mavlink"]
    assert completed("convert", "ros", "") == ["file"]
    assert completed("new", "map", "sl") == ["slocum"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell(shell, capsys):
    app.app.main(["completion", shell], prog_name="bayesub", standalone_mode=False)
    out = capsys.readouterr().out
    assert f"_BAYESUB_COMPLETE={shell}_complete" in out


def listed(**environment):
    command = [sys.executable, "-c", "from bayesub.__main__ import main; main()", "list", "vehicles"]
    plain = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR", "TERM")}
    return subprocess.run(command, env=plain | environment, capture_output=True, text=True, check=True).stdout


def test_nothing_but_text_where_there_is_no_terminal(capsys):
    """And nothing at the ends of its lines."""
    app.app.main(["list"], prog_name="bayesub", standalone_mode=False)
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert all(line == line.rstrip() for line in out.splitlines())
    assert "\n\nVehicles\n  auv690 " in out


def test_no_colour_where_it_is_not_wanted():
    assert not COLOUR.search(listed(TERM="xterm-256color", FORCE_COLOR="1", NO_COLOR="1"))


def test_the_pace_of_a_stage():
    """Units a second or a minute, and the time that is left."""
    assert pace(0.5, 14.0) == "30/min, 14 s left"
    assert pace(12.34, 125.0) == "12.3/s, 2 min 05 s left"
    assert pace(None, None) == pace(0.0, None) == pace(3.0, 0.0) == ""
    assert [duration(s) for s in (6.6, 125, 3780)] == ["7 s", "2 min 05 s", "1 h 03 min"]


def counted(monkeypatch, width, is_terminal, least_s=0.0):
    """What a stage that counts to three of four shows."""
    text = io.StringIO()
    console = Console(file=text, force_terminal=is_terminal, width=width, color_system=None)
    monkeypatch.setattr(terminal, "console", console)
    with terminal.Bars(least_s) as bars:
        bars.stage("sample the posterior")
        for k in range(4):
            bars.update(k, 4, "steps", "R-hat 1.02")
            time.sleep(0.02)
            bars.bars.refresh()
    return text.getvalue()


@pytest.mark.parametrize("width", [80, 100, 200])
def test_bars_show_counts_pace_and_notes(monkeypatch, width):
    """On a terminal; the clock is whole in any, and what has no room is left out at the end."""
    shown = counted(monkeypatch, width, is_terminal=True)
    assert re.search(r"sample the posterior \S+ +75% 0:00:00 3 of 4 steps, [0-9.]+/s, [0-9]+ s left", shown)
    assert ("R-hat 1.02\n" in shown) == (width >= 80)


def test_a_stage_that_has_ended_is_a_line(monkeypatch):
    """Where there is no terminal too; there one that takes long has a line now and then."""
    line = r"  sample the posterior +0\.\d s  3 steps, R-hat 1\.02\n"
    assert re.fullmatch(line, counted(monkeypatch, 80, is_terminal=False))
    assert counted(monkeypatch, 80, is_terminal=False, least_s=5.0) == ""
    monkeypatch.setattr(terminal, "_SAY_S", 1e-4)
    *so_far, last = counted(monkeypatch, 80, is_terminal=False).splitlines()
    said = dict.fromkeys(text.partition("so far  ")[2] for text in so_far)
    assert [text for text in said if text] == [f"{k} of 4 steps, R-hat 1.02" for k in range(4)]
    assert re.fullmatch(line, f"{last}\n")


@pytest.mark.parametrize("least_s", [0.0, 1e9])
def test_a_stage_that_does_not_count_says_that_it_is_at_work(monkeypatch, least_s):
    """Into a file, as the search of a mode before a posterior is sampled."""
    text = io.StringIO()
    monkeypatch.setattr(terminal, "console", Console(file=text, width=80))
    monkeypatch.setattr(terminal, "_SAY_S", 0.02)
    with terminal.Bars(least_s) as bars:
        bars.stage("read run1.mcap")
        for _ in range(1000):
            if text.getvalue():
                break
            time.sleep(0.01)
    assert re.match(r"  read run1.mcap +\d+.\d s so far\n", text.getvalue())


def test_help_has_a_whole_line_for_each_command():
    """Of the groups too, within 80 columns."""
    for path, command in commands():
        if isinstance(command, click.Group):
            text = command.get_help(click.Context(command, info_name=" ".join(path), terminal_width=80))
            names = command.list_commands(click.Context(command))
            lines = [line for line in text.splitlines() if line.split()[:1] and line.split()[0] in names]
            assert len(lines) == len(names)
            assert all(len(line) <= 80 and not line.endswith("...") for line in lines)


def test_list_survives_files_that_are_no_studies(tmp_path, monkeypatch, capsys):
    """A broken one is listed with what is wrong, a table of something else is not."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "studies").mkdir()
    files = {
        "broken.toml": "vehicle = [",
        "boat.toml": 'name = "no study"',
        "good.toml": 'vehicle = "suboff"\nquestion = "Is it good?"',
        "script.py": '"""Is it a script?"""\n\n\ndef compute(run):\n    return {}\n',
        "bad.py": "def compute(:",
        "helper.py": '"""What scripts share."""',
    }
    for name, text in files.items():
        (tmp_path / "studies" / name).write_text(text)
    app.app.main(["list", "studies", "--json"], prog_name="bayesub", standalone_mode=False)
    studies = {Path(name).name: text for name, text in json.loads(capsys.readouterr().out)["studies"].items()}
    assert list(studies) == ["bad.py", "broken.toml", "good.toml", "script.py"]
    assert (studies["good.toml"], studies["script.py"]) == ("Is it good?", "Is it a script?")
    assert studies["broken.toml"].startswith("cannot be read: is not valid TOML")
    assert studies["bad.py"].startswith("cannot be read: line 1: is not valid Python")


def test_python_m_bayesub_is_the_command():
    """Also where no script is installed."""
    command = [sys.executable, "-m", "bayesub", "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.startswith("bayesub, version")
