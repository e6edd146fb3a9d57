"""The command line as a whole: help, completion, colours, silence."""

import os
import re
import subprocess
import sys

import click
import pytest
from click.shell_completion import BashComplete

from bayesub.cli import app
from bayesub.io.terminal import duration, pace

COLOUR = re.compile(r"\x1b\[[0-9;]*\b(3[0-8]|4[0-8]|9[0-7]|10[0-7])\b[0-9;]*m")


def commands(command=app.app, path=("bayesub",)):
    """Every command with its words."""
    yield path, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*path, name))


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
    assert completed("new", "vehicle", "x", "--from", "n") == ["npsauv"]


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
    app.app.main(["list"], prog_name="bayesub", standalone_mode=False)
    assert "\x1b" not in capsys.readouterr().out


def test_no_colour_where_it_is_not_wanted():
    assert not COLOUR.search(listed(TERM="xterm-256color", FORCE_COLOR="1", NO_COLOR="1"))


def test_the_pace_of_a_stage():
    """Three of ten in six seconds are one in two, and fourteen to go."""
    assert pace(6.0, "3 of 10 starts") == "30/min, 14 s left"
    assert pace(1.0, "500 of 1000 trials") == "500/s, 1 s left"
    assert pace(6.0, "0 of 10") == pace(6.0, "10 of 10") == pace(6.0, "auv690 horizontal") == ""
    assert [duration(s) for s in (6.6, 125, 3780)] == ["7 s", "2 min 05 s", "1 h 03 min"]
