"""The command line."""

import json
import sys
import time
from pathlib import Path
from typing import Annotated

import click
import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from bayesub import coefficients, inputs, logs, study
from bayesub.errors import InputError
from bayesub.manoeuvres import ManoeuvreFile, load_manoeuvre
from bayesub.simulate import simulate as simulate_trial
from bayesub.vehicles import VehicleFile, load_vehicle

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130

app = typer.Typer(
    help="Say which hydrodynamic coefficients of a submarine a free-swimming trial determines, and why not the others.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
)
console = Console(highlight=False)


def main() -> None:
    """Run the command line; an InputError is one line on standard error and exit status 2."""
    try:
        sys.exit(app(standalone_mode=False))
    except InputError as error:
        _complain(str(error), BAD_INPUT)
    except click.ClickException as error:
        _complain(f"{error.format_message()}; see bayesub --help", BAD_INPUT)
    except (KeyboardInterrupt, click.Abort):
        _complain("interrupted; a run continues with the same command and --resume", INTERRUPTED)


def _complain(sentence: str, status: int) -> None:
    print(f"bayesub: {sentence}", file=sys.stderr)
    sys.exit(status)


def _example(text: str) -> str:
    return f"Example: `{text}`"


@app.command("list", epilog=_example("bayesub list vehicles"))
def list_(
    what: Annotated[str, typer.Argument(help="vehicles, manoeuvres or studies; all three if left out")] = "",
) -> None:
    """List what is built in, and the studies of the folder `studies`."""
    kinds = ("vehicles", "manoeuvres", "studies")
    if what and what not in kinds:
        raise InputError(f"cannot list '{what}'{coefficients.nearest(what, kinds)}; expected {', '.join(kinds)}")
    for kind in [what] if what else kinds:
        table = Table(title=kind.capitalize(), title_justify="left", show_header=False, box=None, pad_edge=False)
        for name, text in _entries(kind):
            table.add_row(name, text)
        console.print(table)


def _entries(kind: str) -> list[tuple[str, str]]:
    if kind == "studies":
        return [(str(path), study.load_study(path).question) for path in sorted(Path("studies").glob("*.toml"))]
    model = VehicleFile if kind == "vehicles" else ManoeuvreFile
    return [(name, inputs.read_toml(path, model).description) for name, path in inputs.built_in(kind).items()]


@app.command(epilog=_example("bayesub check studies/quickstart.toml myboat.toml"))
def check(files: Annotated[list[Path], typer.Argument(help="vehicle, manoeuvre or study TOML, or a log CSV")]) -> None:
    """Validate input files; build a study and say what it costs, but run nothing."""
    for path in files:
        console.print(f"{path}: {_checked(path)}", soft_wrap=True)


def _checked(path: Path) -> str:
    if path.suffix == ".csv":
        log = logs.read_log(path)
        times = log["time"]
        columns = ", ".join(logs.HEADERS[name] for name in log)
        return f"log of {len(times)} rows from {times[0]:g} to {times[-1]:g} s with {columns}"
    keys = inputs.read_toml_table(path)
    if "coefficients" in keys:
        boat = load_vehicle(path)
        used = int((boat.xi != 0).sum())
        return (
            f"vehicle '{boat.name}', {boat.length_m:g} m at {boat.speed_mps:g} m/s, {used} of 101 coefficients not zero"
        )
    if "kind" in keys:
        file = inputs.read_toml(path, ManoeuvreFile)
        return f"manoeuvre '{file.name}', {file.duration_s:g} s, {len(file.demands.time_s)} steps"
    if "vehicle" in keys:
        return _cost(study.prepare(study.load_study(path)))
    raise InputError(
        f"{path}: is neither a vehicle (no 'coefficients'), a manoeuvre (no 'kind') nor a study (no 'vehicle')"
    )


def _cost(setup: study.Setup) -> str:
    """Time a batch, and count on what the sampler usually needs."""
    problem = setup.problem
    batch = np.repeat(problem.prior.mean[None], 64, axis=0)
    problem.log_prob(batch)  # compiles
    began = time.perf_counter()
    for _ in range(4):
        problem.log_prob(batch)
    rate = 4 * len(batch) / (time.perf_counter() - began)
    return (
        f"study '{setup.study.name}': {setup.vehicle.name}, {setup.manoeuvre.name}, {problem.n_params} free "
        f"coefficients, {problem.record.n_readings} readings, step {problem.simulator.step:g} s; "
        f"{rate:.0f} log posteriors a second, so a million take {1e6 / rate:.0f} s"
    )


