"""Boats that another simulator flies, pushed by forces, and what this software makes of their logs.

The simulator shares no code with bayesub: it reads the numbers of the vehicle file and has the equations of the plane
(model manual, sections 2, 4, 5) written out, adaptive steps of eighth order and an Ornstein-Uhlenbeck process of its
own. What it hands over are the text of a log and of a study file.
"""

import math
import tomllib
from importlib import resources

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

VEHICLE = "auv690"
STEP_S = 0.05  # of the rows of the log and of the forces
STAIRS = tuple((44.0 / 15.0 * (5 * k + 1), 5.0 * min(k + 1, 11 - k)) for k in range(12))  # s, degrees
DURATION_S = 176.0
RPM = 350.0
SHARE, TIME_S = 0.015, 4.0  # sd of the forces over the rms of the hull's, and their correlation time
START = (1.75, 0.02)  # mean and sd of the speed at the start, m/s
PRIOR_SD = 0.25
NOISE = {"x_m": 0.1, "y_m": 0.1, "heading_deg": 0.1, "u_mps": 0.005, "v_mps": 0.005, "r_degps": 0.05}
# As a person would write it who has the log and knows the sensors, and of the forces next to nothing.
STUDY = f"""
name = "stranger"
question = "coverage"
seed = 1
vehicle = "{VEHICLE}"
data = "log.csv"
subproblem = "horizontal"
sensors = [{", ".join(f'{{ kind = "sensor", column = "{column}", sd = {sd} }}' for column, sd in NOISE.items())}]
free = {{ coefficients = "horizontal" }}
prior = {{ kind = "relative_normal", sd = {PRIOR_SD}, centre = "vehicle" }}
nuisance = {{ u0_mps = {{ mean = {START[0]}, sd = {START[1]} }} }}
baselines = {{ sqp_starts = 0 }}
[disturbance]
axes = ["X", "Y", "N"]
sd = {{ median = 0.0001, log_sd = 1.5 }}
correlation_time_s = {{ median = 5.0, log_sd = 0.7 }}
"""
_FASTEST = 10.0  # m/s and rad/s: a boat beyond has not completed

# Coefficient -> power of the length by which it is made dimensional. Accelerations, velocities, and the rudder.
INERTIA = {"Xudot": 3, "Yvdot": 3, "Yrdot": 4, "Nvdot": 4, "Nrdot": 5}
HULL = {
    **{"Xuu": 2, "Xvv": 2, "Xvr": 3, "Xrr": 4},
    **{"Yuu": 2, "Yuv": 2, "Yv_absnu": 2, "Yur": 3, "Yv_absr": 3},
    **{"Nuu": 3, "Nuv": 3, "Nv_absnu": 3, "Nur": 4, "Nabsnu_r": 4, "Nr_absr": 5},
}
RUDDER = {"Xuu_drdr": 2, "Yuu_dr": 2, "Yu_absr_dr": 3, "Nuu_dr": 3, "Nu_absr_dr": 4}


def numbers_of_the_vehicle() -> dict:
    """The vehicle file."""
    return tomllib.loads((resources.files("bayesub") / f"data/vehicles/{VEHICLE}.toml").read_text(encoding="utf-8"))


