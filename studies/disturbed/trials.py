"""Trials of boats that are pushed by what the equations leave out, and what different likelihoods make of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import threadpoolctl
from scipy import special

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.sampling import Posterior, sample
from bayesub.inference.sampling.histories import marginal_mode, with_process
from bayesub.model.coefficients import HORIZONTAL
from bayesub.model.disturbance import CURRENTS, Disturbance, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.disturbances import UnknownDisturbance, force_scales
from bayesub.problem.likelihoods import AR1
from bayesub.problem.problem import Problem
from bayesub.sensors import observe
from bayesub.study.run.prepare import Setup, prepare
from bayesub.study.schema.study_file import load_study
from disturbed.filter_error import filter_error
from disturbed.state_space import StateSpace
from thesis.calibration import N_DRAWS

DISTURBED = ("X", "Y", "N")
FINER = 10  # steps of the truth in one of the fit
_DRAWS, _ROUNDS = 200, (2, 40)  # of importance sampling
# Effective draws. With a hundred, sds of 24 parameters were a fifth too small.
_ENOUGH, _TOO_FEW = 400.0, 20.0
_NEAR = 0.3  # effective part of draws, with which the response to forces that was fitted to them is kept
_MISSED = 1.3  # of squared residuals and coordinates, over readings, of a search that misses these
_FREEDOM = 8.0  # of the t distributions that propose
_FEW = 3.0  # effective draws for each parameter, with which the next proposal is half theirs
_LEAST_CORRELATED = 0.1  # correlation of neighbouring residuals that is slow noise
_REFITS = 2  # of slow noise to the residuals of the fit before


@dataclass(frozen=True)
class Truth:
    """How boats are disturbed.

    Attributes
    ----------
    share : float
        Sd of the forces, of the rms of those of the hull.
    time_s : float
        Correlation time.
    removed : str
        Coefficient that the fit holds at zero.
    current_mps : float
        Sd of the current to the north and to the east, in which a boat moves that no force disturbs.
    """

    share: float
    time_s: float
    removed: str = ""
    current_mps: float = 0.0


class DisturbedTrials:
    """A vehicle on the horizontal spiral with sensors: what the trials of it share.

    Parameters
    ----------
    vehicle : str
    sensors : sequence of Sensor
    prior_sd : float
        Of the coefficients, relative to the vehicle's.
    duration_s : float, optional
        After which the manoeuvre is broken off.
    """

    def __init__(self, vehicle: str, sensors, prior_sd: float, duration_s: float = np.inf):
        self.boat, self.sensors, self.prior = load_vehicle(vehicle), sensors, priors.relative_normal(prior_sd)
        whole = load_manoeuvre("horizontal", self.boat)
        n = np.searchsorted(whole.times, duration_s, side="right")
        self.manoeuvre = replace(whole, times=whole.times[:n], controls=whole.controls[:n], rpm=whole.rpm[:n])
        self.free = [name for name in HORIZONTAL if self.boat.xi[self._place(name)] != 0.0]

    def _place(self, name) -> int:
        return int(self.boat.equations.columns([name])[0])

    @cached_property
    def hull(self) -> np.ndarray:
        """(3,) rms of the forces of the hull in the manoeuvre, N and N m."""
        rms = hull_force_rms([Simulator(self.boat, self.manoeuvre, [self.manoeuvre.duration])])
        return rms[[AXES.index(axis) for axis in DISTURBED]]

    def boat_and_record(self, truth: Truth, step: float, rng: np.random.Generator):
        """Coefficients (n_terms,) of a boat of the prior and the record of its trial, and how many boats failed."""
        end = self.manoeuvre.duration
        times, columns, n_failed = np.arange(0.0, end + step, step), [self._place(n) for n in self.free], 0
        process = None
        if truth.share:
            process = Disturbance(DISTURBED, truth.share * self.hull, truth.time_s)
        elif truth.current_mps:
            process = Disturbance(CURRENTS, np.full(len(CURRENTS), truth.current_mps), truth.time_s)
        while True:
            xi = self.boat.xi.copy()
            (xi[columns],) = self.prior.on(np.array(columns), xi, self.boat.equations).sample(rng, 1)
            forces = None if process is None else process.sample(times, rng)
            simulator = Simulator(self.boat, self.manoeuvre, self.manoeuvre.times, dt=step, forces=forces)
            motion = simulator.trajectory(xi)
            if motion.status[0] == "ok":
                return xi, observe(motion, self.sensors, rng), n_failed
            n_failed += 1

    def problem(self, record, removed: str = "", **options) -> Problem:
        """The problem of a record, with the options of :class:`bayesub.problem.problem.Problem`."""
        xi = self.boat.xi.copy()
        if removed:
            xi[self._place(removed)] = 0.0
        free = [name for name in self.free if name != removed]
        return Problem(self.boat, self.manoeuvre, record, free=free, prior=self.prior, xi=xi, **options)

    def known(self, truth: Truth) -> UnknownDisturbance:
        """The process of a truth, with unknown histories."""
        sds = truth.share * self.hull / force_scales(self.boat, DISTURBED)
        return UnknownDisturbance(DISTURBED, dict(zip(DISTURBED, sds, strict=True)), truth.time_s)

    def guessed(self, share: float, log_sd: float, time_s: float, log_sd_of_time: float) -> UnknownDisturbance:
        """A process of which only the order of magnitude is known."""
        sds = share * self.hull / force_scales(self.boat, DISTURBED)
        spread = {axis: priors.log_normal(float(sd), log_sd) for axis, sd in zip(DISTURBED, sds, strict=True)}
        return UnknownDisturbance(DISTURBED, spread, priors.log_normal(time_s, log_sd_of_time))


def known_current(truth: Truth) -> UnknownDisturbance:
    """The current of a truth, with unknown histories."""
    return UnknownDisturbance(CURRENTS, dict.fromkeys(CURRENTS, truth.current_mps), truth.time_s)


def guessed_current() -> UnknownDisturbance:
    """A current of which only the order of magnitude is known."""
    sds = {axis: priors.log_normal(0.03, 1.0) for axis in CURRENTS}
    return UnknownDisturbance(CURRENTS, sds, priors.log_normal(30.0, 0.5))


def judged(problem: Problem, xi: np.ndarray, means, sds, probabilities=None) -> dict:
    """How the estimate of the coefficients (n_params,) stands to the truth, as JSON types.

    Parameters
    ----------
    probabilities : (n_coefficients,) array, optional
        That the posterior gives to what is below the truth; by default of the normal distribution.
    """
    errors = (means - xi[problem.columns]) / sds
    below = special.ndtr(-errors) if probabilities is None else probabilities
    return {
        "rank": np.clip((below * (N_DRAWS + 1)).astype(int), 0, N_DRAWS).tolist(),
        "error": errors.tolist(),
        "sd": (sds / problem.coefficient_prior.sd).tolist(),
    }


def sampled(problem: Problem, xi: np.ndarray, **options) -> dict:
    """:func:`judged` of the posterior by sampling, and :func:`cost`; `options` are of :func:`bayesub.sample`."""
    posterior = sample(problem, **options)
    n = problem.n_coefficients
    below = np.mean(posterior.chain[..., :n] < xi[problem.columns], axis=(0, 1, 2))
    outcome = judged(problem, xi, posterior.mean[:n], posterior.sd[:n], below)
    return outcome | {"failed": not posterior.converged} | cost(posterior)


def cost(posterior: Posterior) -> dict:
    """What sampling took, and whether it converged, as JSON types."""
    return {
        "n_params": len(posterior.names),
        "converged": posterior.converged,
        "seconds": posterior.seconds,
        "simulations": posterior.evaluations,
        "jacobians": posterior.jacobians,
        "work_per_effective_sample": posterior.work / float(posterior.bulk_ess.min()),
        "longest_tau": float(posterior.tau.max()),
        "slowest": posterior.names[int(posterior.bulk_ess.argmin())],
        "acceptance": posterior.acceptance,
    }


def read_log(log: str, study: str) -> Setup:
    """The problem of the text of a log, ``log.csv``, and of a study file."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "log.csv").write_text(log)
        file = Path(folder) / "study.toml"
        file.write_text(study)
        return prepare(load_study(file))


