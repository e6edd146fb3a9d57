"""Do the other trials predict the one that was left out? Cross-validation of a joint problem by manoeuvre."""

from collections.abc import Callable

import numpy as np

from bayesub.inference.baselines import gauss_newton
from bayesub.inference.checks.prediction import Prediction, predict
from bayesub.inference.identifiability.linalg import complete_svd
from bayesub.inference.interface import Sampled, Searchable, TrialsInference

N_DRAWS = 400


def leave_one_out(
    joint: TrialsInference,
    rng: np.random.Generator,
    *,
    draw: Callable[[Sampled, np.random.Generator, int], np.ndarray] | None = None,
    n_draws: int = N_DRAWS,
) -> dict[str, Prediction]:
    """Predict each trial of a :class:`bayesub.problem.joint.JointProblem` from the others.

    Nuisance parameters that are the trial's own, and coefficients that no other trial has free, come from their prior.

    Parameters
    ----------
    joint : of two trials or more
    rng : source of the draws
    draw : function of a problem, `rng` and a number n that returns (n, n_params) draws of its posterior; by default
        :func:`laplace`, which is quick and, far along directions in which the posterior bends, too wide
    n_draws : of each prediction

    Returns
    -------
    dict of str to Prediction
        By trial.
    """
    predictions = {}
    for trial, problem in joint.problems.items():
        others = joint.without(trial)
        known = (draw or laplace)(others, rng, n_draws)
        parameters = problem.prior.sample(rng, n_draws)
        for k, name in enumerate(problem.names):
            if name in others.names:
                parameters[:, k] = known[:, others.names.index(name)]
        predictions[trial] = predict(problem, parameters, rng)
    return predictions


def laplace(problem: Searchable, rng: np.random.Generator, n: int, start: np.ndarray | None = None) -> np.ndarray:
    """(n, n_params) draws of the Laplace approximation at the mode, made where the prior is standard normal.

    The mode is searched from `start` (n_params,), left out from the middle of the prior.
    """
    mode = gauss_newton(problem, start).values
    t = problem.prior.standard(mode)
    _, s, vt = complete_svd(problem.prior.chain(problem.jacobian(mode), t))
    return problem.prior.parameters(t + (rng.standard_normal((n, len(t))) / np.sqrt(s**2 + 1.0)) @ vt)
