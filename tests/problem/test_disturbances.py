"""Unknown histories of forces: their prior, how they enter the readings, and what is refused."""

import numpy as np
import pytest
from support.refusals import refused

import bayesub as bs
from bayesub.kernels.kalman import policy
from bayesub.model.disturbance import Disturbance, Knots, correlation
from bayesub.problem import innovations
from bayesub.problem.disturbances import Disturbances, UnknownDisturbance, of_history, of_process
from bayesub.problem.joint import JointProblem
from bayesub.problem.likelihoods import AR1

AXES = ("X", "N")
FREE = ("Xuu", "Yuv", "Nuv", "Nuu_dr")
PRIOR = bs.priors.relative_normal(0.25)


@pytest.fixture(scope="module")
def boat():
    return bs.load_vehicle("suboff")


def record(boat, seed=1, sensors=None):
    manoeuvre = bs.load_manoeuvre("horizontal", boat)
    truth = bs.simulate(boat, manoeuvre, dt=1.0)
    sensors = sensors or bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw"))
    return manoeuvre, bs.observe(truth, sensors, np.random.default_rng(seed))


def pose(boat, disturbance, seed=1, sensors=None, **options):
    manoeuvre, readings = record(boat, seed, sensors)
    return bs.Problem(boat, manoeuvre, readings, free=FREE, prior=PRIOR, dt=2.0, disturbance=disturbance, **options)


def unknown(**changes):
    sds = {axis: bs.priors.log_normal(1e-4, 0.7) for axis in AXES}
    values = {"axes": AXES, "sds": sds, "correlation_time_s": bs.priors.log_normal(60.0, 0.5), "knot_interval_s": 40.0}
    return UnknownDisturbance(**values | changes)


@pytest.fixture(scope="module")
def problem(boat):
    return pose(boat, unknown())


@pytest.mark.parametrize("kind", ["ornstein_uhlenbeck", "matern_3_2"])
def test_forces_at_knots_are_projections_of_the_process(kind):
    """Sampled finely and projected on hats by least squares, histories have the covariance of the prior.

    Where the process has gone on for some time, and goes on: there is no more to a projection at its ends.
    """
    knots, time, n = Knots(np.linspace(0.0, 90.0, 19), ("Y",)), 8.0, 4000
    fine = np.linspace(0.0, 90.0, 1441)
    process = Disturbance(("Y",), np.ones(1), time, kind)
    rng = np.random.default_rng(3)
    histories = np.array([process.sample(fine, rng).values[:, 0] for _ in range(n)])
    found = np.linalg.lstsq(knots.interpolation(fine), histories.T)[0][6:13]
    factor = innovations.factor(kind, knots.interval, 7, time)
    standard = np.linalg.solve(factor, found)
    covariance = standard @ standard.T / n
    # Standard errors of the entries are 1/sqrt(n), on the diagonal sqrt(2) times as much; 28 entries.
    assert np.abs(covariance - np.eye(7)).max() < 4.0 * np.sqrt(2.0 / n) + 0.02


def projected_covariance(kind, interval, n, time, fine=24, beyond=20):
    """The covariance of the forces at knots in the middle of a long process, by quadrature over its hats."""
    times = np.linspace(0.0, (n + 2 * beyond - 1) * interval, (n + 2 * beyond - 1) * fine + 1)
    hats = np.maximum(0.0, 1.0 - np.abs(times[:, None] / interval - np.arange(n + 2 * beyond)))
    lags = np.abs(times[:, None] - times)
    covariance = correlation(kind, lags / time)
    weights = np.full(len(times), 1.0)
    weights[[0, -1]] = 0.5
    means = hats.T * weights @ covariance @ (hats * weights[:, None])
    inverse = np.linalg.inv(hats.T * weights @ hats)
    return (inverse @ means @ inverse)[beyond : beyond + n, beyond : beyond + n]


