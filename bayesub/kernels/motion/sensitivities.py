"""Derivatives of a simulated motion by coefficients, body and initial state.

They follow from the tangent-linear equations (model manual, section 6), of which a Runge-Kutta step takes a sensitivity
s (12,) to

    s + P s[3:] + sum over the stages j of G_j f_j

with the force f_j that the parameter adds at stage j along one axis. P (12, 9) and G_j (12, 6) follow from the state
Jacobians at the four stages and serve all parameters. Hence three passes: fly and keep the states at the stages; P, G
and f of some steps; the sensitivities over these. The result is the derivative of the discretised motion itself, to
round-off.

A parameter that adds forces along several axes is the sum of several columns. In the second pass eight steps are the
lanes; afterwards the twelve states, padded to sixteen, are.
"""

import math

import numpy as np
from numba import prange

from bayesub.kernels.jit import distinct_arrays, jit, widest_vectors
from bayesub.kernels.workspace import (
    BODY_ROWS,
    INVERSE_MASS,
    LANES,
    N_STATES,
    SLOPE,
    STAGE,
    STATE,
    STATE_ROWS,
    SUM,
    ZP,
)

from .dynamics import euler_derivative, hydrostatics, ordered_speed, propulsion, rigid_body, store_weight_slopes
from .hydrodynamics import N_COEFFICIENTS, N_CONTROLS, store_control_slopes, store_regressors
from .integrate import any_failed, copy_state, hermite, hermite_rates, load_block, stage, workspace
from .layout import CONTROLS, N_ROWS
from .mass import mass_matrix
from .tangent import JACOBIAN_ROWS, N_COLUMNS, state_jacobian

N_STAGES = 4
WIDTH = 16  # states, padded
_COLUMNS_A_TASK = 32
_STEPS_AT_ONCE = 128  # whose matrices and forces stay in a core's cache from one pass to the next
_UNIT = np.eye(N_STATES, WIDTH)

# Rows of a group of steps, after those of a simulation.
_JACOBIAN = N_ROWS
_ACCELERATIONS = _JACOBIAN + JACOBIAN_ROWS
_MECHANICAL = _ACCELERATIONS + 6  # forces that do not come from coefficients
_BODY_FORCES = _MECHANICAL + 6  # six rows for each body parameter

# Rows of the matrices of a step, each of WIDTH: the columns of the state Jacobian at stage 0, of P, and of G_0 .. G_3.
_FIRST_JACOBIAN = 0
_TRANSITION = _FIRST_JACOBIAN + N_COLUMNS
_GAINS = _TRANSITION + N_COLUMNS
_N_MATRIX_ROWS = _GAINS + 6 * N_STAGES


@jit
def fly(coefficients, body, initial, stages, step, max_speed):
    """States (n_steps + 1, 4, 12) at the stages of one member, not a number from its failure on.

    `coefficients` (1, n_terms), `body` (1, N_BODY + N_CONSTANTS), `initial` (1, 12); the rest as for
    :func:`bayesub.kernels.motion.integrate.integrate`, whose steps these are.
    """
    n_steps = stages.shape[0] - 1
    history = np.full((n_steps + 1, N_STAGES, N_STATES), np.nan)
    work = workspace(N_ROWS)
    load_block(work, 0, coefficients, body, initial)
    for n in range(n_steps + 1):
        work[SUM * LANES : (SUM + STATE_ROWS) * LANES] = 0.0
        copy_state(work, STATE, STAGE)
        _keep(work, history[n, 0])
        stage(work, stages[n, 0], 1.0, 0.5 * step)
        copy_state(work, SUM, SLOPE)
        if any_failed(work, max_speed * max_speed):
            history[n] = np.nan
            break
        _keep(work, history[n, 1])
        stage(work, stages[n, 1], 2.0, 0.5 * step)
        _keep(work, history[n, 2])
        stage(work, stages[n, 1], 2.0, step)
        _keep(work, history[n, 3])
        stage(work, stages[n, 2], 1.0, 0.0)
        for j in range(STATE_ROWS * LANES):
            work[STATE * LANES + j] += step / 6.0 * work[SUM * LANES + j]
    return history


@jit
def _keep(work, state):
    for k in range(N_STATES):
        state[k] = work[(STAGE + k) * LANES]


