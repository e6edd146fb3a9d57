"""The inference problem and the linear form of the equations of motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support.refusals import refused

import bayesub as bs
from bayesub.model.coefficients import HORIZONTAL, INDEX, NAMES, columns
from bayesub.model.linear_form import linear_systems
from bayesub.problem.likelihoods import AR1, Normal, StudentT
from thesis.measured_motion import measure

TRACK = bs.sensors.Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=2.0, channels=("x", "y", "yaw"))


@pytest.fixture(scope="module")
def problem(suboff, spiral, spiral_track):
    record = bs.observe(spiral_track, TRACK, np.random.default_rng(3))
    return bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=bs.priors.relative_normal(0.25), dt=1.0)


@pytest.fixture
def parameters(problem, rng):
    return problem.prior.mean + 0.1 * problem.prior.sd * rng.standard_normal((3, problem.n_params))


def test_coefficients_without_scale_stay_fixed(problem, suboff):
    """The 21 horizontal coefficients that suboff has are free; those that are zero keep that value."""
    zero = {"Yuu", "Yu_absr_dr", "Nuu", "Nu_absr_dr"}
    assert problem.names == tuple(name for name in HORIZONTAL if name not in zero)
    sets = problem.coefficient_sets(problem.prior.mean * 1.1)
    fixed = np.setdiff1d(np.arange(101), problem.columns)
    np.testing.assert_array_equal(sets[0, fixed], suboff.xi[fixed])
    np.testing.assert_array_equal(sets[0, problem.columns], suboff.xi[problem.columns] * 1.1)


def test_predictions_are_the_states_of_a_simulation(problem, parameters, suboff, spiral):
    """Each reading is predicted by the state of its channel at its time."""
    track = bs.simulate(suboff, spiral, xi=problem.coefficient_sets(parameters), dt=1.0, sample=2.0)
    expected = np.concatenate([track.states[:, 1:, k] for k in (0, 1, 5)], axis=1)
    # The same steps, but other output times: equal where those fall on steps of 1 s, up to the rounding of 0.1 * n.
    np.testing.assert_allclose(problem.predicted(parameters), expected, rtol=0, atol=1e-9)


def test_log_prob_is_prior_plus_likelihood(problem, parameters):
    """The posterior density is the product of the densities of scipy."""
    prior = stats.norm.logpdf(parameters, problem.prior.mean, problem.prior.sd).sum(axis=1)
    likelihood = stats.norm.logpdf(problem.readings, problem.predicted(parameters), problem.sds).sum(axis=1)
    np.testing.assert_allclose(problem.log_prior(parameters), prior, rtol=1e-13)
    np.testing.assert_allclose(problem.log_likelihood(parameters), likelihood, rtol=1e-12)
    np.testing.assert_allclose(problem.log_prob(parameters), prior + likelihood, rtol=1e-12)


def test_noise_at_the_truth_is_noise(problem):
    """At the true coefficients the residuals are standard normal."""
    residuals = problem.residuals(problem.prior.mean[None])[0]
    chi2 = residuals @ residuals
    assert abs(chi2 - len(residuals)) < 4 * np.sqrt(2 * len(residuals))


def test_failed_simulations_are_counted_and_impossible(problem, parameters):
    """A coefficient set that diverges has log probability -inf and is counted; its neighbours do not notice."""
    before, failures, evaluations = (
        problem.log_prob(parameters),
        dict(problem.costs.failures),
        problem.costs.simulations,
    )
    parameters[1, problem.names.index("Xuu")] = 0.1
    after = problem.log_prob(parameters)
    np.testing.assert_array_equal(after, [before[0], -np.inf, before[2]])
    assert problem.costs.failures == failures | {"diverged": failures["diverged"] + 1}
    assert problem.costs.simulations == evaluations + 3
    assert np.isnan(problem.predicted(parameters)[1]).all()  # also the readings before the failure


def test_jacobian(problem, parameters):
    """Derivatives agree with central differences at other steps, extrapolated to zero."""

    def central(step):
        offsets = np.diag(step * problem.prior.sd)
        plus, minus = (problem.residuals(parameters[0] + sign * offsets) for sign in (1, -1))
        return (plus - minus) / (2 * step)

    expected = (4 * central(0.004) - central(0.008)).T / 3  # in prior standard deviations
    found = problem.jacobian(parameters[0]) * problem.prior.sd
    # The extrapolation leaves (0.004 x 0.25)^4 of the column, times derivatives that grow along the trial.
    assert np.all(np.abs(found - expected).max(axis=0) < 1e-8 * np.abs(expected).max(axis=0))


@pytest.fixture(scope="module")
def mixed(suboff, spiral, spiral_track):
    """Rounded velocities and accelerations, a track with outliers and a compass with slow errors."""
    sensors = (
        bs.sensors.Sensor("u_mps", sd=0.005, resolution=0.01, interval_s=5.0),
        bs.sensors.Sensor("r_degps", sd=0.02, resolution=0.1, interval_s=3.0),
        bs.sensors.Sensor("vdot_mps2", sd=5e-4, resolution=1e-3, interval_s=5.0),
        bs.sensors.Sensor("x_m", sd=0.5, interval_s=2.5),
        bs.sensors.Sensor("heading_deg", sd=0.3, interval_s=2.0),
    )
    record = bs.observe(spiral_track, sensors, np.random.default_rng(8))
    noise = {"x": StudentT(0.5, 4.0), "heading": AR1(np.radians(0.3), 20.0)}
    prior = bs.priors.relative_normal(0.25)
    return bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, noise=noise, dt=1.0)


def test_channels_have_noise_of_their_own(mixed, parameters):
    """The log likelihood is the sum of the channels', each with its own model."""
    parameters = mixed.prior.mean + 1e-3 * (parameters - mixed.prior.mean)  # near enough for differences of Phi
    predicted = mixed.predicted(parameters)
    parts = mixed.log_likelihoods(parameters)
    assert list(parts) == ["u", "r", "vdot", "x", "heading"]
    np.testing.assert_allclose(mixed.log_likelihood(parameters), sum(parts.values()), rtol=1e-14)
    n = len(mixed.record.channels[0].times)
    below, above = ((mixed.readings[:n] + half - predicted[:, :n]) / 0.005 for half in (-0.005, 0.005))
    interval = np.log(stats.norm.cdf(above) - stats.norm.cdf(below)).sum(axis=1)
    np.testing.assert_allclose(parts["u"], interval, rtol=1e-6)  # of a difference of probabilities near one


