"""A study made ready: its trials simulated or read, the problem that they pose, and logs to predict."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from bayesub.io import seeds
from bayesub.io.errors import InputError, error_source
from bayesub.io.words import listed
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.quantities import Quantity
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.distributions import Prior
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.joint import JointProblem
from bayesub.problem.noise import Noise
from bayesub.problem.nuisance import find
from bayesub.problem.problem import Problem, channel_noises
from bayesub.problem.unseen import UnseenTrial
from bayesub.sensors import Channel
from bayesub.study.schema.prior_section import noise_models
from bayesub.study.schema.sensor_section import with_columns
from bayesub.study.schema.study_file import Study
from bayesub.study.schema.trial_log import Trial
from bayesub.study.schema.trial_section import CheckSection, TrialKeys
from bayesub.study.sources import file_digest


@dataclass(frozen=True)
class Setup:
    """A study made ready."""

    study: Study  # the study
    vehicle: Vehicle  # the boat of its file
    trials: dict[str, Trial]  # by name, which is "" for the only one
    problem: Problem | JointProblem  # what the trials pose
    unseen: tuple[UnseenTrial, ...]  # logs that are not fitted, which the posterior is to predict
    quantities: tuple[Quantity, ...]  # of the study's own, that follow from the coefficients
    # Poses the problem of another trial of the boat, of a manoeuvre and a record, with free coefficients, prior and
    # disturbance of the study
    pose: Callable[..., Problem]
    disturbance: UnknownDisturbance | None  # the unmodelled forces of the study

    def generator(self, stream: int, *members: int) -> np.random.Generator:
        """Random numbers of a stream of the study's seed (:mod:`bayesub.io.seeds`), from their beginning."""
        return seeds.generator(self.study.seed, stream, *members)


@dataclass(frozen=True)
class _Flight:
    """A trial, or a log that is not fitted, on its way from its section to its problem."""

    name: str
    label: str  # in error messages
    section: TrialKeys
    sensors: tuple
    trial: Trial  # one that is simulated is not flown before it is posed
    problem: Problem | None = None  # as soon as it is posed

    @property
    def is_fitted(self) -> bool:
        """Whether it is no log to predict."""
        return not isinstance(self.section, CheckSection)

    def posed(
        self, vehicle: Vehicle, pose: Callable[..., Problem], noise: dict, dt: float | None, rng: np.random.Generator
    ) -> "_Flight":
        """The same, flown, with its problem; `rng` is of the noise of its readings."""
        with error_source(self.label):
            trial = self.trial
            if not self.is_fitted:  # those unknowns of the study are left out whose channels and controls it lacks
                with_noise = trial.record.channels, channel_noises(trial.record.channels, noise)
                for name in filter(self.section.nuisance.__contains__, trial.nuisance):
                    find(name, vehicle, trial.manoeuvre, *with_noise)
                trial = replace(trial, nuisance=present(trial.nuisance, vehicle, trial.manoeuvre, *with_noise))
            given = {"nuisance": trial.nuisance, "noise": noise}
            if dt is None:  # the longest that the sensors do not notice, whatever they are going to read
                dt = pose(trial.manoeuvre, trial.record, **given).simulator.step
            trial = self.section.flown(trial, vehicle, self.sensors, dt, rng)
            return replace(self, trial=trial, problem=pose(trial.manoeuvre, trial.record, dt=dt, **given))


