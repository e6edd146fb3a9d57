"""What a manoeuvre can and cannot tell: null spaces of the linear form, and the spectrum of the Fisher information."""

from bayesub.identifiability.fisher import Spectrum, fisher
from bayesub.identifiability.rank import AxisRank, rank

__all__ = ["AxisRank", "Spectrum", "fisher", "rank"]
