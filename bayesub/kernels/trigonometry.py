"""Sine and cosine of lanes, without a call of a library."""

import math
from functools import singledispatch

from bayesub.kernels.lanes import choose

# pi/2 in two parts; the first has 20 trailing zero bits, so that its multiples up to 2^20 are exact (Cody & Waite).
_HALF_PI_HIGH = 1.57079632673412561417e00
_HALF_PI_LOW = 6.07710050650619224932e-11
_TWO_OVER_PI = 2.0 / math.pi
_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest integer
_S3, _S5, _S7, _S9 = -1 / 6, 1 / 120, -1 / 5040, 1 / 362880
_S11, _S13, _S15 = -1 / 39916800, 1 / 6227020800, -1 / 1307674368000
_C2, _C4, _C6, _C8 = -1 / 2, 1 / 24, -1 / 720, 1 / 40320
_C10, _C12, _C14, _C16 = -1 / 3628800, 1 / 479001600, -1 / 87178291200, 1 / 20922789888000


@singledispatch
def sine_cosine(angle):
    """Sine and cosine of `angle` (rad): Taylor series on [-pi/4, pi/4], to 2e-16 while abs(angle) < 1e6."""
    turns = (angle * _TWO_OVER_PI + _ROUND) - _ROUND
    x = (angle - turns * _HALF_PI_HIGH) - turns * _HALF_PI_LOW
    x2 = x * x
    s = x + x * x2 * (_S3 + x2 * (_S5 + x2 * (_S7 + x2 * (_S9 + x2 * (_S11 + x2 * (_S13 + x2 * _S15))))))
    c = 1.0 + x2 * (_C2 + x2 * (_C4 + x2 * (_C6 + x2 * (_C8 + x2 * (_C10 + x2 * (_C12 + x2 * (_C14 + x2 * _C16)))))))
    half = turns * 0.5
    odd = half != (half + _ROUND) - _ROUND  # an odd number of quarter turns swaps sine and cosine
    pair = turns - 4.0 * ((turns * 0.25 + _ROUND) - _ROUND)  # quarter turns in -2 .. 2
    sine, cosine = choose(odd, (c, s), (s, c))
    sine = choose((pair > 1.5) | (pair < -0.5), -sine, sine)
    cosine = choose((pair > 0.5) | (pair < -1.5), -cosine, cosine)
    return sine, cosine
