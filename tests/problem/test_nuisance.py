"""Nuisance parameters: what else moves the readings, and what derivatives say of it."""

from dataclasses import replace

import numpy as np
import pytest
from support import gradients
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.kernels import workspace
from bayesub.logs.log_files import STATES
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem.likelihoods import AR1, StudentT, UnknownSd
from bayesub.problem.priors import log_normal, normal

SENSORS = (
    bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "z", "pitch", "yaw")),
    bs.sensors.DVL(sd_mps=0.01, resolution_mps=0.005, interval_s=3.0),
    bs.sensors.Sensor("p_degps", sd=0.01, interval_s=3.0),
)
NOISE = {"x": StudentT(0.5, 4.0), "y": AR1(0.5, 6.0), "z": UnknownSd(0.5)}
# Every kind, with a prior in its unit.
NUISANCE = {
    "current_north_mps": normal(0.1, 0.3),
    "current_east_mps": normal(-0.2, 0.3),
    "yaw0_deg": normal(0.0, 2.0),
    "u0_mps": normal(7.5, 0.1),
    "q0_degps": normal(0.0, 0.05),
    "mass_kg": normal(1.0e7, 1e5),
    "buoyancy_n": normal(9.8e7, 1e5),
    "Izz_kgm2": normal(6.5e9, 1e8),
    "zG_m": normal(0.23, 0.02),
    "b3": normal(0.005, 1e-4),
    "bias_yaw_deg": normal(0.0, 0.5),
    "bias_u_ground_mps": normal(0.0, 0.01),
    "sd_pitch_deg": log_normal(0.1, 0.5),
    "sd_v_ground_mps": log_normal(0.01, 0.5),
    "sd_x_m": log_normal(0.5, 0.5),
    "dof_x": log_normal(4.0, 0.4),
    "sd_y_m": log_normal(0.5, 0.5),
    "correlation_time_y_s": log_normal(6.0, 0.5),
}


@pytest.fixture(scope="module")
def problem(full, coupled):
    """The full boat in six degrees of freedom with every kind of nuisance parameter."""
    flown = bs.simulate(full, coupled, dt=0.25)
    record = bs.observe(flown, SENSORS, np.random.default_rng(5), current_mps=(0.1, -0.2))
    prior = bs.priors.relative_normal(0.2)
    return bs.Problem(
        full, coupled, record, free=["Xuu", "Yuv", "Nur"], prior=prior, nuisance=NUISANCE, noise=NOISE, dt=0.25
    )


@pytest.fixture
def parameters(problem, rng):
    return problem.prior.parameters(0.3 * rng.standard_normal(problem.n_params))


def test_gradient(problem, parameters):
    """J'z is the gradient of minus the log likelihood by every parameter, whatever it moves."""
    gradient, expected = gradients.both(problem, parameters, 1e-3)
    # sgn(v) and sgn(w) jump a little earlier or later in six degrees of freedom, which differences see.
    np.testing.assert_allclose(gradient, expected, rtol=2e-3, atol=1e-6 * np.abs(expected).max())


def test_residuals_about_a_place_follow_the_deviance(problem, rng):
    """Moving the parameters of the noise alone, they are off by third order: an eighth at half the way.

    Negative control: the residuals with the noise of where they are, are off by first order.
    """
    centre = problem.reference
    noise = np.array([name.startswith(("sd_", "dof_", "correlation_time_")) for name in problem.names])
    towards = np.where(noise, rng.uniform(0.05, 0.1, problem.n_params), 0.0)
    moved = centre * np.exp(np.array([[0.0], [0.5], [1.0]]) * towards)

    def excess(residuals):
        off = np.sum(residuals**2, axis=1) + 2.0 * problem.log_likelihood(moved)
        return off[1:] - off[0]

    residuals, log_likelihoods = problem.misfit_about(centre, moved)
    np.testing.assert_array_equal(log_likelihoods, problem.log_likelihood(moved))
    half, whole = excess(residuals)
    assert whole / half == pytest.approx(8.0, rel=0.2)
    half, whole = excess(problem.residuals(moved))
    assert whole / half < 3.0


