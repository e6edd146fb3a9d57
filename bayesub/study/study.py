"""Studies: a TOML file with one inference question, run into a folder that explains itself."""

import hashlib
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pydantic

from bayesub import baselines, identifiability
from bayesub.io import toml_files
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError, error_source
from bayesub.io.toml_files import Positive, Section
from bayesub.model import coefficients
from bayesub.model.linear_form import linear_systems, stacked
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.joint import JointProblem
from bayesub.problem.problem import Problem
from bayesub.report.report import write_report
from bayesub.sampling import CrossCheck, cross_check, posterior_file, sample
from bayesub.sampling.posterior import Criteria
from bayesub.study.prior_section import AnyNoiseSection, PriorSection, noise_models
from bayesub.study.run_folder import environment
from bayesub.study.sensor_section import AnySensorSection
from bayesub.study.trial_log import Trial
from bayesub.study.trial_section import TrialKeys, TrialSection

COMPUTED = ("versions", "commit", "quick_run", "files_sha256")  # keys of config.toml that a study file does not have
CHECKED = "cross_check.json"


class FreeSection(Section):
    coefficients: Literal["horizontal", "vertical", "all"] | tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        if isinstance(self.coefficients, str):
            return coefficients.SUBPROBLEMS.get(self.coefficients, coefficients.NAMES)
        return self.coefficients


class BaselinesSection(Section):
    linear_least_squares: bool = True
    sqp_starts: int = pydantic.Field(default=5, ge=0, le=1000)


class SamplerSection(Section):
    n_ensembles: int = pydantic.Field(default=4, ge=1, le=64)
    n_walkers: int | None = pydantic.Field(default=None, ge=4, le=4096)
    max_steps: int = pydantic.Field(default=20_000, ge=100)
    rhat: float = pydantic.Field(default=1.01, gt=1.0)
    ess: Positive = 400.0
    taus: Positive = 25.0


class Study(TrialKeys):
    """The content of a study file. `seed` gives a stream of random numbers each to data, guess, SQP and sampling.

    There is one trial, simulated (`manoeuvre`) or from a log (`data`), or there are several, in `trials`.
    """

    SOURCES: ClassVar = ("manoeuvre", "data", "trials")

    name: str = pydantic.Field(pattern=r"^[A-Za-z0-9_-]+$")
    question: str = ""
    vehicle: str
    trials: tuple[TrialSection, ...] | None = pydantic.Field(default=None, min_length=1)
    seed: int = pydantic.Field(ge=0)
    dt_s: Positive | None = None
    sensors: tuple[AnySensorSection, ...] = ()
    free: FreeSection
    prior: PriorSection
    noise: dict[str, AnyNoiseSection] = pydantic.Field(default_factory=dict)
    baselines: BaselinesSection = BaselinesSection()
    sampler: SamplerSection = SamplerSection()
    quick: dict = pydantic.Field(default_factory=dict)

    @pydantic.model_validator(mode="after")
    def _consistent(self):
        names = [name for name, *_ in self.each_trial()]
        for name, trial, sections in self.each_trial():
            of = f" for trial '{name}'" if name else ""
            if names.count(name) > 1:
                raise ValueError(f"two trials are named '{name}'")
            if not sections:
                raise ValueError(f"give at least one of [[sensors]]{of}")
            if trial.data is not None and self.prior.centre == "perturbed":
                raise ValueError(
                    "prior.centre 'perturbed' is a guess about a simulated truth, and contradicts 'data'; leave it "
                    "out, the centre is then the vehicle file"
                )
        return self

    def each_trial(self) -> Iterator[tuple[str, TrialKeys, tuple]]:
        """Name ("" for the only one), source and sensor sections of each trial."""
        if self.trials is None:
            yield "", self, self.sensors
        for trial in self.trials or ():
            yield trial.name, trial, self.sensors if trial.sensors is None else trial.sensors

    def located(self, folder: Path) -> "Study":
        """The same with the paths of files, which are relative to `folder`, made absolute."""
        changes = {"vehicle": toml_files.located(self.vehicle, folder)}
        if self.prior.table is not None:
            table = toml_files.absolute(self.prior.table, folder)
            changes["prior"] = self.prior.model_copy(update={"table": table})
        if self.trials is not None:
            changes["trials"] = tuple(trial.located(folder) for trial in self.trials)
        return super().located(folder).model_copy(update=changes)

    @property
    def files(self) -> list[Path]:
        """The files that it names: vehicle, table of priors, manoeuvres and logs that are not built in."""
        trials = [trial for _, trial, _ in self.each_trial()]
        paths = [self.prior.table, *(trial.data for trial in trials)]
        names = [self.vehicle, *(trial.manoeuvre for trial in trials)]
        paths += [name for name in names if name is not None and Path(name).suffix]
        return [Path(path) for path in paths if path is not None]


