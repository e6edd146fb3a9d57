"""Units of vehicles' logs: sizes, spellings, and what cannot become what."""

import math

import pytest
from support.refusals import refused

from bayesub.io import units
from bayesub.logs import log_files

SIZES = [
    ("rad", "deg", 180.0 / math.pi),
    ("degE7", "deg", 1e-7),
    ("kn", "m/s", 1852.0 / 3600.0),
    ("kN", "N", 1000.0),
    ("KNOTS", "m/s", 1852.0 / 3600.0),
    ("°/s", "deg/s", 1.0),
    ("Hz", "rpm", 60.0),
    ("us", "s", 1e-6),
    (" m / s ", "m/s", 1.0),
    ("mg", "m/s2", 9.80665e-3),
    ("cc", "cm3", 1.0),
    ("N m", "Nm", 1.0),
    ("nmi", "m", 1852.0),
]


@pytest.mark.parametrize(("unit", "target", "size"), SIZES)
def test_sizes_and_spellings(unit, target, size):
    assert units.factor(unit, target) == pytest.approx(size, rel=1e-14)


def test_a_pressure_becomes_a_depth_with_a_density():
    assert units.factor("dbar", "m", 1025.0) == pytest.approx(1e4 / (1025.0 * 9.81))
    with refused("missing", "water_density_kgm3"):
        units.factor("bar", "m")


def test_what_does_not_fit_is_said():
    with refused("unit", "unit"):
        units.factor("rad", "m")
    with refused("unit", "unit"):
        units.factor("degs", "deg")


def test_every_column_of_a_log_has_its_unit():
    """And the same size as where logs are read."""
    for column in (*log_files.COLUMNS, *log_files.PRESSURES, *log_files.FIXES):
        unit = units.of_column(column)
        assert units.known(unit), column
        if "_deg" in column:
            assert units.factor(unit, unit.replace("deg", "rad")) == pytest.approx(log_files.si_factor(column))
    assert [units.of_column(name) for name in ("fin_1_deg", "port_rpm", "bow_thruster_n", "x")] == [
        "deg",
        "rpm",
        "N",
        "",
    ]
