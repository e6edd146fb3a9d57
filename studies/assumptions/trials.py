"""Trials of boats for which an assumption does not hold, fitted with it and without it."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.identifiability import null_space
from bayesub.inference.sampling import sample
from bayesub.kernels.workspace import BODY, THRUST
from bayesub.model.coefficients import INDEX, NAMES, columns
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import true_step
from bayesub.model.vehicles import GRAVITY_MPS2, Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import Record, unread
from thesis import cases

PRIOR_SD, KNOWN, NORMAL_90 = 0.25, 0.1, 1.6449
ADDED_MASSES = tuple(name for name in NAMES if name.endswith("dot"))
PROPULSION, MASS, INERTIA, CENTRE, TRIM = (
    0.05,
    0.01,
    0.05,
    1e-3,
    1e-3,
)  # sds: of the value, of the length, of the weight
CURRENT, SPEED, ANGLE_DEG, CLOCK = 0.05, 0.02, 0.5, 0.02  # of the trial speed, and of the time for a ship length
ZERO = 0.1  # sd of what the file has as zero, of the median size of the coefficients of its axis


@dataclass(frozen=True)
class Relaxed:
    """An assumption of section 7.3 that is relaxed.

    Attributes
    ----------
    says : what the thesis assumes
    nuisance : prior of what is inferred besides coefficients, for a vehicle
    held : coefficients that a fit with the assumption holds at the values of the file
    zeros : whether coefficients that the file has as zero are free
    """

    says: str
    nuisance: Callable[[Vehicle], dict] = field(default=lambda _: {})
    held: tuple[str, ...] = ()
    zeros: bool = False


def of_propulsion(boat: Vehicle) -> dict:
    """The thrust polynomial, each number that is not zero."""
    scale = 0.5 * boat.water_density_kgm3 * boat.length_m**2
    values = {name: boat.body[BODY.index(name)] / scale for name in THRUST}
    return {name: priors.normal(value, PROPULSION * abs(value)) for name, value in values.items() if value}


def of_mechanics(boat: Vehicle) -> dict:
    """Mass, moments of inertia and centre of gravity."""
    mass = boat.body[BODY.index("mass")]
    inertia = {name: boat.body[BODY.index(name)] for name in ("Ixx", "Iyy", "Izz")}
    found = {"mass_kg": priors.normal(mass, MASS * mass)}
    found |= {f"{name}_kgm2": priors.normal(value, INERTIA * value) for name, value in inertia.items()}
    sd = CENTRE * boat.length_m
    return found | {f"{name}_m": priors.normal(boat.body[BODY.index(name)], sd) for name in ("xG", "zG")}


def of_buoyancy(boat: Vehicle) -> dict:
    """Buoyancy that is not the weight, and where it acts."""
    weight = boat.body[BODY.index("mass")] * GRAVITY_MPS2
    centre = boat.body[BODY.index("xB")], CENTRE * boat.length_m
    return {
        "buoyancy_n": priors.normal(boat.body[BODY.index("buoyancy")], TRIM * weight),
        "xB_m": priors.normal(*centre),
    }


def of_start(boat: Vehicle) -> dict:
    """Speeds and attitude at the start, and a steady current."""
    speed = boat.speed_mps
    found = {"u0_mps": priors.normal(speed, SPEED * speed)}
    found |= {f"{name}0_mps": priors.normal(0.0, 0.5 * SPEED * speed) for name in "vw"}
    found |= {f"{name}0_deg": priors.normal(0.0, ANGLE_DEG) for name in ("roll", "pitch", "yaw")}
    return found | {f"current_{to}_mps": priors.normal(0.0, CURRENT * speed) for to in ("north", "east")}


def of_clock(boat: Vehicle) -> dict:
    """When the range reads, later or earlier than its record says."""
    return {"clock_track_s": priors.normal(0.0, CLOCK * boat.length_m / boat.speed_mps)}


def of_all(boat: Vehicle) -> dict:
    """All of these."""
    parts = (of_propulsion, of_mechanics, of_buoyancy, of_start, of_clock)
    return {name: prior for part in parts for name, prior in part(boat).items()}


ASSUMPTIONS = {
    "none": Relaxed("this software's usual fit: added masses free, all else known"),
    "added masses": Relaxed("6: added masses are known", held=ADDED_MASSES),
    "zeros": Relaxed("4: zero coefficients are known", zeros=True),
    "propulsion": Relaxed("7: propulsion is known", of_propulsion),
    "mechanics": Relaxed("8: mass, inertia and centre of gravity are known", of_mechanics),
    "buoyancy": Relaxed("9: the boat is neutrally buoyant", of_buoyancy),
    "start and current": Relaxed("no current, and a start that is known", of_start),
    "clock": Relaxed("a clock that is right", of_clock),
    "all": Relaxed("all at once", of_all, held=ADDED_MASSES, zeros=True),
}


class Trials:
    """The coupled trial of a vehicle on a tracking range, for one assumption.

    Parameters
    ----------
    vehicle : name
    assumption : of ASSUMPTIONS
    """

    def __init__(self, vehicle: str, assumption: str):
        self.boat, relaxed = load_vehicle(vehicle), ASSUMPTIONS[assumption]
        boat, manoeuvre = self.boat, load_manoeuvre("coupled", self.boat)
        record = within(unread(cases.tracking_range(boat), manoeuvre.duration), manoeuvre.duration, boat)
        usual = [name for name, value in zip(NAMES, boat.xi, strict=True) if value]
        prior, free = priors.relative_normal(PRIOR_SD), usual
        if relaxed.zeros:
            prior, free = priors.Given(prior, zeros(boat)), list(NAMES)
        nuisance = relaxed.nuisance(boat)
        step = Problem(boat, manoeuvre, record, free=usual, prior=priors.relative_normal(PRIOR_SD)).simulator.step
        self.relaxed = Problem(boat, manoeuvre, record, free=free, prior=prior, nuisance=nuisance, dt=step)
        fine = true_step(step, manoeuvre)
        self.fine = Problem(boat, manoeuvre, record, free=free, prior=prior, nuisance=nuisance, dt=fine)
        known = [name for name in usual if name not in relaxed.held]
        self.kept = Problem(boat, manoeuvre, record, free=known, prior=priors.relative_normal(PRIOR_SD), dt=step)
        # Those that are compared: free in both fits.
        self.names = [name for name in self.kept.names if name in self.relaxed.names[: self.relaxed.n_coefficients]]

    def trial(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Parameters (n_params,) of a boat of the prior that completes the trial, and its readings (n_readings,)."""
        while True:
            truth = self.fine.prior.sample(rng, 1)
            (readings,) = self.fine.predicted(truth)
            if np.isfinite(readings).all():
                return truth[0], readings + self.fine.sds * rng.standard_normal(len(readings))


