"""Collinearity of the regressors of one axis, which is that of Belsley, Kuh & Welsch (1980, chapter 3).

The linear form has no constant term, so everything is measured about zero: a correlation is the cosine of the angle
between two columns.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bayesub.inference.identifiability.linalg import null_basis, split_svd
from bayesub.inference.interface import LinearForm


@dataclass(frozen=True)
class Collinearity:
    """Relations among the regressors of one axis, with columns scaled to unit length.

    Attributes
    ----------
    axis : such as "X"
    names : (n_columns,) coefficients
    correlation : (n_columns, n_columns) about zero
    vif : (n_columns,) variance inflation factors ``1 / (1 - R^2)`` with R^2 of the regression of a column on all the
        others; infinite where the column has a part in the null space
    condition_indices : (n_informed,) largest singular value over each one that is not null, ascending
    proportions : (n_informed, n_columns), the share of the variance of each coefficient that each of these directions
        makes, with the null directions held; columns sum to one
    """

    axis: str
    names: tuple[str, ...]
    correlation: np.ndarray
    vif: np.ndarray
    condition_indices: np.ndarray
    proportions: np.ndarray

    def involved(self, i: int, least: float = 0.5) -> tuple[str, ...]:
        """Coefficients that get at least the share `least` of their variance from direction `i`, largest first.

        Belsley's rule calls a dependency harmful where the condition index exceeds 30 and two or more coefficients
        get more than half of their variance from it.
        """
        row = self.proportions[i]
        return tuple(self.names[k] for k in np.argsort(-row, kind="stable") if row[k] >= least)


def collinearity(system: LinearForm, null: Iterable[dict[str, float]] = ()) -> Collinearity:
    """Collinearity of one axis.

    Parameters
    ----------
    system : with axis, names (n_columns,) and matrix (n_samples, n_columns)
    null : null vectors of the axis (``AxisRank.null_vectors``), which are exact relations and not collinearity
    """
    null = tuple(null)
    lengths = np.linalg.norm(system.matrix, axis=0)
    scaled = system.matrix / lengths
    basis = null_basis(system.names, null, 1.0 / lengths)
    _, s, vt = split_svd(scaled, basis)
    informed = len(s) - len(basis)
    variances = (vt[:informed] / s[:informed, None]) ** 2
    inflation = variances.sum(axis=0)
    in_null = np.any(basis != 0.0, axis=0)
    return Collinearity(
        axis=system.axis,
        names=system.names,
        correlation=scaled.T @ scaled,
        vif=np.where(in_null, np.inf, inflation),
        condition_indices=s[0] / s[:informed],
        proportions=variances / inflation,
    )
