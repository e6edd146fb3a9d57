"""Forces that the equations of motion leave out, as histories in time and as random processes."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES

_FINE = 32  # points of an interval between knots in sums over a history
KINDS = ("ornstein_uhlenbeck", "matern_3_2")


@dataclass(frozen=True)
class ForceHistory:
    """Forces and moments on the boat over time, linear between the times and constant outside of them.

    Attributes
    ----------
    times : (n,) array
        Ascending, s.
    axes : tuple of str
        Of X Y Z K M N.
    values : (n, n_axes) array
        N and N m.
    """

    times: np.ndarray
    axes: tuple[str, ...]
    values: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """(m, 6) forces and moments X Y Z K M N at times (m,), N and N m."""
        forces = np.zeros((len(times), len(AXES)))
        for axis, values in zip(self.axes, self.values.T, strict=True):
            forces[:, AXES.index(axis)] = np.interp(times, self.times, values)
        return forces


@dataclass(frozen=True)
class Knots:
    """Where forces that members of a batch have for themselves are given; they are linear in between.

    Attributes
    ----------
    times : (n_knots,) array
        Equidistant from zero, s.
    axes : tuple of str
        Of X Y Z K M N.
    """

    times: np.ndarray
    axes: tuple[str, ...]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Name of each force, N or N m, axis after axis."""
        return tuple(f"force_{axis}_{k}" for axis in self.axes for k in range(len(self.times)))

    @property
    def interval(self) -> float:
        """Time between knots, s."""
        return float(self.times[1] - self.times[0])

    def hats(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position in `times` (m,), number of a knot and weight of it, (n_entries,) each, of linear interpolation."""
        place = np.clip(np.asarray(times) / self.interval, 0.0, len(self.times) - 1)
        first = np.minimum(place.astype(int), len(self.times) - 2)
        after = place - first
        rows = np.tile(np.arange(len(place)), 2)
        knots, weights = np.concatenate([first, first + 1]), np.concatenate([1.0 - after, after])
        return rows[weights > 0], knots[weights > 0], weights[weights > 0]

    @property
    def fine_times(self) -> np.ndarray:
        """(n_fine,) equidistant times, in the middles of parts of the intervals, s."""
        n = _FINE * (len(self.times) - 1)
        return (np.arange(n) + 0.5) * self.interval / _FINE

    def projection(self, values: np.ndarray) -> np.ndarray:
        """Values (n_knots, n) at the knots of the broken lines nearest in least squares to (n_fine, n) of all times."""
        rows, knots, weights = self.hats(self.fine_times)
        hats = np.zeros((len(values), len(self.times)))
        hats[rows, knots] = weights
        return np.linalg.lstsq(hats, values, rcond=None)[0]

    def projected(self, forces: ForceHistory) -> np.ndarray:
        """(n_knots, n_axes) of a history, N and N m."""
        return self.projection(forces.at(self.fine_times)[:, [AXES.index(axis) for axis in self.axes]])


@dataclass(frozen=True)
class Disturbance:
    """Stationary random forces and moments of mean zero, independent of each other.

    The correlation at a lag is ``exp(-lag / time)`` for the Ornstein-Uhlenbeck process, which is rough, and
    ``(1 + sqrt(3) lag / time) exp(-sqrt(3) lag / time)`` for the Matern process of order 3/2, which has a derivative
    (Rasmussen & Williams 2006, section 4.2.1). At a lag of one correlation time they are 0.37 and 0.48.

    Attributes
    ----------
    axes : tuple of str
        Of X Y Z K M N.
    sds : (n_axes,) array
        Standard deviations, N and N m.
    correlation_time_s : float
    kind : str
        "ornstein_uhlenbeck" or "matern_3_2".

    Raises
    ------
    InputError
        For an axis or kind that does not exist, and for numbers that are not positive.
    """

    axes: tuple[str, ...]
    sds: np.ndarray
    correlation_time_s: float
    kind: str = KINDS[0]

    def __post_init__(self):
        check_axes(self.axes)
        check_kind(self.kind)
        for axis, sd in zip(self.axes, self.sds, strict=True):
            if not (np.isfinite(sd) and sd > 0):
                raise InputError(f"disturbance: the sd of {axis} must be positive, found {sd:g}; leave the axis out")
        if not (np.isfinite(self.correlation_time_s) and self.correlation_time_s > 0):
            raise InputError(f"disturbance: correlation_time_s must be positive, found {self.correlation_time_s:g}")

    def sample(self, times: np.ndarray, rng: np.random.Generator) -> ForceHistory:
        """A history at equidistant times (n,), whose covariance between these is exact."""
        from scipy import signal  # takes a second to import

        n, n_axes = len(times), len(self.axes)
        step = (times[-1] - times[0]) / max(1, n - 1) / self.correlation_time_s
        if self.kind == "matern_3_2":
            shocks, recursion = _matern(step, rng.standard_normal((n, 2, n_axes)))
        else:
            rho = np.exp(-step)
            shocks, recursion = rng.standard_normal((n, n_axes)), [1.0, -rho]
            shocks[1:] *= np.sqrt(1.0 - rho**2)
        values = signal.lfilter([1.0], recursion, shocks, axis=0)
        return ForceHistory(np.array(times), self.axes, values * np.asarray(self.sds))


def correlation(kind: str, lags: np.ndarray) -> np.ndarray:
    """Correlation of a process of unit correlation time at lags >= 0."""
    if kind == "matern_3_2":
        lags = np.sqrt(3.0) * lags
        return (1.0 + lags) * np.exp(-lags)
    return np.exp(-lags)


def _matern(step: float, white: np.ndarray) -> tuple[np.ndarray, list[float]]:
    """Shocks (n, n_axes) and recursion of a Matern process of order 3/2, of white noise (n, 2, n_axes).

    Its value and derivative x go by x_k = A x_k-1 + e_k over a step. A has a double eigenvalue d, so that
    A^2 = 2 d A - d^2, and the value alone goes by y_k = 2 d y_k-1 - d^2 y_k-2 + e_k + (A - 2 d) e_k-1.
    """
    rate = np.sqrt(3.0)
    stationary = np.diag([1.0, rate**2])
    decay = np.exp(-rate * step)
    transition = decay * np.array([[1.0 + rate * step, step], [-(rate**2) * step, 1.0 - rate * step]])
    noise = np.linalg.cholesky(stationary - transition @ stationary @ transition.T + 1e-15 * np.eye(2)) @ white
    noise[0] = np.sqrt(stationary) @ white[0]
    shocks = noise[:, 0].copy()
    shocks[1:] += np.einsum("j,kja->ka", (transition - 2.0 * decay * np.eye(2))[0], noise[:-1])
    return shocks, [1.0, -2.0 * decay, decay**2]


def check_kind(kind: str) -> None:
    """Raise InputError for a process that does not exist."""
    if kind not in KINDS:
        raise InputError(f"disturbance: unknown kind '{kind}': expected {' or '.join(KINDS)}{nearest(kind, KINDS)}")


def check_axes(axes: Iterable[str], subproblem: str | None = None) -> None:
    """Raise InputError for an axis that does not exist, is named twice, or does not move in a sub-problem."""
    axes = tuple(axes)
    if not axes:
        raise InputError(f"disturbance: name at least one axis of {' '.join(AXES)}")
    for axis in axes:
        if axis not in AXES:
            raise InputError(f"disturbance: unknown axis '{axis}': expected some of {' '.join(AXES)}")
        if axes.count(axis) > 1:
            raise InputError(f"disturbance: axis {axis} is named twice")
        if subproblem is not None and axis not in PLANES[subproblem][0]:
            moving = " ".join(PLANES[subproblem][0])
            raise InputError(
                f"disturbance: axis {axis} has no part in the {subproblem} sub-problem, which has {moving}; "
                "leave it out"
            )
