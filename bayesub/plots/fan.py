"""A trial by the prior predictive and by the posterior predictive distribution: fans of tracks and of readings."""

import numpy as np

from bayesub.plots import style
from bayesub.plots.track import STRAIGHT, X, Y, Z, labelled, without_gaps

BANDS = ((0.05, 0.95, 0.45), (0.25, 0.75, 0.9))  # lower and upper quantile, opacity


def draw(path, record, prior, posterior, tracks) -> None:
    """The track of draws from the prior and from the posterior, and bands of both of every channel.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    record
        The readings.
    prior, posterior
        (n_draws, n_readings) noise-free readings of draws, SI units.
    tracks
        (n_prior, n_times, 12) and (n_posterior, n_times, 12) states over the ground of some draws.
    """
    channels = record.channels
    ends = np.cumsum([len(channel.times) for channel in channels])
    with style.figure(path, 9.0, max(3.6, 1.25 * len(channels))) as figure:
        axes = figure.subplot_mosaic([["track", c.name] for c in channels], width_ratios=[1.0, 1.15])
        _draw_tracks(axes["track"], *tracks)
        for channel, end in zip(channels, ends, strict=True):
            _draw_channel(axes[channel.name], channel, prior, posterior, slice(end - len(channel.times), end))
            axes[channel.name].tick_params(labelbottom=channel is channels[-1])
        axes[channels[0].name].set_title("readings and bands without noise", fontsize=9)
        axes[channels[-1].name].set_xlabel("time (s)")
        handles, words = axes[channels[0].name].get_legend_handles_labels()
        figure.legend(handles, words, loc="outside lower center", ncols=len(words), fontsize=8, markerscale=3)


def _draw_channel(axis, channel, prior, posterior, part) -> None:
    label, factor = labelled(channel)
    for k, some in enumerate(without_gaps(channel.times)):
        times = channel.times[some]
        for low, high, alpha in BANDS:
            band = factor * np.quantile(prior[:, part][:, some], [low, high], axis=0)
            words = None if k else f"{100 * (high - low):.0f} % of the prior"
            axis.fill_between(times, *band, color=style.PRIOR, alpha=alpha, lw=0, label=words)
        readings = factor * channel.values[some]
        axis.plot(times, readings, ".", ms=3.0, color=style.READINGS, label=None if k else "reading", zorder=2)
        band = factor * np.quantile(posterior[:, part][:, some], [0.05, 0.95], axis=0)
        words = None if k else "90 % of the posterior"
        axis.fill_between(times, *band, color=style.POSTERIOR, ec=style.POSTERIOR, lw=0.8, label=words, zorder=3)
    axis.set_ylabel(label)


def _draw_tracks(axis, prior, posterior) -> None:
    """From above, or of a straight track from aside."""
    from_aside = np.ptp(posterior[0, :, Y]) <= STRAIGHT * np.ptp(posterior[0, :, X])
    for tracks, colour, width in ((prior, style.PRIOR, 0.8), (posterior, style.POSTERIOR, 1.0)):
        across, up = (tracks[..., X], tracks[..., Z]) if from_aside else (tracks[..., Y], tracks[..., X])
        axis.plot(across.T, up.T, color=colour, lw=width)
    if from_aside:
        axis.invert_yaxis()
        axis.set(xlabel="north (m)", ylabel="depth (m)", title="tracks from aside")
    else:
        axis.plot(posterior[0, 0, Y], posterior[0, 0, X], "o", color=style.TRUTH, ms=4)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set(xlabel="east (m)", ylabel="north (m)", title="tracks from above, starting at the dot")
        axis.locator_params(axis="x", nbins=5)
    axis.title.set_fontsize(9)
