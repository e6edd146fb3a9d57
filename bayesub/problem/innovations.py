"""Forces at knots as sequences that cost as much as they are long: the innovations form of a broken line.

The broken line nearest to a process (least squares) has at equidistant knots the values ``c = g^-1 m``, with m the
means of the process under hats and g the Gram matrix of these, 1/6, 2/3, 1/6. As the process is autoregressive in
continuous time, c is an autoregressive moving average: its autocorrelations

    gamma_d = sum of (C a^d, of a smooth process (C + C' d) a^d) + (D + D' d) b^d,    b = sqrt(3) - 2,

follow from those of m by a few linear equations, and its predictions ``p_j`` of c_j, c_j+1, .. given all before are the
state of

    c_j = p_j[0] + root_j w_j,    p_j+1 = T p_j + gain_j w_j,    w standard normal and white,

where T moves predictions up by one, and predicts the last by the autoregression (Brockwell & Davis 1991, section 5.2,
in the recursion of Faurre). So w is as long as c, and c is stationary from its first knot on.
"""

import numpy as np

from bayesub.kernels.jit import jit
from bayesub.kernels.kalman import Innovations
from bayesub.model.disturbance import correlation

_POLE = np.sqrt(3.0) - 2.0  # of the inverse of the Gram matrix
_GRAM = np.array([1.0, 4.0, 1.0]) / 6.0
_SMOOTHNESS = {"ornstein_uhlenbeck": 1, "matern_3_2": 2}  # order of the autoregression in continuous time
_LONGEST = 3e3  # correlation time in intervals; a longer one is no other, and its innovations are round-off
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def lags(kind: str) -> int:
    """How many predictions the sequences of a process need."""
    return _SMOOTHNESS[kind] + 2


def innovations(kind: str, interval: float, n_knots: int, times: np.ndarray, n_lags: int | None = None) -> Innovations:
    """The sequences (n,) of unit sd for correlation times (n,), s, at knots `interval` apart; more lags change nothing.

    Their parts have no place for axes.
    """
    order, n_terms = _SMOOTHNESS[kind], lags(kind)
    n_lags = n_terms if n_lags is None else n_lags
    times = np.minimum(times, _LONGEST * interval)
    decay = np.exp(-interval / times * (1.0 if order == 1 else np.sqrt(3.0)))
    # Autocorrelations of means under hats: integrals over the hats' own, a cubic spline.
    pieces = np.arange(-2, 2)[:, None] + 0.5 + 0.5 * _NODES
    size = np.abs(pieces)
    spline = np.where(size < 1.0, 2.0 / 3.0 - size**2 + 0.5 * size**3, (2.0 - size) ** 3 / 6.0)
    apart = np.arange(n_terms)[:, None, None] + pieces
    of_means = np.einsum(
        "ij,ndij->nd",
        0.5 * _WEIGHTS * spline,
        correlation(kind, np.abs(apart) * (interval / times)[:, None, None, None]),
    )
    # The terms of gamma at lags from zero, and what g g makes of them.
    lag = np.arange(n_lags + 2)
    powers = np.stack([decay[:, None] ** lag, np.broadcast_to(_POLE**lag, (len(times), len(lag)))], axis=-1)
    parts = [powers[..., 0], powers[..., 1], lag * powers[..., 1], *([lag * powers[..., 0]] * (order == 2))]
    terms = np.stack(parts, axis=-1)  # (n, n_lags + 2, n_terms)
    square = np.convolve(_GRAM, _GRAM)
    equations = sum(
        weight * terms[:, np.abs(np.arange(n_terms) + shift)]
        for shift, weight in zip(range(-2, 3), square, strict=True)
    )
    gamma = np.einsum("ndt,nt->nd", terms, np.linalg.solve(equations, of_means[..., None])[..., 0])
    # (1 - a B)^order (1 - b B)^2, whose coefficients predict.
    polynomials = np.ones((len(times), 1))
    for root in (*[decay] * order, *[np.full(len(times), _POLE)] * 2):
        longer = np.pad(polynomials, ((0, 0), (0, 1)))
        longer[:, 1:] -= root[:, None] * polynomials
        polynomials = longer
    last = np.zeros((len(times), n_lags))
    last[:, n_lags - n_terms :] = -polynomials[:, :0:-1]
    gains, roots = np.empty((len(times), n_knots, n_lags)), np.empty((len(times), n_knots))
    _recursion(last, np.ascontiguousarray(gamma[:, : n_lags + 1]), gains, roots)
    return Innovations(last, gains, roots)


@jit
def _recursion(last, gamma, gains, roots):
    """Gains and roots of sequences of autocorrelations gamma (n, n_lags + 1), from the first knot on."""
    n, n_knots, n_lags = gains.shape
    spread, moved = np.empty((n_lags, n_lags)), np.empty((n_lags, n_lags))
    for m in range(n):
        spread[:] = 0.0  # covariance of the predictions
        for j in range(n_knots):
            left = gamma[m, 0] - spread[0, 0]
            roots[m, j] = np.sqrt(max(left, 1e-14 * gamma[m, 0]))
            for i in range(n_lags):
                ahead = 0.0  # of T spread, its first column
                if i + 1 < n_lags:
                    ahead = spread[i + 1, 0]
                else:
                    for k in range(n_lags):
                        ahead += last[m, k] * spread[k, 0]
                gains[m, j, i] = (gamma[m, i + 1] - ahead) / roots[m, j]
            for i in range(n_lags):  # T spread T'
                for k in range(n_lags):
                    moved[i, k] = 0.0
                    if i + 1 < n_lags:
                        moved[i, k] = spread[i + 1, k]
                    else:
                        for h in range(n_lags):
                            moved[i, k] += last[m, h] * spread[h, k]
            for i in range(n_lags):
                for k in range(n_lags):
                    value = 0.0
                    if k + 1 < n_lags:
                        value = moved[i, k + 1]
                    else:
                        for h in range(n_lags):
                            value += last[m, h] * moved[i, h]
                    spread[i, k] = value + gains[m, j, i] * gains[m, j, k]


def factor(kind: str, interval: float, n_knots: int, time: float, n_lags: int | None = None) -> np.ndarray:
    """(n_knots, n_knots) lower triangular: forces of unit sd are it times white coordinates."""
    sequences = innovations(kind, interval, n_knots, np.array([time]), n_lags)
    unit = Innovations(*(np.repeat(part[:, None], n_knots, axis=0) for part in sequences))
    return unit.forces(np.eye(n_knots)[:, None])[:, 0].T
