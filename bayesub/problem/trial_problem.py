"""The posterior density of one trial: a forward model, noise models and priors."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.linear_form import LinearSystem, linear_systems
from bayesub.model.trajectory import Trajectory
from bayesub.problem.base import Costs, PosteriorDensity, coefficient_names, of_readings
from bayesub.problem.distributions import Prior, joined
from bayesub.problem.disturbances import History, of_history, of_process
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.likelihood import Likelihood
from bayesub.problem.noise import Noise
from bayesub.problem.priors import CoefficientPrior

if TYPE_CHECKING:
    from bayesub.kernels.kalman import Policy


class FlownTrial(PosteriorDensity):
    """The motion of one trial, and the truth behind a synthetic record."""

    forward: ForwardModel  # the forward model
    inferred: list[int]  # positions of the nuisance parameters that are inferred, among those of the forward model
    readings: np.ndarray  # (n_readings,) measured values, SI units
    fixed_nuisances: np.ndarray | None

    def nuisance_values(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_nuisances) of parameters (n_batch, n_params), those that are held among them."""
        if self.fixed_nuisances is None:
            return parameters[:, self.n_coefficients :]
        values = np.repeat(self.fixed_nuisances[None], len(parameters), axis=0)
        values[:, self.inferred] = parameters[:, self.n_coefficients :]
        return values

    def arguments(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficient sets and nuisance values of parameters (n_batch, n_params), as the forward model takes them."""
        parameters = self.batch(parameters)
        return self.coefficient_sets(parameters), self.nuisance_values(parameters)

    @property
    def _true_xi(self) -> np.ndarray:
        record = self.forward.record
        return self.forward.vehicle.xi if record.truth is None else record.truth

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) the truth behind a synthetic record, otherwise the values of the vehicle and the manoeuvre.

        Of parameters of the noise that are unknown it is the value given with the noise model. Histories of forces
        are those of the truth between the knots, as near as they come to it.
        """
        return np.concatenate([self._true_xi[self.columns], self._true_nuisances[self.inferred]])

    @cached_property
    def _true_nuisances(self) -> np.ndarray:
        """(n_nuisances,) of the truth behind a synthetic record, or where they are held."""
        record, held = self.forward.record, zip(self.forward.nuisances.names, self.forward.nuisances.held, strict=True)
        values = np.array([record.nuisances.get(name, value) for name, value in held])
        return values if record.forces is None else self.forward.with_history(values, record.forces)

    def truth(self) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_readings,) and states over the ground (n_times, 12) behind a synthetic record.

        The boat feels the forces of the truth, on whichever axes the problem infers any.
        """
        forces = self.forward.record.forces
        readings, states = self.forward.disturbed(self._true_xi[None], self._true_nuisances[None], forces)
        self.forward.measurement.to_nearest_turn(readings[None], self.readings)
        return readings, states

    def trajectory(self, parameters: np.ndarray) -> Trajectory:
        """Simulated motion at the times of the readings, for parameters (n_params,) or (n_batch, n_params).

        It is through the water, of the vehicle from the start of the manoeuvre, without nuisance parameters.
        """
        return self.forward.simulator.trajectory(self.coefficient_sets(self.batch(parameters)))

    def predicted(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, SI units; not a number where the simulation failed.

        Headings of a log, which are known up to whole turns, are on the turn that is nearest to the reading.
        """
        return self._counted(*self.forward.predicted(*self.arguments(parameters)))

    def _counted(self, predicted, status):
        self.forward.count(status)
        self.forward.measurement.to_nearest_turn(predicted, self.readings)
        return predicted

    def flown(
        self, parameters: np.ndarray, policies: "Sequence[Policy] | None" = None
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Parameters and readings of members (n_batch, n_params) whose forces follow a policy, and states on the way.

        As :meth:`bayesub.inference.interface.Forced.flown` has it.
        """
        policy = None if policies is None else policies[0]
        predicted, status, values, seen = self.forward.flown(*self.arguments(parameters), policy)
        parameters = parameters.copy()
        parameters[:, self.n_coefficients :] = values[:, self.inferred]
        return parameters, self._counted(predicted, status), [seen]

    def motion(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings, nuisance parameters included."""
        return self.forward.states(*self.arguments(parameters))

    def forces(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) unmodelled forces at the knots, N and N m, of parameters (n_batch, n_params)."""
        return self.forward.forces(self.nuisance_values(np.atleast_2d(parameters)))

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """Axis -> linear form in the free coefficients, of the body, start and motion of parameters (n_params,)."""
        trajectory = self.forward.trajectory(*self.arguments(self.vector(parameters)))
        return linear_systems(trajectory, free=self.names[: len(self.columns)])


@dataclass(eq=False, repr=False)
class TrialProblem(FlownTrial):
    """The posterior density of one trial; :class:`bayesub.problem.problem.Problem` poses it, views change its parts.

    The `simulator` has output at the times of the readings; `times` (n_readings,), s, are when they were taken, the
    last at `duration`, and `sds` (n_readings,) are their standard deviations with rounding, SI units. `rows` are
    channel -> where its readings stand among the residuals, and `channels` channel -> channel and its noise model. Of
    the `n_rows` residuals there is one a reading, and one for each parameter of the noise that is inferred;
    `heavy_tailed` is whether any noise is (:class:`bayesub.problem.noise.Noise`). `inferred` are the positions of the
    nuisance parameters that are inferred, among those of the forward model.
    """

    forward: ForwardModel  # the forward model, whose costs all views share
    columns: np.ndarray  # (n_coefficients,) positions of the free coefficients in a set
    xi: np.ndarray  # (n_terms,) values of the coefficients that are not free
    spread: CoefficientPrior  # rule that gives the free coefficients their prior
    # nuisance parameter -> prior of it alone, of those of the forward model that are inferred
    nuisance_priors: dict[str, Prior]
    noises: tuple[Noise, ...]  # the noise model of each channel
    readings: np.ndarray  # (n_readings,) measured values, SI units
    # (n_nuisances,) values of the nuisance parameters, if not all of them are inferred; noise is known then
    fixed_nuisances: np.ndarray | None = None
    # how many times as large as inferred the sd of a channel is taken where it is inferred (:meth:`widened`)
    widening: float = 1.0

    def __post_init__(self):
        forward, record, channels = self.forward, self.forward.record, self.forward.record.channels
        self.vehicle, self.manoeuvre, self.record = forward.vehicle, forward.manoeuvre, record
        self.simulator, self.equations = forward.simulator, forward.vehicle.equations
        self.n_coefficients = len(self.columns)
        self.coefficient_prior = self.spread.on(self.columns, self.xi, self.equations)
        self.inferred = [forward.nuisances.names.index(name) for name in self.nuisance_priors]
        self.names = (*coefficient_names(self.equations, self.columns), *self.nuisance_priors)
        self.prior = joined(self.coefficient_prior, self.nuisance_priors)
        self.sds, self.times = record.total_sds, np.concatenate([channel.times for channel in channels])
        self.duration = max(float(channel.times[-1]) for channel in channels)
        slices, known = forward.measurement.slices, self.fixed_nuisances is not None
        unknown = [() if known else forward.nuisances.of_noise(channel) for channel in channels]
        self.likelihood = Likelihood(channels, slices, self.readings, self.noises, unknown, self.widening)
        self.n_rows, self.heavy_tailed = self.likelihood.n_rows, any(noise.heavy_tailed for noise in self.noises)
        self.rows = {channel.name: part for channel, part in zip(channels, slices, strict=True)}
        self.channels = {channel.name: (channel, noise) for channel, noise in zip(channels, self.noises, strict=True)}

    def view(self, **changes: Any) -> "TrialProblem":
        """The same problem but for some of its parts; all others are kept."""
        parts = {part.name: getattr(self, part.name) for part in fields(TrialProblem)}
        return TrialProblem(**parts | changes)

    def of_trials(self, change: "Callable[[TrialProblem], TrialProblem]") -> "TrialProblem":
        """The problem that `change` makes of this one, its only trial."""
        return change(self)

    def with_readings(self, readings: np.ndarray) -> "TrialProblem":
        """The same problem with other readings (n_readings,), SI units, such as replicated ones."""
        return self.view(readings=np.asarray(readings, dtype=float))

    def read_earlier(self, seconds: float) -> "TrialProblem":
        """The same problem with readings that were taken so much earlier than the record says.

        Those from before the start or after the end of the trial are left out; InputError if that is all of a channel.
        """
        record, duration = self.record.earlier(seconds), self.manoeuvre.duration
        inside = [(channel.times >= 0.0) & (channel.times <= duration) for channel in record.channels]
        for channel, kept in zip(record.channels, inside, strict=True):
            if not kept.any():
                text = f"no reading of '{channel.name}' is of the trial if it was taken {seconds:g} s earlier"
                raise InputError(text, "data", channel.name)
        return of_readings(self, record, inside)

    @property
    def costs(self) -> Costs:
        """Counts of what this problem and its views have computed."""
        return self.forward.costs

    def each_trial(self, parameters: np.ndarray) -> "Iterator[tuple[str, TrialProblem, np.ndarray]]":
        """The problem itself with its parameters; the only trial needs no name."""
        yield "", self, parameters

    @property
    def histories(self) -> tuple[History, ...]:
        """The forces with unknown histories of this trial, if there are any."""
        disturbances = self.forward.disturbances
        if disturbances is None or self.fixed_nuisances is not None:
            return ()
        white = np.flatnonzero([of_history(name) for name in self.names])
        process = np.flatnonzero([of_process(name) for name in self.names])
        return (History(slice(0, self.n_rows), white, process, self, np.arange(self.n_params)),)

    def _both(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Predictions (n_batch, n_readings) and nuisance values (n_batch, n_nuisances), of which the likelihood is."""
        parameters = np.atleast_2d(parameters)
        return self.predicted(parameters) if predicted is None else predicted, self.nuisance_values(parameters)

    def residuals(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> np.ndarray:
        """(n_batch, n_rows) standardised residuals, ``(predicted - reading) / sd`` where the noise is normal.

        Otherwise scores over the root of the information (:class:`bayesub.problem.noise.Noise`), so that with
        :meth:`jacobian` they make the gradient of minus the log likelihood. There is a row for each reading, and after
        those one for each parameter of the noise. Nothing is simulated if it is known what is predicted.
        """
        return self.likelihood.residuals(*self._both(parameters, predicted))

    def misfit_about(
        self, centre: np.ndarray, parameters: np.ndarray, predicted: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """(n_batch, n_rows) residuals with the noise as it is at `centre` (n_params,), and log likelihoods (n_batch,).

        In the logarithms of the parameters of the noise the sum of squared residuals then follows the deviance to
        second order, as an emulator needs it. That of :meth:`residuals` does not: each reading is divided by the sd,
        but what the density loses by a larger sd is in none of them.
        """
        predicted, values = self._both(parameters, predicted)
        centres = self.nuisance_values(np.broadcast_to(centre, np.atleast_2d(parameters).shape))
        log_likelihoods = sum(self.likelihood.log_densities(predicted, values).values(), np.zeros(()))
        return self.likelihood.residuals(predicted, values, centres), log_likelihoods

    def misfit(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,), infinite where the simulation failed.

        A deviance is the sum of :meth:`bayesub.problem.noise.Noise.deviance`, squared residuals if noise is known.
        """
        predicted, values = self._both(parameters, predicted)
        residuals = self.likelihood.residuals(predicted, values)
        return residuals, self.likelihood.deviances(residuals, predicted, values)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals at one parameter vector (n_params,).

        They are those of the discretised motion, to round-off; not a number where the simulation failed.
        """
        parameters = self.vector(parameters)
        if not self.histories:
            return self.jacobian_of_others(parameters)
        from bayesub.kernels.kalman import respond  # loads the compiler

        (history,) = self.histories
        jacobian = np.zeros((self.n_rows, self.n_params))
        response = history.response(parameters)
        jacobian[:, self.others] = self.jacobian_of_others(parameters, [response])
        factors = history.disturbances.factor(parameters[None, history.process])
        n_axes, n_knots, _ = factors.shape
        forces = np.zeros((n_axes, n_knots, n_axes, n_knots))
        for a, factor in enumerate(factors):
            forces[a, :, a] = factor.T
        by_white = respond(response, forces.reshape(-1, n_axes, n_knots))
        jacobian[:, history.columns] = by_white.T
        return jacobian

    def jacobian_of_others(self, parameters: np.ndarray, responses: Sequence[Any] | None = None) -> np.ndarray:
        """(n_rows, n_others) :meth:`jacobian` without columns of white coordinates of forces.

        `responses` are those of the histories at these parameters, if they are known already.
        """
        self.costs.jacobians += 1
        sets, values = self.arguments(parameters)
        predicted = self.weighing(sets, values)
        slopes = self.forward.slopes(sets, values, self.names[: self.n_coefficients], of_nuisances=bool(self.inferred))
        if self.fixed_nuisances is not None and self.inferred:
            kept = np.searchsorted(self.forward.others, self.inferred)
            slopes = slopes[:, np.append(np.arange(self.n_coefficients), self.n_coefficients + kept)]
        jacobian = self.likelihood.weighed(predicted, values, slopes)
        if self.n_rows > len(self.readings):
            by_noise = self.likelihood.scale_slopes(predicted, values)
            jacobian[len(self.readings) :, self.n_coefficients :] = by_noise[:, self.forward.others]
        if not self.histories:
            return jacobian
        (history,) = self.histories
        if not len(history.process):
            return jacobian
        from bayesub.kernels.kalman import respond  # loads the compiler

        own = parameters[np.concatenate([history.process, history.columns])][None]
        (response,) = [history.response(parameters)] if responses is None else responses
        by_process = respond(response, history.disturbances.slopes(own)).T
        return np.insert(jacobian, [history.process[0]] * len(history.process), by_process, axis=1)

    def weighed(self, parameters: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """(n_rows, k) derivatives of the residuals at parameters (n_params,), of those of the readings (n_readings, k).

        They are zero in the rows of parameters of the noise.
        """
        sets, values = self.arguments(parameters)
        return self.likelihood.weighed(self.weighing(sets, values), values, slopes)

    def weighing(self, sets: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(1, n_readings) predictions by which derivatives are weighed."""
        # Known normal noise weighs the same wherever the prediction is, and needs no simulation for it.
        return self.readings[None] if self.likelihood.weighs_alike else self.forward.predicted(sets, values)[0]

    def log_likelihoods(self, parameters: np.ndarray, predicted: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        return self.likelihood.log_densities(*self._both(parameters, predicted))

    def quantile_residuals(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Channel -> (n_batch, n) quantile residuals of those channels whose noise has a density.

        They are not a number where the simulation failed.
        """
        return self.likelihood.quantile_residuals(*self._both(parameters), rng)

    def replicated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member of parameters (n_batch, n_params) could have made.

        They are not a number where the simulation failed. An sd that is integrated out is taken as it was guessed.
        """
        return self.likelihood.replicated(*self._both(parameters), rng)
