"""Coordinates in which an ill-conditioned, bent posterior looks like a standard normal.

*Whitening.* In coordinates t, in which the prior is standard normal, the residuals have at the mode the Jacobian
``U diag(s) V'``. In ``z = sqrt(s^2 + 1) V' (t - t_mode)`` the Laplace approximation is N(0, I); they run from
the stiffest to the sloppiest, and a null direction keeps its prior.

*Straightening.* The posterior is a thin sheet around a curved surface: far along the sloppy coordinates the stiff
ones sit many of their own standard deviations away from the mode. Each stiff coordinate is therefore measured from
a quadratic in the sloppier ones,

    z_i = q_i(z_{i+1}, .., z_n) + scale_i y_i,

fitted to where the posterior is highest along z_1 .. z_i with the others held. The map is triangular, so it is inverted
by substitution and its Jacobian is a constant: sampling in y is exact whatever the fit, and the better the fit the
nearer the density is to N(0, I). (Triangular transport maps: Parno & Marzouk 2018.)
"""

from dataclasses import dataclass

import numpy as np

from bayesub.linalg import complete_svd

_NEWTON_STEPS = 6
_MAX_STEP = 50.0  # posterior sd
_STIFF = 1.5  # straighten coordinates whose data are this much sharper than the prior ..
_BENT = 0.1  # .. and whose conditional mode wanders by more than this many of their sd


@dataclass(frozen=True)
class Bend:
    """``q_i = constant + linear . rest + rest' quadratic rest`` with rest the coordinates after i."""

    constant: float
    linear: np.ndarray
    quadratic: np.ndarray
    scale: float

    def __call__(self, rest):
        return self.constant + np.einsum("ij,ij->i", rest @ self.quadratic + self.linear, rest)


class Geometry:
    """The map from sampling coordinates y to parameters.

    Attributes
    ----------
    mode : (n_params,) posterior mode, in coordinates t with a standard normal prior
    singular_values : (n_params,) of the Jacobian in these coordinates, stiffest first
    basis : (n_params, n_params); column i is the step in t for a unit of z_i
    bends : coordinate -> :class:`Bend`
    """

    def __init__(self, problem, mode):
        self.prior = problem.prior
        self.mode = self.prior.standard(np.asarray(mode, dtype=float))
        jacobian = self.prior.chain(problem.jacobian(mode), self.mode)
        self.left, self.singular_values, self.directions = complete_svd(jacobian)
        self.widths = 1.0 / np.sqrt(self.singular_values**2 + 1.0)
        self.basis = self.directions.T * self.widths
        self.bends: dict[int, Bend] = {}

    @property
    def n_params(self) -> int:
        return len(self.mode)

    def bent(self, y) -> np.ndarray:
        """Whitened coordinates z (n, n_params) of sampling coordinates y (n, n_params)."""
        z = np.array(y, dtype=float)
        for i in sorted(self.bends, reverse=True):
            z[:, i] = self.bends[i](z[:, i + 1 :]) + self.bends[i].scale * z[:, i]
        return z

    def parameters(self, y) -> np.ndarray:
        """Parameters (n, n_params) of sampling coordinates y (n, n_params)."""
        return self.prior.parameters(self._standard(self.bent(y)))

    def log_prob(self, problem, y) -> np.ndarray:
        """Log posterior density (n,) in the sampling coordinates, up to a constant."""
        t = self._standard(self.bent(y))
        return problem.log_likelihood(self.prior.parameters(t)) - 0.5 * np.einsum("ij,ij->i", t, t)

    def log_prior(self, y) -> np.ndarray:
        """Log prior density (n,) in the sampling coordinates, up to a constant."""
        t = self._standard(self.bent(y))
        return -0.5 * np.einsum("ij,ij->i", t, t)

    def _standard(self, z):
        return self.mode + z @ self.basis.T

    def straighten(self, problem, rng: np.random.Generator, progress=None) -> None:
        """Fit the bends, from the sloppiest of the stiff coordinates to the stiffest."""
        stiff = int(np.count_nonzero(self.singular_values > _STIFF))
        for i in range(stiff - 1, -1, -1):
            bend = self._fit(problem, i, rng)
            if bend is not None:
                self.bends[i] = bend
            if progress is not None:
                progress(1.0 - i / stiff)

    def _fit(self, problem, i, rng):
        n_rest = self.n_params - i - 1
        rows, columns = np.triu_indices(n_rest)
        n_features = 1 + n_rest + len(rows)
        z = self.bent(rng.standard_normal((4 * n_features + 100, self.n_params)))
        z[:, : i + 1] = 0.0
        active = slice(0, i + 1)
        for _ in range(_NEWTON_STEPS):
            gradient = self._gradient(problem, z)[:, active]
            length = np.linalg.norm(gradient, axis=1, keepdims=True)
            z[:, active] -= np.nan_to_num(gradient * np.minimum(1.0, _MAX_STEP / np.maximum(length, 1e-300)))
        settled = length[:, 0] < 0.3  # of a posterior sd; not a number where the simulation failed
        if np.count_nonzero(settled) < 2 * n_features or np.std(z[settled, i]) < _BENT:
            return None
        rest = z[settled, i + 1 :]
        features = np.hstack([np.ones((len(rest), 1)), rest, rest[:, rows] * rest[:, columns]])
        solution = np.linalg.lstsq(features, z[settled, i])[0]
        quadratic = np.zeros((n_rest, n_rest))
        quadratic[rows, columns] = solution[1 + n_rest :]
        misfit = np.std(z[settled, i] - features @ solution)
        return Bend(solution[0], solution[1 : 1 + n_rest], quadratic, np.sqrt(1.0 + misfit**2))

    def _gradient(self, problem, z):
        """Gradient of minus the log posterior in z with the Jacobian of the mode: the step of a chord Newton method."""
        t = self._standard(z)
        residuals = problem.residuals(self.prior.parameters(t))
        return ((residuals @ self.left) * self.singular_values + t @ self.directions.T) * self.widths

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything that the map consists of but the prior, to be stored."""
        bends = {f"bend_{i}_{key}": np.asarray(a) for i, bend in self.bends.items() for key, a in vars(bend).items()}
        return {"mode": self.mode, "singular_values": self.singular_values, "basis": self.basis} | bends

    @classmethod
    def restored(cls, prior, arrays: dict[str, np.ndarray]) -> "Geometry":
        """The map that :meth:`arrays` describe, bit for bit; it can no longer be straightened."""
        self = cls.__new__(cls)
        self.prior = prior
        self.mode, self.singular_values, self.basis = (arrays[k] for k in ("mode", "singular_values", "basis"))
        bent = {int(key.split("_")[1]) for key in arrays if key.startswith("bend_")}
        self.bends = {
            i: Bend(**{key: arrays[f"bend_{i}_{key}"] for key in ("constant", "linear", "quadratic", "scale")})
            for i in bent
        }
        return self
