"""Manoeuvres, turning circles and added masses as the thesis draws them (Figures 4, 5, 8, 14 to 19, 71 and 72)."""

import numpy as np

from bayesub.report.plots import style

_PLANES = (("rudder_deg", 1, style.POSTERIOR), ("stern_plane_deg", 3, style.SQP))
_COLUMNS = {"horizontal": "horizontal", "vertical": "vertical", "coupled": "coupled", "random:1": "random, first 200 s"}
_SHOWN_S = 200.0


def draw_manoeuvres(path, arrays, interval) -> None:
    """Orders and planes, tracks from above and depths: a column a manoeuvre, the last with a hundred random tracks.

    Parameters
    ----------
    path : one file or several
    arrays : "<manoeuvre>/order/<control>" and "/planes" (n, 1 + n_controls) in s and deg, "/<vehicle>" tracks (n, 3)
        and "tracks/<k>" (n, 2), in ship lengths
    interval : s between samples of a track, on suboff
    """
    with style.figure(path, 11.0, 6.4) as figure:
        panels = figure.subplots(3, 4, height_ratios=(1.0, 1.4, 0.9))
        for (name, title), column in zip(_COLUMNS.items(), panels.T, strict=True):
            _draw_planes(column[0], arrays, name)
            column[0].set_title(title, fontsize=9)
            if name.startswith("random"):
                continue
            for vehicle, colour in style.VEHICLES.items():
                track = arrays[f"{name}/{vehicle}"]
                column[1].plot(track[:, 1], track[:, 0], color=colour, label=vehicle)
                depth = track[:, 2] - track[0, 2]
                column[2].plot(interval * np.arange(len(track)), depth, color=colour, label=vehicle)
            column[1].set_aspect("equal", adjustable="datalim")
            column[1].set_xlabel("east (ship lengths)")
            column[2].set_xlabel("time (s, of suboff)")
            column[2].invert_yaxis()
        cloud = panels[1, 3]
        for key in (key for key in arrays if key.startswith("tracks/")):
            cloud.plot(arrays[key][:, 1], arrays[key][:, 0], color=style.POSTERIOR, lw=0.4)
        cloud.set_aspect("equal", adjustable="datalim")
        cloud.set(title="suboff, 100 random", xlabel="east (ship lengths)")
        cloud.title.set_fontsize(9)
        panels[0, 0].set_ylabel("angle (deg)")
        panels[1, 0].set_ylabel("north (ship lengths)")
        panels[2, 1].set_ylabel("deeper by (ship lengths)")
        for empty in (panels[1, 1], panels[2, 0], panels[2, 3]):
            empty.axis("off")
            for line in list(empty.lines):
                line.remove()
        panels[2, 0].legend(*panels[1, 0].get_legend_handles_labels(), loc="center", title="boats", fontsize=9)
        panels[2, 3].legend(*panels[0, 2].get_legend_handles_labels(), loc="center", title="planes", fontsize=9)


def _draw_planes(panel, arrays, name) -> None:
    planes = arrays[f"{name}/planes"]
    end = _SHOWN_S if name.startswith("random") else planes[-1, 0]
    for control, column, colour in _PLANES:
        word, order = control.removesuffix("_deg").replace("_", " "), arrays.get(f"{name}/order/{control}")
        if order is not None and len(order):
            steps = np.vstack([[0.0, 0.0], order, [planes[-1, 0], order[-1, 1]]])
            panel.step(*steps.T, where="post", color=colour, lw=0.9, ls=":", label=f"{word}, ordered")
        if np.any(planes[:, column]):
            panel.plot(planes[:, 0], planes[:, column], color=colour, lw=1.0, label=word)
    panel.set(xlim=(0.0, end), xlabel="time (s)")


def draw_circles(path, circles) -> None:
    """Tracks (n_times, 2) of turning circles in ship lengths, a line a boat (Figure 8)."""
    with style.figure(path, 3.8, 3.6) as figure:
        axis = figure.subplots()
        for vehicle, track in circles.items():
            axis.plot(track[:, 1], track[:, 0], color=style.VEHICLES[vehicle], label=vehicle)
        axis.plot(0.0, 0.0, "o", ms=4, color=style.TRUTH)
        axis.set(aspect="equal", xlabel="east (ship lengths)", ylabel="north (ship lengths)")
        axis.set_title("rudder 15 degrees", fontsize=9)
        figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)


def draw_added_mass(path, masses, inertias) -> None:
    """Surge added mass of bodies and roll added inertia of sections, normalised (Figures 4 and 5).

    Parameters
    ----------
    path : one file or several
    masses, inertias : "ratio" and name -> values over it
    """
    looks = ((style.POSTERIOR, "-"), (style.SQP, "--"), (style.LINEAR, "-."), (style.TRUTH, "-"))
    sides = (
        (masses, "length over diameter", "surge added mass over that\nof the sphere's displacement"),
        (
            inertias,
            "radius of the cylinder over that of the fins",
            "roll added inertia over\ndensity and fin radius$^4$",
        ),
    )
    with style.figure(path, 8.0, 3.0) as figure:
        for axis, (content, across, up) in zip(figure.subplots(1, 2), sides, strict=True):
            curves = {name: values for name, values in content.items() if name != "ratio"}
            for (name, values), (colour, line) in zip(curves.items(), looks, strict=False):
                axis.plot(content["ratio"], values, line, color=colour, label=name)
            axis.set(xlabel=across, ylabel=up, ylim=(0.0, None))
            axis.legend(fontsize=8)
