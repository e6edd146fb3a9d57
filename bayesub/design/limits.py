"""Limits of a trial: what the boat, its crew and the range allow, judged by simulation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.io.toml_files import Positive, Section
from bayesub.logs import log_files
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle

N_DRAWS = 128  # of the prior, that fly a manoeuvre
_AREA = ("range_north_m", "range_east_m")
_SAMPLES = 300  # of a flight, at which limits are judged
Percent = Annotated[float, pydantic.Field(ge=0.0, le=200.0)]
Share = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]
ORDERED = (  # the first is not above the second
    ("min_rpm_percent", "max_rpm_percent"),
    ("min_speed_mps", "max_speed_mps"),
    ("surface_m", "bottom_m"),
)


class Limits(Section):
    """What a manoeuvre must keep within; what is left out is not limited, but that planes have limits of their own.

    Any other key is the column of a plane or actuator, such as ``rudder_deg``, with its largest value to either side,
    or the same with its rate, ``rudder_degps``; by default those of the vehicle.
    """

    model_config = pydantic.ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Annotated[Positive, pydantic.Field(le=log_files.VAST)]]

    duration_s: Positive | None = None  # length of the trial; by default 44 ship lengths travelled
    min_rpm_percent: Percent = 50.0  # of the propeller speed that self-propels
    max_rpm_percent: Percent = 100.0  # the same as the smallest keeps it
    rpm_percentps: Positive | None = None  # largest rate of change, per cent of it a second; None if it may jump
    orders_an_hour: Positive | None = None  # to one control, by a helmsman; None for an autopilot: it follows any curve
    depth_change_m: Positive | None = None  # largest distance from the depth at the start
    surface_m: float | None = None  # smallest depth of bow and stern, on the axis of the hull
    bottom_m: float | None = None  # largest depth of these
    pitch_deg: Positive | None = None
    roll_deg: Positive | None = None
    min_speed_mps: float | None = None  # of surge
    max_speed_mps: Positive | None = None
    range_north_m: Positive | None = None  # size of the area
    range_east_m: Positive | None = None
    # Share of the drawn boats that must keep all limits too. A search finds what suits these; of others fewer do.
    share_of_draws: Share = 0.97

    @property
    def of_controls(self) -> dict[str, float]:
        """Column, or column with ``ps`` after its unit -> largest value or rate."""
        return dict(self.__pydantic_extra__ or {})

    @pydantic.model_validator(mode="after")
    def _ordered(self):
        for low, high in ORDERED:
            lower, upper = getattr(self, low), getattr(self, high)
            if lower is not None and upper is not None and lower > upper:
                raise InputError(f"{low} is above {high}", "conflict")
        return self


def load_limits(path: str | Path) -> Limits:
    """Read a limits file; InputErrors have file, key and remedy."""
    return toml_files.read_toml(Path(path), Limits)


def usual_limits(vehicle: Vehicle) -> Limits:
    """The default limits of a boat: depth within 0.9 lengths, pitch under 30 and roll under 45 degrees."""
    limits = {"min_speed_mps": 0.1 * vehicle.speed_mps}
    if vehicle.equations.degrees_of_freedom == 6:
        limits |= {"depth_change_m": 0.9 * vehicle.length_m, "pitch_deg": 30.0, "roll_deg": 45.0}
    return Limits.model_validate(limits)


@dataclass(frozen=True)
class Margin:
    """How far a manoeuvre stays from one limit."""

    key: str  # of the limits file
    limit: float  # in the unit of the key
    reached: np.ndarray  # (n_flights,), extreme value of each flight, that of the vehicle itself first
    is_upper: bool = True  # whether the limit is the largest value rather than the smallest

    @property
    def excess(self) -> np.ndarray:
        """(n_flights,) how far each flight is beyond the limit, as a share of its size; negative within."""
        return (self.reached - self.limit) / max(abs(self.limit), 1e-9) * (1.0 if self.is_upper else -1.0)

    @property
    def share_within(self) -> float:
        """Share of the draws, the flights but the first, that keep the limit."""
        return float(np.mean(self.excess[1:] <= 0.0)) if len(self.reached) > 1 else float("nan")


class Range:
    """The limits of a vehicle, and the flights that show whether a manoeuvre keeps them.

    Draws (n_draws, n_terms) are coefficient sets that the prior holds possible; the integration step is in s.
    """

    def __init__(self, vehicle: Vehicle, limits: Limits, draws: np.ndarray, subproblem: str | None, step_s: float):
        self.vehicle, self.limits, self.subproblem, self.step_s = vehicle, limits, subproblem, step_s
        self.sets = np.vstack([vehicle.xi[None], draws])
        self.n_wanted = int(np.ceil(limits.share_of_draws * len(draws)))  # of the draws, that must keep all limits

    def allow(self, straight: Manoeuvre) -> None:
        """Ask of no more draws to keep all limits than keep them, but that of the area, in straight flight.

        Unless the limits say how many.
        """
        if "share_of_draws" not in self.limits.model_fields_set:
            beyond = [margin.excess[1:] > 0.0 for margin in self.margins(straight) if margin.key not in _AREA]
            self.n_wanted = min(self.n_wanted, len(self.sets) - 1 - int(np.sum(np.any(beyond, axis=0))))

    def flown(self, manoeuvre: Manoeuvre) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (n_times,), states (n_flights, n_times, 12) and whether each flight (n_flights,) came to its end."""
        times = np.linspace(0.0, manoeuvre.duration, _SAMPLES + 1)
        simulator = Simulator(self.vehicle, manoeuvre, times, dt=self.step_s, subproblem=self.subproblem)
        states, status = simulator.run(self.sets, parallel=False)
        return times, states, status == 0

    def margins(self, manoeuvre: Manoeuvre) -> list[Margin]:
        """The margin to each limit; that of a flight that failed is infinitely beyond."""
        _, states, whole = self.flown(manoeuvre)
        x, y, z, phi, theta, u = np.moveaxis(states, -1, 0)[log_files.positions("x", "y", "z", "phi", "theta", "u")]
        half = 0.5 * self.vehicle.length_m * np.abs(np.sin(theta))
        extremes = {
            "depth_change_m": (lambda: np.abs(z - z[:, :1]).max(1), True),
            "surface_m": (lambda: (z - half).min(1), False),
            "bottom_m": (lambda: (z + half).max(1), True),
            "pitch_deg": (lambda: np.degrees(np.abs(theta).max(1)), True),
            "roll_deg": (lambda: np.degrees(np.abs(phi).max(1)), True),
            "min_speed_mps": (lambda: u.min(1), False),
            "max_speed_mps": (lambda: u.max(1), True),
            "range_north_m": (lambda: np.ptp(x, axis=1), True),
            "range_east_m": (lambda: np.ptp(y, axis=1), True),
        }
        margins = []
        for key, (reached, is_upper) in extremes.items():
            if (limit := getattr(self.limits, key)) is not None:
                worst = np.where(whole, reached(), np.inf if is_upper else -np.inf)
                margins.append(Margin(key, limit, worst, is_upper))
        return margins

    def penalty(self, margins: list[Margin]) -> float:
        """Zero within all limits; otherwise how far beyond, flights summed as far as they are asked for."""
        beyond = np.max([np.zeros(len(self.sets)), *(np.minimum(m.excess, 10.0) for m in margins)], axis=0)
        of_draws = np.sort(beyond[1:])[: self.n_wanted].mean() if self.n_wanted else 0.0
        return float(beyond[0] + of_draws)

    def refuse(self, straight: Manoeuvre) -> None:
        """InputError if even straight flight breaks a limit.

        But those of depth, which planes amidships do not hold, and of the area, in which turns may keep.
        """
        for margin in self.margins(straight):
            if margin.excess[0] > 0.0 and margin.key not in ("depth_change_m", *_AREA):
                what = f"limits: even straight flight at {self.vehicle.speed_mps:g} m/s reaches {margin.reached[0]:.3g}"
                raise InputError(f"{what}, beyond {margin.key} = {margin.limit:g}; widen it", "conflict", margin.key)
