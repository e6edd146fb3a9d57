"""Searches on the readings from random starts: SQP and trust-region least squares, side by side."""

import importlib
import threading

import numpy as np
import pytest
from support.refusals import refused
from support.toys import Linear, Toy

import bayesub as bs
from bayesub.inference.baselines import Estimate, gauss_newton, posterior_mode, sqp, trust_region
from bayesub.inference.baselines.starts import Normalised, together
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem.priors import Normal, Uniform


@pytest.fixture
def overdetermined(rng):
    """A linear problem in three unknowns with noise, whose guess is 5 % off."""
    truth = np.array([1.0, -2e-3, 30.0])
    matrix = rng.standard_normal((40, 3)) / truth
    guess = 1.05 * truth
    return Linear(matrix, matrix @ truth + 0.01 * rng.standard_normal(40), Normal(guess, 0.25 * np.abs(guess)))


def test_sqp_minimises_the_residuals(overdetermined):
    """Every start ends at the least-squares solution; the best comes first."""
    problem = overdetermined
    found = sqp(problem, rng=np.random.default_rng(1), n_starts=3)
    best = np.linalg.lstsq(problem.matrix, problem.readings)[0]
    # SLSQP stops when the logarithm of the cost changes by 1e-10: the unknowns are good to about its square root.
    np.testing.assert_allclose(found.solutions, np.tile(best, (3, 1)), rtol=1e-4)
    assert np.all(np.diff(found.costs) >= 0)
    assert found.costs[0] == pytest.approx(np.sum(problem.residuals(found.values[None]) ** 2), rel=1e-9)
    assert found.evaluations > 0


def test_sqp_keeps_to_its_bounds_and_seed(overdetermined):
    """Solutions stay within the bounds about the guess, and the same seed gives the same answer."""
    narrow = [
        sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2, start_spread=0.01, bounds=0.02) for _ in "ab"
    ]
    assert np.abs(narrow[0].solutions / overdetermined.prior.mean - 1).max() <= 0.02 + 1e-9
    np.testing.assert_array_equal(narrow[0].solutions, narrow[1].solutions)


@pytest.mark.parametrize("gradients", ["exact", "forward"])
def test_sqp_with_either_gradient(overdetermined, gradients):
    """Both lead to the least-squares solution of a well-conditioned problem."""
    found = sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2, gradients=gradients)
    best = np.linalg.lstsq(overdetermined.matrix, overdetermined.readings)[0]
    np.testing.assert_allclose(found.solutions, np.tile(best, (2, 1)), rtol=1e-4)


def test_the_stopping_rule_of_the_thesis(overdetermined):
    """Loose tolerances stop a search early and say so; with tight ones it ends as without."""
    full = sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2)
    loose = sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2, tolerances=(1.0, 1e9))
    tight = sqp(overdetermined, rng=np.random.default_rng(1), n_starts=2, tolerances=(1e-12, 1e-12))
    assert loose.statuses == ("stopped by the tolerances",) * 2
    assert np.all(loose.efforts < full.efforts)
    assert loose.costs[0] >= full.costs[0]
    np.testing.assert_array_equal(tight.solutions, full.solutions)


def test_trust_region_finds_the_least_squares_solution(overdetermined):
    """Of a linear problem, with its covariance, from every start."""
    found = trust_region(overdetermined, rng=np.random.default_rng(1), n_starts=3)
    best = np.linalg.lstsq(overdetermined.matrix, overdetermined.readings)[0]
    np.testing.assert_allclose(found.solutions, np.tile(best, (3, 1)), rtol=1e-9)
    normal = overdetermined.matrix.T @ overdetermined.matrix
    np.testing.assert_allclose(found.covariance, np.linalg.inv(normal), rtol=1e-9)
    assert Estimate.from_json(found.to_json()).to_json() == found.to_json()


def test_trust_region_has_no_covariance_without_rank(rng):
    """Two unknowns of which only the sum is read."""
    problem = Linear(np.ones((20, 2)), 3.0 + 0.1 * rng.standard_normal(20), Normal(np.ones(2), np.ones(2)))
    assert trust_region(problem, rng=rng).covariance is None


