"""A trial: its orders, its track, what is predicted of its readings, and the forces that the equations leave out."""

from collections.abc import Mapping, Sequence
from itertools import cycle, pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from bayesub.findings.disturbances import CURRENTS, InferredForces, unit
from bayesub.inference.checks.prediction import Prediction
from bayesub.io.words import with_unit
from bayesub.logs import log_files
from bayesub.logs.log_files import positions
from bayesub.report.plots import style
from bayesub.report.plots.style import Paths

X, Y, Z, PHI, THETA = positions("x", "y", "z", "phi", "theta")
VELOCITY = positions("u", "v", "w")
STRAIGHT = 1e-3  # of its length: a track that moves less to the side is not drawn from above
GAP = 5.0  # intervals without a reading
MOST_ORDERS = 6  # trials whose orders are drawn
_BANDS = ((0.05, 0.95, 0.25), (0.25, 0.75, 0.45))  # quantiles of inferred forces, and how dark
_FAN = ((0.05, 0.95, 0.45), (0.25, 0.75, 0.9))  # quantiles of the prior, and how dark
_POINTS = 120  # of a line or a band, at most
ALPHA = {0.9: 0.3, 0.5: 0.45}  # probability of a band -> how dark
_NAMES = {"x": "north", "y": "east", "z": "depth"}


def without_gaps(times: np.ndarray) -> list[slice]:
    """The parts of a channel between which nothing was read for longer than GAP intervals."""
    intervals = np.diff(times)
    ends = (np.flatnonzero(intervals > GAP * np.median(intervals)) + 1).tolist() if len(intervals) else []
    return [slice(a, b) for a, b in pairwise([0, *ends, len(times)])]


def axis_label(channel: Any) -> tuple[str, float]:
    """Name and unit for an axis, and the factor from SI to the unit."""
    header = log_files.HEADERS[channel.quantity]
    label = header.replace(channel.name, _NAMES.get(channel.name, channel.name), 1)
    return with_unit(label), 1.0 / log_files.si_factor(header)


def draw_simulated(path: Paths, trajectory: Any) -> None:
    """One simulated trial: the track from above, depth and pitch, speed, the controls, and unmodelled forces if any."""
    times, states, simulator = trajectory.times, trajectory.states[0], trajectory.simulator
    forces = simulator.forces
    panels = ["depth", "pitch", "speed", "planes"] + ["forces"] * (forces is not None)
    with style.figure(path, 9.0, 1.25 * len(panels)) as figure:
        axes = figure.subplot_mosaic([["track", panel] for panel in panels], width_ratios=[1.0, 1.2])
        axes["track"].plot(states[:, Y], states[:, X], color=style.POSTERIOR)
        style.look_from_above(axes["track"], states[0, [Y, X]])
        axes["track"].set_title(f"{style.plain(simulator.vehicle.name)}: track from above")
        axes["depth"].plot(times, states[:, Z], color=style.POSTERIOR)
        axes["depth"].set_ylabel("depth (m)")
        axes["depth"].invert_yaxis()
        for column, label, colour in ((PHI, "roll", style.SQP), (THETA, "pitch", style.POSTERIOR)):
            axes["pitch"].plot(times, np.degrees(states[:, column]), color=colour, label=label)
        axes["pitch"].set_ylabel("angle (deg)")
        axes["speed"].plot(times, np.linalg.norm(states[:, VELOCITY], axis=1), color=style.POSTERIOR)
        axes["speed"].set_ylabel("speed (m/s)")
        draw_actuators(axes["planes"], simulator.vehicle.actuators, simulator.manoeuvre, times, trajectory.log)
        if forces is not None:
            _draw_forces(axes["forces"], forces)
        axes[panels[-1]].set_xlabel("time (s)")
        for key in ("pitch", *panels[3:]):
            if axes[key].get_legend_handles_labels()[0]:
                axes[key].legend(loc="lower right", bbox_to_anchor=(1.0, 0.95), borderaxespad=0.0, fontsize=8, ncols=3)
        for key in panels[:-1]:
            axes[key].tick_params(labelbottom=False)


def draw_actuators(
    axis: Axes, actuators: Any, manoeuvre: Any, times: np.ndarray, log: Mapping[str, np.ndarray]
) -> None:
    """The actuators that move: angles in degrees; forces and revolutions as parts of their largest, on the right.

    `actuators`: of the boat; `manoeuvre`: says what is commanded; `times`: (n,) s; `log`: short name -> (n,), SI units.
    """
    colours = cycle(style.CYCLE)
    histories = [log[manoeuvre.logged(short)] for short in actuators.shorts]
    entries = list(zip(actuators.columns, histories, colours, strict=False))
    for column, values, colour in entries:
        if column.endswith("_deg") and np.any(values):
            axis.plot(times, np.degrees(values), color=colour, label=column.removesuffix("_deg").replace("_", " "))
    axis.set_ylabel("plane (deg)")
    if others := [entry for entry in entries if not entry[0].endswith("_deg") and np.ptp(entry[1]) > 0.0]:
        right = axis.twinx()
        right.set_ylabel("of the largest")
        for column, values, colour in others:
            largest = np.abs(values).max()
            right.plot(times, values / largest, color=colour)
            axis.plot([], [], color=colour, label=f"{with_unit(column)} / {largest:.3g}")


