"""Good input files and what can happen to them: the corpus that :mod:`fuzz` and its tests drive bayesub with."""

import re
import tomllib

import numpy as np
import tomli_w
from support import fins, user_set

from bayesub.io import toml_files
from bayesub.study.new import files

TORPEDO = files.geometry("boat")
ELLIPSOID = '[hull]\nshape = "ellipsoid"\nlength_m = 8.0\nbeam_m = 1.2\nheight_m = 1.0\n'
OFFSETS = (
    "origin_m = 3.1\n[hull]\nshape = 'offsets'\nstation_m = [0.0, 0.5, 4.0, 6.0]\nradius_m = [0.0, 0.4, 0.4, 0.05]\n"
    "[[fins]]\nname = 'stern'\nfrom_m = 5.0\nto_m = 5.5\nside_m = 0.8\n"
)
STUDY = """name = "small"
question = "What does a mutated file say?"
vehicle = "auv690"
manoeuvre = "horizontal"
seed = 3
dt_s = 0.2

[[sensors]]
kind = "track"
channels = ["x", "y", "yaw"]
position_sd_m = 0.2
attitude_sd_deg = 0.1
interval_s = 2.0
gaps = [[10.0, 20.0]]

[[sensors]]
kind = "sensor"
column = "u_mps"
sd = 0.005
resolution = 0.01
bias = 0.01
dropout = 0.1

[noise.yaw_deg]
kind = "ar1"
correlation_time_s = 20.0

[nuisance]
current_north_mps = { mean = 0.0, sd = 0.5 }
sd_x_m = { median = 0.2, log_sd = 0.7 }

[truth]
current_mps = [0.1, -0.05]

[free]
coefficients = ["Xuu", "Yuv", "Nuv", "Yuu_dr"]

[prior]
kind = "relative_normal"
sd = 0.25
table = "table.csv"
correlations = [["Nuv", "Nur", 0.5]]

[prior.given]
Xuu = { lower = -0.01, upper = -0.001 }

[sampler]
n_walkers = 32
ess = 400.0

[quick]
baselines = { sqp_starts = 1 }
"""
LOGGED = """name = "logged"
vehicle = "auv690"
data = "trial.csv"
subproblem = "horizontal"
clock_offset_s = 0.3
max_control_gap_s = 6.0
ignore = ["depth_m"]
seed = 5
dt_s = 0.2

[[sensors]]
kind = "track"
channels = ["x", "y", "yaw"]
position_sd_m = 0.5
attitude_sd_deg = 1.0
lever_arm_m = [1.5, 0.0, -0.4]
instrument = "range"

[[sensors]]
kind = "sensor"
column = "u_mps"
sd = 0.01
clock_offset_s = -0.2

[nuisance]
current_east_mps = { mean = 0.0, sd = 0.2 }
u0_mps = { value = 1.5 }
clock_range_s = { mean = 0.3, sd = 0.1 }
lever_range_x_m = { lower = 1.0, upper = 2.0 }

[free]
coefficients = ["Xuu", "Yuv", "Nuv", "Yuu_dr"]

[prior]
kind = "relative_normal"
sd = 0.25
"""
DISTURBANCE = """[disturbance]
axes = ["X", "Y", "N"]
sd = { N = 1e-5 }
sd_n = { Y = 2.0 }
share = { X = 0.015 }
correlation_time_s = 4.0
kind = "matern_3_2"
"""
DISTURBED = (
    STUDY.replace("[truth]\n", DISTURBANCE.replace("[disturbance]", "[truth.disturbance]") + "[truth]\n")
    + """
[disturbance]
axes = ["X", "Y", "N"]
sd = { N = { median = 1e-5, log_sd = 1.0 }, Y = 2e-5 }
share = { X = 0.015 }
correlation_time_s = { median = 4.0, log_sd = 0.5 }
knot_interval_s = 16.0
"""
)
_SOURCE = LOGGED[LOGGED.index("data") : LOGGED.index("seed")]
_RANGE = LOGGED[LOGGED.index("clock_range_s") : LOGGED.index("\n[free]")]  # of an instrument that one of them lacks
TRIALS = (
    LOGGED.replace(_SOURCE, "").replace(_RANGE, "")
    + f"""
[[trials]]
name = "logged"
{_SOURCE}nuisance = {{ clock_range_s = {{ mean = 0.3, sd = 0.1 }} }}
[[trials]]
name = "zigzag"
manoeuvre = "zigzag_20_20"
sensors = [{{ kind = "dvl", sd_mps = 0.01, channels = ["u_ground"], lever_arm_m = [1.0, 0.0, 0.0] }}]
nuisance = {{ u0_mps = {{ mean = 1.5, sd = 0.1 }} }}
[trials.truth]
current_mps = [0.1, 0.0]
"""
)
FINNED = tomli_w.dumps(
    fins.with_actuators(
        tomllib.loads(toml_files.find("suboff", "vehicles").read_text(encoding="utf-8")),
        *fins.fins(*fins.X_TAIL),
        fins.PORT,
        fins.BOW,
    )
)
BOAT_OF_SET = user_set.vehicle(toml_files.find("suboff", "vehicles").read_text(encoding="utf-8"))
SHIP = """name = "ship"
title = "Three degrees of freedom"
degrees_of_freedom = 3
speed = "instantaneous"

[controls]
dr = "rudder_deg"

[terms.X]
Xdu  = { regressor = "du", length_power = 2, speed_power = 1, label = "X'_u", meaning = "resistance" }
Xdu3 = { regressor = "du^3", length_power = 2, speed_power = -1, label = "X'_{uuu}", meaning = "resistance, cubed" }

[terms.Y]
Yvvr = { regressor = "v^2*r", length_power = 3, speed_power = -1, label = "Y'_{vvr}", meaning = "turning and drift" }
Ydr  = { regressor = "dr", length_power = 2, speed_power = 2, label = "Y'_\\\\delta", meaning = "rudder" }

[terms.N]
Nrdot = { regressor = "rdot", length_power = 5, label = "N'_{\\\\dot{r}}", meaning = "added inertia" }
"""
TABLE = "coefficient,mean,sd\n# from a towing tank\nNuv,-0.009,0.0006\nNur,-0.004,0.0002\nYur,0.006,0\n"


