"""Null directions that Jacobians have in common."""

import numpy as np
import pytest
from scipy.linalg import subspace_angles

from uniqueness.structure import structure

N_READINGS, N_PARAMS = 600, 8


def blind(directions, rng, n_readings=N_READINGS, n_params=N_PARAMS):
    """A random Jacobian that does not see directions (k, n_params)."""
    basis = np.linalg.qr(np.transpose(directions))[0]
    jacobian = rng.standard_normal((n_readings, n_params))
    return jacobian - jacobian @ basis @ basis.T


@pytest.fixture
def null(rng):
    return rng.standard_normal((2, N_PARAMS))


def test_planted_null_space(null, rng):
    """The directions that all Jacobians miss are found; one more that each misses for itself is not structural."""
    jacobians = [blind([*null, rng.standard_normal(N_PARAMS)], rng, n) for n in (600, 50, 300)]
    found = structure(jacobians)
    assert (found.n_structural, found.n_practical, found.alone) == (2, 0, (3, 3, 3))
    assert subspace_angles(found.structural.T, null.T).max() < 1e-13  # round-off over a gap of order one
    assert found.gap > 1e10


def test_equal_counts_are_not_equal_directions(rng):
    """Two Jacobians with one null direction each have none in common."""
    found = structure([blind([rng.standard_normal(N_PARAMS)], rng) for _ in range(2)])
    assert (found.n_structural, found.alone, found.gap) == (0, (1, 1), None)


@pytest.mark.parametrize("size", [1e-6, 1e-8, 1e-10])
def test_a_faint_direction_is_not_structural(size, null, rng):
    """One Jacobian of three sees a direction by a millionth and less: it is known, if only in principle."""
    jacobians = [blind(null, rng) for _ in range(3)]
    jacobians[1] = jacobians[1] + size * np.outer(rng.standard_normal(N_READINGS), null[0])
    found = structure(jacobians, accuracy=1e-5)
    assert (found.n_structural, found.n_practical, found.alone) == (1, 1, (2, 1, 2))
    # What is seen of null[0] is null in its complement: the structural direction is the one left in the plane.
    left = null[1] - null[1] @ null[0] / (null[0] @ null[0]) * null[0]
    assert abs(found.structural[0] @ left) / np.linalg.norm(left) == pytest.approx(1.0, abs=1e-4)  # 1e-14 over 1e-10
    assert structure(jacobians, accuracy=0.1 * size).n_practical == 0


@pytest.mark.parametrize("error", [1e-12, 1e-9])
def test_noise_of_derivatives(error, null, rng):
    """Round-off of derivatives, exact ones by default and differences if told, hides neither null nor faint ones."""
    jacobians = [blind(null, rng) for _ in range(3)]
    jacobians[0] = jacobians[0] + 1e-6 * np.outer(rng.standard_normal(N_READINGS), null[0])
    jacobians = [j + 0.3 * error * rng.standard_normal(j.shape) for j in jacobians]
    found = structure(jacobians, noise=None if error == 1e-12 else error)
    assert found.n_structural == 1
    assert subspace_angles(found.structural.T, null.T).max() < 1e3 * error / 1e-6
    assert structure(jacobians, noise=1e-16).n_structural == 0


def test_scale_of_columns_does_not_matter(null, rng):
    """Parameters in other units have the same directions in those units."""
    jacobians = [blind(null, rng) for _ in range(2)]
    units = 10.0 ** rng.uniform(-4, 4, N_PARAMS)
    found = structure([j * units for j in jacobians])
    assert found.n_structural == 2
    assert subspace_angles((found.structural * units).T, null.T).max() < 1e-11  # 1e-15 times spread of the units


def test_few_readings_and_dead_columns(rng):
    """Fewer readings than parameters leave directions open, and a parameter without effect is one by itself."""
    jacobian = rng.standard_normal((3, 5))
    jacobian[:, 2] = 0.0
    found = structure([jacobian])
    assert (found.n_structural, len(found.singular_values)) == (2, 5)
    more = rng.standard_normal((20, 5))
    more[:, 2] = 0.0
    found = structure([jacobian, more])
    np.testing.assert_allclose(np.abs(found.structural), [[0, 0, 1, 0, 0]], atol=1e-14)
    assert found.alone == (2, 1)


def test_jacobians_of_different_parameters(rng):
    with pytest.raises(ValueError, match="same parameters"):
        structure([rng.standard_normal((9, 3)), rng.standard_normal((9, 4))])
    with pytest.raises(ValueError, match="at least one"):
        structure([])
