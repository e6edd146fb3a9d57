"""Rows of tables: those of one of several boats, cells of text among numbers, and times of receipt."""

import json
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io.errors import InputError, check_known
from bayesub.logs.readers import stamps

LOOK, LABELS, JUMP = 2000, 20, 10.0  # rows that are compared; boats at most; size of a jump over the usual change
MISSING = {"nan", "-nan", "n/a", "na", "null", "none", "-", "--", "?", "inf", "-inf"}
BACKWARDS_S = 1.0  # a clock that goes back by more was set, or a run begins; by less, messages overtook one another
SHORT, BURSTS = 0.2, 0.1  # of the mean step of a clock; share of shorter ones, from which on it has bursts


def of_one(path: Path, frames: Iterable[Any], names: list[str], where: dict[str, str | float]) -> Iterator[Any]:
    """The rows of tables of pandas whose columns (by place) hold what a map asks for; InputError if there are none."""
    import pandas as pd

    n, labels = 0, dict[str, dict[Any, None]]()
    for cells in frames:
        for name, wanted in where.items():
            key = f"where.{name}"
            check_known(name, names, f"{path}: key '{key}': has no column '{name}'", key=key)
            column = cells[names.index(name)]
            texts, number = column.astype(str).str.strip(), pd.to_numeric(wanted, errors="coerce")
            cells = cells[(texts == wanted) | (pd.to_numeric(texts, errors="coerce") == number)]  # 7 may be 7.0 here
            if not len(cells):
                labels.setdefault(name, {}).update(dict.fromkeys(column.dropna().unique()[:6].tolist()))
                break
        n += len(cells)
        yield cells
    if not n:
        found = ", ".join(list(map(repr, labels[name]))[:6])
        raise InputError(f"{path}: key '{key}': no row has {wanted!r}; '{name}' has {found}", "value", key)


class Cells:
    """The cells of a column, block by block: its numbers if they are kept, and how often texts stand among them."""

    def __init__(self, is_kept: bool):
        self.is_kept, self.values = is_kept, list[np.ndarray]()
        self.n = self.n_numbers = self.n_texts = 0
        self.is_text, self.texts = False, Counter[str]()

    def add(self, column: Any) -> None:
        """Append a column of pandas."""
        filled, values = column.notna().to_numpy(), stamps.as_numbers(column)
        self.n, self.n_numbers = self.n + len(values), self.n_numbers + int(np.isfinite(values).sum())
        if column.dtype.kind not in "biuf":
            texts = column[filled & ~np.isfinite(values)].astype(str).str.strip()
            texts = texts[~texts.str.lower().isin(MISSING)]
            self.n_texts += len(texts)
            self.texts.update(texts.value_counts(sort=False).to_dict())
            if len(self.texts) > LOOK:
                self.texts = Counter(dict(self.texts.most_common(LOOK)))
            filled = filled & ~column.index.isin(texts.index)
        self.is_text = self.n_texts > self.n_numbers
        if self.is_kept:
            self.values.append(np.where(filled, values, np.inf))  # infinite: no reading

    def remarks(self, name: str) -> list[str]:
        """Words for texts in a column of that name."""
        if self.is_text:
            return [f"'{name}' holds text such as '{next(iter(self.texts))}' and is left out"]
        kinds = ", ".join(f"'{text}' in {n}" for text, n in self.texts.most_common(3))
        kinds += f" and {len(self.texts) - 3} other texts" if len(self.texts) > 3 else ""
        return [f"'{name}': {kinds} of {self.n} cells, which are no readings"] if kinds else []


def compared(
    frames: Iterable[Any], names: list[str], times: np.ndarray, offset: int = 0, measured: Collection[str] = ()
) -> list[str]:
    """Remarks on several boats and times of receipt, by rows about the first step back of times (n,), or the first.

    The times are those of the rows from `offset` on; columns that are `measured` tell no boats apart.
    """
    import pandas as pd

    begin, parts, n = max(0, int(np.argmax(np.diff(times, prepend=times[:1]) < 0.0)) - LOOK // 2), [], -offset
    end = min(begin + LOOK, len(times))
    for cells in frames:
        parts.append(cells[max(0, begin - n) : max(0, end - n)])
        n += len(cells)
        if n >= end:
            break
    some = pd.concat(parts, ignore_index=True)
    readings = [stamps.as_numbers(some[k]) for k in some]
    others = [k for k, name in enumerate(names) if name not in measured]
    apart = _told_apart(some[others], [names[k] for k in others], readings, times[begin:][:LOOK])
    return apart + _times_of_header(names, readings, times)


def _told_apart(some: Any, names: list[str], readings: list[np.ndarray], times: np.ndarray) -> list[str]:
    """Columns that tell apart the rows of several boats, which jump from one to the next or begin anew in time."""
    import pandas as pd

    result, back = [], np.diff(times) < 0.0
    found = [(name, *pd.factorize(some[column])) for name, column in zip(names, some, strict=True)]
    found = [one for one in found if 2 <= len(one[2]) <= min(LABELS, len(some) // 2) and one[1].min() >= 0]
    found.sort(key=lambda one: one[2].dtype.kind in "biuf")  # texts first, and not hundreds of flags
    for name, codes, labels in found[:LABELS]:
        changes, order = np.flatnonzero(np.diff(codes)), np.argsort(codes, kind="stable")
        alternate, same = len(changes) > len(codes) // LABELS, np.diff(codes[order]) == 0
        across = (np.median(np.abs(np.diff(values))[changes]) for values in readings)
        inside = (np.median(np.abs(np.diff(values[order]))[same]) for values in readings)
        jump = any(one > JUMP * other > 0.0 for one, other in zip(across, inside, strict=True))
        if (alternate and jump) or (back[changes].sum() > 0.5 * len(changes) and back.mean() < 0.5):
            key = name if re.fullmatch(r"[\w-]+", name, re.ASCII) else json.dumps(name)
            label = json.dumps(labels[0].strip()) if isinstance(labels[0], str) else f"{labels[0]:g}"
            line = f"where = {{ {key} = {label} }}"
            result.append(f"'{name}' tells {len(labels)} boats or runs apart; {line} in the map keeps those of one")
    return result


def _times_of_header(names: list[str], readings: list[np.ndarray], times: np.ndarray) -> list[str]:
    """Another column of times, if it is even in some rows where the times (n,) that are used come in bursts."""

    def is_even(moments):
        steps = np.diff(moments)
        return len(steps) > LABELS and steps.min() >= 0.0 and np.mean(steps < SHORT * steps.mean()) < BURSTS

    if is_even(times[np.isfinite(times)]):
        return []
    others = (k for k, name in enumerate(names) if re.search("stamp|time", name.lower()))
    better = next((names[k] for k in others if is_even(readings[k])), "")
    line = f"those of '{better}' do not: signal = \"{better}\" under [time] of the map takes them"
    return [f"times come in bursts, as they are received, and {line}"] if better else []
