"""The model: coefficients, vehicles and manoeuvres, and the motion that they make."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["coefficients"])
