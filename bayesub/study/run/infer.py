"""The work of a study in TOML: baselines, sampling, cross-check, predictions, report."""

import contextlib
import json
import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import tomlkit

from bayesub.findings.remedies import fit_of_mode
from bayesub.findings.unseen import TrialPrediction, predicted_trial
from bayesub.findings.verdicts import MEANING
from bayesub.inference import baselines, identifiability
from bayesub.inference.interface import Sampled
from bayesub.inference.sampling import Criteria, CrossCheck, Posterior, posterior_file, sample
from bayesub.inference.sampling import cross_check as compare_with_nuts
from bayesub.inference.sampling.histories import foretold_seconds
from bayesub.inference.sampling.posterior import JUDGED_STEPS, N_ENSEMBLES, STANDARD
from bayesub.inference.sampling.sampler import N_WALKERS, N_WITHIN_BOUNDS, search_from, search_mode
from bayesub.io import seeds, toml_files
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import Progress, duration
from bayesub.io.words import listed
from bayesub.logs import log_files
from bayesub.model.linear_form import linear_systems, stacked
from bayesub.model.prescribed import STATES
from bayesub.model.quantities import recorded
from bayesub.problem.joint import JointProblem
from bayesub.problem.problem import Problem
from bayesub.problem.unseen import left_out
from bayesub.report.report import ReportedStudy, write_report
from bayesub.sensors import QUANTITIES
from bayesub.study.provenance import origin
from bayesub.study.run.prepare import Setup
from bayesub.study.run.prescribed import prescription
from bayesub.study.run.result import AGAIN, RESULT, SUGGESTED, StudyResult
from bayesub.study.run.run_folder import CONFIG, CROSS_CHECK, LEFT_OUT, RunContext, saved_config
from bayesub.study.schema.study_file import Study
from bayesub.study.sources import file_digest

if TYPE_CHECKING:
    from bayesub.logs.series import Finding

RECORDS = "record*.csv", "check_*.csv"
POSTERIOR, ESTIMATES, MODE, DERIVED = "posterior.nc", "estimates.json", "mode.json", "derived.json"
_LONG_MINUTES = 5.0  # of sampling, which are said before it
T = TypeVar("T")


def infer(setup: Setup, context: RunContext, *, cross_check: bool, leave_out: bool = False) -> StudyResult:
    """Do the work of a study in an opened folder, if wanted with a cross-check by NUTS and with trials left out."""
    folder, progress = context.folder, context.progress
    progress.stage("simulate or read the trials")
    refuse_misread(setup, progress)
    problem, given = setup.problem, setup.study.prior.given
    if idle := [name for name, one in given.items() if one.value is None and name not in problem.names]:
        progress.remark(f"what [prior.given] says of {listed(idle)} plays no part: not free, and only a value holds it")
    for name, trial in setup.trials.items():
        trial.record.save(folder / (f"record_{name}.csv" if name else "record.csv"))
    for unseen in setup.unseen:
        unseen.problem.record.save(folder / f"check_{unseen.name}.csv")
    problem.predicted(np.repeat(problem.prior.mean[None], 16, axis=0))  # compiles, so that nothing below does
    seconds = {"simulation and compilation": progress.seconds - progress.before}  # of this session of the run
    if not (folder / "chain").exists():
        say_if_long(setup, progress)
    estimates = _baselines(setup, context)
    seconds |= {estimate.method: estimate.seconds for estimate in estimates}

    progress.stage("sample the posterior")
    rng, search = setup.generator(seeds.SAMPLER), partial(_search, setup, context)
    posterior = sample_posterior(setup, problem, rng, checkpoint=folder / "chain", progress=progress, search=search)
    seconds["sampling"] = posterior.seconds
    posterior_file.save(posterior, folder / POSTERIOR)
    posterior = posterior_file.load(folder / POSTERIOR)  # with the draws that the file has, as all that follow read it
    check = None
    if cross_check:
        progress.stage("cross-check with NUTS")
        check = compare_with_nuts(problem, posterior, rng=setup.generator(seeds.CROSS_CHECK), progress=progress)
        write_text(folder / CROSS_CHECK, json.dumps(check.to_json(), indent=1))
    if leave_out:
        from bayesub.study.run import leave_out as others

        others.fit(setup, context)
    progress.stage("findings")
    seconds["all before the report"] = progress.seconds
    result = conclude(setup, context, estimates, posterior, check, seconds=seconds)
    if lines := result.sentences.get("lines_to_add"):
        suggest(setup.study, lines, folder)
    else:
        (folder / SUGGESTED).unlink(missing_ok=True)
    return result


