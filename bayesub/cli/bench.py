"""How fast the simulator is: against what a user would write instead, and against the arithmetic of the processor.

Everything simulates the 600 s spiral of `suboff` with 601 output times. :func:`run` returns the numbers, :func:`tables`
shows them.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from functools import partial
from math import cos, sin

import numba
import numpy as np
from rich.table import Table
from scipy.integrate import solve_ivp

from bayesub.kernels import integrate as kernel
from bayesub.kernels import workspace as layout
from bayesub.kernels.hydrodynamics import sgn
from bayesub.kernels.jit import widest_vectors
from bayesub.kernels.mass import inverse, mass_matrix
from bayesub.model import coefficients
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import STEP_TOLERANCE_M, Simulator, simulate
from bayesub.model.vehicles import load_vehicle
from bayesub.problem import likelihoods
from bayesub.problem.priors import relative_normal
from bayesub.problem.problem import Problem
from bayesub.sensors import Track, observe

PLAIN_STEP = 0.1  # s, the thesis's step
REFERENCE_STEP = 0.01  # s
BATCH = 256


# What a user would write: the model of one simulation, in plain Python, for numba to compile with its default settings.


def plain_forces():
    """Function (c, u, v, w, p, q, r, dr, db, ds) -> X, Y, Z, K, M, N of the table's terms without accelerations."""
    lines = ["def forces(c, u, v, w, p, q, r, dr, db, ds):", "    nu = sqrt(v*v + w*w)"]
    for axis in coefficients.AXES:
        terms = [(k, t) for k, t in enumerate(coefficients.TERMS) if t.axis == axis and not t.is_added_mass]
        lines.append(f"    {axis} = " + " + ".join(f"c[{k}]*({t.regressor})" for k, t in terms))
    lines.append(f"    return {', '.join(coefficients.AXES)}")
    scope = {"sqrt": np.sqrt, "sgn": sgn}
    exec("\n".join(lines), scope)
    return scope["forces"]


def plain_model(compiled):
    """The state derivative (state, controls, c, body, inverse) -> (12,) and a Runge-Kutta integrator of it."""
    wrap = numba.njit if compiled else (lambda function: function)
    forces = wrap(plain_forces())

    @wrap
    def derivative(state, controls, c, body, inverse_mass):
        phi, theta, psi, u, v, w, p, q, r = state[3:]
        dr, db, ds, ordered = controls
        m, ixx, iyy, izz, ixy, iyz, izx, xg, yg, zg, weight, buoyancy, xb, yb, zb = body[:15]
        sphi, cphi, sth, cth, spsi, cpsi = sin(phi), cos(phi), sin(theta), cos(theta), sin(psi), cos(psi)
        X, Y, Z, K, M, N = forces(c, u, v, w, p, q, r, dr, db, ds)

        X -= m * (w * q - v * r - xg * (q * q + r * r) + yg * p * q + zg * p * r)
        Y -= m * (u * r - w * p - yg * (r * r + p * p) + zg * q * r + xg * p * q)
        Z -= m * (v * p - u * q - zg * (p * p + q * q) + xg * r * p + yg * r * q)
        K -= (izz - iyy) * q * r - p * q * izx + (r * r - q * q) * iyz + p * r * ixy
        K -= m * (yg * (v * p - u * q) - zg * (u * r - w * p))
        M -= (ixx - izz) * r * p - q * r * ixy + (p * p - r * r) * izx + q * p * iyz
        M -= m * (zg * (w * q - v * r) - xg * (v * p - u * q))
        N -= (iyy - ixx) * p * q - r * p * iyz + (q * q - p * p) * ixy + r * q * izx
        N -= m * (xg * (u * r - w * p) - yg * (w * q - v * r))

        X -= (weight - buoyancy) * sth
        Y += (weight - buoyancy) * cth * sphi
        Z += (weight - buoyancy) * cth * cphi
        K += (weight * yg - buoyancy * yb) * cth * cphi - (weight * zg - buoyancy * zb) * cth * sphi
        M += -(weight * zg - buoyancy * zb) * sth - (weight * xg - buoyancy * xb) * cth * cphi
        N += (weight * xg - buoyancy * xb) * cth * sphi + (weight * yg - buoyancy * yb) * sth

        b1, b2, b3, b4, b5, b6, b7, b8, b9, zp, kn1, kn2 = body[15:27]
        if ordered > u if u >= 0 else ordered < u:
            thrust = b1 * u * abs(u) + b2 * abs(u) * ordered + b3 * ordered * ordered
        elif ordered <= 0 if u >= 0 else ordered >= 0:
            thrust = b7 * u * abs(u) + b8 * abs(u) * ordered + b9 * ordered * ordered
        else:
            thrust = b4 * u * abs(u) + b5 * abs(u) * ordered + b6 * ordered * ordered
        X += thrust
        M += thrust * zp
        if ordered > 0:
            K += kn1 * ordered * ordered + kn2 * ordered * max(u, 0.0)

        rates = np.empty(12)
        rates[0] = cpsi * cth * u + (cpsi * sth * sphi - spsi * cphi) * v + (spsi * sphi + cpsi * cphi * sth) * w
        rates[1] = spsi * cth * u + (cpsi * cphi + sphi * sth * spsi) * v + (sth * spsi * cphi - cpsi * sphi) * w
        rates[2] = -sth * u + cth * sphi * v + cth * cphi * w
        rates[3] = p + sth * (sphi * q + cphi * r) / cth
        rates[4] = cphi * q - sphi * r
        rates[5] = (sphi * q + cphi * r) / cth
        a = inverse_mass
        for k in range(6):
            rates[6 + k] = a[k, 0] * X + a[k, 1] * Y + a[k, 2] * Z + a[k, 3] * K + a[k, 4] * M + a[k, 5] * N
        return rates

    @wrap
    def runge_kutta(state, stages, step, c, body, inverse_mass):
        states = np.empty((len(stages), 12))
        states[0] = state
        for n in range(len(stages) - 1):
            k1 = derivative(state, stages[n, 0], c, body, inverse_mass)
            k2 = derivative(state + 0.5 * step * k1, stages[n, 1], c, body, inverse_mass)
            k3 = derivative(state + 0.5 * step * k2, stages[n, 1], c, body, inverse_mass)
            k4 = derivative(state + step * k3, stages[n, 2], c, body, inverse_mass)
            state = state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            states[n + 1] = state
        return states

    return derivative, runge_kutta


