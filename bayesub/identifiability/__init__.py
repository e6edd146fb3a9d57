"""What a manoeuvre can and cannot tell: null spaces of the linear form, and the spectrum of the Fisher information."""

from bayesub.identifiability.fisher import Spectrum, fisher
from bayesub.identifiability.rank import AxisRank, held_fixed, rank
from bayesub.identifiability.structure import Structure, structure

__all__ = ["AxisRank", "Spectrum", "Structure", "fisher", "held_fixed", "rank", "structure"]
