"""A made-up torpedo AUV: four fins in a cross, whose servos count, a motor in per cent, compass, pressure and GPS."""

from types import SimpleNamespace

import numpy as np
from support import vehicle_logs
from support.fins import FIN, with_actuators

from bayesub.logs import log_files

NAMES = ("upper", "starboard", "lower", "port")
COLUMNS = tuple(f"{name}_deg" for name in NAMES)
LATITUDE, LONGITUDE = 41.18, -8.70  # where x and y are zero
RADIUS = 6_371_000.0  # m; the earth is a ball here
AMIDSHIPS, COUNTS = (2011, 2048, 2100, 2048), 1 / 0.0879  # of each servo; counts a degree
MIRRORED = "lower"  # this servo counts the other way

MAP_HEAD = 'kind = "ros"\n'
MAP_FIN = '[columns.{name}_deg]\nsignal = "/fins.data[{k}]"\nzero = {zero}\nfactor = 0.0879\nsign = {sign}\n'
MAP_REST = """
[columns.rpm]
signal = "/motor.data"
factor = 15.0
held = true

[columns.heading_deg]
signal = "/imu.orientation.yaw"
sign = -1
offset = 90.0
wrap = true

[columns.pitch_deg]
signal = "/imu.orientation.pitch"
sign = -1

[columns.r_degps]
signal = "/imu.angular_velocity.z"
sign = -1

[columns.depth_m]
signal = "/pressure.fluid_pressure"
zero = 101325.0
water_density_kgm3 = 1025.0

[columns.latitude_deg]
signal = "/gps/fix.latitude"

[columns.longitude_deg]
signal = "/gps/fix.longitude"
"""


def boat(content):
    """The content of a vehicle file with the fins of this boat."""
    fins = [FIN | {"name": name, "angle_deg": 90.0 * k} for k, name in enumerate(NAMES)]
    return with_actuators(content, *fins) | {"name": "torpedo"}


def log_map():
    """The text of the map of its bags."""
    fins = [
        MAP_FIN.format(name=name, k=k, zero=AMIDSHIPS[k], sign=-1 if name == MIRRORED else 1)
        for k, name in enumerate(NAMES)
    ]
    return MAP_HEAD + "\n".join(fins) + MAP_REST


def bag(folder, flown, rng, name="run1"):
    """The bag of the first two minutes of a simulated log of the boat."""
    return vehicle_logs.ros(folder, name, motion=motion(log_files.read_log(flown, COLUMNS), rng), duration=120.0)


def motion(log, rng):
    """What instruments read of a simulated log (columns in SI units, of fins as they are), for the writer of bags."""

    def of(name, factor=1.0, sd=0.0):
        return lambda t: factor * np.interp(t, log["time"], log[name]) + sd * rng.standard_normal()

    def counts(t, k):  # the writer turns degrees into counts about 2048
        degrees = np.degrees(np.interp(t, log["time"], log[f"{NAMES[k]}_deg"]))
        sign = -1.0 if NAMES[k] == MIRRORED else 1.0
        return (np.round(AMIDSHIPS[k] + sign * degrees * COUNTS) - 2048) / COUNTS

    angle = 180.0 / np.pi
    east = RADIUS * np.cos(np.radians(LATITUDE))
    return SimpleNamespace(
        fin=counts,
        rpm=lambda t: 15.0 * round(float(log["rpm"][0]) / 15.0) + 0.0 * t,
        heading=of("psi", angle, 0.5),
        pitch=of("theta", angle, 0.2),
        roll=of("phi", angle, 0.2),
        r=of("r", angle, 0.1),
        depth=of("z", 1.0, 0.02),
        latitude=lambda t: LATITUDE + of("x", angle / RADIUS, angle / RADIUS)(t),
        longitude=lambda t: LONGITUDE + of("y", angle / east, angle / east)(t),
    )
