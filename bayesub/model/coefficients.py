"""The 101 coefficients of the standard submarine equations, for studies about them.

These are the names of the equation set ``booth`` (:mod:`bayesub.model.equations`), which the thesis is about. A vehicle
may have another set; ``vehicle.equations`` knows the names of its coefficients.
"""

from bayesub.model.equations import AXES, load_equations

__all__ = ["ADDED_MASSES", "AXES", "EQUATIONS", "HORIZONTAL", "INDEX", "NAMES", "SUBPROBLEMS", "TERMS", "VERTICAL"]

EQUATIONS = load_equations("booth")
TERMS = EQUATIONS.terms
NAMES = EQUATIONS.names
INDEX = EQUATIONS.index
ADDED_MASSES = EQUATIONS.added_masses
SUBPROBLEMS = EQUATIONS.subproblems
HORIZONTAL = SUBPROBLEMS["horizontal"]
VERTICAL = SUBPROBLEMS["vertical"]
