"""Forces that the equations leave out, at the command line."""

import numpy as np
import pytest
from support import refusals

import bayesub as bs
from bayesub.logs import log_files

FILE = """[disturbance]
axes = ["X", "Y", "N"]
share = 0.02
correlation_time_s = 4.0
"""
INSTRUMENTS = '[[sensors]]\nkind = "track"\nchannels = ["x", "y"]\nposition_sd_m = 0.1\nattitude_sd_deg = 0.1\n'


@pytest.fixture
def fly(bayesub, tmp_path, monkeypatch):
    """fly(*options): status and message of a spiral of auv690, and the log that it wrote, if it has."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "forces.toml").write_text(FILE)
    (tmp_path / "sensors.toml").write_text(INSTRUMENTS)

    def run(*options):
        (tmp_path / "out.csv").unlink(missing_ok=True)
        status, out, err = bayesub(
            "simulate", "auv690", "horizontal", "-o", "out.csv", "--dt", 0.4, "--sample", 1, *options
        )
        return status, out + err, log_files.read_log(tmp_path / "out.csv") if status == 0 else None

    return run


@pytest.mark.rendered
def test_a_disturbed_track(fly, tmp_path):
    """The message says the forces, the columns of the track are those of any, and the seed decides."""
    _, calm_message, calm = fly()
    status, message, first = fly("--disturbance", "forces.toml", "--plot", "track.png")
    assert status == 0
    assert "disturbance" not in calm_message
    assert "step 0.4 s, disturbance sd X 2.81" in message
    assert message.endswith("N m, correlation time 4 s, ok\n")
    assert (tmp_path / "track.png").stat().st_size > 10_000
    _, _, again = fly("--disturbance", "forces.toml")
    _, _, other = fly("--disturbance", "forces.toml", "--seed", 1)
    assert list(first) == list(calm)
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
    assert min(np.abs(first["x"] - track["x"]).max() for track in (calm, other)) > 0.1


def test_the_noise_of_the_readings_is_that_of_the_calm_trial(fly, bayesub, tmp_path):
    """With a file of its own as well as in the file of the instruments."""
    tracks = [fly(*options)[2] for options in ((), ("--disturbance", "forces.toml"))]
    logs = [fly("--sensors", "sensors.toml", *options)[2] for options in ((), ("--disturbance", "forces.toml"))]
    calm, noise = (
        {k: log[k] - np.interp(log["time"], t["time"], t[k]) for k in "xy"} for log, t in zip(logs, tracks, strict=True)
    )
    for k in "xy":
        np.testing.assert_allclose(noise[k], calm[k], rtol=0, atol=1e-9)
    (tmp_path / "both.toml").write_text(INSTRUMENTS + FILE.replace("[disturbance]", "[truth.disturbance]"))
    _, message, log = fly("--sensors", "both.toml")
    assert "disturbance sd X 2.81" in message
    np.testing.assert_array_equal(log["x"], logs[1]["x"])
    assert fly("--sensors", "both.toml", "--disturbance", "forces.toml")[0] == 2
    refusals.check(bayesub.error, "conflict", "--disturbance")


@pytest.mark.parametrize(
    ("old", "new", "kind", "key"),
    [
        ("[disturbance]", "", "unknown", "axes"),
        ("share = 0.02", "share = { median = 0.02, log_sd = 1.0 }", "conflict", "disturbance"),
        ("4.0", "0.3", "conflict", "correlation_time_s"),
        ("share = 0.02", "share = -0.02", "value", "disturbance.share.X"),
        ("share = 0.02", "sd_n = 1.0", "conflict", "disturbance"),
        (
            '"X", "Y"',
            '"X", "M"',
            "conflict",
            "M",
        ),
        ("axes", "axis", "unknown", "disturbance.axis"),
    ],
)
def test_files_that_do_not_fit(fly, bayesub, tmp_path, old, new, kind, key):
    """One line that begins with the file."""
    (tmp_path / "forces.toml").write_text(FILE.replace(old, new))
    status, message, _ = fly("--disturbance", "forces.toml")
    assert status == 2
    assert "forces.toml: " in message
    refusals.check(bayesub.error, kind, key)
    assert message.count("\n") == 1


def test_a_file_that_is_missing(fly, bayesub):
    assert fly("--disturbance", "absent.toml")[0] == 2
    refusals.check(bayesub.error, "file")


def test_check_says_what_a_disturbance_is(bayesub, tmp_path):
    """Of a file; and of a study the sds, their shares, the time and the knots, and that the truth has one."""
    (tmp_path / "forces.toml").write_text(FILE)
    assert bayesub("check", tmp_path / "forces.toml")[1].endswith("disturbance on X Y N, correlation time 4 s\n")
    study = tmp_path / "study.toml"
    text = (
        'name = "disturbed"\nvehicle = "auv690"\nmanoeuvre = "horizontal"\nseed = 1\ndt_s = 0.4\n'
        + INSTRUMENTS
        + '[free]\ncoefficients = ["Xuu", "Yuv"]\n[prior]\nkind = "relative_normal"\nsd = 0.1\n'
    )
    study.write_text(text)
    assert "sd X" not in bayesub("check", study)[1]
    fitted = FILE.replace("share = 0.02", "share = { median = 0.02, log_sd = 1.0 }").replace("4.0", "20.0")
    study.write_text(text + fitted + FILE.replace("[disturbance]", "[truth.disturbance]"))
    out = bayesub("check", study)[1]
    assert ", truth disturbed on X Y N; disturbance sd X about 2.81" in out
    assert " N m (2 % of the hull's), correlation time 20 s, 19 knots; " in out


def test_the_section_of_a_new_study_is_one(tmp_path, bayesub, monkeypatch):
    """Its lines without the hash pose the disturbance of the plane."""
    monkeypatch.chdir(tmp_path)
    assert bayesub("new", "study", "mine", "--vehicle", "auv690", "--manoeuvre", "horizontal")[0] == 0
    lines = (tmp_path / "mine.toml").read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("# [disturbance]"))
    lines[first : first + 4] = [line.removeprefix("# ") for line in lines[first : first + 4]]
    (tmp_path / "mine.toml").write_text("\n".join(lines))
    disturbance = bs.load_study(tmp_path / "mine.toml").disturbance
    assert disturbance.axes == ("X", "Y", "N")
    assert set(disturbance.share) == {"X", "Y", "N"}
