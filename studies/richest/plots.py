"""What manoeuvres tell of coefficients: counts, spectra, why coefficients stay unknown, and the proof."""

import numpy as np

from bayesub.io.words import with_unit
from bayesub.logs.log_files import HEADERS, STATES
from bayesub.model.vehicles import load_vehicle
from bayesub.report.plots import style
from richest.appraisal import SHARE
from richest.floor import REASONS, SHARPER
from richest.tables import best_standard
from thesis.mechanisms import PAIRS

TITLES = {"track": "track", "rounded": "rounded ADCP, INS", "log": "Doppler log, gyros"}
SHOWN = ("track", "rounded")  # where there is no place for all
LINES = {  # label of a manoeuvre -> words, colour, line style
    "worst": ("random, worst", style.PRIOR, "-"),
    "middle": ("random, middle", "#808080", "-"),
    "standard coupled": ("coupled, built in", style.TRUTH, "--"),
    "best": ("random, best", style.POSTERIOR, "-"),
    "optimised": ("optimised", style.SQP, "-"),
}
REASON_COLOURS = dict(zip(REASONS, (style.POSTERIOR, style.WEAK, style.PRIOR, style.NULL), strict=True))
REASON_WORDS = {
    "known": "known to 10 %",
    "imitated": "imitated by others",
    "little": "too little effect",
    "null": "null directions",
}
SENSOR_COLOURS = {"track": style.POSTERIOR, "rounded": style.SQP, "log": style.LINEAR}
SENSOR_MARKERS = {"track": "o", "rounded": "s", "log": "^"}
COUPLED, MOTION = "standard coupled", ("z", "phi", "theta", "v", "w", "q", "r")
_LEGIBLE = 0.05  # share of a bar, above which its number is written


def chosen(arrays: dict[str, np.ndarray], *, motion: bool) -> dict[str, np.ndarray]:
    """The arrays of summaries that figures need: spectra by the manoeuvre's own sensors, and some motions if asked for.

    Parameters
    ----------
    arrays : dict of str to array
        "manoeuvre/key" -> array of :func:`richest.floor.summary`.
    motion : bool
    """
    some = {}
    for name, array in arrays.items():
        label, _, key = name.partition("/")
        optimised = label == COUPLED or label.endswith("optimised")
        if key.startswith("spectrum") and (label == COUPLED or label.startswith(key.split()[1])):
            some[name] = array
        if key.startswith("relative") and (label == COUPLED or (optimised and label.startswith(key.split()[2]))):
            some[name] = array
        if motion and optimised and key == "states":
            some[name] = array[:, [STATES.index(state) for state in MOTION]].astype(np.float16)
        if motion and optimised and key in ("times", "orders"):
            some[name] = array.astype(np.float16)
    return some


def draw_counts(path, vehicles: dict) -> None:
    """How many coefficients random manoeuvres make known, with the standard and the optimised ones."""
    with style.figure(path, 2.5 * len(vehicles) + 0.6, 6.0) as figure:
        panels = figure.subplots(len(TITLES), len(vehicles), squeeze=False, sharex="col", sharey=True)
        for column, (vehicle, result) in zip(panels.T, vehicles.items(), strict=True):
            n = result["n_coefficients"]
            for panel, sensors in zip(column, TITLES, strict=True):
                within, beyond = np.array(result["histograms"][sensors])
                edges = np.arange(n + 2) - 0.5
                panel.stairs(within + beyond, edges, color=style.PRIOR, fill=True)
                panel.stairs(within, edges, color=style.READINGS, fill=True)
                looks = result["manoeuvres"]
                coupled, optimum = (
                    looks[name]["sensors"][sensors]["n_known"][str(SHARE)] for name in (COUPLED, f"{sensors} optimised")
                )
                best, _ = best_standard(looks, sensors)
                floor = looks[f"{sensors} optimised"]["sensors"][sensors]["sharper"]["no error"]
                panel.axvline(coupled, color=style.TRUTH, lw=1.2, ls="--")
                panel.plot(best, 1.5, "^", color=style.TRUTH, ms=5, clip_on=False)
                panel.axvline(optimum, color=style.SQP, lw=1.8)
                panel.axvline(floor, color=style.NULL, lw=1.4, ls=":")
                panel.text(optimum + 0.012 * n, 0.97, optimum, color=style.SQP, fontsize=10, va="top",
                           transform=panel.get_xaxis_transform())  # fmt: skip
                panel.set(yscale="log", xlim=(0, n), ylim=(0.8, 8e3))
            column[0].set_title(f"{vehicle}, {n} coefficients", fontsize=9)
        for row, title in zip(panels, TITLES.values(), strict=True):
            row[0].set_ylabel(f"{title}\nrandom manoeuvres", fontsize=9)
        figure.supxlabel("coefficients known to 10 % after one trial", fontsize=9)
        one = panels[0, 0]
        handles = [
            one.fill([], [], color=style.READINGS, label="random, within limits")[0],
            one.fill([], [], color=style.PRIOR, label="random, beyond limits")[0],
            one.plot([], [], "--", color=style.TRUTH, lw=1.2, label="coupled, built in")[0],
            one.plot([], [], "^", color=style.TRUTH, ms=5, label="best built in")[0],
            one.plot([], [], color=style.SQP, lw=1.8, label="optimised within limits")[0],
            one.plot([], [], ":", color=style.NULL, lw=1.4, label="sensors without error")[0],
        ]
        title = _in_words(*next(iter(vehicles.items())))
        figure.legend(handles=handles, loc="outside upper center", ncols=6, fontsize=8, columnspacing=1.2, title=title)


