"""A finished run predicts a manoeuvre or a log that it has not seen, into a folder that explains itself."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.findings import unseen
from bayesub.findings.predicted_trial import PredictedTrial, motion_table, predicted_motion, readings_table
from bayesub.findings.unseen import TrialPrediction
from bayesub.inference.checks.prediction import N_DRAWS, predict
from bayesub.io import toml_files
from bayesub.io.atomic import write_csv, write_text, writing
from bayesub.io.errors import InputError, error_source
from bayesub.io.interrupts import interruptible
from bayesub.io.terminal import SILENT, Progress
from bayesub.logs import log_files
from bayesub.model.autopilot import SteeredSimulator, load_autopilot
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import OF_MANOEUVRE
from bayesub.model.vehicles import Vehicle
from bayesub.problem.disturbances import of_process
from bayesub.problem.nuisance import MOVING, of_boat
from bayesub.problem.unseen import UnseenTrial
from bayesub.report import prediction_page
from bayesub.report.page import Sheet
from bayesub.sensors import Channel, Record, flat
from bayesub.sensors.current import over_ground
from bayesub.sensors.sensor import MAX_READINGS
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.provenance import copies, of_request
from bayesub.study.run.prepare import Setup, present
from bayesub.study.run.run_folder import open_folder, saved_config
from bayesub.study.schema.sensor_section import FAULTS
from bayesub.study.schema.trial_section import CheckSection, TrialKeys, read_instruments

PAGE, ANSWERS = "prediction.html", {"prediction", "comparison"}
BATCH = 100  # draws between two words of progress
POSITION_SD_M, ATTITUDE_SD_DEG = 0.5, 1.0  # of the track to whose tenth the step of a manoeuvre is good
SAMPLES = 500  # output times of a manoeuvre, about


@dataclass(frozen=True)
class Request:
    """What is asked of a run."""

    run: Path  # its folder
    # Built-in name of a manoeuvre or a log, a manoeuvre in TOML, a control history or a log in CSV. A CSV that has a
    # column besides time and controls is a log
    source: str
    # Instruments of the log (:func:`bayesub.study.schema.trial_section.read_instruments`); by default those of the
    # first fitted trial all of whose columns it has
    sensors: str | None = None
    subproblem: str | None = OF_MANOEUVRE  # plane of the motion; of a CSV by default that of the first fitted trial
    sample_s: float | None = None  # output interval of a manoeuvre
    current_mps: tuple[float, float] | None = None  # known, of a manoeuvre, north and east; by default still water
    autopilot: Path | None = None  # file of one that steers every draw in the course of a manoeuvre
    draws: int = N_DRAWS  # of posterior and prior
    seed: int = 0


@dataclass(frozen=True)
class PosedTrial:
    """A trial to predict, and the run made ready for it."""

    setup: Setup
    trial: UnseenTrial
    has_readings: bool  # whether it is a log, with readings by which the prediction is judged
    held: tuple[str, ...] = ()  # coefficients that act on it and that the run does not infer, at those of the file
    unread: tuple[str, ...] = ()  # columns of the log that no sensor of the run reads
    current_mps: tuple[float, float] | None = None  # north and east; None is still water, or what a log tells


def predict_by_run(
    request: Request, folder: Path, *, force: bool = False, pdf: bool = False, progress: Progress = SILENT
) -> dict:
    """Predict a manoeuvre or a log into a folder, which is made; gives the content of ``numbers.json``.

    The folder gets ``prediction.html``, ``numbers.json``, ``states.csv`` with the bands of the states, figures (as PDF
    too with `pdf`), and of a log ``readings.csv`` with those of the readings. With `force` what is there is replaced.

    InputError for inputs that do not fit, before a folder is made, and for a folder that is not free.
    """
    progress.stage("read the run")
    run = finished_run(request.run)
    posed = pose(run, request)
    sources = (request.source, request.sensors, request.autopilot and str(request.autopilot))
    files = {name: Path(name) for name in sources if name is not None and toml_files.is_path(name)}
    asked = vars(request) | {"subproblem": request.subproblem or "none", "autopilot": sources[2]}
    config = of_request("prediction", asked, run.files | files)
    with open_answer(folder, PAGE, config, copies(files, config["files_sha256"]), force=force):
        trial = predicted_by(run, posed, np.random.default_rng(request.seed), request.draws, progress)
        progress.stage("figures and page")
        numbers = trial.numbers | {"seed": request.seed, "unread_columns": list(posed.unread)}
        chosen = {by: trial.motions[by] for by in (unseen.POSTERIOR, unseen.PRIOR, unseen.SQP) if by in trial.motions}
        bands = {by: one for by, one in chosen.items() if one.is_flown or by == unseen.POSTERIOR}
        tables = {"states.csv": motion_table(bands, trial.states)}
        if trial.readings.predictions:
            tables["readings.csv"] = readings_table(trial.readings)
        sheet = prediction_page.sheet(trial, commit=config["commit"], seed=request.seed)
        write_answer(folder, PAGE, sheet, numbers, tables, pdf=pdf)
    return numbers


@contextmanager
def open_answer(folder: Path, page: str, config: dict, copied: dict[str, Path], *, force: bool) -> Iterator[None]:
    """Make and hold the folder of an answer, whose last file is its page; one that was stopped before is replaced.

    InputError for a folder that holds another run, or an answer, unless `force` is given.
    """
    saved = saved_config(folder)
    stopped = saved is not None and bool(ANSWERS & saved.keys() & config.keys()) and not (folder / page).exists()
    if saved is not None and not (force or stopped):
        raise InputError(f"{folder}: already holds a run; use --force to replace it, or another -o", "state")
    read = map(Path, config["files_sha256"])
    with open_folder(folder, config, copied, read=read, force=force or stopped), interruptible():
        yield


def write_answer(
    folder: Path, page: str, sheet: Sheet, numbers: dict[str, Any], tables: Mapping[str, Any], *, pdf: bool
) -> None:
    """Write tables (name of the file -> what :func:`bayesub.io.atomic.write_csv` takes), numbers, figures and page."""
    with writing(folder):
        for name, content in tables.items():
            write_csv(folder / name, content)
        write_text(folder / "numbers.json", json.dumps(numbers, indent=1))
        sheet.write(folder / page, pdf=pdf)


def predicted_by(
    run: FinishedRun,
    posed: PosedTrial,
    rng: np.random.Generator,
    draws: int = N_DRAWS,
    progress: Progress = SILENT,
    by: Sequence[str] | None = None,
) -> PredictedTrial:
    """What a run says of a trial: its motion, and of a log its readings.

    So many draws of posterior and prior are chosen by `rng`, which is the source of noise too. `by` says by whom, the
    posterior among them; by default posterior, prior, their middles, and SQP.
    """
    fitted, posterior = posed.setup.problem, run.posterior
    trial = posed.trial.with_fitted_noise(fitted, posterior.best)
    problem, motions, predictions = trial.problem, {}, {}
    n = unseen.number_of_draws(max(len(problem.readings), 12 * len(problem.simulator.times)), draws)
    drawn = list(unseen.draws_by_whom(fitted, posterior, run.estimates, rng, n))
    by_whom = [(name, some) for name, some in drawn if by is None or name in by]
    for name, parameters in unseen.transfer(trial, fitted, by_whom, rng):
        progress.stage(f"fly by the {name}")
        states = []
        for k in range(0, len(parameters), BATCH):
            states.append(problem.motion(parameters[k : k + BATCH]))
            progress.update(min(k + BATCH, len(parameters)), len(parameters), "draws")
        motion, times = np.concatenate(states), problem.simulator.times
        if posed.current_mps is not None:
            motion = over_ground(motion, times, posed.current_mps)
        motions[name] = predicted_motion(times, motion)
        if posed.has_readings:
            predictions[name] = predict(problem, parameters, rng, warm_up=trial.warm_up_s).without_draws()
    readings = TrialPrediction(trial, predictions, posterior.converged)
    about = posed.held, tuple(posterior.shortcomings), run.verdict, posed.current_mps
    return PredictedTrial(run.study.name, posed.setup.vehicle, motions, readings, *about)


def pose(run: FinishedRun, request: Request) -> PosedTrial:
    """Pose a manoeuvre or a log to a finished run; InputError for one that does not fit."""
    source, current_mps = request.source, request.current_mps
    columns = _read_columns(source, run.vehicle)
    if columns is None:
        if request.sensors is not None:
            raise InputError(f"{source}: --sensors are of a log; a manoeuvre has no readings", "conflict", "--sensors")
        setup = run.setup()
        with error_source(source):
            trial = _flown(setup, source, request)
            _check_current(trial, current_mps)
        return PosedTrial(setup, trial, False, _held(setup, trial), current_mps=current_mps)
    if current_mps is not None:
        what = f"{source}: --current-north-mps and --current-east-mps are of a manoeuvre; that of a log is unknown"
        raise InputError(f"{what}, and its warm-up tells it", "conflict", "--current-north-mps")
    if request.autopilot is not None:
        text = f"{source}: --autopilot steers in a manoeuvre; that of a log has steered already"
        raise InputError(text, "conflict", "--autopilot")
    if request.sample_s is not None:
        text = f"{source}: --sample is of a manoeuvre; a log is predicted at the times of its readings"
        raise InputError(text, "conflict", "--sample")
    check, unread = _check(run, columns, request)
    setup = run.setup([check])
    (trial,) = setup.unseen
    return PosedTrial(setup, trial, True, _held(setup, trial), unread)


def _read_columns(source: str, vehicle: Vehicle) -> list[str] | None:
    """The columns of a log besides time and controls; None for what is a manoeuvre."""
    path = toml_files.find_log(source)
    if source in toml_files.built_in("manoeuvres") or not path.name.lower().endswith((".csv", ".csv.gz")):
        return None
    own = vehicle.actuators.log_columns
    controls = {log_files.short_name(name) for name in (*log_files.CONTROL_COLUMNS, *own, "time_s")}
    return [name for name in log_files.headers(path, own) if log_files.short_name(name) not in controls] or None


def _check(run: FinishedRun, columns: list[str], request: Request) -> tuple[CheckSection, tuple[str, ...]]:
    """The log as a [[check]] of the study, read like the fitted trial whose sensors it has; columns that are not read.

    What is of that trial alone is not taken over: its window, its start, and faults of its sensors.
    """
    shorts = {log_files.short_name(name) for name in columns}

    def reads(sections):
        return [sensor.quantity for sensor in flat([section.build() for section in sections])]

    trials = list(run.study.each_trial())
    _, like, sections = next((one for one in trials if shorts.issuperset(reads(one[2]))), trials[0])
    if request.sensors is not None:
        sections = read_instruments(request.sensors).sensors
        for key in (key for section in sections for key in FAULTS if key in section.model_fields_set):
            what = f"{request.sensors}: {key} is of simulated readings; those of a log have what they have"
            raise InputError(f"{what}; leave it out", "conflict", key)
    unread = tuple(name for name in columns if log_files.short_name(name) not in reads(sections))
    plane = like.subproblem
    if like.data is None:
        plane = load_manoeuvre(run.study.path(like.manoeuvre), run.vehicle).subproblem
    keys = {key: getattr(like, key) for key in TrialKeys.OF_DATA if key != "window_s"}
    keys |= {"subproblem": plane if request.subproblem == OF_MANOEUVRE else request.subproblem, "ignore": unread}
    name = request.source if request.source in toml_files.built_in("logs") else str(Path(request.source).resolve())
    check = CheckSection(data=name, **{key: value for key, value in keys.items() if value is not None})
    nuisance = {} if like is run.study else CheckSection.nuisances(check, like.nuisance)
    usual = [{key: one.default for key, one in type(s).model_fields.items() if key in FAULTS} for s in sections]
    sections = tuple(section.model_copy(update=good) for section, good in zip(sections, usual, strict=True))
    return check.model_copy(update={"sensors": sections, "nuisance": nuisance}), unread


def _flown(setup: Setup, source: str, request: Request) -> UnseenTrial:
    """A manoeuvre through the water, with the boat, its actuators and the disturbance of the run.

    Under an autopilot the manoeuvre of the trial is what the vehicle of the run does, and the simulator steers draws.
    """
    boat, subproblem, sample_s = setup.vehicle, request.subproblem, request.sample_s
    manoeuvre = load_manoeuvre(source, boat)
    if subproblem == OF_MANOEUVRE and source.lower().endswith(".csv"):
        _, fitted, _ = next(setup.problem.each_trial(setup.problem.prior.mean))
        subproblem = fitted.manoeuvre.subproblem
    if subproblem != OF_MANOEUVRE:
        manoeuvre = replace(manoeuvre, subproblem=subproblem)
    autopilot = None
    if request.autopilot is not None:
        autopilot = load_autopilot(request.autopilot)
        if autopilot.heading is not None and autopilot.heading.waypoints_m and request.current_mps is not None:
            text = f"{request.autopilot}: waypoints_m are of the water; order heading_deg, or leave out the current"
            raise InputError(text, "conflict", "waypoints_m")
        manoeuvre = SteeredSimulator(boat, manoeuvre, manoeuvre.times[-1:], autopilot=autopilot).recorded()
    interval = manoeuvre.duration / SAMPLES if sample_s is None else sample_s
    n = manoeuvre.duration / interval
    if not 1.0 <= n <= MAX_READINGS:
        text = f"--sample must be between {manoeuvre.duration / MAX_READINGS:.2g} s and the duration"
        raise InputError(text, "value", "--sample")
    times = np.minimum(np.arange(int(n * (1 + 1e-12)) + 1) * interval, manoeuvre.duration)
    moving = MOVING.get(boat.equations.subproblem(manoeuvre.subproblem), log_files.STATES)
    sds = dict.fromkeys("xyz", POSITION_SD_M) | dict.fromkeys(log_files.ANGLES, np.radians(ATTITUDE_SD_DEG))
    unread = np.full(len(times), np.nan)
    record = Record(tuple(Channel(name, times, unread, sd) for name, sd in sds.items() if name in moving))
    priors = setup.problem.nuisance_priors
    shared = {name: priors[name] for name in priors if of_boat(name, boat) and not of_process(name)}
    problem = setup.pose(manoeuvre, record, nuisance=present(shared, boat, manoeuvre))
    if autopilot is not None:
        problem.forward.simulator = SteeredSimulator.of(problem.simulator, autopilot)
    return UnseenTrial(manoeuvre.name, problem, 0.0)


def _check_current(trial: UnseenTrial, current_mps: tuple[float, float] | None) -> None:
    """InputError for a current that is too large, or that has no part in the plane of the motion."""
    if current_mps is None:
        return
    most, problem = toml_files.largest("mps"), trial.problem
    for towards, speed in zip(("north", "east"), current_mps, strict=True):
        if not abs(speed) <= most:
            text = f"--current-{towards}-mps must be between {-most:g} and {most:g}, found {speed:g}"
            raise InputError(text, "value", f"--current-{towards}-mps")
    plane = problem.vehicle.equations.subproblem(problem.manoeuvre.subproblem)
    if current_mps[1] and "y" not in MOVING.get(plane, log_files.STATES):
        text = f"--current-east-mps: has no part in the {plane} sub-problem; leave it out"
        raise InputError(text, "conflict", "--current-east-mps")


def _held(setup: Setup, trial: UnseenTrial) -> tuple[str, ...]:
    """Coefficients that act on a trial and that neither a fitted trial nor this one infers, but for those of zero."""
    problem, equations = trial.problem, setup.vehicle.equations
    active = equations.active(None, problem.manoeuvre, problem.manoeuvre.subproblem)
    inferred = {*setup.problem.names, *problem.names}
    return tuple(name for name in active if name not in inferred and problem.xi[equations.index[name]])
