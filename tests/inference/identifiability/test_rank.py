"""Which singular values are round-off, which are merely small, and the command that says so."""

import json
import sys

import numpy as np
import pytest
from support.motions import smooth_manoeuvre

import bayesub as bs
from bayesub.cli import app
from bayesub.findings.run_numbers import null_count
from bayesub.inference.identifiability import rank
from bayesub.inference.identifiability.rank import round_off
from bayesub.kernels import workspace
from bayesub.model.coefficients import ADDED_MASSES, columns, names_of_axis
from bayesub.model.linear_form import LinearSystem, linear_systems

EPS = np.finfo(float).eps
# As in the thesis, or for a reason that studies/uniqueness.py shows.
RANKS = {
    ("suboff", "horizontal"): {"X": (6, 6), "Y": (8, 9), "N": (8, 10)},
    ("suboff", "vertical"): {"X": (6, 6), "Z": (10, 11), "M": (12, 12)},
    ("auv690", "coupled"): {"X": (11, 11), "Y": (17, 18), "Z": (17, 17), "K": (16, 16), "M": (18, 18), "N": (16, 18)},
    ("npsauv", "coupled"): {"X": (11, 11), "Y": (17, 18), "Z": (17, 17), "K": (16, 16), "M": (18, 18), "N": (17, 18)},
}


def system_of(matrix, rounding=3 * EPS):
    names = tuple(f"c{k}" for k in range(matrix.shape[1]))
    return LinearSystem("Y", names, matrix, np.zeros(len(matrix)), rounding)


def with_singular_values(values, rng, n=4000):
    """A matrix of unit columns one of whose singular values is small, and the direction (p,) of it."""
    p = len(values)
    matrix = np.linalg.qr(rng.standard_normal((n, p)))[0] * values @ np.linalg.qr(rng.standard_normal((p, p)))[0]
    matrix /= np.linalg.norm(matrix, axis=0)
    return matrix, np.linalg.svd(matrix, full_matrices=False)[2][-1]


@pytest.mark.parametrize(("vehicle", "manoeuvre"), RANKS)
def test_ranks(vehicle, manoeuvre):
    """Ranks and columns, with nothing within a factor of a thousand of the threshold on either side."""
    boat = bs.load_vehicle(vehicle)
    ranks = rank(linear_systems(bs.simulate(boat, bs.load_manoeuvre(manoeuvre, boat))))
    assert {axis: (r.rank, r.columns) for axis, r in ranks.items()} == RANKS[vehicle, manoeuvre]
    for r in ranks.values():
        assert r.practical_rank == r.rank
        assert r.null_dimension == r.columns - r.rank == len(r.null_vectors)
        assert r.gap is None or r.gap > 1e8


def test_null_vectors_are_what_is_short_of_the_rigid_body(suboff):
    """Sway: coefficients minus those whose forces are the rigid body's own, m (vdot + u r); yaw: minus Izz rdot."""
    track = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff))
    ranks = rank(linear_systems(track))
    body = dict(zip(workspace.BODY, suboff.body, strict=True))
    own = {"Y": {"Yvdot": body["mass"], "Yur": body["mass"]}, "N": {"Nrdot": body["Izz"]}}
    for axis, forces in own.items():
        (vector,) = ranks[axis].null_vectors
        names = ranks[axis].names
        where = columns(names)
        expected = suboff.xi[where] - [
            forces.get(name, 0.0) / suboff.dimensional_factors[columns([name])[0]] for name in names
        ]
        found = np.array([vector.get(name, 0.0) for name in names])
        expected *= found[np.abs(found).argmax()] / expected[np.abs(found).argmax()]
        # Round-off of 1e-15 over a gap of some 1e-4, seen in the smallest columns.
        np.testing.assert_allclose(found, expected, atol=1e-8)


