"""`bayesub design`: a manoeuvre that can be flown, a page, a search that a kill does not lose, and bad input."""

import itertools
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from datetime import datetime, timedelta

import numpy as np
import pytest
from support import refusals

import bayesub as bs
from bayesub.design.limits import load_limits
from bayesub.inference.sampling import posterior_file
from bayesub.model.quantities import QUANTITIES
from bayesub.study import provenance
from bayesub.study.after import design

COMMAND = [sys.executable, "-c", "from bayesub.__main__ import main; main()", "design"]
FILES = ("manoeuvre.csv", "design.json", "design.html")
QUICK = ("--subproblem", "horizontal", "--judgements", "160")
LIMITS = "duration_s = 40.0\nrange_north_m = 80.0\nroll_deg = 30.0\n"
SENSORS = """
[[sensors]]
kind = "dvl"
sd_mps = 0.005
channels = ["u_ground", "v_ground"]
[[sensors]]
kind = "ins"
sd_degps = 0.01
channels = ["r"]
"""


UNKNOWN = """
[free]
coefficients = ["Xuu", "Yuv", "Nuv", "Nur", "Nuu_dr"]
[prior]
kind = "relative_normal"
sd = 0.25
[prior.given]
Xuu = { mean = -0.0065, sd = 1e-4 }
[nuisance]
current_north_mps = { mean = 0.0, sd = 0.2 }
[noise.r_degps]
kind = "student_t"
dof = 4.0
[disturbance]
axes = ["Y", "N"]
sd = 1e-5
correlation_time_s = 5.0
"""


