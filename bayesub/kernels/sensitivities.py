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
from typing import NamedTuple

import numpy as np
from numba import prange

from bayesub.kernels.integrate import Forces, any_failed, copy_state, hermite, hermite_rates, load_block, workspace
from bayesub.kernels.jit import distinct_arrays, inline, jit, spliced, unit, widest_vectors
from bayesub.kernels.mass import inverses, mass_matrices
from bayesub.kernels.memory import plain
from bayesub.kernels.workspace import (
    ACCELERATIONS,
    BODY_ROWS,
    COEFFICIENTS,
    INVERSE_MASS,
    JACOBIAN,
    LANES,
    MECHANICAL,
    N_COLUMNS,
    N_STATES,
    SLOPE,
    STAGE,
    STATE,
    STATE_ROWS,
    SUM,
)

N_STAGES = 4
WIDTH = 16  # states, padded
_COLUMNS_A_TASK = 32
_STEPS_AT_ONCE = 128  # whose matrices and forces stay in a core's cache from one pass to the next
_UNIT = np.eye(N_STATES, WIDTH)

# Rows of the matrices of a step, each of WIDTH: the columns of the state Jacobian at stage 0, of P, and of G_0 .. G_3.
_FIRST_JACOBIAN = 0
_TRANSITION = _FIRST_JACOBIAN + N_COLUMNS
_GAINS = _TRANSITION + N_COLUMNS
_N_MATRIX_ROWS = _GAINS + 6 * N_STAGES


class Slopes(NamedTuple):
    """Addresses of the lane functions of an equation set that derivatives need (:mod:`bayesub.kernels.families`)."""

    linearise: int
    regressors: int
    slopes: int
    mechanical: int


def fly(
    forces: Forces,
    added_mass: np.ndarray,
    coefficients: np.ndarray,
    body: np.ndarray,
    initial: np.ndarray,
    stages: np.ndarray,
    step: float,
    max_speed: float,
) -> np.ndarray:
    """States (n_steps + 1, 4, 12) at the stages of one member, not a number from its failure on.

    `coefficients` (1, n_terms), `body` (1, N_BODY + N_CONSTANTS), `initial` (1, 12); the rest as for
    :func:`bayesub.kernels.integrate.integrate`, whose steps these are, with Euler angles.
    """
    coefficients, body, initial, stages = map(plain, (coefficients, body, initial, stages))
    history = np.full((len(stages), N_STAGES, N_STATES), np.nan)
    inverse_mass = inverses(mass_matrices(coefficients, body, added_mass))
    _fly(forces, coefficients, body, inverse_mass, initial, stages, float(step), float(max_speed), history)
    return history


