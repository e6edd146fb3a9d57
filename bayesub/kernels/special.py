"""Exponential, logarithm of a product and Mills ratio without library calls, so that loops can be vectorised."""

import math

import numpy as np

from bayesub.kernels.jit import inline

_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding it rounds to an integer, which then stands in the lowest bits
_LOG2_E = 1.0 / math.log(2.0)
LOG_2 = math.log(2.0)
# log 2 in two parts; the first has 32 trailing zero bits, so that its multiples up to 2^32 are exact (Cody & Waite).
_LOG_2_HIGH = 6.93147180369123816490e-01
_LOG_2_LOW = 1.90821492927058770002e-10
_E2, _E3, _E4, _E5, _E6, _E7 = 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040
_E8, _E9, _E10, _E11, _E12 = 1 / 40320, 1 / 362880, 1 / 3628800, 1 / 39916800, 1 / 479001600
_EXPONENT_BIAS = 1023
_LOWEST_POWER = -708.0  # exp of anything less is not a normal number and is set to zero


@inline
def exponential(x):
    """exp(x) for x <= 0, to 3e-16; zero below -708."""
    shifted = x * _LOG2_E + _ROUND
    k = shifted - _ROUND
    r = (x - k * _LOG_2_HIGH) - k * _LOG_2_LOW
    # Taylor series on [-log(2)/2, log(2)/2], times 2^k
    value = _E7 + r * (_E8 + r * (_E9 + r * (_E10 + r * (_E11 + r * _E12))))
    value = 1.0 + r * (1.0 + r * (_E2 + r * (_E3 + r * (_E4 + r * (_E5 + r * (_E6 + r * value))))))
    power = np.int64((np.float64(shifted).view(np.int64) << 52) + (_EXPONENT_BIAS << 52)).view(np.float64)
    return 0.0 if x < _LOWEST_POWER else value * power


@inline
def split(x):
    """Mantissa in [1, 2) and binary exponent of a positive number; not a number stays so in the mantissa.

    The logarithm of a long product is that of the product of the mantissas and log 2 times the sum of the exponents.
    """
    biased = np.float64(x).view(np.int64) >> 52
    return x * np.int64((2 * _EXPONENT_BIAS - biased) << 52).view(np.float64), biased - _EXPONENT_BIAS


_R0, _R1, _R2 = 1.8932190633084853, -1.523770910819985, 0.9704095548676177
_R3, _R4, _R5 = -0.46754096299818737, 0.1513917623110474, -0.018900450865484503
_R6, _R7, _R8 = -0.008722295248200037, 0.0040878557264789955, 0.0003342443649391365
_R9, _R10, _R11 = -0.0005792696065073663, -4.781834677436329e-06, 8.809696060211897e-05
_R12, _R13, _R14 = 1.7912419621396938e-06, -1.4846493010422612e-05, -1.5665301434775512e-06
_R15, _R16, _R17 = 2.5742673078165543e-06, 6.635890483495518e-07, -4.0665439602468896e-07
_R18, _R19, _R20 = -1.974812079272745e-07, 4.9053735092410555e-08, 4.027496644667924e-08
_R21, _R22 = -3.2015537235375595e-09, -4.232837128668023e-09


@inline
def mills_ratio(x):
    """(1 - Phi(x)) / phi(x) of the standard normal for x >= 0, to 1e-15 relative.

    (x + 4) times it is smooth on the half line and a Chebyshev series in t = (x - 4) / (x + 4), after Shepherd &
    Laframboise (Mathematics of Computation 36, 1981, 249-253), written here in powers of t.
    """
    inverse = 1.0 / (x + 4.0)
    t = 1.0 - 8.0 * inverse
    value = _R17 + t * (_R18 + t * (_R19 + t * (_R20 + t * (_R21 + t * _R22))))
    value = _R11 + t * (_R12 + t * (_R13 + t * (_R14 + t * (_R15 + t * (_R16 + t * value)))))
    value = _R5 + t * (_R6 + t * (_R7 + t * (_R8 + t * (_R9 + t * (_R10 + t * value)))))
    return inverse * (_R0 + t * (_R1 + t * (_R2 + t * (_R3 + t * (_R4 + t * value)))))
