"""The inference problem: everything that baselines, samplers and identifiability see of a vehicle and its record."""

import copy
from dataclasses import dataclass

import numpy as np

from bayesub import coefficients, likelihoods
from bayesub.errors import InputError
from bayesub.kernels.mass import mass_matrix
from bayesub.kernels.noise import gathered
from bayesub.priors import Spread
from bayesub.simulate import STATUS, Simulator, Trajectory

_REGRESSOR_ROUNDING = 3 * np.finfo(float).eps  # six roundings of half an epsilon: nu, four factors, the dimension
_ROUND_OFF_ONLY = 0.1  # relative error of a column that holds no motion


class Problem:
    """Free coefficients of a vehicle, to be inferred from a record of a manoeuvre.

    Parameters
    ----------
    vehicle, manoeuvre, record
    free : names of the coefficients to infer; one whose prior centre is zero has no scale and stays fixed, and so does
        one that has no part in the sub-problem or belongs to planes that do not move
    prior : from :mod:`bayesub.priors`
    noise : channel name -> noise model of :mod:`bayesub.likelihoods`, for channels that differ from what their sd and
        resolution say: normal noise, or rounded normal noise with the exact probability of the rounding interval
    xi : (101,) values of the coefficients that are not free; by default the vehicle's own
    dt : integration step, s; by default chosen for the vehicle and manoeuvre

    Attributes
    ----------
    names : the n_params free coefficients, and columns : their positions in xi
    prior : with mean and sd (n_params,)
    readings, sds : (n_readings,) the measured values and their sd with rounding, SI units
    noises : the noise model of each channel
    evaluations, jacobians : simulations and Jacobians so far, and failures : simulations so far by status
    """

    def __init__(self, vehicle, manoeuvre, record, *, free, prior: Spread, noise=None, xi=None, dt=None):
        self.vehicle, self.manoeuvre, self.record = vehicle, manoeuvre, record
        self.xi = np.array(vehicle.xi if xi is None else xi, dtype=float)
        centre = self.xi if prior.centre is None else prior.centre
        candidates = coefficients.columns(free)
        moving = [coefficients.NAMES[k] not in _without_effect(vehicle, manoeuvre) for k in candidates]
        self.columns = candidates[(centre[candidates] != 0.0) & moving]
        if not self.columns.size:
            raise InputError(
                "no coefficient is free: every one named has a prior centre of zero or no effect on this manoeuvre"
            )
        self.names = tuple(coefficients.NAMES[k] for k in self.columns)
        self.prior = prior.on(self.columns, self.xi)

        self.noises = _noises(record.channels, noise or {})
        times = np.unique(np.concatenate([channel.times for channel in record.channels]))
        self.simulator = Simulator(vehicle, manoeuvre, times, dt=dt)
        # Where each reading stands in the measured outputs of a simulation laid out in one row.
        self._measured = tuple(dict.fromkeys(channel.state for channel in record.channels))
        self._position = np.concatenate(
            [
                len(self._measured) * np.searchsorted(times, channel.times) + self._measured.index(channel.state)
                for channel in record.channels
            ]
        )
        lengths = [len(channel.times) for channel in record.channels]
        ends = np.cumsum(lengths)
        self._slices = [slice(end - n, end) for n, end in zip(lengths, ends, strict=True)]
        self.readings = np.concatenate([channel.values for channel in record.channels])
        self.sds = np.repeat([channel.total_sd for channel in record.channels], lengths)
        self.evaluations = self.jacobians = 0
        self.failures = dict.fromkeys(STATUS[1:], 0)

    @property
    def n_params(self) -> int:
        return len(self.names)

    def coefficient_sets(self, parameters) -> np.ndarray:
        """(n_batch, 101) coefficient sets with the free columns taken from parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        sets = np.repeat(self.xi[None], len(parameters), axis=0)
        sets[:, self.columns] = parameters
        return sets

    def predicted(self, parameters) -> np.ndarray:
        """(n_batch, n_readings) noise-free readings, SI units; not a number where the simulation failed."""
        states, status = self.simulator.run(self.coefficient_sets(parameters), outputs=self._measured)
        self.evaluations += len(states)
        for code, word in enumerate(STATUS[1:], start=1):
            self.failures[word] += int(np.count_nonzero(status == code))
        predicted = gathered(states.reshape(len(states), -1), self._position)
        predicted[status != 0] = np.nan
        return predicted

    def residuals(self, parameters) -> np.ndarray:
        """(n_batch, n_readings) standardised residuals, ``(predicted - reading) / sd`` where the noise is normal.

        Otherwise scores over the root of the information (:mod:`bayesub.likelihoods`), so that with :meth:`jacobian`
        they make the gradient of minus the log likelihood.
        """
        return self._residuals(self.predicted(parameters))

    def misfit(self, parameters) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n_batch, n_readings) and deviances (n_batch,), infinite where the simulation failed.

        A deviance is minus twice the log likelihood less that of predictions that equal the readings: the sum of
        squared residuals where the noise is normal.
        """
        predicted = self.predicted(parameters)
        residuals, deviances = self._residuals(predicted), np.zeros(len(predicted))
        for noise, times, part in self._parts():
            if isinstance(noise, likelihoods.Gaussian | likelihoods.AR1):
                deviances += np.einsum("ij,ij->i", residuals[:, part], residuals[:, part])
            else:
                readings = self.readings[part]
                most = noise.log_density(readings[None], readings, times)
                deviances += 2.0 * (most - noise.log_density(predicted[:, part], readings, times))
        return residuals, np.where(np.isnan(deviances), np.inf, deviances)

    def jacobian(self, parameters) -> np.ndarray:
        """(n_readings, n_params) derivatives of the residuals at one parameter vector (n_params,).

        They are those of the discretised motion, to round-off; not a number where the simulation failed.
        """
        self.jacobians += 1
        (xi,) = self.coefficient_sets(parameters)
        slopes = self.simulator.sensitivities(xi, self.names, self._measured)
        slopes = slopes.reshape(-1, self.n_params)[self._position]
        # Normal noise weighs the same wherever the prediction is, and needs no simulation for it.
        normal = all(isinstance(noise, likelihoods.Gaussian | likelihoods.AR1) for noise in self.noises)
        predicted = self.readings if normal else self.predicted(parameters)[0]
        weighed = [
            noise.weigh(slopes[part], predicted[part], self.readings[part], times)
            for noise, times, part in self._parts()
        ]
        return np.concatenate(weighed)

    def _parts(self):
        return zip(self.noises, [channel.times for channel in self.record.channels], self._slices, strict=True)

    def _residuals(self, predicted):
        parts = [
            noise.residuals(predicted[:, part], self.readings[part], times) for noise, times, part in self._parts()
        ]
        return np.concatenate(parts, axis=1)

    def naive(self) -> "Problem":
        """The same problem for methods that know nothing of rounding: normal noise of the total sd on every channel."""
        other = copy.copy(self)
        other.noises = tuple(likelihoods.Gaussian(channel.total_sd) for channel in self.record.channels)
        other.failures = dict.fromkeys(self.failures, 0)
        return other

    def trajectory(self, parameters) -> Trajectory:
        """Simulated motion at the times of the readings, for parameters (n_params,) or (n_batch, n_params)."""
        return self.simulator.trajectory(self.coefficient_sets(parameters))

    def log_prior(self, parameters) -> np.ndarray:
        """(n_batch,) log prior densities."""
        return self.prior.log_density(np.atleast_2d(parameters))

    def log_likelihood(self, parameters) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where the simulation failed."""
        return sum(self.log_likelihoods(parameters).values())

    def log_likelihoods(self, parameters) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        predicted = self.predicted(parameters)
        return {
            channel.name: noise.log_density(predicted[:, part], self.readings[part], times)
            for channel, (noise, times, part) in zip(self.record.channels, self._parts(), strict=True)
        }

    def log_prob(self, parameters) -> np.ndarray:
        """(n_batch,) log posterior densities, not normalised."""
        return self.log_prior(parameters) + self.log_likelihood(parameters)


def _without_effect(vehicle, manoeuvre) -> frozenset[str]:
    """Coefficients that have no part in the sub-problem of a manoeuvre, or that belong to planes that do not move."""
    still = {plane for plane, angles in zip(("dr", "db", "ds"), manoeuvre.controls.T, strict=True) if not angles.any()}
    resting = {term.name for term in coefficients.TERMS if term.symbols & still}
    return vehicle.idle(manoeuvre.subproblem) | resting


def _noises(channels, given):
    """The noise model of each channel: the one given by name, or what its sd and resolution say."""
    names = [channel.name for channel in channels]
    for name in given:
        if name not in names:
            raise InputError(f"noise: there is no channel '{name}'{coefficients.nearest(name, names)}")
    noises = tuple(
        given.get(channel.name) or likelihoods.reading_noise(channel.sd, channel.resolution) for channel in channels
    )
    for channel, noise in zip(channels, noises, strict=True):
        if isinstance(noise, likelihoods.SetMembership):
            raise InputError(f"channel '{channel.name}' has no noise to weigh it by; give its sensor an sd")
    return noises


@dataclass(frozen=True)
class LinearSystem:
    """One axis of the linear form ``matrix @ xi = load`` (model section 9), in N or N m.

    matrix : (n_samples, n_columns), dimensional regressors; names : (n_columns,) coefficients; load : (n_samples,)
    rounding : relative error (root mean square) to which each column is known, a number or (n_columns,)
    """

    axis: str
    names: tuple[str, ...]
    matrix: np.ndarray
    load: np.ndarray
    rounding: float | np.ndarray = _REGRESSOR_ROUNDING


def linear_systems(trajectory, member: int = 0, free=None) -> dict[str, LinearSystem]:
    """The linear form of each axis from the states and accelerations of a trajectory, simulated or measured
    (:class:`bayesub.measured.Motion`).

    The load is rigid-body inertia minus hydrostatics minus propulsion. Columns are the coefficients that the
    sub-problem uses and, if `free` names are given, only those: the others move to the load with their values in the
    trajectory. Columns that vanish throughout, such as those of bow planes that do not move, are left out, and so are
    axes without columns.

    The regressors are exact functions of the given states but for round-off. Simulated accelerations come from the
    equations of motion at these very states, so that integration errors do not enter; their round-off is what the
    equations are then short of, and a column of which a tenth is round-off counts as vanishing. Of measured motion
    every column that moves is kept.
    """
    simulator, xi = trajectory.simulator, trajectory.xi[member]
    states, accelerations = trajectory.states[member], trajectory.accelerations[member]
    used = set(coefficients.SUBPROBLEMS.get(simulator.subproblem, coefficients.NAMES))
    free = used if free is None else used & set(free)
    given = simulator.dimensional(np.where(np.isin(coefficients.NAMES, list(free)), 0.0, xi))[0]
    body, factors = simulator.vehicle.body, simulator.vehicle.dimensional_factors
    # What the free coefficients have to explain is how the motion differs from that of a boat without them.
    without = simulator.accelerations(given / factors, trajectory.states[member : member + 1])[0]
    loads = (accelerations - without) @ mass_matrix(given, body).T
    columns = coefficients.regressors(states, accelerations, trajectory.controls)
    noise = {}
    if isinstance(trajectory, Trajectory):
        dimensional = simulator.dimensional(xi)[0]
        short = _forces(columns, dimensional - given) - loads
        errors = np.linalg.norm(np.linalg.solve(mass_matrix(dimensional, body), short.T), axis=1)
        # An acceleration is what two forces leave over, and no better than the round-off of either.
        errors += np.finfo(float).eps * np.linalg.norm(without, axis=0)
        sizes = np.linalg.norm(accelerations, axis=0)
        noise = np.divide(errors, sizes, out=np.zeros(6), where=sizes > 0)
        noise = dict(zip(coefficients.ACCELERATIONS, noise, strict=True))

    systems = {}
    for axis, block in columns.items():
        terms = [term for term in coefficients.TERMS if term.axis == axis]
        rounding = np.array([noise.get(term.regressor, 0.0) for term in terms])
        moves = (np.abs(block).max(axis=0) > 0) & (rounding < _ROUND_OFF_ONLY)
        keep = np.array([term.name in free for term in terms]) & moves
        if keep.any():
            names = tuple(term.name for term, wanted in zip(terms, keep, strict=True) if wanted)
            matrix = block[:, keep] * factors[coefficients.columns(names)]
            load = loads[:, coefficients.AXES.index(axis)]
            systems[axis] = LinearSystem(axis, names, matrix, load, _REGRESSOR_ROUNDING + rounding[keep])
    return systems


def _forces(columns, dimensional) -> np.ndarray:
    """(n_samples, 6) hydrodynamic forces, N and N m, of dimensional coefficients (101,) on regressors by axis."""
    parts = [block @ dimensional[coefficients.columns(coefficients.names_of_axis(a))] for a, block in columns.items()]
    return np.stack(parts, axis=1)
