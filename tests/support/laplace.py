"""Posteriors of problems without sampling: draws of the Laplace approximation, as chains of four ensembles."""

import numpy as np

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.inference.sampling.posterior import Posterior


def spiral_problem(track, seed=0, **given):
    """The horizontal coefficients and the first heading, from readings of a track at half a metre."""
    sensor = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
    record = bs.observe(track, sensor, np.random.default_rng(seed))
    given = {"free": bs.coefficients.HORIZONTAL, "prior": bs.priors.relative_normal(0.25), "dt": 1.0} | given
    nuisance = {"yaw0_deg": bs.priors.normal(0.0, 1.0)}
    return bs.Problem(track.simulator.vehicle, track.simulator.manoeuvre, record, nuisance=nuisance, **given)


def posterior_of(problem, rng) -> Posterior:
    """(4 ensembles, 60 steps, 8 walkers) around the mode."""
    mode = gauss_newton(problem)
    chain = mode.values + rng.standard_normal((4, 60, 8, problem.n_params)) @ np.linalg.cholesky(mode.covariance).T
    log_prob = problem.log_prob(chain.reshape(-1, problem.n_params)).reshape(4, 60, 8)
    prior = problem.prior
    return Posterior(problem.names, chain, log_prob, prior.mean, prior.sd, 10, 0.5, 100, 1.0, {"diverged": 0})
