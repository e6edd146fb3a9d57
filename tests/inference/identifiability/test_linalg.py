"""Decompositions."""

import numpy as np
import pytest

from bayesub.inference.identifiability.linalg import triangle, varimax


@pytest.mark.parametrize("n", [3, 6, 500, 7001])
def test_triangle_of_blocks_has_the_singular_values_of_the_whole(n, rng):
    """Of condition 1e9, to round-off of the largest, with fewer rows than columns and with several blocks."""
    columns = rng.standard_normal((n, 6)) * np.logspace(0, -9, 6)
    reduced = triangle(columns @ np.linalg.qr(rng.standard_normal((6, 6)))[0])
    assert reduced.shape == (min(n, 6), 6)
    np.testing.assert_array_equal(np.tril(reduced, -1), 0.0)
    expected = np.linalg.svd(columns, compute_uv=False)
    np.testing.assert_allclose(np.linalg.svd(reduced, compute_uv=False), expected, rtol=1e-13, atol=1e-14 * expected[0])


def test_triangle_keeps_inner_products(rng):
    """R'R is A'A, so that a least-squares problem is solved by the triangle of its matrix and right side."""
    matrix, values = rng.standard_normal((5000, 4)), rng.standard_normal(5000)
    reduced = triangle(np.column_stack([matrix, values]))
    solution = np.linalg.solve(reduced[:4, :4], reduced[:4, 4])
    np.testing.assert_allclose(solution, np.linalg.lstsq(matrix, values)[0], rtol=1e-12)


def test_varimax_finds_the_axes(rng):
    """Columns with one entry each, mixed by a rotation, are found again; what spans a random plane has none."""
    axes = np.eye(9)[:, [2, 5, 7]] * [1.0, 0.8, 0.9]
    mixed = axes @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    rotation = varimax(mixed)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.sort(np.abs(mixed @ rotation), axis=0)[:-1], 0.0, atol=1e-6)
    plane = np.linalg.qr(rng.standard_normal((9, 3)))[0]
    assert np.sort(np.abs(plane @ varimax(plane)), axis=0)[:-1].max() > 0.1


def test_varimax_of_nothing():
    assert varimax(np.empty((4, 0))).shape == (0, 0)
