"""The card of a vehicle: turning circle, answer to the planes, coefficients beside those of the built-in vehicles."""

from itertools import cycle

import numpy as np

from bayesub.io.toml_files import built_in
from bayesub.io.words import powers
from bayesub.logs.log_files import STATES, positions
from bayesub.model.actuators import Actuators
from bayesub.model.equations import AXES
from bayesub.model.vehicles import load_vehicle
from bayesub.plots import style

_HULL, _TIP = 1.0, 2.1  # radii of the sketch of the tail
SMALLEST, LARGEST = 1e-10, 1e4  # sizes drawn; beyond them a coefficient sits at the edge
_MARKERS = "s^oDv<>p"  # of built-in vehicles, in the order of their names and of the colours of _COLOURS
_COLOURS = (style.SQP, style.LINEAR, style.POSTERIOR, style.WEAK, style.READINGS, style.NULL)


def draw(path, card) -> None:
    """One page of a :class:`bayesub.findings.vehicle_card.VehicleCard`."""
    boat = card.vehicle
    with style.figure(path, 11.7, 8.3) as figure:
        flights, below = figure.subfigures(2, 1, height_ratios=[1.0, 1.55])
        tail = ["tail"] * _has_tail(boat.actuators)
        axes = flights.subplot_mosaic([["turn", "yaw", "pitch", *tail], ["turn", "speed", "depth", *tail]])
        if tail:
            _draw_tail(axes["tail"], boat.actuators)
        _draw_turn(axes, card)
        _draw_dive(axes, card)
        _draw_coefficients(below, boat)
        n = len(card.warnings)
        count = "no warnings" if n == 0 else f"{n} warning{'s' if n > 1 else ''}"
        title = f"{style.plain(boat.name)}: {boat.length_m:g} m at {boat.speed_mps:g} m/s, {count}"
        figure.suptitle(title, fontsize=11)


def _has_tail(actuators: Actuators) -> bool:
    """Whether it is known where any fin stands."""
    return any(actuator.angle_deg is not None for actuator in actuators.members)


def _draw_tail(axis, actuators: Actuators) -> None:
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


def _way(card, key) -> np.ndarray:
    """Ship lengths travelled at the trial speed."""
    return card.flights[key].times * card.vehicle.speed_mps / card.vehicle.length_m


def _draw_turn(axes, card):
    boat, circle = card.vehicle, card.numbers["turning_circle"]
    for key, label in (("turn", "north (ship lengths)"), ("yaw", "yaw rate\n(deg/length)"), ("speed", "speed\n(%)")):
        axes[key].set_ylabel(label)
    axes["turn"].set_xlabel("east (ship lengths)")
    axes["speed"].set_xlabel("ship lengths at trial speed")
    axes["yaw"].tick_params(labelbottom=False)
    axes["yaw"].set_title("in the turn", fontsize=9)
    axes["turn"].set_title("turning circle: not simulated" if circle is None else _turn_title(circle), fontsize=9)
    if "turn" not in card.flights:
        return
    states, way = card.flights["turn"].states[0], _way(card, "turn")
    x, y = states[:, positions("x", "y")].T / boat.length_m
    axes["turn"].plot(y, x, color=style.POSTERIOR)
    axes["turn"].plot(0.0, 0.0, "o", color=style.TRUTH, ms=4)
    axes["turn"].set_aspect("equal", adjustable="datalim")
    rate = np.degrees(states[:, STATES.index("r")])
    axes["yaw"].plot(way, rate * boat.length_m / boat.speed_mps, color=style.POSTERIOR)
    speed = np.linalg.norm(states[:, positions("u", "v", "w")], axis=1) / boat.speed_mps
    axes["speed"].plot(way, 100.0 * speed, color=style.POSTERIOR)


def _turn_title(circle) -> str:
    if circle["diameter_lengths"] is None:
        return f"turning circle: no answer to {circle['rudder_deg']:g} deg of rudder"
    return f"{circle['rudder_deg']:g} deg of rudder: {circle['diameter_lengths']:.3g} ship lengths"


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
    states, way = card.flights["dive"].states[0], _way(card, "dive")
    z, theta = states[:, positions("z", "theta")].T
    axes["pitch"].plot(way, np.degrees(theta), color=style.POSTERIOR)
    axes["depth"].plot(way, (z - z[0]) / boat.length_m, color=style.POSTERIOR)


def _draw_coefficients(figure, boat):
    """Sizes of the coefficients, axis by axis, beside built-in vehicles of the same equations; zeros at the foot."""
    equations = boat.equations
    looks = dict(zip(built_in("vehicles"), zip(cycle(_MARKERS), cycle(_COLOURS), strict=False), strict=False))
    vehicles = {name: load_vehicle(name) for name in looks if name != boat.name}
    others = {name: other.xi for name, other in vehicles.items() if other.equations == equations}
    sizes = np.abs([boat.xi, *others.values()])
    positive = np.clip(sizes[sizes > 0.0], SMALLEST, LARGEST) if sizes.any() else np.ones(1)
    bottom, top = 10.0 ** np.floor(np.log10(positive.min()) - 1.0), 3.0 * positive.max()
    axes = [axis for axis in AXES if equations.names_of_axis(axis)]
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
        panel.set_yscale("log")
        panel.set_ylim(bottom, top)
        panel.set_xlim(-0.7, len(rows) - 0.3)
        names = [
            f"{term.name} ({powers(term.unit)})" if term.unit else term.name
            for term in (equations.terms[k] for k in rows)
        ]
        panel.set_xticks(places, [style.plain(name) for name in names], rotation=90, fontsize=7.5)
        panel.grid(axis="x", visible=False)
    for panel in panels[:, 0]:
        panel.set_ylabel("size of coefficient")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6, fontsize=8)
