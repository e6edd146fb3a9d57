"""Accuracy of the simulation against its time step (thesis Tables 4 and 5)."""

from bayesub.report.plots import style
from thesis.plots.floors import above_floor

_FLOOR_M = 1e-9


def draw(path, numbers, steps, published) -> None:
    """Largest position error against the step, ours and the thesis's: a panel a manoeuvre.

    Parameters
    ----------
    path : one file or several
    numbers : "vehicle manoeuvre" -> convention of the controls -> "position_m" -> step as text -> m
    steps : (n_steps,) s
    published : manoeuvre -> step as text -> m of each of the thesis's boats
    """
    with style.figure(path, 9.0, 3.6) as figure:
        panels = figure.subplots(1, len(published), sharey=True)
        for panel, (manoeuvre, points) in zip(panels, published.items(), strict=True):
            for case, result in numbers.items():
                vehicle = case.split()[0]
                if case.endswith(manoeuvre):
                    for convention, line, word in (("hold", "-", "held"), ("linear", "--", "interpolated")):
                        look = {"marker": "o", "ms": 4, "color": style.VEHICLES[vehicle]}
                        errors = list(result[convention]["position_m"].values())
                        errors = above_floor(panel, steps, errors, _FLOOR_M, style.VEHICLES[vehicle])
                        panel.loglog(steps, errors, line, label=f"{vehicle}, {word}", **look)
            for step, errors in points.items():
                label = "thesis, three boats" if step == "0.1" else None
                panel.loglog([float(step)] * len(errors), errors, "k_", ms=12, mew=1.5, label=label)
            panel.set_title(manoeuvre, fontsize=9)
            panel.set_xlabel("time step, scaled to a 102 m boat (s)")
        panels[0].set(ylabel="largest position error (m)", ylim=(_FLOOR_M, None))
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