def refuse_unreachable(study: Study) -> None:
    """InputError for a stopping rule that no posterior meets."""
    sampler = study.sampler
    steps = 3 * JUDGED_STEPS // 4
    n_walkers = N_WITHIN_BOUNDS if study.prior.kind == "relative_uniform" else N_WALKERS
    draws = steps * sampler.n_ensembles * (sampler.n_walkers or n_walkers)
    for key, value, is_wrong, least in (
        ("n_ensembles", sampler.n_ensembles, sampler.n_ensembles < N_ENSEMBLES, f"at least {N_ENSEMBLES}"),
        ("ess", sampler.ess, sampler.ess > draws, f"at most {draws}, or more walkers"),
        ("taus", sampler.taus, sampler.taus > steps, f"at most {steps}"),
    ):
        if is_wrong:
            text = f"{study.source}: key 'sampler.{key}': no posterior is judged converged with {value:g}"
            raise InputError(f"{text}; give {least}", "value", f"sampler.{key}")


def suggest(study: Study, lines: str, folder: Path) -> Path:
    """Write the file of a study with lines added; a key that is there already gives way. Its path is the answer.

    `lines`: TOML, sections with keys; `folder`: of the run. Files that the study names are named as seen from there.
    """
    text = toml_files.read_text(Path(study.source))
    for name in study.files:
        place = Path(os.path.relpath(study.path(name), folder)).as_posix()
        text = re.sub(rf"""(["']){re.escape(name)}(:\w+)?\1""", rf"\g<1>{place}\g<2>\g<1>", text)
    document = tomlkit.parse(text)
    for section, added in tomlkit.parse(lines).items():
        document.setdefault(section, added).update(added)
    write_text(folder / SUGGESTED, document.as_string().rstrip() + "\n")
    return folder / SUGGESTED


def say_if_long(setup: Setup, progress: Progress) -> None:
    """Say before the search how long sampling with forces will take, and what takes less."""
    if not setup.problem.histories:
        return
    minutes = foretold_seconds(setup.problem) / 60.0
    if minutes < _LONG_MINUTES:
        return
    knots = max((history.disturbances.knots for history in setup.problem.histories), key=lambda one: len(one.times))
    progress.remark(
        f"sampling will take about {minutes:.0f} minutes on this machine, with {len(knots.times)} knots on each of "
        f"{', '.join(knots.axes)}. [disturbance] knot_interval_s = {2.0 * knots.interval:.3g} takes less, and is right "
        f"if forces stay alike for {4.0 * knots.interval:.3g} s or longer; a correlation_time_s that is a number takes "
        "less too: it is then taken for known"
    )


def sample_posterior(
    setup: Setup, problem: Problem | JointProblem, rng: np.random.Generator, **given: Any
) -> Posterior:
    """Draw the posterior of a problem as the study wants it; more as of :func:`bayesub.sample`."""
    sampler = setup.study.sampler
    sizes = {key: getattr(sampler, key) for key in ("n_ensembles", "n_walkers", "max_steps")}
    return sample(problem, rng=rng, **sizes, criteria=criteria(setup), **given)


def criteria(setup: Setup) -> Criteria:
    """When a posterior of the study has converged."""
    sampler = setup.study.sampler
    return Criteria(sampler.rhat, sampler.ess, sampler.taus, look=sampler.look or STANDARD.look)


def refuse_misread(setup: Setup, progress: Progress) -> None:
    """Say what contradicts what in the logs of a study, of the columns that it uses.

    InputError if a column holds something else than its name says, and the trial does not say ``trust_log``.
    """
    for path, is_trusted, findings in _logs(setup):
        misread = [finding for finding in findings if finding.misread]
        if misread and not is_trusted:
            others = f" ({len(misread) - 1} more: bayesub check {path})" if len(misread) > 1 else ""
            text = f"{path}: {misread[0].line()}{others}; if the log is right all the same, give trust_log = true"
            raise InputError(text, "data", ", ".join(misread[0].columns))
        for finding in findings:
            progress.remark(f"{path}: {finding.line()}")


