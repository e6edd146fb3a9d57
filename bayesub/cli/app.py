"""The command line."""

import json
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path

import click
import numpy as np
from click import shell_completion
from click.shell_completion import CompletionItem
from rich.table import Table

from bayesub import identifiability
from bayesub.cli.check import checked, lines
from bayesub.cli.run import Options, run_many, run_one, verdict_of
from bayesub.cli.run import report as report_run
from bayesub.io import toml_files
from bayesub.io.errors import InputError, nearest
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import BAD_INPUT, FAILED, INTERRUPTED, complain, console
from bayesub.model import coefficients
from bayesub.model.hulls import load_hull
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvre_files import read_manoeuvre
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate as simulate_trial
from bayesub.model.vehicles import VehicleFile, load_vehicle
from bayesub.problem import priors
from bayesub.report.data_card import DataCard
from bayesub.sensors import observe
from bayesub.study import new_vehicle, script, study
from bayesub.study.new_study import of_log, simulated
from bayesub.study.runs import Outcome
from bayesub.study.trial_section import read_instruments
from bayesub.thesis import page as thesis_page

PATH = click.Path(path_type=Path)
KINDS = ("vehicles", "manoeuvres", "studies")


def _built_in(kind: str):
    """Completion of a built-in name, or of a path if none begins like that: shells do not mix the two."""

    def complete(_ctx, _param, incomplete: str) -> list[CompletionItem]:
        names = [CompletionItem(name) for name in toml_files.built_in(kind) if name.startswith(incomplete)]
        return names or [CompletionItem(incomplete, type="file")]

    return complete


def _kinds(_ctx, _param, incomplete: str) -> list[str]:
    return [kind for kind in KINDS if kind.startswith(incomplete)]


VEHICLE = {"metavar": "VEHICLE", "shell_complete": _built_in("vehicles")}
MANOEUVRE = {"metavar": "MANOEUVRE", "shell_complete": _built_in("manoeuvres")}


def main() -> None:
    """Run the command line; an InputError is one line on standard error and exit status 2."""
    try:
        with warnings.catch_warnings(), interruptible():
            console.quiet = False
            warnings.showwarning = lambda message, *_: print(f"bayesub: {message}", file=sys.stderr)
            sys.exit(app(prog_name="bayesub", standalone_mode=False))
    except InputError as error:
        complain(str(error), BAD_INPUT)
    except click.ClickException as error:
        complain(f"{error.format_message()}; see bayesub --help", BAD_INPUT)
    except (KeyboardInterrupt, click.Abort):
        complain("interrupted before anything was done; run the same command again", INTERRUPTED)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="bayesub")
def app() -> None:
    """Say which hydrodynamic coefficients of a submarine a free-swimming trial determines, and why not the others.

    Example: bayesub run studies/quickstart.toml
    """


@app.command("list", epilog="Example: bayesub list vehicles")
@click.argument("what", default="", metavar="[vehicles|manoeuvres|studies]", shell_complete=_kinds)
@click.option("--json", "as_json", is_flag=True, help="Names and descriptions as JSON, kind by kind.")
def list_(what: str, as_json: bool) -> None:
    """List what is built in, and the studies of the folder `studies`."""
    if what and what not in KINDS:
        raise InputError(f"cannot list '{what}'{nearest(what, KINDS)}; expected {', '.join(KINDS)}")
    kinds = [what] if what else KINDS
    if as_json:
        click.echo(json.dumps({kind: dict(_entries(kind)) for kind in kinds}, indent=2))
        return
    for kind in kinds:
        table = Table(title=kind.capitalize(), title_justify="left", show_header=False, box=None, pad_edge=False)
        for name, text in _entries(kind):
            table.add_row(name, text)
        console.print(table)


def _entries(kind: str) -> list[tuple[str, str]]:
    if kind == "studies":
        paths = sorted(path for path in Path("studies").glob("*") if path.suffix in (".toml", ".py"))
        return [(str(p), script.question(p) if p.suffix == ".py" else study.load_study(p).question) for p in paths]
    read = read_manoeuvre if kind == "manoeuvres" else partial(toml_files.read_toml, model=VehicleFile)
    return [(name, read(path).description) for name, path in toml_files.built_in(kind).items()]


@app.group()
def new() -> None:
    """Write a commented template: a vehicle of your own, the geometry of its hull, or a study.

    Example: bayesub new vehicle myboat
    """


