"""Forces at knots given the readings, against the same by dense linear algebra."""

import numpy as np
import pytest

from bayesub.kernels.kalman import HATS, Innovations, Pieces, policy, respond, smooth

N_PIECES, N_STATES, N_AXES, N_LAGS, N_ROWS, N_TERMS = 7, 4, 2, 3, 25, 3
N_KNOTS = N_PIECES + 1
N_WHITE = N_AXES * N_KNOTS


@pytest.fixture(scope="module")
def case():
    """Eleven members: a full group of lanes and some more; the last residual is one that no force moves."""
    rng, n, n_columns = np.random.default_rng(0), 11, N_STATES + HATS * N_AXES
    numbers = np.sort(rng.integers(0, N_PIECES, N_ROWS - 1))
    pieces = Pieces(
        0.3 * rng.standard_normal((N_TERMS, N_PIECES, N_STATES, n_columns)),
        rng.standard_normal((N_TERMS, N_ROWS, n_columns)),
        rng.permutation(N_ROWS - 1),
        np.searchsorted(numbers, np.arange(N_PIECES + 1)),
    )
    sequences = Innovations(
        0.4 * rng.standard_normal((n, N_AXES, N_LAGS)),
        rng.standard_normal((n, N_AXES, N_KNOTS, N_LAGS)),
        1.0 + rng.random((n, N_AXES, N_KNOTS)),
    )
    features, residuals = 0.5 * rng.standard_normal((n, N_TERMS)), rng.standard_normal((n, N_ROWS))
    return pieces, features, sequences, residuals, rng.standard_normal((n, N_AXES, N_KNOTS))


def member(case, k):
    """Pieces of one term, and the innovations, of a member."""
    pieces, features, sequences, *_ = case
    parts = (np.tensordot(features[[k]], part, axes=1) for part in pieces[:2])
    return Pieces(*parts, *pieces[2:]), Innovations(*(part[[k]] for part in sequences))


def dense(case, k):
    """(N_ROWS, N_WHITE) derivatives of the residuals of a member, force by force from its recursion."""
    pieces, sequences = member(case, k)
    unit = np.eye(N_WHITE).reshape(N_WHITE, N_AXES, N_KNOTS)
    forces = np.zeros_like(unit)
    for n in range(N_WHITE):
        for a in range(N_AXES):
            ahead = np.zeros(N_LAGS)
            for j in range(N_KNOTS):
                forces[n, a, j] = ahead[0] + sequences.roots[0, a, j] * unit[n, a, j]
                ahead = np.append(ahead[1:], sequences.last[0, a] @ ahead) + sequences.gains[0, a, j] * unit[n, a, j]
    return respond(pieces, forces).T, forces


def test_forces_and_their_response(case):
    """The compiled recursion is the plain one; the response is that of states that go from piece to piece."""
    pieces, sequences = member(case, 3)
    response, forces = dense(case, 3)
    unit = np.eye(N_WHITE).reshape(forces.shape)
    np.testing.assert_allclose(sequences.repeated(N_WHITE).forces(unit), forces, atol=1e-13)
    np.testing.assert_allclose(sequences.repeated(N_WHITE).white(forces), unit, atol=1e-12)
    state, rows = np.zeros(N_STATES), np.zeros(N_ROWS)
    padded = np.pad(forces[5], ((0, 0), (0, HATS)))
    for k in range(N_PIECES):
        causes = np.concatenate([state, *(axis[k : k + HATS] for axis in padded)])
        for row in pieces.order[pieces.firsts[k] : pieces.firsts[k + 1]]:
            rows[row] = pieces.rows[0, row] @ causes
        state = pieces.ends[0, k] @ causes
    np.testing.assert_allclose(response[:, 5], rows, atol=1e-12)


@pytest.mark.parametrize("k", [0, 7, 10])
def test_what_is_found_is_that_of_dense_algebra(case, k):
    """Determinant, best white coordinates, and residuals without forces."""
    *_, residuals, white = case
    found, (response, _), w = smooth(*case), dense(case, k), white[k].ravel()
    precision = response.T @ response + np.eye(N_WHITE)
    assert found.log_determinants[k] == pytest.approx(np.linalg.slogdet(precision)[1], abs=1e-11)
    best = w - np.linalg.solve(precision, response.T @ residuals[k] + w)
    np.testing.assert_allclose(found.white[k].ravel(), best, atol=1e-12)
    order = np.append(case[0].order, N_ROWS - 1)
    lower = np.linalg.cholesky(np.eye(N_ROWS) + response[order] @ response[order].T)
    errors = np.linalg.solve(lower, (residuals[k] - response @ w)[order])
    np.testing.assert_allclose(found.errors[k][order], errors, atol=1e-11)


def no_motion(n):
    """Reference states of a motion of which no state is looked at."""
    return np.zeros((n, N_PIECES, 0))


@pytest.mark.parametrize("k", [0, 10])
def test_a_policy_makes_draws(case, k):
    """They are linear in y and have the covariance given the readings, whose determinant is told; without y the best.

    The first of those knots that are chosen together does not depend on the y of later ones.
    """
    pieces, features, sequences, residuals, white = case
    response, _ = dense(case, k)
    one = Innovations(*(part[[k]] for part in sequences)).repeated(N_WHITE)
    y = np.eye(N_WHITE).reshape(N_WHITE, N_AXES, N_KNOTS)

    def repeated(array):
        return np.repeat(array[[k]], N_WHITE, axis=0)

    best = smooth(pieces, features, sequences, residuals, white)
    given = repeated(features), one, repeated(residuals), repeated(white)
    law, log_determinants = policy(pieces, *given, 0.0 * y, no_motion(N_WHITE))
    unmoved = repeated(white) + law.followed()
    np.testing.assert_allclose(unmoved, repeated(best.white), atol=1e-12)
    np.testing.assert_allclose(log_determinants, best.log_determinants[k], atol=1e-11)
    law, _ = policy(pieces, *given, y, no_motion(N_WHITE))
    by_y = (repeated(white) + law.followed() - unmoved).reshape(N_WHITE, N_WHITE).T
    np.testing.assert_allclose(by_y @ by_y.T, np.linalg.inv(response.T @ response + np.eye(N_WHITE)), atol=1e-12)
    assert np.linalg.slogdet(by_y)[1] == pytest.approx(-0.5 * best.log_determinants[k], abs=1e-10)
    in_time = by_y.reshape(N_AXES, N_KNOTS, N_AXES, N_KNOTS).transpose(1, 0, 3, 2).reshape(N_WHITE, N_WHITE)
    assert np.all(in_time == np.tril(in_time))


def test_members_do_not_touch_each_other(case):
    """One that is not a number spoils none of the others in its lanes."""
    pieces, features, sequences, residuals, white = case
    spoilt = residuals.copy()
    spoilt[2] = np.nan
    before, after = smooth(*case), smooth(pieces, features, sequences, spoilt, white)
    kept = np.arange(len(white)) != 2
    np.testing.assert_array_equal(after.white[kept], before.white[kept])
    assert np.isnan(after.white[2]).all()
