"""Problems, joint problems and toys have what inference needs."""

import inspect
from types import SimpleNamespace

import numpy as np
import pytest
from support.toys import Banana, Pushed, Toy

import bayesub as bs
from bayesub.inference.checks.discrepancy import _WithAmounts
from bayesub.inference.interface import (
    CostCounter,
    Emulated,
    Forced,
    Identifiable,
    InferencePrior,
    Sampled,
    Searchable,
)
from bayesub.inference.sampling.marginalised import Marginalised
from bayesub.problem import distributions
from bayesub.problem.base import Costs
from bayesub.problem.trial_problem import TrialProblem
from disturbed.innovations import Innovations

PROTOCOLS = (Sampled, Identifiable)
PROBLEMS: tuple[type[Sampled], ...] = (TrialProblem, bs.Problem, bs.JointProblem, Toy)
PRIORS: tuple[type[InferencePrior], ...] = (
    distributions.Normal,
    distributions.LogNormal,
    distributions.Uniform,
    distributions.CorrelatedNormal,
    distributions.Joint,
)


def members(protocol):
    return [name for name in dir(protocol) if not name.startswith("_")]


def positional(function):
    needed = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
    return len([p for p in needed if p.kind is not p.VAR_POSITIONAL])


@pytest.mark.parametrize(
    ("protocol", "classes"), [(Sampled, PROBLEMS), (Identifiable, PROBLEMS), (InferencePrior, PRIORS)]
)
def test_methods_take_what_the_interface_says(protocol, classes):
    """The same number of arguments, for every method of the interface."""
    methods = [name for name in members(protocol) if inspect.isfunction(getattr(protocol, name))]
    assert len(methods) >= 4
    for one in classes:
        for name in methods:
            assert positional(getattr(one, name)) == positional(getattr(protocol, name)), (one, name)


def test_instances_have_every_member(suboff, spiral, spiral_track):
    """Attributes too, of the problem, its views, the joint problem, the toy, their priors and counters."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 20.0), np.random.default_rng(1))
    problem = bs.Problem(suboff, spiral, record, free=("Xuu", "Nuv"), prior=bs.priors.relative_normal(0.1), dt=1.0)
    for one in (problem, problem.naive(), bs.JointProblem({"a": problem}), Banana()):
        assert all(isinstance(one, protocol) for protocol in PROTOCOLS)
        assert isinstance(one.prior, InferencePrior)
        assert isinstance(one.costs, CostCounter)
        assert one.misfit(one.prior.mean[None])[0].shape == (1, len(one.jacobian(one.prior.mean)))
    assert not isinstance(object(), Searchable)
    assert isinstance(Costs(), CostCounter)


def test_what_stands_for_a_problem_is_what_it_claims():
    """The problem without histories is emulated, innovations and amounts are searched, and no more than that."""
    toy = Pushed()
    assert isinstance(toy, Forced)
    marginalised = Marginalised(toy, np.r_[0.4, 1.5, np.zeros(toy.N_WHITE)])
    assert isinstance(marginalised, Emulated)
    assert not isinstance(marginalised, Sampled)
    model = SimpleNamespace(names=("a",), prior=toy.prior, costs=toy.costs)
    amounts = _WithAmounts(SimpleNamespace(costs=toy.costs), 1, {("bias", "x"): np.eye(2)})
    for one in (Innovations(model), amounts):
        assert isinstance(one, Searchable)
        assert not isinstance(one, Emulated)
