"""The linear form of each axis (model manual, section 9), scaled for a solver, with held columns subtracted."""

import time
from dataclasses import dataclass

import numpy as np

from bayesub.inference.baselines.estimate import Estimate


@dataclass(frozen=True)
class Scaled:
    """``matrix @ ((xi - centre) * lengths) = load`` for the coefficients of an axis that are not held.

    Attributes
    ----------
    axis : such as "X"
    names : the n_columns coefficients
    matrix : (n_samples, n_columns) with columns of unit length
    lengths : (n_columns,) of the original columns, N or N m
    centre : (n_columns,) the guess
    load : (n_samples,) what the guess leaves unexplained, N or N m
    load_norm : length of the original load
    """

    axis: str
    names: tuple[str, ...]
    matrix: np.ndarray
    lengths: np.ndarray
    centre: np.ndarray
    load: np.ndarray
    load_norm: float

    def coefficients(self, scaled) -> np.ndarray:
        """(n_columns,) coefficients at a scaled offset from the guess."""
        return self.centre + scaled / self.lengths


def scaled(systems, guess: dict[str, float], held=()) -> list[Scaled]:
    """Each axis of the linear form with the coefficients named in `held` kept at their guess.

    Solving for the difference from a guess loses fewer digits than solving for the coefficients. Axes all of whose
    coefficients are held are left out.
    """
    forms = []
    for system in systems.values():
        free = ~np.isin(system.names, list(held))
        if not free.any():
            continue
        values = np.array([guess[name] for name in system.names])
        lengths = np.linalg.norm(system.matrix[:, free], axis=0)
        forms.append(
            Scaled(
                axis=system.axis,
                names=tuple(name for name, is_free in zip(system.names, free, strict=True) if is_free),
                matrix=system.matrix[:, free] / lengths,
                lengths=lengths,
                centre=values[free],
                load=system.load - system.matrix @ values,
                load_norm=float(np.linalg.norm(system.load)),
            )
        )
    return forms


def estimate(method, forms, values, costs, status, covariance, began) -> Estimate:
    """The estimate from (n_columns,) values and a cost for each of the forms; `began` is the time of the start."""
    return Estimate(
        method=method,
        names=tuple(name for form in forms for name in form.names),
        solutions=np.concatenate(values)[None],
        costs=np.array([max(costs)]),
        statuses=(status,),
        covariance=covariance,
        evaluations=0,
        seconds=time.perf_counter() - began,
    )
