"""Where residuals are correlated, does the report say what makes them so?

Question: unmodelled forces, slow sensors, biases, a current and a coefficient held at a wrong value all make residuals
that follow from those before them. Is the right one proposed?
Claim: nine of ten records with forces of 1.5 % and 5 % of those of the hull get `[disturbance]` proposed first, and of
those with slow sensors, biases or a current nine of ten get what they have. No more than one in twenty of the records
without forces get `[disturbance]`, but for those of a drag coefficient held 10 % off: there a force on X that hardly
changes may look as probable.
Cost: five minutes.
"""

from functools import partial

import numpy as np

import bayesub as bs
from bayesub.problem.likelihoods import AR1, Normal
from bayesub.report import markdown
from thesis import wrong_models
from thesis.plots.wrong_models import draw_proposals
from thesis.wrong_models import FITS, NONE, UNCORRELATED, Departure

# Quick: a minute, because a record of each of twenty kinds is fitted and explained.
N_RECORDS, RIGHT_RECORDS, QUICK_RECORDS = 10, 30, 1
PRIOR_SD = 0.25
INSTRUMENTS = (
    bs.sensors.Track(0.1, 0.1, interval_s=1.0, channels=("x", "y", "yaw")),
    bs.sensors.DVL(0.005, interval_s=1.0),
    bs.sensors.Sensor("r_degps", sd=0.05, interval_s=1.0),
)
CASES = {
    "auv690": {"sensors": INSTRUMENTS, "bias": 0.05, "current_mps": (0.02, -0.01)},
    "suboff": {
        "sensors": bs.sensors.Track(0.5, 0.1, interval_s=1.0, channels=("x", "y", "yaw")),
        "bias": 0.5,
        "current_mps": (0.08, -0.06),
    },
}
SLOW_S = 5.0  # correlation time of slow sensors
FOUND, FALSE = 0.9, 0.05
FIGURES = {
    "explanations": "Records by what they have (rows) and what is proposed first for them (columns), in numbers of "
    "records. What is right has an orange frame; `not correlated`: the check fails for other reasons, `fits`: it does "
    "not fail. Forces of 0.5 % are mostly not seen, and a drag coefficient held off is once in a while taken for a "
    "force.",
}
KINDS = ("disturbance", "slow noise", "bias", "current", "coefficient", NONE, UNCORRELATED, FITS)
ANSWER = """
Of ten records of auv690 with forces of 1.5 % {auv690: forces of 1.5 %/first/disturbance; .0f} get `[disturbance]`
proposed first, of ten with a current {auv690: current*/first/current; .0f} the current. Of suboff's ten with Xuu
held 10 % off {suboff: Xuu held 10 % off/first/coefficient; .0f} get the coefficient.
"""
GLOSSARY = "booth"


def slow(channel):
    """Noise of every channel remembers."""
    return AR1(channel.sd, SLOW_S)


def slow_compass(channel):
    """The compass alone has slow errors, twice as large as said."""
    return AR1(2.0 * channel.sd, 4.0 * SLOW_S) if channel.name == "yaw" else Normal(channel.sd)


def records(case):
    """Name of a kind of record -> how it departs, and the explanations that are right, of a case."""
    bias, current = CASES[case]["bias"], CASES[case]["current_mps"]
    return {
        "right": (Departure(right=True), ()),
        "forces of 0.5 %": (Departure(disturbance=0.005), ("disturbance",)),
        "forces of 1.5 %": (Departure(disturbance=0.015), ("disturbance",)),
        "forces of 5 %": (Departure(disturbance=0.05), ("disturbance",)),
        "slow sensors": (Departure(noise=slow), ("slow noise",)),
        "a slow compass": (Departure(noise=slow_compass), ("slow noise",)),
        f"bias of {bias:g} of the unit": (Departure({"bias": bias}), ("bias",)),
        f"current of {np.hypot(*current):.2g} m/s": (Departure(current_mps=current), ("current",)),
        "Xuu held 10 % off": (Departure(held={"Xuu": 1.1}), ("coefficient",)),
        "2 % outliers": (Departure({"outlier_probability": 0.02}), ()),
    }


ITEMS = tuple((case, name) for case in CASES for name in records(case))
POWER = ("forces of 1.5 %", "forces of 5 %", "slow", "bias", "current")  # beginnings or parts of names


def compute(run):
    """What is proposed, by case and kind of record."""
    run.progress.stage("records")
    results = run.repeat("kinds", partial(kind, run.quick), len(ITEMS))
    return {f"{case}: {name}": result for (case, name), result in zip(ITEMS, results, strict=True)}


def kind(quick, number):
    """What is proposed for records of a kind."""
    case, name = ITEMS[number]
    departure, right = records(case)[name]
    n_records = QUICK_RECORDS if quick else RIGHT_RECORDS if departure.right else N_RECORDS
    rng, boat = np.random.default_rng([number, 20]), bs.load_vehicle(case)
    motion = bs.simulate(boat, bs.load_manoeuvre("horizontal", boat))
    sensors = CASES[case]["sensors"]
    problems = (departure.problem(motion, sensors, PRIOR_SD, rng) for _ in range(n_records))
    return {"right": list(right)} | wrong_models.proposals(problems, rng)


def draw(run, numbers):
    """A picture and a table of what is proposed first, rows are what records have."""
    draw_proposals(run.figure("explanations"), numbers, KINDS)
    lines = [
        "Records by what they have (rows) and what is proposed first for them (columns; not correlated: the check",
        "fails, but for other reasons; fits: it does not fail). The last columns are the time of an explanation, and",
        "the sds of forces that are proposed, medians, non-dimensional in 1e-5.\n",
    ]
    cells = {"record": lambda r: r["name"], "records": lambda r: r["n_records"]}
    cells |= {each: partial(_count, each) for each in KINDS}
    cells["seconds"] = lambda r: "" if r["seconds"] is None else f"{r['seconds']:.1f}"
    cells["sds"] = lambda r: ", ".join(f"{axis} {1e5 * np.median(sds):.2g}" for axis, sds in r["sizes"].items())
    run.page([*lines, *markdown.columns(markdown.named(numbers), cells)])


def _count(each, result):
    return str(result["first"].get(each, ""))


def claims(numbers):
    """The right explanation is proposed, and disturbances are not where there are none."""
    for name, result in numbers.items():
        n = result["n_records"]
        share = sum(result["first"].get(each, 0) for each in result["right"]) / n
        if any(part in name for part in POWER):
            yield share >= FOUND, f"{name}: {share:.0%} of the records get the right proposal"
    others = [r for name, r in numbers.items() if "forces" not in name and "Xuu" not in name]
    false = sum(r["first"].get("disturbance", 0) for r in others) / sum(r["n_records"] for r in others)
    yield false <= FALSE, f"[disturbance] is proposed for {false:.1%} of the records without forces"