def _logs(setup: Setup) -> "Iterator[tuple[Path, bool, list[Finding]]]":
    """Each log, whether it is trusted, and what is wrong with the columns that are used."""
    study, fins = setup.study, setup.vehicle.actuators.log_columns
    trials = [(section, setup.trials[name].record) for name, section, _ in study.each_trial()]
    unseen = {trial.name: trial.problem.record for trial in setup.unseen}
    trials += [(section, unseen[section.name]) for section, _ in study.each_check()]
    for section, record in trials:
        if section.data is None:
            continue
        from bayesub.findings import log_card

        path = toml_files.find_log(study.path(section.data))
        log = log_files.read_log(path, fins, ascending=False)
        headers = [header for header in log_files.headers(path, fins) if header not in (section.ignore or ())]
        names = {header: log_files.short_name(header) for header in headers}
        log = {name: log[name] for name in ("time", *names.values()) if name in log}
        read = {channel.quantity for channel in record.channels} | {STATES[a][0] for a in section.prescribed or ()}
        unused = {header for header, name in names.items() if name in QUANTITIES and name not in read}
        findings = log_card.check(log, headers, fins, setup.vehicle).findings
        yield path, bool(section.trust_log), [one for one in findings if not unused.issuperset(one.columns)]


def saved_estimates(folder: Path) -> tuple[baselines.Estimate, ...]:
    """The estimates of the baselines of a run; InputError for a damaged file."""
    return read_back(folder / ESTIMATES, lambda content: tuple(map(baselines.Estimate.from_json, content[:])))


