"""A designed trial, judged: what is expected of it, of the standard manoeuvre, and of any manoeuvre."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesub.design import worth
from bayesub.design.families import Family
from bayesub.design.information import SHARES, Information
from bayesub.design.judge import Judge
from bayesub.design.limits import Margin, Range
from bayesub.design.plan import Plan
from bayesub.design.prescription import TANK_SD, Asked, further_instruments
from bayesub.design.search import Found
from bayesub.design.worth import unlocking
from bayesub.inference.identifiability import NullSpace, null_space
from bayesub.io import templates
from bayesub.io.atomic import finite
from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.problem.joint import JointProblem

STANDARD = {None: "coupled", "horizontal": "horizontal", "vertical": "vertical"}  # manoeuvre of each sub-problem
N_DRAWS = 8  # boats of the prior at which the expected sds are looked at too
N_TANK = 5  # values from a towing tank that would determine most of what the trial leaves unknown
_PARTS = 10  # of a manoeuvre, at whose ends it is said what is known
_WILD = (0.3, 1.0)  # shares of the range of the controls, of manoeuvres that need not keep any limit
_SEED = 101  # of these manoeuvres


@dataclass(frozen=True)
class DesignedTrial:
    """A set of manoeuvres, judged."""

    plan: Plan  # what was searched
    searches: dict[str, Found]  # family -> its search
    kind: str  # the family of the manoeuvres
    manoeuvres: tuple[Manoeuvre, ...]
    goal: str  # what was asked for, in words
    inputs: dict  # everything that the design depends on, as JSON types
    asked: tuple[Asked, ...] = ()  # by name

    @property
    def judge(self) -> Judge:
        """The judge of the plan."""
        return self.plan.judge

    @cached_property
    def before(self) -> Information:
        """The information before the trial."""
        return self.judge.empty()

    @cached_property
    def after(self) -> Information:
        """The expected information at the values of the vehicle."""
        return self._of(self.judge)[0]

    @cached_property
    def on_draws(self) -> list[Information]:
        """The same at boats that the prior holds possible."""
        return self._of(replace(self.judge, draws=self.plan.range.sets[1 : N_DRAWS + 1]))

    def _of(self, judge):
        return [_total(parts) for parts in zip(*map(judge.information, self.manoeuvres), strict=True)]

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
        n = len(self.manoeuvres)
        return replace(information, gram=n * information.gram, apart=n * information.apart)

    @property
    def share(self) -> float:
        """Of a value, to which coefficients are counted as known."""
        return getattr(self.plan.goal, "share", 0.10)

    def measure(self, information: Information) -> float:
        """What is compared: known coefficients, or per cent of the sds before that are left of what was asked for."""
        if self.judge.rival is not None:
            return float(np.sqrt(information.apart))
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
        worths = {f"without {c}": _total(of[c] for of in without) for c in without[0]} if len(without[0]) > 1 else {}
        extra = {f"with {name}": sensors for name, sensors in further_instruments(self.judge).items()}
        more = [worth.further_sensors(self.judge, manoeuvre, extra) for manoeuvre in self.manoeuvres]
        return worths | {name: _total(of[name] for of in more) for name in extra}

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
    """The joint information of independent trials."""
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
    return null_space(problem, judge.parameters(problem, judge.vehicle.xi))


def numbers(design: DesignedTrial) -> dict:
    """Everything that the page says, as JSON types."""
    judge, after, given, standard = design.judge, design.after, design.after_standard, design.standard
    found = design.searches[design.kind]
    content = {
        "vehicle": judge.vehicle.name,
        "goal": design.goal,
        "answer": sentence(design),
        "inputs": design.inputs,
        "duration_s": [manoeuvre.duration for manoeuvre in design.manoeuvres],
        "step_s": judge.step_s,
        "family": design.kind,
        "numbers": found.numbers.tolist(),
        "controls": {
            c.column: {"rest": c.rest, "lower": c.lower, "upper": c.upper, "rate": c.rate}
            for c in design.plan.family(design.kind).controls
        },
        "before": criteria(design.before, None),
        "apart": None if judge.rival is None else {"sds": float(np.sqrt(after.apart)), "power": after.power},
        "standard": {"manoeuvre": standard.name} | criteria(given, design.unique) if given and standard else None,
        "after": criteria(after, design.structural),
        "on_boats_of_the_prior": {
            f"known_to_{100 * share:g}_percent": [information.n_known(share) for information in design.on_draws]
            for share in SHARES
        },
        "asked_for": [
            {
                **{key: getattr(asked, key) for key in ("name", "unit", "value")},
                "sd_before": design.before.prior_sd_of(asked.gradient),
                "sd_standard": None if given is None else given.sd_of(asked.gradient),
                "sd_after": after.sd_of(asked.gradient),
            }
            for asked in design.asked
        ],
        "share": design.share,
        "measure": measure_label(design),
        "by_minute": {f"{minute:.4g}": design.measure(one) for minute, one in design.minutes.items()},
        "by_sensor": {name: design.measure(one) for name, one in design.sensors.items()},
        "towing_tank": [
            {"name": v.name, "n_known": v.n_known, "gain": v.gain, "half_gain_sd": v.half_gain_sd}
            for v in unlocking(after, TANK_SD, N_TANK, share=design.share)
        ],
        "coefficients": _coefficients(design),
        "orders": _orders(design),
        "margins": [[_margin(one) for one in margins] for margins in design.margins],
        "out_of_reach": [dict(vector) for vector in design.structural.vectors],
        "ranks": {axis: rank.summary() for axis, rank in design.unique.ranks.items()},
        "families": list(design.plan.families),
        "searches": {
            kind: {"n_judgements": one.n_judgements, "cost": one.cost, "best": one.best.tolist()}
            for kind, one in design.searches.items()
        },
    }
    return finite(content)


def _margin(one: Margin) -> dict:
    reached = {"reached": float(one.reached[0]), "excess": float(one.excess[0])}
    return {"limit": one.key, "value": one.limit} | reached | {"share_of_boats_within": one.share_within}


def _orders(design: DesignedTrial) -> list[dict]:
    """What a helmsman orders when, of each manoeuvre; empty if the family is not one of steps."""
    tables = []
    for orders in design.plan.cost(design.kind).orders(design.searches[design.kind].numbers):
        if orders:
            times = next(iter(orders.values()))[0]
            rows = np.column_stack([times, *(values for _, values in orders.values())])
            tables.append({"columns": ["time_s", *orders], "rows": rows.tolist()})
    return tables


def criteria(information: Information, null: NullSpace | None) -> dict:
    """Counts and criteria of an information."""
    optimality = {"D": information.d_optimality, "A": information.a_optimality, "n_sharper": information.n_sharper}
    if null is not None:
        optimality |= {"E": information.e_optimality(len(null)), "n_null": len(null)}
    return {f"known_to_{100 * share:g}_percent": information.n_known(share) for share in SHARES} | optimality


def _coefficients(design) -> list[dict]:
    before, after, given = design.before, design.after, design.after_standard
    spread = np.array([information.posterior_sd for information in design.on_draws])
    return [
        {
            "name": name,
            "value": float(after.values[k]),
            "sd_before": float(before.posterior_sd[k]),
            "sd_standard": None if given is None else float(given.posterior_sd[k]),
            "sd_after": float(after.posterior_sd[k]),
            "sd_after_least": float(spread[:, k].min()),
            "sd_after_most": float(spread[:, k].max()),
        }
        for k, name in enumerate(after.names)
    ]


def sentence(design: DesignedTrial) -> str:
    """The answer with its numbers; what was asked for by name comes first."""
    counts = [information.n_known(design.share) for information in design.on_draws]
    beyond = [margin.excess[1:] for margins in design.margins for margin in margins]
    values = {"counts": counts, "n_null": len(design.structural), "excess": np.max(beyond, axis=0) if beyond else None}
    values |= {"broken": [margin for margins in design.margins for margin in margins if margin.excess[0] > 0.0]}
    return " ".join(templates.fill("bayesub.findings", "designed_trial.txt", design=design, **values).split())


def measure_label(design: DesignedTrial) -> str:
    """The name of :meth:`DesignedTrial.measure`."""
    if design.judge.rival is not None:
        return f"sds from {design.judge.rival.vehicle.name}"
    if design.asked:
        return "sd of what was asked for (% of that before)"
    return f"coefficients known to {100 * design.share:g} %"
