"""A problem with histories of forces, marginalised: these are integrated out given all other parameters.

The residuals r of a problem are almost linear in its white coordinates w, hundreds of them with standard normal prior,
if the others, psi, are given: readings that follow the motion closely leave it no room to bend. With G the derivative
of r by w, w given psi is normal with precision G'G + 1 = T T' about the minimum w* of |r|^2 + |w|^2, and psi by itself
has the density

    prior(psi) exp(-(|r*|^2 + |w*|^2 + rho^2) / 2),    rho^2 = log det T T' .

So the vector (r*, w*, rho) holds the residuals of a problem in psi alone, in which one searches and samples as ever.
The mode of psi and w together is not the mode of psi: it lacks rho, which changes by many log units with the masses.

From a centre w_c, at which the forces are those of the mode or follow psi in first order, one simulation gives r_c and
w* = w_c - (T T')^-1 (G'r_c + w_c). With white coordinates v of the process at the centre, G is a polynomial in the few
directions of psi along which it changes, and G'G one too; what the process becomes with psi is in the prior of v.

The sampler moves in psi and in y, where ``w = w* + T'^-1 y``, and a second simulation there gives its density

    prior(psi) exp(-(|r|^2 + |w|^2 + rho^2) / 2).

It is exact whatever G is, for y is a function of w and psi whose derivative is T'; if everything is as above y is
standard normal.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numba
import numpy as np
from scipy import linalg

from bayesub.inference.identifiability.fisher import integrated_out
from bayesub.inference.interface import Forced, LatentForces, Sampled

_BATCH = 8  # members whose G'G are in memory at once in a thread
_STEP = 1e-3  # of differences, in standard deviations of the Laplace approximation
_ACTIVE = 0.15  # change of G for a posterior standard deviation of psi, in those of w, that is worth a term

_solve_lower = partial(linalg.solve_triangular, lower=True)


class _Response:
    """G of one trial, expanded about the centre: in v, the white coordinates of the process there."""

    terms: np.ndarray  # (n_terms, n_rows, n_white) of G
    products: np.ndarray  # (n_products, n_white, n_white) of G'G
    squares: np.ndarray  # active directions with a term of second order

    def __init__(self, history: LatentForces, centre: np.ndarray):
        self.history, self.rows, self.columns = history, history.rows, history.columns
        (self.factors,) = history.factors(centre[None])
        self.n_axes, self.n_knots = self.factors.shape[:2]
        self.known = not len(history.process)

    def by_v(self, jacobian: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """(n_rows, n_white) derivatives by v, of a Jacobian by all parameters (n_all,)."""
        by_white = jacobian[self.rows][:, self.columns]
        if self.known:
            return by_white
        ratio, by_white = self._ratios(parameters[None])[0], by_white.reshape(-1, self.n_axes, self.n_knots)
        return np.hstack([_solve_lower(r, by_white[:, a].T, trans=1).T for a, r in enumerate(ratio)])

    def ratios(self, parameters: np.ndarray) -> np.ndarray | None:
        """(n, n_axes, n_knots, n_knots) R with v = R w, lower triangular, of all parameters (n, n_all).

        None if the process is known, so that v is w.
        """
        return None if self.known else self._ratios(parameters)

    def _ratios(self, parameters):
        members = self.history.factors(parameters)
        return np.stack([[_solve_lower(c, f) for c, f in zip(self.factors, m, strict=True)] for m in members])

    def expand(self, middle: np.ndarray, slopes: np.ndarray, curvatures: np.ndarray) -> None:
        """Take the terms of G at the centre, and of first and second order (n, n_rows, n_white) from there."""
        sizes = np.linalg.norm(_relative(middle, curvatures), axis=(1, 2)) if len(curvatures) else np.zeros(0)
        self.squares = np.flatnonzero(sizes > _ACTIVE)
        self.terms = np.concatenate([middle[None], slopes, curvatures[self.squares]])
        # G'G is the sum of all products of two terms, each pair once: twice its symmetric part, but for squares.
        pairs = zip(*np.triu_indices(len(self.terms)), strict=True)
        products = np.stack([(0.5 if i == j else 1.0) * (self.terms[i].T @ self.terms[j]) for i, j in pairs])
        self.products = products + products.swapaxes(1, 2)

    def features(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n, n_terms) of z (n, n_active), and (n, n_products) of them."""
        terms = np.hstack([np.ones((len(z), 1)), z, z[:, self.squares] ** 2])
        first, second = np.triu_indices(terms.shape[1])
        return terms, terms[:, first] * terms[:, second]


