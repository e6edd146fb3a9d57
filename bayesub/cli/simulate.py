"""The command `simulate`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from bayesub.cli.arguments import MANOEUVRE, PATH, VEHICLE, plane
from bayesub.cli.arguments import subproblem as subproblem_option
from bayesub.io.errors import InputError, error_source
from bayesub.io.terminal import FAILED, say


@click.command(epilog="Example: bayesub simulate suboff horizontal -o track.csv --plot track.png")
@click.argument("vehicle", **VEHICLE)
@click.argument("manoeuvre", **MANOEUVRE)
@click.option("-o", "--output", type=PATH, required=True, help="Track CSV to write.")
@click.option("--dt", type=float, metavar="S", help="Time step in seconds; if left out, a tenth of one good to 5 cm.")
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
@subproblem_option
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
@click.option("--disturbance", type=PATH, metavar="FILE", help="Fly with random forces that the equations leave out.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Of --sensors, --perturb and --disturbance.",
)
def simulate(
    vehicle: str,
    manoeuvre: str,
    output: Path,
    subproblem: str | None,
    plot: Path | None,
    sensors: str | None,
    perturb: float | None,
    disturbance: Path | None,
    seed: int,
    **options: float | str | None,
) -> None:
    """Simulate a VEHICLE (built-in name or TOML) on a MANOEUVRE (built-in name, TOML or control-history CSV).

    With --sensors the output is the log of a trial, controls and readings with noise, which a study reads as its data.
    The file of --disturbance has a section [disturbance]: axes, sd (or sd_n and sd_nm, or share; of a
    current sd_mps), correlation_time_s.
    """
    import numpy as np

    from bayesub.model.disturbance import CURRENTS
    from bayesub.model.manoeuvres import load_manoeuvre
    from bayesub.model.simulate import simulate as simulate_trial
    from bayesub.model.vehicles import load_vehicle
    from bayesub.problem import priors
    from bayesub.sensors import observe
    from bayesub.study.schema.disturbance_section import in_words
    from bayesub.study.schema.trial_section import read_instruments

    instruments = None if sensors is None else read_instruments(sensors)
    section = _disturbance(disturbance, instruments)
    boat = load_vehicle(vehicle)
    history = load_manoeuvre(manoeuvre, boat)
    rng = np.random.default_rng(seed)
    xi = boat.xi if perturb is None else priors.perturbed(boat.xi, perturb, rng)
    options["actuators"] = None if instruments is None else instruments.truth.actuators
    trajectory = simulate_trial(boat, history, xi=xi, **options, **plane(subproblem))
    forces = ""
    if section is not None:
        with error_source(str(disturbance or sensors)):
            trajectory, process = section.flown(trajectory, rng)
            if instruments is None and set(process.axes) & set(CURRENTS):
                raise InputError(
                    "disturbance: a current shows in what instruments read; give --sensors, or leave it out",
                    "missing",
                    "--sensors",
                )
        forces = f"disturbance {in_words(process)}, "
    if instruments is None:
        trajectory.save(output)
    else:
        parts = [section.build() for section in instruments.sensors]
        record = observe(trajectory, parts, rng, current_mps=instruments.truth.current_mps)
        record.save(output, trajectory)
    if plot is not None:
        from bayesub.report.plots import track

        with drawing(plot):
            track.draw_simulated(plot, trajectory)
    status = trajectory.status[0]
    kind = trajectory.simulator.subproblem or "six degrees of freedom"
    say(
        f"{output}: {len(trajectory.times)} times, {boat.name} on {history.name} ({kind}), "
        f"step {trajectory.simulator.step:g} s, {forces}{status}"
    )
    if status != "ok":
        raise click.exceptions.Exit(FAILED)


def _disturbance(path: Path | None, instruments):
    """The section of a file, or that of the truth in the file of the instruments; None if there is none."""
    from bayesub.study.schema.disturbance_section import read_disturbance

    of_truth = None if instruments is None else instruments.truth.disturbance
    if path is None:
        return of_truth
    if of_truth is not None:
        raise InputError(
            f"{path}: the file of --sensors has a [truth.disturbance] too; give one of the two",
            "conflict",
            "--disturbance",
        )
    return read_disturbance(path)


@contextmanager
def drawing(path: Path) -> Iterator[None]:
    """A place or format that cannot be drawn to is an InputError."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be drawn: {' '.join(str(error).split())}", "file") from None
