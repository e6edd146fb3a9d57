"""Three treatments of rounded readings: the rounding interval, normal noise, and linear least squares.

Every trial is of a boat from the prior (:class:`thesis.prior_trials.PriorTrials`), and every search begins at
the truth: the question is what the likelihoods say and not whether a search succeeds.
"""

import numpy as np
from scipy import linalg

from bayesub.inference.baselines import Estimate, gauss_newton, linear_least_squares
from bayesub.inference.sampling import sample
from bayesub.model.coefficients import NAMES, columns
from bayesub.model.linear_form import linear_systems
from bayesub.problem.problem import Problem
from thesis.coverage import RepeatedTrials
from thesis.measured_motion import recorded
from thesis.prior_trials import PriorTrials

FITS = ("rounded", "normal", "linear")


def linear_fit(truth, problem: Problem, held) -> tuple[Estimate, np.ndarray]:
    """Linear least squares on the readings of a trial.

    Parameters
    ----------
    truth : (n_params,)
    held : names of coefficients that are known

    Returns
    -------
    estimate : of the coefficients that are not held
    places : (n,) their positions among the free coefficients
    """
    xi = problem.coefficient_sets(truth)[0]
    systems = linear_systems(recorded(problem.record, problem.simulator, xi), free=problem.names)
    estimate = linear_least_squares(systems, dict(zip(NAMES, xi, strict=True)), held=held)
    return estimate, np.array([problem.names.index(name) for name in estimate.names])


def compare(trials: PriorTrials, rng: np.random.Generator, n_trials: int, n_from_centre: int, held) -> dict:
    """Errors and stated intervals of the three treatments of the same records, as JSON types.

    Parameters
    ----------
    n_from_centre : trials whose search is repeated from the centre of the prior
    held : names of the coefficients that linear least squares is given
    """
    errors, covariances = {fit: [] for fit in FITS}, {fit: [] for fit in FITS}
    same, converged = [], []
    for n in range(n_trials):
        truth, problem, _ = trials.trial(rng)
        rounded, (linear, places) = gauss_newton(problem, truth), linear_fit(truth, problem, held)
        estimates = rounded, gauss_newton(problem.naive(), truth), linear
        for fit, estimate, true in zip(FITS, estimates, (truth, truth, truth[places]), strict=True):
            errors[fit].append(estimate.values - true)
            covariances[fit].append(estimate.covariance)
        converged.append(rounded.statuses[0] == "converged")
        if n < n_from_centre:
            same.append(gauss_newton(problem).costs[0] < rounded.costs[0] + 0.1)
    names = (problem.names, problem.names, linear.names)
    return {
        "n_readings": problem.record.n_readings,
        "n_params": problem.n_params,
        "n_trials": n_trials,
        "converged": float(np.mean(converged)),
        "found_from_centre": float(np.mean(same)),
        "fits": {
            fit: summary(RepeatedTrials(np.array(errors[fit]), np.array(covariances[fit])), own, trials.boat.xi)
            for fit, own in zip(FITS, names, strict=True)
        },
    }


def summary(trials: RepeatedTrials, names, xi) -> dict:
    """Of each coefficient bias, width and coverage, of all together mean coverage and joint error; xi (101,)."""
    scale = np.abs(xi[columns(names)])
    per_coefficient = {
        "coverage_95": trials.coverage(0.95),
        "coverage_50": trials.coverage(0.5),
        "bias_in_sd": trials.standardised.mean(axis=0),
        "rms_in_sd": np.sqrt((trials.standardised**2).mean(axis=0)),
        "bias_over_truth": trials.errors.mean(axis=0) / scale,
        "sd_over_truth": np.median(trials.sds, axis=0) / scale,
    }
    return {
        "names": list(names),
        **{key: [float(f"{v:.4g}") for v in values] for key, values in per_coefficient.items()},
        "mean_coverage_95": trials.mean_coverage(0.95),
        "mean_coverage_50": trials.mean_coverage(0.5),
        "joint": float(np.median(trials.joint)),
    }


def determined(problem: Problem, share: float) -> np.ndarray:
    """(n_params,) whether the readings reduce the prior sd of a coefficient to less than a `share` of it."""
    estimate = gauss_newton(problem, problem.prior.mean)
    return np.sqrt(np.diag(estimate.covariance)) < share * problem.prior.sd


def compare_widths(trials: PriorTrials, rng: np.random.Generator, n_trials: int, chosen) -> dict:
    """Rounding interval against normal noise: coverage, errors and widths of the `chosen` (n_params,) coefficients."""
    errors, covariances = {fit: [] for fit in FITS[:2]}, {fit: [] for fit in FITS[:2]}
    for _ in range(n_trials):
        truth, problem, _ = trials.trial(rng)
        estimates = gauss_newton(problem, truth), gauss_newton(problem.naive(), truth)
        for fit, estimate in zip(FITS[:2], estimates, strict=True):
            errors[fit].append(estimate.values - truth)
            covariances[fit].append(estimate.covariance)
    result, widths = {"n_readings": problem.record.n_readings, "n_trials": n_trials}, {}
    for fit in FITS[:2]:
        every = RepeatedTrials(np.array(errors[fit]), np.array(covariances[fit]))
        some = RepeatedTrials(every.errors[:, chosen], every.covariances[:, chosen][:, :, chosen])
        widths[fit] = np.median(some.sds, axis=0)
        result[fit] = {
            "mean_coverage_95": some.mean_coverage(0.95),
            "rms_in_sd": float(np.sqrt(np.mean(some.standardised**2))),
            "joint": float(np.median(every.joint)),
            "sd_over_prior": float(np.median(widths[fit] / trials.problem.prior.sd[chosen])),
        }
    pairs = zip(covariances["normal"], covariances["rounded"], strict=True)
    return result | {
        "width_ratio": float(np.median(widths["normal"] / widths["rounded"])),
        "largest_width_ratio": float(np.median([np.sqrt(largest_ratio(*pair)) for pair in pairs])),
    }


def largest_ratio(covariance, other) -> float:
    """The largest ratio of the variances of two covariances (n, n) over all directions."""
    scale = np.sqrt(np.outer(np.diag(other), np.diag(other)))
    return float(linalg.eigh(covariance / scale, other / scale, eigvals_only=True)[-1])


def compare_with_sampling(trials: PriorTrials, rng: np.random.Generator) -> dict:
    """Mean and sd of the posterior of one trial, by the Laplace approximation and by sampling."""
    truth, problem, _ = trials.trial(rng)
    laplace, posterior = gauss_newton(problem, truth), sample(problem, rng=rng)
    return {
        "names": list(problem.names),
        "shift_in_sd": ((laplace.values - posterior.mean) / posterior.sd).tolist(),
        "sd_ratio": (np.sqrt(np.diag(laplace.covariance)) / posterior.sd).tolist(),
        "shortcomings": list(posterior.shortcomings),
        "seconds": posterior.seconds,
    }
