"""The commands that come before a run: `check`, `simulate`, `rank`, `design` and `bench`."""

import json
import math
import re
import sys
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bayesub.cli import arguments
from bayesub.cli.arguments import MANOEUVRE, PATH, RUN, VEHICLE, plane
from bayesub.cli.run import interrupted
from bayesub.findings.verdicts import NOT_FLOWN, STATUS
from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.terminal import LONG_S, Bars, complain, console, say, say_rows

if TYPE_CHECKING:
    from bayesub.model.vehicles import Vehicle


@click.command(epilog="Example: bayesub check myboat.toml --card myboat.png")
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
        with Bars(math.inf if as_json else LONG_S) as bars:
            bars.stage(f"check {path.name}")
            text, file_card = examine(built_in.get(str(path), path), vehicles, bars)
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


@click.command(epilog="Example: bayesub simulate suboff horizontal -o track.csv --plot track.png")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@click.option("-o", "--output", type=PATH, required=True, help="Track CSV to write; .csv is added if left out.")
@click.option("--dt", type=float, metavar="S", help="Time step in seconds; if left out, a tenth of one good to 5 cm.")
@click.option("--sample", type=float, metavar="S", help="Output interval, s; if left out, that of the controls.")
@click.option("--controls", **arguments.choice("linear", "hold"), help="Joined by lines, or held as in the thesis.")
@arguments.subproblem
@click.option("--attitude", **arguments.choice("euler", "quaternion"), help="A quaternion passes 90 degrees of pitch.")
@click.option("--plot", type=PATH, help="Also draw the track into this PNG or PDF.")
@click.option("--sensors", metavar="NAME", help="Write what these instruments log instead: a preset, or a TOML file.")
@click.option("--perturb", type=float, metavar="SD", help="Fly coefficients off by this, relative to the file.")
@click.option("--disturbance", type=PATH, metavar="FILE", help="Fly with random forces that the equations leave out.")
@click.option("--seed", **arguments.SEED, help="Of --sensors, --perturb and --disturbance.")
def simulate(vehicle: str, manoeuvre: str, output: Path, subproblem: str | None, **options: Any) -> None:
    """Simulate a VEHICLE (built-in name or TOML) on a MANOEUVRE (built-in name, TOML or control-history CSV).

    With --sensors the output is the log of a trial, controls and readings with noise, which a study reads as its data.
    The file of --disturbance has a section [disturbance]: axes, sd (or sd_n and sd_nm, or share; of a
    current sd_mps), correlation_time_s.
    """
    from bayesub.study.before.simulate import simulate

    output = output if output.suffix else output.with_name(f"{output.name}.csv")
    arguments.refuse_overwriting(output, vehicle, manoeuvre, *map(options.get, ("sensors", "disturbance", "plot")))
    sentence, is_whole = simulate(vehicle, manoeuvre, output, **options, **plane(subproblem))
    say(f"{output}: {sentence}")
    if not is_whole:
        raise click.exceptions.Exit(STATUS[NOT_FLOWN])


@click.command(epilog="Example: bayesub rank suboff horizontal --json")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@arguments.subproblem
@click.option("--json", "as_json", is_flag=True, help="Ranks, singular values and null vectors as JSON.")
def rank(vehicle: str, manoeuvre: str, subproblem: str | None, as_json: bool) -> None:
    """Say which coefficients of a VEHICLE a MANOEUVRE leaves open, axis by axis, if every motion is known exactly.

    A direction at round-off is not unique: no instrument finds it. One above round-off but below a millionth of the
    largest is ill-conditioned: unique in the equations, out of reach in a trial.
    """
    from bayesub.study.before.simulate import rank

    ranked = rank(vehicle, manoeuvre, **plane(subproblem))
    if not ranked.ranks:
        complain(ranked.title, STATUS[NOT_FLOWN])
    if as_json:
        click.echo(json.dumps({axis: r.summary() for axis, r in ranked.ranks.items()}, indent=2))
        return
    say(ranked.title)
    rows: list[tuple[str, ...]] = [("axis", "coefficients", "not unique", "ill-conditioned", "condition number")]
    for axis, r in ranked.ranks.items():
        rows.append((axis, *map(str, (r.columns, r.null_dimension, r.rank - r.practical_rank)), f"{r.condition:.1e}"))
    say_rows(rows)
    say_rows(((line,) for line in ranked.lines), indent="")


