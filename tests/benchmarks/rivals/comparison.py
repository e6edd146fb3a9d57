"""What a user would write instead of the simulator, beside it: time, error, and agreement to round-off."""

import os
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numba
import numpy as np
from scipy.integrate import solve_ivp

from bayesub.io.errors import InputError
from bayesub.model import coefficients
from bayesub.model.simulator import STEP_TOLERANCE_M, Simulator
from bayesub.study.before import bench
from bayesub.study.before.bench import BATCH, TIMES, each_number_of_threads, perturbed, shortest, spiral, with_python
from rivals import arithmetic, cpp_simulator, jax_simulator, scalar_simulator
from rivals.in_threads import in_threads

PLAIN_STEP = 0.1  # s, the thesis's step
REFERENCE_STEP = 0.01  # s
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)  # of the adaptive integrator, until it is within STEP_TOLERANCE_M
AGREEMENT_M = 1e-12  # of positions up to 2.5 km away, which doubles resolve to 5e-13 m
AGREEMENT_OF_JACOBIANS = 1e-12  # relative to the largest entry of a column
N_SCALAR = 8  # flights of a row that flies one boat at a time, between two looks at the clock


@dataclass
class _Rival:
    """A way to simulate: its states (601, 12) of the boat, and seconds of a simulation by number of threads."""

    method: str
    states: np.ndarray
    seconds: dict[int, float] = field(default_factory=dict)
    step: float | None = None  # of Runge-Kutta 4, by which the simulator must get the same
    fly: Callable | None = None  # it flies n_boats, if it is measured here
    n_boats: int = 1


def check_agreement(method: str, difference: float, largest: float, unit: str) -> None:
    """See to it that a method gets what the simulator gets.

    Raises
    ------
    InputError
        If the difference is larger than `largest`.
    """
    if not difference <= largest:
        raise InputError(
            f"bench: {method} differs from the simulator by {difference:.1e}{unit}, more than {largest:.0e}{unit}: "
            "they do not compute the same, so that their times cannot be compared",
            "state",
            method,
        )


def by_jax(seconds: float) -> tuple[dict[int, dict], list[str]]:
    """What JAX measured and computed, by number of threads, and in words what was left out.

    Raises
    ------
    InputError
        If its Jacobian is another one than the simulator's.
    """
    if not jax_simulator.is_installed():
        return {}, ["left out: JAX, which is not installed (pip install 'bayesub[bench]')"]
    simulator, measured = spiral(), {}
    xi, names = simulator.vehicle.xi, simulator.vehicle.equations.names
    expected = simulator.sensitivities(xi, names, jax_simulator.OUTPUTS)
    scale = np.abs(expected).max(axis=(0, 1))
    with tempfile.TemporaryDirectory() as folder:
        for threads in each_number_of_threads():
            environment = jax_simulator.environment(threads, folder)
            try:
                measured[threads] = _by_process(folder, jax_simulator, str(threads), str(seconds), **environment)
            except subprocess.CalledProcessError as error:
                return {}, [f"left out: JAX, whose process ended with status {error.returncode}"]
            difference = np.abs(measured[threads]["jacobian"] - expected).max(axis=(0, 1))
            relative = (difference / np.where(scale > 0.0, scale, 1.0)).max()
            check_agreement("the Jacobian of JAX", relative, AGREEMENT_OF_JACOBIANS, "")
    return measured, []


def _by_process(folder: str, module, *arguments: str, **environment: str) -> dict[str, np.ndarray]:
    """The arrays that a module writes when another Python runs it."""
    file = Path(folder, "measured.npz")
    path = (str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH"))
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, path))
    with_python("-m", module.__name__, str(file), *arguments, **environment)
    with np.load(file) as arrays:
        return dict(arrays)


def run(*, quick: bool = False) -> dict:
    """All measurements as numbers and lists: seconds and metres. `quick` is shorter and leaves out JAX."""
    seconds = 0.2 if quick else 1.5
    measured, left_out = ({}, ["left out by --quick: JAX"]) if quick else by_jax(seconds)
    numbers = compare(seconds, measured)
    numbers["left_out"] += left_out
    numbers["arithmetic"] = arithmetic.limit(spiral().kernels, numbers["evaluations"])
    numbers["jacobians"] = [{"method": "bayesub", **row} for row in bench.jacobians(seconds)]
    for threads, arrays in measured.items():
        row = {
            "coefficients": len(coefficients.NAMES),
            "threads": threads,
            "seconds": float(arrays["jacobian_seconds"]),
        }
        numbers["jacobians"].append({"method": "JAX, jacfwd", **row})
    return numbers