class Marginalised:
    """The n_params other parameters of a problem with histories, as a problem for searches and samplers.

    It is what a surrogate is made of, :class:`bayesub.inference.interface.Emulated`. The `centre` (n_all,) is near the
    mode of all parameters. If `curved`, G has terms of second order, which cost twice as many Jacobians.
    """

    def __init__(self, problem: Forced, centre: np.ndarray, *, curved: bool = True):
        self.problem, self.centre = problem, np.asarray(centre, dtype=float)
        columns = np.concatenate([history.columns for history in problem.histories])
        self.white = np.sort(columns)
        self.others = np.setdiff1d(np.arange(problem.n_params), columns)
        self.names = tuple(problem.names[k] for k in self.others)
        self.prior, self.costs = problem.prior_of_others, problem.costs
        process = np.unique(np.concatenate([h.process for h in problem.histories]))
        self._moving = ~np.isin(self.others, process)
        self._responses = [_Response(history, self.centre) for history in problem.histories]
        self._expand(curved)

    @property
    def n_params(self) -> int:
        """Number of other parameters."""
        return len(self.others)

    def _expand(self, curved):
        """Take the derivatives at the centre, and to both sides along the directions in which they change."""
        self._x = self.prior.scaled(self.centre[self.others])
        jacobian = self.problem.jacobian(self.centre)
        by_others = self.prior.scaled_chain(jacobian[:, self.others], self._x)
        middles = [response.by_v(jacobian, self.centre) for response in self._responses]
        # The Laplace approximation of psi, w integrated out, and how the centre w* of each history follows psi.
        precision = np.eye(self.n_params)
        self._following, self._v = [], []
        for response, by_v in zip(self._responses, middles, strict=True):
            rows = integrated_out(by_others[response.rows], by_v)
            precision += rows.T @ rows
            following = rows[len(by_v) :]  # of v* by x
            following[:, ~self._moving] = 0.0  # the forces do not follow their own process
            self._following.append(following)
            self._v.append(self.centre[response.columns])
        # Its principal axes, a standard deviation long, and what G changes by along each.
        covariance = np.linalg.inv(precision)[np.ix_(self._moving, self._moving)]
        values, vectors = np.linalg.eigh(covariance)
        self._axes = vectors * np.sqrt(values)  # of x; column j is a standard deviation along the jth
        onto = vectors / np.sqrt(values)
        slopes = [side - by_v for side, by_v in zip(self._sides(self._axes.T), middles, strict=True)]
        # Active directions: the eigenvectors of the mean square of these changes that are worth a term.
        changes = np.zeros((len(values), len(values)))
        for by_v, slope in zip(middles, slopes, strict=True):
            seen = _relative(by_v, slope).reshape(len(values), -1)
            changes += seen @ seen.T
        values, vectors = np.linalg.eigh(changes)
        active = vectors[:, values > _ACTIVE**2]
        self._onto = onto @ active
        # First and second differences of G along these.
        curvatures = [slope[:0] for slope in slopes]
        slopes = [np.tensordot(active.T, slope, axes=1) for slope in slopes]
        if curved and active.shape[1]:
            steps = (self._axes @ active).T
            sides = list(zip(self._sides(steps), self._sides(-steps), strict=True))
            slopes = [0.5 * (plus - minus) for plus, minus in sides]
            curvatures = [0.5 * (plus + minus) - by_v for by_v, (plus, minus) in zip(middles, sides, strict=True)]
        for response, *terms in zip(self._responses, middles, slopes, curvatures, strict=True):
            response.expand(*terms)

    def _sides(self, steps):
        """For each trial G (n_steps, n_rows, n_white) after steps (n_steps, n_moving) of x, or at the centre."""
        x = np.tile(self._x, (len(steps), 1))
        x[:, self._moving] += steps
        places, *_ = self._centred(self.prior.unscaled(x))
        sides: list[list[np.ndarray]] = [[] for _ in self._responses]
        for parameters in places:
            jacobian = self.problem.jacobian(parameters)
            if not np.isfinite(jacobian).all():
                jacobian = self.problem.jacobian(self.centre)
            for response, side in zip(self._responses, sides, strict=True):
                side.append(response.by_v(jacobian, parameters))
        return [np.reshape(side, (len(steps), response.rows.stop - response.rows.start, -1))
                for response, side in zip(self._responses, sides, strict=True)]  # fmt: skip

    def _centred(self, others):
        """All parameters (n, n_all) at the centres of the histories, of others (n, n_params); v and ratios by trial."""
        full = np.empty((len(others), self.problem.n_params))
        full[:, self.others] = others
        offset = self.prior.scaled(others) - self._x
        positions, ratios = [], []
        for response, following, at_centre in zip(self._responses, self._following, self._v, strict=True):
            v = at_centre + offset @ following.T
            positions.append(v)
            ratios.append(response.ratios(full))
            full[:, response.columns] = _white(ratios[-1], v)
        return full, positions, ratios

    def _solved(self, others, y=None):
        """Log determinants (n,) and all parameters (n, n_all) at w*, or at y from there."""
        full, positions, ratios = self._centred(others)
        residuals = self.problem.residuals(full)
        z = (self.prior.scaled(others) - self._x)[:, self._moving] @ self._onto
        log_determinants = np.zeros(len(others))
        for response, v, ratio in zip(self._responses, positions, ratios, strict=True):
            self._solve(response, v, ratio, residuals, z, y, full, log_determinants)
        return log_determinants, full

    def _solve(self, response, v, ratios, residuals, z, y, full, log_determinants):
        """What :meth:`_solved` does for the history of one trial, in place; v (n, n_white) are the centres.

        For each member: w* = w_c - (T T')^-1 (G'r_c + w_c) with T T' = G'G + 1, all in v.
        """
        terms, products = response.features(z)
        n_white = v.shape[1]
        white = np.searchsorted(self.white, response.columns)
        stacked = response.terms.reshape(-1, n_white)  # (n_terms n_rows, n_white)

        def solve(first):
            some = slice(first, first + _BATCH)
            rows, weights = residuals[some, response.rows], terms[some]
            # G'r_c and G'G of each member, as sums over the terms of G and over the products of two of them.
            forces = (weights[:, :, None] * rows[:, None, :]).reshape(len(rows), -1) @ stacked
            precisions = np.tensordot(products[some], response.products, axes=1)
            own = None if ratios is None else ratios[some]
            steps = np.zeros_like(forces)
            for k, precision in enumerate(precisions):
                if not (np.isfinite(forces[k]).all() and np.isfinite(precision).all()):
                    log_determinants[first + k] = np.nan
                    continue
                # Add the prior. That of w is standard normal, so that of v = R w is normal with covariance R R'.
                if own is None:
                    precision[np.diag_indices(n_white)] += 1.0
                    forces[k] += v[first + k]
                else:
                    inverses = [_solve_lower(r, np.eye(len(r))) for r in own[k]]
                    for a, inverse in enumerate(inverses):
                        block = slice(a * len(inverse), (a + 1) * len(inverse))
                        of_prior = inverse.T @ inverse
                        precision[block, block] += of_prior
                        forces[k, block] += of_prior @ v[first + k, block]
                        log_determinants[first + k] -= 2.0 * np.log(np.diag(inverse)).sum()
                # T by Cholesky; its diagonal gives rho^2, and two triangular solves the Newton step to the minimum.
                try:
                    factor = linalg.cholesky(precision, lower=True, overwrite_a=True, check_finite=False)
                except linalg.LinAlgError:  # so far out that G'G is round-off
                    log_determinants[first + k] = np.nan
                    continue
                steps[k] = -linalg.cho_solve((factor, True), forces[k], check_finite=False)
                log_determinants[first + k] += 2.0 * np.log(np.diag(factor)).sum()
                if y is not None:  # from the minimum on by T'^-1 y
                    steps[k] += _solve_lower(factor, y[first + k, white], trans=1, check_finite=False)
            full[some, response.columns] = _white(own, v[some] + steps)

        with ThreadPoolExecutor(numba.get_num_threads()) as threads:
            list(threads.map(solve, range(0, len(v), _BATCH)))

    def _rows(self, residuals, log_determinants, full) -> np.ndarray:
        return np.hstack([residuals, full[:, self.white], np.sqrt(log_determinants)[:, None]])

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows + n_white + 1) of the others (n_batch, n_params): r*, w* and rho."""
        solved = self._solved(np.atleast_2d(parameters))
        return self._rows(self.problem.residuals(solved[1]), *solved)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals with the noise as it is at `centre` (n_params,), and :meth:`log_likelihood`."""
        full_centre, *_ = self._centred(np.atleast_2d(centre))
        log_determinants, full = self._solved(np.atleast_2d(parameters))
        rows, log_likelihood = self.problem.misfit_about(full_centre, full)
        return self._rows(rows, log_determinants, full), self._log_density(log_likelihood, full, log_determinants)

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and deviances (n_batch,), infinite where a simulation failed."""
        log_determinants, full = self._solved(np.atleast_2d(parameters))
        rows, deviances = self.problem.misfit(full)
        white = full[:, self.white]
        deviances = deviances + np.einsum("ij,ij->i", white, white) + log_determinants
        return self._rows(rows, log_determinants, full), np.where(np.isfinite(deviances), deviances, np.inf)

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities of the readings given the others (n_batch, n_params), but for a constant."""
        log_determinants, full = self._solved(np.atleast_2d(parameters))
        return self._log_density(self.problem.log_likelihood(full), full, log_determinants)

    def _log_density(self, log_likelihood, full, log_determinants):
        white = full[:, self.white]
        log_density = log_likelihood - 0.5 * (np.einsum("ij,ij->i", white, white) + log_determinants)
        return np.where(np.isfinite(log_density), log_density, -np.inf)

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """(n_rows + n_white + 1, n_params) derivatives of the residuals, by differences of them."""
        x = self.prior.scaled(np.asarray(parameters, dtype=float))
        steps = _STEP * np.eye(self.n_params)
        steps[np.ix_(self._moving, self._moving)] = _STEP * self._axes.T
        sides = self.residuals(self.prior.unscaled(x + np.concatenate([steps, -steps])))
        by_steps = 0.5 * (sides[: self.n_params] - sides[self.n_params :])
        by_scaled = np.linalg.solve(steps, by_steps).T
        by_parameters = self.prior.scaled_chain(np.eye(self.n_params), x)
        return np.linalg.solve(by_parameters.T, by_scaled.T).T

    def full(self, parameters: np.ndarray) -> np.ndarray:
        """All parameters (n_all,) at the minimum w*, of the others (n_params,)."""
        return self._solved(np.asarray(parameters)[None])[1][0]

    def density(self, problem: Sampled, parameters: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log density (n_batch,) of readings and histories in y (n_batch, n_white), given the others (n_batch, ..).

        And all parameters (n_batch, n_all) there. The readings are those of `problem`, which need not be smooth.
        """
        log_determinants, full = self._solved(parameters, y)
        return self._log_density(problem.log_likelihood(full), full, log_determinants), full


def _white(ratios, v):
    """w (n, n_white) of v (n, n_white), with R (n, n_axes, n_knots, n_knots)."""
    if ratios is None:
        return v
    n, n_axes, n_knots, _ = ratios.shape
    members = zip(ratios, v.reshape(n, n_axes, n_knots), strict=True)
    white = [[_solve_lower(r, values) for r, values in zip(*member, strict=True)] for member in members]
    return np.reshape(white, (n, -1))


def _relative(by_v, changes):
    """(n, n_white, n_rows) changes (n, n_rows, n_white) of G in standard deviations of v, where G is by_v."""
    lower = np.linalg.cholesky(by_v.T @ by_v + np.eye(by_v.shape[1]))
    return np.stack([_solve_lower(lower, change.T) for change in changes])