# The arithmetic of the processor.

_CHAIN = 16


@numba.njit(fastmath={"contract"})
def _multiply_add(values, times):
    """`times` passes of four chains of multiply-adds on each of `values`: 4 * _CHAIN of them a value and pass."""
    widest_vectors()
    for _ in range(times):
        for j in range(values.shape[0]):
            x = values[j]
            a, b, c, d = x, x + 0.1, x + 0.2, x + 0.3
            for _ in range(_CHAIN):
                a = a * x + 0.25
                b = b * x + 0.25
                c = c * x + 0.25
                d = d * x + 0.25
            values[j] = 0.1 * (a + b + c + d)


def packed_instructions(function) -> tuple[Counter, int]:
    """Packed double-precision instructions of a compiled function by kind, and its widest vectors in bits (0: none)."""
    assembly = next(iter(function.inspect_asm().values())).split(".Lfunc_end0")[0]
    kinds = Counter()
    for name in re.findall(r"^\s+v([a-z0-9]+)pd\s.*[yz]mm", assembly, flags=re.MULTILINE):
        if kind := re.match(r"fn?m(?:add|sub)|mul|add|sub|div|sqrt|cmp|blend", name):
            kinds["fma" if kind[0].startswith("f") else kind[0]] += 1
    return kinds, 512 if "zmm" in assembly else 256 if "ymm" in assembly else 0


def arithmetic_limit(evaluations: int) -> dict:
    """The shortest time (s) of `evaluations` right-hand sides on one core, and what it follows from.

    Every packed multiply-add, multiplication, addition, subtraction, division and root in the compiled stage counts as
    one multiply-add at the measured peak rate; comparisons, choices, loads and stores count as nothing.
    """
    values = np.full(512, 0.5)
    _multiply_add(values, 1)
    rate = 1000 * values.size * 4 * _CHAIN / _best(lambda: _multiply_add(values, 1000), 0.5)
    # A fresh compilation: numba cannot show the code of a cached one.
    options = {k: v for k, v in kernel.stage.targetoptions.items() if k in ("error_model", "fastmath", "nogil")}
    stage = numba.njit(**options)(kernel.stage.py_func)
    stage(np.zeros(layout.N_ROWS * layout.LANES), np.zeros(4), 0.0, 0.0)
    kinds, bits = packed_instructions(stage)
    slots = sum(kinds[kind] for kind in ("fma", "mul", "add", "sub", "div", "sqrt"))
    return {
        "instructions": dict(kinds),
        "vector_bits": bits,
        "peak_vector_bits": packed_instructions(_multiply_add)[1],
        "fma_per_s": rate,
        "limit_s": evaluations * slots / rate,
    }


