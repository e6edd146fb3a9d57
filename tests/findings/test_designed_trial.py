"""What is unique of designed manoeuvres, where their judge expects the boat."""

from types import SimpleNamespace

import pytest

import bayesub as bs
from bayesub.design.judge import Judge
from bayesub.findings.designed_trial import DesignedTrial
from bayesub.sensors import Track


def conditions_of(boat, **changes):
    """Condition numbers of the equations of each axis, of two manoeuvres."""
    judge = Judge(boat, Track(0.5, 0.1, interval_s=5.0), step_s=2.0, **changes)
    manoeuvres = tuple(bs.load_manoeuvre(name, boat) for name in ("coupled", "random:3"))
    design = DesignedTrial(SimpleNamespace(judge=judge), {}, "steps", manoeuvres, "", {})
    return {axis: rank.condition for axis, rank in design.unique.ranks.items()}


def test_null_directions_are_those_where_nuisance_parameters_are_expected(suboff):
    """At a slow start, of each trial its own, and with a heavy body; and not where the priors have their means."""
    mass = suboff.rigid_body["mass"]
    nuisance = {"u0_mps": bs.priors.normal(7.0, 3.0), "mass_kg": bs.priors.normal(mass, mass)}
    there = {"u0_mps": bs.priors.normal(3.0, 3.0), "mass_kg": bs.priors.normal(1.5 * mass, mass)}
    expected = {name: prior.mean[0] for name, prior in there.items()}
    found = conditions_of(suboff, nuisance=nuisance, expected=expected)
    assert found == pytest.approx(conditions_of(suboff, nuisance=there))
    elsewhere = conditions_of(suboff, nuisance=nuisance)
    assert any(abs(condition / elsewhere[axis] - 1.0) > 0.05 for axis, condition in found.items())
