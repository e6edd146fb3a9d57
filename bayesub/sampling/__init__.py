"""Posterior sampling: emcee in coordinates that are whitened at the mode and straightened along its bends."""

from bayesub.sampling.nuts import CrossCheck, cross_check
from bayesub.sampling.posterior import Posterior
from bayesub.sampling.sampler import sample

__all__ = ["CrossCheck", "Posterior", "cross_check", "sample"]
