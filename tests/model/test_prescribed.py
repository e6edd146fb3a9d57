"""Prescribed angles: the boat follows them exactly, and only the other equations are left."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.logs import log_files
from bayesub.model.prescribed import Prescribed, smoothed
from bayesub.model.simulator import Simulator

TIMES = np.linspace(0.0, 300.0, 301)
THETA, Q, U, W = log_files.positions("theta", "q", "u", "w")


def wave(times):
    """A pitch of a glider that turns from descent to ascent."""
    return 0.38 * np.tanh((times - 150.0) / 8.0) + 0.01 * np.sin(times)


@pytest.fixture(scope="module")
def glider():
    """The glider of the built-in log."""
    return bs.load_vehicle("slocum_comet")


@pytest.fixture(scope="module")
def cast(glider):
    """A descent and an ascent of it, with a prescribed pitch."""
    values = np.column_stack([2.2 * np.tanh((TIMES - 140.0) / 10.0), TIMES / 100.0, TIMES / 100.0])
    start = np.eye(12)[U] * 0.32
    return bs.Manoeuvre(
        "cast",
        TIMES,
        np.empty((len(TIMES), 0)),
        np.full(len(TIMES), 0.32),
        start,
        subproblem="vertical",
        columns=(),
        inputs=values,
        input_columns=glider.actuators.shorts,
        prescribed=(Prescribed("pitch", wave),),
    )


def test_boat_follows_the_angle(glider, cast):
    """Angle and rate are those of the spline at every step, also where nothing else balances the moments."""
    states, status = Simulator(glider, cast, TIMES, dt=0.5).run(glider.xi)
    assert status[0] == 0
    np.testing.assert_allclose(states[0, :, THETA], wave(TIMES), rtol=0, atol=1e-9)
    rates = (wave(TIMES + 1e-5) - wave(TIMES - 1e-5)) / 2e-5
    np.testing.assert_allclose(states[0, :-1, Q], rates[:-1], rtol=0, atol=1e-3)


def test_flight_is_that_of_a_boat_that_pitches_so_by_itself(suboff):
    """With the pitch that it flew prescribed a free boat flies the same track; moments play no part any more."""
    dive = bs.load_manoeuvre("vertical", suboff)
    times = np.arange(0.0, 200.0, 0.5)
    free = Simulator(suboff, dive, times, dt=0.25).run(suboff.xi)[0][0]
    fine = np.arange(0.0, 201.0, 0.25)
    pitch = Simulator(suboff, dive, fine, dt=0.25).run(suboff.xi)[0][0][:, THETA]
    followed = replace(dive, prescribed=(Prescribed("pitch", lambda at: np.interp(at, fine, pitch)),))
    xi = suboff.xi.copy()
    xi[suboff.equations.columns(["Muu_ds"])] = 0.0
    states = Simulator(suboff, followed, times, dt=0.25).run(xi)[0][0]
    travelled = np.linalg.norm(free[-1, :3] - free[0, :3])
    assert np.linalg.norm(states[:, :3] - free[:, :3], axis=1).max() < 1e-4 * travelled
    assert not {"Muu_ds", "Muw", "Mqdot"} & set(suboff.equations.active(None, followed, "vertical"))
    assert {"Zuw", "Xuu"} <= set(suboff.equations.active(None, followed, "vertical"))


def test_sensitivities_are_those_of_the_flight(glider, cast):
    """By coefficients, mass, volume, compressibility, ballast and the start, as central differences are."""
    rng = np.random.default_rng(3)
    sensors = [bs.sensors.Sensor("depth_m", sd=0.1), bs.sensors.Sensor("u_mps", sd=0.01)]
    record = bs.observe(bs.simulate(glider, cast, dt=0.5), sensors, rng)
    nuisance = {
        "weighed_mass_kg": bs.priors.normal(70.0, 0.1),
        "volume_cm3": bs.priors.normal(70e6 / 1004.0, 100.0),
        "compressibility_per_bar": bs.priors.normal(5e-5, 2e-5),
        "scale_ballast": bs.priors.normal(1.0, 0.01),
        "w0_mps": bs.priors.normal(0.0, 0.01),
    }
    prior = bs.priors.relative_normal(0.1)
    problem = bs.Problem(glider, cast, record, free=["Xuu", "Zuw", "Muw"], prior=prior, nuisance=nuisance, dt=0.5)
    assert problem.names == ("Xuu", "Zuw", *nuisance)
    at = problem.prior.mean
    jacobian = problem.jacobian(at)
    for k, sd in enumerate(problem.prior.sd):
        step = 1e-3 * sd * np.eye(len(at))[k]
        ahead, behind = problem.residuals(np.array([at + step, at - step]))
        np.testing.assert_allclose(jacobian[:, k], (ahead - behind) / (2e-3 * sd), rtol=1e-5, atol=1e-5 / sd)


def test_start_of_a_prescribed_angle_is_no_parameter(glider, cast):
    """It follows from the angle."""
    record = bs.observe(bs.simulate(glider, cast, dt=0.5), [bs.sensors.Sensor("depth_m", sd=0.1)], None)
    nuisance, prior = {"pitch0_deg": bs.priors.normal(0.0, 1.0)}, bs.priors.relative_normal(0.1)
    with refused("conflict", "pitch0_deg"):
        bs.Problem(glider, cast, record, free=["Xuu"], prior=prior, nuisance=nuisance)


def test_angle_is_smoothed_by_its_noise():
    """The residuals have the given size, and what is left is nearer to the truth than the readings."""
    rng = np.random.default_rng(1)
    truth = 0.38 * np.tanh((TIMES - 150.0) / 8.0)
    readings = truth + 0.002 * rng.standard_normal(len(TIMES))
    angle = smoothed("pitch", TIMES, readings, 0.002)
    assert np.std(angle.of(TIMES) - readings) == pytest.approx(0.002, rel=0.02)
    assert np.std(angle.of(TIMES) - truth) < 0.0014
    ends = angle.of(np.array([300.0, 301.0, 302.0]))
    assert np.diff(ends)[0] == pytest.approx(np.diff(ends)[1])  # straight on after the last reading


@pytest.mark.parametrize(
    ("angle", "plane", "kind", "key"),
    [("yaw", "vertical", "conflict", "yaw"), ("roll", "vertical", "unknown", "roll")],
)
def test_angle_that_cannot_be_prescribed(glider, cast, angle, plane, kind, key):
    """Roll, and an angle of another plane than that of the trial."""
    manoeuvre = replace(cast, subproblem=plane, prescribed=(Prescribed(angle, wave),))
    with refused(kind, key):
        Simulator(glider, manoeuvre, TIMES, dt=0.5)
