"""The thesis's nine identification cases, three boats on three manoeuvres, and its published numbers.

Vehicles stand in for the classified boats in order: suboff for submarine 1, auv690 for 2, npsauv for 3.
"""

import tomllib
from itertools import product
from pathlib import Path

import numpy as np

from bayesub.inference import baselines
from bayesub.inference.sampling import Posterior, posterior_file, sample
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.coefficients import NAMES
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import Simulator, true_step
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe, unread

VEHICLES = ("suboff", "auv690", "npsauv")
MANOEUVRES = ("horizontal", "vertical", "coupled")
CASES = tuple(product(VEHICLES, MANOEUVRES))
SEED = 2003
TOLERANCES = (0.1, 0.01)  # parTol and funcTol (thesis section 7.2.2)
SUBOFF_TIME = 102.2606 / 7.5  # s to travel a ship length, to which the sampling interval refers
# What a towing tank without a planar motion mechanism measures: forces at drift and rudder angles (appendix G).
TOWED = ("Xuu", "Xvv", "Xuu_drdr", "Yuv", "Yv_absnu", "Yuu_dr", "Nuv", "Nv_absnu", "Nuu_dr")
WEIGHT = 10.0  # samples of the thesis to one of ours


def published() -> dict:
    """The thesis's numbers: table -> rows or columns, submarines 1 to 3 in order."""
    return {name: section for name, section in _results().items() if name != "tables"}


def legible() -> dict:
    """Rows of each table of the thesis: how many it has, how many the scan leaves legible, and where they are."""
    return _results()["tables"]


def _results() -> dict:
    return tomllib.loads(Path(__file__).with_name("thesis_results.toml").read_text(encoding="utf-8"))


def time_scale(boat: Vehicle) -> float:
    """The time that a boat takes for its length over suboff's, to which sampling intervals and time steps refer."""
    return boat.length_m / boat.speed_mps / SUBOFF_TIME


def length_scale(boat: Vehicle) -> float:
    """The length of a boat over suboff's, to which position noise refers."""
    return boat.length_m / load_vehicle("suboff").length_m


def tracking_range(boat: Vehicle) -> Track:
    """Position to 0.5 m and attitude to 0.1 degrees once a second on suboff, in proportion on the others."""
    return Track(0.5 * length_scale(boat), 0.1, time_scale(boat))


def held(manoeuvre: str) -> list[str]:
    """The added masses that are held at the truth so that the other coefficients are unique (thesis section 6.4)."""
    return published()["rank"]["fixed_added_mass"][manoeuvre]


def free_coefficients(boat: Vehicle, manoeuvre: str) -> list[str]:
    """The coefficients identified in section 7.3: in the equations of the manoeuvre, not zero and not held."""
    flown = load_manoeuvre(manoeuvre, boat)
    active = boat.equations.active(boat, flown, flown.subproblem)
    return [name for name in active if name not in held(manoeuvre)]


def track_problem(
    boat: Vehicle, manoeuvre: str, free, *, centre=None, xi=None, rng=None, sd=1.0, position_sd=None
) -> Problem:
    """The track whose sum of squared residuals is the cost of the thesis when `sd` (m and degrees) is one.

    `position_sd` (m) is that of the positions if it differs: the boat's :func:`length_scale` makes the cost that of a
    boat as long as suboff.

    That cost is in the model manual, section 10.
    It is sampled every second and weighted ten-fold, for the thesis's every 0.1 s; times scale with length over speed.
    Truth and model have the same step, so that without noise the true coefficients cost nothing.
    """
    flown = load_manoeuvre(manoeuvre, boat)
    truth = Simulator(boat, flown, flown.times).trajectory(boat.xi)
    sensor = Track((position_sd or sd) / np.sqrt(WEIGHT), sd / np.sqrt(WEIGHT), time_scale(boat))
    record = observe(truth, sensor, rng)
    prior = priors.relative_normal(0.25, boat.xi if centre is None else centre)
    return Problem(boat, flown, record, free=free, prior=prior, xi=xi, dt=truth.simulator.step)


