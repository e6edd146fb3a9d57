"""What sampling returns: the chain of every ensemble, and what it says about itself."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub import diagnostics


@dataclass(frozen=True)
class Criteria:
    """When a posterior counts as converged; every parameter must meet all of them."""

    rhat: float = 1.01
    ess: float = 400.0
    taus: float = 25.0


STANDARD = Criteria()


@dataclass(frozen=True)
class Posterior:
    """Draws from the posterior after warm-up.

    Attributes
    ----------
    names : (n_params,) free coefficients
    chain : (n_ensembles, n_steps, n_walkers, n_params) non-dimensional coefficients
    log_prob : (n_ensembles, n_steps, n_walkers) up to a constant, in coordinates in which the prior is standard normal
    prior_mean, prior_sd : (n_params,)
    n_warmup : steps discarded before the first kept one
    acceptance : fraction of proposals accepted
    evaluations : simulations, and seconds : wall time, from the search for the mode to the last step
    failures : simulations that failed, by status
    """

    names: tuple[str, ...]
    chain: np.ndarray
    log_prob: np.ndarray
    prior_mean: np.ndarray
    prior_sd: np.ndarray
    n_warmup: int
    acceptance: float
    evaluations: int
    seconds: float
    failures: dict[str, int]
    criteria: Criteria = STANDARD

    @cached_property
    def n_steps(self) -> int:
        """Steps of each ensemble that were kept."""
        return self.chain.shape[1]

    @property
    def draws(self) -> np.ndarray:
        """(n_draws, n_params) all draws."""
        return self.chain.reshape(-1, len(self.names))

    @property
    def best(self) -> np.ndarray:
        """(n_params,) the draw of highest posterior density."""
        return self.draws[np.argmax(self.log_prob)]

    @cached_property
    def mean(self) -> np.ndarray:
        return self.draws.mean(axis=0)

    @cached_property
    def sd(self) -> np.ndarray:
        return self.draws.std(axis=0, ddof=1)

    @property
    def contraction(self) -> np.ndarray:
        """(n_params,) posterior sd over prior sd: 1 where the data said nothing."""
        return self.sd / self.prior_sd

    @cached_property
    def correlation(self) -> np.ndarray:
        """(n_params, n_params) posterior correlation matrix."""
        return np.corrcoef(self.draws.T)

    def quantiles(self, probabilities) -> np.ndarray:
        """(n_probabilities, n_params)."""
        return np.quantile(self.draws, probabilities, axis=0)

    @cached_property
    def tau(self) -> np.ndarray:
        """(n_ensembles, n_params) autocorrelation times, steps."""
        return diagnostics.autocorrelation_time(self.chain)

    @cached_property
    def rhat(self) -> np.ndarray:
        """(n_params,) rank-normalised split R-hat across the ensembles."""
        return diagnostics.rhat(self.chain)

    @cached_property
    def bulk_ess(self) -> np.ndarray:
        """(n_params,)"""
        return diagnostics.bulk_ess(self.chain)

    @cached_property
    def tail_ess(self) -> np.ndarray:
        """(n_params,)"""
        return diagnostics.tail_ess(self.chain)

    @cached_property
    def shortcomings(self) -> tuple[str, ...]:
        """The criteria that are not met, each with the parameter that is worst and what to do; empty if converged."""
        n_ensembles, n_steps = len(self.chain), self.n_steps
        if n_ensembles < 4:
            return (f"only {n_ensembles} independent ensembles; at least 4 are needed for R-hat",)
        if n_steps < 50:
            return (f"only {n_steps} steps were kept; raise max_steps",)
        found = []
        longest = self.tau.max(axis=0)
        k = int(np.argmax(longest))
        if not n_steps >= self.criteria.taus * longest[k]:
            found.append(
                f"{self.names[k]}: ensembles are {n_steps / longest[k]:.1f} autocorrelation times long, "
                f"{self.criteria.taus:g} are needed; raise max_steps to about "
                f"{int(1.5 * (self.n_warmup + self.criteria.taus * longest[k])):d}"
            )
            return tuple(found)  # the other two mean little on so short a chain, and cost more
        k = int(np.argmax(self.rhat))
        if not self.rhat[k] < self.criteria.rhat:
            found.append(f"{self.names[k]}: R-hat {self.rhat[k]:.4f} is not below {self.criteria.rhat:g}; run longer")
        k = int(np.argmin(self.bulk_ess))
        if not self.bulk_ess[k] >= self.criteria.ess:
            found.append(f"{self.names[k]}: bulk ESS {self.bulk_ess[k]:.0f} is below {self.criteria.ess:g}; run longer")
        return tuple(found)

    @property
    def converged(self) -> bool:
        return not self.shortcomings
