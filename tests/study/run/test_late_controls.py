"""Studies of controls that are late or follow a command: in a truth, in a log, and inferred."""

import numpy as np
import pytest
import tomli_w
from scipy import stats
from support import small_study
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.logs import log_files
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

SENSORS = [
    small_study.track(position_sd_m=0.1, interval_s=None),
    {"kind": "ins", "channels": ["r"], "sd_degps": 0.05},
]
ACTUATORS = {"lag_rudder_s": 0.9, "delay_rudder_s": 0.6, "bias_rudder_deg": 1.5, "scale_rudder": 0.9}
TRUTH = {"current_mps": [0.0, 0.0], "actuators": ACTUATORS}
STUDY = {"dt_s": None, "sensors": SENSORS, "free": {"coefficients": ["Yuv", "Nuv"]}}
UNKNOWN = {
    "lag_rudder_s": {"median": 0.5, "log_sd": 0.5},
    "delay_rudder_s": {"mean": 0.3, "sd": 0.5},
    "bias_rudder_deg": {"mean": 0.0, "sd": 2.0},
    "scale_rudder": {"mean": 1.0, "sd": 0.2},
}
ORDERS = "time_s,rudder_command_deg\n0,0\n5.2,15\n14.7,-15\n29.3,10\n41.1,-20\n52.9,0\n70,0\n"


@pytest.fixture
def folder(tmp_path, bayesub):
    """Orders, and the log of a boat whose rudder follows them late."""
    (tmp_path / "orders.csv").write_text(ORDERS)
    (tmp_path / "instruments.toml").write_text(tomli_w.dumps({"sensors": SENSORS, "truth": TRUTH}))
    sensors = ("--sensors", tmp_path / "instruments.toml", "--seed", 5, "--subproblem", "horizontal")
    code, *messages = bayesub("simulate", "auv690", tmp_path / "orders.csv", "-o", tmp_path / "log.csv", *sensors)
    assert code == 0, messages
    study = STUDY | {"nuisance": UNKNOWN}
    small_study.write(tmp_path / "simulated.toml", **study, manoeuvre="orders.csv", truth=TRUTH)
    small_study.write(tmp_path / "read.toml", **study, **small_study.LOG, max_control_gap_s=20.0)
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
    ("old", "new", "kind", "key"),
    [
        ("lag_rudder_s = 0.9", "lag_ruder_s = 0.9", "unknown", "lag_ruder_s"),
        ('manoeuvre = "orders.csv"', 'manoeuvre = "zigzag_20_20"', "conflict", "lag_rudder_s"),
    ],
)
def test_refused(folder, old, new, kind, key):
    path = folder / "simulated.toml"
    path.write_text(path.read_text().replace(old, new))
    with refused(kind, key):
        prepare(load_study(path))


def percent(path, controls, nuisance=None):
    """The setup of a study of a log with these controls."""
    changes = STUDY | small_study.LOG | {"prior": {"sd": 0.1}, "nuisance": nuisance or {}}
    path.write_text(small_study.text(**changes) + controls)
    return prepare(load_study(path))


@pytest.mark.slow
def test_a_rudder_in_counts_from_a_guess(tmp_path):
    """Eight logs of a rudder in counts whose zero and scale nobody knows: truths come out, and blind fits do not.

    Sixteen squares of standard normal errors of zero and scale; the probability of a sum outside is 1 in 1000.
    """
    controls = '[controls.rudder]\ncolumn = "rudder_counts"\nunit_deg = 0.05\nzero = 500.0\n'
    zeros = {"bias_rudder_counts": {"mean": 0.0, "sd": 40.0}, "scale_rudder": {"mean": 1.0, "sd": 0.2}}
    speed = {"u0_mps": {"mean": 2.0, "sd": 0.2}}
    boat = bs.load_vehicle("auv690")
    manoeuvre = bs.load_manoeuvre("zigzag_20_20", boat)
    errors, blind = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        bias, scale = rng.normal(0.0, 40.0), rng.normal(1.0, 0.2)
        xi = boat.xi.copy()
        xi[boat.equations.columns(["Yuv", "Nuv"])] *= 1.0 + 0.1 * rng.standard_normal(2)
        track = bs.simulate(boat, manoeuvre, xi=xi, dt=0.1, subproblem="horizontal")
        instruments = [bs.sensors.Track(0.1, 0.1, channels=("x", "y", "yaw")), bs.sensors.Sensor("r_degps", 0.05)]
        record = bs.observe(track, instruments, rng)
        record.save(tmp_path / "log.csv", track)
        # What acts is 0.05 deg (scale (counts - 500) + bias).
        log = log_files.read_log(tmp_path / "log.csv")
        log["rudder_counts"] = (np.degrees(log.pop("delta_r")) / 0.05 - bias) / scale + 500.0
        log_files.write_log(tmp_path / "log.csv", log)
        problem = percent(tmp_path / "study.toml", controls, zeros | speed).problem
        fit = gauss_newton(problem)
        places = [problem.names.index(name) for name in ("bias_rudder_counts", "scale_rudder")]
        errors.append((fit.values[places] - [bias, scale]) / np.sqrt(np.diag(fit.covariance))[places])
        problem = percent(tmp_path / "study.toml", controls, speed).problem
        fit = gauss_newton(problem)
        places = [problem.names.index(name) for name in ("Yuv", "Nuv")]
        truth = xi[boat.equations.columns(["Yuv", "Nuv"])]
        blind.append((fit.values[places] - truth) / np.sqrt(np.diag(fit.covariance))[places])
    low, high = stats.chi2.ppf([0.0005, 0.9995], 16)
    assert low < np.sum(np.square(errors)) < high
    assert np.median(np.abs(blind)) > 5.0


