"""Deterministic answers: each fit gives an :class:`Estimate` that stands beside the posterior."""

from bayesub.baselines.estimate import Estimate
from bayesub.baselines.gauss_newton import gauss_newton
from bayesub.baselines.linear_least_squares import linear_least_squares
from bayesub.baselines.sqp import sqp

__all__ = ["Estimate", "gauss_newton", "linear_least_squares", "sqp"]