def _in_words(vehicle: str, result: dict) -> str:
    """What a search finds for a boat, beside the best random manoeuvre."""
    sensors = next(iter(TITLES))
    optimised = result["manoeuvres"][f"{sensors} optimised"]["sensors"][sensors]["n_known"][str(SHARE)]
    best = np.flatnonzero(result["histograms"][sensors][0])[-1]
    some = f"{vehicle} by a {TITLES[sensors]}: {optimised} of {result['n_coefficients']} coefficients"
    return f"{some} on the optimised manoeuvre, {best} on the best random one within limits"


def draw_spectra(path, vehicles: dict, arrays: dict) -> None:
    """Singular values beside each other: the worst, middle and best random, the standard and the optimised one."""
    with style.figure(path, 2.1 * len(vehicles) + 0.6, 3.9) as figure:
        panels = figure.subplots(len(SHOWN), len(vehicles), squeeze=False, sharex="col", sharey="row")
        for column, vehicle in zip(panels.T, vehicles, strict=True):
            for panel, sensors in zip(column, SHOWN, strict=True):
                for label, (words, colour, line) in LINES.items():
                    name = label if label == COUPLED else f"{sensors} {label}"
                    values = arrays.get(f"{vehicle}/{name}/spectrum {sensors}")
                    if values is not None:
                        lower = np.maximum(values, 1e-3)
                        panel.semilogy(np.arange(1, len(values) + 1), lower, line, color=colour, lw=1.3, label=words)
                panel.axhline(1.0, color=style.TRUTH, lw=0.6)
                panel.set_ylim(bottom=1.1e-3)
            column[0].set_title(vehicle, fontsize=9)
            column[-1].set_xlabel("direction")
        for row, sensors in zip(panels, SHOWN, strict=True):
            row[0].set_ylabel(f"{TITLES[sensors]}\nprior sd / data sd", fontsize=9)
        handles, words = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper center", ncols=5, fontsize=8)


def draw_reasons(path, vehicles: dict) -> None:
    """Why coefficients stay unknown, and how many would be known with more information."""
    with style.figure(path, 2.6 * len(vehicles) + 0.6, 5.4) as figure:
        panels = figure.subplots(2, len(vehicles), squeeze=False, sharey="row", height_ratios=(1.1, 1.0))
        for (upper, lower), (vehicle, result) in zip(panels.T, vehicles.items(), strict=True):
            _draw_bars(upper, result)
            upper.set_title(vehicle, fontsize=9)
            for sensors, colour in SENSOR_COLOURS.items():
                counts = result["manoeuvres"][f"{sensors} optimised"]["sensors"][sensors]["sharper"]
                counts = [counts[name] for name in (*SHARPER, "no error")]
                lower.plot(range(len(counts)), counts, color=colour, marker=SENSOR_MARKERS[sensors], ms=4, lw=1.2)
            lower.axhline(result["n_coefficients"], color=style.TRUTH, lw=0.8)
            names = ["today", "2", "10", "100", "10⁴", "∞"]
            lower.set_xticks(range(len(names)), names)
            lower.set(xlabel="times the information", ylim=(0, None))
        panels[0, 0].set_yticks(
            range(2 * len(TITLES)), [f"{sensors}, {m}" for sensors in TITLES for m in ("coupled", "optimised")]
        )
        panels[0, 0].invert_yaxis()
        panels[1, 0].set_ylabel("known to 10 %, optimised")
        one = panels[0, 0]
        handles = [one.fill([], [], color=REASON_COLOURS[r], label=REASON_WORDS[r])[0] for r in REASONS]
        handles += [
            one.plot([], [], SENSOR_MARKERS[s] + "-", color=c, ms=4, label=TITLES[s])[0]
            for s, c in SENSOR_COLOURS.items()
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)


