"""Captive runs: prescribed motions, the forces that they measure, and what these say of the coefficients.

Forces at a prescribed motion are linear in the coefficients, so that with normal errors and a normal prior the
posterior is normal, and exact. Speeds, lengths and times are made dimensionless by length and trial speed.
"""

import csv
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from bayesub.design.captive import LABEL, MOTION, PROPELLER, forces
from bayesub.model.equations import AXES
from bayesub.model.vehicles import Vehicle

PHASES = 24  # of a cycle at which an oscillating run measures
BALANCE = 0.01  # sd of a force, of the largest of that axis in the catalogue
PER_HOUR = 10.0  # runs
TEXTBOOK = ("oblique tow", "planes", "rotating arm", "planar motion")  # the order of a programme
TWO = "two rotations"  # kind of a run that only a hexapod or a rotary balance can make


@dataclass(frozen=True)
class Run:
    """A captive run: a steady motion, or a cycle of an oscillation."""

    kind: str  # of TEXTBOOK
    words: str
    velocities: np.ndarray  # (n, 6) u' v' w' p' q' r'
    accelerations: np.ndarray  # (n, 6)
    planes: tuple[float, ...]  # of the equations' controls, rad
    propeller: float = 1.0  # revolutions over those of self-propulsion


def catalogue() -> list[Run]:
    """What a tank with a rotating arm and a planar motion mechanism can run: tows, planes, turns and oscillations."""
    runs, none = [], (0.0, 0.0, 0.0)
    angles = (-16.0, -12.0, -8.0, -4.0, 4.0, 8.0, 12.0, 16.0)
    drifts = [(b, 0.0) for b in angles] + [(0.0, a) for a in angles] + list(product((-8.0, 8.0), (-8.0, 8.0)))
    deflected = [(d, *none[1:]) for d in (-20.0, -10.0, 10.0, 20.0)]
    deflected += [(0.0, d, 0.0) for d in (-20.0, 20.0)] + [(0.0, 0.0, d) for d in (-20.0, -10.0, 10.0, 20.0)]
    runs += [steady("oblique tow", speed, 0.0, 0.0) for speed in (0.5, 1.0, 1.2)]
    runs += [steady("oblique tow", 1.0, drift, attack) for drift, attack in drifts]
    for planes, ratio in product(deflected, (0.6, 1.0, 1.4)):
        runs.append(steady("planes", 1.0, 0.0, 0.0, planes=planes, propeller=ratio))
    for planes, (drift, attack) in product(
        deflected, [(b, 0.0) for b in (-8.0, 8.0)] + [(0.0, a) for a in (-8.0, 8.0)]
    ):
        runs.append(steady("planes", 1.0, drift, attack, planes=planes))
    for turn, drift in product((-0.6, -0.3, 0.3, 0.6), (-12.0, -6.0, 0.0, 6.0, 12.0)):
        runs.append(steady("rotating arm", 1.0, drift, 0.0, turn=(0.0, 0.0, turn)))
        runs.append(steady("rotating arm", 1.0, 0.0, drift, turn=(0.0, turn, 0.0)))
    for turn, planes in product((-0.4, 0.4), deflected):
        runs.append(steady("rotating arm", 1.0, 0.0, 0.0, turn=(0.0, 0.0, turn), planes=planes))
        runs.append(steady("rotating arm", 1.0, 0.0, 0.0, turn=(0.0, turn, 0.0), planes=planes))
    for turn, drift, attack in product((-0.4, 0.4), (-6.0, 6.0), (-6.0, 6.0)):
        runs.append(steady("rotating arm", 1.0, drift, attack, turn=(0.0, 0.0, turn)))
    for axis, frequency, size in product("uvwpqr", (0.5, 2.0), (0.1, 0.3)):
        runs.append(oscillation({axis: size}, frequency))
    runs += [oscillation({a: 0.2, b: 0.3}, 1.0, phase) for a, b, phase in product("vw", "pqr", (0.0, 0.5))]
    for axis, drift in product("pqr", (-8.0, 8.0)):
        runs.append(oscillation({axis: 0.3}, 1.0, drift=drift))
        runs.append(oscillation({axis: 0.3}, 1.0, attack=drift))
    for pair, phase in product(("pq", "pr", "qr"), (0.0, 0.5)):
        both = oscillation(dict.fromkeys(pair, 0.3), 1.0, phase)
        runs.append(replace(both, kind=TWO, words=both.words.replace("oscillation", TWO)))
    return runs


