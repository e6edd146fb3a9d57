"""From signals to columns: rules of the map, times, orders that are held, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused

from bayesub.io import toml_files
from bayesub.logs import conversion, log_files
from bayesub.logs.log_map import LogMap, read_map
from bayesub.logs.readers import KINDS, Signal, VehicleLog

MAP = Path("map.toml")


def log(**signals):
    """A log of these signals: (times, values) or (times, values, unit)."""
    return VehicleLog(Path("dive.log"), {name: Signal(*map(np.asarray, s[:2]), *s[2:]) for name, s in signals.items()})


def converted(source, time=None, **columns):
    return conversion.convert(source, LogMap(time=time or {}, columns=columns), MAP)


def cells(result, column):
    filled = np.isfinite(result.columns[column])
    return result.times[filled], result.columns[column][filled]


T = np.array([10.0, 11.0, 12.0])
RULES = {
    "unit of the file": ({}, "rad", np.degrees([1.0, 2.0, 3.0])),
    "unit of the map": ({"unit": "rad"}, "m", np.degrees([1.0, 2.0, 3.0])),
    "factor": ({"factor": 0.5}, "rad", [0.5, 1.0, 1.5]),
    "factor and unit": ({"factor": 0.5, "unit": "rad"}, "", np.degrees([0.5, 1.0, 1.5])),
    "counts": ({"factor": 0.5, "zero": 2}, "", [-0.5, 0.0, 0.5]),
    "zero in the unit of the file": ({"zero": 2}, "rad", np.degrees([-1.0, 0.0, 1.0])),
    "sign and offset": ({"factor": 1.0, "sign": -1, "offset": 90.0}, "", [89.0, 88.0, 87.0]),
    "points": ({"points": ((1, -30.0), (2, 0.0), (4, 40.0))}, "us", [-30.0, 0.0, 20.0]),
    "wrap": ({"unit": "deg", "offset": -2.0, "wrap": True}, "", [359.0, 0.0, 1.0]),
}


@pytest.mark.parametrize(("rule", "unit", "values"), RULES.values(), ids=RULES)
def test_rules(rule, unit, values):
    result = converted(log(a=(T, [1.0, 2.0, 3.0], unit)), heading_deg={"signal": "a"} | rule)
    np.testing.assert_allclose(result.columns["heading_deg"], values, atol=1e-12)
    np.testing.assert_array_equal(result.times, [0.0, 1.0, 2.0])
    assert result.zero == 10.0


def test_a_wrap_is_a_turn_in_the_unit_of_the_column():
    result = converted(log(a=(T, [-0.1, 1.0, 7.0], "rad")), heading_rad={"signal": "a", "wrap": True})
    np.testing.assert_allclose(result.columns["heading_rad"], [2 * np.pi - 0.1, 1.0, 7.0 - 2 * np.pi])


def test_a_column_without_a_unit_needs_a_rule():
    with refused("missing", "columns.x_m.unit"):
        converted(log(a=(T, T)), x_m={"signal": "a"})
    with refused("unit", "columns.x_m.unit"):
        converted(log(a=(T, T, "rad")), x_m={"signal": "a"})


def test_a_pressure_may_stay_a_pressure(tmp_path):
    """Its depth is that of the water of the vehicle, where the log is read."""
    source = log(p=(T, [1100.0, 1200.0, 1300.0], "hPa"))
    result = converted(source, pressure_dbar={"signal": "p", "zero": 1013.25})
    np.testing.assert_allclose(result.columns["pressure_dbar"], [0.8675, 1.8675, 2.8675])
    result.save(tmp_path / "log.csv")
    np.testing.assert_allclose(log_files.read_log(tmp_path / "log.csv")["depth"], [0.8627, 1.8572, 2.8517], atol=1e-3)


def test_counts_may_stay_counts():
    """The vehicle file says what they are."""
    result = converted(log(a=(T, [2040.0, 2050.0, 2060.0])), fin_1_counts={"signal": "a"})
    np.testing.assert_array_equal(result.columns["fin_1_counts"], [2040.0, 2050.0, 2060.0])


def test_each_reading_keeps_its_time():
    """Two rates and a late clock make rows of their own, with blank cells where there is no reading."""
    source = log(a=([10.0, 11.0, 12.0], T, "m"), b=([10.5, 11.5], [1.0, 2.0], "m"))
    result = converted(source, x_m={"signal": "a"}, y_m={"signal": "b", "delay_s": 0.2})
    np.testing.assert_allclose(result.times, [0.0, 0.3, 1.0, 1.3, 2.0])
    np.testing.assert_array_equal(np.isnan(result.columns["y_m"]), [True, False, True, False, True])


def test_an_order_is_held_until_the_next():
    """Twice a second at least, with a last cell just before the new value: a straight line between cells is a step."""
    source = log(order=([10.0, 12.0], [0.0, 20.0], "deg"), x=(np.arange(10.0, 15.0), np.arange(5.0), "m"))
    result = converted(source, rudder_deg={"signal": "order", "held": True}, x_m={"signal": "x"})
    times, values = cells(result, "rudder_deg")
    np.testing.assert_allclose(times, [0.0, 0.5, 1.0, 1.5, 1.999, 2.0, 2.5, 3.0, 3.5, 4.0])
    np.testing.assert_array_equal(values, [0.0] * 5 + [20.0] * 5)
    joined = converted(source, rudder_deg={"signal": "order"}, x_m={"signal": "x"})
    np.testing.assert_allclose(cells(joined, "rudder_deg")[0], [0.0, 2.0])


def test_start_end_and_zero():
    source = log(order=([0.0], [5.0], "deg"), x=(np.arange(10.0), np.arange(10.0), "m"))
    time = {"zero": 2.0, "start_s": 1.0, "end_s": 4.0}
    result = converted(source, time, rudder_deg={"signal": "order", "held": True}, x_m={"signal": "x"})
    np.testing.assert_array_equal(result.times, [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0])
    np.testing.assert_array_equal(cells(result, "x_m")[1], [3.0, 4.0, 5.0, 6.0])
    np.testing.assert_array_equal(result.columns["rudder_deg"], 5.0)  # the order that was given before the start
    with refused("data", "time"):
        converted(source, {"start_s": 20.0}, x_m={"signal": "x"})


def test_readings_that_are_none_are_left_out_and_counted():
    source = log(a=(np.arange(6.0), [1.0, np.nan, -999.0, 2.0, np.inf, 3.0], "m"))
    result = converted(source, x_m={"signal": "a", "valid": (-10.0, 10.0)})
    np.testing.assert_array_equal(result.columns["x_m"], [1.0, 2.0, 3.0])
    assert result.remarks == (
        "x_m: 2 of 6 values of 'a' are not numbers and left out",
        "x_m: 1 of 6 values of 'a' are not valid and left out",
    )
    with refused("data", "columns.x_m"):
        converted(source, x_m={"signal": "a", "valid": (50.0, 60.0)})


@pytest.mark.parametrize("mark", [-9999.0, 999.9, 65535.0, -32768.0, 1e38, 9.96921e36, 0.0])
def test_numbers_that_stand_for_no_reading_are_proposed_and_left_out(mark):
    times = 0.1 * np.arange(200)
    values = 10.0 + 0.5 * times + 0.01 * np.sin(7.0 * times)
    values[[7, 50, 51, 90]] = mark
    source = log(a=(times, values, "deg"))
    (remark,) = converted(source, heading_deg={"signal": "a"}).remarks
    assert f"missing = [{mark:.12g}] under [columns.heading_deg]" in remark
    result = converted(source, heading_deg={"signal": "a", "missing": (mark,)})
    assert np.isfinite(result.columns["heading_deg"]).sum() == 196
    assert result.remarks == ("heading_deg: 4 of 200 values of 'a' are not valid and left out",)


def test_one_reading_in_an_interval():
    source = log(a=(np.arange(0.0, 10.0, 0.1), np.arange(100.0), "m"))
    result = converted(source, x_m={"signal": "a", "interval_s": 3.0})
    np.testing.assert_allclose(result.times, [0.0, 3.0, 6.0, 9.0])


def test_the_mean_of_an_interval_has_the_noise_of_one_reading_over_the_root_of_their_number(rng):
    """At the mean of their times, so that a straight line stays one; a heading is averaged across north."""
    times, noise = 1.79e9 + 0.01 * np.arange(40_000), rng.normal(0.0, 0.5, 40_000)
    for start, rule, tolerance in ((20.0, {}, 1e-9), (355.0, {"wrap": True}, 1e-9)):
        values = start + 0.02 * (times - times[0])
        for added, sd in ((0.0, 0.0), (noise, 0.05)):
            source = log(a=(times, np.mod(values + added, 360.0) if rule else values + added, "deg"))
            result = converted(source, heading_deg={"signal": "a", "interval_s": 1.0, "average": True} | rule)
            assert len(result.times) == 400
            off = result.columns["heading_deg"] - start - 0.02 * result.times
            off = (off + 180.0) % 360.0 - 180.0
            np.testing.assert_allclose(off - np.mean(off), 0.0, atol=5.0 * sd + 1e-6)
            assert np.std(off) == pytest.approx(sd, rel=0.2, abs=tolerance * 1e3)
        assert "a cell is the mean of 100 readings, whose independent noise is 0.1 times" in result.remarks[0]


def test_stamps_that_repeat_or_overtake_one_another_are_mended_and_counted():
    result = converted(log(a=([0.0, 2.0, 1.5, 1.5, 3.0], np.arange(5.0), "m")), x_m={"signal": "a"})
    np.testing.assert_array_equal(result.times, [0.0, 1.5, 2.0, 3.0])
    np.testing.assert_array_equal(result.columns["x_m"], [0.0, 2.0, 1.0, 4.0])
    assert len(result.remarks) == 2
    with refused("data", "a"):
        converted(log(a=([0.0, 100.0, 3.0], T, "m")), x_m={"signal": "a"})


def test_rows_from_the_newest_to_the_oldest_are_turned_round():
    result = converted(log(a=([20.0, 15.0, 5.0, 5.0, 0.0], np.arange(5.0), "m")), x_m={"signal": "a"})
    np.testing.assert_array_equal(result.times, [0.0, 5.0, 15.0, 20.0])
    np.testing.assert_array_equal(result.columns["x_m"], [4.0, 3.0, 1.0, 0.0])
    assert "fall from row to row" in result.remarks[0]


CLOCKS = {"200 s": (np.arange(0.0, 900.0, 0.5) % 200.0, 200.0)}
CLOCKS["32 bits of us"] = np.arange(4290.0, 4310.0) % 4294.967296, 4294.967296


@pytest.mark.parametrize(("times", "period"), CLOCKS.values(), ids=CLOCKS)
def test_a_clock_that_wraps_is_told_from_one_that_was_set(times, period):
    with refused("data", "a") as error:
        converted(log(a=(times, times, "m")), x_m={"signal": "a"})
    assert f"wraps_every_s = {period:.12g}" in str(error.value).replace(".0 ", " ")


def test_rows_without_order_are_to_be_sorted(rng):
    with refused("data", "x") as error:
        converted(log(x=(rng.permutation(100.0 * np.arange(50.0)), np.arange(50.0), "m")), x_m={"signal": "x"})
    assert "sort them by time" in str(error.value)


def test_what_tells_runs_apart_is_said_before_a_clock_that_wraps():
    """Runs of the same length begin again as often as a clock that wraps would."""
    times = np.tile(np.arange(100.0), 3)
    source = log(x=(times, np.arange(300.0), "m"))
    with refused("data", "x") as error:
        converted(source, x_m={"signal": "x"})
    assert "wraps_every_s = 100 " in str(error.value)
    line = "'name' tells 3 boats or runs apart; where = { name = \"a\" } in the map keeps those of one"
    with refused("data", "x") as error:
        converted(VehicleLog(source.path, source.signals, (line,)), x_m={"signal": "x"})
    assert line in str(error.value)
    assert "wraps" not in str(error.value)


@pytest.mark.parametrize("value", [0.0, -1.0, 6999.0])
def test_one_stretch_without_readings_is_seen_if_no_other_number_repeats(value, rng):
    times = np.arange(300.0)
    depth = 5.0 + 0.5 * np.sin(times / 20.0) + 0.01 * rng.standard_normal(300)
    depth[50:60] = value
    missing = converted(log(x=(times, depth, "m")), depth_m={"signal": "x"}).remarks
    assert f"{value:g} stands for no reading in 10 of 300" in " ".join(missing)
    coarse = np.round(depth, 2)  # whose other numbers repeat too
    repeated = converted(log(x=(times, coarse, "m")), depth_m={"signal": "x"}).remarks
    assert not [remark for remark in repeated if "stands for" in remark]


def test_a_stamp_years_after_the_others_can_be_cut_off():
    """As a damaged message has it, whose row would come after millions of an order that is held."""
    source = log(a=([0.0, 1.0, 1e12], T, "m"), n=([0.0], [900.0], "rpm"))
    columns = {"x_m": {"signal": "a"}, "rpm": {"signal": "n", "held": True}}
    with refused("data", "time"):
        converted(source, **columns)
    assert converted(source, {"end_s": 10.0}, **columns).times[-1] == 1.0


def test_columns_without_a_time_in_common():
    source = log(a=([0.0, 1.0], [0.0, 1.0], "m"), b=([50.0, 51.0], [0.0, 1.0], "m"))
    with refused("conflict", "y_m"):
        converted(source, x_m={"signal": "a"}, y_m={"signal": "b"})


def test_unknown_signals():
    source = log(roll=(T, T, "deg"), pitch=(T, T, "deg"))
    with refused("unknown", "columns.roll_deg.signal"):
        converted(source, roll_deg={"signal": "rol"})
    with refused("unknown", "columns.roll_deg.signal"):
        converted(source, roll_deg={"signal": "xyz"})
    result = converted(source, roll_deg={"signal": "roll"}, yaw_deg={"signal": "yaw", "optional": True})
    assert list(result.columns) == ["roll_deg"]


def test_points_do_not_reach_beyond_their_ends():
    with refused("conflict", "columns.rudder_deg.points"):
        converted(log(a=(T, T, "us")), rudder_deg={"signal": "a", "points": ((0.0, 0.0), (11.0, 5.0))})


def test_rows_are_the_same_part_by_part(tmp_path, monkeypatch, rng):
    """And so is the file, however many rows are written at a time."""
    times = np.cumsum(rng.uniform(0.01, 2.0, 200))
    orders = np.repeat(rng.uniform(-10.0, 10.0, 20), 10)
    sparse = np.where(rng.random(200) < 0.3, rng.standard_normal(200), np.nan)
    source = log(fin=(times - 0.3, orders, "deg"), x=(times[3:-9], sparse[3:-9], "m"), t=(times, times % 7.0, "rad"))
    columns = {"rudder_deg": {"signal": "fin", "held": True}, "x_m": {"signal": "x"}, "pitch_rad": {"signal": "t"}}
    result = converted(source, **columns)
    for n in (1, 7, 300):
        for name, whole in result.columns.items():
            parts = [result.cells(name, slice(k, k + n)) for k in range(0, len(result.times), n)]
            np.testing.assert_array_equal(np.concatenate(parts), whole)
        monkeypatch.setattr("bayesub.logs.log_files.CHUNK", n)
        result.save(tmp_path / f"{n}.csv")
    assert (tmp_path / "1.csv").read_bytes() == (tmp_path / "7.csv").read_bytes() == (tmp_path / "300.csv").read_bytes()
    x, orders_there = (result.columns[name] for name in ("x_m", "rudder_deg"))
    assert np.isfinite(x).sum() == np.isfinite(sparse[3:-9]).sum()
    assert np.isfinite(orders_there[result.times >= 0.0]).all()


def test_what_is_written_is_read_back(tmp_path):
    """Times of 1970 lose nothing; angles and places keep their digits."""
    start = 1.79e9
    source = log(a=(start + 0.1 * np.arange(100), np.linspace(0.0, 1.0, 100), "rad"))
    result = converted(source, yaw_deg={"signal": "a"}, fin_1_deg={"signal": "a"})
    result.save(tmp_path / "log.csv")
    back = log_files.read_log(tmp_path / "log.csv", ["fin_1_deg"])
    np.testing.assert_allclose(back["time"], 0.1 * np.arange(100), atol=1e-6)
    np.testing.assert_allclose(back["psi"], np.linspace(0.0, 1.0, 100), atol=1e-11)
    np.testing.assert_allclose(back["fin_1_deg"], back["psi"])


WRONG_MAPS = {
    "[columns.x_m]\nsignal = 'a'\nfactr = 1": ("unknown", "columns.x_m.factr"),
    "[columns.x_m]": ("missing", "columns.x_m.signal"),
    "[columns.rudder]\nsignal = 'a'": ("unknown", "columns.rudder"),
    "[columns.yaw_deg]\nsignal = 'a'\n[columns.yaw_rad]\nsignal = 'a'": ("conflict", "columns.yaw_rad"),
    "[columns.time_s]\nsignal = 'a'": ("unknown", "columns.time_s"),
    "[columns.x_m]\nsignal = 'a'\nunit = 'furlong'": ("unit", "columns.x_m.unit"),
    "[columns.x_m]\nsignal = 'a'\nfactor = 0": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\nsign = 2": ("value", "columns.x_m.sign"),
    "[columns.x_m]\nsignal = 'a'\npoints = [[1, 2]]": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\npoints = [[2, 2], [1, 3]]": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\npoints = [[1, 2], [2, 3]]\nfactor = 2": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\nvalid = [2, 1]": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\ninterval_s = -1": ("value", "columns.x_m.interval_s"),
    "[columns.x_m]\nsignal = 'a'\nwrap = true": ("conflict", "columns.x_m.wrap"),
    "[time]\nunit = 'fortnight'\n[columns.x_m]\nsignal = 'a'": ("unit", "time.unit"),
    "[time]\nstart_s = 2\nend_s = 1\n[columns.x_m]\nsignal = 'a'": ("value", "time"),
    "[time]\nzero = 'last'\n[columns.x_m]\nsignal = 'a'": ("value", "time.zero.float"),
    "kind = 'imc'\n[columns.x_m]\nsignal = 'a'": ("conflict", "kind"),
    "": ("missing", "columns"),
    "[columns": ("format", ""),
    "[columns.x_m]\nsignal = 'a'\naverage = true": ("value", "columns.x_m"),
    "[columns.x_m]\nsignal = 'a'\naverage = true\ninterval_s = 1\nheld = true": ("value", "columns.x_m"),
}


@pytest.mark.parametrize(("text", "code"), WRONG_MAPS.items())
def test_a_map_that_is_wrong(text, code, tmp_path):
    (tmp_path / "map.toml").write_text(text)
    with refused(*code) as error:
        read_map(tmp_path / "map.toml", "csv")
    assert str(error.value).startswith(str(tmp_path / "map.toml"))


@pytest.mark.parametrize("kind", KINDS)
def test_the_example_maps_are_for_their_kinds(kind):
    assert read_map(toml_files.built_in("maps")[kind], kind).kind == kind
