"""Forces with unknown histories, integrated out of the linear model of a problem about a place.

With A and B the derivatives of the residuals r by the other parameters and by the white coordinates w of the forces,
which are standard normal, the residuals ``L^-1 (r - B w)`` and the Jacobian ``L^-1 A`` with ``L L' = B B' + 1`` hold all
that the readings say about the other parameters. A Kalman filter finds them (:mod:`bayesub.kernels.kalman`).
"""

import numpy as np

from bayesub.inference.interface import Forced, LeastSquares
from bayesub.kernels.kalman import respond, smooth


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

    def out(self, columns: np.ndarray, white: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Columns (n_rows, k) without the forces, and the white coordinates (k, n_white) that fit each best.

        These are residuals at white coordinates (n_white,), or derivatives by something. Then the latter are those of
        the white coordinates, as these follow.
        """
        columns, n = np.array(columns), columns.shape[1]
        found = np.zeros((n, len(self.white)))
        for history, pieces, innovations in self.parts:
            own, n_knots = np.searchsorted(self.white, history.columns), innovations.roots.shape[1:]
            about = np.zeros((n, *n_knots)) if white is None else np.tile(white[own].reshape(n_knots), (n, 1, 1))
            residuals = np.ascontiguousarray(columns[history.rows].T)
            smoothed = smooth(pieces, np.ones((n, 1)), innovations.repeated(n), residuals, about)
            columns[history.rows], found[:, own] = smoothed.errors.T, smoothed.white.reshape(n, -1)
        return columns, found

    def respond(self, residuals: np.ndarray, changes: np.ndarray) -> None:
        """Add to residuals (n, n_rows) what changes (n, n_white) of the white coordinates change, in place."""
        for history, pieces, innovations in self.parts:
            own, n = np.searchsorted(self.white, history.columns), len(changes)
            white = changes[:, own].reshape(n, *innovations.roots.shape[1:])
            residuals[:, history.rows] += respond(pieces, innovations.repeated(n).forces(white))


def marginal_jacobian(problem: LeastSquares, parameters: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """(n_rows, n_others) derivatives of the residuals, forces with unknown histories integrated out."""
    if not getattr(problem, "histories", ()):
        jacobian = problem.jacobian(parameters)
    else:
        jacobian = Integrated(problem, parameters, rows).out(problem.jacobian_of_others(parameters))[0]
    return jacobian if rows is None else jacobian[rows]
