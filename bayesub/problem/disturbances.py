"""Histories of unmodelled forces as parameters of a problem.

A force that the equations leave out is a stationary random process (:class:`bayesub.model.disturbance.Disturbance`)
on each of some axes. It enters the simulation linear between knots. The forces at the knots are those whose broken line
is nearest to the process in least squares, not the values of the process there: a broken line through these would lack
the impulse of what happens in between, which is a third of all of it when knots are half a correlation time apart. With
hat functions phi, their inner products M and the covariance k of the process, the forces have the covariance

    M^-1 K M^-1,    K_ij = integral of phi_i(s) k(s - t) phi_j(t) ds dt,

and what the broken line lacks has no inner product with any hat. They are written as sd times L(time) w, L the Cholesky
factor of that matrix for a unit sd, with white coordinates w, which are the parameters: standard normal whatever the sd
and the correlation time are, and independent. Where readings do not tell the forces, the posterior of w is the prior.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from bayesub.io.errors import InputError
from bayesub.model.disturbance import (
    CURRENTS,
    DISTURBED,
    KINDS,
    ForceHistory,
    Knots,
    by_time,
    check_axes,
    check_kind,
    correlation,
)
from bayesub.model.vehicles import Vehicle
from bayesub.problem.distributions import WHITE, Prior

CORRELATION_TIME = "correlation_time_disturbance_s"
CURRENT_TIME = "correlation_time_current_s"
_SD, _HISTORY = "sd_disturbance_", "disturbance_"
KNOTS_A_TIME = 2.0  # knots in a correlation time, if no interval is given
KNOTS_A_TIME_CURRENT = 5.0  # of a current, which bottom tracks read and do not integrate
_WIDE = 0.99  # probability of sds below the one with which searches begin
_FINE = 16  # points of an interval for the integrals
_ROUND_OFF = 1e-12  # variance, far below any that matters; of a force that hardly changes the covariance is singular
_TAILS = 1e-6  # probability of correlation times beyond the range in which L is tabulated, on each side
_DEGREES, _TOLERANCE = (8, 12, 16, 24, 32, 48), 1e-6  # of polynomials of the logarithm of the time; error of L


def of_process(name: str) -> bool:
    """Whether a parameter belongs to the random process, which all trials share."""
    return name in (CORRELATION_TIME, CURRENT_TIME) or (name.startswith(_SD) and name[len(_SD) :] in DISTURBED)


def of_history(name: str) -> bool:
    """Whether a parameter is a white coordinate of a history of forces."""
    axis, _, knot = name.partition("[")[0].removeprefix(_HISTORY).partition("_")
    return name.startswith(_HISTORY) and axis in DISTURBED and knot.isdigit()


def force_scales(vehicle: Vehicle, axes: tuple[str, ...]) -> np.ndarray:
    """(n_axes,) N or N m of a unit non-dimensional force or moment at the trial speed; one, m/s, of a current."""
    force = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2 * vehicle.speed_mps**2
    scales = dict.fromkeys("XYZ", force) | dict.fromkeys("KMN", force * vehicle.length_m) | dict.fromkeys(CURRENTS, 1.0)
    return np.array([scales[axis] for axis in axes])


@dataclass(frozen=True)
class UnknownDisturbance:
    """Unmodelled forces with unknown histories, as a problem is asked to infer them.

    Attributes
    ----------
    axes : of X Y Z K M N, and north and east for a current that varies
    sds : axis -> standard deviation, non-dimensional: forces over (rho/2) l^2 U^2, moments over (rho/2) l^3 U^2, with
        the trial speed U; of a current in m/s; or the prior of it
    correlation_time_s : of all axes
    kind : as of :class:`bayesub.model.disturbance.Disturbance`
    knot_interval_s : by default half of the correlation time of forces and a fifth of that of currents, or of their
        prior medians
    correlation_time_current_s : correlation time of the current, if it is not that of the forces

    Raises
    ------
    InputError : for an axis or kind that does not exist, and numbers that are not positive
    """

    axes: tuple[str, ...]
    sds: Mapping[str, float | Prior]
    correlation_time_s: float | Prior
    kind: str = KINDS[0]
    knot_interval_s: float | None = None
    correlation_time_current_s: float | Prior | None = None

    def __post_init__(self):
        check_axes(self.axes)
        check_kind(self.kind)
        if set(self.sds) != set(self.axes):
            raise InputError(
                f"disturbance: give an sd for each of {', '.join(self.axes)}; found {', '.join(self.sds)}",
                "conflict",
                "sds",
            )
        numbers: dict[str, float | Prior | None] = dict(self.sds)
        numbers |= {"correlation_time_s": self.correlation_time_s, "knot_interval_s": self.knot_interval_s}
        numbers |= {"correlation_time_current_s": self.correlation_time_current_s}
        for key, value in numbers.items():
            if value is None:
                continue
            least = value.quantiles(_TAILS)[0] if isinstance(value, Prior) else value
            if not (np.isfinite(least) and least > 0):
                words = f"the sd of {key}" if key in self.sds else key
                raise InputError(f"disturbance: {words} must be positive, found {least:g}", "value", key)

    @cached_property
    def groups(self) -> list[tuple[str, float | Prior, list[int], str]]:
        """Name and value or prior of the correlation time, positions and kind of forces, and of currents."""
        of_current = self.correlation_time_current_s
        named = None if of_current is None else (CURRENT_TIME, of_current)
        parts = by_time(self.axes, self.kind, (CORRELATION_TIME, self.correlation_time_s), named)
        return [(*time, members, kind) for time, members, kind in parts]

    @property
    def times(self) -> dict[str, float | Prior]:
        """Name of each correlation time -> its value or prior."""
        return {name: time for name, time, *_ in self.groups}

    def time(self, name: str) -> float | None:
        """A correlation time, or its prior median, s; None if there is no such one."""
        return _middle(self.times[name]) if name in self.times else None

    @property
    def time_s(self) -> float:
        """The shortest correlation time, or its prior median, s."""
        return min(map(_middle, self.times.values()))

    @property
    def interval_s(self) -> float:
        """Longest time between knots, s."""
        densities = {True: KNOTS_A_TIME_CURRENT, False: KNOTS_A_TIME}
        intervals = [
            _middle(time) / densities[self.axes[members[0]] in CURRENTS] for _, time, members, _ in self.groups
        ]
        return self.knot_interval_s or min(intervals)

    def sd(self, axis: str) -> float:
        """The standard deviation of an axis, or its prior median, non-dimensional."""
        return _middle(self.sds[axis])


def _middle(value: float | Prior) -> float:
    return float(value.quantiles(0.5)[0]) if isinstance(value, Prior) else float(value)


@dataclass(frozen=True)
class Disturbances:
    """The histories of one trial.

    Attributes
    ----------
    duration : of the readings, from the start of the manoeuvre, s
    """

    unknown: UnknownDisturbance
    vehicle: Vehicle
    duration: float

    @property
    def n_knots(self) -> float:
        """How many knots there are, or would be."""
        return max(1.0, float(np.ceil(self.duration / self.unknown.interval_s * (1.0 - 1e-9)))) + 1.0

    @cached_property
    def knots(self) -> Knots:
        """Equidistant, the last one at the end of the readings."""
        return Knots(np.linspace(0.0, self.duration, int(self.n_knots)), self.unknown.axes)

    @cached_property
    def processes(self) -> dict[str, Prior]:
        """Priors of the parameters of the process that are not known."""
        priors = {f"{_SD}{axis}": self.unknown.sds[axis] for axis in self.unknown.axes}
        priors |= self.unknown.times
        return {name: prior for name, prior in priors.items() if isinstance(prior, Prior)}

    @cached_property
    def priors(self) -> dict[str, Prior]:
        """Parameter -> prior, of the process and then of the white coordinates axis after axis."""
        n = len(self.knots.times)
        return self.processes | {f"{_HISTORY}{axis}_{k}": WHITE for axis in self.unknown.axes for k in range(n)}

    @property
    def held(self) -> np.ndarray:
        """(n_own,) prior medians: no forces."""
        return np.array([_middle(prior) for prior in self.priors.values()])

    @property
    def wide_process(self) -> dict[str, float]:
        """Unknown parameter of the process -> value for searches: a large sd, so that histories follow any motion."""
        return {
            name: float(prior.quantiles(_WIDE if name.startswith(_SD) else 0.5)[0])
            for name, prior in self.processes.items()
        }

    def with_wide_process(self) -> "Disturbances":
        """The same histories, of a process that is known to be the :attr:`wide_process`."""
        wide = self.wide_process
        sds = {axis: wide.get(f"{_SD}{axis}", sd) for axis, sd in self.unknown.sds.items()}
        unknown = replace(
            self.unknown,
            sds=sds,
            correlation_time_s=self.unknown.time(CORRELATION_TIME) or self.unknown.time_s,
            correlation_time_current_s=self.unknown.time(CURRENT_TIME),
            knot_interval_s=self.unknown.interval_s,
        )
        return replace(self, unknown=unknown)

    def members(self, axes: tuple[str, ...]) -> list[int]:
        """Positions of those axes that are among the given ones."""
        return [k for k, axis in enumerate(self.unknown.axes) if axis in axes]

    @cached_property
    def _factors(self) -> list[tuple[str, "_Factor", list[int]]]:
        """Name of each correlation time, L for it, and the positions of its axes."""
        return [(name, _Factor(self.knots, kind, time), members) for name, time, members, kind in self.unknown.groups]

    def process(self, values: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Sds (n_batch, n_axes), N, N m, m/s, and times (n_batch,), s, of values (n_batch, n) that begin as its own."""
        own, n = dict(zip(self.processes, values.T, strict=False)), len(values)
        scales = force_scales(self.vehicle, self.unknown.axes)
        given = {f"{_SD}{axis}": self.unknown.sds[axis] for axis in self.unknown.axes}
        sds = [np.broadcast_to(own.get(name, sd), n) for name, sd in given.items()]
        times = {name: np.broadcast_to(own.get(name, time), n) for name, time in self.unknown.times.items()}
        return np.stack(sds, axis=1) * scales, times

    def _parts(self, values: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
        """Sds (n_batch, n_axes), correlation times by name, and w (n_batch, n_axes, n_knots) of own values."""
        white = values[:, len(self.processes) :].reshape(len(values), len(self.unknown.axes), -1)
        return *self.process(values), white

    def forces(self, values: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) at the knots, N, N m and m/s, of own parameters (n_batch, n_own)."""
        sds, times, white = self._parts(values)
        rows = np.empty_like(white)
        for name, factor, members in self._factors:
            rows[:, members] = factor.rows(white[:, members], factor.weights(times[name]))
        return sds[:, :, None] * rows

    def factors(self, process: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots, n_knots) lower triangular; forces are they times w. Of (n_batch, n_process)."""
        sds, times = self.process(process)
        n_knots = len(self.knots.times)
        factors = np.empty((*sds.shape, n_knots, n_knots))
        for name, factor, members in self._factors:
            unit = np.tensordot(factor.weights(times[name]), factor.table, axes=1)
            factors[:, members] = sds[:, members, None, None] * unit[:, None]
        return factors

    def nearest(self, values: np.ndarray, forces: ForceHistory) -> np.ndarray:
        """Own parameters (n_own,) with those white coordinates whose forces are nearest to given ones."""
        values, n = np.array(values), len(self.processes)
        (factors,) = self.factors(values[None, :n])
        projection = self.knots.projected(forces).T  # (n_axes, n_knots)
        values[n:] = np.concatenate([np.linalg.solve(f, at) for f, at in zip(factors, projection, strict=True)])
        return values

    def slopes(self, values: np.ndarray) -> np.ndarray:
        """(n_axes, n_knots, n_own) derivatives of the histories of one member (1, n_own) by its parameters."""
        sds, times, white = self._parts(values)
        n_axes, n_knots = white.shape[1:]
        names = list(self.processes)
        slopes = np.zeros((n_axes, n_knots, len(names) + n_axes * n_knots))
        scales = force_scales(self.vehicle, self.unknown.axes)
        for name, factor, members in self._factors:
            unit = np.einsum("j,jkl->kl", factor.weights(times[name])[0], factor.table)
            if name in names:
                rows = factor.rows(white[:, members], factor.weights(times[name], slope=True))[0]
                slopes[members, :, names.index(name)] = sds[0, members, None] * rows
            for a in members:
                sd = f"{_SD}{self.unknown.axes[a]}"
                if sd in names:
                    slopes[a, :, names.index(sd)] = scales[a] * unit @ white[0, a]
                first = len(names) + a * n_knots
                slopes[a, :, first : first + n_knots] = sds[0, a] * unit
        return slopes


class _Factor:
    """L for a correlation time, or for any that a prior of it allows: a table of polynomials in the logarithm of time.

    Attributes
    ----------
    table : (n_nodes, n_knots, n_knots) coefficients of Chebyshev polynomials
    """

    def __init__(self, knots: Knots, kind: str, time: float | Prior):
        if not isinstance(time, Prior):
            self.table, self._middle, self._half = projected_factor(knots, kind, time)[None], np.log(time), 1.0
            return
        first, last = (np.log(time.quantiles(p)[0]) for p in (_TAILS, 1.0 - _TAILS))
        self._middle, self._half = 0.5 * (first + last), 0.5 * (last - first)

        def at(x):
            return projected_factor(knots, kind, np.exp(self._middle + self._half * x))

        for degree in _DEGREES:
            nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
            factors = np.array([at(x) for x in nodes])
            table = np.linalg.solve(chebyshev.chebvander(nodes, degree), factors.reshape(degree + 1, -1))
            self.table, error = table.reshape(factors.shape), 0.0
            for x in (-0.99, -0.7, 0.1, 0.8, 0.97):
                error = max(error, np.abs(chebyshev.chebvander(x, degree) @ table - at(x).ravel()).max())
            if error < _TOLERANCE:
                break

    def weights(self, times: np.ndarray, slope: bool = False) -> np.ndarray:
        """(n_batch, n_nodes) of the table for L at times (n_batch,), or for its derivative by the time."""
        with np.errstate(invalid="ignore", divide="ignore"):
            x = np.clip(np.nan_to_num((np.log(times) - self._middle) / self._half, nan=-1.0), -1.0, 1.0)
        if not slope:
            return chebyshev.chebvander(x, len(self.table) - 1)
        units = np.eye(len(self.table))
        by_x = np.stack([chebyshev.chebval(x, chebyshev.chebder(unit)) for unit in units], axis=1)
        return by_x / (self._half * times)[:, None]

    def rows(self, white: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) L w."""
        if len(self.table) == 1:
            return white @ self.table[0].T
        n_batch, n_axes, n = white.shape
        products = white.reshape(-1, n) @ self.table.transpose(2, 0, 1).reshape(n, -1)
        return np.einsum("bj,bajk->bak", weights, products.reshape(n_batch, n_axes, len(self.table), n))


@dataclass(frozen=True)
class History:
    """What of a problem the unknown histories of one trial are: :class:`bayesub.inference.interface.LatentForces`.

    Attributes
    ----------
    rows : of the residuals, those that the forces move
    columns : (n_white,) positions of the white coordinates among the parameters, axis after axis
    process : (n_process,) positions of the parameters of the process
    """

    rows: slice
    columns: np.ndarray
    process: np.ndarray
    disturbances: Disturbances

    @property
    def wide_process(self) -> np.ndarray:
        """(n_process,) values for searches, as :attr:`Disturbances.wide_process`."""
        return np.array(list(self.disturbances.wide_process.values()))

    def factors(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots, n_knots) L times sd at parameters (n_batch, n_params): forces are they times w."""
        return self.disturbances.factors(parameters[:, self.process])


def projected_factor(knots: Knots, kind: str, time: float) -> np.ndarray:
    """(n_knots, n_knots) Cholesky factor of the covariance of the projection on hats of a process of unit sd."""
    n, interval = len(knots.times) - 1, knots.interval
    places = (np.arange(_FINE) + 0.5) / _FINE  # midpoints in an interval
    ramps = np.stack([1.0 - places, places])  # of the hats before and after an interval
    lags = np.abs(_FINE * np.arange(n)[:, None, None] + np.arange(_FINE) - np.arange(_FINE)[:, None])
    correlations = correlation(kind, lags * (interval / _FINE / time))
    products = np.einsum("as,dst,bt->dab", ramps, correlations, ramps)  # of ramps that are d intervals apart
    later = np.arange(n) - np.arange(n)[:, None]
    blocks = products[np.abs(later)]
    blocks = np.where((later >= 0)[..., None, None], blocks, blocks.swapaxes(2, 3))
    covariance, gram = np.zeros((2, n + 1, n + 1))
    for first in (0, 1):
        for second in (0, 1):
            covariance[first : n + first, second : n + second] += blocks[..., first, second]
            gram[first : n + first, second : n + second] += ramps[first] @ ramps[second] * np.eye(n)
    covariance = np.linalg.solve(gram, np.linalg.solve(gram, covariance).T)
    return np.linalg.cholesky(covariance + _ROUND_OFF * np.eye(n + 1))
