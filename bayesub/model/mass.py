"""The mass matrix M = M_rb - M_a (model manual, sections 2 and 6) of a vehicle at rest, for what needs no kernels.

Kernels have their own (:mod:`bayesub.kernels.mass`); a test compares the two.
"""

import numpy as np

from bayesub.kernels import workspace as at
from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.equations import AXES, EquationSet

MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
SINGULAR = 1e-12  # smallest singular value over the largest, in units of length and mass of the boat; hulls have 1e-3


def mass_matrix(equations: EquationSet, dimensional: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Mass and added mass.

    Parameters
    ----------
    equations : EquationSet
    dimensional : (n_terms,) array
        Dimensional coefficients.
    body : (N_BODY,) array
        In the order of :data:`bayesub.kernels.workspace.BODY`.

    Returns
    -------
    (6, 6) array
        kg, kg m and kg m^2.
    """
    mass, (x, y, z) = body[at.MASS], body[[at.XG, at.YG, at.ZG]]
    ixx, iyy, izz, ixy, iyz, izx = body[[at.IXX, at.IYY, at.IZZ, at.IXY, at.IYZ, at.IZX]]
    lever = mass * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # the cross product with the centre of gravity
    inertia = np.array([[ixx, -ixy, -izx], [-ixy, iyy, -iyz], [-izx, -iyz, izz]])
    matrix = np.block([[mass * np.eye(3), -lever], [lever, inertia]])
    for term, coefficient in zip(equations.terms, dimensional, strict=True):
        if term.is_added_mass:
            matrix[AXES.index(term.axis), ACCELERATIONS.index(term.regressor)] -= coefficient
    return matrix


def without_inertia(matrix: np.ndarray, length_m: float, degrees_of_freedom: int) -> str:
    """The motion whose acceleration costs no force, "surge" to "yaw"; empty if the matrix (6, 6) is regular."""
    moving = [0, 1, 5] if degrees_of_freedom == 3 else list(range(6))
    size = np.array([1.0] * 3 + [length_m] * 3)
    scaled = (matrix / np.outer(size, size))[np.ix_(moving, moving)]
    _, values, motions = np.linalg.svd(scaled)
    return MOTIONS[moving[np.argmax(np.abs(motions[-1]))]] if values[-1] <= SINGULAR * values[0] else ""
