"""Integrals of the local cross-flow along a hull (Feldman 1979; Healey & Lienard 1993)."""

import numpy as np

SYMBOLS = ("crossflow_y", "crossflow_z", "crossflow_m", "crossflow_n")


def quadrature(hull: np.ndarray, stations: int) -> np.ndarray:
    """Gauss-Legendre points of a hull: positions, and heights and breadths times their weights.

    Parameters
    ----------
    hull : (3, n) array
        Positions from tail to nose, heights and breadths, m; linear between them.
    stations : int
        Number of points.

    Returns
    -------
    (3, stations) array
        m, m^2, m^2.
    """
    x, height, breadth = hull
    points, weights = np.polynomial.legendre.leggauss(stations)
    half = 0.5 * (x[-1] - x[0])
    at = x[0] + half * (1.0 + points)
    return np.stack([at, half * weights * np.interp(at, x, height), half * weights * np.interp(at, x, breadth)])


def integrals(values: dict[str, np.ndarray], points: np.ndarray) -> dict[str, np.ndarray]:
    """Symbol -> integral (n,), of velocities v, w, q and r (n,) and the points of :func:`quadrature`."""
    x, height, breadth = points[:, :, None]
    v, w = values["v"] + x * values["r"], values["w"] - x * values["q"]
    speed = np.sqrt(v * v + w * w)
    across, down = height * v * speed, breadth * w * speed
    return dict(zip(SYMBOLS, (-across.sum(0), -down.sum(0), (x * down).sum(0), -(x * across).sum(0)), strict=True))
