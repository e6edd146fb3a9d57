"""Ill-conditioning of a case: readings without noise, and results that survive being saved."""

import json

import numpy as np
import pytest

import bayesub as bs
from ill_conditioning import one_case


def test_readings_are_what_the_truth_gives(suboff):
    """The cost at the truth is zero to the last bit, at any time step."""
    truth = bs.simulate(suboff, bs.load_manoeuvre("horizontal", suboff))
    for step in (None, 0.5 * truth.simulator.step):
        problem = one_case.noise_free(truth, ["Xuu", "Nuv"], 1.0, 1.0, 10.0, dt=step)
        assert not problem.residuals(problem.prior.mean[None]).any()
        assert problem.residuals(1.01 * problem.prior.mean[None]).any()


@pytest.fixture(scope="module")
def case():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(one_case, "N_GRID", 3)
        patch.setattr(one_case, "SQP_ITERATIONS", (10,))
        return one_case.analyse("npsauv", "horizontal", converged=10.0)


def test_what_was_saved_draws_the_same(case):
    """Spectrum, contributions, profiles, correlations and force errors come back from numbers and arrays."""
    numbers, arrays = json.loads(json.dumps(case.numbers())), case.arrays()
    assert sum(array.nbytes for array in arrays.values()) < 300_000
    spectrum = one_case.restored_spectrum(numbers, arrays)
    np.testing.assert_array_equal(spectrum.singular_values, case.spectrum.singular_values)
    assert list(spectrum.direction(0)) == list(case.spectrum.direction(0))
    np.testing.assert_array_equal(one_case.restored_contribution(numbers).costs, case.contribution.costs)
    for verdict, profile in one_case.restored_profiles(numbers).items():
        assert profile.value == case.profiles[verdict].value
        np.testing.assert_array_equal(profile.cost, case.profiles[verdict].cost)
    for axis, errors in one_case.restored_cancellation(numbers, arrays).items():
        assert errors.names == case.cancellation[axis].names
        assert errors.ratio == pytest.approx(case.cancellation[axis].ratio, rel=1e-3)  # sums of single precision
        assert list(errors.largest) == list(case.cancellation[axis].largest)
    related = one_case.restored_collinearity(numbers, arrays)
    assert {axis: c.names for axis, c in related.items()} == {a: c.names for a, c in case.collinearity.items()}
