"""The cards of ``bayesub check`` that are a page of figures: those of a vehicle, and of the data of a study."""

from itertools import cycle

import numpy as np

from bayesub.findings.data_card import DataCard
from bayesub.findings.vehicle_card import VehicleCard
from bayesub.io import toml_files
from bayesub.io.words import counted, powers
from bayesub.logs.log_files import STATES, positions
from bayesub.report.plots import style
from bayesub.report.plots.coefficients import labels

_HULL, _TIP = 1.0, 2.1  # radii of the sketch of the tail
SMALLEST, LARGEST = 1e-10, 1e4  # sizes drawn; beyond them a coefficient sits at the edge
_MARKERS = "s^oDv<>p"  # of built-in vehicles, in the order of their names and of the colours of _COLOURS
_COLOURS = (style.SQP, style.LINEAR, style.POSTERIOR, style.WEAK, style.READINGS, style.NULL)


def draw(card: VehicleCard | DataCard, path: style.Paths) -> None:
    """Draw a card; others are in words only."""
    (_draw_vehicle if isinstance(card, VehicleCard) else _draw_data)(card, path)


def _draw_vehicle(card, path):
    boat = card.vehicle
    with style.figure(path, 11.7, 8.3) as figure:
        flights, below = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.0, 1.55])[:, 0]
        tail = ["tail"] * any(actuator.angle_deg is not None for actuator in boat.actuators.members)  # where fins stand
        axes = flights.subplot_mosaic([["turn", "yaw", "pitch", *tail], ["turn", "speed", "depth", *tail]])
        if tail:
            _draw_tail(axes["tail"], boat.actuators)
        _draw_turn(axes, card)
        _draw_dive(axes, card)
        _draw_coefficients(below, card)
        count = counted(len(card.warnings), "warning") if card.warnings else "no warnings"
        title = f"{style.plain(boat.name)}: {boat.length_m:g} m at {boat.speed_mps:g} m/s, {count}"
        figure.suptitle(title, fontsize=11)


def _draw_tail(axis, actuators) -> None:
    """Draw the hull, the fins with their names, and an arrow towards which the trailing edge goes if positive."""
    turn = np.linspace(0.0, 2.0 * np.pi, 101)
    axis.fill(_HULL * np.sin(turn), _HULL * np.cos(turn), color=style.PRIOR, lw=0)
    for actuator in actuators.members:
        if actuator.angle_deg is None:
            continue
        angle = np.radians(actuator.angle_deg)
        outwards, clockwise = np.array([np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), -np.sin(angle)])
        axis.plot(*np.outer(outwards, [_HULL, _TIP]), color=style.POSTERIOR, lw=3, solid_capstyle="butt")
        label = f"{style.plain(actuator.name)}\n{actuator.angle_deg:g} deg"
        axis.text(*(1.38 * _TIP * outwards), label, ha="center", va="center", fontsize=8)
        if actuator.turns:
            foot = 0.5 * (_HULL + _TIP) * outwards
            arrow = {"arrowstyle": "->", "color": style.TRUTH}
            axis.annotate("", foot - 0.7 * actuator.turns * clockwise, foot, arrowprops=arrow)
    axis.set(xlim=(-3.6, 3.6), ylim=(-3.6, 3.6), aspect="equal")
    axis.set_title("tail from astern, positive angles", fontsize=9)
    axis.axis("off")


def _flown(card, key) -> tuple[np.ndarray, np.ndarray]:
    """States (n, 12) of a flight, and ship lengths travelled at the trial speed (n,)."""
    boat, flight = card.vehicle, card.flights[key]
    return flight.states[0], flight.times * boat.speed_mps / boat.length_m


