"""ROS bags, of ROS 2 (folder, .mcap, .db3) and ROS 1 (.bag), by rosbags."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import LONGEST_ARRAY, Collection, VehicleLog, euler_angles, library

# Fields of common messages, whose units are those of REP 103.
_UNITS = (
    (r"orientation\.(roll|pitch|yaw)$", "rad"),
    (r"angular_velocity\.[xyz]$|twist\.angular\.[xyz]$|^angular\.[xyz]$", "rad/s"),
    (r"linear_acceleration\.[xyz]$", "m/s2"),
    (r"twist\.linear\.[xyz]$|^linear\.[xyz]$", "m/s"),
    (r"position\.[xyz]$", "m"),
    (r"^(latitude|longitude)$", "deg"),
    (r"^fluid_pressure$", "Pa"),
)


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read all topics, or those that the map names; a signal is ``/imu.angular_velocity.z``.

    Times are those of the header of a message, or else when the bag recorded it. A quaternion has ``roll``, ``pitch``
    and ``yaw`` beside it, in the axes of the message: x forward, y to port and z up, if it follows REP 103.
    """
    typesys = library("rosbags.typesys", path)
    store = typesys.get_typestore(typesys.Stores.LATEST)
    for place in map(Path, log_map.definitions):
        if not place.exists():
            raise InputError(f"{place}: named by definitions, does not exist", "file", "definitions")
        for file in sorted(place.rglob("*.msg")) if place.is_dir() else [place]:
            folder = file.resolve().parent
            package = (folder.parent if folder.name == "msg" else folder).name
            store.register(typesys.get_types_from_msg(toml_files.read_text(file), f"{package}/msg/{file.stem}"))
    names = [section.signal for section in log_map.columns.values()]
    collection, undefined = Collection(), {}
    with library("rosbags.highlevel", path).AnyReader([path], default_typestore=store) as bag:
        connections = [c for c in bag.connections if not names or any(name.startswith(f"{c.topic}.") for name in names)]
        known = [c for c in connections if c.msgtype in bag.typestore.fielddefs]
        undefined = {c.topic: c.msgtype for c in connections if c not in known}
        for connection, stamp, raw in bag.messages(known) if known else ():
            message = bag.deserialize(raw, connection.msgtype)
            own = getattr(getattr(message, "header", None), "stamp", None)
            time = stamp * 1e-9 if own is None or not (own.sec or own.nanosec) else own.sec + own.nanosec * 1e-9
            for name, value in _fields(message):
                units = (unit for pattern, unit in _UNITS if np.isscalar(value) and re.search(pattern, name))
                collection.add(f"{connection.topic}.{name}", time, value, next(units, ""))
    remarks = tuple(
        f"{topic} is left out: the bag does not define {kind}; give its .msg file as definitions"
        for topic, kind in undefined.items()
    )
    return VehicleLog(path, collection.signals(), remarks)


def _fields(message: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of the fields of a message and of those inside of it, without time stamps."""
    labels = getattr(message, "name", None)  # as of joints, whose order may change
    for name in getattr(message, "__dataclass_fields__", {}):
        if name in ("__msgtype__", "header") or name.isupper() or name.endswith("covariance"):  # upper: constants
            continue
        value = getattr(message, name)
        if hasattr(value, "__dataclass_fields__"):
            if getattr(value, "__msgtype__", "").endswith("/Quaternion"):
                angles = euler_angles(value.x, value.y, value.z, value.w)
                for angle, radians in zip(("roll", "pitch", "yaw"), angles, strict=True):
                    yield f"{prefix}{name}.{angle}", radians
            yield from _fields(value, f"{prefix}{name}.")
        elif isinstance(value, list | tuple) and value and hasattr(value[0], "__dataclass_fields__"):
            for k, part in enumerate(value[:LONGEST_ARRAY]):
                yield from _fields(part, f"{prefix}{name}[{k}].")
        else:
            yield f"{prefix}{name}", value
            if isinstance(labels, list) and name != "name" and np.shape(value) == (len(labels),):
                yield from ((f"{prefix}{name}[{label}]", float(x)) for label, x in zip(labels, value, strict=True))
