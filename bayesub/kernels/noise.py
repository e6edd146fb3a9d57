"""Predicted readings and their log densities, a member of the batch at a time.

Sums run in COLUMNS columns side by side, reading i in column i modulo COLUMNS, so that they are vectorised and do not
depend on the batch or on the number of threads.

A rounded reading is the interval of half-width d around it, both in units of the noise sd. With c the distance of the
prediction from the reading, a = c - d and b = c + d the distances of the two ends, and R the Mills ratio, the
probability of the interval is

    phi(a) [R(a) - exp(-2cd) R(b)]                          a > 0: the prediction is outside
    1 - phi(a) [R(-a) + exp(-2cd) R(b)]                     a <= 0: inside
    2d phi(c) S,  S = sum_j e_j (cd)^2j,                    cd <= 1 and d <= 1, where the others lose digits
                  e_j = 1/(2j)! int_0^1 s^2j exp(-d^2 s^2 / 2) ds
"""

import math

import numpy as np
from numba import prange

from bayesub.kernels.jit import batched, distinct_arrays, inline, widest_vectors

COLUMNS = 64
_LOG_ROOT_2_PI = 0.5 * math.log(2.0 * math.pi)
_ROOT_2_PI = math.sqrt(2.0 * math.pi)
_N_SERIES = 9  # the first term left out is (cd)^18 / 19! < 1e-17
_N_BACKWARD = 12  # steps of the recursion of e_j from zero; each divides its error by more than 2j / d^2
_FAR = 1e4  # at larger a the information is one to 1/a^2, and its formula loses a^2 roundings


# Exponential, logarithm of a product and Mills ratio without library calls, so that loops can be vectorised.
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


@inline
def _sum(column_sums):
    total = 0.0
    for column in column_sums:
        total += column
    return total


@inline
def _log_of_product(mantissas, exponents):
    """Logarithm of the product over columns; COLUMNS mantissas below two cannot overflow."""
    product, exponent = 1.0, 0
    for i in range(COLUMNS):
        product *= mantissas[i]
        exponent += exponents[i]
    return math.log(product) + LOG_2 * exponent


@inline
def _add_squares(squares, predicted, readings):
    distinct_arrays()
    for first in range(0, len(readings), COLUMNS):
        for i in range(min(COLUMNS, len(readings) - first)):
            residual = predicted[first + i] - readings[first + i]
            squares[i] += residual * residual


@batched
def sums_of_squares(predicted, readings):
    """(n_batch,) sums of (predicted - reading)^2 of predicted (n_batch, n) and readings (n,)."""
    result = np.empty(len(predicted))
    for member in prange(len(predicted)):
        widest_vectors()
        squares = np.zeros(COLUMNS)
        _add_squares(squares, predicted[member], readings)
        result[member] = _sum(squares)
    return result


@inline
def _multiply_t(mantissas, exponents, predicted, readings, factor):
    distinct_arrays()
    for first in range(0, len(readings), COLUMNS):
        for i in range(min(COLUMNS, len(readings) - first)):
            residual = predicted[first + i] - readings[first + i]
            mantissa, exponent = split(mantissas[i] * (1.0 + factor * (residual * residual)))
            mantissas[i] = mantissa
            exponents[i] += exponent


@batched
def student_t_logarithms(predicted, readings, sds, dofs):
    """(n_batch,) sums of log(1 + z^2 / dof) with z = (predicted - reading) / sd; sds and dofs (n_batch,)."""
    result = np.empty(len(predicted))
    for member in prange(len(predicted)):
        widest_vectors()
        mantissas, exponents = np.ones(COLUMNS), np.zeros(COLUMNS, np.int64)
        _multiply_t(mantissas, exponents, predicted[member], readings, 1.0 / (dofs[member] * sds[member] ** 2))
        result[member] = _log_of_product(mantissas, exponents)
    return result


