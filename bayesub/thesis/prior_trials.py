"""Trials of boats that are drawn from the prior: a posterior ought to hold their truth as often as it says."""

import numpy as np

from bayesub.checks.calibration import prior_trajectory
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import load_vehicle
from bayesub.problem.likelihoods import Normal
from bayesub.problem.priors import Spread
from bayesub.problem.problem import Problem
from bayesub.sensors import observe


class PriorTrials:
    """A vehicle on a manoeuvre with sensors, and what is free: what the trials of it share.

    Parameters
    ----------
    vehicle, manoeuvre : names
    sensors : what :func:`bayesub.sensors.observe` takes
    free : names of coefficients
    prior : of the coefficients
    dt : integration step of truth and model, s; by default chosen for the vehicle and manoeuvre
    rng : noise of the record with which the problem is posed before there is any trial; None for exact readings

    Attributes
    ----------
    boat : the vehicle
    problem : of a record of the vehicle itself; any record poses the problem whose prior is drawn from
    """

    def __init__(
        self,
        vehicle: str,
        manoeuvre: str,
        sensors,
        *,
        free,
        prior: Spread,
        dt: float | None = None,
        rng: np.random.Generator | None = None,
    ):
        self.boat, self.sensors, self._prior = load_vehicle(vehicle), sensors, prior
        self._manoeuvre = load_manoeuvre(manoeuvre, self.boat)
        trajectory = simulate(self.boat, self._manoeuvre, dt=dt)
        self._step = trajectory.simulator.step
        self.problem = self._pose(observe(trajectory, sensors, rng), free)

    def _pose(self, record, free, noise=None):
        return Problem(
            self.boat, self._manoeuvre, record, free=free, prior=self._prior, noise=noise or {}, dt=self._step
        )

    def trial(self, rng: np.random.Generator, sd_factor: float = 1.0) -> tuple[np.ndarray, Problem, int]:
        """One boat of the prior and the problem of its record.

        Parameters
        ----------
        rng : of the boat and of the noise of its record
        sd_factor : sd of the likelihood over that of the sensors; other than one, noise is normal with the total sd

        Returns
        -------
        truth : (n_params,)
        problem : of the record
        n_failed : number of boats drawn before that did not complete the manoeuvre
        """
        truth, trajectory, n_failed = prior_trajectory(self.problem, rng)
        record = observe(trajectory, self.sensors, rng)
        noise = {c.name: Normal(sd_factor * c.total_sd) for c in record.channels} if sd_factor != 1.0 else {}
        return truth, self._pose(record, self.problem.names, noise), n_failed