@jit
def _linearise(work, still):
    """Accelerations and state Jacobian at the states and controls of the lanes; `still` are controls of zero."""
    distinct_arrays()
    widest_vectors()
    for i in range(LANES):
        rates = euler_derivative(work, i, STAGE, still)
        a = _ACCELERATIONS * LANES + i
        work[a] = rates[6]
        work[a + LANES] = rates[7]
        work[a + 2 * LANES] = rates[8]
        work[a + 3 * LANES] = rates[9]
        work[a + 4 * LANES] = rates[10]
        work[a + 5 * LANES] = rates[11]
        state_jacobian(work, i, STAGE, _JACOBIAN, still)


@jit
def _forces(work, i, still, n_body_forces, variations, step, part, slots, values):
    """Forces of lane `i` by unit coefficients, unit changes of the body and unit amounts of `variations` at a stage."""
    state, rate = (STAGE + 6) * LANES + i, _ACCELERATIONS * LANES + i
    u, v, w = work[state], work[state + LANES], work[state + 2 * LANES]
    p, q, r = work[state + 3 * LANES], work[state + 4 * LANES], work[state + 5 * LANES]
    store_regressors(
        values, work, i, still, u, v, w, p, q, r,
        work[rate], work[rate + LANES], work[rate + 2 * LANES],
        work[rate + 3 * LANES], work[rate + 4 * LANES], work[rate + 5 * LANES],
    )  # fmt: skip
    for k in range(n_body_forces):
        values[N_COEFFICIENTS + k] = work[(_BODY_FORCES + k) * LANES + i]
    first = N_COEFFICIENTS + n_body_forces
    if slots.shape[0]:
        slopes = np.zeros((6, N_CONTROLS))
        store_control_slopes(slopes, work, i, still, u, v, w, p, q, r)
        phi, theta = work[state - 3 * LANES], work[state - 2 * LANES]
        cth = math.cos(theta)
        store_weight_slopes(slopes, -math.sin(theta), cth * math.sin(phi), cth * math.cos(phi))
        values[first:] = 0.0
        for e in range(variations.starts[3 * step + part], variations.starts[3 * step + part + 1]):
            for axis in range(6):
                slot = slots[variations.numbers[e], axis]
                if slot >= 0:
                    values[first + slot] += slopes[axis, variations.columns[e]] * variations.values[e]


@jit
def _mechanical_forces(work, still, target):
    """Hydrostatics, propulsion and velocity terms of the rigid body, at the states and controls of the lanes."""
    for i in range(LANES):
        row = STAGE * LANES + i
        phi, theta = work[row + 3 * LANES], work[row + 4 * LANES]
        u, v, w = work[row + 6 * LANES], work[row + 7 * LANES], work[row + 8 * LANES]
        p, q, r = work[row + 9 * LANES], work[row + 10 * LANES], work[row + 11 * LANES]
        sth, cth = math.sin(theta), math.cos(theta)
        x1, y1, z1, k1, m1, n1 = hydrostatics(work, i, still, -sth, cth * math.sin(phi), cth * math.cos(phi))
        x2, y2, z2, k2, m2, n2 = rigid_body(work, i, u, v, w, p, q, r, u, v, w, p, q, r)
        thrust, torque, _, _ = propulsion(work, i, u, ordered_speed(work, i, still))
        a = target * LANES + i
        work[a] = x1 - x2 + thrust
        work[a + LANES] = y1 - y2
        work[a + 2 * LANES] = z1 - z2
        work[a + 3 * LANES] = k1 - k2 + torque
        work[a + 4 * LANES] = m1 - m2 + thrust * work[(BODY_ROWS + ZP) * LANES + i]
        work[a + 5 * LANES] = n1 - n2


