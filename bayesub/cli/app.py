"""The command line: commands by name, each in a module that is imported when the command is called for."""

import importlib
import os
import sys
import tempfile
import traceback
import warnings
from itertools import groupby
from pathlib import Path

import click

from bayesub.cli.arguments import NamingGroup
from bayesub.findings.verdicts import FAILED, STATUS
from bayesub.io.atomic import reason
from bayesub.io.errors import InputError, Remark, one_line
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import BAD_INPUT, INTERRUPTED, Ended, accept_all_letters, complain, console

PACKAGE = Path(__file__).parents[1]
# Command -> its group, the module and the name of its click command, and a line of help. These modules import what they
# compute with in the function of the command, so that help and completion start at once.
COMMANDS = {
    "new": ("Prepare", "prepare:new", "Write a commented file: vehicle, study, map of a log, limits .."),
    "convert": ("Prepare", "prepare:convert", "Make a log of what a vehicle wrote (ROS, MAVLink, NMEA ..)"),
    "check": ("Prepare", "before:check", "Validate any input file, and show what it holds"),
    "simulate": ("Trial", "before:simulate", "Fly a manoeuvre; write its track or the log of a trial"),
    "rank": ("Trial", "before:rank", "Show what a manoeuvre leaves open, even with perfect sensors"),
    "design": ("Trial", "before:design", "Search the manoeuvre that informs most, within limits"),
    "run": ("Infer", "run:run", "Run a study: fit, sample, judge, report"),
    "report": ("Infer", "finished:report", "Draw figures and report of a run again"),
    "predict": ("Use", "finished:predict", "Predict another manoeuvre or a log by a run"),
    "next": ("Use", "finished:next_", "Say what to measure or fly next, and what it promises"),
    "update": ("Use", "finished:update", "Fit one more log of the boat of a run"),
    "export": ("Use", "finished:export", "Write a posterior as vehicle file, draws or table"),
    "compare": ("Use", "finished:compare", "Set the posteriors of several runs side by side"),
    "manual": ("Learn", "learn:manual", "Show a page of the manual"),
    "list": ("Learn", "learn:list_", "List what is built in, and studies"),
    "bench": ("Learn", "before:bench", "Measure the simulator on this machine"),
    "completion": ("Learn", "learn:completion", "Print what completes commands in your shell"),
}


class LazyGroup(NamingGroup):
    """A group whose commands are imported by name."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """The command of a name; None if there is none."""
        if cmd_name not in COMMANDS:
            return None
        module, name = COMMANDS[cmd_name][1].split(":")
        return getattr(importlib.import_module(f"bayesub.cli.{module}"), name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """The commands group by group, a line each."""
        for group, commands in groupby(COMMANDS.items(), key=lambda item: item[1][0]):
            with formatter.section(group):
                formatter.write_dl([(f"{name:<10}", line) for name, (*_, line) in commands])


def main() -> None:
    """Run the command line; an InputError is one line on standard error and exit status 2.

    So is what the operating system refuses, an output that is full among it. Of warnings those are printed that are
    ours; those of libraries say nothing that a user could do (tests make errors of them, so that causes are mended).
    """
    accept_all_letters()
    try:
        with warnings.catch_warnings(), interruptible():
            console.quiet = False
            warnings.showwarning = _show
            status = app(prog_name="bayesub", standalone_mode=False)
            if sys.stdout is not None:
                sys.stdout.flush()
    except Ended:
        raise
    except SystemExit as error:
        text = f"code that the study brings ends Python by sys.exit({error.code!r}); let it return, or raise an error"
        complain(text, BAD_INPUT)
    except InputError as error:
        complain(str(error), BAD_INPUT)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help(), err=True)
        sys.exit(BAD_INPUT)
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        command = context.command_path if context else "bayesub"
        message = error.format_message().rstrip(".")
        complain(f"{message}{' See' if message.endswith('?') else '; see'} {command} --help", BAD_INPUT)
    except MemoryError as error:
        message = f"out of memory {f'({error})' if str(error) else ''}".strip()
        complain(one_line(f"{message}; give it more, or less to do: shorter logs, fewer trials or draws"), BAD_INPUT)
    except OSError as error:
        if error.filename is None and sys.stdout is not None:  # what is left to be written would fail again, at the end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        complain(one_line(f"{error.filename or 'output'}: cannot be read or written: {reason(error)}"), BAD_INPUT)
    except (KeyboardInterrupt, click.Abort):
        complain("interrupted before anything was done; run the same command again", INTERRUPTED)
    except Exception as error:  # a fault in the code of a study, or in ours
        complain(_fault(error), STATUS[FAILED])
    sys.exit(status)


def _fault(error: Exception) -> str:
    """Where it happened, in the code of a study if that took part, what it is, and the file of the traceback."""
    calls, others = traceback.extract_tb(error.__traceback__), (str(PACKAGE), sys.prefix, sys.base_prefix, "<")
    place = [*calls[-1:], *(call for call in calls if not call.filename.startswith(others))][-1]
    with tempfile.NamedTemporaryFile("w", prefix="bayesub_", suffix=".txt", delete=False, encoding="utf-8") as file:
        file.write("".join(traceback.format_exception(error)))
    fault = f"{type(error).__name__}: {error}; the calls that led there are in {file.name}"
    return one_line(f"{place.filename}, line {place.lineno}, in {place.name}: {fault}")


def _show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, Remark):
        print(f"bayesub: {one_line(str(message))}", file=sys.stderr)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="bayesub")
def app() -> None:
    """Say which hydrodynamic coefficients of a submarine a free-swimming trial determines, and why not the others.

    Example: bayesub run studies/quickstart.toml
    """
