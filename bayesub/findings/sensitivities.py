"""What of a posterior hangs on the prior: sensitivities of every parameter, and a sentence that names them."""

from collections.abc import Sequence

import numpy as np

from bayesub.inference.checks.conflict import SENSITIVE, sensitivity, sensitivity_noise

DRAWS, FLOWN_DRAWS = 10_000, 2000  # at most; where the log likelihood needs simulations, of forces at knots
PRIOR, LIKELIHOOD, BOTH = "prior", "likelihood", "both"


def power_scaling(problem, posterior, n_effective: np.ndarray) -> dict[str, np.ndarray]:
    """Sensitivities to prior and likelihood, and what each parameter hangs on, forces at knots left out.

    The prior is scaled where it is standard normal, so that a uniform one is bent and has a sensitivity too. Of forces
    with unknown histories it is that of the process: the forces at the knots are no conclusions.

    Parameters
    ----------
    problem : Problem or JointProblem
        What was solved.
    posterior : Posterior
        Of all its parameters.
    n_effective : (n_others,) array
        Effective draws of each parameter that is no force at a knot.

    Returns
    -------
    dict
        "prior_sensitivity" and "likelihood_sensitivity", (n_others,) numbers, and "hangs_on", (n_others,) words: prior,
        likelihood, both, or none.
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


def sentence(rows: Sequence[dict]) -> str:
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
