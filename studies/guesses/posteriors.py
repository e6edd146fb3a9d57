"""Posteriors of a boat whose guess is off, by several priors about that guess.

Normal approximations at the mode take a tenth of a second where sampling takes ten. With a normal prior they are made
in the coefficients, with log-normal ones in their logarithms, for which the readings are linearised once, at the mode
with a prior sd of a half. An unknown scale is summed over with the evidence of each of its values (as in INLA: Rue et
al. 2009).
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import product

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.conflict import Conflict, find_conflict
from bayesub.io import toml_files
from bayesub.model.coefficients import HORIZONTAL
from bayesub.model.equations import EquationSet
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.distributions import LogNormal, Normal
from bayesub.problem.priors import Spread
from bayesub.problem.problem import Problem
from bayesub.sensors import observe

N_DRAWS = 500  # of each approximation
_TOLERANCE = 0.02  # posterior sd
POOLED = 2.0  # boats
AXIS_SCALES = 16  # of the scales of a hierarchical prior every sixteenth is taken where each axis has one
NORMAL_SD = 0.25
_MIDDLE, _LEAST = 0.5, 0.05  # prior sd at whose mode the readings are linearised; least share of a guess to start at


@dataclass(frozen=True)
class Guessed:
    """A record of a boat, and a guess of its coefficients.

    Attributes
    ----------
    motion : trajectory of the boat
    record : of it
    guess : (n_terms,)
    """

    motion: object
    record: object
    guess: np.ndarray

    @classmethod
    def drawn(cls, boat, manoeuvre, sensors, errors: str, size: float, dt: float, rng) -> "Guessed":
        """A record, and a guess off by `size`: "relative", by factors 1 + size e, or "logarithmic", exp(size e)."""
        motion = simulate(boat, manoeuvre, dt=dt)
        record = observe(motion, sensors, rng)
        if errors == "relative":
            return cls(motion, record, priors.perturbed(boat.xi, size, rng))
        return cls(motion, record, boat.xi * np.exp(size * rng.standard_normal(len(boat.xi))))

    def problem(self, spread: Spread) -> Problem:
        """With a spread, whose centre becomes the guess."""
        simulator = self.motion.simulator
        return Problem(
            simulator.vehicle,
            simulator.manoeuvre,
            self.record,
            free=HORIZONTAL,
            prior=replace(spread, centre=self.guess),
            dt=simulator.step,
        )

    @cached_property
    def _normal(self):
        """The problem with a normal prior, and its mode."""
        problem = self.problem(priors.relative_normal(NORMAL_SD))
        return problem, gauss_newton(problem, tolerance=_TOLERANCE)

    @property
    def truth(self) -> np.ndarray:
        """(n_params,) true values of the free coefficients."""
        return self._normal[0].reference

    @cached_property
    def _linearised(self):
        """Guesses, and information and pull of the readings in the logarithms of the coefficients over these."""
        problem = self.problem(priors.relative_log_normal(_MIDDLE))
        mode = problem.prior.median * np.maximum(self._normal[1].values / problem.prior.median, _LEAST)
        mode = gauss_newton(problem, mode, tolerance=_TOLERANCE).values
        u, jacobian = np.log(mode / problem.prior.median), problem.jacobian(mode) * mode
        information = jacobian.T @ jacobian
        return problem.prior.median, information, information @ u - jacobian.T @ problem.residuals(mode[None])[0]

    def draws(self, spread: Spread | None, rng: np.random.Generator) -> tuple[np.ndarray, Conflict]:
        """(N_DRAWS, n_params) draws of an approximation of the posterior, and where it disagrees with the prior.

        Without a spread the prior is log-normal with the spread of published boats; a normal one has the `NORMAL_SD`.
        """
        problem, estimate = self._normal
        if spread is None:
            prior = LogNormal(self.guess[problem.columns], spread_of_boats(problem.equations)[problem.columns])
        else:
            prior = replace(spread, centre=self.guess).on(problem.columns, problem.xi, problem.equations)
        if isinstance(prior, Normal):
            draws = rng.multivariate_normal(estimate.values, estimate.covariance, N_DRAWS, method="cholesky")
        else:
            draws = self._log_normal(_scales(prior), rng)
        return draws, find_conflict(prior, draws, problem.names)

    def _log_normal(self, scales, rng):
        """Draws with log-normal priors, one of the (n, n_params) sds of the logarithms, each as probable."""
        guess, information, pull = self._linearised
        precisions = scales**-2.0
        lower = np.linalg.cholesky(information + precisions[:, :, None] * np.eye(len(pull)))
        half = np.linalg.solve(lower, np.broadcast_to(pull[:, None], (*precisions.shape, 1)))[..., 0]
        volumes = 0.5 * np.log(precisions).sum(axis=1) - np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
        evidence = 0.5 * np.sum(half**2, axis=1) + volumes
        weights = np.exp(evidence - evidence.max())
        chosen = rng.choice(len(weights), N_DRAWS, p=weights / weights.sum())
        white = (half[chosen] + rng.standard_normal((N_DRAWS, len(pull))))[..., None]
        return guess * np.exp(np.linalg.solve(np.swapaxes(lower[chosen], 1, 2), white)[..., 0])


def _scales(prior) -> np.ndarray:
    """(n, n_params) sds of the logarithms, each as probable, of a prior with known or unknown ones."""
    if isinstance(prior, LogNormal):
        return prior.log_sd[None]
    parts, positions = getattr(prior, "parts", (prior,)), getattr(prior, "positions", (np.arange(len(prior.mean)),))
    every = AXIS_SCALES if len(parts) > 1 else 1
    combinations = np.array(list(product(*(part.scales[::every] for part in parts))))
    scales = np.empty((len(combinations), len(prior.mean)))
    for place, of_part in zip(positions, combinations.T, strict=True):
        scales[:, place] = of_part[:, None]
    return scales


@cache
def spread_of_boats(equations: EquationSet) -> np.ndarray:
    """(n_terms,) sd of the logarithm of each coefficient over the boats of the package with these equations.

    Of `booth` there are three, which say little about one coefficient: its variance is pooled with the median one of
    its axis, with the weight of two boats. Signs, on which they do not all agree, are left out.
    """
    boats = [boat for boat in map(load_vehicle, toml_files.built_in("vehicles")) if boat.equations == equations]
    values = np.array([boat.xi for boat in boats])
    logs = np.log(np.abs(values), out=np.full(values.shape, np.nan), where=values != 0.0)
    dof = np.maximum(np.isfinite(logs).sum(axis=0) - 1, 0)
    squares = np.nansum((logs - np.nansum(logs, axis=0) / (dof + 1)) ** 2, axis=0)
    axes = np.array([term.axis for term in equations.terms])
    pooled = np.empty(len(axes))
    for axis in dict.fromkeys(axes):
        shared = (axes == axis) & (dof > 0)
        pooled[axes == axis] = np.median(squares[shared] / dof[shared])
    return np.sqrt((squares + POOLED * pooled) / (dof + POOLED))


def judged(draws: np.ndarray, truth: np.ndarray, interval: float) -> dict[str, float]:
    """How many of the true values (n_params,) intervals of draws hold, and their half width over the truth (median)."""
    low, high = np.quantile(draws, [0.5 - 0.5 * interval, 0.5 + 0.5 * interval], axis=0)
    held = (low <= truth) & (truth <= high)
    return {"held": float(held.mean()), "half_width": float(np.median(0.5 * (high - low) / np.abs(truth)))}
