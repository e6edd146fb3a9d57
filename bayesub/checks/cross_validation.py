"""Do the other trials predict the one that was left out? Cross-validation of a joint problem by manoeuvre."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayesub.baselines import gauss_newton
from bayesub.identifiability.interface import InferenceProblem, TrialsInference
from bayesub.identifiability.linalg import complete_svd

N_DRAWS = 400
INTERVALS = (0.5, 0.9)


@dataclass(frozen=True)
class LeftOut:
    """How the posterior of all other trials predicts one.

    Attributes
    ----------
    n_readings : of the trial
    n_failed : draws whose simulation failed, which are left out
    chi_square_per_reading : squared errors of the prediction, weighed by its own covariance and that of the noise;
        about one if the prediction is as good as it says
    p_value : share of replicated readings, and the record, whose chi-square is as large; uniform if the model is right,
        however bent the posterior
    coverage : probability -> share of the readings within their central predictive intervals; they err together, so
        that it is the probability on average over many trials only
    """

    n_readings: int
    n_failed: int
    chi_square_per_reading: float
    p_value: float
    coverage: dict[float, float]


def leave_one_out(
    joint: TrialsInference,
    rng: np.random.Generator,
    *,
    draw: Callable[[InferenceProblem, np.random.Generator, int], np.ndarray] | None = None,
    n_draws: int = N_DRAWS,
) -> dict[str, LeftOut]:
    """Predict each trial of a :class:`bayesub.problem.joint.JointProblem` from the others; trial -> LeftOut.

    Nuisance parameters that are the trial's own, and coefficients that no other trial has free, come from their prior.

    Parameters
    ----------
    joint : of two trials or more
    rng : source of the draws
    draw : function of a problem, `rng` and a number n that returns (n, n_params) draws of its posterior; by default
        :func:`laplace`, which is quick and, far along directions in which the posterior bends, too wide
    n_draws : half of them make the predictive mean and covariance, half the replicated readings
    """
    predictions = {}
    for trial, problem in joint.problems.items():
        others = joint.without(trial)
        known = (draw or laplace)(others, rng, n_draws)
        parameters = problem.prior.sample(rng, n_draws)
        for k, name in enumerate(problem.names):
            if name in others.names:
                parameters[:, k] = known[:, others.names.index(name)]
        predictions[trial] = _judged(problem, parameters, rng)
    return predictions


def laplace(problem: InferenceProblem, rng: np.random.Generator, n: int) -> np.ndarray:
    """(n, n_params) draws of the Laplace approximation at the mode, made where the prior is standard normal."""
    mode = gauss_newton(problem).values
    t = problem.prior.standard(mode)
    _, s, vt = complete_svd(problem.prior.chain(problem.jacobian(mode), t))
    return problem.prior.parameters(t + (rng.standard_normal((n, len(t))) / np.sqrt(s**2 + 1.0)) @ vt)


def _judged(problem, parameters, rng) -> LeftOut:
    predicted = problem.predicted(parameters)
    flown = np.isfinite(predicted).all(axis=1)
    replicated = problem.replicated(parameters[flown], rng)
    middle, half = predicted[flown], np.count_nonzero(flown) // 2
    mean = middle[:half].mean(axis=0)
    directions = (middle[:half] - mean) / problem.sds / np.sqrt(half - 1.0)
    sizes = _chi_squares((np.vstack([problem.readings, replicated[half:]]) - mean) / problem.sds, directions)
    coverage = {}
    for probability in INTERVALS:
        low, high = np.quantile(replicated, [0.5 - 0.5 * probability, 0.5 + 0.5 * probability], axis=0)
        coverage[probability] = float(np.mean((problem.readings >= low) & (problem.readings <= high)))
    return LeftOut(
        n_readings=len(problem.readings),
        n_failed=int(np.count_nonzero(~flown)),
        chi_square_per_reading=float(sizes[0] / len(problem.readings)),
        p_value=float(np.mean(sizes >= sizes[0])),
        coverage=coverage,
    )


def _chi_squares(errors, directions) -> np.ndarray:
    """(n,) e'(I + A'A)^-1 e of errors e (n, n_readings) with A (n_draws, n_readings) the directions."""
    _, s, vt = np.linalg.svd(directions, full_matrices=False)
    return np.sum(errors**2, axis=1) - (errors @ vt.T) ** 2 @ (s**2 / (s**2 + 1.0))
