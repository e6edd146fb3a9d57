"""A rudder that an autopilot moves is recognised by the log, and one that a plan moves is not taken for it."""

import numpy as np
import pytest
from support import small_study

from bayesub.findings import feedback
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

N, INTERVAL = 400, 1.0  # rows of a log, and seconds between them
GAIN, LAG = 0.3, 2.0  # of the boat: degrees a second for a degree of rudder, seconds (Nomoto et al. 1957)


def turned(rng, rudder=None, noise=0.3):
    """Rudder and heading (N,) in degrees of a log in gusts; without a rudder an autopilot steers to headings of a plan.

    It answers the heading as its compass reads it.
    """
    goals, gusts = np.repeat(rng.uniform(-60.0, 60.0, N // 50), 50), rng.normal(0.0, 0.3, N)
    angles, read, heading, rate = np.zeros(N), np.zeros(N), 0.0, 0.0
    for k in range(N):
        read[k] = heading + noise * rng.standard_normal()
        angles[k] = np.clip(1.0 * (read[k] - goals[k]) + rate, -20.0, 20.0) if rudder is None else rudder[k]
        for _ in range(10):
            rate += 0.1 * INTERVAL * ((-GAIN * angles[k] - rate) / LAG + gusts[k])
            heading += 0.1 * INTERVAL * rate
    return angles, read


def plans(rng):
    """Rudders (N,) that a plan moves: steps, a slow walk, a few sines, a sweep, a sawtooth, each as it is read."""
    times = INTERVAL * np.arange(N)
    walk = np.cumsum(rng.normal(0.0, 1.0, N))
    yield np.repeat(rng.uniform(-20.0, 20.0, N // 20), 20)
    yield 10.0 * walk / np.abs(walk).max()
    yield sum(4.0 * np.sin(2.0 * np.pi * times / period) for period in (6.0, 14.0, 58.0))
    yield 10.0 * np.sin(0.002 * times**2)
    yield 10.0 * np.abs((times / 10.0) % 2.0 - 1.0)


def test_a_plan_is_no_autopilot():
    """None of a hundred, with angles that are read with noise and without."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        for plan in plans(rng):
            for noise in (0.0, 0.1):
                rudder, heading = turned(rng, plan)
                assert feedback.answer(rudder + noise * rng.standard_normal(N), heading)[0] == 0.0


def test_an_autopilot_is_recognised_and_its_own_steps_are_counted():
    """The seven changes of the goal are the steps; a long turn may have two, when the rudder leaves its stop."""
    for seed in range(10):
        correlation, n_steps = feedback.answer(*turned(np.random.default_rng(seed)))
        assert correlation > 0.25
        assert 5 <= n_steps <= 14


def test_a_short_log_and_a_rudder_at_rest_say_nothing():
    rudder, heading = turned(np.random.default_rng(1))
    assert feedback.answer(rudder[:50], heading[:50]) == (0.0, 0)
    assert feedback.answer(np.zeros(N), heading) == (0.0, 0)
    assert feedback.answer(rudder, np.zeros(N)) == (0.0, 0)


@pytest.mark.parametrize("inferred", [False, True])
def test_the_remedy_is_a_moment_and_a_run_without_it(tmp_path, inferred):
    """A study that infers the moment is asked for the run alone, and one whose rudder follows a plan for nothing."""
    sections = {"disturbance": {"axes": ["N"], "sd_nm": 1.0, "correlation_time_s": 20.0}} if inferred else {}
    for rudder, answers in ((None, True), (10.0 * np.sin(np.arange(N) / 9.0), False)):
        columns = np.column_stack([INTERVAL * np.arange(N), *turned(np.random.default_rng(3), rudder)])
        names = "time_s,rudder_deg,heading_deg"
        np.savetxt(tmp_path / "log.csv", columns, delimiter=",", comments="", fmt="%.8g", header=names)
        study = small_study.LOG | {"sensors": [{"kind": "compass", "sd_deg": 0.3}], "dt_s": 1.0} | sections
        text = feedback.advice(prepare(load_study(small_study.write(tmp_path / "study.toml", **study))).problem)
        assert ("rudder_deg answers heading as an autopilot does" in text) == answers
        assert ('axes = ["N"]' in text) == (answers and not inferred)