def test_prediction_is_that_of_another_boat_in_a_current(problem, full, coupled):
    """Mass, inertia and start in the parameters are those of a boat that has them; a current and a bias add up."""
    values = dict(zip(problem.names, problem.prior.mean, strict=True))
    values |= {"mass_kg": 1.01e7, "Izz_kgm2": 6.4e9, "yaw0_deg": 1.5, "u0_mps": 7.4, "q0_degps": 0.0, "zG_m": 0.2}
    values |= {"buoyancy_n": full.body[workspace.BUOYANCY], "b3": 0.0049, "bias_yaw_deg": 0.25}
    body = dict(zip(workspace.BODY, full.body, strict=True))
    heavier = (1.01e7 - body["mass"]) * 9.81
    body |= {"Izz": 6.4e9, "zG": 0.2, "mass": 1.01e7}
    body["weight"] += heavier
    body["buoyancy"] += heavier
    body["b3"] = 0.0049 * 0.5 * full.water_density_kgm3 * full.length_m**2
    start = coupled.initial_state.copy()
    start[5], start[6] = np.radians(1.5), 7.4
    xi = full.xi.copy()
    xi[problem.columns] = [values[name] for name in problem.names[:3]]
    other = replace(full, body=np.array(list(body.values())), xi=xi)
    flown = bs.simulate(other, replace(coupled, initial_state=start), dt=0.25)
    record = bs.observe(flown, SENSORS, None, current_mps=(values["current_north_mps"], values["current_east_mps"]))
    expected = np.concatenate([c.values + np.radians(0.25) * (c.name == "yaw") for c in record.channels])
    expected[np.concatenate([[c.name == "u_ground"] * len(c.times) for c in record.channels])] += values[
        "bias_u_ground_mps"
    ]
    found = problem.predicted(np.array(list(values.values())))[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)  # outputs of other grids of times, metres


def test_motion_is_over_the_ground(problem, parameters):
    """Positions and bottom-track velocities of the picture are what the channels read, but for the bias."""
    parameters[problem.names.index("bias_u_ground_mps")] = 0.0
    motion, predicted = problem.motion(parameters)[0], problem.predicted(parameters)[0]
    end = 0
    for channel in problem.record.channels:
        part = slice(end, end := end + len(channel.times))
        if channel.over_ground:
            rows = np.searchsorted(problem.simulator.times, channel.times)
            np.testing.assert_allclose(motion[rows, STATES.index(channel.state)], predicted[part], rtol=0, atol=1e-12)


def test_naive_problem_holds_them(problem, parameters):
    """A method that knows no nuisance parameters sees the coefficients alone, the others at their prior means."""
    naive = problem.naive()
    assert naive.names == ("Xuu", "Yuv", "Nur")
    assert naive.n_params == len(naive.prior.mean) == 3
    full_vector = np.concatenate([parameters[:3], problem.prior.mean[3:]])
    np.testing.assert_array_equal(naive.predicted(parameters[:3]), problem.predicted(full_vector))
    assert naive.jacobian(parameters[:3]).shape == (len(problem.readings), 3)


def test_reference_is_the_truth(problem, full):
    """What a synthetic record knows of its trial; else the values of vehicle, manoeuvre and noise model."""
    values = dict(zip(problem.names, problem.reference, strict=True))
    assert (values["current_north_mps"], values["current_east_mps"]) == (0.1, -0.2)
    assert values["bias_yaw_deg"] == 0.0
    assert values["sd_pitch_deg"] == pytest.approx(0.1)
    assert values["mass_kg"] == full.body[0]
    assert values["correlation_time_y_s"] == 6.0


@pytest.fixture(scope="module")
def spiral_problem(suboff, spiral, spiral_track):
    """problem(nuisance, noise) of the spiral tracked to 0.5 m, of which the sensor says 1 m."""
    track = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, track, np.random.default_rng(3))
    prior = bs.priors.relative_normal(0.25)
    return lambda **settings: bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, dt=1.0, **settings)


def test_unknown_sd_sampled_or_integrated_out(spiral_problem):
    """A sd sampled under a wide prior and one integrated out leave the coefficients the same mode and covariance."""
    names = {"x": "sd_x_m", "y": "sd_y_m"}
    wide = {name: log_normal(1.0, 10.0) for name in names.values()}
    sampled = gauss_newton(spiral_problem(nuisance=wide))
    integrated = gauss_newton(spiral_problem(noise={name: UnknownSd(1.0) for name in names}))
    assert sampled.statuses == integrated.statuses == ("converged",)
    n = len(integrated.names)
    sds = np.sqrt(np.diag(integrated.covariance))
    assert np.all(np.abs(sampled.values[:n] - integrated.values) < 0.05 * sds)
    np.testing.assert_allclose(np.sqrt(np.diag(sampled.covariance))[:n], sds, rtol=0.01)
    # 300 readings of sd 0.5 m, of which 21 coefficients take up a few.
    np.testing.assert_allclose(sampled.values[n:], 0.5, atol=4 * 0.5 / np.sqrt(600))
    found = np.sqrt(np.diag(sampled.covariance))[n:]
    np.testing.assert_allclose(found, sampled.values[n:] / np.sqrt(600), rtol=0.05)


def test_a_current_that_is_inferred_does_not_bias(suboff, spiral, spiral_track):
    """In a current of 0.3 m/s the coefficients stay where they are if it is inferred, and move if it is not."""
    track = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, track, np.random.default_rng(3), current_mps=(0.3, -0.1))
    prior = bs.priors.relative_normal(0.25)
    currents = {name: normal(0.0, 1.0) for name in ("current_north_mps", "current_east_mps")}
    aware = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, nuisance=currents, dt=1.0)
    blind = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, dt=1.0)
    fit = gauss_newton(aware)
    errors = (fit.values - aware.reference) / np.sqrt(np.diag(fit.covariance))
    assert np.abs(errors).max() < 4.0
    assert gauss_newton(blind).costs[0] > 10 * fit.costs[0]