@jit
def _fly(forces, coefficients, body, inverse_mass, initial, stages, step, max_speed, history):
    widest_vectors()
    work = workspace(forces)
    load_block(forces, work, 0, coefficients, body, inverse_mass, initial)
    for n in range(stages.shape[0]):
        for j in range(STATE_ROWS * LANES):
            work[SUM * LANES + j] = 0.0
        copy_state(work, STATE, STAGE)
        for j in range(N_STAGES):
            for k in range(N_STATES):
                history[n, j, k] = work[(STAGE + k) * LANES]
            weight = 1.0 if j in (0, 3) else 2.0
            ahead = 0.0 if j == 3 else (step if j == 2 else 0.5 * step)
            unit(forces.stage, work, stages[n, (j + 1) // 2], work, 0, weight, ahead)
            if j == 0:
                copy_state(work, SUM, SLOPE)
                if any_failed(False, work, max_speed * max_speed):
                    for k in range(N_STATES):
                        history[n, 0, k] = np.nan
                    return
        for j in range(STATE_ROWS * LANES):
            work[STATE * LANES + j] += step / 6.0 * work[SUM * LANES + j]


@spliced
def _control_forces(i, first, variations, step, part, slots, slopes, forces):
    """Forces of lane `i` by unit amounts of `variations` at a stage, into `forces` from row `first` on."""
    for k in range(first, forces.shape[0]):
        forces[k, i] = 0.0
    for e in range(variations.starts[3 * step + part], variations.starts[3 * step + part + 1]):
        for axis in range(6):
            slot = slots[variations.numbers[e], axis]
            if slot >= 0:
                forces[first + slot, i] += slopes[axis, variations.columns[e], i] * variations.values[e]


@spliced
def _body_forces(equations, slopes, work, still, bodies, parameters, inertia, forces):
    """Forces by a unit change of body parameters; they are linear in each, so that a difference is a derivative."""
    unit(slopes.mechanical, work, still, work, MECHANICAL, 0.0, 0.0)
    for n in range(parameters.shape[0]):
        row, first = BODY_ROWS + parameters[n], equations.n_coefficients + 6 * n
        for i in range(LANES):
            work[row * LANES + i] = bodies[n + 1, parameters[n]]
        unit(slopes.mechanical, work, still, forces, first, 0.0, 0.0)
        change = bodies[n + 1, parameters[n]] - bodies[0, parameters[n]]
        for i in range(LANES):
            work[row * LANES + i] = bodies[0, parameters[n]]
        for axis in range(6):
            for i in range(LANES):
                force = forces[first + axis, i] - work[(MECHANICAL + axis) * LANES + i]
                for m in range(6):
                    force -= inertia[n, axis, m] * work[(ACCELERATIONS + m) * LANES + i]
                forces[first + axis, i] = force / change


@inline
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
        a = (JACOBIAN + n) * LANES + lane
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
def _prepare(
    group, begin, equations, slopes_of, loaded, bodies, inertia, history, stages, variations, slots, step, parameters,
    matrices, forces,
):  # fmt: skip
    """The second pass for a group of steps: their `matrices` (n, rows, WIDTH) and `forces` (4, n_forces, LANES).

    The group is one of those from step `begin` on, of which are the first matrices and forces.
    """
    widest_vectors()
    controls = COEFFICIENTS + equations.n_coefficients
    after_body = equations.n_coefficients + 6 * parameters.shape[0]
    work, still = workspace(equations), np.zeros(equations.n_controls)
    for k in range(loaded.shape[0]):
        work[k] = loaded[k]
    slopes = np.zeros((6 if slots.shape[0] else 0, equations.n_controls, LANES))
    response, scratch = np.zeros((LANES, N_COLUMNS, WIDTH)), np.empty((N_COLUMNS, WIDTH))
    first = group * LANES
    members = min(LANES, history.shape[0] - begin - first)
    for j in range(N_STAGES - 1, -1, -1):
        for i in range(LANES):
            n = begin + first + min(i, members - 1)
            for k in range(N_STATES):
                work[(STAGE + k) * LANES + i] = history[n, j, k]
            for k in range(equations.n_controls):
                work[(controls + k) * LANES + i] = stages[n, (j + 1) // 2, k]
        of_stage = forces[group, j]
        unit(slopes_of.linearise, work, still, work, 0, 0.0, 0.0)
        unit(slopes_of.regressors, work, still, of_stage, 0, 0.0, 0.0)
        if parameters.shape[0]:
            _body_forces(equations, slopes_of, work, still, bodies, parameters, inertia, of_stage)
        if slots.shape[0]:
            unit(slopes_of.slopes, work, still, slopes, 0, 0.0, 0.0)
        weight = step / 6.0 if j in (0, 3) else step / 3.0
        ahead = 0.0 if j == 3 else (step if j == 2 else 0.5 * step)
        for i in range(members):
            _compose(work, i, j, weight, ahead, response[i], scratch, matrices[first + i])
            if j == 0:
                for n in range(N_COLUMNS):
                    for k in range(N_STATES):
                        entry = work[(JACOBIAN + N_COLUMNS * k + n) * LANES + i]
                        matrices[first + i, _FIRST_JACOBIAN + n, k] = entry
            if slots.shape[0]:
                step_here = begin + first + i
                _control_forces(i, after_body, variations, step_here, (j + 1) // 2, slots, slopes, of_stage)


@inline
def _advance(now, after, begin, end, matrices, forces, lane, sources, factors, axes):
    """One step of the sensitivities of columns `begin` to `end`."""
    distinct_arrays()
    widest_vectors()
    for c in range(begin, end):
        s0, s1, s2, s3, s4 = now[c, 3], now[c, 4], now[c, 5], now[c, 6], now[c, 7]
        s5, s6, s7, s8 = now[c, 8], now[c, 9], now[c, 10], now[c, 11]
        f, factor = sources[c], factors[c]
        f0, f1 = factor * forces[0, f, lane], factor * forces[1, f, lane]
        f2, f3 = factor * forces[2, f, lane], factor * forces[3, f, lane]
        p, g = _TRANSITION, _GAINS + N_STAGES * axes[c]
        for k in range(WIDTH):
            after[c, k] = (
                (now[c, k] + s0 * matrices[p, k] + s1 * matrices[p + 1, k] + s2 * matrices[p + 2, k])
                + (s3 * matrices[p + 3, k] + s4 * matrices[p + 4, k] + s5 * matrices[p + 5, k])
                + (s6 * matrices[p + 6, k] + s7 * matrices[p + 7, k] + s8 * matrices[p + 8, k])
                + (f0 * matrices[g, k] + f1 * matrices[g + 1, k] + f2 * matrices[g + 2, k] + f3 * matrices[g + 3, k])
            )


@inline
def _slopes(now, slope, begin, end, matrices, forces, lane, sources, factors, axes, step):
    """Rates of change of the sensitivities of columns `begin` to `end` at the start of a step."""
    for c in range(begin, end):
        # The last stage is followed by nothing, so that G_3 is step/6 times the inverse mass matrix.
        force, g = 6.0 / step * factors[c] * forces[sources[c], lane], _GAINS + N_STAGES * axes[c] + 3
        for k in range(N_STATES):
            slope[c, k] = force * matrices[g, k]
            for n in range(N_COLUMNS):
                slope[c, k] += now[c, 3 + n] * matrices[_FIRST_JACOBIAN + n, k]


@jit
def _propagate(
    task, first, outputs, history, matrices, forces, sources, factors, axes, changes, slopes, step, times, rows, result,
    restarts, initial, ends,
):  # fmt: skip
    """The third pass for the columns of a task over the steps from `first` on, from its next of the `outputs` on.

    `changes` and `slopes` (2, n, WIDTH) hold the sensitivities at the starts of an even and of an odd step, and their
    rates where an output needs them. At the starts of the steps `restarts` they are kept as `ends` and `initial` again.
    """
    widest_vectors()
    begin = task * _COLUMNS_A_TASK
    end = min(changes.shape[1], begin + _COLUMNS_A_TASK)
    n_steps, n_times, output = history.shape[0] - 1, times.shape[0], outputs[task]
    rates = False
    for k in range(rows.shape[0]):
        rates |= rows[k] >= N_STATES
    for here in range(min(matrices.shape[0], n_steps + 1 - first)):
        n = first + here
        if math.isnan(history[n, 0, 0]):
            _lose(result, output, begin, end)
            output = n_times
        if output == n_times:
            break
        time, now, before = n * step, changes[n % 2], changes[1 - n % 2]
        following = output  # the first output that comes later
        while following < n_times and (times[following] <= time or n == n_steps):
            following += 1
        # An output between two steps needs the rates at both.
        due = following > output and (rates or times[output] < time)
        soon = following < n_times and (times[following] < time + step or n + 1 == n_steps)
        if due or soon:
            _slopes(
                now, slopes[n % 2], begin, end, matrices[here], forces[here // LANES, 0], here % LANES,
                sources, factors, axes, step,
            )  # fmt: skip
        for k in range(output, following):
            _emit(
                before, slopes[1 - n % 2], now, slopes[n % 2], begin, end, (times[k] - time) / step, step, rows,
                result[k],
            )  # fmt: skip
        output = following
        piece = np.searchsorted(restarts, n)
        if piece < restarts.shape[0] and restarts[piece] == n:
            for c in range(begin, end):
                for k in range(N_STATES):
                    ends[piece, c, k], now[c, k] = now[c, k], initial[c, k]
            if soon:
                _slopes(
                    now, slopes[n % 2], begin, end, matrices[here], forces[here // LANES, 0], here % LANES,
                    sources, factors, axes, step,
                )  # fmt: skip
        _advance(
            now, before, begin, end, matrices[here], forces[here // LANES], here % LANES, sources, factors, axes
        )  # fmt: skip
    outputs[task] = output


@spliced
def _lose(result, output, begin, end):
    """Mark columns as not a number from an output on."""
    for k in range(output, result.shape[0]):
        for c in range(begin, end):
            for m in range(result.shape[2]):
                result[k, c, m] = np.nan


@spliced
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


@jit(threads=True)
def _run(
    equations, slopes_of, coefficients, body, inverse_mass, bodies, inertia, history, stages,
    variations, slots, step, times, parameters, sources, factors, axes, rows, matrices, forces, changes, slopes,
    outputs, result, restarts, initial, ends,
):  # fmt: skip
    n_points, n_tasks, n_times = history.shape[0], outputs.shape[0], times.shape[0]
    loaded = workspace(equations)
    load_block(equations, loaded, 0, coefficients, body, inverse_mass, history[:, 0])
    for first in range(0, n_points, _STEPS_AT_ONCE):
        unfinished = 0
        for task in range(n_tasks):
            unfinished += outputs[task] < n_times
        if unfinished == 0:
            break
        for group in prange((min(_STEPS_AT_ONCE, n_points - first) + LANES - 1) // LANES):
            _prepare(
                np.int64(group), first, equations, slopes_of, loaded, bodies, inertia, history, stages, variations,
                slots, step, parameters, matrices, forces,
            )  # fmt: skip
        for task in prange(n_tasks):
            _propagate(
                np.int64(task), first, outputs, history, matrices, forces, sources, factors, axes, changes, slopes,
                step, times, rows, result, restarts, initial, ends,
            )  # fmt: skip


def sensitivities(
    equations, slopes_of, added_mass, coefficients, body, history, stages, variations, slots, step, times,
    parameters, sources, factors, axes, initial, rows, restarts=(),
):  # fmt: skip
    """Derivatives (n_times, n, n_rows) of the motion of one member by the parameters of `n` columns.

    And (n_restarts, n, N_STATES) those of the states at the starts of some steps, at which the motion begins anew: what
    follows is differentiated by the states there and by forces from there on. An output at such a start is before it.

    Its `history` (n_steps + 1, 4, 12) is from :func:`fly`, and `stages` have all amounts of its variations added.
    `variations` are n_variations changes of the controls whose amounts are parameters; `slots` (n_variations, 6) are
    the number, from zero, of the force along each axis that a change makes, or -1 where none is asked for; `parameters`
    (n_body,) are the positions of the body parameters in the body vector. `sources` (n,) say whose force a column has:
    coefficient k as k, axis a of body parameter m as n_terms + 6 m + a, and after these the slots. It is multiplied by
    `factors` (n,) and acts along `axes` (n,), 0 .. 5. Sensitivities at the start, and at each of the restarts, are
    `initial` (n, N_STATES), and `restarts` (n_restarts,) are ascending steps. The rest is as for :func:`integrate`.
    """
    coefficients, body, history, stages, times, factors = map(
        plain, (coefficients, body, history, stages, times, factors)
    )
    slots, parameters, sources, axes, rows = (plain(each, int) for each in (slots, parameters, sources, axes, rows))
    variations, step, n_columns = variations.plain(), float(step), len(initial)
    # The body vector, and that with each of the parameters changed as much as it is large.
    bodies = np.repeat(body, 1 + len(parameters), axis=0)
    given = body[0, parameters]
    bodies[np.arange(len(parameters)) + 1, parameters] += np.where(given != 0.0, np.abs(given), 1.0)
    masses = mass_matrices(np.zeros((len(bodies), coefficients.shape[1])), bodies, added_mass)
    matrices = np.empty((_STEPS_AT_ONCE, _N_MATRIX_ROWS, WIDTH))
    n_forces = coefficients.shape[1] + 6 * len(parameters) + np.count_nonzero(slots >= 0)
    forces = np.empty((_STEPS_AT_ONCE // LANES, N_STAGES, n_forces, LANES))
    changes, slopes = np.zeros((2, n_columns, WIDTH)), np.zeros((2, n_columns, WIDTH))
    changes[0, :, :N_STATES] = initial
    outputs = np.zeros(-(-n_columns // _COLUMNS_A_TASK), dtype=int)
    result = np.empty((len(times), n_columns, len(rows)))
    restarts, initial = plain(np.asarray(restarts), int), plain(initial)
    ends = np.zeros((len(restarts), n_columns, N_STATES))
    _run(
        equations, slopes_of, coefficients, body, inverses(mass_matrices(coefficients, body, added_mass)), bodies,
        masses[1:] - masses[0], history, stages, variations, slots, step, times, parameters, sources, factors, axes,
        rows, matrices, forces, changes, slopes, outputs, result, restarts, initial, ends,
    )  # fmt: skip
    return result, ends
