"""Sensors in study files."""

import numpy as np
import pytest
from support.refusals import refused

from bayesub import sensors
from bayesub.inference.baselines import posterior_mode
from bayesub.io import toml_files
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import Study

STUDY = {
    "name": "small",
    "vehicle": "auv690",
    "manoeuvre": "horizontal",
    "seed": 3,
    "free": {"coefficients": ["Xuu", "Yuv"]},
    "prior": {"kind": "relative_normal", "sd": 0.25},
}


def read(*sections):
    """The study with these sensors, as if from a file."""
    return toml_files.validate(STUDY | {"sensors": list(sections)}, Study, "small.toml")


EACH = [
    (
        {"kind": "track", "position_sd_m": 0.5, "attitude_sd_deg": 0.1, "channels": ["x", "yaw"]},
        sensors.Track(0.5, 0.1, channels=("x", "yaw")),
    ),
    (
        {"kind": "sensor", "column": "u_mps", "resolution": 0.01, "times": [1.0, 2.5], "bias": 0.1},
        sensors.Sensor("u_mps", resolution=0.01, times=(1.0, 2.5), bias=0.1),
    ),
    ({"kind": "pressure", "sd_m": 0.1}, sensors.Pressure(0.1)),
    ({"kind": "compass", "resolution_deg": 1.0, "interval_s": 5.0}, sensors.Compass(resolution_deg=1.0, interval_s=5)),
    ({"kind": "ins", "sd_deg": 0.1, "sd_degps": 0.01}, sensors.INS(0.1, 0.01)),
    ({"kind": "dvl", "sd_mps": 0.01}, sensors.DVL(0.01)),
    ({"kind": "adcp", "sd_mps": 0.01, "channels": ["v"]}, sensors.ADCP(0.01, channels=("v",))),
    ({"kind": "autosub", "interval_s": 2.0}, sensors.autosub(interval_s=2.0)),
    ({"kind": "thesis_rounding", "channels": ["u", "r"]}, sensors.thesis_rounding(channels=("u", "r"))),
    ({"kind": "tracking_range"}, sensors.tracking_range()),
]


@pytest.mark.parametrize(("section", "expected"), EACH, ids=[section["kind"] for section, _ in EACH])
def test_each_kind_is_what_it_is_in_python(section, expected):
    """Keys of a section are arguments, defaults are the same, and a completed study says the same again."""
    loaded = read(section)
    assert loaded.sensors[0].build() == sensors.flat(expected)
    completed = loaded.model_dump(exclude_none=True, mode="json")
    assert toml_files.validate(completed, Study, "config.toml") == loaded
    faults = {"dropout": 0.1, "gaps": [[10.0, 20.0]], "outlier_scale": 4.0}
    faults |= {"lever_arm_m": [1.0, 0.0, -0.5], "clock_offset_s": 0.3}
    placed = {"lever_arm_m": (1.0, 0.0, -0.5), "clock_offset_s": 0.3}
    faulty = sensors.modified(expected, dropout=0.1, gaps=((10.0, 20.0),), outlier_scale=4.0, **placed)
    assert read(section | faults).sensors[0].build() == faulty


def test_a_completed_track_has_the_keys_that_it_always_had():
    """Runs of earlier studies resume: nothing was added to a section that does not use it."""
    (section,) = read({"kind": "track", "position_sd_m": 0.5, "attitude_sd_deg": 0.1}).model_dump(
        exclude_none=True, mode="json"
    )["sensors"]
    assert section == {
        "kind": "track",
        "channels": ["x", "y", "z", "roll", "pitch", "yaw"],
        "position_sd_m": 0.5,
        "attitude_sd_deg": 0.1,
        "interval_s": 1.0,
    }


@pytest.mark.parametrize(
    ("section", "kind", "key"),
    [
        (
            {"kind": "trak"},
            "unknown",
            "sensors.0.kind",
        ),
        ({}, "missing", "sensors.0.kind"),
        ({"kind": "dvl", "sd_mps": 0.1, "resolution_mpss": 1}, "unknown", "sensors.0.resolution_mpss"),
        ({"kind": "dvl"}, "value", "sensors.0"),
        ({"kind": "sensor", "column": "u_kts", "sd": 1.0}, "unknown", "sensors.0"),
        ({"kind": "adcp", "sd_mps": 0.1, "dropout": 1.0}, "value", "sensors.0"),
        ({"kind": "adcp", "sd_mps": -0.1}, "value", "sensors.0"),
        ({"kind": "autosub", "channels": ["yow"]}, "unknown", "sensors.0"),
        ({"kind": "compass", "sd_deg": 1.0, "gaps": [[2.0]]}, "missing", "sensors.0.gaps.0.1"),
    ],
)
def test_bad_sections(section, kind, key):
    """Refused in one line that names file, section and remedy."""
    with refused(kind, key) as error:
        read(section)
    assert str(error.value).startswith("small.toml: ")


def test_a_study_of_states_by_any_sensor_is_a_problem():
    """At the truth the residuals are the noise, whichever name a state has in the record."""
    setup = prepare(
        read(
            {"kind": "dvl", "sd_mps": 0.01, "interval_s": 2.0},
            {"kind": "compass", "sd_deg": 0.5},
            {"kind": "pressure", "sd_m": 0.1, "interval_s": 5.0},
            {"kind": "ins", "sd_degps": 0.01, "channels": ["r"]},
        )
    )
    problem = setup.problem
    residuals = problem.residuals(setup.vehicle.xi[problem.columns])
    n = problem.record.n_readings
    assert residuals.shape == (1, n)
    assert abs(np.mean(residuals**2) - 1) < 4 * np.sqrt(2 / n)


def test_channels_without_noise():
    """Readings that are rounded and have no noise admit what makes every one of them, and a search finds it."""
    problem = prepare(read({"kind": "sensor", "column": "u_mps", "resolution": 0.01, "interval_s": 5.0})).problem
    truth = problem.reference
    other = truth * np.where([name == "Xuu" for name in problem.names], 1.2, 1.0)
    np.testing.assert_array_equal(problem.log_likelihood(np.array([truth, other])), [0.0, -np.inf])
    found = posterior_mode(problem, rng=np.random.default_rng(0))
    assert problem.log_likelihood(found.values)[0] == 0.0


def test_no_parameters_make_every_reading():
    """A log that no coefficients explain to its rounding is refused by channel."""
    problem = prepare(read({"kind": "sensor", "column": "u_mps", "resolution": 0.01, "interval_s": 5.0})).problem
    problem.readings[3] += 0.5
    with refused("data", "u"):
        posterior_mode(problem, rng=np.random.default_rng(0))