@jit
def _body_forces(work, still, body, parameters):
    """Forces by a unit change of body parameters; they are linear in each, so that a difference is a derivative."""
    _mechanical_forces(work, still, _MECHANICAL)
    no_water = np.zeros(N_COEFFICIENTS)
    mass = mass_matrix(no_water, body)
    for n in range(parameters.shape[0]):
        row = BODY_ROWS + parameters[n]
        varied = body.copy()
        varied[parameters[n]] += abs(body[parameters[n]]) if body[parameters[n]] != 0.0 else 1.0
        change = varied[parameters[n]] - body[parameters[n]]
        inertia = mass_matrix(no_water, varied) - mass
        work[row * LANES : (row + 1) * LANES] = varied[parameters[n]]
        _mechanical_forces(work, still, _BODY_FORCES + 6 * n)
        work[row * LANES : (row + 1) * LANES] = body[parameters[n]]
        for axis in range(6):
            for i in range(LANES):
                a = (_BODY_FORCES + 6 * n + axis) * LANES + i
                force = work[a] - work[(_MECHANICAL + axis) * LANES + i]
                for m in range(6):
                    force -= inertia[axis, m] * work[(_ACCELERATIONS + m) * LANES + i]
                work[a] = force / change


@jit
def _compose(work, lane, j, weight, ahead, response, scratch, matrices):
    """What a stage adds to the matrices of the step of a lane.

    A change of the rates at stage j changes the end of the step by V_j = weight + ahead P_{j+1}, where
    P_j = V_j A_j is what a change of the state at stage j does by its rates: P = P_0 + .. + P_3 and G_j = V_j B, with B
    the inverse mass matrix. `response` (9, WIDTH) holds the columns of P_{j+1} and then of P_j.
    """
    distinct_arrays()
    widest_vectors()
    for n in range(N_COLUMNS):
        for k in range(WIDTH):
            scratch[n, k] = ahead * response[n, k] + weight * _UNIT[3 + n, k]
    s = N_COLUMNS * LANES
    for n in range(N_COLUMNS):
        a = (_JACOBIAN + n) * LANES + lane
        x, y, z = weight * work[a], weight * work[a + s], weight * work[a + 2 * s]
        a0, a1, a2 = work[a + 3 * s], work[a + 4 * s], work[a + 5 * s]
        a3, a4, a5 = work[a + 6 * s], work[a + 7 * s], work[a + 8 * s]
        a6, a7, a8 = work[a + 9 * s], work[a + 10 * s], work[a + 11 * s]
        for k in range(WIDTH):
            response[n, k] = (
                (x * _UNIT[0, k] + y * _UNIT[1, k] + z * _UNIT[2, k])
                + (a0 * scratch[0, k] + a1 * scratch[1, k] + a2 * scratch[2, k])
                + (a3 * scratch[3, k] + a4 * scratch[4, k] + a5 * scratch[5, k])
                + (a6 * scratch[6, k] + a7 * scratch[7, k] + a8 * scratch[8, k])
            )
        for k in range(WIDTH):
            earlier = matrices[_TRANSITION + n, k] if j < N_STAGES - 1 else 0.0
            matrices[_TRANSITION + n, k] = earlier + response[n, k]
    s = 6 * LANES
    for axis in range(6):
        b = (INVERSE_MASS + axis) * LANES + lane
        b0, b1, b2 = work[b], work[b + s], work[b + 2 * s]
        b3, b4, b5 = work[b + 3 * s], work[b + 4 * s], work[b + 5 * s]
        for k in range(WIDTH):
            matrices[_GAINS + N_STAGES * axis + j, k] = (
                b0 * scratch[3, k] + b1 * scratch[4, k] + b2 * scratch[5, k]
            ) + (b3 * scratch[6, k] + b4 * scratch[7, k] + b5 * scratch[8, k])


