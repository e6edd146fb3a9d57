"""Whether a log likelihood jumps from place to place, which no sampler likes.

Cross-flow forces with sg(v) and sg(w) jump where a velocity changes its sign. The integrator sees the sign at the ends
and in the middle of its steps only, so that a change of parameters by which a sign comes a step later moves all later
readings at once. What the log likelihood jumps by is proportional to the step.
"""

import numpy as np

from bayesub.inference.interface import Emulated

NOTICEABLE = 1.0  # jump of a log likelihood by which walkers are held
_SEGMENTS, _POINTS = 128, 16
_SHARE = 1.0 / 8.0  # of the way from one draw to another, on which a log likelihood is a cubic but for jumps


def largest_jump(problem: Emulated, draws: np.ndarray, rng: np.random.Generator) -> float:
    """The largest difference of log likelihoods at neighbouring parameters that no cubic explains.

    Neighbours lie on short pieces of straight lines from one draw towards another, 2048 simulations in all.

    Parameters
    ----------
    problem : Emulated
    draws : (n, n_params) array
        From the posterior.
    rng : numpy.random.Generator
        Chooses among them.

    Returns
    -------
    float
        Zero where no piece has finite log likelihoods throughout.
    """
    starts, ends = draws[rng.choice(len(draws), (2, _SEGMENTS))]
    shares = np.linspace(0.0, _SHARE, _POINTS)
    places = starts[:, None] + shares[:, None] * (ends - starts)[:, None]
    values = problem.log_likelihood(places.reshape(-1, draws.shape[1])).reshape(_SEGMENTS, _POINTS)
    values = values[np.isfinite(values).all(axis=1)].T
    cubics = np.polynomial.polynomial.polyvander(shares / _SHARE, 3)
    rest = values - cubics @ np.linalg.lstsq(cubics, values, rcond=None)[0]
    return float(np.abs(np.diff(rest, axis=0)).max(initial=0.0))


def sentence(jump: float, step_s: float) -> str:
    """What a jump means for a run that has not converged, and what to try; empty for one that is not noticeable.

    Parameters
    ----------
    jump : float
        As :func:`largest_jump` finds it.
    step_s : float
        Of the integrator, s; the longest of all trials.
    """
    if jump < NOTICEABLE:
        return ""
    return (
        f"The log likelihood jumps by up to {jump:.3g} between neighbouring parameters, which holds walkers where they "
        f"are, as a force does that has the sign of a velocity and changes a time step earlier or later. Try "
        f"dt_s = {_round(step_s * NOTICEABLE / jump):g} in place of {step_s:g}."
    )


def _round(step: float) -> float:
    """The longest of .. 0.1, 0.2, 0.5, 1 .. that is not longer."""
    decade = 10.0 ** np.floor(np.log10(step))
    return float(max(m for m in (1.0, 2.0, 5.0) if m * decade <= step * (1.0 + 1e-9)) * decade)
