"""An independent sampler on the same posterior: NUTS with exact gradients (nutpie), compared within Monte Carlo error.

It shares with :func:`bayesub.sample` the log posterior and its coordinates, exact whatever their fit, and nothing that
decides what is drawn: no moves, no ensembles, no stopping rule. Where there are bounds t stands for x in these.
"""

import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, cast

import numpy as np

from bayesub.inference.baselines.estimate import meter
from bayesub.inference.checks import convergence
from bayesub.inference.interface import SMOOTH, Forced, InferencePrior, Progress, Sampled
from bayesub.inference.sampling.geometry import Geometry
from bayesub.inference.sampling.histories import search_marginal_mode
from bayesub.inference.sampling.moments import Effort, Moments
from bayesub.inference.sampling.posterior import Posterior
from bayesub.inference.sampling.sampler import learn_coordinates
from bayesub.io.arguments import checked
from bayesub.io.errors import InputError

FALSE_ALARMS = 0.01  # probability that two samplers of one posterior are said to disagree
LEAST_ESS = 400.0  # of every parameter, for standard errors to mean what they say
MOST_RHAT = 1.01
MOST_DIVERGENT = 0.002  # of the draws: more, and there are places that steps of this length do not reach

# Of the leapfrog, in coordinates in which the posterior is nearly a standard normal, and doublings of a trajectory. The
# step is not adapted: a log posterior may have jumps, as forces do that have the sign of a velocity as a factor. How
# often a trajectory is accepted then depends on the jumps that it crosses and hardly on its steps, which would shrink
# forever to reach what nutpie aims at. Fifteen steps of 0.3 are more than half a turn of a standard normal, where a
# trajectory ends. Of 0.5 it takes seven, for as many effective samples, but up to one in fifty then diverges.
_STEP, _DOUBLINGS = 0.3, 6
_STEP_WITHIN_BOUNDS = 0.2  # near infinity the posterior bends; of 0.3 one trajectory in 400 diverges
_CORNERS = 50  # tried for the start of a chain


