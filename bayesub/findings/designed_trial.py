"""A designed trial, judged: what is expected of it, of the standard manoeuvre, and of any manoeuvre."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesub.design import worth
from bayesub.design.families import Family
from bayesub.design.information import Information
from bayesub.design.judge import Judge
from bayesub.design.limits import Range
from bayesub.design.plan import Plan
from bayesub.design.search import Found
from bayesub.design.worth import TankValue, unlocking
from bayesub.inference.identifiability import NullSpace, null_space
from bayesub.io.errors import InputError
from bayesub.logs.log_files import STATES
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.problem.joint import JointProblem
from bayesub.problem.nuisance import MOVING
from bayesub.sensors import DVL, INS, Track, flat
from bayesub.sensors.sensor import QUANTITIES

STANDARD = {None: "coupled", "horizontal": "horizontal", "vertical": "vertical"}  # manoeuvre of each sub-problem
N_DRAWS = 8  # boats of the prior at which the expected sds are looked at too
FURTHER = {  # instruments that a boat may not have, as good as they are in trials
    "position to 1 m": Track(position_sd_m=1.0, attitude_sd_deg=1.0, channels=("x", "y")),
    "heading to 0.05 deg": INS(sd_deg=0.05, channels=("yaw",)),
    "linear accelerations to 2 mm/s²": INS(sd_mps2=0.002, channels=("udot", "vdot", "wdot")),
    "rates to 0.001 deg/s": INS(sd_degps=0.001, channels=("p", "q", "r")),
    "a Doppler log of 1 mm/s": DVL(sd_mps=0.001),
}
TANK_SD, N_TANK = 0.05, 5  # relative sd of a value from a towing tank, and how many
_PARTS = 10  # of a manoeuvre, at whose ends it is said what is known
_WILD = (0.3, 1.0)  # shares of the range of the controls, of manoeuvres that need not keep any limit
_SEED = 101  # of these manoeuvres


@dataclass(frozen=True)
class Asked:
    """A coefficient or quantity that was asked for by name.

    Attributes
    ----------
    name, unit : str
    value : float
        At the coefficients of the vehicle.
    gradient : (n,) array
        By the coefficients.
    """

    name: str
    unit: str
    value: float
    gradient: np.ndarray


@dataclass(frozen=True)
class DesignedTrial:
    """A set of manoeuvres, judged.

    Attributes
    ----------
    plan : Plan
        What was searched.
    searches : dict of str to Found
        Family -> its search.
    kind : str
        The family of the manoeuvres.
    manoeuvres : tuple of Manoeuvre
    goal : str
        What was asked for, in words.
    inputs : dict
        Everything that the design depends on, as JSON types.
    asked : tuple of Asked
        By name.
    """

    plan: Plan
    searches: dict[str, Found]
    kind: str
    manoeuvres: tuple[Manoeuvre, ...]
    goal: str
    inputs: dict
    asked: tuple[Asked, ...] = ()

    @property
    def judge(self) -> Judge:
        """The judge of the plan."""
        return self.plan.judge

    @cached_property
    def before(self) -> Information:
        """What is known before."""
        return self.judge.empty()

    @cached_property
    def after(self) -> Information:
        """What is expected at the values of the vehicle."""
        return self._of(self.judge)[0]

    @cached_property
    def on_draws(self) -> list[Information]:
        """The same at boats that the prior holds possible."""
        return self._of(replace(self.judge, draws=self.plan.range.sets[1 : N_DRAWS + 1]))

    def _of(self, judge):
        by_trial = [judge.information(manoeuvre) for manoeuvre in self.manoeuvres]
        return [_total(parts) for parts in zip(*by_trial, strict=True)]

    @cached_property
    def standard(self) -> Manoeuvre | None:
        """The standard manoeuvre of the sub-problem; None for a vehicle that does not fly it."""
        return standard(self.judge)

    @cached_property
    def after_standard(self) -> Information | None:
        """What is expected of the standard manoeuvre, flown as often as there are manoeuvres."""
        if self.standard is None:
            return None
        (information,) = replace(self.judge, draws=None).information(self.standard)
        return replace(information, gram=len(self.manoeuvres) * information.gram)

    @property
    def share(self) -> float:
        """Of a value, to which coefficients are counted as known."""
        return getattr(self.plan.goal, "share", 0.10)

    def measure(self, information: Information) -> float:
        """What is compared: known coefficients, or per cent of the sds before that are left of what was asked for."""
        if self.asked:
            return 100.0 * float(np.exp(self.plan.goal(information)))
        return float(information.n_known(self.share))

    @cached_property
    def minutes(self) -> dict[float, Information]:
        """Minutes -> what is known then, of several manoeuvres one after the other."""
        known, begin, by_minute = self.before, 0.0, {0.0: self.before}
        for manoeuvre in self.manoeuvres:
            length = manoeuvre.duration / 60.0
            ends = np.arange(1, _PARTS + 1) / _PARTS * length
            for end, information in worth.by_minute(self.judge, manoeuvre, ends.tolist()).items():
                by_minute[begin + end] = known + information
            known, begin = by_minute[begin + ends[-1]], begin + length
        return by_minute

    @cached_property
    def sensors(self) -> dict[str, Information]:
        """What is changed -> what is known: without each channel, and with each further instrument."""
        without = [worth.by_sensor(self.judge, manoeuvre) for manoeuvre in self.manoeuvres]
        worths = (
            {f"without {c}": _total(of[c].without for of in without) for c in without[0]} if len(without[0]) > 1 else {}
        )
        moving = MOVING.get(self.judge.vehicle.equations.subproblem(self.judge.subproblem), STATES)
        extra = {
            f"with {name}": [sensor for sensor in flat([instrument]) if QUANTITIES[sensor.quantity].changes(moving)]
            for name, instrument in FURTHER.items()
        }
        extra = {name: sensors for name, sensors in extra.items() if sensors}
        more = [worth.further_sensors(self.judge, manoeuvre, extra) for manoeuvre in self.manoeuvres]
        return worths | {name: _total(of[name] for of in more) for name in extra}

    @cached_property
    def tank_values(self) -> list[TankValue]:
        """Values from a towing tank that would tell most of what the trial leaves unknown."""
        return unlocking(self.after, TANK_SD, N_TANK, share=self.share)

    @cached_property
    def margins(self) -> list[list]:
        """The margins of each manoeuvre to each limit."""
        return [self.plan.range.margins(manoeuvre) for manoeuvre in self.manoeuvres]

    @cached_property
    def unique(self) -> NullSpace:
        """The null directions of the designed manoeuvres."""
        return _null_space(self.judge, self.manoeuvres)

    @cached_property
    def structural(self) -> NullSpace:
        """The null directions that stay if wild manoeuvres, which need not keep any limit, are flown too."""
        return structural(self.judge, self.plan.range, self.plan.families, self.manoeuvres)


def _total(parts: Iterable[Information]) -> Information:
    """What independent trials tell together."""
    first, *rest = parts
    return sum(rest, first)


def standard(judge: Judge) -> Manoeuvre | None:
    """The standard manoeuvre of the sub-problem of a judge; None for a vehicle that does not fly it."""
    vehicle = judge.vehicle
    try:
        manoeuvre = load_manoeuvre(STANDARD[vehicle.equations.subproblem(judge.subproblem)], vehicle)
        is_judged = replace(judge, draws=None).information(manoeuvre)[0].gram.any()
    except InputError:
        return None
    return manoeuvre if is_judged else None


def structural(
    judge: Judge, flights: Range, families: Mapping[str, Family], manoeuvres: Sequence[Manoeuvre] = ()
) -> NullSpace:
    """The null directions of some manoeuvres, the standard one and wild ones together: those of the equations."""
    rng, flown = np.random.default_rng(_SEED), [*manoeuvres, standard(judge)]
    for family in families.values():
        flown += [family.manoeuvre(share * family.start(rng)) for share in _WILD]
    complete = [one for one in flown if one is not None and flights.flown(one)[2][0]]
    return _null_space(judge, complete or [next(iter(families.values())).straight()])


def _null_space(judge, manoeuvres) -> NullSpace:
    step = judge.step_s or judge.accurate_step(manoeuvres[0])
    problem = JointProblem({str(k): judge.problem(one, step) for k, one in enumerate(manoeuvres)})
    at = problem.prior.mean.copy()
    at[: problem.n_coefficients] = judge.vehicle.xi[problem.columns]
    return null_space(problem, at)
