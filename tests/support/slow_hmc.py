"""The flights of :mod:`bayesub.inference.sampling.hmc` once more, in NumPy, on any density: walkers are rows."""

import numpy as np

DEPENDENT = 1e-6


@np.errstate(over="ignore", invalid="ignore")  # a flight may end at infinity, and is then refused
def trajectories(density, y, angles, momenta, thresholds, n_kicks):
    """As the compiled flights; `density` gives logarithms (n,) and their gradients at places (n, n_params)."""
    y, accepted = y.copy(), np.zeros(len(y))
    log_prob, gradient = density(y)
    for angle, momentum, threshold in zip(angles, momenta, thresholds, strict=True):
        energy, step = 0.5 * np.sum(momentum**2, axis=1), angle[:, None]
        place, momentum = y, momentum + 0.5 * step * (gradient + y)
        for kick in range(1, n_kicks + 1):
            place, momentum = rotate(place, momentum, step)
            new, slope = density(place)
            momentum = momentum + (step if kick < n_kicks else 0.5 * step) * (slope + place)
        taken = threshold < new - log_prob + energy - 0.5 * np.sum(momentum**2, axis=1)
        y[taken], log_prob[taken], gradient[taken] = place[taken], new[taken], slope[taken]
        accepted += taken / len(angles)
    return y, log_prob, accepted


@np.errstate(over="ignore", invalid="ignore")
def reflecting_trajectories(density, walls, y, angles, momenta, before, thresholds):
    """As the compiled flights; `walls` gives rows (n_walls,), ascending, and normals (n_walls, n_params) at places."""
    y, moved = y.copy(), np.zeros(len(y))
    log_prob, gradient = density(y)
    for angle, start_momentum, back, threshold in zip(angles, momenta, before, thresholds, strict=True):
        start, start_slope = y.copy(), gradient.copy()
        energy = 0.5 * np.sum(start_momentum**2, axis=1) - log_prob
        place, momentum, slope, log_total = start, start_momentum, start_slope, np.zeros(len(y))
        elsewhere = np.zeros(len(y), dtype=bool)
        for leap, limit in enumerate(threshold):
            momentum = reflected(momentum, *walls(place))
            reset = (back == leap)[:, None]
            place, momentum, slope = (
                np.where(reset, first, now)
                for first, now in ((start, place), (start_momentum, momentum), (start_slope, slope))
            )
            step = np.where(back > leap, -angle, angle)[:, None]
            momentum = momentum + 0.5 * step * (slope + place)
            place, momentum = rotate(place, momentum, step)
            new, slope = density(place)
            momentum = momentum + 0.5 * step * (slope + place)
            log_weight = np.nan_to_num(new + energy - 0.5 * np.sum(momentum**2, axis=1), nan=-np.inf)
            log_total = np.logaddexp(log_total, log_weight)
            taken = limit < log_weight - log_total
            y[taken], log_prob[taken], gradient[taken] = place[taken], new[taken], slope[taken]
            elsewhere |= taken
        moved += elsewhere / len(angles)
    return y, log_prob, moved


def rotate(place, momentum, step):
    return np.cos(step) * place + np.sin(step) * momentum, np.cos(step) * momentum - np.sin(step) * place


def reflected(momentum, rows, normals):
    """The component in the span of the normals of each row reversed, by their singular vectors."""
    momentum = momentum.copy()
    members, first, counts = np.unique(rows, return_index=True, return_counts=True)
    for count in np.unique(counts):
        some = members[counts == count]
        walls = normals[first[counts == count][:, None] + np.arange(count)]
        _, lengths, span = np.linalg.svd(walls, full_matrices=False)
        along = np.einsum("nkp,np->nk", span, momentum[some]) * (lengths > DEPENDENT * lengths[:, :1])
        momentum[some] -= 2.0 * np.einsum("nk,nkp->np", along, span)
    return momentum


def numbers(random, y, turns, n_flights, n_leaps=None):
    """What flights draw: angles, momenta, the place of the start if there are leaps, and logarithms of uniforms."""
    angles = random.choice(np.array(turns, dtype=float), size=(n_flights, len(y)))
    momenta = random.standard_normal((n_flights, *y.shape))
    if n_leaps is None:
        return angles, momenta, np.log(random.random((n_flights, len(y))))
    before = random.choice(n_leaps + 1, size=(n_flights, len(y)))
    return angles, momenta, before, np.log(random.random((n_flights, n_leaps, len(y))))