@inline
def _correlation(lag):
    """exp(-lag) and 1 - exp(-2 lag)."""
    rho = exponential(-lag)
    x = 2.0 * lag
    series = 1.0 - x / 2 * (1.0 - x / 3 * (1.0 - x / 4 * (1.0 - x / 5 * (1.0 - x / 6 * (1.0 - x / 7)))))
    return rho, x * series if x < 0.01 else 1.0 - rho * rho


@inline
def _add_innovations(squares, mantissas, exponents, predicted, readings, times, rate):
    distinct_arrays()
    for first in range(1, len(readings), COLUMNS):
        for i in range(min(COLUMNS, len(readings) - first)):
            now = first + i
            rho, variance = _correlation(rate * (times[now] - times[now - 1]))
            innovation = (predicted[now] - readings[now]) - rho * (predicted[now - 1] - readings[now - 1])
            squares[i] += innovation * innovation / variance
            mantissa, exponent = split(mantissas[i] * variance)
            mantissas[i] = mantissa
            exponents[i] += exponent


@batched
def autoregressive_sums(predicted, readings, times, correlation_times):
    """Sums over the readings of a first-order autoregressive process of unit sd, for correlation_times (n_batch,).

    Returns (n_batch, 2): squared innovations over their variances, and logarithms of those variances.
    """
    result = np.empty((len(predicted), 2))
    for member in prange(len(predicted)):
        widest_vectors()
        squares, mantissas, exponents = np.zeros(COLUMNS), np.ones(COLUMNS), np.zeros(COLUMNS, np.int64)
        rate = 1.0 / correlation_times[member]
        _add_innovations(squares, mantissas, exponents, predicted[member], readings, times, rate)
        result[member, 0] = (predicted[member, 0] - readings[0]) ** 2 + _sum(squares)
        result[member, 1] = _log_of_product(mantissas, exponents)
    return result


@inline
def _series(d):
    """(N_SERIES,) coefficients e_j of S."""
    q = 0.5 * d * d
    moment, coefficients = 0.0, np.empty(_N_SERIES)
    for j in range(_N_SERIES + _N_BACKWARD, -1, -1):
        # int s^2j exp(-q s^2) ds over [0, 1], by parts
        moment = (2.0 * q * moment + math.exp(-q)) / (2 * j + 1)
        if j < _N_SERIES:
            coefficients[j] = moment
    factorial = 1.0
    for j in range(1, _N_SERIES):
        factorial *= (2 * j - 1) * (2 * j)
        coefficients[j] /= factorial
    return coefficients


@inline
def _evaluate_series(e, y2):
    tail = e[4] + y2 * (e[5] + y2 * (e[6] + y2 * (e[7] + y2 * e[8])))
    return e[0] + y2 * (e[1] + y2 * (e[2] + y2 * (e[3] + y2 * tail)))


@inline
def _multiply_narrow(squares, mantissas, exponents, series, predicted, readings, half_step, inverse_sd):
    """Densities, which are the probabilities over 2d, of intervals with d <= 1."""
    distinct_arrays()
    d = half_step * inverse_sd
    inverse_width = 0.5 / d
    for first in range(0, len(readings), COLUMNS):
        for i in range(min(COLUMNS, len(readings) - first)):
            distance = abs(predicted[first + i] - readings[first + i])
            c = distance * inverse_sd
            a, b, y = (distance - half_step) * inverse_sd, (distance + half_step) * inverse_sd, c * d
            near = y <= 1.0
            outside = mills_ratio(abs(a)) - exponential(-2.0 * y) * mills_ratio(b)
            density = _evaluate_series(series, y * y) if near else outside * inverse_width
            squares[i] += c * c if near else a * a
            mantissa, exponent = split(mantissas[i] * density)
            mantissas[i] = mantissa
            exponents[i] += exponent


