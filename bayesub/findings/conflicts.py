"""Prior and data: where they disagree, how far off the guesses are, and what of a posterior hangs on the prior."""

from collections.abc import Sequence

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.inference.checks.conflict import SENSITIVE, find_conflict, sensitivity, sensitivity_noise
from bayesub.inference.sampling import Posterior
from bayesub.problem.distributions import Joint
from bayesub.problem.shared_scale import SharedScale

DRAWS, FLOWN_DRAWS = 10_000, 2000  # at most; where the log likelihood needs simulations, of forces at knots
PRIOR, LIKELIHOOD, BOTH = "prior", "likelihood", "both"
_EDGES = (0.05, 0.95)  # of the intervals that are quoted


def numbers(problem: AnyProblem, posterior: Posterior) -> dict:
    """What is found, as JSON types.

    `posterior`: of the parameters that are not white coordinates of histories.

    Returns "named", a row for each parameter about which they disagree; the "probability" of directions that are
    further off, of "n_directions"; and "scales", a row for each unknown scale of the prior.
    """
    prior, names = problem.prior_of_others, posterior.names
    conflict = find_conflict(prior, posterior.draws, names)
    known = posterior.known_before(prior)
    edges = np.sort([known.quantiles(p) for p in _EDGES], axis=0)
    places = [names.index(name) for name in conflict.named]
    return {
        "found": conflict.disagree,
        "refuted": conflict.refuted,
        "p_value": conflict.p_value,
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
        texts = []
        for row in found["scales"]:
            low, high, first, last = (100.0 * edge for edge in (*row["interval"], *row["prior"]))
            of_which = f" of {', '.join(row['names'])}" if len(found["scales"]) > 1 else ""
            texts.append(
                f"The guesses{of_which} are off by {100.0 * row['median']:.0f} % (sd of the logarithm, 90 % interval "
                f"{low:.0f} to {high:.0f} %), where the prior said {first:.0f} to {last:.0f} %."
            )
        result["guess"] = " ".join(texts)
    return result


_REMEDY = (
    " A right prior is called so in one study of a hundred: look for a wrong sign or unit, the scale or"
    " clock of a sensor, the scale of a rudder or of the rpm; give the coefficient a prior"
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


def power_scaling(problem: AnyProblem, posterior: Posterior, n_effective: np.ndarray) -> dict[str, np.ndarray]:
    """Sensitivities to prior and likelihood, and what each parameter hangs on, forces at knots left out.

    The prior is scaled where it is standard normal, so that a uniform one is bent and has a sensitivity too. Of forces
    with unknown histories it is that of the process: the forces at the knots are no conclusions.

    `posterior`: of all its parameters; `n_effective` (n_others,): effective draws of each parameter that is no force at
    a knot.

    Returns "prior_sensitivity" and "likelihood_sensitivity", (n_others,) numbers, and "hangs_on", (n_others,) words:
    prior, likelihood, both, or none.
    """
    n = len(posterior.draws)
    some = np.arange(0, n, max(1, n // (FLOWN_DRAWS if problem.histories else DRAWS)))
    draws = posterior.draws[some]
    others, prior = draws[:, problem.others], problem.prior_of_others
    if problem.histories:
        log_likelihood = problem.log_likelihood(draws)
    else:
        log_likelihood = posterior.log_prob.ravel()[some] - prior.scaled_log_density(prior.scaled(others))
    parts = {PRIOR: -0.5 * np.sum(prior.standard(others) ** 2, axis=1), LIKELIHOOD: log_likelihood}
    values = {name: sensitivity(others, part) for name, part in parts.items()}
    n_effective = np.minimum(n_effective, len(some))
    limits = {name: np.maximum(SENSITIVE, 2.0 * sensitivity_noise(part, n_effective)) for name, part in parts.items()}
    large = {name: values[name] > limits[name] for name in parts}
    by_prior, by_data = large[PRIOR], large[LIKELIHOOD]
    words = np.select([by_prior & by_data, by_prior, by_data], [BOTH, PRIOR, LIKELIHOOD], "")
    return {f"{name}_sensitivity": value for name, value in values.items()} | {"hangs_on": words}


def sensitivity_sentence(rows: Sequence[dict]) -> str:
    """Which parameters hang on the prior, from their rows; empty if none does."""
    groups = {word: [row["name"] for row in rows if row["hangs_on"] == word] for word in (PRIOR, BOTH)}
    parts = []
    if groups[PRIOR]:
        parts.append(f"A prior of another width would give another answer for {', '.join(groups[PRIOR])}.")
    if groups[BOTH]:
        parts.append(
            f"Prior and data pull {', '.join(groups[BOTH])} to different sides: the answer is between them, and the "
            "centre of the prior matters."
        )
    return " ".join(parts)
