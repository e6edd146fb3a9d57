"""A surrogate of the posterior density that costs a hundredth of a simulation.

In whitened coordinates z the residuals are emulated by a polynomial (:func:`bayesub.sampling.geometry.features`),
fitted by least squares to simulations at draws from near the posterior. With the misfit of the fit as additional noise
(Kaipio & Somersalo 2007) the k emulated residuals r are standard normal, but for the emulator's own errors, which are
larger in the tails. Their density is therefore that of a t distribution of nu = 30 + 3 k degrees of freedom,

    log S = log prior - (nu + k) / 2 log(1 + |r|^2 / nu).

The draws come from the surrogate before: first of all from the Laplace approximation, which is a wide and flat sheet
where the posterior is a thin and bent one. Each round brings them nearer. All but the last are drawn at twice the
variance of the readings, so that the surrogate holds in the tails as well.
"""

import numpy as np

from bayesub.sampling.geometry import Geometry, features
from bayesub.sampling.moves import crank_nicolson

STEPS = (0.1, 0.2, 0.4, 0.8)  # of the Crank-Nicolson sweeps on the surrogate
_ROUNDS = 4
_HOT = 2.0  # temperature of the draws that the surrogate is fitted to
_SWEEPS = 20  # over all draws, three times before the sheet is straightened and once after
_FREEDOM = (30.0, 3.0)  # degrees of freedom, and those for each emulated residual
_SPAN = 0.03  # posterior sd; directions of the residuals that vary less are left out
_SPANNING = 300  # simulations that show which
_BATCH = 512


class Surrogate:
    """Emulated posterior density.

    Parameters
    ----------
    geometry : its whitening and active directions stay as they are; its bends may change later
    z : (n, n_params) whitened coordinates of the residuals (n, n_readings), and at_mode (n_readings,) those at the mode
    """

    def __init__(self, geometry: Geometry, z, residuals, at_mode):
        self.geometry = geometry
        changes = residuals - at_mode
        some = changes[:_SPANNING]
        _, s, vt = np.linalg.svd(some, full_matrices=False)
        span = vt[s > _SPAN * np.sqrt(len(some))]
        known = features(z, geometry.active)
        coefficients = np.linalg.lstsq(known, changes @ span.T)[0]
        misfit = changes @ span.T - known @ coefficients
        noise = np.eye(len(span)) + misfit.T @ misfit / (len(z) - known.shape[1])
        coefficients[0] += span @ at_mode
        self.coefficients = np.linalg.solve(np.linalg.cholesky(noise), coefficients.T).T

    def arrays(self) -> dict[str, np.ndarray]:
        """What it consists of besides its geometry, to be stored."""
        return {"surrogate": self.coefficients}

    @classmethod
    def restored(cls, geometry: Geometry, arrays: dict[str, np.ndarray]) -> "Surrogate":
        """The surrogate that :meth:`arrays` describe, bit for bit."""
        self = cls.__new__(cls)
        self.geometry, self.coefficients = geometry, arrays["surrogate"]
        return self

    def log_prob(self, y, temperature: float = 1.0) -> np.ndarray:
        """(n,) log densities at sampling coordinates y (n, n_params), the likelihood to the power 1 / temperature."""
        z = self.geometry.bent(y)
        residuals = features(z, self.geometry.active) @ self.coefficients
        log_prior = self.geometry.prior.scaled_log_density(self.geometry.scaled(z))
        n_degrees = _FREEDOM[0] + _FREEDOM[1] * residuals.shape[1]
        excess = np.log1p(np.einsum("ij,ij->i", residuals, residuals) / n_degrees)
        return log_prior - 0.5 / temperature * (n_degrees + residuals.shape[1]) * excess


def learn(
    problem, geometry: Geometry, rng: np.random.Generator, progress=lambda _: None
) -> tuple[Surrogate, np.ndarray]:
    """Find the active directions, straighten the geometry and fit a surrogate.

    Returns
    -------
    the surrogate, and draws of it (n, n_params) in sampling coordinates. `progress` is called with the fraction done.
    """
    random = np.random.RandomState(rng.integers(2**32))
    geometry.find_active(problem, random)
    (at_mode,) = problem.residuals(geometry.prior.unscaled(geometry.mode[None]))
    n_features = features(np.zeros((1, geometry.n_params)), geometry.active).shape[1]
    y = geometry.draws(random, 2 * n_features + 300)
    for n in range(_ROUNDS):
        progress(n / _ROUNDS)
        z = geometry.bent(y)
        parameters = geometry.prior.unscaled(geometry.scaled(z))
        chunks = [parameters[first : first + _BATCH] for first in range(0, len(y), _BATCH)]
        residuals = np.concatenate([problem.residuals(chunk) for chunk in chunks])
        done = np.isfinite(residuals).all(axis=1)
        surrogate = Surrogate(geometry, z[done], residuals[done], at_mode)
        y = _settled(geometry, surrogate, y, _HOT if n < _ROUNDS - 1 else 1.0, random)
    return surrogate, y


def _settled(geometry, surrogate, y, temperature, random):
    """Draws of the surrogate at a temperature from draws y (n, n_params) of another one, geometry straightened."""

    def log_prob(y):
        return surrogate.log_prob(y, temperature)

    density, seen = log_prob(y), []
    for _ in range(3):
        y, density, _ = crank_nicolson(log_prob, y, density, STEPS, _SWEEPS, random)
        seen.append(geometry.bent(y))
    geometry.straighten(np.concatenate(seen))
    y = geometry.straightened(seen[-1])
    return crank_nicolson(log_prob, y, log_prob(y), STEPS, _SWEEPS, random)[0]
