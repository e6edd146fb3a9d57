"""The command line: commands by name, each in a module that is imported when the command is called for."""

import importlib
import sys
import warnings

import click

from bayesub.io.errors import InputError, one_line
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import BAD_INPUT, INTERRUPTED, complain, console

# Command -> the module and the name of its click command. These modules import what their command computes with in the
# function of the command, so that help and completion start at once.
COMMANDS = {
    "list": "bayesub.cli.listing:list_",
    "new": "bayesub.cli.new:new",
    "convert": "bayesub.cli.convert:convert",
    "check": "bayesub.cli.before:check",
    "simulate": "bayesub.cli.before:simulate",
    "rank": "bayesub.cli.before:rank",
    "design": "bayesub.cli.design:design",
    "run": "bayesub.cli.run:run",
    "report": "bayesub.cli.finished:report",
    "export": "bayesub.cli.finished:export",
    "predict": "bayesub.cli.finished:predict",
    "compare": "bayesub.cli.finished:compare",
    "manual": "bayesub.cli.manual:manual",
    "bench": "bayesub.cli.before:bench",
    "completion": "bayesub.cli.listing:completion",
}


class LazyGroup(click.Group):
    """A group whose commands are imported by name."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """The command of a name; None if there is none."""
        if cmd_name not in COMMANDS:
            return None
        module, name = COMMANDS[cmd_name].split(":")
        return getattr(importlib.import_module(module), name)


def main() -> None:
    """Run the command line; an InputError is one line on standard error and exit status 2."""
    try:
        with warnings.catch_warnings(), interruptible():
            console.quiet = False
            warnings.showwarning = lambda message, *_: print(f"bayesub: {one_line(str(message))}", file=sys.stderr)
            sys.exit(app(prog_name="bayesub", standalone_mode=False))
    except InputError as error:
        complain(str(error), BAD_INPUT)
    except click.ClickException as error:
        complain(f"{error.format_message()}; see bayesub --help", BAD_INPUT)
    except (KeyboardInterrupt, click.Abort):
        complain("interrupted before anything was done; run the same command again", INTERRUPTED)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="bayesub")
def app() -> None:
    """Say which hydrodynamic coefficients of a submarine a free-swimming trial determines, and why not the others.

    Example: bayesub run studies/quickstart.toml
    """
