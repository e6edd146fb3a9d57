"""Classical fourth-order Runge-Kutta over a control history, blocks of lanes, with output at any times."""

import math

import numpy as np
from numba import prange

from bayesub.kernels.attitude import euler_angles, quaternion
from bayesub.kernels.jit import distinct_arrays, inline, jit, widest_vectors
from bayesub.kernels.workspace import (
    BODY_ROWS,
    COEFFICIENTS,
    INVERSE_MASS,
    LANES,
    N_BODY,
    N_STATES,
    OUTPUT,
    PREVIOUS,
    PREVIOUS_SLOPE,
    SLOPE,
    STAGE,
    STATE,
    STATE_ROWS,
    SUM,
)

from .attitude_form import QUATERNIONS
from .dynamics import euler_derivative, quaternion_derivative
from .hydrodynamics import N_COEFFICIENTS, N_CONSTANTS, N_CONTROLS
from .layout import CONSTANTS, CONTROLS, N_ROWS
from .mass import inverse, mass_matrix

OK, DIVERGED, LEFT_ENVELOPE = 0, 1, 2
MAX_PITCH = math.radians(85.0)


@jit
def workspace(n_rows):
    """Zeros for `n_rows` rows, each in a cache line of its own: vectors that straddle two take half as long again."""
    memory = np.zeros((n_rows + 1) * LANES)
    start = (-(memory.ctypes.data // memory.itemsize)) % LANES
    return memory[start : start + n_rows * LANES]


@jit
def load_block(work, first, coefficients, body, initial):
    """Fill the workspace with the members from `first` on, the last one repeated in lanes that have no member."""
    for i in range(LANES):
        member = min(first + i, coefficients.shape[0] - 1)
        for k in range(N_COEFFICIENTS):
            work[(COEFFICIENTS + k) * LANES + i] = coefficients[member, k]
        for k in range(N_BODY):
            work[(BODY_ROWS + k) * LANES + i] = body[member, k]
        for k in range(N_CONSTANTS):
            work[(CONSTANTS + k) * LANES + i] = body[member, N_BODY + k]
        for k in range(N_STATES):
            work[(STATE + k) * LANES + i] = initial[member, k]
        inverted = inverse(mass_matrix(coefficients[member], body[member]))
        for k in range(36):
            work[(INVERSE_MASS + k) * LANES + i] = inverted[k // 6, k % 6]


@inline
def copy_state(work, source, target):
    """Copy the state of all lanes from row `source` to row `target`."""
    for j in range(STATE_ROWS * LANES):
        work[target * LANES + j] = work[source * LANES + j]


@inline
def _advance(work, i, k, rate, weight, ahead):
    work[(SUM + k) * LANES + i] += weight * rate
    work[(STAGE + k) * LANES + i] = work[(STATE + k) * LANES + i] + ahead * rate


@jit
def _vary_controls(work, variations, n, part, amounts):
    """Let each lane add its `amounts` (n, LANES) of the variations at a part of step `n` to the controls."""
    for j in range(N_CONTROLS * LANES):
        work[CONTROLS * LANES + j] = 0.0
    for e in range(variations.starts[3 * n + part], variations.starts[3 * n + part + 1]):
        row, m, value = CONTROLS + variations.columns[e], variations.numbers[e], variations.values[e]
        for i in range(LANES):
            work[row * LANES + i] += amounts[m, i] * value


@jit
def stage(work, control, weight, ahead):
    """Add `weight` times the derivative at STAGE to SUM, then put STATE + `ahead` times it into STAGE."""
    distinct_arrays()
    widest_vectors()
    for i in range(LANES):
        # Twelve scalars and twelve calls: a loop over a tuple of rates would keep this loop from being vectorised.
        x, y, z, phi, theta, psi, u, v, w, p, q, r = euler_derivative(work, i, STAGE, control)
        _advance(work, i, 0, x, weight, ahead)
        _advance(work, i, 1, y, weight, ahead)
        _advance(work, i, 2, z, weight, ahead)
        _advance(work, i, 3, phi, weight, ahead)
        _advance(work, i, 4, theta, weight, ahead)
        _advance(work, i, 5, psi, weight, ahead)
        _advance(work, i, 6, u, weight, ahead)
        _advance(work, i, 7, v, weight, ahead)
        _advance(work, i, 8, w, weight, ahead)
        _advance(work, i, 9, p, weight, ahead)
        _advance(work, i, 10, q, weight, ahead)
        _advance(work, i, 11, r, weight, ahead)


@jit
def stage_quaternion(work, control, weight, ahead):
    """:func:`stage` for states with quaternions."""
    distinct_arrays()
    widest_vectors()
    for i in range(LANES):
        x, y, z, q1, q2, q3, u, v, w, p, q, r, q0 = quaternion_derivative(work, i, STAGE, control)
        _advance(work, i, 0, x, weight, ahead)
        _advance(work, i, 1, y, weight, ahead)
        _advance(work, i, 2, z, weight, ahead)
        _advance(work, i, 3, q1, weight, ahead)
        _advance(work, i, 4, q2, weight, ahead)
        _advance(work, i, 5, q3, weight, ahead)
        _advance(work, i, 6, u, weight, ahead)
        _advance(work, i, 7, v, weight, ahead)
        _advance(work, i, 8, w, weight, ahead)
        _advance(work, i, 9, p, weight, ahead)
        _advance(work, i, 10, q, weight, ahead)
        _advance(work, i, 11, r, weight, ahead)
        _advance(work, i, 12, q0, weight, ahead)


_stage = stage_quaternion if QUATERNIONS else stage


@inline
def _evaluate(work, stages, variations, amounts, n, part, weight, ahead):
    if amounts.shape[0]:
        _vary_controls(work, variations, n, part, amounts)
    _stage(work, stages[n, part], weight, ahead)


@jit
def _to_quaternions(work):
    """Replace the Euler angles of STATE by quaternions."""
    for i in range(LANES):
        row = STATE * LANES + i
        q0, q1, q2, q3 = quaternion(work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES])
        work[row + 12 * LANES], work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES] = q0, q1, q2, q3


@jit
def _normalise(work):
    """Bring the quaternions of STATE back to unit length."""
    for i in range(LANES):
        row = STATE * LANES + i
        q0, q1, q2, q3 = work[row + 12 * LANES], work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES]
        scale = 1.0 / math.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
        work[row + 12 * LANES] = q0 * scale
        work[row + 3 * LANES] = q1 * scale
        work[row + 4 * LANES] = q2 * scale
        work[row + 5 * LANES] = q3 * scale


