"""Hamiltonian Monte Carlo on a surrogate, compiled: trajectories without walls, and such that are reflected at walls.

With a potential ``|y|^2 / 2 - rest(y)`` the motion of the first part is a rotation of coordinates and momenta, which is
exact. A leapfrog step is half a step of the momenta by the slope of `rest`, a rotation, and half a step of the momenta
(Shahbaba et al. 2014). Each of them keeps volume and is reversible, whatever the slope is.

Walkers are taken :data:`PLACES` at a time through all their trajectories, as columns of matrices that stay in a core's
cache. A surrogate is a tuple of arrays, and so is its prior
(:meth:`bayesub.inference.interface.InferencePrior.scaled_form`);
:meth:`bayesub.inference.sampling.surrogate.Surrogate.packed` gives both.
"""

import numpy as np
from numpy import ndarray as Array

from bayesub.inference.sampling.geometry import bend_at, pull_back_at
from bayesub.inference.sampling.polynomial import PLACES, add, columns, compiled, inline, pullback_at, put, values_at

_DEPENDENT = 1e-6  # of its length; what a normal has beside others that is no more than round-off


@compiled
def log_densities(y: np.ndarray, surrogate: tuple, prior: tuple) -> np.ndarray:
    """(n,) log densities of a surrogate at y (n, n_params)."""
    result = np.empty(len(y))
    for first in range(0, len(y), PLACES):
        some = columns(y, first)
        log_prob, _, _, _, _ = _emulated(some, surrogate, prior)
        for k in range(len(log_prob)):
            result[first + k] = log_prob[k]
    return result


