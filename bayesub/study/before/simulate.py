"""A manoeuvre simulated: its track or the log of a trial, and which coefficients its exact motion leaves open."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayesub.findings.run_numbers import change_words, changes, null_count
from bayesub.findings.zeros import rank_lines
from bayesub.inference import identifiability
from bayesub.inference.identifiability.null_space import RANK_DRAWS
from bayesub.inference.identifiability.rank import AxisRank
from bayesub.io.errors import InputError, error_source
from bayesub.model.disturbance import CURRENTS
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate as simulate_trial
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.sensors import observe
from bayesub.study.before.check import drawing
from bayesub.study.schema.disturbance_section import in_words, read_disturbance
from bayesub.study.schema.trial_section import read_instruments

_SEED, _NEAR = 8, 0.01  # of coefficients near those of the file, at which the rank is taken too, and how near


def simulate(
    vehicle: str,
    manoeuvre: str,
    output: Path,
    *,
    plot: Path | None = None,
    sensors: str | None = None,
    perturb: float | None = None,
    disturbance: Path | None = None,
    seed: int = 0,
    **options: Any,
) -> tuple[str, bool]:
    """Write the track of a simulated manoeuvre, or the log of a trial; what it is, and whether it came to its end.

    `vehicle`, `manoeuvre`: built-in names or paths; `output`, `plot`: files for the track or log, and for a figure of
    the track; `sensors`: preset or file of the instruments whose log is written; `perturb`: relative sd of coefficients
    that are flown in place of those of the file; `disturbance`: file of random forces, left out those of the truth in
    the file of the instruments; `options`: of :func:`bayesub.simulate`.
    """
    if perturb is not None and not 0.0 <= perturb < np.inf:
        raise InputError(f"--perturb must be a number and not negative, found {perturb:g}", "value", "--perturb")
    instruments = None if sensors is None else read_instruments(sensors)
    section = None if instruments is None else instruments.truth.disturbance
    if disturbance is not None:
        if section is not None:
            text = f"{disturbance}: the file of --sensors has a [truth.disturbance] too; give one of the two"
            raise InputError(text, "conflict", "--disturbance")
        section = read_disturbance(disturbance)
    boat = load_vehicle(vehicle)
    history = load_manoeuvre(manoeuvre, boat)
    rng = np.random.default_rng(seed)
    xi = boat.xi if perturb is None else priors.perturbed(boat.xi, perturb, rng)
    options["actuators"] = None if instruments is None else instruments.truth.actuators
    trajectory = simulate_trial(boat, history, xi=xi, **options)
    forces = ""
    if section is not None:
        with error_source(str(disturbance or sensors)):
            trajectory, process = section.flown(trajectory, rng)
            if instruments is None and set(process.axes) & set(CURRENTS):
                text = "disturbance: a current shows in what instruments read; give --sensors, or leave it out"
                raise InputError(text, "missing", "--sensors")
        forces = f"disturbance {in_words(process)}, "
    if instruments is None:
        trajectory.save(output)
    else:
        parts = [section.build() for section in instruments.sensors]
        observe(trajectory, parts, rng, current_mps=instruments.truth.current_mps).save(output, trajectory)
    if plot is not None:
        from bayesub.report.plots import track

        with drawing(plot):
            track.draw_simulated(plot, trajectory)
    status, step = trajectory.status[0], trajectory.simulator.step
    flight = f"{boat.name} on {history.name} ({_freedom(trajectory)})"
    return f"{len(trajectory.times)} times, {flight}, step {step:g} s, {forces}{status}", status == "ok"


class Ranked(NamedTuple):
    """What the exact motion of a manoeuvre leaves open; of one that the boat does not complete, there are no ranks."""

    title: str  # what was flown, or why it was not
    ranks: dict[str, AxisRank]  # by axis
    lines: list[str]  # directions that are not unique or ill-conditioned, and what follows


def rank(vehicle: str, manoeuvre: str, **options: Any) -> Ranked:
    """Which coefficients a manoeuvre (built-in names or paths) leaves open if every motion is known exactly."""
    boat = load_vehicle(vehicle)
    history = load_manoeuvre(manoeuvre, boat)
    trajectory = simulate_trial(boat, history, **options)
    if trajectory.status[0] != "ok":
        return Ranked(f"{boat.name} does not complete {history.name}: {trajectory.status[0]}", {}, [])
    rng = np.random.default_rng(_SEED)
    near = np.vstack([trajectory.xi, [priors.perturbed(boat.xi, _NEAR, rng) for _ in range(RANK_DRAWS)]])
    flown = trajectory.simulator.trajectory(near)
    systems = [linear_systems(flown, k) for k in np.flatnonzero(flown.status == "ok")]
    ranks = identifiability.rank(systems[0], boat.equations.added_masses, others=systems[1:])
    lines, values = [], dict(zip(boat.equations.names, boat.xi.tolist(), strict=True))
    for axis, r in ranks.items():
        for verdict, vectors in (("not unique", r.null_vectors), ("ill-conditioned", r.weak_vectors)):
            lines += [f"{axis} {verdict}: {change_words(changes(vector, values))}" for vector in vectors]
    title = f"{boat.name} on {history.name} ({_freedom(trajectory)}), if every motion is known exactly"
    n, hold = sum(r.columns for r in ranks.values()), [name for r in ranks.values() for name in r.pivots]
    last = f"Of {n} directions in coefficient space: {null_count({axis: r.summary() for axis, r in ranks.items()})}"
    last += f"; hold {', '.join(hold)}, and the rest is unique." if hold else "."
    return Ranked(title, ranks, [*lines, *rank_lines(trajectory), last])


def _freedom(trajectory: Trajectory) -> str:
    return trajectory.simulator.subproblem or "six degrees of freedom"