@pytest.mark.parametrize(
    ("controls", "kind", "key"),
    [
        ('[controls.ruder]\ncolumn = "rudder_percent"', "unknown", "controls.ruder"),
        ('[controls.rudder]\ncolumn = "rudder_counts"', "missing", "controls.rudder.unit_deg"),
        ("[controls.rudder]\nzero = 3.0", "missing", "controls.rudder"),
        ("[controls.rudder]\ncommanded = true", None, None),
        ('[controls.rudder]\ncolumn = "rudder_percent"\nzero = 1.5', None, None),
    ],
)
def test_columns_of_a_study(tmp_path, controls, kind, key):
    """A hundred per cent are the limit of the rudder; a column may be of commands whatever its name."""
    column = "rudder_percent" if "percent" in controls else "rudder_deg"
    rows = (f"{t},{20.0 * np.sin(t / 3)},{t},0,{t},{np.cos(t / 3)}" for t in range(30))
    (tmp_path / "log.csv").write_text("\n".join([f"time_s,{column},x_m,y_m,yaw_deg,r_degps", *rows]) + "\n")
    if kind is not None:
        with refused(kind, key):
            percent(tmp_path / "study.toml", controls)
        return
    setup = percent(tmp_path / "study.toml", controls)
    manoeuvre, rudder = setup.trials[""].manoeuvre, setup.vehicle.actuators.members[0]
    assert manoeuvre.commanded == (("delta_r",) if "commanded" in controls else ())
    if "percent" in controls:
        times = np.arange(30)
        expected = (20.0 * np.sin(times / 3) - 1.5) / 100.0 * bs.load_vehicle("auv690").actuators.members[0].limit
        np.testing.assert_allclose(manoeuvre.controls[:, 0], expected, rtol=0, atol=1e-12)
        assert rudder.range[1] == pytest.approx(101.5)


def test_a_new_study_reads_commands(folder, bayesub):
    """A log of commands becomes a study as any other does; its motion is told from what was ordered."""
    path, options = folder / "fresh.toml", ("--vehicle", "auv690", "--data", folder / "log.csv")
    code, *messages = bayesub("new", "study", "fresh", "-o", path, *options)
    assert code == 0, messages
    assert 'subproblem = "horizontal"' in path.read_text()


def test_a_log_is_checked_without_its_boat(folder, bayesub):
    """Commands and counts are known as such; a command of the wrong sign is found by the turn that follows."""
    code, out, err = bayesub("check", folder / "log.csv")
    assert code == 0, err
    assert "rudder_command_deg" in out
    header, *rows = (folder / "log.csv").read_text().splitlines()
    (folder / "counts.csv").write_text("\n".join([header.replace("rudder_command_deg", "rudder_counts"), *rows]) + "\n")
    assert bayesub("check", folder / "counts.csv")[0] == 0
    k = header.split(",").index("rudder_command_deg")
    turned, ordered = [line.split(",") for line in rows], "0"
    for cells in turned:  # at each row, as a computer repeats its commands
        ordered = cells[k] or ordered
        cells[k] = f"{-float(ordered):g}"
    (folder / "turned.csv").write_text("\n".join([header, *(",".join(cells) for cells in turned)]) + "\n")
    _, out, _ = bayesub("check", folder / "turned.csv")
    assert "rudder_command_deg: positive turns the boat to starboard" in out
