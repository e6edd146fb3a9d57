"""Expected posterior sds of a trial that has not been flown against problems with a record of it."""

from dataclasses import replace

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.design.judge import MIN_SHARPNESS, Judge, Sensed, expected_sd
from bayesub.inference.identifiability.fisher import fisher
from bayesub.problem.disturbances import UnknownDisturbance
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import Rounded, UnknownSd
from bayesub.sensors import ADCP, DVL, INS, Track

STEP = 2.0
FREE = ("Xuu", "Yuv", "Yur", "Kup", "Muw", "Muq", "Nuv", "Nuu_dr", "Nur")
SENSORS = (*Track(0.5, 0.1, interval_s=5.0), *DVL(sd_mps=0.005, interval_s=5.0))
PRIOR = bs.priors.relative_normal(0.25)


def judge_of(boat, sensors=SENSORS, **changes):
    return Judge(boat, sensors, **{"free": FREE, "prior": PRIOR, "step_s": STEP} | changes)


def posed(boat, manoeuvre, sensors=SENSORS, seed=1, **options):
    record = bs.observe(bs.simulate(boat, manoeuvre, dt=0.5), sensors, np.random.default_rng(seed))
    return bs.Problem(boat, manoeuvre, record, **{"free": FREE, "prior": PRIOR, "dt": STEP} | options)


def truth_of(problem):
    parameters = problem.prior.mean.copy()
    parameters[: problem.n_coefficients] = problem.vehicle.xi[problem.columns]
    return parameters


def by_name(names, values):
    return dict(zip(names, values, strict=True))


def dense_sds(problem, names):
    """The posterior sds of coefficients with everything else integrated out, of the whole dense precision."""
    jacobian = problem.jacobian(truth_of(problem)) * problem.prior.sd
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(problem.n_params))
    sds = by_name(problem.names, problem.prior.sd * np.sqrt(np.diag(covariance)))
    return np.array([sds[name] for name in names])


def test_expected_sds_are_those_of_the_fisher_information_of_a_record(boat, manoeuvre):
    (told,) = judge_of(boat).information(manoeuvre)
    problem = posed(boat, manoeuvre)
    spectrum = fisher(problem, truth_of(problem))
    assert told.names == spectrum.names
    assert told.posterior_sd == pytest.approx(spectrum.posterior_sd, rel=1e-6)
    assert told.singular_values == pytest.approx(spectrum.singular_values, rel=1e-6)


def test_all_coefficients_of_a_boat_with_null_directions(boat, manoeuvre):
    """With all coefficients free the record knows null directions by the equations, the judge by the derivatives."""
    (told,) = judge_of(boat, free=()).information(manoeuvre)
    problem = posed(boat, manoeuvre, free=boat.equations.names)
    sds = by_name(problem.names, fisher(problem, truth_of(problem)).posterior_sd)
    for name, sd in by_name(told.names, told.posterior_sd).items():
        assert sd == pytest.approx(sds.get(name, 0.25 * abs(boat.xi[boat.equations.index[name]])), rel=1e-6), name


def test_coefficients_that_a_manoeuvre_cannot_show_keep_their_prior(boat):
    turn = bs.load_manoeuvre("horizontal", boat)  # no plane moves
    turn = replace(turn, subproblem=None)
    judge = judge_of(boat, free=(*FREE, "Muu_ds"))
    (told,) = judge.information(turn)
    assert by_name(told.names, told.relative_sd)["Muu_ds"] == pytest.approx(0.25, rel=1e-12)
    assert by_name(told.names, told.relative_sd)["Nur"] < 0.1


