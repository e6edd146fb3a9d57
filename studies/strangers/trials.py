"""A boat of a simulator from its log to a verdict: what it writes, what is fitted, and what the truth says of the fit.

The simulator writes two logs with noise into one folder, and the truth into another, which :func:`fit` does not know.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

import bayesub as bs
from bayesub.findings import missing_terms
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.fit import criticise
from bayesub.inference.sampling.histories import marginal_mode, with_process
from bayesub.logs import conversion, log_files, readers
from bayesub.logs.log_map import read_map
from bayesub.model.disturbance import hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.simulator import Simulator
from bayesub.problem.disturbances import force_scales
from bayesub.study.schema.trial_log import read_trial

FOLDER = Path(__file__).parent
PRIOR_SD = 0.2  # of coefficients, relative; boats are drawn from it
LEVELS = (0.5, 0.9)
RUNS = ("fitted", "unseen")
N_DRAWS, N_CHECKED, N_SCORED = 2000, 50, 60  # of an approximation, for the model check, for missing terms
FORCES = "XYN"  # axes on which unmodelled forces are inferred to find a missing term
SHARE, LOG_SD, LENGTHS = 0.05, 1.5, 2.0  # prior of their sd, of the hull's forces; correlation time, in ship lengths


def write(module: ModuleType, folder: Path, rng: np.random.Generator, *, lacking: bool) -> int:
    """Let a simulator fly a boat: ``logs`` with noise and ``truth`` in a folder; how many boats before it failed.

    Each parameter is that of the publication times a factor with an sd of a fifth. A boat whose
    simulation fails is drawn again.
    """
    published = module.PARAMETERS | (module.LACKING if lacking else {})
    failed = 0
    while True:
        p = {name: value * (1.0 + PRIOR_SD * rng.standard_normal()) for name, value in published.items()}
        exact = flown(module, p)
        if exact is not None:
            break
        failed += 1
    for name in ("logs", "truth"):
        (folder / name).mkdir()
    for run, columns in exact.items():
        noisy = {
            name: values + module.NOISE.get(name, 0.0) * rng.standard_normal(len(values))
            for name, values in columns.items()
        }
        table(folder / "logs" / f"{run}.csv", noisy)
    table(folder / "truth" / "unseen.csv", exact["unseen"])
    truth = {"coefficients": module.counterparts(p), "boats_drawn_again": failed}
    if lacking:
        truth["size"] = size(module, p, exact["fitted"])
    (folder / "truth" / "truth.json").write_text(json.dumps(truth))
    return failed


def flown(module: ModuleType, p: dict[str, float]) -> dict[str, dict[str, np.ndarray]] | None:
    """The columns of both runs; None if the boat does not complete one."""
    runs = {}
    for run in RUNS:
        try:
            runs[run] = module.fly(p, run)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None
        if not all(np.isfinite(values).all() for values in runs[run].values()):
            return None
    return runs


def table(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write columns (n,) as CSV."""
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", comments="", fmt="%.10g", header=",".join(columns))


def size(module: ModuleType, p: dict[str, float], exact: dict[str, np.ndarray]) -> float:
    """How far the terms that are left out move the readings, root mean square in sds of the noise."""
    with np.errstate(all="ignore"):
        other = module.fly(p | dict.fromkeys(module.ABSENT, 0.0), "fitted")
        off = [np.mean(((exact[name] - other[name]) / sd) ** 2) for name, sd in module.NOISE.items()]
    return float(np.sqrt(np.mean(off)))


def converted(module: ModuleType, source: Path) -> Path:
    """The log of bayesub that ``bayesub convert csv SOURCE --map NAME_map.toml`` makes, beside the source."""
    map_file = FOLDER / f"{module.NAME}_map.toml"
    log_map = read_map(map_file, "csv")
    log, path = readers.read("csv", [source], log_map), source.with_name(f"{source.stem}_log.csv")
    conversion.convert(log, log_map, map_file).save(path)
    return path