# Measuring.


def _best(function, seconds: float, least: int = 3) -> float:
    """The shortest of repeated runs, s."""
    return _alternately([function], seconds, least)[0]


def _alternately(functions, seconds: float, least: int = 3) -> list[float]:
    """The shortest run of each function (s), run in turn so that a slow moment of the machine falls on all alike."""
    durations = [[] for _ in functions]
    while len(durations[0]) < least or np.sum(durations) < seconds:
        for function, taken in zip(functions, durations, strict=True):
            began = time.perf_counter()
            function()
            taken.append(time.perf_counter() - began)
    return [min(taken) for taken in durations]


def _threads() -> list[int]:
    return sorted({1, min(2, numba.config.NUMBA_NUM_THREADS)})


def compare(seconds: float) -> dict:
    """Time (s) and position error (m) of a simulation by this simulator and by what a user would write.

    The error is the largest over the 601 output times, against this simulator at a hundredth of its step.
    """
    vehicle = load_vehicle("suboff")
    manoeuvre = load_manoeuvre("horizontal", vehicle)
    times = np.linspace(0.0, 600.0, 601)
    simulator = Simulator(vehicle, manoeuvre, times)
    reference = Simulator(vehicle, manoeuvre, times, dt=REFERENCE_STEP).run(vehicle.xi)[0][0, :, :3]

    def error(states):
        return float(np.linalg.norm(states[:, :3] - reference, axis=1).max())

    rows = []
    xi = _perturbed(vehicle, BATCH)
    before = numba.get_num_threads()
    ours = error(simulator.run(vehicle.xi)[0][0])
    for threads in _threads():
        numba.set_num_threads(threads)
        simulator.run(xi)
        name = f"bayesub, batch of {BATCH}, {threads} thread{'s' * (threads > 1)}, step {simulator.step:g} s"
        rows.append((name, _best(lambda: simulator.run(xi), seconds) / BATCH, ours))
    numba.set_num_threads(before)

    c, body = simulator.dimensional(vehicle.xi)[0], simulator.vehicle.body
    inverse_mass = inverse(mass_matrix(c, body))
    initial = manoeuvre.initial_state
    derivative, runge_kutta = plain_model(compiled=True)
    for step in (PLAIN_STEP, simulator.step):
        stages = Simulator(vehicle, manoeuvre, times, dt=step)._stages

        def scalar(step=step, stages=stages):
            return runge_kutta(initial, stages, step, c, body, inverse_mass)[:: round(1.0 / step)]

        accuracy = error(scalar())
        rows.append((f"scalar numba, Runge-Kutta 4, step {step:g} s", _best(scalar, seconds), accuracy))

    history = simulator._controls_at(manoeuvre.times)

    @numba.njit
    def controlled(t, state, spacing):
        n = min(int(t / spacing), len(history) - 2)
        f = t / spacing - n
        return derivative(state, (1.0 - f) * history[n] + f * history[n + 1], c, body, inverse_mass)

    spacing = manoeuvre.times[1] - manoeuvre.times[0]
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):

        def adaptive(tolerance=tolerance):
            return solve_ivp(
                controlled, (0.0, 600.0), initial, "DOP853", times, args=(spacing,), rtol=tolerance, atol=tolerance
            ).y.T

        dop = error(adaptive())
        if dop <= STEP_TOLERANCE_M:
            break
    rows.append((f"SciPy DOP853, tolerance {tolerance:g}, same compiled model", _best(adaptive, seconds), dop))

    _, runge_kutta_python = plain_model(compiled=False)

    def python():
        stages, step = simulator._stages, simulator.step
        return runge_kutta_python(initial, stages, step, c, body, inverse_mass)[:: round(1.0 / step)]

    accuracy = error(python())
    rows.append((f"Python and NumPy, Runge-Kutta 4, step {simulator.step:g} s", _best(python, 0.0), accuracy))
    return {
        "step_s": simulator.step,
        "reference_step_s": REFERENCE_STEP,
        "evaluations": 4 * (len(simulator._stages) - 1),
        "methods": [{"method": m, "seconds": t, "error_m": e} for m, t, e in rows],
    }


def _perturbed(vehicle, n_batch):
    return vehicle.xi * (1.0 + 0.01 * np.random.default_rng(0).standard_normal((n_batch, len(vehicle.xi))))