def normal(problem: Problem, xi: np.ndarray, estimate: Estimate) -> dict:
    """:func:`judged` of the normal approximation about an estimate."""
    n = problem.n_coefficients
    sds = np.sqrt(np.diag(estimate.covariance)[:n])
    failed = not estimate.statuses[0].startswith("converged")
    return judged(problem, xi, estimate.values[:n], sds) | {"failed": failed, "seconds": estimate.seconds}


def slow_noise(problem: Problem, pose, estimate: Estimate) -> tuple[Problem, Estimate]:
    """The problem with slow noise in every channel whose residuals are slow after the fit before, and its estimate.

    Parameters
    ----------
    pose : callable
        Makes a problem of noise models by channel.
    """
    for _ in range(_REFITS):
        predicted = problem.predicted(estimate.values)[0]
        noises = {}
        for channel, part in zip(problem.record.channels, problem.forward.measurement.slices, strict=True):
            residuals = problem.readings[part] - predicted[part]
            neighbours = np.sum(residuals[1:] * residuals[:-1]) / np.sum(residuals**2)
            if neighbours > _LEAST_CORRELATED:
                sd = max(channel.sd, float(np.sqrt(np.mean(residuals**2))))
                interval = float(np.median(np.diff(channel.times)))
                noises[channel.name] = AR1(sd, -interval / float(np.log(neighbours)))
        posed = pose(noises)
        estimate = gauss_newton(posed, estimate.values)
    return posed, estimate


