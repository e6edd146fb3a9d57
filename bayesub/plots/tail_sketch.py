"""The tail of a boat seen from astern: where its fins stand, and which way they are positive."""

import numpy as np

from bayesub.model.actuators import Actuators
from bayesub.plots import style

HULL, TIP = 1.0, 2.1  # radii of the sketch


def has_tail(actuators: Actuators) -> bool:
    """Whether it is known where any fin stands."""
    return any(actuator.angle_deg is not None for actuator in actuators.members)


def draw(axis, actuators: Actuators) -> None:
    """Draw the hull, the fins with their names, and an arrow towards which the trailing edge goes if positive."""
    turn = np.linspace(0.0, 2.0 * np.pi, 101)
    axis.fill(HULL * np.sin(turn), HULL * np.cos(turn), color=style.PRIOR, lw=0)
    for actuator in actuators.members:
        if actuator.angle_deg is None:
            continue
        angle = np.radians(actuator.angle_deg)
        outwards, clockwise = np.array([np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), -np.sin(angle)])
        axis.plot(*np.outer(outwards, [HULL, TIP]), color=style.POSTERIOR, lw=3, solid_capstyle="butt")
        label = f"{style.plain(actuator.name)}\n{actuator.angle_deg:g} deg"
        axis.text(*(1.38 * TIP * outwards), label, ha="center", va="center", fontsize=8)
        if actuator.turns:
            foot = 0.5 * (HULL + TIP) * outwards
            arrow = {"arrowstyle": "->", "color": style.TRUTH}
            axis.annotate("", foot - 0.7 * actuator.turns * clockwise, foot, arrowprops=arrow)
    axis.set(xlim=(-3.6, 3.6), ylim=(-3.6, 3.6), aspect="equal")
    axis.set_title("tail from astern, positive angles", fontsize=9)
    axis.axis("off")
