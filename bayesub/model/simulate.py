"""Simulate trials: a vehicle, a manoeuvre and a batch of coefficient sets give a batch of trajectories."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from bayesub.io import log_files
from bayesub.io.errors import InputError, nearest
from bayesub.io.log_files import ACCELERATIONS
from bayesub.kernels import compilation, noise, workspace
from bayesub.kernels import integrate as kernel
from bayesub.kernels import sensitivities as sensitivity
from bayesub.model import coefficients
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.vehicles import Vehicle, load_vehicle

STATUS = ("ok", "diverged", "left_envelope")
MAX_SPEED_RATIO = 10.0  # a member faster than this many times the trial speed has diverged
MAX_STEPS = 2_000_000  # of one flight, and of its output times
STEP_TOLERANCE_M = 0.05  # position change on halving the step that an automatic step must keep
_UNSET = "of the manoeuvre"


@dataclass(frozen=True)
class Trajectory:
    """Simulated motion of a batch.

    Attributes
    ----------
    times : (n_times,) s
    states : (n_batch, n_times, 12) m, rad, m/s, rad/s; not a number from the failure of a member on
    controls : (n_times, 3) rad, and rpm : (n_times,), both at `times`
    status : (n_batch,) of the words "ok", "diverged", "left_envelope"
    simulator, xi : what was run, so that it can be sampled at other times
    """

    times: np.ndarray
    states: np.ndarray
    controls: np.ndarray
    rpm: np.ndarray
    status: np.ndarray
    simulator: "Simulator"
    xi: np.ndarray

    @cached_property
    def accelerations(self) -> np.ndarray:
        """(n_batch, n_times, 6) udot vdot wdot (m/s^2) and pdot qdot rdot (rad/s^2), from the equations of motion."""
        return self.simulator.accelerations(self.xi, self.states)

    def resampled(self, times) -> "Trajectory":
        """The same motion at other output times (s)."""
        return self.simulator.at(times).trajectory(self.xi)

    def save(self, path: str | Path, member: int = 0) -> None:
        """Write one member with its controls and accelerations as a track CSV."""
        log = {"time": self.times, "rpm": self.rpm}
        log |= dict(zip(log_files.CONTROLS, self.controls.T, strict=True))
        log |= dict(zip(log_files.STATES, self.states[member].T, strict=True))
        log |= dict(zip(ACCELERATIONS, self.accelerations[member].T, strict=True))
        log_files.write_log(Path(path), log)


class Simulator:
    """A vehicle on a manoeuvre, prepared once for many batches of coefficient sets.

    Parameters
    ----------
    vehicle, manoeuvre
    times : (n_times,) output times within the manoeuvre, s
    dt : integration step, s; None chooses one (:func:`choose_step`)
    controls : "linear" interpolates the control history at the Runge-Kutta stages, "hold" keeps the value at the
        start of each step (the thesis's convention, first order)
    subproblem : "horizontal", "vertical" or None for all six degrees of freedom; by default the manoeuvre's own
    attitude : "euler", or "quaternion" to fly through 90 degrees of pitch (output in Euler angles all the same)
    """

    def __init__(self, vehicle, manoeuvre, times, *, dt=None, controls="linear", subproblem=_UNSET, attitude="euler"):
        if subproblem == _UNSET:
            subproblem = manoeuvre.subproblem
        if subproblem is not None and subproblem not in coefficients.SUBPROBLEMS:
            raise InputError(f"unknown sub-problem '{subproblem}': expected horizontal or vertical")
        if controls not in ("linear", "hold"):
            raise InputError(f"unknown control convention '{controls}': expected linear or hold")
        if attitude not in ("euler", "quaternion"):
            raise InputError(f"unknown attitude '{attitude}': expected euler or quaternion")
        if dt is not None and not (np.isfinite(dt) and dt > 0):
            raise InputError(f"the time step must be a positive number of seconds, found {dt}")
        compilation.ensure("from bayesub.model.simulate import call_kernels; call_kernels()")
        self.vehicle = vehicle.restricted(subproblem)
        self.manoeuvre = manoeuvre
        self.subproblem = subproblem
        self.convention, self.attitude = controls, attitude
        self.step = choose_step(vehicle, manoeuvre, subproblem, attitude) if dt is None else float(dt)
        self.times = np.array(times, dtype=float)
        if self.times.size == 0 or self.times[0] < 0 or self.times[-1] > manoeuvre.duration * (1 + 1e-12):
            raise InputError(f"output times must lie within the manoeuvre, 0 to {manoeuvre.duration:g} s")
        if not self.times[-1] / self.step <= MAX_STEPS:
            raise InputError(
                f"{manoeuvre.name}: {self.times[-1]:g} s are more than {MAX_STEPS:,} steps of {self.step:g} s; "
                "shorten the manoeuvre or give a longer step"
            )
        n_steps = max(1, int(np.ceil(self.times[-1] / self.step * (1 - 1e-12))))
        starts = np.arange(n_steps + 1) * self.step
        middle, end = (0.0, 0.0) if controls == "hold" else (0.5, 1.0)
        self._columns = {}  # of sensitivities, by parameters
        self._stages = np.stack([self._controls_at(starts + f * self.step) for f in (0.0, middle, end)], axis=1)

    def at(self, times) -> "Simulator":
        """The same simulator with other output times."""
        return Simulator(
            self.vehicle,
            self.manoeuvre,
            times,
            dt=self.step,
            controls=self.convention,
            subproblem=self.subproblem,
            attitude=self.attitude,
        )

    def _controls_at(self, times):
        """(n, 4): the three planes and n/k0, linearly interpolated."""
        history = self.manoeuvre
        columns = [*history.controls.T, history.rpm / self.vehicle.rpm_per_mps]
        return np.stack([np.interp(times, history.times, column) for column in columns], axis=-1)

    def dimensional(self, xi) -> np.ndarray:
        """(n_batch, 101) dimensional coefficients, those that the sub-problem does not use set to zero."""
        dimensional = np.atleast_2d(np.asarray(xi, dtype=float)) * self.vehicle.dimensional_factors
        if self.subproblem is not None:
            unused = np.ones(len(coefficients.NAMES), dtype=bool)
            unused[coefficients.columns(coefficients.SUBPROBLEMS[self.subproblem])] = False
            dimensional[:, unused] = 0.0
        return dimensional

    def run(
        self, xi, *, body=None, initial=None, outputs=log_files.STATES, parallel=True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Fly a batch of coefficient sets.

        Parameters
        ----------
        xi : (n_batch, 101)
        body : (n_batch, N_BODY) body vectors, SI units; by default the vehicle's
        initial : (n_batch, 12) states at the start; by default the manoeuvre's
        outputs : those of the states and accelerations that are wanted

        Returns
        -------
        states (n_batch, n_times, n_outputs) at the output times and status codes (n_batch,).
        """
        dimensional = self.dimensional(xi)
        n_batch = len(dimensional)
        integrate = kernel.integrate_parallel if parallel and n_batch > kernel.LANES else kernel.integrate
        states, status = integrate(
            dimensional,
            self._repeated(self.vehicle.body, n_batch) if body is None else body,
            self._repeated(self.manoeuvre.initial_state, n_batch) if initial is None else initial,
            self._stages,
            self.step,
            self.times,
            MAX_SPEED_RATIO * self.vehicle.speed_mps,
            self.attitude == "quaternion",
            np.array([log_files.OUTPUTS.index(name) for name in outputs]),
        )
        if self.attitude == "quaternion":
            angles = np.isin(outputs, ("phi", "theta", "psi"))
            states[..., angles] = np.unwrap(states[..., angles], axis=1)
        return states, status

    def accelerations(self, xi, states) -> np.ndarray:
        """Body accelerations (n_batch, n_times, 6) of coefficient sets `xi` along `states` at the output times."""
        dimensional = self.dimensional(xi)
        body = self._repeated(self.vehicle.body, len(dimensional))
        return kernel.body_accelerations(dimensional, body, states, self._controls_at(self.times))

    def sensitivities(self, xi, parameters, outputs=log_files.STATES, *, body=None, initial=None) -> np.ndarray:
        """Derivatives of the motion of one coefficient set `xi` (101,) at the output times.

        They are those of the discretised motion, exact to round-off where it is differentiable (model section 6).

        Parameters
        ----------
        parameters : names of coefficients (non-dimensional), of entries of the body vector (SI units; b1 .. b9
            non-dimensional; mass, weight and buoyancy are three numbers), or of states at the start, such as "u0"
        outputs : those of the states and accelerations whose derivatives are wanted
        body, initial : (N_BODY,) and (12,), by default the vehicle's and the manoeuvre's

        Returns
        -------
        (n_times, n_outputs, n_parameters) array, not a number from the failure of the simulation on.
        """
        if self.attitude != "euler":
            raise InputError("sensitivities need the attitude in Euler angles")
        dimensional = self.dimensional(xi)
        body = np.array(self.vehicle.body if body is None else body)[None]
        initial = np.array(self.manoeuvre.initial_state if initial is None else initial)[None]
        history = sensitivity.fly(
            dimensional, body, initial, self._stages, self.step, MAX_SPEED_RATIO * self.vehicle.speed_mps
        )
        columns = self._sensitivity_columns(parameters)
        rows = np.array([log_files.OUTPUTS.index(name) for name in outputs])
        found = sensitivity.sensitivities(
            dimensional, body, history, self._stages, self.step, self.times, *columns[1:], rows
        )
        if len(columns[0]) < found.shape[1]:
            found = np.add.reduceat(found, columns[0], axis=1)
        return found.swapaxes(1, 2)

    def _sensitivity_columns(self, parameters):
        """First column of each parameter, and what :func:`bayesub.kernels.sensitivities.sensitivities` asks for."""
        parameters = tuple(parameters)
        if parameters in self._columns:
            return self._columns[parameters]
        idle = self.vehicle.idle(self.subproblem)
        factors_of = self.vehicle.dimensional_factors
        thrust_factor = 0.5 * self.vehicle.water_density_kgm3 * self.vehicle.length_m**2
        body, columns, firsts = [], [], []
        for name in parameters:
            firsts.append(len(columns))
            used = name not in idle
            if name in coefficients.INDEX:
                k = coefficients.INDEX[name]
                columns.append((k, used * factors_of[k], coefficients.AXES.index(name[0]), None))
            elif name in workspace.BODY:
                first = len(coefficients.NAMES) + 6 * len(body)
                factor = used * (thrust_factor if name in workspace.THRUST else 1.0)
                columns += [(first + axis, factor, axis, None) for axis in range(6)]
                body.append(workspace.BODY.index(name))
            elif name[-1:] == "0" and name[:-1] in log_files.STATES:
                columns.append((0, 0.0, 0, log_files.STATES.index(name[:-1])))
            else:
                valid = [*coefficients.NAMES, *workspace.BODY, *(f"{state}0" for state in log_files.STATES)]
                raise InputError(f"unknown parameter '{name}'{nearest(name, valid)}")
        sources, factors, axes, starts = zip(*columns, strict=True)
        initial = np.zeros((len(columns), sensitivity.WIDTH))
        for column, start in enumerate(starts):
            if start is not None:
                initial[column, start] = 1.0
        arrays = np.array(body, dtype=int), np.array(sources), np.array(factors), np.array(axes), initial
        self._columns[parameters] = firsts, *arrays
        return self._columns[parameters]

    def trajectory(self, xi) -> Trajectory:
        """Simulate coefficient sets `xi` (n_batch, 101) and keep everything."""
        states, status = self.run(xi)
        controls = self._controls_at(self.times)
        rpm = controls[:, 3] * self.vehicle.rpm_per_mps
        return Trajectory(self.times, states, controls[:, :3], rpm, np.array(STATUS)[status], self, np.atleast_2d(xi))

    @staticmethod
    def _repeated(row, n_batch):
        return np.repeat(row[None], n_batch, axis=0)


def call_kernels() -> None:
    """Call every kernel that a study needs, with the types that it gives them (:mod:`bayesub.kernels.compilation`)."""
    vehicle = load_vehicle("suboff")
    times = np.arange(3.0)
    straight = Manoeuvre(
        "straight", times, np.zeros((3, 3)), np.full(3, vehicle.rpm_per_mps * vehicle.speed_mps), np.eye(12)[6] * 7.5
    )
    simulator = Simulator(vehicle, straight, times, dt=1.0)
    for n_batch in (1, 2 * kernel.LANES):
        states, _ = simulator.run(np.repeat(vehicle.xi[None], n_batch, axis=0))
        noise.sums_of_squares(states[:, :, 0].copy(), np.zeros(3))
    simulator.accelerations(vehicle.xi, states[:1])
    simulator.sensitivities(vehicle.xi, ("Xuu",))


def simulate(
    vehicle: Vehicle,
    manoeuvre: Manoeuvre,
    *,
    xi=None,
    dt: float | None = None,
    sample: float | None = None,
    controls: str = "linear",
    subproblem: str | None = _UNSET,
    attitude: str = "euler",
) -> Trajectory:
    """Simulate a manoeuvre.

    Parameters
    ----------
    xi : (101,) or (n_batch, 101) non-dimensional coefficients; by default the vehicle's own
    dt : integration step, s; by default the largest that keeps the position error below 5 cm
    sample : output interval, s; by default the spacing of the control history
    controls, subproblem, attitude : see :class:`Simulator`

    A member that fails keeps its states up to the failure and says so in its status.
    """
    xi = vehicle.xi if xi is None else np.asarray(xi, dtype=float)
    if xi.shape[-1:] != (len(coefficients.NAMES),) or xi.ndim > 2 or not np.isfinite(xi).all():
        raise InputError(f"xi must be finite with shape (101,) or (n_batch, 101), found shape {xi.shape}")
    if sample is None:
        times = manoeuvre.times
    elif np.isfinite(sample) and 0 < sample <= manoeuvre.duration:
        if not manoeuvre.duration / sample <= MAX_STEPS:
            raise InputError(
                f"an output interval of {sample:g} s gives more than {MAX_STEPS:,} rows; give a longer one"
            )
        times = np.arange(int(manoeuvre.duration / sample * (1 + 1e-12)) + 1) * sample
    else:
        raise InputError(f"the output interval must lie between 0 and {manoeuvre.duration:g} s, found {sample}")
    times = np.minimum(times, manoeuvre.duration)
    options = {"dt": dt, "controls": controls, "subproblem": subproblem, "attitude": attitude}
    return Simulator(vehicle, manoeuvre, times, **options).trajectory(xi)


def choose_step(vehicle: Vehicle, manoeuvre: Manoeuvre, subproblem: str | None, attitude: str = "euler") -> float:
    """The largest step of 1, 0.5, 0.2, 0.1, .. s that keeps the position within 5 cm of the one at half the step.

    The search starts at a tenth of a ship length travelled. InputError if a boat that completes the manoeuvre has none.
    """
    times = np.linspace(0.0, manoeuvre.duration, 201)
    ladder = [m * 10.0**e for e in range(1, -5, -1) for m in (5, 2, 1)]
    ladder = [step for step in ladder if step <= 0.1 * vehicle.length_m / vehicle.speed_mps] or ladder[-1:]
    ladder = [step for step in ladder if 2.0 * manoeuvre.duration / step <= MAX_STEPS] or ladder[:1]
    for step in ladder:
        coarse, fine = (
            Simulator(vehicle, manoeuvre, times, dt=dt, subproblem=subproblem, attitude=attitude).run(vehicle.xi)[0][
                0, :, :3
            ]
            for dt in (step, step / 2)
        )
        # A vehicle that fails is compared up to its failure.
        both = np.isfinite(coarse[:, 0]) & np.isfinite(fine[:, 0])
        if both.any() and np.linalg.norm(coarse[both] - fine[both], axis=1).max() < STEP_TOLERANCE_M:
            return step
    if both.all():
        raise InputError(
            f"{manoeuvre.name}: no step down to {ladder[-1]:g} s keeps the position of '{vehicle.name}' within 5 cm; "
            "give a step (dt)"
        )
    return ladder[-1]


def accelerations(vehicle: Vehicle, states, controls, rpm) -> np.ndarray:
    """Body accelerations at given states, from all six equations of motion (model section 6).

    Parameters
    ----------
    states : (n, 12) m, rad, m/s, rad/s
    controls : (n, 3) rad
    rpm : (n,) or number

    Returns
    -------
    (n, 6) udot vdot wdot (m/s^2), pdot qdot rdot (rad/s^2).
    """
    states = np.ascontiguousarray(states, dtype=float)
    ordered = np.empty((len(states), 4))
    ordered[:, :3] = controls
    ordered[:, 3] = np.asarray(rpm, dtype=float) / vehicle.rpm_per_mps
    dimensional = (vehicle.xi * vehicle.dimensional_factors)[None]
    return kernel.body_accelerations(dimensional, vehicle.body[None].copy(), states[None], ordered)[0]
