"""Ways from one record to a boat: a posterior mode, a smoother with regression, and a network for what is not linear.

The network is that of Haddara & Wang (1999), as thesis section 3.6.4 reports it: linear derivatives and added masses
are taken as known, a small network learns what is left of the forces along the measured motion, and coefficients are
found by regression on the forces of both.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesub.inference.baselines import gauss_newton, smoothed_regression
from bayesub.logs.log_files import positions
from bayesub.model.coefficients import HORIZONTAL, INDEX, columns
from bayesub.model.disturbance import hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.manoeuvres import Manoeuvre, load_manoeuvre
from bayesub.model.simulate import accelerations, simulate
from bayesub.model.simulator import Simulator, true_step
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.disturbances import UnknownDisturbance, force_scales
from bayesub.problem.problem import Problem
from bayesub.sensors import DVL, INS, Record, Track, observe
from thesis import cases

TRAINED = Path(__file__).with_name("zigzag_35.toml")
LINEAR = ("Xuu", "Yuv", "Yur", "Yuu_dr", "Nuv", "Nur", "Nuu_dr")
ADDED = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
PLANE = ("X", "Y", "N")
PLACES = [AXES.index(axis) for axis in PLANE]
HIDDEN, DECAY, MEMBERS = 12, 0.1, 5  # units, weight decay, and networks of which the mean is taken
SMOOTHED, LEARNED = 0.03, 0.1  # shares of the hull's forces that are the noise of the process, of smoother and network
U, V, R, PSI = positions("u", "v", "r", "psi")


def sensors(boat: Vehicle) -> tuple:
    """Of suboff fixes to 0.5 m, headings to 0.1 degrees, speeds to 1 cm/s and rates to 0.02 deg/s once a second."""
    second, length = cases.time_scale(boat), cases.length_scale(boat)
    return (
        Track(0.5 * length, 0.1, second, channels=("x", "y", "yaw")),
        DVL(sd_mps=0.01 * length / second, interval_s=second, channels=("u_ground", "v_ground")),
        INS(sd_degps=0.02 / second, interval_s=second, channels=("r",)),
    )


@dataclass(frozen=True)
class Trial:
    """A record of a boat on a zig-zag, and the guess that all methods begin with, whose relative sd is known."""

    boat: Vehicle
    manoeuvre: Manoeuvre
    record: Record
    guess: np.ndarray  # (n_terms,)
    sd: float

    @property
    def step(self) -> float:
        """Of what is fitted, s: one of suboff, in proportion for others."""
        return cases.time_scale(self.boat)

    @property
    def free(self) -> list[str]:
        """Coefficients that are not zero."""
        return [name for name in HORIZONTAL if self.boat.xi[INDEX[name]]]

    def problem(self, free: list[str], **given) -> Problem:
        """The problem with a prior about the guess, where coefficients that are not free are held at it."""
        sds = self.sd * np.abs(self.boat.xi)
        about = {n: priors.normal(self.guess[INDEX[n]], sds[INDEX[n]]) for n in free}
        given |= {"free": free, "prior": priors.Given(priors.relative_normal(self.sd), about)}
        return Problem(self.boat, self.manoeuvre, self.record, xi=self.guess, dt=self.step, **given)

    def with_forces(self, share: float) -> Problem:
        """The problem with the noise of a process, of a share of the hull's forces, and added masses of the guess."""
        boat = self.boat
        hull = hull_force_rms([Simulator(boat, self.manoeuvre, [self.manoeuvre.duration])])
        length = boat.length_m / boat.speed_mps
        sds = dict(zip(PLANE, share * hull[PLACES] / force_scales(boat, PLANE), strict=True))
        start = {"u0_mps": priors.normal(boat.speed_mps, 0.05)}
        forces = UnknownDisturbance(PLANE, sds, length, knot_interval_s=0.5 * length)
        free = [name for name in self.free if name not in ADDED]
        return self.problem(free, nuisance=start, disturbance=forces)


def trial(boat: Vehicle, sd: float, rng: np.random.Generator) -> Trial:
    """A record with noise, and a guess that is off by a relative sd."""
    flown = load_manoeuvre(TRAINED, boat)
    motion = simulate(boat, flown, dt=true_step(cases.time_scale(boat), flown))
    places = columns([name for name in HORIZONTAL if boat.xi[INDEX[name]]])
    guess = boat.xi.copy()
    guess[places] *= 1.0 + sd * rng.standard_normal(len(places))
    return Trial(boat, flown, observe(motion, sensors(boat), rng), guess, sd)


