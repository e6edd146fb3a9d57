"""Two simulators on the comparison manoeuvre (thesis Figures 22 to 25 and 101 to 112)."""

import numpy as np

from bayesub.report.plots import style

_SYMBOLS = {"phi": r"$\phi$ (rad)", "theta": r"$\theta$ (rad)", "psi": r"$\psi$ (rad)"}
_UNITS = {"x": "m", "y": "m", "z": "m", "u": "m/s", "v": "m/s", "w": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s"}
_CONTROLS = (("rudder", style.POSTERIOR), ("bow planes", style.WEAK), ("stern planes", style.SQP))


def draw_manoeuvre(path, case, interval) -> None:
    """Control angles over time, and the track from above and from the side.

    Parameters
    ----------
    path : one file or several
    case : arrays "controls_deg" (n_times, 3) and "states" (n_times, 12)
    interval : s between rows
    """
    controls, states = case["controls_deg"], case["states"]
    times = interval * np.arange(len(states))
    with style.figure(path, 9.0, 2.8) as figure:
        panels = figure.subplots(1, 3, width_ratios=(1.5, 1.0, 1.0))
        for k, (name, colour) in enumerate(_CONTROLS):
            panels[0].plot(times, controls[:, k], color=colour, label=name)
        panels[0].set(xlabel="time (s)", ylabel="angle (deg)")
        panels[0].legend(fontsize=8)
        panels[1].plot(states[:, 1], states[:, 0], color=style.TRUTH)
        panels[1].set(xlabel="east (m)", ylabel="north (m)")
        panels[1].set_aspect("equal", adjustable="datalim")
        panels[2].plot(times, states[:, 2], color=style.TRUTH)
        panels[2].set(xlabel="time (s)", ylabel="depth (m)")
        panels[2].invert_yaxis()


def draw_differences(path, between, keys, interval) -> None:
    """Differences over time of two simulators, a panel a state, a line a boat.

    Parameters
    ----------
    path : one file or several
    between : vehicle -> "differences" (n_times, 12), in units of a boat as long and as fast as suboff
    keys : (12,) names of the states
    interval : s between rows, likewise
    """
    with style.figure(path, 10.0, 6.6) as figure:
        panels = figure.subplots(4, 3, sharex=True)
        for k, (panel, key) in enumerate(zip(panels.ravel(), keys, strict=True)):
            for vehicle, case in between.items():
                values = case["differences"][:, k]
                panel.plot(
                    interval * np.arange(len(values)), values, color=style.VEHICLES[vehicle], lw=0.9, label=vehicle
                )
            panel.set_ylabel(_SYMBOLS.get(key) or f"${key}$ ({_UNITS[key]})")
            panel.ticklabel_format(axis="y", scilimits=(-2, 2))
        for panel in panels[-1]:
            panel.set_xlabel("time (s)")
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)


def draw_causes(path, causes, theirs) -> None:
    """Largest differences of u against those of x, a panel a boat and a marker a cause, beside the thesis's.

    `causes` are vehicle -> cause -> "u" (m/s) and "x" (m), and `theirs` key -> of the three boats.
    """
    with style.figure(path, 8.6, 3.6) as figure:
        panels = figure.subplots(1, len(causes), sharex=True, sharey=True, squeeze=False)[0]
        for k, (panel, (vehicle, of)) in enumerate(zip(panels, causes.items(), strict=True)):
            for (cause, one), marker in zip(of.items(), "osD^v<>PX*", strict=True):
                is_late = "planes late" in cause
                colour = style.SQP if is_late else style.POSTERIOR
                panel.loglog(one["x"], 1e3 * one["u"], marker, color=colour, ms=6, mew=0, label=cause)
            panel.loglog(theirs["x"][k], 1e3 * theirs["u"][k], "o", color=style.TRUTH, ms=9, mfc="none", label="thesis")
            line = np.array([0.02, 20.0])
            for times in (0.1, 1.0, 10.0):
                ratio = 1e3 * theirs["u"][k] / theirs["x"][k] * times
                panel.loglog(line, ratio * line, color="#BBBBBB", lw=0.7, zorder=0)
            panel.set(title=vehicle, xlabel="x (m)", xlim=(0.02, 20.0), ylim=(0.05, 20.0))
        panels[0].set_ylabel("u (mm/s)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", fontsize=8)
