"""Numbers and units in sentences, tables and figures."""

import numpy as np
import pytest

from bayesub.io.words import measured, powers, uncertain


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (1.2345, 0.012, "1.234 ± 0.012"),
        (-0.001, 9.1e-7, "-0.00100000 ± 0.00000091"),
        (321.0, 45.0, "321 ± 45"),
        (2.0, 0.0, "2"),
        (123456.0, 1234.0, "123500 ± 1200"),
        (-8.9123e9, 1.53e9, "(-8.9 ± 1.5) × 10⁹"),
        (2e4, 1.5e6, "(0.0 ± 1.5) × 10⁶"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (-0.0004, 0.12, "0.00 ± 0.12"),
        (-2.5e-11, 3.1e-13, "-2.500e-11 ± 3.1e-13"),
        (0.0, 0.12, "0 ± 0.12"),
        (1.5, np.inf, "1.5 ± inf"),
    ],
)
def test_two_digits_of_what_is_not_known(value, sd, text):
    assert uncertain(value, sd) == text


def test_units_and_factors_are_written_as_in_print():
    assert powers("kg m^2/s") == "kg m²/s"
    assert powers("(rho/2) l^3 U^-1") == "(ρ/2) l³ U⁻¹"


def test_a_value_is_told_with_the_unit_of_its_column():
    assert measured("roll_deg", 30.0) == "roll 30 deg"
    assert measured("min_rpm_percent", 50.0) == "min rpm 50 %"
    assert measured("u_ground_mps", "sd 0.005") == "u ground sd 0.005 m/s"
    assert measured("share_of_draws", 0.0) == "share of draws 0"
