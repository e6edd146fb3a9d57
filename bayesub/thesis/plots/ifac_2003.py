"""Figures of the paper of 2003 (thesis appendix G): track, error over time, coefficients of three cases."""

import numpy as np

from bayesub.plots import style
from bayesub.thesis.plots.labels import labels


def draw_spiral(path, track) -> None:
    """The track (n_times, 2) from above (IFAC Figure 1)."""
    with style.figure(path, 3.4, 3.2) as figure:
        axis = figure.subplots()
        axis.plot(track[:, 1], track[:, 0], color=style.TRUTH)
        axis.plot(track[0, 1], track[0, 0], "o", color=style.TRUTH, ms=4)
        axis.set(aspect="equal", xlabel="east (m)", ylabel="north (m)")


def draw_errors(path, errors) -> None:
    """Distance from the true track over time, s and m, of each case (IFAC Figure 2)."""
    colours = (style.POSTERIOR, style.LINEAR, style.SQP)
    with style.figure(path, 6.0, 2.8) as figure:
        axis = figure.subplots()
        for (case, values), colour in zip(errors.items(), colours, strict=True):
            times = np.arange(1, len(values) + 1)
            axis.semilogy(times, values, color=colour, lw=1.0)
            axis.annotate(
                f"case {case[-1]}", (times[-1], values[-1]), (4, -3), textcoords="offset points", color=colour
            )
        axis.set(xlabel="time (s)", ylabel="position error (m)", ylim=(1e-5, None))


def draw_coefficients(path, cases, order) -> None:
    """Ratios to the truth, one dot a draw; crosses are held (IFAC Figures 3 to 5).

    Parameters
    ----------
    path : one file or several
    cases : case -> "names", "ratios" (n_draws, n_params), "starts" and "known" (name -> ratios)
    order : names, in the order of the axis
    """
    names = [name for name in order if name in cases["case1"]["names"]]
    with style.figure(path, 8.0, 6.2) as figure:
        panels = figure.subplots(len(cases), 1, sharex=True)
        for panel, (case, numbers) in zip(panels, cases.items(), strict=True):
            for shift, key, colour in ((-0.17, "starts", "#909090"), (0.17, "ratios", style.SQP)):
                values = np.array(numbers[key])
                x = [names.index(name) for name in numbers["names"]]
                jitter = shift + np.linspace(-0.12, 0.12, len(values))[:, None]
                word = {"starts": "start", "ratios": "SQP, converged"}[key]
                panel.plot((x + jitter).ravel(), values.ravel(), "o", ms=2, mew=0, color=colour, label=word)
            for name, values in numbers["known"].items():
                x = names.index(name) + np.linspace(-0.2, 0.2, len(values))
                panel.plot(x, values, "x", ms=3, mew=0.5, color=style.TRUTH)
            panel.plot([], [], "x", ms=4, color=style.TRUTH, label="held")
            panel.axhline(1.0, color=style.TRUTH, lw=0.7)
            panel.set(ylabel=f"case {case[-1]}\nratio to truth", xlim=(-0.6, len(names) - 0.4))
            panel.grid(axis="x", visible=False)
        panels[-1].set_xticks(
            range(len(names)), labels(np.array(names)), rotation=70, ha="right", rotation_mode="anchor"
        )
        panels[-1].legend(loc="lower center", bbox_to_anchor=(0.5, 3.35), ncols=3, fontsize=8, markerscale=1.5)