def prepare(study: Study, *, run_code: bool = False) -> Setup:
    """Simulate the truth and measure it, or read the logs, and pose the problem; InputErrors begin with the study file.

    The functions of its own quantities are run only if that is said; else their values are not numbers.
    The result is the same for the same study, bit for bit, on the same machine with the same versions.
    """
    with error_source(study.source):
        data_rng = seeds.generator(study.seed, seeds.DATA)
        vehicle = with_columns(load_vehicle(study.vehicle, study.path), study.controls)
        quantities = tuple(section.build(vehicle, study.path, run_code=run_code) for section in study.derived)
        flights = list(_flights(study, vehicle))
        _refuse_twins([flight for flight in flights if flight.section.data is not None])
        centre = vehicle.xi
        if study.prior.centre == "perturbed":
            guess_rng = seeds.generator(study.seed, seeds.GUESS)
            centre = priors.perturbed(vehicle.xi, study.prior.perturbation_sd, guess_rng)
        prior, fixed = study.prior.build(centre, vehicle, study.path)
        xi = vehicle.xi.copy()
        xi[vehicle.equations.columns(fixed)] = list(fixed.values())
        free = [name for name in study.free.names(vehicle.equations) if name not in fixed]
        disturbance = None
        if study.disturbance is not None:  # of which shares are of the forces of the hull in all trials
            manoeuvres = [flight.trial.manoeuvre for flight in flights if flight.is_fitted]
            disturbance = study.disturbance.build(
                [Simulator(vehicle, m, np.zeros(1), dt=study.dt_s) for m in manoeuvres]
            )
        noises = noise_models(study.noise, [flight.trial.record.channels for flight in flights])
        pose = partial(Problem, vehicle, free=free, prior=prior, xi=xi, disturbance=disturbance)
        asked = zip(flights, noises, strict=True)
        flights = [flight.posed(vehicle, pose, noise, study.dt_s, data_rng) for flight, noise in asked]
        fitted = {flight.name: flight for flight in flights if flight.is_fitted}
        problem = (
            fitted[""].problem if study.trials is None else JointProblem({n: f.problem for n, f in fitted.items()})
        )
        unseen = []
        for flight in flights[len(fitted) :]:
            with error_source(flight.label):
                unseen.append(flight.section.posed(flight.problem, problem))
        trials = {name: flight.trial for name, flight in fitted.items()}
        return Setup(study, vehicle, trials, problem, tuple(unseen), quantities, pose, disturbance)


def _flights(study: Study, vehicle: Vehicle) -> Iterator[_Flight]:
    """The trials of a study, and then the logs that are not fitted; InputError for one that is fitted too."""
    for name, section, sensors in study.each_trial():
        label = f"trial '{name}'" if name else ""
        with error_source(label):
            trial = section.build(vehicle, sensors, study.nuisance | section.nuisance, study.path)
        yield _Flight(name, label, section, sensors, trial)
    for check, sensors in study.each_check():
        label = f"check '{check.name}'"
        with error_source(label):
            for name, fitted, _ in study.each_trial() if check.data is not None else ():
                logs = [section.data and file_digest(Path(study.path(section.data))) for section in (check, fitted)]
                begins, ends = zip(*(section.window_s or (-np.inf, np.inf) for section in (check, fitted)), strict=True)
                if logs[0] == logs[1] and max(begins) < min(ends):
                    where = f"is fitted in trial '{name}'" if name else "is fitted by this study"
                    text = f"{check.data} {where} and says nothing about prediction; give a log that is not fitted"
                    text += ", or a window_s to both that does not overlap"
                    raise InputError(text, "conflict", "check.data")
            trial = check.build(vehicle, sensors, check.nuisances(study.nuisance), study.path)
        yield _Flight(check.name, label, check, sensors, trial)


def _refuse_twins(logs: Sequence[_Flight]) -> None:
    """InputError for readings of a fitted trial that another trial or a log to predict has too."""
    for k, later in enumerate(logs):
        for earlier in (log for log in logs[:k] if log.is_fitted):
            if names := later.trial.record.shared_with(earlier.trial.record):
                text = f"{later.label}: {later.section.data} has the same readings of {listed(names)} as "
                text += f"{earlier.label or 'the log that is fitted'}, {earlier.section.data}"
                why = "which would count twice" if later.is_fitted else "which say nothing about prediction"
                text += f", {why}; leave one of the two out, or give them a window_s each that does not overlap"
                raise InputError(text, "conflict", "data")


def present(
    nuisance: dict[str, Prior],
    vehicle: Vehicle,
    manoeuvre: Manoeuvre,
    channels: Sequence[Channel] = (),
    noises: Sequence[Noise] = (),
) -> dict[str, Prior]:
    """Those of the nuisance parameters that a vehicle has on a manoeuvre, with channels and their noise models."""
    unknown = {}
    for name, prior in nuisance.items():
        with suppress(InputError):
            find(name, vehicle, manoeuvre, channels, noises)
            unknown[name] = prior
    return unknown