@dataclass(frozen=True)
class Approximation:
    """The normal approximation about the posterior mode, in the words of a posterior."""

    mean: np.ndarray  # (n_params,)
    sd: np.ndarray  # (n_params,)
    draws: np.ndarray  # (n_draws, n_params)
    converged: bool  # whether the search did
    seconds: float


@dataclass(frozen=True)
class Fit:
    """What is made of the logs of a boat."""

    problem: bs.Problem
    posterior: bs.Posterior | Approximation
    check: dict  # whether the residuals look like the noise, as JSON types
    unseen: bs.Manoeuvre  # what the log of the unseen run orders, from the documented start


def fit(module: ModuleType, logs: Path, rng: np.random.Generator, *, lacking: bool, **options) -> Fit:
    """The posterior of the first log, without what is in any other folder; `options` are of :func:`bayesub.sample`.

    Where terms are lacking the model check is of the normal approximation: a posterior of a wrong model is not used.
    """
    boat = module.vehicle(logs, lacking=lacking)
    sensors = [bs.sensors.Sensor(column, sd=sd) for column, sd in module.SENSORS.items()]
    trial = read_trial(converted(module, logs / "fitted.csv"), boat, sensors, subproblem="horizontal", nuisance={})
    given = {"free": boat.equations.names, "prior": bs.priors.relative_normal(PRIOR_SD), "nuisance": trial.nuisance}
    problem = bs.Problem(boat, trial.manoeuvre, trial.record, **given)
    posterior = approximated(problem, rng) if lacking else bs.sample(problem, rng=rng, **options)
    start = {"subproblem": "horizontal", "nuisance": module.START}
    unseen = read_trial(converted(module, logs / "unseen.csv"), boat, sensors, **start)
    return Fit(problem, posterior, checked(problem, posterior, rng), unseen.manoeuvre)


def approximated(problem: bs.Problem, rng: np.random.Generator) -> Approximation:
    """The normal approximation about the mode."""
    mode = bs.baselines.posterior_mode(problem, rng=rng)
    assert mode.covariance is not None
    draws = rng.multivariate_normal(mode.values, mode.covariance, N_DRAWS, method="eigh")
    sd, found = np.sqrt(np.diag(mode.covariance)), mode.statuses[0].startswith("converged")
    return Approximation(mode.values, sd, draws, found, mode.seconds)


def checked(problem: bs.Problem, posterior: bs.Posterior | Approximation, rng: np.random.Generator) -> dict:
    """Whether the model fits, what is wrong by channel, and the largest chi-square per reading of a channel."""
    draws = posterior.draws[rng.choice(len(posterior.draws), N_CHECKED)]
    times = {name: channel.times for name, (channel, _) in problem.channels.items()}
    criticism = criticise(problem.quantile_residuals(draws, rng), times)
    faults = {name: list(check.faults) for name, check in criticism.suspects.items()}
    at_mean = problem.quantile_residuals(posterior.mean[None], rng)
    squares = max(np.mean(residuals**2) for residuals in at_mean.values())
    return {"fits": criticism.fits, "faults": faults, "chi_square": float(squares)}


