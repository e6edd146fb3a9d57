"""Simulated motion: what :func:`bayesub.simulate` returns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayesub.io.equality import ByContent
from bayesub.io.notebook import Displayed
from bayesub.logs import log_files
from bayesub.logs.log_files import ACCELERATIONS

if TYPE_CHECKING:
    from bayesub.model.simulator import Simulator


@dataclass(frozen=True, eq=False)
class Trajectory(ByContent, Displayed):
    """Simulated motion of a batch."""

    times: np.ndarray  # (n_times,), s
    states: np.ndarray  # (n_batch, n_times, 12), m, rad, m/s, rad/s; not a number from the failure of a member on
    controls: np.ndarray  # (n_times, n_controls) of the equations, SI units, at `times`
    rpm: np.ndarray  # (n_times,) at `times`
    status: np.ndarray  # (n_batch,) of "ok", "diverged" or "left_envelope"
    simulator: Simulator  # what was run, so that the motion can be sampled at other times
    xi: np.ndarray  # (n_batch, n_terms) coefficients that were run

    @cached_property
    def accelerations(self) -> np.ndarray:
        """(n_batch, n_times, 6) udot vdot wdot (m/s^2) and pdot qdot rdot (rad/s^2), from the equations of motion."""
        return self.simulator.accelerations(self.xi, self.states)

    @property
    def log(self) -> dict[str, np.ndarray]:
        """Short name -> (n_times,) histories as a log has them: of actuators, and of a propeller speed that acts."""
        simulator = self.simulator
        vehicle, values = simulator.vehicle, simulator.histories.logged(self.times)
        histories = {"rpm": self.rpm} | dict(zip(vehicle.actuators.shorts, values.T, strict=True))
        return {simulator.manoeuvre.logged(name): histories[name] for name in vehicle.inputs}

    def resampled(self, times: np.ndarray) -> Trajectory:
        """The same motion at other output times (s), which must not descend."""
        return self.simulator.at(times).trajectory(self.xi)

    def outputs(self, names: Iterable[str]) -> np.ndarray:
        """(n_batch, n_times, n_names) states and accelerations by their short names."""
        columns = dict(zip(log_files.STATES, np.moveaxis(self.states, -1, 0), strict=True))
        if not set(names) <= columns.keys():
            columns |= zip(ACCELERATIONS, np.moveaxis(self.accelerations, -1, 0), strict=True)
        return np.stack([columns[name] for name in names], axis=-1)

    def save(self, path: str | Path, member: int = 0) -> None:
        """Write one member with its controls and accelerations as a track CSV."""
        log = {"time": self.times} | self.log
        log |= dict(zip(log_files.STATES, self.states[member].T, strict=True))
        log |= dict(zip(ACCELERATIONS, self.accelerations[member].T, strict=True))
        log_files.write_log(Path(path), log)
