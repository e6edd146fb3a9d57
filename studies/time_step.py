"""How accurate is the simulation at a given time step, with controls interpolated and with controls held?

Question: the thesis's Tables 4 and 5 show first-order convergence of a fourth-order integrator. Why?
Claim: held controls reproduce its errors (0.70 m at 0.1 s, 8 m at 1 s on the horizontal manoeuvre); the same
integrator with controls interpolated at its stages is better at 1 s steps than with held ones at 0.1 s.
Cost: seconds.
"""

import numpy as np

import bayesub as bs
from bayesub.report.markdown import table
from thesis.cases import CASES, published, time_scale
from time_step import plots

STEPS = (0.01, 0.1, 0.5, 1.0)  # s on a boat of suboff's length over speed
REFERENCE_STEP, SAMPLE = 0.005, 0.1  # s, in the same way
FIGURES = {
    "time_step": "Largest position error of a step, by manoeuvre. Full lines, controls held over a step, fall by ten "
    "when the step does, for every boat and for the thesis's three (bars). Dashed lines, controls interpolated, are "
    "orders of magnitude below them; arrows point to errors below the edge.",
}
ANSWER = """
With controls held over a step the largest position error of the spiral of suboff is {suboff
horizontal/hold/position_m/0.1; .2f} m at steps of 0.1 s and {suboff horizontal/hold/position_m/1.0; .1f} m at 1 s,
the thesis's own figures: the integrator converges with order {*/hold/order; min; .2f} to {*/hold/order; max; .2f}.
With controls interpolated at its stages it is off by {suboff horizontal/linear/position_m/1.0; milli; .0f} mm at 1
s.
"""


def compute(run):
    """Errors of every vehicle, manoeuvre, convention of the controls and step."""
    cases = CASES[:3] if run.quick else CASES
    run.progress.stage("time steps")
    numbers = {}
    for n, (vehicle, manoeuvre) in enumerate(cases, start=1):
        numbers[f"{vehicle} {manoeuvre}"] = errors(vehicle, manoeuvre)
        run.progress.update(n, len(cases), "cases")
    return numbers


def errors(vehicle, manoeuvre):
    """Largest position error (m) and cost function (model manual, section 10) against a fine step."""
    boat = bs.load_vehicle(vehicle)
    flown, scale = bs.load_manoeuvre(manoeuvre, boat), time_scale(boat)
    sample = flown.duration / round(flown.duration / (SAMPLE * scale))
    reference = bs.simulate(boat, flown, dt=REFERENCE_STEP * scale, sample=sample).states[0]
    result = {"time_scale": scale}
    for convention in ("linear", "hold"):
        position, cost = {}, {}
        for step in STEPS:
            states = bs.simulate(boat, flown, dt=step * scale, sample=sample, controls=convention).states[0]
            off = states[:, :6] - reference[:, :6]
            off[:, 3:] = np.degrees(off[:, 3:])
            position[str(step)] = float(np.linalg.norm(off[:, :3], axis=1).max())
            cost[str(step)] = float(np.sum(off**2))
        order = np.log10(position["1.0"] / position["0.1"])
        result[convention] = {"position_m": position, "cost": cost, "order": float(order)}
    return result


def draw(run, numbers):
    """Errors against the step; Tables 5 and 4 of the thesis beside ours."""
    thesis = published()["time_step"]
    plots.draw(run.figure("time_step"), numbers, STEPS, thesis["max_position_error_m"])
    run.page(
        [
            "Largest position error in m against a fine step (thesis Table 5).\n",
            *table_of(numbers, "position_m", thesis["max_position_error_m"]),
            "\nCost in m^2 + deg^2 against a fine step (thesis Table 4).\n",
            *table_of(numbers, "cost", thesis["cost"]),
        ]
    )


def table_of(numbers, quantity, thesis):
    """One quantity by case, convention and step."""
    lines = [
        (case, convention, *(f"{value:.2g}" for value in result[convention][quantity].values()))
        for case, result in numbers.items()
        for convention in ("hold", "linear")
    ]
    for manoeuvre, rows in thesis.items():
        cells = (", ".join(f"{value:g}" for value in rows.get(str(s), [])) for s in STEPS)
        lines.append((f"thesis's three boats, {manoeuvre}", "hold", *cells))
    return table(("vehicle, manoeuvre", "controls", *(f"{s:g} s" for s in STEPS)), lines)


def claims(numbers):
    """The thesis's errors with held controls, and better ones with interpolated controls."""
    held, linear = (numbers["suboff horizontal"][convention]["position_m"] for convention in ("hold", "linear"))
    yield 0.6 < held["0.1"] < 0.8, f"held controls at 0.1 s: {held['0.1']:.3f} m is not the thesis's 0.69 m"
    yield 7.5 < held["1.0"] < 8.5, f"held controls at 1 s: {held['1.0']:.2f} m is not the thesis's 8.1 m"
    yield linear["1.0"] < 0.02, f"interpolated controls at 1 s: {linear['1.0']:.3f} m is not below 2 cm"
    for case, result in numbers.items():
        order = result["hold"]["order"]
        yield 0.8 < order < 1.2, f"{case}: held controls converge with order {order:.2f}, not 1"
        better = result["hold"]["position_m"]["0.1"] / result["linear"]["position_m"]["1.0"]
        yield better > 1, f"{case}: interpolated controls at 1 s are not better than held ones at 0.1 s"
