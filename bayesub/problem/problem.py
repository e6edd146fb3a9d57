"""The inference problem: everything that baselines, samplers and identifiability see of a vehicle and its record."""

import copy
from dataclasses import replace

import numpy as np

from bayesub.io import log_files
from bayesub.io.errors import InputError, nearest
from bayesub.model import coefficients
from bayesub.model.simulate import STATUS, Simulator, Trajectory
from bayesub.problem import likelihoods
from bayesub.problem.base import PosteriorDensity
from bayesub.problem.nuisance import CURRENTS, Nuisances, find
from bayesub.problem.priors import Joint, Prior, Spread
from bayesub.sensors.current import over_ground
from bayesub.sensors.measurement import MeasurementModel


class Problem(PosteriorDensity):
    """Free coefficients of a vehicle and nuisance parameters, to be inferred from a record of a manoeuvre.

    Parameters
    ----------
    vehicle, manoeuvre, record
    free : names of the coefficients to infer; one whose prior centre is zero has no scale and stays fixed, and so does
        one that has no part in the sub-problem or belongs to planes that do not move
    prior : of the coefficients, from :mod:`bayesub.problem.priors`
    nuisance : name (:mod:`bayesub.problem.nuisance`) -> prior of one parameter, in the unit of its name
    noise : channel name -> noise model of :mod:`bayesub.problem.likelihoods`, for channels that differ from what their
        sd and resolution say: normal noise, rounded normal noise with the exact probability of the rounding interval,
        or without an sd the interval itself, within which the prior is all there is to say
    xi : (101,) values of the coefficients that are not free; by default the vehicle's own
    dt : integration step, s; by default chosen for the vehicle and manoeuvre

    Attributes
    ----------
    names : the n_params free coefficients and after them the nuisance parameters
    n_coefficients : how many of them are coefficients, and columns : the positions of those in xi
    prior : with mean and sd (n_params,), and spread : that of the coefficients as given
    readings, sds : (n_readings,) the measured values and their sd with rounding, SI units
    noises : the noise model of each channel
    evaluations, jacobians : simulations and Jacobians so far, and failures : simulations so far by status
    """

    def __init__(self, vehicle, manoeuvre, record, *, free, prior: Spread, nuisance=None, noise=None, xi=None, dt=None):
        self.vehicle, self.manoeuvre, self.record = vehicle, manoeuvre, record
        self.xi = np.array(vehicle.xi if xi is None else xi, dtype=float)
        nuisance = nuisance or {}
        candidates = coefficients.columns(free)
        # Of any vehicle: a coefficient that is zero for this one may have a prior with another centre.
        active = coefficients.columns(coefficients.active_coefficients(None, manoeuvre, manoeuvre.subproblem))
        self.columns = candidates[prior.has_scale(candidates, self.xi) & np.isin(candidates, active)]
        if not self.columns.size:
            raise InputError(
                "no coefficient is free: every one named has a prior centre of zero or no effect on this manoeuvre"
            )
        self.n_coefficients, self.spread = len(self.columns), prior
        self.noises = _noises(record.channels, noise or {})
        found = [find(name, vehicle, manoeuvre, record.channels, self.noises) for name in nuisance]
        self.names = (*(coefficients.NAMES[k] for k in self.columns), *nuisance)
        self.prior = _joint(prior.on(self.columns, self.xi), nuisance)

        current = any(name in CURRENTS for name in nuisance)
        self._readings = MeasurementModel(record.channels, current=current)
        self.simulator = Simulator(vehicle, manoeuvre, self._readings.times, dt=dt)
        self._nuisances = Nuisances(tuple(found), self.simulator.vehicle, manoeuvre)
        self._held = None  # (n_nuisances,) where nuisance parameters are not inferred
        self.readings, self.sds = record.values, record.total_sds
        self.evaluations = self.jacobians = 0
        self.failures = dict.fromkeys(STATUS[1:], 0)

    def each_trial(self, parameters):
        """This problem is its only trial, which needs no name."""
        yield "", self, parameters

    def _nuisance_values(self, parameters) -> np.ndarray:
        """(n_batch, n_nuisances) of parameters (n_batch, n_params)."""
        if self._held is None:
            return parameters[:, self.n_coefficients :]
        return np.repeat(self._held[None], len(parameters), axis=0)

    def _fly(self, parameters, outputs):
        """Outputs (n_batch, n_times, n_outputs) in the water and status codes of parameters (n_batch, n_params)."""
        values = self._nuisance_values(parameters)
        return self.simulator.run(
            self.coefficient_sets(parameters),
            body=self._nuisances.body(values),
            initial=self._nuisances.initial(values),
            outputs=outputs,
        )

    def predicted(self, parameters) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, SI units; not a number where the simulation failed.

        Headings of a log, which are known up to whole turns, are on the turn that is nearest to the reading.
        """
        parameters = np.atleast_2d(parameters)
        measured, status = self._fly(parameters, self._readings.measured)
        self.evaluations += len(measured)
        for code, word in enumerate(STATUS[1:], start=1):
            self.failures[word] += int(np.count_nonzero(status == code))
        values = self._nuisance_values(parameters)
        predicted = self._readings.of(measured, self._nuisances.currents(values))
        for channel, k, factor in self._nuisances.biases(self.record.channels):
            predicted[:, self._readings.slices[channel]] += factor * values[:, k : k + 1]
        predicted[status != 0] = np.nan
        self._readings.to_nearest_turn(predicted, self.readings)
        return predicted

    @property
    def rows(self) -> dict[str, slice]:
        """Where the readings of each channel stand among the residuals."""
        return {c.name: part for c, part in zip(self.record.channels, self._readings.slices, strict=True)}

    def residuals(self, parameters) -> np.ndarray:
        """(n_batch, n_rows) standardised residuals, ``(predicted - reading) / sd`` where the noise is normal.

        Otherwise scores over the root of the information (:mod:`bayesub.problem.likelihoods`), so that with
        :meth:`jacobian` they make the gradient of minus the log likelihood. There is a row for
        each reading, and after those one for each parameter of the noise.
        """
        parameters = np.atleast_2d(parameters)
        return self._residuals(parameters, self.predicted(parameters), parameters)

    def residuals_about(self, centre, parameters) -> np.ndarray:
        """(n_batch, n_rows) residuals with the noise as it is at `centre` (n_params,), for emulation.

        In the logarithms of the parameters of the noise the sum of their squares then follows the deviance to second
        order. That of :meth:`residuals` does not: each reading is divided by the sd, but what the density loses by a
        larger sd is in none of them.
        """
        parameters = np.atleast_2d(parameters)
        centres = np.broadcast_to(centre, parameters.shape)
        return self._residuals(parameters, self.predicted(parameters), centres)

    def misfit(self, parameters) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_rows) and deviances (n_batch,), infinite where the simulation failed.

        A deviance is minus twice the log likelihood less that of predictions that equal the readings under the noise as
        given: the sum of squared residuals where the noise is normal and known. If that has no bound, as with an
        unknown sd, nothing is taken off.
        """
        parameters = np.atleast_2d(parameters)
        predicted = self.predicted(parameters)
        residuals, deviances = self._residuals(parameters, predicted, parameters), np.zeros(len(predicted))
        for noise, times, part, unknown in self._parts(parameters):
            if isinstance(noise, likelihoods.Normal | likelihoods.AR1) and not unknown:
                deviances += np.einsum("ij,ij->i", residuals[:, part], residuals[:, part])
            else:
                readings = self.readings[part]
                most = np.nan_to_num(noise.log_density(readings[None], readings, times), posinf=0.0)
                deviances += 2.0 * (most - noise.log_density(predicted[:, part], readings, times, **unknown))
        return residuals, np.where(np.isnan(deviances), np.inf, deviances)

    def jacobian(self, parameters) -> np.ndarray:
        """(n_rows, n_params) derivatives of the residuals at one parameter vector (n_params,).

        They are those of the discretised motion, to round-off; not a number where the simulation failed.
        """
        self.jacobians += 1
        parameters = np.atleast_2d(parameters)
        # Known normal noise weighs the same wherever the prediction is, and needs no simulation for it.
        known = all(isinstance(noise, likelihoods.Normal | likelihoods.AR1) for noise in self.noises)
        known = known and not any(unknown for *_, unknown in self._parts(parameters))
        predicted = self.readings[None] if known else self.predicted(parameters)
        slopes = self._slopes(parameters)
        weighed, rows = [], []
        for channel, (noise, times, part, unknown) in zip(self.record.channels, self._parts(parameters), strict=True):
            readings = self.readings[part]
            numbers = {attribute: values[0] for attribute, values in unknown.items()}
            weighed.append(noise.weigh(slopes[part], predicted[0, part], readings, times, **numbers))
            if unknown:
                _, (by_logarithms,) = likelihoods.scale_rows(noise, predicted[:, part], readings, times, unknown)
                places = [self.n_coefficients + k for _, k, _ in self._nuisances.of_noise(channel)]
                rows.append(np.zeros((len(places), self.n_params)))
                rows[-1][:, places] = by_logarithms / parameters[0, places]
        return np.concatenate(weighed + rows)

    def _slopes(self, parameters) -> np.ndarray:
        """(n_readings, n_params) derivatives of the predicted readings of one member (1, n_params), SI units."""
        values = self._nuisance_values(parameters)
        first = lambda rows: None if rows is None else rows[0]  # noqa: E731
        body, initial = first(self._nuisances.body(values)), first(self._nuisances.initial(values))
        current = first(self._nuisances.currents(values))
        moved, effects = ((), None) if self._held is not None else self._nuisances.on_motion()
        names = (*self.names[: self.n_coefficients], *moved)
        moving = current is not None or self._readings.displaced
        measured = self._fly(parameters, self._readings.measured)[0][0] if moving else None
        (xi,) = self.coefficient_sets(parameters)
        sensitivities = self.simulator.sensitivities(xi, names, self._readings.measured, body=body, initial=initial)
        slopes = self._readings.slopes(sensitivities, measured, current)
        if self._held is not None or not len(self._nuisances):
            return slopes
        own = np.zeros((len(slopes), len(self._nuisances)))
        if moved:
            own += slopes[:, self.n_coefficients :] @ effects
        for k, towards in self._nuisances.current_columns():
            own[:, k] += self._readings.current_slopes(measured)[:, towards]
        for channel, k, factor in self._nuisances.biases(self.record.channels):
            own[self._readings.slices[channel], k] += factor
        return np.hstack([slopes[:, : self.n_coefficients], own])

    def _parts(self, parameters):
        """Noise model, times, slice and unknown attributes (n_batch,) of the noise of each channel."""
        values = self._nuisance_values(parameters)
        for channel, noise, part in zip(self.record.channels, self.noises, self._readings.slices, strict=True):
            of_noise = self._nuisances.of_noise(channel) if self._held is None else ()
            unknown = {attribute: factor * values[:, k] for attribute, k, factor in of_noise}
            yield noise, channel.times, part, unknown

    def _residuals(self, parameters, predicted, centres):
        """Residuals with the noise as at `centres`, and how far its parameters are from there."""
        parts, rows = [], []
        for (noise, times, part, there), (*_, here) in zip(self._parts(centres), self._parts(parameters), strict=True):
            arguments = predicted[:, part], self.readings[part], times
            parts.append(noise.residuals(*arguments, **there))
            if there:
                row, by_logarithms = likelihoods.scale_rows(noise, *arguments, there)
                off = np.log(np.stack([here[key] / there[key] for key in there], axis=1))
                rows.append(row + np.einsum("nij,nj->ni", by_logarithms, off))
        return np.concatenate(parts + rows, axis=1)

    def naive(self) -> "Problem":
        """The same problem for methods that know neither rounding nor nuisance parameters.

        Noise is normal with the total sd on every channel, and nuisance parameters are held at their prior means.
        """
        other = copy.copy(self)
        other.noises = tuple(likelihoods.Normal(channel.total_sd) for channel in self.record.channels)
        other.failures = dict.fromkeys(self.failures, 0)
        if len(self._nuisances):
            other.names = self.names[: self.n_coefficients]
            other._held = self._nuisance_values(self.prior.mean[None])[0]
            other.prior = self.prior.parts[0]
        return other

    def smoothed(self, share: float) -> "Problem":
        """The same problem for searches: channels without noise get some, with `share` of their resolution as sd."""
        if not any(isinstance(noise, likelihoods.SetMembership) for noise in self.noises):
            return self
        other = copy.copy(self)
        other.noises = tuple(
            likelihoods.Rounded(share * noise.resolution, noise.resolution)
            if isinstance(noise, likelihoods.SetMembership)
            else noise
            for noise in self.noises
        )
        return other

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) the truth behind a synthetic record, otherwise the values of the vehicle and the manoeuvre.

        Of parameters of the noise that nobody knows it is the value given with the noise model.
        """
        xi = self.vehicle.xi if self.record.truth is None else self.record.truth
        own = zip(self.names[self.n_coefficients :], self._nuisances.held, strict=False)
        return np.concatenate([xi[self.columns], [self.record.nuisances.get(name, value) for name, value in own]])

    def trajectory(self, parameters) -> Trajectory:
        """Simulated motion at the times of the readings, for parameters (n_params,) or (n_batch, n_params).

        It is through the water, of the vehicle from the start of the manoeuvre, without nuisance parameters.
        """
        return self.simulator.trajectory(self.coefficient_sets(parameters))

    def motion(self, parameters) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings, nuisance parameters included."""
        parameters = np.atleast_2d(parameters)
        states, _ = self._fly(parameters, log_files.STATES)
        currents = self._nuisances.currents(self._nuisance_values(parameters))
        if currents is None:
            return states
        pairs = zip(states, currents, strict=True)
        return np.stack([over_ground(member, self.simulator.times, current) for member, current in pairs])

    def log_likelihoods(self, parameters) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        parameters = np.atleast_2d(parameters)
        predicted = self.predicted(parameters)
        return {
            channel.name: noise.log_density(predicted[:, part], self.readings[part], times, **unknown)
            for channel, (noise, times, part, unknown) in zip(
                self.record.channels, self._parts(parameters), strict=True
            )
        }

    @property
    def channels(self) -> dict:
        """Channel name -> channel and its noise model."""
        pairs = zip(self.record.channels, self.noises, strict=True)
        return {channel.name: (channel, noise) for channel, noise in pairs}

    def quantile_residuals(self, parameters, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """(n_batch, n) quantile residuals (:mod:`bayesub.problem.likelihoods`) of each channel that has noise.

        They are not a number where the simulation failed.
        """
        parameters = np.atleast_2d(parameters)
        predicted = self.predicted(parameters)
        return {
            channel.name: noise.quantile_residuals(predicted[:, part], self.readings[part], times, rng, **unknown)
            for channel, (noise, times, part, unknown) in zip(
                self.record.channels, self._parts(parameters), strict=True
            )
            if not isinstance(noise, likelihoods.SetMembership)
        }

    def replicated(self, parameters, rng: np.random.Generator) -> np.ndarray:
        """(n_batch, n_readings) readings that each member of parameters (n_batch, n_params) could have made.

        They are not a number where the simulation failed. An sd that is integrated out is taken as it was guessed.
        """
        parameters = np.atleast_2d(parameters)
        readings = self.predicted(parameters)
        for noise, times, part, unknown in self._parts(parameters):
            for k, truth in enumerate(readings[:, part]):
                own = replace(noise, **{attribute: float(values[k]) for attribute, values in unknown.items()})
                readings[k, part] = own.sample(truth, times, rng)
        return readings


def _joint(prior: Prior, nuisance: dict[str, Prior]) -> Prior:
    """The prior of coefficients followed by nuisance parameters."""
    if not nuisance:
        return prior
    n = len(prior.mean)
    positions = (np.arange(n), *(np.array([n + k]) for k in range(len(nuisance))))
    return Joint((prior, *nuisance.values()), positions)


def _noises(channels, given):
    """The noise model of each channel: the one given by name, or what its sd and resolution say."""
    names = [channel.name for channel in channels]
    for name in given:
        if name not in names:
            raise InputError(f"noise: there is no channel '{name}'{nearest(name, names)}")
    return tuple(
        given.get(channel.name) or likelihoods.reading_noise(channel.sd, channel.resolution) for channel in channels
    )
