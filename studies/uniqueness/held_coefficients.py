"""Which coefficients of an axis, once known, make the rest unique."""

from itertools import combinations

import numpy as np

from bayesub.inference.identifiability.rank import round_off
from bayesub.inference.interface import LinearForm


def held_fixed(system: LinearForm, n_held: int) -> dict[tuple[str, ...], float]:
    """Which coefficients, once known, make the rest of an axis unique: every choice of `n_held` is tried.

    Parameters
    ----------
    system : the linear form of the axis
    n_held : number of coefficients to hold

    Returns
    -------
    dict of names -> smallest singular value, over the largest, of the columns that are left; zero where that is
    round-off, so that the rest is still not unique. Best choice first.
    """
    scaled = system.matrix / np.linalg.norm(system.matrix, axis=0)
    triangle = np.linalg.qr(scaled, mode="r")  # the same singular values for any choice of columns
    rounding = np.broadcast_to(system.rounding, len(system.names))
    results = {}
    for held in combinations(range(len(system.names)), n_held):
        s = np.linalg.svd(np.delete(triangle, held, axis=1), compute_uv=False)
        rest = np.delete(rounding, held)
        unique = s[-1] > round_off((len(scaled), len(rest)), s[0], rest)
        results[tuple(system.names[k] for k in held)] = float(s[-1] / s[0]) if unique else 0.0
    return dict(sorted(results.items(), key=lambda item: -item[1]))
