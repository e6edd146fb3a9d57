"""PX4: the ULog (.ulg) of its logger, by pyulog."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np

from bayesub.logs.log_map import LogMap
from bayesub.logs.readers.signals import LONGEST_ARRAY, Signal, VehicleLog, euler_angles, library

# Topic and field -> unit, by the definitions of PX4's messages.
_UNITS = (
    (r"angular_acceleration\.xyz\[\d\]$", "rad/s2"),
    (r"(gps_position|sensor_gps)\.(lat|lon)$", "degE7"),
    (r"(gps_position|sensor_gps)\.(alt|alt_ellipsoid)$", "mm"),
    (r"(attitude|local_position)\.(roll|pitch|yaw|heading)$|\.cog_rad$", "rad"),
    (r"rates_setpoint\.(roll|pitch|yaw)$|\.(roll|pitch|yaw)speed$|\.gyro_rad\[\d\]$|angular_velocity\.xyz\[", "rad/s"),
    (r"position\.(x|y|z|alt|altitude)$|\.(depth|distance_bottom)$", "m"),
    (r"\.(vx|vy|vz|vel_[ned]|vel_[ned]_m_s|vel_m_s|velocity\[\d\])$", "m/s"),
    (r"global_position.*\.(lat|lon)$|\.(latitude_deg|longitude_deg)$", "deg"),
    (r"accelerometer_m_s2\[\d\]$", "m/s2"),
    (r"pressure_pa$", "Pa"),
)


def read(path: Path, log_map: LogMap) -> VehicleLog:
    """Read all topics, or those that the map names; a signal is ``vehicle_attitude.yaw``, of instances ``NAME[1].yaw``.

    Times are those of the autopilot since it started. A quaternion ``q`` has ``roll``, ``pitch`` and ``yaw`` beside it.
    """
    names = {re.split(r"[.\[]", section.signal)[0] for section in log_map.columns.values()}
    pyulog = library("pyulog", path)
    with path.open("rb") as file, contextlib.redirect_stdout(io.StringIO()):  # it prints what is damaged
        content = pyulog.ULog(file, sorted(names) or None)
    several = {data.name for data in content.data_list if data.multi_id}
    signals = {}
    for data in content.data_list:
        head = f"{data.name}[{data.multi_id}]" if data.name in several else data.name
        fields, times = data.data, data.data["timestamp"] * 1e-6
        if "q[3]" in fields:
            angles = euler_angles(*(fields[f"q[{k}]"] for k in (1, 2, 3, 0)))
            fields = fields | dict(zip(("roll", "pitch", "yaw"), angles, strict=True))
        for field, values in fields.items():
            place = re.search(r"\[(\d+)\]$", field)
            if not field.startswith("timestamp") and (place is None or int(place[1]) < LONGEST_ARRAY):
                name = f"{head}.{field}"
                unit = next((unit for pattern, unit in _UNITS if re.search(pattern, f"{data.name}.{field}")), "")
                signals[name] = Signal(times, np.asarray(values, dtype=float), unit)
    lost = sum(dropout.duration for dropout in content.dropouts) * 1e-3
    remarks = [f"the logger lost {lost:.3g} s in {len(content.dropouts)} pieces"] if content.dropouts else []
    remarks += ["parts of the file are damaged and left out"] if content.file_corruption else []
    return VehicleLog(path, signals, tuple(remarks))