def test_nuisance_parameters_are_integrated_out(boat, manoeuvre):
    normal = bs.priors.normal
    nuisance = {
        "bias_yaw_deg": normal(0.0, 0.5), "bias_u_ground_mps": normal(0.0, 0.02), "current_north_mps": normal(0.0, 0.2),
        "bias_rudder_deg": normal(0.0, 0.5), "scale_stern_plane": normal(1.0, 0.1), "xG_m": normal(0.0, 0.1),
    }  # fmt: skip
    (told,) = judge_of(boat, nuisance=nuisance).information(manoeuvre)
    problem = posed(boat, manoeuvre, nuisance=nuisance)
    assert told.names == problem.names[: len(told.names)]
    assert told.posterior_sd == pytest.approx(dense_sds(problem, told.names), rel=1e-6)
    (without,) = judge_of(boat).information(manoeuvre)
    assert np.any(told.posterior_sd > 1.1 * without.posterior_sd)
    assert np.all(told.posterior_sd >= without.posterior_sd * (1.0 - 1e-9))


def test_derivatives_are_those_where_nuisance_parameters_are_expected(boat, manoeuvre):
    """At a slow start in a current, and not where the priors have their means; likewise of a rival that fits."""
    nuisance = {"u0_mps": bs.priors.normal(7.0, 3.0), "current_north_mps": bs.priors.normal(0.0, 1.0)}
    there = {"u0_mps": bs.priors.normal(3.0, 3.0), "current_north_mps": bs.priors.normal(1.2, 1.0)}
    expected = {name: prior.mean[0] for name, prior in there.items()}
    judge = judge_of(boat, nuisance=nuisance, expected=expected)
    problem = posed(boat, manoeuvre, nuisance=there)
    (told,) = judge.information(manoeuvre)
    assert told.posterior_sd == pytest.approx(dense_sds(problem, told.names), rel=1e-6)
    (elsewhere,) = judge_of(boat, nuisance=nuisance).information(manoeuvre)
    assert np.any(np.abs(elsewhere.posterior_sd / told.posterior_sd - 1.0) > 0.05)
    (same,) = replace(judge, rival=judge_of(boat, nuisance=nuisance)).information(manoeuvre)
    assert same.apart == pytest.approx(0.0, abs=1e-6)


def test_histories_of_forces_are_integrated_out(boat, manoeuvre):
    sds = {axis: bs.priors.log_normal(2e-5, 0.5) for axis in ("X", "N")}
    forces = UnknownDisturbance(
        axes=("X", "N"), sds=sds, correlation_time_s=bs.priors.log_normal(60.0, 0.5), knot_interval_s=40.0
    )
    (told,) = judge_of(boat, disturbance=forces).information(manoeuvre)
    problem = posed(boat, manoeuvre, disturbance=forces)
    jacobian = problem.jacobian(truth_of(problem))[: len(problem.times)] * problem.prior.sd
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(problem.n_params))
    n = problem.n_coefficients
    sds = problem.prior.sd[:n] * np.sqrt(np.diag(covariance)[:n])
    assert told.posterior_sd == pytest.approx(sds, rel=1e-6)
    (without,) = judge_of(boat).information(manoeuvre)
    assert np.any(told.posterior_sd > 1.1 * without.posterior_sd)


def test_two_manoeuvres_are_a_joint_problem(boat, manoeuvre):
    other = replace(bs.load_manoeuvre("vertical", boat), subproblem=None)
    nuisance = {"bias_yaw_deg": bs.priors.normal(0.0, 0.5), "current_east_mps": bs.priors.normal(0.0, 0.2)}
    judge = judge_of(boat, nuisance=nuisance)
    (first,), (second,) = judge.information(manoeuvre), judge.information(other)
    both = first + second
    trials = {"first": posed(boat, manoeuvre, nuisance=nuisance), "second": posed(boat, other, nuisance=nuisance)}
    joint = JointProblem(trials)
    assert both.posterior_sd == pytest.approx(dense_sds(joint, both.names), rel=1e-6)


def test_a_second_trial_after_a_first_is_both_together(boat, manoeuvre):
    other = replace(bs.load_manoeuvre("vertical", boat), subproblem=None)
    (first,), (second,) = (judge_of(boat).information(each) for each in (manoeuvre, other))
    (after,) = judge_of(boat, precision=first.precision + first.gram).information(other)
    assert after.posterior_sd == pytest.approx((first + second).posterior_sd, rel=1e-9)


