"""A problem with histories of forces, marginalised: these are integrated out given all other parameters.

The residuals r of a problem are almost linear in its white coordinates w, hundreds of them with standard normal prior,
if the others, psi, are given: readings that follow the motion closely leave it no room to bend. With G the derivative
of r by w, w given psi is normal with precision G'G + 1 about the minimum w* of |r|^2 + |w|^2, and psi alone has density

    prior(psi) exp(-(|r*|^2 + |w*|^2 + rho^2) / 2),    rho^2 = log det(G'G + 1).

So the vector (r*, w*, rho) holds the residuals of a problem in psi alone, in which one searches and samples as ever.
The mode of psi and w together is not the mode of psi: it lacks rho, which changes by many log units with the masses.

One simulation at forces that follow psi gives the residuals there, and the information filter
(:mod:`bayesub.kernels.kalman`) rho and a policy: how the forces of each knot follow the state that is reached, so that
all w are best. A second simulation in which they do gives r* and w*; what is not linear in r, or not right in G, the
forces after it make good. Hundreds of simulations at draws of psi say what G is: of a long motion G changes with psi
beyond any polynomial, but that of each piece between two knots hardly changes, and is one of few terms.

The sampler moves in psi and in y, standard normal, of which the policy makes draws of w. These have the density

    prior(psi) exp(-(|r|^2 + |w|^2 + rho^2) / 2).

It is exact whatever G is, for w is a function of y and psi, knot by knot, whose derivative by y has the determinant
exp(-rho^2 / 2). If everything is as above y is standard normal.
"""

from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from scipy import linalg

from bayesub.inference.identifiability.linear_model import Integrated
from bayesub.inference.interface import Forced, LatentForces
from bayesub.inference.sampling.polynomial import n_features
from bayesub.kernels.kalman import Pieces, Policy, causes, policy

_STEP = 1e-3  # of differences, in standard deviations of the Laplace approximation
_DRAWS = 6  # for each feature, to which terms are fitted
_ACTIVE, _MOST_ACTIVE = 0.03, 10  # change of G, in what matters, along directions that have products; how many at most
_WORTH = 0.003  # change of G that is worth a term
_STORED = (*Pieces._fields, "mix", "forces")
_TOGETHER = 64  # draws at which G is found at once


class _Response:
    """How forces follow the other parameters in one trial, and the readings the forces.

    Its `pieces` are G between knots, of n_terms, which `mix` (n_features, n_terms) makes; `forces` (n_features, n_axes,
    n_knots) are near those that fit best.
    """

    def __init__(self, history: LatentForces, pieces: Pieces, mix: np.ndarray, forces: np.ndarray):
        self.history, self.rows, self.columns = history, history.rows, history.columns
        self.pieces, self.mix, self.forces = pieces, mix, forces

    def policy(
        self, features: np.ndarray, full: np.ndarray, residuals: np.ndarray, y: np.ndarray, states: np.ndarray
    ) -> tuple[Policy, np.ndarray]:
        """That of w, and log determinants, of members full (n, n_all) with the residuals (n, n_rows) and states there.

        Of y (n, n_white) are made draws, and the best of zero.
        """
        white = full[:, self.columns].reshape(len(full), *self.forces.shape[1:])
        given = self.history.innovations(full), residuals[:, self.rows], white, y.reshape(white.shape)
        return policy(self.pieces, features @ self.mix, *given, states)

    def weighed(self, pieces: Pieces, scales: np.ndarray) -> np.ndarray:
        """(n, k) all numbers of pieces of n terms, a unit of which matters as much as a standard deviation of noise.

        The scales (n_pieces, n_columns) are standard deviations of what acts in a piece.
        """
        n, n_states = len(pieces.ends), pieces.ends.shape[2]
        after = np.vstack([scales[1:, :n_states], np.ones((1, n_states))])
        numbers = np.zeros(pieces.rows.shape[1], dtype=int)
        numbers[pieces.order] = np.repeat(np.arange(len(scales)), np.diff(pieces.firsts))
        ends = pieces.ends * scales[:, None] / np.maximum(after, np.finfo(float).tiny)[:, :, None]
        return np.hstack([ends.reshape(n, -1), (pieces.rows * scales[numbers]).reshape(n, -1)])


