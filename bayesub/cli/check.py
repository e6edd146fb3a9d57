"""The command `check`: what an input file is, and its card."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bayesub.cli.arguments import PATH
from bayesub.io import toml_files
from bayesub.io.terminal import say

if TYPE_CHECKING:
    from bayesub.model.vehicles import Vehicle


@click.command(epilog="Example: bayesub check studies/quickstart.toml myboat.toml --card myboat.png")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.option("--card", type=PATH, help="Draw the card of the one vehicle or study in the files into this PNG or PDF.")
@click.option("--json", "as_json", is_flag=True, help="What is found as JSON, file by file.")
def check(files: tuple[Path, ...], card: Path | None, as_json: bool) -> None:
    """Validate equations, vehicles, geometries, maps, manoeuvres, studies (TOML, Python) and logs (CSV).

    Of an equation set it prints terms, sub-problems and controls; of a vehicle a card: balance, stability, turning
    circle, answer to the planes, mass matrix, and warnings with a remedy; of a study what it costs, and what each
    channel of its data covers in time and informs; of a log which columns disagree with each other, and what mends
    them. FILE may be the name of a built-in vehicle or equation set. A log with columns of a vehicle's own comes after
    that vehicle.
    """
    from bayesub.study.before.check import draw_card, examine

    vehicles: list[Vehicle] = []
    findings, built_in = {}, toml_files.built_in("equations") | toml_files.built_in("vehicles")
    for path in files:
        text, file_card = examine(built_in.get(str(path), path), vehicles)
        if file_card is not None and hasattr(file_card, "vehicle"):
            vehicles.append(file_card.vehicle)
        findings[str(path)] = (text, file_card)
        if not as_json:
            say(f"{path}: {text}")
            for line in file_card.lines() if file_card else []:
                say(line)
    if as_json:
        contents = {path: {"found": text} | (c.to_json() if c else {}) for path, (text, c) in findings.items()}
        click.echo(json.dumps(contents, indent=2, allow_nan=False))
    if card is not None:
        draw_card([found for _, found in findings.values()], card)
