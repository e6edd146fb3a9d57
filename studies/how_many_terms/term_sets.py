"""Smaller and smaller sets of terms of one boat: posed, fitted, and flown on manoeuvres that they have not seen."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from bayesub.findings.unseen import leave_one_out
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.prediction import laplace
from bayesub.inference.sampling import sample
from bayesub.model.coefficients import NAMES, SUBPROBLEMS
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import priors
from bayesub.problem.joint import JointProblem
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe
from how_many_terms.needless_terms import Approximation, log_ratio_of_draws
from how_many_terms.reweighting import TRUSTED, reweighted
from thesis.cases import VEHICLES, unseen

STEP = 1.0  # s, of truth and model, so that nothing but noise and terms makes a difference
INTERVAL_S, POSITION_SD_M, ATTITUDE_SD_DEG = 2.0, 0.5, 0.1  # of a tracking range
PRIOR_SD, GUESS = 0.5, 0.15  # of a term, in its size; error of the guess
DRAWS, MAX_STEPS = 4000, 4000  # of a posterior; of its ensembles
ENDED = -1e3  # log ratio from which a set is no model of the trial any more


def sizes(boat: Vehicle) -> np.ndarray:
    """(n_terms,) how large each term may be: as on the boat, or where it has none the largest of other boats.

    A term that none of the built-in boats has may be as large as the median of those on its axis.
    """
    largest = np.max([np.abs(load_vehicle(name).xi) for name in VEHICLES], axis=0)
    present = {axis: [s for s, name in zip(largest, NAMES, strict=True) if s and name[0] == axis] for axis in "XYZKMN"}
    others = np.where(largest > 0.0, largest, [np.median(present[name[0]]) for name in NAMES])
    return np.where(boat.xi != 0.0, np.abs(boat.xi), others)


def posed(boat: Vehicle, manoeuvres, noise: float, free, seed: int) -> Problem | JointProblem:
    """Tracks of one boat or several, with `noise` times that of a tracking range; truth and model have one step.

    The prior of every term is normal about a guess, with half of its size; the guess is 15 % off where the boat has
    the term, and where it has none it is a draw, so that the prior does not tell which terms there are.
    """
    guesses, readings = np.random.default_rng(seed).spawn(2)
    guess, sd = priors.perturbed(boat.xi, GUESS, guesses), PRIOR_SD * sizes(boat)
    guess = np.where(boat.xi == 0.0, sd * guesses.standard_normal(len(sd)), guess)
    given = {name: priors.normal(float(g), float(s)) for name, g, s in zip(NAMES, guess, sd, strict=True)}
    prior, problems = priors.Given(priors.relative_normal(PRIOR_SD), given), {}
    sensor = Track(noise * POSITION_SD_M, noise * ATTITUDE_SD_DEG, INTERVAL_S)
    for name in manoeuvres:
        flown = load_manoeuvre(name, boat)
        record = observe(simulate(boat, flown, dt=STEP), sensor, readings)
        problems[name] = Problem(boat, flown, record, free=free, prior=prior, dt=STEP)
    return JointProblem(problems) if len(problems) > 1 else problems[name]


def without(problem: Problem | JointProblem, gone) -> Problem | JointProblem:
    """The same problem with the terms `gone` set to zero."""
    if isinstance(problem, JointProblem):
        return JointProblem({name: without(one, gone) for name, one in problem.problems.items()})
    xi = problem.xi.copy()
    xi[[NAMES.index(name) for name in gone]] = 0.0
    free = [name for name in problem.names if name not in gone]
    record, manoeuvre = problem.record, problem.manoeuvre
    return Problem(problem.vehicle, manoeuvre, record, free=free, prior=problem.spread, xi=xi, dt=STEP)


@dataclass(frozen=True)
class Fit:
    """A set of terms at its posterior mode.

    Attributes
    ----------
    problem : Problem or JointProblem
        With the terms that are left.
    values : (n_params,) array
        The mode.
    log_evidence : float
        By the Laplace approximation there, but for what all sets of a record have in common.
    approximation : Approximation
        The posterior about the mode.
    """

    problem: Problem | JointProblem
    values: np.ndarray
    log_evidence: float
    approximation: Approximation

    @property
    def zeros(self) -> np.ndarray:
        """(n_params,) standard normal coordinates of terms of zero."""
        return self.problem.prior.standard(np.zeros(self.problem.n_params))


def fit(problem: Problem | JointProblem, start: np.ndarray) -> Fit:
    """The mode that is reached from a start; ValueError if the boat does not complete the manoeuvre there."""
    mode = gauss_newton(problem, start, tolerance=0.02)
    t, jacobian = problem.prior.standard(mode.values), problem.jacobian(mode.values)
    jacobian = problem.prior.chain(jacobian, t)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    log_evidence = -0.5 * (mode.costs[0] + np.sum(np.log1p(singular**2)))
    approximation = Approximation(jacobian, problem.residuals(mode.values[None])[0], t)
    return Fit(problem, mode.values, float(log_evidence), approximation)


def removed(first: Fit, per_fit: int) -> Iterator[tuple[tuple[str, ...], Fit]]:
    """What has been taken away so far, and the fit of the rest, until the rest is no model of the trial.

    Terms go in the order of their Savage-Dickey ratios in the approximation about the last fit; it is made again when
    `per_fit` have gone.
    """
    gone, last = (), first
    yield gone, last
    while last.problem.n_params > per_fit:
        names, prior = last.problem.names, last.problem.prior
        removals = [
            removal for _, removal in zip(range(per_fit), last.approximation.removals(last.zeros), strict=False)
        ]
        now = [names[removal.position] for removal in removals]
        left = [k for k, name in enumerate(names) if name not in now]
        try:
            last = _refitted(without(last.problem, now), prior.parameters(removals[-1].t)[left], last.values[left])
        except ValueError:
            return
        gone = (*gone, *now)
        yield gone, last
        if last.log_evidence - first.log_evidence < ENDED:
            return


def _refitted(problem, *starts) -> Fit:
    """The fit from the first of the starts from which the boat completes the manoeuvre."""
    for start in starts[:-1]:
        try:
            return fit(problem, start)
        except ValueError:
            pass
    return fit(problem, starts[-1])


def prediction_errors(boat: Vehicle, sets: Mapping[str, np.ndarray], n_manoeuvres: int) -> dict[str, np.ndarray]:
    """Name of a set -> (n_manoeuvres,) rms position error on random manoeuvres, m; not a number where it fails."""
    xi, errors = np.stack(list(sets.values())), []
    for simulator in unseen(boat, n_manoeuvres):
        (truth,), _ = simulator.run(boat.xi)
        states, status = simulator.run(xi)
        off = np.linalg.norm(states[:, :, :3] - truth[:, :3], axis=2)
        errors.append(np.where(status == 0, np.sqrt(np.mean(off**2, axis=1)), np.nan))
    return dict(zip(sets, np.transpose(errors), strict=True))


def path(first: Fit, per_fit: int, less: float) -> tuple[list[tuple[tuple[str, ...], Fit]], int, int]:
    """All sets from :func:`removed`, and the places of that of highest evidence and the smallest that fits as well.

    Parameters
    ----------
    first : Fit
        With all terms.
    per_fit : int
        Terms that go at a time.
    less : float
        Log evidence that a set may lack to fit as well.
    """
    sets = list(removed(first, per_fit))
    evidence = np.array([one.log_evidence for _, one in sets])
    return sets, int(np.argmax(evidence)), int(np.flatnonzero(evidence >= evidence.max() - less)[-1])


def record(boat: Vehicle, manoeuvre: str, noise: float, seed: int, n_manoeuvres: int, *, per_fit: int, less: float):
    """How many terms one record asks for, which the data see, and how the sets predict, as JSON types."""
    problem = posed(boat, [manoeuvre], noise, NAMES, seed)
    first = fit(problem, boat.xi[problem.columns])
    sets, best, needed = path(first, per_fit, less)
    absent = {name for name, value in zip(NAMES, boat.xi, strict=True) if value == 0.0}
    kept = set(sets[needed][1].problem.names)
    seen = first.approximation.ratios_alone(first.zeros) < -less
    imitated = [name for name, is_seen in zip(problem.names, seen, strict=True) if is_seen and name not in kept]
    flown = {str(k): one.problem.coefficient_sets(one.values)[0] for k, (_, one) in enumerate(sets)}
    errors = prediction_errors(boat, flown, n_manoeuvres)
    logs = {key: np.log(errors[str(k)]) for key, k in {"full": 0, "best": best, "needed": needed}.items()}
    evidence = [one.log_evidence for _, one in sets]
    return {
        "sizes": [one.problem.n_params for _, one in sets],
        "log_evidence": [round(value - max(evidence), 2) for value in evidence],
        "errors_m": [float(f"{np.exp(np.nanmean(np.log(errors[str(k)]))):.4g}") for k in range(len(sets))],
        "gone": list(sets[-1][0]),
        "best": sets[best][1].problem.n_params,
        "needed": len(kept),
        "absent": len(absent & set(problem.names)),
        "absent_best": len(absent & set(sets[best][1].problem.names)),
        "absent_needed": len(absent & kept),
        "unseen": int(np.count_nonzero(~seen)),
        "imitated": sorted(imitated),
        "log_error_m": {key: np.round(values, 3).tolist() for key, values in logs.items()},
        "failed": int(sum(np.isnan(errors[str(k)]).sum() for k in (0, best, needed))),
    }


def plane(boat: Vehicle, trials, noise: float, seed: int, chosen, *, per_fit: int, less: float) -> dict:
    """The horizontal plane by several trials: sampled ratios beside normal ones, each trial predicted by the others.

    Of the `chosen` sets, all terms ("full") or the smallest that fits as well as the best ("needed"); as JSON types.
    """
    problem = posed(boat, trials, noise, SUBPROBLEMS["horizontal"], seed)
    sets, best, needed = path(fit(problem, boat.xi[problem.columns]), per_fit, less)
    places, result = {"full": 0, "needed": needed}, {"best": sets[best][1].problem.n_params}
    for key in chosen:
        one, rng = sets[places[key]][1], np.random.default_rng(seed)
        posterior = sample(one.problem, rng=rng, max_steps=MAX_STEPS)
        draws = posterior.draws[rng.choice(len(posterior.draws), DRAWS)]
        result[key] = {
            "n_terms": one.problem.n_params,
            "converged": posterior.converged,
            "ratios": compared_ratios(one, draws),
            "left_out": left_out(one, draws, rng),
        }
    return result


def compared_ratios(one: Fit, draws: np.ndarray) -> dict[str, tuple[float, float]]:
    """Term -> log Savage-Dickey ratio by the normal approximation and by draws, where these reach to zero."""
    t, normal = one.problem.prior.standard(draws), one.approximation.ratios(one.zeros)
    sampled = [log_ratio_of_draws(zero, column) for zero, column in zip(one.zeros, t.T, strict=True)]
    pairs = zip(one.problem.names, normal, sampled, strict=True)
    return {name: (round(float(a), 2), round(b, 2)) for name, a, b in pairs if np.isfinite(b)}


def left_out(one: Fit, draws: np.ndarray, rng: np.random.Generator) -> dict[str, dict]:
    """Each trial as the others predict it: by weighted draws where they can be trusted, else by another fit.

    The fit is the Laplace approximation; k_hat is the shape of the tail of the weights.
    """
    shapes = {}

    def draw(others, rng, n):
        (trial,) = set(one.problem.problems) - set(others.problems)
        weights, shapes[trial] = reweighted(one.problem, draws, trial)
        if shapes[trial] <= TRUSTED:
            return draws[rng.choice(len(draws), n, p=weights)]
        return laplace(others, rng, n, one.values)

    predictions = leave_one_out(one.problem, rng, draw=draw)
    return {
        trial: {
            "k_hat": round(shapes[trial], 2),
            "crps_m": round(float(np.mean([prediction.crps[axis] for axis in "xy"])), 5),
            "coverage": round(prediction.coverage[0.9], 3),
            "p_value": round(prediction.p_value, 4),
        }
        for trial, prediction in predictions.items()
    }
