"""The card of a study's data: coverage in time, gaps and outliers, and what each channel informs."""

import numpy as np

from bayesub.plots import style
from bayesub.plots.coefficients import labels


def draw(path, card) -> None:
    """One page of a :class:`bayesub.findings.data_card.DataCard`."""
    n_rows, n_params = len(card.channels) + 1, len(card.names)
    width, row = max(11.7, 0.21 * n_params + 4.0), 0.27 * n_rows
    with style.figure(path, width, 2 * row + 3.2) as figure:
        above, below = figure.subplots(2, 1)
        _draw_coverage(above, card)
        _draw_information(figure, below, card)
        figure.suptitle(style.plain(card.title), fontsize=11)


def _draw_coverage(axis, card):
    n_trials = len(card.durations)
    for k, duration in enumerate(card.durations.values()):
        axis.barh(k, duration, height=0.5, color=style.PRIOR)
        axis.text(1.01, k, f"{duration:.4g} s", transform=axis.get_yaxis_transform(), va="center", fontsize=8)
    for k, channel in enumerate(card.channels, start=n_trials):
        axis.plot(channel.times, np.full(len(channel.times), k), "|", ms=7, mew=0.5, color=style.POSTERIOR)
        for start, end in channel.gaps:
            axis.plot([start, end], [k, k], color=style.WEAK, lw=4, solid_capstyle="butt")
        axis.plot(channel.outliers, np.full(len(channel.outliers), k), "x", ms=7, mew=1.8, color=style.SQP)
        text = f"{len(channel.times)} readings, every {channel.interval_s:.3g} s"
        axis.text(1.01, k, text, transform=axis.get_yaxis_transform(), va="center", fontsize=8)
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
    counts = [*(channel.n_directions for channel in card.channels), card.n_directions]
    for k, count in enumerate(counts):
        axis.text(
            1.01, k, f"{count} of {len(card.names)}", transform=axis.get_yaxis_transform(), va="center", fontsize=8
        )
    axis.text(1.01, -0.75, "directions", transform=axis.get_yaxis_transform(), va="bottom", fontsize=8)
    figure.colorbar(image, ax=axis, shrink=0.9, pad=0.09, label="posterior / prior sd")
    axis.set_title(
        "what each channel alone says, by the Fisher information at the prior centre", fontsize=9, loc="left"
    )
