"""Equality of objects that hold arrays: the same numbers, wherever they were made."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


class ByContent:
    """Dataclasses that are equal if they are of one class and hold the same; with ``eq=False``, so that this counts."""

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(other) is type(self) else NotImplemented

    def __hash__(self) -> int:
        return hash(type(self))  # arrays have none


def same(one: Any, other: Any) -> bool:
    """Whether two dataclasses of one kind hold the same numbers; arrays are the same if all their numbers are.

    Also two sequences or mappings of such, and arrays or anything else that is compared.
    """
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(value, other[key]) for key, value in one.items())
    if is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return one == other