@pytest.mark.parametrize(
    ("nuisance", "kind", "key"),
    [
        ("curent_north_mps", "unknown", "curent_north_mps"),
        ("zG_m", "conflict", "zG_m"),
        ("pitch0_deg", "conflict", "pitch0_deg"),
        ("sd_z_m", "unknown", "sd_z_m"),
        ("dof_x", "unknown", "dof_x"),
    ],
)
def test_refused(spiral_problem, nuisance, kind, key):
    with refused(kind, key):
        spiral_problem(nuisance={nuisance: normal(1.0, 1.0)})


def test_a_current_needs_a_channel_that_feels_it(suboff, spiral, spiral_track):
    record = bs.observe(spiral_track, bs.sensors.ADCP(sd_mps=0.01, channels=("u", "v")), np.random.default_rng(3))
    with refused("conflict", "current_north_mps"):
        bs.Problem(
            suboff,
            spiral,
            record,
            free=HORIZONTAL,
            prior=bs.priors.relative_normal(0.25),
            nuisance={"current_north_mps": normal(0.0, 1.0)},
        )


def test_scale_of_a_sensor_multiplies_its_readings(problem, full, coupled):
    """Before the bias is added; its derivative is the reading without it, and those of all else are multiplied.

    Negative control: other channels stay as they are.
    """
    nuisance = {"scale_u_ground": normal(1.0, 0.01), **NUISANCE}
    options = {"prior": problem.spread, "noise": NOISE, "dt": 0.25, "nuisance": nuisance}
    scaled = bs.Problem(full, coupled, problem.record, free=["Xuu", "Yuv", "Nur"], **options)
    at, k = problem.reference, problem.n_coefficients
    (as_read,), (twice,) = problem.predicted(at), scaled.predicted(np.insert(at, k, 2.0))
    bias, own = at[problem.names.index("bias_u_ground_mps")], problem.rows["u_ground"]
    expected = as_read.copy()
    expected[own] = 2.0 * (as_read[own] - bias) + bias
    np.testing.assert_allclose(twice, expected, rtol=1e-14)
    slopes, before = (
        one.forward.slopes(*one.arguments(values[None]), one.names[:k])
        for one, values in ((scaled, np.insert(at, k, 2.0)), (problem, at))
    )
    by_scale = np.zeros(len(slopes))
    by_scale[own] = as_read[own] - bias
    np.testing.assert_allclose(slopes[:, k], by_scale, rtol=1e-12)
    j = problem.names.index("bias_u_ground_mps")
    factors = np.where(np.arange(problem.n_params) == j, 1.0, 2.0)
    np.testing.assert_allclose(np.delete(slopes, k, axis=1)[own], before[own] * factors, rtol=1e-12, atol=1e-12)
    with refused("unknown", "scale_yaw"):  # an angle has a zero of its own choice
        options |= {"nuisance": {"scale_yaw": normal(1.0, 0.1)}}
        bs.Problem(full, coupled, problem.record, free=["Xuu"], **options)


def test_scale_of_a_sensor_is_that_of_all_trials(problem, full, coupled):
    """A second trial does not tell it: one wrong scale makes both wrong."""
    options = {"prior": problem.spread, "dt": 0.25, "nuisance": {"scale_u_ground": normal(1.0, 0.01)}}
    one = bs.Problem(full, coupled, problem.record, free=["Xuu"], **options)
    assert bs.JointProblem({"first": one, "second": one}).names == ("Xuu", "scale_u_ground")


def test_scale_of_the_propeller_is_that_of_its_thrust():
    """Where thrust follows the square of the rpm, 1.21 times the thrust is a log whose rpm is 1.1 times as high."""
    auv = bs.load_vehicle("auv690")
    turn = bs.load_manoeuvre("turning_circle", auv)
    faster = replace(turn, rpm=1.1 * turn.rpm)
    record = bs.observe(bs.simulate(auv, faster, dt=0.1), bs.sensors.DVL(sd_mps=0.01, interval_s=2.0), None)
    options = {"free": ["Xuu"], "prior": bs.priors.relative_normal(0.2), "dt": 0.1}
    problem = bs.Problem(auv, turn, record, nuisance={"scale_propeller": normal(1.0, 0.1)}, **options)
    scaled = np.array([auv.xi[auv.equations.index["Xuu"]], 1.1**2])
    np.testing.assert_allclose(problem.predicted(scaled)[0], record.values, rtol=1e-11, atol=1e-12)
    steps = 1e-4 * np.array([[-2.0], [-1.0], [1.0], [2.0]]) * [0.0, 1.0]
    ends = problem.residuals(scaled + steps)
    difference = (8 * (ends[2] - ends[1]) - (ends[3] - ends[0])) / 1.2e-3
    np.testing.assert_allclose(problem.jacobian(scaled)[:, 1], difference, atol=1e-8 * np.abs(difference).max())
