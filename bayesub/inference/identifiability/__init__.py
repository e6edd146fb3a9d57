"""What a manoeuvre can and cannot tell: null spaces of the linear form, and the spectrum of the Fisher information."""

from bayesub.inference.identifiability.cancellation import Cancellation, cancellation
from bayesub.inference.identifiability.collinearity import Collinearity, collinearity
from bayesub.inference.identifiability.contribution import Contribution, contribution
from bayesub.inference.identifiability.fisher import Spectrum, fisher
from bayesub.inference.identifiability.null_space import NullSpace, null_space
from bayesub.inference.identifiability.profile import Profile, profile
from bayesub.inference.identifiability.rank import AxisRank, held_fixed, rank
from bayesub.inference.identifiability.structure import Structure, structure
from bayesub.inference.interface import Identifiable, InferencePrior

__all__ = [
    "AxisRank",
    "Cancellation",
    "Collinearity",
    "Contribution",
    "Identifiable",
    "InferencePrior",
    "NullSpace",
    "Profile",
    "Spectrum",
    "Structure",
    "cancellation",
    "collinearity",
    "contribution",
    "fisher",
    "held_fixed",
    "null_space",
    "profile",
    "rank",
    "structure",
]