def test_residuals_and_jacobian_make_the_gradient(mixed, parameters):
    """J'z is the gradient of minus the log likelihood, whatever the noise of the channels."""
    t = parameters[0]
    steps = 1e-4 * mixed.prior.sd
    plus, minus = (mixed.log_likelihood(t + sign * np.diag(steps)) for sign in (1, -1))
    gradient = mixed.jacobian(t).T @ mixed.residuals(t)[0]
    scale = np.linalg.norm(mixed.jacobian(t), axis=0)
    # Central differences 1e-4 of a prior sd apart lose 1e-4 of the digits of a log likelihood of thousands.
    assert np.abs(gradient + (plus - minus) / (2 * steps)).max() < 1e-4 * scale.max()
    np.testing.assert_allclose(gradient, -(plus - minus) / (2 * steps), rtol=1e-3, atol=1e-5 * np.abs(gradient).max())


def test_deviance_counts_from_the_best_possible(mixed, problem, parameters):
    """Deviances differ as log likelihoods do, twice over; for normal noise they are sums of squares."""
    residuals, deviances = mixed.misfit(parameters)
    np.testing.assert_allclose(np.diff(deviances), -2 * np.diff(mixed.log_likelihood(parameters)), rtol=1e-9)
    np.testing.assert_array_equal(residuals, mixed.residuals(parameters))
    np.testing.assert_allclose(problem.misfit(parameters)[1], np.sum(problem.residuals(parameters) ** 2, axis=1))
    parameters[1, problem.names.index("Xuu")] = 0.1
    assert problem.misfit(parameters)[1][1] == mixed.misfit(parameters)[1][1] == np.inf


def test_naive_problem(mixed, parameters):
    """A method that knows nothing of rounding sees normal noise with a twelfth of the squared step added."""
    naive = mixed.naive()
    sds = np.hypot(0.005, 0.01 / np.sqrt(12))
    n = len(mixed.record.channels[0].times)
    expected = (mixed.predicted(parameters)[:, :n] - mixed.readings[:n]) / sds
    np.testing.assert_allclose(naive.residuals(parameters)[:, :n], expected)


def test_noise_of_no_channel(suboff, spiral, mixed):
    """Noise for a channel that is not in the record is refused by name."""
    with refused("unknown", "headin"):
        bs.Problem(
            suboff,
            spiral,
            mixed.record,
            free=HORIZONTAL,
            prior=bs.priors.relative_normal(0.25),
            noise={"headin": AR1(0.1, 10.0)},
        )


