"""Regression on smoothed motion, against a Kalman filter and smoother written out, and on trials of known boats."""

import numpy as np
import pytest
from support.toys import Linear, Toy

import bayesub as bs
from bayesub.inference.baselines import smoothed_regression
from bayesub.model.coefficients import HORIZONTAL
from bayesub.model.linear_form import LinearSystem
from bayesub.problem.priors import Normal, normal

HELD = ("Yvdot", "Nvdot", "Nrdot")


class Pushed(Toy):
    """A speed that goes on by ``c g + f`` in each second, with white f, and is read after it; it begins at zero."""

    n_coefficients, TRUE, SD = 1, 2.0, 0.3

    def __init__(self, force=0.2):
        self.force = force
        rng = np.random.default_rng(4)
        self.g = np.sin(0.7 * np.arange(40)) + 0.2
        self.sums = np.tril(np.ones((40, 40)))
        pushes = self.TRUE * self.g + self.force * rng.standard_normal(40)
        self.readings = self.sums @ pushes + self.SD * rng.standard_normal(40)
        super().__init__(Normal(np.array([1.0, *np.zeros(40)]), np.array([0.5, *np.full(40, self.force)])))

    def held(self, parameters):
        off = self.readings - self.sums @ (parameters[0] * self.g)
        return Linear(self.sums, off, Normal(np.zeros(40), np.full(40, self.force)), self.SD)

    def linear_systems(self, parameters):
        return {"X": LinearSystem("X", ("c0",), self.g[:, None], parameters[0] * self.g + parameters[1:])}


def kalman_and_smoother(toy, c):
    """Speeds (41,) by a Kalman filter and the recursion of Rauch, Tung & Striebel, for a coefficient."""
    n = len(toy.readings)
    means, variances = np.zeros(n + 1), np.zeros(n + 1)
    ahead, of_ahead = np.zeros(n + 1), np.zeros(n + 1)
    for k, reading in enumerate(toy.readings, start=1):
        ahead[k], of_ahead[k] = means[k - 1] + c * toy.g[k - 1], variances[k - 1] + toy.force**2
        gain = of_ahead[k] / (of_ahead[k] + toy.SD**2)
        means[k], variances[k] = ahead[k] + gain * (reading - ahead[k]), (1.0 - gain) * of_ahead[k]
    smooth = means.copy()
    for k in range(n - 1, -1, -1):
        smooth[k] += variances[k] / of_ahead[k + 1] * (smooth[k + 1] - ahead[k + 1])
    return smooth


def by_kalman(toy, rounds):
    """Coefficient and its variance by regression on the smoothed accelerations."""
    c = 1.0
    for _ in range(rounds):
        pushes = np.diff(kalman_and_smoother(toy, c))
        c = toy.g @ pushes / (toy.g @ toy.g)
    return c, np.sum((pushes - c * toy.g) ** 2) / (len(toy.g) - 1) / (toy.g @ toy.g)


@pytest.mark.parametrize("rounds", [1, 2, 5])
def test_it_is_the_kalman_smoother_and_regression(rounds):
    """To the tolerance of the smoothing, a thousandth of a standard deviation of the forces."""
    toy = Pushed()
    c, variance = by_kalman(toy, rounds)
    found = smoothed_regression(toy, rounds=rounds)
    assert found.names == ("c0",)
    assert found.values[0] == pytest.approx(c, abs=1e-3)
    assert found.covariance[0, 0] == pytest.approx(variance, rel=0.02)
    assert found.statuses == ("unique; smoothing converged",)


def test_rounds_lead_from_the_guess_to_the_truth():
    """The motion leans towards the guess where it is smoothed; each round takes that away by as much again."""
    toy = Pushed()
    off = [abs(smoothed_regression(toy, rounds=n).values[0] - toy.TRUE) for n in (1, 2, 10)]
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.1 < off[0]


def test_without_process_noise_the_answer_is_the_guess():
    """Negative control: a motion that is the guess's own says nothing else, whatever was read."""
    toy = Pushed(force=1e-6)
    assert smoothed_regression(toy, rounds=3).values[0] == pytest.approx(1.0, abs=1e-6)


def test_a_trial_is_followed_better_than_by_the_guess(suboff, spiral, spiral_track):
    """The track of a spiral, read each second, with coefficients that are 20 % off before."""
    columns = ("x_m", "y_m", "yaw_deg", "u_mps", "v_mps", "r_degps")
    sensors = [bs.sensors.Sensor(column, sd=1e-3, interval_s=2.0) for column in columns]
    record = bs.observe(spiral_track, sensors, np.random.default_rng(8))
    free = [name for name in HORIZONTAL if name not in HELD]
    off = bs.priors.perturbed(suboff.xi, 0.2, np.random.default_rng(3))
    xi = np.where(np.isin(suboff.equations.names, free), off, suboff.xi)
    forces = bs.UnknownDisturbance(("X", "Y", "N"), dict.fromkeys("XYN", 1e-3), 4.0, knot_interval_s=2.0)
    options = {"free": free, "prior": bs.priors.relative_normal(0.2, xi), "xi": xi, "dt": 1.0}
    nuisance = {"u0_mps": normal(suboff.speed_mps, 0.1)}
    problem = bs.Problem(suboff, spiral, record, nuisance=nuisance, disturbance=forces, **options)
    found = smoothed_regression(problem)
    guess, values = problem.prior.mean.copy(), problem.prior.mean.copy()
    values[[problem.names.index(name) for name in found.names]] = found.values
    rows = problem.rows["x"]
    before, after = (
        np.sqrt(np.mean(off[rows] ** 2)) for off in problem.predicted(np.array([guess, values])) - problem.readings
    )
    assert after < 0.2 * before


@pytest.mark.parametrize("nuisance", [{}, {"bias_yaw_deg": normal(0.0, 1.0)}, {"clock_track_s": normal(0.0, 0.2)}])
def test_a_boat_whose_start_is_known(suboff, spiral, spiral_track, nuisance):
    """Smoothing has then no other parameter that moves the boat, or none at all but the forces.

    The answer is near that of a start which is nearly known; one whose sd were wide is the control.
    """
    sensors = bs.sensors.Track(0.5, 0.1, 10.0, channels=("x", "y", "yaw"))
    record = bs.observe(spiral_track, sensors, np.random.default_rng(8))
    forces = bs.UnknownDisturbance(("X", "N"), dict.fromkeys("XN", 1e-4), 60.0, knot_interval_s=40.0)
    given = {"free": ["Xuu", "Yuv", "Nuv"], "prior": bs.priors.relative_normal(0.25), "dt": 2.0, "disturbance": forces}

    def fit(more):
        return smoothed_regression(bs.Problem(suboff, spiral, record, nuisance=nuisance | more, **given)).values

    known, nearly = fit({}), fit({"u0_mps": normal(suboff.speed_mps, 1e-5)})
    np.testing.assert_allclose(known, nearly, rtol=1e-7)
    assert np.abs(fit({"u0_mps": normal(suboff.speed_mps, 0.5)}) / known - 1.0).max() > 1e-4