def test_a_correlated_prior_is_its_own_precision(boat, manoeuvre):
    (first,) = judge_of(boat).information(manoeuvre)
    columns, sds = boat.equations.columns(first.names), first.posterior_sd
    correlation = first.covariance / np.sqrt(np.outer(np.diag(first.covariance), np.diag(first.covariance)))
    means = boat.xi[columns]
    normals = {n: bs.priors.normal(m, s) for n, m, s in zip(first.names, means, sds, strict=True)}
    pairs = [(i, j) for i in range(len(means)) for j in range(i)]
    related = tuple((first.names[i], first.names[j], float(correlation[i, j])) for i, j in pairs)
    given = bs.priors.Given(PRIOR, normals, related)
    (twice,) = judge_of(boat, prior=given).information(manoeuvre)
    assert twice.posterior_sd == pytest.approx((first + first).posterior_sd, rel=1e-6)


def test_information_at_each_draw_is_that_of_a_boat_with_these_coefficients(boat, manoeuvre, rng):
    judge = judge_of(boat)
    draws = np.tile(boat.xi, (3, 1))
    draws[:, judge.columns] *= 1.0 + 0.1 * rng.standard_normal((3, len(judge.columns)))
    told = replace(judge, draws=draws).information(manoeuvre)
    assert len(told) == 3
    for information, xi in zip(told, draws, strict=True):
        problem = posed(boat, manoeuvre)
        jacobian = problem.jacobian(xi[judge.columns]) * problem.prior.sd
        assert information.gram == pytest.approx(jacobian.T @ jacobian, rel=1e-9)
    assert not np.allclose(told[0].gram, told[1].gram, rtol=1e-2)


def test_a_channel_with_a_noise_model_of_its_own(boat, manoeuvre):
    noise = {"yaw": bs.likelihoods.AR1(sd=np.radians(0.1), correlation_time_s=20.0)}
    (told,) = judge_of(boat, noise=noise).information(manoeuvre)
    problem = posed(boat, manoeuvre, noise=noise)
    assert told.posterior_sd == pytest.approx(fisher(problem, truth_of(problem)).posterior_sd, rel=1e-6)


def test_any_part_of_the_readings(boat, manoeuvre, rng):
    sensed = Sensed(judge_of(boat), manoeuvre, STEP)
    mask = rng.random(len(sensed.times)) < 0.5
    (some,), (others,), (whole,) = (sensed.information(m) for m in (mask, ~mask, None))
    assert some.gram + others.gram == pytest.approx(whole.gram, rel=1e-9)
    assert sum(rows.stop - rows.start for rows in sensed.rows.values()) == len(sensed.times)


def test_rounding_is_normal_noise_where_the_sd_is_large():
    """Sheppard's correction: a rounded reading with much noise has the variance sd^2 + resolution^2 / 12."""
    assert expected_sd(0.3, 0.0) == 0.3
    for sd in (0.6, 1.0, 5.0):
        assert expected_sd(sd, 1.0) == pytest.approx(np.sqrt(sd**2 + 1.0 / 12.0), rel=3e-3)
    assert expected_sd(100.0, 1.0) == pytest.approx(100.0, rel=1e-4)
    assert expected_sd(0.2, 0.1) == pytest.approx(0.1 * expected_sd(2.0, 1.0), rel=1e-12)


@pytest.mark.parametrize("sd", [0.05, 0.1, 0.3, 1.0])
def test_rounding_is_worth_the_mean_observed_information_of_rounded_readings(sd, rng):
    noise = Rounded(sd=sd, resolution=1.0)
    truths = rng.uniform(-0.5, 0.5, 200_000)
    readings = np.round(truths + sd * rng.standard_normal(len(truths)))
    weights = noise.weigh(np.ones((len(truths), 1)), truths, readings)[:, 0]  # roots of the observed information
    assert expected_sd(sd, 1.0) == pytest.approx(1.0 / np.sqrt(np.mean(weights**2)), rel=0.01)
    assert expected_sd(0.0, 1.0) == expected_sd(MIN_SHARPNESS, 1.0)


