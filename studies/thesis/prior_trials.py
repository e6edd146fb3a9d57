"""Trials of boats that are drawn from the prior: a posterior ought to hold their truth as often as it says."""

import numpy as np

from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import true_step
from bayesub.model.vehicles import load_vehicle
from bayesub.problem.likelihoods import Normal
from bayesub.problem.priors import Spread
from bayesub.problem.problem import Problem
from bayesub.sensors import observe, unread
from thesis.calibration import prior_trajectory


class PriorTrials:
    """A vehicle on a manoeuvre with sensors, and what is free: what the trials of it share.

    Parameters
    ----------
    vehicle, manoeuvre : names
    sensors : what :func:`bayesub.sensors.observe` takes
    free : names of coefficients
    prior : of the coefficients
    dt : integration step of truth and model, s; by default that of the model follows the sensors, and truths are flown
        at a tenth of it
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
        record = unread(sensors, self._manoeuvre.duration)
        self._step = dt or self._pose(record, free, None).simulator.step
        flown_at = dt or true_step(self._step, self._manoeuvre)
        self._flown = self._pose(record, free, flown_at)
        trajectory = simulate(self.boat, self._manoeuvre, dt=flown_at)
        self.problem = self._pose(observe(trajectory, sensors, rng), free, self._step)

    def _pose(self, record, free, step, noise=None):
        return Problem(self.boat, self._manoeuvre, record, free=free, prior=self._prior, noise=noise or {}, dt=step)

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
        truth, trajectory, n_failed = prior_trajectory(self._flown, rng)
        record = observe(trajectory, self.sensors, rng)
        noise = {c.name: Normal(sd_factor * c.total_sd) for c in record.channels} if sd_factor != 1.0 else {}
        return truth, self._pose(record, self.problem.names, self._step, noise), n_failed
