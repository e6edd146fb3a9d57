"""Weights that leave a trial out of a posterior."""

from types import SimpleNamespace

import numpy as np
import pytest

from how_many_terms.reweighting import TRUSTED, reweighted


def test_weighted_draws_are_a_posterior_without_the_trial_where_they_can_be_trusted(rng):
    """A normal mean read in two trials: few readings are left out by weights, and many cannot be."""
    mean, others = 0.3 + rng.standard_normal(4000) / np.sqrt(41.0), rng.standard_normal(40)
    for n, trusted in ((2, True), (4000, False)):
        own = rng.standard_normal(n)
        precision = 1.0 + len(others) + n
        draws = (others.sum() + own.sum()) / precision + (mean - mean.mean()) * np.sqrt(41.0 / precision)

        def log_likelihoods(draws, own=own):
            parts = {"x[one]": own, "x[two]": others}
            return {name: -0.5 * np.sum((readings - draws) ** 2, axis=1) for name, readings in parts.items()}

        joint = SimpleNamespace(log_likelihoods=log_likelihoods)
        weights, k_hat = reweighted(joint, draws[:, None], "one")
        assert weights.sum() == pytest.approx(1.0)
        assert (k_hat < TRUSTED) == trusted
        if trusted:
            left = weights @ draws
            assert left == pytest.approx(others.sum() / 41.0, abs=0.02)  # sd of the posterior 0.16, of its mean 0.003
            assert weights @ (draws - left) ** 2 == pytest.approx(1.0 / 41.0, rel=0.1)
