"""The prescription of a study: what to measure or fly next, by its posterior."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesub.design.judge import Judge
from bayesub.design.knowledge import KnownBefore
from bayesub.design.limits import N_DRAWS, Limits, Range, usual_limits
from bayesub.design.plan import with_ready_made
from bayesub.design.prescription import Prescription, prescribe
from bayesub.inference.sampling import Posterior
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.sensors import flat
from bayesub.sensors.sensor import channel_name
from bayesub.study.run.prepare import Setup
from bayesub.study.schema.prior_section import noise_models


def prescription(
    setup: Setup, posterior: Posterior, wanted: Sequence[str] = (), limits: Limits | None = None, seed: int = 0
) -> tuple[Prescription, Range]:
    """That after the last trial of a study, for coefficients and quantities, by default five coefficients.

    With it the flights that show whether a manoeuvre keeps the limits, by default the usual ones. InputError for a name
    that is not known, and draws of which a coefficient is always the same.
    """
    judge, manoeuvre = judge_of_next(setup, posterior)
    sets = KnownBefore.by(posterior, setup.vehicle).sets(judge.vehicle, N_DRAWS, np.random.default_rng(seed))
    within = limits or usual_limits(setup.vehicle)
    flights = Range(judge.vehicle, within, sets, judge.subproblem, judge.step_s or judge.accurate_step(manoeuvre))
    return with_ready_made(prescribe(judge, manoeuvre, wanted), flights), flights


def judge_of_next(setup: Setup, posterior: Posterior) -> tuple[Judge, Manoeuvre]:
    """The judge of a next trial, read as the last one of a study, whose prior is a posterior; and that manoeuvre.

    Start, current, body and whatever else is unknown besides coefficients are expected where the posterior has them.
    """
    study, vehicle = setup.study, setup.vehicle
    *_, (name, posed, mean) = setup.problem.each_trial(posterior.draws.mean(axis=0))
    (sections,) = (sections for one, _, sections in study.each_trial() if one == name)
    trial = setup.trials[name]
    # A log that was thinned, or has gaps, is read that way again.
    intervals = {c.name: float(np.median(np.diff(c.times))) for c in trial.record.channels if len(c.times) > 1}
    sensors = [
        replace(sensor, interval_s=intervals.get(channel_name(sensor.quantity), sensor.interval_s))
        for sensor in flat([section.build() for section in sections])
    ]
    *_, noise = noise_models(study.noise, [one.record.channels for one in setup.trials.values()])
    known = KnownBefore.by(posterior, vehicle)
    expected = {one: value for one, value in zip(posed.names, mean.tolist(), strict=True) if one in trial.nuisance}
    judge = Judge(
        known.vehicle(vehicle), tuple(sensors), known.names, nuisance=trial.nuisance, expected=expected, noise=noise,
        disturbance=setup.disturbance, subproblem=trial.manoeuvre.subproblem, step_s=posed.simulator.step,
    )  # fmt: skip
    return known.judge(judge), trial.manoeuvre