def test_noise_that_is_no_model(suboff, spiral, problem):
    """A class without its values, a number, and a model for no channel."""
    given = {"free": ["Xuu"], "prior": bs.priors.relative_normal(0.25), "dt": 2.0}
    for noise, key in (({"x": Normal}, "x"), ({"y": 0.5}, "y"), (Normal, "noise"), ([StudentT], "noise")):
        with refused("value", key):
            bs.Problem(suboff, spiral, problem.record, noise=noise, **given)


def test_jacobian_has_the_noise_that_was_given(suboff, spiral, problem, parameters):
    """Normal noise given for a channel weighs its derivatives, not the sd of the sensor."""
    noise = {"x": Normal(2.0)}
    prior = bs.priors.relative_normal(0.25)
    given = bs.Problem(suboff, spiral, problem.record, free=HORIZONTAL, prior=prior, noise=noise, dt=1.0)
    t, steps = parameters[0], 1e-4 * given.prior.sd
    plus, minus = (given.log_likelihood(t + sign * np.diag(steps)) for sign in (1, -1))
    gradient = given.jacobian(t).T @ given.residuals(t)[0]
    np.testing.assert_allclose(gradient, -(plus - minus) / (2 * steps), rtol=1e-3, atol=1e-5 * np.abs(gradient).max())


def test_coefficients_without_effect_stay_fixed():
    """Bow planes that rest leave their coefficients as they are, and so does a plane the motion is not in."""
    boat = bs.load_vehicle("npsauv")
    trial = bs.load_manoeuvre("vertical", boat)
    record = bs.observe(bs.simulate(boat, trial), bs.sensors.Pressure(sd_m=0.1), np.random.default_rng(1))
    found = bs.Problem(boat, trial, record, free=NAMES, prior=bs.priors.relative_normal(0.25))
    assert np.all(np.abs(found.jacobian(found.prior.mean)).max(axis=0) > 0)
    assert not {"Xuu_dbdb", "Zuu_db", "Muu_db", "Nuv", "Yvdot"} & set(found.names)
    assert {"Zuu_ds", "Muw", "Xuu"} <= set(found.names)


def test_nothing_to_infer(suboff, spiral, problem):
    """A problem needs a coefficient that has a scale, and names that exist."""
    for free, kind, key in ((["Yuu", "Nuu"], "missing", "free"), (["Yuv", "Yvu_"], "unknown", "Yvu_")):
        with refused(kind, key):
            bs.Problem(suboff, spiral, problem.record, free=free, prior=bs.priors.relative_normal(0.25), dt=1.0)


def test_linear_form_holds_on_the_track(spiral_track, suboff):
    """Matrix times coefficients is the load: the track obeys its own equations of motion."""
    systems = linear_systems(spiral_track)
    assert set(systems) == {"X", "Y", "N"}
    for system in systems.values():
        forces = system.matrix * suboff.xi[columns(system.names)]
        # Round-off of the accelerations, through the mass matrix.
        assert np.abs(forces.sum(axis=1) - system.load).max() < 1e-12 * np.abs(forces).max()


def test_linear_form_in_six_degrees_of_freedom(full, coupled):
    """So does that of a boat with every coefficient, offset and coupling, on all six axes."""
    track = bs.simulate(full, coupled, dt=0.5)
    systems = linear_systems(track)
    assert [len(system.names) for system in systems.values()] == [12, 18, 18, 16, 19, 18]
    for system in systems.values():
        forces = system.matrix * full.xi[columns(system.names)]
        heavy = np.abs(system.load).max() + full.body[0] * 9.81 * full.length_m / 100 * (system.axis in "KMN")
        assert np.abs(forces.sum(axis=1) - system.load).max() < 1e-11 * heavy


def test_known_coefficients_move_to_the_load(spiral_track, suboff):
    """With some coefficients given the rest obey the rest of the equation."""
    free = [name for name in HORIZONTAL if name not in ("Yvdot", "Nvdot", "Nrdot", "Yuv")]
    systems = linear_systems(spiral_track, free=free)
    assert "Yuv" not in systems["Y"].names
    for system in systems.values():
        forces = system.matrix * suboff.xi[columns(system.names)]
        assert np.abs(forces.sum(axis=1) - system.load).max() < 1e-11 * np.abs(forces).max()


