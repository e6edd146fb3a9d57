"""Logs of one made-up minute in all formats that `bayesub convert` reads, written by the libraries that read them.

Each writer has the file that it writes and the map of `bayesub/data/maps` in mind. The motion is in `MINUTE`.
"""

import gzip
import struct
from dataclasses import dataclass

import numpy as np

START = 1_790_000_000.0  # s since 1970
COUNTS = 1 / 0.0879  # of a servo, a degree
MIDDLE = 2048


@dataclass(frozen=True)
class Motion:
    """What the boat did, as functions of the time (s)."""

    def fin(self, t, k=0):
        return 10.0 * np.sin(0.3 * t + k)  # deg

    def rpm(self, t):
        return 900.0 if t < 30.0 else 1200.0  # an order

    def heading(self, t):
        return (350.0 + 2.0 * t) % 360.0  # passes north after 5 s

    def pitch(self, t):
        return 5.0 * np.cos(0.2 * t)

    def roll(self, t):
        return 2.0 * np.cos(0.5 * t)

    def r(self, t):  # noqa: ARG002
        return 2.0  # deg/s

    def depth(self, t):
        return 2.0 + 0.05 * t

    def latitude(self, t):
        return 41.18 + 1e-5 * t

    def longitude(self, t):
        return -8.70 + 2e-5 * t

    speed, course = 1.5, 61.0  # m/s and deg, over the ground


MINUTE = Motion()


def clocks(duration):
    """When fins, compass and GPS are written, s."""
    return [np.arange(0.0, duration, dt) for dt in (0.1, 0.2, 1.0)]


FINS, COMPASS, GPS = clocks(60.0)


