"""Rows of tables: those of one of several boats, cells of text among numbers, and times of receipt."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io.errors import InputError, check_known

LOOK, LABELS, JUMP = 2000, 20, 10.0  # rows that are compared; boats at most; size of a jump over the usual change
SHORT, BURSTS = 0.2, 0.1  # of the mean step of a clock; share of shorter ones, from which on it has bursts


def of_one(path: Path, cells: Any, names: list[str], where: dict[str, str | float]) -> Any:
    """The rows of a table of pandas whose columns (by place) hold what a map asks for."""
    import pandas as pd

    for name, wanted in where.items():
        key = f"where.{name}"
        check_known(name, names, f"{path}: key '{key}': has no column '{name}'", key=key)
        column = cells[names.index(name)]
        texts = column.astype(str).str.strip()
        same = (texts if isinstance(wanted, str) else pd.to_numeric(texts, errors="coerce")) == wanted
        if not same.any():
            found = ", ".join(map(repr, column.dropna().unique()[:6].tolist()))
            raise InputError(f"{path}: key '{key}': no row has {wanted!r}; '{name}' has {found}", "value", key)
        cells = cells[same]
    return cells


def of_text(name: str, column: Any, filled: np.ndarray) -> list[str]:
    """A remark on cells of text in a column of pandas of numbers, which are not `filled` (n,)."""
    texts = column[column.notna() & ~filled].astype(str).str.strip().value_counts().head(3)
    kinds = ", ".join(f"'{text}' in {n}" for text, n in texts.items())
    return [f"'{name}': {kinds} of {len(column)} cells, which are no readings"] if kinds else []


def told_apart(cells: Any, names: list[str], numbers: list[np.ndarray], times: np.ndarray) -> list[str]:
    """Columns that tell apart the rows of several boats, which jump from one to the next or begin anew in time."""
    import pandas as pd

    begin = max(0, int(np.argmax(np.diff(times, prepend=times[:1]) < 0.0)) - LOOK // 2)
    some, back = cells.iloc[begin : begin + LOOK], np.diff(times[begin : begin + LOOK]) < 0.0
    readings, result = [values[begin : begin + LOOK] for values in numbers], []
    for name, column in zip(names, some, strict=True):
        codes, labels = pd.factorize(some[column])
        if not 2 <= len(labels) <= LABELS or codes.min() < 0:
            continue
        changes, order = np.flatnonzero(np.diff(codes)), np.argsort(codes, kind="stable")
        alternate, same = len(changes) > len(codes) // LABELS, np.diff(codes[order]) == 0
        across = (np.median(np.abs(np.diff(values))[changes]) for values in readings)
        inside = (np.median(np.abs(np.diff(values[order]))[same]) for values in readings)
        jump = any(one > JUMP * other > 0.0 for one, other in zip(across, inside, strict=True))
        if (alternate and jump) or back[changes].any():
            key = name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name)
            label = json.dumps(labels[0].strip()) if isinstance(labels[0], str) else f"{labels[0]:g}"
            line = f"where = {{ {key} = {label} }}"
            result.append(f"'{name}' tells {len(labels)} boats or runs apart; {line} in the map keeps those of one")
    return result


def times_of_header(names: list[str], numbers: list[np.ndarray], times: np.ndarray) -> list[str]:
    """Another column of times, if it is even where the times (n,) that are used come in bursts."""

    def is_even(stamps):
        steps = np.diff(stamps)
        return len(steps) > LABELS and steps.min() >= 0.0 and np.mean(steps < SHORT * steps.mean()) < BURSTS

    if is_even(times[np.isfinite(times)]):
        return []
    others = (k for k, name in enumerate(names) if re.search("stamp|time", name.lower()))
    better = next((names[k] for k in others if is_even(numbers[k])), "")
    line = f"those of '{better}' do not: signal = \"{better}\" under [time] of the map takes them"
    return [f"times come in bursts, as they are received, and {line}"] if better else []
