"""The likelihood of the innovations of an extended Kalman filter, as a problem that searches can take.

An innovation is a reading less what the filter expects of it from all readings before. At each time the m innovations v
are normal with the covariance S = L L', so that minus twice the log likelihood is ``sum of |e|^2 + 2 log |L|`` with
e = L^-1 v (Jategaonkar 2015, section 5.5). S depends on the parameters too. With

    residuals  e and (1 - e e') / sqrt(2),    Jacobian  L^-1 dv and L^-1 dS L^-T / sqrt(2)

J'r is the gradient of minus the log likelihood and J'J its expected information, each time given those before.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from bayesub.inference.interface import CostCounter, InferencePrior

_STEP = 1e-4  # of a difference, in prior standard deviations


class Members(Protocol):
    """A batch of members of a random process with n_states states."""

    states: np.ndarray  # (n_batch, n_states) expected at the start
    covariances: np.ndarray  # (n_batch, n_states, n_states) of these

    def advance(self, k: int, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From states (n_batch, n_states) to the k-th time, of states and m readings there.

        Returns
        -------
        means : (n_batch, n_states + m) array
            Not a number where there are none.
        by_states : (n_batch, n_states + m, n_states) array
            Their derivatives.
        by_noise : (n_batch, n_states + m, n_noises) array
            Derivatives by standard normal noise.
        """


class StateSpaceModel(Protocol):
    """A random process that is read at times, and that depends on parameters."""

    names: tuple[str, ...]
    prior: InferencePrior
    costs: CostCounter
    readings: Sequence[np.ndarray]  # (m,) at each time, perhaps none
    variances: Sequence[np.ndarray]  # (m,) of their noise

    def members(self, parameters: np.ndarray) -> Members:
        """A batch with parameters (n_batch, n_params)."""


class Innovations:
    """The problem as searches know one, :class:`bayesub.inference.interface.Searchable`.

    Parameters
    ----------
    model : StateSpaceModel

    Attributes
    ----------
    names, n_params, prior, costs
        As those of such a problem.
    """

    def __init__(self, model: StateSpaceModel):
        self.model = model
        self.names, self.prior, self.costs = model.names, model.prior, model.costs
        self.n_params = len(model.names)

    def filtered(self, parameters: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Innovations (n_batch, m) and their covariances (n_batch, m, m) at each time that has readings.

        Innovations are not a number from the failure of a member on.
        """
        members, result = self.model.members(parameters), []
        states, covariances, n = members.states, members.covariances, members.states.shape[1]
        for k, (readings, variances) in enumerate(zip(self.model.readings, self.model.variances, strict=True)):
            means, by_states, by_noise = members.advance(k, states)
            # Of states and readings together, without the noise of these.
            joint = by_states @ covariances @ _transposed(by_states) + by_noise @ _transposed(by_noise)
            failed = ~(np.isfinite(means).all(axis=1) & np.isfinite(joint).all(axis=(1, 2)))
            joint[failed], means[failed] = 0.0, np.nan
            states, covariances = means[:, :n], joint[:, :n, :n]
            if len(readings):
                innovations, of_readings = readings - means[:, n:], joint[:, n:, n:] + np.diag(variances)
                result.append((innovations, of_readings))
                gain = np.linalg.solve(of_readings, joint[:, n:, :n])
                states = states + np.einsum("bm,bmn->bn", innovations, gain)
                covariances = covariances - joint[:, :n, n:] @ gain
                covariances = 0.5 * (covariances + _transposed(covariances))
        return result

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,), infinite where the simulation failed.

        The deviance is -2 log likelihood but for a constant: the sum of squared residuals where nothing is random but
        the noise of the readings.
        """
        parameters = np.atleast_2d(parameters)
        parts, deviances = [], np.zeros(len(parameters))
        variances = [part for part in self.model.variances if len(part)]
        for (innovations, covariances), noise in zip(self.filtered(parameters), variances, strict=True):
            factors = np.linalg.cholesky(covariances)
            white = np.linalg.solve(factors, innovations[..., None])
            excess = (np.eye(white.shape[1]) - white * _transposed(white)) / np.sqrt(2.0)
            parts += [white[..., 0], excess.reshape(len(parameters), -1)]
            logarithms = 2.0 * np.log(np.diagonal(factors, axis1=1, axis2=2)) - np.log(noise)
            deviances += np.sum(white[..., 0] ** 2 + logarithms, axis=1)
        return np.hstack(parts), np.where(np.isnan(deviances), np.inf, deviances)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) of one parameter vector (n_params,), by central differences."""
        steps = _STEP * self.prior.sd
        members = np.vstack([parameters, parameters + np.diag(steps), parameters - np.diag(steps)])
        parts = []
        for innovations, covariances in self.filtered(members):
            factor = np.linalg.cholesky(covariances[0])
            slopes, of_covariances = (
                (up - down) / (2.0 * steps.reshape(-1, *(1,) * (up.ndim - 1)))
                for _, up, down in (np.split(part, [1, 1 + self.n_params]) for part in (innovations, covariances))
            )
            half = np.linalg.solve(factor, of_covariances)
            both = np.linalg.solve(factor, _transposed(half))
            parts += [np.linalg.solve(factor, slopes.T), both.reshape(self.n_params, -1).T / np.sqrt(2.0)]
        return np.vstack(parts)

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where the simulation failed."""
        readings = np.concatenate(self.model.variances)
        return -0.5 * (self.misfit(parameters)[1] + np.sum(np.log(2.0 * np.pi * readings)))


def _transposed(matrices):
    return np.swapaxes(matrices, -1, -2)