def history(n=24, columns=("rudder_deg", "bow_plane_deg", "stern_plane_deg")) -> str:
    """A control history of `n` rows for a boat whose actuators have these columns."""
    moves = {"rudder_deg": lambda t: 10 * np.sin(0.2 * t), "bow_plane_deg": lambda _t: 0.0}
    rows = [
        ",".join(f"{value:.4g}" for value in (t, *(moves.get(c, lambda t: 2 * np.cos(0.3 * t))(t) for c in columns)))
        for t in 2.5 * np.arange(n)
    ]
    rows = [f"{row},{900 + 2.5 * k:g}" for k, row in enumerate(rows)]
    return "\n".join([",".join(("time_s", *columns, "rpm")), *rows, ""])


def log(n=40) -> str:
    """A record of `n` rows with empty cells and a heading that passes north."""
    rows = []
    for k, t in enumerate(1.0 + np.arange(n)):
        y = "" if k % 7 == 3 else f"{0.02 * t:.5g}"
        rows.append(f"{t:g},{1.5 * t:.6g},{y},{(355 + t) % 360:g},{1.5 - 0.001 * t:.4g}")
    return "\n".join(["time_s,x_m,y_m,yaw_deg,u_mps", *rows, ""])


def trial(n=60) -> str:
    """A log of `n` seconds with controls of their own times and readings on a straight way."""
    rows = []
    for t in range(n):
        read = f"{1.5 * t:g},{0.1 * t:.3g},{(358 + 0.2 * t) % 360:.4g},1.5,2" if t % 3 else ",,,,"
        rows.append(f"{t},{'' if t % 2 else f'{5 * np.sin(0.3 * t):.3g}'},{read}")
    return "\n".join(["time_s,rudder_deg,x_m,y_m,yaw_deg,u_mps,depth_m", *rows, ""])


# Kind of a file that a study names -> its name there, and the study.
BESIDE = {"table": ("table.csv", STUDY), "trial": ("trial.csv", LOGGED)}