def test_bounds_are_kept_where_the_minimum_lies_beyond_them(overdetermined):
    """A minimum 5 % away with bounds of 2 % ends at a bound."""
    options = {"n_starts": 2, "start_spread": 0.01, "bounds": 0.02}
    for fit in (sqp, trust_region):
        found = fit(overdetermined, rng=np.random.default_rng(2), **options)
        off = np.abs(found.solutions / overdetermined.prior.mean - 1)
        assert off.max() <= 0.02 + 1e-12
        np.testing.assert_allclose(off.max(axis=1), 0.02, rtol=1e-6)


class Cliff(Toy):
    """``x0 x1 = 1`` and ``x1 = 1`` are read with the guess at 1.3, but beyond ``x0 < 1.1`` the simulation fails."""

    def __init__(self, edge=1.1):
        super().__init__(Normal(np.array([1.3, 1.3]), np.array([0.3, 0.3])))
        self.edge = edge

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        a, b = np.atleast_2d(parameters).T
        values = 100.0 * np.stack([a * b - 1.0, b - 1.0, 0.1 * (a - 1.12)], axis=1)
        return np.where((a < self.edge)[:, None], np.nan, values)

    def slopes(self, parameters):
        a, b = parameters
        return 100.0 * np.array([[b, a], [0.0, 1.0], [0.1, 0.0]])


@pytest.mark.parametrize("gradients", ["exact", "forward"])
def test_failed_simulations_are_stepped_back_from(gradients):
    """The minimum of a cost whose descent leads over a cliff is approached from the side where simulations succeed."""
    problem = Cliff()
    steps = []
    inner = problem.residuals
    problem.residuals = lambda p: (steps.append(np.isnan(r := inner(p)).any()), r)[1]
    found = sqp(problem, rng=np.random.default_rng(4), n_starts=4, start_spread=0.05, gradients=gradients)
    assert any(steps)
    assert np.all(np.isfinite(found.costs))
    started = np.sum(inner(found.starts) ** 2, axis=1)
    assert np.all(found.costs < 0.5 * started)
    assert np.all(found.solutions[:, 0] >= problem.edge)


def test_trust_region_steps_back_from_failed_simulations():
    """As SQP does: it ends on the safe side, where the cliff has stopped it."""
    problem = Cliff(edge=1.05)
    found = trust_region(problem, rng=np.random.default_rng(4), n_starts=4, start_spread=0.05)
    assert np.all(found.solutions[:, 0] >= problem.edge)
    assert np.all(found.costs < 0.1 * np.sum(problem.residuals(found.starts) ** 2, axis=1))


def test_starts_that_fail_are_drawn_again():
    """All starts simulate; if none can be had, the error says what to change."""
    problem = Cliff(edge=1.3)
    starts = Normalised(problem).draw(np.random.default_rng(1), 50, 0.1)
    assert np.all(starts[:, 0] >= 1.0)
    problem.edge = 2.0
    with pytest.raises(ValueError, match="lower start_spread"):
        sqp(problem, rng=np.random.default_rng(1))


def test_unknown_gradients_are_named(overdetermined):
    with refused("unknown", "gradients"):
        sqp(overdetermined, rng=np.random.default_rng(1), gradients="central")


def test_searches_in_lockstep_are_answered_in_batches():
    """Three searches that ask 2, 5 and 3 questions take five rounds, each with all that are still searching."""
    rounds, done = [], []

    class Progress:
        def update(self, *numbers):
            done.append(numbers)

    def search(n_questions):
        return lambda ask: sum(ask((n_questions, k)) for k in range(n_questions))

    def answer(questions):
        rounds.append(questions)
        return [10 * n + k for n, k in questions]

    assert together([search(n) for n in (2, 5, 3)], answer, Progress()) == [41, 260, 93]
    assert rounds[0] == [(2, 0), (5, 0), (3, 0)]
    assert [len(r) for r in rounds] == [3, 3, 2, 1, 1]
    assert done == [(1, 3, "starts"), (2, 3, "starts"), (3, 3, "starts")]


def test_an_error_ends_every_search():
    """Neither an error in a search nor one in the answer leaves a thread waiting."""

    def stumbles(ask):
        raise RuntimeError(f"stumbled at {ask(1)}")

    before = threading.active_count()
    with pytest.raises(RuntimeError, match="stumbled at 1"):
        together([lambda ask: ask(1) + ask(2), stumbles], lambda questions: questions)
    with pytest.raises(ZeroDivisionError):
        together([lambda ask: ask(1)] * 3, lambda questions: [1 / 0 for _ in questions])
    assert threading.active_count() == before


