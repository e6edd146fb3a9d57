"""A finished run predicts a manoeuvre or a log that it has not seen, into a folder that explains itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesub.findings import unseen
from bayesub.findings.predicted_trial import (
    PredictedMotion,
    PredictedTrial,
    motion_table,
    predicted_motion,
    readings_table,
)
from bayesub.findings.unseen import TrialPrediction
from bayesub.inference.checks.prediction import N_DRAWS, predict
from bayesub.io import toml_files
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.simulator import OF_MANOEUVRE
from bayesub.problem.trial_problem import TrialProblem
from bayesub.report import prediction_page
from bayesub.sensors.current import over_ground
from bayesub.study.after.answer import open_answer, write_answer
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.after.unseen_manoeuvre import Asked, asked
from bayesub.study.provenance import of_request

PAGE = "prediction.html"
BATCH = 100  # draws between two words of progress


@dataclass(frozen=True)
class Request:
    """What is asked of a run.

    Attributes
    ----------
    run : Path
        Its folder.
    source : str
        A manoeuvre or a log (:func:`bayesub.study.after.unseen_manoeuvre.asked`).
    sensors : str or None
        Of the log.
    subproblem : str or None
        Plane of the motion; by default that of the manoeuvre.
    sample_s : float or None
        Output interval of a manoeuvre.
    current_mps : (float, float) or None
        North and east, in which a manoeuvre is flown; by default still water.
    draws : int
        Of posterior and prior.
    seed : int
    """

    run: Path
    source: str
    sensors: str | None = None
    subproblem: str | None = OF_MANOEUVRE
    sample_s: float | None = None
    current_mps: tuple[float, float] | None = None
    draws: int = N_DRAWS
    seed: int = 0

    def config(self, files: Mapping[str, Path]) -> dict:
        """What the result depends on."""
        return of_request("prediction", vars(self) | {"subproblem": self.subproblem or "none"}, files)

    @property
    def own_files(self) -> dict[str, Path]:
        """Name -> file of the manoeuvre or log and its sensors, as far as they are files."""
        names = [name for name in (self.source, self.sensors) if name is not None and toml_files.is_path(name)]
        return {name: Path(name) for name in names}


def predict_by_run(
    request: Request, folder: Path, *, force: bool = False, pdf: bool = False, progress: Progress = SILENT
) -> dict:
    """Predict a manoeuvre or a log into a folder.

    It gets ``prediction.html``, ``numbers.json``, ``states.csv`` with the bands of the states, figures, and of a log
    ``readings.csv`` with those of the readings.

    Parameters
    ----------
    request : Request
    folder : Path
        It is made if it does not exist.
    force : bool
        Replace what is in the folder.
    pdf : bool
        Draw every figure as PDF too.
    progress : Progress

    Returns
    -------
    dict
        The content of ``numbers.json``.

    Raises
    ------
    InputError
        For inputs that do not fit, before a folder is made, and for a folder that is not free.
    """
    progress.stage("read the run")
    run = finished_run(request.run)
    options = {key: getattr(request, key) for key in ("sensors", "subproblem", "sample_s", "current_mps")}
    question = asked(run, request.source, **options)
    files = request.own_files
    config = request.config(run.files | files)
    with open_answer(folder, config, files, force=force):
        rng = np.random.default_rng(request.seed)
        trial = predicted_by(run, question, rng, request.draws, progress)
        progress.stage("figures and page")
        numbers = trial.numbers | {"seed": request.seed, "unread_columns": list(question.unread)}
        tables = {"states.csv": motion_table(_with_bands(trial.motions), trial.states)}
        if trial.readings.predictions:
            tables["readings.csv"] = readings_table(trial.readings)
        sheet = prediction_page.sheet(trial, commit=config["commit"], seed=request.seed)
        write_answer(folder, PAGE, sheet, numbers, tables, pdf=pdf)
    return numbers


def predicted_by(
    run: FinishedRun,
    question: Asked,
    rng: np.random.Generator,
    draws: int = N_DRAWS,
    progress: Progress = SILENT,
    by: Sequence[str] | None = None,
) -> PredictedTrial:
    """What a run says of a trial: its motion, and of a log its readings.

    Parameters
    ----------
    run : FinishedRun
    question : Asked
    rng : numpy.random.Generator
        Chooses draws, and is the source of noise.
    draws : int
        Of posterior and prior.
    progress : Progress
    by : sequence of str, optional
        By whom, the posterior among them; by default posterior, prior, their middles, and SQP.
    """
    fitted, posterior = question.setup.problem, run.posterior
    trial = question.trial.with_fitted_noise(fitted, posterior.best)
    problem, motions, predictions = trial.problem, {}, {}
    n_numbers = max(len(problem.readings), 12 * len(problem.simulator.times))
    n = unseen.number_of_draws(n_numbers, draws)
    by_whom = unseen.draws_by_whom(fitted, posterior, run.estimates, rng, n)
    by_whom = {name: some for name, some in by_whom.items() if by is None or name in by}
    for name, parameters in unseen.transfer(trial, fitted, by_whom, rng):
        progress.stage(f"fly by the {name}")
        states = []
        for k in range(0, len(parameters), BATCH):
            states.append(_over_ground(problem, parameters[k : k + BATCH], question.current_mps))
            progress.update(min(k + BATCH, len(parameters)), len(parameters), "draws")
        motions[name] = predicted_motion(problem.simulator.times, np.concatenate(states))
        if question.has_readings:
            predictions[name] = predict(problem, parameters, rng, warm_up=trial.warm_up_s).without_draws()
    readings = TrialPrediction(trial, predictions, posterior.converged)
    about = question.held, tuple(posterior.shortcomings), question.current_mps
    return PredictedTrial(run.study.name, question.setup.vehicle, motions, readings, *about)


def _over_ground(problem: TrialProblem, parameters: np.ndarray, current_mps: tuple[float, float] | None) -> np.ndarray:
    """(n, n_times, 12) states over the ground, in a known current besides those of the parameters (n, n_params)."""
    states = problem.motion(parameters)
    return states if current_mps is None else over_ground(states, problem.simulator.times, current_mps)


def _with_bands(motions: dict[str, PredictedMotion]) -> dict[str, PredictedMotion]:
    """Those of posterior, prior and SQP that complete the motion; the posterior in any case, first."""
    chosen = (unseen.POSTERIOR, unseen.PRIOR, unseen.SQP)
    return {by: motions[by] for by in chosen if by in motions and (motions[by].is_flown or by == unseen.POSTERIOR)}