@new.command(epilog="Example: bayesub new vehicle myboat --geometry myboat_hull.toml")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME.toml if left out.")
@click.option(
    "--from",
    "source",
    **VEHICLE,
    help="Start from a copy of this vehicle (built-in name or TOML).",
)
@click.option("--geometry", type=PATH, metavar="HULL", help="Estimate added masses from this geometry file.")
def vehicle(name: str, output: Path | None, source: str | None, geometry: Path | None) -> None:
    """Write a vehicle file with every key and all 101 coefficients; what is unknown is zero.

    With a geometry, added masses and what follows from them are estimated, each with its uncertainty and source.
    """
    if source and geometry:
        raise InputError("--from and --geometry exclude each other")
    text = new_vehicle.copied(name, source) if source else new_vehicle.vehicle(name, geometry and load_hull(geometry))
    _written(output or Path(f"{name}.toml"), text, "bayesub check says what it lacks")


@new.command("geometry", epilog="Example: bayesub new geometry myboat -o myboat_hull.toml")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME_hull.toml if left out.")
def new_geometry(name: str, output: Path | None) -> None:
    """Write a hull geometry file, to be filled in and given to `bayesub new vehicle --geometry`."""
    path = output or Path(f"{name}_hull.toml")
    _written(path, new_vehicle.geometry(name), f"fill it in, then bayesub new vehicle {name} --geometry {path}")


@new.command("study", epilog="Example: bayesub new study mytrial --vehicle myboat.toml --data trial.csv")
@click.argument("name")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write; NAME.toml if left out.")
@click.option("--vehicle", "boat", **VEHICLE, required=True, help="Built-in name or TOML.")
@click.option("--manoeuvre", **MANOEUVRE, help="Simulate this one and measure it.")
@click.option("--data", type=PATH, metavar="LOG", help="Read this log (CSV) instead.")
def new_study(name: str, output: Path | None, boat: str, manoeuvre: str | None, data: Path | None) -> None:
    """Write a study file, of a simulated manoeuvre or of a log, with a sensor for each of its columns."""
    if (manoeuvre is None) == (data is None):
        raise InputError("a study needs one of --manoeuvre and --data")
    path = output or Path(f"{name}.toml")
    flown = load_vehicle(boat)
    if data is None:
        load_manoeuvre(manoeuvre, flown)
        text = simulated(name, path, boat, manoeuvre)
    else:
        text = of_log(name, path, boat, data)
    _written(path, text, f"look through it, then bayesub check {path} --card card.png")


def _written(path: Path, text: str, advice: str) -> None:
    new_vehicle.write_new(path, text)
    console.print(f"{path}: {advice}", soft_wrap=True)


@app.command(epilog="Example: bayesub check studies/quickstart.toml myboat.toml --card myboat.png")
@click.argument("files", nargs=-1, required=True, type=PATH, metavar="FILE...")
@click.option("--card", type=PATH, help="Draw the card of the one vehicle or study in the files into this PNG or PDF.")
@click.option("--json", "as_json", is_flag=True, help="What is found as JSON, file by file.")
def check(files: tuple[Path, ...], card: Path | None, as_json: bool) -> None:
    """Validate vehicles, geometries, manoeuvres, studies (TOML, Python) and logs (CSV); say what a study costs.

    Of a vehicle it prints a card: balance, stability, turning circle, answer to the planes, mass matrix, and warnings
    with a remedy; of the data of a study, what each channel covers in time and informs. FILE may be the name of a
    built-in vehicle.
    """
    found = {}
    for path in files:
        text, found_card = checked(toml_files.built_in("vehicles").get(str(path), path))
        found[str(path)] = (text, found_card)
        if not as_json:
            console.print(f"{path}: {text}", soft_wrap=True)
            for line in lines(found_card):
                console.print(line, soft_wrap=True)
    if as_json:
        contents = {path: {"found": text} | (c.to_json() if c else {}) for path, (text, c) in found.items()}
        click.echo(json.dumps(contents, indent=2, allow_nan=False))
    if card is not None:
        cards = [c for _, c in found.values() if c]
        if len(cards) != 1:
            raise InputError(f"--card draws one vehicle or study, found {len(cards)} among the files")
        from bayesub.plots import data_card, vehicle_card

        drawing = data_card if isinstance(cards[0], DataCard) else vehicle_card
        with _drawing(card):
            drawing.draw(cards[0], card)