def in_minutes(_context: click.Context, _option: click.Parameter, text: str | None) -> float | None:
    """A time with its unit in minutes."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d+\.?\d*) ?(s|min|h)", text.strip())
    if found is None:
        raise InputError(f"--budget {text}: expected a time such as 60s, 5min or 1h", "value", "--budget")
    return float(found[1]) * {"s": 1.0 / 60.0, "min": 1.0, "h": 60.0}[found[2]]


@click.command(epilog="Example: bayesub design suboff --limits limits.toml --minutes 10 -o trial")
@click.argument("vehicle", **VEHICLE)
@click.option("-o", "--output", type=PATH, required=True, metavar="DIR", help="Folder for manoeuvre and page.")
@click.option(
    "--sensors",
    type=PATH,
    metavar="FILE",
    help="TOML with [[sensors]] as in a study, and perhaps [free], [prior], [nuisance], [noise] and [disturbance]; if "
    "left out, a Doppler log, gyros, attitude and depth.",
)
@click.option(
    "--limits", type=PATH, metavar="FILE", help="Of boat, crew and range (bayesub new limits); else depth, pitch, roll."
)
@click.option(
    "--for",
    "wanted",
    multiple=True,
    metavar="WHAT",
    help="known:10 (coefficients known to 10 %, the default), D, A, E, or names of coefficients and quantities; may be "
    "given several times.",
)
@click.option("--after", **RUN, metavar="RUN", help="A run folder whose posterior is what is known before.")
@click.option("--family", "families", multiple=True, metavar="NAME", help="curves, steps, multisines or standard.")
@click.option("--trials", type=click.IntRange(1, 20), default=1, show_default=True, help="Manoeuvres of one design.")
@click.option(
    "--boats",
    type=click.IntRange(1, 32),
    default=1,
    show_default=True,
    help="Boats over which the goal is averaged: that of the file, and others that the prior holds possible.",
)
@click.option("--minutes", type=float, metavar="M", help="Until the last answer; 10 if left out.")
@click.option("--budget", callback=in_minutes, metavar="TIME", help="The same with a unit: 60s, 5min or 1h.")
@click.option(
    "--without", multiple=True, metavar="NAME", help="Instrument, channel or column that is lost (gps ..); repeatable."
)
@click.option("--robust", is_flag=True, help="Average the goal over the loss of any instrument, and of any manoeuvre.")
@click.option(
    "--judgements", type=click.IntRange(1), metavar="N", help="In place of minutes: the result is that of any machine."
)
@arguments.seed_option
@arguments.subproblem
@click.option("--resume", is_flag=True, help="Continue an interrupted search bit for bit, or a finished one longer.")
@arguments.force_option
@arguments.dask_option
def design(
    vehicle: str, output: Path, resume: bool, force: bool, dask: str, subproblem: str | None, **asked: Any
) -> None:
    """Design a trial of a VEHICLE (built-in name or TOML): the manoeuvre that determines most, within limits.

    It writes manoeuvre.csv, which `bayesub simulate` and an autopilot fly, design.json, and a page design.html: orders,
    track, margins to the limits, what each coefficient will be known to, and what stays out of reach whatever is flown.
    A first answer is written within a minute.
    """
    from bayesub.study.after.design import DEFAULT, MINUTES, Request
    from bayesub.study.after.design import design as design_trial
    from bayesub.study.run.run import RunInterrupted, executor_of

    arguments.refuse_several({"--resume": resume, "--force": force}, "--force")
    arguments.refuse_several({f"--{option}": asked[option] for option in ("minutes", "budget", "judgements")})
    minutes = asked.pop("budget") or asked["minutes"] or MINUTES
    asked |= {"wanted": asked["wanted"] or (DEFAULT,), "minutes": minutes}
    request = Request(vehicle, **asked, **plane(subproblem))
    try:
        with executor_of(dask) as executor, Bars() as bars:
            design_trial(request, output, resume=resume, force=force, progress=bars, executor=executor)
    except RunInterrupted:
        interrupted(["bayesub", *(word for word in sys.argv[1:] if word not in ("--force", "--resume")), "--resume"])
    say(f"page: {output / 'design.html'}")


@click.command(epilog="Example: bayesub bench --quick")
@click.option("--quick", is_flag=True, help="Shorter, without the cold start and compilation; less exact.")
@click.option("--json", "as_json", is_flag=True, help="The numbers as JSON: seconds and bytes.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the simulator on this machine: simulations, derivatives, densities, and what compiling costs."""
    from bayesub.study.before import bench

    console.quiet = as_json
    numbers = bench.run(quick=quick)
    if as_json:
        click.echo(json.dumps(numbers, indent=2))
        return
    for title, rows in tables(numbers).items():
        say(title)
        say_rows(rows)


def tables(numbers: dict[str, Any]) -> dict[str, list[tuple[str, ...]]]:
    """Title -> rows, heads first, of what :func:`bayesub.study.before.bench.run` returns; a title may be all."""
    n, alone = numbers["batch"], {r["threads"]: r["seconds"] for r in numbers["log_likelihoods"] if r["noise"] is None}

    def timed(row, what, form, times=1):
        ratio = row["seconds"] / alone[row["threads"]] * times
        return what, str(row["threads"]), f"{1e3 * row['seconds']:.2f}", format(ratio, form)

    batches = [
        (f"{size}", f"{1e3 * s:.3g}", f"{1e6 * s / size:.1f}", f"{size / s:,.0f}", f"{n_bytes / 1e6:.2f}")
        for size, s, n_bytes in map(itemgetter("size", "seconds", "bytes"), numbers["batches"])
    ]
    jacobians = [timed(row, str(row["coefficients"]), ".0f", n) for row in numbers["jacobians"]]
    noises = [timed(row, row["noise"] or "simulations alone", ".2f") for row in numbers["log_likelihoods"]]
    title = f"600 s spiral of suboff, steps of {numbers['step_s']:g} s, threads: {numbers['threads']}"
    shown: dict[str, list[tuple[str, ...]]] = {
        title: [("batch", "ms", "us a simulation", "simulations/s", "MB"), *batches],
        "Exact sensitivities": [("coefficients", "threads", "ms a Jacobian", "in simulations"), *jacobians],
        f"Log likelihoods, batch of {n}": [("noise", "threads", "ms a batch", "over the simulations alone"), *noises],
    }
    if "cold_s" in numbers:
        shown["first simulation: {cold_s:.1f} s with compilation, {warm_s:.1f} s without".format(**numbers)] = []
    titles = {"compilation": ("Compilation, from an empty cache", ("what", "s of a processor"))}
    titles |= {"run": ("A run of the spiral, all compiled", ("part", "s"))}
    for title, heads, seconds in ((*titles[key], numbers[key]) for key in titles if key in numbers):
        shown[title] = [heads, *((name, f"{taken:.2f}") for name, taken in seconds.items())]
    return shown
