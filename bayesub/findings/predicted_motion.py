"""The motion of a boat as draws of its parameters predict it: bands of every state, and where it is."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.inference.checks.prediction import INTERVALS, LEAST_FLOWN, band
from bayesub.logs import log_files
from bayesub.logs.log_files import HEADERS, STATES

X, Y, Z = log_files.positions("x", "y", "z")
WIDEST = max(INTERVALS)
_LEAST_SD = 1e-9  # m; along which all draws are in one place


@dataclass(frozen=True)
class Region:
    """Ellipses, one at each time, each of which holds the same share of the draws.

    Attributes
    ----------
    centres : (n_times, 2) array
        m.
    roots : (n_times, 2, 2) array
        ``centre + root @ (cos t, sin t)`` is the ellipse, m. They are symmetric, so that t stays in its place from one
        ellipse to the next.
    """

    centres: np.ndarray
    roots: np.ndarray


@dataclass(frozen=True)
class PredictedMotion:
    """What draws say of a motion.

    Attributes
    ----------
    times : (n_times,) array
        s.
    median : (n_times, 12) array
        Of the states over the ground, SI units.
    bands : dict of float to (2, n_times, 12) array
        Probability -> ends of the central intervals.
    above, aside : dict of float to Region
        Probability -> of east and north, and of north and depth.
    distance : (n_times,) array
        From the mean place, within which nine of ten draws are, m.
    n_flown, n_failed : int
        Draws that complete the motion, of which all this is, and that do not.
    """

    times: np.ndarray
    median: np.ndarray
    bands: dict[float, np.ndarray]
    above: dict[float, Region]
    aside: dict[float, Region]
    distance: np.ndarray
    n_flown: int
    n_failed: int

    @property
    def is_flown(self) -> bool:
        """Whether most draws complete the motion, and enough of them for bands."""
        return self.n_flown >= max(LEAST_FLOWN, self.n_failed)

    @cached_property
    def half_widths(self) -> np.ndarray:
        """(n_times, 12) half of the widest bands, SI units."""
        return 0.5 * np.diff(self.bands[WIDEST], axis=0)[0]


def predicted_motion(times: np.ndarray, states: np.ndarray) -> PredictedMotion:
    """Summarise the states (n_draws, n_times, 12) of draws; a draw that fails is left out and counted."""
    flown = np.isfinite(states).all(axis=(1, 2))
    n_failed = int(np.count_nonzero(~flown))
    if flown.sum() < LEAST_FLOWN:
        empty = np.full((len(times), len(STATES)), np.nan)
        return PredictedMotion(times, empty, {}, {}, {}, empty[:, 0], int(flown.sum()), n_failed)
    states = states[flown]
    places = states[:, :, [X, Y, Z]]
    return PredictedMotion(
        times=times,
        median=np.median(states, axis=0),
        bands={probability: band(states, probability) for probability in INTERVALS},
        above={probability: region(states[:, :, [Y, X]], probability) for probability in INTERVALS},
        aside={probability: region(states[:, :, [X, Z]], probability) for probability in INTERVALS},
        distance=np.quantile(np.linalg.norm(places - places.mean(axis=0), axis=2), WIDEST, axis=0),
        n_flown=len(states),
        n_failed=n_failed,
    )


def region(places: np.ndarray, probability: float) -> Region:
    """The ellipses of the covariance of places (n_draws, n_times, 2), each so large that it holds a share of them."""
    centres = places.mean(axis=0)
    off = places - centres
    variances, directions = np.linalg.eigh(np.einsum("nti,ntj->tij", off, off) / (len(places) - 1.0))
    sds = np.sqrt(np.maximum(variances, _LEAST_SD**2))
    sizes = np.linalg.norm(np.einsum("nti,tij->ntj", off, directions) / sds, axis=2)
    radii = np.quantile(sizes, probability, axis=0)
    return Region(centres, np.einsum("tij,tj,tkj->tik", directions, sds * radii[:, None], directions))


def table(motions: Mapping[str, PredictedMotion], states: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Column -> (n_times,) of medians and bands of states, by whom, in the units of files, for a CSV.

    The columns are named as ``x_m_posterior_q5``; the first is ``time_s``.
    """
    first = next(iter(motions.values()))
    columns = {"time_s": first.times}
    for name in states:
        k, factor = STATES.index(name), 1.0 / log_files.si_factor(name)
        for by, motion in motions.items():
            stem = f"{HEADERS[name]}_{by.replace(' ', '_')}"
            columns[f"{stem}_median"] = factor * motion.median[:, k]
            columns |= {f"{stem}_{q}": factor * end[:, k] for q, end in quantiles(motion.bands).items()}
    return columns


def quantiles(bands: Mapping[float, np.ndarray]) -> dict[str, np.ndarray]:
    """``q5`` and so on -> ends of bands (2, ..), ascending."""
    percents = {50.0 * (1.0 + sign * p): ends[k] for p, ends in bands.items() for k, sign in enumerate((-1.0, 1.0))}
    return {f"q{percent:g}": percents[percent] for percent in sorted(percents)}


def numbers(motions: Mapping[str, PredictedMotion], states: tuple[str, ...], of: str, spread: tuple[str, ...]) -> dict:
    """What there is to say of the motion predicted by `of`, beside the others, as JSON types, in the units of files.

    Of each state: the median at the end, and the largest distance of the median to that of `of`; by those of `spread`
    also half of the 90 % band, at the end and at its widest, and the same of :attr:`PredictedMotion.distance`.
    """
    main = motions[of]
    result = {
        "last_s": float(main.times[-1]),
        "draws": {by: motion.n_flown for by, motion in motions.items()},
        "failed_draws": {by: motion.n_failed for by, motion in motions.items()},
        "is_flown": main.is_flown,
        "distance_m": {},
        "states": {},
    }
    if not main.is_flown:
        return result
    flown = {by: motion for by, motion in motions.items() if motion.is_flown}
    wide = {by: motion for by, motion in flown.items() if by in spread}
    result["distance_m"] = {
        by: {"at_end": float(m.distance[-1]), "largest": float(m.distance.max())} for by, m in wide.items()
    }
    for name in states:
        k, factor = STATES.index(name), 1.0 / log_files.si_factor(name)
        result["states"][HEADERS[name]] = by_whom = {}
        for by, motion in flown.items():
            off = np.abs(motion.median - main.median)[:, k].max()
            by_whom[by] = {"median_at_end": factor * float(motion.median[-1, k]), "off": factor * float(off)}
        for by, motion in wide.items():
            half = factor * motion.half_widths[:, k]
            by_whom[by] |= {"half_width_at_end": float(half[-1]), "half_width": float(half.max())}
    return result