@inline
def _multiply_wide(squares, mantissas, exponents, predicted, readings, half_step, inverse_sd):
    """Probabilities times root 2 pi of intervals with d > 1."""
    distinct_arrays()
    d = half_step * inverse_sd
    for first in range(0, len(readings), COLUMNS):
        for i in range(min(COLUMNS, len(readings) - first)):
            distance = abs(predicted[first + i] - readings[first + i])
            a, b = (distance - half_step) * inverse_sd, (distance + half_step) * inverse_sd
            near_tail = mills_ratio(abs(a))
            far_tail = exponential(-2.0 * (distance * inverse_sd) * d) * mills_ratio(b)
            inside = _ROOT_2_PI - exponential(-0.5 * a * a) * (near_tail + far_tail)
            probability = near_tail - far_tail if a > 0.0 else inside
            squares[i] += a * a if a > 0.0 else 0.0
            mantissa, exponent = split(mantissas[i] * probability)
            mantissas[i] = mantissa
            exponents[i] += exponent


@batched
def rounded_log_probabilities(predicted, readings, half_step, sds):
    """(n_batch,) log probabilities that all readings (n,) are rounded to as they were, for noise sds (n_batch,)."""
    n = len(readings)
    result = np.empty(len(predicted))
    for member in prange(len(predicted)):
        widest_vectors()
        squares, mantissas, exponents = np.zeros(COLUMNS), np.ones(COLUMNS), np.zeros(COLUMNS, np.int64)
        inverse_sd = 1.0 / sds[member]
        d = half_step * inverse_sd
        constant = -n * _LOG_ROOT_2_PI
        if d <= 1.0:
            constant += n * math.log(2.0 * d)
            _multiply_narrow(
                squares, mantissas, exponents, _series(d), predicted[member], readings, half_step, inverse_sd
            )
        else:
            _multiply_wide(squares, mantissas, exponents, predicted[member], readings, half_step, inverse_sd)
        result[member] = constant - 0.5 * _sum(squares) + _log_of_product(mantissas, exponents)
    return result


@inline
def _narrow_slopes(c, d, edge, series):
    """Score and information of d <= 1 and cd <= 1; edge = exp(-d^2 / 2)."""
    y = c * d
    scale = edge / _evaluate_series(series, y * y)
    score = scale * math.sinh(y) / d
    return score, score * (score - c) + scale * math.cosh(y)


@inline
def _wide_slopes(a, b, y):
    """Score and information from the distances of the ends, with y = cd."""
    far = exponential(-2.0 * y)
    near_tail, far_tail = mills_ratio(abs(a)), far * mills_ratio(b)
    density = exponential(-0.5 * a * a)
    ratio = 1.0 / (near_tail - far_tail) if a > 0.0 else density / (_ROOT_2_PI - density * (near_tail + far_tail))
    score = (1.0 - far) * ratio
    return score, score * score + (b * far - a) * ratio


@batched
def rounded_slopes(predicted, readings, half_step, sds):
    """First and second derivatives (n_batch, n) of minus the log probability of each reading by predicted / sd.

    The second ones, the information, are between zero and one.
    """
    slopes, information = np.empty(predicted.shape), np.empty(predicted.shape)
    for member in prange(len(predicted)):
        widest_vectors()
        inverse_sd = 1.0 / sds[member]
        d = half_step * inverse_sd
        series, edge = _series(min(d, 1.0)), math.exp(-0.5 * d * d)
        for i in range(len(readings)):
            residual = predicted[member, i] - readings[i]
            distance = abs(residual)
            c, a, b = distance * inverse_sd, (distance - half_step) * inverse_sd, (distance + half_step) * inverse_sd
            if d <= 1.0 and c * d <= 1.0:
                score, curvature = _narrow_slopes(c, d, edge, series)
            else:
                score, curvature = _wide_slopes(a, b, c * d)
            curvature = min(max(curvature, 0.0), 1.0) if a < _FAR else 1.0
            slopes[member, i] = math.copysign(score, residual)
            information[member, i] = curvature if distance == distance else math.nan
    return slopes, information