def steady(kind, speed, drift, attack, turn=(0.0, 0.0, 0.0), planes=(0.0, 0.0, 0.0), propeller=1.0) -> Run:
    """A run at a speed, drift angle and angle of attack (degrees), p' q' r' and planes (degrees)."""
    b, a = np.radians([drift, attack])
    velocity = speed * np.array([np.cos(a) * np.cos(b), -np.sin(b), np.sin(a) * np.cos(b)])
    words = [
        f"U/U0 {speed:g}" * (speed != 1.0),
        f"drift {drift:g}°" * bool(drift),
        f"attack {attack:g}°" * bool(attack),
    ]
    words += [f"{name}' {x:g}" for name, x in zip("pqr", turn, strict=True) if x]
    names = ("rudder", "bow planes", "stern planes")
    words += [f"{name} {x:g}°" for name, x in zip(names, planes, strict=True) if x]
    words += [f"n/n0 {propeller:g}" * (propeller != 1.0)]
    text = f"{kind}: {', '.join(filter(None, words)) or 'straight'}"
    velocities = np.concatenate([velocity, turn])[None]
    return Run(kind, text, velocities, np.zeros((1, 6)), tuple(np.radians(planes)), propeller)


def oscillation(sizes: dict[str, float], frequency, phase=0.0, drift=0.0, attack=0.0) -> Run:
    """Velocities that oscillate about a tow, of sizes and a frequency w L / U, the second of two a part of pi later."""
    b, a = np.radians([drift, attack])
    velocities, accelerations = np.zeros((2, PHASES, 6))
    velocities[:, :3] = [np.cos(a) * np.cos(b), -np.sin(b), np.sin(a) * np.cos(b)]
    turn = 2.0 * np.pi * np.arange(PHASES) / PHASES
    for k, (name, size) in enumerate(sizes.items()):
        column, at = "uvwpqr".index(name), turn + k * phase * np.pi
        velocities[:, column] += size * np.sin(at)
        accelerations[:, column] += size * frequency * np.cos(at)
    what = " and ".join(f"{name}' {size:g}" for name, size in sizes.items())
    about = f", drift {drift:g}°" * bool(drift) + f", attack {attack:g}°" * bool(attack)
    later = f", {180 * phase:g}° apart" * (len(sizes) > 1)
    return Run(
        "planar motion", f"oscillation: {what} at {frequency:g}{later}{about}", velocities, accelerations, (0.0,) * 3
    )