@dataclass(frozen=True)
class CrossCheck:
    """Posterior moments by two samplers."""

    names: tuple[str, ...]  # (n_params,)
    means: np.ndarray  # (2, n_params) of the ensemble sampler and of NUTS
    sds: np.ndarray  # (2, n_params) of the ensemble sampler and of NUTS
    mean_z: np.ndarray  # (n_params,) differences of the means in Monte Carlo standard errors of both
    sd_z: np.ndarray  # (n_params,) the same of the sds
    correlation_z: np.ndarray  # (n_pairs,) the same of the correlations
    # the |z| that any of them reaches in one of a hundred comparisons of equal posteriors (Bonferroni)
    threshold: float
    rhat: float  # largest of NUTS, over parameters
    ess: float  # smallest of NUTS, over parameters
    divergences: int  # of the trajectories of NUTS
    gradients: int  # that NUTS took
    # of the ensemble sampler and of NUTS, with the search for the coordinates of each; empty if not known
    efforts: tuple[Effort, ...] = ()
    engine: str = "NUTS with exact gradients"  # the name of the second sampler, if it is another than NUTS
    divergent: float = 0.0  # share of its draws whose trajectory diverged

    def part(self, names: Sequence[str]) -> "CrossCheck":
        """The comparison of some parameters, by name, in their order here."""
        members = np.isin(self.names, list(names))
        rows, columns = np.triu_indices(len(self.names), 1)
        return replace(
            self,
            names=tuple(np.array(self.names)[members].tolist()),
            means=self.means[:, members],
            sds=self.sds[:, members],
            mean_z=self.mean_z[members],
            sd_z=self.sd_z[members],
            correlation_z=self.correlation_z[members[rows] & members[columns]],
        )

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The n_pairs pairs of parameters, in the order of :attr:`correlation_z`."""
        rows, columns = np.triu_indices(len(self.names), 1)
        return [(self.names[i], self.names[j]) for i, j in zip(rows, columns, strict=True)]

    @property
    def verdict(self) -> str:
        """``agree``, ``disagree``, or ``inconclusive`` where NUTS itself has not converged."""
        if not (self.rhat < MOST_RHAT and self.ess >= LEAST_ESS and self.divergent <= MOST_DIVERGENT):
            return "inconclusive"
        return "agree" if self._worst()[0] < self.threshold else "disagree"

    def _worst(self):
        """The largest |z|, and of what."""
        differences = [(abs(z), f"the {what} of {name}") for what, zs in (("mean", self.mean_z), ("sd", self.sd_z))
                 for name, z in zip(self.names, zs, strict=True)]  # fmt: skip
        differences += [
            (abs(z), f"the correlation of {first} with {second}")
            for (first, second), z in zip(self.pairs, self.correlation_z, strict=True)
        ]
        return max(differences)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        largest, of = self._worst()
        n = len(self.names)
        difference = f"the largest difference is {largest:.1f} Monte Carlo standard errors, in {of}"
        if self.verdict == "inconclusive":
            return (
                f"{self.engine} has not converged itself (R-hat {self.rhat:.4f}, ESS {self.ess:.0f}, "
                f"{self.divergences} divergent trajectories), so that nothing follows; {difference}.{self._cost}"
            )
        agrees = self.verdict == "agree"
        return (
            f"{self.engine} {'agrees within' if agrees else 'disagrees beyond'} Monte Carlo error in {n} "
            f"means, {n} sds and {len(self.correlation_z)} correlations: {difference}, {self.threshold:.1f} allowed."
            + ("" if agrees else " Of the shortest chains one in twenty does so by chance: sample on, to a larger ess.")
            + self._cost
        )

    @property
    def _cost(self) -> str:
        """A sentence on the cost of an effective sample by both."""
        if not self.efforts:
            return ""
        ours, other = (effort.per_effective_sample for effort in self.efforts)
        return f" An effective sample of the worst parameter cost {ours:.3g} simulations here and {other:.3g} there."

    def to_json(self) -> dict:
        """Everything as JSON types, with the verdict."""
        content = {key: np.asarray(value).tolist() for key, value in asdict(self).items()}
        return content | {"verdict": self.verdict, "sentence": self.sentence}

    @classmethod
    def from_json(cls, content: dict) -> "CrossCheck":
        """The inverse of :meth:`to_json`."""
        arrays = ("means", "sds", "mean_z", "sd_z", "correlation_z")
        fields = {key: content[key] for key in cls.__dataclass_fields__}
        fields |= {key: np.array(content[key]) for key in arrays} | {"names": tuple(content["names"])}
        return cls(**fields | {"efforts": tuple(Effort(**effort) for effort in content["efforts"])})


@checked
def cross_check(
    problem: Sampled,
    posterior: Posterior,
    *,
    rng: np.random.Generator,
    n_draws: int = 1000,
    n_tune: int = 500,
    n_chains: int = 4,
    progress: Progress | None = None,
) -> CrossCheck:
    """Sample the posterior of a problem with NUTS too, and compare.

    The `posterior` is what was sampled of the problem; each of `n_chains` has `n_tune` further draws for adaptation.
    Progress is an object with ``update(done, total, unit, note)``. InputError if nutpie is not installed.
    """
    chain, counts = sample_nuts(problem, rng=rng, n_draws=n_draws, n_tune=n_tune, n_chains=n_chains, progress=progress)
    return compare(posterior, Moments.of_chain(chain), **counts)


def compare(
    posterior: Posterior,
    other: Moments,
    divergences: int = 0,
    gradients: int = 0,
    *,
    spent: tuple[int, int, float] | None = None,
    engine: str = CrossCheck.engine,
) -> CrossCheck:
    """Means, sds and correlations of a posterior by the ensemble sampler beside those by another, the `engine`.

    `divergences`, `gradients` and what it `spent`, if known (simulations, Jacobians, s), are of the other sampler.
    """
    chain = posterior.thinned().chain
    draws = chain.reshape(-1, chain.shape[-1])
    mean_z, sd_z, correlation_z = (np.round(z, 3) for z in other.differences(chain))
    n_params = len(posterior.names)
    efforts: tuple[Effort, ...] = ()
    if spent and posterior.work >= 0.0:  # a Jacobian has the same price for both
        price = float(posterior.jacobian_price)
        ours = posterior.evaluations, posterior.jacobians, price, posterior.seconds, float(posterior.bulk_ess.min())
        simulations, jacobians, seconds = spent
        efforts = Effort(*ours), Effort(simulations, jacobians, price, seconds, other.bulk_ess)
    return CrossCheck(
        names=posterior.names,
        means=np.stack([draws.mean(axis=0), other.means]),
        sds=np.stack([draws.std(axis=0), other.sds]),
        mean_z=mean_z,
        sd_z=sd_z,
        correlation_z=correlation_z,
        threshold=convergence.threshold(n_params * (n_params + 3) // 2, FALSE_ALARMS),
        rhat=other.rhat,
        ess=min(other.bulk_ess, other.tail_ess),
        divergences=int(divergences),
        gradients=int(gradients),
        efforts=efforts,
        engine=engine,
        divergent=divergences / other.n_draws,
    )


class _WithoutWalls:
    """What a geometry asks of a prior, in t in place of x: bounds are at infinity, where no trajectory is cut off."""

    def __init__(self, prior: InferencePrior):
        self.scaled, self.unscaled, self.scaled_chain = prior.standard, prior.parameters, prior.chain
        n = len(prior.mean)
        self.form = np.full(n, np.inf), np.zeros(n), np.full(n, -1), np.empty((0, 0))

    def scaled_log_density(self, t: np.ndarray) -> np.ndarray:
        return -0.5 * np.sum(t**2, axis=-1)

    def scaled_slope(self, t: np.ndarray) -> np.ndarray:
        return -t

    def scaled_form(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        return self.form


def require_nutpie() -> Any:
    """The module, or an InputError that says how to install it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # ArviZ announces its successor
            import nutpie
            import nutpie.compiled_pyfunc
    except ImportError:
        message = "the cross-check needs nutpie; install it with: pip install 'bayesub[cross-check]'"
        raise InputError(message, "install", "nutpie") from None
    return nutpie