def compare(seconds: float, by_jax: dict[int, dict]) -> dict:
    """Time (s) and position error (m) of a simulation by this simulator and by what a user would write.

    The error is the largest over the 601 output times, against this simulator at a hundredth of its step. Where the
    method and its step are those of this simulator, `differs_m` is the largest difference of a position (m).

    Raises
    ------
    InputError
        If a method with the same step gets another motion.
    """
    simulator = spiral()
    xi, step = perturbed(simulator.vehicle, BATCH), simulator.step
    of_cpp, left_out = _cpp(simulator, xi)
    measured = [_ours(simulator, xi), *of_cpp, _scalar(simulator), _scalar(spiral(PLAIN_STEP))]
    differences = [_difference(rival) for rival in measured]
    for threads in each_number_of_threads():
        measured[0].fly()  # on so many threads for the first time
        measured[0].seconds[threads] = shortest(measured[0].fly, seconds=seconds)[0] / BATCH
        for rival in measured[1:]:
            rival.seconds[threads] = in_threads(rival.fly, threads, seconds) / rival.n_boats
    others = []
    if by_jax:
        durations = {threads: float(arrays["seconds"]) for threads, arrays in by_jax.items()}
        others.append(_Rival("JAX, jit(vmap(scan))", by_jax[1]["states"], durations, step))
    with tempfile.TemporaryDirectory() as folder:
        python = _by_process(folder, scalar_simulator, str(step), NUMBA_DISABLE_JIT="1")
    others.append(_Rival("Python and NumPy", python["states"], {1: float(python["seconds"])}, step))
    reference = spiral(REFERENCE_STEP).run(simulator.vehicle.xi)[0][0]
    others.append(_adaptive(simulator, reference, seconds))
    differences += [_difference(rival) for rival in others]
    rows = []
    for rival, difference in zip(measured + others, differences, strict=True):
        error = float(np.linalg.norm((rival.states - reference)[:, :3], axis=1).max())
        row = {"method": rival.method, "step_s": rival.step, "seconds": rival.seconds}
        rows.append(row | {"error_m": error, "differs_m": difference})
    return {
        "step_s": step,
        "reference_step_s": REFERENCE_STEP,
        "batch": BATCH,
        "evaluations": 4 * (len(simulator._stages) - 1),
        "methods": rows,
        "left_out": left_out,
    }


def _difference(rival) -> float | None:
    """How far (m) a track is from that of the simulator with the same step; none without a step."""
    if rival.step is None:
        return None
    simulator = spiral(rival.step)
    expected = simulator.run(simulator.vehicle.xi)[0][0]
    difference = float(np.abs(rival.states - expected)[:, :3].max())
    check_agreement(rival.method, difference, AGREEMENT_M, " m")
    return difference


def _ours(simulator, xi) -> _Rival:
    states = simulator.run(simulator.vehicle.xi)[0][0]
    return _Rival("bayesub", states, step=simulator.step, fly=lambda: simulator.run(xi))


def _cpp(simulator, xi) -> tuple[list[_Rival], list[str]]:
    """By C++, and in words why not."""
    if cpp_simulator.compiler() is None:
        return [], ["left out: C++, for which there is no compiler (c++, or what the environment variable CXX names)"]
    boats = np.vstack([simulator.vehicle.xi, xi[1:]])
    result = []
    for library, words in ((True, "of its library"), (False, "of bayesub")):
        try:
            rival = cpp_simulator.CppSimulator(simulator, library_sines=library)
        except (OSError, subprocess.CalledProcessError) as error:
            reason = (getattr(error, "stderr", None) or str(error)).strip().partition("\n")[0]
            return [], [f"left out: C++, which {cpp_simulator.compiler()} does not compile: {reason}"]
        blocks = rival.prepared(boats)
        fly = partial(rival.run, blocks)
        result.append(_Rival(f"C++, sines {words}", fly()[0], step=simulator.step, fly=fly, n_boats=BATCH))
    return result, []


def _scalar(simulator) -> _Rival:
    works = [scalar_simulator.rows_of(simulator, xi) for xi in perturbed(simulator.vehicle, N_SCALAR)]
    stages, step = simulator._stages, simulator.step

    def fly():
        for work in works:
            scalar_simulator.runge_kutta(stages, step, work)

    states = scalar_simulator.simulate(simulator)
    return _Rival("numba, one at a time", states, step=step, fly=fly, n_boats=N_SCALAR)


def _adaptive(simulator, reference, seconds) -> _Rival:
    """SciPy's adaptive integrator with the coarsest tolerance that keeps it within STEP_TOLERANCE_M."""
    for tolerance in TOLERANCES:
        fly = partial(_with_scipy, simulator, tolerance)
        states = fly()
        if np.linalg.norm((states - reference)[:, :3], axis=1).max() <= STEP_TOLERANCE_M:
            break
    return _Rival(f"SciPy DOP853, {tolerance:g}", states, {1: shortest(fly, seconds=seconds)[0]})


def _with_scipy(simulator: Simulator, tolerance: float) -> np.ndarray:
    """States (601, 12) by SciPy's adaptive integrator."""
    manoeuvre = simulator.manoeuvre
    work = scalar_simulator.rows_of(simulator, simulator.vehicle.xi)
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
