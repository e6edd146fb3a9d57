"""The inference problem of one trial, posed from a vehicle, a manoeuvre and a record."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from bayesub.io.arguments import check_class, checked
from bayesub.io.errors import InputError, check_known
from bayesub.kernels import workspace
from bayesub.logs.log_files import ACCELERATIONS
from bayesub.model.disturbance import check_axes
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import choose_step, steps
from bayesub.model.vehicles import Vehicle
from bayesub.problem import likelihoods
from bayesub.problem.distributions import Prior
from bayesub.problem.disturbances import Disturbances, UnknownDisturbance
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.mounting import within_reach
from bayesub.problem.noise import Noise
from bayesub.problem.nuisance import Nuisance, find
from bayesub.problem.priors import CoefficientPrior, coefficient_set
from bayesub.problem.trial_problem import TrialProblem, joined
from bayesub.sensors.record import Channel, Record

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

    The prior is of the free coefficients, whose positions in a set are `columns` (n_coefficients,), and the nuisance
    parameters; `xi` (n_terms,) has the other coefficients. It is one of :func:`bayesub.model.simulator.steps`, s; for a
    boat that fails at the mean of the prior with all of them that of :func:`bayesub.model.simulator.choose_step`. If
    no step is short enough an InputError says so.
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
    worst = max(errors, key=lambda name: errors[name], default="")
    text = f"{manoeuvre.name}: no step down to {step:g} s keeps the error of '{worst}' below a tenth of its sd for all "
    text += "boats of the prior; give a step (dt, in a study dt_s)"
    raise InputError(text, "model", "dt")


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


_FAR = 1e-4  # probability of clocks further ahead, or further behind, than readings are kept for


class Problem(TrialProblem):
    """Free coefficients of a vehicle and nuisance parameters, to be inferred from a record of a manoeuvre.

    InputError if no coefficient is free, or a name of a coefficient, nuisance parameter or channel is not known. It has
    the attributes of a :class:`bayesub.problem.trial_problem.TrialProblem`, and `spread`, the prior as given.

    Parameters
    ----------
    vehicle : whose coefficients are inferred
    manoeuvre : that it flies
    record : of that manoeuvre; readings that an unknown clock may put before its start or after its end are left out
    free : names of the coefficients to infer, or a sub-problem or "all"; one whose prior centre is zero has no scale
        and stays fixed, and so does one that has no part in the sub-problem or belongs to planes that do not move
    prior : of the coefficients, from :mod:`bayesub.problem.priors`
    nuisance : name (:mod:`bayesub.problem.nuisance`) -> prior of one parameter, in the unit of its name
    noise : channel name -> noise model of :mod:`bayesub.problem.likelihoods`, for channels that differ from what their
        sd and resolution say: normal noise, rounded normal noise with the exact probability of the rounding interval,
        or without an sd the interval itself, within which the prior decides alone
    xi : (n_terms,) values of the coefficients that are not free; by default the vehicle's own
    dt : integration step, s; by default the longest whose error is below a tenth of the sd of every reading
        (:func:`bayesub.problem.problem.sensed_step`)
    disturbance : unmodelled forces whose histories are inferred too, after the nuisance parameters
    """

    @checked
    def __init__(
        self,
        vehicle: Vehicle,
        manoeuvre: Manoeuvre,
        record: Record,
        *,
        free: str | Iterable[str],
        prior: CoefficientPrior,
        nuisance: dict[str, Prior] | None = None,
        noise: dict[str, Noise] | None = None,
        xi: np.ndarray | None = None,
        dt: float | None = None,
        disturbance: UnknownDisturbance | None = None,
    ):
        xi = coefficient_set("xi", vehicle.xi if xi is None else xi, len(vehicle.xi))
        equations = vehicle.equations
        if isinstance(free, str):
            free = equations.active(subproblem=None if free == "all" else free)
        free = list(check_class("free", free, Iterable, key="free"))
        for name in (name for k, name in enumerate(free) if name in free[:k]):
            raise InputError(f"free: '{name}' is named twice; name it once", "conflict", "free")
        candidates = equations.columns(free)
        prior.check(equations.names)
        # Of any vehicle: a coefficient that is zero for this one may have a prior with another centre.
        active = equations.columns(equations.active(None, manoeuvre, manoeuvre.subproblem))
        columns = candidates[prior.has_scale(candidates, xi, equations) & np.isin(candidates, active)]
        if not columns.size:
            text = "no coefficient is free: every one named has a prior centre of zero or no effect on this manoeuvre"
            raise InputError(text, "missing", "free")
        noises = channel_noises(record.channels, noise or {})
        nuisance = dict(check_class("nuisance", nuisance or {}, Mapping, key="nuisance"))
        for name, one in nuisance.items():
            check_class(f"nuisance '{name}'", one, Prior, key=name)
        parameters = [find(name, vehicle, manoeuvre, record.channels, noises) for name in nuisance]
        for k, parameter in enumerate(parameters):
            if parameter.mount is not None and not parameter.mount.axis:  # a clock, and what its prior allows
                first, last = (float(nuisance[parameter.name].quantiles(p)[0]) for p in (_FAR, 1.0 - _FAR))
                parameters[k] = replace(parameter, later_s=(parameter.value - last, parameter.value - first))
        spans = {p.mount.instrument: p.later_s for p in parameters if p.mount is not None and not p.mount.axis}
        record = within_reach(record, spans, manoeuvre.duration)
        disturbances = None
        if disturbance is not None:
            disturbances = _disturbances(disturbance, vehicle, manoeuvre, record)
            parameters += [Nuisance(*pair) for pair in zip(disturbances.priors, disturbances.held, strict=True)]
            nuisance |= disturbances.priors
        forward_at = partial(ForwardModel, vehicle, manoeuvre, record, parameters, disturbances=disturbances)
        if dt is None:
            whole = joined(prior.on(columns, xi, equations), nuisance)
            dt = sensed_step(vehicle, manoeuvre, forward_at, noises, whole, columns, xi)
        forward = forward_at(dt)
        if disturbance is not None and disturbance.time_s < forward.simulator.step:
            text = f"disturbance: correlation_time_s is {disturbance.time_s:g} s and the time step "
            text += f"{forward.simulator.step:g} s; give a longer time, or a shorter step (dt_s)"
            raise InputError(text, "conflict", "correlation_time_s")
        super().__init__(forward, columns, xi, prior, nuisance, noises, record.values)


def _disturbances(disturbance, vehicle, manoeuvre, record) -> Disturbances:
    """The histories of a trial; InputError if its axes do not move or its readings cannot tell so many forces."""
    check_axes(disturbance.axes, vehicle.equations.subproblem(manoeuvre.subproblem))
    duration = max(float(channel.times[-1]) for channel in record.channels)
    disturbances = Disturbances(disturbance, vehicle, duration)
    n_readings = sum(len(channel.times) for channel in record.channels)
    if len(disturbance.axes) * disturbances.n_knots > n_readings:
        text = f"disturbance: {disturbances.n_knots:.6g} knots on each of {len(disturbance.axes)} axes are more "
        text += f"forces than the {n_readings} readings inform; give a longer knot_interval_s than "
        text += f"{disturbance.interval_s:.3g} s, or fewer axes"
        raise InputError(text, "limit", "knot_interval_s")
    return disturbances


def channel_noises(channels: Iterable[Channel], by_name: dict[str, Noise]) -> tuple[Noise, ...]:
    """The noise model of each channel: the one given by name, or what its sd and resolution say.

    Raises InputError for the name of a channel that is not among them, and for what is no noise model.
    """
    names = [channel.name for channel in channels]
    for name, noise in check_class("noise", by_name, Mapping, key="noise").items():
        check_known(name, names, f"noise: there is no channel '{name}'")
        check_class(f"noise: '{name}'", noise, Noise, key=name)
    return tuple(by_name.get(c.name) or likelihoods.reading_noise(c.sd, c.resolution) for c in channels)
