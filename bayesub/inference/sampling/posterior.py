"""What sampling returns: the chain of every ensemble, its summaries and its convergence."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np
from scipy import stats

from bayesub.inference.checks import convergence
from bayesub.inference.interface import InferencePrior
from bayesub.io.arguments import check_class
from bayesub.io.errors import InputError
from bayesub.io.notebook import Displayed

if TYPE_CHECKING:
    import arviz
    import pandas as pd
    import xarray as xr


@dataclass(frozen=True)
class Criteria:
    """When a posterior counts as converged; every parameter must meet all of them."""

    rhat: float = 1.01  # upper limit of rank-normalised split R-hat across at least four ensembles
    ess: float = 400.0  # lower limit of bulk and tail effective sample size
    taus: float = 25.0  # lower limit of the length of every ensemble, in its autocorrelation times
    false_alarms: float = 0.01  # probability that a stationary chain is said to have a trend in its variance
    look: int = 100  # kept steps between two looks, until a tenth of the chain is more

    def __post_init__(self):
        for name, value in vars(self).items():
            check_class(f"criteria: {name}", value, SupportsFloat, key=name)
        positive = min(self.ess, self.taus, self.look) > 0.0
        if not (self.rhat > 1.0 and positive and 0.0 < self.false_alarms < 1.0):
            text = f"criteria: rhat must be above 1, and ess, taus and look positive, found {self}"
            raise InputError(text, "value", "criteria")


AnyPrior = TypeVar("AnyPrior", bound=InferencePrior)
STANDARD = Criteria()
DIAGNOSTICS = ("tau", "rhat", "bulk_ess", "tail_ess", "variance_trend", "unvisited")  # of a parameter each
JUDGED_STEPS = 250  # of each ensemble at least; the chain is thinned to at most twice as many before it is judged
N_ENSEMBLES = 4  # at least, for R-hat
LEAST_STEPS = 50  # kept at least before anything is judged
PROBES = 1024  # values from its prior that are tried for each parameter before a posterior counts as converged
STUCK = 0.1  # acceptance below which more steps are of little use; it is 0.3 to 0.9 where sampling works


class Convergence:
    """What a chain says of its convergence, each number computed when it is asked for.

    It is judged by a chain that is thinned to a few hundred steps; as an ensemble must be 25 autocorrelation times
    long, ten or more steps are left to each of them, and thinning loses next to nothing.
    """

    chain: np.ndarray
    criteria: "Criteria"
    thin: int

    @cached_property
    def n_steps(self) -> int:
        """Steps of each ensemble after warm-up."""
        return self.chain.shape[1] * self.thin

    @property
    def _judged(self) -> slice:
        """Which steps of the chain, the last one among them."""
        every = max(1, self.chain.shape[1] // JUDGED_STEPS)
        return slice((self.chain.shape[1] - 1) % every, None, every)

    @cached_property
    def _scores(self) -> np.ndarray:
        return convergence.rank_normalised(self.chain[:, self._judged])

    @cached_property
    def tau(self) -> np.ndarray:
        """(n_ensembles, n_params) autocorrelation times, steps."""
        return convergence.autocorrelation_time(self.chain[:, self._judged]) * (self._judged.step * self.thin)

    @cached_property
    def rhat(self) -> np.ndarray:
        """(n_params,) rank-normalised split R-hat across the ensembles."""
        return convergence.rhat(self.chain[:, self._judged], self._scores)

    @cached_property
    def bulk_ess(self) -> np.ndarray:
        """(n_params,) effective sample size of the rank-normalised draws."""
        return convergence.bulk_ess(self.chain[:, self._judged], self._scores)

    @cached_property
    def tail_ess(self) -> np.ndarray:
        """(n_params,) effective sample size of the 5 % and 95 % quantiles, the smaller one."""
        return convergence.tail_ess(self.chain[:, self._judged])

    @cached_property
    def variance_trend(self) -> np.ndarray:
        """(n_params,) change of the variance from first to second half, in standard errors."""
        return convergence.variance_trend(self.chain[:, self._judged], self._scores)

    @cached_property
    def unvisited(self) -> np.ndarray:
        """(n_params,) of :data:`PROBES` values of its prior, how many are accepted where draws have not been.

        The sampler tries them, with the others as they are, if all other criteria are met.
        """
        return np.zeros(self.chain.shape[-1])

    @property
    def uncovered(self) -> np.ndarray:
        """(n_params,) whether :attr:`unvisited` is above what a Poisson number exceeds in few runs (`false_alarms`).

        At each end one independent draw is beyond where draws count as having been, so that two in all are usual.
        """
        expected = 2.0 * PROBES / np.minimum(self.bulk_ess, self.tail_ess)
        return self.unvisited > stats.poisson.isf(self.criteria.false_alarms / self.chain.shape[-1], expected)


@dataclass(frozen=True)
class Posterior(Convergence, Displayed):
    """Draws from the posterior after warm-up, and what they say of their convergence."""

    names: tuple[str, ...]  # the n_params free coefficients, and after them the nuisance parameters with their units
    # (n_ensembles, n_kept, n_walkers, n_params) parameters after warm-up, every `thin`-th step; coefficients are non-
    # dimensional, nuisance parameters in the unit of their name
    chain: np.ndarray
    # (n_ensembles, n_kept, n_walkers) log posterior densities up to a constant, in the scaled coordinates x of the
    # table of :mod:`bayesub.inference.sampling`, where the density does not depend on units
    log_prob: np.ndarray
    prior_mean: np.ndarray  # (n_params,) of each parameter by itself, as it was known before (:meth:`given`)
    prior_sd: np.ndarray  # (n_params,) of each parameter by itself, likewise
    n_warmup: int  # steps discarded before the first kept one
    acceptance: float  # fraction of proposals accepted
    evaluations: int  # simulations, from the search for the mode to the last step
    seconds: float  # wall time, from the search for the mode to the last step
    failures: dict[str, int]  # status -> simulations that ended so
    criteria: Criteria = STANDARD  # by which convergence is judged
    thin: int = 1  # steps from one kept step to the next
    jacobians: int = 0  # Jacobians, from the search for the mode to the last step
    # simulations that a Jacobian is worth by its time, measured when the run began; not a number if unknown
    jacobian_price: float = float("nan")
    # wall time of simulations and Jacobians among `seconds`; not a number if unknown
    simulation_seconds: float = float("nan")

    def thinned(self) -> "Posterior":
        """The same posterior with the draws that convergence is judged by."""
        judged = self._judged
        chain, log_prob = self.chain[:, judged], self.log_prob[:, judged]
        return replace(self, chain=chain, log_prob=log_prob, thin=judged.step * self.thin)

    def known_before(self, prior: AnyPrior) -> AnyPrior:
        """What was known before: the `prior` of its parameters, with the scale that the draws say if it is unknown.

        The draws are those of :meth:`thinned`, so that a posterior that was saved says the same.
        """
        return prior.found(self.thinned().draws)

    def given(self, prior: InferencePrior, **attributes: Any) -> "Posterior":
        """The same with mean and sd of :meth:`known_before`, which is what tables, files and figures compare with.

        Other `attributes` may be given besides. What was computed of the chain is kept.
        """
        known = self.known_before(prior)
        result = replace(self, prior_mean=known.mean, prior_sd=known.sd, **attributes)
        computed = vars(self).keys() - {field.name for field in fields(self)} - {"shortcomings"}
        vars(result).update({key: vars(self)[key] for key in computed})
        return result

    def part(self, positions: np.ndarray) -> "Posterior":
        """The posterior of some parameters, with the convergence of each as it was judged among all.

        `positions` (n,) are theirs, as in ``posterior.part(problem.others)``, of all but forces at knots.
        """
        result = replace(
            self,
            names=tuple(self.names[k] for k in positions),
            chain=self.chain[..., positions],
            prior_mean=self.prior_mean[positions],
            prior_sd=self.prior_sd[positions],
        )
        vars(result).update({key: getattr(self, key)[..., positions] for key in DIAGNOSTICS}, n_steps=self.n_steps)
        return result

    @property
    def draws(self) -> np.ndarray:
        """(n_draws, n_params) all draws."""
        return self.chain.reshape(-1, len(self.names))

    @property
    def best(self) -> np.ndarray:
        """(n_params,) the draw of highest posterior density in the scaled coordinates x (:attr:`log_prob`).

        For normal and uniform priors that is the draw of highest density in the parameters too. For log-normal ones it
        is the highest density in the logarithm of the parameter.
        """
        return self.draws[np.argmax(self.log_prob)]

    @cached_property
    def mean(self) -> np.ndarray:
        """(n_params,)."""
        return self.draws.mean(axis=0)

    @cached_property
    def sd(self) -> np.ndarray:
        """(n_params,)."""
        return self.draws.std(axis=0, ddof=1)

    @property
    def contraction(self) -> np.ndarray:
        """(n_params,) posterior sd over the prior sd of each parameter by itself: 1 where the data said nothing."""
        return self.sd / self.prior_sd

    @cached_property
    def correlation(self) -> np.ndarray:
        """(n_params, n_params) posterior correlation matrix; a parameter that never moves is correlated with none."""
        deviations = np.where(_never_moves(self.draws), 0.0, self.draws - self.mean)
        lengths = np.linalg.norm(deviations, axis=0)
        unit = deviations / np.where(lengths > 0.0, lengths, 1.0)
        correlation = np.clip(unit.T @ unit, -1.0, 1.0)
        np.fill_diagonal(correlation, 1.0)
        return correlation

    @property
    def constants(self) -> tuple[str, ...]:
        """Parameters that have the same value in all draws."""
        return tuple(name for name, is_still in zip(self.names, _never_moves(self.draws), strict=True) if is_still)

    def quantiles(self, probabilities: Sequence[float]) -> np.ndarray:
        """(n_probabilities, n_params)."""
        return np.quantile(self.draws, probabilities, axis=0)

    @property
    def work(self) -> float:
        """What sampling has cost in simulations, a Jacobian at its price; not a number if that is unknown."""
        return self.evaluations + self.jacobians * self.jacobian_price

    def summary(self) -> "pd.DataFrame":
        """A table with a row for each parameter, the units of nuisance parameters in their names.

        `mean`, `sd`, `q5`, `median`, `q95`, `contraction` (posterior sd over prior sd), `rhat`, `bulk_ess`, `tail_ess`.
        """
        import pandas as pd  # slow to import, and of use here only

        q5, median, q95 = self.quantiles([0.05, 0.5, 0.95])
        columns = {"mean": self.mean, "sd": self.sd, "q5": q5, "median": median, "q95": q95}
        columns |= {key: getattr(self, key) for key in ("contraction", "rhat", "bulk_ess", "tail_ess")}
        return pd.DataFrame(columns, index=pd.Index(self.names, name="parameter"))

    def save(self, path: str | Path) -> None:
        """Write the draws that convergence is judged by, and the diagnostics, to a NetCDF file that ArviZ reads.

        InputError if the file cannot be written.
        """
        from bayesub.inference.sampling import posterior_file

        posterior_file.save(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> "Posterior":
        """Read a file of :meth:`save`.

        InputError if it is missing or is no posterior.
        """
        from bayesub.inference.sampling import posterior_file

        return posterior_file.load(Path(path))

    def to_arviz(self) -> "arviz.InferenceData | xr.DataTree":
        """The posterior as ArviZ's own container: InferenceData before ArviZ 1, an xarray DataTree from it on."""
        from bayesub.inference.sampling import posterior_file

        return posterior_file.to_arviz(self)

    @cached_property
    def shortcomings(self) -> tuple[str, ...]:
        """The criteria that are not met, each with the parameters and what to do; empty if converged."""
        if len(self.chain) < N_ENSEMBLES:
            return (f"only {len(self.chain)} independent ensembles; at least {N_ENSEMBLES} are needed for R-hat",)
        if self.chain.shape[1] < LEAST_STEPS:
            return (f"only {self.n_steps} steps were kept; raise max_steps",)
        if self.constants:
            return (f"all draws of {', '.join(self.constants)} are the same; widen its prior, or hold it fixed",)
        criteria = self.criteria
        taus = self.n_steps / self.tau.max(axis=0)
        long = f"ensembles are {{:.1f}} autocorrelation times long, {criteria.taus:g} are needed"
        if short := _missed(self.names, taus, taus >= criteria.taus, long):
            return (
                f"{short}; {_longer(self, criteria.taus / taus.min())}",
            )  # the others mean little on so short a chain
        trend, limit = self.variance_trend, convergence.threshold(len(self.names), criteria.false_alarms)
        apart = "; if it stays, the ensembles sit in different places: narrow the prior or free fewer coefficients"
        drift = f"the variance changes by {{:.1f}} standard errors from first to second half, above {limit:.1f}"
        beyond = f"of {PROBES} values of its prior {{:.0f}} are as likely as the draws and where these have not been"
        # Merit of each parameter, whether it is enough, what to say if not, how much longer to sample, and what else.
        verdicts: list[tuple[np.ndarray, np.ndarray, str, float, str]] = [
            (-self.rhat, self.rhat < criteria.rhat, f"R-hat {{:.4f}} is not below {criteria.rhat:g}", 2.0, apart),
            *((ess, ess >= criteria.ess, f"{word} ESS {{:.0f}} is below {criteria.ess:g}", criteria.ess / ess.min(), "")
              for word, ess in (("bulk", self.bulk_ess), ("tail", self.tail_ess))),
            (-np.abs(trend), np.abs(trend) < limit, drift, 2.0, ""),
            (-self.unvisited, ~self.uncovered, beyond, 2.0, "; if it stays, narrow its prior"),
        ]  # fmt: skip
        return tuple(
            f"{missed}; {_longer(self, factor)}{more}"
            for merit, met, sentence, factor, more in verdicts
            if (missed := _missed(self.names, merit, met, sentence))
        )

    def stuck(self, max_steps: int) -> bool:
        """Whether there is no chance of enough steps: after a tenth of them, with few proposals accepted.

        Of a chain that moves, autocorrelation times stay what they are and the length in them grows with its steps. Of
        one that does not, they grow as it does. The length is extrapolated to `max_steps` with the power of the steps
        by which it has grown since half of them, and must be less than a third of what is needed.
        """
        n = self.n_warmup + self.n_steps
        if self.acceptance >= STUCK or 10 * n < max_steps or self.chain.shape[1] < 2 * LEAST_STEPS:
            return False
        half = replace(self, chain=self.chain[:, : self.chain.shape[1] // 2])
        taus, before = (part.n_steps / part.tau.max() for part in (self, half))
        power = np.clip(np.log2(taus / before), 0.0, 1.0)
        return bool(3.0 * taus * (max_steps / n) ** power < self.criteria.taus)

    @property
    def converged(self) -> bool:
        """Whether all criteria are met."""
        return not self.shortcomings


def _missed(names, merit, met, sentence) -> str:
    """What the parameter of least merit misses and how many others do; empty if `met` holds for all."""
    if np.all(met):
        return ""
    k = int(np.argmin(np.where(np.isnan(merit), -np.inf, merit)))
    others = np.count_nonzero(~met) - 1
    return f"{names[k]}{f' and {others} more' if others else ''}: {sentence.format(abs(merit[k]))}"


def _longer(posterior, factor) -> str:
    """What to do if so many times the steps are needed."""
    if posterior.acceptance < STUCK:
        return (
            f"only {100 * posterior.acceptance:.2g} % of the proposals are accepted, and more steps are of little use: "
            "see whether the model fits, narrow the prior or free fewer coefficients"
        )
    steps = 1.2 * factor * (posterior.n_warmup + posterior.n_steps)
    return f"resume with max_steps of about {np.ceil(steps / 100) * 100:.0f}"


def _never_moves(draws: np.ndarray) -> np.ndarray:
    """(n_params,) of draws (n, n_params); the sd of a constant is that of rounding."""
    return np.ptp(draws, axis=0) == 0.0