@dataclass(frozen=True)
class Setup:
    """A study made ready: its trials by name ("" for the only one), and the problem that they pose."""

    study: Study
    vehicle: Vehicle
    trials: dict[str, Trial]
    problem: Problem | JointProblem
    sqp_rng: np.random.Generator
    sampler_rng: np.random.Generator


def load_study(path: str | Path, *, quick: bool = False) -> Study:
    """Read a study file; with `quick`, its ``[quick]`` section overrides the others."""
    path = Path(path)
    study = toml_files.read_toml(path, Study)
    if quick:
        content = study.model_dump(exclude_none=True)
        for section, changes in study.quick.items():
            if isinstance(changes, dict) and isinstance(content.get(section), dict):
                content[section] |= changes
            else:
                content[section] = changes
        study = toml_files.validate(content, Study, f"{path} with its [quick] section")
    return study.located(path.parent)


def prepare(study: Study) -> Setup:
    """Simulate the truth and measure it, or read the logs, and pose the problem; the same for the same study, bit for
    bit.
    """
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(study.seed).spawn(4)]
    data_rng, guess_rng, sqp_rng, sampler_rng = streams
    vehicle = load_vehicle(study.vehicle)
    trials = {}
    for name, trial, sections in study.each_trial():
        with error_source(f"trial '{name}'" if name else ""):
            nuisance = study.nuisance | trial.nuisance
            trials[name] = trial.build(vehicle, sections, nuisance, study.dt_s, data_rng)
    centre = vehicle.xi
    if study.prior.centre == "perturbed":
        centre = priors.perturbed(vehicle.xi, study.prior.perturbation_sd, guess_rng)
    prior, fixed = study.prior.build(centre, vehicle)
    xi = vehicle.xi.copy()
    xi[coefficients.columns(fixed)] = list(fixed.values())
    free = [name for name in study.free.names if name not in fixed]
    noises = noise_models(study.noise, [trial.record.channels for trial in trials.values()])
    problems = {}
    for (name, trial), noise in zip(trials.items(), noises, strict=True):
        with error_source(f"trial '{name}'" if name else ""):
            problems[name] = Problem(
                vehicle,
                trial.manoeuvre,
                trial.record,
                free=free,
                prior=prior,
                nuisance=trial.nuisance,
                noise=noise,
                xi=xi,
                dt=trial.truth.simulator.step if trial.truth else study.dt_s,
            )
    problem = problems[""] if study.trials is None else JointProblem(problems)
    return Setup(study, vehicle, trials, problem, sqp_rng, sampler_rng)


def completed(study: Study, *, quick: bool) -> dict:
    """The study with every default filled in, and what else the result depends on."""
    named = study.model_dump(exclude_none=True, mode="json")
    return named | {"files_sha256": _digests(study)} | environment(quick=quick)


