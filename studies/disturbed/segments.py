"""Pieces of a manoeuvre, which each member flies from a state and under forces of its own."""

import numpy as np

from bayesub.io.errors import InputError
from bayesub.kernels.variations import of_dense
from bayesub.logs import log_files
from bayesub.model.equations import AXES
from bayesub.model.simulator import MAX_SPEED_RATIO, Simulator


class Segment:
    """A manoeuvre from one time to another, in Runge-Kutta steps of equal length.

    Parameters
    ----------
    simulator : Simulator
        Of the manoeuvre, with forces at knots if members have any here; steps are as long as its own, or shorter to
        fit.
    begin, end : float
        Within the manoeuvre, s; of a segment without length the states stay what they are.
    axes : tuple of str
        Along which each member has a force that goes linearly from one value to another.
    varied : tuple of str
        Parameters of actuators by which members differ.
    """

    def __init__(
        self, simulator: Simulator, begin: float, end: float, axes: tuple[str, ...], varied: tuple[str, ...] = ()
    ):
        self._simulator = simulator
        n_steps = max(1, int(np.ceil((end - begin) / simulator.step * (1.0 - 1e-9))))
        self._step = (end - begin) / n_steps or simulator.step
        self._times = np.array([end - begin])
        weights = (np.arange(n_steps + 1)[:, None] + [0.0, 0.5, 1.0]) / n_steps
        times = np.minimum(begin + weights * (end - begin), simulator.manoeuvre.duration).ravel()
        if simulator.histories.individual:
            raise InputError(
                "a filter does not know delays and lags of actuators; give them a value", "conflict", "varied"
            )
        controls = simulator.controls_at(times)
        changes = np.zeros((len(times), len(varied) + 2 * len(axes), controls.shape[1]))
        inputs = simulator.histories.at(times)
        for m, parameter in enumerate(varied):
            change = simulator.vehicle.actuators.variation(parameter, inputs, simulator.subproblem)
            changes[:, m, : change.shape[1]] = change
        first = len(simulator.vehicle.equations.controls) + 1
        later = np.minimum(weights.ravel(), 1.0)
        for m, axis in enumerate(axes, start=len(varied)):
            changes[:, m, first + AXES.index(axis)] = 1.0 - later
            changes[:, m + len(axes), first + AXES.index(axis)] = later
        self._stages = controls.reshape(n_steps + 1, 3, -1)
        self._variations = of_dense(changes.reshape(n_steps + 1, 3, *changes.shape[1:]))

    def fly(
        self,
        dimensional: np.ndarray,
        bodies: np.ndarray,
        initial: np.ndarray,
        amounts: np.ndarray,
        outputs: tuple[str, ...],
    ) -> np.ndarray:
        """Outputs (n_batch, n_outputs) at the end, not a number where the simulation failed.

        Parameters
        ----------
        dimensional : (n_batch, n_terms) array
            Of :meth:`bayesub.model.simulator.Simulator.dimensional`.
        bodies : (n_batch, N_BODY + N_CONSTANTS) array
        initial : (n_batch, 12) array
            States at the beginning.
        amounts : (n_batch, n_varied + 2 n_axes) array
            How much parameters of actuators differ; forces at the beginning; forces at the end, N and N m.
        outputs : tuple of str
            Short names of states and accelerations.
        """
        # One thread: pieces are too short to be worth the wait for another.
        states, _ = self._simulator.kernels.integrate(
            dimensional,
            bodies,
            initial,
            self._stages,
            self._variations,
            amounts,
            self._step,
            self._times,
            MAX_SPEED_RATIO * self._simulator.vehicle.speed_mps,
            np.array(log_files.positions(*outputs)),
        )
        return states[:, 0]
