"""How a posterior predicts logs that were not fitted, beside other estimates: numbers, sentences, a verdict."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.inference.baselines import Estimate
from bayesub.inference.checks import prediction as checks
from bayesub.inference.checks.prediction import FALSE_ALARMS, N_DRAWS, Prediction, given_warm_up, laplace, predict
from bayesub.inference.sampling import Posterior
from bayesub.io import templates
from bayesub.io.arguments import checked
from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.problem.joint import JointProblem
from bayesub.problem.unseen import UnseenTrial, left_out

POSTERIOR, MODE, SQP, PRIOR, PRIOR_MEAN = "posterior", "posterior mode", "SQP", "prior", "prior mean"
N_OTHERS = 200  # draws of an estimate that the posterior is compared with
MOST_READINGS = 8_000_000  # of all draws, which then take 64 MB; of a long log there are fewer draws
FEW = 0.7  # of the readings within 90 % bands, below which a log that is predicted is in doubt


@dataclass(frozen=True)
class TrialPrediction:
    """An unseen trial as it is predicted."""

    trial: UnseenTrial
    predictions: dict[str, Prediction]  # by whom: the posterior, and what it is compared with
    converged: bool  # whether the posterior is

    @property
    def posterior(self) -> Prediction:
        """That of the posterior."""
        return self.predictions[POSTERIOR]


def predicted_trial(
    trial: UnseenTrial,
    fitted: AnyProblem,
    posterior: Posterior,
    estimates: Sequence[Estimate],
    rng: np.random.Generator,
) -> TrialPrediction:
    """Predict a trial by a posterior, its mode, its prior, the middle of that, and the best solution of SQP.

    What the fitted trials do not tell is drawn given the warm-up of the trial, by each of them for itself.

    `fitted`: of the trials that were fitted; `posterior`: of their parameters; `estimates`: of the same trials; SQP is
    looked for among them; `rng`: chooses draws, and is the source of noise.
    """
    trial = trial.with_fitted_noise(fitted, posterior.best)
    n = number_of_draws(len(trial.problem.readings))
    draws = draws_by_whom(fitted, posterior, estimates, rng, n)  # and those of the posterior are predicted by first
    predictions = {
        name: predict(trial.problem, parameters, rng, warm_up=trial.warm_up_s).without_draws()
        for name, parameters in transfer(trial, fitted, draws, rng)
    }
    return TrialPrediction(trial, predictions, posterior.converged)


@checked
def leave_one_out(
    joint: JointProblem,
    rng: np.random.Generator,
    *,
    draw: Callable[[JointProblem, np.random.Generator, int], np.ndarray | Posterior] | None = None,
    n_draws: int | None = None,
) -> dict[str, Prediction]:
    """Predict each trial of several from the others, as ``bayesub run --leave-out`` does.

    What the others do not tell of a trial, such as start and current, comes from its warm-up, after which it is judged;
    coefficients that no other trial has free come from their prior. Each trial has a child of `rng` as the source of
    draws and noise. `draw` takes the problem of the others, a generator and a number n, and returns their posterior or
    (n, n_params) draws of it; by default :func:`bayesub.inference.checks.prediction.laplace`, which is quick and, far
    along directions in which the posterior bends, too wide. InputError for one trial, or one that is too short.
    """
    predictions = {}
    for (name, trial), own in zip(left_out(joint).items(), rng.spawn(len(joint.problems)), strict=True):
        others, n = joint.without(name), n_draws or number_of_draws(len(trial.problem.readings))
        found = (draw or laplace)(others, own, n)
        if isinstance(found, Posterior):
            known, best = found.draws[own.choice(len(found.draws), n)], found.best
        else:
            known, best = found, found[np.argmax(others.log_prob(found))]
        trial = trial.with_fitted_noise(others, best)
        ((_, parameters),) = transfer(trial, others, [(POSTERIOR, known)], own)
        predictions[name] = predict(trial.problem, parameters, own, warm_up=trial.warm_up_s)
    return predictions


def number_of_draws(n_numbers: int, most: int = N_DRAWS) -> int:
    """How many draws are predicted by, `most` of them unless so many numbers of each fill the memory."""
    return int(np.clip(MOST_READINGS // n_numbers, min(N_OTHERS, most), most))


def draws_by_whom(
    fitted: AnyProblem, posterior: Posterior, estimates: Sequence[Estimate], rng: np.random.Generator, n: int
) -> Iterator[tuple[str, np.ndarray]]:
    """By whom, and draws (.., n_fitted) of the fitted parameters, `n` of posterior and prior; the others are points."""
    yield POSTERIOR, posterior.draws[rng.choice(len(posterior.draws), n)]
    yield PRIOR, posterior.known_before(fitted.prior).sample(rng, n)
    points = {MODE: posterior.best, PRIOR_MEAN: fitted.prior.mean}
    for estimate in estimates:
        if estimate.method == SQP:
            points[SQP] = fitted.prior.mean.copy()
            known = {name: k for k, name in enumerate(estimate.names) if name in fitted.names}
            points[SQP][[fitted.names.index(name) for name in known]] = estimate.values[list(known.values())]
    yield from ((name, np.repeat(point[None], N_OTHERS, axis=0)) for name, point in points.items())


def transfer(
    trial: UnseenTrial, fitted: AnyProblem, draws: Iterable[tuple[str, np.ndarray]], rng: np.random.Generator
) -> Iterator[tuple[str, np.ndarray]]:
    """By whom, and parameters (.., n_params) of a trial: what draws do not tell is drawn given its warm-up."""
    not_fitted = trial.own(fitted)
    for name, some in draws:
        parameters = trial.transferred(fitted, some, rng)
        yield name, given_warm_up(trial.problem, parameters, rng, not_fitted, trial.warm_up_s)


def numbers(predictions: Sequence[TrialPrediction]) -> list[dict]:
    """What there is to say of each trial, as JSON types; errors in the unit of the column.

    False alarms are shared among the trials (Bonferroni).
    """
    trials = [_numbers(prediction, FALSE_ALARMS / len(predictions)) for prediction in predictions]
    return [trial | {"sentence": _sentence(trial)} for trial in trials]


def _numbers(prediction: TrialPrediction, false_alarms: float) -> dict:
    trial, posterior = prediction.trial, prediction.posterior
    problem = trial.problem
    result: dict[str, Any] = {
        "name": trial.name,
        "kind": "left out" if trial.is_left_out else "check",
        "log": problem.manoeuvre.name,
        "converged": prediction.converged,
        "first_s": trial.warm_up_s,
        "last_s": float(problem.times.max()),
        "n_readings": posterior.n_readings,
        "failed_draws": {name: one.n_failed for name, one in prediction.predictions.items()},
        "n_draws": posterior.n_flown + posterior.n_failed,
        "predicts": posterior.predicts(false_alarms),
        "p_value": posterior.p_value,
        "false_alarms": false_alarms,
        "coverage": {},
        "channels": {},
    }
    if not posterior.is_flown:
        return result
    flown = {name: one for name, one in prediction.predictions.items() if one.is_flown}
    result["coverage"] = by_percent(posterior.coverage)
    result["worst"] = posterior.worst
    result["crps_over_prior"] = mean_ratio(posterior.crps, flown[PRIOR].crps) if PRIOR in flown else None
    half_widths = posterior.by_channel(0.5 * np.diff(posterior.bands[0.9], axis=0)[0])
    held = {p: posterior.by_channel(held) for p, held in posterior.held.items()}
    for name in posterior.rms:
        column = log_files.HEADERS[problem.channels[name][0].quantity]
        factor = 1.0 / log_files.si_factor(column)
        result["channels"][name] = {
            "column": column,
            "n_readings": len(half_widths[name]),
            "coverage": by_percent({p: float(values[name].mean()) for p, values in held.items()}),
            "half_width": factor * float(half_widths[name].mean()),
            "rms": {by: factor * one.rms[name] for by, one in flown.items()},
            "crps": {by: factor * one.crps[name] for by, one in flown.items()},
        }
    return result


def by_percent(coverage: Mapping[float, float]) -> dict[str, float]:
    """Coverage with its probabilities in words."""
    return {f"{100 * probability:g} %": share for probability, share in coverage.items()}


def mean_ratio(first: Mapping[str, float], second: Mapping[str, float]) -> float:
    """Geometric mean over the channels."""
    return float(np.exp(np.mean([np.log(first[name] / second[name]) for name in first])))


def sentence(trials: Sequence[dict], n_logs: int, n_trials: int = 1) -> dict[str, str]:
    """The sentence on prediction, by topic: about what was predicted, or that nothing was.

    `trials`: of :func:`numbers`; `n_logs` of the `n_trials` fitted trials are logs; simulated ones need no sentence.
    """
    if trials:
        text = " ".join(trial["sentence"] for trial in sorted(trials, key=lambda trial: trial["predicts"]))
        n_left_out = sum(trial["kind"] == "left out" for trial in trials)
        if 0 < n_left_out < n_trials:
            text += f" Of {n_trials} trials {n_left_out} have been left out."
        if not all(trial["predicts"] for trial in trials):
            text += " The coefficients are valid for the fitted log at best, whatever its residuals say: fit both "
            text += "together ([[trials]]), or look for what differs between them (a zero of the rudder: "
            text += "bias_rudder_deg)."
        return {"prediction": text}
    text = "No prediction was tried: the only log is fitted. A model may pass every test of fit and predict badly; "
    text += 'name a second log in the study: [[check]] data = "other.csv".'
    if n_logs > 1:
        text = f"No prediction was tried: all {n_logs} logs are fitted. Run again with --resume --leave-out, which "
        text += "predicts each from the others, or name a log that is not fitted in [[check]]."
    return {"prediction": text} if n_logs else {}


def _sentence(trial: dict) -> str:
    """Whether a trial is predicted, and how well, by its numbers."""
    values = {"intervals": [f"{100 * share:g} %" for share in checks.INTERVALS], "with_unit": with_unit}
    values |= {"false_alarms": FALSE_ALARMS, "few": FEW}
    values |= {"lost": lambda what: not_flown(trial["failed_draws"][POSTERIOR], trial["n_draws"], what)}
    return " ".join(templates.fill("bayesub.findings", "prediction.txt", trial=trial, **values).split())


def not_flown(n_failed: int, n: int, what: str) -> str:
    """What to say of draws of the posterior with which the boat does not complete a trial; empty if there are none."""
    if not n_failed:
        return ""
    return f" With {n_failed} of {n} draws of the posterior the boat does not complete {what}; they are left out."
