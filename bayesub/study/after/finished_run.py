"""A finished run, as other commands take it up: its study, posterior and estimates read back, its page made again."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from bayesub.findings.verdicts import NOT_CONVERGED, STATUS, in_words, worst
from bayesub.inference.baselines import Estimate
from bayesub.inference.sampling import CrossCheck, Posterior, posterior_file
from bayesub.io import toml_files
from bayesub.io.errors import InputError, error_source
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.quantities import QUANTITIES, replayed
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem.nuisance import of_boat
from bayesub.study.provenance import COMPUTED, copy_name
from bayesub.study.run import script
from bayesub.study.run.infer import DERIVED, ESTIMATES, POSTERIOR, conclude, read_back, saved_estimates
from bayesub.study.run.prepare import Setup, prepare
from bayesub.study.run.result import AGAIN, NUMBERS, StudyResult, load_result
from bayesub.study.run.run_folder import CONFIG, CROSS_CHECK, RunContext, config_of_run
from bayesub.study.schema.sensor_section import with_columns
from bayesub.study.schema.study_file import Study
from bayesub.study.schema.trial_section import CheckSection
from bayesub.study.sources import file_digest

OTHERS = {"design": "design with --resume", "prediction": "predict with --force", "comparison": "compare with --force"}


@dataclass(frozen=True)
class FinishedRun:
    """A run that came to its end."""

    folder: Path
    config: dict  # the content of its ``config.toml``
    study: Study  # whose files are the copies in the folder
    judged: str  # verdict when it ended (:class:`bayesub.study.run.result.StudyResult`)
    posterior: Posterior
    estimates: tuple[Estimate, ...]  # by the baselines

    @cached_property
    def verdict(self) -> str:
        """On the run as its folder is now (:data:`bayesub.findings.verdicts.STATUS`)."""
        return self.judged if self.posterior.converged else worst([self.judged, NOT_CONVERGED])

    @cached_property
    def rows(self) -> list[dict]:
        """The numbers of each parameter, as its report has them; none if that is not there."""
        file = self.folder / NUMBERS
        numbers = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        return [*numbers.get("parameters", []), *numbers.get("nuisance", [])]

    @property
    def doubt(self) -> str:
        """Why the run is in doubt, by its verdict; empty if it is not."""
        reasons = self.posterior.shortcomings if self.verdict == NOT_CONVERGED else ()
        return in_words(self.verdict, reasons) if STATUS[self.verdict] else ""

    def refuse_unconverged(self) -> None:
        """InputError for a run that has not converged, on which nothing is to be built."""
        if self.verdict == NOT_CONVERGED:
            what = f"{self.folder}: the run has not converged, and its posterior may be wrong"
            remedy = "raise max_steps of [sampler] in its study and continue it with --resume"
            raise InputError(f"{what}; {remedy}", "state")

    def refuse_quantities(self, wanted: Iterable[str]) -> None:
        """InputError for a quantity among what is asked for, if the run infers more of the boat than coefficients."""
        others = [name for name in self.posterior.names if of_boat(name, self.vehicle)]
        for name in (name for name in wanted if others and name in QUANTITIES):
            what = f"--for {name}: depends on {', '.join(others)} too, inferred in the run"
            raise InputError(f"{what}; ask for coefficients", "conflict", "--for")

    @cached_property
    def vehicle(self) -> Vehicle:
        """The boat of the study, with the columns that its actuators have in logs."""
        return with_columns(load_vehicle(self.study.vehicle, self.study.path), self.study.controls)

    @property
    def files(self) -> dict[str, Path]:
        """Name -> file that a prediction by this run depends on."""
        return {f"{self.folder}/{name}": self.folder / name for name in (CONFIG, POSTERIOR, ESTIMATES)}

    def setup(self, checks: Sequence[CheckSection] = ()) -> Setup:
        """The study made ready again, with other logs to predict than it had.

        InputError for a log that does not fit, and if the problem is not the one that the posterior is of.
        """
        setup = prepare(self.study.model_copy(update={"check": tuple(checks)}))
        if setup.problem.names != self.posterior.names:
            what = f"{self.folder}: was made by a version of bayesub that posed another problem of the same study"
            raise InputError(f"{what}; {AGAIN}", "state")
        return setup


def finished_run(folder: str | Path) -> FinishedRun:
    """Read the run of a study in TOML; it may have been copied from elsewhere.

    InputError for a folder that is no such run, a run that has not finished, and one that lacks its draws.
    """
    folder = Path(folder)
    config = config_of_study(folder)
    if "script_sha256" in config:
        raise InputError(f"{folder}: is the run of a script; give that of a study in TOML", "state")
    if "sources_sha256" not in config:
        raise InputError(f"{folder}: {CONFIG} has no sources_sha256; {AGAIN}", "state")
    if (result := load_result(folder)) is None:
        raise InputError(f"{folder}: the run has not finished; continue it with --resume", "state")
    if not (folder / POSTERIOR).exists():
        raise InputError(f"{folder}: {POSTERIOR} is missing; {AGAIN}", "state", POSTERIOR)
    posterior = posterior_file.load(folder / POSTERIOR)
    estimates = saved_estimates(folder)
    with error_source(str(folder)):
        study = saved_study(folder, config)
    return FinishedRun(folder, config, study, result.verdict, posterior, estimates)


def config_of_study(folder: Path, advice: str = "give the folder of the run of a study") -> dict:
    """The configuration of the run of a study; InputError for a folder of something else, with advice on what to do.

    In the advice ``{}`` is the command that writes the page of that folder again.
    """
    config = config_of_run(folder)
    for key, command in OTHERS.items():
        if key in config:
            raise InputError(f"{folder}: is a {key}; {advice.format(command)}", "state", key)
    return config


def saved_study(folder: Path, config: dict) -> Study:
    """The study of a run, whose files are the copies in its folder, or for a run of before 0.2 the files themselves."""
    source = folder / CONFIG
    content = {key: value for key, value in config.items() if key not in COMPUTED}
    study = toml_files.validate(content, Study, str(source))
    digests, places = config.get("files_sha256", {}), {}
    for name in dict.fromkeys((*study.files, *digests)):
        digest = digests.get(name, "")
        places[name] = folder / copy_name(name, digest) if "sources_sha256" in config else Path(name)
        if file_digest(places[name]) != digest:
            raise InputError(f"{folder}: {places[name]} has changed since the run; {AGAIN}", "state")
    return study.located(source, places, quick=config["quick_run"])


def redraw(
    folder: str | Path,
    *,
    study: str | Path | None = None,
    run_code: bool = False,
    pdf: bool = False,
    progress: Progress = SILENT,
) -> StudyResult:
    """Draw figures and report of a finished run again; the folder may have been copied from elsewhere.

    Of the run of a script `study` is the script to draw with; its own is taken where it is unchanged and `run_code` is
    given. Else no code runs that lies in the folder or that it names. The result has the seconds of the run.

    InputError for a folder that lacks something, which it names, and for a file that has changed since the run.
    """
    folder = Path(folder)
    config = config_of_study(folder, "bayesub {} writes its page again")
    if "script_sha256" in config:
        if study is None and not run_code:
            text = f"{folder}: its page is drawn by code, {script.place_of(config)}; if you trust it give --run-code"
            raise InputError(text, "missing", "--run-code")
        result = script.redraw(folder, config, Path(study) if study else None, pdf=pdf)
    elif study is not None:
        raise InputError(f"{folder}: is the run of a study in TOML, which needs no --study", "conflict", "--study")
    else:
        result = _redraw(folder, config, RunContext(folder, pdf, progress, commit=config["commit"]), run_code=run_code)
    if (saved := load_result(folder)) is not None:
        result = replace(result, seconds=saved.seconds)
        result.save()
    return result


def _redraw(folder: Path, config: dict, context: RunContext, *, run_code: bool) -> StudyResult:
    """The report of a study in TOML."""
    if not (folder / "numbers.json").exists():
        text = f"{folder}: the run has not finished, numbers.json is missing; continue it with --resume"
        raise InputError(text, "state", "numbers.json")
    if not (folder / POSTERIOR).exists():
        what = f"{folder}: {POSTERIOR} is missing: without the draws neither figures nor report can be drawn again"
        what += " (numbers.json and the figures that are there are those of the run)"
        raise InputError(f"{what}; {AGAIN} to have them", "state", POSTERIOR)
    load_result(folder)  # refuses what is not the posterior of the result
    study = saved_study(folder, config)
    posterior, estimates = posterior_file.load(folder / POSTERIOR), saved_estimates(folder)
    seconds = read_back(folder / "numbers.json", lambda numbers: numbers["seconds"])
    check = read_back(folder / CROSS_CHECK, CrossCheck.from_json) if (folder / CROSS_CHECK).exists() else None
    kept = folder / DERIVED
    setup = prepare(study, run_code=run_code and not kept.exists())
    if setup.quantities and not run_code and not kept.exists():
        code = ", ".join(dict.fromkeys(study.path(section.file) for section in study.derived))
        what = f"{folder}: {DERIVED} is missing, and its quantities come from code, {code}"
        raise InputError(f"{what}; if you trust it give --run-code", "missing", "--run-code")
    if setup.quantities and kept.exists():
        values = read_back(kept, lambda kept: tuple(replayed(q, *kept[q.name]) for q in setup.quantities))
        setup = replace(setup, quantities=values)
    return conclude(setup, context, estimates, posterior, check, seconds=seconds)
