"""What a design is to make small: optimality criteria, coefficients known to so many per cent, or a quantity.

Each goal is a number for an :class:`bayesub.design.information.Information`; among manoeuvres the least is the best.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bayesub.design.information import Information

Goal = Callable[[Information], float]
SHARPNESS = 4.0  # with which the count of known coefficients falls about the share that is asked for


class Known:
    """Minus the number of coefficients known to a share of their value, smooth so that a search sees where it rises."""

    def __init__(self, share: float):
        self.share = share

    def __call__(self, information: Information) -> float:
        """Minus the sum of 1 / (1 + (sd / share)^4)."""
        with np.errstate(over="ignore"):
            ratio = information.relative_sd / self.share
            return -float(np.sum(1.0 / (1.0 + ratio**SHARPNESS)))


def d_optimality(information: Information) -> float:
    """Logarithm of the volume of the posterior (:attr:`Information.d_optimality`)."""
    return information.d_optimality


def a_optimality(information: Information) -> float:
    """Logarithm of the mean variance."""
    return float(np.log(information.a_optimality))


class EOptimality:
    """Logarithm of the sd of the least known direction that is not null."""

    def __init__(self, n_null: int):
        self.n_null = n_null

    def __call__(self, information: Information) -> float:
        """As :meth:`Information.e_optimality`."""
        return float(np.log(information.e_optimality(self.n_null)))


class Sharpest:
    """Mean logarithm of the sds of some coefficients and quantities over those before the trial."""

    def __init__(self, gradients: Sequence[np.ndarray]):
        self.gradients = gradients

    def __call__(self, information: Information) -> float:
        """Mean of log(sd after / sd before)."""
        return float(np.mean([np.log(information.sd_of(g) / information.prior_sd_of(g)) for g in self.gradients]))
