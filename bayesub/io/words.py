"""Enumerations, numbers and units in sentences, tables and figures."""

import re
from collections.abc import Sequence

import numpy as np

from bayesub.io.errors import printable

_PLACES = 9  # after the point, beyond which numbers have a power of ten
_LARGE = 1e5  # sd from which values have a power of ten
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNITS = {"mps": "m/s", "degps": "deg/s", "mps2": "m/s²", "degps2": "deg/s²", "kgm2": "kg m²", "n": "N"}
_UNITS |= {"m": "m", "deg": "deg", "s": "s", "kg": "kg", "percent": "%", "percentps": "%/s"}

# What the label and the unit of a coefficient may be, so that they are formulae of LaTeX and nothing else: letters,
# signs, and commands of mathematics. Two carets would write any character.
_COMMANDS = "dot ddot bar hat tilde vec mathrm mathit mathbf left right vert mid cdot times prime sin cos"
_COMMANDS += " alpha beta gamma delta epsilon varepsilon zeta eta theta vartheta iota kappa lambda mu nu xi pi rho"
_COMMANDS += " sigma tau upsilon phi varphi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
_COMMAND = rf"\\(?:(?:{'|'.join(_COMMANDS.split())})(?![A-Za-z])|[,;:! |])"
LABEL = re.compile(rf"(\$?)(?:[\w '|{{}},.+\-*/=()]|\^(?!\^)|{_COMMAND})+\1")
UNIT = re.compile(r"(?:[\w °·/*.+\-()]|\^(?!\^))+")
_LATEX = str.maketrans({c: f"\\{c}" for c in "{}$&#_%"} | {"\\": r"\textbackslash{}", "^": r"\^{}", "~": r"\~{}"})
_MARKDOWN = str.maketrans({c: f"\\{c}" for c in "\\`*[]$"} | {"&": "&amp;", "<": "&lt;", ">": "&gt;", "|": "&#124;"})


def latex(text: str) -> str:
    """A text as LaTeX that shows it."""
    return printable(text).translate(_LATEX)


def markdown(text: str) -> str:
    """A text as Markdown that shows it, also in a cell of a table: no tags, links, pictures or columns."""
    return printable(text).translate(_MARKDOWN)


def matlab(text: str) -> str:
    """A text as a literal of Matlab."""
    return f"'{printable(text).replace(chr(39), chr(39) * 2)}'"


def listed(names: Sequence[str], otherwise: str = "") -> str:
    """Names as an enumeration, ``Zuw, Zww and Muq``; the words `otherwise` if there are none."""
    *first, last = names or [otherwise]
    return f"{', '.join(first)} and {last}" if first else last


def counted(n: int, noun: str) -> str:
    """A number of things, ``1 start`` or ``5 starts``."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def with_unit(column: str) -> str:
    """The label of a column or parameter whose name ends with its unit: ``yaw0_deg`` is ``yaw0 (deg)``.

    The trial to which it belongs may follow in brackets, as in ``yaw0_deg[first]``.
    """
    name, bracket, trial = column.partition("[")
    *words, unit = name.split("_")
    last = f"({_UNITS[unit]})" if words and unit in _UNITS else unit
    return " ".join([*words, last]) + (f" {bracket}{trial}" if bracket else "")


def measured(column: str, value: float | str) -> str:
    """A value with the name and the unit of its column: ``roll_deg`` and 30 are ``roll 30 deg``."""
    name, _, unit = with_unit(column).partition(" (")
    return f"{name} {value if isinstance(value, str) else f'{value:.4g}'} {unit.rstrip(')')}".rstrip()


def powers(text: str) -> str:
    """A unit or factor such as ``kg m^2`` or ``(rho/2) l^3 U^-1`` with raised powers and a Greek rho."""
    return re.sub(r"\^(-?\d+)", lambda match: match[1].translate(_RAISED), text).replace("rho", "ρ")


def rounded(value: float, sd: float) -> str:
    """A value to the second digit of its standard deviation, the only rounding of what has one.

    Where that is beyond the ninth place after the point it has a power of ten, and without an sd four digits.
    """
    if not (0.0 < sd < np.inf and np.isfinite(value)) or value == 0.0:
        return f"{value:.4g}"
    places = 1 - int(f"{sd:.1e}".partition("e")[2])  # of sd as it is rounded: 0.0996 has those of 0.10
    if places > _PLACES:
        return f"{value:.{max(0, places + int(f'{value:e}'.partition('e')[2]))}e}"
    return f"{round(value, places) + 0.0:.{max(0, places)}f}"  # adding zero leaves no -0


def uncertain(value: float, sd: float) -> str:
    """A value and its standard deviation, to two digits of the latter; with one power of ten where they are large."""
    if not sd > 0.0:
        return rounded(value, sd)
    if not _LARGE <= sd < np.inf:
        return f"{rounded(value, sd)} ± {rounded(sd, sd)}"
    exponent = int(f"{max(abs(value), sd):e}".partition("e")[2])
    value, sd = value / 10.0**exponent, sd / 10.0**exponent
    return f"({rounded(value, sd)} ± {rounded(sd, sd)}) × 10{str(exponent).translate(_RAISED)}"


def cell(value: float | None, digits: int = 3) -> str:
    """A number of so many digits, large ones without exponent; empty for what is not there."""
    return "" if value is None else f"{float(f'{value:.{digits}g}'):.12g}"
