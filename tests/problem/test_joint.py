"""Several trials as one problem."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.model.coefficients import NAMES
from bayesub.model.linear_form import linear_systems, stacked
from bayesub.problem.joint import JointProblem
from bayesub.problem.priors import Given, normal, relative_normal

FREE = ("Xuu", "Yuv", "Yuu_dr", "Nuv", "Nuu_dr", "Nur")
NUISANCE = {"yaw0_deg": normal(0.0, 2.0), "Izz_kgm2": normal(6.5e9, 1e8)}
PRIOR = relative_normal(0.25)


@pytest.fixture(scope="module")
def trials(suboff, spiral, spiral_track):
    zigzag = bs.load_manoeuvre("zigzag_20_20", suboff)
    sensor = bs.sensors.Track(0.5, 0.1, interval_s=5.0, channels=("x", "y", "yaw"))
    problems = {}
    for seed, (name, manoeuvre, track) in enumerate(
        (("spiral", spiral, spiral_track), ("zigzag", zigzag, bs.simulate(suboff, zigzag, dt=0.5)))
    ):
        record = bs.observe(track, sensor, np.random.default_rng(seed))
        problems[name] = bs.Problem(
            suboff, manoeuvre, record, free=FREE, prior=PRIOR, nuisance=NUISANCE, dt=1.0, noise={}
        )
    return problems


def test_likelihoods_multiply_and_information_adds(trials, rng):
    """Coefficients and inertia are common, headings at the start are not."""
    joint = JointProblem(trials)
    assert joint.names == (*FREE, "yaw0_deg[spiral]", "Izz_kgm2", "yaw0_deg[zigzag]")
    parameters = joint.prior.mean + 0.1 * joint.prior.sd * rng.standard_normal((3, joint.n_params))
    own = {"spiral": [0, 1, 2, 3, 4, 5, 6, 7], "zigzag": [0, 1, 2, 3, 4, 5, 8, 7]}
    parts = [trials[name].log_likelihood(parameters[:, places]) for name, places in own.items()]
    np.testing.assert_allclose(joint.log_likelihood(parameters), np.sum(parts, axis=0), rtol=1e-14)
    expected = np.zeros((joint.n_params, joint.n_params))
    for name, places in own.items():
        jacobian = trials[name].jacobian(parameters[0, places])
        expected[np.ix_(places, places)] += jacobian.T @ jacobian
    jacobian = joint.jacobian(parameters[0])
    np.testing.assert_allclose(jacobian.T @ jacobian, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    gradient = jacobian.T @ joint.residuals(parameters)[0]
    step = 1e-4 * joint.prior.sd[3]
    shift = step * np.eye(joint.n_params)[3]
    ends = joint.log_likelihood(np.array([parameters[0] - shift, parameters[0] + shift]))
    assert gradient[3] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4)


def test_equal_priors_are_equal_whether_or_not_they_are_one_object(trials, suboff):
    """With a centre or values of single coefficients, which are arrays, and priors of nuisance parameters."""

    def given(sd):
        centre = relative_normal(0.25, suboff.xi)
        nuisance = NUISANCE | {"Izz_kgm2": normal(6.5e9, sd)}
        return {"free": FREE, "prior": Given(centre, {"Xuu": normal(-1e-3, 1e-4)}), "nuisance": nuisance, "dt": 1.0}

    problems = {
        name: bs.Problem(suboff, problem.manoeuvre, problem.record, **given(1e8)) for name, problem in trials.items()
    }
    assert JointProblem(problems).names == JointProblem(trials).names
    zigzag = trials["zigzag"]
    problems["zigzag"] = bs.Problem(suboff, zigzag.manoeuvre, zigzag.record, **given(2e8))
    with refused("conflict", "Izz_kgm2"):
        JointProblem(problems)


def test_two_trials_know_more_than_one(trials):
    """The posterior of both is narrower than that of either, and agrees with the truth."""
    joint = JointProblem(trials)
    both = gauss_newton(joint)
    assert both.statuses == ("converged",)
    sds = np.sqrt(np.diag(both.covariance))
    assert np.all(np.abs(both.values - joint.reference) < 4 * sds)
    for problem in trials.values():
        alone = np.sqrt(np.diag(gauss_newton(problem).covariance))
        assert np.all(sds[: len(FREE)] < alone[: len(FREE)])


def test_naive_and_failures(trials):
    joint = JointProblem(trials)
    assert joint.naive().names == FREE
    worst = joint.prior.mean.copy()
    worst[0] = 0.1  # drag that accelerates
    assert joint.log_likelihood(worst)[0] == -np.inf
    assert joint.costs.failures["diverged"] == 2


def test_trials_must_belong_together(trials, suboff, spiral):
    record = trials["spiral"].record
    other = bs.Problem(suboff, spiral, record, free=FREE, prior=relative_normal(0.5), dt=1.0)
    with refused("conflict", "problems"):
        JointProblem({"a": trials["spiral"], "b": other})
    with refused("missing", "problems"):
        JointProblem({})
    for again in (bs.load_vehicle("suboff"), bs.load_vehicle("auv690")):  # which has been loaded twice, and another
        other = bs.Problem(again, spiral, record, free=FREE, prior=PRIOR, nuisance=NUISANCE, dt=1.0)
        if again == suboff:
            assert JointProblem({"a": trials["spiral"], "b": other}).n_params == trials["spiral"].n_params + 1
            continue
        with refused("conflict", "problems"):
            JointProblem({"a": trials["spiral"], "b": other})
    fewer = bs.Problem(suboff, spiral, record, free=FREE[1:], prior=PRIOR, nuisance=NUISANCE, dt=1.0)
    with refused("conflict", "problems"):  # else one boat would have two values of the first
        JointProblem({"a": trials["spiral"], "b": fewer})


def test_the_body_is_one_in_all_trials(trials, suboff, spiral):
    """An inertia that one trial infers and another holds, or other fixed coefficients, make no joint problem."""
    record = trials["spiral"].record
    other = bs.Problem(suboff, spiral, record, free=FREE, prior=PRIOR, dt=1.0)
    with refused("conflict", "problems"):
        JointProblem({"a": trials["spiral"], "b": other})


def test_null_directions_of_two_trials_are_those_of_both(suboff, spiral_track):
    """The linear forms stand one below the other: their null space is the intersection, and columns add."""
    zigzag = bs.simulate(suboff, bs.load_manoeuvre("zigzag_20_20", suboff), dt=0.5)
    first, second = linear_systems(spiral_track), linear_systems(zigzag)
    both = stacked([first, second], NAMES)
    for axis, system in both.items():
        lengths = [np.linalg.norm(systems[axis].matrix, axis=0) for systems in (first, second)]
        np.testing.assert_allclose(np.linalg.norm(system.matrix, axis=0), np.hypot(*lengths), rtol=1e-12)
        xi = suboff.xi[bs.coefficients.columns(system.names)]
        scale = np.abs(system.matrix * xi).max()
        np.testing.assert_allclose(system.matrix @ xi, system.load, atol=1e-9 * scale)
    alone = [bs.identifiability.rank(systems)["N"].null_dimension for systems in (first, second)]
    assert bs.identifiability.rank(both)["N"].null_dimension <= min(alone)
    assert stacked([first], NAMES) is first


def test_a_joint_problem_has_the_methods_of_a_problem(trials, rng):
    """Rows, replicated readings, linear systems and counters, trial after trial."""
    joint = JointProblem(trials)
    parameters = np.repeat(joint.prior.mean[None], 2, axis=0)
    residuals = joint.residuals(parameters)
    for trial, problem, values in joint.each_trial(parameters):
        for channel, part in problem.rows.items():
            own = problem.residuals(values)[:, part]
            np.testing.assert_array_equal(residuals[:, joint.rows[f"{channel}[{trial}]"]], own)
    assert joint.replicated(parameters, rng).shape == (2, len(joint.readings))
    assert set(joint.linear_systems(parameters[0])) == {"X", "Y", "N"}
    before = joint.costs.jacobians, joint.costs.simulations
    joint.jacobian(parameters[0])
    joint.naive().predicted(parameters[:, : len(FREE)])
    assert (joint.costs.jacobians, joint.costs.simulations) == (before[0] + 2, before[1] + 4)
    assert list(joint.nuisance_priors) == ["yaw0_deg[spiral]", "Izz_kgm2", "yaw0_deg[zigzag]"]
    assert joint.coefficient_prior.mean.tolist() == trials["spiral"].coefficient_prior.mean.tolist()


def test_a_trial_may_have_a_parameter_of_the_boat_for_itself(trials):
    """As many copies of it as trials, in views and without one trial too; the likelihoods are those of each copy."""
    joint = JointProblem(trials, own=("Izz_kgm2",))
    own = ("yaw0_deg[spiral]", "Izz_kgm2[spiral]", "yaw0_deg[zigzag]", "Izz_kgm2[zigzag]")
    assert joint.names == (*FREE, *own)
    parameters = joint.prior.mean + 0.1 * joint.prior.sd
    parts = [problem.log_likelihood(values)[0] for _, problem, values in joint.each_trial(parameters)]
    assert joint.log_likelihood(parameters)[0] == pytest.approx(sum(parts), rel=1e-14)
    assert joint.widened(2.0).names == joint.names
    assert joint.without("spiral").names == (*FREE, *own[2:])


def test_held_coefficients_leave_the_other_parameters(trials, rng):
    """Of one trial and of several the likelihood is the same, and its derivatives are those columns."""
    for problem in (trials["spiral"], JointProblem(trials)):
        parameters = problem.prior.mean + 0.1 * problem.prior.sd * rng.standard_normal(problem.n_params)
        held = problem.held(parameters)
        others = parameters[len(FREE) :]
        assert held.names == problem.names[len(FREE) :]
        assert held.log_likelihood(others)[0] == pytest.approx(problem.log_likelihood(parameters)[0], rel=1e-12)
        expected = problem.jacobian(parameters)[:, len(FREE) :]
        np.testing.assert_allclose(held.jacobian(others), expected, rtol=1e-9, atol=1e-12)
