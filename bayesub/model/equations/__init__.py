"""Equation sets: the hydrodynamic terms of a boat as a file, and the force kernels generated from it."""

from bayesub.model.equations.equation_set import AXES, Control, EquationSet, Term
from bayesub.model.equations.files import load_equations

__all__ = ["AXES", "Control", "EquationSet", "Term", "load_equations"]
