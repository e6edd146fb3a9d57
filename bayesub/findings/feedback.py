"""Whether an autopilot steered: a control that answers the motion hides what one that is moved by a plan shows."""

import numpy as np

from bayesub.findings import zeros
from bayesub.findings.set_up import AnyProblem

STEERED = {"rudder_deg": (("psi", "heading"), "N"), "stern_plane_deg": (("theta",), "M")}  # angles, moment on them
LAGS = 6  # rows before, by which the next change of an angle and of a control is predicted
LARGE = 4.0  # robust standard deviations, beyond which a change of a control is a step of a plan
CHANCE, LEAST = 4.0, 0.15  # standard errors, and correlation, of an answer that is one
MOVING = 0.5  # share of rows in which a control that answers changes


def advice(problem: AnyProblem) -> str:
    """What a study should infer besides or heed: zeros of actuators, and controls that answer; empty if nothing."""
    parts = [text] if (text := zeros.advice(problem)) else []
    for name, trial, _ in problem.each_trial(problem.prior.mean):
        history, of_trial = trial.manoeuvre, f" of {name}" if name else ""
        inferred = [axis for one in trial.histories for axis in one.disturbances.knots.axes]
        for k, control in enumerate(trial.equations.controls if trial.record.truth is None else ()):
            angles, axis = STEERED.get(control.column, ((), ""))
            for channel in [c for c in trial.record.channels if c.quantity in angles and len(c.times) > LAGS][:1]:
                rows, readings = (np.median(np.diff(times)) for times in (history.times, channel.times))
                times = channel.times[:: (every := max(round(rows / readings), 1))]
                moved = np.interp(times, history.times, history.controls[:, k])
                correlation, n_steps = answer(moved, channel.values[::every])
                text = f"{control.column}{of_trial} answers {channel.name} as an autopilot does ({correlation:.2f} is "
                text += f"the correlation of what is new in both, by chance at most {CHANCE / np.sqrt(len(times)):.2f}"
                text += "): it holds against waves and gusts, whose forces a fit takes for those of hull and rudder, "
                text += f"and only its {n_steps} own steps move the boat; "
                text += "" if axis in inferred else f'infer the forces ([disturbance] axes = ["{axis}"]), and '
                parts += [f"{text}fly a run without autopilot, with steps by a plan"] if correlation else []
    return ". ".join(parts)


def answer(control: np.ndarray, angle: np.ndarray) -> tuple[float, int]:
    """How far a control answers an angle, and how many steps of its own it has.

    Both (n,), at equal intervals. What is new in a change of the angle is not predicted by the changes of both before
    it, what is new in a change of the control not by its own (Haugh 1976). A plan does not know what is new in the
    angle, noise and gusts; an autopilot answers it in the same row, and not in the next.

    Returns `correlation` of the two, 0 if it is within chance, and `n_steps`.
    """
    moves, turns = np.diff(control), np.diff(angle)
    n = len(moves) - LAGS
    if n < 10 * LAGS or np.mean(np.abs(moves) > 1e-6 * np.ptp(control)) < MOVING:
        return 0.0, 0
    own, others = (np.stack([p[LAGS - k :][:n] for k in range(1, LAGS + 1)], axis=1) for p in (moves, turns))
    own = np.column_stack([own, np.ones(n)])
    new, sd = _new(moves[LAGS:], own)
    surprise, scale = _new(turns[LAGS:], np.column_stack([own, others, control[LAGS:-1]]))
    if not (sd and scale):
        return 0.0, 0
    now, later = (np.corrcoef(surprise[: n - k], new[k:])[0, 1] for k in (0, 1))
    answers = now > LEAST and (now - max(later, 0.0)) * np.sqrt(n) > CHANCE
    steps = np.flatnonzero(np.abs(new) >= LARGE * sd)  # of which those that follow closely are one
    return float(now) if answers else 0.0, int(np.count_nonzero(np.diff(steps, prepend=-n) > LAGS))


def _new(values: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """What known columns (n, k) do not predict of values (n,), large ones cut, and its robust standard deviation."""
    usual = np.ones(len(values), dtype=bool)
    for _ in range(3):
        rest = values - known @ np.linalg.lstsq(known[usual], values[usual])[0]
        sd = 1.4826 * float(np.median(np.abs(rest)))
        usual = np.abs(rest) <= LARGE * sd
    return np.clip(rest, -LARGE * sd, LARGE * sd), sd