def write_beside(folder) -> None:
    """Write the good files that studies, vehicles and equations name."""
    user_set.write(folder)
    for name, text in (("good_history.csv", history()), ("table.csv", TABLE), ("trial.csv", trial())):
        (folder / name).write_text(text)


def corpus() -> list[tuple[str, str, str]]:
    """Kind, suffix and text of every good file."""
    built_in = [(kind[:-1], path) for kind in ("vehicles", "manoeuvres") for path in toml_files.built_in(kind).values()]
    files = [(kind, path.read_text(encoding="utf-8")) for kind, path in built_in]
    files += [("equations", text) for text in (user_set.SET, user_set.INCLUDED, SHIP)] + [
        ("boat of a set", BOAT_OF_SET),
        ("vehicle", FINNED),
    ]
    files += [("geometry", text) for text in (TORPEDO, ELLIPSOID, OFFSETS)] + [
        ("study", text) for text in (STUDY, DISTURBED, LOGGED, TRIALS)
    ]
    files.append(("disturbance", DISTURBANCE))
    tables = [("history", history()), ("history", history(3)), ("log", log()), ("log", log(5)), ("table", TABLE)]
    tables.append(("trial", trial()))
    return [(kind, ".toml", text) for kind, text in files] + [(kind, ".csv", text) for kind, text in tables]


NUMBERS = (
    *(
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-300",
        "5e-324",
        "1e999",
        "-0",
        "-0.0",
        "0",
        "0.0",
        "-1",
        "1e9",
        "1e-9",
    ),
    *("1e20", "1e5", "9" * 30, "9" * 400, "9" * 5000, "1_000", "0x7f", "3,5", "1.5.2", "1e", "+", "null", "true"),
    *("'7'", "''", "[]", "[1.0]", "[[1]]", "{}", "1979-05-27", "__import__('os').getpid()", "1/0"),
)
UNITS = ("_m", "_mps", "_deg", "_rad", "_s", "_kg", "_n", "_degps", "_deg_s", "_kgm2", "_kgm3", "_mps2", "_knots", "")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]+")
LETTERS = "abcdefghijklmnopqrstuvwxyz_0123456789"


def _one(pattern, text, rng):
    found = list(pattern.finditer(text))
    return found[rng.integers(len(found))] if found else re.match("", text)


def _replaced(match, text, new):
    return text[: match.start()] + new + text[match.end() :]


def another_number(text, rng):
    return _replaced(_one(NUMBER, text, rng), text, NUMBERS[rng.integers(len(NUMBERS))])


def scaled_number(text, rng):
    match = _one(NUMBER, text, rng)
    power = rng.choice([-12, -6, -3, -2, 2, 3, 6, 12])
    return _replaced(match, text, f"{float(match.group() or 1) * rng.choice([-1, 1]) * 10.0**power:.6g}")


def misspelt_word(text, rng):
    match = _one(WORD, text, rng)
    letters = list(match.group())
    for _ in range(rng.integers(1, 3)):
        at = rng.integers(len(letters) + 1)
        letters[at : at + rng.integers(0, 2)] = [LETTERS[rng.integers(len(LETTERS))]] * rng.integers(0, 2)
    return _replaced(match, text, "".join(letters))


def other_unit(text, rng):
    match = _one(re.compile(r"_(m|mps|deg|s|kg|n|degps|deg_s|kgm2|kgm3)\b"), text, rng)
    return _replaced(match, text, UNITS[rng.integers(len(UNITS))])


def swapped_words(text, rng):
    first, second = sorted((_one(WORD, text, rng), _one(WORD, text, rng)), key=re.Match.start)
    if first.end() > second.start():
        return text
    between = text[first.end() : second.start()]
    return text[: first.start()] + second.group() + between + first.group() + text[second.end() :]


def swapped_numbers(text, rng):
    first, second = sorted((_one(NUMBER, text, rng), _one(NUMBER, text, rng)), key=re.Match.start)
    if first.end() > second.start():
        return text
    between = text[first.end() : second.start()]
    return text[: first.start()] + second.group() + between + first.group() + text[second.end() :]


