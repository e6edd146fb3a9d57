"""What a manoeuvre can and cannot tell: null spaces of the linear form, and the spectrum of the Fisher information."""

from bayesub.inference.identifiability.fisher import Spectrum, conditional_sd, fisher
from bayesub.inference.identifiability.null_space import NullSpace, kept, null_space
from bayesub.inference.identifiability.rank import AxisRank, rank
from bayesub.inference.interface import Identifiable, InferencePrior

__all__ = [
    "AxisRank", "Identifiable", "InferencePrior", "NullSpace", "Spectrum", "conditional_sd", "fisher", "kept",
    "null_space", "rank",
]  # fmt: skip
