"""Posterior sampling: emcee in straightened coordinates, with proposals from a surrogate and exact acceptance."""

from bayesub.sampling.nuts import CrossCheck, cross_check
from bayesub.sampling.posterior import Criteria, Posterior
from bayesub.sampling.sampler import sample

__all__ = ["Criteria", "CrossCheck", "Posterior", "cross_check", "sample"]
