"""MAVLink and ArduPilot: .bin and .log of the autopilot, .tlog of the ground station, by pymavlink."""

import contextlib
import io
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Collection, Signal, VehicleLog, library, numbers

DESCRIPTIONS = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "BAD_DATA")  # messages about messages
CLOCKS = ("TimeUS", "TimeMS", "time_boot_ms", "time_usec")
_DECIMAL = {"degE5": 1e-5, "mdeg": 1e-3, "dm/s": 0.1, "dm": 0.1}  # units of the messages that are not ours


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read all messages, or those that the map names; a signal is ``ATTITUDE.yaw``, of instances ``GPS[0].Lat``.

    Times of a .bin are those of the autopilot since it started. Those of a .tlog are of the ground station when the
    message came; a message with its own time since the start keeps that, on the clock of the ground station.
    """
    mavutil = library("pymavlink.mavutil", "pymavlink", path)
    types = {
        section.signal.rpartition("/")[2].partition(".")[0].partition("[")[0] for section in log_map.columns.values()
    }
    os.environ["PYMAVLINK_FAST_INDEX"] = "0"  # the fast one writes to the terminal, beside Python, what is damaged
    complaints, collection = io.StringIO(), Collection()
    with contextlib.redirect_stdout(complaints), contextlib.redirect_stderr(complaints):
        source = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
        with contextlib.closing(source):
            messages = iter(lambda: source.recv_match(type=types or None), None)
            messages = (message for message in messages if message.get_type() not in DESCRIPTIONS)
            if hasattr(source, "formats"):
                _collect_bin(messages, collection)
            else:
                _collect_telemetry(list(messages), collection)
    remarks = ("parts of the file are damaged and left out",) if "bad header" in complaints.getvalue().lower() else ()
    return VehicleLog(path, {name: _scaled(signal) for name, signal in collection.signals().items()}, remarks)


def _collect_bin(messages, collection: Collection) -> None:
    """Add the fields of the messages of a .bin; one type has a signal for each instrument, ``GPS[0]``."""
    for message in messages:
        instance = message.fmt.instance_field
        head = message.get_type() + ("" if instance is None else f"[{getattr(message, instance)}]")
        _add(message, head, message.fmt.get_unit, _time(message, None), collection)


def _collect_telemetry(messages, collection: Collection) -> None:
    """Add the fields of the messages of a .tlog; what several systems send has their numbers, ``1.1/ATTITUDE``."""
    offset, n_systems = _boot_time(messages), _senders(messages)
    for message in messages:
        head = _sender(message, n_systems)
        _add(
            message,
            head,
            lambda name, m=message: m.fieldunits_by_name.get(name, ""),
            _time(message, offset),
            collection,
        )


def _add(message, head: str, unit: Callable[[str], str], time: float, collection: Collection) -> None:
    for field in message.get_fieldnames():
        if field not in CLOCKS:
            for name, value in numbers(getattr(message, field), field):
                collection.add(f"{head}.{name}", time, value, unit(field))


def _senders(messages) -> dict[str, int]:
    """How many systems send each type of message."""
    pairs = {(message.get_type(), message.get_srcSystem(), message.get_srcComponent()) for message in messages}
    return Counter(kind for kind, _, _ in pairs)


def _sender(message, n_systems: dict[str, int]) -> str:
    """The type of a message of a .tlog, after the numbers of system and component if several send it."""
    kind = message.get_type()
    if n_systems[kind] == 1:
        return kind
    return f"{message.get_srcSystem()}.{message.get_srcComponent()}/{kind}"


def _boot_time(messages) -> float | None:
    """When the autopilot started, by the clock of the ground station: the message that was quickest tells."""
    delays = [message._timestamp - message.time_boot_ms * 1e-3 for message in messages if _has_boot_time(message)]
    return min(delays, default=None)


def _has_boot_time(message) -> bool:
    return getattr(message, "time_boot_ms", 0) > 0


def _time(message, offset: float | None) -> float:
    """The time of a message, s: of a .bin since the autopilot started, otherwise of the ground station."""
    for field, unit in (("TimeUS", 1e-6), ("TimeMS", 1e-3)):
        if hasattr(message, field):
            return getattr(message, field) * unit
    return message.time_boot_ms * 1e-3 + offset if _has_boot_time(message) else message._timestamp


def _scaled(signal: Signal) -> Signal:
    """A signal whose unit is a decimal part of one that is known is brought to that."""
    if signal.unit not in _DECIMAL:
        return signal
    unit = signal.unit.removesuffix("E5").removeprefix("m") if "deg" in signal.unit else signal.unit.removeprefix("d")
    return Signal(signal.times, np.asarray(signal.values) * _DECIMAL[signal.unit], unit)
