"""Mechanisms behind ranks, null moves, and sets that data leave open."""

from dataclasses import replace

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.coefficients import INDEX
from bayesub.model.linear_form import LinearSystem
from thesis import cases, mechanisms
from uniqueness import null_directions
from uniqueness.held_coefficients import held_fixed
from wrong_coefficients import open_sets


@pytest.mark.parametrize("row", [row for row in mechanisms.MECHANISMS if row[1] == "horizontal" or "zigzag" in row[1]])
def test_signs_of_two_motions_decide_a_rank(row):
    """A zigzag shows a coefficient that the spiral hides, unless only samples with opposite signs are left."""
    result = mechanisms.mechanism(*row)
    assert result["rank"] == row[3]


def test_a_boat_is_altered_by_name(suboff):
    """Mass properties and coefficients are set, buoyancy as a share of the weight; the boat itself stays."""
    before = suboff.xi.copy()
    changed = mechanisms.altered(suboff, {"Yp_absp": 0.5, "buoyancy": 0.9, "zG": 0.1})
    assert changed.xi[INDEX["Yp_absp"]] == 0.5
    np.testing.assert_array_equal(suboff.xi, before)
    assert np.count_nonzero(changed.body != suboff.body) == 2


def test_relative_signs():
    """The sign of a product of two motions, and the share of samples in which it is positive."""
    boat = bs.load_vehicle("npsauv")
    track = bs.simulate(boat, bs.load_manoeuvre("coupled", boat))
    for pair, signs in mechanisms.relative_signs(track).items():
        first, second = mechanisms.motions(track, pair)
        np.testing.assert_array_equal(signs, np.sign(first * second))
        shares = mechanisms.shares_of_equal_signs(track)[pair]
        assert shares["samples"] == np.mean(first * second > 0)
        assert 0.0 < shares["regressor"] < 1.0


def test_null_moves_move_no_track():
    """Coefficients half off along null vectors leave a random manoeuvre to round-off; random errors do not."""
    boat = bs.load_vehicle("npsauv")
    simulators = list(cases.unseen(boat, 2))
    names = open_sets.tracks(boat, simulators[:1]).names
    sets = open_sets.null_moves(boat, names)
    assert len(sets) == 2
    off = open_sets.errors(boat, names, simulators, 1, sets)
    assert max(off["unseen_m"] + off["seen_m"]) < 1e-6
    assert max(off["coefficient_largest"]) == pytest.approx(open_sets.NULL_MOVE)
    random = open_sets.random_sets(boat, {"random": 0.01}, 3)["random"]
    assert min(open_sets.errors(boat, names, simulators, 1, random)["unseen_m"]) > 1e-3


def test_open_sets_are_draws_of_the_posterior(monkeypatch):
    """With a prior so narrow that tracks are linear in it, they have the closed-form covariance, (J'J + I)^-1."""
    monkeypatch.setattr(open_sets, "PRIOR_SD", 0.01)
    boat, n_sets = bs.load_vehicle("npsauv"), 40
    found = open_sets.open_sets("npsauv", 1, n_sets)
    problem = open_sets.tracks(boat, cases.unseen(boat, 1))
    middle, unit = np.zeros(problem.n_params), np.eye(problem.n_params)
    jacobian = problem.jacobian(problem.prior.parameters(middle)) @ problem.prior.chain(unit, middle)
    t = problem.prior.standard(np.array(found["xi"])[:, problem.columns])
    squares = (t @ np.linalg.cholesky(jacobian.T @ jacobian + unit)) ** 2
    assert squares.mean() == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / squares.size))
    assert max(found["last_steps"]) < 0.01


def test_tracks_and_linear_form_have_the_same_null_space():
    """On four manoeuvres together npsauv's horizontal coefficients keep one null direction, and it is the predicted."""
    manoeuvres = ("horizontal", "turning_circle", "zigzag_20_20")
    result = null_directions.of_tracks(bs.load_vehicle("npsauv"), "horizontal", manoeuvres, 0)
    assert result["structural"] == result["predicted"] > 0
    assert result["angle_rad"] < 1e-6
    assert min(result["alone"].values()) >= result["structural"]


def test_held_coefficients(rng):
    """A coefficient makes the rest unique if and only if the null vector holds it; two, if a minor is not zero."""
    free = rng.standard_normal((300, 4))
    matrix = np.column_stack(
        [free, free[:, 0] + free[:, 1], free[:, 2] - 2 * free[:, 0]]
    )  # c4 = c0 + c1, c5 = c2 - 2 c0
    names, rounding = tuple(f"c{k}" for k in range(6)), 3 * np.finfo(float).eps
    system = LinearSystem("Y", names, matrix, np.zeros(300), rounding)
    one = held_fixed(replace(system, names=names[:5], matrix=matrix[:, :5]), 1)
    assert {names for names, value in one.items() if value} == {("c0",), ("c1",), ("c4",)}
    two = held_fixed(system, 2)
    for held, value in two.items():
        rest = np.delete(matrix, [int(name[1]) for name in held], axis=1)
        assert (value > 0) == (np.linalg.matrix_rank(rest) == 4)
        if value:
            s = np.linalg.svd(rest / np.linalg.norm(rest, axis=0), compute_uv=False)
            assert value == pytest.approx(s[-1] / s[0], rel=1e-9)
    assert list(two.values()) == sorted(two.values(), reverse=True)
