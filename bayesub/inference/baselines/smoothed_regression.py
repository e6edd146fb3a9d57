"""Regression on smoothed motion: the extended Kalman smoother and inverse dynamics with which ships are identified."""

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.baselines.linear_least_squares import linear_least_squares
from bayesub.inference.interface import Forced, LinearForm


class Smoothable(Forced, Protocol):
    """A problem with unmodelled forces; what its linear form may have are the first n_coefficients parameters."""

    n_coefficients: int

    def held(self, parameters: np.ndarray) -> Forced:
        """The problem of the other parameters, with the coefficients of parameters (n_params,)."""

    def linear_systems(self, parameters: np.ndarray) -> Mapping[str, LinearForm]:
        """Axis -> linear form along the motion of parameters (n_params,); unmodelled forces are in the load."""


def smoothed_regression(problem: Smoothable, *, held: Iterable[str] = (), rounds: int = 2) -> Estimate:
    """Smooth the motion with the boat as it is known, and fit all forces on it by least squares.

    The disturbance of the problem, with known sds, is the noise of the process. Its most probable histories are, with
    the start, those of an extended Kalman filter and Rauch-Tung-Striebel smoother, repeated about the motion found
    until that stays: the Gauss-Newton method (Bell 1994). The forces on this motion are fitted by
    :func:`linear_least_squares`, and the next round smooths with the coefficients of that (Alexandersson et al. 2022).

    Parameters
    ----------
    problem : of one trial or several, with a disturbance; the first round has the middle of its prior
    held : names of coefficients that stay there
    rounds : how often the motion is smoothed, and the coefficients are fitted

    Returns
    -------
    Estimate of the coefficients, whose cost and covariance are those of the fit.

    Raises
    ------
    ValueError : if the simulation fails with the coefficients of a round
    """
    began, before, held = time.perf_counter(), (problem.costs.simulations, problem.costs.jacobians), list(held)
    parameters, n = problem.prior.parameters(np.zeros(problem.n_params)), problem.n_coefficients
    for _ in range(rounds):
        motion = gauss_newton(problem.held(parameters), parameters[n:])
        parameters[n:] = motion.values
        guess = dict(zip(problem.names[:n], parameters, strict=False))
        fit = linear_least_squares(problem.linear_systems(parameters), guess, held=held)
        parameters[[problem.names.index(name) for name in fit.names]] = fit.values
    return replace(
        fit,
        method="smoothed regression",
        statuses=(f"{fit.statuses[0]}; smoothing {motion.statuses[0]}",),
        evaluations=problem.costs.simulations - before[0],
        jacobians=problem.costs.jacobians - before[1],
        seconds=time.perf_counter() - began,
    )
