"""Deterministic methods on one case of the thesis: searches on the track, linear fits, and the noise each survives."""

import numpy as np
from scipy import stats

from bayesub.inference.baselines import linear_least_squares, linear_programme, sqp, trust_region
from bayesub.inference.baselines.estimate import Estimate
from bayesub.model.coefficients import INDEX, NAMES
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem.problem import Problem
from thesis import cases
from thesis.measured_motion import measure

LOST = 0.1  # a coefficient is lost when its standard error is the spread of the starts
VELOCITY_NOISE = 1e-5  # m/s, in the linear range; accelerations get as many m/s^2
TRACK_NOISE = 1e-3  # m and degrees


def compare(vehicle: str, manoeuvre: str, n_starts: int, n_free: int, max_iterations: int) -> dict:
    """All methods on one vehicle and manoeuvre, as JSON types.

    Parameters
    ----------
    vehicle : name
    manoeuvre : name
    n_starts : searches of SQP by the thesis's rule
    n_free : searches of each other kind, to their own end
    max_iterations : of SQP
    """
    starts, noise = cases.streams(vehicle, manoeuvre)
    boat, held = load_vehicle(vehicle), cases.held(manoeuvre)
    flown = simulate(boat, load_manoeuvre(manoeuvre, boat))
    problem = cases.track_problem(boat, manoeuvre, cases.free_coefficients(boat, manoeuvre))
    truth = boat.xi[problem.columns]
    by_rule = cases.identify(problem, starts, n_starts, max_iterations)
    searches = {
        "trust_region": trust_region(problem, rng=starts, n_starts=n_free, bounds=None),
        "trust_region_bounded": trust_region(problem, rng=starts, n_starts=n_free),
        "sqp_exact": sqp(problem, rng=starts, n_starts=n_free, max_iterations=max_iterations),
        "sqp_forward": sqp(problem, rng=starts, n_starts=n_free, gradients="forward", max_iterations=max_iterations),
    }
    linear = linear_fits(boat, linear_systems(flown), held, problem.names)
    errors = {"trust_region": np.abs(searches["trust_region"].values / truth - 1).tolist(), **linear.pop("errors")}
    errors["SQP"] = np.sqrt(np.mean((by_rule.solutions / truth - 1) ** 2, axis=0)).tolist()
    return {
        "names": list(problem.names),
        "step_s": problem.simulator.step,
        "sqp": search_numbers(problem, by_rule) | {"ratios": (by_rule.solutions / truth).tolist()},
        "searches": {key: search_numbers(problem, estimate) for key, estimate in searches.items()},
        "linear": linear,
        "errors": errors,
        "lost_at": noise_limits(boat, problem, flown, held, noise),
        "noisy_track": noisy_track(boat, manoeuvre, problem, noise),
    }


def search_numbers(problem: Problem, estimate: Estimate) -> dict:
    """What Tables 10 to 27 give of a set of searches, search by search."""
    truth = problem.vehicle.xi[problem.columns]
    before, after = np.abs(estimate.starts / truth - 1), np.abs(estimate.solutions / truth - 1)
    xuu = list(problem.names).index("Xuu") if "Xuu" in problem.names else None
    return {
        "initial_costs": np.sum(problem.residuals(estimate.starts) ** 2, axis=1).tolist(),
        "costs": estimate.costs.tolist(),
        "position_m": position_errors(problem, estimate.solutions).tolist(),
        "efforts": estimate.efforts.tolist(),
        "seconds": estimate.seconds / len(estimate.costs),
        "starts": (estimate.starts / truth).tolist(),
        "largest_error": after.max(axis=1).tolist(),
        "share_further": float(np.mean(np.median(after, axis=0) > np.median(before, axis=0))),
        "Xuu_error": None if xuu is None else float(np.median(after[:, xuu])),
        "statuses": sorted(set(estimate.statuses)),
    }


def position_errors(problem: Problem, solutions) -> np.ndarray:
    """(n_starts,) largest distance of solutions (n_starts, n_params) from the true track, m."""
    truth = problem.trajectory(problem.vehicle.xi[problem.columns]).states[0, :, :3]
    return np.linalg.norm(problem.trajectory(solutions).states[:, :, :3] - truth, axis=2).max(axis=1)


