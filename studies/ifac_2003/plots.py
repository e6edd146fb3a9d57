"""Figures of the paper of 2003 (thesis appendix G): track, error over time, coefficients of three cases."""

import numpy as np

from bayesub.report.plots import style
from thesis.plots.labels import labels


def draw_track(path, track, errors) -> None:
    """The track from above, and the distance from it over time of each case (IFAC Figures 1 and 2).

    Parameters
    ----------
    path : one file or several
    track : (n, 2) m
    errors : case -> (n_times,) m, once a second
    """
    colours = (style.POSTERIOR, style.LINEAR, style.SQP)
    with style.figure(path, 8.0, 2.9) as figure:
        above, over_time = figure.subplots(1, 2, width_ratios=(1.0, 2.2))
        above.plot(track[:, 1], track[:, 0], color=style.TRUTH)
        above.plot(track[0, 1], track[0, 0], "o", color=style.TRUTH, ms=4)
        above.set_aspect("equal", adjustable="datalim")
        above.set(xlabel="east (m)", ylabel="north (m)")
        for (case, values), colour in zip(errors.items(), colours, strict=True):
            times = np.arange(1, len(values) + 1)
            over_time.semilogy(times, values, color=colour, lw=1.0)
            end = times[-1], values[-1]
            over_time.annotate(f"case {case[-1]}", end, (4, -3), textcoords="offset points", color=colour)
        over_time.set(xlabel="time (s)", ylabel="position error (m)", ylim=(1e-5, None))


def draw_coefficients(path, cases, arrays, order) -> None:
    """Ratios to the truth, one dot a draw; crosses are held (IFAC Figures 3 to 5).

    Parameters
    ----------
    path : one file or several
    cases : case -> "names" and "known", of the coefficients that are free and held
    arrays : "<case>/ratios", "<case>/starts" (n_draws, n_params) and "<case>/known" (n_draws, n_known)
    order : names, in the order of the axis
    """
    names = [name for name in order if name in cases["case1"]["names"]]
    with style.figure(path, 8.0, 5.6) as figure:
        panels = figure.subplots(len(cases), 1, sharex=True)
        for panel, (case, numbers) in zip(panels, cases.items(), strict=True):
            for shift, key, colour in ((-0.17, "starts", "#909090"), (0.17, "ratios", style.SQP)):
                values = arrays[f"{case}/{key}"]
                x = [names.index(name) for name in numbers["names"]]
                jitter = shift + np.linspace(-0.12, 0.12, len(values))[:, None]
                word = {"starts": "start", "ratios": "SQP, converged"}[key]
                panel.plot((x + jitter).ravel(), values.ravel(), "o", ms=2, mew=0, color=colour, label=word)
            for name, values in zip(numbers["known"], arrays[f"{case}/known"].T, strict=True):
                x = names.index(name) + np.linspace(-0.2, 0.2, len(values))
                panel.plot(x, values, "x", ms=3, mew=0.5, color=style.TRUTH)
            panel.plot([], [], "x", ms=4, color=style.TRUTH, label="held")
            panel.axhline(1.0, color=style.TRUTH, lw=0.7)
            panel.set(ylabel=f"case {case[-1]}\nratio to truth", xlim=(-0.6, len(names) - 0.4))
            panel.grid(axis="x", visible=False)
        panels[-1].set_xticks(
            range(len(names)), labels(np.array(names)), rotation=70, ha="right", rotation_mode="anchor"
        )
        handles, words = panels[-1].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper center", ncols=3, fontsize=8, markerscale=1.5)
