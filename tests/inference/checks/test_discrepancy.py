"""Explanations of residuals, against dense normal densities and on toys that are linear."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import block_diag

from bayesub.inference.checks.discrepancy import find_discrepancies, gain_of_sizes, inner_products, log_density
from bayesub.problem.alternatives import SlowNoise
from bayesub.problem.likelihoods import AR1

N, P = 60, 3
TIMES = np.arange(N, dtype=float)


class LinearToy:
    """Two channels of which the residuals are linear in everything."""

    def __init__(self, seed, noise=None):
        rng = np.random.default_rng(seed)
        self.slopes = rng.standard_normal((2 * N, P))
        lags = TIMES[:, None] - TIMES
        response = np.where(lags >= 0, lags * np.exp(-0.2 * lags), 0.0)
        both = np.vstack([response, -0.5 * np.cumsum(response, axis=0) / 5.0])
        self.forces = {"X": both, "Y": both[::-1]}
        self.factors = {time: np.linalg.cholesky(np.exp(-np.abs(lags) / time)) for time in (2.0, 5.0, 12.0)}
        self.effects = {
            "bias": {"bias_a": block_diag(np.ones((N, 1)), np.zeros((N, 0))), "bias_b": np.zeros((2 * N, 1))},
            "current": {"current": np.column_stack([np.tile(TIMES / 30.0, 2), np.ones(2 * N)])},
        }
        self.effects["bias"]["bias_a"] = np.repeat([1.0, 0.0], N)[:, None]
        self.effects["bias"]["bias_b"] = np.repeat([0.0, 1.0], N)[:, None]
        truth = rng.standard_normal(P)
        white = rng.standard_normal(2 * N) if noise is None else noise(rng, self)
        self.offset = white - self.slopes @ truth
        self.costs = SimpleNamespace(simulations=0, jacobians=0)

    def residuals(self, standard, amounts):
        columns = {("disturbance", axis): part for axis, part in self.forces.items()}
        columns |= {(kind, name): c for kind, parts in self.effects.items() for name, c in parts.items()}
        return self.offset + standard @ self.slopes.T + sum(amount @ columns[key].T for key, amount in amounts.items())

    def about(self, standard, amounts=None, *, forced=True):  # noqa: ARG002
        return SimpleNamespace(
            residuals=self.offset + self.slopes @ standard,
            standard=standard,
            jacobian=self.slopes,
            effects=self.effects,
            forces=self.forces,
            factors=self.factors,
        )

    def slow_noises(self, about):
        whole = np.column_stack([about.jacobian, about.residuals])
        noises = {}
        for name, rows in (("a", slice(0, N)), ("b", slice(N, 2 * N))):
            own, times = whole[rows], np.array([1.0, 3.0, 9.0])
            whitened = np.array([AR1(1.0, t).weigh(own, own, np.zeros(N), TIMES) for t in times])
            covariances = [np.exp(-np.abs(TIMES[:, None] - TIMES) / t) for t in times]
            noises[name] = SlowNoise(
                rows, times, whitened, np.array([0.5 * np.linalg.slogdet(c)[1] for c in covariances])
            )
        return noises


def dense(toy, covariance):
    """Log density of the residuals by the normal distribution with parameters integrated out."""
    return stats.multivariate_normal(np.zeros(2 * N), covariance + toy.slopes @ toy.slopes.T).logpdf(toy.offset)


@pytest.mark.parametrize("standard", [np.zeros(P), np.array([0.5, -1.0, 2.0])])
def test_gains_are_those_of_dense_densities(standard):
    """About whatever parameters: a toy is linear, and its density does not depend on where it is expanded."""
    toy = LinearToy(1)
    about = toy.about(standard)
    at_zero = log_density(toy.about(np.zeros(P)))
    assert log_density(about) == pytest.approx(at_zero, abs=1e-9)
    columns = np.hstack([toy.forces["X"] @ toy.factors[5.0], toy.effects["current"]["current"]])
    sizes = np.concatenate([np.full(N, 0.05), [0.3, 0.4]])
    gain, slopes = gain_of_sizes(*inner_products(about, columns), sizes)
    assert gain == pytest.approx(dense(toy, np.eye(2 * N) + columns * sizes**2 @ columns.T) - dense(toy, np.eye(2 * N)))
    for k in (0, N):
        more, less = (np.where(np.arange(N + 2) == k, sizes * np.exp(h), sizes) for h in (1e-4, -1e-4))
        difference = [dense(toy, np.eye(2 * N) + columns * s**2 @ columns.T) for s in (more, less)]
        assert slopes[k] == pytest.approx((difference[0] - difference[1]) / 2e-4, rel=1e-5, abs=1e-7)


def of_forces(rng, toy):
    return rng.standard_normal(2 * N) + 0.2 * toy.forces["X"] @ toy.factors[5.0] @ rng.standard_normal(N)


def of_bias(rng, toy):
    return rng.standard_normal(2 * N) + 2.0 * toy.effects["bias"]["bias_b"][:, 0]


def of_current(rng, toy):
    return rng.standard_normal(2 * N) + toy.effects["current"]["current"] @ [1.0, -0.7]


def slow(rng, toy):  # noqa: ARG001
    own = np.linalg.cholesky(1.5**2 * np.exp(-np.abs(TIMES[:, None] - TIMES) / 3.0)) @ rng.standard_normal(N)
    return np.concatenate([own, rng.standard_normal(N)])


@pytest.mark.parametrize(
    ("noise", "kind", "names"),
    [
        (of_forces, "disturbance", {"X"}),
        (of_bias, "bias", {"bias_b"}),
        (of_current, "current", {"current"}),
        (slow, "slow noise", {"a"}),
    ],
)
def test_the_kind_that_made_the_residuals_is_first(noise, kind, names):
    for seed in range(5):
        toy = LinearToy(seed, noise)
        best, *others = find_discrepancies(toy, np.zeros(P))
        assert best.kind == kind
        assert names <= set(best.sizes)
        assert all(best.gain >= other.gain for other in others)


def test_the_gain_of_slow_noise_is_that_of_the_dense_density():
    toy = LinearToy(2, slow)
    (best,) = (e for e in find_discrepancies(toy, np.zeros(P)) if e.kind == "slow noise")
    assert set(best.sizes) == {"a"}
    covariance = best.sizes["a"] ** 2 * np.exp(-np.abs(TIMES[:, None] - TIMES) / best.times["a"])
    gain = dense(toy, block_diag(covariance, np.eye(N))) - dense(toy, np.eye(2 * N))
    assert best.gain == pytest.approx(gain - np.log(2 * N), abs=1e-6)


def test_the_size_of_forces_is_found():
    """Within a factor of two of the truth, on the median of ten records."""
    sizes = [find_discrepancies(LinearToy(seed, of_forces), np.zeros(P))[0].sizes["X"] for seed in range(10)]
    assert 0.1 < np.median(sizes) < 0.4


def test_white_residuals_have_no_explanation():
    counts = [len(find_discrepancies(LinearToy(seed), np.zeros(P))) for seed in range(40)]
    assert np.count_nonzero(counts) <= 4


def test_a_simulation_that_fails_has_no_explanation():
    toy = LinearToy(3)
    toy.about = lambda *_, **__: None
    assert find_discrepancies(toy, np.zeros(P)) == []


def test_without_candidates_there_is_no_explanation():
    """All that could be left out is inferred, and channels of single readings have no slow noise."""
    toy = LinearToy(3)
    toy.effects, toy.forces, toy.slow_noises = {}, {}, lambda _: {}
    assert find_discrepancies(toy, np.zeros(P)) == []
