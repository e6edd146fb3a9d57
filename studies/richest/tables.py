"""Tables and claims of the study of the richest manoeuvre."""

from collections.abc import Iterator
from operator import itemgetter

from bayesub.report import markdown
from richest.appraisal import SHARE
from richest.floor import REASONS, SHARPER

RANKS = ("worst", "middle", "best", "best beyond", "optimised")
FEW = 0.1  # share of the coefficients that null directions hide
_ERRORS = 3.0  # standard errors by which a share may miss
_WIDER, _WRONG = 1.25, 1.15  # of a posterior sd over the expected one, and of errors over the sd, that are too much

COUNTS = """
Coefficients known to 10 % (expected posterior sd over the value; prior sd 25 %) after one trial: on the built-in
coupled manoeuvre and the best of the built-in ones, on the worst, middle and best of the random ones that keep the
limits, on the best random one whatever it breaks, and on the one that searches find within the limits. Directions that
the data know better than the prior, of the last. Ranks are those of the smooth count that a search makes large; the
most that any random one makes known stands beside them.
"""
BOATS = """
The same manoeuvres flown by boats of the prior: share that keeps all limits, and coefficients known to 10 %, mean
(least to most).
"""
REASON = """
Why the others are not, on the best manoeuvre within the limits: others imitate them (alone they would be known), they
do too little, or a null direction of the equations is in the way. And how many would be known with more information.
"""
CONDITION = """
Rank correlation with the number of known coefficients (smooth), over random manoeuvres: of the mean and of the largest
logarithm of the condition numbers of the axes of the linear form, and of the D-optimality. The less they are, the more
is known.
"""
ONE = """
Of the coupled and the best manoeuvre: null directions, condition numbers of the axes, correlation about zero of v with
r and of w with q, and margins to the limits (limit, reached).
"""
PROOF = """
Boats of the prior, each on the best manoeuvre within the limits and on the coupled one: coefficients expected to be
known to 10 % and those whose posterior is as narrow; posterior sd over the expected sd (median, and fifth to 95th per
cent); rms error of the posterior mode in posterior sds; how often intervals hold the truth. Posteriors are normal
approximations at the mode; some were sampled: sampled sd over that of the approximation, and mean less mode in sds
(fifth, fiftieth and 95th per cent).
"""
SEARCHES = """
Share of the coefficients within 10 % of the truth: posterior mode, and ends of searches; SQP starts spread as the prior
and does not know it, Gauss-Newton starts at draws of the prior and looks for the posterior mode. A search fits if the
mean square of its residuals is below 1.2.
"""
UNSEEN = """
Largest position error on unseen random manoeuvres in lengths, median (and nine tenths); and the share of true positions
within 90 % bands of the posterior.
"""


def page(numbers: dict) -> Iterator[str]:
    """The lines of the page."""
    rows = list(_rows(numbers["vehicles"]))
    yield COUNTS
    cells = {"vehicle": itemgetter("vehicle"), "sensors": itemgetter("sensors"), "of": itemgetter("n_coefficients")}
    cells |= {"coupled": lambda r: known(r, "standard coupled")}
    cells |= {"best built-in": lambda r: "{} ({})".format(*best_standard(r["manoeuvres"], r["sensors"]))}
    cells |= {f"random: {rank}": lambda r, rank=rank: known(r, rank) for rank in RANKS[:4]}
    cells |= {"most within, beyond": lambda r: "{within}, {beyond}".format(**r["most"][r["sensors"]])}
    cells |= {"optimised": lambda r: known(r, "optimised"), "directions": lambda r: best(r)["n_sharper"]}
    yield from markdown.columns(rows, cells)
    yield "\nRandom manoeuvres: " + "; ".join(
        f"{name} {v['n_within']} of {v['n_random']} within the limits" for name, v in numbers["vehicles"].items()
    )
    yield BOATS
    cells = {"vehicle": itemgetter("vehicle"), "sensors": itemgetter("sensors")}
    for name in ("coupled", "optimised"):
        cells |= {
            f"{name}: within": lambda r, name=name: f"{r['boats'][r['sensors']][name]['within']:.0%}",
            f"{name}: known": lambda r, name=name: "{mean:.1f} ({least} to {most})".format(
                **r["boats"][r["sensors"]][name]
            ),
        }
    yield from markdown.columns(rows, cells)
    yield REASON
    cells = {"vehicle": itemgetter("vehicle"), "sensors": itemgetter("sensors")}
    cells |= {reason: lambda r, reason=reason: best(r)["reasons"][reason] for reason in REASONS}
    cells |= {name: lambda r, name=name: best(r)["sharper"][name] for name in (*list(SHARPER)[1:], "no error")}
    yield from markdown.columns(rows, cells)
    yield CONDITION
    cells = {"vehicle": itemgetter("vehicle"), "sensors": itemgetter("sensors")}
    words = {"mean": "condition, mean", "largest": "condition, largest", "d": "D-optimality"}
    cells |= {
        word: lambda r, key=key: f"{r['correlations'][r['sensors']][key]:+.2f}".replace("-", "−")
        for key, word in words.items()
    }
    yield from markdown.columns(rows, cells)
    yield ONE
    yield from _single(rows)
    yield from _proof(numbers["proof"])


