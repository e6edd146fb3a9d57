"""What is known of the tanker before its trials: the published model, as coefficients of the set and their covariance.

The MMG standard method (Yasukawa & Yoshimura 2015) has hull, propeller and rudder of KVLCC2, with the wake and the flow
at the rudder that change with drift and turning. It is not linear in its constants. Its forces in motions as in
zig-zags and turning circles are fitted by the set, once for each of many draws of its constants.
"""

import numpy as np

from bayesub.logs.log_files import positions
from bayesub.model.vehicles import Vehicle
from bayesub.problem.priors import Given, normal, relative_normal

LENGTH, DRAUGHT, DENSITY, SPEED = 7.0, 0.46, 1000.0, 1.179  # m, m, kg/m^3, m/s
REVOLUTIONS = 10.23  # 1/s of HSVA's trials, 614 a minute (report of 2006)
# With the wake of 0.35 the thrust is 41 N, as HSVA measured.
DIAMETER, RUDDER_AREA, RUDDER_HEIGHT, RUDDER_X = 0.216, 0.0539, 0.345, -0.5  # m, m^2, m, lengths
OPEN_WATER = (0.2931, -0.2753, -0.1385)  # K_T by powers of J
ADDED = {"x": 0.022, "y": 0.223}  # masses, of 0.5 rho L^2 d
# Name -> value, sd: a fifth of the value, a tenth of what is measured well, 0.015 at least of a hull's third order.
CONSTANTS = {
    "Xvv": (-0.040, 0.008), "Xvr": (0.002, 0.015), "Xrr": (0.011, 0.0022), "Xvvvv": (0.771, 0.154),
    "Yv": (-0.315, 0.063), "Yr": (0.083, 0.0166), "Yvvv": (-1.607, 0.321),
    "Yvvr": (0.379, 0.076), "Yvrr": (-0.391, 0.078), "Yrrr": (0.008, 0.015),
    "Nv": (-0.137, 0.0274), "Nr": (-0.049, 0.0098), "Nvvv": (-0.030, 0.015),
    "Nvvr": (-0.294, 0.059), "Nvrr": (0.055, 0.011), "Nrrr": (-0.013, 0.015),
    "t_P": (0.220, 0.022), "t_R": (0.387, 0.077), "a_H": (0.312, 0.062), "x_H": (-0.464, 0.093),
    "w_P0": (0.35, 0.035), "C_1": (2.0, 0.4), "C_2+": (1.6, 0.2), "C_2-": (1.1, 0.2), "x_P": (-0.48, 0.096),
    "gamma_R+": (0.640, 0.128), "gamma_R-": (0.395, 0.079), "l_R": (-0.710, 0.142),
    "epsilon": (1.09, 0.109), "kappa": (0.50, 0.10), "f_alpha": (2.747, 0.275),
}  # fmt: skip
# What the published model leaves out: that the two sides differ, by the single propeller.
SIDES = {"Y0": 1.1e-4, "Yvv": 1.6e-3, "Yrr": 6.3e-4, "Ydd": 6e-4}
SIDES |= {"N0": 4.3e-5, "Nvv": 7.8e-4, "Nrr": 3.1e-4, "Ndd": 3e-4}
FORM = 0.1  # sd of each coefficient besides, as a share of it, for what no constant can change
N_MOTIONS, N_DRAWS, SEED = 6000, 400, 1


def motions(rng: np.random.Generator) -> np.ndarray:
    """(n, 4) u and v in m/s, r in rad/s, rudder in rad, as in zig-zags and circles with up to 35 degrees of rudder."""
    u = SPEED * rng.uniform(0.35, 1.05, N_MOTIONS)
    turning = rng.uniform(-0.9, 0.9, N_MOTIONS)  # r L / V
    sideways = -0.37 * turning + 0.08 * rng.standard_normal(N_MOTIONS)  # v / V
    speed = u / np.sqrt(1.0 - sideways**2)
    return np.stack([u, sideways * speed, turning * speed / LENGTH, rng.uniform(-0.61, 0.61, N_MOTIONS)], axis=1)


