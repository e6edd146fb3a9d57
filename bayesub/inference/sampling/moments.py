"""What a comparison of two samplers asks of each: moments of its draws with their errors, and what these have cost."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bayesub.inference.checks import convergence


@dataclass(frozen=True)
class Effort:
    """The cost of the draws of a sampler."""

    simulations: int  # those within a Jacobian not among them
    jacobians: int  # Jacobians
    jacobian_price: float  # of a Jacobian, simulations
    seconds: float  # wall time
    ess: float  # bulk effective sample size of the worst parameter

    @property
    def work(self) -> float:
        """Simulations, a Jacobian at its price; what takes no Jacobians needs no price of them."""
        return self.simulations + (self.jacobians * self.jacobian_price if self.jacobians else 0.0)

    @property
    def per_effective_sample(self) -> float:
        """:attr:`work` over :attr:`ess`."""
        return self.work / self.ess


@dataclass(frozen=True)
class Moments:
    """Posterior moments by one sampler: all that a comparison with another asks of its draws.

    Errors are Monte Carlo standard errors of the means of x, of x^2 and of the products x_i x_j, where x are the draws
    less `means`, over `sds`. Correlations and errors are of single precision, which is far below the latter.
    """

    means: np.ndarray  # (n_params,)
    sds: np.ndarray  # (n_params,)
    correlations: np.ndarray  # (n_pairs,) for i < j, in the order of ``np.triu_indices(n_params, 1)``
    mean_errors: np.ndarray  # (n_params,)
    square_errors: np.ndarray  # (n_params,)
    product_errors: np.ndarray  # (n_pairs,)
    n_draws: int  # of all chains together
    rhat: float  # largest of the parameters
    bulk_ess: float  # smallest of the parameters
    tail_ess: float  # smallest of the parameters

    @classmethod
    def of_chain(cls, chain: np.ndarray) -> "Moments":
        """The moments of independent chains (n_chains, n_draws, n_params)."""
        walkers = np.asarray(chain)[:, :, None]
        flat = walkers.reshape(-1, walkers.shape[-1])
        means, sds = flat.mean(axis=0), flat.std(axis=0)
        (_, mean_errors), (_, square_errors), (correlations, product_errors) = feature_means((walkers - means) / sds)
        return cls(
            means=means,
            sds=sds,
            correlations=correlations.astype(np.float32),
            mean_errors=mean_errors.astype(np.float32),
            square_errors=square_errors.astype(np.float32),
            product_errors=product_errors.astype(np.float32),
            n_draws=len(flat),
            rhat=float(convergence.rhat(walkers).max()),
            bulk_ess=float(convergence.bulk_ess(walkers).min()),
            tail_ess=float(convergence.tail_ess(walkers).min()),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything by name, to be stored."""
        return {key: np.asarray(value) for key, value in asdict(self).items()}

    @classmethod
    def restored(cls, arrays: dict[str, np.ndarray]) -> "Moments":
        """The moments of :meth:`arrays`."""
        parts: dict[str, Any] = {key: value if value.ndim else value.item() for key, value in arrays.items()}
        return cls(**parts)

    def differences(self, chain: np.ndarray) -> tuple[np.ndarray, ...]:
        """Means (n_params,), sds (n_params,) and correlations (n_pairs,) of another sampler less these.

        In Monte Carlo standard errors of both; `chain` (n_ensembles, n_steps, n_walkers, n_params) is of the other.
        """
        theirs = feature_means((chain - self.means) / self.sds)
        ours = (0.0, self.mean_errors), (1.0, self.square_errors), (self.correlations, self.product_errors)
        return tuple(
            (mean - own) / np.hypot(error, own_error)
            for (mean, error), (own, own_error) in zip(theirs, ours, strict=True)
        )


def feature_means(x: np.ndarray) -> list[tuple[np.ndarray, ...]]:
    """Means of x, of x^2 and of the products x_i x_j for i < j, each with its Monte Carlo standard error.

    Of chains x (n_ensembles, n_steps, n_walkers, n_params); a standard error follows from the effective sample size of
    the feature itself.
    """
    products = [_mean(x[..., [i]] * x[..., i + 1 :]) for i in range(x.shape[-1] - 1)]
    empty = np.empty((2, 0))
    return [_mean(x), _mean(x**2), tuple(np.concatenate([empty, *products], axis=1))]


def _mean(features) -> tuple[np.ndarray, np.ndarray]:
    axes = (0, 1, 2)
    return features.mean(axis=axes), np.sqrt(features.var(axis=axes) / convergence.ess(features))
