"""What the thesis leaves untried of a trial of suboff (chapters 10 and 11), one option at a time.

Ballast, trim and thrusters are actuators that the boat of the thesis does not have, of the size that boats have: tanks
of half a per cent of the weight, a mass that trims as a trim tank does, and thrusters of a thousandth of the weight.
What they do is known, as that of a load that was weighed; what they do to mass and inertia is left out.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pydantic

from bayesub.design.families import RPM, Control, Family, controls
from bayesub.design.information import Known
from bayesub.design.judge import Judge
from bayesub.design.limits import Limits, Range, usual_limits
from bayesub.design.search import Cost, Found, search
from bayesub.kernels import workspace
from bayesub.model import actuator_files
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.sensors import DVL, INS, Pressure, Sensor, flat

BOAT = "suboff"
DURATION_S = 600.0
SHARE = 0.1  # of its value, to which a coefficient is to be known
BALLAST = 0.005  # of the weight, to either side
BALLAST_S = 120.0  # from empty to full
TRIM_LENGTHS = 0.002  # of the whole mass, forward and aft: the moment of a tank of 0.5 % moved by 0.4 lengths
THRUST = 0.001  # of the weight
BOW = 0.4  # ship lengths ahead of the origin, where the thrusters are
THRUST_S = 10.0  # from nothing to all
KNOTS = 45  # orders of each control, in 600 s
THINNED = 4  # one reading in so many is judged in a search
EXTRAS = ("ballast_n", "trim_m", "side_n", "lift_n")  # columns of the actuators that the thesis's boat does not have


def equipped(speed_mps: float | None = None) -> Vehicle:
    """Suboff with a ballast tank, a mass that trims, and thrusters at the bow; at rest they do nothing.

    Parameters
    ----------
    speed_mps : float, optional
        At which trials begin, by default suboff's own.
    """
    boat = load_vehicle(BOAT)
    speed = boat.speed_mps if speed_mps is None else speed_mps
    weight, bow = boat.body[workspace.WEIGHT], (BOW * boat.length_m, 0.0, 0.0)
    planes = [
        {
            "kind": "fin",
            "name": member.column.removesuffix("_deg"),
            "mixing": {member.column: 1.0},
            "limit_deg": np.degrees(member.limit),
            "rate_deg_s": np.degrees(member.rate),
            "time_constant_s": member.time_constant,
        }
        for member in boat.actuators.members
    ]
    thruster = {"kind": "thruster", "position_m": bow, "limit_n": THRUST * weight}
    sections = pydantic.TypeAdapter(actuator_files.ActuatorArray).validate_python(
        [
            *planes,
            {"kind": "ballast", "name": "ballast"},
            {"kind": "sliding_mass", "name": "trim", "mass_kg": boat.body[workspace.MASS]},
            thruster | {"name": "side", "direction": (0.0, 1.0, 0.0)},
            thruster | {"name": "lift", "direction": (0.0, 0.0, -1.0)},
        ]
    )
    actuators = actuator_files.build(sections, boat.equations, boat.water_density_kgm3, boat.rpm_per_mps * speed)
    return replace(boat, actuators=actuators, speed_mps=speed)


@dataclass(frozen=True)
class Option:
    """One way to plan a trial.

    Attributes
    ----------
    meaning : str
    vehicle : callable
        Gives the boat.
    moved : tuple of str
        Columns of the controls that may be moved.
    limits : dict
        Keys of :class:`bayesub.design.limits.Limits` that differ from the usual ones.
    n_manoeuvres : int
        Flown one after the other.
    """

    meaning: str
    vehicle: Callable[[], Vehicle] = field(default=lambda: load_vehicle(BOAT))
    moved: tuple[str, ...] = ("rudder_deg", "bow_plane_deg", "stern_plane_deg")
    limits: dict = field(default_factory=dict)
    n_manoeuvres: int = 1

    def family(self) -> Family:
        """The steps of this option, as many orders a minute whatever the duration."""
        vehicle = self.vehicle()
        limits = usual_limits(vehicle).model_copy(
            update={"duration_s": DURATION_S, "share_of_draws": 0.0} | self.limits
        )
        limits = Limits(**limits.model_dump(exclude_none=True) | _sizes(vehicle))
        chosen: tuple[Control, ...] = tuple(c for c in controls(vehicle, limits) if c.column in self.moved)
        n_knots = round(KNOTS * limits.duration_s / DURATION_S)
        return Family("steps", vehicle, limits, chosen, n_knots=n_knots)

    def cost(self, step_s: float, sensors: tuple[Sensor, ...] | None = None) -> Cost:
        """Minus the number of coefficients known to ten per cent, within the limits.

        Parameters
        ----------
        step_s : float
            Integration step.
        sensors : tuple of Sensor, optional
            By default :func:`log_sensors`.
        """
        family = self.family()
        judge = Judge(family.vehicle, sensors or log_sensors(), step_s=step_s)
        nobody = np.empty((0, len(family.vehicle.xi)))
        kept = Range(family.vehicle, family.limits, nobody, None, step_s)
        return Cost(judge, kept, (family,) * self.n_manoeuvres, Known(SHARE))


def _sizes(vehicle: Vehicle) -> dict[str, float]:
    """Limits of the actuators that have none of their own, and how fast they are."""
    if vehicle.actuators.direct:
        return {}
    weight = float(vehicle.body[workspace.WEIGHT])
    ballast, trim, thrust = BALLAST * weight, TRIM_LENGTHS * vehicle.length_m, THRUST * weight
    sizes = {"ballast_n": ballast, "ballast_nps": 2.0 * ballast / BALLAST_S}
    sizes |= {"trim_m": trim, "trim_mps": 2.0 * trim / BALLAST_S}
    return sizes | dict.fromkeys(("side_nps", "lift_nps"), thrust / THRUST_S)


@cache
def log_sensors(thinned: int = 1) -> tuple[Sensor, ...]:
    """A Doppler log (5 mm/s), gyros (0.01 deg/s), attitude (0.05 deg) and depth (0.1 m), once a second.

    `thinned` takes one reading in so many, with as many times the weight: it tells nearly the same and is faster.
    """
    share, every = 1.0 / np.sqrt(thinned), {"interval_s": float(thinned)}
    dvl, ins = DVL(sd_mps=0.005 * share, **every), INS(sd_deg=0.05 * share, sd_degps=0.01 * share, **every)
    return flat((dvl, ins, Pressure(sd_m=0.1 * share, **every)))


PLANES = Option.moved
OPTIONS: dict[str, Option] = {
    "planes": Option("Rudder, bow and stern planes, constant propeller speed, ten minutes."),
    "no bow planes": Option("Without bow planes.", moved=("rudder_deg", "stern_plane_deg")),
    "rpm": Option("The propeller speed changes too, between half and all of it.", moved=(*PLANES, RPM)),
    "ballast": Option("A tank of 0.5 % of the weight to either side.", equipped, (*PLANES, "ballast_n")),
    "trim": Option("Trim by 0.2 % of the length.", equipped, (*PLANES, "trim_m")),
    "ballast and trim": Option("Both.", equipped, (*PLANES, "ballast_n", "trim_m")),
    "known push": Option("Thrusters at the bow of 0.1 % of the weight.", equipped, (*PLANES, "side_n", "lift_n")),
    "faster": Option("Ten instead of 7.5 m/s.", lambda: replace(load_vehicle(BOAT), speed_mps=10.0)),
    "slower": Option("Five instead of 7.5 m/s.", lambda: replace(load_vehicle(BOAT), speed_mps=5.0)),
    "20 minutes": Option("Twice as long.", limits={"duration_s": 2.0 * DURATION_S}),
    "40 minutes": Option("Four times as long.", limits={"duration_s": 4.0 * DURATION_S}),
    "two manoeuvres": Option("Two, designed together.", n_manoeuvres=2),
    "three manoeuvres": Option("Three, designed together.", n_manoeuvres=3),
    "everything": Option("All controls, ten minutes.", equipped, (*PLANES, RPM, *EXTRAS)),
}


def best(
    name: str, seed: int, n_judgements: int, step_s: float, thinned: int = THINNED, **options: object
) -> tuple[Cost, Found]:
    """The cost of an option with all readings, and the best manoeuvres that a search finds.

    Parameters
    ----------
    name : str
        Of :data:`OPTIONS`.
    seed : int
    n_judgements : int
    step_s : float
        Integration step.
    thinned : int
        One reading in so many is judged in the search.
    **options : object
        Of :func:`bayesub.design.search.search`.
    """
    option = OPTIONS[name]
    cost = option.cost(step_s, log_sensors(thinned))
    found = search(cost, np.random.default_rng(seed), n_judgements=n_judgements, **options)
    return option.cost(step_s), found
