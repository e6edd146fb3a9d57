"""Deterministic answers: each fit gives an :class:`Estimate` that stands beside the posterior.

Those on the equations of motion take linear systems, one an axis: :func:`linear_least_squares`,
:func:`linear_programme`; :func:`smoothed_regression` takes a problem and smooths the motion first. Those on the
readings take a problem: :func:`sqp`, :func:`trust_region` and, with the prior, :func:`gauss_newton`,
:func:`posterior_mode` and, where these end in local modes, :func:`continuation`.
"""

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.baselines.linear_least_squares import linear_least_squares
from bayesub.inference.baselines.linear_programme import linear_programme
from bayesub.inference.baselines.posterior_mode import continuation, posterior_mode
from bayesub.inference.baselines.smoothed_regression import smoothed_regression
from bayesub.inference.baselines.sqp import sqp
from bayesub.inference.baselines.trust_region import trust_region

__all__ = [
    "Estimate", "continuation", "gauss_newton", "linear_least_squares", "linear_programme", "posterior_mode",
    "smoothed_regression", "sqp", "trust_region",
]  # fmt: skip
