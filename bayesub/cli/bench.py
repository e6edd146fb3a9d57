"""How fast the simulator is: against what a user would write instead, and against the arithmetic of the processor.

Everything simulates the 600 s spiral of `suboff` with 601 output times. :func:`run` returns the numbers,
:func:`bayesub.cli.bench_tables.tables` shows them.
"""

import os
import subprocess
import sys
import tempfile
import timeit
from collections.abc import Callable, Iterator
from functools import partial

import numba
import numpy as np
from scipy.integrate import solve_ivp

from bayesub.cli import arithmetic, scalar_simulator
from bayesub.cli.scalar_simulator import TIMES, spiral
from bayesub.kernels import workspace
from bayesub.model import coefficients
from bayesub.model.simulate import simulate
from bayesub.model.simulator import Simulator
from bayesub.model.time_step import STEP_TOLERANCE_M
from bayesub.problem import likelihoods
from bayesub.problem.priors import relative_normal
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe

PLAIN_STEP = 0.1  # s, the thesis's step
REFERENCE_STEP = 0.01  # s
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # of the adaptive integrator, until it is within STEP_TOLERANCE_M
BATCH = 256
NOISES = {
    "normal": likelihoods.Normal,
    "normal, rounded to an sd": lambda sd: likelihoods.Rounded(sd, sd),
    "normal, rounded to ten sd": lambda sd: likelihoods.Rounded(sd, 10.0 * sd),
    "Student t": lambda sd: likelihoods.StudentT(sd, 4.0),
    "autoregressive": lambda sd: likelihoods.AR1(sd, 10.0),
}


def shortest(*functions: Callable, seconds: float, least: int = 3) -> list[float]:
    """The shortest run (s) of each function, run in turn so that a slow moment of the machine falls on all alike."""
    durations = []
    while len(durations) < least or np.sum(durations) < seconds:
        durations.append([timeit.timeit(function, number=1) for function in functions])
    return np.min(durations, axis=0).tolist()


def each_number_of_threads() -> Iterator[int]:
    """One thread and then two, if there are two; afterwards as many as before."""
    before = numba.get_num_threads()
    try:
        for threads in sorted({1, min(2, numba.config.NUMBA_NUM_THREADS)}):
            numba.set_num_threads(threads)
            yield threads
    finally:
        numba.set_num_threads(before)


def perturbed(vehicle, n_batch: int) -> np.ndarray:
    """(n_batch, 101) coefficients that are off by one per cent."""
    return vehicle.xi * (1.0 + 0.01 * np.random.default_rng(0).standard_normal((n_batch, len(vehicle.xi))))


def compare(seconds: float) -> dict:
    """Time (s) and position error (m) of a simulation by this simulator and by what a user would write.

    The error is the largest over the 601 output times, against this simulator at a hundredth of its step.
    """
    simulator = spiral()
    vehicle = simulator.vehicle
    reference = spiral(REFERENCE_STEP).run(vehicle.xi)[0][0, :, :3]

    def row(method, duration, states):
        error = float(np.linalg.norm(states[:, :3] - reference, axis=1).max())
        return {"method": method, "seconds": duration, "error_m": error}

    rows, xi, states = [], perturbed(vehicle, BATCH), simulator.run(vehicle.xi)[0][0]
    for threads in each_number_of_threads():
        simulator.run(xi)
        name = f"bayesub, batch of {BATCH}, {threads} thread{'s' * (threads > 1)}, step {simulator.step:g} s"
        rows.append(row(name, shortest(lambda: simulator.run(xi), seconds=seconds)[0] / BATCH, states))
    for scalar in (spiral(PLAIN_STEP), simulator):
        states = scalar_simulator.simulate(scalar)
        duration = shortest(partial(scalar_simulator.simulate, scalar), seconds=seconds)[0]
        rows.append(row(f"scalar numba, Runge-Kutta 4, step {scalar.step:g} s", duration, states))
    for tolerance in TOLERANCES:
        adaptive = partial(_adaptive, simulator, tolerance)
        result = row(f"SciPy DOP853, tolerance {tolerance:g}, same compiled model", 0.0, adaptive())
        if result["error_m"] <= STEP_TOLERANCE_M:
            break
    rows.append(result | {"seconds": shortest(adaptive, seconds=seconds)[0]})
    python = _with_python("-m", scalar_simulator.__name__, str(simulator.step), NUMBA_DISABLE_JIT="1")
    rows.append(row(f"Python and NumPy, Runge-Kutta 4, step {simulator.step:g} s", float(python), states))
    return {
        "step_s": simulator.step,
        "reference_step_s": REFERENCE_STEP,
        "batch": BATCH,
        "evaluations": 4 * (len(simulator._stages) - 1),
        "methods": rows,
    }


def _adaptive(simulator: Simulator, tolerance: float) -> np.ndarray:
    """States (601, 12) by SciPy's adaptive integrator."""
    manoeuvre, work = simulator.manoeuvre, scalar_simulator.workspace(simulator)
    history, spacing = simulator.controls_at(manoeuvre.times), manoeuvre.times[1] - manoeuvre.times[0]
    span = (TIMES[0], TIMES[-1])
    options = {"args": (history, spacing, work), "rtol": tolerance, "atol": tolerance}
    return solve_ivp(_controlled, span, manoeuvre.initial_state, "DOP853", TIMES, **options).y.T


