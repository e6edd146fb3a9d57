"""Sine and cosine of the kernels."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.lane_functions import mapped

from bayesub.kernels.lanes import sine_cosine


def interpreted(angles):
    return np.stack(sine_cosine(angles), axis=1)


@pytest.fixture(scope="module")
def compiled():
    """Sine and cosine (n, 2) of angles (n,) as they are computed in lanes."""
    return interpreted if numba.config.DISABLE_JIT else mapped(sine_cosine, "sine_cosine")


@pytest.fixture(scope="module")
def angles():
    """Every quadrant, multiples of pi/4 and their neighbours, and far turns of both signs."""
    rng = np.random.default_rng(1)
    multiples = np.arange(-4000, 4001) * (np.pi / 4)
    return np.concatenate(
        [
            multiples,
            np.nextafter(multiples, np.inf),
            np.nextafter(multiples, -np.inf),
            rng.uniform(-np.pi, np.pi, 20_000),
            rng.uniform(-1e4, 1e4, 20_000),
            rng.standard_normal(1000) * 1e-8,
            [0.0, -0.0],
        ]
    )


def reference(angles):
    return np.stack([np.sin(angles), np.cos(angles)], axis=1)


def test_equal_numpy(compiled, angles):
    """Both agree with the library within 4e-16, two units in the last place of numbers near one, in every quadrant."""
    np.testing.assert_allclose(compiled(angles), reference(angles), rtol=0, atol=4e-16)


def test_numpy_and_machine_code_agree(compiled, angles):
    """They differ by contracted products only."""
    np.testing.assert_allclose(interpreted(angles), compiled(angles), rtol=0, atol=4e-16)


def test_mirror_symmetry_is_exact(compiled, angles):
    """sin is odd and cos is even to the last bit, so that mirrored motions stay mirrored."""
    np.testing.assert_array_equal(compiled(-angles), compiled(angles) * [-1, 1])


def test_sine_keeps_small_angles(compiled):
    """sin x = x to full relative precision for tiny angles."""
    tiny = 10.0 ** np.arange(-300.0, -9.0)
    np.testing.assert_allclose(compiled(tiny)[:, 0], tiny, rtol=2.3e-16)


@settings(deadline=None, max_examples=200)
@given(st.floats(-1e4, 1e4))
def test_lies_on_the_unit_circle(compiled, angle):
    """sin^2 + cos^2 = 1."""
    sine, cosine = compiled(np.array([angle]))[0]
    assert abs(sine * sine + cosine * cosine - 1.0) < 1e-15  # twice the error of each
