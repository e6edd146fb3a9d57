"""What data fix where they do not fix coefficients: the shortest weighted sums that are known to one per cent.

Null and sloppy directions say what is not known; these sums say what is, and may be quoted. Of coefficients with the
posterior mean m and covariance C the sum with weights ``C^-1 m`` is known best, to a relative sd of ``1 / sqrt(m' C^-1
m)`` (Fisher 1936, of a discriminant: the largest mean over its sd). Of each axis, whose coefficients balance each other
in steady motion, all sums of up to four are tried, the shortest first. One that those before it imply, or that the
prior knew already, is left out.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

KNOWN = 0.01  # relative sd
MOST = 4  # coefficients of a sum
SUBSETS = 20_000  # of one size and axis, beyond which sums of that size are not tried
_IMPLIED = 3.0  # sds: what the sums before leave open of a new one is more
_DIGITS, _ROUNDED = (1, 2, 3, 4, 8), 1.2  # of weights; by how much rounding them may widen a sum
_LEARNED = 0.5  # posterior over prior sd, below which the data have said it


def known_sums(
    names: Sequence[str], axes: Sequence[str], draws: np.ndarray, prior_covariance: np.ndarray
) -> list[dict]:
    """The sums of coefficients that are known to one per cent, shortest and best first.

    `names`, `axes`: of the n coefficients; `draws`: (n_draws, n) of the posterior; `prior_covariance`: (n, n).

    Gives rows ``axis``, ``formula``, ``weights`` (coefficient -> weight, that of the largest part 1), ``mean``, ``sd``,
    ``q5``, ``q95`` and ``relative_sd``.
    """
    mean, covariance = draws.mean(axis=0), np.atleast_2d(np.cov(draws.T))
    rows: list[dict] = []
    taken: list[np.ndarray] = []
    for axis in dict.fromkeys(axes):
        own = [k for k, one in enumerate(axes) if one == axis and mean[k] != 0.0 and covariance[k, k] > 0.0]
        found: list[set[int]] = []
        for size in range(1, min(MOST, len(own)) + 1):
            subsets = np.array(list(combinations(own, size)))
            if len(subsets) > SUBSETS:
                break
            parts, means = covariance[subsets[:, :, None], subsets[:, None, :]], mean[subsets]
            weights = (np.linalg.pinv(parts, hermitian=True) @ means[..., None])[..., 0]
            relative = np.einsum("ij,ij->i", weights, means) ** -0.5
            for best in np.argsort(relative):
                members, vector = subsets[best], np.zeros(len(names))
                if not relative[best] <= KNOWN or any(one <= set(members) for one in found):
                    continue
                order = np.argsort(-np.abs(weights[best] * means[best]))
                members, scaled = members[order], weights[best][order] / weights[best][order[0]]
                for digits in _DIGITS:  # as few as keep what is known
                    vector[members] = [float(f"{weight:.{digits}g}") for weight in scaled]
                    sd = np.sqrt(vector @ covariance @ vector)
                    if sd < _ROUNDED * relative[best] * abs(vector @ mean):
                        break
                open_before = vector - _implied(taken, vector, prior_covariance)
                left = np.sqrt(open_before @ prior_covariance @ open_before)
                if left < _IMPLIED * sd or sd > _LEARNED * np.sqrt(vector @ prior_covariance @ vector):
                    continue
                found.append(set(members))
                taken.append(vector)
                rows.append(_row(axis, {names[k]: float(vector[k]) for k in members}, draws @ vector))
    return rows


def _implied(taken, vector, covariance):
    """The combination of the sums (n,) before that is nearest to a new one, by the prior."""
    if not taken:
        return np.zeros(len(vector))
    before = np.stack(taken)
    by_prior = before @ covariance
    return np.linalg.lstsq(by_prior @ before.T, by_prior @ vector, rcond=None)[0] @ before


def _row(axis, weights, values):
    q5, q95 = np.quantile(values, [0.05, 0.95])
    row = {"mean": values.mean(), "sd": values.std(ddof=1), "q5": q5, "q95": q95}
    numbers = {key: float(value) for key, value in row.items()}
    formula = " ".join(_part(name, weight) for name, weight in weights.items()).removeprefix("+ ")
    relative = abs(numbers["sd"] / numbers["mean"])
    return {"axis": axis, "formula": formula, "weights": weights} | numbers | {"relative_sd": relative}


def _part(name, weight):
    factor = "" if abs(weight) == 1.0 else f"{abs(weight):g} "
    return f"{'-' if weight < 0.0 else '+'} {factor}{name}"


def sentence(rows: Sequence[dict]) -> str:
    """The best known sums in words; empty if there are none but single coefficients."""
    several = [row for row in rows if len(row["weights"]) > 1]
    if not several:
        return ""
    best = "; ".join(f"{row['formula']} to {100.0 * row['relative_sd']:.1g} %" for row in several[:3])
    return (
        f"{len(several)} weighted sums are known to {100 * KNOWN:g} % or better, of coefficients that are not: {best}."
    )