@jit
def _prepare(group, begin, loaded, body, history, stages, variations, slots, step, parameters, matrices, forces):
    """The second pass for a group of steps: their `matrices` (n, rows, WIDTH) and `forces` (n, 4, n_forces).

    The group is one of those from step `begin` on, of which are the first matrices and forces.
    """
    n_body_forces = 6 * parameters.shape[0]
    work, still = workspace(loaded.shape[0] // LANES), np.zeros(N_CONTROLS)
    work[:] = loaded
    response, scratch = np.zeros((LANES, N_COLUMNS, WIDTH)), np.empty((N_COLUMNS, WIDTH))
    first = group * LANES
    members = min(LANES, history.shape[0] - begin - first)
    for j in range(N_STAGES - 1, -1, -1):
        for i in range(LANES):
            n = begin + first + min(i, members - 1)
            for k in range(N_STATES):
                work[(STAGE + k) * LANES + i] = history[n, j, k]
            for k in range(N_CONTROLS):
                work[(CONTROLS + k) * LANES + i] = stages[n, (j + 1) // 2, k]
        _linearise(work, still)
        if n_body_forces:
            _body_forces(work, still, body, parameters)
        weight = step / 6.0 if j in (0, 3) else step / 3.0
        ahead = 0.0 if j == 3 else (step if j == 2 else 0.5 * step)
        for i in range(members):
            _compose(work, i, j, weight, ahead, response[i], scratch, matrices[first + i])
            if j == 0:
                for n in range(N_COLUMNS):
                    for k in range(N_STATES):
                        entry = work[(_JACOBIAN + N_COLUMNS * k + n) * LANES + i]
                        matrices[first + i, _FIRST_JACOBIAN + n, k] = entry
            part, values = (j + 1) // 2, forces[first + i, j]
            _forces(work, i, still, n_body_forces, variations, begin + first + i, part, slots, values)


@jit
def _advance(now, after, begin, end, matrices, forces, sources, factors, axes):
    """One step of the sensitivities of columns `begin` to `end`."""
    distinct_arrays()
    widest_vectors()
    for c in range(begin, end):
        s0, s1, s2, s3, s4 = now[c, 3], now[c, 4], now[c, 5], now[c, 6], now[c, 7]
        s5, s6, s7, s8 = now[c, 8], now[c, 9], now[c, 10], now[c, 11]
        f, factor = sources[c], factors[c]
        f0, f1, f2, f3 = factor * forces[0, f], factor * forces[1, f], factor * forces[2, f], factor * forces[3, f]
        p, g = _TRANSITION, _GAINS + N_STAGES * axes[c]
        for k in range(WIDTH):
            after[c, k] = (
                (now[c, k] + s0 * matrices[p, k] + s1 * matrices[p + 1, k] + s2 * matrices[p + 2, k])
                + (s3 * matrices[p + 3, k] + s4 * matrices[p + 4, k] + s5 * matrices[p + 5, k])
                + (s6 * matrices[p + 6, k] + s7 * matrices[p + 7, k] + s8 * matrices[p + 8, k])
                + (f0 * matrices[g, k] + f1 * matrices[g + 1, k] + f2 * matrices[g + 2, k] + f3 * matrices[g + 3, k])
            )


@jit
def _slopes(now, slope, begin, end, matrices, forces, sources, factors, axes, step):
    """Rates of change of the sensitivities of columns `begin` to `end` at the start of a step."""
    for c in range(begin, end):
        # The last stage is followed by nothing, so that G_3 is step/6 times the inverse mass matrix.
        force, g = 6.0 / step * factors[c] * forces[0, sources[c]], _GAINS + N_STAGES * axes[c] + 3
        for k in range(N_STATES):
            slope[c, k] = force * matrices[g, k]
            for n in range(N_COLUMNS):
                slope[c, k] += now[c, 3 + n] * matrices[_FIRST_JACOBIAN + n, k]


@jit
def _propagate(
    task, first, output, history, matrices, forces, sources, factors, axes, changes, slopes, step, times, rows, result
):
    """The third pass for the columns of a task over the steps from `first` on; the next output after these.

    `changes` and `slopes` (2, n, WIDTH) hold the sensitivities at the starts of an even and of an odd step, and their
    rates where an output needs them.
    """
    begin = task * _COLUMNS_A_TASK
    end = min(changes.shape[1], begin + _COLUMNS_A_TASK)
    n_steps = history.shape[0] - 1
    rates = np.any(rows >= N_STATES)
    for here in range(min(matrices.shape[0], n_steps + 1 - first)):
        n = first + here
        if math.isnan(history[n, 0, 0]):
            result[output:, begin:end] = np.nan
            return times.shape[0]
        time, now, before = n * step, changes[n % 2], changes[1 - n % 2]
        # An output between two steps needs the rates at both.
        due = times[output] <= time or n == n_steps
        sloped = due and (rates or times[output] < time)
        if sloped:
            _slopes(now, slopes[n % 2], begin, end, matrices[here], forces[here], sources, factors, axes, step)
        while output < times.shape[0] and (times[output] <= time or n == n_steps):
            _emit(
                before, slopes[1 - n % 2], now, slopes[n % 2], begin, end, (times[output] - time) / step, step, rows,
                result[output],
            )  # fmt: skip
            output += 1
        if output == times.shape[0]:
            return output
        if not sloped and (times[output] < (n + 1) * step or n + 1 == n_steps):
            _slopes(now, slopes[n % 2], begin, end, matrices[here], forces[here], sources, factors, axes, step)
        _advance(now, before, begin, end, matrices[here], forces[here], sources, factors, axes)
    return output


@jit
def _emit(before, slope_before, now, slope, begin, end, late, step, rows, result):
    """The outputs wanted, `late` steps (zero or a negative fraction) after the end of a step."""
    for k in range(rows.shape[0]):
        m = rows[k]
        h00, h10, h01, h11 = hermite(1.0 + late, step)
        if m >= N_STATES:
            h00, h10, h01, h11 = hermite_rates(1.0 + late, step)
            m -= 6  # the rate of a velocity
        for c in range(begin, end):
            value = h01 * now[c, m] + h11 * slope[c, m]
            if late != 0.0:
                value += h00 * before[c, m] + h10 * slope_before[c, m]
            result[c, k] = value


@jit(parallel=True)
def sensitivities(
    coefficients, body, history, stages, variations, slots, step, times,
    parameters, sources, factors, axes, initial, rows,
):  # fmt: skip
    """Derivatives of the motion of one member by the parameters of `n` columns.

    Parameters
    ----------
    coefficients : (1, n_terms) array
        Dimensional (N, m, kg, s).
    body : (1, N_BODY + N_CONSTANTS) array
    history : (n_steps + 1, 4, 12) array
        From :func:`fly`.
    stages : (n_steps + 1, 3, N_CONTROLS) array
        Controls, with all amounts of the variations of this member added.
    variations : Variations
        Changes of the controls whose amounts are parameters, n_variations of them.
    slots : (n_variations, 6) array
        Number, from zero, of the force along each axis that a change makes, or -1 where none is asked for.
    step : float
        s.
    times : (n_times,) array
        s.
    parameters : (n_body,) array
        Positions in the body vector of the body parameters.
    sources : (n,) array
        Whose force a column has: coefficient k as k, axis a of body parameter m as n_terms + 6 m + a, and after
        these the slots.
    factors : (n,) array
        Factor of that force.
    axes : (n,) array
        Axis 0 .. 5 along which it acts.
    initial : (n, WIDTH) array
        Sensitivities at the start.
    rows : (n_rows,) array
        Which of the states (0 .. 11) and accelerations (12 .. 17) are wanted.

    Returns
    -------
    (n_times, n, n_rows)
    """
    n_points, n_columns = history.shape[0], initial.shape[0]
    n_forces = N_COEFFICIENTS + 6 * parameters.shape[0] + np.count_nonzero(slots >= 0)
    matrices = np.empty((_STEPS_AT_ONCE, _N_MATRIX_ROWS, WIDTH))
    forces = np.empty((_STEPS_AT_ONCE, N_STAGES, n_forces))
    loaded = workspace(_BODY_FORCES + 6 * parameters.shape[0])
    load_block(loaded, 0, coefficients, body, history[:1, 0])
    changes, slopes = np.zeros((2, n_columns, WIDTH)), np.zeros((2, n_columns, WIDTH))
    changes[0] = initial
    n_tasks = (n_columns + _COLUMNS_A_TASK - 1) // _COLUMNS_A_TASK
    outputs = np.zeros(n_tasks, dtype=np.int64)
    result = np.empty((times.shape[0], n_columns, rows.shape[0]))
    for first in range(0, n_points, _STEPS_AT_ONCE):
        if np.all(outputs == times.shape[0]):
            break
        for group in prange((min(_STEPS_AT_ONCE, n_points - first) + LANES - 1) // LANES):
            _prepare(
                np.int64(group), first, loaded, body[0], history, stages, variations, slots, step, parameters,
                matrices, forces,
            )  # fmt: skip
        for task in prange(n_tasks):
            outputs[task] = _propagate(
                np.int64(task), first, outputs[task], history, matrices, forces, sources, factors, axes,
                changes, slopes, step, times, rows, result,
            )  # fmt: skip
    return result
