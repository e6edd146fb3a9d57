"""Least squares on the equations of motion (thesis section 9.4), axis by axis, by singular values."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from bayesub.inference.baselines.estimate import Estimate
from bayesub.inference.interface import LinearForm


def linear_least_squares(
    systems: Mapping[str, LinearForm], guess: dict[str, float], *, held: Iterable[str] = (), rcond: float = 1e-12
) -> Estimate:
    """Solve ``matrix @ xi = load`` of each axis.

    The motion is taken as it is: nothing that is unknown of readings and instruments, such as clocks, can be searched.
    Columns are scaled to unit length first. Where the matrix has a null space (singular values below `rcond` of the
    largest of the axis) the solution nearest to the guess is taken, in scaled coordinates: along those directions the
    data say nothing and the answer is the guess.

    `systems` are from :func:`bayesub.model.linear_form.linear_systems`, the `guess` is coefficient name -> value, and
    coefficients named in `held`, such as the added masses that reduce the rank, keep the value of the guess. The cost
    of the Estimate is the root mean square residual relative to that of the load, largest over the axes. The covariance
    is the classical one, ``sigma^2 (A'A)^-1`` with sigma from the residuals of the axis: right if the errors are
    independent, equal and in the load only. It is None if an axis is not unique.
    """
    began = time.perf_counter()
    forms, values, blocks, misfits, deficient = scaled(systems, guess, held), [], [], [], []
    for form in forms:
        u, s, vt = np.linalg.svd(form.matrix, full_matrices=False)
        informed = s > rcond * s[0]
        inverse = vt[informed].T / s[informed]
        solution, residuals = np.zeros(len(form.names)), -form.load
        for _ in range(2):  # the second refines what rounding in the first has lost
            solution = solution - inverse @ (u.T @ residuals)[informed]
            residuals = form.matrix @ solution - form.load
        values.append(form.centre + solution / form.lengths)
        misfits.append(np.linalg.norm(residuals) / form.load_norm)
        variance = residuals @ residuals / max(1, len(residuals) - informed.sum())
        blocks.append(variance * inverse @ inverse.T / np.outer(form.lengths, form.lengths))
        if not informed.all():
            deficient.append(f"{form.axis} rank {informed.sum()}/{len(s)}")
    status = f"not unique: {', '.join(deficient)}; hold an added mass of the axis" if deficient else "unique"
    covariance = None if deficient else linalg.block_diag(*blocks)
    return estimate("linear least squares", forms, values, misfits, status, covariance, began)


@dataclass(frozen=True)
class Scaled:
    """``matrix @ ((xi - centre) * lengths) = load`` for the coefficients of an axis that are not held."""

    axis: str  # such as "X"
    names: tuple[str, ...]  # the n_columns coefficients
    matrix: np.ndarray  # (n_samples, n_columns) with columns of unit length
    lengths: np.ndarray  # (n_columns,) of the original columns, N or N m
    centre: np.ndarray  # (n_columns,) the guess
    load: np.ndarray  # (n_samples,) what the guess leaves unexplained, N or N m
    load_norm: float  # length of the original load


def scaled(systems: Mapping[str, LinearForm], guess: dict[str, float], held: Iterable[str] = ()) -> list[Scaled]:
    """Each axis of the linear form with the coefficients named in `held` kept at their guess.

    Solving for the difference from a guess loses fewer digits. Axes all of whose coefficients are held are left out.
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


def estimate(
    method: str,
    forms: list[Scaled],
    values: list[np.ndarray],
    costs: Sequence[float | np.floating],
    status: str,
    covariance: np.ndarray | None,
    began: float,
) -> Estimate:
    """The estimate from (n_columns,) values and a cost for each of the forms; `began` is the time of the start."""
    names, solutions = tuple(name for form in forms for name in form.names), np.concatenate(values)[None]
    found = names, solutions, np.array([max(costs)]), (status,), covariance
    return Estimate(method, *found, evaluations=0, seconds=time.perf_counter() - began)