@pytest.mark.parametrize("fit", [sqp, trust_region])
def test_side_by_side_is_one_after_the_other(suboff, spiral, spiral_track, fit):
    """Bit for bit, on a boat, and the counts of simulations add up."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 5.0), None)
    held = ("Yvdot", "Nvdot", "Nrdot")
    problem = bs.Problem(
        suboff,
        spiral,
        record,
        free=[name for name in HORIZONTAL if name not in held],
        prior=bs.priors.relative_normal(0.25),
        dt=spiral_track.simulator.step,
    )
    options = {"gradients": "forward"} if fit is sqp else {}
    together_ = fit(problem, rng=np.random.default_rng(7), n_starts=3, max_iterations=6, **options)
    rng = np.random.default_rng(7)
    alone = [fit(problem, rng=rng, n_starts=1, max_iterations=6, **options) for _ in range(3)]
    alone.sort(key=lambda estimate: estimate.costs[0])
    np.testing.assert_array_equal(together_.solutions, np.concatenate([a.solutions for a in alone]))
    np.testing.assert_array_equal(together_.starts, np.concatenate([a.starts for a in alone]))
    assert together_.efforts.tolist() == [a.efforts[0] for a in alone]


def test_forward_differences_lead_as_exact_gradients_do(suboff, spiral, spiral_track):
    """From the same start the first iterations agree to the error of the differences."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 5.0), None)
    problem = bs.Problem(
        suboff, spiral, record, free=("Xuu", "Yuv", "Nuv", "Nuu_dr"), prior=bs.priors.relative_normal(0.25), dt=1.0
    )
    exact, forward = (
        sqp(problem, rng=np.random.default_rng(7), n_starts=2, max_iterations=3, gradients=gradients)
        for gradients in ("exact", "forward")
    )
    # A step of 1.5e-8 over a curvature of order 1e2 in the logarithm: the gradient is good to 1e-6 of itself.
    np.testing.assert_allclose(forward.solutions, exact.solutions, rtol=1e-4)
    assert forward.costs[0] < 1e-2 * np.max(np.sum(problem.residuals(forward.starts) ** 2, axis=1))


