"""A vehicle on a manoeuvre, prepared once, and flown with many batches of coefficient sets."""

from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from types import NoneType
from typing import TYPE_CHECKING, NamedTuple, SupportsFloat

import numpy as np

from bayesub.io.arguments import check_class
from bayesub.io.errors import InputError, nearest
from bayesub.kernels import workspace
from bayesub.kernels.workspace import HATS
from bayesub.logs import log_files
from bayesub.model import prescribed
from bayesub.model.control_histories import ControlHistories, StageChanges
from bayesub.model.disturbance import Disturbance, ForceHistory, Knots, check_axes
from bayesub.model.equations import AXES
from bayesub.model.equations.generate import EXTERNAL
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Policy
    from bayesub.kernels.steering import Steering

STATUS = ("ok", "diverged", "left_envelope")
MAX_SPEED_RATIO = 10.0  # a member faster than this many times the trial speed has diverged
MAX_STEPS = 2_000_000  # of one flight, and of its output times
STEP_TOLERANCE_M = 0.05  # position change on halving the step that an automatic step must keep
FINER = 10.0  # steps of a true motion in one of the model that is fitted to its record
OF_MANOEUVRE = "of the manoeuvre"
# States that move, by sub-problem.
MOVING = {None: log_files.STATES, "horizontal": ("x", "y", "psi", "u", "v", "r")}
MOVING |= {"vertical": ("x", "z", "theta", "u", "w", "q")}


class Pieces(NamedTuple):
    """A motion between knots, linear in the state at the start of each piece and in the forces at its knots.

    A piece begins with the first step after a knot, so that it ends a step late and the forces of HATS knots act in it.
    The columns are n_states of :data:`MOVING`, and then axis after axis the forces at these knots.
    """

    ends: np.ndarray  # (n_pieces, n_states, n_columns) derivatives of the state at the end
    outputs: np.ndarray  # (n_times, n_outputs, n_columns) derivatives of what is put out
    bounds: np.ndarray  # (n_pieces,) where they end, s
    numbers: np.ndarray  # (n_times,) of the pieces in which the outputs are; what is at an end is before it