@app.command(epilog=_example("bayesub simulate suboff horizontal -o track.csv --plot track.png"))
def simulate(
    vehicle: Annotated[str, typer.Argument(help="built-in name or TOML file")],
    manoeuvre: Annotated[str, typer.Argument(help="built-in name, TOML file or control-history CSV")],
    output: Annotated[Path, typer.Option("-o", "--output", help="track CSV to write")],
    dt: Annotated[float | None, typer.Option(help="time step in seconds; chosen for 5 cm accuracy if left out")] = None,
    sample: Annotated[float | None, typer.Option(help="output interval in seconds")] = None,
    controls: Annotated[str, typer.Option(help="linear, or hold as in the thesis")] = "linear",
    subproblem: Annotated[
        str | None, typer.Option(help="horizontal, vertical or none; the manoeuvre's own if left out")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="also draw the track into this PNG or PDF")] = None,
) -> None:
    """Simulate a vehicle on a manoeuvre and write its track."""
    boat = load_vehicle(vehicle)
    flown = load_manoeuvre(manoeuvre, boat)
    plane = {} if subproblem is None else {"subproblem": None if subproblem == "none" else subproblem}
    trajectory = simulate_trial(boat, flown, dt=dt, sample=sample, controls=controls, **plane)
    trajectory.save(output)
    if plot is not None:
        from bayesub.plots import track

        track.draw_simulated(trajectory, boat.name, plot)
    status = trajectory.status[0]
    kind = trajectory.simulator.subproblem or "six degrees of freedom"
    console.print(
        f"{output}: {len(trajectory.times)} rows, {boat.name} on {flown.name} ({kind}), "
        f"step {trajectory.simulator.step:g} s, {status}",
        soft_wrap=True,
    )
    if status != "ok":
        raise typer.Exit(FAILED)


@app.command(epilog=_example("bayesub run studies/quickstart.toml -o runs/quickstart"))
def run(
    file: Annotated[Path, typer.Argument(metavar="STUDY", help="study TOML")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="run folder; runs/NAME if left out")] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="the small version that the study's [quick] describes")
    ] = False,
    resume: Annotated[bool, typer.Option("--resume", help="continue an interrupted run, bit for bit")] = False,
    force: Annotated[bool, typer.Option("--force", help="replace an existing run")] = False,
) -> None:
    """Run a study: simulate, fit, sample, report. Exit status 1 if the posterior has not converged."""
    if resume and force:
        raise InputError("--resume and --force exclude each other")
    loaded = study.load_study(file, quick=quick)
    folder = output or Path("runs") / loaded.name
    study.prepare(loaded)  # bad input shows before a folder is made
    study.open_folder(folder, study.completed(loaded, quick=quick), resume=resume, force=force)
    with _Bars() as bars:
        converged = study.run(loaded, folder, progress=bars)
    _finish(folder, converged)


@app.command(epilog=_example("bayesub report runs/quickstart"))
def report(folder: Annotated[Path, typer.Argument(metavar="DIR", help="run folder")]) -> None:
    """Draw figures and report again from saved results."""
    _finish(folder, study.redraw(folder))


def _finish(folder: Path, converged: bool) -> None:
    numbers = json.loads((folder / "numbers.json").read_text())
    for sentence in (*numbers["convergence"]["shortcomings"], *filter(None, numbers["verdict"].values())):
        console.print(f"- {sentence}", soft_wrap=True, markup=False)
    console.print(f"report: {folder / 'report.html'}", soft_wrap=True)
    console.print("CONVERGED" if converged else "NOT CONVERGED")
    if not converged:
        raise typer.Exit(FAILED)


class _Bars:
    """One progress bar a stage; nothing when the output is not a terminal."""

    def __init__(self):
        self.bars = Progress(
            SpinnerColumn(),
            TextColumn("{task.description:32}"),
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[text]}"),
            console=console,
            disable=not console.is_terminal,
        )
        self.task = None

    def __enter__(self):
        self.bars.start()
        return self

    def __exit__(self, *_):
        self._end()
        self.bars.stop()

    def _end(self):
        if self.task is not None:
            self.bars.update(self.task, completed=1.0)
            self.bars.stop_task(self.task)

    def stage(self, name: str) -> None:
        self._end()
        self.task = self.bars.add_task(name, total=1.0, text="")

    def update(self, fraction: float, text: str) -> None:
        self.bars.update(self.task, completed=fraction, text=text)