def test_columns_that_vanish_are_left_out(full, coupled):
    """Planes that do not move leave no column behind."""
    still = replace(coupled, controls=coupled.controls * [1, 0, 1])
    names = {name for s in linear_systems(bs.simulate(full, still, dt=0.5, sample=1.0)).values() for name in s.names}
    assert set(INDEX) - names == {"Xuu_dbdb", "Zuu_db", "Muu_db"}


def test_measured_motion_keeps_its_columns(suboff):
    """Errors of measurement, here larger than the smallest accelerations, are not round-off."""
    track = bs.simulate(suboff, bs.load_manoeuvre("random:0", suboff), dt=1.0)
    rounded = measure(track, velocity_resolution=0.01, acceleration_resolution=1e-3)
    exact, coarse = linear_systems(track), linear_systems(rounded)
    assert {axis: system.names for axis, system in coarse.items()} == {a: s.names for a, s in exact.items()}


def test_replicated_readings_have_standard_normal_quantile_residuals(mixed, suboff, spiral, problem, rng):
    """At the parameters that made them, whatever the noise; an sd that is sampled is each member's own."""
    given = {"nuisance": {"sd_x_m": bs.priors.log_normal(0.5, 1.0)}, "free": ("Xuu", "Nuv"), "dt": 1.0}
    sampled = bs.Problem(suboff, spiral, problem.record, prior=bs.priors.relative_normal(0.25), **given)
    for one in (mixed, sampled):
        parameters = np.repeat(one.prior.mean[None], 2, axis=0)
        if one is sampled:
            parameters[1, -1] = 5.0
        for k, readings in enumerate(one.replicated(parameters, rng)):
            again = one.with_readings(readings)
            for name, residuals in again.quantile_residuals(parameters[k], rng).items():
                assert stats.kstest(residuals[0], "norm").pvalue > 1e-4, name
    apart = one.replicated(parameters, rng) - one.predicted(parameters)
    # an sd of 300 readings, to four standard errors
    np.testing.assert_allclose(apart[:, :300].std(axis=1) / parameters[:, -1], 1.0, atol=4 / np.sqrt(600))


def test_failed_simulations_have_no_residuals(problem, rng):
    parameters = problem.prior.mean[None].copy()
    parameters[0, problem.names.index("Xuu")] = 0.1  # drag that accelerates
    assert all(np.isnan(part).any() for part in problem.quantile_residuals(parameters, rng).values())
    assert np.isnan(problem.replicated(parameters, rng)).any()


def test_views_share_one_counter(suboff, spiral, spiral_track, rng):
    """What a view computes is counted once, for the problem: simulations, Jacobians and failures."""
    sensor = bs.sensors.Sensor("x_m", sd=0.0, resolution=1.0, interval_s=20.0)
    record = bs.observe(spiral_track, sensor, rng)
    problem = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=bs.priors.relative_normal(0.25), dt=1.0)
    mean = problem.prior.mean
    smooth, naive = problem.smoothed(0.1), problem.naive()
    assert smooth is not problem
    assert smooth.costs is naive.costs is problem.costs
    smooth.log_likelihood(np.repeat(mean[None], 3, axis=0))
    smooth.jacobian(mean)
    naive.jacobian(mean)
    worst = mean.copy()
    worst[problem.names.index("Xuu")] = 0.1
    naive.residuals(worst)
    assert (problem.costs.simulations, problem.costs.jacobians, problem.costs.failures["diverged"]) == (4, 2, 1)
    assert smooth.smoothed(0.1) is smooth


def test_a_view_leaves_its_problem_alone(mixed, parameters):
    """Noise, nuisance parameters and readings of the problem stay what they are."""
    before = mixed.log_likelihood(parameters)
    mixed.naive(), mixed.smoothed(0.1), mixed.with_readings(np.zeros(len(mixed.readings)))
    np.testing.assert_array_equal(mixed.log_likelihood(parameters), before)
    again = mixed.with_readings(mixed.readings)
    np.testing.assert_array_equal(again.log_likelihood(parameters), before)


def test_what_makes_no_problem_is_refused(problem, suboff, spiral):
    """A coefficient that is named twice would have two priors and one effect; a number is no prior."""
    given = {"prior": bs.priors.relative_normal(0.25), "dt": 1.0}
    with refused("conflict", "free"):
        bs.Problem(suboff, spiral, problem.record, free=["Xuu", "Nuv", "Xuu"], **given)
    with refused("unknown", "0"):
        bs.Problem(suboff, spiral, problem.record, free=[0, 1], **given)
    with refused("value", "u0_mps"):
        bs.Problem(suboff, spiral, problem.record, free=["Xuu"], nuisance={"u0_mps": 7.5}, **given)
