"""The integration step of a fit: the longest whose discretisation error the sensors do not notice."""

from collections.abc import Callable, Sequence

import numpy as np

from bayesub.io.errors import InputError
from bayesub.kernels import workspace
from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import choose_step, steps
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import Prior
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.noise import Noise

TOLERANCE = 0.1  # largest discretisation error of a reading, in standard deviations of its noise
N_DRAWS = workspace.LANES - 1  # of the prior: with its mean one block of the kernels
ON_JUMPS = 0.01  # share of the readings of an acceleration that may fall to the other side of a jump
_SEED = 8  # of the draws, so that a problem has the same step each time


def sensed_step(
    vehicle: Vehicle,
    manoeuvre: Manoeuvre,
    forward_at: Callable[[float], ForwardModel],
    noises: Sequence[Noise],
    prior: Prior,
    columns: np.ndarray,
    xi: np.ndarray,
) -> float:
    """The longest step whose discretisation error is below a tenth of the standard deviation of every reading.

    The error is twice the difference to half the step: controls have kinks and forces have jumps, and there the error
    of Runge-Kutta 4 falls no faster than the step. It is looked at for the mean of the prior and seven draws from it;
    a draw whose simulation fails at both steps has no likelihood and is left out. Accelerations jump with the forces,
    and a reading next to a jump may fall to the other side at any step, so one in a hundred of them is left out.

    Parameters
    ----------
    vehicle : Vehicle
        Of the problem.
    manoeuvre : Manoeuvre
        That it flies.
    forward_at : callable
        Gives the forward model with a step, s.
    noises : sequence of Noise
        The noise model of each channel.
    prior : Prior
        Of the free coefficients, followed by the nuisance parameters.
    columns : (n_coefficients,) array
        Positions of the free coefficients in a set.
    xi : (n_terms,) array
        Values of the other coefficients.

    Returns
    -------
    float
        One of :func:`bayesub.model.simulator.steps`, s; for a boat that fails at the mean of the prior with all of them
        that of :func:`bayesub.model.simulator.choose_step`.

    Raises
    ------
    InputError
        If no step is short enough.
    """
    parameters = np.vstack([prior.mean, prior.sample(np.random.default_rng(_SEED), N_DRAWS)])
    sets = np.repeat(xi[None], len(parameters), axis=0)
    sets[:, columns], values = np.split(parameters, [len(columns)], axis=1)
    predictions: dict[float, tuple[ForwardModel, np.ndarray]] = {}

    def predicted(step):
        if step not in predictions:
            forward = forward_at(step)
            predictions[step] = forward, forward.predicted(sets, values)[0]
        return predictions[step]

    completed, errors = False, {}
    for step in steps(vehicle, manoeuvre):
        (forward, coarse), (_, fine) = predicted(step), predicted(step / 2)
        ends = [np.isfinite(readings[:, 0]) for readings in (coarse, fine)]
        completed |= bool(ends[0][0] and ends[1][0])
        if not (ends[0][0] and np.array_equal(*ends)):
            continue
        errors = _errors(forward, noises, values[ends[0]], 2.0 * np.abs(coarse - fine)[ends[0]])
        if max(errors.values()) < TOLERANCE:
            return step
    if not completed:
        return choose_step(vehicle, manoeuvre, forward.simulator.subproblem)
    worst = max(errors, key=errors.get, default="")
    raise InputError(
        f"{manoeuvre.name}: no step down to {step:g} s keeps the error of '{worst}' below a tenth of its sd for all "
        "boats of the prior; give a step (dt, in a study dt_s)",
        "model",
        "dt",
    )


def _errors(forward, noises, values, differences) -> dict[str, float]:
    """Channel -> largest of differences (n_batch, n_readings), in standard deviations of its noise."""
    errors = {}
    channels = zip(forward.record.channels, noises, forward.measurement.slices, strict=True)
    for channel, noise, part in channels:
        sd = getattr(noise, "sd", 0.0)
        for attribute, k, factor in forward.nuisances.of_noise(channel):
            if attribute == "sd":
                sd = factor * values[:, k : k + 1]
        scale = np.where(np.less(sd, 0.0), np.inf, np.hypot(sd, getattr(noise, "resolution", 0.0) / np.sqrt(12.0)))
        ascending = np.sort(differences[:, part] / scale, axis=1)
        n = ascending.shape[1]
        left_out = min(np.ceil(ON_JUMPS * n), n - 1) if channel.state in ACCELERATIONS else 0
        errors[channel.name] = float(ascending[:, n - 1 - int(left_out)].max())
    return errors