def _draw_turn(axes, card):
    boat, circle = card.vehicle, card.numbers["turning_circle"]
    axes["turn"].set(xlabel="east (ship lengths)", ylabel="north (ship lengths)")
    axes["speed"].set(xlabel="ship lengths at trial speed", ylabel="speed\n(%)")
    axes["yaw"].set_ylabel("yaw rate\n(deg/length)")
    axes["yaw"].tick_params(labelbottom=False)
    axes["yaw"].set_title("in the turn", fontsize=9)
    title = "turning circle: not simulated"
    if circle is not None:
        title = f"turning circle: no answer to {circle['rudder_deg']:g} deg of rudder"
        if circle["diameter_lengths"] is not None:
            title = f"{circle['rudder_deg']:g} deg of rudder: {circle['diameter_lengths']:.3g} ship lengths"
    axes["turn"].set_title(title, fontsize=9)
    if "turn" not in card.flights:
        return
    states, way = _flown(card, "turn")
    x, y = states[:, positions("x", "y")].T / boat.length_m
    axes["turn"].plot(y, x, color=style.POSTERIOR)
    axes["turn"].plot(0.0, 0.0, "o", color=style.TRUTH, ms=4)
    axes["turn"].set_aspect("equal", adjustable="datalim")
    rate = np.degrees(states[:, STATES.index("r")])
    axes["yaw"].plot(way, rate * boat.length_m / boat.speed_mps, color=style.POSTERIOR)
    speed = np.linalg.norm(states[:, positions("u", "v", "w")], axis=1) / boat.speed_mps
    axes["speed"].plot(way, 100.0 * speed, color=style.POSTERIOR)


def _draw_dive(axes, card):
    boat, answer = card.vehicle, card.numbers["stern_plane"]
    if "stern_plane" in card.numbers.get("skipped", {}):
        axes["pitch"].axis("off")
        axes["depth"].axis("off")
        return
    axes["pitch"].set_ylabel("pitch\n(deg)")
    axes["pitch"].tick_params(labelbottom=False)
    axes["depth"].set(ylabel="deeper\n(ship lengths)", xlabel="ship lengths at trial speed")
    axes["depth"].invert_yaxis()
    title = "stern planes: not simulated" if answer is None else f"{answer['angle_deg']:+g} deg of stern planes"
    axes["pitch"].set_title(title, fontsize=9)
    if "dive" not in card.flights:
        return
    states, way = _flown(card, "dive")
    z, theta = states[:, positions("z", "theta")].T
    axes["pitch"].plot(way, np.degrees(theta), color=style.POSTERIOR)
    axes["depth"].plot(way, (z - z[0]) / boat.length_m, color=style.POSTERIOR)