def streams(vehicle: str, manoeuvre: str) -> list[np.random.Generator]:
    """Random numbers of a case: for the starts of searches, and for noise."""
    seed = [SEED, VEHICLES.index(vehicle), MANOEUVRES.index(manoeuvre)]
    return [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2)]


def identify(problem: Problem, rng: np.random.Generator, n_starts: int, max_iterations: int = 500):
    """SQP from random starts by the rules of thesis section 7.2: forward differences and the thesis's tolerances."""
    return baselines.sqp(
        problem,
        rng=rng,
        n_starts=n_starts,
        gradients="forward",
        tolerances=TOLERANCES,
        max_iterations=max_iterations,
    )


def identified(vehicle: str, manoeuvre: str, n_starts: int, max_iterations: int = 500):
    """The problem of a case and the coefficient sets that SQP identifies from exact tracks, best first."""
    boat = load_vehicle(vehicle)
    problem = track_problem(boat, manoeuvre, free_coefficients(boat, manoeuvre))
    return problem, identify(problem, streams(vehicle, manoeuvre)[0], n_starts, max_iterations)


def unseen(boat: Vehicle, n: int, *, first: int = 0):
    """Simulators of the first `n` random manoeuvres (thesis section 8.2) from seed `first` on that the boat completes.

    Output times are those of :func:`track_problem`; the manoeuvre's name has its seed.
    """
    seed, count, interval = first, 0, time_scale(boat)
    while count < n:
        manoeuvre = load_manoeuvre(f"random:{seed}", boat)
        simulator = Simulator(boat, manoeuvre, np.arange(interval, manoeuvre.duration, interval))
        seed += 1
        if simulator.run(boat.xi)[1][0] == 0:
            count += 1
            yield simulator


def posed(
    boat: Vehicle,
    manoeuvre: Manoeuvre,
    sensors,
    rng: np.random.Generator | None,
    *,
    model: Vehicle | None = None,
    orders: Manoeuvre | None = None,
    **given,
) -> Problem:
    """The problem of a synthetic record: its step follows the sensors, and the boat is flown at a tenth of it.

    Parameters
    ----------
    boat : the true one
    manoeuvre : that it flies
    sensors : what :func:`bayesub.sensors.observe` takes
    rng : of the noise; None for exact readings
    model : the boat that is fitted, if it is another
    orders : the manoeuvre as that boat takes it, if it differs
    **given : what else :class:`bayesub.problem.problem.Problem` takes
    """
    fitted = model or boat, orders or manoeuvre
    step = Problem(*fitted, unread(sensors, manoeuvre.duration), **given).simulator.step
    record = observe(simulate(boat, manoeuvre, dt=true_step(step, manoeuvre)), sensors, rng)
    return Problem(*fitted, record, dt=step, **given)


def trial(vehicle: str, manoeuvre: str, *, sd: float = 0.25, free=None) -> Problem:
    """What a tracking range makes of a case: every coefficient that is not zero, and the added masses, free.

    The sensor is :func:`tracking_range`; the prior is normal with `sd` about a guess 15 % off.
    """
    boat = load_vehicle(vehicle)
    flown = load_manoeuvre(manoeuvre, boat)
    guess, noise = streams(vehicle, manoeuvre)
    prior = priors.relative_normal(sd, priors.perturbed(boat.xi, 0.15, guess))
    return posed(boat, flown, tracking_range(boat), noise, free=free or NAMES, prior=prior)


def sampled(problem: Problem, file: Path, *, max_steps: int = 20_000, progress: Progress = SILENT) -> Posterior:
    """The posterior of a trial, sampled once and kept in `file`, its chain in a folder beside it; converged or not."""
    if not file.exists():
        rng = np.random.default_rng(SEED)
        chain = file.with_name(f"chain_{file.stem}")
        posterior_file.save(sample(problem, rng=rng, max_steps=max_steps, checkpoint=chain, progress=progress), file)
    return posterior_file.load(file)
