"""What is read off histories between their samples: where a value is first reached, and how high the peak is."""

import numpy as np


def at(states: np.ndarray, histories: np.ndarray, value: float, points: int = 4) -> np.ndarray:
    """States (n, k) where histories (n, n_times) first reach a value, by inverse interpolation.

    Parameters
    ----------
    states : (n, n_times, k) array
    histories : (n, n_times) array
    value : float
        Of histories that do not reach it the states are not a number.
    points : int
        Of the polynomial, 4 for a smooth history and 2 for one that has a kink nearby.
    """
    beyond = histories >= value
    n_times = histories.shape[1]
    first = np.clip(beyond.argmax(axis=1) - points // 2, 0, n_times - points)
    places, rows = first[:, None] + np.arange(points), np.arange(len(states))[:, None]
    near, around = histories[rows, places], states[rows, places]
    weights = np.ones_like(near)
    for i in range(points):
        for j in range(points):
            if i != j:
                with np.errstate(all="ignore"):
                    weights[:, i] *= (value - near[:, j]) / (near[:, i] - near[:, j])
    found = np.einsum("ni,nik->nk", weights, around)
    return np.where(beyond.any(axis=1)[:, None], found, np.nan)


def peak(histories: np.ndarray) -> np.ndarray:
    """(n,) largest values of histories (n, n_times), of the parabola through three; not a number at an end."""
    finite = np.where(np.isfinite(histories), histories, -np.inf)
    k = finite.argmax(axis=1)
    inside = (k > 0) & (k < histories.shape[1] - 1)
    rows, k = np.arange(len(histories)), np.clip(k, 1, histories.shape[1] - 2)
    before, top, after = (histories[rows, k + j] for j in (-1, 0, 1))
    with np.errstate(all="ignore"):
        return np.where(inside, top - (after - before) ** 2 / (8.0 * (after - 2.0 * top + before)), np.nan)
