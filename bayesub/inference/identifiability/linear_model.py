"""Forces with unknown histories, integrated out of the linear model of a problem about a place.

With A and B the derivatives of the residuals r by the other parameters and by the white coordinates w of the forces,
standard normal, all that the readings say about the other parameters is in r and w of the forces that fit best, and in
how these follow the other parameters: the inner products of both are those of ``r - B w`` and ``A`` by the inverse of
``B B' + 1``. An information filter finds them (:mod:`bayesub.kernels.kalman`).
"""

from typing import cast

import numpy as np

from bayesub.inference.interface import Forced, LeastSquares, Searchable
from bayesub.kernels.kalman import Pieces, policy, respond


class Integrated:
    """The white coordinates of all histories of a problem, about parameters (n_params,).

    If `rows` (n_rows,) are given only those residuals are read.
    """

    def __init__(self, problem: Forced, parameters: np.ndarray, rows: np.ndarray | None = None):
        self.parts = []
        for history in problem.histories:
            pieces = history.response(parameters)
            if rows is not None:
                read = rows[history.rows][pieces.order]
                firsts = np.concatenate([[0], np.cumsum(read)])[pieces.firsts]
                pieces = pieces._replace(order=pieces.order[read], firsts=firsts)
            self.parts.append((history, pieces, history.innovations(parameters[None])))
        self.white = np.sort(np.concatenate([history.columns for history in problem.histories]))

    @property
    def responses(self) -> list[Pieces]:
        """Those of the histories."""
        return [pieces for _, pieces, _ in self.parts]

    def out(self, columns: np.ndarray, white: np.ndarray | None = None) -> np.ndarray:
        """Columns (n_rows, k) with the forces that fit each best, and below their white coordinates (n_white, k).

        The columns are residuals at white coordinates (n_white,) or (k, n_white), or derivatives by something. Then the
        white coordinates are derivatives too, as these follow.
        """
        n_rows, n = columns.shape
        columns = np.concatenate([columns, np.zeros((len(self.white), n))])
        for history, pieces, innovations in self.parts if n else ():
            own, shape = np.searchsorted(self.white, history.columns), (n, *innovations.roots.shape[1:])
            about = np.zeros((n, len(own))) if white is None else np.broadcast_to(white[..., own], (n, len(own)))
            residuals = np.ascontiguousarray(columns[history.rows].T)
            nothing = np.zeros(shape), np.zeros((n, pieces.ends.shape[1], 0))
            law, _ = policy(pieces, np.ones((1, 1)), innovations, residuals, about.reshape(shape), *nothing)
            changes = law.followed()
            columns[history.rows] += respond(pieces, innovations.repeated(n).forces(changes)).T
            columns[n_rows + own] = about.T + changes.reshape(n, -1).T
        return columns

    def respond(self, residuals: np.ndarray, changes: np.ndarray) -> None:
        """Add to residuals (n, n_rows) what changes (n, n_white) of the white coordinates change, in place."""
        for history, pieces, innovations in self.parts:
            own, n = np.searchsorted(self.white, history.columns), len(changes)
            white = changes[:, own].reshape(n, *innovations.roots.shape[1:])
            residuals[:, history.rows] += respond(pieces, innovations.repeated(n).forces(white))


class LinearModel:
    """The linear model of the residuals (n_rows,) about standard coordinates t (n_params,), forces integrated out.

    The prior is of the parameters that are no white coordinates of forces, `others` (n_others,), and the Jacobian
    (n_rows, n_others) by their t; rows of the white coordinates follow those of the residuals in both. By the `gain`
    the sum of squares falls if the white coordinates alone fit best.
    """

    def __init__(self, problem: Searchable, t: np.ndarray, residuals: np.ndarray):
        parameters = problem.prior.parameters(t)
        self._t, self._residuals, self.n_params, self.gain = t, residuals, len(t), 0.0
        self._integrated: Integrated | None = None
        if not getattr(problem, "histories", ()):
            self.prior, self.others = problem.prior, np.arange(len(t))
            self.residuals, self.jacobian = residuals, self.prior.chain(problem.jacobian(parameters), t)
            return
        forced = cast(Forced, problem)
        self._integrated, self.prior = Integrated(forced, parameters), forced.prior_of_others
        self._white = self._integrated.white
        self.others = np.delete(np.arange(len(t)), self._white)
        self._by_others = self.prior.chain(
            forced.jacobian_of_others(parameters, self._integrated.responses), t[self.others]
        )
        self.jacobian = self._integrated.out(self._by_others)
        self._following = self.jacobian[len(residuals) :].T
        self.residuals = self._integrated.out(residuals[:, None], t[self._white])[:, 0]
        before = residuals @ residuals + t[self._white] @ t[self._white]
        self.gain = max(0.0, before - self.residuals @ self.residuals)

    def after(self, steps: np.ndarray, bends: np.ndarray | float = 0.0) -> np.ndarray:
        """(n, n_params) t after steps (n, n_others), if the residuals bend by (n, n_rows) from what is linear."""
        ends = np.tile(self._t, (len(steps), 1))
        ends[:, self.others] += steps
        if self._integrated is not None:
            moved = self._residuals + steps @ self._by_others.T + bends
            ends[:, self._white] = self._integrated.out(moved.T, self._t[self._white])[moved.shape[1] :].T
        return ends

    def expected(self, steps: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """(n, n_rows) residuals that the linear model has after steps (n, n_others), at t (n, n_params)."""
        if self._integrated is None:
            return self._residuals + steps @ self.jacobian.T
        moved = self._residuals + steps @ self._by_others.T
        self._integrated.respond(moved, ends[:, self._white] - self._t[self._white])
        return moved

    def out(self, rows: np.ndarray) -> np.ndarray:
        """(n, ..) what rows (n, n_rows), such as derivatives by something, are without the forces, as the residuals."""
        return rows if self._integrated is None else self._integrated.out(rows.T).T

    def covariance_times(self, vectors: np.ndarray) -> np.ndarray:
        """(n, n_params) vectors (n, n_params) times the covariance of t: the inverse of ``J'J + 1`` of all t."""
        of_others = np.linalg.inv(self.jacobian.T @ self.jacobian + np.eye(len(self.others)))
        if self._integrated is None:
            return vectors @ of_others
        own, result = vectors[:, self._white], np.empty(vectors.shape)
        result[:, self.others] = (vectors[:, self.others] + own @ self._following.T) @ of_others
        n_rows = len(self._residuals)
        solved = self._integrated.out(np.zeros((n_rows, len(own))), -own)[n_rows:].T
        result[:, self._white] = solved + own + result[:, self.others] @ self._following
        return result


def marginal_jacobian(problem: LeastSquares, parameters: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Derivatives (.., n_others) of the residuals, of some rows (n_rows,) or all, by others, and of white coordinates.

    Forces with unknown histories are integrated out.
    """
    read = slice(None) if rows is None else rows
    if not getattr(problem, "histories", ()):
        return problem.jacobian(parameters)[read]
    forced = cast(Forced, problem)
    integrated = Integrated(forced, parameters, rows)
    by_others = forced.jacobian_of_others(parameters, integrated.responses)
    jacobian = integrated.out(by_others)
    return np.concatenate([jacobian[: len(by_others)][read], jacobian[len(by_others) :]])
