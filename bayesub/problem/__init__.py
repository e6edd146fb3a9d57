"""The inference problem: priors, likelihoods, nuisance parameters, and the density of one trial or several."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["likelihoods", "priors"])
