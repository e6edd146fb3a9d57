"""How accurate is the simulation at a given time step, with controls interpolated and with controls held?

Question: the thesis's Tables 4 and 5 show first-order convergence of a fourth-order integrator. Why?
Claim: held controls reproduce its errors (0.70 m at 0.1 s, 8 m at 1 s on the horizontal manoeuvre); the same
integrator with controls interpolated at its stages is better at 1 s steps than with held ones at 0.1 s.
Cost: seconds.
"""

from itertools import product

import numpy as np

import bayesub as bs
from bayesub.plots import style
from bayesub.report.markdown import table
from bayesub.thesis.cases import published

VEHICLES = ("suboff", "auv690", "npsauv")
MANOEUVRES = ("horizontal", "vertical", "coupled")
STEPS = (0.01, 0.1, 0.5, 1.0)  # s on a boat of suboff's length over speed
REFERENCE_STEP = 0.005
SUBOFF_TIME = 102.2606 / 7.5  # s to travel a ship length
COLOURS = {"suboff": style.POSTERIOR, "auv690": style.SQP, "npsauv": style.LINEAR}


def run(folder, *, quick, progress):
    """Errors of every vehicle, manoeuvre, convention and step; draws ``time_step.png``."""
    thesis = published()["time_step"]
    cases = list(product(VEHICLES[:1] if quick else VEHICLES, MANOEUVRES))
    progress.stage("time steps")
    numbers = {}
    for n, (vehicle, manoeuvre) in enumerate(cases):
        numbers[f"{vehicle} {manoeuvre}"] = errors(vehicle, manoeuvre)
        progress.update((n + 1) / len(cases), f"{vehicle} {manoeuvre}")
    draw(folder / "time_step.png", numbers, thesis["max_position_error_m"])
    draw(folder / "time_step.pdf", numbers, thesis["max_position_error_m"])
    (folder / "time_step.md").write_text(tables(numbers, thesis))

    held, linear = (numbers["suboff horizontal"][convention]["position_m"] for convention in ("hold", "linear"))
    assert 0.6 < held["0.1"] < 0.8, f"held controls at 0.1 s: {held['0.1']:.3f} m is not the thesis's 0.69 m"
    assert 7.5 < held["1.0"] < 8.5, f"held controls at 1 s: {held['1.0']:.2f} m is not the thesis's 8.1 m"
    assert linear["1.0"] < 0.02, f"interpolated controls at 1 s: {linear['1.0']:.3f} m is not below 2 cm"
    for case, result in numbers.items():
        order = result["hold"]["order"]
        assert 0.8 < order < 1.2, f"{case}: held controls converge with order {order:.2f}, not 1"
        better = result["hold"]["position_m"]["0.1"] / result["linear"]["position_m"]["1.0"]
        assert better > 1, f"{case}: interpolated controls at 1 s are not better than held ones at 0.1 s"
    return numbers


def errors(vehicle, manoeuvre):
    """Largest position error (m) and cost function (model section 10) against a fine step, by convention and step."""
    boat = bs.load_vehicle(vehicle)
    flown = bs.load_manoeuvre(manoeuvre, boat)
    scale = boat.length_m / boat.speed_mps / SUBOFF_TIME
    sample = flown.duration / round(flown.duration / (0.1 * scale))
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


def draw(path, numbers, thesis):
    """Largest position error against the step, ours and the thesis's."""
    with style.figure(path, 9.0, 3.6) as figure:
        panels = figure.subplots(1, len(MANOEUVRES), sharey=True)
        for panel, manoeuvre in zip(panels, MANOEUVRES, strict=True):
            for case, result in numbers.items():
                vehicle = case.split()[0]
                if case.endswith(manoeuvre):
                    for convention, line in (("hold", "-"), ("linear", "--")):
                        values = np.maximum(list(result[convention]["position_m"].values()), 1e-9)
                        label = f"{vehicle}, {'held' if convention == 'hold' else 'interpolated'}"
                        panel.loglog(STEPS, values, line, marker="o", ms=4, color=COLOURS[vehicle], label=label)
            for step, values in thesis[manoeuvre].items():
                points = [float(step)] * len(values)
                label = "thesis, three boats" if step == "0.1" else None
                panel.loglog(points, values, "k_", ms=12, mew=1.5, label=label)
            panel.set_title(manoeuvre, fontsize=9)
            panel.set_xlabel("time step, scaled to a 102 m boat (s)")
        panels[0].set_ylabel("largest position error (m)")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)


def tables(numbers, thesis):
    """Tables 5 and 4 of the thesis beside ours, in Markdown."""
    lines = [
        "Largest position error in m against a fine step (thesis Table 5).\n",
        *table_of(numbers, "position_m", thesis["max_position_error_m"]),
        "\nCost in m^2 + deg^2 against a fine step (thesis Table 4).\n",
        *table_of(numbers, "cost", thesis["cost"]),
    ]
    return "\n".join(lines) + "\n"


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