def growth(sizes, seconds: float) -> dict:
    """Time (s) and memory (bytes) of batches by size, and time by the number of coefficients that are not zero."""
    vehicle = load_vehicle("suboff")
    manoeuvre = load_manoeuvre("horizontal", vehicle)
    times = np.linspace(0.0, 600.0, 601)
    simulator = Simulator(vehicle, manoeuvre, times)
    batches = []
    for size in sizes:
        xi = _perturbed(vehicle, size)
        states, status = simulator.run(xi)
        inputs = size * 8 * (layout.N_COEFFICIENTS + layout.N_BODY + layout.N_STATES)
        workspace = 8 * layout.N_ROWS * layout.LANES * numba.get_num_threads()
        batches.append(
            {
                "size": size,
                "seconds": _best(lambda xi=xi: simulator.run(xi), seconds),
                "bytes": states.nbytes + status.nbytes + inputs + simulator._stages.nbytes + workspace,
            }
        )
    everything = vehicle.xi[None].repeat(64, axis=0)
    everything[everything == 0.0] = 1e-12  # not zero, and without effect
    pruned = []
    for problem, xi in (("horizontal", everything), (None, vehicle.xi[None].repeat(64, axis=0)), (None, everything)):
        run = Simulator(vehicle, manoeuvre, times, dt=simulator.step, subproblem=problem)
        used = int((run.dimensional(xi)[0] != 0.0).sum())
        pruned.append({"coefficients": used, "seconds": _best(lambda run=run, xi=xi: run.run(xi), seconds) / 64})
    return {"threads": numba.get_num_threads(), "batches": batches, "non_zero": pruned}


def jacobians(seconds: float) -> list[dict]:
    """Time (s) of the derivatives of x, y and yaw at 601 times, by number of coefficients and threads."""
    vehicle = load_vehicle("suboff")
    simulator = Simulator(vehicle, load_manoeuvre("horizontal", vehicle), np.linspace(0.0, 600.0, 601))
    names = {21: [n for n in coefficients.HORIZONTAL if vehicle.xi[coefficients.INDEX[n]] != 0.0]}
    names[len(coefficients.NAMES)] = coefficients.NAMES
    rows = []
    before = numba.get_num_threads()
    for threads in _threads():
        numba.set_num_threads(threads)
        for n, columns in names.items():
            taken = _best(
                lambda columns=columns: simulator.sensitivities(vehicle.xi, columns, ("x", "y", "psi")), seconds
            )
            rows.append({"coefficients": n, "threads": threads, "seconds": taken})
    numba.set_num_threads(before)
    return rows


def log_likelihoods(seconds: float) -> list[dict]:
    """Time (s) of a batch of log likelihoods of x, y and yaw, 600 readings each, by noise model and threads.

    The first row of each number of threads has no noise: the same batch of simulations alone.
    """
    vehicle = load_vehicle("suboff")
    manoeuvre = load_manoeuvre("horizontal", vehicle)
    sensor = Track(position_sd_m=0.5, attitude_sd_deg=0.1, interval_s=1.0, channels=("x", "y", "yaw"))
    record = observe(simulate(vehicle, manoeuvre), sensor, np.random.default_rng(0))
    models = {
        "normal": lambda sd: likelihoods.Normal(sd),
        "normal, rounded to an sd": lambda sd: likelihoods.Rounded(sd, sd),
        "normal, rounded to ten sd": lambda sd: likelihoods.Rounded(sd, 10.0 * sd),
        "Student t": lambda sd: likelihoods.StudentT(sd, 4.0),
        "autoregressive": lambda sd: likelihoods.AR1(sd, 10.0),
    }
    prior = relative_normal(0.25)
    problems = [
        Problem(
            vehicle,
            manoeuvre,
            record,
            free=coefficients.HORIZONTAL,
            prior=prior,
            noise={channel.name: model(channel.sd) for channel in record.channels},
        )
        for model in models.values()
    ]
    xi = _perturbed(vehicle, BATCH)
    parameters = xi[:, problems[0].columns]
    functions = [lambda: problems[0].simulator.run(xi)]
    functions += [partial(problem.log_likelihood, parameters) for problem in problems]
    rows = []
    before = numba.get_num_threads()
    for threads in _threads():
        numba.set_num_threads(threads)
        _alternately(functions, 0.0, least=1)
        taken = _alternately(functions, 2.0 * seconds)
        rows += [
            {"noise": noise, "threads": threads, "seconds": t} for noise, t in zip((None, *models), taken, strict=True)
        ]
    numba.set_num_threads(before)
    return rows


