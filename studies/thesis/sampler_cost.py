"""What a posterior costs, by this sampler and by the moves that emcee comes with, and the problems to measure it on."""

import time
from collections.abc import Sequence

import emcee
import numpy as np

from bayesub import sensors
from bayesub.inference.checks import convergence
from bayesub.inference.sampling import Posterior
from bayesub.model.coefficients import NAMES, SUBPROBLEMS
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import choose_step
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.priors import Normal
from bayesub.problem.problem import Problem
from thesis import cases

SEED = 690
VARIANTS = ("normal", "uniform", "rounded")  # prior sd 25 %; prior within 75 %; thesis_rounding with a normal prior
POSITION_SD_M, ROUNDED_SD = 0.5, (0.001, 0.0001)  # on suboff; m/s and m/s^2
FINER = 8.0  # steps in one that would do for the track, where readings are rounded
N_ENSEMBLES = 4
N_JACOBIANS = 12
UNSEEN = 0.01  # singular value, in prior sd: the data move the mean by as much, less than a standard error


def pose(vehicle: str, manoeuvre: str, variant: str, free: Sequence[str] | None = None) -> Problem:
    """A record of the manoeuvre, and what is to be inferred from it.

    Parameters
    ----------
    vehicle, manoeuvre : of :mod:`thesis.cases`
    variant : of :data:`VARIANTS`
    free : coefficients; by default all of the sub-problem
    """
    boat, suboff = load_vehicle(vehicle), load_vehicle("suboff")
    flown = load_manoeuvre(manoeuvre, boat)
    scale = boat.length_m / suboff.length_m
    interval = scale * suboff.speed_mps / boat.speed_mps
    sensor = sensors.tracking_range(position_sd_m=scale * POSITION_SD_M, interval_s=interval)
    if variant == "rounded":
        velocity, acceleration = ROUNDED_SD
        sensor = sensors.thesis_rounding(
            interval_s=interval, velocity_sd_mps=velocity, acceleration_sd_mps2=acceleration
        )
    prior = priors.relative_uniform(0.75) if variant == "uniform" else priors.relative_normal(0.25)
    free, rng = free or SUBPROBLEMS.get(manoeuvre, NAMES), np.random.default_rng(SEED)
    if variant != "rounded":
        return cases.posed(boat, flown, sensor, rng, free=free, prior=prior)
    # Truth and model have the same step: rounded accelerations ask for one of half a millisecond. The forces with
    # sg(v) and sg(w) jump, and the density with them from step to step, by several units if steps are as long as the
    # track allows: then it is not the readings that make it hard.
    step = choose_step(boat, flown, flown.subproblem) / FINER
    record = sensors.observe(simulate(boat, flown, dt=step), sensor, rng)
    return Problem(boat, flown, record, free=free, prior=prior, dt=step)


def cost(posterior: Posterior) -> dict:
    """What a posterior cost, in simulations an effective sample of its worst parameter, and whether it converged.

    A Jacobian counts at its measured price.
    """
    ess = posterior.bulk_ess
    worst = int(np.argmin(ess))
    return {
        "converged": posterior.converged,
        "evaluations": posterior.evaluations,
        "jacobians": posterior.jacobians,
        "jacobian_price": posterior.jacobian_price,
        "seconds": posterior.seconds,
        "simulation_seconds": posterior.simulation_seconds,
        "ess": float(ess[worst]),
        "worst": posterior.names[worst],
        "per_sample": posterior.work / float(posterior.bulk_ess.min()),
        "tau": float(posterior.tau.max()),
        "rhat": float(posterior.rhat.max()),
        "acceptance": float(posterior.acceptance),
    }


def rival(problem: Problem, moves, rng: np.random.Generator, budget: int) -> Posterior:
    """Independent emcee ensembles of three walkers a parameter, in prior coordinates, from draws of the prior.

    Parameters
    ----------
    moves : called for the moves of each ensemble
    budget : number of simulations
    """
    n_params = problem.n_params
    n_walkers = 4 * (1 + 3 * n_params // 4)
    n_steps = budget // (N_ENSEMBLES * n_walkers)
    watch = time.perf_counter()

    def log_prob(t):
        return problem.log_likelihood(problem.prior.parameters(t)) - 0.5 * np.einsum("ij,ij->i", t, t)

    chains, densities, accepted = [], [], 0.0
    for _ in range(N_ENSEMBLES):
        sampler = emcee.EnsembleSampler(n_walkers, n_params, log_prob, moves=moves(), vectorize=True)
        state = np.random.RandomState(rng.integers(2**32)).get_state()  # the generator that emcee knows
        sampler.run_mcmc(emcee.State(starts(problem, rng, n_walkers), random_state=state), n_steps)
        half = n_steps // 2
        chains.append(problem.prior.parameters(sampler.get_chain(discard=half)))
        densities.append(sampler.get_log_prob(discard=half))
        accepted += sampler.acceptance_fraction.mean() / N_ENSEMBLES
    return Posterior(
        names=problem.names,
        chain=np.array(chains),
        log_prob=np.array(densities),
        prior_mean=problem.prior.mean,
        prior_sd=problem.prior.sd,
        n_warmup=n_steps // 2,
        acceptance=accepted,
        evaluations=problem.costs.simulations,
        seconds=time.perf_counter() - watch,
        failures=dict(problem.costs.failures),
        jacobian_price=0.0,  # it takes none
        simulation_seconds=problem.costs.seconds,
    )


def starts(problem: Problem, rng: np.random.Generator, n: int) -> np.ndarray:
    """(n, n_params) draws of the prior in its coordinates t, whose simulations complete."""
    found = np.empty((0, problem.n_params))
    while len(found) < n:
        t = rng.standard_normal((n, problem.n_params))
        found = np.concatenate([found, t[np.isfinite(problem.log_likelihood(problem.prior.parameters(t)))]])
    return found[:n]


def unseen(problem: Problem, posterior: Posterior) -> dict | None:
    """The directions that the data do not see, along which a posterior must have mean and sd of a normal prior.

    Returns
    -------
    dict or None
        Their number ``n``, and the largest ``departure`` of mean and sd from the prior's in Monte Carlo standard
        errors. None where the prior is not normal.
    """
    if not isinstance(problem.prior, Normal):
        return None
    # At one point every motion that fits has directions which it alone does not see: take several.
    some = posterior.draws[:: len(posterior.draws) // N_JACOBIANS]
    jacobians = [problem.jacobian(parameters) * problem.prior.sd for parameters in some]
    _, s, vt = np.linalg.svd(np.concatenate(jacobians) / np.sqrt(len(some)), full_matrices=False)
    along = (posterior.chain - problem.prior.mean) / problem.prior.sd @ vt[s < UNSEEN].T
    if not along.shape[-1]:
        return {"n": 0, "departure": 0.0}
    squares = along**2 - 1.0
    departures = [
        np.abs(f.mean(axis=(0, 1, 2))) / f.std(axis=(0, 1, 2)) * np.sqrt(convergence.ess(f)) for f in (along, squares)
    ]
    return {"n": along.shape[-1], "departure": float(np.max(departures))}
