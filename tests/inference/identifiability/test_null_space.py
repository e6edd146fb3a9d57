"""The one way to null directions."""

import numpy as np
import pytest
from scipy.linalg import subspace_angles
from support.toys import Banana

import bayesub as bs
from bayesub.inference.identifiability import fisher, null_space, rank, structure
from bayesub.model.coefficients import ADDED_MASSES, HORIZONTAL, NAMES
from bayesub.model.linear_form import linear_systems, stacked
from ill_conditioning.profile import profile

SENSOR = bs.sensors.Track(0.5, 0.1, interval_s=5.0, channels=("x", "y", "yaw"))
PRIOR = bs.priors.relative_normal(0.25)


def posed(suboff, manoeuvre, track, **options):
    record = bs.observe(track, SENSOR, np.random.default_rng(1))
    return bs.Problem(suboff, manoeuvre, record, free=HORIZONTAL, prior=PRIOR, dt=0.5, **options)


@pytest.fixture(scope="module")
def problem(suboff, spiral, spiral_track):
    return posed(suboff, spiral, spiral_track)


def test_null_vectors_are_those_of_the_linear_form(problem):
    """Axis by axis, named by added masses, which hold the rest of the coefficients in place."""
    mean = problem.prior.mean
    null = null_space(problem, mean)
    ranks = rank(linear_systems(problem.trajectory(mean), free=problem.names), prefer=ADDED_MASSES)
    assert {axis: r.summary() for axis, r in null.ranks.items()} == {axis: r.summary() for axis, r in ranks.items()}
    assert len(null) == sum(r.null_dimension for r in ranks.values()) == 3
    assert len(null.pivots) == 3
    assert set(null.pivots) <= set(ADDED_MASSES)
    basis = null.basis(problem.prior.sd)
    np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-14)


def test_spectra_and_profiles_take_them_unasked(problem):
    """The null directions are the last rows, whatever their singular values; the readings do not see them."""
    mean = problem.prior.mean
    spectrum, null = fisher(problem, mean), null_space(problem, mean)
    assert spectrum.n_null == 3
    given = fisher(problem, mean, null.vectors)
    np.testing.assert_array_equal(spectrum.directions, given.directions)
    basis = null.basis(problem.prior.sd)
    np.testing.assert_allclose(np.abs(np.linalg.svd(spectrum.directions[-3:] @ basis.T)[1]), 1.0, rtol=1e-12)
    assert spectrum.singular_values[-3:].max() < 1e-6 * spectrum.singular_values[-4]
    assert fisher(problem, mean, null=()).n_null == 0
    valley = profile(problem, mean, null.pivots[0], mean[problem.names.index(null.pivots[0])] * np.array([0.9, 1.1]))
    np.testing.assert_array_equal(valley.laplace, 0.0)
    np.testing.assert_allclose(valley.cost, 0.0, atol=1e-3)


def test_nuisance_parameters_have_no_part(suboff, spiral, spiral_track):
    """Null vectors name coefficients only, of the motion that the nuisance parameters give."""
    nuisance = {"u0_mps": bs.priors.normal(7.5, 0.1), "mass_kg": bs.priors.normal(suboff.body[0], 1e5)}
    problem = posed(suboff, spiral, spiral_track, nuisance=nuisance)
    at = problem.prior.mean.copy()
    at[-2:] += [0.2, 5e4]
    null = null_space(problem, at)
    basis = null.basis(problem.prior.sd)
    assert len(null) == 3
    np.testing.assert_array_equal(basis[:, -2:], 0.0)
    # The readings at these very parameters do not see them; those at the mass of the vehicle would.
    jacobian = problem.jacobian(at) * problem.prior.sd
    size = np.linalg.norm(jacobian, 2)
    assert np.linalg.norm(jacobian @ basis.T) < 1e-9 * size
    elsewhere = null_space(problem, problem.prior.mean).basis(problem.prior.sd)
    assert np.linalg.norm(jacobian @ elsewhere.T) > 1e-7 * size


def test_trials_together(suboff, problem):
    """The equations of all trials stand below one another."""
    zigzag = bs.load_manoeuvre("zigzag_20_20", suboff)
    other = posed(suboff, zigzag, bs.simulate(suboff, zigzag, dt=0.5))
    joint = bs.JointProblem({"spiral": problem, "zigzag": other})
    mean = joint.prior.mean
    both = rank(stacked([one.linear_systems(mean) for one in (problem, other)], NAMES), prefer=ADDED_MASSES)
    null = null_space(joint, mean)
    assert {axis: r.summary() for axis, r in null.ranks.items()} == {axis: r.summary() for axis, r in both.items()}
    assert fisher(joint, mean).n_null == len(null) > 0


def test_without_equations_there_are_none():
    """A toy has no linear form; its null directions are those that are handed in."""
    banana = Banana()
    assert len(null_space(banana, banana.prior.mean)) == 0
    assert fisher(banana, banana.prior.mean).n_null == 0
    assert fisher(banana, np.array([0.0, 0.0]), [{"c0": 1.0}]).n_null == 1


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
