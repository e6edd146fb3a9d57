"""Regressors that histories follow: a linear toy against closed forms, chance, and a boat that lacks a term."""

import numpy as np
import pytest
from scipy import stats
from support.toys import Linear

import bayesub as bs
from bayesub.findings import missing_terms
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling.histories import marginal_mode
from bayesub.kernels.kalman import HATS, Pieces
from bayesub.model.equations import load_equations
from bayesub.problem.distributions import joined
from bayesub.problem.disturbances import Disturbances, History, UnknownDisturbance
from bayesub.problem.priors import normal

BOAT = bs.load_vehicle("auv690")
KNOTS = Disturbances(UnknownDisturbance(("Y",), {"Y": 1e-5}, 4.0, knot_interval_s=2.0), BOAT, 80.0)
TERMS = {name: load_equations("booth").term(name) for name in ("Yuv", "Yv_absnu", "Yuu_dr")}
CANDIDATES = [missing_terms.Candidate("Y", term.regressor, term) for term in TERMS.values()]
CANDIDATES.append(missing_terms.Candidate("Y", "r*r", None))
FREE = ("Xuu", "Yuv", "Yv_absnu", "Yur", "Yuu_dr", "Nuv", "Nur", "Nuu_dr")
NOISE = 0.3  # of readings of the force, of its sd


def lines(times):
    """(n, 4) regressors: the last is nearly the third."""
    slow = np.sin(times / 9.0)
    columns = [slow, np.cos(times / 5.0), np.where(times > 40.0, 1.0, -1.0), 0.0 * times]
    columns[3] = columns[2] + 0.05 * slow
    return np.column_stack(columns)


class Known(History):
    """A history that is read knot by knot, by the last of which all forces are states."""

    disturbances = KNOTS

    def response(self, _):
        n = len(self.columns)
        ends = np.zeros((1, n - 1, n, n + HATS))
        for k in range(n - 1):
            ends[0, k] = np.eye(n, n + HATS)
            ends[0, k, k, n] = 1.0
        rows = np.eye(n, n + HATS) / (NOISE * Forces.scale)
        rows[n - 2 :] = np.roll(rows[n - 2 :], 2, axis=1)
        return Pieces(ends, rows[None], np.arange(n), np.append(np.zeros(n - 1, dtype=int), n))


class Forces(Linear):
    """Readings of a force: a free coefficient times a regressor of its own, and a history."""

    def __init__(self, readings=0.0):
        (process,) = KNOTS.factor(np.zeros((1, 0)))
        n = len(process)
        Forces.scale = np.sqrt(np.mean(np.sum(process**2, axis=1)))
        self.own = 5.0 * self.scale * np.cos(np.arange(n) / 3.0)
        prior = joined(normal(0.0, 1.0), {f"disturbance_Y_{k}": normal(0.0, 1.0) for k in range(n)})
        matrix = np.column_stack([self.own, process])
        super().__init__(matrix, np.zeros(n) + readings, prior, NOISE * self.scale)
        self.histories = (Known(slice(0, n), np.arange(1, n + 1), np.array([], dtype=int), None, np.arange(n + 1)),)
        self.prior_of_others = joined(normal(0.0, 1.0), {})

    def jacobian_of_others(self, parameters, _=None):
        return self.jacobian(parameters)[:, :1]

    def each_trial(self, parameters):
        yield "", self, parameters

    @property
    def marginal(self):
        """(n, n) covariance of the readings."""
        return self.matrix @ self.matrix.T + self.sd**2 * np.eye(len(self.matrix))

    def draws(self, rng, n):
        return rng.multivariate_normal(self.mean, self.covariance, n)


@pytest.fixture
def scored(monkeypatch):
    """scored(factors, rng): the toy with terms of these sizes added to what is random, and its scores."""
    fine, knots = lines(KNOTS.knots.fine_times), KNOTS.knots
    monkeypatch.setattr(missing_terms, "_candidates", lambda *_: (CANDIDATES, fine))

    def score(factors, rng):
        toy = Forces()
        random = np.linalg.cholesky(toy.marginal) @ rng.standard_normal(len(toy.matrix))
        toy = Forces(random + knots.projection(fine) @ np.asarray(factors))
        return toy, missing_terms.scores(toy, toy.draws(rng, 50))

    return score


def test_scores_are_those_of_generalised_least_squares(scored, rng):
    toy, scores = scored([0.0] * 4, rng)
    x, weight = KNOTS.knots.projection(lines(KNOTS.knots.fine_times)), np.linalg.inv(toy.marginal)
    assert scores.information == pytest.approx(x.T @ weight @ x, rel=1e-6)
    assert scores.values == pytest.approx(x.T @ weight @ toy.readings, rel=1e-4)
    assert scores.rms == pytest.approx(np.sqrt(np.mean(lines(KNOTS.knots.fine_times) ** 2, axis=0)))
    assert (np.diag(scores.covariance) >= np.diag(scores.information)).all()
    one, both = scores.given(0), [1, 2, 3]
    exact = np.linalg.inv(np.linalg.inv(scores.information[:3, :3])[1:, 1:])  # of two, with the first one free
    assert [c.regressor for c in one.candidates] == [CANDIDATES[k].regressor for k in both]
    assert one.information[:2, :2] == pytest.approx(exact, rel=1e-6)