def _lines(change):
    def mutated(text, rng):
        lines = text.split("\n")
        change(lines, rng.integers(len(lines)), rng.integers(len(lines)))
        return "\n".join(lines)

    mutated.__name__ = change.__name__
    return mutated


@_lines
def deleted_line(lines, at, _other):
    del lines[at]


@_lines
def doubled_line(lines, at, other):
    lines.insert(other, lines[at])


@_lines
def swapped_lines(lines, at, other):
    lines[at], lines[other] = lines[other], lines[at]


@_lines
def another_value(lines, at, other):
    """The value of one key given to another."""
    key, _, _ = lines[at].partition("=")
    lines[at] = f"{key}={lines[other].partition('=')[2]}"


@_lines
def section_of_its_own(lines, at, _other):
    lines.insert(at, "[extra.section]")


def truncated(text, rng):
    return text[: rng.integers(len(text) + 1)]


def deep(text, rng):
    n = int(rng.choice([50, 2000, 100_000]))
    return _replaced(_one(NUMBER, text, rng), text, "[" * n + "]" * (n if rng.integers(2) else 0))


def huge(text, rng):
    filling = ["x" * 1_000_000, '"' + "y" * 1_000_000 + '"', "7," * 200_000, "\n" * 200_000][rng.integers(4)]
    return _replaced(_one(WORD, text, rng), text, filling)


def line_ends(text, rng):
    return text.replace("\n", ["\r\n", "\r", "\n\n", "\u2028", "\x0b"][rng.integers(5)])


def separators(text, rng):
    old, new = [(",", ";"), (".", ","), (",", "\t"), ("=", ":"), (" ", "\u00a0"), ("-", "\u2212"), ('"', "'")][
        rng.integers(7)
    ]
    return text.replace(old, new)


def byte_order_mark(text, rng):
    return "\ufeff" * int(rng.integers(1, 3)) + text


def odd_character(text, rng):
    at = rng.integers(len(text) + 1)
    return (
        text[:at]
        + ["\0", "\x1b[31m", "\u202e", "\ud7ff", "\U0001f6a2", '"""', "#", "\\", "\\u0000"][rng.integers(9)]
        + text[at:]
    )


def markup(text, rng):
    return _replaced(
        _one(WORD, text, rng), text, ["<script>alert(1)</script>", "[bold]x[/]", "{{ 7*7 }}", "$(id)"][rng.integers(4)]
    )


def empty(_text, rng):
    return ["", " ", "\n", "#", "\ufeff", "[]", ","][rng.integers(7)]


PLAUSIBLE = (another_number, scaled_number, misspelt_word, other_unit, swapped_words, swapped_numbers, deleted_line)
PLAUSIBLE += (doubled_line, swapped_lines, another_value, section_of_its_own)
ON_TEXT = (*PLAUSIBLE, truncated, deep, huge, line_ends, separators, byte_order_mark, odd_character, markup, empty)


def flipped_bytes(data, rng):
    changed = bytearray(data)
    for _ in range(rng.integers(1, 9)):
        if changed:
            changed[rng.integers(len(changed))] ^= 1 << rng.integers(8)
    return bytes(changed)


def invalid_utf8(data, rng):
    at = rng.integers(len(data) + 1)
    return data[:at] + [b"\xff\xfe", b"\xc3\x28", b"\xed\xa0\x80", b"\xe9"][rng.integers(4)] + data[at:]


def other_encoding(data, rng):
    return data.decode().encode(["utf-16", "utf-32", "cp037"][rng.integers(3)], errors="replace")


ON_BYTES = (flipped_bytes, invalid_utf8, other_encoding)


def mutated(text: str, rng: np.random.Generator) -> tuple[bytes, str]:
    """The file after one to three accidents, and their names; most are those a person could have."""
    names = []
    for _ in range(rng.integers(1, 4)):
        among = PLAUSIBLE if rng.random() < 0.6 else ON_TEXT
        change = among[rng.integers(len(among))]
        text = change(text, rng)
        names.append(change.__name__)
    data = text.encode(errors="replace")
    if rng.random() < 0.12:
        change = ON_BYTES[rng.integers(len(ON_BYTES))]
        data = change(data, rng)
        names.append(change.__name__)
    return data, "+".join(names)
