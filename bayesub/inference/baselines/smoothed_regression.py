"""Regression on smoothed motion: the extended Kalman smoother and inverse dynamics with which ships are identified."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from bayesub.inference.baselines.estimate import Estimate, meter
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.baselines.linear_least_squares import linear_least_squares
from bayesub.inference.interface import Forced, LinearForm


class Smoothable(Forced, Protocol):
    """A problem with unmodelled forces, whose first n_coefficients parameters are those of its linear form."""

    n_coefficients: int

    def held(self, parameters: np.ndarray) -> Forced:
        """The problem of the other parameters, with the coefficients of parameters (n_params,)."""

    def linear_systems(self, parameters: np.ndarray) -> Mapping[str, LinearForm]:
        """Axis -> linear form along the motion of parameters (n_params,); unmodelled forces are in the load."""


def smoothed_regression(problem: Smoothable, *, rounds: int = 2) -> Estimate:
    """Smooth the motion with the boat as it is known, and fit all forces on it by :func:`linear_least_squares`.

    The disturbance of the problem, with known sds, is the noise of the process. Its most probable histories are, with
    the start, those of an extended Kalman filter and Rauch-Tung-Striebel smoother, repeated about the motion found
    until that stays: the Gauss-Newton method (Bell 1994). The first of so many rounds smooths with the middle of the
    prior, each other one with the coefficients of the fit before (Alexandersson et al. 2022). Cost and covariance of
    the estimate are those of the last fit. ValueError if the simulation fails with coefficients of a round.
    """
    spent = meter(problem.costs)
    parameters, n = problem.prior.parameters(np.zeros(problem.n_params)), problem.n_coefficients
    for _ in range(rounds):
        motion = gauss_newton(problem.held(parameters), parameters[n:])
        parameters[n:] = motion.values
        guess = dict(zip(problem.names, parameters, strict=True))
        fit = linear_least_squares(problem.linear_systems(parameters), guess)
        parameters[[problem.names.index(name) for name in fit.names]] = fit.values
    statuses = (f"{fit.statuses[0]}; smoothing {motion.statuses[0]}",)
    return replace(fit, method="smoothed regression", statuses=statuses, **spent())
