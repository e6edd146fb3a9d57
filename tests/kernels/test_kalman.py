"""Forces at knots given the readings, against the same by dense linear algebra."""

import numpy as np
import pytest

from bayesub.kernels.kalman import HATS, Innovations, Pieces, policy, respond

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


def best(case):
    """The white coordinates that fit best, and the log determinants; no state of the motion is looked at."""
    white = case[-1]
    law, log_determinants = policy(*case, np.zeros(white.shape), np.zeros((len(white), N_PIECES, 0)))
    return white + law.followed(), log_determinants


@pytest.mark.parametrize("k", [0, 7, 10])
def test_what_is_found_is_that_of_dense_algebra(case, k):
    """Determinant, and best white coordinates."""
    *_, residuals, white = case
    (found, log_determinants), (response, _), w = best(case), dense(case, k), white[k].ravel()
    precision = response.T @ response + np.eye(N_WHITE)
    assert log_determinants[k] == pytest.approx(np.linalg.slogdet(precision)[1], abs=1e-11)
    by_hand = w - np.linalg.solve(precision, response.T @ residuals[k] + w)
    np.testing.assert_allclose(found[k].ravel(), by_hand, atol=1e-12)


@pytest.mark.parametrize("k", [0, 10])
def test_a_policy_makes_draws(case, k):
    """They are linear in y and have the covariance given the readings, whose determinant is told.

    What is chosen at a knot does not depend on the y of later ones.
    """
    pieces, features, sequences, residuals, white = case
    response, _ = dense(case, k)
    one = Innovations(*(part[[k]] for part in sequences)).repeated(N_WHITE)
    y = np.eye(N_WHITE).reshape(N_WHITE, N_AXES, N_KNOTS)

    def repeated(array):
        return np.repeat(array[[k]], N_WHITE, axis=0)

    given = repeated(features), one, repeated(residuals), repeated(white)
    law, log_determinants = policy(pieces, *given, y, np.zeros((N_WHITE, N_PIECES, 0)))
    by_y = (white[k] + law.followed() - best(case)[0][k]).reshape(N_WHITE, N_WHITE).T
    np.testing.assert_allclose(by_y @ by_y.T, np.linalg.inv(response.T @ response + np.eye(N_WHITE)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.slogdet(by_y)[1], -0.5 * log_determinants, atol=1e-10)
    in_time = by_y.reshape(N_AXES, N_KNOTS, N_AXES, N_KNOTS).transpose(1, 0, 3, 2).reshape(N_WHITE, N_WHITE)
    assert np.all(in_time == np.tril(in_time))


def test_members_do_not_touch_each_other(case):
    """One that is not a number spoils none of the others."""
    pieces, features, sequences, residuals, white = case
    spoilt = residuals.copy()
    spoilt[2] = np.nan
    (before, _), (after, _) = best(case), best((pieces, features, sequences, spoilt, white))
    kept = np.arange(len(white)) != 2
    np.testing.assert_array_equal(after[kept], before[kept])
    assert np.isnan(after[2]).all()