@pytest.mark.slow
def test_random_histories_follow_no_regressor_more_often_than_said(scored, rng):
    p_values = [scored([0.0] * 4, rng)[1].p_value() for _ in range(100)]
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    assert np.mean(np.array(p_values) < missing_terms.FALSE_ALARMS) < 0.05


def test_terms_are_named_one_after_the_other_with_those_that_look_alike(scored, rng):
    size = Forces().scale
    found = missing_terms.find_followed(scored([0.0, 7.0 * size, -9.0 * size, 0.0], rng)[1])
    assert [one.candidates[0].term.name for one in found] == ["Yuu_dr", "Yv_absnu"]
    assert [c.regressor for c in found[0].candidates] == [TERMS["Yuu_dr"].regressor, "r*r"]
    assert abs(found[0].factors[0] + 9.0 * size) < 4.0 * found[0].sds[0]
    assert abs(found[1].factors[0] - 7.0 * size) < 4.0 * found[1].sds[0]
    assert found[0].rms == pytest.approx(abs(found[0].factors[0]))
    assert found[0].p_value < 1e-3


def test_what_a_free_coefficient_takes_up_is_no_missing_term(monkeypatch, rng):
    toy = Forces()
    fine = np.interp(KNOTS.knots.fine_times, KNOTS.knots.times, toy.own)[:, None]
    monkeypatch.setattr(missing_terms, "_candidates", lambda *_: (CANDIDATES[:1], fine))
    toy = Forces(np.linalg.cholesky(toy.marginal) @ rng.standard_normal(len(toy.matrix)))
    scores = missing_terms.scores(toy, toy.draws(rng, 50))
    assert 1.0 / np.sqrt(scores.information[0, 0]) > 0.99  # as uncertain as the coefficient was before
    assert not missing_terms.find_followed(scores)


def test_a_history_larger_than_its_process_raises_no_alarm(scored, rng):
    toy, scores = scored([0.0] * 4, rng)
    larger = Forces(10.0 * toy.readings)
    again = missing_terms.scores(larger, larger.draws(rng, 50))
    assert np.abs(again.z).max() < 3.0 * max(1.0, np.abs(scores.z).max())
    assert np.abs(again.values / np.sqrt(np.diag(again.information))).max() > 5.0 * np.abs(scores.z).max()


@pytest.mark.parametrize(("missing", "names"), [((), set()), (("Yv_absnu",), {"Yv_absnu"})])
def test_a_boat_that_lacks_a_term_has_it_named(missing, names):
    """Cross-flow drag in sway, held at zero; other coefficients take up what a quarter of each can."""
    rng, spiral = np.random.default_rng(7), bs.load_manoeuvre("horizontal", BOAT)
    gusts = bs.Disturbance(("Y",), np.array([1.2]), 4.0)
    truth = bs.simulate(BOAT, spiral, dt=0.05, disturbance=gusts, rng=rng)
    sensors = [bs.sensors.Track(0.1, 0.1, channels=("x", "y", "yaw")), bs.sensors.Sensor("v_mps", sd=0.005)]
    record = bs.observe(truth, [*sensors, bs.sensors.Sensor("r_degps", sd=0.05)], rng)
    xi = BOAT.xi.copy()
    xi[BOAT.equations.columns(missing)] = 0.0
    free = [name for name in FREE if name not in missing]
    unknown = UnknownDisturbance(("Y",), {"Y": 5e-5 * 1.2 / 3.85}, 4.0, knot_interval_s=4.0)
    problem = bs.Problem(
        BOAT, spiral, record, free=free, prior=bs.priors.relative_normal(0.25), xi=xi, dt=0.4, disturbance=unknown
    )
    marginal, _ = marginal_mode(problem, gauss_newton(problem).values)
    estimate = gauss_newton(marginal)
    others = estimate.values + rng.standard_normal((60, marginal.n_params)) @ np.linalg.cholesky(estimate.covariance).T
    _, draws = marginal.density(problem, others, rng.standard_normal((60, len(marginal.white))))
    found = missing_terms.find_followed(missing_terms.scores(problem, draws[np.isfinite(draws).all(axis=1)]))
    assert names <= {c.term.name for one in found for c in one.candidates if c.term}
    assert bool(found) == bool(names)
    assert all(not found[0].candidates[0].free for _ in names)  # the term that is held, before free ones like it
