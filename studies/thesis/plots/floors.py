"""Values that are below the lower edge of a figure."""

import numpy as np


def above_floor(panel, x, values, floor: float, colour: str) -> np.ndarray:
    """Values (n,) with those below a floor made not a number, for which arrows stand at the lower edge."""
    x, values = np.asarray(x, dtype=float), np.asarray(values, dtype=float)
    below = values < floor
    if below.any():
        arrow = {"marker": r"$\downarrow$", "ls": "", "ms": 7, "mew": 0.3, "color": colour}
        panel.plot(x[below], np.full(np.count_nonzero(below), 0.025), transform=panel.get_xaxis_transform(), **arrow)
    return np.where(below, np.nan, values)
