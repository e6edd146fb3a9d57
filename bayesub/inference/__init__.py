"""Inference: what data say of parameters, whatever the model is.

Parts import downwards: ``sampling`` draws, ``checks`` judges draws and fits, ``baselines`` are the deterministic
answers, ``identifiability`` says what can be determined at all, and ``interface`` is all that these know of a problem.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["baselines", "checks", "identifiability", "sampling"])
