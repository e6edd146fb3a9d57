"""What is unknown of actuators, a bent fin or a weak thruster: derivatives, batches and a posterior."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from scipy import stats
from support import gradients
from support.fins import BOW, PORT, STARBOARD, X_TAIL, fins, with_actuators
from support.motions import smooth_manoeuvre
from support.refusals import refused

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.model.simulator import Simulator
from bayesub.problem.priors import normal

SENSORS = bs.sensors.Track(0.5, 0.1, interval_s=2.0)
NUISANCE = {
    "bias_fin_1_deg": normal(0.3, 0.5),
    "scale_fin_2": normal(0.9, 0.1),
    "scale_port": normal(1.05, 0.1),
    "bias_bow_n": normal(2e3, 1e3),
    "scale_bow": normal(1.1, 0.2),
}


def load(content, folder):
    (folder / "boat.toml").write_text(tomli_w.dumps(content))
    return bs.load_vehicle(folder / "boat.toml")


@pytest.fixture(scope="module")
def pushed(boat, full, tmp_path_factory):
    """The full boat with fins, propellers and a thruster, without terms that bend where a speed is zero."""
    content = with_actuators(boat, *fins(*X_TAIL), PORT, STARBOARD, BOW, propulsion={"model": "none"})
    bent = [term.name for term in full.equations.terms if "abs(" in term.regressor or "sgn(" in term.regressor]
    content["coefficients"] |= dict.fromkeys(bent, 0.0)
    return load(content, tmp_path_factory.mktemp("pushed"))


@pytest.fixture(scope="module")
def turn(pushed):
    """A smooth turn with more and less revolutions and side thrust."""
    smooth = smooth_manoeuvre(pushed, 48.0)
    swing = 1.0 - np.cos(2 * np.pi * smooth.times / 40.0)
    inputs = smooth.controls @ pushed.actuators.allocation.T + pushed.actuators.rest
    inputs[:, -1] = 2e4 * swing
    inputs[:, 4:6] *= 1.0 + 0.1 * swing[:, None] * [1.0, -0.5]
    return replace(smooth, inputs=inputs, input_columns=pushed.actuators.shorts)


@pytest.fixture(scope="module")
def problem(pushed, turn):
    record = bs.observe(bs.simulate(pushed, turn, dt=0.25), SENSORS, np.random.default_rng(5))
    prior = bs.priors.relative_normal(0.2)
    return bs.Problem(pushed, turn, record, free=["Xuu", "Yuv", "Yuu_dr"], prior=prior, nuisance=NUISANCE, dt=0.25)


def test_derivatives_are_those_of_the_run(problem):
    """Against differences of fourth order, at which the amounts are not zero; to their truncation and round-off."""
    simulator, values = problem.simulator, np.array([[p.mean[0] for p in NUISANCE.values()]])
    amounts = problem.forward.nuisances.amounts(values)
    names = problem.forward.nuisances.varied
    assert names == tuple(NUISANCE)
    slopes = simulator.sensitivities(problem.vehicle.xi, ("Yuv", *names, "u0"), amounts=amounts[0])
    sets = np.repeat(problem.vehicle.xi[None], 4, axis=0)
    for k, (name, prior) in enumerate(NUISANCE.items()):
        steps = 0.02 * prior.sd[0] * np.array([[-2.0], [-1.0], [1.0], [2.0]])
        a, b, c, d = simulator.run(sets, amounts=amounts + steps * np.eye(len(names))[k])[0]
        expected = (a - 8.0 * b + 8.0 * c - d) / (12.0 * 0.02 * prior.sd[0])
        scale = np.abs(expected).max(axis=0)
        np.testing.assert_allclose(slopes[..., 1 + k] / scale, expected / scale, rtol=0, atol=1e-6, err_msg=name)


def test_gradient(problem, rng):
    """J'z is the gradient of minus the log likelihood."""
    parameters = problem.prior.parameters(0.3 * rng.standard_normal(problem.n_params))
    gradient, expected = gradients.both(problem, parameters, 1e-3)
    np.testing.assert_allclose(gradient, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_prediction_is_that_of_the_changed_inputs(problem, pushed, turn):
    """A bent fin and a thruster that pushes more are those whose log says so."""
    values = problem.reference.copy()
    for name, value in {"bias_fin_1_deg": 0.7, "scale_fin_2": 0.8, "bias_bow_n": -1e3, "scale_bow": 1.2}.items():
        values[problem.names.index(name)] = value
    inputs = turn.inputs.copy()
    inputs[:, 0] += np.radians(0.7)
    inputs[:, 1] *= 0.8
    inputs[:, 6] = 1.2 * inputs[:, 6] - 1e3
    changed = replace(turn, inputs=inputs)
    flown = Simulator(pushed, changed, problem.simulator.times, dt=0.25).trajectory(pushed.xi)
    expected = np.concatenate([c.values for c in bs.observe(flown, SENSORS, None).channels])
    np.testing.assert_allclose(problem.predicted(values)[0], expected, rtol=0, atol=1e-10)
    motion = problem.forward.trajectory(problem.coefficient_sets(values[None]), values[None, 3:])
    np.testing.assert_allclose(motion.states, flown.states, rtol=0, atol=1e-10)
    np.testing.assert_allclose(motion.controls, flown.controls, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(motion.log["fin_1_deg"], np.interp(motion.times, turn.times, turn.inputs[:, 0]))
    np.testing.assert_allclose(problem.motion(values)[0], flown.states[0], rtol=0, atol=1e-10)


def test_a_weak_propeller(problem, pushed, turn):
    """The scale of a propeller is that of its thrust and torque, whatever it turns."""
    port, *_ = (a for a in pushed.actuators.members if a.name == "port")
    weak = replace(port, force_of_square=0.8 * port.force_of_square, force_of_speed=0.8 * port.force_of_speed)
    members = tuple(weak if a is port else a for a in pushed.actuators.members)
    other = replace(pushed, actuators=replace(pushed.actuators, members=members))
    values = problem.reference.copy()
    values[problem.names.index("scale_port")] = 0.8
    flown = Simulator(other, turn, problem.simulator.times, dt=0.25).trajectory(pushed.xi)
    np.testing.assert_allclose(problem.motion(values)[0], flown.states[0], rtol=0, atol=1e-10)


def test_plain_rudder(suboff, spiral):
    """A vehicle with the table [actuators] has the same parameters of its rudder, in its plane."""
    times = np.linspace(0.0, spiral.duration, 61)
    simulator = Simulator(suboff, spiral, times, dt=0.5, varied=("bias_rudder_deg", "scale_rudder"))
    changed = replace(spiral, controls=0.9 * spiral.controls + np.radians([1.5, 0.0, 0.0]))
    expected = Simulator(suboff, changed, times, dt=0.5).run(suboff.xi)[0]
    found = simulator.run(suboff.xi, amounts=np.array([[1.5, -0.1]]))[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    slopes = simulator.sensitivities(suboff.xi, simulator.varied)
    steps = np.array([[1e-3, 0.0], [-1e-3, 0.0], [0.0, 1e-4], [0.0, -1e-4]])
    a, b, c, d = simulator.run(np.repeat(suboff.xi[None], 4, axis=0), amounts=steps)[0]
    for k, difference in enumerate(((a - b) / 2e-3, (c - d) / 2e-4)):
        scale = np.abs(difference).max()
        np.testing.assert_allclose(slopes[..., k] / scale, difference / scale, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_a_bent_fin_is_found(suboff_file, tmp_path):
    """Truths drawn from the prior come out within the posterior's standard deviations, of a bent and weak fin too.

    Thirty-two squares of standard normal errors; the probability of a sum outside is 1 in 1000. Without the nuisance
    parameters the same fits are wrong by many standard deviations.
    """
    content = tomllib.loads(suboff_file)
    vehicle = load(with_actuators(content, *fins(*X_TAIL)), tmp_path)
    manoeuvre = bs.load_manoeuvre("random:11", vehicle)
    nuisance = {"bias_fin_2_deg": normal(0.0, 1.0), "scale_fin_2": normal(1.0, 0.2)}
    free, errors, blind = ["Yuu_dr", "Zuu_ds"], [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        xi, bias, scale = vehicle.xi.copy(), rng.normal(0.0, 1.0), rng.normal(1.0, 0.2)
        positions = vehicle.equations.columns(free)
        xi[positions] *= 1.0 + 0.1 * rng.standard_normal(2)
        changes = {"bias_fin_2_deg": bias, "scale_fin_2": scale - 1.0}
        flown = Simulator(vehicle, manoeuvre, manoeuvre.times[::20], dt=0.5, changes=changes).trajectory(xi)
        record = bs.observe(flown, SENSORS, rng)
        settings = {"free": free, "prior": bs.priors.relative_normal(0.1), "dt": 0.5}
        fit = gauss_newton(bs.Problem(vehicle, manoeuvre, record, nuisance=nuisance, **settings))
        truth = np.array([*xi[positions], bias, scale])
        errors.append((fit.values - truth) / np.sqrt(np.diag(fit.covariance)))
        fit = gauss_newton(bs.Problem(vehicle, manoeuvre, record, **settings))
        blind.append((fit.values - truth[:2]) / np.sqrt(np.diag(fit.covariance)))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 32)
    assert low < np.sum(np.square(errors)) < high
    assert np.median(np.abs(blind)) > 5.0


@pytest.mark.parametrize(
    ("name", "kind", "key"),
    [
        ("bias_fin_5_deg", "unknown", "bias_fin_5_deg"),
        ("bias_port_rpm", "unknown", "bias_port_rpm"),
        ("scale_starboards", "unknown", "scale_starboards"),
    ],
)
def test_refused(problem, pushed, turn, name, kind, key):
    with refused(kind, key):
        bs.Problem(pushed, turn, problem.record, free=["Xuu"], prior=problem.spread, nuisance={name: normal(1.0, 1.0)})


def test_without_a_part_in_the_motion(suboff, spiral, spiral_track):
    """The stern planes have no part in a horizontal motion, and the scale of a plane that rests none in any."""
    record = bs.observe(spiral_track, SENSORS, np.random.default_rng(3))
    settings = {"free": ["Xuu"], "prior": bs.priors.relative_normal(0.25), "dt": 0.5}
    for name, manoeuvre in (
        ("bias_stern_plane_deg", spiral),
        ("scale_stern_plane", replace(spiral, subproblem=None)),
    ):
        with refused("conflict", name):
            bs.Problem(suboff, manoeuvre, record, nuisance={name: normal(1.0, 1.0)}, **settings)


def test_a_bent_fin_is_bent_in_all_trials(suboff, spiral, spiral_track):
    """Biases of actuators belong to the boat: one parameter for several trials, with derivatives in each."""
    record = bs.observe(spiral_track, SENSORS, np.random.default_rng(3))
    settings = {"free": ["Nuu_dr"], "prior": bs.priors.relative_normal(0.25), "dt": 1.0}
    nuisance = {"bias_rudder_deg": normal(0.0, 1.0), "yaw0_deg": normal(0.0, 1.0)}
    one = bs.Problem(suboff, spiral, record, nuisance=nuisance, **settings)
    joint = bs.JointProblem({"first": one, "second": one})
    assert joint.names == ("Nuu_dr", "bias_rudder_deg", "yaw0_deg[first]", "yaw0_deg[second]")
    with refused("conflict", "problems"):
        bs.JointProblem({"first": one, "second": bs.Problem(suboff, spiral, record, **settings)})
