"""Control-plane dynamics: a rate-limited first-order lag (model manual, section 7; thesis section 8.2)."""

import numpy as np


def step_response(elapsed, start, demand, rate, time_constant):
    """Plane angle after a step of the demand.

    ``delta' = clip((demand - delta) / time_constant, -rate, rate)`` has a closed form: a slew at `rate` until
    ``rate * time_constant`` from the demand, then an exponential approach.

    Parameters
    ----------
    elapsed : (n,) array
        Times since the step, s.
    start : float
        Angle at the step, rad.
    demand : float
        Ordered angle, rad.
    rate : float
        Slew limit, rad/s.
    time_constant : float
        s.
    """
    error = abs(demand - start)
    direction = np.sign(demand - start)
    slew_time = max(0.0, error / rate - time_constant)
    slewing = np.minimum(elapsed, slew_time) * rate
    settling = np.maximum(elapsed - slew_time, 0.0) / time_constant
    return start + direction * (slewing - (error - slew_time * rate) * np.expm1(-settling))