class Marginalised:
    """The n_params other parameters of a problem with histories, as a problem for searches and samplers.

    It is what a surrogate is made of, :class:`bayesub.inference.interface.Emulated`. The `centre` (n_all,) is near the
    mode of all parameters. It is right near there, and after :meth:`fit` where its draws are; if it is `exact`, which
    costs several times as much, it finds G anew at each place. What it has learned is in its `arrays`.
    """

    def __init__(
        self, problem: Forced, centre: np.ndarray, arrays: dict[str, np.ndarray] | None = None, *, exact: bool = False
    ):
        self.problem, self.centre, self.exact = problem, np.asarray(centre, dtype=float), exact
        columns = np.concatenate([history.columns for history in problem.histories])
        self.white = np.sort(columns)
        self.others = np.setdiff1d(np.arange(problem.n_params), columns)
        self.names = tuple(problem.names[k] for k in self.others)
        self.prior, self.costs = problem.prior_of_others, problem.costs
        process = np.unique(np.concatenate([h.process for h in problem.histories]))
        self._moving = ~np.isin(self.others, process)
        self._x = self.prior.scaled(self.centre[self.others])
        self._places: list[tuple[np.ndarray, list[list[np.ndarray]]]] = []  # draws, and what was found there
        if arrays is None:
            self._expand()
            return
        self._axes, self._onto, self._active = (arrays[key] for key in ("axes", "onto", "active"))
        parts = [[arrays[f"response_{k}_{key}"] for key in _STORED] for k in range(len(problem.histories))]
        pairs = zip(problem.histories, parts, strict=True)
        self._responses = [_Response(history, Pieces(*own[:4]), *own[4:]) for history, own in pairs]

    def arrays(self) -> dict[str, np.ndarray]:
        """What it has learned, to be stored."""
        arrays = {"centre": self.centre, "axes": self._axes, "onto": self._onto, "active": self._active}
        for k, response in enumerate(self._responses):
            parts = *response.pieces, response.mix, response.forces
            arrays |= {f"response_{k}_{key}": part for key, part in zip(_STORED, parts, strict=True)}
        return arrays

    @property
    def n_params(self) -> int:
        """Number of other parameters."""
        return len(self.others)

    def _expand(self):
        """Take G at the centre, and how the forces follow psi from there."""
        linear = Integrated(self.problem, self.centre)
        by_others = self.problem.jacobian_of_others(self.centre, linear.responses)
        by_scaled = self.prior.scaled_chain(by_others, self._x)
        rows = linear.out(by_scaled)
        # The principal axes of the Laplace approximation of psi, a standard deviation long.
        covariance = np.linalg.inv(rows.T @ rows + np.eye(self.n_params))[np.ix_(self._moving, self._moving)]
        values, vectors = np.linalg.eigh(covariance)
        self._axes = vectors * np.sqrt(values)  # of x; column j is a standard deviation along the jth
        self._onto, self._active = vectors / np.sqrt(values), np.zeros((len(values), 0))
        following = (rows[len(by_others) :, self._moving] @ self._axes).T  # of white coordinates by these
        self._responses = []
        for history, pieces, innovations in linear.parts:
            own = np.searchsorted(self.white, history.columns)
            white = np.vstack([self.centre[history.columns], following[:, own]])
            forces = innovations.repeated(len(white)).forces(white.reshape(len(white), *innovations.roots.shape[1:]))
            self._responses.append(_Response(history, pieces, np.eye(len(white), 1), forces))

    def _features(self, others):
        """(n, n_features) of others (n, n_params): one, the principal coordinates, and products of active ones."""
        z = (self.prior.scaled(others) - self._x)[:, self._moving] @ self._onto
        active = z @ self._active
        first, second = np.triu_indices(active.shape[1])
        return np.hstack([np.ones((len(z), 1)), z, active[:, first] * active[:, second]])

    def fit(self, others: np.ndarray, rng: np.random.Generator) -> None:
        """Fit G and the forces to what they are at draws (n, n_params) of the others, and of the fit before."""
        full, *_ = self._solved(others)
        batches = [self._found(full[k : k + _TOGETHER], rng) for k in range(0, len(full), _TOGETHER)]
        new = [[np.concatenate(parts) for parts in zip(*each, strict=True)] for each in zip(*batches, strict=True)]
        known = np.all([np.isfinite(forces).all(axis=(1, 2)) for _, _, forces, _ in new], axis=0)
        if not known.any():  # what was known before is all there is
            return
        self._places = [*self._places[-1:], (others[known], [[part[known] for part in parts] for parts in new])]
        others = np.concatenate([places for places, _ in self._places])
        learned = []
        for k, response in enumerate(self._responses):
            each = zip(*(parts[k] for _, parts in self._places), strict=True)
            ends, rows, forces, acting = map(np.concatenate, each)
            pieces, scales = response.pieces._replace(ends=ends, rows=rows), np.sqrt(acting.mean(axis=0))
            learned.append((pieces, forces, scales))
        # Active directions: the principal ones of what G changes by along each coordinate.
        self._active = np.zeros((self._onto.shape[1], 0))
        linear, changes = self._features(others), np.zeros((len(self._active), len(self._active)))
        for response, (pieces, _, scales) in zip(self._responses, learned, strict=True):
            slopes = response.weighed(_of_terms(linear, pieces), scales)[1:]
            changes += slopes @ slopes.T
        squares, vectors = np.linalg.eigh(changes)
        wanted = [_DRAWS * n_features(len(linear[0]) - 1, n, (0, 0)) for n in range(1, _MOST_ACTIVE + 1)]
        n_active = int(np.count_nonzero(np.array(wanted) <= len(others)))
        n_active = min(n_active, int(np.count_nonzero(squares > _ACTIVE**2)))
        self._active = vectors[:, len(vectors) - n_active :]
        features = self._features(others)
        for response, (pieces, forces, scales) in zip(self._responses, learned, strict=True):
            terms = _of_terms(features, pieces)
            # Few sums of terms are all that matters: the principal components of what they make of the draws.
            weighed = response.weighed(terms, scales)
            squares, members = np.linalg.eigh(features @ (weighed @ weighed.T) @ features.T / len(features))
            members = members[:, squares > _WORTH**2]
            response.mix = _fitted(features, members)
            ends, rows = (np.tensordot(members.T @ features, term, axes=1) for term in terms[:2])
            response.pieces = pieces._replace(ends=ends, rows=rows)
            response.forces = _fitted(features, forces)

    def _responses_at(self, full) -> list[_Response]:
        """The response of each trial at each of a few members (n, n_all), which are the features."""
        responses = []
        for response in self._responses:
            with ThreadPoolExecutor(numba.get_num_threads()) as threads:
                each = list(threads.map(response.history.response, full))
            ends, rows = (np.concatenate([one[part] for one in each]) for part in (0, 1))
            pieces = response.pieces._replace(ends=ends, rows=rows)
            responses.append(_Response(response.history, pieces, np.eye(len(full)), response.forces))
        return responses

    def _found(self, full, rng) -> list[tuple[np.ndarray, ...]]:
        """Of a few members (n, n_all) the response of each trial, the forces that fit best, and what acts in pieces."""
        responses, white = self._responses_at(full), np.zeros((len(full), len(self.white)))
        best, *_ = self._steered(responses, np.eye(len(full)), full, white)
        drawn, *_ = self._steered(responses, np.eye(len(full)), full, rng.standard_normal(white.shape))
        found: list[tuple[np.ndarray, ...]] = []
        for response in responses:
            sequences, pieces = response.history.innovations(full), response.pieces
            forces, others = (
                sequences.forces(one[:, response.columns].reshape(len(full), *response.forces.shape[1:]))
                for one in (best, drawn)
            )
            squares = np.empty((len(full), pieces.ends.shape[1], pieces.ends.shape[3]))
            for k, change in enumerate(others - forces):
                one = pieces._replace(ends=pieces.ends[[k]], rows=pieces.rows[[k]])
                squares[k] = np.concatenate(list(causes(one, change[None]))) ** 2
            found.append((pieces.ends, pieces.rows, forces, squares))
        return found

    def _steered(self, responses, features, full, y):
        """Parameters (n, n_all) whose w are as y has them, near `full`; what is predicted; log determinants (n,)."""
        full, predicted, states = self.problem.flown(full)
        residuals, policies, log_determinants = self.problem.residuals(full, predicted), [], np.zeros(len(full))
        for response, seen in zip(responses, states, strict=True):
            own = y[:, np.searchsorted(self.white, response.columns)]
            law, more = response.policy(features, full, residuals, own, seen)
            policies.append(law)
            log_determinants += more
        full, predicted, _ = self.problem.flown(full, policies)
        return full, predicted, log_determinants

    def _solved(self, others, y=None):
        """All parameters (n, n_all) at w*, or at y from there, of others (n, n_params).

        And what is predicted there, (n, n_readings), and log determinants (n,).
        """
        features, n = self._features(others), len(others)
        y = np.zeros((n, len(self.white))) if y is None else y
        if self.exact and n > _TOGETHER:
            parts = (self._solved(others[k : k + _TOGETHER], y[k : k + _TOGETHER]) for k in range(0, n, _TOGETHER))
            return tuple(map(np.concatenate, zip(*parts, strict=True)))
        full = np.empty((n, self.problem.n_params))
        full[:, self.others] = others
        for response in self._responses:
            forces = np.tensordot(features, response.forces, axes=1)
            full[:, response.columns] = response.history.innovations(full).white(forces).reshape(n, -1)
        if self.exact:
            return self._steered(self._responses_at(full), np.eye(n), full, y)
        return self._steered(self._responses, features, full, y)

    def _rows(self, residuals, full, log_determinants) -> np.ndarray:
        return np.hstack([residuals, full[:, self.white], np.sqrt(log_determinants)[:, None]])

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch, n_rows + n_white + 1) of the others (n_batch, n_params): r*, w* and rho."""
        full, predicted, log_determinants = self._solved(np.atleast_2d(parameters))
        return self._rows(self.problem.residuals(full, predicted), full, log_determinants)

    def misfit_about(self, centre: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals with the noise as it is at `centre` (n_params,), and :meth:`log_likelihood`."""
        about = self.centre.copy()
        about[self.others] = centre
        full, predicted, log_determinants = self._solved(np.atleast_2d(parameters))
        rows, log_likelihood = self.problem.misfit_about(about, full, predicted)
        return self._rows(rows, full, log_determinants), self._density(log_likelihood, full, log_determinants)

    def misfit(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and deviances (n_batch,), infinite where a simulation failed."""
        full, predicted, log_determinants = self._solved(np.atleast_2d(parameters))
        rows, deviances = self.problem.misfit(full, predicted)
        log_density = self._density(-0.5 * deviances, full, log_determinants)
        return self._rows(rows, full, log_determinants), -2.0 * log_density

    def log_likelihood(self, parameters: np.ndarray) -> np.ndarray:
        """(n_batch,) log densities of the readings given the others (n_batch, n_params), but for a constant."""
        return self.density(self.problem, np.atleast_2d(parameters))[0]

    def _density(self, log_likelihood, full, log_determinants):
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
        return self._solved(np.asarray(parameters)[None])[0][0]

    def density(
        self, problem: Forced, parameters: np.ndarray, y: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Log density (n_batch,) of readings and histories in y (n_batch, n_white), given the others (n_batch, ..).

        And all parameters (n_batch, n_all) there. The readings are those of `problem`, which need not be smooth.
        """
        full, predicted, log_determinants = self._solved(parameters, y)
        return self._density(problem.log_likelihood(full, predicted), full, log_determinants), full

    @property
    def n_draws(self) -> int:
        """How many draws :meth:`fit` wants; the fit is to twice as many."""
        return -(-_DRAWS * n_features(self._onto.shape[1], _MOST_ACTIVE, (0, 0)) // 2)


def _of_terms(features, pieces):
    """Pieces of terms of features (n, n_terms), from those at n draws."""
    return pieces._replace(ends=_fitted(features, pieces.ends), rows=_fitted(features, pieces.rows))


def _fitted(features, values):
    """(n_terms, ..) of features (n, n_terms) and values (n, ..), by least squares."""
    orthonormal, triangle = np.linalg.qr(features)
    if len(features) < features.shape[1]:  # nearly all simulations failed
        triangle, orthonormal = np.eye(features.shape[1]), np.linalg.pinv(features).T
    rows = linalg.solve_triangular(triangle, orthonormal.T @ values.reshape(len(values), -1), check_finite=False)
    return rows.reshape(-1, *values.shape[1:])