@inline
def hermite(f, step):
    """Weights of value and slope at the start, and of value and slope at the end, of a step at its fraction `f`."""
    g = 1.0 - f
    return (1.0 + 2.0 * f) * g * g, f * g * g * step, f * f * (3.0 - 2.0 * f), -f * f * g * step


@inline
def hermite_rates(f, step):
    """:func:`hermite` for the derivative with respect to time; at the end of a step it is the slope there."""
    a = 6.0 * f * (f - 1.0) / step
    return a, (3.0 * f - 1.0) * (f - 1.0), -a, f * (3.0 * f - 2.0)


@inline
def _emit(work, states, first, members, output, fraction, step, rows):
    """Cubic Hermite interpolation at `fraction` of the last step into ``states[first:, output]``, in Euler angles.

    `rows` are those of the states and, from N_STATES on, accelerations that are wanted.
    """
    h00, h10, h01, h11 = hermite(fraction, step)
    for j in range(STATE_ROWS * LANES):
        work[OUTPUT * LANES + j] = (
            h00 * work[PREVIOUS * LANES + j]
            + h10 * work[PREVIOUS_SLOPE * LANES + j]
            + h01 * work[STATE * LANES + j]
            + h11 * work[SLOPE * LANES + j]
        )
    if QUATERNIONS:
        for i in range(members):
            vector = (OUTPUT + 3) * LANES + i
            angles = euler_angles(
                work[(OUTPUT + 12) * LANES + i], work[vector], work[vector + LANES], work[vector + 2 * LANES]
            )
            work[vector], work[vector + LANES], work[vector + 2 * LANES] = angles
    h00, h10, h01, h11 = hermite_rates(fraction, step)
    for i in range(members):
        column = states[first + i, output]
        for n in range(len(rows)):
            k = rows[n]
            if k < N_STATES:
                column[n] = work[(OUTPUT + k) * LANES + i]
            else:
                k -= 6  # the velocity whose rate it is
                column[n] = (
                    h00 * work[(PREVIOUS + k) * LANES + i]
                    + h10 * work[(PREVIOUS_SLOPE + k) * LANES + i]
                    + h01 * work[(STATE + k) * LANES + i]
                    + h11 * work[(SLOPE + k) * LANES + i]
                )