def ros(folder, name="dive", storage="MCAP", with_header=True, motion=MINUTE, duration=60.0):
    """A bag of ROS 2: fins in counts, the motor's order when it changes, IMU, pressure, GPS."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    stamp, header = kinds["builtin_interfaces/msg/Time"], kinds["std_msgs/msg/Header"]
    vector, quaternion = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]

    def head(t):
        t = START + t if with_header else 0.0
        return header(stamp(int(t), round((t % 1.0) * 1e9) % 10**9), "base_link")

    def fins(t):
        counts = [MIDDLE + motion.fin(t, k) * COUNTS for k in range(4)]
        layout = kinds["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return kinds["std_msgs/msg/Float64MultiArray"](layout, np.array(counts))

    def motor(t):
        return kinds["std_msgs/msg/Float64"](motion.rpm(t) / 15.0)

    def imu(t):
        roll, pitch, yaw = np.radians([motion.roll(t), -motion.pitch(t), 90.0 - motion.heading(t)]) / 2.0
        (sr, cr), (sp, cp), (sy, cy) = ((np.sin(x), np.cos(x)) for x in (roll, pitch, yaw))
        q = quaternion(
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
        rates, zeros = vector(0.0, 0.0, -np.radians(motion.r(t))), np.zeros(9)
        return kinds["sensor_msgs/msg/Imu"](head(t), q, zeros, rates, zeros, vector(0.0, 0.0, 9.81), zeros)

    def pressure(t):
        return kinds["sensor_msgs/msg/FluidPressure"](head(t), 101325.0 + 1025.0 * 9.81 * motion.depth(t), 0.0)

    def fix(t):
        status = kinds["sensor_msgs/msg/NavSatStatus"](0, 1)
        place = motion.latitude(t), motion.longitude(t), 0.0
        return kinds["sensor_msgs/msg/NavSatFix"](head(t), status, *place, np.zeros(9), 0)

    fin_times, compass, gps = clocks(duration)
    topics = {
        "/fins": ("std_msgs/msg/Float64MultiArray", fins, fin_times),
        "/motor": ("std_msgs/msg/Float64", motor, [0.0, 30.0]),
        "/imu": ("sensor_msgs/msg/Imu", imu, compass),
        "/pressure": ("sensor_msgs/msg/FluidPressure", pressure, compass),
        "/gps/fix": ("sensor_msgs/msg/NavSatFix", fix, gps),
    }
    path = folder / name
    with Writer(path, version=9, storage_plugin=StoragePlugin[storage]) as writer:
        for topic, (kind, message, times) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=store)
            for t in times:
                late = 0.0 if topic in ("/fins", "/motor") else 0.02  # the bag records later than the header says
                stamp_ns = int(START) * 10**9 + round((t + late) * 1e9)
                writer.write(connection, stamp_ns, store.serialize_cdr(message(t), kind))
    return path


def mavlink(folder, name="dive.BIN"):
    """A DataFlash log of ArduPilot, with units of the fields (FMTU)."""
    kinds = {"FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns", "")}
    kinds |= {"UNIT": (130, "QbZ", "TimeUS,Id,Label", ""), "FMTU": (131, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "")}
    kinds |= {"RCOU": (140, "QHH", "TimeUS,C1,C3", "sYY"), "ATT": (141, "QccC", "TimeUS,Roll,Pitch,Yaw", "sddd")}
    kinds |= {"BARO": (142, "QBf", "TimeUS,I,Alt", "s#m")}
    kinds |= {"GPS": (143, "QBLLff", "TimeUS,I,Lat,Lng,Spd,GCrs", "s#DUnh")}
    kinds |= {"MSG": (144, "QZ", "TimeUS,Message", "s-")}
    labels = {
        "s": "s",
        "Y": "us",
        "d": "deg",
        "m": "m",
        "D": "deglatitude",
        "U": "deglongitude",
        "n": "m/s",
        "h": "degheading",
    }
    sizes = {
        "B": "B",
        "b": "b",
        "n": "4s",
        "N": "16s",
        "Z": "64s",
        "Q": "Q",
        "H": "H",
        "c": "h",
        "C": "H",
        "L": "i",
        "f": "f",
    }
    scales = {"c": 100.0, "C": 100.0, "L": 1e7}

    def message(kind, *values):
        number, form, _, _ = kinds[kind]
        cells = [round(v * scales[c]) if c in scales else v for c, v in zip(form, values, strict=True)]
        cells = [c.encode() if isinstance(c, str) else c for c in cells]
        return struct.pack("<BBB" + "".join(sizes[c] for c in form), 0xA3, 0x95, number, *cells)

    def length(form):
        return 3 + struct.calcsize("<" + "".join(sizes[c] for c in form))

    parts = [message("FMT", n, length(form), kind, form, columns) for kind, (n, form, columns, _) in kinds.items()]
    parts += [message("UNIT", 0, ord(unit), label) for unit, label in labels.items()]
    parts += [message("FMTU", 0, n, ids, "-" * len(ids)) for n, _, _, ids in kinds.values() if ids]
    parts.append(message("MSG", 1, "ArduSub V4.5"))
    us = 5_000_000  # after the start of the autopilot
    events = [(t, "RCOU", (round(1500 + MINUTE.fin(t) / 0.06), round(1500 + MINUTE.rpm(t) / 3.0))) for t in FINS]
    events += [(t, "ATT", (MINUTE.roll(t), MINUTE.pitch(t), MINUTE.heading(t))) for t in COMPASS]
    events += [(t, "BARO", (0, -MINUTE.depth(t))) for t in COMPASS]
    events += [(t, "GPS", (0, MINUTE.latitude(t), MINUTE.longitude(t), MINUTE.speed, MINUTE.course)) for t in GPS]
    parts += [message(kind, us + round(t * 1e6), *values) for t, kind, values in sorted(events, key=lambda e: e[0])]
    path = folder / name
    path.write_bytes(b"".join(parts))
    return path


def telemetry(folder, name="dive.tlog", named=None):
    """A telemetry log, as ground stations write it: each message comes 0.1 to 0.2 s late.

    `named`: what the vehicle sends besides under names of its own, functions of time.
    """
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    parts = []
    for k, t in enumerate(COMPASS):
        ms = 5000 + round(t * 1000)
        angles = np.radians([MINUTE.roll(t), MINUTE.pitch(t), MINUTE.heading(t)])
        place = [round(x * 1e7) for x in (MINUTE.latitude(t), MINUTE.longitude(t))]
        for message in (
            link.attitude_encode(ms, *angles, 0.0, 0.0, np.radians(MINUTE.r(t))),
            link.global_position_int_encode(ms, *place, 0, 0, 150, 0, 0, 6100),
            link.servo_output_raw_encode(ms * 1000, 0, *[round(1500 + MINUTE.fin(t) / 0.06)] * 8),
            *(link.named_value_float_encode(ms, key.encode(), of(t)) for key, of in (named or {}).items()),
        ):
            stamp = round((START + t + 0.1 + 0.1 * (k % 2)) * 1e6)
            parts.append(struct.pack(">Q", stamp) + message.pack(link))
    path = folder / name
    path.write_bytes(b"".join(parts))
    return path


def nmea(folder, name="dive.nmea"):
    """GPS, compass, depth sounder and rudder indicator, without stamps of a logger."""
    import datetime

    import pynmea2

    def degrees(x, width):
        return f"{int(abs(x)):0{width}d}{(abs(x) % 1) * 60:09.6f}"

    lines = []
    for t in GPS:
        moment = datetime.datetime.fromtimestamp(START + t, datetime.UTC)
        lat, lon = degrees(MINUTE.latitude(t), 2), degrees(MINUTE.longitude(t), 3)
        fields = (
            f"{moment:%H%M%S}.00",
            "A",
            lat,
            "N",
            lon,
            "W",
            f"{MINUTE.speed * 3600 / 1852:.4f}",
            f"{MINUTE.course}",
        )
        lines.append(pynmea2.RMC("GP", "RMC", (*fields, f"{moment:%d%m%y}", "", "", "A")))
        s = t + np.arange(8) / 8.0  # sentences come at even times
        lines += [pynmea2.HDT("HE", "HDT", (f"{MINUTE.heading(s[k]):.3f}", "T")) for k in range(1, 6)]
        lines.append(pynmea2.DPT("SD", "DPT", (f"{MINUTE.depth(s[6]):.4f}", "0.0")))
        lines.append(pynmea2.RSA("II", "RSA", (f"{-MINUTE.fin(s[7]):.3f}", "A", "", "")))
    path = folder / name
    path.write_text("\r\n".join(map(str, lines)) + "\r\n")
    return path


def imc(folder, name="Data.lsf.gz"):
    """A log of DUNE: four servos, motor, AHRS, depth and GPS."""
    import imcpy

    def message(kind, t, entity, **fields):
        m = getattr(imcpy, kind)()
        m.timestamp, m.src, m.src_ent = START + t, 0x0019, entity
        for field, value in fields.items():
            setattr(m, field, value)
        return t, imcpy.Packet.serialize(m)

    messages = [message("EntityInfo", 0.0, 7, id=7, label="AHRS"), message("EntityInfo", 0.0, 9, id=9, label="GPS")]
    for t in FINS:
        messages += [message("ServoPosition", t, 3, id=k, value=np.radians(MINUTE.fin(t, k))) for k in range(4)]
        messages.append(message("Rpm", t, 4, value=int(MINUTE.rpm(t))))
    for t in COMPASS:
        angles = {"phi": MINUTE.roll(t), "theta": MINUTE.pitch(t), "psi": (MINUTE.heading(t) + 180.0) % 360.0 - 180.0}
        messages.append(message("EulerAngles", t, 7, **{field: np.radians(value) for field, value in angles.items()}))
        messages.append(message("AngularVelocity", t, 7, z=np.radians(MINUTE.r(t))))
        messages.append(message("Depth", t, 8, value=MINUTE.depth(t)))
    for t in GPS:
        place = np.radians([MINUTE.latitude(t), MINUTE.longitude(t)])
        messages.append(message("GpsFix", t, 9, lat=place[0], lon=place[1]))
    content = b"".join(packet for _, packet in sorted(messages, key=lambda m: m[0]))
    path = folder / name
    path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    return path


def slocum(folder, name="01600001.dbd"):
    """A file of the flight computer with its cache file beside it; dbdreader reads only, so that it is written here."""
    sensors = {"m_present_time": (8, "timestamp"), "m_fin": (4, "rad"), "m_roll": (4, "rad"), "m_pitch": (4, "rad")}
    sensors |= {"m_heading": (4, "rad"), "m_depth": (4, "m"), "m_gps_lat": (8, "lat"), "m_gps_lon": (8, "lon")}
    crc = "1a2b3c4d"
    names = list(sensors)
    lines = [f"s: T {k} {k} {sensors[n][0]} {n} {sensors[n][1]}" for k, n in enumerate(names)]
    (folder / f"{crc}.cac").write_text("\n".join(lines) + "\n")
    n_state = -(-len(names) // 4)
    head = {"dbd_label": "DBD(dinkum_binary_data)file", "encoding_ver": 5, "num_ascii_tags": 14, "all_sensors": 0}
    head |= {"the8x3_filename": "01600001", "full_filename": "made-up-2026-001-0-1", "filename_extension": "dbd"}
    head |= {"mission_name": "TRIAL.MI", "fileopen_time": "Mon_Sep_21_12:00:00_2026", "total_num_sensors": len(names)}
    head |= {"sensors_per_cycle": len(names), "state_bytes_per_cycle": n_state, "sensor_list_crc": crc}
    head |= {"sensor_list_factored": 1}
    content = "".join(f"{key}:    {value}\n" for key, value in head.items()).encode("ascii")
    content += b"sa" + struct.pack("<hfd", 0x1234, 123.456, 123456789.12345)

    def glider(degrees):  # degrees and minutes in one number
        return np.sign(degrees) * (100.0 * (abs(degrees) // 1) + 60.0 * (abs(degrees) % 1))

    for k, t in enumerate(np.concatenate([[0.0], np.arange(0.0, 60.0, 4.0)])):  # the first cycle counts for nothing
        angles = np.radians([-MINUTE.fin(t), MINUTE.roll(t), MINUTE.pitch(t), MINUTE.heading(t)])
        values = [START + t, *angles, MINUTE.depth(t), glider(MINUTE.latitude(t)), glider(MINUTE.longitude(t))]
        new = [True] * 6 + [k % 3 == 0] * 2  # GPS is slower
        bits = "".join("10" if is_new else "00" for is_new in new)
        content += b"d" + bytes(int(bits[i : i + 8].ljust(8, "0"), 2) for i in range(0, 8 * n_state, 8))
        for (size, _), value, is_new in zip(sensors.values(), values, new, strict=True):
            if is_new:
                content += struct.pack("<d" if size == 8 else "<f", value)
    path = folder / name
    path.write_bytes(content + b"X")
    return path


def matlab(folder, name="trial.mat"):
    """A structure with a matrix; ``trial73.mat`` is written as v7.3, that is HDF5."""
    t = FINS
    log = {"time": t, "rudder": np.radians(MINUTE.fin(t)), "n": np.array([MINUTE.rpm(s) for s in t]) / 60.0}
    log |= {"pos": np.stack([1.5 * t, 0.1 * t], axis=1), "psi": np.radians(350.0 + 2.0 * t)}
    path = folder / name
    if "73" not in name:
        from scipy import io

        io.savemat(path, {"log": log, "boat": "made up", "gains": np.arange(3.0)})
        return path
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for key, values in log.items():
            file[f"log/{key}"] = np.atleast_2d(values) if values.ndim == 1 else values.T
    content = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + content[512:])
    return path


def csv(folder, name="trial.txt"):
    """What a spreadsheet of a German office saves: semicolons, decimal commas, units in the head, GPS once a second."""
    lines = ["Logger 3.1", "Time [ms];Rudder [counts];Motor [%];Compass [deg];Depth [m];Lat [deg];Lon [deg];Mode"]
    for k, t in enumerate(FINS):
        place = [f"{MINUTE.latitude(t):.7f}", f"{MINUTE.longitude(t):.7f}"] if k % 10 == 0 else ["", ""]
        counts = f"{512 + MINUTE.fin(t) * COUNTS:.2f}"
        cells = [
            f"{1000 * t:.0f}",
            counts,
            f"{MINUTE.rpm(t) / 15:.0f}",
            f"{MINUTE.heading(t):.2f}",
            f"{MINUTE.depth(t):.3f}",
        ]
        lines.append(";".join([*cells, *place, "AUTO"]).replace(".", ","))
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="cp1252")
    return path


def kvlcc2(folder, name="HSVA_Z_10_10.dat", tank="HSVA"):
    """Numbers of our own in the layout of the tanks; those of MARIN have three digits."""
    t = np.arange(2000) * 0.05 if tank == "HSVA" else np.arange(2000) * 0.135264
    psi = 10.0 * np.sin(0.1 * t)
    x, y = 1.1 * t, np.cumsum(1.1 * np.radians(psi)) * t[1]
    dx, dy, r, rudder = np.full_like(t, 1.1), 1.1 * np.radians(psi), np.cos(0.1 * t), 10.0 * np.cos(0.1 * t)
    if tank == "HSVA":
        columns = [
            t,
            x,
            y,
            psi,
            dx,
            dy,
            r,
            0.1 * psi,
            rudder,
            np.full_like(t, 10.2),
            np.full_like(t, 41.0),
            t * 0 + 1.0,
        ]
        head, form = (
            [" HSVA, experimental data CPMC", " KVLCC2", " Z10\xb0/10\xb0", " Time series of motions"],
            "{:17.9f}",
        )
    else:
        columns = [t, x, y, 0.1 * psi, psi, dx, dy, 0.1 * r, r, rudder, np.full_like(t, 91.7)]
        head, form = ["MARIN(Maritime Research Institute Netherlands)", "Zig-zag : 10 / -10", ""], "{:.2E}\t"
    rows = ["".join(form.format(cell) for cell in row).rstrip("\t") for row in np.stack(columns, axis=1)]
    path = folder / name
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="cp1252")
    return path


def ulog(folder, name="09_00_00.ulg"):
    """A log of PX4: attitude as quaternions, rates, servos, motor, local position and GPS."""
    kinds = {"vehicle_attitude": ("float[4] q", "4f"), "vehicle_angular_velocity": ("float[3] xyz", "3f")}
    kinds |= {"actuator_servos": ("float[8] control", "8f"), "actuator_motors": ("float[12] control", "12f")}
    kinds |= {
        "vehicle_local_position": ("float z", "f"),
        "sensor_gps": ("double latitude_deg;double longitude_deg", "2d"),
    }

    def message(kind, content):
        return struct.pack("<Hc", len(content), kind) + content

    def q(t):
        roll, pitch, yaw = np.radians([MINUTE.roll(t), MINUTE.pitch(t), MINUTE.heading(t)]) / 2.0
        (sr, cr), (sp, cp), (sy, cy) = ((np.sin(x), np.cos(x)) for x in (roll, pitch, yaw))
        x, y, z = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
        return cr * cp * cy + sr * sp * sy, x, y, z

    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 5_000_000), message(b"B", bytes(40))]
    parts += [message(b"F", f"{kind}:uint64_t timestamp;{fields};".encode()) for kind, (fields, _) in kinds.items()]
    parts += [message(b"A", struct.pack("<BH", 0, k) + kind.encode()) for k, kind in enumerate(kinds)]
    events = [(t, "actuator_servos", (MINUTE.fin(t) / 25.0, *[0.0] * 7)) for t in FINS]
    events += [(t, "actuator_motors", (MINUTE.rpm(t) / 1500.0, *[0.0] * 11)) for t in FINS]
    events += [(t, "vehicle_attitude", q(t)) for t in COMPASS]
    events += [(t, "vehicle_angular_velocity", (0.0, 0.0, np.radians(MINUTE.r(t)))) for t in COMPASS]
    events += [(t, "vehicle_local_position", (MINUTE.depth(t),)) for t in COMPASS]
    events += [(t, "sensor_gps", (MINUTE.latitude(t), MINUTE.longitude(t))) for t in GPS]
    numbers = list(kinds)
    for t, kind, values in sorted(events, key=lambda event: event[0]):
        head = struct.pack("<HQ", numbers.index(kind), 5_000_000 + round(t * 1e6))
        parts.append(message(b"D", head + struct.pack("<" + kinds[kind][1], *values)))
    path = folder / name
    path.write_bytes(b"".join(parts))
    return path


def netcdf(folder, name="dive.nc4"):
    """A log in the layout of MBARI's LRAUV: groups of components, and a time beside each variable."""
    import h5py

    cells = {"RudderServo/platform_rudder_angle": (FINS, -np.radians(MINUTE.fin(FINS)), "radian")}
    cells |= {"ElevatorServo/platform_elevator_angle": (FINS, np.radians(MINUTE.fin(FINS)), "radian")}
    rates = np.array([MINUTE.rpm(t) for t in FINS]) * np.pi / 30.0
    cells |= {"ThrusterServo/platform_propeller_rotation_rate": (FINS, rates, "radian/second")}
    cells |= {"MassServo/platform_mass_position": (COMPASS, 0.01 + 0.0 * COMPASS, "m")}
    cells |= {"BuoyancyServo/platform_buoyancy_position": (COMPASS, 1e-6 * (500.0 + COMPASS), "m3")}
    cells |= {"platform_orientation": (COMPASS, np.radians(MINUTE.heading(COMPASS)), "radian")}
    cells |= {"platform_pitch_angle": (COMPASS, np.radians(MINUTE.pitch(COMPASS)), "radian")}
    cells |= {"depth": (COMPASS, MINUTE.depth(COMPASS), "m")}
    cells |= {"platform_x_velocity_wrt_sea_water": (COMPASS, 1.2 + 0.0 * COMPASS, "m/s")}
    path = folder / name
    with h5py.File(path, "w") as file:
        for key, (times, values, unit) in cells.items():
            file[key], file[f"{key}_time"] = values, START + times
            file[key].attrs["units"], file[f"{key}_time"].attrs["units"] = unit, "seconds since 1970-01-01T00:00:00Z"
    return path


def parquet(folder, name="trial.parquet"):
    """A table of pandas, with microseconds since 1970."""
    import pandas as pd

    columns = {"stamp_time": np.round((START + FINS) * 1e6).astype("int64"), "rudder": MINUTE.fin(FINS)}
    columns |= {"rpm": [MINUTE.rpm(t) for t in FINS], "heading": MINUTE.heading(FINS), "depth": MINUTE.depth(FINS)}
    pd.DataFrame(columns).to_parquet(folder / name)
    return folder / name


# Kind -> the writer of its example, whose signals are those of the example map of the kind.
WRITERS = {"ros": ros, "mavlink": mavlink, "nmea": nmea, "imc": imc, "slocum": slocum, "matlab": matlab, "csv": csv}
WRITERS |= {"kvlcc2": kvlcc2, "ulog": ulog, "netcdf": netcdf, "parquet": parquet}
