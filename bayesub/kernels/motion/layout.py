"""Rows of the workspace that depend on the equation set; those of all sets are in :mod:`bayesub.kernels.workspace`."""

from bayesub.kernels.workspace import COEFFICIENTS

from .hydrodynamics import N_COEFFICIENTS, N_CONSTANTS, N_CONTROLS, ORDERED_SPEED

CONTROLS = COEFFICIENTS + N_COEFFICIENTS  # of the set, in SI units; n/k0, m/s; external forces, if there are any
ORDERED = CONTROLS + ORDERED_SPEED
VARIATIONS = CONTROLS + N_CONTROLS  # what each member adds to the controls
CONSTANTS = VARIATIONS + N_CONTROLS  # the trial speed, and stations of the hull, if the set integrates along it
N_ROWS = CONSTANTS + N_CONSTANTS
