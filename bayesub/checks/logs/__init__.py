"""Columns of a log against each other: names, axes, signs, units and clocks, before anything is fitted."""

from bayesub.checks.logs.consistency import findings
from bayesub.checks.logs.finding import KINDS, Finding

__all__ = ["KINDS", "Finding", "findings"]