@contextmanager
def _drawing(path: Path) -> Iterator[None]:
    """A place or format that cannot be drawn to is an InputError."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be drawn: {' '.join(str(error).split())}") from None


@app.command(epilog="Example: bayesub simulate suboff horizontal -o track.csv --plot track.png")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@click.option("-o", "--output", type=PATH, required=True, help="Track CSV to write.")
@click.option("--dt", type=float, metavar="S", help="Time step in seconds; if left out, one good to 5 cm.")
@click.option(
    "--sample", type=float, metavar="S", help="Output interval in seconds; if left out, that of the controls."
)
@click.option(
    "--controls",
    type=click.Choice(["linear", "hold"]),
    default="linear",
    show_default=True,
    help="Controls within a step: interpolated, or held as in the thesis.",
)
@click.option(
    "--subproblem",
    type=click.Choice(["horizontal", "vertical", "none"]),
    help="Plane to confine the motion to; if left out, that of the manoeuvre.",
)
@click.option(
    "--attitude",
    type=click.Choice(["euler", "quaternion"]),
    default="euler",
    show_default=True,
    help="Integrate Euler angles, or a quaternion that flies through 90 degrees of pitch.",
)
@click.option("--plot", type=PATH, help="Also draw the track into this PNG or PDF.")
@click.option("--sensors", metavar="NAME", help="Write what these instruments log instead: a preset, or a TOML file.")
@click.option(
    "--perturb", type=float, metavar="SD", help="Fly coefficients that are off by this, relative to the file."
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of --sensors and --perturb.")
def simulate(
    vehicle, manoeuvre, output, dt, sample, controls, subproblem, attitude, plot, sensors, perturb, seed
) -> None:
    """Simulate a VEHICLE (built-in name or TOML) on a MANOEUVRE (built-in name, TOML or control-history CSV).

    With --sensors the output is the log of a trial, controls and readings with noise, which a study reads as its data.
    """
    boat = load_vehicle(vehicle)
    flown = load_manoeuvre(manoeuvre, boat)
    rng = np.random.default_rng(seed)
    xi = boat.xi if perturb is None else priors.perturbed(boat.xi, perturb, rng)
    plane = _plane(subproblem)
    options = {"dt": dt, "sample": sample, "controls": controls, "attitude": attitude}
    trajectory = simulate_trial(boat, flown, xi=xi, **options, **plane)
    if sensors is None:
        trajectory.save(output)
    else:
        instruments = read_instruments(sensors)
        parts = [section.build() for section in instruments.sensors]
        record = observe(trajectory, parts, rng, current_mps=instruments.truth.current_mps)
        record.save(output, trajectory)
    if plot is not None:
        from bayesub.plots import track

        with _drawing(plot):
            track.draw_simulated(trajectory, boat.name, plot)
    status = trajectory.status[0]
    kind = trajectory.simulator.subproblem or "six degrees of freedom"
    console.print(
        f"{output}: {len(trajectory.times)} times, {boat.name} on {flown.name} ({kind}), "
        f"step {trajectory.simulator.step:g} s, {status}",
        soft_wrap=True,
    )
    if status != "ok":
        raise click.exceptions.Exit(FAILED)


def _plane(subproblem: str | None) -> dict:
    """The option --subproblem as an argument of the simulator; left out, the manoeuvre decides."""
    return {} if subproblem is None else {"subproblem": None if subproblem == "none" else subproblem}


@app.command(epilog="Example: bayesub rank suboff horizontal --json")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@click.option(
    "--subproblem",
    type=click.Choice(["horizontal", "vertical", "none"]),
    help="Plane to confine the motion to; if left out, that of the manoeuvre.",
)
@click.option("--json", "as_json", is_flag=True, help="Ranks, singular values and null vectors as JSON.")
def rank(vehicle, manoeuvre, subproblem, as_json) -> None:
    """Say which coefficients of a VEHICLE a MANOEUVRE leaves open, axis by axis, if every motion is known exactly.

    A direction at round-off is not unique: no instrument finds it. One above round-off but below a millionth of the
    largest is ill-conditioned: unique in the equations, out of reach in a trial.
    """
    boat = load_vehicle(vehicle)
    flown = load_manoeuvre(manoeuvre, boat)
    trajectory = simulate_trial(boat, flown, **_plane(subproblem))
    if trajectory.status[0] != "ok":
        complain(f"{boat.name} does not complete {flown.name}: {trajectory.status[0]}", FAILED)
    ranks = identifiability.rank(linear_systems(trajectory), prefer=coefficients.ADDED_MASSES)
    if as_json:
        click.echo(json.dumps({axis: r.summary() for axis, r in ranks.items()}, indent=2))
        return
    kind = trajectory.simulator.subproblem or "six degrees of freedom"
    title = f"{boat.name} on {flown.name} ({kind}): columns scaled to unit length"
    table = Table("axis", "rank", "null", "weak", "condition", "round-off", "smallest", title=title)
    for axis, r in ranks.items():
        smallest = " ".join(f"{s:.0e}" for s in r.singular_values[max(0, r.rank - 2) :])
        counts = (f"{r.rank}/{r.columns}", str(r.null_dimension), str(r.rank - r.practical_rank))
        table.add_row(axis, *counts, f"{r.condition:.1e}", f"{r.threshold:.0e}", smallest)
    console.print(table)
    for axis, r in ranks.items():
        for verdict, vectors in (("not unique", r.null_vectors), ("ill-conditioned", r.weak_vectors)):
            for vector in vectors:
                changes = ", ".join(f"{name} {change:+.3g}" for name, change in vector.items())
                console.print(f"{axis} {verdict}: {changes}", soft_wrap=True)


@app.command(epilog="Example: bayesub run studies/quickstart.toml -o runs/quickstart")
@click.argument("file", type=PATH, metavar="STUDY")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Run folder, runs/NAME if left out; of many runs, runs.")
@click.option("--quick", is_flag=True, help="The small version of the study's [quick] table.")
@click.option("--resume", is_flag=True, help="Continue an interrupted run, bit for bit; of many runs this is the rule.")
@click.option("--force", is_flag=True, help="Replace an existing run; of many, those whose configuration has changed.")
@click.option("--cross-check", "check", is_flag=True, help="Sample with NUTS too and compare; works with --resume.")
@click.option("--json", "as_json", is_flag=True, help="Only the verdicts, as JSON.")
def run(file: Path, output: Path | None, quick: bool, resume: bool, force: bool, check: bool, as_json: bool) -> None:
    """Run a STUDY: TOML (simulate, fit, sample, report) or Python script (compare, draw, assert its claim).

    If STUDY is a folder, run every study in it, each into a folder of its own under DIR. Those that are done and have
    not changed are skipped, those that were interrupted are continued, and one that fails does not stop the others;
    DIR/index.html lists them.

    Exit status 1 if a posterior has not converged, a cross-check does not agree, or a claim does not hold.
    """
    if resume and force:
        raise InputError("--resume and --force exclude each other")
    options = Options(quick, resume, force, check)
    console.quiet = as_json
    outcomes = run_many(file, output or Path("runs"), options) if file.is_dir() else [run_one(file, output, options)]
    if as_json:
        click.echo(json.dumps([asdict(outcome) for outcome in outcomes], indent=2))
    if not all(outcome.good for outcome in outcomes):
        raise click.exceptions.Exit(FAILED)


@app.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without the cold start; less exact.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds, metres and bytes.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the simulator: against what a user would write, and against the arithmetic of this processor."""
    from bayesub.cli import bench as measure

    numbers = measure.run(quick=quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for table in measure.tables(numbers):
        console.print(table, soft_wrap=isinstance(table, str))


@app.command(epilog="Example: bayesub report runs/quickstart")
@click.argument("folder", type=PATH, metavar="DIR")
def report(folder: Path) -> None:
    """Draw figures and report of the run in DIR again, from its saved results.

    If DIR is a folder of runs of the thesis's studies, write its README.md: their numbers beside the thesis's.
    """
    if page := thesis_page.write(folder):
        console.print(f"beside the thesis: {page}", soft_wrap=True)
        return
    good = study.redraw(folder)
    report_run(Outcome(folder.name, "", verdict_of(folder, good), good, 0.0, str(folder)))
    if not good:
        raise click.exceptions.Exit(FAILED)


@app.command(epilog="Example: bayesub completion bash >> ~/.bashrc")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print what makes a SHELL complete commands, options, files and the names of what is built in.

    For bash and zsh append it to ~/.bashrc or ~/.zshrc, for fish write it to ~/.config/fish/completions/bayesub.fish.
    """
    made = shell_completion.get_completion_class(shell)(app, {}, "bayesub", "_BAYESUB_COMPLETE")
    click.echo(made.source())