def followed(problem: bs.Problem, posterior: bs.Posterior | Approximation, rng: np.random.Generator) -> list[list[str]]:
    """Terms that unmodelled forces follow, the clearest first, each with those that the motion cannot distinguish.

    A name is that of the coefficient, or axis and regressor of a term that the axis has not. The draws are those of
    the normal approximation about the marginal mode.
    """
    boat, manoeuvre = problem.vehicle, problem.manoeuvre
    rms = hull_force_rms([Simulator(boat, manoeuvre, [manoeuvre.duration])])[[AXES.index(axis) for axis in FORCES]]
    sds = SHARE * rms / force_scales(boat, tuple(FORCES))
    spread = {axis: bs.priors.log_normal(float(sd), LOG_SD) for axis, sd in zip(FORCES, sds, strict=True)}
    unknown = bs.UnknownDisturbance(tuple(FORCES), spread, LENGTHS * boat.length_m / boat.speed_mps)
    given = {"free": boat.equations.names, "prior": problem.spread, "nuisance": problem.nuisance_priors}
    posed = bs.Problem(boat, manoeuvre, problem.record, dt=problem.simulator.step, disturbance=unknown, **given)
    known = posed.with_wide_process()
    begin = known.prior.parameters(np.zeros(known.n_params))
    begin[: posterior.mean.size] = posterior.mean
    marginal, mode = marginal_mode(posed, with_process(posed, gauss_newton(known, begin)))
    centre = marginal.prior.scaled(mode)
    jacobian = marginal.prior.scaled_chain(marginal.jacobian(mode), centre)
    lower = np.linalg.cholesky(np.linalg.inv(jacobian.T @ jacobian + np.eye(len(centre))))
    others = marginal.prior.unscaled(centre + rng.standard_normal((N_SCORED, len(centre))) @ lower.T)
    _, draws = marginal.density(posed, others, rng.standard_normal((N_SCORED, len(marginal.white))))
    found = missing_terms.find_followed(missing_terms.scores(posed, draws[np.isfinite(draws).all(axis=1)]))
    return [[c.term.name if c.term else f"{c.axis}: {c.regressor}" for c in one.candidates] for one in found]


def judge(module: ModuleType, truth: Path, one: Fit) -> dict:
    """What the truth says of a fit, as JSON types."""
    content = json.loads((truth / "truth.json").read_text())
    problem, posterior = one.problem, one.posterior
    names = problem.names[: problem.n_coefficients]
    values, draws = np.array([content["coefficients"][name] for name in names]), posterior.draws[:, : len(names)]
    held = {}
    for level in LEVELS:
        low, high = np.quantile(draws, [0.5 - level / 2, 0.5 + level / 2], axis=0)
        held[f"{level:.0%}"] = ((low <= values) & (values <= high)).tolist()
    mean, guess = problem.coefficient_sets(np.stack([posterior.mean, problem.prior.mean]))
    errors = path_errors(module, truth / "unseen.csv", one, np.stack([mean, guess]))
    return {
        "names": list(names),
        "held": held,
        "sd": (posterior.sd[: len(names)] / problem.coefficient_prior.sd).tolist(),
        "error": ((posterior.mean[: len(names)] - values) / posterior.sd[: len(names)]).tolist(),
        "path_percent": errors[0],
        "guess_path_percent": errors[1],
        "converged": posterior.converged,
        "seconds": posterior.seconds,
        "step_s": problem.simulator.step,
        "n_readings": problem.record.n_readings,
        "boats_drawn_again": content["boats_drawn_again"],
        "size": content.get("size"),
        **one.check,
    }


def path_errors(module: ModuleType, exact: Path, one: Fit, sets: np.ndarray) -> list[float | None]:
    """Largest distance from the true track of the unseen run by coefficient set (n, n_terms), % of the path.

    None where the boat does not complete the run.
    """
    log = log_files.read_log(converted(module, exact), one.problem.vehicle.actuators.log_columns)
    here = np.isfinite(log["x"]) & np.isfinite(log["y"]) & (log["time"] <= one.unseen.duration)
    times, track = log["time"][here], np.stack([log["x"], log["y"]], axis=1)[here]
    path = np.linalg.norm(np.diff(track, axis=0), axis=1).sum()
    simulator = Simulator(one.problem.vehicle, one.unseen, times, dt=one.problem.simulator.step)
    states, codes = simulator.run(sets)
    off = np.linalg.norm(states[:, :, :2] - track, axis=2).max(axis=1)
    return [float(100.0 * far / path) if code == 0 else None for far, code in zip(off, codes, strict=True)]
