"""Integrals of the local cross-flow along a hull (Feldman 1979; Healey & Lienard 1993)."""

import numpy as np
from numpy.polynomial import legendre

from bayesub.model.equations.regressors import CROSSFLOW


def quadrature(hull: np.ndarray, stations: int) -> np.ndarray:
    """Gauss-Legendre points of a hull: positions, and heights and breadths times their weights.

    The heights and breadths are those of the polynomials of degree stations - 1 that fit the sections best, so that the
    section times any such polynomial is integrated exactly: only the kinks of the local cross-flow are left as errors,
    not those of the hull. On the 15 sections of the boat `phoenix` the largest errors of 16 points in hard manoeuvres
    are 3e-4 of the integral's root mean square; with the sections at the points they are 2e-2.

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
    x, *sections = hull
    points, weights = legendre.leggauss(stations)
    half = 0.5 * (x[-1] - x[0])
    # Between two sections they are linear, and n // 2 + 1 points integrate them times a polynomial of degree n - 1.
    inner, inner_weights = legendre.leggauss(stations // 2 + 1)
    ends = (x - x[0]) / half - 1.0
    halves = 0.5 * np.diff(ends)[:, None]
    fine = (ends[:-1, None] + halves * (1.0 + inner)).ravel()
    fit = legendre.legvander(fine, stations - 1) * (halves * inner_weights).reshape(-1, 1)
    polynomials = legendre.legvander(points, stations - 1) * (np.arange(stations) + 0.5)
    widths = (np.interp(x[0] + half * (1.0 + fine), x, section) @ fit @ polynomials.T for section in sections)
    return np.stack([x[0] + half * (1.0 + points), *(half * weights * width for width in widths)])


def integrals(values: dict[str, np.ndarray], points: np.ndarray) -> dict[str, np.ndarray]:
    """Symbol -> integral (n,), of velocities v, w, q and r (n,) and the points of :func:`quadrature`."""
    x, height, breadth = points[:, :, None]
    v, w = values["v"] + x * values["r"], values["w"] - x * values["q"]
    speed = np.sqrt(v * v + w * w)
    across, down = height * v * speed, breadth * w * speed
    return dict(zip(CROSSFLOW, (-across.sum(0), -down.sum(0), (x * down).sum(0), -(x * across).sum(0)), strict=True))