def draw_orders(path: Paths, trials: Mapping[str, tuple[Any, Any]]) -> None:
    """The orders of rudder, planes and propeller, a panel for each trial: its manoeuvre, and actuators."""
    shown = dict(list(trials.items())[:MOST_ORDERS])
    with style.figure(path, 5.2, 0.5 + 1.5 * len(shown)) as figure:
        panels = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
        for panel, (name, (manoeuvre, actuators)) in zip(panels, shown.items(), strict=True):
            draw_actuators(panel, actuators, manoeuvre, manoeuvre.times, manoeuvre.log)
            panel.set_title(style.plain(f"{name}: {manoeuvre.name}" if name else manoeuvre.name), fontsize=9)
            if panel.get_legend_handles_labels()[0]:
                panel.legend(fontsize=8, ncols=3, loc="best")
        panels[-1].set_xlabel("time (s)")


def _draw_forces(axis, forces):
    """Unmodelled forces and currents, one unit on the left and the others on the right, each with its label."""
    colours = cycle(style.CYCLE)
    panels: dict[str, Axes] = {}
    for k, kind in enumerate(dict.fromkeys(map(unit, forces.axes))):
        panel = panels[kind] = axis.twinx() if k else axis
        panel.set_ylabel({"N": "force (N)", "N m": "moment (N m)", "m/s": "current (m/s)"}[kind])
        if k:
            panel.grid(False)
            panel.spines["right"].set_position(("axes", 1.0 + 0.16 * (k - 1)))
    for name, history, colour in zip(forces.axes, forces.values.T, colours, strict=False):
        panels[unit(name)].plot(forces.times, history, color=colour, lw=0.8)
        axis.plot([], [], color=colour, label=name)


def draw_fan(
    path: Paths, channels: Sequence, prior: np.ndarray, posterior: np.ndarray, tracks: Sequence[np.ndarray]
) -> None:
    """The track of draws from the prior and from the posterior, and bands of both of every channel.

    `channels`: of the record, in the order of the readings; `prior` and `posterior`: (n_draws, n_readings) noise-free
    readings of draws, SI units; `tracks`: (n_prior, n_times, 12) and (n_posterior, n_times, 12) states of some draws.
    """
    with style.figure(path, 9.0, max(3.6, 1.25 * len(channels))) as figure:
        axes = figure.subplot_mosaic([["track", c.name] for c in channels], width_ratios=[1.0, 1.15])
        draw_tracks(axes["track"], *tracks)
        last = max(channel.times[-1] for channel in channels)
        for channel, end in zip(channels, np.cumsum([len(channel.times) for channel in channels]), strict=True):
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
        some = np.arange(len(channel.times))[part_of_channel][:: -(-len(channel.times) // _POINTS)]
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


def draw_small_fan(path: Paths, tracks: Sequence[np.ndarray]) -> None:
    """Tracks (n_draws, n_times, 12) of the prior and of the posterior, for the first screen."""
    with style.figure(path, *style.SMALL) as figure:
        draw_tracks(figure.subplots(), *tracks)


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
                for probability, alpha in ALPHA.items():
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


def draw_disturbance(path: Paths, forces: InferredForces) -> None:
    """A row for each disturbed axis: the inferred history on the left, the force of the hull on the right.

    Of a current the velocity of the boat in the water is on the right.
    """
    n_axes, margins = len(forces.axes), (0.85, 0.15, 0.5, 0.62)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], forces.turning, [False]]).astype(int)))
    turns = np.append(forces.fine_times, forces.times[-1])[edges].reshape(-1, 2)  # when it turns fast, from .. to
    with style.figure(path, 9.0, 1.2 + 1.75 * n_axes, margins) as figure:
        spaces = {"wspace": 0.24, "hspace": 0.14}
        rows = figure.subplots(n_axes, 2, squeeze=False, sharex=True, width_ratios=[1.7, 1.0], gridspec_kw=spaces)
        figure.align_ylabels(rows)
        for k, (axis, (left, right)) in enumerate(zip(forces.axes, rows, strict=True)):
            for panel in (left, right):
                for begin, end in turns:
                    label = "turning faster than half of the time" if begin == turns[0][0] else None
                    panel.axvspan(begin, end, color=style.PRIOR, alpha=0.4, lw=0, label=label)
                panel.axhline(0.0, color=style.TRUTH, lw=0.5)
                panel.set_ylabel(f"{axis} ({unit(axis)})")
                panel.margins(x=0.01)
                panel.locator_params(axis="y", nbins=5)
            for low, high, alpha in _BANDS:
                ends, label = np.quantile(forces.draws[:, k], [low, high], axis=0), f"{100 * (high - low):.0f} %"
                left.fill_between(forces.times, *ends, color=style.POSTERIOR, alpha=alpha, lw=0, label=label)
            median = np.median(forces.draws[:, k], axis=0)
            left.plot(forces.times, median, color=style.POSTERIOR, lw=1.2, label="median")
            if forces.truth is not None:
                left.plot(forces.times, forces.truth[k], color=style.TRUTH, lw=0.8, label="truth")
            left.locator_params(axis="x", nbins=10)
            right.locator_params(axis="x", nbins=5)
            right.plot(forces.fine_times, forces.hull[k], color=style.SQP, lw=1.0)
        currents = [axis in CURRENTS for axis in forces.axes]
        forced = not all(currents)
        left = " or ".join(["unmodelled force"] * forced + ["current"] * any(currents))
        right = " or ".join(["force of the hull"] * forced + ["velocity in the water"] * any(currents))
        rows[0, 0].set_title(left, fontsize=9)
        rows[0, 1].set_title(f"{right}, on its own scale", fontsize=9)
        for panel in rows[-1]:
            panel.set_xlabel("time (s)")
        figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="upper center", ncols=5, fontsize=8)
