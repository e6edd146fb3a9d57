"""Rows of the workspace that depend on the equation set; those of all sets are in :mod:`bayesub.kernels.workspace`."""

from bayesub.kernels.workspace import COEFFICIENTS

from .hydrodynamics import N_COEFFICIENTS, N_CONSTANTS, N_CONTROLS

# What each lane adds to the controls of all: those of the set, in SI units; n/k0, m/s; external forces, if any.
CONTROLS = COEFFICIENTS + N_COEFFICIENTS
CONSTANTS = CONTROLS + N_CONTROLS  # the trial speed, and stations of the hull, if the set integrates along it
N_ROWS = CONSTANTS + N_CONSTANTS
