"""A boat that is described in another equation set than the one it moves by, and what that predicts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesub.inference.checks.fit import criticise
from bayesub.inference.sampling import Posterior
from bayesub.logs.log_files import VELOCITIES, positions
from bayesub.model.equations import AXES, EquationSet, load_equations
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from thesis.cases import posed, time_scale, tracking_range
from thesis.uniqueness import GUESS_SD, PRIOR_SD

LEVELS = (0.5, 0.9)
ROUND_OFF_M = 1e-6  # of a coordinate that does not change
N_TIMES = 10  # of a manoeuvre at which bands are compared with the truth
N_DRAWS, N_CHECKED = 200, 50  # draws that predict, and whose residuals are checked
N_STATES = 32  # at which regressors are compared
CONFINED = {"horizontal": ("u", "v", "r"), "vertical": ("u", "w", "q")}


def counterparts(boat: Vehicle, other: EquationSet, subproblem: str) -> dict[str, str]:
    """Coefficient of `other` -> that of the boat whose term is the same function of every motion ahead in the plane.

    So ``u*abs(u)`` is ``u*u``, and in a plane ``v*nu`` is ``v*abs(v)``.
    """
    rng = np.random.default_rng(0)
    states = np.zeros((N_STATES, 12))
    states[:, positions(*CONFINED[subproblem])] = rng.standard_normal((N_STATES, 3))
    states[:, positions("u")] = boat.speed_mps * rng.uniform(0.5, 1.5, (N_STATES, 1))
    accelerations = np.zeros((N_STATES, 6))
    moving = [VELOCITIES.index(name) for name in CONFINED[subproblem]]
    accelerations[:, moving] = rng.standard_normal((N_STATES, 3))
    columns = {c.column for e in (boat.equations, other) for c in e.controls}
    angles = dict(zip(sorted(columns), rng.uniform(0.1, 0.3, (len(columns), N_STATES)), strict=True))
    values = []
    for equations in (boat.equations, other):
        controls = np.column_stack([*(angles[c.column] for c in equations.controls), states[:, positions("u")]])
        constants = equations.constants(boat.speed_mps, boat.hull)
        values.append(equations.regressors(states, accelerations, controls, constants))
    given, wanted = values
    return {
        name: known
        for axis in AXES
        for name, column in zip(other.names_of_axis(axis), wanted[axis].T, strict=True)
        for known, same in zip(boat.equations.names_of_axis(axis), given[axis].T, strict=True)
        if column.any() and np.allclose(column, same, rtol=1e-12, atol=0.0)
    }


def crossed(boat: Vehicle, name: str, subproblem: str) -> Vehicle:
    """The boat in another equation set: coefficients that have a counterpart are the same force, all others zero."""
    other = load_equations(name)
    xi = np.zeros(len(other.names))
    factors = other.factors(boat.length_m, boat.water_density_kgm3, boat.speed_mps)
    for new, old in counterparts(boat, other, subproblem).items():
        k, j = other.index[new], boat.equations.index[old]
        xi[k] = boat.xi[j] * boat.dimensional_factors[j] / factors[k]
    members = {member.column: member for member in boat.actuators.members}
    at_rest = next(iter(members.values()))
    rows = np.eye(len(other.controls))
    moved = tuple(
        replace(members.get(c.column, at_rest), name=c.short, column=c.column, mixing=row)
        for c, row in zip(other.controls, rows, strict=True)
    )
    actuators = replace(boat.actuators, members=moved, equations=other)
    return replace(boat, equations=other, xi=xi, sd=np.full(len(xi), np.nan), actuators=actuators)


def same_orders(manoeuvre: Manoeuvre, equations: EquationSet) -> Manoeuvre:
    """A manoeuvre with the control histories in the columns of other equations; what it does not have rests."""
    histories = dict(zip(manoeuvre.columns, manoeuvre.controls.T, strict=True))
    columns = tuple(control.short for control in equations.controls)
    controls = np.column_stack([histories.get(name, np.zeros(len(manoeuvre.times))) for name in columns])
    return replace(manoeuvre, controls=controls, columns=columns)


def crossed_trial(track: Trajectory, boat: Vehicle, rng: np.random.Generator) -> Problem:
    """The record of a motion that the boat of :func:`crossed` is fitted to.

    Priors are as wide as in :func:`thesis.uniqueness.trial` about the counterpart of a coefficient. One
    without counterpart may be of either sign; its sd makes a force as large as the median term of its axis.
    """
    truth, flown = track.simulator.vehicle, track.simulator.manoeuvre
    manoeuvre = same_orders(flown, boat.equations)
    own, new = _sizes(track, truth, flown), _sizes(track, boat, manoeuvre)
    typical = {axis: np.median([s for n, s in own.items() if n[0] == axis and s > 0.0] or [0.0]) for axis in AXES}
    unit = _sizes(track, replace(boat, xi=np.ones(len(boat.xi))), manoeuvre)
    guess = priors.perturbed(boat.xi, GUESS_SD, rng)
    unknown = [n for n, size in new.items() if size == 0.0 and unit[n] > 0.0 and typical[n[0]] > 0.0]
    given = {name: priors.normal(0.0, float(typical[name[0]] / unit[name])) for name in unknown}
    prior = priors.Given(priors.relative_normal(PRIOR_SD, guess), given)
    given = {"model": boat, "orders": manoeuvre, "free": boat.equations.names, "prior": prior}
    return posed(truth, flown, tracking_range(truth), rng, **given)


def _sizes(track: Trajectory, boat: Vehicle, manoeuvre: Manoeuvre) -> dict[str, float]:
    """Coefficient -> root mean square of its force on a motion, N and N m."""
    simulator = Simulator(boat, manoeuvre, track.times, dt=track.simulator.step)
    controls = simulator.controls_at(track.times)[:, : len(boat.equations.controls) + 1]
    forces = boat.equations.regressors(track.states[0], track.accelerations[0], controls, boat.constants)
    scale = np.abs(boat.xi * boat.dimensional_factors)
    sizes = np.concatenate([np.sqrt(np.mean(forces[axis] ** 2, axis=0)) for axis in AXES])
    return dict(zip(boat.equations.names, scale * sizes, strict=True))


@dataclass(frozen=True)
class Unseen:
    """Manoeuvres of a boat that its trial does not contain.

    Attributes
    ----------
    boat : the true one
    manoeuvres : in one plane
    """

    boat: Vehicle
    manoeuvres: tuple[Manoeuvre, ...]


def unseen(boat: Vehicle, names, subproblem: str) -> Unseen:
    """Built-in manoeuvres by name; random ones are confined to the plane, in which the other controls rest."""
    manoeuvres = []
    for name in names:
        flown = load_manoeuvre(name, boat)
        moving = [control.subproblem in (None, subproblem) for control in boat.equations.controls]
        controls = np.where(moving, flown.controls, 0.0)
        manoeuvres.append(replace(flown, controls=controls, subproblem=subproblem))
    return Unseen(boat, tuple(manoeuvres))


def predictions(unseen: Unseen, fits: Sequence[tuple[Problem, Posterior]], rng: np.random.Generator) -> dict:
    """Errors in ship lengths of guess and posterior mean, and coverage of posterior bands, as JSON types.

    They are of all trials in `fits` together: the errors of one trial's coefficients make the errors of all places, so
    that its bands hold all of the truth or little of it.
    """
    truths = list(_truths(unseen))
    errors, places = zip(*(_errors_and_places(unseen.boat, truths, *fit, rng) for fit in fits), strict=True)
    guess, mean = np.concatenate(errors).T
    return {
        "n_trials": len(errors),
        "n_manoeuvres": len(errors[0]),
        "guess_lengths": guess.tolist(),
        "posterior_lengths": mean.tolist(),
        "median_lengths": float(np.nanmedian(mean)),
        "largest_lengths": float(np.nanmax(mean)),
        "guess_median_lengths": float(np.nanmedian(guess)),
        "coverage": {str(p): float(np.mean(np.abs(np.concatenate(places) - 0.5) <= p / 2)) for p in LEVELS},
    }


def _truths(unseen):
    """Manoeuvre, times, step and true coordinates (n_times, 3) of each unseen manoeuvre that the boat can fly."""
    boat = unseen.boat
    for manoeuvre in unseen.manoeuvres:
        times = np.arange(time_scale(boat), manoeuvre.duration, time_scale(boat))
        simulator = Simulator(boat, manoeuvre, times)
        (states,), (status,) = simulator.run(boat.xi)
        if status == 0:
            yield manoeuvre, times, simulator.step, states[:, :3]


def _errors_and_places(boat, truths, problem, posterior, rng):
    """Errors (n_manoeuvres, 2) of guess and mean, ship lengths, and shares of draws (n,) below the true coordinates."""
    draws = posterior.draws[rng.choice(len(posterior.draws), N_DRAWS)]
    sets = problem.coefficient_sets(np.vstack([problem.prior.mean, posterior.mean, draws]))
    errors, places = [], []
    for manoeuvre, times, step, truth in truths:
        orders = same_orders(manoeuvre, problem.equations)
        states, codes = Simulator(problem.vehicle, orders, times, dt=step).run(sets)
        off = np.linalg.norm(states[:, :, :3] - truth, axis=2).max(axis=1) / boat.length_m
        errors.append(np.where(codes == 0, off, np.nan)[:2])
        looks = np.linspace(0, len(times) - 1, N_TIMES + 1).astype(int)[1:]
        members = states[2:][codes[2:] == 0][:, looks, :3]
        moves = np.ptp(truth[looks], axis=0) > ROUND_OFF_M
        places.append(np.mean(members < truth[looks], axis=0)[:, moves].ravel())
    return np.array(errors), np.concatenate(places)


def model_check(problem: Problem, posterior: Posterior, rng: np.random.Generator) -> dict:
    """Whether the residuals look like the noise, and what is wrong with them, as JSON types."""
    draws = posterior.draws[rng.choice(len(posterior.draws), N_CHECKED)]
    times = {name: channel.times for name, (channel, _) in problem.channels.items()}
    criticism = criticise(problem.quantile_residuals(draws, rng), times)
    squares = {name: check.chi_square_per_reading for name, check in criticism.checks.items()}
    faults = {name: list(check.faults) for name, check in criticism.suspects.items()}
    return {"fits": criticism.fits, "faults": faults, "chi_square_per_reading": squares}
