"""The 101 coefficients of the standard submarine equations, for studies about them.

These are the names of the equation set ``booth`` (:mod:`bayesub.model.equations`), which the thesis is about. A vehicle
may have another set; ``vehicle.equations`` knows the names of its coefficients.
"""

import numpy as np

from bayesub.model.equations import AXES, load_equations

__all__ = [
    "ADDED_MASSES", "AXES", "EQUATIONS", "HORIZONTAL", "INDEX", "NAMES", "SUBPROBLEMS", "TERMS", "VERTICAL", "columns",
    "names_of_axis", "regressors",
]  # fmt: skip

EQUATIONS = load_equations("booth")
TERMS = EQUATIONS.terms
NAMES = EQUATIONS.names
INDEX = EQUATIONS.index
ADDED_MASSES = EQUATIONS.added_masses
SUBPROBLEMS = EQUATIONS.subproblems
HORIZONTAL = SUBPROBLEMS["horizontal"]
VERTICAL = SUBPROBLEMS["vertical"]

columns = EQUATIONS.columns
names_of_axis = EQUATIONS.names_of_axis


def regressors(states: np.ndarray, accelerations: np.ndarray, controls: np.ndarray) -> dict[str, np.ndarray]:
    """The regressors of each axis, the columns of the linear form ``A xi = b`` (model manual, section 9).

    Axis -> (n, n_columns); columns in the order of the table, without the factor (rho/2) l^power, at `states` (n, 12),
    body `accelerations` (n, 6) and `controls` (n, 3), the angles of rudder, bow plane and stern plane, all in SI units.
    """
    with_propeller = np.column_stack([controls, np.zeros(len(controls))])  # no term of these has its speed
    return EQUATIONS.regressors(states, accelerations, with_propeller, np.zeros(1))