@threadpoolctl.threadpool_limits.wrap(1, "blas")
def integrated(problem: Problem, xi: np.ndarray, coefficients: Mapping[str, float], rng: np.random.Generator) -> dict:
    """:func:`judged` of the posterior with the histories integrated out, by importance sampling.

    The proposals have t distributions, first about the marginal mode and then with the moments of the draws so far,
    as far as these are many (adaptive multiple importance sampling: Cornuet et al. 2012). Where few are effective in
    the end, the posterior is sampled with the histories.

    Parameters
    ----------
    coefficients : dict of str to float
        Where a second search for the mode begins if the first, from the middle of the prior, misses the readings.
    """
    marginal, centre, laplace = _marginal(problem, coefficients)
    covariance = laplace

    def density(x):
        return marginal.log_likelihood(marginal.prior.unscaled(x)) + marginal.prior.scaled_log_density(x)

    draws, targets, proposals, effective = [], [], [], 0.0
    for n in range(_ROUNDS[1]):
        lower = np.linalg.cholesky(covariance)
        proposals.append((centre, lower))
        tails = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, (_DRAWS, 1)))
        x = centre + tails * (rng.standard_normal((_DRAWS, len(centre))) @ lower.T)
        draws.append(x)
        if n < _ROUNDS[0] and effective < _NEAR * _DRAWS:  # the response is fitted to draws of what is known by then
            marginal.fit(marginal.prior.unscaled(x[: marginal.n_draws]), rng)
            targets = [density(before) for before in draws[:-1]]
        targets.append(density(x))
        x, target = np.concatenate(draws), np.concatenate(targets)
        ratios = target - special.logsumexp([_log_t(x, *proposal) for proposal in proposals], axis=0)
        weights = special.softmax(ratios)
        effective = float(1.0 / np.sum(weights**2))
        if n + 1 >= _ROUNDS[0] and effective > _ENOUGH:
            break
        if n + 1 == _ROUNDS[1] and effective < _TOO_FEW:
            return sampled(problem, xi, rng=rng)
        share = effective / (effective + _FEW * len(centre))
        centre = share * (weights @ x) + (1.0 - share) * centre
        covariance = share * (x - centre).T @ ((x - centre) * weights[:, None]) + (1.0 - share) * laplace
    n = problem.n_coefficients
    parameters = marginal.prior.unscaled(x)
    means = weights @ parameters[:, :n]
    sds = np.sqrt(weights @ (parameters[:, :n] - means) ** 2)
    below = np.sum(weights[:, None] * (parameters[:, :n] < xi[problem.columns]), axis=0)
    process = dict(zip(marginal.names[n:], (weights @ parameters[:, n:]).tolist(), strict=True))
    outcome = {"failed": False, "effective": effective, "process": process}
    return judged(problem, xi, means, sds, below) | outcome


def _log_t(x, centre, lower):
    """Log densities (n,) of x (n, n_params) but for a constant."""
    squares = np.sum(np.linalg.solve(lower, (x - centre).T) ** 2, axis=0)
    return -0.5 * (_FREEDOM + x.shape[1]) * np.log1p(squares / _FREEDOM) - np.log(np.diag(lower)).sum()


def approximated(problem: Problem, xi: np.ndarray, coefficients: Mapping[str, float]) -> dict:
    """As :func:`integrated`, by the normal approximation about the marginal mode."""
    marginal, centre, laplace = _marginal(problem, coefficients)
    n = problem.n_coefficients
    means = marginal.prior.unscaled(centre)[:n]
    sds = problem.coefficient_prior.sd * np.sqrt(np.diag(laplace))[:n]  # their prior is normal
    return judged(problem, xi, means, sds) | {"failed": False}


def _marginal(problem, coefficients):
    """The marginal problem, its mode in scaled coordinates, and the covariance there."""
    known = problem.with_wide_process()
    search = gauss_newton(known)
    if search.costs[0] > _MISSED * len(problem.readings):
        other = gauss_newton(known, with_histories(known, coefficients))
        search = min(search, other, key=lambda estimate: estimate.costs[0])
    marginal, mode = marginal_mode(problem, with_process(problem, search))
    centre = marginal.prior.scaled(mode)
    jacobian = marginal.prior.scaled_chain(marginal.jacobian(mode), centre)
    return marginal, centre, np.linalg.inv(jacobian.T @ jacobian + np.eye(len(centre)))


def filtered(problem: Problem, xi: np.ndarray, start: np.ndarray, rng: np.random.Generator) -> dict:
    """:func:`judged` of the filter-error estimate."""
    estimate = filter_error(StateSpace(problem), rng=rng, starts=[start], agreement=1)
    return normal(problem, xi, estimate)


def with_histories(problem: Problem, coefficients: Mapping[str, float]) -> np.ndarray:
    """(n_all,) the given coefficients, and what is most likely before of all else."""
    start = problem.prior.parameters(np.zeros(problem.n_params))
    start[: problem.n_coefficients] = [coefficients[name] for name in problem.names[: problem.n_coefficients]]
    return start
