"""One prior and one contraction: what the data do not see is as wide as before, for every kind of prior."""

from types import SimpleNamespace

import numpy as np
import pytest

from bayesub.findings.results import Results
from bayesub.inference.identifiability import fisher
from bayesub.inference.sampling import Posterior
from bayesub.problem.distributions import CorrelatedNormal, Joint, LogNormal, Normal, Uniform
from bayesub.problem.shared_scale import SharedScale

MIDDLE = np.array([1.0, -2.0, 0.5, 3.0, 1.5])
N = len(MIDDLE)
RELATED = np.eye(N)  # correlations, but of the last
RELATED[:4, :4] = 0.5 * (1.0 + np.eye(4))
SCALES = 0.25 * 4.0 ** np.linspace(-1.0, 1.0, 65)
ALL, ONE = np.arange(N), np.ones(1)
PRIORS = {
    "normal": Normal(MIDDLE, 0.25 * np.abs(MIDDLE)),
    "uniform": Uniform(MIDDLE - 0.75 * np.abs(MIDDLE), MIDDLE + 0.75 * np.abs(MIDDLE)),
    "log-normal": LogNormal(MIDDLE, np.full(N, 0.25)),
    "relative log-normal": SharedScale(MIDDLE, np.array([0.25])),
    "hierarchical": SharedScale(MIDDLE, SCALES),
    "by axis": Joint(
        (SharedScale(MIDDLE[[0, 2, 4]], SCALES), SharedScale(MIDDLE[[1, 3]], SCALES)), (ALL[::2], ALL[1::2])
    ),
    "given": CorrelatedNormal(MIDDLE, np.diag(0.3 * np.abs(MIDDLE)) @ np.linalg.cholesky(RELATED)),
    "mixed": Joint(
        (SharedScale(MIDDLE[[0, 1, 4]], SCALES), Uniform(MIDDLE[[2]] - 1, MIDDLE[[2]] + 1), Normal(MIDDLE[[3]], ONE)),
        (ALL[[0, 1, 4]], ALL[[2]], ALL[[3]]),
    ),
}  # fmt: skip
READ = np.zeros((2, N))  # two sums of parameters over their size; the last is in neither, and so two directions besides
READ[0, :3], READ[1, 1:4] = (1.0, 1.0, 1.0), (1.0, -1.0, 1.0)
READ /= np.abs(MIDDLE)
SD, N_DRAWS = 0.1, 4000


@pytest.fixture(scope="module", params=PRIORS)
def results(request):
    """Exact draws, by rejection, of a linear problem whose null space is known."""
    prior, rng = PRIORS[request.param], np.random.default_rng(3)
    null = [_named(row) for row in _null_rows()]
    readings, draws = READ @ (MIDDLE * [1.2, 0.9, 1.1, 1.1, 1.0]), np.empty((0, N))
    while len(draws) < N_DRAWS:
        some = prior.sample(rng, 200_000)
        misfit = np.sum((some @ READ.T - readings) ** 2, axis=1) / SD**2
        draws = np.concatenate([draws, some[rng.random(len(some)) < np.exp(-0.5 * misfit)]])
    chain = draws[:N_DRAWS].reshape(4, -1, 8, N)
    names = tuple(f"c{k}" for k in ALL)
    posterior = Posterior(names, chain, np.zeros(chain.shape[:-1]), prior.mean, prior.sd, 0, 0.5, 1, 1.0, {})
    problem = SimpleNamespace(
        names=names, n_params=N, prior=prior, prior_of_others=prior, others=ALL, histories=(), preferred_pivots=(),
        jacobian=lambda _: READ / SD,
    )  # fmt: skip
    spectrum = fisher(problem, posterior.mean, null, posterior.draws)
    return Results(problem, [], spectrum, posterior, None)


def _null_rows():
    """(3, N) directions that the readings do not see."""
    return np.linalg.svd(READ)[2][2:]


def _named(row):
    return {f"c{k}": float(value) for k, value in enumerate(row)}


def _error(draws):
    """Standard error of the sd of independent draws (n, m), relative, from their fourth moments."""
    z = (draws - draws.mean(axis=0)) / draws.std(axis=0)
    return np.sqrt((np.mean(z**4, axis=0) - 1.0) / len(z)) / 2.0


def test_null_directions_are_as_wide_as_before(results):
    spectrum = results.spectrum
    assert spectrum.n_null == 3
    along = results.summary.draws @ (spectrum.coordinates[-3:] / spectrum.prior_sd).T
    assert (np.abs(results.null_contraction - 1.0) < 4.0 * _error(along) + 0.01).all()


def test_what_no_reading_sees_is_as_wide_as_before(results):
    """A scale that the others tell has narrowed it, and tells nothing of it."""
    posterior = results.summary
    error = _error(posterior.draws)[-1]
    assert posterior.contraction[-1] == pytest.approx(1.0, abs=4.0 * error + 0.01)
    assert posterior.summary()["contraction"].iloc[-1] == posterior.contraction[-1]
    np.testing.assert_allclose(
        posterior.contraction, posterior.draws.std(axis=0, ddof=1) / results.prior.sd, rtol=1e-12
    )


def test_the_file_alone_says_the_same(results, tmp_path):
    posterior = results.posterior.given(results.problem.prior)
    posterior.save(tmp_path / "posterior.nc")
    loaded = Posterior.load(tmp_path / "posterior.nc")
    np.testing.assert_array_equal(loaded.prior_sd, posterior.prior_sd)
    np.testing.assert_array_equal(loaded.given(results.problem.prior).prior_sd, posterior.prior_sd)
    np.testing.assert_allclose(loaded.contraction, posterior.contraction, rtol=0.02)