def test_readings_without_noise_are_the_track(spiral_track):
    """With no generator the sensor reads the truth."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 60.0, ("x", "yaw")), None)
    at = np.searchsorted(spiral_track.times, record.channels[0].times - 1e-9)
    np.testing.assert_array_equal(record.channels[0].values, spiral_track.states[0, at, 0])
    np.testing.assert_array_equal(record.channels[1].values, spiral_track.states[0, at, 5])


class TwoWells(Toy):
    """Zero residual at -2 and 2, of which another reading prefers 2; the middle of the prior is on the other side."""

    def __init__(self, prior=None):
        super().__init__(Normal(mean=np.array([-0.3]), sd=np.array([3.0])) if prior is None else prior)

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        return np.concatenate([3.0 * (parameters**2 - 4.0), parameters - 2.0], axis=1)

    def slopes(self, parameters):
        return np.array([[6.0 * parameters[0]], [1.0]])


@pytest.mark.parametrize("prior", [None, Uniform(np.array([-6.0]), np.array([5.4]))])
def test_the_mode_is_the_lowest_of_several_wells(prior):
    """One search from the middle of the prior ends in the well next to it, which is twice as high."""
    problem = TwoWells(prior)
    one, best = gauss_newton(problem), posterior_mode(problem, rng=np.random.default_rng(0))
    assert one.values[0] == pytest.approx(-2.0, abs=0.1)
    assert best.values[0] == pytest.approx(2.0, abs=0.1)
    assert best.costs[0] < 0.5 * one.costs[0]


def test_a_search_ends_where_its_cost_is_enough():
    """Within bounds the search that confirms a mode ends where its cost is that of the mode."""
    found = gauss_newton(problem := TwoWells(), np.array([5.0]))
    short = gauss_newton(problem, np.array([5.0]), enough=lambda cost: cost < found.costs[0] + 1.0)
    assert found.costs[0] < short.costs[0] < found.costs[0] + 1.0
    assert short.statuses == ("converged",)
    assert short.jacobians < found.jacobians


@pytest.mark.parametrize("start", [1.9, -1.9, -0.3])
def test_a_search_from_near_the_mode_is_the_only_one(start, monkeypatch):
    """Where it ends in the higher well, or in none, it is not trusted, and the others follow."""
    module = importlib.import_module("bayesub.inference.baselines.posterior_mode")
    searches, search = [], module.gauss_newton
    monkeypatch.setattr(module, "gauss_newton", lambda *a: searches.append(a) or search(*a))
    problem = TwoWells()
    found = posterior_mode(problem, rng=np.random.default_rng(0), start={problem.names[0]: start})
    assert found.values[0] == pytest.approx(2.0, abs=0.1)
    assert (len(searches) == 1) == (start > 0.0)
    with refused("unknown", "Yvu"):
        posterior_mode(problem, rng=np.random.default_rng(0), start={"Yvu": 1.0})


class Steps(Toy):
    """Twenty parameters whose cubes are read too, and a reading that jumps a thousand times while one grows by one."""

    def __init__(self, height):
        super().__init__(Normal(mean=np.zeros(20), sd=np.full(20, 10.0)))
        self.height = height

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        jumps = self.height * np.sin(7.0 * np.floor(1000.0 * parameters[:, :1]))
        return np.concatenate([parameters + 0.1 * parameters**3 - 1.0, jumps], axis=1)

    def slopes(self, parameters):
        return np.concatenate([np.diag(1.0 + 0.3 * parameters**2), np.zeros((1, 20))])


@pytest.mark.parametrize(("height", "agree"), [(1.0, True), (5.0, False)])
def test_searches_agree_on_a_mode_that_has_little_steps(height, agree, monkeypatch):
    """Two that end within what tells twenty parameters apart are enough; where steps are large others follow."""
    module = importlib.import_module("bayesub.inference.baselines.posterior_mode")
    costs, search = [], module.gauss_newton
    monkeypatch.setattr(module, "gauss_newton", lambda *a: costs.append(search(*a)) or costs[-1])
    posterior_mode(Steps(height), rng=np.random.default_rng(0))
    assert abs(costs[0].costs[0] - costs[1].costs[0]) > 0.1
    assert (len(costs) == 2) == agree


def test_trust_region_has_no_covariance_with_null_directions(suboff, spiral, spiral_track):
    """All added masses are free: along three directions the track says nothing, whatever the error of the Jacobian."""
    record = bs.observe(spiral_track, bs.sensors.Track(1.0, 1.0, 20.0), np.random.default_rng(1))
    prior = bs.priors.relative_normal(0.1)
    free = ("Yuv", "Nuv", "Yuu_dr", "Nuu_dr", "Yur", "Nur", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
    problem = bs.Problem(suboff, spiral, record, free=free, prior=prior, dt=1.0)
    if bs.identifiability.null_space(problem, problem.prior.mean):
        assert trust_region(problem, rng=np.random.default_rng(1), max_iterations=2).covariance is None
    fewer = bs.Problem(suboff, spiral, record, free=free[:4], prior=prior, dt=1.0)
    assert trust_region(fewer, rng=np.random.default_rng(1), max_iterations=5).covariance is not None


class Runaway(Cliff):
    """A boat that runs away beyond the cliff, and whose derivatives run away before it does."""

    def residuals(self, parameters):
        values = super().residuals(parameters)
        return np.where(np.isnan(values), 1e200, values)

    def slopes(self, parameters):
        return super().slopes(parameters) * (1e200 if parameters[0] < self.edge + 0.05 else 1.0)


@pytest.mark.parametrize("start", [1.3, 1.12])
def test_numbers_that_overflow_are_no_warning(start):
    """Squares and products of what runs away are infinite costs, which a search steps back from; users read nothing."""
    problem = Runaway()
    gauss_newton(problem, np.array([start, 1.3]))
    for search in (sqp, trust_region):
        solution = search(problem, rng=np.random.default_rng(4), n_starts=4, start_spread=0.05)
        assert np.isfinite(solution.costs).all()
    sqp(problem, rng=np.random.default_rng(4), n_starts=4, start_spread=0.3, gradients="forward")


@pytest.mark.parametrize("search", [sqp, trust_region])
def test_what_is_guessed_to_be_zero_is_searched_too(search, rng):
    """As something informed: ratios to a guess of zero would hold it there."""
    matrix = rng.standard_normal((40, 2))
    problem = Linear(
        matrix, matrix @ [1.0, 3.0] + 0.01 * rng.standard_normal(40), Normal(np.array([1.1, 0.0]), np.ones(2))
    )
    found = search(problem, rng=np.random.default_rng(1), n_starts=2)
    np.testing.assert_allclose(found.values, [1.0, 3.0], atol=0.1)
