"""Every public name as a user writes it; ``mypy`` (no arguments) checks that the types say so. It is not run."""

from pathlib import Path

import numpy as np

import bayesub as bs


def version() -> str:
    """Of the package."""
    return bs.__version__


def equations() -> bs.EquationSet:
    """Equation sets, by name and by file."""
    terms: bs.EquationSet = bs.load_equations(Path("mine.toml"))
    names: tuple[str, ...] = terms.active(subproblem="horizontal")
    print(names, terms.label(names[0]), terms.term(names[0]).unit)
    return bs.load_equations("booth")


def boats() -> tuple[bs.Vehicle, bs.Manoeuvre]:
    """Vehicles and manoeuvres, by name and by file."""
    boat: bs.Vehicle = bs.load_vehicle(Path("boat.toml"))
    manoeuvre: bs.Manoeuvre = bs.load_manoeuvre("horizontal", boat)
    manoeuvre = bs.random_manoeuvre(boat, np.random.default_rng(1))
    names: tuple[str, ...] = bs.coefficients.HORIZONTAL
    length: float = boat.length_m * len(names)
    print(length, manoeuvre.duration, boat.xi.shape)
    return boat, manoeuvre


def motions(boat: bs.Vehicle, manoeuvre: bs.Manoeuvre) -> bs.Trajectory:
    """Motions, regressors and the linear form."""
    truth: bs.Trajectory = bs.simulate(boat, manoeuvre, dt=0.5)
    states: np.ndarray = truth.states[0]
    rates: np.ndarray = bs.accelerations(boat, states, manoeuvre.controls, manoeuvre.rpm)
    print(rates.shape, bs.regressors, bs.linear_systems(truth).keys())
    return truth


def disturbances(boat: bs.Vehicle, manoeuvre: bs.Manoeuvre) -> bs.UnknownDisturbance:
    """Forces that the equations leave out, of a truth and of a problem."""
    gusts: bs.Disturbance = bs.Disturbance(("Y",), np.ones(1), correlation_time_s=4.0)
    truth: bs.Trajectory = bs.simulate(boat, manoeuvre, disturbance=gusts, rng=np.random.default_rng(1))
    print(truth.status)
    return bs.UnknownDisturbance(("Y",), {"Y": bs.priors.log_normal(1e-4, 1.0)}, correlation_time_s=4.0)


def records(truth: bs.Trajectory) -> bs.Record:
    """What sensors read."""
    sensors = [
        bs.sensors.Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=1.0),
        bs.sensors.modified(bs.sensors.DVL(sd_mps=0.005), dropout=0.05),
    ]
    record: bs.Record = bs.observe(truth, sensors, np.random.default_rng(1), current_mps=(0.2, -0.1))
    record.save("record.csv")
    return bs.Record.load("record.csv", sensors)


def problems(boat: bs.Vehicle, manoeuvre: bs.Manoeuvre, record: bs.Record) -> bs.Problem:
    """A problem of one trial."""
    return bs.Problem(
        boat,
        manoeuvre,
        record,
        free=bs.coefficients.HORIZONTAL,
        prior=bs.priors.relative_normal(0.25),
        nuisance={"current_north_mps": bs.priors.normal(0.0, 0.5)},
        noise={"yaw": bs.likelihoods.AR1(sd=0.002, correlation_time_s=20.0)},
    )


def inference(problem: bs.Problem, truth: bs.Trajectory) -> bs.Posterior:
    """Searches, directions, sampling and report."""
    rng = np.random.default_rng(2)
    joint: bs.JointProblem = bs.JointProblem({"first": problem, "second": problem})
    print(bs.leave_one_out(joint, rng).keys(), bs.identifiability.rank(bs.linear_systems(truth)).keys())
    sqp = bs.baselines.sqp(problem, rng=rng, n_starts=3)
    spectrum = bs.identifiability.fisher(problem, at=sqp)
    criteria: bs.Criteria = bs.Criteria(rhat=1.01, ess=400.0, taus=25.0)
    posterior: bs.Posterior = bs.sample(problem, rng=rng, criteria=criteria, checkpoint="chain")
    check: bs.CrossCheck = bs.cross_check(problem, posterior, rng=rng)
    bs.write_report("report", problem, [sqp], spectrum, posterior, check=check)
    return posterior


def own_models() -> bs.Posterior:
    """Residuals and a log likelihood of a user."""
    priors = {"mean": bs.priors.normal(0.0, 1.0), "sd": bs.priors.log_normal(1.0, 1.0)}
    model: bs.LeastSquaresModel = bs.LeastSquaresModel(lambda p: p[:1] - np.ones(3), priors, sd="sd")
    density: bs.DensityModel = bs.DensityModel(lambda p: float(-(p[0] ** 2)), priors)
    posterior: bs.Posterior = bs.sample(density if model.n_params > 2 else model, rng=np.random.default_rng(3))
    return posterior


def studies() -> bool:
    """Studies from file to result."""
    try:
        study: bs.Study = bs.load_study("studies/quickstart.toml", quick=True)
        result: bs.StudyResult = bs.run(study, "runs/quickstart", resume=True)
    except bs.InputError as error:
        print(error)
        return False
    draws: np.ndarray = bs.export(result.folder, Path("known.toml"), kind="vehicle").posterior.draws
    print(draws.shape)
    sentences: dict[str, str] = result.sentences
    return result.good and bool(sentences) and result.seconds > 0.0
