"""Coefficients of the tanker from some of its trials: the posterior, and what others would fit."""

from collections.abc import Iterable

import numpy as np
from scipy.signal import savgol_filter

import bayesub as bs
from bayesub.inference.baselines import Estimate
from bayesub.logs import log_files
from bayesub.model.linear_form import stacked
from kvlcc2.trials import ROW_S, Tanker
from thesis.measured_motion import Motion

# What the equations miss is alike for minutes: the readings of a run, followed to their sds, are worth a few. So their
# noise is taken for so many times that of the sensors, as left-out zig-zags of HSVA want it.
NOISE = 10.0
# The process noise of the published filter, as forces of two seconds that change speeds by as much in a second:
# variances of 0.003 m^2/s^2 of u and v and 0.0019 deg rad/s of r (conf/base/parameters/extended_kalman.yml).
PROCESS = {"X": 2.8e-3, "Y": 4.6e-3, "N": 2.0e-4}
PROCESS_TIME_S = 2.0
SMOOTHED_S = 1.0  # between the readings that are smoothed
WINDOW_S = 2.2  # of the quadratics that make accelerations of velocities
# The terms of the published model that the equations have; others are zero.
TERMS = ("Xuu", "XuU", "XUU", "Xvr", "Xrr", "XUUdd", "Y0", "Yv", "Yr", "YUr", "YuUd", "YUUd")
TERMS += ("N0", "Nv", "Nr", "NUr", "NuUd", "NUUd")


def process_noise() -> bs.UnknownDisturbance:
    """The noise of the process of the smoother."""
    return bs.UnknownDisturbance(tuple(PROCESS), PROCESS, PROCESS_TIME_S, knot_interval_s=SMOOTHED_S)


def posed(tanker: Tanker, names: Iterable[str], noise: float = NOISE) -> bs.JointProblem:
    """The problem of some trials, with noise so many times that of the sensors."""
    return tanker.joint(names).widened(noise)


def mode(tanker: Tanker, names: Iterable[str], noise: float = NOISE) -> Estimate:
    """The posterior mode and the normal approximation there."""
    return bs.baselines.gauss_newton(posed(tanker, names, noise))


def smoothed(tanker: Tanker, names: Iterable[str]) -> Estimate:
    """By smoothed motion and regression, with the terms of the published model."""
    fit = bs.baselines.smoothed_regression(tanker.joint(names, process_noise(), SMOOTHED_S, TERMS))
    return fit.completed({name: 0.0 for name in tanker.free if name not in TERMS})


def differenced(tanker: Tanker, names: Iterable[str]) -> Estimate:
    """By least squares on velocities and their differences, filtered, as practitioners do."""
    systems = [bs.linear_systems(_motion(tanker, name), free=tanker.free) for name in names]
    guess = dict(zip(tanker.boat.equations.names, tanker.boat.xi, strict=True))
    systems = stacked(systems, tanker.boat.equations.names)
    return bs.baselines.linear_least_squares(systems, {name: guess[name] for name in tanker.free})


def _motion(tanker, name):
    """Velocities, and accelerations by quadratics through two seconds of them."""
    log, problem = tanker.log(name), tanker.problem(name)
    velocities = np.stack([log["u_mps"], log["v_mps"], np.radians(log["r_degps"])])
    window = round(WINDOW_S / ROW_S)
    smooth = savgol_filter(velocities, window, 2)
    rates = savgol_filter(velocities, window, 2, deriv=1, delta=ROW_S)
    simulator = problem.simulator.at(log["time_s"])
    states, accelerations = np.zeros((1, len(log["time_s"]), 12)), np.zeros((1, len(log["time_s"]), 6))
    states[0][:, log_files.positions("u", "v", "r")] = smooth.T
    accelerations[0][:, [0, 1, 5]] = rates.T
    controls = np.radians(log["rudder_deg"])[:, None]
    return Motion(log["time_s"], states, accelerations, controls, simulator, tanker.boat.xi[None])