def _draw_bars(panel, result: dict) -> None:
    """The reasons on the coupled and the optimised manoeuvre by each set of sensors, stacked."""
    for k, sensors in enumerate(TITLES):
        for j, name in enumerate((COUPLED, f"{sensors} optimised")):
            counts, left = result["manoeuvres"][name]["sensors"][sensors]["reasons"], 0
            for reason in REASONS:
                panel.barh(2 * k + j, counts[reason], 0.8, left, color=REASON_COLOURS[reason], lw=0)
                if counts[reason] > _LEGIBLE * sum(counts.values()):
                    panel.text(left + 0.5 * counts[reason], 2 * k + j, counts[reason], fontsize=7, ha="center",
                               va="center", color="white" if reason == "known" else style.TRUTH)  # fmt: skip
                left += counts[reason]
    panel.set_xlim(0, left)
    panel.grid(axis="y", visible=False)


def draw_coupling(path, vehicle: str, result: dict, arrays: dict) -> None:
    """Sway against yaw and heave against pitch, over the coupled and the optimised manoeuvres (thesis Figure 68)."""
    labels = {COUPLED: "coupled, built in"} | {f"{s} optimised": f"optimised, {TITLES[s]}" for s in SHOWN}
    with style.figure(path, 2.2 * len(labels) + 0.5, 4.4) as figure:
        panels = figure.subplots(len(PAIRS), len(labels), squeeze=False, sharex="row", sharey="row")
        for column, (label, title) in zip(panels.T, labels.items(), strict=True):
            states = arrays[f"{vehicle}/{label}/states"].astype(float)
            for panel, (pair, (first, second)) in zip(column, PAIRS.items(), strict=True):
                x, y = np.degrees(states[:, MOTION.index(second)]), states[:, MOTION.index(first)]
                panel.plot(x, y, ".", ms=2.5, color=style.POSTERIOR)
                panel.set_xlabel(f"{second} (deg/s)")
                correlation = f"correlation {result['manoeuvres'][label]['coupling'][pair]:+.3f}"
                panel.text(1.0, 1.01, correlation, transform=panel.transAxes, ha="right", va="bottom", fontsize=8)
            column[0].set_title(title, fontsize=9, pad=16)
        for row, (first, _) in zip(panels, PAIRS.values(), strict=True):
            row[0].set_ylabel(f"{first} (m/s)")


def draw_manoeuvre(path, vehicle: str, arrays: dict, sensors: str = "log") -> None:
    """Orders, depth and attitude of the optimised manoeuvre over time."""
    label = f"{vehicle}/{sensors} optimised"
    times, orders, states = (arrays[f"{label}/{key}"].astype(float) for key in ("times", "orders", "states"))
    shorts = [control.short for control in load_vehicle(vehicle).equations.controls]
    names = [with_unit(HEADERS.get(short, short)) for short in shorts]
    with style.figure(path, 7.5, 4.9) as figure:
        panels = figure.subplots(4, 1, sharex=True)
        colours = (style.POSTERIOR, style.LINEAR, style.SQP)
        for row, name, colour in zip(orders[:-1], names, colours, strict=False):
            panels[0].plot(times, np.degrees(row), color=colour, lw=1.0, label=name)
        panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
        panels[0].set_ylabel("orders")
        panels[1].plot(times, orders[-1], color=style.TRUTH, lw=1.0)
        panels[1].set_ylabel("propeller\n(rpm)")
        depth, phi, theta = (states[:, MOTION.index(name)] for name in ("z", "phi", "theta"))
        panels[2].plot(times, depth, color=style.POSTERIOR, lw=1.2)
        panels[2].set_ylabel("depth (m)")
        panels[2].invert_yaxis()
        panels[3].plot(times, np.degrees(phi), color=style.LINEAR, lw=1.0, label="roll (deg)")
        panels[3].plot(times, np.degrees(theta), color=style.SQP, lw=1.0, label="pitch (deg)")
        panels[3].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
        panels[3].set(ylabel="attitude", xlabel="time (s)")
        panels[0].set_title(f"{vehicle}: optimised for {TITLES[sensors]}", fontsize=9)


