"""Units that logs of vehicles are written in, and their factors."""

import math

from bayesub.io.errors import InputError, nearest

GRAVITY = 9.81  # m/s^2
TURN = 2.0 * math.pi  # rad
DEGREE = math.pi / 180.0  # rad
KNOT = 1852.0 / 3600.0  # m/s
FOOT = 0.3048  # m

# Quantity -> unit -> SI units in one of it. Upper and lower case matter only where both are units: kn, kN.
QUANTITIES = {
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": DEGREE, "cdeg": 1e-2 * DEGREE, "degE7": 1e-7 * DEGREE},
    "length": {"m": 1.0, "km": 1e3, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "ft": FOOT, "in": 0.0254, "nmi": 1852.0},
    "speed": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6, "kn": KNOT, "ft/s": FOOT},
    "rate": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": DEGREE, "cdeg/s": 1e-2 * DEGREE, "deg/h": DEGREE / 3600},
    "acceleration": {"m/s2": 1.0, "cm/s2": 1e-2, "g": 9.80665, "mg": 9.80665e-3},
    "angular acceleration": {"rad/s2": 1.0, "deg/s2": DEGREE},
    "revolutions": {"rpm": 1.0, "1/s": 60.0},  # a minute, as in logs
    "force": {"N": 1.0, "kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216},
    "moment": {"Nm": 1.0, "kNm": 1e3},
    "volume": {"m3": 1.0, "l": 1e-3, "cm3": 1e-6},
    "density": {"kg/m3": 1.0, "g/cm3": 1e3},
    "pressure": {"Pa": 1.0, "hPa": 1e2, "mbar": 1e2, "kPa": 1e3, "dbar": 1e4, "bar": 1e5, "psi": 6894.757},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
}
# Other spellings, of manuals and of the libraries.
_SPELLINGS = {
    "deg": ("°", "degree", "degrees", "deglatitude", "deglongitude", "degheading", "lat", "lon", "degt", "degm"),
    "rad": ("radian", "radians"),
    "m": ("meter", "metre", "meters", "metres"),
    "m/s": ("mps", "ms-1", "m.s-1", "m*s-1", "meters/second"),
    "kn": ("kt", "kts", "knot", "knots"),
    "km/h": ("kmh", "kph"),
    "deg/s": ("degps", "°/s", "dps", "degs-1"),
    "rad/s": ("radps", "rads-1"),
    "m/s2": ("mps2", "m/s/s", "m/s^2", "m/s²", "ms-2"),
    "rad/s2": ("radps2", "rad/s/s", "rad/s^2"),
    "deg/s2": ("degps2", "deg/s/s", "deg/s^2"),
    "1/s": ("hz", "rps", "s-1", "rev/s"),
    "rpm": ("1/min", "rev/min", "revs/min"),
    "N": ("newton",),
    "Nm": ("n*m", "n.m"),
    "cm3": ("cc", "cm^3", "ml"),
    "kg/m3": ("kg/m^3", "kgm-3"),
    "s": ("sec", "seconds", "timestamp"),
    "us": ("µs", "microseconds"),
    "ms": ("milliseconds",),
}
_EXACT = {unit: (quantity, unit) for quantity, units in QUANTITIES.items() for unit in units}
_UNITS = {unit.lower(): place for unit, place in reversed(_EXACT.items())}  # the first of two spellings remains
_UNITS |= {spelling: _EXACT[unit] for unit, spellings in _SPELLINGS.items() for spelling in spellings}
# How the name of a column ends -> its unit.
_ENDS = {"mps2": "m/s2", "degps2": "deg/s2", "radps2": "rad/s2", "degps": "deg/s", "radps": "rad/s", "mps": "m/s"}
_ENDS |= {"deg": "deg", "rad": "rad", "m": "m", "n": "N", "s": "s", "pa": "Pa", "kpa": "kPa", "dbar": "dbar"}
_ENDS |= {"bar": "bar", "nm": "Nm", "cm3": "cm3", "kgm3": "kg/m3", "kn": "kn", "rpm": "rpm"}


def find(unit: str) -> tuple[str, str]:
    """Quantity and name of a unit in any spelling; InputError for one that is not in the table."""
    if not known(unit):
        units = [name for names in QUANTITIES.values() for name in names]
        hint = "or leave it out and give factor"
        suggestion = nearest(unit, units, hint) if nearest(unit, units) else f"; known are {', '.join(units)}; {hint}"
        raise InputError(f"unknown unit '{unit}'{suggestion}", "unit", "unit")
    return _EXACT.get(unit) or _UNITS[_key(unit)]


def known(unit: str) -> bool:
    """Whether a unit is in the table, in any spelling."""
    return unit in _EXACT or _key(unit) in _UNITS


def _key(unit: str) -> str:
    return unit.strip().lower().replace(" ", "")


def of_column(column: str) -> str:
    """The unit at the end of a column's name, such as ``m/s`` of ``u_mps``; empty without one."""
    return _ENDS.get(column.rpartition("_")[2], "") if "_" in column or column == "rpm" else ""


def factor(unit: str, target: str, density: float | None = None) -> float:
    """Units `target` in one `unit`, both in any spelling; a pressure becomes a depth by the density of water, kg/m^3.

    InputError for a unit that is not in the table, and for units of different quantities.
    """
    quantity, unit = find(unit)
    target_quantity, target = find(target)
    size = QUANTITIES[quantity][unit] / QUANTITIES[target_quantity][target]
    if quantity == target_quantity:
        return size
    if (quantity, target_quantity) == ("pressure", "length"):
        if density is None:
            key = "water_density_kgm3"
            raise InputError(f"a pressure in {unit} becomes a depth with {key}; give it", "missing", key)
        return size / (density * GRAVITY)
    message = f"'{unit}' ({quantity}) cannot become '{target}' ({target_quantity}); give factor instead"
    raise InputError(message, "unit", "unit")
