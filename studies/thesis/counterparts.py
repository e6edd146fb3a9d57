"""Counterparts: which of our numbers stands for which of the thesis's, by ``counterparts.toml``."""

import json
import tomllib
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.vehicles import load_vehicle
from thesis import cases as thesis

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
    over : key paths of what `ours` is divided by, one for each of its values
    over_statistic : of the values at each of these paths
    orders : whether the decimal logarithm of the quotient is the row's
    times : the study's unit in the thesis's
    on_suboff : whether lengths are scaled to a boat as long as suboff
    also_on_suboff : whether they stand beside the unscaled ones
    compared : whether the row has a ratio
    percentile : whether the row says where among our values the thesis's lies, instead of a ratio
    study : whose numbers they are, if not the section's
    """

    thesis: str
    label: str
    sentence: str
    ours: tuple[str, ...] = ()
    statistic: str = "all"
    combine: str = "all"
    over: tuple[str, ...] = ()
    over_statistic: str = "all"
    orders: bool = False
    times: float = 1.0
    on_suboff: bool = False
    also_on_suboff: bool = False
    compared: bool = True
    percentile: bool = False
    study: str = ""

    def keys(self, path: tuple[str, ...]) -> list[str] | None:
        """The keys of a row that ``*`` stands for; None if the row is another entry's."""
        pattern = self.thesis.split("/")
        if len(pattern) != len(path) or any(p not in ("*", key) for p, key in zip(pattern, path, strict=True)):
            return None
        return [key for p, key in zip(pattern, path, strict=True) if p == "*"]

    def values(self, numbers: dict, keys: list[str], *, on_suboff: bool) -> list:
        """Our values, in the thesis's unit; KeyError if the run has not kept them."""
        results = STATISTICS[self.combine](self._at(numbers, keys, self.ours, self.statistic, on_suboff))
        if self.over:
            divisors = self._at(numbers, keys, self.over, self.over_statistic, on_suboff=False)
            results = [a / b for a, b in zip(results, divisors, strict=True)]
        return np.log10(results).tolist() if self.orders else results

    def _at(self, numbers, keys, paths, statistic, on_suboff) -> list:
        results = []
        for path in paths:
            for vehicle in thesis.VEHICLES if "{vehicle}" in path else thesis.VEHICLES[:1]:
                values = STATISTICS[statistic](at(numbers, path.format(*keys, vehicle=vehicle)))
                scale = self.times * (1.0 / thesis.length_scale(load_vehicle(vehicle)) if on_suboff else 1.0)
                results += values if scale == 1.0 else [scale * value for value in values]
        return results


@dataclass(frozen=True)
class TableSection:
    """A table of ``thesis_results.toml``.

    Attributes
    ----------
    title : heading on the page
    rows : counterparts
    study : whose numbers they are
    figures : figures of the thesis -> file in the study's folder, or in a folder of runs
    of : the table whose rows stand here a second time, beside another study; empty for those of its own
    """

    title: str
    rows: list[Entry]
    study: str = ""
    figures: dict[str, str] = field(default_factory=dict)
    of: str = ""


@dataclass(frozen=True)
class Row:
    """A row of the thesis and its counterpart.

    Attributes
    ----------
    path : key path in ``thesis_results.toml``, the section first
    label : of the row
    thesis : values; not a number where the scan is not legible
    ours : values, or a word that says why there are none
    entry : how they are compared
    scaled : our values on a boat as long as suboff where `ours` are in the boats' own metres; empty otherwise
    """

    path: tuple[str, ...]
    label: str
    thesis: list
    ours: list | str
    entry: Entry
    scaled: list = field(default_factory=list)

    @property
    def sentence(self) -> str:
        """Remark on the counterpart."""
        return self.entry.sentence

    @property
    def ratios(self) -> list[float]:
        """Ours over the thesis's one by one, or of the means if the thesis has fewer; empty unless both are numbers."""
        return self._over_thesis(self.ours) if self.entry.compared and not self.entry.percentile else []

    @property
    def scaled_ratios(self) -> list[float]:
        """As `ratios`, of what is scaled."""
        return self._over_thesis(self.scaled) if self.scaled else []

    @property
    def percentile(self) -> float | None:
        """Percentage of our values that are below the thesis's; None if the row does not ask or has no values."""
        if not self.entry.percentile or isinstance(self.ours, str):
            return None
        return 100.0 * float(np.mean(np.array(self.ours) < self.thesis[0]))

    def _over_thesis(self, ours: list | str) -> list[float]:
        if isinstance(ours, str) or any(isinstance(v, str) for v in self.thesis + ours):
            return []
        if len(ours) != len(self.thesis):
            return [float(np.mean(ours) / np.mean(self.thesis))]
        with np.errstate(divide="ignore", invalid="ignore"):
            return (np.array(ours) / np.array(self.thesis)).tolist()


def comparison(ours: float, theirs: float | None) -> str:
    """Our number, the thesis's and their ratio; ours alone where the thesis has none."""
    return f"{ours:.3g}" if theirs is None or np.isnan(theirs) else f"{ours:.3g} / {theirs:.3g} = {ours / theirs:.2g}"


@dataclass(frozen=True)
class Counterparts:
    """What stands beside the thesis.

    Attributes
    ----------
    sections : by name
    figures : figures of the thesis that belong to no table -> file in a folder of runs
    elsewhere : what has no row -> why
    beyond : study without a row -> what of the thesis it takes further
    """

    sections: dict[str, TableSection]
    figures: dict[str, str]
    elsewhere: dict[str, str]
    beyond: dict[str, str]


def load() -> Counterparts:
    """Everything of ``counterparts.toml``."""
    content = tomllib.loads(Path(__file__).with_name("counterparts.toml").read_text(encoding="utf-8"))
    others = [content.pop(name) for name in ("figures", "elsewhere", "beyond")]
    sections = {
        name: TableSection(**section | {"rows": [Entry(**entry) for entry in section["rows"]]})
        for name, section in content.items()
    }
    return Counterparts(sections, *others)


def rows(folder: Path, name: str, section: TableSection) -> list[Row]:
    """The rows of a section in the thesis's order, ours from a folder of runs; KeyError if no entry covers one."""
    studies = {section.study, *(entry.study for entry in section.rows)}
    numbers = {study: _read(folder / study / NUMBERS) if study else None for study in studies}
    lines = []
    for path, theirs in leaves(thesis.published()[section.of or name]):
        entry, keys = next(((e, k) for e in section.rows if (k := e.keys(path)) is not None), (None, []))
        if entry is None:
            raise KeyError(f"{name}/{'/'.join(path)} has neither a counterpart nor a reason")
        label = entry.label.format(*(key.replace("_", " ") for key in keys)) + (" *" if entry.on_suboff else "")
        content = numbers[entry.study or section.study]
        ours = _ours(entry, content, keys, entry.on_suboff)
        scaled = _ours(entry, content, keys, True) if entry.also_on_suboff and not isinstance(ours, str) else []
        lines.append(Row((name, *path), label, theirs, ours, entry, scaled))
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


def _ours(entry: Entry, numbers: dict | None, keys: list[str], on_suboff: bool) -> list | str:
    if not entry.ours:
        return NONE
    if numbers is None:
        return NOT_RUN
    try:
        return entry.values(numbers, keys, on_suboff=on_suboff)
    except KeyError:
        return NOT_KEPT


def _read(file: Path) -> dict | None:
    if not file.is_file():
        return None
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{file}: is damaged ({error}); run the study again", "format", file.name) from None
