"""The orders of manoeuvres: a small picture of what rudder, planes and propeller were told, or of what a log says."""

from bayesub.plots import style
from bayesub.plots.track import draw_actuators

MOST = 6  # trials that are drawn


def draw(path, trials) -> None:
    """A panel for each of the first trials: name -> :class:`bayesub.model.manoeuvres.Manoeuvre` and Actuators."""
    shown = dict(list(trials.items())[:MOST])
    with style.figure(path, 5.2, 0.5 + 1.5 * len(shown)) as figure:
        panels = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
        for panel, (name, (manoeuvre, actuators)) in zip(panels, shown.items(), strict=True):
            draw_actuators(panel, actuators, manoeuvre, manoeuvre.times, manoeuvre.log)
            panel.set_title(style.plain(f"{name}: {manoeuvre.name}" if name else manoeuvre.name), fontsize=9)
            if panel.get_legend_handles_labels()[0]:
                panel.legend(fontsize=8, ncols=3, loc="best")
        panels[-1].set_xlabel("time (s)")
