"""MAVLink and ArduPilot: .bin and .log of the autopilot, .tlog of the ground station, by pymavlink."""

import contextlib
import io
import os
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Collection, Signal, VehicleLog, library

DESCRIPTIONS = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "BAD_DATA")  # messages about messages
CLOCKS = ("TimeUS", "TimeMS", "time_boot_ms", "time_usec")
# Units of the messages that are not ours -> ours in one of them, and ours.
_DECIMAL = {"degE5": (1e-5, "deg"), "mdeg": (1e-3, "deg"), "dm/s": (0.1, "m/s"), "dm": (0.1, "m")}


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read all messages, or those that the map names; a signal is ``ATTITUDE.yaw``, of instances ``GPS[0].Lat``.

    Times of a .bin are those of the autopilot since it started. Those of a .tlog are of the ground station when the
    message came; a message with its own time since the start keeps that, on the clock of the ground station.
    """
    mavutil = library("pymavlink.mavutil", path)
    names = (section.signal.rpartition("/")[2] for section in log_map.columns.values())
    types = {name.partition(".")[0].partition("[")[0] for name in names}
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
    signals = {}
    for name, signal in collection.signals().items():
        factor, unit = _DECIMAL.get(signal.unit, (1.0, signal.unit))
        signals[name] = Signal(signal.times, signal.values * factor, unit)
    remarks = ("parts of the file are damaged and left out",) if "bad header" in complaints.getvalue().lower() else ()
    return VehicleLog(path, signals, remarks)


def _collect_bin(messages: Iterable[Any], collection: Collection) -> None:
    """Add the fields of the messages of a .bin; one type has a signal for each instrument, ``GPS[0]``."""
    for message in messages:
        instance = message.fmt.instance_field
        head = message.get_type() + ("" if instance is None else f"[{getattr(message, instance)}]")
        if hasattr(message, "TimeUS"):
            time = message.TimeUS * 1e-6
        else:
            time = message.TimeMS * 1e-3 if hasattr(message, "TimeMS") else message._timestamp
        _add(collection, message, head, time, message.fmt.get_unit)


def _collect_telemetry(messages: list[Any], collection: Collection) -> None:
    """Add the fields of the messages of a .tlog; what several systems send has their numbers, ``1.1/ATTITUDE``."""
    timed = [message for message in messages if getattr(message, "time_boot_ms", 0) > 0]
    # When the autopilot started, by the clock of the ground station: the message that was quickest tells.
    start = min((message._timestamp - message.time_boot_ms * 1e-3 for message in timed), default=0.0)
    senders = {(message.get_type(), message.get_srcSystem(), message.get_srcComponent()) for message in messages}
    n_senders = Counter(kind for kind, _, _ in senders)
    for message in messages:
        head = message.get_type()
        if n_senders[head] > 1:
            head = f"{message.get_srcSystem()}.{message.get_srcComponent()}/{head}"
        head += f"[{message.name}]" if message.get_type().startswith("NAMED_VALUE") else ""
        since_start = getattr(message, "time_boot_ms", 0)
        time = since_start * 1e-3 + start if since_start > 0 else message._timestamp
        _add(collection, message, head, time, message.fieldunits_by_name.get)


def _add(collection: Collection, message: Any, head: str, time: float, unit: Callable[[str], str | None]) -> None:
    for field in message.get_fieldnames():
        if field not in CLOCKS:
            collection.add(f"{head}.{field}", time, getattr(message, field), unit(field) or "")