def within(record: Record, duration: float, boat: Vehicle) -> Record:
    """A record without the readings that another clock would put before the start or after the end."""
    margin = 6.0 * CLOCK * boat.length_m / boat.speed_mps
    channels = []
    for channel in record.channels:
        inside = (channel.times > margin) & (channel.times < duration - margin)
        channels.append(replace(channel, times=channel.times[inside], values=channel.values[inside]))
    return replace(record, channels=tuple(channels))


def zeros(boat: Vehicle) -> dict:
    """Priors of the coefficients that are zero in a file."""
    found = {}
    for axis in "XYZKMN":
        of_axis = boat.equations.names_of_axis(axis)
        sizes = np.abs(boat.xi[columns(of_axis)])
        if np.any(sizes):
            sd = ZERO * float(np.median(sizes[sizes > 0.0]))
            found |= {name: priors.normal(0.0, sd) for name, size in zip(of_axis, sizes, strict=True) if size == 0.0}
    return found


@cache
def trials_of(vehicle: str, assumption: str) -> Trials:
    """The trials of a case, made once a process."""
    return Trials(vehicle, assumption)


def expected(vehicle: str, assumption: str, n: int, seed: int) -> dict:
    """What fits with the assumption and without it say, by exact sensitivities at the boat of the file, as JSON types.

    Of n boats of the prior with noisy readings, both linear there: how many coefficients either fit knows to 10 %, and
    how often its 90 % intervals hold the truth.
    """
    trials, rng = trials_of(vehicle, assumption), np.random.default_rng([seed, list(ASSUMPTIONS).index(assumption)])
    problem = trials.relaxed
    middle = problem.prior.mean
    sds = np.sqrt(np.diag(np.cov(problem.prior.sample(rng, 4000).T)))
    jacobian = problem.jacobian(middle) * sds  # by parameters in their prior sds
    truths, noise = rng.standard_normal((n, problem.n_params)), rng.standard_normal((n, len(jacobian)))
    data, found = truths @ jacobian.T + noise, {}
    for key, names in (("relaxed", problem.names), ("kept", trials.kept.names)):
        places = [problem.names.index(name) for name in names]
        part = jacobian[:, places]
        covariance = np.linalg.inv(part.T @ part + np.eye(len(places)))
        of_sets = [names.index(name) for name in trials.names]
        off = (data @ part @ covariance - truths[:, places])[:, of_sets]
        sd = np.sqrt(np.diag(covariance))[of_sets]
        relative = sd * sds[[problem.names.index(name) for name in trials.names]]
        relative = relative / np.abs(trials.boat.xi[columns(trials.names)])
        inside = np.mean(np.abs(off) <= NORMAL_90 * sd)
        found[key] = {"known": int(np.count_nonzero(relative <= KNOWN)), "coverage": float(inside)}
    return found | {"n_parameters": problem.n_params, "n_compared": len(trials.names)}


