"""Problems with a known posterior, and the check that judges draws against it."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass

import numpy as np

from bayesub.inference.checks import convergence
from bayesub.kernels.kalman import HATS, Innovations, Pieces
from bayesub.problem.base import Costs
from bayesub.problem.distributions import WHITE, LogNormal, joined
from bayesub.problem.priors import Normal


class Toy:
    """What inference needs of a problem (:mod:`bayesub.inference.interface`), with unit noise.

    A toy has `residuals(parameters)`, which counts its simulations, and `slopes(parameters)`, their derivatives. It has
    no equations, and so no null directions but those that are handed in.
    """

    preferred_pivots = ()
    heavy_tailed = False
    histories = ()
    duration = 1.0

    def __init__(self, prior):
        self.prior = prior
        self.names = tuple(f"c{k}" for k in range(len(prior.mean)))
        self.n_params = len(self.names)
        self.costs = Costs(failures={"diverged": 0})

    def residuals(self, parameters):
        raise NotImplementedError

    def slopes(self, parameters):
        raise NotImplementedError

    def jacobian(self, parameters):
        self.costs.jacobians += 1
        return self.slopes(parameters)

    def linear_systems(self, _):
        return {}

    def misfit(self, parameters, *predicted):
        residuals = self.residuals(parameters, *predicted)
        return residuals, np.nan_to_num(np.einsum("ij,ij->i", residuals, residuals), nan=np.inf)

    def log_likelihood(self, parameters, *predicted):
        return -0.5 * self.misfit(np.atleast_2d(parameters), *predicted)[1]

    def log_likelihoods(self, parameters):
        return {"reading": self.log_likelihood(parameters)}

    def misfit_about(self, _, parameters, *predicted):
        return self.residuals(parameters, *predicted), self.log_likelihood(parameters, *predicted)

    def smoothed(self, _):
        return self

    def truncated(self, _):
        return self

    def widened(self, scale):
        toy = copy(self)
        toy.residuals = lambda parameters: self.residuals(parameters) / scale
        toy.slopes = lambda parameters: self.slopes(parameters) / scale
        return toy


class Linear(Toy):
    """Residuals ``(matrix @ parameters - readings) / sd`` and a normal prior: the posterior is normal."""

    def __init__(self, matrix, readings, prior, sd=1.0):
        super().__init__(prior)
        self.matrix, self.readings, self.sd = matrix, readings, sd
        n = len(prior.mean)
        self.spread, scaled = (prior.chain(rows, np.zeros(n)) for rows in (np.eye(n), matrix / sd))
        precision = scaled.T @ scaled + np.eye(n)
        self.factor = np.linalg.cholesky(precision)
        self.covariance = self.spread @ np.linalg.inv(precision) @ self.spread.T
        off = readings - matrix @ prior.mean
        self.mean = prior.mean + self.spread @ np.linalg.solve(precision, scaled.T @ (off / sd))

    def standardised(self, draws):
        """Draws (..., n) in coordinates in which the posterior is a standard normal.

        By the factor of the precision: round-off in the covariance drowns what is known 1e5 times better than others.
        """
        return np.linalg.solve(self.spread, (draws - self.mean)[..., None])[..., 0] @ self.factor

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return (parameters @ self.matrix.T - self.readings) / self.sd

    def slopes(self, _):
        return self.matrix / self.sd


# In prior standard deviations: condition number 1e5, and one direction of which the data say nothing.
SINGULAR_VALUES = np.array([1e3, 1e2, 10.0, 1.0, 1e-2, 0.0])


def ill_conditioned(sd=1.0, singular_values=SINGULAR_VALUES):
    """A linear problem with these singular values, and the direction (n,) of the last."""
    rng = np.random.default_rng(5)
    n = len(singular_values)
    prior = Normal(mean=rng.uniform(1, 3, n), sd=10.0 ** rng.uniform(-3, 1, n))
    left = np.linalg.qr(rng.standard_normal((n + 14, n)))[0]
    directions = np.linalg.qr(rng.standard_normal((n, n)))[0]
    matrix = left * singular_values @ directions.T / prior.sd
    readings = matrix @ (prior.mean + prior.sd * rng.standard_normal(n)) + rng.standard_normal(n + 14)
    return Linear(matrix, readings, prior, sd), directions[:, -1]


class Banana(Toy):
    """``x1 + x0^2`` is read as zero within `width`: a thin bent sheet, with both marginals by quadrature over x0.

    A second reading says nothing.
    """

    def __init__(self, width=0.05, reach=3.0):
        super().__init__(Normal(mean=np.zeros(2), sd=np.array([1.0, reach])))
        self.width = width

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return np.stack([(parameters[:, 1] + parameters[:, 0] ** 2) / self.width, 0.0 * parameters[:, 0]], axis=1)

    def slopes(self, parameters):
        return np.array([[2.0 * parameters[0], 1.0], [0.0, 0.0]]) / self.width

    def marginals(self):
        """Grid (n,) of x0 with its weights, and conditional mean (n,) and variance of x1."""
        x = np.linspace(-8.0, 8.0, 4001)
        variance, noise = self.prior.sd[1] ** 2, self.width**2
        weights = np.exp(-0.5 * x**2 - 0.5 * x**4 / (variance + noise))
        return x, weights / weights.sum(), -(x**2) * variance / (variance + noise), 1 / (1 / variance + 1 / noise)


class Cliff(Banana):
    """Whose simulation fails above one."""

    def residuals(self, parameters):
        residuals = super().residuals(parameters)
        residuals[parameters[:, 0] > 1.0] = np.nan
        return residuals


def second_moments(standardised):
    """Features z_i and z_i z_j - [i = j] of draws (..., n), which average zero for a standard normal."""
    n = standardised.shape[-1]
    rows, columns = np.triu_indices(n)
    return np.concatenate(
        [standardised, standardised[..., rows] * standardised[..., columns] - (rows == columns)], axis=-1
    )


def disagreement(features):
    """Largest |mean| of features (n_ensembles, n_steps, n_walkers, n_features) in Monte Carlo standard errors.

    The standard errors come from the effective sample size.
    """
    flat = features.reshape(-1, features.shape[-1])
    return np.max(np.abs(flat.mean(axis=0)) / (flat.std(axis=0) / np.sqrt(convergence.ess(features))))


# Two dozen features stay below 3.5 standard errors in 99 of 100 runs; the autocorrelation time, and with it the error,
# is known to a few ten per cent and optimistic, hence half as much again.
AGREE = 1.5 * 3.5


def standardised(chain, mean, covariance):
    """Draws (..., n) in coordinates in which N(mean, covariance) is a standard normal."""
    scale = np.sqrt(np.diag(covariance))
    factor = np.linalg.cholesky(covariance / np.outer(scale, scale))
    return np.linalg.solve(factor, ((chain - mean) / scale)[..., None])[..., 0]


@dataclass(frozen=True)
class ToyHistory:
    """White coordinates that are forces of sd `s`, the second parameter, and act all at the end."""

    rows: slice
    columns: np.ndarray
    process: np.ndarray
    by_forces: Callable  # (n_rows, n_white) derivatives of the residuals at parameters (n_params,)

    @property
    def wide_process(self):
        return np.ones(len(self.process))

    def innovations(self, parameters):
        n, n_knots = len(parameters), len(self.columns)
        sds = parameters[:, 1] if len(self.process) else np.ones(n)
        roots = np.repeat(sds, n_knots).reshape(n, 1, n_knots)
        return Innovations(np.zeros((n, 1, 3)), np.zeros((n, 1, n_knots, 3)), roots)

    def response(self, parameters):
        """The state is what forces there have been; all residuals are read in the last piece, at the last two knots."""
        rows, n = self.by_forces(parameters), len(self.columns)
        ends = np.zeros((1, n - 1, n, n + HATS))
        for k in range(n - 1):
            ends[0, k] = np.eye(n, n + HATS)
            ends[0, k, k, n] = 1.0
        read = np.hstack([rows[:, : n - 2], np.zeros((len(rows), 2)), rows[:, n - 2 :], np.zeros((len(rows), 1))])
        firsts = np.append(np.zeros(n - 1, dtype=int), len(rows))
        return Pieces(ends, read[None], np.arange(len(rows)), firsts)


class Pushed(Toy):
    """Readings ``theta c + (H0 + theta H1) s w`` with unit noise, white w and unknown sd s of the forces s w."""

    N_READINGS, N_WHITE = 30, 8

    def __init__(self, seed=3, sd=1.0, known=False):
        rng = np.random.default_rng(seed)
        self.c, self.sd, self.known = 3.0 * rng.standard_normal(self.N_READINGS), sd, known
        self.h0, self.h1 = rng.standard_normal((2, self.N_READINGS, self.N_WHITE)) * [[[4.0]], [[2.0]]]
        theta, s, w = 0.4, 1.5, rng.standard_normal(self.N_WHITE)
        noise = rng.standard_normal(self.N_READINGS)
        self.readings = theta * self.c + (self.h0 + theta * self.h1) @ (s * w) + noise
        of_theta, of_s, white = Normal(np.zeros(1), np.ones(1)), LogNormal(np.ones(1), 0.5 * np.ones(1)), [WHITE] * 8
        self.prior_of_others = joined(of_theta, {} if known else {"s": of_s})
        super().__init__(joined(of_theta, dict(enumerate([*([] if known else [of_s]), *white]))))
        first = len(self.prior_of_others.mean)
        columns, process = np.arange(first, self.n_params), np.arange(1, first)
        self.histories = (ToyHistory(slice(0, self.N_READINGS), columns, process, self._by_forces),)

    def with_wide_process(self):
        if self.known:
            return self
        toy = Pushed(sd=self.sd, known=True)
        toy.names = (self.names[0], *self.names[2:])
        return toy

    def widened(self, scale):
        toy = Pushed(sd=scale * self.sd, known=self.known)
        toy.readings, toy.costs = self.readings, self.costs
        return toy

    def _parts(self, parameters):
        if self.known:
            parameters = np.insert(parameters, 1, 1.0, axis=1)
        theta, s, w = parameters[:, :1], parameters[:, 1:2], parameters[:, 2:]
        return theta, s, w, self.h0 + theta[:, :, None] * self.h1

    def flown(self, parameters, policies=None):
        self.costs.simulations += len(parameters)
        parameters = parameters.copy()
        if policies is not None:
            parameters[:, self.histories[0].columns] += policies[0].followed()[:, 0]
        theta, s, w, h = self._parts(parameters)
        predicted = theta * self.c + np.einsum("nij,nj->ni", h, s * w)
        return parameters, predicted, [np.zeros((len(parameters), self.N_WHITE - 1, 0))]

    def residuals(self, parameters, predicted=None):
        predicted = self.flown(parameters)[1] if predicted is None else predicted
        return (predicted - self.readings) / self.sd

    def slopes(self, parameters):
        _, s, w, h = self._parts(np.atleast_2d(parameters))
        by_theta, by_s = self.c + self.h1 @ (s[0] * w[0]), h[0] @ w[0]
        return np.column_stack([by_theta, *([] if self.known else [by_s]), s[0] * h[0]]) / self.sd

    def _by_forces(self, parameters):
        return self._parts(parameters[None])[3][0] / self.sd

    def jacobian_of_others(self, parameters, _=None):
        return self.jacobian(parameters)[:, : len(self.prior_of_others.mean)]

    def marginal(self, theta, s):
        """Log density of the readings given theta and s, but for a constant."""
        h = s * (self.h0 + theta * self.h1)
        covariance = self.sd**2 * np.eye(self.N_READINGS) + h @ h.T
        off = self.readings - theta * self.c
        return -0.5 * (off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1])

    def moments(self, n=161):
        """Means and variances of theta and log s by quadrature."""
        theta, log_s = np.linspace(-1.5, 2.0, n), np.linspace(-1.8, 2.2, n)
        logs = np.array([[self.marginal(t, np.exp(x)) - 0.5 * t**2 - 2.0 * x**2 for x in log_s] for t in theta])
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        of_theta, of_s = weights.sum(axis=1), weights.sum(axis=0)
        means = of_theta @ theta, of_s @ log_s
        return means, (of_theta @ (theta - means[0]) ** 2, of_s @ (log_s - means[1]) ** 2)
