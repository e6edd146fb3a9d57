"""Records of a motion, made as a model says or otherwise, and the problem that takes the model for granted."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.discrepancy import find_discrepancies
from bayesub.inference.checks.fit import Criticism, criticise
from bayesub.model.coefficients import HORIZONTAL, INDEX
from bayesub.model.disturbance import Disturbance, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES
from bayesub.model.trajectory import Trajectory
from bayesub.problem.alternatives import LeftOut
from bayesub.problem.priors import perturbed, relative_normal
from bayesub.problem.problem import Problem
from bayesub.sensors import modified, observe
from thesis.coverage import RepeatedTrials

FORCE_TIME = 2.0  # correlation time of unmodelled forces, in lengths over trial speed


@dataclass(frozen=True)
class Departure:
    """How the records differ from what the problem takes for granted; nothing by default.

    Attributes
    ----------
    sensors : settings of the sensors that made the records, in place of those that the problem knows
    noise : channel -> noise model of the records, if it is not that of the sensors
    known_noise : whether the problem knows that noise model
    current_mps : in which the boat flies, north and east
    held : coefficient -> factor by which its fixed value is off
    disturbance : share of the force of the hull that forces on the axes that move have, of 2 l / U correlation time
    right : whether the problem is right all the same
    """

    sensors: dict = field(default_factory=dict)
    noise: Callable | None = None
    known_noise: bool = False
    current_mps: tuple[float, float] = (0.0, 0.0)
    held: dict[str, float] = field(default_factory=dict)
    disturbance: float = 0.0
    right: bool = False

    def problem(self, motion: Trajectory, sensors, prior_sd: float, rng: np.random.Generator) -> Problem:
        """A record of the motion, on the horizontal plane, and the problem made of it.

        Parameters
        ----------
        motion : flown at a tenth of the step that the sensors ask for, or less
        sensors : what the problem knows of the sensors
        prior_sd : of the coefficients, relative to a guess that is off by as much
        """
        boat = motion.simulator.vehicle
        if self.disturbance:
            motion = self._disturbed(motion, rng)
        used = modified(sensors, **self.sensors)
        record = observe(motion, used, None if self.noise else rng, current_mps=self.current_mps)
        noise = {}
        if self.noise:
            models = {channel.name: self.noise(channel) for channel in record.channels}
            noisy = [replace(c, values=models[c.name].sample(c.values, c.times, rng)) for c in record.channels]
            record, noise = replace(record, channels=tuple(noisy)), models if self.known_noise else {}
        xi = boat.xi.copy()
        for name, factor in self.held.items():
            xi[INDEX[name]] *= factor
        return Problem(
            boat,
            motion.simulator.manoeuvre,
            record,
            free=[name for name in HORIZONTAL if name not in self.held],
            prior=relative_normal(prior_sd, centre=perturbed(boat.xi, prior_sd, rng)),
            noise=noise,
            xi=xi,
        )

    def _disturbed(self, motion, rng):
        """The motion with forces that the equations leave out."""
        simulator, boat = motion.simulator, motion.simulator.vehicle
        axes = PLANES[simulator.subproblem][0]
        rms = hull_force_rms([simulator])[[AXES.index(axis) for axis in axes]]
        correlation_time = FORCE_TIME * boat.length_m / boat.speed_mps
        process = Disturbance(tuple(axes), self.disturbance * rms, correlation_time)
        return simulator.disturbed(process, rng).trajectory(boat.xi)


def warnings(problems, rng: np.random.Generator, interval: float) -> dict:
    """How often residuals call the model into question, over problems of one kind, as JSON types.

    Parameters
    ----------
    problems : iterable, made with the same `rng`
    interval : probability of the intervals whose coverage is counted

    Returns
    -------
    dict
        The share ``warned`` at the posterior mode and ``warned_at_truth``, the share of each of the ``faults`` at the
        mode, and the ``coverage`` of intervals of the Laplace approximation with its ``coverage_error``.
    """
    warned, faults, errors, covariances = [], {}, [], []
    for problem in problems:
        # A search under Student-t noise must start where few readings look like outliers.
        mode = gauss_newton(problem, gauss_newton(problem.naive()).values)
        at_mode, at_truth = (_criticism(problem, place, rng) for place in (mode.values, problem.reference))
        warned.append((not at_mode.fits, not at_truth.fits))
        for fault in {fault for check in at_mode.suspects.values() for fault in check.faults}:
            faults[fault] = faults.get(fault, 0) + 1
        errors.append(mode.values - problem.reference)
        covariances.append(mode.covariance)
    coverage, error = RepeatedTrials(np.array(errors), np.array(covariances)).mean_coverage(interval)
    shares = np.mean(warned, axis=0).tolist()
    return {
        "warned": shares[0],
        "warned_at_truth": shares[1],
        "faults": {fault: count / len(warned) for fault, count in sorted(faults.items())},
        "coverage": coverage,
        "coverage_error": error,
    }


NONE, UNCORRELATED, FITS = "nothing", "not correlated", "fits"


def proposals(problems, rng: np.random.Generator) -> dict:
    """What the residuals of problems of one kind are explained by, as JSON types.

    Returns
    -------
    dict
        ``n_records``; ``first``: kind of explanation, or "nothing", "not correlated" or "fits" -> number of records of
        which it is the first; ``second``: the same of the second explanations, only where there are two;
        ``seconds``: median time of an explanation; and ``sizes``: of proposed disturbances, axis -> list of sds.
    """
    first, second, seconds, sizes = Counter(), Counter(), [], {}
    for problem in problems:
        mode = gauss_newton(problem, gauss_newton(problem.naive()).values)
        criticism = _criticism(problem, mode.values, rng)
        if criticism.fits or not any("correlated" in check.faults for check in criticism.suspects.values()):
            first[FITS if criticism.fits else UNCORRELATED] += 1
            continue
        began = time.perf_counter()
        kinds = find_discrepancies(LeftOut(problem), problem.prior.standard(mode.values))
        seconds.append(time.perf_counter() - began)
        first[kinds[0].kind if kinds else NONE] += 1
        if len(kinds) > 1:
            second[kinds[1].kind] += 1
        if kinds and kinds[0].kind == "disturbance":
            for axis, size in kinds[0].sizes.items():
                sizes.setdefault(axis, []).append(size)
    counts = {"n_records": sum(first.values()), "first": dict(sorted(first.items())), "second": dict(second)}
    return counts | {"seconds": float(np.median(seconds)) if seconds else None, "sizes": sizes}


def _criticism(problem: Problem, parameters, rng: np.random.Generator) -> Criticism:
    times = {name: channel.times for name, (channel, _) in problem.channels.items()}
    return criticise(problem.quantile_residuals(parameters, rng), times)
