"""How fast the simulator is on this machine: simulations, derivatives, densities, and what compiling costs.

Everything simulates the 600 s spiral of `suboff` with 601 output times. What compiling costs is measured by a process
of its own: ``python -m bayesub.study.before.bench FILE`` writes the seconds.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np

from bayesub.io import toml_files
from bayesub.kernels import workspace
from bayesub.kernels.families import UNITS, family
from bayesub.model import coefficients
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import source
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle, load_vehicle
from bayesub.problem import likelihoods
from bayesub.problem.priors import relative_normal
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe
from bayesub.study.new import study

TIMES = np.linspace(0.0, 600.0, 601)  # s
BATCH = 256
NOISES = {
    "normal": likelihoods.Normal,
    "normal, rounded to an sd": lambda sd: likelihoods.Rounded(sd, sd),
    "normal, rounded to ten sd": lambda sd: likelihoods.Rounded(sd, 10.0 * sd),
    "Student t": lambda sd: likelihoods.StudentT(sd, 4.0),
    "autoregressive": lambda sd: likelihoods.AR1(sd, 10.0),
}


def shortest(*functions: Callable[[], object], seconds: float, least: int = 3) -> list[float]:
    """The shortest run (s) of each function, run in turn so that a slow moment of the machine falls on all alike."""
    durations: list[list[float]] = []
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


def with_python(*arguments: str, **environment: str) -> None:
    """Run another Python with these arguments, and these environment variables besides."""
    subprocess.run([sys.executable, *arguments], check=True, env=os.environ | environment, stdout=subprocess.PIPE)


def spiral(step: float | None = None) -> Simulator:
    """The simulator of the 600 s spiral of `suboff` at 601 output times, with its own step or a given one (s)."""
    vehicle = load_vehicle("suboff")
    return Simulator(vehicle, load_manoeuvre("horizontal", vehicle), TIMES, dt=step, subproblem="horizontal")


def perturbed(vehicle: Vehicle, n_batch: int) -> np.ndarray:
    """(n_batch, 101) coefficients that are off by one per cent."""
    return vehicle.xi * (1.0 + 0.01 * np.random.default_rng(0).standard_normal((n_batch, len(vehicle.xi))))


def growth(sizes: tuple[int, ...], seconds: float) -> dict[str, Any]:
    """Time (s) and memory (bytes) of batches by size."""
    simulator = spiral()
    vehicle = simulator.vehicle
    batches = []
    for size in sizes:
        xi = perturbed(vehicle, size)
        states, status = simulator.run(xi)
        inputs = size * 8 * (len(vehicle.xi) + workspace.N_BODY + workspace.N_STATES)
        work = 8 * simulator.kernels.n_rows * workspace.LANES * numba.get_num_threads()
        memory = states.nbytes + status.nbytes + inputs + simulator._stages.nbytes + work
        duration = shortest(partial(simulator.run, xi), seconds=seconds)[0]
        batches.append({"size": size, "seconds": duration, "bytes": memory})
    return {"threads": numba.get_num_threads(), "batches": batches}


def jacobians(seconds: float) -> list[dict[str, Any]]:
    """Time (s) of the derivatives of x, y and yaw at 601 times, by number of coefficients and threads."""
    simulator = spiral()
    xi = simulator.vehicle.xi
    free = [name for name in coefficients.HORIZONTAL if xi[coefficients.INDEX[name]] != 0.0]
    rows = []
    for threads in each_number_of_threads():
        for names in (free, coefficients.NAMES):
            duration = shortest(partial(simulator.sensitivities, xi, names, ("x", "y", "psi")), seconds=seconds)[0]
            rows.append({"coefficients": len(names), "threads": threads, "seconds": duration})
    return rows


def log_likelihoods(seconds: float) -> list[dict[str, Any]]:
    """Time (s) of a batch of log likelihoods of x, y and yaw, 600 readings each, by noise model and threads.

    The first row of each number of threads has no noise: the same batch of simulations alone.
    """
    simulator = spiral()
    vehicle, manoeuvre = simulator.vehicle, simulator.manoeuvre
    sensor = Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=1.0, channels=("x", "y", "yaw"))
    record = observe(simulate(vehicle, manoeuvre), sensor, np.random.default_rng(0))
    given: dict[str, Any] = {"free": coefficients.HORIZONTAL, "prior": relative_normal(0.25)}
    noises = [{channel.name: noise(channel.sd) for channel in record.channels} for noise in NOISES.values()]
    problems = [Problem(vehicle, manoeuvre, record, noise=noise, **given) for noise in noises]
    xi = perturbed(vehicle, BATCH)
    functions: list[Callable[[], object]] = [partial(problems[0].simulator.run, xi)]
    functions += [partial(problem.log_likelihood, xi[:, problem.columns]) for problem in problems]
    rows = []
    for threads in each_number_of_threads():
        shortest(*functions, seconds=0.0, least=1)
        for noise, duration in zip((None, *NOISES), shortest(*functions, seconds=2.0 * seconds), strict=True):
            rows.append({"noise": noise, "threads": threads, "seconds": duration})
    return rows


def starts() -> dict[str, float]:
    """Time (s) from starting Python to the end of a first simulation, with an empty cache and with a filled one."""
    script = "from bayesub import load_manoeuvre, load_vehicle, simulate; boat = load_vehicle('suboff'); "
    script += "simulate(boat, load_manoeuvre('horizontal', boat))"
    with tempfile.TemporaryDirectory() as cache:
        run = partial(with_python, "-c", script, NUMBA_CACHE_DIR=cache)
        return {name: timeit.timeit(run, number=1) for name in ("cold_s", "warm_s")}


def parts_of_a_run() -> dict[str, float]:
    """Time (s) by part of the run of a new study of the spiral, in a Python of its own; the last is the whole."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "spiral.toml")
        file.write_text(study.simulated("spiral", file, "suboff", "horizontal"), encoding="utf-8")
        imports = timeit.timeit(partial(with_python, "-c", "import bayesub.study.run.infer"), number=1)
        command = [sys.executable, "-m", "bayesub", "run", str(file), "-o", f"{folder}/run"]
        whole = timeit.timeit(partial(subprocess.run, command, capture_output=True), number=1)
        numbers = json.loads(Path(folder, "run", "numbers.json").read_text(encoding="utf-8"))
    seconds, sampling = dict(numbers["seconds"]), numbers["seconds"]["sampling"]
    flying, before = numbers["cost"]["simulation_seconds"], seconds.pop("all before the report")
    del seconds["sampling"]
    return {
        "imports": imports,
        **seconds,
        "sampling: flying and derivatives": flying,
        "sampling: searches, surrogate and moves": sampling - flying,
        "findings": before - sum(seconds.values()) - sampling,
        "figures and page": whole - before - imports,
        "all": whole,
    }