@compiled
def with_gradients(y: np.ndarray, surrogate: tuple, prior: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Log densities (n,) of a surrogate at y (n, n_params), and gradients (n, n_params) within the prior's support."""
    result, gradients = np.empty(len(y)), np.empty(y.shape)
    for first in range(0, len(y), PLACES):
        some = columns(y, first)
        log_prob, slopes, _, _ = _with_gradient(some, surrogate, prior)
        for k in range(len(log_prob)):
            result[first + k] = log_prob[k]
        put(slopes, gradients, first)
    return result, gradients


@compiled
def trajectories(
    y: Array, angles: Array, momenta: Array, thresholds: Array, n_steps: int, surrogate: tuple, prior: tuple
) -> tuple[Array, Array, Array]:
    """Trajectories one after another, each accepted or refused at its end.

    Of walkers y (n, n_params), with `angles` (n_trajectories, n) of a leapfrog step in radians, standard normal
    `momenta` (n_trajectories, n, n_params) at the start of each, and `thresholds` (n_trajectories, n), logarithms of
    uniform random numbers. Returns places (n, n_params), log densities (n,), fractions of trajectories accepted (n,).
    """
    n_trajectories, ends, log_ends, accepted = len(angles), np.empty(y.shape), np.empty(len(y)), np.zeros(len(y))
    for first in range(0, len(y), PLACES):
        place = columns(y, first)
        log_prob, gradient, _, _ = _with_gradient(place, surrogate, prior)
        for trajectory in range(n_trajectories):
            angle = angles[trajectory, first : first + PLACES]
            momentum = columns(momenta[trajectory], first)
            energy = _kinetic(momentum)
            # The half steps of the momenta between two rotations are one whole step.
            _step_momentum(momentum, 0.5, angle, gradient, place)
            reached, new, slope = place, log_prob, gradient
            for step in range(n_steps):
                reached, momentum = _rotate(reached, momentum, angle)
                new, slope, _, _ = _with_gradient(reached, surrogate, prior)
                _step_momentum(momentum, 1.0 if step < n_steps - 1 else 0.5, angle, slope, reached)
            left = _kinetic(momentum)
            for k in range(len(angle)):
                if thresholds[trajectory, first + k] < new[k] - log_prob[k] + energy[k] - left[k]:
                    log_prob[k] = new[k]
                    _copy_column(k, reached, place)
                    _copy_column(k, slope, gradient)
                    accepted[first + k] += 1.0 / n_trajectories
        put(place, ends, first)
        for k in range(len(log_prob)):
            log_ends[first + k] = log_prob[k]
    return ends, log_ends, accepted


@compiled
def reflecting_trajectories(
    y: Array, angles: Array, momenta: Array, before: Array, thresholds: Array, surrogate: tuple, prior: tuple
) -> tuple[Array, Array, Array]:
    """Trajectories that are reflected at walls, each of which ends at any of its places.

    Within the bounds of fifty parameters a trajectory hits several walls on its way, and its end is often outside. A
    leapfrog step from outside therefore begins with a reflection: all that the momentum has along the normals of the
    walls that the place is behind is reversed. That depends on the place alone and is its own inverse, whatever the
    normals are, so that backwards the same steps lead over the same places. The start is put anywhere on its
    trajectory, and the new place is drawn from all of it by density (Neal 1994; Betancourt 2017, appendix A.3): what
    lies outside is never drawn.

    Walkers y (n, n_params) are within the support. `angles`, `momenta` and what is returned are as in
    :func:`trajectories`, with the fraction of trajectories that ended elsewhere; `before` (n_trajectories, n) is how
    many steps of a trajectory lead to its start, and `thresholds` are (n_trajectories, n_steps, n).
    """
    n_trajectories, n_steps = thresholds.shape[:2]
    ends, log_ends, moved = np.empty(y.shape), np.empty(len(y)), np.zeros(len(y))
    for first in range(0, len(y), PLACES):
        drawn = columns(y, first)
        log_drawn, gradient, _, _ = _with_gradient(drawn, surrogate, prior)
        n = len(log_drawn)
        for trajectory in range(n_trajectories):
            start, slope_of_start = drawn.copy(), gradient.copy()
            momenta_of_start = columns(momenta[trajectory], first)
            energy = _kinetic(momenta_of_start)
            for k in range(n):
                energy[k] -= log_drawn[k]
            place, slope, momentum = start.copy(), slope_of_start.copy(), momenta_of_start.copy()
            outside, log_total, elsewhere = np.zeros(start.shape, dtype=np.bool_), np.zeros(n), np.zeros(n)
            z = place
            for step in range(n_steps):
                _reflect(momentum, outside, z, surrogate)
                # Backwards to the first place; when that is reached, from the start again and forwards.
                angle = np.empty(n)
                for k in range(n):
                    back = before[trajectory, first + k]
                    angle[k] = -angles[trajectory, first + k] if back > step else angles[trajectory, first + k]
                    if back == step:
                        _copy_column(k, start, place)
                        _copy_column(k, momenta_of_start, momentum)
                        _copy_column(k, slope_of_start, slope)
                # The leapfrog step.
                _step_momentum(momentum, 0.5, angle, slope, place)
                place, momentum = _rotate(place, momentum, angle)
                new, slope, x, z = _with_gradient(place, surrogate, prior)
                _step_momentum(momentum, 0.5, angle, slope, place)
                outside = _outside(x, prior)
                # The place takes the turn of those before with its share of the total density.
                left = _kinetic(momentum)
                for k in range(n):
                    log_weight = new[k] + energy[k] - left[k]
                    if np.isnan(log_weight):
                        continue
                    log_total[k] = np.logaddexp(log_total[k], log_weight)
                    if thresholds[trajectory, step, first + k] < log_weight - log_total[k]:
                        _copy_column(k, place, drawn)
                        _copy_column(k, slope, gradient)
                        log_drawn[k], elsewhere[k] = new[k], 1.0
            for k in range(n):
                moved[first + k] += elsewhere[k] / n_trajectories
        put(drawn, ends, first)
        for k in range(n):
            log_ends[first + k] = log_drawn[k]
    return ends, log_ends, moved


# Loops are written out: a sum of arrays, or a slice that is written to, takes numba longer than all of a walk.


@inline
def _step_momentum(momentum, share, angle, slope, place):
    """Add a share of the angle times the slope of what is left of the potential to the momenta."""
    for param in range(momentum.shape[0]):
        for k in range(momentum.shape[1]):
            momentum[param, k] += share * angle[k] * (slope[param, k] + place[param, k])


@inline
def _copy_column(k, source, target):
    for param in range(source.shape[0]):
        target[param, k] = source[param, k]


@inline
def _kinetic(momentum):
    energy = np.zeros(momentum.shape[1])
    for param in range(momentum.shape[0]):
        for k in range(momentum.shape[1]):
            energy[k] += 0.5 * momentum[param, k] * momentum[param, k]
    return energy


@compiled
def _rotate(place, momentum, angle):
    places, momenta = np.empty(place.shape), np.empty(place.shape)
    for k in range(len(angle)):
        cosine, sine = np.cos(angle[k]), np.sin(angle[k])
        for param in range(place.shape[0]):
            places[param, k] = cosine * place[param, k] + sine * momentum[param, k]
            momenta[param, k] = cosine * momentum[param, k] - sine * place[param, k]
    return places, momenta


@compiled
def _reflect(momentum, outside, z, surrogate):
    """Reverse what each momentum has in the span of the normals of the walls that its place z is outside of, in place.

    All (n_params, n). The normals of a place are made orthonormal; those of no use are left out.
    """
    basis, sizes, numbers = surrogate[1], surrogate[2], surrogate[3]
    n_walls = np.sum(outside)
    if n_walls == 0:
        return
    # Each wall by one place: z there, and the normal in z, which the bends turn into one in y.
    at, normals, n_params = np.empty((len(z), n_walls)), np.empty((len(z), n_walls)), len(z)
    columns_of, wall = np.empty(n_walls, dtype=np.int64), 0
    for k in range(z.shape[1]):
        for param in range(n_params):
            if outside[param, k]:
                for row in range(n_params):
                    at[row, wall], normals[row, wall] = z[row, k], basis[param, row]
                columns_of[wall] = k
                wall += 1
    pull_back_at(at, normals, sizes, numbers)
    # Gram-Schmidt over the walls of one place, then the momentum less twice its part along each orthonormal normal.
    span = np.ascontiguousarray(normals.T)
    first = 0
    for wall in range(n_walls):
        if columns_of[wall] != columns_of[first]:
            first = wall
        normal = span[wall]
        length = np.sqrt(np.sum(normal**2))
        for other in range(first, wall):
            normal -= np.sum(span[other] * normal) * span[other]
        rest = np.sqrt(np.sum(normal**2))
        normal *= 1.0 / rest if rest > _DEPENDENT * length else 0.0
        along = 0.0
        for param in range(n_params):
            along += normal[param] * momentum[param, columns_of[wall]]
        for param in range(n_params):
            momentum[param, columns_of[wall]] -= 2.0 * along * normal[param]


@compiled
def _emulated(y, surrogate, prior):
    """Log densities (n,) at y (n_params, n); what the squares sum to more than at the mode (n,); residuals, x and z."""
    mode, basis, sizes, numbers, polynomials, power, n_degrees = surrogate
    z = y.copy()
    bend_at(z, sizes, numbers)
    x = np.dot(basis, z)
    for param in range(len(x)):
        for k in range(x.shape[1]):
            x[param, k] += mode[param]
    residuals = values_at(z, polynomials)
    excess, at_mode = np.zeros(y.shape[1]), 0.0
    for row in range(len(residuals)):
        at_mode += polynomials.linear[0, row] ** 2
        for k in range(len(excess)):
            excess[k] += residuals[row, k] * residuals[row, k]
    log_prob, factor = log_prior(x, prior), 0.5 * power * (n_degrees + len(residuals))
    for k in range(len(excess)):
        excess[k] -= at_mode
        tail = np.log1p(max(excess[k], 0.0) / n_degrees) + min(excess[k], 0.0) / n_degrees
        log_prob[k] -= factor * tail
    return log_prob, excess, residuals, x, z


@compiled
def _with_gradient(y, surrogate, prior):
    """Log densities (n,), their gradients (n_params, n) by y (n_params, n), x and z."""
    _, basis, sizes, numbers, polynomials, power, n_degrees = surrogate
    log_prob, excess, residuals, x, z = _emulated(y, surrogate, prior)
    for k in range(len(excess)):
        factor = -power * (n_degrees + len(residuals)) / (n_degrees + max(excess[k], 0.0))
        for row in range(len(residuals)):
            residuals[row, k] *= factor
    slopes = pullback_at(z, polynomials, residuals)
    add(np.dot(basis.T, slope_of_prior(x, prior)), slopes)
    pull_back_at(z, slopes, sizes, numbers)
    return log_prob, slopes, x, z


@compiled
def log_prior(x: np.ndarray, prior: tuple) -> np.ndarray:
    """Log densities (n,) of a prior at scaled coordinates x (n_params, n), up to a constant; -inf outside."""
    walls, stretches, groups, scales = prior
    result = np.zeros(x.shape[1])
    for param in range(len(x)):
        if groups[param] < 0:
            wall = walls[param]
            for k in range(x.shape[1]):
                if wall == np.inf:
                    result[k] -= 0.5 * x[param, k] ** 2
                elif not abs(x[param, k]) <= wall:
                    result[k] = -np.inf
    for group in range(len(scales)):
        squares, logs, size, inside = _logarithms(x, stretches, groups, group)
        for k in range(x.shape[1]):
            if not inside[k]:
                result[k] = -np.inf
                continue
            total = -np.inf
            for scale in scales[group]:
                if not np.isnan(scale):
                    total = np.logaddexp(total, -0.5 * squares[k] / scale**2 - size * np.log(scale))
            result[k] += total - logs[k]
    return result


@compiled
def slope_of_prior(x: np.ndarray, prior: tuple) -> np.ndarray:
    """(n_params, n) gradient of :func:`log_prior` at x (n_params, n), within the support."""
    walls, stretches, groups, scales = prior
    result = np.zeros(x.shape)
    for param in range(len(x)):
        if groups[param] < 0 and walls[param] == np.inf:
            for k in range(x.shape[1]):
                result[param, k] = -x[param, k]
    for group in range(len(scales)):
        squares, _, size, _ = _logarithms(x, stretches, groups, group)
        precision = np.empty(x.shape[1])
        for k in range(x.shape[1]):
            # Weights of the scales, over that of the most probable one.
            most, total, weighted = -np.inf, 0.0, 0.0
            for scale in scales[group]:
                if not np.isnan(scale):
                    most = max(most, -0.5 * squares[k] / scale**2 - size * np.log(scale))
            for scale in scales[group]:
                if not np.isnan(scale):
                    weight = np.exp(-0.5 * squares[k] / scale**2 - size * np.log(scale) - most)
                    total += weight
                    weighted += weight / scale**2
            precision[k] = weighted / total
        for param in range(len(x)):
            if groups[param] == group:
                for k in range(x.shape[1]):
                    ratio = 1.0 + stretches[param] * x[param, k]
                    result[param, k] = -stretches[param] * (np.log(ratio) * precision[k] + 1.0) / ratio
    return result


@compiled
def _logarithms(x, stretches, groups, group):
    """Of the parameters of a group over their medians: sums of squared logarithms and of logarithms, number, signs."""
    squares, logs, size = np.zeros(x.shape[1]), np.zeros(x.shape[1]), 0
    inside = np.ones(x.shape[1], dtype=np.bool_)
    for param in range(len(x)):
        if groups[param] == group:
            size += 1
            for k in range(x.shape[1]):
                ratio = 1.0 + stretches[param] * x[param, k]
                inside[k] &= ratio > 0.0
                u = np.log(ratio)
                squares[k] += u * u
                logs[k] += u
    return squares, logs, size, inside


@compiled
def _outside(x, prior):
    """Whether each coordinate x (n_params, n) is behind a wall; where a trajectory came to no numbers none is."""
    walls = prior[0]
    result = np.empty(x.shape, dtype=np.bool_)
    for param in range(len(x)):
        for k in range(x.shape[1]):
            result[param, k] = abs(x[param, k]) > walls[param]
    return result
