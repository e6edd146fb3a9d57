"""What members of a batch change of the controls at the stages of the steps: actuators, and forces at knots."""

from __future__ import annotations

import numpy as np

from bayesub.kernels.variations import Variations, of_entries
from bayesub.model.control_histories import ControlHistories
from bayesub.model.disturbance import Knots
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle


class StageChanges:
    """The changes by which members of a batch differ.

    Most are amounts of what a unit of each adds. An actuator that has a delay or a lag of a member's own adds what that
    makes of its history instead, and the biases and scales of this actuator go into it.

    Parameters
    ----------
    vehicle : Vehicle
    subproblem : str or None
    varied : tuple of str
        Parameters of actuators by which members may differ, and after them forces at the knots; n_varied of them.
    histories : ControlHistories
        At the stages, with the same parameters of actuators.
    stage_times : list of (n,) array
        The three stages of each step, s.
    knots : Knots or None
        Of the forces.

    Attributes
    ----------
    variations : Variations
        What a unit of each of :meth:`numbers` adds.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        subproblem: str | None,
        varied: tuple[str, ...],
        histories: ControlHistories,
        stage_times: list[np.ndarray],
        knots: Knots | None,
    ):
        self._vehicle, self._subproblem, self._histories = vehicle, subproblem, histories
        self._stage_times, self._knots = stage_times, knots
        positions = {name: i for name, (i, _) in vehicle.actuators.parameters.items()}
        self._n_of_actuators = sum(name in positions for name in varied)
        self._individual = np.array([positions.get(name) in histories.individual for name in varied], dtype=bool)
        others = tuple(name for name, individual in zip(varied, self._individual, strict=True) if not individual)
        self.variations = self._variations(
            [*self._entries(others, np.zeros(self._n_of_actuators)), *self._individual_entries()]
        )

    def numbers(self, amounts: np.ndarray) -> np.ndarray:
        """What the kernels take as amounts, of amounts (n_batch, n_varied): those of own histories come last."""
        if not self._histories.individual:
            return amounts
        return np.hstack([amounts[:, ~self._individual], self._histories.added(amounts[:, : self._n_of_actuators])])

    def by(self, parameters: tuple[str, ...], amounts: np.ndarray | None) -> Variations:
        """The derivatives of the controls by parameters, at amounts (n_varied,) or none."""
        n = self._n_of_actuators
        return self._variations(self._entries(parameters, np.zeros(n) if amounts is None else amounts[:n]))

    @property
    def are_linear(self) -> bool:
        """Whether the derivatives are the same at all amounts."""
        return not self._histories.individual

    def _individual_entries(self):
        first = np.count_nonzero(~self._individual)
        return ((stages, first + numbers, *rest) for stages, numbers, *rest in self._histories.individual_entries())

    def _entries(self, parameters, amounts):
        """Stages, numbers, columns and values of what a unit of each parameter adds, part by part."""
        actuators = self._vehicle.actuators
        forces = {} if self._knots is None else {name: n for n, name in enumerate(self._knots.parameters)}
        places = {forces[name]: m for m, name in enumerate(parameters) if name in forces}
        slopes = {name: self._histories.slopes(name, amounts) for name in parameters if name not in forces}
        for k, times in enumerate(self._stage_times if len(parameters) else ()):
            for m, parameter in enumerate(parameters):
                if parameter in forces:
                    continue
                if slopes[parameter] is None:
                    change = actuators.variation(parameter, self._histories.stages[k], self._subproblem)
                else:
                    change = slopes[parameter][:, k]
                rows, columns = np.nonzero(change)
                yield 3 * rows + k, np.full(len(rows), m), columns, change[rows, columns]
            if places:
                yield from self._of_forces(k, times, places)

    def _of_forces(self, k, times, places):
        first = len(self._vehicle.equations.controls) + 1
        rows, knots, weights = self._knots.hats(times)
        for a, axis in enumerate(self._knots.axes):
            numbers = np.array([places.get(n, -1) for n in a * len(self._knots.times) + knots])
            of = numbers >= 0
            column = np.full(np.count_nonzero(of), first + AXES.index(axis))
            yield 3 * rows[of] + k, numbers[of], column, weights[of]

    def _variations(self, entries) -> Variations:
        none = (np.zeros(0, dtype=int),) * 3 + (np.zeros(0),)
        stages, *rest = (np.concatenate(part) for part in zip(none, *entries, strict=True))
        order = np.argsort(rest[0], kind="stable")  # a member adds its amounts in their order
        return of_entries(len(self._stage_times[0]), stages[order], *(part[order] for part in rest))
