"""Studies of controls that are late or follow a command: in a truth, in a log, and inferred."""

import numpy as np
import pytest

import bayesub as bs
from bayesub.baselines import gauss_newton
from bayesub.study.prepare import prepare
from bayesub.study.study_file import load_study

SENSORS = """
[[sensors]]
kind = "track"
channels = ["x", "y", "yaw"]
position_sd_m = 0.1
attitude_sd_deg = 0.1
[[sensors]]
kind = "ins"
channels = ["r"]
sd_degps = 0.05
"""
TRUTH = """
[truth]
current_mps = [0.0, 0.0]
actuators = { lag_rudder_s = 0.9, delay_rudder_s = 0.6, bias_rudder_deg = 1.5, scale_rudder = 0.9 }
"""
ACTUATORS = {"lag_rudder_s": 0.9, "delay_rudder_s": 0.6, "bias_rudder_deg": 1.5, "scale_rudder": 0.9}
STUDY = """
name = "ordered"
vehicle = "auv690"
seed = 3
{source}
{sensors}
[free]
coefficients = ["Yuv", "Nuv"]
[prior]
kind = "relative_normal"
sd = 0.25
[nuisance]
lag_rudder_s = {{ median = 0.5, log_sd = 0.5 }}
delay_rudder_s = {{ mean = 0.3, sd = 0.5 }}
bias_rudder_deg = {{ mean = 0.0, sd = 2.0 }}
scale_rudder = {{ mean = 1.0, sd = 0.2 }}
"""
ORDERS = "time_s,rudder_command_deg\n0,0\n5.2,15\n14.7,-15\n29.3,10\n41.1,-20\n52.9,0\n70,0\n"


@pytest.fixture
def folder(tmp_path, bayesub):
    """Orders, and the log of a boat whose rudder follows them late."""
    (tmp_path / "orders.csv").write_text(ORDERS)
    (tmp_path / "instruments.toml").write_text(SENSORS + TRUTH)
    sensors = ("--sensors", tmp_path / "instruments.toml", "--seed", 5, "--subproblem", "horizontal")
    code, *messages = bayesub("simulate", "auv690", tmp_path / "orders.csv", "-o", tmp_path / "log.csv", *sensors)
    assert code == 0, messages
    simulated = STUDY.format(source='manoeuvre = "orders.csv"', sensors=SENSORS + TRUTH)
    (tmp_path / "simulated.toml").write_text(simulated)
    read = 'data = "log.csv"\nsubproblem = "horizontal"\nmax_control_gap_s = 20.0'
    (tmp_path / "read.toml").write_text(STUDY.format(source=read, sensors=SENSORS))
    return tmp_path


@pytest.mark.parametrize("study", ["simulated", "read"])
def test_what_is_wrong_with_a_rudder_comes_out(folder, study):
    """From orders to the posterior: within four standard deviations of it, which are a small part of the prior's."""
    setup = prepare(load_study(folder / f"{study}.toml"))
    problem = setup.problem
    fit = gauss_newton(problem)
    sds = np.sqrt(np.diag(fit.covariance))
    for name, truth in ACTUATORS.items():
        k = problem.names.index(name)
        assert abs(fit.values[k] - truth) < 4.0 * sds[k], name
        assert sds[k] < 0.5 * problem.prior.sd[k]
    if study == "simulated":
        assert ACTUATORS.items() <= problem.record.nuisances.items()


def test_the_log_has_what_was_ordered(folder, bayesub):
    header = (folder / "log.csv").read_text().splitlines()[0]
    assert "rudder_command_deg" in header.split(",")
    assert "rudder_deg" not in header.split(",")
    code, out, _ = bayesub("check", folder / "read.toml")
    assert code == 0
    assert "other parameters" in out


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("lag_rudder_s = 0.9", "lag_ruder_s = 0.9", "there is no 'lag_ruder_s': did you mean 'lag_rudder_s'"),
        ('manoeuvre = "orders.csv"', 'manoeuvre = "zigzag_20_20"', "a lag is between a command and the actuator"),
    ],
)
def test_refused(folder, old, new, message):
    path = folder / "simulated.toml"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(bs.InputError, match=message):
        prepare(load_study(path))
