"""What decides the rank of an axis: mass properties, coefficients, and the relative signs of two motions."""

from dataclasses import replace

import numpy as np

from bayesub.inference.identifiability import rank
from bayesub.kernels import workspace
from bayesub.logs.log_files import STATES
from bayesub.model.coefficients import INDEX
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.trajectory import Trajectory
from bayesub.model.vehicles import Vehicle, load_vehicle

PAIRS = {"v and r": ("v", "r"), "w and q": ("w", "q")}

# Vehicle, manoeuvre, axis, rank expected, and what is changed: mass properties, coefficients, or the samples that are
# left, those where two motions have equal (+1) or opposite (-1) signs.
MECHANISMS = (
    ("suboff", "coupled", "Y", 17, {}),
    ("suboff", "coupled", "Y", 18, {"yG": 0.5, "yB": 0.5}),
    ("suboff", "coupled", "Y", 17, {"buoyancy": 0.999}),
    ("suboff", "coupled", "Y", 17, {"Ixy": 1e7}),
    ("suboff", "coupled", "Y", 18, {"buoyancy": 0.999, "Ixy": 1e7}),
    ("auv690", "vertical", "Z", 11, {}),
    ("auv690", "vertical", "Z", 10, {"zG": 0.0, "zB": -0.0265}),
    ("npsauv", "coupled", "Z", 17, {}),
    ("npsauv", "coupled", "Z", 16, {"zG": 0.0, "zB": -0.061}),
    ("suboff", "vertical", "M", 12, {}),
    ("suboff", "vertical", "M", 11, {"w and q": 1}),
    ("suboff", "vertical", "M", 11, {"w and q": -1}),
    ("suboff", "coupled", "M", 18, {}),
    ("suboff", "coupled", "M", 17, {"w and q": 1}),
    ("suboff", "coupled", "N", 17, {}),
    ("suboff", "coupled", "N", 16, {"Yp_absp": 0.0}),
    ("auv690", "coupled", "N", 16, {}),
    ("auv690", "random:1", "N", 17, {}),
    ("auv690", "random:1", "N", 16, {"v and r": -1}),
    ("npsauv", "coupled", "N", 17, {}),
    ("npsauv", "coupled", "N", 16, {"Ixy": 0.0, "Iyz": 0.0, "Izx": 0.0}),
    ("suboff", "horizontal", "N", 8, {}),
    ("suboff", "zigzag_20_20", "N", 9, {}),
    ("suboff", "zigzag_20_20", "N", 8, {"v and r": -1}),
)


def altered(boat: Vehicle, changes: dict[str, float]) -> Vehicle:
    """The boat with some mass properties (buoyancy as a share of the weight) or coefficients set."""
    body, xi = boat.body.copy(), boat.xi.copy()
    for name, value in changes.items():
        if name in INDEX:
            xi[INDEX[name]] = value
        else:
            unit = body[workspace.BODY.index("weight")] if name == "buoyancy" else 1.0
            body[workspace.BODY.index(name)] = value * unit
    return replace(boat, body=body, xi=xi)


def motions(track: Trajectory, pair: str) -> tuple[np.ndarray, np.ndarray]:
    """The two motions (n_samples,) of a pair."""
    first, second = (track.states[0, :, STATES.index(name)] for name in PAIRS[pair])
    return first, second


def mechanism(vehicle: str, manoeuvre: str, axis: str, expected: int, changes: dict[str, float]) -> dict:
    """Rank of one axis with one thing about the vehicle or the record changed, a row of MECHANISMS."""
    boat = load_vehicle(vehicle)
    signs = {pair: sign for pair, sign in changes.items() if pair in PAIRS}
    body = {name: value for name, value in changes.items() if name not in signs}
    track = simulate(altered(boat, body), load_manoeuvre(manoeuvre, boat))
    system, rows = linear_systems(track)[axis], np.ones(len(track.times), dtype=bool)
    for pair, sign in signs.items():
        first, second = motions(track, pair)
        rows = sign * first * second >= 0
    result = rank({axis: replace(system, matrix=system.matrix[rows], load=system.load[rows])})[axis]
    v, r = motions(track, "v and r")
    return {
        "vehicle": vehicle,
        "manoeuvre": manoeuvre,
        "axis": axis,
        "changes": changes,
        "expected": expected,
        "rank": result.rank,
        "columns": result.columns,
        "equal_v_and_r": float(np.mean(v * r > 0)),
        "smallest_relative": (result.singular_values[[result.rank - 1, -1]] / result.singular_values[0]).tolist(),
    }


def relative_signs(track: Trajectory) -> dict[str, np.ndarray]:
    """Pair of motions -> -1, 0 or 1 (n_samples,), the product of their signs."""
    return {pair: np.prod(np.sign(motions(track, pair)), axis=0) for pair in PAIRS}


def shares_of_equal_signs(track: Trajectory) -> dict[str, dict[str, float]]:
    """Pair of motions -> share of the samples, and of the length of their product, in which signs are equal."""
    shares = {}
    for pair in PAIRS:
        first, second = motions(track, pair)
        product, equal = first * second, np.sign(first) * np.sign(second) > 0
        part = np.linalg.norm(product[equal]) / np.linalg.norm(product)
        shares[pair] = {"samples": float(np.mean(equal)), "regressor": float(part)}
    return shares
