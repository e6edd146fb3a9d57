"""What manoeuvres tell of the coefficients of a vehicle: random, standard and optimised ones by several sensors.

One simulation serves all sensors. They read at the same times, so that the information of any of them is a weighted
sum of that of single channels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from bayesub.design.families import Family, controls
from bayesub.design.information import Information, Known
from bayesub.design.judge import Judge, Sensed, expected_sd, is_sound
from bayesub.design.limits import Range, usual_limits
from bayesub.design.search import Cost, search
from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.sensors import DVL, INS, Pressure, Sensor, thesis_rounding
from bayesub.sensors.sensor import channel_name, flat
from thesis.cases import time_scale, tracking_range

SHARE = 0.10  # of its value, to which a coefficient is to be known
SHARES = (0.05, SHARE)
STANDARD = ("horizontal", "vertical", "coupled", "comparison", "turning_circle", "zigzag_10_10", "zigzag_20_20")
KINDS = ("steps", "curves", "random")  # of random manoeuvres: two families, and those of thesis section 8.2
LATE = 0.9  # of a step, when a control has come to rest
N_KNOTS = {"steps": 20}  # of a control in a search; steps hold 30 s on suboff, as the thesis's
SMALLEST = 0.05  # of the range of controls, by which a random manoeuvre may be made smaller
TYPICAL = "coupled"  # manoeuvre that decides the integration step of all that are compared
START_SIGMA = 0.15  # of a search that starts at the best random manoeuvre
# One reading in so many is simulated, with as many times the weight, where manoeuvres are compared: a third of the
# time, and on suboff, npsauv and remus100 no count of known coefficients changes.
THINNED = 4


def sensor_sets(boat: Vehicle) -> dict[str, tuple[Sensor, ...]]:
    """Name -> sensors, which read 13.63 times while the boat travels its length: once a second on suboff.

    ``track`` has position to 0.5 m on suboff, in proportion on others, and attitude to 0.1 degrees. ``rounded`` has an
    ADCP and an INS as in thesis section 9.6, with noise of a tenth of the resolution. ``log`` has a Doppler log
    (5 mm/s), gyros (0.01 deg/s), attitude (0.05 deg) and depth (0.1 m).
    """
    interval = time_scale(boat)
    log = (
        DVL(sd_mps=0.005, interval_s=interval),
        INS(sd_deg=0.05, sd_degps=0.01, interval_s=interval),
        Pressure(sd_m=0.1, interval_s=interval),
    )
    rounded = thesis_rounding(interval_s=interval, velocity_sd_mps=1e-3, acceleration_sd_mps2=1e-4)
    return {"track": tuple(flat(tracking_range(boat))), "rounded": tuple(flat(rounded)), "log": tuple(flat(log))}


class Appraiser:
    """Judges manoeuvres of one vehicle for all sets of sensors.

    Parameters
    ----------
    vehicle : str
    """

    def __init__(self, vehicle: str):
        self.boat = load_vehicle(vehicle)
        self.sensors = sensor_sets(self.boat)
        self.limits = usual_limits(self.boat)
        self.range = Range(self.boat, self.limits, np.empty((0, len(self.boat.xi))), None, self.step)

    @cached_property
    def step(self) -> float:
        """Integration step, s, of manoeuvres that are compared: accurate for the sharpest sensors on a typical one."""
        return self.accurate_step(load_manoeuvre(TYPICAL, self.boat))

    def accurate_step(self, manoeuvre: Manoeuvre) -> float:
        """Integration step, s, that is accurate for the sharpest sensors on one manoeuvre."""
        return Judge(self.boat, self.sensors["rounded"]).accurate_step(manoeuvre)

    def unit(self, thinned: int) -> Judge:
        """With each quantity that any sensor reads to one unit of its column, one time in so many."""
        columns = dict.fromkeys(sensor.column for sensors in self.sensors.values() for sensor in sensors)
        units = tuple(Sensor(column, 1.0, interval_s=thinned * time_scale(self.boat)) for column in columns)
        return Judge(self.boat, units, step_s=self.step)

    @cached_property
    def exact(self) -> Judge:
        """With every reading of every quantity."""
        return self.unit(1)

    @cached_property
    def _fast(self) -> Judge:
        return self.unit(THINNED)

    def family(self, kind: str, n_knots: int | None = None) -> Family:
        """A family of manoeuvres within the limits of controls, by default with the knots of searches."""
        moved = controls(self.boat, self.limits)
        return Family(kind, self.boat, self.limits, moved, n_knots=n_knots or N_KNOTS.get(kind, Family.n_knots))

    def information(self, manoeuvre: Manoeuvre) -> dict[str, Information]:
        """Set of sensors -> what they will tell, from one reading in :data:`THINNED`."""
        return self._by_sensors(self._fast, manoeuvre, self.step, float(THINNED))

    def exact_information(self, manoeuvre: Manoeuvre) -> dict[str, Information]:
        """As :meth:`information`, with every reading and an accurate step."""
        return self._by_sensors(self.exact, manoeuvre, self.accurate_step(manoeuvre), 1.0)

    def _by_sensors(self, judge, manoeuvre, step, weight):
        sensed, empty = Sensed(judge, manoeuvre, step), judge.empty()
        grams = {channel: weight * sensed.information(rows)[0].gram for channel, rows in sensed.rows.items()}
        sums = {name: weighted(grams, sensors) for name, sensors in self.sensors.items()}
        return {name: replace(empty, gram=gram if is_sound(gram) else 0.0 * empty.gram) for name, gram in sums.items()}

    def penalty(self, manoeuvre: Manoeuvre) -> float:
        """Zero within the limits."""
        return self.range.penalty(self.range.margins(manoeuvre))

    def manoeuvre(self, spec: dict) -> Manoeuvre:
        """The manoeuvre of a ``name``, of the ``seed`` of a random one, or of ``kind`` and ``numbers``.

        All move in six degrees of freedom.
        """
        if "name" in spec:
            return replace(load_manoeuvre(spec["name"], self.boat), subproblem=None)
        if "seed" in spec:
            return self.random(spec["seed"])[1]
        return self.family(spec["kind"]).manoeuvre(np.array(spec["numbers"]))

    def random(self, seed: Sequence[int]) -> tuple[str, Manoeuvre]:
        """Kind and manoeuvre; the last of the seeds deals the kinds.

        Amplitudes of the two families are scaled by a random share of the range of the controls, because almost no
        manoeuvre of full amplitude keeps the limits.
        """
        rng, kind = np.random.default_rng(seed), KINDS[seed[-1] % len(KINDS)]
        if kind == "random":
            return kind, load_manoeuvre(f"random:{seed[-1]}", self.boat)
        family = self.family(kind, Family.n_knots)
        return kind, family.manoeuvre(SMALLEST ** rng.uniform(0.0, 1.0) * family.start(rng))

    def numbers_like(self, manoeuvre: Manoeuvre, kind: str) -> np.ndarray:
        """(n_dims,) numbers of steps or curves that follow a manoeuvre: its values late in each step, or at knots."""
        family = self.family(kind)
        n = family.n_dims // len(family.controls)
        shares = (np.arange(n) + LATE) / n if kind == "steps" else np.linspace(0.0, 1.0, n)
        histories = manoeuvre.log
        shorts = {member.column: member.short for member in self.boat.actuators.members}
        rows = []
        for control in family.controls:
            middle, half = 0.5 * (control.upper + control.lower), 0.5 * (control.upper - control.lower)
            values = histories[shorts.get(control.column, control.column)]
            rows.append((np.interp(shares * manoeuvre.duration, manoeuvre.times, values) - middle) / half)
        return np.clip(np.concatenate(rows), -1.0, 1.0)

    def standard(self) -> tuple[str, ...]:
        """Names of the built-in manoeuvres that the vehicle can fly."""
        names = []
        for name in STANDARD:
            try:
                load_manoeuvre(name, self.boat)
            except InputError:  # for another kind of vehicle
                continue
            names.append(name)
        return tuple(names)


@cache
def appraiser_of(vehicle: str) -> Appraiser:
    """The appraiser of a vehicle, made once in a process."""
    return Appraiser(vehicle)


@dataclass(frozen=True)
class SensorSet:
    """The judge of a search, by one set of sensors.

    Attributes
    ----------
    appraiser : Appraiser
    sensors : str
    """

    appraiser: Appraiser
    sensors: str

    def information(self, manoeuvre: Manoeuvre) -> list[Information]:
        """What a manoeuvre tells, as :meth:`bayesub.design.judge.Judge.information`."""
        return [self.appraiser.information(manoeuvre)[self.sensors]]


def weighted(grams: dict[str, np.ndarray], sensors: Sequence[Sensor]) -> np.ndarray:
    """(n, n) information of sensors from that of channels (n, n) read to one unit of their column."""
    return sum(
        grams[channel_name(sensor.quantity)] / expected_sd(sensor.sd, sensor.resolution) ** 2 for sensor in sensors
    )


def random_chunk(vehicle: str, seed: int, size: int, k: int) -> dict:
    """What the random manoeuvres k * size, .., (k + 1) * size - 1 tell, as lists.

    Returns
    -------
    dict
        ``penalty``, and for each set of sensors ``n``, the coefficients that are known, ``cost``, of
        :class:`bayesub.design.information.Known`, and ``d``, the D-optimality; rounded to five digits.
    """
    appraiser, goal = appraiser_of(vehicle), Known(SHARE)
    results = {"penalty": [], **{name: {"n": [], "cost": [], "d": []} for name in appraiser.sensors}}
    for number in range(k * size, (k + 1) * size):
        _, manoeuvre = appraiser.random((seed, number))
        results["penalty"].append(float(f"{appraiser.penalty(manoeuvre):.4g}"))
        for name, information in appraiser.information(manoeuvre).items():
            results[name]["n"].append(information.n_known(SHARE))
            results[name]["cost"].append(round(goal(information), 5))
            results[name]["d"].append(round(float(information.d_optimality), 5))
    return results


def joined(chunks: list[dict]) -> dict:
    """Chunks of :func:`random_chunk` as arrays (n_manoeuvres,)."""
    names = [name for name in chunks[0] if name != "penalty"]
    joined = {"penalty": np.concatenate([chunk["penalty"] for chunk in chunks])}
    for name in names:
        joined[name] = {key: np.concatenate([chunk[name][key] for chunk in chunks]) for key in chunks[0][name]}
    return joined


def ranked(results: dict, sensors: str) -> dict[str, int]:
    """The worst, middle and best random manoeuvre within the limits, and the best of all, by number."""
    within = np.flatnonzero(results["penalty"] == 0.0)
    cost = results[sensors]["cost"]
    order = within[np.argsort(cost[within], kind="stable")]
    numbers = {"worst": order[-1], "middle": order[len(order) // 2], "best": order[0]} if len(order) else {}
    return {key: int(number) for key, number in (numbers | {"best beyond": np.argmin(cost)}).items()}


def optimised(
    vehicle: str,
    sensors: str,
    kind: str,
    seed: Sequence[int],
    n_judgements: int,
    start: Sequence[int],
    saved: Path | None = None,
) -> dict:
    """The best manoeuvre that a search of a family finds within the limits.

    Parameters
    ----------
    vehicle, sensors, kind : str
    seed : sequence of int
        Of the search.
    n_judgements : int
    start : sequence of int
        Seed of the random manoeuvre that it begins with, as far as the family can follow it.
    saved : Path, optional
        File of costs from which a search that was killed, or one of fewer judgements, continues.

    Returns
    -------
    dict
        ``numbers``, ``cost``, ``n_judgements`` and ``best``, the cost after each twentieth of the generations.
    """
    appraiser = appraiser_of(vehicle)
    cost = Cost(SensorSet(appraiser, sensors), appraiser.range, (appraiser.family(kind),), Known(SHARE))
    first = appraiser.numbers_like(appraiser.random(start)[1], kind)
    rng = np.random.default_rng(seed)
    result = search(cost, rng, n_judgements=n_judgements, start=first, sigma=START_SIGMA, saved=saved)
    looks = np.linspace(0, len(result.best) - 1, min(20, len(result.best))).astype(int)
    return {
        "kind": kind,
        "numbers": [float(f"{x:.4g}") for x in result.numbers],
        "cost": result.cost,
        "n_judgements": result.n_judgements,
        "best": [round(float(x), 3) for x in result.best[looks]],
    }
