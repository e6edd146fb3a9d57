"""LSTS logs of IMC messages (.lsf, .lsf.gz), as DUNE writes them on a LAUV, by imcpy."""

import gzip
import io
from collections import Counter
from pathlib import Path

from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Collection, VehicleLog, library

SYNC = (0xFE54).to_bytes(2, "little")
HEADER, FOOTER = 20, 2  # bytes
_ANGLES = dict.fromkeys(("phi", "theta", "psi", "lat", "lon", "latitude", "longitude", "cog"), "rad")
_MOTION = dict.fromkeys("uvw", "m/s") | dict.fromkeys("pqr", "rad/s") | dict.fromkeys(("vx", "vy", "vz"), "m/s")
_MOTION |= dict.fromkeys(("x", "y", "z", "depth", "height", "alt"), "m")
# Message, or all with the empty name -> field -> unit, by the specification of IMC.
_UNITS = {
    "": _ANGLES | {"sog": "m/s"},
    "EstimatedState": _MOTION,
    "AngularVelocity": dict.fromkeys("xyz", "rad/s"),
    "Acceleration": dict.fromkeys("xyz", "m/s2"),
    "GroundVelocity": dict.fromkeys("xyz", "m/s"),
    "WaterVelocity": dict.fromkeys("xyz", "m/s"),
    "EstimatedStreamVelocity": dict.fromkeys("xyz", "m/s"),
    "DesiredVelocity": _MOTION,
    "SimulatedState": _MOTION | dict.fromkeys(("svx", "svy", "svz"), "m/s"),
}
_VALUES = {"m": "Depth DepthOffset Distance", "rpm": "Rpm", "hPa": "Pressure", "rad/s": "DesiredHeadingRate"}
_VALUES |= {"rad": "ServoPosition SetServoPosition DesiredHeading DesiredPitch DesiredRoll"}
_VALUES |= {"m/s": "IndicatedSpeed TrueSpeed SoundSpeed"}
_UNITS |= {kind: {"value": unit} for unit, kinds in _VALUES.items() for kind in kinds.split()}
# Fields that say the unit of value or z, and what they say -> unit.
_UNIT_FIELDS = ("speed_units", "z_units")
_SAID = {"METERS_PS": "m/s", "RPM": "rpm", "DEPTH": "m", "ALTITUDE": "m", "HEIGHT": "m"}


def read(path: Path, log_map: LogMap) -> VehicleLog:  # noqa: ARG001
    """Read all messages; a signal is ``EulerAngles.psi``.

    Where several entities send a message its name is ``EulerAngles@AHRS.psi``, and of messages that are numbered, such
    as those of servos, ``ServoPosition[0].value``; a value with its own unit has that, ``DesiredSpeed.value[RPM]``.
    """
    imcpy = library("imcpy", path)
    packets, is_whole = _packets(path)
    messages, n_wrong = [], 0
    for packet in packets:
        try:
            messages.append(imcpy.Packet.deserialize(packet))
        except Exception:  # a message of another version of IMC, or a sum that does not fit
            n_wrong += 1
    entities = {(m.src, m.src_ent): m.label for m in messages if type(m).__name__ == "EntityInfo"}
    senders: dict[str, set[tuple[int, int]]] = {}
    for message in messages:
        senders.setdefault(type(message).__name__, set()).add((message.src, message.src_ent))
    labels = Counter(entities.values())
    collection, fields = Collection(), {}
    for message in messages:
        kind = type(message).__name__
        if kind not in fields:
            fields[kind] = [k for k, v in type(message).__dict__.items() if isinstance(v, property)]
        sender = (message.src, message.src_ent)
        head = kind + (f"[{message.id}]" if "id" in fields[kind] and isinstance(message.id, int) else "")
        if len(senders[kind]) > 1:
            label = entities.get(sender, "")  # two vehicles may have entities of one name
            head += f"@{label}" if labels[label] == 1 else f"@{sender[0]}.{label or sender[1]}"
        units = _UNITS[""] | _UNITS.get(kind, {})
        for field in fields[kind]:
            name, unit = f"{head}.{field}", units.get(field, "")
            for key in _UNIT_FIELDS if field in ("value", "z") else ():
                if key in fields[kind]:
                    said = getattr(message, key).name
                    name, unit = f"{name}[{said}]", _SAID.get(said, "")
            if field != "id":
                collection.add(name, message.timestamp, getattr(message, field), unit)
        if kind == "EstimatedState":
            latitude, longitude, _ = imcpy.coordinates.toWGS84(message)
            collection.add(f"{head}.latitude", message.timestamp, latitude, "rad")
            collection.add(f"{head}.longitude", message.timestamp, longitude, "rad")
    remarks = [] if is_whole else ["the file ends within a message; what comes before is read"]
    remarks += [f"{n_wrong} messages of another version of IMC are left out"] if n_wrong else []
    return VehicleLog(path, collection.signals(), tuple(remarks))


def _packets(path: Path) -> tuple[list[bytes], bool]:
    """The messages of a file as bytes, and whether the last is whole."""
    content, is_whole = path.read_bytes(), True
    if content.startswith(b"\x1f\x8b"):
        parts = []
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            try:
                while part := file.read1(1 << 20):
                    parts.append(part)
            except (EOFError, OSError):  # it breaks off
                is_whole = False
        content = b"".join(parts)
    if not content.startswith(SYNC):
        message = f"{path}: does not begin with a message of IMC; expected the Data.lsf or Data.lsf.gz of a mission"
        raise InputError(message, "format")
    packets, begin = [], 0
    while 0 <= begin < len(content):
        if content[begin : begin + 2] != SYNC:
            begin, is_whole = content.find(SYNC, begin), False
            continue
        end = begin + HEADER + int.from_bytes(content[begin + 4 : begin + 6], "little") + FOOTER
        if end > len(content) or begin + HEADER > len(content):
            is_whole = False
            break
        packets.append(content[begin:end])
        begin = end
    return packets, is_whole
