"""Priors on the free coefficients."""

from dataclasses import dataclass

import numpy as np

from bayesub.errors import InputError


@dataclass(frozen=True)
class Normal:
    """Independent normal prior: `mean` and `sd`, both (n_params,)."""

    mean: np.ndarray
    sd: np.ndarray

    def log_density(self, parameters) -> np.ndarray:
        """(n_batch,) log densities of parameters (n_batch, n_params)."""
        standardised = (parameters - self.mean) / self.sd
        constant = -np.log(self.sd).sum() - 0.5 * len(self.sd) * np.log(2.0 * np.pi)
        return constant - 0.5 * np.sum(standardised**2, axis=-1)

    def sample(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_params) draws."""
        return self.mean + self.sd * rng.standard_normal((n, len(self.mean)))


@dataclass(frozen=True)
class RelativeNormal:
    """A normal prior on each coefficient with sd a fraction of the size of its centre; see :func:`relative_normal`."""

    sd: float
    centre: np.ndarray | None

    def on(self, columns: np.ndarray, xi: np.ndarray) -> Normal:
        """The prior of the coefficients at `columns`, centred on `xi` unless a centre was given."""
        centre = (xi if self.centre is None else self.centre)[columns]
        return Normal(mean=centre.copy(), sd=self.sd * np.abs(centre))


def relative_normal(sd: float, centre=None) -> RelativeNormal:
    """Normal prior with standard deviation ``sd * |centre|`` for each coefficient.

    Parameters
    ----------
    sd : relative standard deviation, 0.25 for 25 %
    centre : (101,) coefficient set; by default the vehicle's own. A coefficient whose centre is zero has no scale
        and stays fixed.
    """
    if not (np.isfinite(sd) and sd > 0):
        raise InputError(f"prior: sd must be positive, found {sd}")
    return RelativeNormal(float(sd), None if centre is None else np.asarray(centre, dtype=float))


def perturbed(xi, sd: float, rng: np.random.Generator) -> np.ndarray:
    """A guess: each coefficient of `xi` times ``1 + sd * standard normal``, with the sign of the original."""
    return xi * np.abs(1.0 + sd * rng.standard_normal(len(xi)))
