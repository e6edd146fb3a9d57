"""What the simulators share: orders in steps, tables, and vehicle files that are changed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np

import bayesub as bs

load = bs.load_vehicle


def held(orders: Sequence[tuple[float, float]], time: float) -> float:
    """The order at a time, s, of pairs of time and value; zero before the first."""
    value = 0.0
    for begin, order in orders:
        if begin > time:
            break
        value = order
    return value


def columns(names: str, rows: Sequence[tuple[float, ...]]) -> dict[str, np.ndarray]:
    """Name -> (n,) column of rows, of names with blanks between."""
    return dict(zip(names.split(), np.array(rows).T, strict=True))


def changed(name: str, folder: Path, texts: Mapping[str, str], coefficients: Mapping[str, float]) -> bs.Vehicle:
    """A built-in vehicle whose file has other texts, and coefficients after its own, loaded from a folder."""
    text = (resources.files("bayesub") / f"data/vehicles/{name}.toml").read_text(encoding="utf-8")
    for old, new in texts.items():
        if old not in text:
            raise ValueError(f"the vehicle {name} has no {old}")
        text = text.replace(old, new)
    text += "".join(f"{key} = {value}\n" for key, value in coefficients.items())
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return bs.load_vehicle(path)


def without(vehicle: bs.Vehicle, names: Sequence[str]) -> bs.Vehicle:
    """The vehicle with coefficients at zero, where they are held."""
    xi = vehicle.xi.copy()
    xi[vehicle.equations.columns(names)] = 0.0
    return replace(vehicle, xi=xi)
