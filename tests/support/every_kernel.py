"""What a study calls of compiled loops, in a process of its own: how many it compiled, for how many lists of types, and
a digest of all its numbers.
"""

import hashlib
import json
import os
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba.core.dispatcher import Dispatcher

import bayesub as bs
from bayesub.findings.vehicle_examinations import growth
from bayesub.kernels.jit import _Kept
from bayesub.model.linear_form import linear_systems
from bayesub.problem.likelihoods import AR1, Normal, Rounded, StudentT, UnknownSd
from bayesub.sensors import DVL, INS, Track, modified
from thesis.measured_motion import measure


class Report(NamedTuple):
    """How many lists of types were compiled, names of what has several, and the digest of the numbers."""

    compiled: int
    several: list[str]
    digest: str


def environment(cache: Path) -> dict[str, str]:
    """Of a process with a cache folder of its own."""
    studies = Path(__file__).parents[2] / "studies"
    path = os.pathsep.join(filter(None, (str(studies), os.environ.get("PYTHONPATH"))))
    return os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": path}


def read(output: str) -> Report:
    """The report that a process printed."""
    return Report(*json.loads(output.splitlines()[-1]))


def _variants(function) -> tuple:
    found = getattr(function, "variants", ())
    return found if isinstance(found, tuple) else ()


def report(digest: str) -> Report:
    """Of all compiled loops of this process."""
    modules = [module for name, module in sys.modules.items() if name.startswith(("bayesub.kernels", "bayesub.model"))]
    functions = [value for module in modules for value in vars(module).values()]
    functions += [variant for function in functions for variant in _variants(function)]
    # What is part of others is compiled with them, and has a list of types for each.
    loops = {f for f in functions if isinstance(f, Dispatcher) and type(f._cache) is _Kept}
    return Report(
        sum(sum(loop.stats.cache_misses.values()) for loop in loops),
        sorted(loop.__name__ for loop in loops if len(loop.signatures) > 1),
        digest,
    )


def study() -> list[np.ndarray]:
    """Numbers of simulation, readings, likelihoods, derivatives and linear form of short trials."""
    boat, found = bs.load_vehicle("suboff"), []
    for name in ("horizontal", "vertical"):  # the vertical one is flown in closed loop
        flown = bs.load_manoeuvre(name, boat)
        track = bs.simulate(boat, flown, dt=1.0, sample=1.0)
        flights = [
            track,
            bs.simulate(boat, flown, dt=1.0, sample=1.0, attitude="quaternion"),
            bs.simulate(boat, flown, dt=1.0, sample=1.0, subproblem=None),
        ]
        found += [flight.states for flight in flights]
        found += [system.load for system in linear_systems(track).values()]
    linear_systems(measure(track, velocity_resolution=0.01))
    growth(boat)
    sensors = [
        modified(Track(0.5, 0.1, 20.0), lever_arm_m=(3.0, 0.0, 1.0)),
        DVL(sd_mps=0.01, resolution_mps=0.01, interval_s=20.0),
        INS(sd_degps=0.01, resolution_mps2=0.001, channels=("p", "q", "r", "udot"), interval_s=20.0),
    ]
    record = bs.observe(track, sensors, np.random.default_rng(1), current_mps=(0.1, 0.2))
    noise = {"x": StudentT(0.5, 4.0), "y": AR1(0.5, 6.0), "z": UnknownSd(0.5), "roll": Normal(0.1)}
    noise["pitch"] = Rounded(1e-3, 1e-2)
    unknown = ("sd_x_m", "dof_x", "sd_y_m", "correlation_time_y_s", "sd_roll_deg", "sd_pitch_deg")
    nuisance = {name: bs.priors.log_normal(1.0, 0.1) for name in unknown}
    nuisance |= {"bias_z_m": bs.priors.normal(0.0, 1.0), "u0_mps": bs.priors.normal(7.5, 0.1)}
    nuisance |= {"current_north_mps": bs.priors.normal(0.1, 0.1), "mass_kg": bs.priors.normal(boat.body[0], 1e3)}
    for given in ({}, {"nuisance": nuisance, "noise": noise}):
        problem = bs.Problem(
            boat, flown, record, free=("Xuu", "Zuw"), prior=bs.priors.relative_normal(0.25), dt=1.0, **given
        )
        for n_batch in (1, 40):
            parameters = np.repeat(problem.prior.mean[None], n_batch, axis=0)
            for view in (problem, problem.naive(), problem.smoothed(0.3)):
                some = parameters[:, : view.n_params]
                view.misfit(some)
                found += [view.log_prob(some), view.jacobian(some[0])]
            problem.quantile_residuals(parameters, np.random.default_rng(2))
            problem.replicated(parameters, np.random.default_rng(2))

    return found


if __name__ == "__main__":
    numbers = study()
    print(json.dumps(report(hashlib.sha256(b"".join(np.asarray(part).tobytes() for part in numbers)).hexdigest())))
