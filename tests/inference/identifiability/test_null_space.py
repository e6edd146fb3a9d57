"""The one way to null directions."""

import numpy as np
import pytest
from support.toys import Banana

import bayesub as bs
from bayesub.inference.identifiability import fisher, null_space, rank
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