@pytest.fixture
def minutes_pass(monkeypatch):
    """A clock that is a minute further whenever it is read."""

    class Clock(datetime):
        minutes = itertools.count()

        @classmethod
        def now(cls, tz=None):
            return datetime(2026, 1, 1, tzinfo=tz) + timedelta(minutes=next(cls.minutes))

    monkeypatch.setattr(provenance, "datetime", Clock)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with limits of a short trial and with sensors."""
    (tmp_path / "limits.toml").write_text(LIMITS)
    (tmp_path / "sensors.toml").write_text(SENSORS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def content(folder):
    return {name: (folder / name).read_bytes() for name in FILES}


def answer(folder):
    """What a search found, without the time at which it was begun."""
    numbers = json.loads((folder / "design.json").read_text())
    del numbers["inputs"]["begun"]
    return numbers, [(folder / name).read_bytes() for name in ("manoeuvre.csv", "design.html")]


def test_a_design_is_written_judged_and_flown(folder, bayesub):
    """Numbers and page agree, limits are kept, and `simulate` flies the manoeuvre."""
    options = ("--limits", "limits.toml", "--family", "standard", *QUICK)
    status, out, err = bayesub("design", "auv690", *options, "-o", "trial")
    assert status == 0, err
    assert "as none are given" in out
    numbers = json.loads((folder / "trial" / "design.json").read_text())
    after, before, standard = (numbers[key]["known_to_10_percent"] for key in ("after", "before", "standard"))
    assert after >= standard >= before == 0
    assert f"Known to 10 %: {after} of {len(numbers['coefficients'])} coefficients" in out
    sds = {c["name"]: c["sd_after"] / abs(c["value"]) for c in numbers["coefficients"]}
    assert sum(sd <= 0.10 for sd in sds.values()) == after
    assert all(c["sd_after"] <= c["sd_before"] * (1 + 1e-9) for c in numbers["coefficients"])
    margins = {m["limit"]: m for m in numbers["margins"][0]}
    assert set(margins) == {"range_north_m", "roll_deg"}
    assert all(m["excess"] <= 0.0 for m in margins.values())
    page = (folder / "trial" / "design.html").read_text()
    assert numbers["answer"] in page.replace("&#39;", "'")
    assert "http" not in re.sub(r"http://www.w3.org\S*", "", page), "the page needs nothing from elsewhere"
    flight = ("trial/manoeuvre.csv", "--subproblem", "horizontal", "-o", "track.csv")
    assert bayesub("simulate", "auv690", *flight)[0] == 0
    boat = bs.load_vehicle("auv690")
    flown = bs.simulate(boat, bs.load_manoeuvre("trial/manoeuvre.csv", boat), subproblem="horizontal")
    reached = np.ptp(flown.states[0, :, 0])
    assert reached == pytest.approx(margins["range_north_m"]["reached"], rel=0.01)
    rudder = np.degrees(np.abs(flown.simulator.manoeuvre.controls[:, 0]))
    assert rudder.max() <= np.degrees(boat.actuators.members[0].range[1]) * (1 + 1e-9)


def test_a_helmsman_gets_a_table_of_orders(folder, bayesub):
    """Times and angles, no more than he can follow; searched over several boats."""
    (folder / "limits.toml").write_text(LIMITS + "orders_an_hour = 450.0\n")
    options = ("--limits", "limits.toml", "--family", "steps", "--boats", "2", *QUICK)
    status, out, err = bayesub("design", "auv690", *options, "-o", "trial")
    assert status == 0, err
    assert "on average over 2 boats" in out
    (orders,) = json.loads((folder / "trial" / "design.json").read_text())["orders"]
    assert orders["columns"][:2] == ["time_s", "rudder_deg"]
    assert len(orders["rows"]) == 5
    assert ">Orders</h2>" in (folder / "trial" / "design.html").read_text()


@pytest.mark.usefixtures("minutes_pass")
@pytest.mark.slow
def test_a_search_that_was_cut_off_is_continued_bit_for_bit(folder, bayesub):
    """Whatever is left of the costs: some, a line that is half written, or none; and however long ago it was begun."""
    options = ("auv690", "--limits", "limits.toml", "--family", "standard", *QUICK)
    assert bayesub("design", *options, "-o", "whole")[0] == 0
    whole, costs = content(folder / "whole"), folder / "whole" / "costs" / "costs_standard.txt"
    text = costs.read_text()
    for remains in (text[: len(text) // 2], ""):
        costs.write_text(remains)
        for name in FILES:
            (folder / "whole" / name).unlink()
        assert bayesub("design", *options, "-o", "whole", "--resume")[0] == 0
        assert content(folder / "whole") == whole


@pytest.mark.usefixtures("minutes_pass")
@pytest.mark.slow
def test_a_search_that_has_ended_goes_on(folder, bayesub):
    """With more judgements, to the result of one that was asked for all of them at once, curves from the best too."""
    options = ("auv690", "--subproblem", "horizontal", "--limits", "limits.toml")
    families = ("--family", "standard", "--family", "curves")
    assert bayesub("design", *options, *families, "--judgements", 300, "-o", "long")[0] == 0
    assert bayesub("design", *options, *families, "--judgements", 450, "-o", "long", "--resume")[0] == 0
    assert bayesub("design", *options, *families, "--judgements", 450, "-o", "whole")[0] == 0
    assert answer(folder / "long") == answer(folder / "whole")


@pytest.mark.slow
def test_ctrl_c_loses_nothing(folder, bayesub):
    """One line with the command that continues, whose result is that of a search that was not interrupted."""
    options = ("auv690", "--limits", "limits.toml", "--family", "standard", *QUICK)
    process = subprocess.Popen([*COMMAND, *options, "-o", "cut"], stderr=subprocess.PIPE, text=True)
    costs = folder / "cut" / "costs" / "costs_standard.txt"
    while not (costs.exists() and costs.read_text()):
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert err.startswith("bayesub: interrupted; what is done is saved, continue with: bayesub design auv690")
    again = err.strip().rpartition("bayesub ")[2].split()
    assert bayesub(*again)[0] == 0
    assert bayesub("design", *options, "-o", "whole")[0] == 0
    same = [(folder / name / "manoeuvre.csv").read_bytes() for name in ("cut", "whole")]
    assert same[0] == same[1]


@pytest.mark.slow
def test_several_manoeuvres_for_one_coefficient(folder, bayesub):
    """Designed together: two files, and together they tell more than the same search of one."""
    options = ("--limits", "limits.toml", "--sensors", "sensors.toml", "--family", "standard", *QUICK, "--for", "Nuv")
    sds = []
    for n in (1, 2):
        assert bayesub("design", "auv690", *options, "--trials", n, "-o", f"of{n}")[0] == 0
        numbers = json.loads((folder / f"of{n}" / "design.json").read_text())
        (asked,) = numbers["asked_for"]
        assert asked["name"] == "Nuv"
        assert asked["sd_after"] < asked["sd_before"]
        sds.append(asked["sd_after"])
        assert len(numbers["margins"]) == n
    assert sds[1] < sds[0]
    assert sorted(path.name for path in (folder / "of2").glob("*.csv")) == ["manoeuvre_1.csv", "manoeuvre_2.csv"]


@pytest.mark.usefixtures("folder")
def test_a_folder_is_not_overwritten(bayesub):
    options = ("auv690", "--limits", "limits.toml", "--family", "standard", *QUICK)
    assert bayesub("design", *options, "-o", "trial")[0] == 0
    for more, kind, key in (((), "state", ""), (("--seed", "1"), "state", "")):
        assert bayesub("design", *options, *more, "-o", "trial")[0] == 2
        refusals.check(bayesub.error, kind, key)
    assert bayesub("report", "trial")[0] == 2
    refusals.check(bayesub.error, "state", "design")


@pytest.mark.parametrize("goal", ["D", "A", "E", "known:25"])
@pytest.mark.slow
def test_every_criterion_and_all_that_a_trial_may_not_know(goal, folder, bayesub):
    """Steps of a helmsman, with noise, nuisance parameters and unmodelled forces that are integrated out."""
    (folder / "steps.toml").write_text(LIMITS + "orders_an_hour = 500.0\nrudder_deg = 10.0\n")
    (folder / "unknown.toml").write_text(SENSORS + UNKNOWN)
    options = ("--sensors", "unknown.toml", "--limits", "steps.toml", *QUICK, "--for", goal)
    status, out, err = bayesub("design", "auv690", *options, "-o", "trial")
    assert status == 0, err
    assert "unknown besides: current_north_mps, forces on Y N" in " ".join(out.split())
    numbers = json.loads((folder / "trial" / "design.json").read_text())
    before, after = numbers["before"], numbers["after"]
    assert after["D"] < before["D"] == pytest.approx(0.0, abs=1e-12)
    assert after["A"] < before["A"] == pytest.approx(1.0)
    assert {c["name"] for c in numbers["coefficients"]} == {"Xuu", "Yuv", "Nuv", "Nur", "Nuu_dr"}
    assert next(c for c in numbers["coefficients"] if c["name"] == "Xuu")["sd_before"] == pytest.approx(1e-4)
    boat = bs.load_vehicle("auv690")
    rudder = np.degrees(bs.load_manoeuvre("trial/manoeuvre.csv", boat).controls[:, 0])
    assert np.abs(rudder).max() <= 10.0 + 1e-6
    assert len(np.unique(rudder[np.abs(np.diff(rudder, append=0.0)) < 1e-9].round(6))) <= 6, "an order in eight seconds"


BAD = {
    "limits that straight flight breaks": (
        "--limits straight.toml", "conflict", "max_speed_mps"
    ),
    "no limit": ("--limits typo.toml", "unknown", "depth_chang_m"),
    "a limit above another": ("--limits order.toml", "conflict", ""),
    "a missing file": ("--limits none.toml", "file", ""),
    "sensors that tell nothing": ("--sensors pressure.toml", "data", "sensors"),
    "a coefficient that the sensors do not tell": ("--sensors pressure.toml --for Nuv", "data", "Nuv"),
    "a typing error": ("--for Nuw", "unknown", "--for"),
    "a criterion and a name": ("--for D --for Nuv", "conflict", "--for"),
    "no share": ("--for known:0", "value", "--for"),
    "a coefficient without part": ("--for Zuw", "conflict", "--for"),
    "a quantity of another plane": ("--for vertical_stability", "conflict", "--for"),
    "no family": ("--family curve", "unknown", "--family"),
    "curves for a helmsman": ("--limits helmsman.toml --family curves", "conflict", "--family"),
    "time twice": ("--minutes 1", "conflict", "--minutes"),
    "budget and minutes": ("--budget 60s", "conflict", "--budget"),
    "no time": ("--budget soon", "value", "--budget"),
    "a sensor that is not there": ("--without gps", "unknown", "--without"),
    "no sensor is left": ("--without dvl --without ins", "missing", "--without"),
    "resume and force": ("--resume --force", "conflict", "--force"),
    "nothing to resume": ("--resume", "state", "--resume"),
    "no run": ("--after nowhere", "state", "config.toml"),
    "a prior of nothing": ("--sensors perturbed.toml", "conflict", ""),
    "a nuisance that is known": ("--sensors known.toml", "conflict", ""),
}  # fmt: skip


def test_new_limits_are_limits(folder, bayesub):
    """As they are, and with every key that is commented out."""
    assert bayesub("new", "limits", "-o", "new.toml")[0] == 0
    text = (folder / "new.toml").read_text()
    assert load_limits(folder / "new.toml").pitch_deg == 30.0
    (folder / "all.toml").write_text(re.sub(r"^# (\w+ = )", r"\1", text, flags=re.MULTILINE))
    limits = load_limits(folder / "all.toml")
    assert all(value is not None for value in limits.model_dump().values())
    assert limits.of_controls == {"rudder_deg": 20.0, "rudder_degps": 3.0}
    assert bayesub("new", "limits", "-o", "new.toml")[0] == 2
    assert "limits of a trial: min_rpm_percent 50, " in bayesub("check", "new.toml")[1]
    assert bayesub("check", "sensors.toml")[1].endswith("instruments that read u_ground_mps, v_ground_mps, r_degps\n")


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(case, folder, bayesub):
    """It names file or option and remedy, and makes no folder."""
    options, kind, key = BAD[case]
    pressure = '[[sensors]]\nkind = "pressure"\nsd_m = 0.05\n'
    (folder / "straight.toml").write_text("duration_s = 40.0\nmax_speed_mps = 1.0\n")
    (folder / "typo.toml").write_text("depth_chang_m = 10.0\n")
    (folder / "order.toml").write_text("min_speed_mps = 2.0\nmax_speed_mps = 1.0\n")
    (folder / "helmsman.toml").write_text("duration_s = 40.0\norders_an_hour = 400.0\n")
    (folder / "pressure.toml").write_text(pressure)
    (folder / "perturbed.toml").write_text(
        pressure + '[prior]\nkind = "relative_normal"\nsd = 0.2\ncentre = "perturbed"\n'
    )
    (folder / "known.toml").write_text(SENSORS + "[nuisance]\nbias_yaw_deg = { value = 1.0 }\n")
    given = ("design", "auv690", *QUICK, *options.split(), "-o", "trial")
    if "--limits" not in options:
        given += ("--limits", "limits.toml")
    status, _, err = bayesub(*given)
    assert status == 2, err
    refusals.check(bayesub.error, kind, key)
    assert err.count("\n") == 1
    assert not (folder / "trial" / "config.toml").exists()


@pytest.mark.parametrize("minutes", ["nan", "0.01", "inf"])
def test_a_time_that_is_none_is_refused(folder, bayesub, minutes):
    assert bayesub("design", "auv690", "--minutes", minutes, "-o", "trial")[0] == 2
    refusals.check(bayesub.error, "value", "--minutes")
    assert not (folder / "trial").exists()


def test_a_control_is_said_to_move_no_further_than_the_vehicle_lets_it(folder):
    (folder / "wide.toml").write_text("duration_s = 40.0\nrudder_deg = 80.0\nrudder_degps = 90.0\n")
    posed = design.pose(design.Request("auv690", limits=folder / "wide.toml", subproblem="horizontal"))
    member = next(m for m in bs.load_vehicle("auv690").actuators.members if m.column == "rudder_deg")
    limit, rate = (float(np.degrees(value)) for value in (member.limit, member.rate))
    assert limit < 80.0
    assert rate < 90.0
    assert f"rudder {limit:g} deg, rudder {rate:g} deg/s" in posed.words["limits"]


def test_a_quantity_first(folder, bayesub):
    """Its expected sd comes first in the answer, and falls with time and with a sensor that reads what it needs."""
    options = ("--limits", "limits.toml", "--sensors", "sensors.toml", "--family", "standard", *QUICK)
    wanted = ("--for", "tactical_diameter_m", "--for", "straight_line_stability")
    status, out, err = bayesub("design", "auv690", *options, *wanted, "-o", "trial")
    assert status == 0, err
    assert ": tactical_diameter_m = " in out
    numbers = json.loads((folder / "trial" / "design.json").read_text())
    boat = bs.load_vehicle("auv690")
    (value,) = QUANTITIES["tactical_diameter_m"].values(boat, boat.xi)
    assert numbers["asked_for"][0]["value"] == pytest.approx(value)
    assert all(q["sd_after"] < 0.5 * q["sd_before"] for q in numbers["asked_for"])
    left = list(numbers["by_minute"].values())
    assert left == sorted(left, reverse=True)
    assert left[0] == pytest.approx(100.0)
    ratios = [q["sd_after"] / q["sd_before"] for q in numbers["asked_for"]]
    assert left[-1] == pytest.approx(100.0 * np.sqrt(np.prod(ratios)))
    assert numbers["by_sensor"]["without r"] > left[-1] > numbers["by_sensor"]["with rates to 0.001 deg/s"]
    assert {v["name"] for v in numbers["towing_tank"]} <= {c["name"] for c in numbers["coefficients"]}


@pytest.mark.slow
def test_what_is_lost_is_not_used(folder, bayesub):
    """Without the Doppler log nothing is known of drag; a design that is robust says so, and keeps its time."""
    files = ("--limits", "limits.toml", "--sensors", "sensors.toml")
    options = (*files, "--family", "standard", "--subproblem", "horizontal")
    status, out, err = bayesub("design", "auv690", *options, "--without", "dvl", "--budget", "6s", "-o", "lost")
    assert status == 0, err
    assert "sensors: r sd 0.01 deg/s every 1 s\n" in out
    lost = json.loads((folder / "lost" / "design.json").read_text())
    assert not any("u_ground" in name for name in lost["by_sensor"])
    status, out, err = bayesub("design", "auv690", *options, "--robust", "--judgements", 160, "-o", "robust")
    assert status == 0, err
    assert "on average over the loss of any instrument" in " ".join(out.split())


@pytest.mark.slow
def test_after_a_first_trial(folder, bayesub, finished):
    """The posterior of a run is the prior; a run that is not finished or has not converged is refused."""
    shutil.copytree(finished(), folder / "first")
    options = ("--limits", "limits.toml", "--family", "standard", *QUICK, "--after", "first")
    status, out, err = bayesub("design", "auv690", *options, "-o", "second")
    assert status == 0, err
    assert "the posterior of first of 3 coefficients" in out
    assert "(those of first)" in out, "its sensors"
    numbers = json.loads((folder / "second" / "design.json").read_text())
    posterior = posterior_file.load(folder / "first" / "posterior.nc")
    for coefficient in numbers["coefficients"]:
        place = posterior.names.index(coefficient["name"])
        assert coefficient["value"] == pytest.approx(posterior.mean[place])
        assert coefficient["sd_before"] == pytest.approx(posterior.sd[place])
        assert coefficient["sd_after"] < coefficient["sd_before"]
    for vehicle, run, kind, key in (
        ("suboff", "first", "conflict", "--after"),
        ("auv690", "second/costs", "state", "config.toml"),
        ("auv690", "second", "state", "design"),
    ):
        status, _, err = bayesub("design", vehicle, "--after", run, "-o", "third")
        assert (status, err.count("\n")) == (2, 1)
        refusals.check(bayesub.error, kind, key)
    outcome = folder / "first" / "outcome.json"
    saved = json.loads(outcome.read_text())
    outcome.write_text(json.dumps(saved | {"verdict": "not converged"}))
    assert bayesub("design", "auv690", *options, "-o", "third")[0] == 2
    refusals.check(bayesub.error, "state")
    outcome.unlink()
    assert bayesub("design", "auv690", *options, "-o", "third")[0] == 2
    refusals.check(bayesub.error, "state")
