"""What each coefficient contributes to the forces of straight flight, and to their slopes by one variable."""

from dataclasses import dataclass

import numpy as np

from bayesub.io.log_files import VELOCITIES, positions
from bayesub.model.equations import AXES
from bayesub.model.manoeuvre_files import straight_and_level
from bayesub.model.vehicles import Vehicle

# A step of a velocity or an angle so small that its square underflows to zero: u v has its exact slope, v |v| none.
_STEP = 1e-200


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
    states, controls = _straight(vehicle, 1)
    states[0, positions("u")] *= speed_ratio
    return _summed(vehicle, _regressors(vehicle, states, controls)[0])


def slopes(vehicle: Vehicle, variable: str) -> Contributions:
    """The slopes by a velocity other than u (per m/s, rad/s), or by a control by its column (per rad)."""
    states, controls = _straight(vehicle, 2)
    if variable in VELOCITIES:
        states[:, positions(variable)[0]] = [_STEP, -_STEP]
    else:
        controls[:, vehicle.equations.control(variable, "check")] = [_STEP, -_STEP]
    ahead, back = _regressors(vehicle, states, controls)
    return _summed(vehicle, (ahead - back) / (2.0 * _STEP))


def _straight(vehicle: Vehicle, n: int) -> tuple[np.ndarray, np.ndarray]:
    """States (n, 12) of straight flight, and controls (n, n_controls + 1) amidships, after them n/k0."""
    controls = np.zeros((n, len(vehicle.equations.controls) + 1))
    controls[:, -1] = vehicle.speed_mps
    return np.tile(straight_and_level(vehicle), (n, 1)), controls


def _regressors(vehicle: Vehicle, states: np.ndarray, controls: np.ndarray) -> np.ndarray:
    """(n, n_terms) what a coefficient of one contributes, N and N m."""
    still = np.zeros((len(states), 6))
    by_axis = vehicle.equations.regressors(states, still, controls, vehicle.constants)
    return np.concatenate([by_axis[axis] for axis in AXES], axis=1) * vehicle.dimensional_factors


def _summed(vehicle: Vehicle, regressors: np.ndarray) -> Contributions:
    names, values = {}, {}
    for axis in AXES:
        positions_of_axis = vehicle.equations.columns(vehicle.equations.names_of_axis(axis))
        used = positions_of_axis[regressors[positions_of_axis] != 0.0]
        names[axis] = [vehicle.equations.names[k] for k in used]
        values[axis] = float(vehicle.xi[used] @ regressors[used])
    return Contributions(names, values)
