"""What the equations of motion leave out, as histories in time and as random processes: forces, and a current.

A current that is the same all around the boat enters the readings only. The equations hold in the water. Where that
speeds up, its pressure moves a boat that weighs what it displaces along with it, so that the motion through the water
stays the same; what is left is the lever of the centre of gravity about that of buoyancy, times the acceleration of
the water, which is small beside gravity.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bayesub.io.errors import InputError, nearest
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES

if TYPE_CHECKING:  # which import this module
    from bayesub.model.simulator import Simulator
    from bayesub.model.trajectory import Trajectory

T = TypeVar("T")
_FINE = 32  # points of an interval between knots in sums over a history
_N_TIMES = 2001  # of a flight for the forces of the hull, equidistant
SMOOTH = "matern_3_2"
KINDS = ("ornstein_uhlenbeck", SMOOTH)
CURRENTS = ("north", "east")
DISTURBED = (*AXES, *CURRENTS)
_PLANES = {None: DISTURBED, "horizontal": (*PLANES["horizontal"][0], *CURRENTS)}
_PLANES["vertical"] = (*PLANES["vertical"][0], "north")


@dataclass(frozen=True)
class ForceHistory:
    """Forces and moments on the boat, and the current, over time: linear between the times and constant outside."""

    times: np.ndarray  # (n,) ascending, s
    axes: tuple[str, ...]  # of X Y Z K M N, north and east
    values: np.ndarray  # (n, n_axes) N and N m; m/s of the current

    def at(self, times: np.ndarray) -> np.ndarray:
        """(m, 6) forces and moments X Y Z K M N at times (m,), N and N m."""
        return self._values(AXES, times)

    def current(self, times: np.ndarray) -> np.ndarray:
        """(m, 2) velocity of the water to the north and to the east at times (m,), m/s."""
        return self._values(CURRENTS, times)

    def _values(self, axes, times):
        values = np.zeros((len(times), len(axes)))
        for axis, history in zip(self.axes, self.values.T, strict=True):
            if axis in axes:
                values[:, axes.index(axis)] = np.interp(times, self.times, history)
        return values

    @property
    def of_forces(self) -> ForceHistory | None:
        """The forces alone, or None if there are none."""
        return self._part(AXES)

    @property
    def of_current(self) -> ForceHistory | None:
        """The current alone, or None if there is none."""
        return self._part(CURRENTS)

    def _part(self, axes):
        members = [k for k, axis in enumerate(self.axes) if axis in axes]
        if not members:
            return None
        return ForceHistory(self.times, tuple(self.axes[k] for k in members), self.values[:, members])


@dataclass(frozen=True)
class Knots:
    """Where forces that members of a batch have for themselves are given; they are linear in between."""

    times: np.ndarray  # (n_knots,) equidistant from zero, s
    axes: tuple[str, ...]  # of X Y Z K M N, north and east

    def part(self, axes: tuple[str, ...]) -> Knots | None:
        """The same knots of those axes that are among the given ones, or None if there are none."""
        members = tuple(axis for axis in self.axes if axis in axes)
        return Knots(self.times, members) if members else None

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

    def interpolation(self, times: np.ndarray) -> np.ndarray:
        """(m, n_knots) weights of the knots in values at times (m,)."""
        weights = np.zeros((len(times), len(self.times)))
        rows, knots, entries = self.hats(times)
        weights[rows, knots] = entries
        return weights

    def integration(self, times: np.ndarray) -> np.ndarray:
        """(m, n_knots) weights of the knots in integrals from zero to times (m,), s."""
        ends = self.interpolation(self.times)
        halves = 0.5 * self.interval * (ends[1:] + ends[:-1])
        whole = np.vstack([np.zeros(len(self.times)), np.cumsum(halves, axis=0)])
        times = np.asarray(times, dtype=float)
        inside = np.minimum(times, self.times[-1])
        first = np.clip((inside / self.interval).astype(int), 0, len(self.times) - 2)
        part = inside - self.times[first]
        middle = self.interpolation(self.times[first] + 0.5 * part)
        return whole[first] + part[:, None] * middle + (times - inside)[:, None] * ends[-1]

    def differentiation(self, times: np.ndarray) -> np.ndarray:
        """(m, n_knots) weights of the knots in derivatives by time at times (m,), 1/s; at a knot the one after it."""
        place = np.asarray(times) / self.interval
        first = np.clip(np.floor(place).astype(int), 0, len(self.times) - 2)
        ends = np.eye(len(self.times)) / self.interval
        within = (place >= 0.0) & (place <= len(self.times) - 1)
        return within[:, None] * (ends[first + 1] - ends[first])

    def projection(self, values: np.ndarray) -> np.ndarray:
        """Values (n_knots, n) at the knots of the broken lines nearest in least squares to (n_fine, n) of all times."""
        from scipy import linalg  # takes a second to import

        rows, knots, weights = self.hats(self.fine_times)
        n = len(self.times)
        means, gram, half = np.zeros((n, values.shape[1])), np.zeros((2, n)), len(rows) // 2
        np.add.at(means, knots, weights[:, None] * values[rows])
        np.add.at(gram[0], knots, weights**2)
        np.add.at(gram[1], knots[:half], weights[:half] * weights[half:])
        return linalg.solveh_banded(gram, means, lower=True)

    def projected(self, forces: ForceHistory) -> np.ndarray:
        """(n_knots, n_axes) of a history, N, N m and m/s."""
        histories = np.hstack([forces.at(self.fine_times), forces.current(self.fine_times)])
        return self.projection(histories[:, [DISTURBED.index(axis) for axis in self.axes]])


@dataclass(frozen=True)
class Disturbance:
    """Stationary random forces, moments and currents of mean zero, independent of each other.

    The correlation at a lag is ``exp(-lag / time)`` for the Ornstein-Uhlenbeck process, which is rough, and ``(1 +
    sqrt(3) lag / time) exp(-sqrt(3) lag / time)`` for the Matern process of order 3/2, which has a derivative
    (Rasmussen & Williams 2006, section 4.2.1). At a lag of one correlation time they are 0.37 and 0.48. InputError for
    an axis or kind that does not exist, and for numbers that are not positive.
    """

    axes: tuple[str, ...]  # of X Y Z K M N, north and east
    sds: np.ndarray  # (n_axes,) standard deviations, N, N m and m/s
    correlation_time_s: float  # of the forces
    kind: str = KINDS[0]  # "ornstein_uhlenbeck" or "matern_3_2", of the forces; a current is of the latter kind
    correlation_time_current_s: float | None = None  # correlation time of the current, if it is not that of the forces

    def __post_init__(self):
        check_axes(self.axes)
        check_kind(self.kind)
        for axis, sd in zip(self.axes, self.sds, strict=True):
            if not (np.isfinite(sd) and sd > 0):
                message = f"disturbance: the sd of {axis} must be positive, found {sd:g}; leave the axis out"
                raise InputError(message, "value", axis)
        for key in ("correlation_time_s", "correlation_time_current_s"):
            time = getattr(self, key)
            if time is not None and not (np.isfinite(time) and time > 0):
                raise InputError(f"disturbance: {key} must be positive, found {time:g}", "value", key)

    @property
    def shortest_s(self) -> float:
        """The shorter of the correlation times, s."""
        return min(self.correlation_time_s, self.correlation_time_current_s or np.inf)

    def sample(self, times: np.ndarray, rng: np.random.Generator) -> ForceHistory:
        """A history at equidistant times (n,), whose covariance between these is exact."""
        from scipy import signal  # takes a second to import

        n = len(times)
        values = np.empty((n, len(self.axes)))
        times_s = self.correlation_time_s, self.correlation_time_current_s
        for time, members, kind in by_time(self.axes, self.kind, *times_s):
            step = (times[-1] - times[0]) / max(1, n - 1) / time  # of a process of unit sd and correlation time
            if kind == SMOOTH:
                shocks, recursion = _matern(step, rng.standard_normal((n, 2, len(members))))
            else:
                rho = np.exp(-step)
                shocks, recursion = rng.standard_normal((n, len(members))), [1.0, -rho]
                shocks[1:] *= np.sqrt(1.0 - rho**2)
            values[:, members] = signal.lfilter([1.0], recursion, shocks, axis=0)
        return ForceHistory(np.array(times), self.axes, values * np.asarray(self.sds))


def by_time(axes: tuple[str, ...], kind: str, of_all: T, of_currents: T | None) -> list[tuple[T, list[int], str]]:
    """The correlation time, positions and kind of the axes that are forces, and of those that are currents.

    The time of currents may be None, if it is that of all. Currents are smooth: a bottom track reads their velocity,
    which in a rough process changes between knots by more than such a log errs.
    """
    forces = [k for k, axis in enumerate(axes) if axis in AXES]
    currents = [k for k, axis in enumerate(axes) if axis in CURRENTS]
    groups = (of_all, forces, kind), (of_all if of_currents is None else of_currents, currents, SMOOTH)
    return [group for group in groups if group[1]]


def correlation(kind: str, lags: np.ndarray) -> np.ndarray:
    """Correlation of a process of unit correlation time at lags >= 0."""
    if kind == SMOOTH:
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


def unit(axis: str) -> str:
    """N, N m or m/s."""
    return "m/s" if axis in CURRENTS else "N" if axis in "XYZ" else "N m"


def check_kind(kind: str) -> None:
    """Raise InputError for a process that does not exist."""
    if kind not in KINDS:
        text = f"disturbance: unknown kind '{kind}': expected {' or '.join(KINDS)}{nearest(kind, KINDS)}"
        raise InputError(text, "unknown", "kind")


def check_axes(axes: Iterable[str], subproblem: str | None = None) -> None:
    """Raise InputError for an axis that does not exist, is named twice, or does not move in a sub-problem."""
    axes = tuple(axes)
    if not axes:
        raise InputError(f"disturbance: name at least one axis of {' '.join(DISTURBED)}", "missing", "axes")
    for axis in axes:
        if axis not in DISTURBED:
            message = f"disturbance: unknown axis '{axis}': expected some of {' '.join(DISTURBED)}"
            raise InputError(message, "unknown", axis)
        if axes.count(axis) > 1:
            raise InputError(f"disturbance: axis {axis} is named twice", "conflict", axis)
        if axis not in _PLANES[subproblem]:
            fault = f"disturbance: axis {axis} has no part in the {subproblem} sub-problem"
            raise InputError(f"{fault}, which has {' '.join(_PLANES[subproblem])}; leave it out", "conflict", axis)


def hull_forces(trajectory: Trajectory, member: int = 0) -> np.ndarray:
    """Hydrodynamic forces and moments along a motion, by the terms of velocities.

    Rudder, planes and propeller are left out: in a steady turn the rudder balances the moment of the hull. So are added
    masses, hydrostatics and the forces of actuators from outside, and the terms of the rigid body unless they are in
    the coefficients of the equation set. Forces (n_times, 6) of a member of the batch are X Y Z K M N, N and N m; zero
    on the axes that a sub-problem does not have.
    """
    simulator = trajectory.simulator
    vehicle, equations = simulator.vehicle, simulator.vehicle.equations
    controls = simulator.controls_at(trajectory.times)[:, : len(equations.controls) + 1]
    resting = np.zeros((len(trajectory.times), len(AXES)))  # accelerations
    blocks = equations.regressors(trajectory.states[member], resting, controls, vehicle.constants)
    commands = {control.symbol for control in equations.controls} | {"uc", "duc"}
    steered = [bool(term.symbols & commands) for term in equations.terms]
    dimensional = np.where(steered, 0.0, simulator.dimensional(trajectory.xi[member])[0])
    return np.stack([blocks[axis] @ dimensional[equations.columns(equations.names_of_axis(axis))] for axis in AXES], 1)


def hull_force_rms(simulators: Iterable[Simulator]) -> np.ndarray:
    """Root mean square over time of the forces of the hull of a vehicle on its manoeuvres, undisturbed.

    Forces (6,) are X Y Z K M N, N and N m; several manoeuvres count by their durations. InputError if one fails.
    """
    squares, total = np.zeros(len(AXES)), 0.0
    for simulator in simulators:
        manoeuvre = simulator.manoeuvre
        times = np.linspace(0.0, manoeuvre.duration, _N_TIMES)
        trajectory = simulator.at(times).undisturbed.trajectory(simulator.vehicle.xi)
        if trajectory.status[0] != "ok":
            status = trajectory.status[0].replace("_", " ")
            fault = f"disturbance: a share is of the forces of '{simulator.vehicle.name}' on {manoeuvre.name}"
            raise InputError(f"{fault}, where the boat {status}; give sd, or sd_n and sd_nm", "model", "share")
        squares += manoeuvre.duration * np.mean(hull_forces(trajectory) ** 2, axis=0)
        total += manoeuvre.duration
    return np.sqrt(squares / total)
