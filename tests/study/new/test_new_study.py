"""New study files: what is written can be read back and poses a problem."""

from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.io import toml_files
from bayesub.sensors import flat
from bayesub.study.new import files
from bayesub.study.new.study import of_log, simulated
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study


def test_a_new_study_is_one_that_can_be_posed(tmp_path, monkeypatch):
    """Of a simulated manoeuvre, and of a log in another folder; both are read back and pose a problem."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "first.toml"
    path.write_text(simulated("first", path, "auv690", "zigzag_20_20"))
    assert prepare(load_study(path)).problem.names[0] == "Xuu"
    (tmp_path / "logs").mkdir()
    log = tmp_path / "logs" / "trial.csv"
    boat = bs.load_vehicle("auv690")
    spiral = bs.load_manoeuvre("horizontal", boat)
    record = bs.observe(bs.simulate(boat, spiral), bs.sensors.DVL(sd_mps=0.005), np.random.default_rng(1))
    record.save(log, spiral)
    path.write_text(of_log("first", path, "auv690", log))
    posed = load_study(path)
    assert 'data = "logs/trial.csv"' in path.read_text()
    assert (posed.subproblem, posed.ignore) == ("horizontal", ("w_ground_mps",))
    # The median of some hundred second differences knows the noise to a tenth or so.
    assert [sensor.sd for sensor in posed.sensors] == pytest.approx([0.005] * 2, rel=0.3)
    assert "current_north_mps" in prepare(posed).problem.names
    # Scales, which no log tells, are offered with priors, and exist.
    path.write_text(path.read_text().replace("# scale_", "scale_"))
    scales = {"scale_u_ground", "scale_v_ground", "scale_propeller", "scale_rudder"}
    priors = prepare(load_study(path)).problem.nuisance_priors
    assert {name: float(priors[name].sd[0]) for name in scales} == {
        name: 0.01 if name.endswith("ground") else 0.05 for name in scales
    }


def test_files_are_named_from_the_study_file(tmp_path, monkeypatch):
    """A study in a folder of its own finds its vehicle and its manoeuvre, wherever it is run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "boat.toml").write_bytes(toml_files.built_in("vehicles")["auv690"].read_bytes())
    (tmp_path / "flown.toml").write_bytes(toml_files.built_in("manoeuvres")["horizontal"].read_bytes())
    (tmp_path / "mine").mkdir()
    path = Path("mine/first.toml")
    path.write_text(simulated("first", path, "boat.toml", "flown.toml"))
    assert 'vehicle = "../boat.toml"' in path.read_text()
    monkeypatch.chdir("/")
    posed = load_study(tmp_path / path)
    assert [posed.path(name) for name in posed.files] == [str(tmp_path / "boat.toml"), str(tmp_path / "flown.toml")]
    assert prepare(posed).vehicle.name == "auv690"


def test_names_of_files_are_texts_of_toml(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    boat, flown = 'a "fast" boat.toml', "it's\\flown.toml"
    (tmp_path / boat).write_bytes(toml_files.built_in("vehicles")["auv690"].read_bytes())
    (tmp_path / flown).write_bytes(toml_files.built_in("manoeuvres")["horizontal"].read_bytes())
    path = Path("first.toml")
    path.write_text(simulated("first", path, boat, flown))
    study = load_study(path)
    assert (study.vehicle, study.manoeuvre) == (boat, flown)


def sensors_of(path, **columns):
    """The sensors that a new study proposes for columns (n,) of a log, written with ten digits, a row a second."""
    columns = {"time_s": np.arange(len(columns["x_m"])), "rudder_deg": np.zeros(len(columns["x_m"]))} | columns
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path / "log.csv", rows, delimiter=",", comments="", fmt="%.10g", header=",".join(columns))
    (path / "a.toml").write_text(of_log("a", path / "a.toml", "auv690", path / "log.csv"))
    return {sensor.column: sensor for sensor in flat(s.build() for s in load_study(path / "a.toml").sensors)}


def test_the_rounding_of_a_column_is_recognised(tmp_path):
    """A step for all readings is a resolution, steps that grow with the value are noise; or neither in noise."""
    times, rng = np.arange(600.0), np.random.default_rng(1)
    track = 100.0 * (1.0 - np.cos(times / 200.0))
    few_digits = [float(f"{value:.2g}") for value in track]
    noisy = np.round(1.7 + rng.normal(0.0, 0.05, 600), 3)
    heading = np.round(np.degrees(times / 90.0), 0) % 360.0  # which wraps
    sensors = sensors_of(tmp_path, x_m=np.round(track, 0), y_m=few_digits, u_mps=noisy, heading_deg=heading)
    for column in ("x_m", "heading_deg"):
        assert sensors[column].resolution == pytest.approx(1.0)
        assert sensors[column].sd == pytest.approx(1.0 / np.sqrt(12.0), rel=0.02)
    assert sensors["y_m"].resolution == sensors["u_mps"].resolution == 0.0
    error = np.sqrt(np.mean((few_digits - track) ** 2))
    assert sensors["y_m"].sd == pytest.approx(error, rel=0.2)
    assert sensors["u_mps"].sd == pytest.approx(0.05, rel=0.2)
    with refused("data", "x_m"):
        sensors_of(tmp_path, x_m=np.full(50, 7.0))