def starts() -> dict:
    """Time (s) from starting Python to the end of a first simulation, with an empty cache and with a filled one."""
    script = (
        "from bayesub import load_manoeuvre, load_vehicle, simulate; boat = load_vehicle('suboff'); "
        "simulate(boat, load_manoeuvre('horizontal', boat))"
    )
    with tempfile.TemporaryDirectory() as cache:
        result = {}
        for name in ("cold_s", "warm_s"):
            began = time.perf_counter()
            subprocess.run([sys.executable, "-c", script], check=True, env=os.environ | {"NUMBA_CACHE_DIR": cache})
            result[name] = time.perf_counter() - began
    return result


def run(*, quick: bool = False) -> dict:
    """All measurements as numbers and lists; seconds, metres, bytes. `quick` is shorter and leaves out cold starts."""
    seconds = 0.2 if quick else 1.5
    numbers = compare(seconds)
    numbers["arithmetic"] = arithmetic_limit(numbers["evaluations"])
    numbers["jacobians"] = jacobians(seconds)
    numbers["log_likelihoods"] = log_likelihoods(seconds)
    numbers |= growth((1, 8, 64) if quick else (1, 8, 64, 256, 1024), seconds)
    if not quick:
        numbers |= starts()
    return numbers


def tables(numbers: dict) -> list[Table | str]:
    """What :func:`run` measured, for the terminal."""
    ours = [m for m in numbers["methods"] if m["method"].startswith("bayesub")]
    fastest = ours[-1]["seconds"]
    methods = Table("method", "per simulation", "position error", "times ours", title="600 s spiral of suboff")
    for m in numbers["methods"]:
        methods.add_row(
            m["method"], f"{1e6 * m['seconds']:.1f} us", f"{1e3 * m['error_m']:.3g} mm", f"{m['seconds'] / fastest:.1f}"
        )
    batches = Table("batch", "time", "per simulation", "memory", title=f"Batches on {numbers['threads']} threads")
    for b in numbers["batches"]:
        each = 1e6 * b["seconds"] / b["size"]
        batches.add_row(str(b["size"]), f"{1e3 * b['seconds']:.3g} ms", f"{each:.1f} us", f"{b['bytes'] / 1e6:.2f} MB")
    pruned = Table("coefficients not zero", "per simulation", title="Number of coefficients, batch of 64")
    for row in numbers["non_zero"]:
        pruned.add_row(str(row["coefficients"]), f"{1e6 * row['seconds']:.1f} us")
    slopes = Table("coefficients", "threads", "Jacobian", "simulations in a batch", title="Exact sensitivities")
    batch = dict(zip(_threads(), (m["seconds"] for m in ours), strict=True))
    for row in numbers["jacobians"]:
        worth = row["seconds"] / batch[row["threads"]]
        cells = (row["coefficients"], row["threads"], f"{1e3 * row['seconds']:.2f} ms", f"{worth:.0f}")
        slopes.add_row(*map(str, cells))
    densities = Table(
        "noise", "threads", "batch", "over the simulations alone", title=f"Log likelihoods, batch of {BATCH}"
    )
    for row in numbers["log_likelihoods"]:
        if row["noise"] is None:
            alone = row["seconds"]
        cells = (f"{1e3 * row['seconds']:.2f} ms", f"{row['seconds'] / alone:.2f}")
        densities.add_row(row["noise"] or "simulations alone", str(row["threads"]), *cells)
    limit = numbers["arithmetic"]
    one = ours[0]["seconds"]
    count = ", ".join(f"{n} {kind}" for kind, n in limit["instructions"].items())
    text = [
        f"right-hand side: {count} ({limit['vector_bits']}-bit vectors)",
        f"peak of one core: {limit['fma_per_s'] / 1e9:.1f}e9 multiply-adds/s ({limit['peak_vector_bits']}-bit vectors)",
        f"arithmetic limit: {1e6 * limit['limit_s']:.1f} us a simulation on one core; ours takes "
        f"{one / limit['limit_s']:.2f} times that",
    ]
    if "cold_s" in numbers:
        text.append(f"first simulation: {numbers['cold_s']:.1f} s with compilation, {numbers['warm_s']:.1f} s without")
    return [methods, batches, pruned, slopes, densities, "\n".join(text)]