@inline
def _moving(work, i, max_speed2):
    """Whether lane `i` is slower than the root of `max_speed2` and its accelerations are finite."""
    row = STATE * LANES + i
    u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
    row = SLOPE * LANES + i
    rates = (  # not finite if one of the accelerations is not
        work[row + 6 * LANES] + work[row + 7 * LANES] + work[row + 8 * LANES]
        + work[row + 9 * LANES] + work[row + 10 * LANES] + work[row + 11 * LANES]
    )  # fmt: skip
    return (u * u + v * v + w * w < max_speed2) & (abs(rates) < math.inf)


@inline
def _level(work, i):
    """Whether the Euler angles of lane `i` are within their envelope; quaternions have none."""
    return QUATERNIONS | (abs(work[(STATE + 4) * LANES + i]) < MAX_PITCH)


@jit
def any_failed(work, max_speed2):
    """Whether any lane has left the envelope, is faster than the root of `max_speed2`, or has no finite rates."""
    widest_vectors()
    flying = 0
    for i in range(LANES):
        flying += 1 if _moving(work, i, max_speed2) & _level(work, i) else 0
    return flying < LANES


@inline
def _fate(work, i, max_speed2):
    """Status of lane `i`."""
    if not _moving(work, i, max_speed2):
        return DIVERGED
    return OK if _level(work, i) else LEFT_ENVELOPE


@jit
def _integrate_block(
    block,
    coefficients,
    body,
    initial,
    stages,
    variations,
    amounts,
    step,
    times,
    max_speed,
    rows,
    states,
    status,
):
    """Integrate one block of members and write their `states` at `times`; see :func:`integrate`."""
    first = block * LANES
    members = min(LANES, coefficients.shape[0] - first)
    work = workspace(N_ROWS)
    load_block(work, first, coefficients, body, initial)
    mine = np.empty((amounts.shape[1], LANES))
    for i in range(LANES):
        mine[:, i] = amounts[min(first + i, coefficients.shape[0] - 1)]
    if QUATERNIONS:
        _to_quaternions(work)
    n_steps = stages.shape[0] - 1
    n_times = times.shape[0]
    output = 0
    alive = members
    max_speed2 = max_speed * max_speed
    for step_index in range(n_steps + 1):
        work[SUM * LANES : (SUM + STATE_ROWS) * LANES] = 0.0
        copy_state(work, STATE, STAGE)
        _evaluate(work, stages, variations, mine, step_index, 0, 1.0, 0.5 * step)
        copy_state(work, SUM, SLOPE)

        if any_failed(work, max_speed2):
            for i in range(members):
                if status[first + i] == OK:
                    status[first + i] = _fate(work, i, max_speed2)
                    if status[first + i] != OK:
                        alive -= 1
                        states[first + i, output:, :] = np.nan  # its readings from here on are not a number
        if alive == 0:
            return

        now = step_index * step
        while output < n_times and (times[output] <= now or step_index == n_steps):
            fraction = 1.0 if step_index == 0 else 1.0 + (times[output] - now) / step
            _emit(work, states, first, members, output, fraction, step, rows)
            for i in range(members):
                if status[first + i] != OK:
                    states[first + i, output, :] = np.nan
            output += 1
        if output == n_times:
            return

        copy_state(work, STATE, PREVIOUS)
        copy_state(work, SLOPE, PREVIOUS_SLOPE)
        _evaluate(work, stages, variations, mine, step_index, 1, 2.0, 0.5 * step)
        _evaluate(work, stages, variations, mine, step_index, 1, 2.0, step)
        _evaluate(work, stages, variations, mine, step_index, 2, 1.0, 0.0)
        for j in range(STATE_ROWS * LANES):
            work[STATE * LANES + j] += step / 6.0 * work[SUM * LANES + j]
        if QUATERNIONS:
            _normalise(work)


