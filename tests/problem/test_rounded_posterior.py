"""The posterior of one coefficient from rounded readings, sampled and by quadrature."""

import numpy as np
import pytest

import bayesub as bs

STEP = 0.05  # m/s


@pytest.mark.parametrize("sd", [0.2 * STEP, STEP], ids=["rounding rules", "noise rules"])
@pytest.mark.slow
def test_sampled_posterior_is_that_of_quadrature(suboff, spiral, spiral_track, sd):
    """Mean, sd and 5 % and 95 % quantiles of the drag coefficient, from speeds rounded to 5 cm/s."""
    sensor = bs.sensors.Sensor("u_mps", sd=sd, resolution=STEP, interval_s=60.0)
    record = bs.observe(spiral_track, sensor, np.random.default_rng(11))
    prior = bs.priors.relative_normal(0.1)
    problem = bs.Problem(suboff, spiral, record, free=["Xuu"], prior=prior, dt=1.0)
    posterior = bs.sample(problem, rng=np.random.default_rng(4), max_steps=4000)
    assert posterior.converged

    middle, reach = posterior.mean[0], 9 * posterior.sd[0]
    grid = np.linspace(middle - reach, middle + reach, 4001)
    density = problem.log_prob(grid[:, None])
    density = np.exp(density - density.max())
    assert density[[0, -1]].max() < 1e-6
    density /= density.sum()
    mean = density @ grid
    spread = np.sqrt(density @ (grid - mean) ** 2)
    # Monte Carlo errors of a mean and of a sd, four of each.
    error = 1 / np.sqrt(posterior.bulk_ess[0])
    assert abs(posterior.mean[0] - mean) < 4 * error * spread
    assert abs(posterior.sd[0] / spread - 1) < 4 * error
    low, high = np.interp([0.05, 0.95], np.cumsum(density), grid)
    for found, expected in zip(posterior.quantiles([0.05, 0.95])[:, 0], (low, high), strict=True):
        assert abs(found - expected) < 4 * 2.1 * error * spread  # sqrt(p (1 - p)) over the normal density
