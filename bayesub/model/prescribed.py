"""Angles that are prescribed: a log measures them well, and the boat follows them instead of being turned by moments.

In its plane a prescribed angle takes the place of the equation of its moment. The angle that is flown is the cubic
spline through its values at the steps, whose second derivative is a broken line; the boat gets an inertia beside which
all other moments are nothing, and the moment that makes it follow (model manual, section 7). Runge-Kutta 4 integrates
such a spline without error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.errors import InputError, check_known
from bayesub.kernels import workspace

if TYPE_CHECKING:  # it takes half a second to import
    from scipy.interpolate import CubicSpline

INERTIA = 1e15  # kg m^2; a moment of 100 N m turns it by 1e-5 rad in 4 hours
PLANES = {"pitch": "vertical", "yaw": "horizontal"}
STATES = {"pitch": ("theta", "q"), "yaw": ("psi", "r")}
_SMOOTHNESS = (-12.0, 12.0)  # decimal logarithms of the penalty of curvature between which it is sought
_FEWEST = 5  # readings that a smoothing spline needs


@dataclass(frozen=True)
class Prescribed:
    """An angle over time."""

    angle: str  # "pitch" or "yaw"
    of: Callable[[np.ndarray], np.ndarray]  # times (n,), s -> angles (n,), rad

    @property
    def axis(self) -> str:
        """The moment whose equation it takes the place of."""
        return {"pitch": "M", "yaw": "N"}[self.angle]

    @property
    def inertia(self) -> int:
        """Position of its moment of inertia in the body vector."""
        return {"pitch": workspace.IYY, "yaw": workspace.IZZ}[self.angle]

    @property
    def states(self) -> tuple[str, str]:
        """Short names of the angle and its rate."""
        return STATES[self.angle]

    def on_steps(self, boundaries: np.ndarray) -> CubicSpline:
        """The spline that is flown, through the angles at the boundaries of the steps (n,), s; it needs two steps."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(boundaries, self.of(boundaries))


def check(angle: str, subproblem: str | None) -> None:
    """InputError for an angle that cannot be prescribed in a sub-problem."""
    check_known(angle, PLANES, f"prescribed: '{angle}' is no angle", hint="expected pitch or yaw")
    if subproblem != PLANES[angle]:
        flown = "six degrees of freedom" if subproblem is None else f"the {subproblem} sub-problem"
        text = f"prescribed: {angle} can be prescribed in the {PLANES[angle]} sub-problem only, and the trial has "
        text += f'{flown}; give subproblem = "{PLANES[angle]}"'
        raise InputError(text, "conflict", angle)


def smoothed(angle: str, times: np.ndarray, readings: np.ndarray, sd: float) -> Prescribed:
    """The smoothest angle that misses its readings by their noise.

    It is the cubic smoothing spline through readings (n,), rad, at ascending times (n,), s, whose residuals have the
    root mean square `sd`, rad. The angle is "pitch" or "yaw". InputError for fewer than five readings.
    """
    from scipy.interpolate import make_smoothing_spline
    from scipy.optimize import brentq

    if len(times) < _FEWEST:
        raise InputError(f"prescribed: {angle} has {len(times)} readings; it needs {_FEWEST}", "data", angle)

    def excess(logarithm):
        spline = make_smoothing_spline(times, readings, lam=10.0**logarithm)
        return np.sqrt(np.mean((spline(times) - readings) ** 2)) - sd

    low, high = _SMOOTHNESS
    if excess(low) >= 0.0:
        logarithm = low
    elif excess(high) <= 0.0:
        logarithm = high
    else:
        logarithm = brentq(excess, low, high, xtol=0.01)
    spline = make_smoothing_spline(times, readings, lam=10.0**logarithm)
    slope = spline.derivative()

    def of(at):
        within = np.clip(at, times[0], times[-1])
        return spline(within) + slope(within) * (at - within)

    return Prescribed(angle, of)
