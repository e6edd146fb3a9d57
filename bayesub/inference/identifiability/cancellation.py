"""Error cancellation: large force errors of single terms that add up to a small one (thesis section 7.8.2)."""

from dataclasses import dataclass

import numpy as np

from bayesub.inference.interface import LinearForm


@dataclass(frozen=True)
class Cancellation:
    """What wrong coefficients do to the force along one axis, on the true motion.

    Attributes
    ----------
    axis : such as "X"
    names : (n_terms,) coefficients
    errors : (n_samples, n_terms) force error of each term, N (moments: N m)
    """

    axis: str
    names: tuple[str, ...]
    errors: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """(n_samples,) error of the whole force, the sum over the terms."""
        return self.errors.sum(axis=1)

    @property
    def largest(self) -> dict[str, float]:
        """Coefficient -> largest size of its error over the manoeuvre, largest first (thesis Table 28)."""
        sizes = np.abs(self.errors).max(axis=0)
        return {self.names[k]: float(sizes[k]) for k in np.argsort(-sizes, kind="stable")}

    @property
    def ratio(self) -> float:
        """Largest error of a term over the largest error of the sum."""
        return float(np.abs(self.errors).max() / np.abs(self.total).max())


def cancellation(system: LinearForm, changes: dict[str, float]) -> Cancellation:
    """Force errors on one axis of the linear form.

    Parameters
    ----------
    system : with axis, names (n_terms,) and matrix (n_samples, n_terms) of dimensional regressors on the true motion
    changes : coefficient -> wrong minus true value; a term of the axis that is not named is right
    """
    return Cancellation(system.axis, system.names, system.matrix * [changes.get(name, 0.0) for name in system.names])
