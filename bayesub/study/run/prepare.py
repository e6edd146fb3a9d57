"""A study made ready: its trials simulated or read, the problem that they pose, and logs to predict."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bayesub.io.errors import InputError, error_source
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.quantities import Quantity
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.joint import JointProblem
from bayesub.problem.nuisance import find
from bayesub.problem.problem import Problem, channel_noises
from bayesub.problem.unseen import UnseenTrial
from bayesub.study.provenance import file_digest
from bayesub.study.schema.check_section import CheckSection
from bayesub.study.schema.control_section import with_columns
from bayesub.study.schema.prior_section import noise_models
from bayesub.study.schema.study_file import Study
from bayesub.study.schema.trial_log import Trial


@dataclass(frozen=True)
class Setup:
    """A study made ready.

    Attributes
    ----------
    study : Study
        The study.
    vehicle : Vehicle
        The boat of its file.
    trials : dict of str to Trial
        By name, which is "" for the only one.
    problem : Problem or JointProblem
        What the trials pose.
    unseen : tuple of UnseenTrial
        Logs that are not fitted, which the posterior is to predict.
    quantities : tuple of Quantity
        Of the study's own, that follow from the coefficients.
    pose : callable
        Poses the problem of another trial of the boat, of a manoeuvre and a record: a Problem with its free
        coefficients, its prior and its disturbance.
    sqp_rng, sampler_rng, check_rng : numpy.random.Generator
        Independent streams of the study's seed.
    """

    study: Study
    vehicle: Vehicle
    trials: dict[str, Trial]
    problem: Problem | JointProblem
    unseen: tuple[UnseenTrial, ...]
    quantities: tuple[Quantity, ...]
    pose: Callable[..., Problem]
    sqp_rng: np.random.Generator
    sampler_rng: np.random.Generator
    check_rng: np.random.Generator


def prepare(study: Study) -> Setup:
    """Simulate the truth and measure it, or read the logs, and pose the problem.

    The result is the same for the same study, bit for bit, on the same machine with the same versions.

    Raises
    ------
    InputError
        Begins with the study file.
    """
    with error_source(study.source):
        return _prepare(study)


def _prepare(study: Study) -> Setup:
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(study.seed).spawn(5)]
    data_rng, guess_rng, *others = streams
    vehicle = with_columns(load_vehicle(study.vehicle, study.path), study.controls)
    quantities = tuple(section.build(vehicle, study.path) for section in study.derived)
    trials = {}
    for name, trial, sections in study.each_trial():
        with error_source(_label(name)):
            trials[name] = trial.build(vehicle, sections, study.nuisance | trial.nuisance, study.path)
    checks = {check.name: _built(check, vehicle, sections, study) for check, sections in study.each_check()}
    centre = vehicle.xi
    if study.prior.centre == "perturbed":
        centre = priors.perturbed(vehicle.xi, study.prior.perturbation_sd, guess_rng)
    prior, fixed = study.prior.build(centre, vehicle, study.path)
    xi = vehicle.xi.copy()
    xi[vehicle.equations.columns(fixed)] = list(fixed.values())
    free = [name for name in study.free.names(vehicle.equations) if name not in fixed]
    disturbance = _disturbance(study, vehicle, trials)
    records = [trial.record for trial in (*trials.values(), *checks.values())]
    noises = noise_models(study.noise, [record.channels for record in records])
    pose = partial(Problem, vehicle, free=free, prior=prior, xi=xi, disturbance=disturbance)

    def posed(section, trial, sensors, noise):
        given, step = {"nuisance": trial.nuisance, "noise": noise}, study.dt_s
        if step is None:  # the longest that the sensors do not notice, whatever they are going to read
            step = pose(trial.manoeuvre, trial.record, **given).simulator.step
        trial = section.flown(trial, vehicle, sensors, step, data_rng)
        return trial, pose(trial.manoeuvre, trial.record, dt=step, **given)

    problems = {}
    for (name, section, sensors), noise in zip(study.each_trial(), noises, strict=False):
        with error_source(_label(name)):
            trials[name], problems[name] = posed(section, trials[name], sensors, noise)
    problem = problems[""] if study.trials is None else JointProblem(problems)
    unseen = []
    for (check, sensors), noise in zip(study.each_check(), noises[len(trials) :], strict=True):
        with error_source(_check_label(check)):
            trial = _with_own_unknowns(checks[check.name], check, vehicle, noise)
            unseen.append(check.posed(posed(check, trial, sensors, noise)[1], problem))
    return Setup(study, vehicle, trials, problem, tuple(unseen), quantities, pose, *others)


def _built(check: CheckSection, vehicle: Vehicle, sections, study: Study) -> Trial:
    """The trial of a log that is not fitted; InputError for one that is fitted too."""
    with error_source(_check_label(check)):
        for name, fitted, _ in study.each_trial():
            logs = [section.data and file_digest(Path(study.path(section.data))) for section in (check, fitted)]
            if check.data is not None and logs[0] == logs[1]:
                where = f"in trial '{name}'" if name else "by this study"
                raise InputError(
                    f"{check.data} is fitted {where} and says nothing about prediction; give a log that is not fitted",
                    "conflict",
                    "check.data",
                )
        return check.build(vehicle, sections, check.nuisances(study.nuisance), study.path)


def _with_own_unknowns(trial: Trial, check: CheckSection, vehicle: Vehicle, noise: dict) -> Trial:
    """The trial of a log without those unknowns of the study that are of channels and controls it does not have."""
    channels = trial.record.channels
    noises = channel_noises(channels, noise)
    for name in filter(check.nuisance.__contains__, trial.nuisance):
        find(name, vehicle, trial.manoeuvre, channels, noises)
    return replace(trial, nuisance=present(trial.nuisance, vehicle, trial.manoeuvre, channels, noises))


def present(nuisance: dict, vehicle: Vehicle, manoeuvre: Manoeuvre, channels=(), noises=()) -> dict:
    """Those of the nuisance parameters that a vehicle has on a manoeuvre, with channels and their noise models."""
    unknown = {}
    for name, prior in nuisance.items():
        with suppress(InputError):
            find(name, vehicle, manoeuvre, channels, noises)
            unknown[name] = prior
    return unknown


def _disturbance(study: Study, vehicle: Vehicle, trials: dict[str, Trial]) -> UnknownDisturbance | None:
    """The unmodelled forces that a study infers, of which shares are of the forces of the hull in all trials."""
    if study.disturbance is None:
        return None
    at_start = np.zeros(1)
    simulators = [Simulator(vehicle, trial.manoeuvre, at_start, dt=study.dt_s) for trial in trials.values()]
    return study.disturbance.build(simulators)


def _check_label(check: CheckSection) -> str:
    """A log that is not fitted, in error messages."""
    return f"check '{check.name}'"


def _label(name: str) -> str:
    """A trial in error messages."""
    return f"trial '{name}'" if name else ""
