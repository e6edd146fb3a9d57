"""Treatments of towed coefficients."""

import numpy as np

import bayesub as bs
from bayesub.model.coefficients import INDEX
from known_coefficients import towing_tank
from thesis.cases import TOWED


def test_treatments_share_a_record_and_differ_in_what_is_known(rng):
    sensors = bs.sensors.tracking_range(position_sd_m=0.5, interval_s=5.0)
    problems = towing_tank.treatments(sensors, rng, error=0.01, prior_sd=0.25, dt=1.0)
    exact, held, uncertain = (problems[key] for key in (towing_tank.EXACT, towing_tank.HELD, towing_tank.UNCERTAIN))
    np.testing.assert_array_equal(exact.readings, held.readings)
    assert exact.names == held.names == tuple(name for name in uncertain.names if name not in TOWED)
    assert set(exact.names) == set(towing_tank.unknown())
    assert set(uncertain.names) - set(exact.names) == set(TOWED)
    truth = exact.vehicle.xi
    towed = [INDEX[name] for name in TOWED]
    np.testing.assert_array_equal(exact.xi, truth)
    off = np.abs(held.xi[towed] / truth[towed] - 1)
    assert np.all((off > 0) & (off <= 0.01))
    np.testing.assert_array_equal(np.delete(held.xi, towed), np.delete(truth, towed))
    # Whatever the tank measured, the truth is within the prior of who knows its accuracy.
    assert np.isfinite(uncertain.prior.standard(uncertain.reference)).all()