def _draw_coefficients(figure, card):
    """Sizes of the coefficients, axis by axis, beside built-in vehicles of the same equations; zeros at the foot."""
    boat, others = card.vehicle, card.others
    equations = boat.equations
    all_looks = zip(cycle(_MARKERS), cycle(_COLOURS), strict=False)
    looks = dict(zip(toml_files.built_in("vehicles"), all_looks, strict=False))
    sizes = np.abs([boat.xi, *others.values()])
    positive = np.clip(sizes[sizes > 0.0], SMALLEST, LARGEST) if sizes.any() else np.ones(1)
    bottom, top = 10.0 ** np.floor(np.log10(positive.min()) - 1.0), 3.0 * positive.max()
    axes = list(card.numbers["zero_coefficients"])  # those that the equations have
    n_rows = 2 if len(axes) > 3 else 1
    panels = figure.subplots(n_rows, -(-len(axes) // n_rows), sharey=True, squeeze=False)
    for panel in panels.flat[len(axes) :]:
        panel.axis("off")
    for axis, panel in zip(axes, panels.flat, strict=False):
        rows = equations.columns(equations.names_of_axis(axis))
        places = np.arange(len(rows))
        for name, xi in others.items():
            values = np.abs(xi[rows])
            drawn = np.where(values > 0.0, values, np.nan)
            marker, colour = looks[name]
            panel.plot(places, drawn, marker, ms=4.5, mfc="none", mec=colour, mew=0.9, label=name)
        values = boat.xi[rows]
        for sign, marker in ((1.0, "+"), (-1.0, "_")):
            chosen = np.sign(values) == sign
            label = f"{style.plain(boat.name)}, {'positive' if sign > 0 else 'negative'}"
            drawn = np.clip(np.abs(values[chosen]), SMALLEST, LARGEST)
            panel.plot(places[chosen], drawn, marker, ms=9, mew=2.0, color=style.TRUTH, ls="", label=label)
        zero = values == 0.0
        panel.plot(places[zero], np.full(zero.sum(), 2.0 * bottom), "x", ms=4, color=style.NULL, ls="", label="zero")
        panel.set(yscale="log", ylim=(bottom, top), xlim=(-0.7, len(rows) - 0.3))
        terms = [equations.terms[k] for k in rows]
        names = [f"{term.name} ({powers(term.unit)})" if term.unit else term.name for term in terms]
        panel.set_xticks(places, [style.plain(name) for name in names], rotation=90, fontsize=7.5)
        panel.grid(axis="x", visible=False)
    for panel in panels[:, 0]:
        panel.set_ylabel("size of coefficient")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=6, fontsize=8)


def _draw_data(card, path):
    width, row = max(11.7, 0.21 * len(card.names) + 4.0), 0.27 * (len(card.channels) + 1)
    with style.figure(path, width, 2 * row + 3.2) as figure:
        above, below = figure.subplots(2, 1)
        _draw_coverage(above, card)
        _draw_information(figure, below, card)
        figure.suptitle(style.plain(card.title), fontsize=11)


def _draw_coverage(axis, card):
    n_trials = len(card.durations)
    beside = {"transform": axis.get_yaxis_transform(), "va": "center", "fontsize": 8}
    for k, duration in enumerate(card.durations.values()):
        axis.barh(k, duration, height=0.5, color=style.PRIOR)
        axis.text(1.01, k, f"{duration:.4g} s", **beside)
    for k, channel in enumerate(card.channels, start=n_trials):
        axis.plot(channel.times, np.full(len(channel.times), k), "|", ms=7, mew=0.5, color=style.POSTERIOR)
        for start, end in channel.gaps:
            axis.plot([start, end], [k, k], color=style.WEAK, lw=4, solid_capstyle="butt")
        axis.plot(channel.outliers, np.full(len(channel.outliers), k), "x", ms=7, mew=1.8, color=style.SQP)
        axis.text(1.01, k, f"{len(channel.times)} readings, every {channel.interval_s:.3g} s", **beside)
    for line, colour, label in (("|", style.POSTERIOR, "reading"), ("x", style.SQP, "outlier?")):
        axis.plot([], [], line, color=colour, mew=1.8, label=label)
    axis.plot([], [], color=style.WEAK, lw=4, label="gap")
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8)
    controls = [f"controls[{trial}]" if trial else "controls" for trial in card.durations]
    axis.set_yticks(range(n_trials + len(card.channels)), controls + [c.name for c in card.channels])
    axis.invert_yaxis()
    axis.grid(axis="y", visible=False)
    axis.set_xlabel("time from the first control (s)")
    axis.set_title("what was read, and when", fontsize=9, loc="left")


def _draw_information(figure, axis, card):
    rows = np.array([*(channel.contraction for channel in card.channels), card.contraction])
    image = axis.imshow(rows, cmap="Blues_r", vmin=0.0, vmax=1.0, aspect="auto")
    axis.set_yticks(range(len(rows)), [*(channel.name for channel in card.channels), "all together"])
    axis.set_xticks(range(len(card.names)), labels(card.names, card.equations), rotation=90, fontsize=8)
    axis.grid(visible=False)
    axis.axvline(card.n_coefficients - 0.5, color=style.TRUTH, lw=0.8)
    axis.axhline(len(rows) - 1.5, color=style.TRUTH, lw=0.8)
    beside = {"transform": axis.get_yaxis_transform(), "fontsize": 8}
    for k, count in enumerate([*(channel.n_directions for channel in card.channels), card.n_directions]):
        axis.text(1.01, k, f"{count} of {len(card.names)}", va="center", **beside)
    axis.text(1.01, -0.75, "directions", va="bottom", **beside)
    figure.colorbar(image, ax=axis, shrink=0.9, pad=0.09, label="posterior / prior sd")
    title = "what each channel alone says, by the Fisher information at the prior centre"
    axis.set_title(title, fontsize=9, loc="left")
