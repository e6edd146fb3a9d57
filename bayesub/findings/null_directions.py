"""Null directions by how much of itself each coefficient may change together with others without being seen."""

from collections.abc import Mapping

import numpy as np

from bayesub.inference.identifiability import NullSpace
from bayesub.io.words import counted, listed

LARGEST = 0.5  # relative change of the coefficient that changes most
LEAST = 0.05  # relative change of what a sentence speaks of
NAMED = 3  # coefficients in it beside that which changes most


def numbers(null_space: NullSpace, values: Mapping[str, float]) -> list[dict]:
    """Of each null direction its axis and the relative changes of its coefficients, the largest of them 50 %.

    The motion stays the same to round-off: a null direction is one of the linear form of the equations, so that a step
    along it may be of any length.

    Parameters
    ----------
    null_space : NullSpace
        Its vectors are in coefficients.
    values : mapping
        Coefficient -> value where the null space was taken.

    Returns
    -------
    list of dict
        ``axis``, and ``changes``: coefficient -> change over its value, largest first.
    """
    result = []
    for axis, rank in null_space.ranks.items():
        for vector in rank.null_vectors:
            relative = {name: change / values[name] for name, change in vector.items() if values[name]}
            order = sorted(relative, key=lambda name: -abs(relative[name]))
            scale = LARGEST / relative[order[0]]
            result.append({"axis": axis, "changes": {name: scale * relative[name] for name in order}})
    return result


def sentence(directions: list[dict]) -> str:
    """What may change together; empty if nothing may."""
    return "; ".join(f"{direction['axis']}: {_words(direction['changes'])}" for direction in directions)


def _words(changes: Mapping[str, float]) -> str:
    """Changes such as ``50 % of Yvdot with 21 % of Yuv and 4 others``, or of one by itself where others hardly move."""
    some = [f"{percent(change)} of {name}" for name, change in changes.items() if abs(change) >= LEAST]
    first, *others = some
    if not others:
        rest = counted(len(changes) - 1, "other")
        return f"{first} with less than {percent(LEAST)} of {rest}" if len(changes) > 1 else first
    named, more = others[:NAMED], len(others) - NAMED
    return f"{first} with {listed([*named, *([counted(more, 'other')] if more > 0 else [])])}"


def percent(share: float) -> str:
    """A share such as -0.1342 as ``-13 %``: two digits."""
    return f"{np.format_float_positional(100.0 * share, 2, fractional=False, trim='-')} %"