def _rows(vehicles: dict) -> Iterator[dict]:
    for vehicle, result in vehicles.items():
        for sensors in result["searches"]:
            yield result | {"vehicle": vehicle, "sensors": sensors}


def look(row: dict, name: str) -> dict | None:
    """What a row's sensors tell on a manoeuvre, by its name or by its rank among those of the sensors."""
    manoeuvres, sensors = row["manoeuvres"], row["sensors"]
    manoeuvre = manoeuvres.get(name) or manoeuvres.get(f"{sensors} {name}")
    return manoeuvre and manoeuvre["sensors"][sensors]


def best(row: dict) -> dict:
    """What a row's sensors tell on the optimised manoeuvre."""
    return look(row, "optimised")


def known(row: dict, name: str) -> int | str:
    """How many coefficients are known after a manoeuvre, if there is such a one."""
    result = look(row, name)
    return "" if result is None else result["n_known"][str(SHARE)]


def best_standard(manoeuvres: dict, sensors: str) -> tuple[int, str]:
    """The largest number of known coefficients of a built-in manoeuvre, and its name."""
    counts = {
        name.removeprefix("standard "): m["sensors"][sensors]["n_known"][str(SHARE)]
        for name, m in manoeuvres.items()
        if name.startswith("standard ")
    }
    name = max(counts, key=counts.get)
    return counts[name], name


def _single(rows) -> list[str]:
    lines = []
    for row in rows:
        of_sensors = {"optimised": f"{row['sensors']} optimised"}
        if row["sensors"] == next(iter(row["searches"])):
            of_sensors = {"coupled": "standard coupled"} | of_sensors
        for name, key in of_sensors.items():
            lines.append(row["manoeuvres"][key] | {"vehicle": row["vehicle"], "name": f"{row['sensors']} {name}"})
    cells = {
        "vehicle": itemgetter("vehicle"),
        "manoeuvre": lambda r: r["name"].replace("track coupled", "coupled"),
        "null": itemgetter("n_null"),
        "condition numbers": lambda r: ", ".join(f"{axis} {value:.1e}" for axis, value in r["condition"].items()),
        "v and r": lambda r: f"{r['coupling']['v and r']:.3f}",
        "w and q": lambda r: f"{r['coupling']['w and q']:.3f}",
        "margins": lambda r: ", ".join(f"{k} {a:g}, {b:g}" for k, (a, b) in r["margins"].items()),
    }
    return markdown.columns(lines, cells)


def share(value: dict) -> str:
    """Mean and standard error in words."""
    error = "" if value["error"] is None else f" ± {value['error']:.1%}"
    return f"{value['mean']:.0%}{error}"


