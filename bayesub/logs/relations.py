"""What kinematics says of the columns of a log: which are the rates of change of which.

Differences of a noisy column are noisier still, so that changes over windows are compared with integrals of the rates
over the same windows, for windows of several lengths. The equations are those of the model manual, section 1.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bayesub.logs.series import ANGLES, WINDOWS, Series, lengths, windows

_TINY = 1e-300
_ROUND_OFF = 1e-9  # of the largest position or angle
PIECES, HALF = 16, 0.5  # over which what goes apart is averaged; share of the motion from which on it counts


@dataclass(frozen=True)
class Misfit:
    """How far changes are from the integrals of rates, for windows of one length."""

    share: float  # root mean square of the difference over that of the changes
    rms: float  # root mean square of the difference over the length of the window, in SI units of the rate
    correlation: float  # between changes and integrals


def _difference(change: np.ndarray, by_rates: np.ndarray, elapsed: np.ndarray) -> Misfit:
    off, size = _rms(change - by_rates), max(_TINY, _rms(change))
    correlation = np.sum(change * by_rates) / max(_TINY, len(change) * size * _rms(by_rates))
    return Misfit(off / size, off / _rms(elapsed), float(correlation))


def _rms(values: np.ndarray) -> float:
    return float(np.linalg.norm(values)) / len(values) ** 0.5


Data = dict[str, Series]


@dataclass(frozen=True)
class Relation:
    """Columns whose changes are the integrals of functions of others; all are given by short name."""

    words: str  # what is compared
    targets: tuple[str, ...]  # positions or angles
    needed: tuple[str, ...]  # columns that their rates are made of
    rates: Callable  # short name -> values (n,) of the columns, or zero of those that are not there, to rates (.., n)
    optional: tuple[str, ...] = ()  # columns that count as zero if the log does not have them
    drift: bool = False  # whether the rates may be off by a constant: a current, or the zero of a gyro
    kind: str = "change"  # or ``length`` of the change, or ``direction``, for integrals of unit vectors

    @property
    def rotation(self) -> bool:
        """Whether rates are angular."""
        return self.targets[0] in ANGLES

    def columns(self, data: Data) -> tuple[str, ...]:
        """Those that take part; none if the log lacks one that is needed."""
        if any(name not in data for name in (*self.targets, *self.needed)):
            return ()
        return (*self.targets, *self.needed, *(name for name in self.optional if name in data))

    def misfits(self, data: Data) -> tuple[Misfit, ...]:
        """One for each length of windows of which there are enough and in which anything changes, shortest first.

        There is none if too few readings are at common times.
        """
        if (compared := self._compared(data)) is None:
            return ()
        parts, at, targets, integrals = compared
        gaps = [part.gaps for part in parts.values()]
        round_off = _ROUND_OFF * max(1.0, float(np.abs(targets).max()))
        result = []
        for length in lengths(at, 2.0 * max(part.interval for part in parts.values())):
            first, last = windows(at, length, gaps)
            change, by_rates = (values[last] - values[first] for values in (targets, integrals))
            if len(first) >= WINDOWS and _rms(change) > round_off:
                result.append(self._misfit(change, by_rates, (at[last] - at[first])[:, None]))
        return tuple(result)

    def _compared(self, data: Data) -> tuple[Data, np.ndarray, np.ndarray, np.ndarray] | None:
        """Columns, times (n,) of the targets, targets and integrals of the rates (n, k); None for too few readings."""
        parts = {name: data[name] for name in self.columns(data)}
        parts = {name: part.unwrapped if name in ANGLES else part for name, part in parts.items()}
        rates = {name: part for name, part in parts.items() if name not in self.targets}
        begin = max(part.times[0] for part in parts.values())
        end = min(part.times[-1] for part in parts.values())
        finest = min(rates.values(), key=lambda part: part.interval)
        times, at = (t[(t >= begin) & (t <= end)] for t in (finest.times, parts[self.targets[0]].times))
        if min(len(times), len(at)) < 2 * WINDOWS:
            return None
        read = {name: part.at(times) for name, part in rates.items()}
        values = np.reshape(self.rates(defaultdict(float, read)), (-1, len(times)))
        steps = 0.5 * np.diff(times) * (values[:, 1:] + values[:, :-1])
        totals = np.concatenate([np.zeros_like(values[:, :1]), np.cumsum(steps, axis=1)], axis=1)
        integrals = np.stack([np.interp(at, times, total) for total in totals], axis=1)
        return parts, at, np.stack([parts[name].at(at) for name in self.targets], axis=1), integrals

    def apart(self, data: Data) -> float:
        """How far targets and integrals of the rates go apart, m or rad, noise averaged out.

        Zero if that is less than half of how far either goes.
        """
        if not self.columns(data) or (compared := self._compared(data)) is None:
            return 0.0
        pieces = [[piece.mean(axis=0) for piece in np.array_split(part, PIECES)] for part in compared[1:]]
        at, *both = (np.diff(part, axis=0) for part in pieces)
        change, by_rates = self._alike(*both)
        ways = np.cumsum([change - by_rates, change, by_rates], axis=1)
        if self.drift:
            times = np.cumsum(at)[:, None]
            ways = ways - times * (times.T @ ways / (times.T @ times))
        off, *others = np.ptp(ways, axis=1).max(axis=1)
        return float(off) if off > HALF * max(others) else 0.0

    def _alike(self, change: np.ndarray, by_rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Changes (n, k) of the targets and integrals (n, k) of rates, as the kind compares them."""
        if self.kind == "direction":
            size = np.linalg.norm(by_rates, axis=1, keepdims=True)
            by_rates = np.linalg.norm(change, axis=1, keepdims=True) * by_rates / np.maximum(size, _TINY)
        elif self.kind == "length":
            change = np.linalg.norm(change, axis=1, keepdims=True)
        return change, by_rates

    def _misfit(self, change: np.ndarray, by_rates: np.ndarray, elapsed: np.ndarray) -> Misfit:
        """Of changes (n, k) of the targets and integrals (n, k) of rates over windows of lengths (n, 1), s."""
        change, by_rates = self._alike(change, by_rates)
        misfit = _difference(change, by_rates, elapsed)
        if not self.drift:
            return misfit
        total = np.sum(elapsed**2)
        change, by_rates = (x - elapsed * (np.sum(elapsed * x, axis=0) / total) for x in (change, by_rates))
        return min(misfit, _difference(change, by_rates, elapsed), key=lambda one: one.share)


