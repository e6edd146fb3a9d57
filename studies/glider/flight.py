"""Casts of the built-in log of a glider, and what the package gliderflight makes of them."""

from __future__ import annotations

import numpy as np

from bayesub.io import toml_files
from bayesub.logs import log_files
from bayesub.model.vehicles import load_vehicle

LOG = "slocum_comet"  # and its vehicle
TOP_M, BOTTOM_M = 10.0, 35.0  # of a cast, as the authors calibrate: without surface and turn
INTERVAL_S = 10.0
ROWS = 20  # at the begin of a cast, from which its start follows
INCIDENCE = 0.045  # rad, angle of attack of steady flight with the coefficients of the vehicle file
SOUND_MPS = 0.05  # a profiler that is off by more throughout a descent is not to be met


def whole_log():
    """The log by short names, SI units."""
    glider = load_vehicle(LOG)
    return log_files.read_log(toml_files.find_log(LOG), glider.actuators.log_columns)


def find_casts():
    """Descents and ascents between two depths: dive, direction, first and last time (s), and start of each.

    A cast starts in steady flight, with the speed that makes its depth change as it does along its pitch. What that is
    off is forgotten in 20 s.
    """
    log = whole_log()
    times, depths = log["time"], log["depth"]
    inside = np.diff(np.r_[0, (depths > TOP_M) & (depths < BOTTOM_M), 0].astype(int))
    casts = []
    for begin, end in zip(np.flatnonzero(inside == 1), np.flatnonzero(inside == -1), strict=True):
        if end - begin > 100 and np.diff(times[begin:end]).max() < 5.0:
            down = bool(depths[end - 1] > depths[begin])
            window = float(times[begin]), float(times[end - 1])
            rows = slice(begin, begin + ROWS)
            rate, depth = np.polyfit(times[rows] - times[begin], depths[rows], 1)
            incidence = INCIDENCE if down else -INCIDENCE
            speed = rate / np.sin(incidence - log["theta"][rows].mean())
            start = {"z0_m": depth, "u0_mps": speed, "w0_mps": incidence * speed}
            start = {name: float(value) for name, value in start.items()}
            casts.append({"dive": len(casts) // 2, "down": down, "window": window, "start": start})
    return casts


def shown(unseen):
    """The descent of the picture."""
    return [cast for cast in unseen if cast["down"]][len(unseen) // 6]


def rows_of(log, cast):
    """Which rows of the log are of a cast."""
    begin, end = cast["window"]
    return (log["time"] >= begin) & (log["time"] <= end)


def sparse(times):
    """One row in ten seconds: those in between see the same slow errors again."""
    return np.unique(np.searchsorted(times, np.arange(times[0], times[-1], INTERVAL_S)))


def mean_density(casts):
    """Of the water along the casts, kg/m3."""
    log = whole_log()
    return float(log["density_kgm3"][np.any([rows_of(log, cast) for cast in casts], axis=0)].mean())


def slopes(log, casts, width=20.0):
    """Upward speed by straight lines through the depths of twenty seconds, m/s; zero outside of casts."""
    rates = np.zeros(len(log["time"]))
    for rows in (rows_of(log, cast) for cast in casts):
        times, depths = log["time"][rows], log["depth"][rows]
        near = np.abs(times[:, None] - times) <= width / 2.0
        weight = near / near.sum(axis=1, keepdims=True)
        lag = times - (weight @ times)[:, None]
        rates[rows] = -np.sum(weight * lag * depths, axis=1) / np.sum(weight * lag**2, axis=1)
    return rates


def peer(run, fitted, unseen):
    """Calibrations by gliderflight on the fitted casts, and its speeds on the others; None if it is not installed."""
    try:
        from gliderflight import SteadyStateCalibrate
    except ImportError:
        return None
    log = whole_log()
    data = {"time": log["time"], "pressure": log["pressure_bar"], "pitch": log["theta"], "U_relative": log["u"]}
    data |= {"buoyancy_change": log["ballast_cm3"], "density": log["density_kgm3"]}
    used = np.any([rows_of(log, cast) for cast in fitted], axis=0)
    rates = {"by differences": None, "by lines": slopes(log, fitted)}
    kinds = {"depths": (("Cd0", "mg"), ("dhdt",)), "depths and speeds": (("Cd0", "mg", "ah"), ("dhdt", "U_relative"))}
    results = {}
    for rate, dhdt in rates.items():
        for kind, (parameters, constraints) in kinds.items():
            model = SteadyStateCalibrate(rho0=1004)
            model.define(ah=3.8, Cd1=10.5)
            model.set_input_data(**data, dhdt=dhdt)
            model.OR(~used)
            model.define(Cd0=0.15, mg=70, Vg=70 / 1004)
            best = model.calibrate(*parameters, constraints=constraints)
            read = [rows_of(log, cast) & np.isfinite(log["u"]) for cast in unseen if cast["down"]]
            errors = [(model.U - log["u"])[rows][sparse(log["time"][rows])] for rows in read]
            sound = np.concatenate([e for e in errors if abs(e.mean()) < SOUND_MPS])
            result = {"CD0": best["Cd0"], "mass_kg": best["mg"], "lift_slope": best.get("ah", 3.8) + model.aw}
            result |= {"speed_bias_mps": sound.mean(), "speed_rms_mps": np.sqrt(np.mean(sound**2))}
            results[f"{kind}, rates {rate}"] = {key: float(value) for key, value in result.items()}
            if dhdt is None:
                rows = rows_of(log, shown(unseen))
                times = log["time"][rows] - log["time"][rows][0]
                run.save_arrays(f"gliderflight_{kind.replace(' ', '_')}", times=times, speed=model.U[rows])
    return results