def _proof(proof: dict) -> Iterator[str]:
    yield f"\nProof on {proof['vehicle']}, sensors {proof['sensors']}."
    results = [proof[name] | {"name": name} for name in ("best", "standard")]
    yield PROOF
    cells = {
        "manoeuvre": itemgetter("name"),
        "trials": itemgetter("n_trials"),
        "expected": lambda r: f"{r['n_known']['expected']:.1f} of {r['n_params']}",
        "achieved": lambda r: f"{r['n_known']['achieved']:.1f}",
        "sd over expected": lambda r: "{1:.2f} ({0:.2f} to {2:.2f})".format(*r["sd_over_expected"]),
        "error (sd)": lambda r: f"{r['rms_error']:.2f}",
    }
    cells |= {f"{level} hold": lambda r, level=level: share(r["coverage"][level]) for level in ("50 %", "90 %", "95 %")}
    cells |= {
        "sampled, converged": lambda r: f"{r['sampled']['n']}, {r['sampled']['n_converged']}",
        "sampled sd": lambda r: ", ".join(f"{x:.2f}" for x in r["sampled"]["sd_ratio"]),
        "mean less mode": lambda r: ", ".join(f"{x:.2f}" for x in r["sampled"]["shift"]),
    }
    yield from markdown.columns(results, cells)
    yield SEARCHES
    cells = {"manoeuvre": itemgetter("name"), "prior mean": lambda r: share(r["guess"])}
    cells |= {"posterior mode": lambda r: share(r["found"])}
    for name in ("SQP", "Gauss-Newton"):
        cells |= {
            name: lambda r, name=name: share(r["searches"][name]["found"]),
            f"{name}: fit": lambda r, name=name: f"{r['searches'][name]['n_fit']} of {r['searches'][name]['n']}",
            f"{name}: seconds": lambda r, name=name: f"{r['searches'][name]['seconds']:.1f}",
        }
    yield from markdown.columns(results, cells)
    yield UNSEEN
    cells = {"manoeuvre": itemgetter("name"), "flights": lambda r: r["unseen"]["n"]}
    for name in proof["best"]["unseen"]["errors"]:
        cells[name] = lambda r, name=name: "{:.3f} ({:.3f})".format(*r["unseen"]["errors"][name])
    cells |= {"90 % bands hold": lambda r: share(r["unseen"]["held"])}
    yield from markdown.columns(results, cells)


def claims(numbers: dict) -> Iterator[tuple[bool, str]]:
    """No manoeuvre tells all; searches go beyond random ones, and these beyond standard ones; posteriors are right."""
    for row in _rows(numbers["vehicles"]):
        what = f"{row['vehicle']}, {row['sensors']}"
        optimum, manoeuvre = known(row, "optimised"), row["manoeuvres"][f"{row['sensors']} optimised"]
        yield manoeuvre["within"], f"{what}: the optimised manoeuvre breaks a limit"
        yield optimum < row["n_coefficients"], f"{what}: all coefficients are known"
        yield manoeuvre["n_null"] > 0, f"{what}: the optimised manoeuvre has no null directions"
        means = {name: of_boats["mean"] for name, of_boats in row["boats"][row["sensors"]].items()}
        yield means["optimised"] >= means["coupled"], f"{what}: for other boats the coupled manoeuvre tells more"
        coupled = known(row, "standard coupled")
        yield optimum >= coupled, f"{what}: {optimum} known after the optimised manoeuvre, {coupled} after the coupled"
        if row["n_random"] < 1000:  # a quick run searches too little for the rest
            continue
        random = row["most"][row["sensors"]]["within"]
        yield optimum >= random, f"{what}: {optimum} known after the optimised manoeuvre, {random} after a random one"
        reasons = best(row)["reasons"]
        few = reasons["null"] <= FEW * row["n_coefficients"]
        yield few, f"{what}: null directions hide {reasons['null']} coefficients"
        yield reasons["imitated"] >= reasons["little"], f"{what}: more coefficients do too little than are imitated"
        correlations = row["correlations"][row["sensors"]]
        yield correlations["mean"] < 0.0, f"{what}: large condition numbers go with many known coefficients"
        better = abs(correlations["d"]) > abs(correlations["mean"])
        yield better, f"{what}: condition numbers rank manoeuvres better than the D-optimality"
    proof = numbers["proof"]
    for name in ("best", "standard"):
        result = proof[name]
        if result["n_trials"] < 5:  # a quick run
            continue
        yield result["rms_error"] < _WRONG, f"{name}: errors are {result['rms_error']:.2f} posterior sds"
        median = result["sd_over_expected"][1]
        yield 1.0 / _WIDER < median < _WIDER, f"{name}: posterior sds are {median:.2f} of the expected ones"
        for level, held in result["coverage"].items():
            miss = abs(held["mean"] - float(level.split()[0]) / 100.0)
            yield miss < _ERRORS * held["error"] + 0.01, f"{name}: {level} intervals hold {share(held)}"
    if proof["boats"] >= 5:
        found = [proof[name]["found"]["mean"] for name in ("best", "standard")]
        yield found[0] > found[1], "the best manoeuvre does not find more coefficients than the standard one"