@dataclass(eq=False, repr=False)
class Simulator:
    """A vehicle on a manoeuvre, prepared once for many batches of coefficient sets.

    Parameters of actuators are those of :attr:`bayesub.model.actuators.Actuators.parameters`. InputError for an option
    that does not exist, and for output times that descend or lie outside the manoeuvre.
    """

    vehicle: Vehicle  # which is then confined to the sub-problem
    manoeuvre: Manoeuvre
    times: np.ndarray  # (n_times,) of output within the manoeuvre, s, which must not descend
    _: KW_ONLY
    dt: float | None = None  # integration step, s; by default one that is good to 5 cm (choose_step)
    # "linear" interpolates the control history at the Runge-Kutta stages, "hold" takes the value at the start of each
    # step (the convention of the thesis, first order).
    controls: str = "linear"
    subproblem: str | None = OF_MANOEUVRE  # "horizontal", "vertical" or None for all six degrees of freedom
    attitude: str = "euler"  # or "quaternion", to fly through 90 degrees of pitch (output in Euler angles all the same)
    # Parameters of actuators by which members of a batch may differ; with the forces at the knots, which come after
    # them, they are n_varied.
    varied: tuple[str, ...] = ()
    # Parameters of actuators -> how much they differ, for all members, from no bias, a scale of one, no delay and the
    # lag of the vehicle.
    changes: Mapping[str, float] = field(default_factory=dict)
    knots: Knots | None = None  # where each member has forces of its own that the equations leave out
    # Forces that the equations leave out, for all members. A current among them moves the boat over the ground, and not
    # in the water, in which all states here are.
    forces: ForceHistory | None = None
    step: float = field(init=False)  # the integration step that is taken, s

    def __post_init__(self):
        vehicle, manoeuvre, equations = self.vehicle, self.manoeuvre, self.vehicle.equations
        wanted = manoeuvre.subproblem if self.subproblem == OF_MANOEUVRE else self.subproblem
        self.subproblem = equations.subproblem(wanted)
        self._check_options()
        self._disturbed = self.knots is not None or (self.forces is not None and self.forces.of_forces is not None)
        self._pushed = self._disturbed or bool(manoeuvre.prescribed)
        self.kernels = vehicle.kernels(self.subproblem, external=self._pushed)
        self.vehicle = vehicle.restricted(self.subproblem)
        self.step = choose_step(vehicle, manoeuvre, self.subproblem, self.attitude) if self.dt is None else self.dt
        self.step, self.times = float(self.step), np.array(self.times, dtype=float)
        self._check_times()
        self._inactive = np.isin(equations.names, equations.active(subproblem=self.subproblem), invert=True)
        self._columns: dict[tuple[str, ...], tuple] = {}  # of sensitivities, by parameters
        self._hats: tuple | None = None  # of pieces
        n_steps = max(1, int(np.ceil(self.times[-1] / self.step * (1 - 1e-12))))
        boundaries = np.arange(max(n_steps, 3) + 1) * self.step
        self._prescribed = {one: one.on_steps(boundaries) for one in manoeuvre.prescribed}
        starts = np.arange(n_steps + 1) * self.step
        middle, end = (0.0, 0.0) if self.controls == "hold" else (0.5, 1.0)
        stage_times = [starts + f * self.step for f in (0.0, middle, end)]
        self.histories = ControlHistories(
            vehicle, manoeuvre, starts, self.step, stage_times, self.varied, self.changes, self.subproblem
        )
        pairs = zip(stage_times, self.histories.stages, strict=True)
        self._stages = np.stack([self._controls(at, inputs) for at, inputs in pairs], axis=1)
        self._varied = (*self.varied, *(() if self.knots is None else self.knots.parameters))
        self._stage_changes = StageChanges(
            vehicle, self.subproblem, self._varied, self.histories, stage_times, self.knots
        )

    def _check_options(self):
        """InputError for options that do not exist or do not go together."""
        if self.controls not in ("linear", "hold"):
            message = f"unknown control convention '{self.controls}': expected linear or hold"
            raise InputError(message, "unknown", "controls")
        if self.attitude not in ("euler", "quaternion"):
            raise InputError(f"unknown attitude '{self.attitude}': expected euler or quaternion", "unknown", "attitude")
        check_class("dt", self.dt, SupportsFloat, NoneType, key="dt")
        if self.dt is not None and not (np.isfinite(self.dt) and self.dt > 0):
            raise InputError(f"the time step must be a positive number of seconds, found {self.dt}", "value", "dt")
        longest = self.vehicle.length_m / self.vehicle.speed_mps
        if self.dt is not None and self.dt > longest:
            message = f"the time step is {self.dt:g} s, longer than a ship length travelled, {longest:.3g} s"
            raise InputError(f"{message}; give a shorter one, or none", "limit", "dt")
        self.manoeuvre.check(self.vehicle)
        for part in (self.knots, self.forces):
            if part is not None and part.axes:
                check_axes(part.axes, self.subproblem)
        for one in self.manoeuvre.prescribed:
            prescribed.check(one.angle, self.subproblem)
            if self.controls == "hold":
                text = f"prescribed: {one.angle} cannot be held over a step; leave out controls = hold"
                raise InputError(text, "conflict", "controls")

    def _check_times(self):
        """InputError for output times that descend or lie outside the manoeuvre, and for too many steps."""
        times, manoeuvre = self.times, self.manoeuvre
        if times.size == 0 or not (times[0] >= 0 and times[-1] <= manoeuvre.duration * (1 + 1e-12)):
            message = f"output times must lie within the manoeuvre, 0 to {manoeuvre.duration:g} s"
            raise InputError(message, "value", "times")
        steps = np.diff(times)
        if not np.all(steps >= 0):
            k = int(np.argmin(steps >= 0))
            message = f"output times must ascend, found {times[k + 1]:g} s after {times[k]:g} s"
            raise InputError(message, "value", "times")
        if not times[-1] / self.step <= MAX_STEPS:
            text = f"{manoeuvre.name}: {times[-1]:g} s are more than {MAX_STEPS:,} steps of {self.step:g} s; "
            text += "shorten the manoeuvre or give a longer step"
            raise InputError(text, "limit", "dt")

    def at(self, times: np.ndarray) -> "Simulator":
        """The same simulator with other output times."""
        return replace(self, dt=self.step, times=times)

    @property
    def undisturbed(self) -> "Simulator":
        """The same simulator without the forces that the equations leave out."""
        calm = self.knots is None and self.forces is None
        return self if calm else replace(self, dt=self.step, knots=None, forces=None)

    def disturbed(self, disturbance: Disturbance | ForceHistory, rng: np.random.Generator | None = None) -> "Simulator":
        """The same simulator with forces that the equations leave out, for all members.

        Of a process a history is sampled by `rng` at the beginning and end of each step; InputError without `rng`, and
        for a correlation time shorter than a step.
        """
        if isinstance(disturbance, Disturbance):
            if rng is None:
                raise InputError("disturbance: a history of it needs random numbers; give rng", "missing", "rng")
            if not disturbance.shortest_s >= self.step:
                text = f"disturbance: correlation_time_s is {disturbance.shortest_s:g} s, shorter than the time "
                text += f"step of {self.step:g} s; give a shorter step"
                raise InputError(text, "conflict", "correlation_time_s")
            n_steps = int(np.ceil(self.manoeuvre.duration / self.step * (1.0 - 1e-12)))
            disturbance = disturbance.sample(np.arange(n_steps + 1) * self.step, rng)
        return replace(self, dt=self.step, forces=disturbance)

    def controls_at(self, times: np.ndarray) -> np.ndarray:
        """(n, n_controls + 1): the controls of the equations and n/k0; then, if there are any, forces from outside."""
        return self._controls(times, self.histories.at(times))

    def _controls(self, times, inputs):
        """The same of values (n, n_actuators) of the actuators."""
        history, actuators = self.manoeuvre, self.vehicle.actuators
        speed = np.interp(times, history.times, history.rpm / self.vehicle.rpm_per_mps)
        controls = actuators.kernel_controls(inputs, speed, self.subproblem)
        for parameter, amount in self.changes.items():
            if actuators.parameters[parameter][1] in ("bias", "scale"):
                controls = controls + amount * actuators.variation(parameter, inputs, self.subproblem)
        if self._pushed and not actuators.external:
            controls = np.hstack([controls, np.zeros((len(controls), len(EXTERNAL)))])
        if self._disturbed and self.forces is not None:
            controls[:, self._first_force : self._first_force + len(AXES)] += self.forces.at(times)
        for one, angle in self._prescribed.items():
            column = self._first_force + AXES.index(one.axis)
            controls[:, column] += prescribed.INERTIA * np.interp(times, angle.x, angle(angle.x, 2))
        return controls

    @property
    def _first_force(self) -> int:
        """Column of the first force from outside in what the kernels take as controls."""
        return len(self.vehicle.equations.controls) + 1

    def dimensional(self, xi: np.ndarray) -> np.ndarray:
        """(n_batch, n_terms) dimensional coefficients, zero where they play no part in the sub-problem."""
        dimensional = np.atleast_2d(np.asarray(xi, dtype=float)) * self.vehicle.dimensional_factors
        dimensional[:, self._inactive] = 0.0
        return dimensional

    def run(
        self,
        xi: np.ndarray,
        *,
        body: np.ndarray | None = None,
        initial: np.ndarray | None = None,
        amounts: np.ndarray | None = None,
        outputs: tuple[str, ...] = log_files.STATES,
        parallel: bool = True,
        times: np.ndarray | None = None,
        steering: "Steering | None" = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Simulate a batch of coefficient sets (n_batch, n_terms).

        Body vectors `body` (n_batch, N_BODY), SI units, are by default the vehicle's, the states at the start `initial`
        (n_batch, 12) those of the manoeuvre. `amounts` (n_batch, n_varied) are how much the parameters of the actuators
        that vary differ, and forces at the knots (N, N m); by default not at all. `outputs` are short names of the
        states and accelerations that are wanted. Output times (n_times,), s, do not descend, and none is after the last
        of the simulator; by default they are its own. A large batch is shared among threads, if it may be `parallel`.
        Of forces at the knots that are chosen on the way the `steering` is filled in (:meth:`steering`). Returned are
        the states (n_batch, n_times, n_outputs) at the output times, and the status (n_batch,), positions in STATUS.
        """
        dimensional = self.dimensional(xi)
        n_batch = len(dimensional)
        states, status = self.kernels.integrate(
            dimensional,
            self._bodies(body, n_batch),
            self._initials(initial, n_batch),
            self._stages,
            self._stage_changes.variations,
            self._stage_changes.numbers(np.zeros((n_batch, len(self._varied))) if amounts is None else amounts),
            self.step,
            self.times if times is None else times,
            MAX_SPEED_RATIO * self.vehicle.speed_mps,
            np.array(log_files.positions(*outputs)),
            quaternions=self.attitude == "quaternion",
            parallel=parallel,
            **({} if steering is None else {"steering": steering}),
        )
        if self.attitude == "quaternion":
            angles = np.isin(outputs, log_files.ANGLES)
            states[..., angles] = np.unwrap(states[..., angles], axis=1)
        return states, status

    def steering(self, n_batch: int, policy: "Policy | None", axes: list[int], n_axes: int) -> "Steering":
        """Looks at the states of members at the ends of :meth:`pieces`, and their forces by a policy if there is one.

        Of its n_axes those of the knots are the given ones.
        """
        from bayesub.kernels.steering import FREE, Steering  # loads the compiler

        knots, rows = self.knots, np.array(log_files.positions(*MOVING[self.subproblem]))
        assert knots is not None
        n_knots = len(knots.times)
        places = np.full((n_axes, n_knots), -1)
        places[axes] = (self._stage_changes.n_before + np.arange(len(axes) * n_knots)).reshape(len(axes), n_knots)
        seen = np.full((n_batch, n_knots - 1, len(rows)), np.nan)
        shocks = np.zeros((0, 0, 0)) if policy is None else np.full(policy.levels.shape, np.nan)
        return Steering(self._restarts, rows, places, seen, shocks, *(FREE if policy is None else policy))

    @property
    def _restarts(self) -> np.ndarray:
        """(n_pieces,) steps at whose start a piece ends."""
        assert self.knots is not None
        return np.ceil(self.knots.times[1:] / self.step * (1 - 1e-12)).astype(int)

    def accelerations(self, xi: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Body accelerations (n_batch, n_times, 6) of coefficient sets `xi` along `states` at the output times."""
        dimensional = self.dimensional(xi)
        bodies = self._bodies(None, len(dimensional))
        return self.kernels.body_accelerations(dimensional, bodies, states, self.controls_at(self.times))

    def sensitivities(
        self,
        xi: np.ndarray,
        parameters: Iterable[str],
        outputs: tuple[str, ...] = log_files.STATES,
        *,
        body: np.ndarray | None = None,
        initial: np.ndarray | None = None,
        amounts: np.ndarray | None = None,
        times: np.ndarray | None = None,
    ) -> np.ndarray:
        """Derivatives of the motion of one coefficient set at the output times.

        They are those of the discretised motion, exact to round-off where it is differentiable (model manual, section
        6). The set is (n_terms,); `parameters` are names of coefficients (non-dimensional), of entries of the body
        vector (SI units; b1 .. b9 non-dimensional; mass, weight and buoyancy are three numbers), of states at the
        start, such as "u0", of what is unknown of actuators, such as "bias_rudder_deg", or of forces at the knots. The
        others are as of :meth:`run`, of one member. Returns (n_times, n_outputs, n_parameters), nan from a failure on.
        """
        flight = self._flight(xi, body, initial, amounts)
        parameters = tuple(parameters)
        if parameters not in self._columns:
            firsts, varied, *columns = sensitivity_columns(parameters, self.vehicle, self.subproblem, self.knots)
            self._columns[parameters] = firsts, varied, self._stage_changes.by(varied, amounts), *columns
        firsts, varied, variations, slots, *columns = self._columns[parameters]
        if not self._stage_changes.are_linear:
            variations = self._stage_changes.by(varied, amounts)
        rows = np.array(log_files.positions(*outputs))
        times = self.times if times is None else times
        derivatives, _ = self.kernels.sensitivities(*flight, variations, slots, self.step, times, *columns, rows)
        if len(firsts) < derivatives.shape[1]:
            derivatives = np.add.reduceat(derivatives, firsts, axis=1)
        return derivatives.swapaxes(1, 2)

    def _flight(self, xi, body, initial, amounts) -> tuple[np.ndarray, ...]:
        """Coefficients, body, states at the stages and controls there, of one member as of :meth:`run`."""
        if self.attitude != "euler":
            raise InputError("sensitivities need the attitude in Euler angles", "conflict", "attitude")
        dimensional = self.dimensional(xi)
        bodies = self._bodies(None if body is None else np.array(body)[None], 1)
        initial = self._initials(None if initial is None else np.array(initial)[None], 1)
        stages = self._stages
        if amounts is not None:
            (numbers,) = self._stage_changes.numbers(amounts[None])
            stages = stages + self._stage_changes.variations.added(numbers, stages.shape[2])
        max_speed = MAX_SPEED_RATIO * self.vehicle.speed_mps
        return dimensional, bodies, self.kernels.fly(dimensional, bodies, initial, stages, self.step, max_speed), stages

    def pieces(
        self,
        xi: np.ndarray,
        outputs: tuple[str, ...] = log_files.STATES,
        *,
        body: np.ndarray | None = None,
        initial: np.ndarray | None = None,
        amounts: np.ndarray | None = None,
        times: np.ndarray | None = None,
    ) -> Pieces:
        """The motion of one coefficient set between the knots, linearised: :meth:`sensitivities` of its pieces.

        Their cost grows with the duration and not with the number of knots. The knots are at least a step apart.
        """
        knots, states = self.knots, MOVING[self.subproblem]
        assert knots is not None
        flight = self._flight(xi, body, initial, amounts)
        n_axes, n_knots, n_states = len(knots.axes), len(knots.times), len(states)
        if self._hats is None:
            by_knot = self._stage_changes.by(knots.parameters, None)
            axis, knot = np.divmod(by_knot.numbers, n_knots)
            slots = np.full((HATS * n_axes, 6), -1)
            acts = np.repeat([AXES.index(axis) for axis in knots.axes], HATS)
            slots[np.arange(len(acts)), acts] = np.arange(len(acts))
            starts = np.zeros((n_states + len(acts), workspace.N_STATES))
            starts[np.arange(n_states), log_files.positions(*states)] = 1.0
            of_hats = len(self.vehicle.equations.names) + np.arange(len(acts)), np.ones(len(acts)), acts
            columns = (*(np.concatenate([np.zeros(n_states), part]) for part in of_hats), starts)
            variations = by_knot._replace(numbers=HATS * axis + knot % HATS)
            self._hats = variations, slots, columns, self._restarts
        variations, slots, columns, restarts = self._hats
        times = self.times if times is None else times
        derivatives, ends = self.kernels.sensitivities(
            *flight, variations, slots, self.step, times, np.zeros(0), *columns,
            np.array(log_files.positions(*outputs)), restarts,
        )  # fmt: skip
        bounds = restarts * self.step
        numbers = np.minimum(np.searchsorted(bounds, times), len(bounds) - 1)
        ends = ends[:, :, log_files.positions(*states)].swapaxes(1, 2)

        def in_order(array, pieces):
            """Columns of the hats of knots modulo three as those of the knot of each piece and the two after it."""
            hats = HATS * np.arange(n_axes)[:, None] + (pieces[:, None, None] + np.arange(HATS)) % HATS
            places = n_states + hats.reshape(len(pieces), 1, -1)
            of_hats = np.take_along_axis(array, np.broadcast_to(places, (*array.shape[:2], places.shape[2])), axis=2)
            return np.concatenate([array[..., :n_states], of_hats], axis=2)

        outputs_of = in_order(derivatives.swapaxes(1, 2), numbers)
        return Pieces(in_order(ends, np.arange(len(ends))), outputs_of, bounds, numbers)

    def trajectory(self, xi: np.ndarray) -> Trajectory:
        """The motion of coefficient sets `xi` (n_batch, n_terms), all twelve states."""
        states, status = self.run(xi)
        n = len(self.vehicle.equations.controls)
        controls, ordered_speed = np.split(self.controls_at(self.times)[:, : n + 1], [n], axis=1)
        rpm = ordered_speed[:, 0] * self.vehicle.rpm_per_mps
        return Trajectory(self.times, states, controls, rpm, np.array(STATUS)[status], self, np.atleast_2d(xi))

    def _bodies(self, body, n_batch):
        """Body vectors (n_batch, N_BODY), by default the vehicle's, with the constants of the equations."""
        body = np.tile(self.vehicle.body, (n_batch, 1)) if body is None else body
        bodies = np.hstack([body, np.tile(self.vehicle.constants, (n_batch, 1))])
        bodies[:, [one.inertia for one in self._prescribed]] = prescribed.INERTIA
        return bodies

    def _initials(self, initial, n_batch):
        """States at the start (n_batch, 12), by default the manoeuvre's, with the angles that are prescribed."""
        initial = np.tile(self.manoeuvre.initial_state, (n_batch, 1)) if initial is None else np.array(initial)
        for one, angle in self._prescribed.items():
            initial[:, log_files.positions(*one.states)] = angle(0.0), angle(0.0, 1)
        return initial


def sensitivity_columns(
    parameters: tuple[str, ...], vehicle: Vehicle, subproblem: str | None, knots: Knots | None
) -> tuple:
    """What the kernel needs to know of parameters (:meth:`bayesub.model.simulator.Simulator.sensitivities`).

    A coefficient is one column, an entry of the body vector or something unknown of an actuator six, one for the force
    along each axis; a force at a knot is one, and a state at the start has none but its own start. Returned are the
    first column of each parameter; names of those of actuators and knots; and the arguments `slots`, `parameters`,
    `sources`, `factors`, `axes` and `initial` of the kernel. InputError for an unknown name.
    """
    equations, idle, factors_of = vehicle.equations, vehicle.idle(subproblem), vehicle.dimensional_factors
    thrust_factor = 0.5 * vehicle.water_density_kgm3 * vehicle.length_m**2
    forces = {}
    if knots is not None:
        forces = dict(zip(knots.parameters, [axis for axis in knots.axes for _ in knots.times], strict=True))
    varied = [name for name in parameters if name in vehicle.actuators.parameters or name in forces]
    after_body = len(equations.names) + 6 * sum(name in workspace.BODY for name in parameters)
    body: list[int] = []
    columns: list[tuple[int, float, int, int | None]] = []
    firsts, slots, n_slots = [], [], 0
    for name in parameters:
        firsts.append(len(columns))
        used = name not in idle
        if name in equations.index:
            k = equations.index[name]
            columns.append((k, used * factors_of[k], AXES.index(equations.terms[k].axis), None))
        elif name in workspace.BODY:
            first = len(equations.names) + 6 * len(body)
            factor = used * (thrust_factor if name in workspace.THRUST else 1.0)
            columns += [(first + axis, factor, axis, None) for axis in range(6)]
            body.append(workspace.BODY.index(name))
        elif name in varied:
            along = range(6) if name not in forces else (AXES.index(forces[name]),)
            columns += [(after_body + n_slots + k, 1.0, axis, None) for k, axis in enumerate(along)]
            slots.append([n_slots + along.index(axis) if axis in along else -1 for axis in range(6)])
            n_slots += len(along)
        elif name[-1:] == "0" and name[:-1] in log_files.STATES:
            columns.append((0, 0.0, 0, log_files.STATES.index(name[:-1])))
        else:
            valid = [*equations.names, *workspace.BODY, *(f"{state}0" for state in log_files.STATES)]
            valid += vehicle.actuators.parameters
            raise InputError(f"unknown parameter '{name}'{nearest(name, valid)}", "unknown", name)
    sources, factors, axes, starts = zip(*columns, strict=True)
    initial = np.zeros((len(columns), workspace.N_STATES))
    for column, start in enumerate(starts):
        if start is not None:
            initial[column, start] = 1.0
    of_slots, of_body = np.array(slots, dtype=int).reshape(-1, 6), np.array(body, dtype=int)
    return firsts, varied, of_slots, of_body, *map(np.array, (sources, factors, axes)), initial


def true_step(step: float, manoeuvre: Manoeuvre) -> float:
    """The step at which a motion is flown whose record is fitted at `step` (s): a tenth, as MAX_STEPS allow."""
    return min(step, max(step / FINER, 2.0 * manoeuvre.duration / MAX_STEPS))


def choose_step(vehicle: Vehicle, manoeuvre: Manoeuvre, subproblem: str | None, attitude: str = "euler") -> float:
    """The largest step of 1, 0.5, 0.2, 0.1, .. s that keeps the position within 5 cm of the one at half the step.

    It starts at a tenth of a ship length. InputError if a boat that completes the manoeuvre has no such step.
    """
    times = np.linspace(0.0, manoeuvre.duration, 201)
    ladder = steps(vehicle, manoeuvre)
    for step in ladder:
        both_steps = (
            Simulator(vehicle, manoeuvre, times, dt=dt, subproblem=subproblem, attitude=attitude)
            for dt in (step, step / 2)
        )
        coarse, fine = (simulator.run(vehicle.xi)[0][0, :, :3] for simulator in both_steps)
        # A vehicle that fails is compared up to its failure.
        both = np.isfinite(coarse[:, 0]) & np.isfinite(fine[:, 0])
        if both.any() and np.linalg.norm(coarse[both] - fine[both], axis=1).max() < STEP_TOLERANCE_M:
            return step
    if both.all():
        text = f"{manoeuvre.name}: no step down to {ladder[-1]:g} s keeps the position of '{vehicle.name}' within 5 "
        text += "cm; give a step (dt)"
        raise InputError(text, "model", "dt")
    return ladder[-1]


def steps(vehicle: Vehicle, manoeuvre: Manoeuvre) -> list[float]:
    """The steps that may be chosen: 5, 2, 1, 0.5, .. s from a tenth of a ship length travelled down.

    The shortest is such that a flight at half of it has no more than MAX_STEPS.
    """
    ladder = [m * 10.0**e for e in range(1, -5, -1) for m in (5, 2, 1)]
    ladder = [step for step in ladder if step <= 0.1 * vehicle.length_m / vehicle.speed_mps] or ladder[-1:]
    return [step for step in ladder if 2.0 * manoeuvre.duration / step <= MAX_STEPS] or ladder[:1]