def forces(c: dict[str, float], motion: np.ndarray) -> np.ndarray:
    """(3, n) X and Y in N and N in Nm of motions (n, 4), by equations 6 to 22; rudder positive to port.

    With the added masses that turn with the ship, which the set has in its coefficients, and with the resistance that
    the measured revolutions overcome at the speed of the trials.
    """
    u, v, r, rudder = motion.T
    rudder, speed = -rudder, np.hypot(u, v)
    side, turn, drift = v / speed, r * LENGTH / speed, np.arctan2(-v, u)
    pressure = 0.5 * DENSITY * LENGTH * DRAUGHT * speed**2
    products = {"v": side, "r": turn, "vv": side**2, "vr": side * turn, "rr": turn**2, "vvvv": side**4}
    products |= {"vvv": side**3, "vvr": side**2 * turn, "vrr": side * turn**2, "rrr": turn**3}
    hull = {axis: sum(c[axis + key] * value for key, value in products.items() if axis + key in c) for axis in "XYN"}
    at_propeller = drift - c["x_P"] * turn
    steep = np.where(at_propeller > 0.0, c["C_2+"], c["C_2-"]) - 1.0
    inflow = u * (1.0 - c["w_P0"]) * (1.0 + steep * (1.0 - np.exp(-c["C_1"] * np.abs(at_propeller))))
    resistance = thrust(SPEED * (1.0 - c["w_P0"])) * (speed / SPEED) ** 2
    push = (1.0 - c["t_P"]) * (thrust(inflow) - resistance)
    at_rudder = drift - c["l_R"] * turn
    across = speed * np.where(at_rudder > 0.0, c["gamma_R+"], c["gamma_R-"]) * at_rudder
    load = 8.0 * thrust(inflow) / (np.pi * DENSITY * (DIAMETER * inflow) ** 2)
    slip = c["kappa"] * (np.sqrt(1.0 + load) - 1.0)
    share = DIAMETER / RUDDER_HEIGHT
    along = c["epsilon"] * inflow * np.sqrt(share * (1.0 + slip) ** 2 + 1.0 - share)
    angle = rudder - np.arctan2(across, along)
    lift = 0.5 * DENSITY * RUDDER_AREA * c["f_alpha"] * (along**2 + across**2) * np.sin(angle)
    mass = {axis: value * 0.5 * DENSITY * LENGTH**2 * DRAUGHT for axis, value in ADDED.items()}
    x = pressure * hull["X"] + push - (1.0 - c["t_R"]) * lift * np.sin(rudder) + mass["y"] * v * r
    y = pressure * hull["Y"] - (1.0 + c["a_H"]) * lift * np.cos(rudder) - mass["x"] * u * r
    n = LENGTH * (pressure * hull["N"] - (RUDDER_X + c["a_H"] * c["x_H"]) * lift * np.cos(rudder))
    return np.stack([x, y, n])


def thrust(inflow: np.ndarray | float) -> np.ndarray:
    """Of the propeller at the revolutions of the trials, N, in an inflow in m/s."""
    k_t = np.polynomial.polynomial.polyval(inflow / (REVOLUTIONS * DIAMETER), OPEN_WATER)
    return DENSITY * REVOLUTIONS**2 * DIAMETER**4 * k_t


def prior(boat: Vehicle, form: float = FORM) -> tuple[np.ndarray, Given]:
    """Coefficients of the published model (n_terms,), those of the boat for added masses, and their normal prior."""
    rng = np.random.default_rng(SEED)
    motion, equations = motions(rng), boat.equations
    states, still = np.zeros((len(motion), 12)), np.zeros((len(motion), 6))
    states[:, positions("u", "v", "r")] = motion[:, :3]
    blocks = equations.regressors(states, still, motion[:, [3, 3]], boat.constants)
    draws = [{key: mean + sd * rng.standard_normal() for key, (mean, sd) in CONSTANTS.items()} for _ in range(N_DRAWS)]
    means = {key: mean for key, (mean, _) in CONSTANTS.items()}
    loads = [forces(constants, motion) for constants in (means, *draws)]
    xi, sds = boat.xi.copy(), np.where(np.isfinite(boat.sd), boat.sd, 0.0)
    covariance = np.diag(sds**2)
    fitted, found = [], []
    for axis, load in zip("XYN", np.stack(loads, axis=2), strict=True):
        names = equations.names_of_axis(axis)
        places = [k for k, name in enumerate(names) if "dot" not in name and name not in SIDES]
        columns = equations.columns([names[k] for k in places])
        found.append(np.linalg.lstsq(blocks[axis][:, places] * boat.dimensional_factors[columns], load)[0])
        fitted += columns.tolist()
    values = np.concatenate(found)  # (n_fitted, 1 + N_DRAWS)
    xi[fitted] = values[:, 0]
    covariance[np.ix_(fitted, fitted)] = np.cov(values[:, 1:]) + np.diag((form * values[:, 0]) ** 2)
    sides = equations.columns(list(SIDES))
    covariance[sides, sides] = np.square(list(SIDES.values()))
    sds = np.sqrt(np.diag(covariance))
    given = {name: normal(xi[k], sds[k]) for k, name in enumerate(equations.names)}
    pairs = ((i, j, covariance[i, j] / (sds[i] * sds[j])) for n, i in enumerate(fitted) for j in fitted[:n])
    related = tuple((equations.names[i], equations.names[j], float(share)) for i, j, share in pairs)
    return xi, Given(relative_normal(1.0), given, related)
