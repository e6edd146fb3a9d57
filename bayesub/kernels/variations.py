"""Changes of the controls that members of a batch make by amounts of their own, where they are not zero."""

from typing import NamedTuple

import numpy as np

from bayesub.kernels.memory import plain


class Variations(NamedTuple):
    """What a unit of each of n changes adds to the controls at the stages of the steps.

    Start, middle and end of step i are stages 3 i, 3 i + 1 and 3 i + 2; ``starts[s]`` to ``starts[s + 1]`` is stage s.
    """

    starts: np.ndarray  # (n_stages + 1,)
    numbers: np.ndarray  # (n_entries,) which change, 0 to n - 1
    columns: np.ndarray  # (n_entries,) which control
    values: np.ndarray  # (n_entries,) what a unit of the change adds to it

    def plain(self) -> "Variations":
        """The same in contiguous arrays that may be written to."""
        starts, numbers, columns = (plain(part, int) for part in self[:3])
        return Variations(starts, numbers, columns, plain(self.values))

    def added(self, amounts: np.ndarray, n_columns: int) -> np.ndarray:
        """(n_steps, 3, n_columns) what `amounts` (n,) of the changes add to the controls."""
        n_stages = len(self.starts) - 1
        places = np.repeat(np.arange(n_stages), np.diff(self.starts)) * n_columns + self.columns
        sums = np.bincount(places, self.values * amounts[self.numbers], minlength=n_stages * n_columns)
        return sums.reshape(-1, 3, n_columns)


def of_entries(
    n_steps: int, stages: np.ndarray, numbers: np.ndarray, columns: np.ndarray, values: np.ndarray
) -> Variations:
    """The changes of entries (n_entries,) in any order; those of one stage keep theirs."""
    order = np.argsort(stages, kind="stable")
    starts = np.searchsorted(stages[order], np.arange(3 * n_steps + 1))
    return Variations(starts, *(part[order] for part in (numbers, columns, values)))


def of_dense(changes: np.ndarray) -> Variations:
    """The changes of an array (n_steps, 3, n, n_columns)."""
    step, part, numbers, columns = np.nonzero(changes)
    return of_entries(len(changes), 3 * step + part, numbers, columns, changes[step, part, numbers, columns])
