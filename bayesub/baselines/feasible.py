"""The posterior mode, also where some channels say no more than an interval."""

import numpy as np

from bayesub.baselines.estimate import Estimate
from bayesub.baselines.gauss_newton import gauss_newton
from bayesub.errors import InputError

SHARES = (0.1, 0.03, 0.01, 0.003, 0.001)  # sd of what smooths the ends of an interval, over its length


def posterior_mode(problem) -> Estimate:
    """The posterior mode by Gauss-Newton steps, with a finite log likelihood.

    Readings that are rounded and have no noise only say in which interval the prediction lies. The search then smooths
    the ends of the intervals, less and less until all predictions are inside.

    Raises InputError if none is found: then no parameters that the prior admits make every reading, and there is noise.
    """
    start = None
    for share in SHARES:
        found = gauss_newton(problem.smoothed(share), start)
        if np.isfinite(problem.log_likelihood(found.values)[0]):
            return found
        start = found.values
    parts = problem.log_likelihoods(start)
    channels = [name for name, part in parts.items() if not np.isfinite(part[0])]
    raise InputError(
        f"channel '{channels[0]}': no parameters that the prior admits are found with every prediction within the "
        f"rounding of its reading; give the sensor an sd, or widen the prior"
    )