def test_noise_is_not_guessed_of_columns_that_hide_it(tmp_path):
    """One that was smoothed, and one that is the sum of another: as of the tanker KVLCC2 in HSVA's basin.

    Their second differences are of micrometres, and the places along a straight path all lie apart, in steps of motion.
    """
    times, rng = 0.05 * np.arange(2000), np.random.default_rng(2)
    speeds = 1.2 + 0.2 * np.cos(times / 200.0) + rng.normal(0.0, 2e-4, 2000)
    sensors = sensors_of(tmp_path, x_m=np.cumsum(0.05 * speeds), y_m=20.0 * np.sin(times / 9.0), u_mps=speeds)
    assert not any(sensor.resolution for sensor in sensors.values())
    assert sensors["x_m"].sd == pytest.approx(1e-5 * np.ptp(np.cumsum(0.05 * speeds)), rel=0.1)
    assert sensors["y_m"].sd == pytest.approx(1e-3 * 40.0, rel=0.1)
    assert sensors["u_mps"].sd == pytest.approx(2e-4, rel=0.2)
    assert sensors_of(tmp_path, x_m=np.array([0.0, 1.0, 2.7]))["x_m"].sd > 0.0  # too few to tell


def test_a_log_that_is_denser_than_its_boat_moves_is_thinned(tmp_path):
    """Of 100 Hz one reading in a tenth of a ship length is proposed, and used; of 1 Hz, or of a short log, all."""
    boat = bs.load_vehicle("auv690")
    tenth = 0.1 * boat.length_m / boat.speed_mps
    for step, n, thinned in ((0.01, 6001, True), (0.01, 2001, False), (1.0, 201, False)):
        times = step * np.arange(n)
        rows = np.column_stack([times, np.sin(times), 1.75 * times])
        names = "time_s,rudder_deg,x_m"
        np.savetxt(tmp_path / "log.csv", rows, delimiter=",", comments="", fmt="%.9g", header=names)
        path = tmp_path / "a.toml"
        path.write_text(of_log("a", path, "auv690", tmp_path / "log.csv"))
        study = load_study(path)
        assert (study.interval_s is not None) == thinned
        if thinned:
            assert study.interval_s == pytest.approx(tenth, rel=0.05)
            (channel,) = study.build(
                boat, study.sensors, {"yaw0_deg": study.nuisance["yaw0_deg"]}, study.path
            ).record.channels
            assert np.diff(channel.times) == pytest.approx(study.interval_s, abs=step)


def test_a_vertical_log_needs_neither_heading_nor_cross_current(tmp_path):
    """What cannot change in the plane of the motion is not among the nuisance parameters."""
    boat = bs.load_vehicle("npsauv")
    zigzag = bs.load_manoeuvre("vertical", boat)
    record = bs.observe(bs.simulate(boat, zigzag), bs.sensors.DVL(sd_mps=0.005), np.random.default_rng(1))
    record.save(tmp_path / "log.csv", zigzag)
    path = tmp_path / "vertical.toml"
    path.write_text(of_log("vertical", path, "npsauv", tmp_path / "log.csv"))
    names = prepare(load_study(path)).problem.names
    assert "current_north_mps" in names
    assert not {"current_east_mps", "yaw0_deg"} & set(names)


def test_what_is_measured_beside_controls_that_rest_is_kept(tmp_path):
    """A depth says something of six degrees of freedom, though planes that rest would leave the horizontal."""
    rng = np.random.default_rng(2)
    sensors = sensors_of(tmp_path, x_m=np.full(60, np.nan), depth_m=50.0 + rng.normal(0.0, 0.1, 60))
    assert set(sensors) == {"depth_m"}


@pytest.mark.parametrize(("manoeuvre", "column"), [("horizontal", "x_m"), ("vertical", "x_m")])
def test_the_noise_that_the_template_advises_is_accepted(tmp_path, manoeuvre, column):
    """Without the hash signs the commented section names a column that the template's sensors read."""
    path = tmp_path / "first.toml"
    text = simulated("first", path, "auv690", manoeuvre)
    assert f"# [noise.{column}] " in text
    for line in (f"[noise.{column}] ", 'kind = "student_t" ', "dof = 4.0"):
        text = text.replace(f"# {line}", line)
    path.write_text(text)
    assert prepare(load_study(path)).study.noise[column].dof == 4.0


def log_of(path, *columns):
    """A log in which these controls move, and x too."""
    rows = [f"{k},{k % 7},{','.join([str(k % 3)] * len(columns))}" for k in range(30)]
    path.write_text("\n".join([f"time_s,x_m,{','.join(columns)}", *rows]) + "\n")
    return path


def test_the_controls_of_the_equations_decide_the_plane(tmp_path):
    """A ship stays in the horizontal one; a control whose plane nobody knows may act in both."""
    path = tmp_path / "study.toml"
    path.write_text(of_log("study", path, "mariner", log_of(tmp_path / "log.csv", "rudder_deg")))
    assert load_study(path).subproblem == load_study(path).free.coefficients == "horizontal"
    assert "# Xu = {" in path.read_text()
    (tmp_path / "few.toml").write_text(files.equations("few").replace("# t1 =", "t1 ="))
    boat = tmp_path / "boat.toml"
    boat.write_text(files.vehicle("boat", equations=str(tmp_path / "few.toml"), path=boat))
    for columns, plane in (
        (("rudder_deg",), "horizontal"),
        (("stern_plane_deg",), "vertical"),
        (("rudder_deg", "thruster_1_n"), "all"),
        (("thruster_1_n",), "all"),
        (("rudder_deg", "stern_plane_deg"), "all"),
    ):
        path.write_text(of_log("study", path, str(boat), log_of(tmp_path / "log.csv", *columns)))
        assert load_study(path).free.coefficients == plane
        assert (load_study(path).subproblem or "all") == plane


def test_the_track_of_a_ship_has_no_depth(tmp_path):
    path = tmp_path / "first.toml"
    path.write_text(simulated("first", path, "mariner", "zigzag_20_20"))
    assert load_study(path).sensors[0].channels == ("x", "y", "yaw")
