"""Ranks, null spaces and the Fisher spectrum."""

import numpy as np
import pytest
from scipy.linalg import subspace_angles
from support.toys import SINGULAR_VALUES, ill_conditioned

import bayesub as bs
from bayesub.inference.identifiability import fisher, rank
from bayesub.model.coefficients import ADDED_MASSES, columns
from bayesub.model.linear_form import LinearSystem, linear_systems


@pytest.fixture(scope="module", params=["suboff", "auv690"])
def spiralling(request):
    """A boat, its spiral, and the ranks of its three axes."""
    vehicle = bs.load_vehicle(request.param)
    spiral = bs.load_manoeuvre("horizontal", vehicle)
    dt = 0.5 * vehicle.length_m / vehicle.speed_mps / (102.2606 / 7.5)
    return vehicle, spiral, dt, rank(linear_systems(bs.simulate(vehicle, spiral, dt=dt)))


def test_ranks_of_the_thesis(spiralling):
    """The spiral determines 6 of 6 coefficients in surge, 8 of 9 in sway and 8 of 10 in yaw."""
    ranks = spiralling[-1]
    assert {axis: (r.rank, r.columns) for axis, r in ranks.items()} == {"X": (6, 6), "Y": (8, 9), "N": (8, 10)}
    for r in ranks.values():
        assert len(r.null_vectors) == r.columns - r.rank
        # Nothing lies between round-off and what the data know.
        assert r.singular_values[r.rank - 1] > 1e6 * r.threshold
        # The threshold is a bound; what round-off really does to these matrices stays a factor of ten below it.
        assert np.all(r.singular_values[r.rank :] < 0.1 * r.threshold)
        assert r.condition == r.singular_values[0] / r.singular_values[r.rank - 1]


def test_null_vectors_leave_the_track_where_it_is(spiralling, rng):
    """20 % along a null vector moves the track by round-off, as far in random directions by metres on a 100 m boat."""
    vehicle, spiral, dt, ranks = spiralling
    for vector in (v for r in ranks.values() for v in r.null_vectors):
        where = columns(vector)
        changes = rng.standard_normal((9, len(where)))
        changes[0] = list(vector.values()) / vehicle.xi[where]
        changes *= (
            0.2 / np.abs(changes[0]).max() * np.linalg.norm(changes[0]) / np.linalg.norm(changes, axis=1)[:, None]
        )
        sets = np.repeat(vehicle.xi[None], 10, axis=0)
        sets[1:, where] *= 1 + changes
        tracks = bs.simulate(vehicle, spiral, xi=sets, dt=dt).states[:, :, :3]
        moved = np.linalg.norm(tracks[1:] - tracks[0], axis=2).max(axis=1)
        # Round-off of a machine epsilon times a kilometre and a thousand steps is 2e-10 m.
        assert moved[0] < 1e-9
        assert np.median(moved[1:]) > 0.05 * vehicle.length_m


def test_null_vectors_need_added_mass(spiralling):
    """Every null direction moves an added mass, so that the axis becomes unique when those are held."""
    vehicle, spiral, dt, ranks = spiralling
    for r in ranks.values():
        assert all(set(vector) & set(ADDED_MASSES) for vector in r.null_vectors)
    free = [name for name in bs.coefficients.HORIZONTAL if name not in ("Yvdot", "Nvdot", "Nrdot")]
    held = rank(linear_systems(bs.simulate(vehicle, spiral, dt=dt), free=free))
    assert all(r.rank == r.columns for r in held.values())


@pytest.fixture
def planted(rng):
    """A system with two null directions and columns that differ by twelve decades, and the directions (7, 2)."""
    free = rng.standard_normal((500, 5))
    matrix = np.hstack([free, free @ rng.standard_normal((5, 2))])
    scale = 10.0 ** np.linspace(-6, 6, 7)
    null = np.linalg.svd(matrix)[2][5:].T / scale[:, None]
    return LinearSystem("Y", tuple("abcdefg"), matrix * scale, np.zeros(500)), null


def as_columns(r):
    return np.array([[vector.get(name, 0.0) for name in r.names] for vector in r.null_vectors]).T


def test_planted_null_space_is_found(planted):
    """The null space that was planted is the one that is found, with columns of any size."""
    system, null = planted
    found = rank({"Y": system})["Y"]
    assert (found.rank, found.columns) == (5, 7)
    lengths = np.linalg.norm(system.matrix, axis=0)[:, None]
    # Round-off of the null space over the gap in the spectrum, which is of order one.
    assert subspace_angles(as_columns(found) * lengths, null * lengths).max() < 1e-13


def test_each_null_vector_has_a_pivot_of_its_own(planted):
    """Null vectors come tied to one coefficient each; holding those makes the rest unique."""
    system, _ = planted
    for prefer in ((), ("c", "d", "e")):
        found = rank({"Y": system}, prefer=prefer)["Y"]
        assert len(found.pivots) == 2
        assert set(found.pivots) <= set(prefer or system.names)
        for pivot, vector in zip(found.pivots, found.null_vectors, strict=True):
            assert [p in vector for p in found.pivots] == [p == pivot for p in found.pivots]
        keep = [k for k, name in enumerate(system.names) if name not in found.pivots]
        rest = LinearSystem("Y", tuple(system.names[k] for k in keep), system.matrix[:, keep], system.load)
        assert rank({"Y": rest})["Y"].rank == 5


def test_a_nearly_null_direction_is_not_null(planted, rng):
    """A direction that the data know to one part in a million is known."""
    system, _ = planted
    lengths = np.linalg.norm(system.matrix, axis=0) / np.sqrt(len(system.matrix))
    blurred = system.matrix + 1e-6 * lengths * rng.standard_normal(system.matrix.shape)
    found = rank({"Y": LinearSystem("Y", system.names, blurred, system.load)})["Y"]
    assert found.rank == 7
    assert found.null_vectors == ()
    assert 1e-7 < found.singular_values[-1] / found.singular_values[0] < 1e-5


def test_fisher_spectrum_of_a_known_matrix():
    """Singular values and directions are those the problem was made of, in prior standard deviations."""
    problem, null = ill_conditioned()
    spectrum = fisher(problem, problem.mean)
    np.testing.assert_allclose(spectrum.singular_values, SINGULAR_VALUES, rtol=1e-10, atol=1e-12)
    assert spectrum.n_informed in (3, 4)  # the fourth value is one up to round-off
    assert abs(spectrum.directions[-1] @ null) == pytest.approx(1.0, abs=1e-10)  # round-off over a gap of 1e-5 squared
