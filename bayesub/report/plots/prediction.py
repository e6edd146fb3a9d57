"""A trial by predictive distributions: of the prior and the posterior, and of a log that was not fitted."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from bayesub.inference.checks.prediction import Prediction
from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.report.plots import style
from bayesub.report.plots.style import Paths
from bayesub.report.plots.track import STRAIGHT, X, Y, Z, axis_label, without_gaps

_FAN = ((0.05, 0.95, 0.45), (0.25, 0.75, 0.9))  # lower and upper quantile, opacity
_POINTS = 120  # of a line or a band, at most
_BANDS = {0.9: 0.3, 0.5: 0.45}  # probability, opacity


def draw_fan(
    path: Paths, channels: Sequence, prior: np.ndarray, posterior: np.ndarray, tracks: Sequence[np.ndarray]
) -> None:
    """The track of draws from the prior and from the posterior, and bands of both of every channel.

    `channels`: of the record, in the order of the readings; `prior` and `posterior`: (n_draws, n_readings) noise-free
    readings of draws, SI units; `tracks`: (n_prior, n_times, 12) and (n_posterior, n_times, 12) states over the ground
    of some draws.
    """
    ends = np.cumsum([len(channel.times) for channel in channels])
    with style.figure(path, 9.0, max(3.6, 1.25 * len(channels))) as figure:
        axes = figure.subplot_mosaic([["track", c.name] for c in channels], width_ratios=[1.0, 1.15])
        draw_tracks(axes["track"], *tracks)
        last = max(channel.times[-1] for channel in channels)
        for channel, end in zip(channels, ends, strict=True):
            _draw_channel(axes[channel.name], channel, prior, posterior, slice(end - len(channel.times), end))
            axes[channel.name].set_xlim(-0.02 * last, 1.02 * last)
            axes[channel.name].tick_params(labelbottom=channel is channels[-1])
        axes[channels[0].name].set_title("readings and bands without noise", fontsize=9)
        axes[channels[-1].name].set_xlabel("time (s)")
        handles, words = axes[channels[0].name].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=len(words), fontsize=8, markerscale=3)


def _draw_channel(axis, channel, prior, posterior, part) -> None:
    label, factor = axis_label(channel)
    for k, part_of_channel in enumerate(without_gaps(channel.times)):
        places = np.arange(len(channel.times))[part_of_channel]
        some = places[:: -(-len(channel.times) // _POINTS)]
        times = channel.times[some]
        for low, high, alpha in _FAN:
            band = factor * np.quantile(prior[:, part][:, some], [low, high], axis=0)
            words = None if k else f"{100 * (high - low):.0f} % of the prior"
            axis.fill_between(times, *band, color=style.PRIOR, alpha=alpha, lw=0, label=words)
        readings = factor * channel.values[some]
        axis.plot(times, readings, ".", ms=3.0, color=style.READINGS, label=None if k else "reading", zorder=2)
        band = factor * np.quantile(posterior[:, part][:, some], [0.05, 0.95], axis=0)
        words = None if k else "90 % of the posterior"
        axis.fill_between(times, *band, color=style.POSTERIOR, ec=style.POSTERIOR, lw=0.8, label=words, zorder=3)
    axis.set_ylabel(label)


def draw_tracks(axis: Axes, prior: np.ndarray, posterior: np.ndarray) -> None:
    """From above, or of a straight track from aside, at some of the times."""
    some = np.linspace(0, prior.shape[1] - 1, min(_POINTS, prior.shape[1])).astype(int)
    prior, posterior = prior[:, some], posterior[:, some]
    from_aside = np.ptp(posterior[0, :, Y]) <= STRAIGHT * np.ptp(posterior[0, :, X])
    for tracks, colour, width in ((prior, style.PRIOR, 0.8), (posterior, style.POSTERIOR, 1.0)):
        across, up = (tracks[..., X], tracks[..., Z]) if from_aside else (tracks[..., Y], tracks[..., X])
        axis.plot(across.T, up.T, color=colour, lw=width)
    if from_aside:
        axis.invert_yaxis()
        axis.set(xlabel="north (m)", ylabel="depth (m)", title="tracks from aside")
    else:
        style.look_from_above(axis, posterior[0, 0, [Y, X]])
        axis.set_title("tracks from above, starting at the dot")
        axis.locator_params(axis="x", nbins=5)
    axis.title.set_fontsize(9)


def draw_unseen(path: Paths, channels: Sequence, predictions: Mapping[str, Prediction], warm_up: float) -> None:
    """A row for each channel: readings within bands, and readings less the mean prediction of the posterior.

    `channels`: of the record, in the order of the readings; `predictions`: by whom ->
    :class:`bayesub.inference.checks.prediction.Prediction`; "posterior" among them. Those that failed are left out;
    `warm_up`: s; shaded.
    """
    posterior = predictions["posterior"]
    bands = posterior.bands
    lines = {"prior mean": style.LINEAR, "SQP": style.SQP}
    lines = {by: colour for by, colour in lines.items() if by in predictions and predictions[by].is_flown}
    with style.figure(path, 9.0, 1.0 + 1.5 * len(channels)) as figure:
        rows = figure.subplots(len(channels), 2, squeeze=False, sharex=True, width_ratios=[1.0, 1.6])
        for (left, right), channel in zip(rows, channels, strict=True):
            part = posterior.slices[channel.name]
            factor = 1.0 / log_files.si_factor(channel.quantity)
            mean, readings, times = posterior.mean[part], posterior.readings[part], channel.times
            for axis, base in ((left, 0.0), (right, mean)):
                style.shade_warm_up(axis, warm_up)
                for probability, alpha in _BANDS.items():
                    band = [factor * (end[part] - base) for end in bands[probability]]
                    label = f"{100 * probability:g} % band"
                    axis.fill_between(times, *band, color=style.POSTERIOR, alpha=alpha, lw=0, label=label)
                for by, colour in lines.items():
                    axis.plot(times, factor * (predictions[by].mean[part] - base), color=colour, lw=1.0, label=by)
                axis.plot(times, factor * (readings - base), ".", ms=2.5, color=style.TRUTH, label="reading")
            style.show_whole(left, factor * np.concatenate([readings, *bands[0.9][:, part]]))
            style.show_whole(right, factor * np.concatenate([readings - mean, *(bands[0.9][:, part] - mean)]))
            left.set_ylabel(with_unit(log_files.HEADERS[channel.quantity]))
        rows[0, 0].set_title(f"readings and prediction{'; grey: warm-up' if warm_up else ''}", fontsize=9)
        rows[0, 1].set_title("less the mean of the posterior's prediction", fontsize=9)
        for axis in rows[-1]:
            axis.set_xlabel("time (s)")
        handles, labels = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, markerscale=3)
