"""What a record may have that its problem leaves out, and how each of it moves the residuals.

All that is left out becomes nuisance parameters of the same trial, and a force its response in all channels at once, as
the equations say. Columns are derivatives about some parameters and some amounts of what is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bayesub.logs import log_files
from bayesub.model.equations import AXES
from bayesub.model.equations.equation_set import PLANES
from bayesub.problem.base import Costs
from bayesub.problem.distributions import WHITE
from bayesub.problem.disturbances import Disturbances, UnknownDisturbance
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import AR1
from bayesub.problem.nuisance import CURRENTS, Nuisance, find
from bayesub.problem.trial_problem import TrialProblem

_N_FORCES = 180  # at the knots of all axes of a trial, at most
_FACTOR = 1.6  # from one correlation time to the next
_LONGEST = 0.2  # correlation time, of the duration of a trial
_SHORTEST = 0.5  # correlation time of slow noise, in intervals of its readings
_LOG_2_PI = np.log(2.0 * np.pi)

Amounts = Mapping[tuple[str, str], np.ndarray]  # kind and name of what is left out -> (k,) amounts, one a column


@dataclass(frozen=True)
class SlowNoise:
    """The residuals of one channel as they are if its noise is slow, of the sd that it is said to have."""

    rows: slice  # of the channel among the residuals
    times: np.ndarray  # (n_times,) correlation times, s
    # (n_times, n, n_params + 1) Jacobian by standard coordinates, and residuals, whose noise is then independent and of
    # unit variance
    whitened: np.ndarray
    half_log_determinants: np.ndarray  # (n_times,) of the correlation of the noise


@dataclass(frozen=True)
class Alternatives:
    """Residuals of a problem at some parameters, and what could have moved them."""

    residuals: np.ndarray  # (n_rows,) with nothing that is left out, in first order
    standard: np.ndarray  # (n_params,) the parameters in coordinates in which their prior is standard normal
    jacobian: np.ndarray  # (n_rows, n_params) by these
    # kind ("bias", "current", "coefficient") -> name -> (n_rows, k) columns for a unit of a parameter, one for each
    # trial or component; of a coefficient for as much as its value
    effects: dict[str, dict[str, np.ndarray]]
    # axis -> (n_rows, n_knots) columns for a unit of the non-dimensional force at each knot of each trial
    forces: dict[str, np.ndarray]
    # correlation time, s -> (n_knots, n_knots) factor of the covariance of these forces for a unit sd
    factors: dict[float, np.ndarray]


class LeftOut:
    """All that a problem of one or several trials leaves out.

    A problem that has unknown forces gets no others. Forces need their own kernels, which are compiled on first use.
    """

    def __init__(self, problem: TrialProblem | JointProblem):
        self.problem = problem
        trials = list(problem.each_trial(np.arange(problem.n_params)))
        self._still = [_Trial(trial, places, forced=False) for _, trial, places in trials]
        self._trials = [_Trial(trial, places, forced=True) for _, trial, places in trials]

    def about(
        self, standard: np.ndarray, amounts: Amounts | None = None, *, forced: bool = True
    ) -> Alternatives | None:
        """All of it about standard coordinates (n_params,) of the parameters, or None if the simulation fails there.

        Without forces, of which `amounts` then has none, it takes a tenth of the time.
        """
        problem, amounts = self.problem, {} if amounts is None else amounts
        trials = self._trials if forced else self._still
        parameters = problem.prior.parameters(standard)
        n_rows = sum(trial.problem.n_rows for trial in trials)
        residuals, jacobian, first = np.zeros(n_rows), np.zeros((n_rows, problem.n_params)), 0
        blocks: dict[tuple[str, str], list[np.ndarray]] = {}
        for number, trial in enumerate(trials):
            rows = slice(first, first + trial.problem.n_rows)
            residuals[rows], jacobian[rows, trial.places], columns = trial.about(parameters, number, amounts)
            for key, part in columns.items():
                blocks.setdefault(key, []).append(np.zeros((n_rows, part.shape[1])))
                blocks[key][-1][rows] = part
            first = rows.stop
        effects: dict[str, dict[str, np.ndarray]] = {}
        forces: dict[str, np.ndarray] = {}
        for (kind, name), parts in blocks.items():
            # A coefficient is that of all trials; everything else each trial has for itself.
            together = sum(parts, np.zeros(())) if kind == "coefficient" else np.hstack(parts)
            (forces if kind == "disturbance" else effects.setdefault(kind, {}))[name] = together
            if (kind, name) in amounts:
                residuals = residuals - together @ amounts[kind, name]
        jacobian = problem.prior.chain(jacobian, standard)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            return None
        return Alternatives(residuals, standard, jacobian, effects, forces, self._factors if forces else {})

    def residuals(self, standard: np.ndarray, amounts: Amounts) -> np.ndarray:
        """(n, n_rows) residuals at coordinates (n, n_params) and amounts (n, k), not a number where it fails."""
        parameters = self.problem.prior.parameters(standard)
        trials = self._trials if any(kind == "disturbance" for kind, _ in amounts) else self._still
        return np.hstack([trial.residuals(parameters, number, amounts) for number, trial in enumerate(trials)])

    def slow_noises(self, alternatives: Alternatives) -> dict[str, SlowNoise]:
        """Channel -> what it is if its noise is slow, of channels whose noise is not."""
        whole = np.column_stack([alternatives.jacobian, alternatives.residuals])
        return {
            name: _slow(self.problem.rows[name], channel.times, whole)
            for name, (channel, noise) in self.problem.channels.items()
            if not isinstance(noise, AR1) and len(channel.times) > 1
        }

    @property
    def costs(self) -> Costs:
        """Counts of what has been computed."""
        return self.problem.costs

    @cached_property
    def _factors(self) -> dict[float, np.ndarray]:
        return _factors(self._trials)


class _Trial:
    """A trial, of which all that is left out is a nuisance parameter too; `places` are its parameters among all."""

    def __init__(self, problem: TrialProblem, places: np.ndarray, forced: bool):
        self.problem, self.places = problem, places
        forward, vehicle, manoeuvre = problem.forward, problem.vehicle, problem.manoeuvre
        channels, inferred = problem.record.channels, forward.nuisances.names
        currents = CURRENTS if any(channel.over_ground for channel in channels) else ()
        biases = dict.fromkeys(f"bias_{log_files.HEADERS[channel.quantity]}" for channel in channels)
        given = vehicle, manoeuvre, channels, problem.noises
        missing = [find(name, *given) for name in (*biases, *currents) if name not in inferred]
        own: Any = self._disturbances() if forced and not forward.disturbances else None
        self.disturbances = forward.disturbances or own
        if own is not None:
            missing += [Nuisance(*pair) for pair in zip(own.priors, own.held, strict=True)]
        nuisances = [*forward.nuisances.parameters, *missing]
        step = forward.simulator.step
        self._forward = ForwardModel(vehicle, manoeuvre, problem.record, nuisances, step, self.disturbances)
        self._priors = problem.nuisance_priors | dict.fromkeys((nuisance.name for nuisance in missing), WHITE)
        active = problem.equations.active(None, manoeuvre, problem.simulator.subproblem)
        held = [k for k in problem.equations.columns(active) if k not in problem.columns and problem.xi[k] != 0.0]
        self._held = {problem.equations.names[k]: k for k in held}
        n = len(problem.names)
        # Kind and name -> positions among the parameters with all that is left out.
        self._positions: dict[tuple[str, str], np.ndarray] = {}
        for place, nuisance in enumerate(missing, start=n):
            if nuisance.name in CURRENTS:
                key = "current", "current"
            elif nuisance.name in biases:
                key = "bias", nuisance.name
            else:
                key = "disturbance", nuisance.name.split("_")[1]
            self._positions[key] = np.append(self._positions.get(key, np.zeros(0, dtype=int)), place)
        self._whole = self._problem(problem.xi)
        self._factor: Any = self.factor(self.disturbances.unknown.time_s) if self.disturbances else None

    def _disturbances(self) -> Disturbances:
        """Forces of unit sd on all axes that move, as white coordinates."""
        problem = self.problem
        plane = problem.simulator.subproblem
        axes = tuple(PLANES[plane][0]) if plane in PLANES else AXES
        times = problem.forward.measurement.times
        # A disturbance with the shortest correlation time has twice as many, which its readings must be able to tell.
        n_knots = int(np.clip(len(problem.readings) / (2 * len(axes)), 4, _N_FORCES // len(axes)))
        duration = float(times.max())
        interval = duration / (n_knots - 1)
        unknown = UnknownDisturbance(axes, dict.fromkeys(axes, 1.0), interval, knot_interval_s=interval)
        return Disturbances(unknown, problem.vehicle, duration)

    def factor(self, time: float) -> np.ndarray:
        """(n_knots, n_knots) of the covariance of forces of unit sd."""
        from bayesub.problem import innovations  # loads the compiler

        knots = self.disturbances.knots
        return innovations.factor(self.disturbances.unknown.kind, knots.interval, len(knots.times), time)

    def _problem(self, xi) -> TrialProblem:
        """The problem of this trial with all that is left out."""
        return self.problem.view(forward=self._forward, xi=xi, nuisance_priors=self._priors)

    def _at(self, parameters, number, amounts):
        """Coefficient sets and parameters (n, n_all) at all parameters (n, n_params) and amounts (n, k).

        Of the amounts those of the trial of a `number` count.
        """
        left_out = sum(map(len, self._positions.values()))
        full = np.hstack([parameters[:, self.places], np.zeros((len(parameters), left_out))])
        sets = self.problem.coefficient_sets(full)
        for (kind, name), values in amounts.items():
            if kind == "coefficient" and name in self._held:
                sets[:, self._held[name]] *= 1.0 + values[:, 0]
            elif (kind, name) in self._positions:
                own = self._positions[kind, name]
                part = values[:, number * len(own) : (number + 1) * len(own)]
                full[:, own] = np.linalg.solve(self._factor, part.T).T if kind == "disturbance" else part
        return sets, full

    def residuals(self, parameters: np.ndarray, number: int, amounts: Amounts) -> np.ndarray:
        """(n, n_rows) there."""
        sets, full = self._at(parameters, number, amounts)
        predicted, _ = self._forward.predicted(sets, full[:, self.problem.n_coefficients :])
        self._forward.measurement.to_nearest_turn(predicted, self.problem.readings)
        return self._whole.likelihood.residuals(predicted, self._whole.nuisance_values(full))

    def about(
        self, parameters: np.ndarray, number: int, amounts: Amounts
    ) -> tuple[np.ndarray, np.ndarray, dict[tuple[str, str], np.ndarray]]:
        """Residuals (n_rows,), Jacobian (n_rows, n_own) and columns by kind and name at one such place."""
        problem, amounts = self.problem, {key: values[None] for key, values in amounts.items()}
        sets, full = self._at(parameters[None], number, amounts)
        whole = self._problem(sets[0])
        jacobian, columns = whole.jacobian(full[0]), {}
        for key, own in self._positions.items():
            columns[key] = jacobian[:, own]
            if key[0] == "disturbance":
                columns[key] = np.linalg.solve(self._factor.T, columns[key].T).T
        if self._held:
            slopes = self._forward.slopes(*whole.arguments(full), list(self._held), of_nuisances=False)
            rows = whole.weighed(full[0], slopes)
            for j, (name, k) in enumerate(self._held.items()):
                columns["coefficient", name] = rows[:, [j]] * problem.xi[k]
        residuals = self.residuals(parameters[None], number, amounts)[0]
        return residuals, jacobian[:, : len(problem.names)], columns


def _factors(trials) -> dict[float, np.ndarray]:
    """Correlation time -> factor (n, n) of the forces at the knots of all trials, which have one process."""
    shortest = max(trial.disturbances.knots.interval for trial in trials)
    longest = max(_LONGEST * trial.disturbances.duration for trial in trials)
    factors = {}
    for time in _geometric(shortest, longest):
        parts = [trial.factor(time) for trial in trials]
        n, place = sum(map(len, parts)), 0
        factors[time] = np.zeros((n, n))
        for part in parts:
            factors[time][place : place + len(part), place : place + len(part)] = part
            place += len(part)
    return factors


def _slow(rows, times, whole) -> SlowNoise:
    """One channel, of the Jacobian and residuals `whole` (n_rows, n_params + 1)."""
    own = whole[rows]
    shortest = _SHORTEST * float(np.median(np.diff(times)))
    correlation_times = np.array(_geometric(shortest, _LONGEST * (times[-1] - times[0])))
    whitened, halves = [], []
    for time in correlation_times:
        noise = AR1(1.0, time)
        whitened.append(noise.weigh(own, own, np.zeros(len(own)), times))
        (density,) = noise.log_density(np.zeros((1, len(own))), np.zeros(len(own)), times)
        halves.append(-density - 0.5 * len(own) * _LOG_2_PI)
    return SlowNoise(rows, correlation_times, np.array(whitened), np.array(halves))


def _geometric(shortest, longest) -> list[float]:
    n = max(1, int(np.ceil(np.log(max(longest / shortest, 1.0)) / np.log(_FACTOR))) + 1)
    return [float(time) for time in shortest * _FACTOR ** np.arange(n)]
