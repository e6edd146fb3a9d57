"""LSTS logs of IMC messages (.lsf, .lsf.gz), as DUNE writes them on a LAUV, by imcpy."""

import gzip
import io
from pathlib import Path

from bayesub.io import toml_files
from bayesub.io.errors import InputError
from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import Collection, VehicleLog, library, numbers

SYNC = (0xFE54).to_bytes(2, "little")
HEADER, FOOTER = 20, 2  # bytes
HEADER_FIELDS = {"timestamp", "src", "src_ent", "dst", "dst_ent"}
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
    "Depth": {"value": "m"},
    "ServoPosition": {"value": "rad"},
    "SetServoPosition": {"value": "rad"},
    "Rpm": {"value": "rpm"},
    "Pressure": {"value": "hPa"},
}


def read(path: Path, log_map: LogMap) -> VehicleLog:  # noqa: ARG001
    """Read all messages; a signal is ``EulerAngles.psi``.

    Where several entities send a message its name is ``EulerAngles@AHRS.psi``, and of messages that are numbered, such
    as those of servos, ``ServoPosition[0].value``.
    """
    imcpy = library("imcpy", "imcpy", path)
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
    collection, fields = Collection(), {}
    for message in messages:
        kind = type(message).__name__
        if kind not in fields:
            fields[kind] = [k for k, v in type(message).__dict__.items() if isinstance(v, property)]
        sender = (message.src, message.src_ent)
        head = kind + (f"[{message.id}]" if "id" in fields[kind] and isinstance(message.id, int) else "")
        if len(senders[kind]) > 1:
            head += f"@{entities.get(sender, f'{sender[0]}.{sender[1]}')}"
        for field in fields[kind]:
            for name, value in numbers(getattr(message, field), field) if field != "id" else ():
                collection.add(f"{head}.{name}", message.timestamp, value, _unit(kind, field))
        if kind == "EstimatedState":
            latitude, longitude, _ = imcpy.coordinates.toWGS84(message)
            collection.add(f"{head}.latitude", message.timestamp, latitude, "rad")
            collection.add(f"{head}.longitude", message.timestamp, longitude, "rad")
    remarks = [] if is_whole else ["the file ends within a message; what comes before is read"]
    remarks += [f"{n_wrong} messages of another version of IMC are left out"] if n_wrong else []
    return VehicleLog(path, collection.signals(), tuple(remarks))


def _packets(path: Path) -> tuple[list[bytes], bool]:
    """The messages of a file as bytes, and whether the last is whole."""
    with toml_files.reading(path):
        content = path.read_bytes()
    is_whole = True
    if content.startswith(b"\x1f\x8b"):
        content, is_whole = _unzip(content)
    if not content.startswith(SYNC):
        raise InputError(
            f"{path}: does not begin with a message of IMC; expected the Data.lsf or Data.lsf.gz of a mission", "format"
        )
    packets, begin = [], 0
    while begin < len(content):
        if content[begin : begin + 2] != SYNC:
            begin, is_whole = content.find(SYNC, begin), False
            if begin < 0:
                break
            continue
        end = begin + HEADER + int.from_bytes(content[begin + 4 : begin + 6], "little") + FOOTER
        if end > len(content) or begin + HEADER > len(content):
            is_whole = False
            break
        packets.append(content[begin:end])
        begin = end
    return packets, is_whole


def _unzip(content: bytes) -> tuple[bytes, bool]:
    """What a gzip file holds, up to where it breaks off, and whether it is whole."""
    parts = []
    with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
        try:
            while part := file.read1(1 << 20):
                parts.append(part)
        except (EOFError, OSError):
            return b"".join(parts), False
    return b"".join(parts), True


def _unit(kind: str, field: str) -> str:
    return (_UNITS[""] | _UNITS.get(kind, {})).get(field, "")
