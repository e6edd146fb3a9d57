"""What a posterior density is made of, whether of one trial or of several."""

from collections.abc import Iterator

import numpy as np


class PosteriorDensity:
    """The posterior density of free coefficients and nuisance parameters.

    A problem that is one has `names`, `prior`, `xi`, `columns` and `n_coefficients` as
    :class:`bayesub.problem.problem.Problem` has, and says what its channels contribute and which trials it is made of.
    """

    names: tuple[str, ...]
    xi: np.ndarray
    columns: np.ndarray
    n_coefficients: int

    @property
    def n_params(self) -> int:
        return len(self.names)

    def log_likelihoods(self, parameters) -> dict[str, np.ndarray]:
        """The contribution (n_batch,) of each channel to the log likelihood, by name."""
        raise NotImplementedError

    def each_trial(self, parameters) -> Iterator[tuple[str, "PosteriorDensity", np.ndarray]]:
        """Name, problem and own parameters (.., n_own) of each trial, of parameters (.., n_params)."""
        raise NotImplementedError

    def coefficient_sets(self, parameters) -> np.ndarray:
        """(n_batch, 101) coefficient sets with the free columns taken from parameters (n_batch, n_params)."""
        parameters = np.atleast_2d(parameters)
        sets = np.repeat(self.xi[None], len(parameters), axis=0)
        sets[:, self.columns] = parameters[:, : self.n_coefficients]
        return sets

    def log_prior(self, parameters) -> np.ndarray:
        """(n_batch,) log prior densities."""
        return self.prior.log_density(np.atleast_2d(parameters))

    def log_likelihood(self, parameters) -> np.ndarray:
        """(n_batch,) log likelihoods, -inf where a simulation failed."""
        return sum(self.log_likelihoods(parameters).values())

    def log_prob(self, parameters) -> np.ndarray:
        """(n_batch,) log posterior densities, not normalised."""
        return self.log_prior(parameters) + self.log_likelihood(parameters)
