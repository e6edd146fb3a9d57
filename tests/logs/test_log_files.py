"""Track and record files."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.refusals import refused

from bayesub.logs import log_files
from bayesub.logs.log_files import (
    ACCELERATIONS,
    CONTROLS,
    HEADERS,
    OUTPUTS,
    STATES,
    positions,
    possible,
    read_log,
    si_factor,
    write_log,
)


def csv(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_headers_are_those_of_the_design():
    """The columns are those that are documented, with their units."""
    documented = (
        "time_s,rudder_deg,bow_plane_deg,stern_plane_deg,rpm,x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg,u_mps,v_mps,w_mps,"
        "p_degps,q_degps,r_degps,udot_mps2,vdot_mps2,wdot_mps2,pdot_degps2,qdot_degps2,rdot_degps2"
    )
    names = ("time", *CONTROLS, "rpm", *STATES, *ACCELERATIONS)
    assert [HEADERS[name] for name in names] == documented.split(",")
    instruments = {"depth_m", "heading_deg", "u_ground_mps", "v_ground_mps", "w_ground_mps"}
    instruments |= {"velocity_north_mps", "velocity_east_mps", "velocity_down_mps", "speed_over_ground_mps"}
    instruments |= {"course_over_ground_deg", "speed_through_water_mps"}
    assert set(HEADERS.values()) == set(documented.split(",")) | instruments


def test_velocities_in_knots(tmp_path):
    log = read_log(csv(tmp_path, "time_s,speed_over_ground_kn,u_kn\n1,2,-360\n"))
    assert log["sog"][0] == pytest.approx(2 * 1852 / 3600, rel=1e-15)
    assert log["u"][0] == pytest.approx(-185.2, rel=1e-14)


def test_units(tmp_path):
    """Degrees and radians are told apart by the column name; empty cells are missing readings."""
    log = read_log(
        csv(tmp_path, "time_s,roll_deg,yaw_rad,p_degps,q_radps,rdot_radps2,x_m\n1,180,2,90,3,4,\n2,,0,0,0,0,5\n")
    )
    assert log["phi"][0] == np.pi
    assert np.isnan(log["phi"][1])
    assert (log["psi"][0], log["p"][0], log["q"][0], log["rdot"][0]) == (2.0, np.pi / 2, 3.0, 4.0)
    assert np.isnan(log["x"][0])
    assert log["x"][1] == 5.0


@pytest.mark.parametrize("prefix", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_byte_order_mark_and_line_ends(tmp_path, prefix, end):
    """Files from spreadsheets are read as they are."""
    log = read_log(csv(tmp_path, prefix + end.join([b"time_s, x_m", b"0,1.5", b"1,2.5", b""])))
    np.testing.assert_array_equal(log["x"], [1.5, 2.5])


def readings(name):
    """Numbers in SI units that a column may have, or none."""
    least, most = (0.999 * si_factor(name) * np.clip(end, -1e6, 1e6) for end in possible(HEADERS[name]))
    return st.one_of(st.floats(least, most, allow_subnormal=False), st.just(np.nan))


@settings(deadline=None, max_examples=25)
@given(
    columns=st.lists(st.sampled_from([name for name in HEADERS if name != "time"]), unique=True),
    rows=st.integers(1, 5),
    data=st.data(),
)
def test_round_trip(tmp_path_factory, columns, rows, data):
    """What is written is read back to twelve digits, missing readings included."""
    times = np.cumsum(data.draw(st.lists(st.floats(0.01, 100.0), min_size=rows, max_size=rows)))
    log = {"time": times}
    for name in columns:
        log[name] = np.array(data.draw(st.lists(readings(name), min_size=rows, max_size=rows)))
    path = tmp_path_factory.mktemp("log") / "log.csv"
    write_log(path, log)
    back = read_log(path)
    assert set(back) == set(log)
    for name, values in log.items():
        np.testing.assert_allclose(back[name], values, rtol=1e-11, atol=0)


REFUSED = [
    ("", "format", ""),
    ("\n0,1\n", "format", ""),
    ("time_s,x_m\n", "data", ""),
    ("time_s;x_m\n0;1\n", "format", ""),
    ("time_s,height_m\n0,1\n", "unknown", "height_m"),
    ("time_s,yaw_degs\n0,1\n", "unknown", "yaw_degs"),
    ("x_m,y_m\n0,1\n", "missing", "time_s"),
    ("time_s,x_m,x_m\n0,1,1\n", "conflict", "x_m"),
    ("time_s,yaw_deg,yaw_rad\n0,1,1\n", "conflict", "yaw_deg"),
    ("time_s,x_m\n0,1\n1,two\n", "data", "x_m"),
    ("time_s,x_m\n0,inf\n", "data", "x_m"),
    ("time_s,x_m\n0,1\n2,1\n1,1\n", "data", "time_s"),
    ("time_s,x_m\n0,1\n0,1\n", "data", "time_s"),
    ("time_s,x_m\n0,1\n,1\n", "data", "time_s"),
    ("time_s,x_m\n0,1\n1,2,3\n", "format", ""),
    ("time_s,x_m\n0,5,1\n1,2\n", "format", ""),
    ("time_s,x_m\n0,5,1\n1,two\n", "format", ""),
    ("time_s,x_m\n0,two\n" + 15_000 * "1,2\n" + "1,2,3\n", "format", ""),
    ('time_s,x_m\n0,"1,5"\n', "data", "x_m"),
    ("time_s\tx_m\n0\t1\n", "format", ""),
    ("time_s,u_kts\n0,1\n", "unknown", "u_kts"),
    ("time_s,depth_ft\n0,1\n", "unknown", "depth_ft"),
    ("time_s,rudder_deg\n0,500\n", "unit", "rudder_deg"),
    ("time_s,depth_m\n0,-5000\n", "unit", "depth_m"),
    ("time_s,pressure_bar\n0,3\n1,2000\n", "unit", "pressure_bar"),
    ("time_s,z_m\n0,1e5\n", "unit", "z_m"),
    ("time_s,pitch_deg\n0,95\n", "unit", "pitch_deg"),
    ("time_s,pitch_rad\n0,20\n", "unit", "pitch_rad"),
    ("time_s,r_radps\n0,30\n", "unit", "r_radps"),
    ("time_s,x_m\n0,1\n1e9,1\n", "unit", "time_s"),
    ("time_s,x_m,\n0,1,\n", "format", ""),
    ("# logger 3.2\ntime_s,x_m\n0,1\n", "format", "# logger 3.2"),
    ("time_s,thrust_main_n\n0,1\n", "unknown", "thrust_main_n"),
    ("time_s,x_m\n0,1\n1,---\n2,ERR\n", "data", "x_m"),
    ("time_s,r_degps\n0,1\n1,-9999\n", "unit", "r_degps"),
    ("time_s,u_mps\n0,1\n1,9.96921e36\n", "unit", "u_mps"),
    (b"time_s,x_m\n0,1\n" + 10000 * b"\n" + b"1,\xff\n", "format", ""),
]


def test_what_boats_do_is_read(tmp_path):
    """Planes hard over in either unit, a dive upright, depths from a wave above the surface to the deepest trench."""
    text = "time_s,rudder_deg,pitch_deg,depth_m,yaw_deg,p_degps\n0,-90,90,-2,7200,-300\n86400,90,-90,10935,-400,300\n"
    assert len(read_log(csv(tmp_path, text))["depth"]) == 2
    read_log(csv(tmp_path, "time_s,rudder_rad,pitch_rad\n0,1.5708,-1.5708\n"))


@pytest.mark.parametrize(("text", "kind", "key"), REFUSED, ids=[repr(text[:40]) for text, *_ in REFUSED])
def test_bad_files(tmp_path, text, kind, key):
    """A log that does not fit is refused in one line that names file and place."""
    path = csv(tmp_path, text)
    with refused(kind, key) as error:
        read_log(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_zeros_of_a_power_cut_are_refused_or_are_no_row(tmp_path):
    """Before version 3.1 pandas takes cells of zeros for empty ones."""
    path = csv(tmp_path, "time_s,x_m\n0,1\n\0\0\0\0")
    if tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1):
        assert read_log(path)["x"].tolist() == [1.0]
    else:
        with refused("data", "time_s"):
            read_log(path)


def test_line_numbers_count_blank_lines(tmp_path):
    """The line in the message is the line of the file."""
    with refused("data", "x_m"):
        read_log(csv(tmp_path, "time_s,x_m\n0,1\n\n1,2\n2,bad\n"))


def test_a_place_that_cannot_be_written(tmp_path):
    """Writing where one cannot is an error that names the file."""
    with refused("file"):
        write_log(tmp_path / "absent" / "log.csv", {"time": np.zeros(1)})


def test_a_long_log_is_read_as_numbers(tmp_path, monkeypatch):
    """It is parsed once, and not as text; a wrong cell in the last row is found by its line."""
    n = 100_000
    rows = "\n".join(f"{k}.5,{k % 7},," for k in range(n))
    path = csv(tmp_path, f"time_s,x_m,y_m,rpm\n{rows}\n")
    with monkeypatch.context() as patch:
        patch.setattr(log_files, "_not_a_number", lambda *_: pytest.fail("was read as text"))
        log = read_log(path)
    assert log["time"][-1] == n - 0.5
    assert np.isnan(log["y"]).all()
    path.write_text(path.read_text() + f"{n}.5,1.5.1,,\n")
    with refused("data", "x_m"):
        read_log(path)


def test_units_of_columns():
    """A factor is that of the column as it is written, or of the one that is named."""
    assert si_factor("psi") == si_factor("yaw_deg") == np.pi / 180
    assert si_factor("yaw_rad") == si_factor("rpm") == si_factor("u_ground") == 1.0
    assert [OUTPUTS[k] for k in positions("w", "psi", "rdot")] == ["w", "psi", "rdot"]


def test_latitude_and_longitude_become_metres_from_the_first_fix(tmp_path):
    """On the ellipsoid WGS 84: a minute of latitude at 45 degrees is 1852.2 m, of longitude 1314.1 m."""
    text = "time_s,latitude_deg,longitude_deg\n0,,\n1,45,7\n2,45.01666666666667,7\n3,45,7.01666666666667\n4,45.01,\n"
    log = read_log(csv(tmp_path, text))
    assert set(log) == {"time", "x", "y"}
    np.testing.assert_allclose(log["x"][[1, 2]], [0.0, 1852.2], atol=0.1)
    np.testing.assert_allclose(log["y"][[1, 3]], [0.0, 1314.1], atol=0.1)
    assert np.isnan(log["x"][[0, 4]]).all()


def test_pressure_becomes_depth(tmp_path):
    """By the weight of a cubic metre of the water, 1000 kg/m^3 here."""
    for unit, value in (("dbar", 0.981), ("bar", 0.0981), ("kpa", 9.81), ("pa", 9810.0)):
        path = csv(tmp_path, f"time_s,pressure_{unit}\n0,{value}\n")
        assert read_log(path, weight_density=9810.0)["depth"][0] == pytest.approx(1.0, rel=1e-14)
        assert read_log(path)["depth"][0] == pytest.approx(1000.0 / 1025.0, rel=1e-14)


def test_a_pressure_that_is_a_control_leaves_the_depth_alone(tmp_path):
    log = read_log(csv(tmp_path, "time_s,depth_m,pressure_bar\n0,20,2\n"), ("pressure_bar",))
    assert (log["depth"][0], log["pressure_bar"][0]) == (20.0, 2.0)


@pytest.mark.parametrize(
    ("text", "kind", "key"),
    [
        ("time_s,latitude_deg\n0,45\n", "missing", "longitude_deg"),
        ("time_s,latitude_deg,longitude_deg\n0,45,7\n1,95,7\n", "value", "latitude_deg"),
        ("time_s,latitude_deg,longitude_deg\n0,45,7\n1,0,0\n", "data", "latitude_deg"),
        ("time_s,latitude_deg,longitude_deg\n0,45,\n", "data", "latitude_deg"),
        ("time_s,latitude_deg,longitude_deg,x_m\n0,45,7,1\n", "conflict", "latitude_deg"),
        ("time_s,depth_m,pressure_dbar\n0,45,7\n", "conflict", "depth_m"),
    ],
)
def test_fixes_that_cannot_be(tmp_path, text, kind, key):
    with refused(kind, key):
        read_log(csv(tmp_path, text))


def test_pressure_of_a_hull_that_follows_it_stays_a_pressure(tmp_path):
    """A boat with such a column of its own has it beside the depth; without the boat pressure becomes depth."""
    path = tmp_path / "log.csv"
    path.write_text("time_s,depth_m,pressure_bar\n0,10,1.0\n1,11,1.1\n")
    log = log_files.read_log(path, ["pressure_bar"])
    np.testing.assert_array_equal(log["pressure_bar"], [1.0, 1.1])
    np.testing.assert_array_equal(log["depth"], [10.0, 11.0])
