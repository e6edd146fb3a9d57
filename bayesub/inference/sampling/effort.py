"""What a Jacobian costs, in simulations, and what draws have cost."""

import time
from dataclasses import dataclass

import numpy as np

from bayesub.inference.interface import LeastSquares

_BATCH = 64  # simulations at once, as in a step of the sampler
_REPEATS = 3  # of which the fastest counts


@dataclass(frozen=True)
class Effort:
    """What the draws of a sampler have cost.

    Attributes
    ----------
    simulations : those within a Jacobian not among them
    jacobians : Jacobians
    jacobian_price : of a Jacobian, simulations
    seconds : wall time
    ess : bulk effective sample size of the worst parameter
    """

    simulations: int
    jacobians: int
    jacobian_price: float
    seconds: float
    ess: float

    @property
    def work(self) -> float:
        """Simulations, a Jacobian at its price; what takes no Jacobians needs no price of them."""
        return self.simulations + (self.jacobians * self.jacobian_price if self.jacobians else 0.0)

    @property
    def per_effective_sample(self) -> float:
        """:attr:`work` over :attr:`ess`."""
        return self.work / self.ess


def jacobian_price(problem: LeastSquares, parameters: np.ndarray) -> float:
    """The time of a Jacobian over the time per simulation in a batch, on this machine.

    Parameters
    ----------
    problem : whose simulations and Jacobians are measured; they are counted like any others
    parameters : (n_params,) where the simulation completes
    """
    batch = np.repeat(np.asarray(parameters, dtype=float)[None], _BATCH, axis=0)
    simulation = _fastest(lambda: problem.residuals(batch)) / _BATCH
    return _fastest(lambda: problem.jacobian(batch[0])) / simulation


def _fastest(work) -> float:
    """The shortest of several times, s."""
    times = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return max(min(times), 1e-9)
