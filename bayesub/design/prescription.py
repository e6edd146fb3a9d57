"""What to measure or fly next, to know better what is asked for.

The posterior of a run is the prior of what comes next, and each way is judged by exact Jacobians at its mean, in the
normal approximation: the last trial again, as it was or with one more instrument, and a coefficient from a towing tank.
Other manoeuvres are ready-made or searched for (:mod:`bayesub.design.plan`). Errors of trials are independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesub.design.information import Information, Sharpest
from bayesub.design.judge import Judge
from bayesub.design.worth import further_sensors
from bayesub.io.errors import InputError, check_known
from bayesub.logs.log_files import STATES
from bayesub.model import quantities
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.problem.nuisance import MOVING
from bayesub.sensors import DVL, INS, Track, flat
from bayesub.sensors.sensor import QUANTITIES, Sensor

N_ASKED = 5  # coefficients, if none are named: those that the trial again would see most of
TANK_SD = 0.05  # relative sd of a value from a towing tank
AGAIN = "the last trial again"
EXACT = 1e-4  # relative sd of a quantity, before any trial, below which it depends on nothing that is unknown
FURTHER = {  # instruments that a boat may not have, as good as they are in trials
    "position to 1 m": Track(position_sd_m=1.0, attitude_sd_deg=1.0, channels=("x", "y")),
    "heading to 0.05 deg": INS(sd_deg=0.05, channels=("yaw",)),
    "linear accelerations to 2 mm/s²": INS(sd_mps2=0.002, channels=("udot", "vdot", "wdot")),
    "rates to 0.001 deg/s": INS(sd_degps=0.001, channels=("p", "q", "r")),
    "a Doppler log of 1 mm/s": DVL(sd_mps=0.001),
}


@dataclass(frozen=True)
class Asked:
    """A coefficient or quantity that was asked for by name."""

    name: str
    unit: str
    value: float  # at the coefficients of the vehicle
    gradient: np.ndarray  # (n,), by the coefficients


@dataclass(frozen=True)
class Prescription:
    """Ways to know better what is asked for."""

    judge: Judge  # whose prior is the posterior of the run
    again: Manoeuvre  # of the last trial
    asked: tuple[Asked, ...]  # the n coefficients and quantities
    ways: dict[str, Information]  # what to do -> what is known then, the best first

    @property
    def goal(self) -> Sharpest:
        """What is to become small."""
        return Sharpest([one.gradient for one in self.asked])

    @cached_property
    def before(self) -> np.ndarray:
        """(n,) sds by the run, each in its unit."""
        return np.array([self.judge.empty().prior_sd_of(one.gradient) for one in self.asked])

    @cached_property
    def after(self) -> dict[str, np.ndarray]:
        """What to do -> (n,) expected sds."""
        return {way: np.array([known.sd_of(one.gradient) for one in self.asked]) for way, known in self.ways.items()}

    def with_ways(self, ways: dict[str, Information]) -> "Prescription":
        """The same with some ways more."""
        return replace(self, ways=dict(sorted((self.ways | ways).items(), key=lambda way: self.goal(way[1]))))

    def to_json(self) -> dict:
        """As JSON types, by what is asked for."""
        content = {}
        for k, (one, sd) in enumerate(zip(self.asked, self.before.tolist(), strict=True)):
            after = {way: float(sds[k]) for way, sds in self.after.items()}
            content[one.name] = {"value": one.value, "unit": one.unit, "sd": sd, "after": after}
        return content


def prescribe(judge: Judge, manoeuvre: Manoeuvre, wanted: Sequence[str] = ()) -> Prescription:
    """What a repetition of a trial, an instrument and a tank value would do for the names that are `wanted`.

    By default they are the five coefficients that the trial again would see most of. InputError for an unknown name.
    """
    (again,), empty = judge.information(manoeuvre), judge.empty()
    asked = [asked_by_name(name, judge) for name in dict.fromkeys(wanted)]
    seen = np.argsort(-np.diag(again.gram) * np.diag(empty.covariance))[:N_ASKED]
    asked = asked or [asked_by_name(judge.names[k], judge) for k in seen]
    instruments = further_sensors(judge, manoeuvre, further_instruments(judge))
    tank = {}
    for k, name in enumerate(judge.names):
        gained = empty.with_known([k], TANK_SD).precision - empty.precision
        tank[f"{name} from a tank, to {100 * TANK_SD:g} %"] = replace(empty, gram=gained)
    found = Prescription(judge, manoeuvre, tuple(asked), {AGAIN: again})
    for ways in ({f"the same with {name}": known for name, known in instruments.items()}, tank):
        if ways:
            way = min(ways, key=lambda way: found.goal(ways[way]))
            found = found.with_ways({way: ways[way]})
    return found


def asked_by_name(name: str, judge: Judge, others: Sequence[str] = ()) -> Asked:
    """A coefficient or quantity of a judge by its name; InputError if there is none, which lists `others` too."""
    vehicle = judge.vehicle
    if name in judge.names:
        place, unit = judge.names.index(name), vehicle.equations.term(name).unit or ""
        return Asked(name, unit, judge.values[place], np.eye(len(judge.names))[place])
    if name in vehicle.equations.index:
        what = f"--for {name}: is not among the coefficients to infer of {vehicle.name}"
        raise InputError(f"{what}: it is zero, held, or has no part in the motion", "conflict", "--for")
    if name not in quantities.QUANTITIES:
        valid = (*others, *judge.names, *quantities.QUANTITIES)
        hint = f"quantities are {', '.join(quantities.QUANTITIES)}"
        kinds = "criterion, coefficient or quantity" if others else "coefficient or quantity"
        check_known(name, valid, f"--for {name}: is no {kinds}", hint=hint, key="--for")
    quantity = quantities.QUANTITIES[name]
    if reason := quantity.reason(vehicle):
        raise InputError(f"--for {name}: {vehicle.name} has none: {reason}", "conflict", "--for")
    (value,) = quantity.values(vehicle, vehicle.xi)
    gradient = quantities.gradient(vehicle, quantity, judge.columns)
    if not (np.isfinite(value) and np.isfinite(gradient).all()):
        raise InputError(f"--for {name}: {vehicle.name} does not reach it; ask for another quantity", "limit", "--for")
    if judge.empty().prior_sd_of(gradient) <= EXACT * abs(value):
        text = f"--for {name}: depends on none of the coefficients to infer; ask for another, or change [free]"
        raise InputError(text, "conflict", "--for")
    return Asked(name, quantity.unit, float(value), gradient)


def further_instruments(judge: Judge) -> dict[str, list[Sensor]]:
    """Name of each of :data:`FURTHER` -> its sensors of what moves in the sub-problem, as far as there are any."""
    moving = MOVING.get(judge.vehicle.equations.subproblem(judge.subproblem), STATES)
    extra = {
        name: [sensor for sensor in flat([instrument]) if QUANTITIES[sensor.quantity].changes(moving)]
        for name, instrument in FURTHER.items()
    }
    return {name: sensors for name, sensors in extra.items() if sensors}
