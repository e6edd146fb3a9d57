"""What data fix where they do not fix coefficients: short weighted sums, and quotients, known to one per cent.

Null and sloppy directions say what is not known; these sums say what is, and may be quoted. Of coefficients with the
posterior mean m and covariance C the sum with weights ``C^-1 m`` is known best, to a relative sd of ``1 / sqrt(m' C^-1
m)`` (Fisher 1936, of a discriminant: the largest mean over its sd). Of each axis, whose coefficients balance each other
in steady motion, all sums of up to four are tried, the shortest first. What is implied, or known before, is left out.
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
                too_wide = sd > KNOWN * abs(vector @ mean)  # rounded
                if too_wide or left < _IMPLIED * sd or sd > _LEARNED * np.sqrt(vector @ prior_covariance @ vector):
                    continue
                found.append(set(members))
                taken.append(vector)
                named = {names[k]: float(vector[k]) for k in members}
                formula = " ".join(_part(name, weight) for name, weight in named.items()).removeprefix("+ ")
                rows.append(_row(axis, formula, draws @ vector) | {"weights": named})
    return rows


def _implied(taken, vector, covariance):
    """The combination of the sums (n,) before that is nearest to a new one, by the prior."""
    if not taken:
        return np.zeros(len(vector))
    before = np.stack(taken)
    by_prior = before @ covariance
    return np.linalg.lstsq(by_prior @ before.T, by_prior @ vector, rcond=None)[0] @ before


def _row(axis, formula, values):
    q5, q95 = np.quantile(values, [0.05, 0.95])
    numbers = {"mean": values.mean(), "sd": values.std(ddof=1), "q5": q5, "q95": q95}
    numbers["relative_sd"] = abs(numbers["sd"] / numbers["mean"])
    return {"axis": axis, "formula": formula} | {key: float(value) for key, value in numbers.items()}


def _part(name, weight):
    factor = "" if abs(weight) == 1.0 else f"{abs(weight):g} "
    return f"{'-' if weight < 0.0 else '+'} {factor}{name}"


def known_quotients(
    names: Sequence[str], axes: Sequence[str], draws: np.ndarray, prior_draws: np.ndarray
) -> list[dict]:
    """The quotients of two numbers of an axis that are known to one per cent, where neither is; the best first.

    `names`, `axes`: of the n numbers, coefficients or masses less an added mass; `draws`, `prior_draws`: (n_draws, n).
    That a/b and b/c are known says so of a/c, which is left out. Rows as of :func:`known_sums`, with no weights.
    """
    found = []
    steady = np.all(draws > 0.0, axis=0) | np.all(draws < 0.0, axis=0)
    known = draws.std(axis=0) <= KNOWN * np.abs(draws.mean(axis=0))
    for above, below in combinations([k for k in range(len(names)) if steady[k] and not known[k]], 2):
        if axes[above] == axes[below]:
            values, before = (one[:, above] / one[:, below] for one in (draws, prior_draws))
            lower, upper = np.quantile(before, [0.16, 0.84])  # which a denominator near zero leaves finite
            if values.std() <= min(KNOWN * abs(values.mean()), _LEARNED * 0.5 * (upper - lower)):
                found.append((values.std() / abs(values.mean()), above, below, values))
    rows, group = [], list(range(len(names)))  # numbers of one group have known quotients
    for _, above, below, values in sorted(found, key=lambda one: one[0]):
        if group[above] != group[below]:
            group = [group[above] if one == group[below] else one for one in group]
            rows.append(_row(axes[above], f"{names[above]} / {names[below]}", values) | {"weights": {}})
    return rows


def sentence(rows: Sequence[dict]) -> str:
    """The best known sums and quotients in words; empty if there are none but single coefficients."""
    if not (several := [row for row in rows if len(row["weights"]) != 1]):
        return ""
    best = "; ".join(f"{row['formula']} to {100.0 * row['relative_sd']:.1g} %" for row in several[:3])
    what = f"{len(several)} weighted sums and quotients are known to {100 * KNOWN:g} % or better"
    return f"{what}, of coefficients that are not: {best}."