@jit
def integrate(coefficients, body, initial, stages, variations, amounts, step, times, max_speed, rows):
    """Simulate a batch.

    Parameters
    ----------
    coefficients : (n_batch, n_terms) array
        Dimensional (N, m, kg, s).
    body : (n_batch, N_BODY + N_CONSTANTS) array
    initial : (n_batch, 12) array
        States at the start.
    stages : (n_steps + 1, 3, N_CONTROLS) array
        Controls at the start, middle and end of each step.
    variations : Variations
        Changes of the controls, n of them, of which each member has its own amounts.
    amounts : (n_batch, n) array
    step : float
        s.
    times : (n_times,) array
        Ascending output times from 0 to n_steps * step, s.
    max_speed : float
        A member that reaches this speed (m/s) has diverged.
    rows : (n_outputs,) array
        Which of the 12 states and, after them, the 6 accelerations (udot .. rdot) are wanted.

    Returns
    -------
    states : (n_batch, n_times, n_outputs) array
        Not a number from the failure of a member on.
    status : (n_batch,) array
        OK, DIVERGED or LEFT_ENVELOPE.
    """
    n_batch = coefficients.shape[0]
    states = np.empty((n_batch, times.shape[0], len(rows)))
    status = np.zeros(n_batch, dtype=np.int8)
    for block in range((n_batch + LANES - 1) // LANES):
        _integrate_block(
            block,
            coefficients,
            body,
            initial,
            stages,
            variations,
            amounts,
            step,
            times,
            max_speed,
            rows,
            states,
            status,
        )
    return states, status


@jit(parallel=True)
def integrate_parallel(coefficients, body, initial, stages, variations, amounts, step, times, max_speed, rows):
    """:func:`integrate` with the blocks shared among threads; bitwise the same."""
    n_batch = coefficients.shape[0]
    states = np.empty((n_batch, times.shape[0], len(rows)))
    status = np.zeros(n_batch, dtype=np.int8)
    for block in prange((n_batch + LANES - 1) // LANES):
        _integrate_block(
            np.int64(block),  # of the type that the serial kernel has, or all would be compiled twice
            coefficients,
            body,
            initial,
            stages,
            variations,
            amounts,
            step,
            times,
            max_speed,
            rows,
            states,
            status,
        )
    return states, status


@jit
def body_accelerations(coefficients, body, states, controls):
    """Accelerations of a batch along given states.

    Parameters
    ----------
    coefficients : (n_batch, n_terms) array
        Dimensional (N, m, kg, s).
    body : (n_batch, N_BODY + N_CONSTANTS) array
    states : (n_batch, n_times, 12) array
    controls : (n_times, N_CONTROLS) array

    Returns
    -------
    (n_batch, n_times, 6) array
        m/s^2 and rad/s^2.
    """
    n_batch, n_times = states.shape[0], states.shape[1]
    result = np.empty((n_batch, n_times, 6))
    work = workspace(N_ROWS)
    for first in range(0, n_batch, LANES):
        members = min(LANES, n_batch - first)
        load_block(work, first, coefficients, body, states[:, 0])
        for n in range(n_times):
            for i in range(members):
                for k in range(N_STATES):
                    work[(STAGE + k) * LANES + i] = states[first + i, n, k]
            work[SUM * LANES : (SUM + STATE_ROWS) * LANES] = 0.0
            stage(work, controls[n], 1.0, 0.0)
            for i in range(members):
                for k in range(6):
                    result[first + i, n, k] = work[(SUM + 6 + k) * LANES + i]
    return result
