"""Ill-conditioning of one case: how well its coefficients are known, beside what, and which errors cancel."""

from dataclasses import dataclass

import numpy as np

from bayesub.findings.coefficient_examinations import number_or_none as finite
from bayesub.inference import identifiability
from bayesub.inference.baselines import sqp
from bayesub.inference.identifiability import Spectrum
from bayesub.model.linear_form import LinearSystem, linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe
from ill_conditioning.collinearity import Collinearity, collinearity
from ill_conditioning.contribution import Cancellation, Contribution, cancellation, contribution
from ill_conditioning.profile import Profile, profile
from ill_conditioning.sds import alone_sd, cramer_rao_sd, held_sd, null_part, sharper_sensors
from thesis.cases import length_scale, time_scale

POSITION_SD, ATTITUDE_SD, INTERVAL = 0.5, 0.1, 1.0  # m, deg, s, on suboff
PRIOR_SD = 0.25
KNOWN = 0.05  # relative sd that counts as known
COST_INTERVAL = 0.1  # s, of the thesis's cost function
SQP_ITERATIONS = (50, 100, 200)
SEED = 28
N_GRID = 17
N_SAMPLES = 400  # of force errors, besides the largest of each term
REGRESSORS = ("Xvv", "Xvr", "Xrr")


@dataclass(frozen=True)
class Conditioning:
    """What is asked of one vehicle on one manoeuvre.

    Attributes
    ----------
    spectrum : at the truth, which is its `values`
    collinearity : axis -> of its regressors
    contribution : of each coefficient alone, in m^2 + deg^2 (model manual, section 10)
    accuracy : the same cost of the simulator's time step
    sqp_cost : cost of the set that SQP stopped at
    times : (n_samples,) s, of the force errors
    cancellation : axis -> force errors of the set that SQP stopped at
    profiles : verdict -> profile of the coefficient with the extreme verdict
    regressors : (n, 3) columns of the axis X of REGRESSORS; (0, 3) if not all of them are there
    """

    spectrum: Spectrum
    collinearity: dict[str, Collinearity]
    contribution: Contribution
    accuracy: float
    sqp_cost: float
    times: np.ndarray
    cancellation: dict[str, Cancellation]
    profiles: dict[str, Profile]
    regressors: np.ndarray

    def numbers(self) -> dict:
        """What is worth keeping, as JSON types; null stands for infinite."""
        s = self.spectrum
        size = np.abs(s.values)
        columns = {
            "alone": alone_sd(s) / size,
            "cramer_rao": cramer_rao_sd(s) / size,
            "null_held": held_sd(s) / size,
            "posterior": s.posterior_sd / size,
            "null_part": null_part(s),
            "sharper_sensors": sharper_sensors(s, KNOWN),
            "cost_at_25_percent": self.contribution.costs[0],
            "cost_at_99_percent": self.contribution.costs[1],
        }
        return {
            "n_params": len(s.names),
            "n_null": s.n_null,
            "n_sharpened": s.n_informed,
            "singular_values": s.singular_values.tolist(),
            "coefficients": {n: {key: finite(c[k]) for key, c in columns.items()} for k, n in enumerate(s.names)},
            "condition_index": {axis: float(c.condition_indices[-1]) for axis, c in self.collinearity.items()},
            "vif": {n: finite(v) for c in self.collinearity.values() for n, v in zip(c.names, c.vif, strict=True)},
            "involved": {axis: list(c.involved(-1)) for axis, c in self.collinearity.items()},
            "null_by_axis": {a: len(c.names) - len(c.condition_indices) for a, c in self.collinearity.items()},
            "simulator_cost": self.accuracy,
            "sqp_cost": self.sqp_cost,
            "largest_force_errors": {axis: c.largest for axis, c in self.cancellation.items()},
            "largest_sum": {axis: float(np.abs(c.total).max()) for axis, c in self.cancellation.items()},
            "profiles": {
                verdict: {"name": p.name, "grid": p.grid.tolist()}
                | {key: [finite(x) for x in getattr(p, key)] for key in ("cost", "laplace")}
                for verdict, p in self.profiles.items()
            },
        }

    def arrays(self) -> dict[str, np.ndarray]:
        """What figures need besides the numbers; of force errors some samples and the largest."""
        s = self.spectrum
        arrays = {"directions": s.directions.astype(np.float32), "prior_sd": s.prior_sd, "values": s.values}
        arrays["regressors"] = self.regressors.astype(np.float32)
        peaks = [np.abs(np.column_stack([c.errors, c.total])).argmax(axis=0) for c in self.cancellation.values()]
        samples = np.arange(0, len(self.times), -(-len(self.times) // N_SAMPLES))
        samples = np.unique(np.concatenate([samples, *peaks]))
        arrays["times"] = self.times[samples]
        for axis, c in self.collinearity.items():
            arrays[f"correlation_{axis}"] = c.correlation
        for axis, c in self.cancellation.items():
            arrays[f"errors_{axis}"] = c.errors[samples].astype(np.float32)
        return arrays


def analyse(vehicle: str, manoeuvre: str, converged: float) -> Conditioning:
    """Everything that is asked of one vehicle on one manoeuvre.

    Parameters
    ----------
    vehicle : name
    manoeuvre : name
    converged : cost at which SQP counts as converged, m^2 + deg^2 on a boat of suboff's length
    """
    boat = load_vehicle(vehicle)
    truth = simulate(boat, load_manoeuvre(manoeuvre, boat))
    size = length_scale(boat)
    names = [name for system in linear_systems(truth).values() for name in system.names]
    problem = noise_free(truth, names, POSITION_SD * size, ATTITUDE_SD, INTERVAL)
    at = problem.prior.mean
    systems, null = linear_systems(truth, free=problem.names), identifiability.null_space(problem, at)
    spectrum = identifiability.fisher(problem, at, null.vectors)
    cost, fine = (noise_free(truth, names, 1.0, 1.0, COST_INTERVAL, dt=problem.simulator.step / n) for n in (1, 10))
    unique = noise_free(truth, [name for name in problem.names if name not in null.pivots], size, 1.0, INTERVAL)
    sqp_cost, changes = stopped_set(unique, converged)
    surge = systems["X"]
    present = set(REGRESSORS) <= set(surge.names)
    return Conditioning(
        spectrum=spectrum,
        collinearity={a: collinearity(s, null.ranks[a].null_vectors) for a, s in systems.items()},
        contribution=contribution(cost, at),
        accuracy=float(np.sum(((cost.readings - fine.readings) / cost.sds) ** 2)),
        sqp_cost=sqp_cost,
        times=truth.times,
        cancellation={axis: cancellation(s, changes) for axis, s in systems.items()},
        profiles=extreme_profiles(problem, spectrum, null.vectors),
        regressors=surge.matrix[:, [surge.names.index(n) for n in REGRESSORS]] if present else np.empty((0, 3)),
    )


def noise_free(truth: Trajectory, free, position_sd, attitude_sd, interval, dt=None) -> Problem:
    """A problem whose readings are what the true coefficients give.

    Parameters
    ----------
    truth : the true motion
    free : names of coefficients
    position_sd : m, the weight of the readings of position
    attitude_sd : degrees, that of attitude
    interval : s on suboff, about
    dt : time step of the simulation, s; by default that which the readings ask for
    """
    boat, flown = truth.simulator.vehicle, truth.simulator.manoeuvre
    interval = flown.duration / round(flown.duration / (interval * time_scale(boat)))
    record = observe(truth, Track(position_sd, attitude_sd, interval), np.random.default_rng(0))
    problem = Problem(boat, flown, record, free=free, prior=priors.relative_normal(PRIOR_SD), dt=dt)
    return problem.with_readings(problem.predicted(problem.prior.mean)[0])


def stopped_set(problem: Problem, converged: float) -> tuple[float, dict[str, float]]:
    """Cost of a set that SQP stopped at, and by how much its coefficients are wrong; the others are known.

    The search is given more iterations until its cost is that of the thesis's converged sets (in m^2 scaled to suboff),
    because on noise-free readings it would in the end find the truth.
    """
    for n_iterations in SQP_ITERATIONS:
        estimate = sqp(problem, rng=np.random.default_rng(SEED), n_starts=1, max_iterations=n_iterations)
        cost = estimate.costs[0] * INTERVAL / COST_INTERVAL
        if cost < converged:
            break
    return float(cost), dict(zip(problem.names, estimate.values - problem.prior.mean, strict=True))


def extreme_profiles(problem: Problem, spectrum: Spectrum, null) -> dict[str, Profile]:
    """Profile likelihoods of the coefficients with the extreme verdicts."""
    s, at = spectrum, spectrum.values
    bound = cramer_rao_sd(s)
    relative = bound / np.abs(at)
    unique = np.isfinite(relative)
    chosen = {
        "best known": np.argmin(relative),
        "most imitated": np.argmax(np.where(unique, bound / alone_sd(s), 0.0)),
        "worst known": np.argmax(np.where(unique, relative, 0.0)),
    }
    if s.n_null:
        chosen["null direction"] = np.argmax(null_part(s))
    profiles = {}
    for verdict, k in chosen.items():
        reach = min(4.0 * bound[k], 0.75 * abs(at[k]))
        grid = at[k] + reach * np.linspace(-1.0, 1.0, N_GRID)
        profiles[verdict] = profile(problem, at, s.names[k], grid, null=null)
    return profiles


def restored_spectrum(numbers: dict, arrays: dict | None = None) -> Spectrum:
    """The spectrum of saved numbers; without the arrays it has singular values only."""
    arrays = arrays or {"directions": np.empty((0, 0)), "prior_sd": np.empty(0), "values": np.empty(0)}
    names, values = tuple(numbers["coefficients"]), np.array(numbers["singular_values"])
    return Spectrum(names, values, arrays["directions"], arrays["prior_sd"], numbers["n_null"], arrays["values"])


def restored_contribution(numbers: dict) -> Contribution:
    """The contributions of saved numbers."""
    rows = numbers["coefficients"].values()
    costs = [[row[key] for row in rows] for key in ("cost_at_25_percent", "cost_at_99_percent")]
    return Contribution(tuple(numbers["coefficients"]), (0.25, 0.99), np.array(costs, dtype=float))


def restored_profiles(numbers: dict) -> dict[str, Profile]:
    """The profiles of saved numbers, without their paths; the truth is in the middle of a grid."""
    profiles = {}
    for verdict, p in numbers["profiles"].items():
        grid, cost, laplace = (np.array(p[key], dtype=float) for key in ("grid", "cost", "laplace"))
        profiles[verdict] = Profile(p["name"], grid[len(grid) // 2], grid, cost, laplace, np.empty((len(grid), 0)))
    return profiles


def names_by_axis(numbers: dict) -> dict[str, tuple[str, ...]]:
    """Axis -> coefficients of its columns."""
    return {axis: tuple(name for name in numbers["vif"] if name[0] == axis) for axis in numbers["condition_index"]}


def restored_collinearity(numbers: dict, arrays: dict) -> dict[str, Collinearity]:
    """Axis -> correlations of its regressors; of the condition indices there is the largest, and no proportions."""
    related = {}
    for axis, names in names_by_axis(numbers).items():
        vif = np.array([numbers["vif"][name] for name in names], dtype=float)
        indices = np.array([numbers["condition_index"][axis]])
        correlation = arrays[f"correlation_{axis}"]
        related[axis] = Collinearity(axis, names, correlation, vif, indices, np.empty((0, len(names))))
    return related


def restored_cancellation(numbers: dict, arrays: dict) -> dict[str, Cancellation]:
    """Axis -> force errors at the samples that were saved."""
    names = names_by_axis(numbers)
    return {axis: Cancellation(axis, names[axis], arrays[f"errors_{axis}"].astype(float)) for axis in names}


def restored_regressors(arrays: dict) -> LinearSystem:
    """The axis X with the columns that were saved."""
    matrix = arrays["regressors"].astype(float)
    return LinearSystem("X", REGRESSORS, matrix, np.zeros(len(matrix)))
