"""What a posterior density is made of, whether of one trial or of several."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.model.linear_form import LinearSystem
from bayesub.problem.distributions import WHITE, Prior, joined
from bayesub.problem.views import Viewed


@dataclass
class Costs:
    """What has been computed so far; one counter is shared by all views of a problem.

    Attributes
    ----------
    simulations : number of simulations, a member of a batch each; those within a Jacobian are not among them
    jacobians : number of Jacobians
    failures : status -> number of simulations that ended so
    seconds : wall time of all of these
    """

    simulations: int = 0
    jacobians: int = 0
    failures: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0

    def __add__(self, other: "Costs") -> "Costs":
        words = self.failures | other.failures
        failures = {word: self.failures.get(word, 0) + other.failures.get(word, 0) for word in words}
        seconds = self.seconds + other.seconds
        return Costs(self.simulations + other.simulations, self.jacobians + other.jacobians, failures, seconds)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Count the time of what is simulated in the block."""
        began = time.perf_counter()
        yield
        self.seconds += time.perf_counter() - began


class PosteriorDensity(Viewed):
    """The posterior density of free coefficients and nuisance parameters, as inference sees it.

    It is all that :mod:`bayesub.inference.interface` names. A subclass says what its channels
    contribute, which trials it is made of and what it has cost.

    Attributes
    ----------
    names : the n_params free coefficients and after them the nuisance parameters
    n_coefficients : how many of the parameters are coefficients
    columns : (n_coefficients,) the positions of these in a coefficient set
    xi : (n_terms,) values of the coefficients that are not free
    coefficient_prior : of the free coefficients
    nuisance_priors : nuisance parameter -> prior of it alone, in the unit of its name
    prior : of all parameters together
    equations : of the vehicle
    """

    names: tuple[str, ...]
    n_coefficients: int
    columns: np.ndarray
    xi: np.ndarray
    coefficient_prior: Prior
    nuisance_priors: dict[str, Prior]
    prior: Prior
    equations: EquationSet

    @property
    def preferred_pivots(self) -> tuple[str, ...]:
        """Coefficients to name null directions by: the added masses, which a hull form gives."""
        return self.equations.added_masses

    @property
    def histories(self) -> tuple:
        """Forces with unknown histories (:class:`bayesub.problem.disturbances.History`)."""
        return ()

    @property
    def others(self) -> np.ndarray:
        """(n_others,) positions of the parameters that are not white coordinates of histories.

        Tables and figures of parameters are of these; there is a white coordinate for every knot and axis.
        """
        white = [history.columns for history in self.histories]
        return np.delete(np.arange(self.n_params), np.concatenate(white) if white else [])

    @property
    def prior_of_others(self) -> Prior:
        """The prior of the parameters that are not white coordinates of histories."""
        others = {name: prior for name, prior in self.nuisance_priors.items() if prior is not WHITE}
        return joined(self.coefficient_prior, others)

    @property
    def n_params(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def costs(self) -> Costs:
        """What this problem and its views have computed so far."""
        raise NotImplementedError

    def log_likelihoods(self, parameters: np.ndarray) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        raise NotImplementedError

    def each_trial(self, parameters: np.ndarray) -> Iterator[tuple[str, "PosteriorDensity", np.ndarray]]:
        """Name, problem and parameters (.., n_params of the trial) of each trial, of parameters (.., n_params)."""
        raise NotImplementedError

    def linear_systems(self, parameters: np.ndarray) -> dict[str, LinearSystem]:
        """Axis -> linear form in the free coefficients (model manual, section 9) at parameters (n_params,).

        It holds along the motion that these parameters give. Of several trials the rows stand below one another.
        """
        raise NotImplementedError

    def coefficient_sets(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_terms) coefficient sets with the free columns taken from parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        sets = np.repeat(self.xi[None], len(parameters), axis=0)
        sets[:, self.columns] = parameters[:, : self.n_coefficients]
        return sets

    def log_prior(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log prior densities."""
        return self.prior.log_density(np.atleast_2d(parameters))

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where a simulation failed."""
        return sum(self.log_likelihoods(parameters).values())

    def log_prob(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log posterior densities, not normalised."""
        return self.log_prior(parameters) + self.log_likelihood(parameters)


def coefficient_names(equations: EquationSet, columns: np.ndarray) -> tuple[str, ...]:
    """Names of the coefficients at positions `columns` (n,) of a set."""
    return tuple(equations.names[k] for k in columns)
