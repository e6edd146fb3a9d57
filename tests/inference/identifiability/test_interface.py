"""Problems, joint problems and toys have what inference needs."""

import inspect

import numpy as np
import pytest
from support.toys import Banana, Toy

import bayesub as bs
from bayesub.inference.interface import CostCounter, InferencePrior, InferenceProblem
from bayesub.problem import distributions
from bayesub.problem.base import Costs
from bayesub.problem.trial_problem import TrialProblem

PROBLEMS: tuple[type[InferenceProblem], ...] = (TrialProblem, bs.Problem, bs.JointProblem, Toy)
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
    return len([p for p in inspect.signature(function).parameters.values() if p.default is p.empty])


@pytest.mark.parametrize(("protocol", "classes"), [(InferenceProblem, PROBLEMS), (InferencePrior, PRIORS)])
def test_methods_take_what_the_interface_says(protocol, classes):
    """The same number of arguments, for every method of the interface."""
    methods = [name for name in members(protocol) if inspect.isfunction(getattr(protocol, name))]
    assert len(methods) >= 8
    for one in classes:
        for name in methods:
            assert positional(getattr(one, name)) == positional(getattr(protocol, name)), (one, name)


def test_instances_have_every_member(suboff, spiral, spiral_track):
    """Attributes too, of the problem, its views, the joint problem, the toy, their priors and counters."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 20.0), np.random.default_rng(1))
    problem = bs.Problem(suboff, spiral, record, free=("Xuu", "Nuv"), prior=bs.priors.relative_normal(0.1), dt=1.0)
    for one in (problem, problem.naive(), bs.JointProblem({"a": problem}), Banana()):
        assert isinstance(one, InferenceProblem)
        assert isinstance(one.prior, InferencePrior)
        assert isinstance(one.costs, CostCounter)
        assert one.misfit(one.prior.mean[None])[0].shape == (1, len(one.jacobian(one.prior.mean)))
    assert not isinstance(object(), InferenceProblem)
    assert isinstance(Costs(), CostCounter)