def draw_options(path, options: list[dict], worth: dict) -> None:
    """How many coefficients each option of a trial makes known, each sensor, and each value from a towing tank."""
    sensors = {f"without {name}": r for name, r in worth["without"].items()}
    sensors |= {f"with {name}": r for name, r in worth["further"].items()}
    sensors = {"as they are": worth["whole"]} | sensors
    tank = {"none": worth["whole"]} | {f"+ {v['name']}": v for v in worth["tank"]}
    columns = {
        "a search of each option": {r["name"] + ("" if r["within"] else " (beyond)"): r for r in options},
        "best manoeuvre: sensors": sensors,
        "and values from a tank": tank,
    }
    height = 0.22 * max(map(len, columns.values())) + 0.8
    with style.figure(path, 11.0, height) as figure:
        panels = figure.subplots(1, len(columns))
        for panel, (title, results) in zip(panels, columns.items(), strict=True):
            values = [r["n_known"] for r in results.values()]
            panel.barh(range(len(values)), values, color=[style.PRIOR, *[style.POSTERIOR] * (len(values) - 1)])
            for k, count in enumerate(values):
                panel.text(max(count, values[0]) + 0.5, k, count, va="center", fontsize=8)
            panel.axvline(values[0], color=style.TRUTH, lw=0.8)
            panel.set_yticks(range(len(values)), list(results), fontsize=8)
            panel.set_ylim(max(map(len, columns.values())) - 0.4, -0.6)
            panel.set_title(title, fontsize=9)
            panel.grid(axis="y", visible=False)
        figure.supxlabel(f"coefficients known to 10 % of {worth['whole']['n_coefficients']}", fontsize=9)


def draw_proof(path, proof: dict) -> None:
    """Expected against achieved sds, coverage, and how many coefficients are found."""
    looks = {"standard": (style.TRUTH, "s", "coupled"), "best": (style.SQP, "o", "best")}
    with style.figure(path, 10.0, 3.4) as figure:
        first, second, third = figure.subplots(1, 3, width_ratios=(1.1, 0.8, 1.2))
        for name, (colour, marker, words) in looks.items():
            expected, achieved = np.array(proof[name]["pairs"])
            first.loglog(expected, achieved, marker, color=colour, ms=3.5, alpha=0.8, label=words)
        ends = np.array([min(first.get_xlim()), max(first.get_xlim())])
        first.plot(ends, ends, color=style.TRUTH, lw=0.7)
        first.set(xlabel="expected sd over value", ylabel="posterior sd, median of boats")
        first.legend(fontsize=8)
        for k, (name, (colour, marker, _)) in enumerate(looks.items()):
            for j, (level, held) in enumerate(proof[name]["coverage"].items()):
                error = 2.0 * (held["error"] or 0.0)
                second.errorbar(j + 0.16 * (k - 0.5), held["mean"], error, fmt=marker, color=colour, ms=5)
                second.plot([j - 0.3, j + 0.3], [float(level.split()[0]) / 100] * 2, color=style.TRUTH, lw=0.8)
        second.set_xticks(range(3), list(proof["best"]["coverage"]))
        second.set(ylim=(0, 1.03), xlabel="intervals", ylabel="share that hold the truth")
        words = ("no trial", "posterior mode", "SQP", "Gauss-Newton")
        for k, (name, (colour, *_)) in enumerate(looks.items()):
            result = proof[name]
            found = [result["guess"], result["found"], *(result["searches"][w]["found"] for w in words[2:])]
            place = np.arange(len(words)) + 0.38 * (k - 0.5)
            third.bar(place, [f["mean"] for f in found], 0.36, yerr=[2.0 * (f["error"] or 0.0) for f in found],
                      color=colour, ecolor="#808080")  # fmt: skip
        third.set_xticks(range(len(words)), [word.replace(" ", "\n").replace("-", "-\n") for word in words])
        third.set(ylabel="coefficients within 10 %", ylim=(0, 1))
        third.grid(axis="x", visible=False)