def test_a_weak_direction_is_not_null(rng):
    """A direction at 1e-9 is unique and ill-conditioned, two verdicts; at round-off it is not unique."""
    values = np.array([1.0, 0.5, 0.3, 0.2, 1e-9])
    matrix, direction = with_singular_values(values, rng)
    found = rank({"Y": system_of(matrix)})["Y"]
    assert (found.rank, found.practical_rank, found.null_vectors, found.gap) == (5, 4, (), None)
    (weak,) = found.weak_vectors
    vector = np.array([weak.get(name, 0.0) for name in found.names])
    assert abs(vector @ direction) / np.linalg.norm(vector) == pytest.approx(1.0, abs=1e-12)
    sharp = rank({"Y": system_of(matrix)}, accuracy=1e-10)["Y"]
    assert (sharp.rank, sharp.practical_rank, sharp.weak_vectors) == (5, 5, ())
    values[-1] = 1e-17
    found = rank({"Y": system_of(with_singular_values(values, rng)[0])})["Y"]
    assert (found.rank, found.practical_rank, len(found.null_vectors), found.weak_vectors) == (4, 4, 1, ())


@pytest.mark.parametrize("rounding", [1e-15, 1e-12, 1e-8])
def test_threshold_bounds_what_errors_do(rounding, rng):
    """Columns in error by so much give null singular values below the threshold, and not far below it."""
    matrix, _ = with_singular_values(np.array([1.0, 0.7, 0.5, 0.4, 0.0]), rng)
    s0 = np.linalg.norm(matrix, 2)
    threshold = round_off(matrix.shape, s0, rounding)
    errors = rng.standard_normal((20, *matrix.shape)) * rounding / np.sqrt(len(matrix))
    smallest = [np.linalg.svd(matrix + error, compute_uv=False)[-1] for error in errors]
    assert max(smallest) < threshold
    assert threshold < 100 * max(smallest)


def test_accelerations_that_are_less_accurate_raise_the_threshold(suboff, spiral, rng):
    """With accelerations in error by 1e-9 the null directions stand at 1e-9, and are still told from the others."""
    blurred = bs.simulate(suboff, spiral, dt=0.5)
    exact = rank(linear_systems(blurred))
    rms = np.sqrt(np.mean(blurred.accelerations**2, axis=1, keepdims=True))
    blurred.accelerations[...] += 1e-9 * rms * rng.standard_normal(blurred.accelerations.shape)
    systems = linear_systems(blurred)
    rounding = dict(zip(systems["Y"].names, systems["Y"].rounding, strict=True))
    assert rounding["Yvdot"] == pytest.approx(1e-9, rel=0.1)  # 6,000 samples give it to a per cent
    assert rounding["Yuv"] == 3 * EPS
    for axis, r in rank(systems).items():
        assert r.rank == exact[axis].rank
        assert np.all(r.singular_values[r.rank :] > 100 * exact[axis].threshold)


@pytest.mark.parametrize("name", ["auv690", "npsauv"])
def test_a_column_of_round_off_vanishes(name):
    """On a straight course at constant speed an acceleration is round-off or nothing: the terms of u^2 are left."""
    boat = bs.load_vehicle(name)
    straight = smooth_manoeuvre(boat, 48.0, rudder=0.0, stern=0.0)
    systems = linear_systems(bs.simulate(boat, straight, dt=0.5, subproblem="horizontal"))
    assert {axis: s.names for axis, s in systems.items()} == {"X": ("Xuu",), "Y": ("Yuu",), "N": ("Nuu",)}


def run_cli(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["bayesub", *arguments])
    with pytest.raises(SystemExit) as exit_:
        app.main()
    return exit_.value.code or 0


