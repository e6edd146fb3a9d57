"""The command `design`."""

import shlex
import sys
from pathlib import Path
from typing import Any

import click

from bayesub.cli.arguments import PATH, VEHICLE, dask_option, force_option, plane, seed_option
from bayesub.cli.arguments import subproblem as subproblem_option
from bayesub.io.errors import InputError
from bayesub.io.terminal import INTERRUPTED, Bars, complain, say


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
    "--limits",
    type=PATH,
    metavar="FILE",
    help="Of boat, crew and range (bayesub new limits); if left out, depth, pitch and roll.",
)
@click.option(
    "--for",
    "wanted",
    multiple=True,
    metavar="WHAT",
    help="known:10 (coefficients known to 10 %, the default), D, A, E, or names of coefficients and quantities; may be "
    "given several times.",
)
@click.option("--after", type=PATH, metavar="RUN", help="A run folder whose posterior is what is known before.")
@click.option(
    "--family",
    "families",
    multiple=True,
    metavar="NAME",
    help="curves, steps, multisines or standard; all if left out.",
)
@click.option(
    "--trials", type=click.IntRange(1, 20), default=1, show_default=True, help="Manoeuvres designed together."
)
@click.option(
    "--boats",
    type=click.IntRange(1, 32),
    default=1,
    show_default=True,
    help="Boats over which the goal is averaged: that of the file, and others that the prior holds possible.",
)
@click.option("--minutes", type=click.FloatRange(0.1, 10_000), metavar="M", help="Of search; 10 if left out.")
@click.option(
    "--judgements",
    type=click.IntRange(1),
    metavar="N",
    help="Manoeuvres to judge in place of minutes, for a result that does not depend on the speed of the machine.",
)
@seed_option
@subproblem_option
@click.option(
    "--resume", is_flag=True, help="Continue an interrupted search, bit for bit, or a finished one for longer."
)
@force_option
@dask_option
def design(
    vehicle: str,
    output: Path,
    wanted: tuple[str, ...],
    minutes: float | None,
    judgements: int | None,
    resume: bool,
    force: bool,
    dask: str,
    subproblem: str | None,
    **asked: Any,
) -> None:
    """Design a trial of a VEHICLE (built-in name or TOML): the manoeuvre that determines most, within limits.

    It writes manoeuvre.csv, which `bayesub simulate` and an autopilot fly, design.json, and a page design.html: orders,
    track, margins to the limits, what each coefficient will be known to, and what stays out of reach whatever is flown.
    A first answer is written within a minute.
    """
    from bayesub.study.after.design import DEFAULT, MINUTES, Request
    from bayesub.study.after.design import design as design_trial
    from bayesub.study.run.run import RunInterrupted, executor_of

    if resume and force:
        raise InputError("--resume and --force exclude each other", "conflict", "--force")
    if minutes is not None and judgements is not None:
        raise InputError("--minutes and --judgements exclude each other", "conflict", "--minutes")
    asked |= {"wanted": wanted or (DEFAULT,), "minutes": minutes or MINUTES, "judgements": judgements}
    request = Request(vehicle, **asked, **plane(subproblem))
    try:
        with executor_of(dask) as executor, Bars() as bars:
            design_trial(request, output, resume=resume, force=force, progress=bars, executor=executor)
    except RunInterrupted:
        words = [word for word in sys.argv[1:] if word not in ("--force", "--resume")]
        again = shlex.join(["bayesub", *words, "--resume"])
        complain(f"interrupted; what is done is saved, continue with: {again}", INTERRUPTED)
    say(f"page: {output / 'design.html'}")
