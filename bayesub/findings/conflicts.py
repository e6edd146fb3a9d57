"""Prior and data: where they disagree, how far off the prior is, and what of a posterior depends on the prior."""

from collections.abc import Sequence

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.inference.checks.conflict import SENSITIVE, find_conflict, sensitivity, sensitivity_noise
from bayesub.inference.sampling import Posterior
from bayesub.io import templates
from bayesub.problem.distributions import Joint, Prior
from bayesub.problem.shared_scale import SharedScale

DRAWS, FLOWN_DRAWS = 10_000, 2000  # at most; where the log likelihood needs simulations, of forces at knots
PRIOR, LIKELIHOOD, BOTH = "prior", "likelihood", "both"
HALF = 2.0**2 - 1.0  # precision that a prior half as wide adds, in units of its own
FAR, NARROW = 0.5, 2.0 / 3.0  # changes of a mean, in sds, and of a width by such a prior from which they are quoted
QUOTED = 5  # parameters that are named
_EDGES = (0.05, 0.95)  # of the intervals that are quoted


def numbers(problem: AnyProblem, posterior: Posterior) -> dict:
    """What is found, as JSON types.

    `posterior`: of the parameters that are not white coordinates of histories.

    Returns "named", a row for each parameter about which they disagree; the "probability" of directions that are
    further off, of "n_directions"; and "scales", a row for each unknown scale of the prior.
    """
    prior, names = problem.prior_of_others, posterior.names
    conflict = find_conflict(prior, posterior.draws, names)
    edges = np.sort([posterior.known_before(prior).quantiles(p) for p in _EDGES], axis=0)
    after = posterior.quantiles(_EDGES)
    named = [
        {"name": name, "sds": abs(sds), "prior": edges[:, k].tolist(), "posterior": after[:, k].tolist()}
        for k, (name, sds) in zip(map(names.index, conflict.named), conflict.named.items(), strict=True)
    ]
    return {
        "found": conflict.disagree,
        **{key: getattr(conflict, key) for key in ("refuted", "p_value", "probability", "n_directions")},
        "named": named,
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
        ends = [float(prior.scales.min()), float(prior.scales.max())]
        yield {"names": list(names), "prior": ends, "median": middle, "interval": [low, high]}


def sentences(numbers: dict) -> dict[str, str]:
    """A sentence on the conflict, only where there is one, and one on the scale of the prior if it is unknown."""
    found = numbers["conflict"]
    result = {}
    if found["found"]:
        result["conflict"] = " ".join(templates.fill("bayesub.findings", "conflict.txt", found=found).split())
    if found["scales"]:
        texts = []
        for row in found["scales"]:
            low, high, first, last = (100.0 * edge for edge in (*row["interval"], *row["prior"]))
            of_which = f" of {', '.join(row['names'])}" if len(found["scales"]) > 1 else ""
            texts.append(
                f"The centres of the prior{of_which} are off by {100.0 * row['median']:.0f} % (standard deviation of "
                f"the logarithm; 90 % interval {low:.0f} to {high:.0f} %, possible were {first:.0f} to {last:.0f} %)."
            )
        result["guess"] = " ".join(texts)
    return result


def power_scaling(problem: AnyProblem, posterior: Posterior, n_effective: np.ndarray) -> dict[str, np.ndarray]:
    """Sensitivities to prior and likelihood, and on which of them each parameter depends, forces at knots left out.

    The prior is scaled where it is standard normal, so that a uniform one is bent and has a sensitivity too. Of forces
    with unknown histories it is that of the process: the forces at the knots are no conclusions.

    `posterior`: of all its parameters; `n_effective` (n_others,): of each parameter that is no force at a knot.

    Returns "prior_sensitivity" and "likelihood_sensitivity", (n_others,) numbers, "hangs_on", (n_others,) words (prior,
    likelihood, both, or none), and "half_prior_shift" and "half_prior_width" of :func:`half_prior`.
    """
    n = len(posterior.draws)
    some = np.arange(0, n, max(1, n // (FLOWN_DRAWS if problem.histories else DRAWS)))
    draws = posterior.draws[some]
    others, prior = draws[:, problem.others], problem.prior_of_others
    standard = prior.standard(others)
    if problem.histories:
        log_likelihood = problem.log_likelihood(draws)
    else:
        log_likelihood = posterior.log_prob.ravel()[some] - prior.scaled_log_density(prior.scaled(others))
    parts = {PRIOR: -0.5 * np.sum(standard**2, axis=1), LIKELIHOOD: log_likelihood}
    values = {name: sensitivity(others, part) for name, part in parts.items()}
    n_effective = np.minimum(n_effective, len(some))
    limits = {name: np.maximum(SENSITIVE, 2.0 * sensitivity_noise(part, n_effective)) for name, part in parts.items()}
    by_prior, by_data = (values[name] > limits[name] for name in (PRIOR, LIKELIHOOD))
    words = np.select([by_prior & by_data, by_prior, by_data], [BOTH, PRIOR, LIKELIHOOD], "")
    shift, width = half_prior(prior, standard)
    result = {f"{name}_sensitivity": value for name, value in values.items()} | {"hangs_on": words}
    return result | {"half_prior_shift": shift, "half_prior_width": width}


def half_prior(prior: Prior, standard: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What priors half as wide about the same centres would change, the posterior taken as normal.

    A posterior with mean m and covariance C in the coordinates in which the prior is N(0, I) has the precision C^-1.
    With a prior of half the width that is C^-1 + 3 I, hence the covariance (I + 3 C)^-1 C and the mean
    (I + 3 C)^-1 m. C is not inverted: it may be all but singular. The prior is taken as linear about m.

    `standard`: draws (n, n_params) in those coordinates.

    The shift (n_params,) of each mean in posterior standard deviations, and the width (n_params,) over that of today.
    """
    covariance = np.atleast_2d(np.cov(standard.T))
    mean, n = standard.mean(axis=0), len(covariance)
    change = np.linalg.inv(np.eye(n) + HALF * covariance)
    slopes = prior.chain(np.eye(n), mean)  # of the parameters

    def sds(of_standard):
        return np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, of_standard, slopes), 0.0))

    sd = sds(covariance)
    sd[sd == 0.0] = 1.0  # of what never moves
    return slopes @ (change @ mean - mean) / sd, sds(change @ covariance) / sd


def sensitivity_sentence(rows: Sequence[dict]) -> str:
    """What priors half as wide would change, from the rows of the coefficients; empty if that is nothing worth it."""
    far = sorted((r for r in rows if abs(r["half_prior_shift"]) >= FAR), key=lambda r: -abs(r["half_prior_shift"]))
    narrow = sum(row["half_prior_width"] <= NARROW for row in rows)
    parts = [f"the 90 % intervals of {narrow} of {len(rows)} coefficients would be narrower by a third or more"]
    parts = parts if narrow else []
    if far:
        moved = ", ".join(f"{row['name']} by {abs(row['half_prior_shift']):.1f}" for row in far[:QUOTED])
        more = f", and {len(far) - QUOTED} more by {FAR:g} or more" if len(far) > QUOTED else ""
        parts.append(f"the means would move: {moved}{more} (in posterior standard deviations)")
    return f"With priors half as wide {', and '.join(parts)}." if parts else ""