class Tank:
    """A vehicle in a tank: for each run what its forces say of the coefficients, axis by axis.

    Parameters
    ----------
    boat : vehicle
    runs : that the tank can make
    """

    def __init__(self, boat: Vehicle, runs: list[Run]):
        self.boat, self.runs = boat, runs
        self.columns = {axis: boat.equations.columns(boat.equations.names_of_axis(axis)) for axis in AXES}
        self.matrices = [self._forces(run) for run in runs]  # axis -> (n, n_axis) forces for coefficients of one
        largest = {
            axis: max(np.abs(m[axis] @ boat.xi[self.columns[axis]]).max() for m in self.matrices) for axis in AXES
        }
        self.sds = {axis: BALANCE * size for axis, size in largest.items()}  # dimensionless, as all forces

    def _forces(self, run: Run) -> dict[str, np.ndarray]:
        controls = np.tile([*run.planes, run.propeller], (len(run.velocities), 1))
        return forces(self.boat, run.velocities, run.accelerations, controls)

    def spectra(self, kinds: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Axis -> singular values of the forces of all runs of some kinds, of columns scaled to unit length if any."""
        found = {}
        for axis in AXES:
            whole = np.concatenate(
                [m[axis] for m, run in zip(self.matrices, self.runs, strict=True) if run.kind in kinds]
            )
            sizes = np.linalg.norm(whole, axis=0)
            found[axis] = np.linalg.svd(whole / np.where(sizes > 0.0, sizes, 1.0), compute_uv=False)
        return found

    def rows(self, k: int, names: list[str], scales: np.ndarray) -> np.ndarray:
        """(n_rows, n) derivatives of the forces of a run, in their sds, by coefficients in units of scales (n,)."""
        places = {name: i for i, name in enumerate(names)}
        blocks = []
        for axis, matrix in self.matrices[k].items():
            full = np.zeros((len(matrix), len(names)))
            of_axis = self.boat.equations.names_of_axis(axis)
            own = [i for i, name in enumerate(of_axis) if name in places]
            full[:, [places[of_axis[i]] for i in own]] = matrix[:, own] / self.sds[axis]
            blocks.append(full * scales)
        whole = np.concatenate(blocks)
        return whole if len(whole) <= len(AXES) else np.linalg.qr(whole, mode="r")

    def measure(self, k: int, xi: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Axis -> (n,) forces that a boat with coefficients (n_terms,) has in a run, with errors."""
        exact = {axis: matrix @ xi[self.columns[axis]] for axis, matrix in self.matrices[k].items()}
        return {axis: force + self.sds[axis] * rng.standard_normal(len(force)) for axis, force in exact.items()}


def write(path: Path, tank: Tank, chosen: list[int], loads: list[dict[str, np.ndarray]]) -> None:
    """A table of captive runs as ``bayesub new vehicle --captive`` reads it, with the forces of each run."""
    boat = tank.boat
    planes = [control.column for control in boat.equations.controls]
    headers = [f"{axis}_prime{suffix}" for suffix in ("", "_sd") for axis in AXES]
    errors = [float(tank.sds[axis]) for axis in AXES]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([LABEL, *MOTION, *planes, PROPELLER, *headers])
        for k, measured in zip(chosen, loads, strict=True):
            run = tank.runs[k]
            for row, (velocity, rate) in enumerate(zip(run.velocities, run.accelerations, strict=True)):
                cells = [float(measured[axis][row]) for axis in AXES]
                table.writerow([run.kind, *velocity, *rate, *np.degrees(run.planes), run.propeller, *cells, *errors])


class Knowledge:
    """Relative covariance (n, n) of coefficients, and how it shrinks with further readings."""

    def __init__(self, covariance: np.ndarray):
        self.covariance = covariance

    @property
    def sds(self) -> np.ndarray:
        """(n,) relative sds."""
        return np.sqrt(np.diag(self.covariance))

    def known(self, share: float) -> int:
        """How many are known to a share of their value."""
        return int(np.count_nonzero(self.sds <= share))

    def after(self, rows: np.ndarray) -> "Knowledge":
        """With further readings, (n_rows, n) their derivatives in their sds."""
        across = rows @ self.covariance
        gain = np.linalg.solve(np.eye(len(rows)) + across @ rows.T, across)
        return Knowledge(self.covariance - across.T @ gain)

    def worth(self, rows: np.ndarray, share: float) -> float:
        """What further readings leave of the mean logarithm of the sds, of which none counts below the share."""
        across = rows @ self.covariance
        gain = np.linalg.solve(np.eye(len(rows)) + across @ rows.T, across)
        left = np.maximum(np.diag(self.covariance) - np.sum(across * gain, axis=0), 1e-30)
        return float(np.mean(np.log(np.maximum(np.sqrt(left), share))))


def choose(begin: Knowledge, rows: list[np.ndarray], n: int, share: float) -> tuple[list[int], list[Knowledge]]:
    """The n runs that are best one after the other, and what is known after each; a run may be made again."""
    chosen, states = [], [begin]
    for _ in range(n):
        best = min(range(len(rows)), key=lambda k: states[-1].worth(rows[k], share))
        chosen.append(best)
        states.append(states[-1].after(rows[best]))
    return chosen, states
