"""A noise model and a sensor of a user's own are one class or function, which a study file names."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from support.refusals import refused

from bayesub import sensors
from bayesub.io import toml_files
from bayesub.io.toml_files import Positive
from bayesub.problem.likelihoods import Noise, Normal
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

STUDY = """
name = "own"
vehicle = "auv690"
manoeuvre = "horizontal"
seed = 3
[free]
coefficients = ["Xuu", "Yuv"]
[prior]
kind = "relative_normal"
sd = 0.25
"""
SENSOR = '[[sensors]]\nkind = "paddle_wheel"\nsd_mps = 0.02\ndropout = 0.1\n'


@pytest.fixture
def paddle_wheel(monkeypatch):
    """A sensor that is registered, for one test."""
    monkeypatch.setitem(sensors.KINDS, "paddle_wheel", None)

    @sensors.register
    def paddle_wheel(sd_mps: Positive, interval_s: Positive = 2.0) -> Iterator[sensors.Sensor]:
        yield sensors.Sensor("u_mps", sd=sd_mps, interval_s=interval_s)

    return paddle_wheel


@pytest.fixture
def laplace(monkeypatch):
    """A noise model that is registered, for one test."""
    monkeypatch.setattr(Noise, "KINDS", dict(Noise.KINDS))

    @dataclass(frozen=True)
    class Laplace(Normal, kind="laplace"):
        SAMPLED = ("sd", "tail")
        words = "Laplace"
        sd: float
        tail: Positive = 1.5

        def log_density(self, predicted, readings, times=None):  # noqa: ARG002
            scale = np.reshape(self.sd * np.asarray(self.tail), (-1, 1))
            return -np.sum(np.abs(predicted - readings) / scale + np.log(2.0 * scale), axis=1)

    return Laplace


@pytest.fixture
def read(tmp_path):
    """read(text): the study of a file with this text."""

    def load(text):
        path = tmp_path / "own.toml"
        path.write_text(STUDY + text)
        return load_study(path)

    return load


def test_a_sensor_of_ones_own_is_named_by_a_study(read, paddle_wheel):
    """Its arguments are keys, the settings of all sensors work, and a completed study says the same again."""
    study = read(SENSOR)
    assert study.sensors[0].build() == sensors.modified(paddle_wheel(0.02), dropout=0.1)
    completed = study.model_dump(exclude_none=True, mode="json")
    assert completed["sensors"] == [{"kind": "paddle_wheel", "sd_mps": 0.02, "interval_s": 2.0, "dropout": 0.1}]
    assert toml_files.validate(completed, type(study), "config.toml").sensors == study.sensors
    assert prepare(study).problem.record.channels[0].name == "u"


@pytest.mark.usefixtures("paddle_wheel")
@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        (SENSOR.replace("sd_mps", "sd_mpss"), "unknown", "sensors.0.sd_mpss"),
        (SENSOR.replace("0.02", "-0.02"), "value", "sensors.0.sd_mps"),
        (SENSOR.replace("wheel", "whel"), "unknown", "sensors.0.kind"),
    ],
    ids=["key", "value", "kind"],
)
def test_its_keys_are_checked(read, text, kind, key):
    with refused(kind, key) as error:
        read(text)
    assert "paddle_wheel" in str(error.value) or "sd_mps" in str(error.value)


def test_without_registration_there_is_no_such_kind(read):
    with refused("unknown", "sensors.0.kind"):
        read(SENSOR)


@pytest.mark.usefixtures("paddle_wheel")
def test_a_noise_model_of_ones_own_is_named_by_a_study(read, laplace):
    """Its attributes but sd are keys with defaults, and nuisance parameters of the channel if they may be inferred."""
    text = SENSOR + '[noise.u_mps]\nkind = "laplace"\nsd = 0.05\n'
    problem = prepare(read(text + "[nuisance]\ntail_u = { median = 1.5, log_sd = 0.2 }\n")).problem
    assert problem.noises == (laplace(0.05, 1.5),)
    assert problem.names[-1] == "tail_u"
    (density,) = problem.log_likelihood(problem.reference[None])
    (errors,) = problem.predicted(problem.reference) - problem.readings
    assert density == pytest.approx(-np.sum(np.abs(errors) / 0.075 + np.log(0.15)))
    assert prepare(read(text + "tail = 2.0\n")).problem.noises == (laplace(0.05, 2.0),)
    with refused("unknown", "noise.u_mps.tails"):
        read(text + "tails = 2.0\n")
