"""Messages for users."""

import time

from bayesub.io.errors import nearest


def test_suggestions():
    assert nearest("Yuvv", ["Yuv", "Nuv"]) == ": did you mean 'Yuv'?"
    assert nearest("rudder", ["Yuv", "Nuv"]) == ""
    assert nearest("RPM", ["rpm", "time"]) == ": did you mean 'rpm'?"
    assert nearest("vv", ["v", "V"]) == ": did you mean 'v'?"
    assert nearest("yuV", ["Yuv", "yUv"]) == ": did you mean 'yUv'?"  # the case counts where it can


def test_a_name_of_millions_of_characters_is_not_compared():
    """It comes of a broken file, and would take seconds for each key that it might have been."""
    began = time.perf_counter()
    assert nearest("xyz" * 10**6, ["Yuv", "xyz" * 10]) == ""
    assert time.perf_counter() - began < 0.2
