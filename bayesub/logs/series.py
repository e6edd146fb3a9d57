"""Columns of a log as time series, what they change over windows of time, and findings: where columns disagree."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

GAP = 5.0  # median intervals without a reading, beyond which a window is not used
WINDOWS = 8  # at least, in which changes are compared
LADDER = 8  # lengths of windows that are tried, each twice the one before
MOST = 20_000  # rows; of longer logs every second, third, .. is taken
HEADINGS = ("psi", "heading", "cog")
ANGLES = ("phi", "theta", *HEADINGS)


@dataclass(frozen=True)
class Series:
    """The cells of a column that are not empty."""

    times: np.ndarray  # (n,) ascending, s
    values: np.ndarray  # (n,) SI units

    @cached_property
    def interval(self) -> float:
        """Median time between two readings, s."""
        return float(np.median(np.diff(self.times)))

    def at(self, times: np.ndarray) -> np.ndarray:
        """Values by straight lines between readings at times (m,)."""
        return np.interp(times, self.times, self.values)

    def without(self, cells: np.ndarray | slice) -> "Series":
        """The readings but for those at these positions."""
        return Series(np.delete(self.times, cells), np.delete(self.values, cells))

    @cached_property
    def unwrapped(self) -> "Series":
        """An angle in rad without jumps of a turn."""
        return Series(self.times, np.unwrap(self.values))

    @cached_property
    def gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Begins and ends (n_gaps,) of times without readings, s."""
        wide = np.flatnonzero(np.diff(self.times) > GAP * self.interval)
        return self.times[wide], self.times[wide + 1]


def series(log: dict[str, np.ndarray]) -> dict[str, Series]:
    """Short name -> readings of each column of a log that has enough of them; times must ascend."""
    result = {}
    for name, values in log.items():
        cells = np.flatnonzero(np.isfinite(values))
        cells = cells[:: 1 + len(cells) // MOST]
        if name != "time" and len(cells) >= 2 * WINDOWS:
            result[name] = Series(log["time"][cells], values[cells])
    return result


def lengths(times: np.ndarray, shortest: float) -> Iterator[float]:
    """Lengths in s of the windows that a record of times (n,) is cut into, from `shortest` on."""
    length, longest = shortest, (times[-1] - times[0]) / WINDOWS
    for _ in range(LADDER):
        if length > longest:
            return
        yield length
        length *= 2.0


def windows(
    times: np.ndarray, length: float, gaps: Iterable[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """First and last reading of windows of about a length (s) that lie end to end and have none of the gaps inside.

    Times (n,) ascend, in s; there is a pair of :attr:`Series.gaps` for each column that takes part.
    """
    edges = np.searchsorted(times, np.arange(times[0], times[-1], length))
    edges = edges[np.diff(edges, prepend=-1) > 0]
    first, last = edges[:-1], edges[1:]
    whole = times[last] - times[first] <= 2.0 * length
    for begins, ends in gaps:
        whole &= np.searchsorted(begins, times[last]) == np.searchsorted(ends, times[first], side="right")
    return first[whole], last[whole]


@dataclass(frozen=True)
class Finding:
    """One disagreement among the columns of a log."""

    # ``sign``, ``unit`` or ``name`` is another than the name says; ``axes`` of velocities or the ``origin`` of an
    # angle; averages across a ``wrap``; ``stuck`` at one value; ``constant`` from first to last; a ``mark`` for no
    # reading; the ``order`` of rows; ``mixed`` rows of several boats; another ``run`` begins; the ``clock`` was set;
    # ``stamp``: repeated ones, or too few digits
    kind: str
    columns: tuple[str, ...]  # headers of the columns that are wrong
    message: str  # what they hold, with the number that shows it
    remedy: str  # what to change in the file or in the study
    # whether the whole column holds something else than its name says, and not only some of its cells
    misread: bool = False

    def line(self) -> str:
        """The finding in one line."""
        return f"{', '.join(self.columns)}: {self.message}; {self.remedy}"

    def to_json(self) -> dict:
        """The finding as JSON types."""
        return {"kind": self.kind, "columns": list(self.columns), "message": self.message, "remedy": self.remedy}
