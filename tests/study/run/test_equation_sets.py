"""A study of each built-in equation set from file to report; that of `booth` is the study of test_study.py."""

import json
import re

import pytest
from support import small_study
from support.pages import Page

import bayesub as bs
from bayesub.inference.sampling import posterior_file

# Vehicle -> manoeuvre, step (s), sd of positions (m), channels, free coefficients and those that the trial sharpens.
CASES = {
    "mariner": ("zigzag_20_20", 1.0, 1.0, ("x", "y", "yaw"), ("Xuu", "Yv", "Yd", "Nr", "Nd"), ("Yv", "Nr", "Nd")),
    "remus100": ("turning_circle", 0.1, 0.1, ("x", "y", "yaw"), ("Xuu", "Yuv", "Nur", "Nuudr"), ("Xuu", "Nuudr")),
    "npsauv_crossflow": (
        "vertical",
        0.2,
        0.2,
        ("x", "z", "pitch"),
        ("Xuu", "Zuw", "Muw", "Mcrossflow"),
        ("Xuu", "Muw"),
    ),
}


def study(path, vehicle):
    manoeuvre, step, sd, channels, free, _ = CASES[vehicle]
    return small_study.write(
        path,
        question="What does a track say?",
        vehicle=vehicle,
        manoeuvre=manoeuvre,
        dt_s=step,
        sensors=[small_study.track(channels=channels, position_sd_m=sd, attitude_sd_deg=0.2)],
        free={"coefficients": free},
        prior={"centre": "perturbed", "perturbation_sd": 0.1},
        nuisance={"bias_yaw_deg": {"mean": 0.0, "sd": 1.0}} if "yaw" in channels else {},
        baselines={"sqp_starts": 1},
    )


@pytest.mark.slow
@pytest.mark.usefixtures("few_figures")
@pytest.mark.parametrize("vehicle", CASES)
def test_a_study_converges_to_the_truth(bayesub, tmp_path, vehicle):
    """The words of the report are those of the set, and the saved posterior is loaded with its names."""
    *_, free, sharpened = CASES[vehicle]
    path, folder = study(tmp_path / "small.toml", vehicle), tmp_path / "run"
    status, out, _ = bayesub("run", path, "-o", folder)
    assert (status, out.splitlines()[-1]) == (0, "CONVERGED AND FITS")
    numbers = json.loads((folder / "numbers.json").read_text())
    rows = {row["name"]: row for row in numbers["parameters"]}
    for row in rows.values():  # the truth is a plausible draw: within five posterior sd
        assert abs(row["mean"] - row["reference"]) < 5 * row["sd"]
    assert all(rows[name]["contraction"] < 0.5 for name in sharpened)
    assert numbers["criticism"]["fits"]
    equations = bs.load_vehicle(vehicle).equations
    assert all(rows[name]["unit"] == equations.term(name).unit for name in free)
    words = Page((folder / "report.html").read_text()).text
    assert ("non-dimensional" in words) == (vehicle != "remus100")
    answers = words.rpartition("How it was computed")[0]  # the last is the fold, after the link to it
    assert rows.keys() == {name for name in rows if name in answers}
    assert not re.search(r"suboff|auv690|npsauv(?!_crossflow)|101 (terms|coefficients)", answers)
    assert "sd is of the prior's" not in words  # no ratios where there are no null directions
    assert {*free} <= {*posterior_file.load(folder / "posterior.nc").names}
    assert bayesub("report", folder)[0] == 0
