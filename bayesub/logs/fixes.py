"""Latitude and longitude of a log as positions in m."""

from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError

COLUMNS = ("latitude_deg", "longitude_deg")
LIMITS = (90.0, 360.0)
FARTHEST = 200e3  # m from the first fix


def positions(path: Path, names: list[str], rows: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and y (n,) each of fixes on the ellipsoid WGS 84, in the plane that touches it at the first fix, m.

    Parameters
    ----------
    path : Path
        Of the file, for errors.
    names : list of str
        Its columns.
    rows : (n, n_columns) array
        Their cells.
    line : (n,) array of int
        Where the rows stand.

    Raises
    ------
    InputError
        For latitude without longitude, and for fixes that are not on the earth or far from the first.
    """
    for one, other in (COLUMNS, COLUMNS[::-1]):
        if one not in names:
            raise InputError(
                f"{path}: column '{other}' is given without '{one}'; add it or leave both out", "missing", one
            )
    fixes = rows[:, [names.index(name) for name in COLUMNS]]
    for name, values, limit in zip(COLUMNS, fixes.T, LIMITS, strict=True):
        wrong = np.flatnonzero(np.abs(values) > limit)
        if wrong.size:
            raise InputError(
                f"{path}: line {line[wrong[0]]}, column '{name}': {values[wrong[0]]:g} is beyond {limit:g}",
                "value",
                name,
            )
    whole = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    if not whole.size:
        raise InputError(f"{path}: no row has both {COLUMNS[0]} and {COLUMNS[1]}", "data", COLUMNS[0])
    import pymap3d  # here, since most logs have none

    first = fixes[whole[0]]
    relative = np.full((len(rows), 3), np.nan)
    relative[whole] = np.stack(pymap3d.geodetic2ned(*fixes[whole].T, 0.0, *first, 0.0), axis=-1)
    distance = np.linalg.norm(relative, axis=1)
    far = np.flatnonzero(distance > FARTHEST)
    if far.size:
        k = far[0]
        fix, begin = (f"{values[0]:g}, {values[1]:g}" for values in (fixes[k], first))
        where = f"line {line[k]}: the fix {fix} is {distance[k] / 1e3:.0f} km from the first, {begin}"
        raise InputError(f"{path}: {where}; empty the cells of what is no fix", "data", COLUMNS[0])
    return relative[:, 0], relative[:, 1]