class Boat:
    """A boat in the horizontal plane.

    Parameters
    ----------
    coefficients : dict of str to float
        Non-dimensional; those that are left out are the vehicle file's.
    """

    def __init__(self, coefficients: dict[str, float] | None = None):
        file = numbers_of_the_vehicle()
        body, self.actuators = file["body"], file["actuators"]
        length, pressure = body["length_m"], 0.5 * body["water_density_kgm3"]
        names = {**INERTIA, **HULL, **RUDDER}
        self.coefficients = {name: float(file["coefficients"][name]) for name in names} | dict(coefficients or {})
        c = {name: pressure * length**power * self.coefficients[name] for name, power in names.items()}
        self.dimensional = c
        self.thrust = pressure * length**2 * np.reshape(file["propulsion"]["b"], (3, 3))
        self.rpm_per_mps = file["propulsion"]["rpm_per_mps"]
        self.mass = m = body["mass_kg"]
        turning = np.array([[m - c["Yvdot"], -c["Yrdot"]], [-c["Nvdot"], body["inertia_kgm2"]["Izz"] - c["Nrdot"]]])
        self.surge_mass = m - c["Xudot"]
        self.inverse = np.linalg.inv(turning).tolist()
        self.is_possible = self.surge_mass > 0 and np.linalg.det(turning) > 0

    def hull(self, u, v, r) -> tuple:
        """Forces X and Y, N, and moment N, N m, of the hull without its rudder."""
        c = self.dimensional
        return (
            c["Xuu"] * u * u + c["Xvv"] * v * v + c["Xvr"] * v * r + c["Xrr"] * r * r,
            c["Yuu"] * u * u + (c["Yuv"] * u + c["Yv_absnu"] * abs(v) + c["Yv_absr"] * abs(r)) * v + c["Yur"] * u * r,
            c["Nuu"] * u * u
            + (c["Nuv"] * u + c["Nv_absnu"] * abs(v)) * v
            + (c["Nur"] * u + c["Nabsnu_r"] * abs(v) + c["Nr_absr"] * abs(r)) * r,
        )

    def propeller(self, u: float, rpm: float) -> float:
        """Thrust, N: one of three polynomials, by the speed at which the propeller would drive the boat."""
        driven = rpm / self.rpm_per_mps
        b = self.thrust[0 if driven > u > 0 else 1 if driven * u > 0 else 2]
        return b[0] * u * abs(u) + b[1] * abs(u) * driven + b[2] * driven**2

    def rates(self, state, rudder: float, rpm: float, forces) -> tuple:
        """Derivatives of x, y, heading, u, v, r by the time."""
        _, _, heading, u, v, r = state
        c = self.dimensional
        x_force, y_force, moment = self.hull(u, v, r)
        x_force += c["Xuu_drdr"] * u * u * rudder * rudder + self.propeller(u, rpm) + forces[0] + self.mass * v * r
        along = u * u * rudder
        across = u * abs(r) * rudder
        y_force += c["Yuu_dr"] * along + c["Yu_absr_dr"] * across + forces[1] - self.mass * u * r
        moment += c["Nuu_dr"] * along + c["Nu_absr_dr"] * across + forces[2]
        (a, b), (d, e) = self.inverse
        cos, sin = math.cos(heading), math.sin(heading)
        return (
            u * cos - v * sin,
            u * sin + v * cos,
            r,
            x_force / self.surge_mass,
            a * y_force + b * moment,
            d * y_force + e * moment,
        )

    def flown(self, times: np.ndarray, rudder: np.ndarray, forces: np.ndarray, speed: float) -> np.ndarray | None:
        """States (n_times, 6), or None if the boat does not complete.

        Parameters
        ----------
        times : equidistant, s
        rudder : (n_times,) rad, linear in between as the log has it
        forces : (n_times, 3) X, Y, N in N and N m, linear in between
        speed : at the start, m/s
        """
        if not self.is_possible:
            return None
        step = times[1] - times[0]
        inputs = np.column_stack([rudder, forces])
        pairs = list(zip(inputs.tolist(), np.diff(inputs, axis=0).tolist(), strict=False))

        def rates(t, state):
            k = min(int(t / step), len(pairs) - 1)
            begin, change = pairs[k]
            part = t / step - k
            delta, *force = (a + part * b for a, b in zip(begin, change, strict=True))
            return self.rates(state.tolist(), delta, RPM, force)

        def too_fast(_, state):
            return _FASTEST - np.abs(state[3:]).max()

        too_fast.terminal = True
        # Steps end where the lines of the inputs break, so that the error is that of smooth motions.
        options = {"first_step": step, "max_step": step, "rtol": 1e-8, "atol": 1e-9, "events": too_fast}
        start = [0.0, 0.0, 0.0, speed, 0.0, 0.0]
        solution = solve_ivp(rates, (times[0], times[-1]), start, "DOP853", times, **options)
        return solution.y.T if solution.status == 0 else None


