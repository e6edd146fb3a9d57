"""Integration steps: the longest one that flies a manoeuvre accurately, and that of true motions."""

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import MAX_STEPS, Simulator
from bayesub.model.vehicles import Vehicle

STEP_TOLERANCE_M = 0.05  # position change on halving the step that an automatic step must keep
FINER = 10.0  # steps of a true motion in one of the model that is fitted to its record


def true_step(step: float, manoeuvre: Manoeuvre) -> float:
    """The step at which a motion is flown whose record is fitted at `step` (s): a tenth, as MAX_STEPS allow."""
    return min(step, max(step / FINER, 2.0 * manoeuvre.duration / MAX_STEPS))


def choose_step(vehicle: Vehicle, manoeuvre: Manoeuvre, subproblem: str | None, attitude: str = "euler") -> float:
    """The largest step of 1, 0.5, 0.2, 0.1, .. s that keeps the position within 5 cm of the one at half the step.

    The search starts at a tenth of a ship length travelled.

    Raises
    ------
    InputError
        If a boat that completes the manoeuvre has no such step.
    """
    times = np.linspace(0.0, manoeuvre.duration, 201)
    ladder = steps(vehicle, manoeuvre)
    for step in ladder:
        coarse, fine = (
            Simulator(vehicle, manoeuvre, times, dt=dt, subproblem=subproblem, attitude=attitude).run(vehicle.xi)[0][
                0, :, :3
            ]
            for dt in (step, step / 2)
        )
        # A vehicle that fails is compared up to its failure.
        both = np.isfinite(coarse[:, 0]) & np.isfinite(fine[:, 0])
        if both.any() and np.linalg.norm(coarse[both] - fine[both], axis=1).max() < STEP_TOLERANCE_M:
            return step
    if both.all():
        raise InputError(
            f"{manoeuvre.name}: no step down to {ladder[-1]:g} s keeps the position of '{vehicle.name}' within 5 cm; "
            "give a step (dt)",
            "model",
            "dt",
        )
    return ladder[-1]


def steps(vehicle: Vehicle, manoeuvre: Manoeuvre) -> list[float]:
    """The steps that may be chosen: 5, 2, 1, 0.5, .. s from a tenth of a ship length travelled down.

    The shortest is such that a flight at half of it has no more than MAX_STEPS.
    """
    ladder = [m * 10.0**e for e in range(1, -5, -1) for m in (5, 2, 1)]
    ladder = [step for step in ladder if step <= 0.1 * vehicle.length_m / vehicle.speed_mps] or ladder[-1:]
    return [step for step in ladder if 2.0 * manoeuvre.duration / step <= MAX_STEPS] or ladder[:1]
