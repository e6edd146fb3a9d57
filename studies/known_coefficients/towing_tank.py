"""The horizontal spiral when a towing tank has measured nine coefficients (appendix G, case 3)."""

from functools import partial

import numpy as np

from bayesub.model.coefficients import HORIZONTAL, INDEX, NAMES
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import true_step
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.sensors import observe
from thesis.cases import TOWED, held

EXACT, HELD, UNCERTAIN = "known exactly", "held 1 % wrong", "known to 1 %"


def unknown() -> list[str]:
    """The coefficients to be identified: neither towed nor held nor zero."""
    xi = load_vehicle("suboff").xi
    known = {*TOWED, *held("horizontal")}
    return [name for name in HORIZONTAL if name not in known and xi[INDEX[name]] != 0.0]


def treatments(sensors, rng: np.random.Generator, *, error: float, prior_sd: float, dt: float) -> dict[str, Problem]:
    """The problems of one record under each treatment of the towed coefficients.

    Parameters
    ----------
    sensors : that track suboff
    rng : of the noise, of the values from the tank and of the guess of the others
    error : largest, relative, of the values from the tank
    prior_sd : of the other coefficients, relative to the truth
    dt : integration step of the model, s; the truth is flown at a tenth of it
    """
    boat = load_vehicle("suboff")
    manoeuvre = load_manoeuvre("horizontal", boat)
    record = observe(simulate(boat, manoeuvre, dt=true_step(dt, manoeuvre)), sensors, rng)
    # The sd is of the truth, not of the guess: then the truth is a draw from its prior.
    sds = {n: (boat.xi[INDEX[n]], prior_sd * abs(boat.xi[INDEX[n]])) for n in unknown()}
    others = {n: priors.normal(value + sd * rng.standard_normal(), sd) for n, (value, sd) in sds.items()}
    given = np.where(np.isin(NAMES, TOWED), boat.xi * rng.uniform(1 - error, 1 + error, len(NAMES)), boat.xi)
    towed = {n: priors.uniform(*sorted(given[INDEX[n]] / (1 + side * error) for side in (-1, 1))) for n in TOWED}
    pose = partial(Problem, boat, manoeuvre, record, dt=dt)
    spread = priors.relative_normal(prior_sd)
    return {
        EXACT: pose(free=unknown(), prior=priors.Given(spread, others)),
        HELD: pose(free=unknown(), prior=priors.Given(spread, others), xi=given),
        UNCERTAIN: pose(free=[*unknown(), *TOWED], prior=priors.Given(spread, others | towed)),
    }