def test_rounded_velocities_tell_what_problems_with_records_of_them_tell_on_average(boat, manoeuvre):
    sensors = (
        *ADCP(sd_mps=0.005, resolution_mps=0.01, interval_s=2.0),
        *INS(sd_deg=0.05, sd_degps=0.01, interval_s=2.0),
    )
    (told,) = judge_of(boat, sensors).information(manoeuvre)
    grams = []
    for seed in range(8):
        problem = posed(boat, manoeuvre, sensors, seed)
        jacobian = problem.jacobian(truth_of(problem)) * problem.prior.sd
        grams.append(jacobian.T @ jacobian)
    sds = np.sqrt(np.diag(np.linalg.inv(np.mean(grams, axis=0) + np.eye(len(told.names)))))
    assert told.posterior_sd / told.prior_sd == pytest.approx(sds, rel=0.03)


def test_the_accurate_step_is_accurate_and_the_next_is_not_needed(boat, manoeuvre):
    judge = judge_of(boat, step_s=None)
    step = judge.accurate_step(manoeuvre)
    told, finer = (Sensed(judge, manoeuvre, each).information()[0] for each in (step, step / 16.0))
    assert np.abs(told.posterior_sd / finer.posterior_sd - 1.0).max() < 0.03
    if step < 0.25 * boat.length_m / boat.speed_mps:
        coarse = Sensed(judge, manoeuvre, 2.0 * step).information()[0]
        assert np.abs(coarse.posterior_sd / told.posterior_sd - 1.0).max() > 0.02


def test_a_flight_that_fails_tells_nothing(boat, manoeuvre):
    xi = boat.xi.copy()
    xi[boat.equations.columns(["Muw", "Muq"])] *= [50.0, -50.0]
    judge = judge_of(boat, draws=np.stack([boat.xi, xi]))
    whole, failed = judge.information(manoeuvre)
    assert np.all(np.isfinite(failed.posterior_sd))
    assert failed.posterior_sd == pytest.approx(failed.prior_sd)
    assert np.all(whole.posterior_sd < whole.prior_sd)


def test_before_any_trial_the_prior_counts(boat):
    judge = judge_of(boat)
    assert judge.empty().relative_sd == pytest.approx(0.25)
    assert judge.empty().d_optimality == pytest.approx(0.0, abs=1e-12)


def test_coefficients_without_a_value_are_refused(boat):
    with refused("conflict", "free"):
        judge_of(boat, free=("Yuu",)).names  # noqa: B018


def test_noise_models_that_weigh_by_readings_weigh_as_the_normal_noise_they_amount_to(boat, manoeuvre):
    """Without readings an unknown sd is the guess of it, and rounding that of a channel with a resolution."""
    channels = dict(zip(("x", "y", "z", "roll", "pitch", "yaw", "u_ground"), SENSORS, strict=False))
    (normal,) = judge_of(boat).information(manoeuvre)
    sd = channels["yaw"].sd * channels["yaw"].factor
    (unknown,) = judge_of(boat, noise={"yaw": UnknownSd(sd)}).information(manoeuvre)
    assert unknown.posterior_sd == pytest.approx(normal.posterior_sd, rel=1e-9)
    (rounded,) = judge_of(boat, noise={"yaw": Rounded(sd, sd)}).information(manoeuvre)
    coarse = tuple(replace(s, resolution=s.sd) if s is channels["yaw"] else s for s in SENSORS)
    (channel,) = judge_of(boat, coarse).information(manoeuvre)
    assert rounded.posterior_sd == pytest.approx(channel.posterior_sd, rel=1e-9)