@pytest.mark.parametrize("kind", ["ornstein_uhlenbeck", "matern_3_2"])
@pytest.mark.parametrize("time", [0.8, 4.0, 60.0])
def test_the_covariance_is_that_of_the_projection(kind, time):
    """From the closed form, against sums over a process that goes on before and after; more lags change nothing."""
    factor = innovations.factor(kind, 2.0, 9, time)
    expected = projected_covariance(kind, 2.0, 9, time)
    np.testing.assert_allclose(factor @ factor.T, expected, atol=4e-3)
    np.testing.assert_allclose(innovations.factor(kind, 2.0, 9, time, 6), factor, atol=1e-9)
    other = innovations.factor(kind, 2.0, 9, 1.3 * time)
    assert np.abs(other @ other.T - expected).max() > 2e-2


def test_white_coordinates_and_forces_are_each_other(problem):
    """There and back."""
    (history,), values = problem.histories, problem.prior.sample(np.random.default_rng(1), 3)
    sequences = history.innovations(values)
    white = sequences.white(problem.forces(values))
    np.testing.assert_allclose(white.reshape(3, -1), values[:, history.columns], atol=1e-9)


@pytest.fixture(scope="module")
def carried(boat):
    """In a yaw moment and a current that vary, each with a time of its own, and a constant current besides."""
    axes = ("N", "east", "north")
    sds = {"N": 1e-6, "east": bs.priors.log_normal(0.2, 0.7), "north": 0.1}
    time = bs.priors.log_normal(100.0, 0.5)
    disturbance = unknown(axes=axes, sds=sds, correlation_time_s=40.0, correlation_time_current_s=time)
    sensors = [bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw")), bs.sensors.DVL(0.01, 10.0)]
    return pose(boat, disturbance, sensors=sensors, nuisance={"current_north_mps": bs.priors.normal(0.0, 0.3)})


@pytest.fixture(scope="module")
def followed(boat):
    """With noise that depends on the reading before, less often than once between knots, and a clock that is late."""
    track = bs.sensors.modified(
        bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw")), instrument="gps"
    )
    slow = [
        bs.sensors.Sensor("r_degps", sd=0.01, interval_s=70.0),
        bs.sensors.Sensor("u_mps", sd=0.01, interval_s=15.0),
    ]
    noise = {"r": AR1(2e-4, 100.0), "u": AR1(0.01, 30.0)}
    clock = {"clock_gps_s": bs.priors.normal(0.3, 0.2)}
    return pose(boat, unknown(), sensors=[track, *slow], noise=noise, nuisance=clock)


@pytest.mark.parametrize("name", ["problem", "carried", "followed"])
def test_the_jacobian_is_that_of_the_readings(name, request):
    """By coefficients, sds, the correlation time and white coordinates, against central differences."""
    problem = request.getfixturevalue(name)
    values = problem.prior.parameters(np.random.default_rng(4).standard_normal(problem.n_params) * 0.5)
    jacobian = problem.jacobian(values)
    picked = [*range(9), len(FREE) + 12, problem.n_params - 50, problem.n_params - 20, problem.n_params - 1]
    for k in picked:
        step = np.zeros(problem.n_params)
        step[k] = 1e-4 * problem.prior.sd[k]
        plus, minus = problem.residuals(np.array([values + step, values - step]))
        difference = (plus - minus) / (2.0 * step[k])
        assert np.abs(difference - jacobian[:, k]).max() < 1e-5 * np.abs(difference).max(), problem.names[k]


@pytest.fixture(scope="module")
def trials(boat):
    """Two trials with forces."""
    return JointProblem({"a": pose(boat, unknown(), 1), "b": pose(boat, unknown(), 2)})


def white_of(problem):
    return np.concatenate([history.columns for history in problem.histories])


def policies(problem, values, y):
    """Of members of one vector (n_params,) with standard normal y (n, n_white): policies, and log determinants."""
    members = np.repeat(values[None], len(y), axis=0)
    _, predicted, states = problem.flown(members)
    laws, log_determinant, first = [], 0.0, 0
    for history, seen in zip(problem.histories, states, strict=True):
        sequences, residuals = history.innovations(members), problem.residuals(members, predicted)[:, history.rows]
        shape, last = sequences.roots.shape, first + len(history.columns)
        white, own = members[:, history.columns].reshape(shape), y[:, first:last].reshape(shape)
        pieces, first = history.response(values), last
        law, more = policy(pieces, np.ones((len(y), 1)), sequences, residuals, white, own, seen)
        laws.append(law)
        log_determinant += more[0]
    return members, laws, log_determinant


@pytest.mark.parametrize("name", ["problem", "carried", "followed", "trials"])
def test_forces_follow_a_policy_during_the_simulation(name, request):
    """What was flown is what the forces fly that were chosen; members are what they are without others.

    Each is a function of the y before it, and of all of them together the determinant is told, on the real motion.
    """
    problem = request.getfixturevalue(name)
    values = problem.prior.parameters(np.random.default_rng(4).standard_normal(problem.n_params) * 0.3)
    white, step = white_of(problem), 1e-4
    y = np.random.default_rng(5).standard_normal(len(white))
    sides = np.concatenate([y + step * np.eye(len(white)), y - step * np.eye(len(white))])
    members, laws, log_determinant = policies(problem, values, np.vstack([y, sides]))
    flown, predicted, _ = problem.flown(members, laws)
    np.testing.assert_allclose(predicted[:9], problem.predicted(flown[:9]), rtol=1e-9, atol=1e-9)
    others = np.delete(np.arange(problem.n_params), white)
    np.testing.assert_array_equal(flown[:, others], members[:, others])
    alone, one, _ = policies(problem, values, y[None])
    np.testing.assert_allclose(problem.flown(alone, one)[0][0], flown[0], rtol=1e-9, atol=1e-12)
    plus, minus = np.split(flown[1:, white], 2)
    by_y = (plus - minus).T / (2.0 * step)
    assert np.linalg.slogdet(by_y)[1] == pytest.approx(-0.5 * log_determinant, abs=1e-3)
    first = 0
    for history in problem.histories:
        own = slice(first, first := first + len(history.columns))
        n_axes, n_knots = history.innovations(values[None]).roots.shape[1:]
        blocks = by_y[own, own].reshape(n_axes, n_knots, n_axes, n_knots).transpose(1, 0, 3, 2)
        in_time = blocks.reshape(n_axes * n_knots, -1)
        np.testing.assert_allclose(in_time - np.tril(in_time), 0.0, atol=1e-7)


def test_later_forces_make_good_what_is_not_linear(boat):
    """Of histories given the readings y is standard normal; negative control: with forces chosen before it is less."""
    problem = pose(boat, unknown(knot_interval_s=10.0))
    (history,), best = problem.histories, problem.reference
    y = np.random.default_rng(1).standard_normal((64, len(history.columns)))

    def planned(y):
        members, laws, _ = policies(problem, best, y)
        return members, laws, np.column_stack([members[:, : history.columns[0]], _moved(members, laws, history)])

    for _ in range(4):
        best = planned(0.0 * y[:1])[2][0]
    members, laws, open_loop = planned(y)
    spreads = []
    for full in (open_loop, problem.flown(members, laws)[0]):
        squares = np.sum(problem.residuals(full) ** 2, axis=1) + np.sum(full[:, history.columns] ** 2, axis=1)
        spreads.append(np.std(squares - np.sum(y**2, axis=1)))
    assert spreads[1] < 0.2 * spreads[0]


def _moved(members, laws, history):
    """(n, n_white) white coordinates that follow a policy on a linear motion."""
    return members[:, history.columns] + laws[0].followed().reshape(len(members), -1)


def test_no_forces_change_nothing(boat, problem):
    """With white coordinates of zero the readings are those of the problem without a disturbance."""
    plain = pose(boat, None)
    values = problem.prior.parameters(np.zeros(problem.n_params))
    np.testing.assert_allclose(
        problem.predicted(values), plain.predicted(values[: plain.n_params]), rtol=1e-12, atol=1e-12
    )


def test_a_current_enters_the_readings_and_not_the_motion(carried):
    """The readings are those that a boat in that history of the water makes, and a constant current adds to it."""
    rng = np.random.default_rng(6)
    values = carried.prior.parameters(0.5 * rng.standard_normal(carried.n_params))
    sets, nuisances = carried.arguments(values[None])
    history = carried.forward.history(nuisances)
    motion = carried.forward.trajectory(sets, nuisances)
    sensors = [bs.sensors.Track(0.5, 0.1, interval_s=10.0, channels=("x", "y", "yaw")), bs.sensors.DVL(0.01, 10.0)]
    north = values[carried.names.index("current_north_mps")]
    assert history.of_current.axes == ("east", "north")
    assert motion.simulator.forces.of_forces.axes == ("N",)
    truth = bs.observe(motion, sensors, None, current_mps=(north, 0.0))
    np.testing.assert_allclose(carried.predicted(values[None])[0], truth.values, rtol=1e-9, atol=1e-9)


def test_a_current_alone_leaves_the_kernels_without_forces(boat):
    """No forces are flown where only the water varies."""
    current = pose(boat, unknown(axes=("north",), sds={"north": 0.1}))
    assert current.simulator.knots is None
    assert current.simulator.kernels is pose(boat, None).simulator.kernels
    jacobian = current.jacobian(current.prior.mean)
    assert np.abs(jacobian[:, current.histories[0].columns]).max() > 0.0


def test_names_say_whose_a_parameter_is(problem):
    """The process first, then the history axis after axis; all else is neither."""
    rest = problem.names[problem.n_coefficients :]
    assert rest[:3] == ("sd_disturbance_X", "sd_disturbance_N", "correlation_time_disturbance_s")
    assert all(map(of_process, rest[:3]))
    assert all(map(of_history, rest[3:]))
    assert not any(of_process(name) or of_history(name) for name in (*FREE, "sd_yaw_deg", "correlation_time_yaw_s"))
    n_knots = len(problem.forward.disturbances.knots.times)
    assert problem.forces(problem.prior.mean).shape == (1, 2, n_knots)
    assert len(rest) == 3 + 2 * n_knots


def test_trials_share_the_process_and_not_the_history(trials):
    """The parameters of the process once, histories for each trial; its rows and columns are those of the trial."""
    joint = trials
    assert sum(map(of_process, joint.names)) == 3
    first, second = joint.histories
    assert {joint.names[k].partition("[")[2] for k in second.columns} == {"b]"}
    assert second.rows.start == first.rows.stop
    np.testing.assert_array_equal(first.process, second.process)
    values = joint.prior.sample(np.random.default_rng(1), 1)
    jacobian = joint.jacobian(values[0])
    assert not jacobian[first.rows][:, second.columns].any()


def test_searches_know_a_wide_process(problem):
    """The view without parameters of the process has the same histories and the same counter."""
    wide = problem.with_wide_process()
    assert not any(map(of_process, wide.names))
    assert wide.costs is problem.costs
    process = problem.forward.disturbances.wide_process
    assert process["sd_disturbance_X"] == pytest.approx(1e-4 * np.exp(0.7 * 2.3263), rel=1e-4)
    assert process["correlation_time_disturbance_s"] == pytest.approx(60.0)
    values = problem.prior.parameters(np.zeros(problem.n_params))
    values[-5:] = 1.0
    values[[problem.names.index(name) for name in process]] = list(process.values())
    held = np.delete(values, [problem.names.index(name) for name in process])
    np.testing.assert_allclose(wide.forces(held), problem.forces(values), rtol=1e-5)
    plain = wide.naive()
    assert plain.histories == ()
    assert plain.with_wide_process() is plain


@pytest.mark.parametrize(
    ("changes", "kind", "key"),
    [
        ({"axes": ("X", "Z"), "sds": {"X": 1e-4, "Z": 1e-4}}, "conflict", "Z"),
        ({"knot_interval_s": 2.0}, "limit", "knot_interval_s"),
        ({"correlation_time_s": 1.0, "knot_interval_s": 40.0}, "conflict", "correlation_time_s"),
        ({"sds": {"X": 0.0, "N": 1e-4}}, "value", "X"),
        ({"sds": {"X": 1e-4}}, "conflict", "sds"),
        ({"kind": "pink"}, "unknown", "kind"),
    ],
)
def test_bad_input_is_one_line(boat, changes, kind, key):
    """Names the key, and what to do."""
    with refused(kind, key) as error:
        pose(boat, unknown(**changes))
    assert "\n" not in str(error.value)


def test_knots_end_with_the_readings(boat):
    """The last knot is at the last reading, and no interval is longer than what was asked for."""
    disturbances = Disturbances(unknown(correlation_time_s=60.0), boat, 590.0)
    times = disturbances.knots.times
    assert times[0] == 0.0
    assert times[-1] == 590.0
    assert np.all(np.diff(times) <= 40.0 + 1e-9)
