"""Counterparts: which of our numbers stands for which of the thesis's, by ``counterparts.toml``."""

import json
import tomllib
from dataclasses import dataclass, field
from importlib import resources
from itertools import chain
from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.vehicles import load_vehicle
from bayesub.thesis import cases as thesis

NUMBERS = "numbers.json"
NOT_RUN, NOT_KEPT, NONE = "not yet run", "not in the run's numbers", "none"
STATISTICS = {
    "all": list,
    "count": lambda values: [len(values)],
    "distinct": lambda values: list(dict.fromkeys(values)),
    "max": lambda values: [max(values)],
    "mean": lambda values: [float(np.mean(values))],
    "median": lambda values: [float(np.median(values))],
    "min": lambda values: [min(values)],
    "range": lambda values: [min(values), max(values)],
}


@dataclass(frozen=True)
class Entry:
    """One or several rows of the thesis, and where in the numbers of a study our counterparts are.

    Attributes
    ----------
    thesis : key path below the section, ``*`` for any key
    label : of a row; {0} and {1} are the keys that ``*`` stands for
    sentence : remark on the counterpart, or why there is none
    ours : key paths in ``numbers.json`` with {0}, {1}, {vehicle} and ``*``; none if there is no counterpart
    statistic : of the values at each path
    combine : statistic of what the paths give
    times : the study's unit in the thesis's
    on_suboff : whether lengths are scaled to a boat as long as suboff
    """

    thesis: str
    label: str
    sentence: str
    ours: tuple[str, ...] = ()
    statistic: str = "all"
    combine: str = "all"
    times: float = 1.0
    on_suboff: bool = False

    def keys(self, path: tuple[str, ...]) -> list[str] | None:
        """The keys of a row that ``*`` stands for; None if the row is another entry's."""
        pattern = self.thesis.split("/")
        if len(pattern) != len(path) or any(p not in ("*", key) for p, key in zip(pattern, path, strict=True)):
            return None
        return [key for p, key in zip(pattern, path, strict=True) if p == "*"]

    def values(self, numbers: dict, keys: list[str]) -> list:
        """Our values, in the thesis's unit; KeyError if the run has not kept them."""
        results = []
        for path in self.ours:
            for vehicle in thesis.VEHICLES if "{vehicle}" in path else thesis.VEHICLES[:1]:
                values = STATISTICS[self.statistic](at(numbers, path.format(*keys, vehicle=vehicle)))
                scale = self.times * (_to_suboff(vehicle) if self.on_suboff else 1.0)
                results += values if scale == 1.0 else [scale * value for value in values]
        return STATISTICS[self.combine](results)


@dataclass(frozen=True)
class TableSection:
    """A table of ``thesis_results.toml``.

    Attributes
    ----------
    title : heading on the page
    rows : counterparts
    study : whose numbers they are
    figures : figures of the thesis -> file in the study's folder
    """

    title: str
    rows: list[Entry]
    study: str = ""
    figures: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """A row of the thesis and its counterpart.

    Attributes
    ----------
    path : key path in ``thesis_results.toml``, the section first
    label : of the row
    thesis : values
    ours : values, or a word that says why there are none
    sentence : remark
    """

    path: tuple[str, ...]
    label: str
    thesis: list
    ours: list | str
    sentence: str

    @property
    def ratios(self) -> list[float]:
        """Ours over the thesis's one by one, or of the means if the thesis has fewer; empty unless both are numbers."""
        if isinstance(self.ours, str) or any(isinstance(v, str) for v in self.thesis + self.ours):
            return []
        if len(self.ours) != len(self.thesis):
            return [float(np.mean(self.ours) / np.mean(self.thesis))]
        return (np.array(self.ours) / np.array(self.thesis)).tolist()


def comparison(ours: float, theirs: float | None) -> str:
    """Our number, the thesis's and their ratio; ours alone where the thesis has none."""
    return f"{ours:.3g}" if theirs is None else f"{ours:.3g} / {theirs:.3g} = {ours / theirs:.2g}"


def load() -> tuple[dict[str, TableSection], dict[str, str], dict[str, str]]:
    """Sections by name, reasons for what has no row, and what of the thesis studies without a row take further."""
    content = tomllib.loads((resources.files("bayesub.thesis") / "counterparts.toml").read_text(encoding="utf-8"))
    elsewhere, beyond = content.pop("elsewhere"), content.pop("beyond")
    sections = {
        name: TableSection(**section | {"rows": [Entry(**entry) for entry in section["rows"]]})
        for name, section in content.items()
    }
    return sections, elsewhere, beyond


def rows(folder: Path, name: str, section: TableSection) -> list[Row]:
    """The rows of a section in the thesis's order, ours from a folder of runs; KeyError if no entry covers one."""
    numbers = _read(folder / section.study / NUMBERS) if section.study else None
    lines = []
    for path, theirs in leaves(thesis.published()[name]):
        entry, keys = next(((e, k) for e in section.rows if (k := e.keys(path)) is not None), (None, []))
        if entry is None:
            raise KeyError(f"{name}/{'/'.join(path)} has neither a counterpart nor a reason")
        label = entry.label.format(*(key.replace("_", " ") for key in keys)) + (" *" if entry.on_suboff else "")
        lines.append(Row((name, *path), label, theirs, _ours(entry, numbers, keys), entry.sentence))
    return lines


def leaves(content: dict, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], list]]:
    """Key path and values of each row of a section of ``thesis_results.toml``."""
    pairs = []
    for key, value in content.items():
        if isinstance(value, dict):
            pairs += leaves(value, (*path, key))
        else:
            pairs.append(((*path, key), value if isinstance(value, list) else [value]))
    return pairs


def at(numbers: dict, path: str) -> list:
    """The values at a key path, ``*`` for each key, lists taken apart, null left out; KeyError if there are none."""
    values = [numbers]
    for key in path.split("/"):
        if not all(isinstance(v, dict) for v in values):
            raise KeyError(path)
        values = list(chain.from_iterable(v.values() if key == "*" else [v[key]] for v in values))
    while any(isinstance(v, list) for v in values):
        values = list(chain.from_iterable(v if isinstance(v, list) else [v] for v in values))
    if not (values := [v for v in values if v is not None]):
        raise KeyError(path)
    return values


def _ours(entry: Entry, numbers: dict | None, keys: list[str]) -> list | str:
    if not entry.ours:
        return NONE
    if numbers is None:
        return NOT_RUN
    try:
        return entry.values(numbers, keys)
    except KeyError:
        return NOT_KEPT


def _read(file: Path) -> dict | None:
    if not file.is_file():
        return None
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{file}: is damaged ({error}); run the study again") from None


def _to_suboff(vehicle: str) -> float:
    return load_vehicle("suboff").length_m / load_vehicle(vehicle).length_m
