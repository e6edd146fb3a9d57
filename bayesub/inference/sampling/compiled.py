"""How walks on a surrogate are compiled: as loops of the kernels are, but with each product and each sum rounded."""

import functools

from bayesub.kernels.jit import inline_exact as inline
from bayesub.kernels.jit import jit

compiled = functools.partial(jit, exact=True)

__all__ = ["compiled", "inline"]
