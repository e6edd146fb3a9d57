"""The kernels of motion, written once for all equation sets.

These modules are not imported from here. :func:`bayesub.kernels.families.family` imports them into a package for each
set and sub-problem, where the relative import ``from .hydrodynamics import ..`` finds the forces generated for it
(:mod:`bayesub.model.equations.generate`).
"""
