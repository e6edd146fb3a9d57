"""Total least squares on the equations of motion, axis by axis: errors in the matrix count too."""

import time
from collections.abc import Iterable, Mapping

import numpy as np
from scipy import linalg

from bayesub.inference.baselines import Estimate
from bayesub.inference.baselines.linear_least_squares import estimate, scaled
from bayesub.inference.interface import LinearForm


def total_least_squares(
    systems: Mapping[str, LinearForm],
    guess: dict[str, float],
    *,
    held: Iterable[str] = (),
    errors: dict[str, np.ndarray] | None = None,
) -> Estimate:
    """Solve ``(matrix + E) @ xi = load + e`` of each axis for the smallest errors E and e.

    Least squares assumes that the matrix is exact; measured velocities and accelerations are not. Columns known exactly
    are removed by a QR factorisation and the solution is the last right singular vector of what is left (mixed LS-TLS;
    van Huffel & Vandewalle 1991, section 3.5).

    Parameters
    ----------
    systems, guess, held : as in :func:`bayesub.inference.baselines.linear_least_squares`
    errors : axis -> (n_columns + 1,) standard deviations of the errors of the columns, in the order of the system,
        and of the load; zero for an exact column, positive for the load. By default
        in proportion to the length of each.

    Returns
    -------
    Estimate whose cost is the last singular value relative to the one before, largest over the axes: the solution is
    not unique as it approaches one. It has no covariance.
    """
    began = time.perf_counter()
    forms, values, ratios = scaled(systems, guess, held), [], []
    for form in forms:
        # Not the offset from the guess: an error of the matrix would enter the load that the guess leaves as well.
        load = form.load + form.matrix @ (form.centre * form.lengths)
        sizes = np.append(np.ones(len(form.names)), np.linalg.norm(load))
        if errors is not None:
            place = [systems[form.axis].names.index(name) for name in form.names]
            sizes = np.asarray(errors[form.axis], dtype=float)[[*place, -1]] * np.append(form.lengths**-1.0, 1.0)
        solution, ratio = _mixed_total_least_squares(form.matrix, load, sizes)
        values.append(solution / form.lengths)
        ratios.append(ratio)
    return estimate("total least squares", forms, values, ratios, "unique", None, began)


def _mixed_total_least_squares(matrix, load, sizes):
    """Solution (n_columns,) and the ratio of the last two singular values, for errors of relative `sizes`."""
    exact = sizes[:-1] == 0.0
    order = np.concatenate([np.flatnonzero(exact), np.flatnonzero(~exact)])
    n_exact = int(exact.sum())
    triangle = np.asarray(np.linalg.qr(np.column_stack([matrix[:, order], load]), mode="r"))
    scales = sizes[[*order[n_exact:], len(order)]]
    _, s, vt = np.linalg.svd(triangle[n_exact:, n_exact:] / scales)
    direction = vt[-1] / scales
    noisy = -direction[:-1] / direction[-1]
    right = triangle[:n_exact, -1] - triangle[:n_exact, n_exact:-1] @ noisy
    solution = np.empty(len(order))
    solution[order] = np.concatenate([linalg.solve_triangular(triangle[:n_exact, :n_exact], right), noisy])
    return solution, s[-1] / s[-2] if len(s) > 1 else 0.0
