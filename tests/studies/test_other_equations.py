"""Mechanisms of null directions in several equation sets, and boats in equations that are not their own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import bayesub as bs
from bayesub.model.simulator import Simulator
from other_equations import swapped
from thesis import uniqueness

# Vehicle, and axis -> rank, columns, and the axes whose equations of motion are its null directions, on the spiral.
KNOWN = {
    "suboff": {"X": (6, 6, []), "Y": (8, 9, ["Y"]), "N": (8, 10, ["Y", "N"])},
    "remus100": {"X": (4, 4, []), "Y": (5, 7, ["Y", "N"]), "N": (5, 7, ["Y", "N"])},
    "mariner": {"X": (10, 11, ["X"]), "Y": (15, 17, ["Y", "N"]), "N": (15, 17, ["Y", "N"])},
}


@pytest.mark.parametrize("vehicle", KNOWN)
def test_null_directions_are_equations_of_motion(vehicle):
    """A null dimension for each equation that can be written in the terms of the axis, and none of other terms."""
    axes = uniqueness.uniqueness(uniqueness.flight(vehicle, "horizontal"))
    for axis, (rank, columns, equations) in KNOWN[vehicle].items():
        one = axes[axis]
        assert (one["rank"], one["columns"], one["equations"]) == (rank, columns, equations)
        assert (one["motion"], one["terms"]) == (len(equations), 0)


def test_terms_that_look_alike_are_told_from_motion():
    """With a column twice there is a null direction without an added mass."""
    track = uniqueness.flight("suboff", "horizontal")
    system = bs.linear_systems(track)["X"]
    doubled = replace(
        system,
        names=(*system.names, "Xuu"),
        matrix=np.column_stack([system.matrix, system.matrix[:, 0]]),
        rounding=np.append(system.rounding, system.rounding[0]),
    )
    kept = [not name.endswith("dot") for name in doubled.names]
    assert uniqueness.null_dimension(system, kept[:-1]) == 0
    assert uniqueness.null_dimension(doubled, kept) == 1


def test_a_spectrum_counts_null_directions_apart():
    """Of suboff's 21 coefficients on the spiral three directions are null, as in the quickstart."""
    track = uniqueness.flight("suboff", "horizontal")
    s = uniqueness.spectra(track)["track"]
    assert (s["n_params"], s["n_null"], len(s["singular_values"])) == (21, 3, 18)
    assert s["n_known"] <= s["n_sharpened"] < s["n_params"]


def test_counterparts_are_the_same_functions_of_motions_in_the_plane():
    """u|u| is u^2 ahead, and v nu is v|v| without heave; r|r| has no counterpart in sway."""
    boat = bs.load_vehicle("auv690")
    pairs = swapped.counterparts(boat, bs.load_equations("remus"), "horizontal")
    assert (pairs["Xuu"], pairs["Yvv"], pairs["Nuudr"]) == ("Xuu", "Yv_absnu", "Nuu_dr")
    assert "Yrr" not in pairs


def test_a_boat_whose_terms_all_have_counterparts_flies_the_same_track():
    """remus100 in the terms of booth, but for the one that booth lacks, set to zero in both."""
    boat = bs.load_vehicle("remus100")
    xi = boat.xi.copy()
    xi[boat.equations.index["Yrr"]] = 0.0
    boat = replace(boat, xi=xi)
    crossed = swapped.crossed(boat, "booth", "horizontal")
    manoeuvre = bs.load_manoeuvre("zigzag_20_20", boat)
    times = np.arange(0.0, manoeuvre.duration, 1.0)
    own = Simulator(boat, manoeuvre, times, dt=0.05)
    orders = swapped.same_orders(manoeuvre, crossed.equations)
    (track,), _ = own.run(boat.xi)
    (other,), _ = Simulator(crossed, orders, times, dt=0.05).run(crossed.xi)
    np.testing.assert_allclose(other, track, atol=1e-9)


def test_predictions_of_the_truth_are_exact_and_pass_the_check():
    """A posterior that is the truth errs by nothing, in other equations as in its own, and fits its record."""
    boat = bs.load_vehicle("remus100")
    problem = uniqueness.trial(uniqueness.flight("remus100", "horizontal"), np.random.default_rng(1))
    draws = np.tile(problem.reference, (10, 1))
    truth = SimpleNamespace(draws=draws, mean=problem.reference)
    unseen = swapped.unseen(boat, ("turning_circle", "random:1"), "horizontal")
    assert [manoeuvre.subproblem for manoeuvre in unseen.manoeuvres] == ["horizontal"] * 2
    result = swapped.predictions(unseen, [(problem, truth)], np.random.default_rng(2))
    assert result["largest_lengths"] < 1e-9 < result["guess_median_lengths"]
    assert swapped.model_check(problem, truth, np.random.default_rng(2))["fits"]


def test_unmatched_terms_are_free_about_zero():
    """Booth's terms for remus100 get priors about zero where remus has none, about a guess where it has."""
    boat, track = bs.load_vehicle("remus100"), uniqueness.flight("remus100", "horizontal")
    crossed = swapped.crossed(boat, "booth", "horizontal")
    problem = swapped.crossed_trial(track, crossed, np.random.default_rng(1))
    centres = dict(zip(problem.names, problem.prior.mean, strict=True))
    pairs = swapped.counterparts(boat, crossed.equations, "horizontal")
    assert {name for name, centre in centres.items() if centre == 0.0} == set(problem.names) - set(pairs)
    assert (problem.prior.sd > 0.0).all()
