"""What the arguments of several commands share: paths, and completion of built-in names."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from bayesub.io import toml_files
from bayesub.io.errors import InputError, nearest


class NamingGroup(click.Group):
    """A group of commands that names the nearest for one that it does not have."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command of the first argument."""
        is_option, names = args[0].startswith("-"), self.list_commands(ctx)  # click says what is wrong with an option
        if not (ctx.resilient_parsing or is_option or args[0] in names):
            ctx.fail(f"No such command '{args[0]}'{nearest(args[0], names)}")
        return super().resolve_command(ctx, args)


PATH = click.Path(path_type=Path)


def _names(kind: str) -> Callable[..., list[CompletionItem]]:
    """Completion of a built-in name, or of a path if none begins like that: shells do not mix the two."""

    def complete(_ctx, _param, incomplete: str) -> list[CompletionItem]:
        names = [CompletionItem(name) for name in toml_files.built_in(kind) if name.startswith(incomplete)]
        return names or [CompletionItem(incomplete, type="file")]

    return complete


EQUATIONS: dict[str, Any] = {"metavar": "SET", "shell_complete": _names("equations")}
VEHICLE: dict[str, Any] = {"metavar": "VEHICLE", "shell_complete": _names("vehicles")}
MANOEUVRE: dict[str, Any] = {"metavar": "MANOEUVRE", "shell_complete": _names("manoeuvres")}
KIND: dict[str, Any] = {"metavar": "KIND", "type": click.Choice(list(toml_files.built_in("maps")))}

PLANES = click.Choice(["horizontal", "vertical", "none"])
subproblem = click.option("--subproblem", type=PLANES, help="Plane of the motion; if left out, that of the manoeuvre.")


def choice(*words: str) -> dict[str, Any]:
    """An option that is one of some words, the first if it is left out."""
    return {"type": click.Choice(words), "default": words[0], "show_default": True}


def plane(subproblem: str | None) -> dict[str, Any]:
    """The option --subproblem as an argument of the simulator; left out, the manoeuvre decides."""
    return {} if subproblem is None else {"subproblem": None if subproblem == "none" else subproblem}


def refuse_several(given: dict[str, Any], key: str = "") -> None:
    """InputError about the key, or the first, if more than one of some options is given that exclude each other."""
    names = [option for option, value in given.items() if value not in (None, False)]
    if len(names) > 1:
        raise InputError(f"{' and '.join(names)} exclude each other", "conflict", key or names[0])


def refuse_overwriting(output: Path, *inputs: Path | str | None) -> None:
    """InputError if the file that is to be written is one of those that are read."""
    if output.resolve() in {Path(one).resolve() for one in inputs if one is not None}:
        raise InputError(f"{output}: is what is read; choose another with -o", "conflict", "-o")


def _with_run(_context: click.Context, _argument: click.Parameter, given: Path | tuple[Path, ...] | None) -> Any:
    """The folders as they are; InputError for one without a run, before all is imported that takes one up."""
    from bayesub.study.run.run_folder import config_of_run

    for folder in [given] if isinstance(given, Path) else given or ():
        config_of_run(folder)
    return given


RUN: dict[str, Any] = {"type": PATH, "callback": _with_run}
page_folder = click.option(
    "-o", "--output", type=PATH, required=True, metavar="DIR", help="Folder for page, numbers and figures."
)
SEED: dict[str, Any] = {"type": click.IntRange(0), "default": 0, "show_default": True}
seed_option = click.option("--seed", **SEED, help="Of everything random.")
verbose_option = click.option("--verbose", is_flag=True, help="Every sentence of the report too.")
pdf_option = click.option("--pdf", is_flag=True, help="Draw every figure as PDF too.")
force_option = click.option("--force", is_flag=True, help="Replace what is in the folder.")


def _keeping_memory(_context: click.Context, _option: click.Parameter, cluster: str) -> str:
    """The option as it is. Workers of ``local:N`` are to keep memory that is free, which Dask has them give back."""
    if cluster.startswith("local:"):
        with contextlib.suppress(ImportError):
            import dask.config

            environ = "distributed.nanny.pre-spawn-environ.MALLOC"
            dask.config.set({f"{environ}_TRIM_THRESHOLD_": 1 << 30, f"{environ}_MMAP_THRESHOLD_": 1 << 25})
    return cluster


dask_option = click.option(
    "--dask",
    default="",
    callback=_keeping_memory,
    metavar="CLUSTER",
    help="Do independent parts on a cluster: tcp://host:port, local:N or cluster.yaml; see the page 'cluster'.",
)
_draws_option = click.option(
    "--draws",
    type=click.IntRange(40, 100_000),
    default=800,
    show_default=True,
    help="Of each distribution, to predict by; fewer of what would fill the memory.",
)


def of_predictions(command: Callable[..., None]) -> Callable[..., None]:
    """The options of a command that predicts into a folder: --draws, --seed, --pdf and --force."""
    return _draws_option(seed_option(pdf_option(force_option(command))))
