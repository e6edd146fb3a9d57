"""The commands `list` and `completion`, of what is built in."""

import json
from pathlib import Path

import click
from click import shell_completion

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import say, say_rows

KINDS = ("equations", "vehicles", "manoeuvres", "logs", "studies")


def _kinds(_ctx, _param, incomplete: str) -> list[str]:
    return [kind for kind in KINDS if kind.startswith(incomplete)]


@click.command("list", epilog="Example: bayesub list vehicles")
@click.argument("what", default="", metavar="[equations|vehicles|manoeuvres|logs|studies]", shell_complete=_kinds)
@click.option("--json", "as_json", is_flag=True, help="Names and descriptions as JSON, kind by kind.")
def list_(what: str, as_json: bool) -> None:
    """List what is built in, the studies of the folder `studies`, and which of their runs in `figures` are current."""
    if what:
        check_known(what, KINDS, f"cannot list '{what}'", hint=f"expected {', '.join(KINDS)}")
    listings = {"equations": _equations, "logs": _logs, "studies": _studies}
    kinds = [what] if what else KINDS
    entries = {kind: listings[kind]() if kind in listings else _built_in(kind) for kind in kinds}
    if "studies" in kinds and (states := _runs()):
        entries["runs"] = states
    if as_json:
        click.echo(json.dumps(entries, indent=2))
        return
    for n, (kind, texts) in enumerate(entries.items()):
        say("\n" * (n > 0) + kind.capitalize())
        say_rows(texts.items())


def _built_in(kind: str) -> dict[str, str]:
    """Name -> description of what is built in."""
    files = toml_files.built_in(kind)
    return {name: toml_files.read_toml_table(path).get("description", "") for name, path in files.items()}


def _equations() -> dict[str, str]:
    """Name -> what each built-in equation set has, and its title."""
    from bayesub.model.equations import load_equations

    texts = {}
    for name in toml_files.built_in("equations"):
        equations = load_equations(name)
        controls = ", ".join(control.column for control in equations.controls) or "no controls"
        freedom = f"{equations.degrees_of_freedom} degrees of freedom"
        texts[name] = f"{len(equations.terms)} terms, {freedom}, {controls}: {equations.title}"
    return texts


def _logs() -> dict[str, str]:
    """Name -> title of each built-in log."""
    folders = toml_files.built_in("logs")
    return {name: toml_files.read_line(folder / "README.md").removeprefix("# ") for name, folder in folders.items()}


def _studies() -> dict[str, str]:
    """File -> question of the studies in the folder `studies`; of one that cannot be read, why not."""
    from bayesub.study.run import runs

    return {str(path): _question(path) for path in runs.study_files(Path("studies"))}


def _runs() -> dict[str, str]:
    """Folder -> ``current``, or ``stale`` and why, of the runs in the folder `figures`."""
    from bayesub.study.run import runs

    studies = {path.stem: path for path in runs.study_files(Path("studies"))}
    folders = [file.parent for file in sorted(Path("figures").glob("*/config.toml"))]
    flaws = {str(folder): "; ".join(runs.flaws(folder, studies.get(folder.name)).values()) for folder in folders}
    return {folder: f"stale: {why}" if why else "current" for folder, why in flaws.items()}


def _question(path: Path) -> str:
    from bayesub.study.run import script

    try:
        if path.suffix == ".py":
            return script.question(path)
        return str(toml_files.read_toml_table(path).get("question", ""))
    except InputError as error:
        return f"cannot be read: {str(error).removeprefix(f'{path}: ')}"


@click.command(epilog="Example: bayesub completion bash >> ~/.bashrc")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print what makes a SHELL complete commands, options, files and the names of what is built in.

    For bash and zsh append it to ~/.bashrc or ~/.zshrc, for fish write it to ~/.config/fish/completions/bayesub.fish.
    """
    make = shell_completion.get_completion_class(shell)
    assert make is not None  # the shells of the argument are those that click knows
    click.echo(make(context.find_root().command, {}, "bayesub", "_BAYESUB_COMPLETE").source())