def read_back(file: Path, made: Callable[[Any], T]) -> T:
    """An object of the JSON of a file in a run folder; InputError for a damaged one."""
    try:
        return made(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        state = f"damaged ({error})" if file.exists() else "missing"
        text = f"{file.parent}: {file.name} is {state}; {AGAIN}"
        raise InputError(text, "format", file.name) from None


def _baselines(setup: Setup, context: RunContext) -> list[baselines.Estimate]:
    """The estimates that the study asks for, kept as soon as all are there; those of an earlier session of the run."""
    if (context.folder / ESTIMATES).exists():
        return list(saved_estimates(context.folder))
    estimates = list(_searched(setup, context.progress))
    write_text(context.folder / ESTIMATES, json.dumps([estimate.to_json() for estimate in estimates], indent=1))
    return estimates


def _searched(setup: Setup, progress: Progress) -> Iterator[baselines.Estimate]:
    study, problem = setup.study, setup.problem
    truths = [trial.truth for trial in setup.trials.values()]
    if study.baselines.linear_least_squares and all(truths):  # a log has no noise-free motion
        progress.stage("linear least squares")
        plain = problem.naive()
        systems = [linear_systems(truth, free=plain.names) for truth in truths]
        guess = dict(zip(plain.names, plain.prior.guess, strict=True))
        yield baselines.linear_least_squares(stacked(systems, plain.equations.names), guess).completed(guess)
    if n_starts := study.baselines.sqp_starts:
        progress.stage("SQP")
        plain = problem.searchable()
        others = plain.names[plain.n_coefficients :]
        rng = setup.generator(seeds.SQP)
        yield baselines.sqp(plain, rng=rng, informed=others, n_starts=n_starts, progress=progress)


def _search(setup: Setup, context: RunContext, problem: Sampled, rng: np.random.Generator) -> np.ndarray:
    """The posterior mode, of which is said before anything is sampled how it fits, and below it draws from near by.

    InputError if it does not fit at all.
    """
    study, sampler = setup.study, setup.study.sampler
    if sampler.start is None:
        found = search_mode(problem, rng)
    else:
        found = search_from(Posterior.load(study.path(sampler.start)), problem, rng)
    mode = np.atleast_2d(found)[0]
    fit = fit_of_mode(setup.problem, mode, setup.generator(seeds.MODE))
    values = dict(zip(setup.problem.names, mode.tolist(), strict=True))
    write_text(context.folder / MODE, json.dumps(fit.to_json() | {"values": values}, indent=1))
    for topic, sentence in fit.sentences.items():
        if topic == "lines_to_add":
            file = suggest(study, sentence, context.folder)
            again = shlex.join(["bayesub", "run", str(file), "-o", f"{context.folder}_again"])
            sentence = f"{file} is the study with them, which runs by\n  {again}"
        context.progress.remark(f"{topic.replace('_', ' ')}: {sentence}")
    if fit.misfit > sampler.max_misfit:
        from bayesub.findings.suspect_columns import suspect

        column = suspect(setup.problem, mode) or fit.small_sd
        likely = f"likely {column}; if not, " if column else ""
        text = f"{study.source}: nothing is sampled, because the best fit that was found misses '{fit.channel}' "
        text += f"by {fit.misfit:.3g} times its noise: {likely}look for a wrong column, sign or unit with bayesub "
        text += "check, free more coefficients, or raise the sd; to sample all the same give [sampler] max_misfit "
        text += "above that"
        raise InputError(text, "data", fit.channel)
    return found


def conclude(
    setup: Setup,
    context: RunContext,
    estimates: Sequence[baselines.Estimate],
    posterior: Posterior,
    check: CrossCheck | None,
    *,
    seconds: Mapping[str, float],
) -> StudyResult:
    """Write figures, numbers and report of a posterior; what it says is the result."""
    study, folder = setup.study, context.folder
    predictions = _predictions(setup, folder, estimates, posterior)
    spectrum = identifiability.fisher(setup.problem, posterior.best, draws=posterior.draws)
    taken = seconds.get("all before the report", sum(seconds.values()))
    made = origin(saved_config(folder) or {}) | {"time taken": duration(taken)}
    following = {}
    with contextlib.suppress(InputError):  # a trial of which nothing is asked that has a value
        following = prescription(setup, posterior)[0].to_json() if posterior.converged else {}
    kept: dict[str, list[list[float]]] = {quantity.name: [] for quantity in setup.quantities}
    about = (study.name, study.question, study.seed, seconds, context.commit, made, context.progress, following)
    quantities = [recorded(quantity, kept[quantity.name]) for quantity in setup.quantities]
    found = {"study": ReportedStudy(*about), "check": check, "predictions": predictions, "quantities": quantities}
    numbers = write_report(folder, setup.problem, estimates, spectrum, posterior, pdf=context.pdf, **found)
    files = [CONFIG, POSTERIOR, ESTIMATES, *(file.name for kind in RECORDS for file in folder.glob(kind))]
    files += [*(f"{LEFT_OUT}/{file.name}" for file in (folder / LEFT_OUT).glob("*.nc"))]
    if kept and not (folder / RESULT).exists():  # a run, after which reports need not run these functions
        write_text(folder / DERIVED, json.dumps(kept))
    files += [DERIVED] if (folder / DERIVED).exists() else []
    return StudyResult(
        name=study.name,
        question=study.question,
        verdict=(verdict := numbers["outcome"]["verdict"]),
        folder=str(folder),
        text=MEANING.get(verdict, ""),
        sentences=numbers["verdict"],
        shortcomings=tuple(posterior.shortcomings),
        files_sha256={name: file_digest(folder / name) for name in files},
    )


def _predictions(
    setup: Setup, folder: Path, estimates: Sequence[baselines.Estimate], posterior: Posterior
) -> list[TrialPrediction]:
    """Those of the logs that are not fitted, and of the trials that have been left out."""
    rng = setup.generator(seeds.PREDICTIONS)
    predictions = [predicted_trial(trial, setup.problem, posterior, estimates, rng) for trial in setup.unseen]
    if (folder / LEFT_OUT).is_dir():
        from bayesub.study.run import leave_out as others

        trials = left_out(setup.problem)
        rngs = dict(zip(trials, rng.spawn(len(trials)), strict=True))  # as findings.unseen.leave_one_out has them
        fits = others.posteriors(setup, folder)
        predictions += [predicted_trial(trials[name], *fit, [], rngs[name]) for name, fit in fits.items()]
    return predictions