def one(vehicle: str, assumption: str, seed: int, keys: tuple[str, ...], k: int) -> dict:
    """The k-th boat, flown, and fitted with the assumption ("kept") or without it, as JSON types.

    Errors and covariances of coefficients are relative to the values of the file; modes are searched from the truth.
    """
    trials = trials_of(vehicle, assumption)
    rng = np.random.default_rng([seed, list(ASSUMPTIONS).index(assumption), k])
    truth, readings = trials.trial(rng)
    scales, found = np.abs(trials.boat.xi[columns(trials.names)]), {}
    values = dict(zip(trials.relaxed.names, truth, strict=True))
    true = np.array([values[name] for name in trials.names])
    for key in keys:
        problem = trials.relaxed if key == "relaxed" else trials.kept
        start = np.array([values[name] for name in problem.names])
        mode = gauss_newton(problem.with_readings(readings), start, max_iterations=100)
        places = [problem.names.index(name) for name in trials.names]
        sds = np.sqrt(np.diag(mode.covariance))[places] / scales
        errors = (mode.values[places] - true) / scales
        found[key] = {
            "inside": float(np.mean(np.abs(errors) <= NORMAL_90 * sds)),
            "known": int(np.count_nonzero(sds <= KNOWN)),
        }
    return found


def sampled(vehicle: str, seed: int, max_steps: int) -> dict:
    """The posterior of a boat with all assumptions relaxed: whether it has converged, and in what time."""
    trials = trials_of(vehicle, "all")
    _, readings = trials.trial(np.random.default_rng([seed, 99]))
    problem, began = trials.relaxed.with_readings(readings), time.perf_counter()
    posterior = sample(problem, rng=np.random.default_rng(seed), max_steps=max_steps)
    return {
        "seconds": time.perf_counter() - began,
        "converged": posterior.converged,
        "shortcomings": list(posterior.shortcomings),
        "n_parameters": problem.n_params,
    }


def other_sets(vehicle: str, name: str, factors) -> dict[str, float]:
    """Factor of an added mass -> how far off (m) a set is that has it and is the truth but for null vectors.

    Parameters
    ----------
    vehicle : of which every manoeuvre of the study of predictions is flown, the first ten
    name : of the added mass
    factors : of its true value, at which it is held
    """
    boat = load_vehicle(vehicle)
    problem = cases.track_problem(boat, "coupled", [n for n, x in zip(NAMES, boat.xi, strict=True) if x])
    vectors = np.zeros((0, len(NAMES)))
    for vector in null_space(problem, problem.reference).vectors:
        row = np.zeros(len(NAMES))
        row[columns(vector)] = list(vector.values())
        vectors = np.vstack([vectors, row])
    along = vectors[:, INDEX[name]]
    move = along @ vectors / (along @ along)  # of the null space, the smallest that changes the added mass by one
    sets = np.array([boat.xi + (factor - 1.0) * boat.xi[INDEX[name]] * move for factor in factors])
    worst = np.zeros(len(factors))
    for simulator in cases.unseen(boat, 10):
        states, status = simulator.run(np.vstack([boat.xi, sets]))
        off = np.linalg.norm(states[1:, :, :3] - states[0, :, :3], axis=2).max(axis=1)
        worst = np.maximum(worst, np.where(status[1:] == 0, off, np.inf))
    return {f"{factor:g}": float(off) for factor, off in zip(factors, worst, strict=True)}
