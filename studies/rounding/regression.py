"""Linear least squares on a motion whose velocities and accelerations are rounded (thesis section 9.6)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bayesub.inference.baselines import linear_least_squares
from bayesub.model.coefficients import NAMES, columns
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import Vehicle
from rounding.total_least_squares import total_least_squares
from thesis.measured_motion import measure

FITS = ("rounded", "rounded load only", "total least squares")
BIASED = 4.0  # standard errors of a mean


def trials(boat: Vehicle, n: int, resolution: tuple[float, float], held) -> Iterator[dict]:
    """The trials of the first `n` random manoeuvres, without those that have no result (:func:`trial`)."""
    results = (trial(boat, seed, resolution, held) for seed in range(n))
    return (result for result in results if result is not None)


def trial(boat: Vehicle, seed: int, resolution: tuple[float, float], held) -> dict | None:
    """One random manoeuvre: estimates and standard errors by fit, and how well the estimates reproduce the track.

    Parameters
    ----------
    resolution : of velocities, m/s, and of accelerations, m/s^2
    held : names of the coefficients that count as known

    Returns
    -------
    dict or None
        ``names`` (n,), ``values`` and ``standard_errors`` (n,) by fit, and ``position_m``, the largest position error
        of the estimate from rounded data, None if its simulation fails. There is no result if the boat leaves the
        envelope, or if the manoeuvre is so poor that the coefficients are not unique.
    """
    motion = simulate(boat, load_manoeuvre(f"random:{seed}", boat))
    if motion.status[0] != "ok":
        return None
    exact = linear_systems(motion)
    velocity, acceleration = resolution
    rounded = linear_systems(measure(motion, velocity_resolution=velocity, acceleration_resolution=acceleration))
    truth = dict(zip(NAMES, boat.xi, strict=True))
    load_only = {axis: replace(system, load=rounded[axis].load) for axis, system in exact.items()}
    errors = {axis: column_errors(rounded[axis], exact[axis]) for axis in exact}
    estimates = {
        "rounded": linear_least_squares(rounded, truth, held=held),
        "rounded load only": linear_least_squares(load_only, truth, held=held),
    }
    if any(estimate.covariance is None for estimate in estimates.values()):
        return None
    estimates["total least squares"] = total_least_squares(rounded, truth, held=held, errors=errors)
    estimate = estimates["rounded"]
    xi = boat.xi.copy()
    xi[columns(estimate.names)] = estimate.values
    again = motion.simulator.trajectory(xi)
    distance = np.linalg.norm(again.states[0, :, :3] - motion.states[0, :, :3], axis=1).max()
    return {
        "names": list(estimate.names),
        "values": {fit: estimates[fit].values.tolist() for fit in FITS},
        "standard_errors": {fit: np.sqrt(np.diag(estimates[fit].covariance)).tolist() for fit in FITS[:2]},
        "position_m": float(distance) if again.status[0] == "ok" else None,
    }


def column_errors(rounded, exact) -> np.ndarray:
    """Root mean square errors (n + 1,) of the columns and the load, for total least squares.

    Columns whose errors are round-off are exact. The load must not be: that of K is if zG is zero, and then counts as
    known to six digits.
    """
    errors = np.column_stack([rounded.matrix - exact.matrix, rounded.load - exact.load])
    sizes = np.linalg.norm(np.column_stack([exact.matrix, exact.load]), axis=0)
    rms = np.sqrt(np.mean(errors**2, axis=0))
    rms = np.where(np.linalg.norm(errors, axis=0) > 1e-12 * sizes, rms, 0.0)
    rms[-1] = max(rms[-1], 1e-6 * sizes[-1] / np.sqrt(len(errors)))
    return rms


def errors(results: list[dict], xi) -> dict[str, np.ndarray]:
    """Fit -> (n_trials, n) estimates of the trials less the truth, which is in xi (101,)."""
    truth = xi[columns(results[0]["names"])]
    return {fit: np.array([result["values"][fit] for result in results]) - truth for fit in FITS}


def summary(results: list[dict], xi) -> dict:
    """Over the trials: errors by fit, their bias in standard errors of the mean, coverage of classical 95 % intervals.

    Parameters
    ----------
    results : of :func:`trial`
    xi : (101,) the true coefficients
    """
    names = results[0]["names"]
    truth, everything = xi[columns(names)], errors(results, xi)
    ratios = 1 + everything["rounded"][:, truth != 0] / truth[truth != 0]
    fits = {}
    round_off = 1e-6 * everything["rounded"].std(axis=0)
    for fit, values in everything.items():
        spread = values.std(axis=0, ddof=1)
        bias = np.where(spread > round_off, values.mean(axis=0) / np.maximum(spread, round_off), 0.0)
        fits[fit] = {
            "bias_in_standard_errors": (np.sqrt(len(results)) * bias).tolist(),
            "bias_over_spread": bias.tolist(),
            "error_quartiles": np.quantile(values, [0, 0.25, 0.5, 0.75, 1], axis=0).tolist(),
        }
        if fit in results[0]["standard_errors"]:
            standard = np.array([result["standard_errors"][fit] for result in results])
            fits[fit]["coverage"] = np.mean(np.abs(values) <= 1.96 * standard, axis=0).tolist()
            fits[fit]["mean_standardised_error"] = (values / standard).mean(axis=0).tolist()
    return {
        "n_manoeuvres": len(results),
        "names": names,
        "truth": truth.tolist(),
        "position_m": [result["position_m"] for result in results],
        "fits": fits,
        "ratios": [float(ratios.min()), float(ratios.max())],
    }


def biased(fit: dict) -> np.ndarray:
    """(n,) whether the mean error of a coefficient is beyond four of its standard errors."""
    return np.abs(fit["bias_in_standard_errors"]) > BIASED