def rudder_of(demands, times: np.ndarray, actuators: dict) -> np.ndarray:
    """Angles (n_times,), degrees, of a rudder that follows demands by a lag with a limited rate.

    Parameters
    ----------
    demands : (time, angle) one after the other, s and degrees
    """
    rate, lag = actuators["rate_deg_s"], actuators["time_constant_s"]
    angles = np.zeros(len(times))
    now = 0.0
    ends = [time for time, _ in demands[1:]] + [times[-1] + STEP_S]
    for (begin, demand), end in zip(demands, ends, strict=True):
        gap = demand - now
        slew = max(abs(gap) / rate - lag, 0.0)  # s, at the limit

        def angle(since, demand=demand, gap=gap, slew=slew):
            left = np.minimum(abs(gap), rate * lag) * np.exp(-np.maximum(since - slew, 0.0) / lag)
            return demand - np.sign(gap) * (left + rate * np.maximum(slew - since, 0.0))

        here = times >= begin
        angles[here] = angle(times[here] - begin)
        now = float(angle(end - begin))
    return angles


def pushes(rng: np.random.Generator, n_times: int, sds: np.ndarray, time_s: float = TIME_S) -> np.ndarray:
    """(n_times, n_axes) values of Ornstein-Uhlenbeck processes, a step apart, stationary from the first."""
    kept = np.exp(-STEP_S / time_s)
    white = rng.standard_normal((n_times, len(sds)))
    white[1:] *= np.sqrt(1.0 - kept**2)
    return sds * lfilter([1.0], [1.0, -kept], white, axis=0)


def boat_and_log(
    rng: np.random.Generator, demands=STAIRS, duration_s: float = DURATION_S, time_s: float = TIME_S
) -> tuple[dict, str, int]:
    """True coefficients, the text of the log, and how many boats before this one did not complete.

    The forces have the correlation time `time_s`.
    """
    vehicle = Boat()
    times = STEP_S * np.arange(round(duration_s / STEP_S) + 1)
    degrees = rudder_of(demands, times, vehicle.actuators)
    rudder = np.radians(degrees)
    calm = vehicle.flown(times, rudder, np.zeros((len(times), 3)), START[0])
    sds = SHARE * np.sqrt([np.mean(np.square(force)) for force in vehicle.hull(*calm[:, 3:].T)])
    n_failed = 0
    while True:
        truth = {name: value * (1.0 + PRIOR_SD * rng.standard_normal()) for name, value in vehicle.coefficients.items()}
        speed = START[0] + START[1] * rng.standard_normal()
        motion = Boat(truth).flown(times, rudder, pushes(rng, len(times), sds, time_s), speed)
        if motion is not None:
            return truth, log(times, degrees, motion, rng), n_failed
        n_failed += 1


def log(times: np.ndarray, rudder: np.ndarray, motion: np.ndarray, rng: np.random.Generator) -> str:
    """The log of a motion (n_times, 6) as CSV: controls in each row, and every second noisy readings after them."""
    lines = [",".join(["time_s", "rudder_deg", "rpm", *NOISE])]
    readings = motion * [1.0, 1.0, 180.0 / np.pi, 1.0, 1.0, 180.0 / np.pi]
    every = round(1.0 / STEP_S)
    for k, (time, angle) in enumerate(zip(times, rudder, strict=True)):
        cells = [""] * len(NOISE)
        if k and k % every == 0:
            cells = [f"{x:.6f}" for x in readings[k] + rng.normal(0.0, list(NOISE.values()))]
        lines.append(",".join([f"{time:.4f}", f"{angle:.8f}", f"{RPM:.6f}", *cells]))
    return "\n".join(lines) + "\n"
