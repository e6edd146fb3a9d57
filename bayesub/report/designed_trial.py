"""A designed trial, judged: what is expected of it, of the standard manoeuvre, and of any manoeuvre."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bayesub.design.families import Family
from bayesub.design.information import Information
from bayesub.design.judge import Judge
from bayesub.design.limits import Range
from bayesub.design.plan import Plan
from bayesub.design.search import Found
from bayesub.identifiability import NullSpace, null_space
from bayesub.io.errors import InputError
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.problem.joint import JointProblem

STANDARD = {None: "coupled", "horizontal": "horizontal", "vertical": "vertical"}  # manoeuvre of each sub-problem
N_DRAWS = 8  # boats of the prior at which the expected sds are looked at too
_WILD = (0.3, 1.0)  # shares of the range of the controls, of manoeuvres that need not keep any limit
_SEED = 101  # of these manoeuvres


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
    gradients : dict of str to (n,) array
        Coefficient or quantity that was asked for -> gradient by the coefficients.
    units : dict of str to str
        Of these quantities.
    goal : str
        What was asked for, in words.
    inputs : dict
        Everything that the design depends on, as JSON types.
    """

    plan: Plan
    searches: dict[str, Found]
    kind: str
    manoeuvres: tuple[Manoeuvre, ...]
    goal: str
    inputs: dict
    gradients: dict[str, np.ndarray] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)

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
        return [sum(rest, first) for first, *rest in zip(*by_trial, strict=True)]

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
