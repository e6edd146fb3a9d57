"""The figures of a report that are of one trial: its orders, tracks, unmodelled forces and predictions."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from bayesub.findings import disturbances
from bayesub.findings.unseen import SQP, TrialPrediction
from bayesub.io.words import rounded
from bayesub.plots import disturbance, fan, prediction, track
from bayesub.report.page import ReportFigure

TRACKS = 20  # draws whose motion is drawn


def orders_figure(problem, parameters) -> ReportFigure:
    """What each trial was told to do."""
    trials = {name: (trial.manoeuvre, problem.vehicle.actuators) for name, trial, _ in problem.each_trial(parameters)}
    some = f" of the first {track.MOST_ORDERS} of {len(trials)} trials" if len(trials) > track.MOST_ORDERS else ""
    source = "as the actuators follow them" if _synthetic(problem, parameters) else "as the log has them"
    return ReportFigure("orders", f"The orders{some}, {source}.", partial(track.draw_orders, trials=trials))


def track_figure(name: str, problem, draws: np.ndarray, *, synthetic: bool) -> ReportFigure:
    """The track of a trial of name "" or several."""

    def draw(path):
        motion = problem.truth() if synthetic else None
        track.draw(path, problem.record, problem.predicted(draws), problem.motion(draws[:TRACKS]), motion)

    return ReportFigure(
        f"track_{name}" if name else "track",
        f"The trial {f'{name} ' if name else ''}and {min(TRACKS, len(draws))} draws from the posterior. On the right "
        f"the readings minus the posterior mean: pure noise if the model fits. {_band(problem, draws)}",
        draw,
    )


def _band(problem, draws: np.ndarray) -> str:
    """How wide the posterior of the readings is beside their noise, by the channels where it is most and least so."""
    share = problem.predicted(draws).std(axis=0) / problem.sds
    ends = np.cumsum([len(channel.times) for channel in problem.record.channels])[:-1]
    widths = {c.name: float(np.median(s)) for c, s in zip(problem.record.channels, np.split(share, ends), strict=True)}
    least, most = min(widths, key=widths.get), max(widths, key=widths.get)
    word = "The blue band is the posterior's own uncertainty of the readings: its sd is"
    if least == most:
        return f"{word} {widths[most]:.2g} of that of the noise."
    return (
        f"{word} {widths[least]:.2g} ({least}) to {widths[most]:.2g} ({most}) of that of the noise, medians over time."
    )


def fan_figure(name: str, problem, before: np.ndarray, after: np.ndarray) -> Iterator[ReportFigure]:
    """A trial by draws from before and after it; no figure if most draws of the prior do not complete it."""
    prior, posterior = problem.predicted(before), problem.predicted(after)
    flown = np.isfinite(prior).all(axis=1)
    if 2 * np.count_nonzero(flown) < len(prior):
        return
    lost = len(prior) - np.count_nonzero(flown)
    failed = f" {lost} of {len(prior)} draws of the prior do not complete the trial and are left out." if lost else ""
    tracks = [problem.motion(draws[:TRACKS]) for draws in (before[flown], after)]
    record = problem.record
    ends = np.cumsum([len(channel.times) for channel in record.channels]) - 1
    bands = (np.quantile(draws[:, ends], [0.05, 0.95], axis=0) for draws in (prior[flown], posterior))
    sizes = [0.5 * np.ptp(band, axis=0) for band in bands]
    words = [_shrinks(*track.labelled(channel), *pair) for channel, *pair in zip(record.channels, *sizes, strict=True)]
    yield ReportFigure(
        f"fan_{name}" if name else "fan",
        f"The trial {f'{name} ' if name else ''}as the prior foretold it (grey) and as the posterior has it (blue): "
        f"{TRACKS} tracks each, and bands of every channel. At its last reading half of the 90 % band shrinks: "
        f"{', '.join(words)}.{failed}",
        partial(fan.draw, record=record, prior=prior[flown], posterior=posterior, tracks=tracks),
    )


def _shrinks(label: str, factor: float, wide: float, narrow: float) -> str:
    """How a band shrinks, of an axis with a label such as ``north (m)`` and the factor from SI to its unit."""
    name, _, unit = label.partition(" (")
    before, after = (rounded(factor * width, factor * width) for width in (wide, narrow))
    return f"{name} from {before} to {after} {unit.rstrip(')')}".rstrip()


def disturbance_figure(forces: disturbances.InferredForces) -> ReportFigure:
    """The unmodelled forces of a trial of name "" or several."""
    trial = forces.trial
    truth = "Black: the truth, linear between the same knots. " if forces.truth is not None else ""
    return ReportFigure(
        f"disturbance_{trial}" if trial else "disturbance",
        f"Forces {f'in the trial {trial} ' if trial else ''}that the equations leave out, beside those of the hull. "
        f"Left, median, 50 and 90 % of the posterior of the history on each axis. {truth}Right, in orange, the force "
        "of the hull of which shares are, along the posterior mean of the motion, on its own scale. Grey: where the "
        "boat turns faster than half of the time. A band as wide everywhere as the process itself means that the "
        "sensors do not see the force; a history that has the shape of the hull's force or comes with the turns may be "
        "a term that is missing or held at a wrong value.",
        partial(disturbance.draw, forces=forces),
    )


def prediction_figure(unseen: TrialPrediction) -> ReportFigure:
    """A trial that was not fitted, and its prediction."""
    trial = unseen.trial
    return ReportFigure(
        f"prediction_{trial.name}",
        f"The log {trial.name}, which was not fitted, and what the posterior predicts of its readings, noise included: "
        "dark blue 50 %, light blue 90 %. Readings in the grey time say where the boat starts and what else belongs to "
        "this log alone; no reading says anything about the coefficients. Green: the middle of the prior. "
        f"{'Orange: SQP. ' if SQP in unseen.predictions else ''}Lines far off are cut.",
        partial(
            prediction.draw,
            channels=trial.problem.record.channels,
            predictions=unseen.predictions,
            warm_up=trial.warm_up_s,
        ),
    )


def _synthetic(problem, parameters) -> bool:
    return all(trial.record.truth is not None for _, trial, _ in problem.each_trial(parameters))