def mode(one: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (n_terms,) of the posterior mode, and their sds (n_free,)."""
    problem = one.problem(one.free)
    found = gauss_newton(problem)
    return problem.coefficient_sets(found.values)[0], np.sqrt(np.diag(found.covariance))


def smoothed(one: Trial) -> np.ndarray:
    """Coefficients (n_terms,) by smoothing and regression; those that it cannot distinguish stay with the guess."""
    found = smoothed_regression(one.with_forces(SMOOTHED))
    xi = one.guess.copy()
    known = [name in INDEX for name in found.names]
    xi[columns(np.array(found.names)[known])] = found.values[known]
    return xi


class Network:
    """Linear derivatives and added masses of a guess, and a network for what is left of the forces of a motion.

    The weights start from random numbers of the `seed`.
    """

    def __init__(self, one: Trial, seed: int):
        self.one, known = one, np.zeros_like(one.guess)
        known[columns((*LINEAR, *ADDED))] = one.guess[columns((*LINEAR, *ADDED))]
        self.vehicle = replace(one.boat, xi=known)
        dimensional = known * one.boat.dimensional_factors
        self._mass = one.boat.kernels().mass_matrix(dimensional, one.boat.body)
        self._plane = self._mass[np.ix_(PLACES, PLACES)]
        problem = one.with_forces(LEARNED)
        parameters, n = problem.prior.parameters(np.zeros(problem.n_params)), problem.n_coefficients
        parameters[:n] = one.guess[columns(problem.names[:n])]
        parameters[n:] = gauss_newton(problem.held(parameters), parameters[n:]).values
        motion = problem.forward.trajectory(*problem.arguments(parameters[None]))
        self.states, self.controls = motion.states[0], np.atleast_2d(np.squeeze(motion.controls).T).T
        self.rpm = np.broadcast_to(motion.rpm, len(self.states))
        rates = motion.accelerations.reshape(-1, 6)[:, PLACES]
        left = rates @ self._plane.T - self._known(self.states, self.controls, self.rpm)
        sizes, inputs = left.std(axis=0), self._inputs(self.states, self.controls)
        from sklearn.neural_network import MLPRegressor

        settings = {"activation": "tanh", "solver": "lbfgs", "alpha": DECAY, "max_iter": 3000, "max_fun": 60_000}
        nets = [MLPRegressor(hidden_layer_sizes=(HIDDEN,), random_state=seed + k, **settings) for k in range(MEMBERS)]
        fitted = [net.fit(inputs, left / sizes) for net in nets]
        # Their mean is one network with the units of all.
        self._inner = np.hstack([net.coefs_[0] for net in fitted]), np.hstack([net.intercepts_[0] for net in fitted])
        outer = np.vstack([net.coefs_[1] for net in fitted]), np.sum([net.intercepts_[1] for net in fitted], axis=0)
        self._outer = tuple(part / MEMBERS * sizes for part in outer)

    def _inputs(self, states, controls):
        """Speed, drift, rate of turn and rudder, each of the order of one."""
        speed, length = self.one.boat.speed_mps, self.one.boat.length_m
        scaled = states[:, [U, V, R]] / [speed, 0.2 * speed, 0.5 * speed / length]
        return np.column_stack([scaled[:, 0] - 1.0, scaled[:, 1:], 2.0 * controls[:, 0]])

    def _known(self, states, controls, rpm):
        """(n, 3) forces in the plane of all that is known, N and N m: what its accelerations take."""
        return (accelerations(self.vehicle, states, controls, rpm) @ self._mass.T)[:, PLACES]

    def forces(self, states: np.ndarray, controls: np.ndarray) -> np.ndarray:
        """(n, 3) what the network adds in the plane, N and N m, at states (n, 12) and controls (n, n_controls)."""
        (inner, a), (outer, b) = self._inner, self._outer
        return np.tanh(self._inputs(states, controls) @ inner + a) @ outer + b

    def _slope(self, manoeuvre, state, time):
        """(12,) derivative of a state of the plane."""
        control = np.array([[np.interp(time, manoeuvre.times, column) for column in manoeuvre.controls.T]])
        rpm = float(np.interp(time, manoeuvre.times, manoeuvre.rpm))
        forces = self._known(state[None], control, rpm) + self.forces(state[None], control)
        (u, v, r, psi), slope = state[[U, V, R, PSI]], np.zeros(12)
        slope[[0, 1]] = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
        slope[PSI], slope[[U, V, R]] = r, np.linalg.solve(self._plane, forces[0])
        return slope

    def fly(self, manoeuvre: Manoeuvre, times: np.ndarray) -> np.ndarray:
        """States (n_times, 12) on a manoeuvre, by Runge-Kutta; times (n_times,) are steps of the trial from zero on."""
        boat, step = self.one.boat, self.one.step
        state = Simulator(boat, manoeuvre, times[:1]).trajectory(boat.xi).states[0, 0]
        states = [state]
        for time in times[:-1]:
            a = self._slope(manoeuvre, state, time)
            b = self._slope(manoeuvre, state + 0.5 * step * a, time + 0.5 * step)
            c = self._slope(manoeuvre, state + 0.5 * step * b, time + 0.5 * step)
            d = self._slope(manoeuvre, state + step * c, time + step)
            state = state + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
            states.append(state)
        return np.array(states)

    def coefficients(self) -> np.ndarray:
        """(n_terms,) by regression on the forces of network and linear part along the motion, added masses known."""
        one, equations, boat = self.one, self.one.boat.equations, self.one.boat
        given = np.column_stack([self.controls, self.rpm / boat.rpm_per_mps])
        terms = equations.regressors(self.states, np.zeros((len(self.states), 6)), given, boat.constants)
        network, xi = self.forces(self.states, self.controls), one.guess.copy()
        for place, axis in enumerate(PLANE):
            of_axis = list(equations.names_of_axis(axis))
            names = [name for name in of_axis if name in one.free and name not in ADDED]
            block = terms[axis][:, [of_axis.index(name) for name in names]] * boat.dimensional_factors[columns(names)]
            known = [name in LINEAR for name in names]
            load = network[:, place] + block[:, known] @ one.guess[columns(np.array(names)[known])]
            sizes = np.linalg.norm(block, axis=0)
            xi[columns(names)] = np.linalg.lstsq(block / sizes, load, rcond=1e-8)[0] / sizes
        return xi
