"""Small motions about straight and level flight: roots, stability indices, and speeds at which they change.

Accelerations are differentiated by velocities, angles and planes with the equations of motion of the simulator, at the
trial speed. Names of derivatives in formulas are those of dimensional forces (SNAME 1950); w and q stand for their
change from straight flight, theta for pitch.
"""

import numpy as np

from bayesub.kernels import workspace
from bayesub.logs.log_files import VELOCITIES, positions
from bayesub.model.boats import Boats
from bayesub.model.equations import AXES
from bayesub.model.manoeuvre_files import STERN_PLANE, straight_and_level
from bayesub.model.vehicles import Vehicle

NUDGE = 1e-7  # of the speed, the speed per length and 1 rad, for derivatives of accelerations: forces of v|v| vanish
_STEP = 1e-200  # of a velocity or an angle, whose square underflows to zero: u v has its exact slope, v |v| none
SMALLEST = 1e-4  # of the trial speed, below which a speed is round-off
_REAL = 1e-9  # of the size of a root, below which its imaginary part is round-off
RATES = {"phi": "p", "theta": "q"}  # of angles, if these are small
PLANES = {"horizontal": ("v", "r"), "vertical": ("w", "q", "theta")}


def motion_matrix(boats: Boats, plane: str | None, names: tuple[str, ...]) -> np.ndarray:
    """Matrices (n, k, k) by which small changes of k velocities and angles change a second later, SI units.

    The motion is confined to a plane; of an angle the rate must be among the names.
    """
    speed, length = boats.vehicle.speed_mps, boats.vehicle.length_m
    scales = {"phi": 1.0, "theta": 1.0} | dict.fromkeys("uvw", speed) | dict.fromkeys("pqr", speed / length)
    steps = NUDGE * np.array([scales[name] for name in names])
    states = boats.straight(2 * len(names))
    for k, (place, step) in enumerate(zip(positions(*names), steps, strict=True)):
        states[2 * k : 2 * k + 2, place] += [step, -step]
    rates = boats.accelerations(plane, states, boats.controls(plane, n=len(states)))
    slopes = (rates[:, ::2] - rates[:, 1::2]) / (2.0 * steps[:, None])
    result = np.zeros((len(boats), len(names), len(names)))
    for k, name in enumerate(names):
        result[:, k] = np.array(names) == RATES[name] if name in RATES else slopes[:, :, VELOCITIES.index(name)]
    return result


def roots(boats: Boats, plane: str) -> np.ndarray:
    """Roots (n, k) of small motions in a plane, 1/s: of sway and yaw, or of heave and pitch; largest real part first.

    The righting moment is that of the boat; the speed ahead does not change. Not a number where a derivative is none.
    """
    matrices = motion_matrix(boats, plane, PLANES[plane])
    whole = np.isfinite(matrices).all(axis=(1, 2))
    found = np.linalg.eigvals(np.where(whole[:, None, None], matrices, 0.0)).astype(complex)
    order = np.argsort(-found.real, axis=1, kind="stable")
    return np.where(whole[:, None], np.take_along_axis(found, order, axis=1), np.nan)


def period(boats: Boats) -> np.ndarray:
    """Period (n,) of the oscillation of heave and pitch, s; not a number where all roots are real."""
    found = boats.once(roots, "vertical")
    frequency = np.abs(found.imag).max(axis=1)
    with np.errstate(all="ignore"):
        return np.where(frequency > _REAL * np.abs(found).max(axis=1), 2.0 * np.pi / frequency, np.nan)


def regressor_slopes(vehicle: Vehicle, variable: str) -> np.ndarray:
    """(n_terms,) what a coefficient of one adds to the slope of its force in straight flight at the trial speed.

    The slope is by a velocity other than u (per m/s, rad/s), or by a control by its column (per rad).
    """
    states, controls = straight(vehicle, 2)
    if variable in VELOCITIES:
        states[:, positions(variable)[0]] = [_STEP, -_STEP]
    else:
        controls[:, vehicle.equations.control(variable, "check")] = [_STEP, -_STEP]
    ahead, back = regressors(vehicle, states, controls)
    return (ahead - back) / (2.0 * _STEP)


def straight(vehicle: Vehicle, n: int) -> tuple[np.ndarray, np.ndarray]:
    """States (n, 12) of straight flight, and controls (n, n_controls + 1) amidships, after them n/k0."""
    controls = np.zeros((n, len(vehicle.equations.controls) + 1))
    controls[:, -1] = vehicle.speed_mps
    return np.tile(straight_and_level(vehicle), (n, 1)), controls