def sample_nuts(
    problem: Sampled,
    *,
    rng: np.random.Generator,
    n_draws: int,
    n_tune: int,
    n_chains: int,
    progress: Progress | None = None,
) -> tuple[np.ndarray, dict]:
    """Draws (n_chains, n_draws, n_params) of NUTS, and what :func:`compare` asks for besides.

    That is the divergent trajectories among them, gradients taken, and what all has cost. KeyboardInterrupt for Ctrl-C,
    which nutpie keeps to itself: of draws that it has not got there are none, or they are not numbers.
    """
    nutpie = require_nutpie()
    spent = meter(problem.costs)
    walled = np.isfinite(problem.prior.scaled_form()[0]).any()
    prior = cast(InferencePrior, _WithoutWalls(problem.prior)) if walled else problem.prior
    if problem.histories:  # whitened at the mode they are nearly normal as it is
        smooth = problem.smoothed(SMOOTH)
        marginal, others = search_marginal_mode(cast(Forced, problem), cast(Forced, smooth), rng)
        geometry = Geometry.whitened(smooth, marginal.full(others), prior)
    else:
        geometry = cast(Geometry, learn_coordinates(problem, rng, progress, prior=prior)[0])
    n = problem.n_params
    counts = {"draws": 0, "gradients": 0}

    def log_prob(y):
        counts["gradients"] += 1
        return geometry.with_gradient(problem, y)

    def draw(y):
        counts["draws"] += 1
        if progress is not None:
            total = n_chains * (n_draws + n_tune)
            progress.update(min(counts["draws"], total), total, "draws", f"NUTS, {counts['gradients']} gradients")
        return {"parameters": geometry.parameters(y[None])[0]}

    def start(seed):
        """A point as far out as draws are, without slopes near zero: nutpie's first variances are their inverses."""
        corners = np.random.default_rng(seed).choice([-1.0, 1.0], (_CORNERS, n))
        possible = corners[np.isfinite(geometry.log_prob(problem, corners))]
        return max(possible, key=lambda y: np.abs(geometry.with_gradient(problem, y)[1]).min(), default=corners[0])

    model = nutpie.compiled_pyfunc.from_pyfunc(
        n, lambda: log_prob, lambda *_: draw, [np.dtype(float)], [(n,)], ["parameters"], make_initial_point_fn=start
    )
    step = _STEP_WITHIN_BOUNDS if walled else _STEP
    options = {"chains": n_chains, "cores": 1, "step_size_adapt_method": str(step), "maxdepth": _DOUBLINGS}
    options |= {"seed": int(rng.integers(2**31)), "progress_bar": False}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # ArviZ finds fault with what Ctrl-C leaves
        trace = nutpie.sample(model, draws=n_draws, tune=n_tune, **options)
    draws = np.asarray(trace.posterior["parameters"].values)
    if draws.shape[1] < n_draws or np.isnan(draws).any():
        raise KeyboardInterrupt
    divergences = int(np.count_nonzero(trace.sample_stats["diverging"].values))
    result = {"divergences": divergences, "gradients": counts["gradients"], "spent": list(spent().values())}
    return draws, result
