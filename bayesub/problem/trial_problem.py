"""The posterior density of one trial: a forward model, noise models and priors."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from bayesub.io.errors import InputError
from bayesub.model.equations import EquationSet
from bayesub.model.linear_form import LinearSystem, linear_systems
from bayesub.model.trajectory import Trajectory
from bayesub.problem.base import Costs, PosteriorDensity
from bayesub.problem.distributions import Prior, joined
from bayesub.problem.disturbances import History, of_history, of_process
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.likelihoods import Normal
from bayesub.problem.noise import Noise, scale_rows
from bayesub.problem.priors import CoefficientPrior


class TrialProblem(PosteriorDensity):
    """The posterior density of one trial; :class:`bayesub.problem.problem.Problem` poses it, views change its parts.

    Parameters
    ----------
    forward : the forward model, whose costs all views share
    columns : (n_coefficients,) positions of the free coefficients in a set
    xi : (n_terms,) values of the coefficients that are not free
    spread : rule that gives the free coefficients their prior
    nuisance_priors : nuisance parameter -> prior of it alone, of those of the forward model that are inferred
    noises : the noise model of each channel
    fixed_nuisances : (n_nuisances,) values of the nuisance parameters, if not all of them are inferred; noise is known
        then
    readings : (n_readings,) by default those of the record
    widening : how many times as large as inferred the sd of a channel is taken where it is inferred (:meth:`widened`)

    Attributes
    ----------
    vehicle, manoeuvre, record : of the trial
    simulator : flies it, with output at the times of the readings
    readings : (n_readings,) measured values, SI units
    sds : (n_readings,) their standard deviations with rounding, SI units
    noises : the noise model of each channel
    """

    def __init__(
        self,
        forward: ForwardModel,
        columns: np.ndarray,
        xi: np.ndarray,
        spread: CoefficientPrior,
        nuisance_priors: dict[str, Prior],
        noises: tuple[Noise, ...],
        *,
        fixed_nuisances: np.ndarray | None = None,
        readings: np.ndarray | None = None,
        widening: float = 1.0,
    ):
        self.forward, self.columns, self.xi = forward, columns, xi
        self.vehicle, self.manoeuvre, self.record = forward.vehicle, forward.manoeuvre, forward.record
        self.simulator, self.equations = forward.simulator, forward.vehicle.equations
        self.n_coefficients = len(columns)
        self.spread, self.coefficient_prior = spread, spread.on(columns, xi, self.equations)
        self.nuisance_priors, self.noises, self._widening = nuisance_priors, noises, widening
        self.fixed_nuisances = fixed_nuisances
        self._inferred = [forward.nuisances.names.index(name) for name in nuisance_priors]
        self.names = (*coefficient_names(self.equations, columns), *nuisance_priors)
        self.prior = joined(self.coefficient_prior, nuisance_priors)
        self.readings = forward.record.values if readings is None else readings
        self.sds = forward.record.total_sds

    def _view(self, **changes) -> "TrialProblem":
        """The same problem but for some arguments of the constructor."""
        parts = {
            "nuisance_priors": self.nuisance_priors,
            "noises": self.noises,
            "fixed_nuisances": self.fixed_nuisances,
            "readings": self.readings,
            "widening": self._widening,
        }
        return TrialProblem(self.forward, self.columns, self.xi, self.spread, **parts | changes)

    @property
    def costs(self) -> Costs:
        """What this problem and its views have computed so far."""
        return self.forward.costs

    def each_trial(self, parameters: np.ndarray):
        """As :meth:`bayesub.problem.base.PosteriorDensity.each_trial`; the only trial needs no name."""
        yield "", self, parameters

    def _nuisance_values(self, parameters) -> np.ndarray:
        """(n_batch, n_nuisances) of parameters (n_batch, n_params)."""
        if self.fixed_nuisances is None:
            return parameters[:, self.n_coefficients :]
        values = np.repeat(self.fixed_nuisances[None], len(parameters), axis=0)
        values[:, self._inferred] = parameters[:, self.n_coefficients :]
        return values

    def arguments(self, parameters) -> tuple[np.ndarray, np.ndarray]:
        """Coefficient sets and nuisance values of parameters (n_batch, n_params), as the forward model takes them."""
        return self.coefficient_sets(parameters), self._nuisance_values(parameters)

    def predicted(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, SI units; not a number where the simulation failed.

        Headings of a log, which are known up to whole turns, are on the turn that is nearest to the reading.
        """
        predicted, status = self.forward.predicted(*self.arguments(np.atleast_2d(parameters)))
        self.forward.count(status)
        self.forward.measurement.to_nearest_turn(predicted, self.readings)
        return predicted

    @property
    def histories(self) -> tuple[History, ...]:
        """The forces with unknown histories of this trial, if there are any."""
        disturbances = self.forward.disturbances
        if disturbances is None or self.fixed_nuisances is not None:
            return ()
        white = np.flatnonzero([of_history(name) for name in self.names])
        process = np.flatnonzero([of_process(name) for name in self.names])
        return (History(slice(0, self.n_rows), white, process, disturbances),)

    @property
    def rows(self) -> dict[str, slice]:
        """Where the readings of each channel stand among the residuals."""
        slices = self.forward.measurement.slices
        return {channel.name: part for channel, part in zip(self.record.channels, slices, strict=True)}

    @property
    def times(self) -> np.ndarray:
        """(n_readings,) when the readings were taken, s."""
        return np.concatenate([channel.times for channel in self.record.channels])

    @property
    def n_rows(self) -> int:
        """Number of residuals: one a reading, and one for each parameter of the noise that is inferred."""
        if self.fixed_nuisances is not None:
            return len(self.readings)
        return len(self.readings) + sum(len(self.forward.nuisances.of_noise(c)) for c in self.record.channels)

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows) standardised residuals, ``(predicted - reading) / sd`` where the noise is normal.

        Otherwise scores over the root of the information (:class:`bayesub.problem.noise.Noise`), so that with
        :meth:`jacobian` they make the gradient of minus the log likelihood. There is a row for
        each reading, and after those one for each parameter of the noise.
        """
        parameters = np.atleast_2d(parameters)
        return self._residuals(parameters, self.predicted(parameters), parameters)

    def residuals_of(self, parameters: np.ndarray, predicted: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows) residuals of predictions (n_batch, n_readings), with the noise as at the parameters."""
        return self._residuals(parameters, predicted, parameters)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n_batch, n_rows) residuals with the noise as it is at `centre` (n_params,), and log likelihoods (n_batch,).

        In the logarithms of the parameters of the noise the sum of squared residuals then follows the deviance to
        second order, as an emulator needs it. That of :meth:`residuals` does not: each reading is divided by the sd,
        but what the density loses by a larger sd is in none of them.
        """
        parameters = np.atleast_2d(parameters)
        centres, predicted = np.broadcast_to(centre, parameters.shape), self.predicted(parameters)
        log_likelihoods = sum(self._log_likelihoods(parameters, predicted).values())
        return self._residuals(parameters, predicted, centres), log_likelihoods

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,), infinite where the simulation failed.

        A deviance is the sum over the channels of :meth:`bayesub.problem.noise.Noise.deviance`: the sum of squared
        residuals where the noise is normal and known.
        """
        parameters = np.atleast_2d(parameters)
        predicted = self.predicted(parameters)
        residuals, deviances = self._residuals(parameters, predicted, parameters), np.zeros(len(predicted))
        for noise, times, part, unknown in self._channels(parameters):
            members = noise.of_members(**unknown)
            deviances += noise.deviance(residuals[:, part], predicted[:, part], self.readings[part], times, members)
        return residuals, np.where(np.isnan(deviances), np.inf, deviances)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals at one parameter vector (n_params,).

        They are those of the discretised motion, to round-off; not a number where the simulation failed.
        """
        self.costs.jacobians += 1
        parameters = np.atleast_2d(parameters)
        arguments = self.arguments(parameters)
        names = self.names[: self.n_coefficients]
        predicted = self._weighing(parameters)
        slopes = self.forward.slopes(*arguments, names, of_nuisances=bool(self._inferred))
        if self.fixed_nuisances is not None:
            of_inferred = self.n_coefficients + np.array(self._inferred, dtype=int)
            slopes = slopes[:, np.append(np.arange(self.n_coefficients), of_inferred)]
        jacobian = self._weighed(parameters, predicted, slopes)
        row = len(self.readings)
        for channel, (noise, times, part, unknown) in zip(
            self.record.channels, self._channels(parameters), strict=True
        ):
            if unknown:
                _, (by_logarithms,) = scale_rows(noise, predicted[:, part], self.readings[part], times, unknown)
                places = [self.n_coefficients + k for _, k, _ in self.forward.nuisances.of_noise(channel)]
                jacobian[row : row + len(places), places] = by_logarithms / parameters[0, places]
                row += len(places)
        return jacobian

    def weighed(self, parameters: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """(n_rows, k) derivatives of the residuals at parameters (n_params,), of those of the readings (n_readings, k).

        They are zero in the rows of parameters of the noise.
        """
        parameters = np.atleast_2d(parameters)
        return self._weighed(parameters, self._weighing(parameters), slopes)

    def _weighing(self, parameters):
        """(1, n_readings) predictions by which derivatives are weighed."""
        # Known normal noise weighs the same wherever the prediction is, and needs no simulation for it.
        known = all(noise.is_normal and not unknown for noise, *_, unknown in self._channels(parameters))
        return self.readings[None] if known else self.forward.predicted(*self.arguments(parameters))[0]

    def _weighed(self, parameters, predicted, slopes):
        rows = np.zeros((self.n_rows, slopes.shape[1]))
        for noise, times, part, unknown in self._channels(parameters):
            member = noise.of_members(**{attribute: values[0] for attribute, values in unknown.items()})
            rows[part] = member.weigh(slopes[part], predicted[0, part], self.readings[part], times)
        return rows

    def _channels(self, parameters):
        """Noise model, times, slice and unknown attributes (n_batch,) of the noise of each channel."""
        values, slices = self._nuisance_values(parameters), self.forward.measurement.slices
        for channel, noise, part in zip(self.record.channels, self.noises, slices, strict=True):
            inferred = self.forward.nuisances.of_noise(channel) if self.fixed_nuisances is None else ()
            unknown = {
                attribute: factor * values[:, k] * (self._widening if attribute == "sd" else 1.0)
                for attribute, k, factor in inferred
            }
            yield noise, channel.times, part, unknown

    def _residuals(self, parameters, predicted, centres):
        """Residuals with the noise as at `centres`, and how far its parameters are from there."""
        parts, rows = [], []
        pairs = zip(self._channels(centres), self._channels(parameters), strict=True)
        for (noise, times, part, at_centre), (*_, unknown) in pairs:
            arguments = predicted[:, part], self.readings[part], times
            parts.append(noise.of_members(**at_centre).residuals(*arguments))
            if at_centre:
                row, by_logarithms = scale_rows(noise, *arguments, at_centre)
                offset = np.log(np.stack([unknown[key] / at_centre[key] for key in at_centre], axis=1))
                rows.append(row + np.einsum("nij,nj->ni", by_logarithms, offset))
        return np.concatenate(parts + rows, axis=1)

    def naive(self) -> "TrialProblem":
        """The same problem for methods that know neither rounding nor nuisance parameters.

        Noise is normal with the total sd on every channel, and nuisance parameters are held at their prior means.
        """
        return self._plain({})

    def searchable(self) -> "TrialProblem":
        """The same problem for searches that know no other noise than normal, and no histories of forces.

        As :meth:`naive`, but the nuisance parameters that move the readings remain: all but those of the noise and of a
        disturbance.
        """
        still = {p.name for p in self.forward.nuisances.parameters if p.channel and p.attribute != "bias"}
        priors = self.nuisance_priors.items()
        return self._plain({n: prior for n, prior in priors if not (n in still or of_history(n) or of_process(n))})

    def _plain(self, nuisance_priors) -> "TrialProblem":
        noises = tuple(Normal(channel.total_sd) for channel in self.record.channels)
        values = self._nuisance_values(self.prior.mean[None])[0]
        return self._view(noises=noises, nuisance_priors=nuisance_priors, fixed_nuisances=values)

    def with_noises(self, noises: dict[str, Noise]) -> "TrialProblem":
        """The same problem with other noise models of some channels, by name."""
        names = [channel.name for channel in self.record.channels]
        pairs = zip(names, self.noises, strict=True)
        return self._view(noises=tuple(noises.get(name, noise) for name, noise in pairs))

    def smoothed(self, share: float) -> "TrialProblem":
        """The same problem for searches: channels without noise get some, with `share` of their resolution as sd."""
        if all(noise.has_density for noise in self.noises):
            return self
        return self._view(noises=tuple(noise.smoothed(share) for noise in self.noises))

    @property
    def heavy_tailed(self) -> bool:
        """Whether any noise is (:class:`bayesub.problem.noise.Noise`)."""
        return any(noise.heavy_tailed for noise in self.noises)

    def widened(self, scale: float) -> "TrialProblem":
        """The same problem with noise that is `scale` times as large, for searches from afar."""
        noises = tuple(noise.widened(scale) for noise in self.noises)
        return self._view(noises=noises, widening=scale * self._widening)

    def with_wide_process(self) -> "TrialProblem":
        """The same problem with a known and wide process of the disturbance, if it has one that is not known."""
        if not self.histories or not self.forward.disturbances.processes:
            return self
        forward = self.forward.with_wide_process()
        priors = {name: prior for name, prior in self.nuisance_priors.items() if not of_process(name)}
        return TrialProblem(forward, self.columns, self.xi, self.spread, priors, self.noises, readings=self.readings)

    @property
    def duration(self) -> float:
        """Time of the last reading, s."""
        return max(float(channel.times[-1]) for channel in self.record.channels)

    def within(self, duration: float) -> "TrialProblem":
        """The same problem with the readings of the first `duration` seconds, for searches that lengthen the record.

        A channel without readings by then keeps its first. Nothing later is simulated.
        """
        counts = [max(1, int(np.searchsorted(c.times, duration, side="right"))) for c in self.record.channels]
        if all(n == len(channel.times) for n, channel in zip(counts, self.record.channels, strict=True)):
            return self
        return self._of_readings(self.record, [slice(n) for n in counts])

    def read_earlier(self, seconds: float) -> "TrialProblem":
        """The same problem with readings that were taken so much earlier than the record says.

        Those that would be from before the start or after the end of the trial are left out; InputError if that leaves
        nothing of a channel.
        """
        record, duration = self.record.earlier(seconds), self.manoeuvre.duration
        inside = [(channel.times >= 0.0) & (channel.times <= duration) for channel in record.channels]
        for channel, kept in zip(record.channels, inside, strict=True):
            if not kept.any():
                raise InputError(
                    f"no reading of '{channel.name}' is of the trial if it was taken {seconds:g} s earlier",
                    "data",
                    channel.name,
                )
        return self._of_readings(record, inside)

    def _of_readings(self, record, chosen) -> "TrialProblem":
        """The same problem with some readings of the channels of a record with these channels."""
        parts = zip(self.forward.measurement.slices, chosen, strict=True)
        readings = np.concatenate([self.readings[part][kept] for part, kept in parts])
        forward = self.forward.with_record(record.of_readings(chosen))
        options = {"fixed_nuisances": self.fixed_nuisances, "readings": readings}
        return TrialProblem(forward, self.columns, self.xi, self.spread, self.nuisance_priors, self.noises, **options)

    def with_readings(self, readings: np.ndarray) -> "TrialProblem":
        """The same problem with other readings (n_readings,), SI units, such as replicated ones."""
        return self._view(readings=np.asarray(readings, dtype=float))

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) the truth behind a synthetic record, otherwise the values of the vehicle and the manoeuvre.

        Of parameters of the noise that nobody knows it is the value given with the noise model. Histories of forces
        are those of the truth between the knots, as near as they come to it.
        """
        xi = self.vehicle.xi if self.record.truth is None else self.record.truth
        return np.concatenate([xi[self.columns], self._true_nuisances[self._inferred]])

    @cached_property
    def _true_nuisances(self) -> np.ndarray:
        """(n_nuisances,) of the truth behind a synthetic record, or where they are held."""
        held = zip(self.forward.nuisances.names, self.forward.nuisances.held, strict=True)
        values = np.array([self.record.nuisances.get(name, value) for name, value in held])
        if self.record.forces is not None:
            values = self.forward.with_history(values, self.record.forces)
        return values

    def truth(self) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings (n_readings,) and states over the ground (n_times, 12) behind a synthetic record.

        The boat feels the forces of the truth, on whichever axes the problem infers any.
        """
        xi = self.vehicle.xi if self.record.truth is None else self.record.truth
        readings, states = self.forward.disturbed(xi[None], self._true_nuisances[None], self.record.forces)
        self.forward.measurement.to_nearest_turn(readings[None], self.readings)
        return readings, states

    def trajectory(self, parameters: np.ndarray) -> Trajectory:
        """Simulated motion at the times of the readings, for parameters (n_params,) or (n_batch, n_params).

        It is through the water, of the vehicle from the start of the manoeuvre, without nuisance parameters.
        """
        return self.simulator.trajectory(self.coefficient_sets(parameters))

    def motion(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings, nuisance parameters included."""
        return self.forward.states(*self.arguments(np.atleast_2d(parameters)))

    def forces(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) unmodelled forces at the knots, N and N m, of parameters (n_batch, n_params)."""
        return self.forward.forces(self._nuisance_values(np.atleast_2d(parameters)))

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """As :meth:`bayesub.problem.base.PosteriorDensity.linear_systems`, of the body and start that are inferred."""
        trajectory = self.forward.trajectory(*self.arguments(np.atleast_2d(parameters)))
        return linear_systems(trajectory, free=self.names[: self.n_coefficients])

    def log_likelihoods(self, parameters: np.ndarray) -> dict[str, np.ndarray]:
        """As :meth:`bayesub.problem.base.PosteriorDensity.log_likelihoods`."""
        parameters = np.atleast_2d(parameters)
        return self._log_likelihoods(parameters, self.predicted(parameters))

    def _log_likelihoods(self, parameters, predicted) -> dict[str, np.ndarray]:
        return {
            channel.name: noise.of_members(**unknown).log_density(predicted[:, part], self.readings[part], times)
            for channel, (noise, times, part, unknown) in zip(
                self.record.channels, self._channels(parameters), strict=True
            )
        }

    @property
    def channels(self) -> dict:
        """Channel name -> channel and its noise model."""
        pairs = zip(self.record.channels, self.noises, strict=True)
        return {channel.name: (channel, noise) for channel, noise in pairs}

    def quantile_residuals(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Channel -> (n_batch, n) quantile residuals of those channels whose noise has a density.

        They are not a number where the simulation failed.
        """
        parameters = np.atleast_2d(parameters)
        predicted = self.predicted(parameters)
        return {
            channel.name: noise.of_members(**unknown).quantile_residuals(
                predicted[:, part], self.readings[part], times, rng
            )
            for channel, (noise, times, part, unknown) in zip(
                self.record.channels, self._channels(parameters), strict=True
            )
            if noise.has_density
        }

    def replicated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member of parameters (n_batch, n_params) could have made.

        They are not a number where the simulation failed. An sd that is integrated out is taken as it was guessed.
        """
        parameters = np.atleast_2d(parameters)
        readings = self.predicted(parameters)
        for noise, times, part, unknown in self._channels(parameters):
            for k, truth in enumerate(readings[:, part]):
                member = replace(noise, **{attribute: float(values[k]) for attribute, values in unknown.items()})
                readings[k, part] = member.sample(truth, times, rng)
        return readings


def coefficient_names(equations: EquationSet, columns: np.ndarray) -> tuple[str, ...]:
    """Names of the coefficients at positions `columns` (n,) of a set."""
    return tuple(equations.names[k] for k in columns)
