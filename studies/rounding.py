"""What does rounding velocities to 1 cm/s and accelerations to 1 mm/s^2 do to coefficients from linear least squares?

Question: the thesis's section 9.6 finds coefficients up to 250 times too large and tracks reproduced. Is that noise?
Claim: it is bias. Rounding errors stand in the matrix as well as in the load, so that the mean error over 100 random
manoeuvres is many standard errors from zero, and classical 95 % intervals miss the truth far more often than 5 % of the
time. With the exact matrix and the same rounded load the bias is gone. Total least squares is no remedy: columns share
the velocities they are made of, and it takes their errors for independent.
Cost: two minutes.
"""

from dataclasses import replace

import numpy as np

import bayesub as bs
from bayesub.baselines import linear_least_squares, total_least_squares
from bayesub.model.linear_form import linear_systems
from bayesub.model.measured_motion import measure
from bayesub.report.markdown import table
from bayesub.thesis.cases import published
from bayesub.thesis.plots import rounding as plots

VEHICLES = ("suboff", "auv690", "npsauv")
N_MANOEUVRES = 100
VELOCITY_RESOLUTION, ACCELERATION_RESOLUTION = 0.01, 0.001  # m/s, m/s^2 (thesis section 9.6)
SUBOFF = (102.2606, 7.5)  # length (m) and speed (m/s) to which scaled resolutions refer
FITS = ("rounded", "rounded load only", "total least squares")


def run(folder, *, quick, progress):
    """Errors, standard errors and coverage of every coefficient, for each vehicle and pair of resolutions."""
    held = published()["rank"]["fixed_added_mass"]["coupled"]
    vehicles, n_manoeuvres = (VEHICLES[:1], 8) if quick else (VEHICLES, N_MANOEUVRES)
    cases = [
        (vehicle, scaled) for vehicle in vehicles for scaled in ((False, True) if vehicle != "suboff" else (False,))
    ]
    numbers = {}
    for vehicle, scaled in cases:
        case = f"{vehicle}, scaled" if scaled else vehicle
        progress.stage(case)
        boat = bs.load_vehicle(vehicle)
        trials = []
        for seed in range(n_manoeuvres):
            trials.append(trial(boat, seed, resolutions(boat, scaled), held))
            progress.update((seed + 1) / n_manoeuvres, f"{seed + 1} of {n_manoeuvres} manoeuvres")
        numbers[case] = summary(boat, [t for t in trials if t is not None], resolutions(boat, scaled))
        for suffix in ("png", "pdf"):
            plots.draw_ratios(folder / f"ratios_{case.replace(', ', '_')}.{suffix}", numbers[case])
    for suffix in ("png", "pdf"):
        plots.draw_coverage(folder / f"coverage.{suffix}", numbers)
        plots.draw_tracks(folder / f"tracks.{suffix}", numbers)
    (folder / "rounding.md").write_text(tables(numbers))
    for case, result in numbers.items():
        check(case, result)
        for entry in result["fits"].values():
            entry["error_quartiles"] = np.quantile(entry.pop("errors"), [0, 0.25, 0.5, 0.75, 1], axis=0).tolist()
    return numbers


def resolutions(boat, scaled):
    """Resolutions of velocity and acceleration: the thesis's, or those with the same relation to speed and length."""
    length, speed = SUBOFF
    ratio = boat.speed_mps / speed if scaled else 1.0
    return VELOCITY_RESOLUTION * ratio, ACCELERATION_RESOLUTION * (ratio**2 * length / boat.length_m if scaled else 1.0)


def trial(boat, seed, resolution, held):
    """One random manoeuvre: estimates and standard errors by fit, and how well the estimates reproduce the track.

    None if the boat leaves the envelope, or if the manoeuvre is so poor that the coefficients are not unique.
    """
    flown = bs.simulate(boat, bs.load_manoeuvre(f"random:{seed}", boat))
    if flown.status[0] != "ok":
        return None
    exact = linear_systems(flown)
    motion = measure(flown, velocity_resolution=resolution[0], acceleration_resolution=resolution[1])
    rounded = linear_systems(motion)
    truth = dict(zip(bs.coefficients.NAMES, boat.xi, strict=True))
    errors = {axis: column_errors(rounded[axis], exact[axis]) for axis in exact}
    estimates = {
        "rounded": linear_least_squares(rounded, truth, held=held),
        "rounded load only": linear_least_squares(
            {axis: replace(system, load=rounded[axis].load) for axis, system in exact.items()}, truth, held=held
        ),
        "total least squares": total_least_squares(rounded, truth, held=held, errors=errors),
    }
    if any(estimates[fit].covariance is None for fit in FITS[:2]):
        return None
    found = estimates["rounded"]
    xi = boat.xi.copy()
    xi[bs.coefficients.columns(found.names)] = found.values
    again = flown.simulator.trajectory(xi)
    off = np.linalg.norm(again.states[0, :, :3] - flown.states[0, :, :3], axis=1).max()
    return {
        "names": found.names,
        "values": {fit: estimates[fit].values for fit in FITS},
        "standard_errors": {fit: np.sqrt(np.diag(estimates[fit].covariance)) for fit in FITS[:2]},
        "position_m": float(off) if again.status[0] == "ok" else None,
    }


