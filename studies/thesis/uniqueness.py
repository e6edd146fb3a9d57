"""Uniqueness and conditioning of the coefficients of any equation set, and why a null direction is one.

A null direction of an axis has one of two mechanisms:

- ``motion``: it contains an added mass. The equations of motion make the accelerations functions of the velocities and
  controls. If the terms of an axis contain those of the rigid body, all of its equation may be multiplied by a number,
  and the motion is the same: a null direction of any equations with such terms.
- ``terms``: it contains none. Terms in velocities and controls are linearly dependent on this manoeuvre.
"""

from dataclasses import replace

import numpy as np

from bayesub.inference.baselines import sqp
from bayesub.inference.identifiability import Spectrum, fisher, rank
from bayesub.inference.sampling import Posterior
from bayesub.logs.log_files import VELOCITIES
from bayesub.model.equations.equation_set import Term
from bayesub.model.linear_form import LinearSystem, linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import choose_step
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import observe, thesis_rounding
from thesis.cases import posed, time_scale, tracking_range

PRIOR_SD, GUESS_SD = 0.25, 0.15  # relative; the guess about which a prior of a trial is centred is a draw
KNOWN, SHARPENED = 0.1, 0.9  # posterior sd over prior sd
SAME = 1e-9  # of the load: what is left when the terms of the rigid body explain it
SENSORS = {
    "track": tracking_range,
    "rounded": lambda boat: thesis_rounding(interval_s=time_scale(boat)),
}


def flight(vehicle: str, manoeuvre: str) -> Trajectory:
    """The motion of a built-in vehicle on a built-in manoeuvre."""
    boat = load_vehicle(vehicle)
    return simulate(boat, load_manoeuvre(manoeuvre, boat))


def uniqueness(track: Trajectory) -> dict[str, dict]:
    """Axis -> rank, null dimensions by mechanism, and condition number, as JSON types.

    ``equations`` lists the axes whose equations of motion are null directions of this one: in its terms they can be
    written whole.
    """
    equations, systems = track.simulator.vehicle.equations, linear_systems(track)
    results = {}
    for axis, result in rank(systems).items():
        system = systems[axis]
        of_terms = null_dimension(system, [name not in equations.added_masses for name in system.names])
        results[axis] = {
            "columns": result.columns,
            "rank": result.rank,
            "motion": result.null_dimension - of_terms,
            "terms": of_terms,
            "equations": [other for other in systems if is_written_in(systems[other], system, track)],
            "condition": result.condition,
            "gap": result.gap,
            "null_vectors": list(result.null_vectors),
        }
    return results


def _part(system: LinearSystem, kept) -> LinearSystem:
    """The columns of a system that are `kept`, (n_columns,) of booleans."""
    places = np.flatnonzero(kept)
    rounding = np.broadcast_to(system.rounding, len(system.names))[places]
    names = tuple(system.names[k] for k in places)
    return replace(system, names=names, matrix=system.matrix[:, places], rounding=rounding)


def null_dimension(system: LinearSystem, kept) -> int:
    """Null directions among the columns of a system that are `kept`, (n_columns,) of booleans."""
    return rank({"": _part(system, kept)})[""].null_dimension if any(kept) else 0


def is_written_in(equation: LinearSystem, system: LinearSystem, track: Trajectory) -> bool:
    """Whether the equation of motion of one axis can be written in the terms of another, or of its own.

    If so, any multiple of it may be added to the other. Its load must then be a sum of the terms that the rigid body
    has, accelerations and products of two velocities with a rate among them, and each of its terms one of the other's.
    """
    boat = track.simulator.vehicle
    unit = system.matrix / np.linalg.norm(system.matrix, axis=0)
    body = unit[:, [_of_rigid_body(boat.equations.term(name)) for name in system.names]]
    rest = equation.load - body @ np.linalg.lstsq(body, equation.load, rcond=None)[0]
    present = boat.xi[boat.equations.columns(equation.names)] != 0.0
    terms = equation.matrix[:, present] / np.linalg.norm(equation.matrix[:, present], axis=0)
    alike = np.abs(terms.T @ unit).max(axis=1, initial=0.0) > 1.0 - SAME
    return bool(np.linalg.norm(rest) < SAME * np.linalg.norm(equation.load) and alike.all())


