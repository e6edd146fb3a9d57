"""What a manoeuvre can and cannot tell: null spaces of the linear form, and the spectrum of the Fisher information."""

from bayesub.identifiability.cancellation import Cancellation, cancellation
from bayesub.identifiability.collinearity import Collinearity, collinearity
from bayesub.identifiability.contribution import Contribution, contribution
from bayesub.identifiability.fisher import Spectrum, fisher
from bayesub.identifiability.interface import InferencePrior, InferenceProblem
from bayesub.identifiability.null_space import NullSpace, null_space
from bayesub.identifiability.profile import Profile, profile
from bayesub.identifiability.rank import AxisRank, held_fixed, rank
from bayesub.identifiability.structure import Structure, structure

__all__ = [
    "AxisRank",
    "Cancellation",
    "Collinearity",
    "Contribution",
    "InferencePrior",
    "InferenceProblem",
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
