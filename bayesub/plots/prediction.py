"""Readings of a log that was not fitted, and the bands of its prediction."""

import numpy as np

from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.plots import style

_LIGHT, _DARK = 0.3, 0.45  # of the bands of 90 and 50 %


def draw(path, channels, predictions: dict, warm_up: float) -> None:
    """A row for each channel: readings within bands, and readings less the mean prediction of the posterior.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    channels
        Of the record, in the order of the readings.
    predictions
        By whom -> :class:`bayesub.inference.checks.prediction.Prediction`; "posterior" among them. Those that failed
        are left out.
    warm_up
        s; shaded.
    """
    posterior = predictions["posterior"]
    bands = posterior.bands
    lines = {"prior mean": style.LINEAR, "SQP": style.SQP}
    lines = {by: colour for by, colour in lines.items() if by in predictions and predictions[by].is_flown}
    with style.figure(path, 9.0, 1.0 + 1.5 * len(channels)) as figure:
        rows = figure.subplots(len(channels), 2, squeeze=False, sharex=True)
        for (left, right), channel in zip(rows, channels, strict=True):
            part = posterior.slices[channel.name]
            factor = 1.0 / log_files.si_factor(channel.quantity)
            mean, readings, times = posterior.mean[part], posterior.readings[part], channel.times
            for axis, base in ((left, 0.0), (right, mean)):
                if warm_up:
                    axis.axvspan(0.0, warm_up, color=style.PRIOR, alpha=0.4, lw=0)
                for probability, alpha in ((0.9, _LIGHT), (0.5, _DARK)):
                    low, high = (factor * (end[part] - base) for end in bands[probability])
                    axis.fill_between(
                        times,
                        low,
                        high,
                        color=style.POSTERIOR,
                        alpha=alpha,
                        lw=0,
                        label=f"{100 * probability:g} % band",
                    )
                for by, colour in lines.items():
                    axis.plot(times, factor * (predictions[by].mean[part] - base), color=colour, lw=1.0, label=by)
                axis.plot(times, factor * (readings - base), ".", ms=2.5, color=style.TRUTH, label="reading")
            _limit(left, factor * np.concatenate([readings, *bands[0.9][:, part]]))
            _limit(right, factor * np.concatenate([readings - mean, *(bands[0.9][:, part] - mean)]))
            left.set_ylabel(with_unit(log_files.HEADERS[channel.quantity]))
        rows[0, 0].set_title(
            "readings and prediction; grey: warm-up" if warm_up else "readings and prediction", fontsize=9
        )
        rows[0, 1].set_title("less the mean of the posterior's prediction", fontsize=9)
        for axis in rows[-1]:
            axis.set_xlabel("time (s)")
        handles, labels = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, markerscale=3)


def _limit(axis, values) -> None:
    """Show readings and bands whole; a line far off is cut."""
    low, high = float(np.min(values)), float(np.max(values))
    margin = 0.06 * (high - low) or 1.0
    axis.set_ylim(low - margin, high + margin)
