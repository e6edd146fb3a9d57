"""Classical fourth-order Runge-Kutta over a control history, blocks of lanes, with output at any times."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from bayesub.kernels.jit import jit, spliced, unit, variants, widest_vectors
from bayesub.kernels.mass import inverses, mass_matrices
from bayesub.kernels.memory import plain
from bayesub.kernels.steering import NOWHERE, Steering, set_out, steer
from bayesub.kernels.variations import Variations
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

OK, DIVERGED, LEFT_ENVELOPE = 0, 1, 2
MAX_PITCH = math.radians(85.0)


class Forces(NamedTuple):
    """What a loop needs of an equation set."""

    stage: int  # address of the lane function that takes a stage of a step (bayesub.kernels.families)
    quaternions: bool  # whether its states have a quaternion
    n_coefficients: int
    n_controls: int
    n_constants: int


@spliced
def workspace(forces):
    """Zeros for a block, each row in a cache line of its own: vectors that straddle two take half as long again."""
    n_rows = COEFFICIENTS + forces.n_coefficients + forces.n_controls + forces.n_constants
    memory = np.zeros((n_rows + 1) * LANES)
    start = (-(memory.ctypes.data // memory.itemsize)) % LANES
    return memory[start : start + n_rows * LANES]


@spliced
def load_block(forces, work, first, coefficients, body, inverse_mass, initial):
    """Fill the workspace with the members from `first` on, the last one repeated in lanes that have no member."""
    constants = COEFFICIENTS + forces.n_coefficients + forces.n_controls
    for i in range(LANES):
        member = min(first + i, coefficients.shape[0] - 1)
        for k in range(forces.n_coefficients):
            work[(COEFFICIENTS + k) * LANES + i] = coefficients[member, k]
        for k in range(N_BODY):
            work[(BODY_ROWS + k) * LANES + i] = body[member, k]
        for k in range(forces.n_constants):
            work[(constants + k) * LANES + i] = body[member, N_BODY + k]
        for k in range(N_STATES):
            work[(STATE + k) * LANES + i] = initial[member, k]
        for k in range(36):
            work[(INVERSE_MASS + k) * LANES + i] = inverse_mass[member, k // 6, k % 6]


@spliced
def copy_state(work, source, target):
    """Copy the state of all lanes from row `source` to row `target`."""
    for j in range(STATE_ROWS * LANES):
        work[target * LANES + j] = work[source * LANES + j]


@spliced
def _vary_controls(forces, work, variations, n, part, amounts):
    """Let each lane add its `amounts` (n, LANES) of the variations at a part of step `n` to the controls."""
    controls = COEFFICIENTS + forces.n_coefficients
    for j in range(forces.n_controls * LANES):
        work[controls * LANES + j] = 0.0
    for e in range(variations.starts[3 * n + part], variations.starts[3 * n + part + 1]):
        row, m, value = controls + variations.columns[e], variations.numbers[e], variations.values[e]
        for i in range(LANES):
            work[row * LANES + i] += amounts[m, i] * value


@spliced
def _evaluate(forces, work, stages, variations, amounts, n, part, weight, ahead):
    if amounts.shape[0]:
        _vary_controls(forces, work, variations, n, part, amounts)
    unit(forces.stage, work, stages[n, part], work, 0, weight, ahead)


@spliced
def quaternion(phi, theta, psi):
    """(q0, q1, q2, q3) of roll, pitch and yaw (rad), scalar part first."""
    sphi, cphi = math.sin(0.5 * phi), math.cos(0.5 * phi)
    sth, cth = math.sin(0.5 * theta), math.cos(0.5 * theta)
    spsi, cpsi = math.sin(0.5 * psi), math.cos(0.5 * psi)
    return (
        cphi * cth * cpsi + sphi * sth * spsi,
        sphi * cth * cpsi - cphi * sth * spsi,
        cphi * sth * cpsi + sphi * cth * spsi,
        cphi * cth * spsi - sphi * sth * cpsi,
    )


@spliced
def euler_angles(q0, q1, q2, q3):
    """Roll and yaw in -pi .. pi and pitch in -pi/2 .. pi/2 (rad) of a quaternion of any length."""
    length2 = q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3
    sine = 2.0 * (q0 * q2 - q1 * q3) / length2
    return (
        math.atan2(2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3),
        math.asin(min(1.0, max(-1.0, sine))),
        math.atan2(2.0 * (q1 * q2 + q0 * q3), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3),
    )


@spliced
def _to_quaternions(work):
    """Replace the Euler angles of STATE by quaternions."""
    for i in range(LANES):
        row = STATE * LANES + i
        q0, q1, q2, q3 = quaternion(work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES])
        work[row + 12 * LANES], work[row + 3 * LANES], work[row + 4 * LANES], work[row + 5 * LANES] = q0, q1, q2, q3


@spliced
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


@spliced
def hermite(f, step):
    """Weights of value and slope at the start, and of value and slope at the end, of a step at its fraction `f`."""
    g = 1.0 - f
    return (1.0 + 2.0 * f) * g * g, f * g * g * step, f * f * (3.0 - 2.0 * f), -f * f * g * step


@spliced
def hermite_rates(f, step):
    """:func:`hermite` for the derivative with respect to time; at the end of a step it is the slope there."""
    a = 6.0 * f * (f - 1.0) / step
    return a, (3.0 * f - 1.0) * (f - 1.0), -a, f * (3.0 * f - 2.0)


@spliced
def _emit(quaternions, work, states, first, members, output, fraction, step, rows):
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
    if quaternions:
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


@spliced
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


@spliced
def _level(quaternions, work, i):
    """Whether the Euler angles of lane `i` are within their envelope; quaternions have none."""
    return quaternions | (abs(work[(STATE + 4) * LANES + i]) < MAX_PITCH)


@spliced
def any_failed(quaternions, work, max_speed2):
    """Whether any lane has left the envelope, is faster than the root of `max_speed2`, or has no finite rates."""
    flying = 0
    for i in range(LANES):
        flying += 1 if _moving(work, i, max_speed2) & _level(quaternions, work, i) else 0
    return flying < LANES


@spliced
def _fate(quaternions, work, i, max_speed2):
    """Status of lane `i`."""
    moves = _moving(work, i, max_speed2)
    return (OK if _level(quaternions, work, i) else LEFT_ENVELOPE) if moves else DIVERGED


@spliced
def _lose(states, member, begin, end):
    """Mark the readings of a member from output `begin` to `end` as not a number."""
    for output in range(begin, end):
        for k in range(states.shape[2]):
            states[member, output, k] = np.nan


@jit
def _integrate_block(
    block, forces, coefficients, body, inverse_mass, initial, stages, variations, amounts, step, times, max_speed,
    rows, steering, states, status,
):  # fmt: skip
    """Integrate one block of members and write their `states` at `times` and `status`; see :func:`integrate`."""
    widest_vectors()
    first = block * LANES
    members = min(LANES, coefficients.shape[0] - first)
    work = workspace(forces)
    load_block(forces, work, first, coefficients, body, inverse_mass, initial)
    mine = np.empty((amounts.shape[1], LANES))
    for i in range(LANES):
        for k in range(amounts.shape[1]):
            mine[k, i] = amounts[min(first + i, coefficients.shape[0] - 1), k]
    if forces.quaternions:
        _to_quaternions(work)
    n_steps = stages.shape[0] - 1
    n_times = times.shape[0]
    output, piece, n_pieces = 0, 0, len(steering.steps)
    reached = np.zeros((LANES, steering.feedback.shape[3]))
    set_out(steering, first, members, reached, mine)
    alive = members
    max_speed2 = max_speed * max_speed
    for step_index in range(n_steps + 1):
        while piece < n_pieces and steering.steps[piece] == step_index:
            steer(steering, piece, first, members, work, reached, mine)
            piece += 1
        for j in range(STATE_ROWS * LANES):
            work[SUM * LANES + j] = 0.0
        copy_state(work, STATE, STAGE)
        _evaluate(forces, work, stages, variations, mine, step_index, 0, 1.0, 0.5 * step)
        copy_state(work, SUM, SLOPE)

        if any_failed(forces.quaternions, work, max_speed2):
            for i in range(members):
                if status[first + i] == OK:
                    status[first + i] = _fate(forces.quaternions, work, i, max_speed2)
                    if status[first + i] != OK:
                        alive -= 1
                        _lose(states, first + i, output, n_times)
        if alive == 0:
            return

        now = step_index * step
        while output < n_times and (times[output] <= now or step_index == n_steps):
            fraction = 1.0 if step_index == 0 else 1.0 + (times[output] - now) / step
            _emit(forces.quaternions, work, states, first, members, output, fraction, step, rows)
            for i in range(members):
                if status[first + i] != OK:
                    _lose(states, first + i, output, output + 1)
            output += 1
        if output == n_times and piece == n_pieces:
            return

        copy_state(work, STATE, PREVIOUS)
        copy_state(work, SLOPE, PREVIOUS_SLOPE)
        for j in range(1, 4):  # the other stages
            part, weight = (2, 1.0) if j == 3 else (1, 2.0)
            ahead = 0.0 if j == 3 else (step if j == 2 else 0.5 * step)
            _evaluate(forces, work, stages, variations, mine, step_index, part, weight, ahead)
        for j in range(STATE_ROWS * LANES):
            work[STATE * LANES + j] += step / 6.0 * work[SUM * LANES + j]
        if forces.quaternions:
            _normalise(work)


def _integrate_blocks(
    n_blocks, forces, coefficients, body, inverse_mass, initial, stages, variations, amounts, step, times,
    max_speed, rows, steering, states, status,
):  # fmt: skip
    for block in prange(n_blocks):
        _integrate_block(
            np.int64(block), forces, coefficients, body, inverse_mass, initial, stages, variations, amounts, step,
            times, max_speed, rows, steering, states, status,
        )  # fmt: skip


_on_one_thread, _on_all_threads = variants(_integrate_blocks)


def integrate(
    forces: Forces,
    added_mass: np.ndarray,
    coefficients: np.ndarray,
    body: np.ndarray,
    initial: np.ndarray,
    stages: np.ndarray,
    variations: Variations,
    amounts: np.ndarray,
    step: float,
    times: np.ndarray,
    max_speed: float,
    rows: np.ndarray,
    *,
    steering: Steering = NOWHERE,
    parallel: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate a batch of dimensional coefficients (n_batch, n_terms), N, m, kg, s.

    Rows (n, 3) of `added_mass` are axis, acceleration and coefficient of each added-mass term. The members have bodies
    (n_batch, N_BODY + N_CONSTANTS), states at the start (n_batch, 12), and their own amounts (n_batch, n) of n
    variations of the controls, of which the `steering` chooses some on the way. Controls at the start, middle and end
    of each step (s) are `stages` (n_steps + 1, 3, N_CONTROLS). Output times (n_times,), s, ascend from 0 to
    n_steps * step; `rows` (n_outputs,) say which of the 12 states and, after them, the 6 accelerations (udot .. rdot)
    are wanted. A member that reaches `max_speed` (m/s) has diverged. If it is `parallel` blocks are shared among
    threads; the result is bitwise the same. Returned are the states (n_batch, n_times, n_outputs), not a number from
    the failure of a member on, and the status (n_batch,): OK, DIVERGED or LEFT_ENVELOPE.
    """
    coefficients, body, initial, stages, amounts, times = map(
        plain, (coefficients, body, initial, stages, amounts, times)
    )
    states = np.empty((len(coefficients), len(times), len(rows)))
    status = np.zeros(len(coefficients), dtype=np.int8)
    arguments = (
        forces, coefficients, body, inverses(mass_matrices(coefficients, body, added_mass)), initial, stages,
        variations.plain(), amounts, float(step), times, float(max_speed), plain(rows, int), steering, states, status,
    )  # fmt: skip
    n_blocks = -(-len(coefficients) // LANES)
    (_on_all_threads if parallel and n_blocks > 1 else _on_one_thread)(n_blocks, *arguments)
    return states, status


def body_accelerations(
    forces: Forces,
    added_mass: np.ndarray,
    coefficients: np.ndarray,
    body: np.ndarray,
    states: np.ndarray,
    controls: np.ndarray,
) -> np.ndarray:
    """Accelerations (n_batch, n_times, 6) of a batch, m/s^2 and rad/s^2, along states (n_batch, n_times, 12).

    The other parameters are as those of :func:`integrate`, with Euler angles and controls (n_times, N_CONTROLS).
    """
    coefficients, body, states, controls = map(plain, (coefficients, body, states, controls))
    result = np.empty((*states.shape[:2], 6))
    inverse_mass = inverses(mass_matrices(coefficients, body, added_mass))
    _body_accelerations(forces, coefficients, body, inverse_mass, states, controls, result)
    return result


@jit
def _body_accelerations(forces, coefficients, body, inverse_mass, states, controls, result):
    n_batch, n_times = states.shape[0], states.shape[1]
    work = workspace(forces)
    for first in range(0, n_batch, LANES):
        members = min(LANES, n_batch - first)
        load_block(forces, work, first, coefficients, body, inverse_mass, states[:, 0])
        for n in range(n_times):
            for i in range(members):
                for k in range(N_STATES):
                    work[(STAGE + k) * LANES + i] = states[first + i, n, k]
            for j in range(STATE_ROWS * LANES):
                work[SUM * LANES + j] = 0.0
            unit(forces.stage, work, controls[n], work, 0, 1.0, 0.0)
            for i in range(members):
                for k in range(6):
                    result[first + i, n, k] = work[(SUM + 6 + k) * LANES + i]