@numba.njit
def _controlled(t, state, history, spacing, work):
    """The rates of a state at a time, with controls interpolated in a history (n, 4) of equal spacing."""
    n = min(int(t / spacing), len(history) - 2)
    f = t / spacing - n
    return scalar_simulator.derivative(state, (1.0 - f) * history[n] + f * history[n + 1], work)


def _with_python(*arguments: str, **environment: str) -> str:
    """What another Python prints."""
    command = [sys.executable, *arguments]
    return subprocess.run(command, check=True, env=os.environ | environment, stdout=subprocess.PIPE, text=True).stdout


def growth(sizes: tuple[int, ...], seconds: float) -> dict:
    """Time (s) and memory (bytes) of batches by size, and time by the number of coefficients that are not zero."""
    simulator = spiral()
    vehicle = simulator.vehicle
    batches = []
    for size in sizes:
        xi = perturbed(vehicle, size)
        states, status = simulator.run(xi)
        inputs = size * 8 * (len(vehicle.xi) + workspace.N_BODY + workspace.N_STATES)
        work = 8 * simulator.kernels.layout.N_ROWS * workspace.LANES * numba.get_num_threads()
        memory = states.nbytes + status.nbytes + inputs + simulator._stages.nbytes + work
        duration = shortest(lambda xi=xi: simulator.run(xi), seconds=seconds)[0]
        batches.append({"size": size, "seconds": duration, "bytes": memory})
    some = vehicle.xi[None].repeat(64, axis=0)
    everything = np.where(some == 0.0, 1e-12, some)  # not zero, and without effect
    pruned = []
    for subproblem, xi in (("horizontal", everything), (None, some), (None, everything)):
        run = spiral(simulator.step, subproblem)
        used = int((run.dimensional(xi)[0] != 0.0).sum())
        duration = shortest(lambda run=run, xi=xi: run.run(xi), seconds=seconds)[0]
        pruned.append({"coefficients": used, "seconds": duration / 64})
    return {"threads": numba.get_num_threads(), "batches": batches, "non_zero": pruned}


def jacobians(seconds: float) -> list[dict]:
    """Time (s) of the derivatives of x, y and yaw at 601 times, by number of coefficients and threads."""
    simulator = spiral()
    xi = simulator.vehicle.xi
    free = [name for name in coefficients.HORIZONTAL if xi[coefficients.INDEX[name]] != 0.0]
    rows = []
    for threads in each_number_of_threads():
        for names in (free, coefficients.NAMES):
            differentiate = partial(simulator.sensitivities, xi, names, ("x", "y", "psi"))
            duration = shortest(differentiate, seconds=seconds)[0]
            rows.append({"coefficients": len(names), "threads": threads, "seconds": duration})
    return rows


def log_likelihoods(seconds: float) -> list[dict]:
    """Time (s) of a batch of log likelihoods of x, y and yaw, 600 readings each, by noise model and threads.

    The first row of each number of threads has no noise: the same batch of simulations alone.
    """
    simulator = spiral()
    vehicle, manoeuvre = simulator.vehicle, simulator.manoeuvre
    sensor = Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=1.0, channels=("x", "y", "yaw"))
    record = observe(simulate(vehicle, manoeuvre), sensor, np.random.default_rng(0))
    given = {"free": coefficients.HORIZONTAL, "prior": relative_normal(0.25)}
    noises = [{channel.name: noise(channel.sd) for channel in record.channels} for noise in NOISES.values()]
    problems = [Problem(vehicle, manoeuvre, record, noise=noise, **given) for noise in noises]
    xi = perturbed(vehicle, BATCH)
    parameters = xi[:, problems[0].columns]
    functions = [partial(problems[0].simulator.run, xi)]
    functions += [partial(problem.log_likelihood, parameters) for problem in problems]
    rows = []
    for threads in each_number_of_threads():
        shortest(*functions, seconds=0.0, least=1)
        durations = shortest(*functions, seconds=2.0 * seconds)
        for noise, duration in zip((None, *NOISES), durations, strict=True):
            rows.append({"noise": noise, "threads": threads, "seconds": duration})
    return rows


def starts() -> dict:
    """Time (s) from starting Python to the end of a first simulation, with an empty cache and with a filled one."""
    script = (
        "from bayesub import load_manoeuvre, load_vehicle, simulate; boat = load_vehicle('suboff'); "
        "simulate(boat, load_manoeuvre('horizontal', boat))"
    )
    with tempfile.TemporaryDirectory() as cache:
        run = partial(_with_python, "-c", script, NUMBA_CACHE_DIR=cache)
        return {name: timeit.timeit(run, number=1) for name in ("cold_s", "warm_s")}


def run(*, quick: bool = False) -> dict:
    """All measurements as numbers and lists; seconds, metres, bytes. `quick` is shorter and leaves out cold starts."""
    seconds = 0.2 if quick else 1.5
    numbers = compare(seconds)
    numbers["arithmetic"] = arithmetic.limit(spiral().kernels, numbers["evaluations"])
    numbers["jacobians"] = jacobians(seconds)
    numbers["log_likelihoods"] = log_likelihoods(seconds)
    numbers |= growth((1, 8, 64) if quick else (1, 8, 64, 256, 1024), seconds)
    return numbers if quick else numbers | starts()