_RATES: dict[str, Callable] = {  # of angles, from the rates about the axes of the boat
    "roll": lambda v: v["p"] + np.tan(v["theta"]) * (np.sin(v["phi"]) * v["q"] + np.cos(v["phi"]) * v["r"]),
    "pitch": lambda v: np.cos(v["phi"]) * v["q"] - np.sin(v["phi"]) * v["r"],
    "yaw": lambda v: (np.sin(v["phi"]) * v["q"] + np.cos(v["phi"]) * v["r"]) / np.cos(v["theta"]),
}


def _velocity(values, suffix, heading):
    """(3, n) of body velocities, to the north, to the east and down."""
    u, v, w = (values[f"{name}{suffix}"] for name in "uvw")
    (a, b), (c, d), (e, f) = ((np.cos(values[name]), np.sin(values[name])) for name in (heading, "theta", "phi"))
    ahead, across, down = u * c + (v * f + w * e) * d, v * e - w * f, (v * f + w * e) * c - u * d
    return np.stack(np.broadcast_arrays(ahead * a - across * b, ahead * b + across * a, down))


def _unit(name):
    return lambda values: [np.cos(values[name]), np.sin(values[name])]


def relations(data: Data) -> Iterator[Relation]:
    """All relations between the columns of a log."""
    heading, track = "psi" if "psi" in data else "heading", ("x", "y")
    for name, header in (("psi", "yaw"), ("heading", "heading")):
        words = f"changes of {header} and integrals of r"
        yield Relation(words, (name,), ("r",), _RATES["yaw"], ("phi", "theta", "q"), drift=True)
    words = "changes of pitch and integrals of q"
    yield Relation(words, ("theta",), ("q",), _RATES["pitch"], ("phi", "r"), drift=True)
    words = "changes of roll and integrals of p"
    yield Relation(words, ("phi",), ("p",), _RATES["roll"], ("theta", "q", "r"), drift=True)
    words = "changes of the track and integrals of"
    yield Relation(f"{words} north and east", track, ("north", "east"), lambda v: [v["north"], v["east"]])
    for suffix, drift in (("_ground", False), ("", True)):
        u, v, w = (f"{name}{suffix}" for name in "uvw")
        body = f"{u} and {v}" if v in data else u

        def along(values, suffix=suffix):
            return _velocity(values, suffix, heading)[:2]

        def down(values, suffix=suffix):
            return _velocity(values, suffix, heading)[2]

        yield Relation(f"{words} {body}", track, (u, heading), along, (v, w, "phi", "theta"), drift)
        for depth in ("z", "depth"):
            # Without w a boat goes where it points, but for a trim, which is a drift.
            yield Relation(f"changes of {depth} and {u} with pitch", (depth,), (u, "theta"), down, (v, w, "phi"), True)
    yield Relation("lengths of the track and integrals of sog", track, ("sog",), lambda v: v["sog"], kind="length")
    yield Relation("directions of the track and cog", track, ("cog",), _unit("cog"), kind="direction")
    if not any(name in data for name in ("u", "u_ground")):
        words = "directions of the track and the heading"
        yield Relation(words, track, (heading,), _unit(heading), kind="direction")
