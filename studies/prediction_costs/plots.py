"""Costs of predictions by set and manoeuvre, and the worst ones (thesis Figures 75 to 78, 82, 115, 118 to 126)."""

import numpy as np

from bayesub.report.plots import style


def draw_surfaces(path, logs) -> None:
    """Heat maps of the log cost (n_sets, n_manoeuvres) of each vehicle, both sorted by their means."""
    with style.figure(path, 10.0, 3.2) as figure:
        panels = figure.subplots(1, len(logs), squeeze=False, sharey=True)[0]
        low, high = (f([f(values[np.isfinite(values)]) for values in logs.values()]) for f in (np.min, np.max))
        for panel, (vehicle, values) in zip(panels, logs.items(), strict=True):
            ordered = values[np.argsort(np.nanmean(values, axis=1))][:, np.argsort(np.nanmean(values, axis=0))]
            image = panel.imshow(ordered, aspect="auto", origin="lower", cmap="cividis", vmin=low, vmax=high)
            panel.set(title=vehicle, xlabel="unseen manoeuvre, easiest first")
            panel.grid(visible=False)
        panels[0].set_ylabel("identified set, best first")
        figure.colorbar(image, ax=panels, label="log$_{10}$ cost (m$^2$ + deg$^2$)")


def draw_sorted(path, logs, n_extreme) -> None:
    """Costs over manoeuvres sorted by their mean: the range of all sets, and those that vary most and least."""
    with style.figure(path, 9.0, 3.8) as figure:
        panels = figure.subplots(2, len(logs), squeeze=False, sharex=True, sharey=True)
        for column, (vehicle, values) in zip(panels.T, logs.items(), strict=True):
            ordered = values[:, np.argsort(np.nanmean(values, axis=0))]
            extreme = np.argsort(np.nanstd(ordered, axis=1))
            pairs = ((extreme[-n_extreme:], "most", style.SQP), (extreme[:n_extreme], "least", style.POSTERIOR))
            x = np.arange(1, ordered.shape[1] + 1)
            for panel, (some, word, colour) in zip(column, pairs, strict=True):
                panel.fill_between(x, *10.0 ** np.nanquantile(ordered, (0.0, 1.0), axis=0), color=style.PRIOR, lw=0)
                panel.semilogy(x, 10.0 ** ordered[some].T, color=colour, lw=0.8)
                panel.semilogy(x, 10.0 ** np.nanmean(ordered, axis=0), color=style.TRUTH, lw=1.5)
                panel.set_title(f"{vehicle}: {n_extreme} that vary {word}", fontsize=9)
            column[-1].set_xlabel("unseen manoeuvre, by mean cost")
        for panel in panels[:, 0]:
            panel.set_ylabel("cost (m$^2$ + deg$^2$)")


def draw_worst(path, arrays, numbers, interval) -> None:
    """The worst set on its worst manoeuvre: track, depth, and error over time, with that of the largest error of all.

    Parameters
    ----------
    path : one file or several
    arrays : vehicle -> "worst_true", "worst_predicted", "largest_true", "largest_predicted" (n_times, 3), m
    numbers : vehicle -> "worst_set_m", "largest_m"
    interval : vehicle -> s between rows
    """
    with style.figure(path, 10.0, 7.0) as figure:
        panels = figure.subplots(3, len(arrays), squeeze=False, height_ratios=(2.0, 1.0, 1.0))
        for column, (vehicle, a) in zip(panels.T, arrays.items(), strict=True):
            truth, predicted = a["worst_true"], a["worst_predicted"]
            times = interval[vehicle] * np.arange(1, len(truth) + 1)
            for values, line, colour, word in (
                (truth, "-", style.TRUTH, "truth"),
                (predicted, "--", style.SQP, "predicted"),
            ):
                column[0].plot(values[:, 1], values[:, 0], line, color=colour, label=word)
                column[1].plot(times, values[:, 2], line, color=colour)
            column[0].set_aspect("equal", adjustable="datalim")
            column[0].set(xlabel="east (m)", ylabel="north (m)")
            column[0].set_title(f"{vehicle}: worst set {numbers[vehicle]['worst_set_m']:.3g} m off", fontsize=9)
            column[1].set(ylabel="depth (m)")
            column[1].invert_yaxis()
            pairs = (("worst", style.SQP, "worst set"), ("largest", style.NULL, "largest error of all sets"))
            for name, colour, word in pairs:
                off = np.linalg.norm(a[f"{name}_predicted"] - a[f"{name}_true"], axis=1)
                column[2].plot(interval[vehicle] * np.arange(1, len(off) + 1), off, color=colour, label=word)
            column[2].set(xlabel="time (s)", ylabel="error (m)")
        panels[0, 0].legend(fontsize=8)
        panels[2, 0].legend(fontsize=8)
