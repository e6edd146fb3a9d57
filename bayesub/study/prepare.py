"""A study made ready: its trials simulated or read, and the problem that they pose."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from bayesub.io.errors import error_source
from bayesub.model.simulate import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.joint import JointProblem
from bayesub.problem.problem import Problem
from bayesub.study.control_section import with_columns
from bayesub.study.prior_section import noise_models
from bayesub.study.study_file import Study
from bayesub.study.trial_log import Trial


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
    sqp_rng, sampler_rng, check_rng : numpy.random.Generator
        Independent streams of the study's seed.
    """

    study: Study
    vehicle: Vehicle
    trials: dict[str, Trial]
    problem: Problem | JointProblem
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
    trials = {}
    for name, trial, sections in study.each_trial():
        with error_source(_label(name)):
            trials[name] = trial.build(vehicle, sections, study.nuisance | trial.nuisance, study.path)
    centre = vehicle.xi
    if study.prior.centre == "perturbed":
        centre = priors.perturbed(vehicle.xi, study.prior.perturbation_sd, guess_rng)
    prior, fixed = study.prior.build(centre, vehicle, study.path)
    xi = vehicle.xi.copy()
    xi[vehicle.equations.columns(fixed)] = list(fixed.values())
    free = [name for name in study.free.names(vehicle.equations) if name not in fixed]
    disturbance = _disturbance(study, vehicle, trials)
    noises = noise_models(study.noise, [trial.record.channels for trial in trials.values()])
    pose = partial(Problem, vehicle, free=free, prior=prior, xi=xi, disturbance=disturbance)
    problems = {}
    for (name, section, sensors), noise in zip(study.each_trial(), noises, strict=True):
        with error_source(_label(name)):
            trial, step = trials[name], study.dt_s
            given = {"nuisance": trial.nuisance, "noise": noise}
            if step is None:  # the longest that the sensors do not notice, whatever they are going to read
                step = pose(trial.manoeuvre, trial.record, **given).simulator.step
            trials[name] = trial = section.flown(trial, vehicle, sensors, step, data_rng)
            problems[name] = pose(trial.manoeuvre, trial.record, dt=step, **given)
    problem = problems[""] if study.trials is None else JointProblem(problems)
    return Setup(study, vehicle, trials, problem, *others)


def _disturbance(study: Study, vehicle: Vehicle, trials: dict[str, Trial]) -> UnknownDisturbance | None:
    """The unmodelled forces that a study infers, of which shares are of the forces of the hull in all trials."""
    if study.disturbance is None:
        return None
    at_start = np.zeros(1)
    simulators = [Simulator(vehicle, trial.manoeuvre, at_start, dt=study.dt_s) for trial in trials.values()]
    return study.disturbance.build(simulators)


def _label(name: str) -> str:
    """A trial in error messages."""
    return f"trial '{name}'" if name else ""
