"""Posteriors side by side: distances that are known, and coefficients that only share a name."""

import json

import numpy as np
import pytest

import bayesub as bs
from bayesub.findings.comparison import ComparedRun, Comparison
from bayesub.inference.sampling.posterior import Posterior

NAMES = ("Xuu", "Nuv", "Nuu_dr")


def posterior(names, mean, sd, seed=0):
    """Independent normal draws."""
    mean, sd = np.asarray(mean, dtype=float), np.asarray(sd, dtype=float)
    chain = np.random.default_rng(seed).normal(mean, sd, (4, 100, 10, len(names)))
    prior = np.ones(len(names))
    return Posterior(names, chain, np.zeros(chain.shape[:3]), mean, 2.0 * prior, 10, 0.5, 100, 1.0, {"diverged": 0})


def compared(label, vehicle, *given, settings=None):
    return ComparedRun(label, vehicle, posterior(*given), {"study": label}, settings or {})


def test_a_shift_is_found_in_the_parameter_that_has_it(suboff):
    first = compared("first", suboff, NAMES, [0.0, 0.0, 0.0], [1.0, 1.0, 1.0])
    second = compared("second", suboff, NAMES, [0.0, 2.0, 0.0], [1.0, 1.0, 0.5], 1)
    numbers = Comparison((first, second), "zigzag").numbers
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    (pair,) = numbers["pairs"]
    assert (pair["furthest"], pair["n_shared"]) == ("Nuv", 3)
    assert pair["wasserstein"]["Nuv"] == pytest.approx(2.0, abs=0.1)
    assert pair["wasserstein"]["Xuu"] < 0.1
    # The product of a shift by two sds and of a half of one sd.
    overlap = np.exp(-(2.0**2) / 8.0) * np.sqrt(2 * 0.5 / (1 + 0.25))
    assert pair["hellinger"] == pytest.approx(np.sqrt(1.0 - overlap), abs=0.03)
    assert pair["by_chance"] < 0.1 < pair["hellinger"]
    assert numbers["parameters"]["Nuu_dr"]["second"]["contraction"] == pytest.approx(0.25, abs=0.02)
    assert "most of all Nuv, moved by 2 pooled sds" in numbers["sentences"]["distance"]


def test_the_one_with_the_smallest_sd_knows_best(suboff):
    sharp = compared("sharp", suboff, NAMES, [0.0] * 3, [0.1, 0.1, 1.0])
    blunt = compared("blunt", suboff, NAMES[1:], [0.0] * 2, [1.0, 0.5])
    numbers = Comparison((sharp, blunt), "zigzag").numbers
    assert numbers["sentences"]["shared"].startswith("The 2 runs have 2 coefficients")
    assert numbers["sentences"]["known"].endswith("1 by sharp, 1 by blunt.")
    assert list(numbers["parameters"]["Xuu"]) == ["sharp"]


def test_chance_is_that_of_the_parameters_that_are_shared(suboff):
    """Halves of a run with eighty parameters are far apart, which says nothing of the one that two runs share."""
    names = tuple(suboff.equations.names[:80])
    wide = ComparedRun("wide", suboff, posterior(names, [0.0] * 80, [1.0] * 80), {}, {})
    narrow = compared("narrow", suboff, names[:1], [1.0], [1.0], 1)
    (pair,) = Comparison((wide, narrow), "zigzag").numbers["pairs"]
    assert pair["by_chance"] < 0.1 < 0.3 < pair["hellinger"]


def test_the_same_posterior_twice_is_no_difference(suboff):
    """Other draws of it: the distance is that of two halves of a run, and no run knows anything best."""
    runs = [compared(f"run {seed}", suboff, NAMES, [0.0] * 3, [1.0] * 3, seed) for seed in (2, 3)]
    said = Comparison(tuple(runs), "zigzag").numbers["sentences"]
    assert said["distance"].startswith("There is no difference beyond the noise of the draws")
    assert said["known"].endswith("0 by run 2, 0 by run 3; 3 equally well.")


def test_a_name_that_means_another_term_is_another_coefficient(suboff):
    """Yv_absr of booth and of remus, which are not scaled alike; mass_kg is that of the boat, whichever it is."""
    remus = bs.load_vehicle("remus100")
    both = sorted(set(suboff.equations.names) & set(remus.equations.names))
    assert both
    name = both[0]
    first = compared("first", suboff, (name, "mass_kg", "current_north_mps"), [0.0] * 3, [1.0] * 3)
    second = compared("second", remus, (name, "mass_kg", "current_north_mps"), [0.0] * 3, [1.0] * 3)
    comparison = Comparison((first, second), "zigzag")
    assert list(comparison.parameters) == [name, "mass_kg", f"{name} (remus)"]
    assert comparison.shared("first", "second") == ["mass_kg"]
    assert [row["parameter"] for row in comparison.distance_rows()] == ["mass_kg"]


def test_runs_without_anything_in_common_are_no_distance_apart(suboff, auv):
    runs = compared("first", suboff, NAMES[:1], [0.0], [1.0]), compared("second", auv, NAMES[1:], [0.0] * 2, [1.0] * 2)
    numbers = Comparison(runs, "zigzag").numbers
    assert (numbers["pairs"][0]["n_shared"], numbers["pairs"][0]["hellinger"]) == (0, None)
    assert "distance" not in numbers["sentences"]


def test_settings_that_differ_are_listed_in_words(suboff):
    settings = [{"seed": 1, "sensors": [{"kind": "dvl", "sd_mps": sd}], "dt_s": 1.0} for sd in (0.1, 0.2)]
    del settings[1]["dt_s"]
    runs = [compared(str(k), suboff, NAMES, [0.0] * 3, [1.0] * 3, settings=some) for k, some in enumerate(settings)]
    assert Comparison(tuple(runs), "zigzag").differences == {
        "dt_s": {"0": "1.0", "1": ""},
        "sensors": {"0": "kind dvl, sd_mps 0.1", "1": "kind dvl, sd_mps 0.2"},
    }
