"""The gradient of the log likelihood, exact and by differences."""

import numpy as np


def both(problem, parameters: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """J'z, and minus the slopes of the log likelihood by differences over one and two steps, extrapolated to zero."""
    t = problem.prior.standard(parameters)
    gradient = problem.prior.chain(problem.jacobian(parameters), t).T @ problem.residuals(parameters)[0]

    def central(step):
        offsets = step * np.eye(problem.n_params)
        plus, minus = (problem.log_likelihood(problem.prior.parameters(t + sign * offsets)) for sign in (1, -1))
        return (minus - plus) / (2 * step)

    return gradient, (4 * central(step) - central(2 * step)) / 3
