"""Where prior and data disagree, by name, and how far off the guesses are."""

import numpy as np

from bayesub.inference.checks.conflict import find_conflict
from bayesub.problem.distributions import Joint
from bayesub.problem.shared_scale import SharedScale

_EDGES = (0.05, 0.95)  # of the intervals that are quoted


def numbers(problem, posterior) -> dict:
    """What is found, as JSON types.

    Parameters
    ----------
    problem : Problem or JointProblem
    posterior : Posterior
        Of the parameters that are not white coordinates of histories.

    Returns
    -------
    dict
        "named", a row for each parameter about which they disagree; the "probability" of directions that are further
        off, of "n_directions"; and "scales", a row for each unknown scale of the prior.
    """
    prior, names = problem.prior_of_others, posterior.names
    conflict = find_conflict(prior, posterior.draws, names)
    edges = np.sort([prior.quantiles(p) for p in _EDGES], axis=0)
    places = [names.index(name) for name in conflict.named]
    return {
        "found": conflict.disagree,
        "named": [
            {
                "name": names[k],
                "sds": abs(conflict.named[names[k]]),
                "prior": edges[:, k].tolist(),
                "posterior": posterior.quantiles(_EDGES)[:, k].tolist(),
            }
            for k in places
        ],
        "probability": conflict.probability,
        "n_directions": conflict.n_directions,
        "scales": list(_scales(prior, names, posterior.draws)),
    }


def _scales(prior, names, draws):
    """What the draws (n, n_params) say of each unknown scale of a prior, and what it was before."""
    if isinstance(prior, Joint):
        for part, place in zip(prior.parts, prior.positions, strict=True):
            yield from _scales(part, [names[k] for k in place], draws[:, place])
    elif isinstance(prior, SharedScale) and len(prior.scales) > 1:
        below = np.cumsum(prior.scales_of(draws))
        low, middle, high = (float(prior.scales[np.searchsorted(below, p)]) for p in (_EDGES[0], 0.5, _EDGES[1]))
        yield {
            "names": list(names),
            "prior": [float(prior.scales.min()), float(prior.scales.max())],
            "median": middle,
            "interval": [low, high],
        }


def sentences(numbers: dict) -> dict[str, str]:
    """A sentence on the conflict, only where there is one, and one on the scale of the guesses if it is unknown."""
    found = numbers["conflict"]
    result = {"conflict": f"{_named(found)}{_REMEDY}"} if found["found"] else {}
    if found["scales"]:
        result["guess"] = " ".join(_scale(row, len(found["scales"]) > 1) for row in found["scales"])
    return result


_REMEDY = (
    " A right prior is called so in one study of a hundred: look for a wrong sign or unit, give the coefficient a prior"
    ' of its own in [prior.given], or all a scale that the data inform (kind = "relative_hierarchical").'
)


def _named(found) -> str:
    if not found["named"]:
        return (
            f"Prior and data disagree on no coefficient by itself, but on all together: {found['n_directions']} "
            f"directions that the data know are as far from the prior with a probability of {found['probability']:.1g}."
        )
    rows = [
        f"{row['name']} ({' to '.join(f'{edge:.3g}' for edge in row['posterior'])} where the prior said "
        f"{' to '.join(f'{edge:.3g}' for edge in row['prior'])}; {row['sds']:.1f} standard deviations off)"
        for row in found["named"]
    ]
    return f"Prior and data disagree on {', '.join(rows)}, 90 % intervals."


def _scale(row, many) -> str:
    low, high = (100.0 * edge for edge in row["interval"])
    first, last = (100.0 * edge for edge in row["prior"])
    of_which = f" of {', '.join(row['names'])}" if many else ""
    return (
        f"The guesses{of_which} are off by {100.0 * row['median']:.0f} % (sd of the logarithm, 90 % interval {low:.0f} "
        f"to {high:.0f} %), where the prior said {first:.0f} to {last:.0f} %."
    )