def _of_rigid_body(term: Term) -> bool:
    powers = term.parsed.canonical
    of_two_velocities = term.symbols <= set(VELOCITIES) and sum(power for _, power, _ in powers) == 2
    with_a_rate = of_two_velocities and bool(term.symbols & {"p", "q", "r"}) and not any(sign for *_, sign in powers)
    return term.is_added_mass or with_a_rate


def spectra(track: Trajectory) -> dict[str, dict]:
    """Sensors -> what noise-free readings say of the coefficients that are not zero, as JSON types."""
    return {name: summary(spectrum(track, sensors)) for name, sensors in SENSORS.items()}


def spectrum(track: Trajectory, sensors) -> Spectrum:
    """Spectrum at the truth, for a prior of 25 % about it; `sensors` is a function of the vehicle."""
    boat, manoeuvre = track.simulator.vehicle, track.simulator.manoeuvre
    prior, free = priors.relative_normal(PRIOR_SD), boat.equations.names
    # Without noise the step need not follow the sensors, of which rounded accelerations ask for half a millisecond.
    step = choose_step(boat, manoeuvre, manoeuvre.subproblem)
    problem = Problem(boat, manoeuvre, observe(track, sensors(boat), None), free=free, prior=prior, dt=step).naive()
    return fisher(problem, problem.reference)


def summary(directions: Spectrum) -> dict:
    """The numbers of a spectrum, as JSON types."""
    ratios = directions.posterior_sd / directions.prior_sd
    seen = directions.singular_values[: len(directions.names) - directions.n_null]
    return {
        "n_params": len(directions.names),
        "n_null": directions.n_null,
        "n_sharper": directions.n_informed,
        "n_known": int(np.sum(ratios < KNOWN)),
        "n_sharpened": int(np.sum(ratios < SHARPENED)),
        "decades": float(np.log10(seen[0] / seen[-1])),
        "singular_values": [float(f"{s:.4g}") for s in seen],
    }


def trial(track: Trajectory, rng: np.random.Generator) -> Problem:
    """What a tracking range makes of a motion: every coefficient that is not zero is free, the guess 15 % off."""
    boat, manoeuvre = track.simulator.vehicle, track.simulator.manoeuvre
    prior = priors.relative_normal(PRIOR_SD, priors.perturbed(boat.xi, GUESS_SD, rng))
    return posed(boat, manoeuvre, tracking_range(boat), rng, free=boat.equations.names, prior=prior)


def sharpened(posterior: Posterior) -> dict:
    """What sampling has found, as JSON types."""
    return {
        "n_params": len(posterior.names),
        "n_known": int(np.sum(posterior.contraction < KNOWN)),
        "n_sharpened": int(np.sum(posterior.contraction < SHARPENED)),
        "contraction": dict(zip(posterior.names, posterior.contraction.tolist(), strict=True)),
        "converged": posterior.converged,
        "shortcomings": list(posterior.shortcomings),
        "seconds": posterior.seconds,
    }


def searches(problem: Problem, rng: np.random.Generator, n_starts: int, max_iterations: int) -> dict:
    """SQP on the readings of a trial: chi-square a reading, and how many coefficients end nearer to the truth."""
    estimate = sqp(problem, rng=rng, n_starts=n_starts, max_iterations=max_iterations)
    off = np.abs(estimate.solutions - problem.reference)
    nearer = off < np.abs(problem.prior.mean - problem.reference)
    return {
        "nearer_than_guess": nearer.mean(axis=1).tolist(),
        "chi_square_per_reading": (estimate.costs / problem.record.n_readings).tolist(),
    }
