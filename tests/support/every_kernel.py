"""What a study calls of the compiled kernels, to be run in a process of its own: prints what would be compiled there.

It calls all kernels as the process that compiles does, then goes through a study with every noise model, and prints
the kernels that got further signatures.
"""

import importlib
import pkgutil
import sys

import numba
import numpy as np

import bayesub as bs
from bayesub import kernels
from bayesub.kernels import families
from bayesub.kernels.jit import FAMILY
from bayesub.model.linear_form import linear_systems
from bayesub.problem.likelihoods import AR1, Normal, Rounded, StudentT, UnknownSd
from bayesub.report.flights import growth
from bayesub.sensors import DVL, INS, Track, modified
from bayesub.sensors.measured_motion import measure


def signatures() -> set[tuple[str, str, str]]:
    """Module, name and signature of each compiled function of the kernels, those of all families included."""
    for module in pkgutil.iter_modules(kernels.__path__):
        importlib.import_module(f"bayesub.kernels.{module.name}")
    names = [name for name in sys.modules if name.startswith(("bayesub.kernels.", FAMILY))]
    modules = [sys.modules[name] for name in names]
    functions = [value for module in modules for value in vars(module).values()]
    functions += [variant for function in functions for variant in getattr(function, "variants", ())]
    compiled = [function for function in functions if isinstance(function, numba.core.dispatcher.Dispatcher)]
    return {
        (function.__module__, function.__name__, str(signature))
        for function in compiled
        for signature in function.signatures
    }


def study() -> None:
    """Simulation, readings, likelihoods, derivatives and linear form of short trials."""
    boat = bs.load_vehicle("suboff")
    for name in ("horizontal", "vertical"):  # the vertical one is flown in closed loop
        flown = bs.load_manoeuvre(name, boat)
        track = bs.simulate(boat, flown, dt=1.0, sample=1.0)
        bs.simulate(boat, flown, dt=1.0, sample=1.0, attitude="quaternion")
        bs.simulate(boat, flown, dt=1.0, sample=1.0, subproblem=None)
        linear_systems(track)
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
                view.misfit(parameters[:, : view.n_params])
                view.log_prob(parameters[:, : view.n_params])
                view.jacobian(parameters[0, : view.n_params])
            problem.quantile_residuals(parameters, np.random.default_rng(2))
            problem.replicated(parameters, np.random.default_rng(2))


if __name__ == "__main__":
    boat = bs.load_vehicle("suboff")
    for subproblem in (None, *boat.equations.subproblems):
        for quaternions in (False, True):
            families.compiled(boat.kernel_folder(subproblem), quaternions).first_calls.call_all()
    before = signatures()
    study()
    print(*sorted(signatures() - before), sep="\n")
