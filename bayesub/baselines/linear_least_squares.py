"""Linear least squares on the equations of motion (thesis section 9.4), axis by axis, by singular values."""

import time

import numpy as np

from bayesub.baselines.estimate import Estimate


def linear_least_squares(systems, guess: dict[str, float], *, rcond: float = 1e-12) -> Estimate:
    """Solve ``matrix @ xi = load`` of each axis.

    Columns are scaled to unit length first. Where the matrix has a null space (singular values below `rcond` of the
    largest) the solution nearest to the guess is taken, in scaled coordinates: along those directions the data say
    nothing and the answer is the guess.

    Parameters
    ----------
    systems : from :func:`bayesub.problem.linear_systems`
    guess : coefficient name -> value

    Returns
    -------
    Estimate whose cost is the root mean square residual relative to that of the load, largest over the axes.
    """
    began = time.perf_counter()
    names, values, misfits, deficient = [], [], [], []
    for system in systems.values():
        centre = np.array([guess[name] for name in system.names])
        lengths = np.linalg.norm(system.matrix, axis=0)
        u, s, vt = np.linalg.svd(system.matrix / lengths, full_matrices=False)
        informed = s > rcond * s[0]
        coordinates = u.T @ (system.load - system.matrix @ centre)
        solution = centre + (vt[informed].T @ (coordinates[informed] / s[informed])) / lengths
        names += system.names
        values += solution.tolist()
        misfits.append(np.linalg.norm(system.matrix @ solution - system.load) / np.linalg.norm(system.load))
        if not informed.all():
            deficient.append(f"{system.axis} rank {informed.sum()}/{len(s)}")
    status = f"not unique: {', '.join(deficient)}; hold an added mass of the axis" if deficient else "unique"
    return Estimate(
        method="linear least squares",
        names=tuple(names),
        solutions=np.array([values]),
        costs=np.array([max(misfits)]),
        statuses=(status,),
        covariance=None,
        evaluations=0,
        seconds=time.perf_counter() - began,
    )