def regressors(vehicle: Vehicle, states: np.ndarray, controls: np.ndarray) -> np.ndarray:
    """(n, n_terms) what a coefficient of one adds to its force, N and N m, at states (n, 12) without accelerations."""
    by_axis = vehicle.equations.regressors(states, np.zeros((len(states), 6)), controls, vehicle.constants)
    return np.concatenate([by_axis[axis] for axis in AXES], axis=1) * vehicle.dimensional_factors


def stability_index(boats: Boats, plane: str) -> np.ndarray:
    """G_h or G_v (n,), the margin of stability of a straight course (Arentzen & Mandel 1960; Feldman 1987).

    ``G_h = 1 - Nv (Yr - m U) / (Yv (Nr - m xG U))``, ``G_v = 1 - Mw (Zq + m U) / (Zw (Mq - m xG U))`` with the slopes
    of the hydrodynamic forces in straight flight, without the terms of the mass where those are in the coefficients;
    above zero is stable, without help from righting moment. Not a number where a damping derivative is not negative.
    """
    vehicle, bodies = boats.vehicle, boats.bodies(None)
    separate = vehicle.equations.rigid_body_terms == "separate"
    mass = bodies[:, workspace.MASS] * vehicle.speed_mps * separate
    horizontal = plane == "horizontal"
    across, turning, force, moment, sign = ("v", "r", "Y", "N", -1.0) if horizontal else ("w", "q", "Z", "M", 1.0)
    columns = {axis: vehicle.equations.columns(vehicle.equations.names_of_axis(axis)) for axis in (force, moment)}
    with np.errstate(all="ignore"):
        drift, rate = (
            {axis: boats.xi[:, k] @ regressor_slopes(vehicle, variable)[k] for axis, k in columns.items()}
            for variable in (across, turning)
        )
        lever = rate[moment] - mass * bodies[:, workspace.XG]
        index = 1.0 - drift[moment] * (rate[force] + sign * mass) / (drift[force] * lever)
    return np.where((drift[force] < 0.0) & (lever < 0.0), index, np.nan)


def critical_speed(boats: Boats) -> np.ndarray:
    """Speed (n,) above which oscillations of heave and pitch grow, m/s; not a number where none does, or all do.

    A boat with a righting moment and G_v below zero is stable up to there (Tupper 1996, chapter 10). Slopes by w and q
    grow with the speed U and those by pitch do not, so that the matrix is ((U a, U b, c), (U d, U e, f), (0, 1, 0)),
    and the boat is stable as long as ``-(a + e) ((a e - b d) U^2 - f) > a f - c d`` (Routh).
    """
    matrix = boats.once(motion_matrix, "vertical", PLANES["vertical"])
    (a, b), (d, e) = np.moveaxis(matrix[:, :2, :2], 0, -1) / boats.vehicle.speed_mps
    c, f = matrix[:, :2, 2].T
    with np.errstate(all="ignore"):
        square = (e * f + c * d) / ((a * e - b * d) * (a + e))
    return _root(boats, np.where((a + e < 0.0) & (a * f - c * d > 0.0) & (a * e - b * d < 0.0), square, np.nan))


def inversion_speed(boats: Boats) -> np.ndarray:
    """Speed (n,) at which the stern planes do not change the depth, m/s; below it they act the other way round.

    There the boat that they pitch drifts by as much as it is pitched, and its path stays level (Renilson 2015, chapter
    3: the critical point lies at the planes). With the matrix of :func:`critical_speed` and accelerations ``U^2 g,
    U^2 h`` by the planes it is ``U^2 = (f g - c h) / (a h - d g)``; not a number where there is no such speed.
    """
    matrix, speed = boats.once(motion_matrix, "vertical", PLANES["vertical"]), boats.vehicle.speed_mps
    angles = np.array([NUDGE, -NUDGE])
    rates = boats.accelerations("vertical", boats.straight(2), boats.controls("vertical", {STERN_PLANE: angles}, 2))
    places = [VELOCITIES.index(name) for name in "wq"]
    g, h = ((rates[:, 0] - rates[:, 1])[:, places] / (2.0 * NUDGE * speed**2)).T
    (a, d), (c, f) = matrix[:, :2, 0].T / speed, matrix[:, :2, 2].T
    with np.errstate(all="ignore"):
        return _root(boats, (f * g - c * h) / (a * h - d * g))


def _root(boats, squares):
    """(n,) roots, m/s; not a number where there is none, or one that is round-off beside the trial speed."""
    real = np.isfinite(squares) & (squares > (SMALLEST * boats.vehicle.speed_mps) ** 2)
    return np.sqrt(np.where(real, squares, np.nan))