def test_an_unknown_parameter_of_a_noise_model_learns_nothing_without_readings(boat, manoeuvre):
    """Degrees of freedom that are inferred change nothing of what is expected of coefficients; nothing warns."""
    dof = bs.priors.log_normal(4.0, 0.5)
    noise = {"yaw": bs.likelihoods.StudentT(sd=np.radians(0.1), dof=dof.mean.item())}
    (held,) = judge_of(boat, noise=noise).information(manoeuvre)
    (inferred,) = judge_of(boat, noise=noise, nuisance={"dof_yaw": dof}).information(manoeuvre)
    np.testing.assert_allclose(inferred.gram, held.gram, rtol=1e-9)


def lacking(boat, name):
    """The boat without one coefficient, and the others to infer."""
    xi = boat.xi.copy()
    xi[boat.equations.columns([name])] = 0.0
    return replace(boat, xi=xi), tuple(one for one in FREE if one != name)


def test_a_rival_is_as_far_as_its_best_fit_to_noise_free_readings(boat, manoeuvre):
    """That of a search from afar; of a manoeuvre that does not move the planes a rival without their force is none."""
    rival, free = lacking(boat, "Kup")
    told = judge_of(boat, rival=judge_of(rival, free=free)).information(manoeuvre)[0]
    record = bs.simulate(boat, manoeuvre, dt=STEP)
    quiet = bs.observe(record, [replace(s, sd=1e-9 * s.sd) for s in SENSORS], np.random.default_rng(1))
    quiet = bs.Record(tuple(replace(channel, sd=1e9 * channel.sd) for channel in quiet.channels))
    problem = bs.Problem(rival, manoeuvre, quiet, free=free, prior=PRIOR, dt=STEP)
    fit = bs.baselines.posterior_mode(problem, rng=np.random.default_rng(2))
    assert told.apart == pytest.approx(fit.costs[0], rel=0.02)
    assert told.apart > 1.0
    turn = replace(bs.load_manoeuvre("horizontal", boat), subproblem=None)
    rival, free = lacking(boat, "Muu_ds")
    judge = judge_of(boat, free=(*FREE, "Muu_ds"), rival=judge_of(rival))
    assert judge.information(turn)[0].apart == pytest.approx(0.0, abs=1e-9)
    assert judge.information(turn)[0].power == pytest.approx(0.01)


def test_distances_of_trials_add_up_and_a_lost_channel_brings_the_rival_nearer(boat, manoeuvre):
    rival, free = lacking(boat, "Kup")
    judge = judge_of(boat, rival=judge_of(rival, free=free))
    sensed = Sensed(judge, manoeuvre, STEP)
    (whole,), (part,) = sensed.information(), sensed.information(sensed.times < 200.0)
    assert 0.0 < part.apart < whole.apart
    assert (whole + part).apart == whole.apart + part.apart


def test_a_rival_with_the_same_equations_is_no_rival(boat, manoeuvre, rng):
    """Whatever boat of the prior is flown: what the prior makes dear is as dear for either."""
    xi = boat.xi.copy()
    xi[boat.equations.columns(FREE)] *= 1.0 + 0.2 * rng.standard_normal(len(FREE))
    (told,) = judge_of(boat, rival=judge_of(boat), draws=xi[None]).information(manoeuvre)
    assert told.apart == pytest.approx(0.0, abs=1e-3)


def test_a_rival_is_told_by_the_readings_that_unknown_clocks_leave(boat, manoeuvre):
    """Those within reach of the clocks, each in its own channel: as far as without the others, and not less."""
    rival, free = lacking(boat, "Kup")
    clocks = {"clock_dvl_s": bs.priors.normal(0.0, 1e-3)}
    told = judge_of(boat, nuisance=clocks, rival=judge_of(rival, free=free, nuisance=clocks)).information(manoeuvre)[0]
    exact = judge_of(boat, rival=judge_of(rival, free=free)).information(manoeuvre)[0]
    assert told.apart == pytest.approx(exact.apart, rel=0.1)
