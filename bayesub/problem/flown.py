"""What the boat does in one trial, by the parameters of its problem and in truth."""

from functools import cached_property

import numpy as np

from bayesub.model.linear_form import LinearSystem, linear_systems
from bayesub.model.trajectory import Trajectory
from bayesub.problem.base import PosteriorDensity
from bayesub.problem.forward_model import ForwardModel


class FlownTrial(PosteriorDensity):
    """The motion of one trial, and the truth behind a synthetic record.

    Attributes
    ----------
    forward : the forward model
    inferred : positions of the nuisance parameters that are inferred, among those of the forward model
    readings : (n_readings,) measured values, SI units
    """

    forward: ForwardModel
    inferred: list[int]
    readings: np.ndarray

    def nuisance_values(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_nuisances) of parameters (n_batch, n_params)."""
        raise NotImplementedError

    def arguments(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficient sets and nuisance values of parameters (n_batch, n_params), as the forward model takes them."""
        return self.coefficient_sets(parameters), self.nuisance_values(parameters)

    @property
    def _true_xi(self) -> np.ndarray:
        record = self.forward.record
        return self.forward.vehicle.xi if record.truth is None else record.truth

    @property
    def reference(self) -> np.ndarray:
        """(n_params,) the truth behind a synthetic record, otherwise the values of the vehicle and the manoeuvre.

        Of parameters of the noise that nobody knows it is the value given with the noise model. Histories of forces
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
        return self.forward.simulator.trajectory(self.coefficient_sets(parameters))

    def motion(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_times, 12) states over the ground at the times of the readings, nuisance parameters included."""
        return self.forward.states(*self.arguments(np.atleast_2d(parameters)))

    def forces(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_axes, n_knots) unmodelled forces at the knots, N and N m, of parameters (n_batch, n_params)."""
        return self.forward.forces(self.nuisance_values(np.atleast_2d(parameters)))

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """As :meth:`bayesub.problem.base.PosteriorDensity.linear_systems`, of the body and start that are inferred."""
        trajectory = self.forward.trajectory(*self.arguments(np.atleast_2d(parameters)))
        return linear_systems(trajectory, free=self.names[: len(self.columns)])