def compilations() -> dict[str, float]:
    """Processor time (s) of compiling, by name: sets of equations and their sub-problems, then loops."""

    def compiled(equations, plane):
        kernels = family(source(equations, plane))
        for name in UNITS:
            kernels.unit(name)

    works: dict[str, Callable[[], object]] = {}
    for name in toml_files.built_in("equations"):
        equations = load_equations(name)
        for plane in (None, *equations.subproblems) if equations.degrees_of_freedom == 6 else equations.subproblems:
            works[f"{name} {plane or 'full'}"] = partial(compiled, equations, plane)
    boat = load_vehicle("suboff")
    simulator = Simulator(boat, load_manoeuvre("horizontal", boat), np.array([10.0]), dt=1.0)
    works["loops of a flight"] = partial(simulator.run, boat.xi)
    works["loops of a batch"] = partial(simulator.run, np.tile(boat.xi, (20, 1)))
    works["loops of accelerations"] = lambda: simulator.accelerations(boat.xi, simulator.run(boat.xi)[0])
    works["loops of derivatives"] = partial(simulator.sensitivities, boat.xi, boat.equations.names)
    return {name: timeit.timeit(work, timer=time.process_time, number=1) for name, work in works.items()}


def run(*, quick: bool = False) -> dict[str, Any]:
    """All measurements as numbers and lists: seconds and bytes. `quick` leaves out starting and compilation."""
    seconds = 0.2 if quick else 1.5
    numbers = {"step_s": spiral().step, "batch": BATCH, "jacobians": jacobians(seconds)}
    numbers["log_likelihoods"] = log_likelihoods(seconds)
    numbers |= growth((1, 8, 64) if quick else (1, 8, 64, 256, 1024), seconds)
    if quick:
        return numbers
    with tempfile.TemporaryDirectory() as cache:
        file = Path(cache, "seconds.json")
        with_python("-m", "bayesub.study.before.bench", str(file), NUMBA_CACHE_DIR=cache)
        return numbers | starts() | {"compilation": json.loads(file.read_text()), "run": parts_of_a_run()}


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(compilations()))
