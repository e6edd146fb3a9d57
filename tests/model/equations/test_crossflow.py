"""Integrals of the local cross-flow along a hull: exact for smooth flow, close to fine integrals for any."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.equations.regressors import crossflow_integrals, crossflow_points

FILE = Path(bs.__file__).parent / "data" / "vehicles" / "phoenix.toml"


@pytest.fixture
def hull():
    sections = tomllib.loads(FILE.read_text())["hull"]
    return np.array([sections[key] for key in ("x_m", "height_m", "breadth_m")])


@pytest.mark.parametrize("stations", [2, 3, 8, 16])
def test_sections_times_polynomials_are_exact(hull, stations, rng):
    """By panels between the sections, where both are polynomials."""
    x, height, breadth = crossflow_points(hull, stations)
    polynomial = np.polynomial.Polynomial(rng.standard_normal(stations))
    ends = hull[0]
    points, weights = np.polynomial.legendre.leggauss(20)
    fine = 0.5 * (ends[:-1, None] + ends[1:, None] + np.diff(ends)[:, None] * points)
    lengths = 0.5 * np.diff(ends)[:, None] * weights
    for section, width in zip(hull[1:], (height, breadth), strict=True):
        exact = (np.interp(fine, ends, section) * polynomial(fine) * lengths).sum()
        assert width @ polynomial(x) == pytest.approx(exact, abs=1e-12)


def test_sixteen_points_are_close_to_fine_integrals(hull, rng):
    speed, length = 0.6, 2.2
    sizes = {"v": 0.25 * speed, "w": 0.15 * speed, "q": 0.3 * speed / length, "r": 0.6 * speed / length}
    values = {name: size * rng.uniform(-1.0, 1.0, 2000) for name, size in sizes.items()}
    x = np.linspace(hull[0, 0], hull[0, -1], 4001)
    dx = np.full(len(x), x[1] - x[0])
    dx[[0, -1]] /= 2.0
    exact = crossflow_integrals(values, np.stack([x, *(np.interp(x, hull[0], s) * dx for s in hull[1:])]))
    ours = crossflow_integrals(values, crossflow_points(hull, 16))
    for name, integral in exact.items():
        error = np.abs(ours[name] - integral).max() / np.sqrt((integral**2).mean())
        assert error < 5e-4, name  # 2e-4 measured; 2.4e-2 with the sections at the points
