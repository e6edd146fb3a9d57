"""Changes of the controls by what is not zero."""

import numpy as np

from bayesub.kernels.variations import of_dense, of_entries


def test_amounts_add_as_the_dense_array_says():
    """Half of it zero; entries in another order are the same changes."""
    rng = np.random.default_rng(1)
    dense = rng.standard_normal((4, 3, 5, 6)) * (rng.random((4, 3, 5, 6)) < 0.5)
    amounts = rng.standard_normal(5)
    sparse = of_dense(dense)
    assert len(sparse.values) == np.count_nonzero(dense)
    np.testing.assert_allclose(sparse.added(amounts, 6), np.einsum("n,stnk->stk", amounts, dense), atol=1e-15)
    stages = np.repeat(np.arange(12), np.diff(sparse.starts))
    order = rng.permutation(len(stages))
    shuffled = of_entries(4, stages[order], *(part[order] for part in sparse[1:]))
    np.testing.assert_allclose(shuffled.added(amounts, 6), sparse.added(amounts, 6), atol=1e-15)
