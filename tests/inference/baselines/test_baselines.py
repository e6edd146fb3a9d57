"""Gauss-Newton with the prior."""

import numpy as np
import pytest
from support.toys import Banana, Linear, ill_conditioned

import bayesub as bs
from bayesub.inference.baselines import Estimate, gauss_newton
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem.priors import Normal


def test_gauss_newton_finds_the_mode_of_a_linear_problem():
    """In one step: mean and covariance of the posterior are the closed form, null direction included."""
    problem, null = ill_conditioned()
    found = gauss_newton(problem)
    sd = np.sqrt(np.diag(problem.covariance))
    assert np.abs((found.values - problem.mean) / sd).max() < 1e-3  # its tolerance
    np.testing.assert_allclose(found.covariance / np.outer(sd, sd), problem.covariance / np.outer(sd, sd), atol=1e-8)
    whitened = found.covariance / np.outer(problem.prior.sd, problem.prior.sd)
    assert null @ whitened @ null == pytest.approx(1.0, rel=1e-9)
    assert found.statuses == ("converged",)


def test_gauss_newton_from_a_bad_start():
    """Damping leads along the bend of a thin valley to its mode."""
    found = gauss_newton(Banana(), start=[3.0, 2.0])
    np.testing.assert_allclose(found.values, 0.0, atol=1e-3)
    assert found.statuses[0].startswith("converged")


class Jump(Linear):
    """Two readings of one, and a cost of ten more where the first parameter is above 0.3."""

    def __init__(self):
        super().__init__(np.eye(2), np.ones(2), Normal(np.zeros(2), np.ones(2)))

    def misfit(self, parameters):
        residuals, deviances = super().misfit(parameters)
        return residuals, deviances + 10.0 * (parameters[:, 0] > 0.3)


def test_gauss_newton_stops_at_a_jump_that_no_gradient_shows():
    """Undamped steps stay long there, and damped ones gain ever less; the mode without the jump is at (0.5, 0.5)."""
    problem = Jump()
    found = gauss_newton(problem, start=[-1.0, -1.0], max_iterations=100)
    assert found.statuses == ("converged to a jump or to round-off",)
    assert 0.29 < found.values[0] <= 0.3
    assert problem.costs.jacobians < 20


def test_gauss_newton_with_fewer_readings_than_parameters():
    """The prior makes the mode unique also then, and its directions keep their variance."""
    prior = Normal(np.array([1.0, -2.0, 0.5]), np.array([0.5, 1.0, 2.0]))
    problem = Linear(np.array([[1.0, 2.0, -1.0]]), np.array([3.0]), prior)
    found = gauss_newton(problem, start=prior.mean + prior.sd)
    np.testing.assert_allclose(found.values, problem.mean, atol=1e-3)
    np.testing.assert_allclose(found.covariance, problem.covariance, rtol=1e-12)


def test_gauss_newton_reports_a_limit_and_a_failed_start():
    """It says when it stopped short, and refuses to start from a simulation that fails."""
    assert "stopped after 1 iterations" in gauss_newton(Banana(), start=[3.0, 2.0], max_iterations=1).statuses[0]
    with pytest.raises(ValueError, match="fails at the start"):
        gauss_newton(Banana(), start=[np.nan, 0.0])


@pytest.mark.slow
def test_gauss_newton_recovers_a_boat(suboff, spiral, spiral_track):
    """From the record of a spiral it finds coefficients that explain it, and whose posterior holds the truth."""
    record = bs.observe(spiral_track, bs.sensors.Track(0.5, 0.1, 2.0, ("x", "y", "yaw")), np.random.default_rng(8))
    centre = bs.priors.perturbed(suboff.xi, 0.2, np.random.default_rng(9))
    prior = bs.priors.relative_normal(0.25, centre)
    problem = bs.Problem(suboff, spiral, record, free=HORIZONTAL, prior=prior, dt=1.0)
    found = gauss_newton(problem)
    assert found.statuses[0].startswith("converged")
    residuals = problem.residuals(found.values[None])[0]
    assert residuals @ residuals < len(residuals) + 4 * np.sqrt(2 * len(residuals))
    off = found.values - suboff.xi[problem.columns]
    chi2 = off @ np.linalg.solve(found.covariance, off)
    # 21 degrees of freedom; the Laplace approximation is an approximation, so three times the sd of chi2 from its mean.
    assert chi2 < 21 + 3 * np.sqrt(42)


def test_estimates_are_completed_by_the_guess():
    """What a method did not see stands at the guess, behind what it found."""
    found = Estimate("any", ("a",), np.array([[1.0], [2.0]]), np.zeros(2), ("", ""), None, 0, 0.0)
    completed = found.completed({"b": 5.0, "a": 9.0})
    assert completed.names == ("a", "b")
    np.testing.assert_array_equal(completed.solutions, [[1.0, 5.0], [2.0, 5.0]])
    assert found.completed({"a": 9.0}).names == ("a",)