def test_command(monkeypatch, capsys):
    """JSON and nothing else, every column of the sub-problem counted, null vectors by the size of their entries."""
    assert run_cli(monkeypatch, "rank", "suboff", "horizontal", "--json") == 0
    axes = json.loads(capsys.readouterr().out)
    assert {axis: (r["rank"], r["columns"]) for axis, r in axes.items()} == RANKS["suboff", "horizontal"]
    for axis, r in axes.items():
        assert len(r["singular_values"]) == r["columns"]
        assert len(r["null_vectors"]) == r["null_dimension"] == r["columns"] - r["rank"]
        for vector in r["null_vectors"]:
            sizes = np.abs(list(vector.values()))
            assert np.all(np.diff(sizes) <= 0)
            assert sizes[0] == 1.0
            assert set(vector) <= set(names_of_axis(axis))
            assert set(vector) & set(ADDED_MASSES)
    assert run_cli(monkeypatch, "rank", "suboff", "horizontal", "--subproblem", "none") == 0
    text = capsys.readouterr().out
    assert "six degrees of freedom" in text
    assert "Y not unique: 50 % of " in text
    assert "hold Yvdot, Zwdot, Nrdot, and the rest is unique." in " ".join(text.split())


def test_command_with_bad_names(monkeypatch, capsys):
    """One line that names what was wrong, and exit status 2."""
    for arguments in (("subof", "horizontal"), ("suboff", "spirral"), ("suboff", "horizontal", "--subproblem", "x")):
        assert run_cli(monkeypatch, "rank", *arguments) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert len(captured.err.splitlines()) == 1


def test_choices_do_not_hang_on_rounding(rng):
    """Of two columns as long the first is the pivot, and signs follow the largest entry, whatever errors of 1e-14."""
    matrix = rng.standard_normal((200, 4))
    matrix[:, 2:] = matrix[:, :2]  # a and c, b and d enter as sums; a nearly equal pair is weak
    matrix = np.column_stack([matrix, matrix[:, 0] * (1.0 + 1e-8 * rng.standard_normal(200))])
    names = ("a", "b", "c", "d", "e")
    verdicts = []
    for _ in range(8):
        noisy = matrix * (1.0 + 1e-14 * rng.standard_normal(matrix.shape))
        r = rank({"Y": LinearSystem("Y", names, noisy, noisy[:, 0], 1e-13)})["Y"]
        vectors = [[(name, round(x, 3)) for name, x in v.items() if abs(x) > 0.01] for v in r.null_vectors]
        weak = [[(name, np.sign(x)) for name, x in v.items() if abs(x) > 0.1] for v in r.weak_vectors]
        verdicts.append((r.pivots, r.rank, vectors, weak))
    assert verdicts[0][1] == 3
    assert verdicts[0][0] == ("a", "b")
    assert all(verdict == verdicts[0] for verdict in verdicts)
    assert all(next(iter(vector.values())) > 0.0 for vector in r.weak_vectors)


def test_a_rank_does_not_hang_on_one_motion(rng):
    """c0 + c1 - c2 is null at all draws; c3 is like c0 at one by accident, and otherwise but for 6e-9."""
    first = rng.standard_normal((4000, 2))
    columns = np.column_stack([first, first.sum(axis=1), first[:, 0], rng.standard_normal(4000)])
    apart = columns.copy()
    apart[:, 3] += 2e-8 * rng.standard_normal(4000)
    one, other = ({"Y": system_of(matrix)} for matrix in (columns, apart))
    alone, both, reverse = rank(one)["Y"], rank(one, others=[one, other])["Y"], rank(other, others=[one])["Y"]
    assert (alone.null_dimension, both.null_dimension, reverse.null_dimension) == (2, 1, 1)
    assert both.rank - both.practical_rank == reverse.rank - reverse.practical_rank == 1
    assert both.singular_values[3] == pytest.approx(reverse.singular_values[3], rel=1e-3)
    for found in (both, reverse):
        (null,) = found.null_vectors
        assert {name: round(x / null["c0"], 6) for name, x in null.items() if abs(x) > 1e-6} == {
            "c0": 1,
            "c1": 1,
            "c2": -1,
        }
        (weak,) = found.weak_vectors
        assert next(iter(weak)) == "c3"
        words = null_count({"Y": found.summary()})
        assert words.startswith("one combination leaves the motion exactly the same, and 1 changes it by less than any")
    assert null_count({"Y": alone.summary()}) == "2 combinations leave the motion exactly the same"
