"""The study of a finished run with one more log, which is a trial like those before it.

All trials are fitted together, so that nothing of the former posterior is approximated, and the order of logs is none.
The former posterior says where the search for the mode and learning begin. Walkers are half as many as those of a run
that is new, and convergence is looked at more often: it is there after fewer steps than between two looks of that.
"""

from pathlib import Path

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.problem.nuisance import INITIAL
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.run.infer import POSTERIOR
from bayesub.study.schema.sensor_section import FAULTS
from bayesub.study.schema.study_file import Study
from bayesub.study.schema.trial_section import CheckSection, TrialKeys
from bayesub.study.sources import file_digest

FIRST = "first"  # trial of a run that had one
LOOK, N_WALKERS = 20, 8  # steps between two looks; walkers of each ensemble


def updated(folder: Path, log: Path) -> Study:
    """The study of a run with a log as its last trial, read by the sensors of the one before; without baselines.

    InputError for a folder that is no finished run, a log that is not there, and one that the run has fitted.
    """
    run = finished_run(folder)
    study, log = run.study, log.resolve()
    if not log.is_file():
        raise InputError(f"{log}: there is no such log", "file")
    if any(_is(study, trial.data, log) for _, trial, _ in study.each_trial()):
        raise InputError(f"{log}: {folder} has fitted it already, and it would count twice", "conflict")
    content = study.model_dump(exclude_none=True, exclude_defaults=True)
    trials = content.pop("trials", None) or [_moved(content)]
    last, taken = trials[-1], [trial["name"] for trial in trials]
    new = {key: value for key, value in last.items() if key not in ("manoeuvre", "truth", "window_s")}
    new["nuisance"] = {name: one for name, one in last.get("nuisance", {}).items() if "value" not in one}
    name = CheckSection(data=str(log)).name
    new["name"] = next(n for n in (name, *(f"{name}_{k}" for k in range(2, len(taken) + 3))) if n not in taken)
    new["data"] = str(log)
    if "manoeuvre" in last:  # which was simulated: a log has faults of its own
        sections = new.get("sensors", content.get("sensors", ()))
        new["sensors"] = [{key: value for key, value in one.items() if key not in FAULTS} for one in sections]
        *_, trial = run.setup().trials.values()
        new |= {} if trial.manoeuvre.subproblem is None else {"subproblem": trial.manoeuvre.subproblem}
    content |= {"trials": [*trials, new], "name": f"{study.name}_{new['name']}", "prior": _prior(run, content["prior"])}
    content["check"] = [one for one in content.pop("check", ()) if not _is(study, one.get("data"), log)]
    start = folder.resolve() / POSTERIOR
    content["sampler"] = {"n_walkers": N_WALKERS, **content.get("sampler", {}), "look": LOOK, "start": str(start)}
    content["baselines"] = {"linear_least_squares": False, "sqp_starts": 0}
    both = toml_files.validate(content, Study, f"{folder} with {log}")
    new_ones = {str(path): path for path in (log, start)}
    places = {name: new_ones.get(name) or Path(study.path(name)) for name in both.files}
    return both.located(Path(study.source), places, quick=False)


def _moved(content: dict) -> dict:
    """What is of the only trial of a study, taken out of its content: its source, and where it is known to start."""
    trial = {key: content.pop(key) for key in TrialKeys.model_fields if key in content and key != "nuisance"}
    nuisance = content.get("nuisance", {})
    known = {name: nuisance.pop(name) for name in INITIAL if "value" in nuisance.get(name, {})}
    return {"name": FIRST} | trial | ({"nuisance": known} if known else {})


def _is(study: Study, name: str | None, log: Path) -> bool:
    return name is not None and file_digest(Path(study.path(name))) == file_digest(log)


def _prior(run: FinishedRun, prior: dict) -> dict:
    """The prior of a study, without the truth of a simulated trial, from which a guess was perturbed."""
    if prior.get("centre", "vehicle") != "perturbed":
        return prior
    if prior["kind"] != "relative_normal":
        text = f"{run.folder}: its prior is a perturbed guess of the kind {prior['kind']}, and has no other centre"
        raise InputError(f"{text}; run the study with centre = 'vehicle'", "conflict", "prior.centre")
    problem = run.setup().problem
    names, known = problem.names[: problem.n_coefficients], problem.coefficient_prior
    pairs = zip(names, known.mean.tolist(), known.sd.tolist(), strict=True)
    given = {name: {"mean": mean, "sd": sd} for name, mean, sd in pairs} | prior.get("given", {})
    return {"kind": "relative_normal", "sd": prior["sd"], "given": given}