def mean_with_error(values, probability: float = 0.95) -> tuple[float, float]:
    """Mean of independent values (n,), and half the width of its interval by Student's t distribution."""
    n = len(values)
    error = stats.t.ppf(0.5 + probability / 2, n - 1) * np.std(values, ddof=1) / np.sqrt(n)
    return float(np.mean(values)), float(error)


def shares_further(search: dict) -> np.ndarray:
    """(n_starts,) share of the coefficients that each search left further from the truth than it began."""
    before, after = (np.abs(np.array(search[key]) - 1) for key in ("starts", "ratios"))
    return np.mean(after > before, axis=1)


def linear_fits(boat: Vehicle, systems: dict, held, names) -> dict:
    """Relative errors without noise of linear programming and least squares from a guess 10 % off, seconds by axis.

    The error of a coefficient whose axis has no solution is None. Coefficients that are zero are free too: the largest
    of their errors is in orders of magnitude below the smallest of the coefficients `names`.
    """
    off = np.where(np.isin(NAMES, held), 1.0, 1.1)
    guess = dict(zip(NAMES, off * boat.xi, strict=True))
    seconds, errors, zeros = {}, {}, {}
    smallest = min(abs(boat.xi[INDEX[name]]) for name in names)
    for method, fit in (("LP", linear_programme), ("LLS", linear_least_squares)):
        estimates = {axis: fit({axis: system}, guess, held=held) for axis, system in systems.items()}
        values = {n: v for e in estimates.values() for n, v in zip(e.names, e.values, strict=True)}
        relative = [abs(float(values[name] / boat.xi[INDEX[name]] - 1)) for name in names]
        errors[method] = [error if np.isfinite(error) else None for error in relative]
        seconds[method] = {axis: estimate.seconds for axis, estimate in estimates.items()}
        zero = [abs(v) for n, v in values.items() if boat.xi[INDEX[n]] == 0.0 and np.isfinite(v)]
        largest = max(zero, default=0.0)
        zeros[method] = float(np.log10(smallest / largest)) if largest > 0.0 else None
    return {"seconds": seconds, "errors": errors, "zeros": zeros}


def noise_limits(boat: Vehicle, problem: Problem, flown, held, rng: np.random.Generator) -> dict:
    """Noise at which the standard error of a coefficient is 10 %: of the track (m and degrees), of velocities (m/s).

    Of the track by the covariance at the truth. Of velocities by the errors of ten fits with little noise, because
    errors in the matrix have no simple covariance.
    """
    truth = boat.xi[problem.columns]
    jacobian = problem.jacobian(truth)
    lengths = np.linalg.norm(jacobian, axis=0)
    _, s, vt = np.linalg.svd(jacobian / lengths, full_matrices=False)
    sd = np.linalg.norm(vt.T / s, axis=1) / lengths / np.abs(truth)
    guess = dict(zip(NAMES, boat.xi, strict=True))
    errors = []
    for _ in range(10):
        motion = measure(flown, velocity_sd=VELOCITY_NOISE, acceleration_sd=VELOCITY_NOISE, rng=rng)
        estimate = linear_least_squares(linear_systems(motion), guess, held=held)
        place = [estimate.names.index(name) for name in problem.names]
        errors.append(estimate.values[place] / truth - 1)
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    return {
        "track_m": dict(zip(problem.names, (LOST / sd).tolist(), strict=True)),
        "velocity_mps": dict(zip(problem.names, (LOST * VELOCITY_NOISE / spread).tolist(), strict=True)),
    }


def noisy_track(boat: Vehicle, manoeuvre: str, problem: Problem, rng: np.random.Generator) -> dict:
    """Trust region on a track with 1 mm and 0.001 degrees of noise: errors of the coefficients and what they should be.

    It starts at the truth: the question is what the data say, not whether the search finds it.
    """
    noisy = cases.track_problem(boat, manoeuvre, problem.names, rng=rng, sd=TRACK_NOISE)
    estimate = trust_region(noisy, rng=rng, start_spread=0.0, bounds=None)
    truth, covariance = boat.xi[problem.columns], estimate.covariance
    standard = None if covariance is None else (np.sqrt(np.diag(covariance)) / np.abs(truth)).tolist()
    return {
        "errors": np.abs(estimate.values / truth - 1).tolist(),
        "chi_square_per_reading": estimate.costs[0] / noisy.record.n_readings,
        "standard_errors": standard,
    }
