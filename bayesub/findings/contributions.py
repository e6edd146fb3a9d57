"""What each coefficient contributes to the forces of straight flight, and to their slopes by one variable."""

from dataclasses import dataclass

import numpy as np

from bayesub.logs.log_files import positions
from bayesub.model.equations import AXES
from bayesub.model.linear_motion import regressor_slopes, regressors, straight
from bayesub.model.vehicles import Vehicle


@dataclass(frozen=True)
class Contributions:
    """Hydrodynamic forces, or their slopes by one variable, in straight flight at the trial speed.

    Attributes
    ----------
    names : dict of str to list of str
        Axis -> coefficients that contribute, whatever their values.
    values : dict of str to float
        Axis -> sum, N and N m for a force, and that per unit of the variable for a slope.
    """

    names: dict[str, list[str]]
    values: dict[str, float]

    def of(self, *axes: str) -> list[str]:
        """The coefficients that contribute to some axes."""
        return [name for axis in axes for name in self.names[axis]]


def forces(vehicle: Vehicle, speed_ratio: float = 1.0) -> Contributions:
    """The forces of straight flight, at a ratio of the trial speed; the propeller keeps turning as at that speed."""
    states, controls = straight(vehicle, 1)
    states[0, positions("u")] *= speed_ratio
    return _summed(vehicle, regressors(vehicle, states, controls)[0])


def slopes(vehicle: Vehicle, variable: str) -> Contributions:
    """The slopes by a velocity other than u (per m/s, rad/s), or by a control by its column (per rad)."""
    return _summed(vehicle, regressor_slopes(vehicle, variable))


def _summed(vehicle: Vehicle, regressors: np.ndarray) -> Contributions:
    names, values = {}, {}
    for axis in AXES:
        positions_of_axis = vehicle.equations.columns(vehicle.equations.names_of_axis(axis))
        used = positions_of_axis[regressors[positions_of_axis] != 0.0]
        names[axis] = [vehicle.equations.names[k] for k in used]
        values[axis] = float(vehicle.xi[used] @ regressors[used])
    return Contributions(names, values)