def _digests(study: Study) -> dict[str, str]:
    """The SHA-256 of each file that the study names, so that a run is not continued or drawn again with another."""
    digests = {}
    for path in study.files:
        with toml_files.reading(path), path.open("rb") as file:
            digests[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()
    return digests


def run(study: Study, folder: Path, *, check: bool = False, progress=None) -> bool:
    """Do the work of a study in an opened folder; True if the posterior converged and the check agrees, if any.

    check : sample with NUTS too and compare
    progress : object with ``stage(name)``, called when a stage begins, and ``update(fraction, text)``; a text
        that begins "3 of 5" counts items, whose rate is shown
    """
    began = time.perf_counter()
    progress = progress or _Silent()
    progress.stage("simulate or read the trials")
    setup = prepare(study)
    problem = setup.problem
    for name, trial in setup.trials.items():
        trial.record.save(folder / (f"record_{name}.csv" if name else "record.csv"))
    problem.predicted(np.repeat(problem.prior.mean[None], 16, axis=0))  # compiles, so that nothing below does
    seconds = {"simulation and compilation": time.perf_counter() - began}

    estimates = []
    truths = [trial.truth for trial in setup.trials.values()]
    if study.baselines.linear_least_squares and all(truths):  # a log has no noise-free motion
        progress.stage("linear least squares")
        plain = problem.naive()
        systems = stacked([linear_systems(truth, free=plain.names) for truth in truths])
        guess = dict(zip(plain.names, plain.prior.mean, strict=True))
        estimates.append(baselines.linear_least_squares(systems, guess).completed(guess))
        seconds["linear least squares"] = estimates[-1].seconds
    if study.baselines.sqp_starts:
        progress.stage("SQP")
        n = study.baselines.sqp_starts
        estimates.append(
            baselines.sqp(
                problem.naive(),
                rng=setup.sqp_rng,
                n_starts=n,
                progress=lambda done: progress.update(done / n, f"{done} of {n} starts"),
            )
        )
        seconds["SQP"] = estimates[-1].seconds

    progress.stage("sample the posterior")
    sampler = study.sampler
    posterior = sample(
        problem,
        rng=setup.sampler_rng,
        n_ensembles=sampler.n_ensembles,
        n_walkers=sampler.n_walkers,
        max_steps=sampler.max_steps,
        criteria=Criteria(sampler.rhat, sampler.ess, sampler.taus),
        checkpoint=folder / "chain",
        progress=progress.update,
    )
    seconds["sampling"] = posterior.seconds
    posterior_file.save(posterior, folder / "posterior.nc")
    write_text(folder / "estimates.json", json.dumps([e.to_json() for e in estimates], indent=1))
    checked = None
    if check:
        progress.stage("cross-check with NUTS")
        rng = np.random.default_rng(np.random.SeedSequence(study.seed, spawn_key=(4,)))  # after those of `prepare`
        checked = cross_check(problem, posterior, rng=rng, progress=progress.update)
        write_text(folder / CHECKED, json.dumps(checked.to_json(), indent=1))
    progress.stage("figures and report")
    spectrum = identifiability.fisher(problem, posterior.best)
    seconds["all before the report"] = time.perf_counter() - began
    write_report(folder, problem, estimates, spectrum, posterior, study=study, seconds=seconds, check=checked)
    return posterior.converged and (checked is None or checked.verdict == "agree")


def redraw(folder: Path) -> bool:
    """Draw figures and report of a finished run again, from its saved results; as :func:`run` does."""
    file = folder / "config.toml"
    if not file.exists():
        raise InputError(f"{folder}: is not a run folder, config.toml is missing")
    content = toml_files.read_toml_table(file)
    study = toml_files.validate({k: v for k, v in content.items() if k not in COMPUTED}, Study, str(file))
    for name in ("posterior.nc", "estimates.json", "numbers.json"):
        if not (folder / name).exists():
            raise InputError(f"{folder}: {name} is missing, the run has not finished; continue it with --resume")
    for path, digest in _digests(study).items():
        if content.get("files_sha256", {}).get(path) != digest:
            raise InputError(f"{folder}: {path} has changed since the run; run the study again")
    setup = prepare(study)
    posterior = posterior_file.load(folder / "posterior.nc")
    try:
        estimates = [baselines.Estimate.from_json(e) for e in json.loads((folder / "estimates.json").read_text())]
        seconds = json.loads((folder / "numbers.json").read_text())["seconds"]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{folder}: estimates.json or numbers.json is damaged ({error}); run the study again"
        ) from None
    file = folder / CHECKED
    checked = CrossCheck.from_json(json.loads(file.read_text())) if file.exists() else None
    spectrum = identifiability.fisher(setup.problem, posterior.best)
    write_report(folder, setup.problem, estimates, spectrum, posterior, study=study, seconds=seconds, check=checked)
    return posterior.converged and (checked is None or checked.verdict == "agree")


class _Silent:
    def stage(self, name):
        pass

    def update(self, fraction, text):
        pass
