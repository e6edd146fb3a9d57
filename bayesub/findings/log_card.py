"""The card of a log: which of its columns disagree with each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.logs import consistency, log_files
from bayesub.model.actuators import values_of_log, with_commands
from bayesub.model.vehicles import Vehicle


@dataclass(frozen=True)
class LogCard:
    """Which columns of a log disagree."""

    findings: tuple[consistency.Finding, ...]  # one for each disagreement

    def lines(self) -> list[str]:
        """The card in words, a line a finding."""
        return [finding.line() for finding in self.findings] or ["no column contradicts another"]

    def to_json(self) -> dict:
        """The findings."""
        return {"findings": [finding.to_json() for finding in self.findings]}


def check(
    log: dict[str, np.ndarray], headers: Sequence[str], controls: Sequence[str] = (), vehicle: Vehicle | None = None
) -> LogCard:
    """The card of a log.

    `log` (n,): of :func:`bayesub.logs.log_files.read_log`; times need not ascend; `headers`: the columns of its file in
    their order; `controls`: columns of a vehicle's own; `vehicle`: whose fins are taken together as rudder and planes.
    """
    names = {log_files.short_name(header): header for header in headers}
    if vehicle is not None and not vehicle.actuators.direct:
        for name, (values, fins) in _together(log, vehicle).items():
            log, names = log | {name: values}, names | {name: ", ".join(fins)}
    return LogCard(tuple(consistency.findings(log, names, tuple(controls))))


def joined(cards: Sequence[LogCard]) -> LogCard:
    """The card of a log that was examined part by part, with the first finding of each kind on each column."""
    found = {(finding.kind, finding.columns): finding for card in cards[::-1] for finding in card.findings[::-1]}
    return LogCard(tuple(found.values())[::-1])


def _together(log, vehicle) -> dict[str, tuple[np.ndarray, tuple[str, ...]]]:
    """Short name of a control of the equations -> its history (n,) by the fins of the log, and their columns."""
    actuators, times = vehicle.actuators, np.arange(len(log["time"]))
    angles, _ = with_commands(log, actuators)
    angles = {name: angles[name] for name in actuators.shorts if name in angles and np.isfinite(angles[name]).any()}
    if not angles:
        return {}
    whole = {name: np.interp(times, times[read := np.isfinite(angle)], angle[read]) for name, angle in angles.items()}
    mixed = actuators.mixed(values_of_log(actuators, whole, len(times), "the log"))
    result = {}
    for k, control in enumerate(vehicle.equations.controls):
        moved = zip(actuators.shorts, actuators.columns, actuators.mixing[k], strict=True)
        columns = tuple(column for short, column, part in moved if part and short in angles)
        if columns and control.short not in log:
            result[control.short] = mixed[:, k], columns
    return result