def column_errors(rounded, exact):
    """Root mean square errors of the columns and the load, which total least squares is told.

    Columns whose errors are round-off are exact. The load must not be: that of K is if zG is zero, and then counts as
    known to six digits.
    """
    errors = np.column_stack([rounded.matrix - exact.matrix, rounded.load - exact.load])
    sizes = np.linalg.norm(np.column_stack([exact.matrix, exact.load]), axis=0)
    rms = np.sqrt(np.mean(errors**2, axis=0))
    rms = np.where(np.linalg.norm(errors, axis=0) > 1e-12 * sizes, rms, 0.0)
    rms[-1] = max(rms[-1], 1e-6 * sizes[-1] / np.sqrt(len(errors)))
    return rms


def summary(boat, trials, resolution):
    """Over the manoeuvres, by fit: errors, their bias in standard errors of the mean, coverage of 95 % intervals."""
    names = trials[0]["names"]
    truth = boat.xi[bs.coefficients.columns(names)]
    result = {
        "velocity_resolution_mps": resolution[0],
        "acceleration_resolution_mps2": resolution[1],
        "n_manoeuvres": len(trials),
        "names": list(names),
        "truth": truth.tolist(),
        "position_m": [t["position_m"] for t in trials],
        "fits": {},
    }
    everything = {fit: np.array([t["values"][fit] for t in trials]) - truth for fit in FITS}
    ratios = 1 + everything["rounded"][:, truth != 0] / truth[truth != 0]
    result["ratios"] = [float(ratios.min()), float(ratios.max())]
    round_off = 1e-6 * everything["rounded"].std(axis=0)
    for fit, errors in everything.items():
        spread = errors.std(axis=0, ddof=1)
        bias = np.where(spread > round_off, errors.mean(axis=0) / np.maximum(spread, round_off), 0.0)
        entry = {
            "errors": errors.tolist(),
            "bias_in_standard_errors": (np.sqrt(len(trials)) * bias).tolist(),
            "bias_over_spread": bias.tolist(),
        }
        if fit in trials[0]["standard_errors"]:
            standard = np.array([t["standard_errors"][fit] for t in trials])
            entry["coverage"] = np.mean(np.abs(errors) <= 1.96 * standard, axis=0).tolist()
            entry["mean_standardised_error"] = (errors / standard).mean(axis=0).tolist()
        result["fits"][fit] = entry
    return result


def check(case, result):
    """The claim, of one case."""
    rounded, load_only = result["fits"]["rounded"], result["fits"]["rounded load only"]
    assert np.median(rounded["coverage"]) < 0.5, f"{case}: half the 95 % intervals hold the truth"
    biased = np.mean(np.abs(rounded["bias_in_standard_errors"]) > 4)
    control = np.mean(np.abs(load_only["bias_in_standard_errors"]) > 4)
    assert biased > control, f"{case}: {biased:.0%} of the coefficients are biased, {control:.0%} with the exact matrix"


def tables(numbers):
    """The cases in Markdown."""
    header = ("case", "resolution", "manoeuvres", "coefficients", "biased", "biased, exact matrix", "biased, TLS")
    header += ("coverage: median (range)", "coverage, exact matrix", "ratios", "track error, median (m)")
    lines = []
    for case, r in numbers.items():
        biased = [np.sum(np.abs(r["fits"][fit]["bias_in_standard_errors"]) > 4) for fit in FITS]
        coverage = [np.array(r["fits"][fit]["coverage"]) for fit in FITS[:2]]
        tracks = [p for p in r["position_m"] if p is not None]
        resolution = 100 * r["velocity_resolution_mps"], 1000 * r["acceleration_resolution_mps2"]
        lines.append(
            (
                case,
                f"{resolution[0]:.3g} cm/s, {resolution[1]:.3g} mm/s^2",
                r["n_manoeuvres"],
                len(r["names"]),
                *biased,
                f"{np.median(coverage[0]):.0%} ({coverage[0].min():.0%} to {coverage[0].max():.0%})",
                f"{np.median(coverage[1]):.0%}",
                f"{r['ratios'][0]:.3g} to {r['ratios'][1]:.3g}",
                f"{np.median(tracks):.3g} ({len(r['position_m']) - len(tracks)} failed)",
            )
        )
    caption = [
        "Linear least squares on rounded data. Biased: mean error over the manoeuvres beyond four standard errors of",
        "that mean. Coverage: how often the classical 95 % interval of a coefficient holds the truth.\n",
    ]
    return "\n".join([*caption, *table(header, lines)]) + "\n"
