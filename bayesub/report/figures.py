"""The figures of a report: what each is called, what it shows in words, and how it is drawn."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from bayesub.findings.derived import Derived
from bayesub.findings.disturbances import InferredForces
from bayesub.findings.results import AnyProblem, Results
from bayesub.findings.unseen import SQP, TrialPrediction
from bayesub.io.words import cell, counted, listed, rounded
from bayesub.report.page import ReportFigure
from bayesub.report.plots import checks, coefficients, corner, derived, style, track, trade_offs
from bayesub.report.plots.coefficients import Found, labels

TRACKS = 20  # draws whose motion is drawn
FITS = 1.5  # chi-square per reading
MARKS = (("o", style.SQP), ("X", style.LINEAR), ("s", style.WEAK))  # of baselines, searches first


def figures(results: Results, reference: np.ndarray, word: str, baselines: list[dict]) -> Iterator[ReportFigure]:
    """The figures of a report, in no order that matters: the page says where each stands.

    `reference` (n_others,): values that ratios refer to, histories of forces left out; `word`: what they are;
    `baselines`: numbers of the baselines.
    """
    problem, sample, n = results.problem, results.summary, results.problem.n_coefficients
    equations, prior = problem.equations, results.prior_of_others
    wide = None if problem.prior_of_others == prior else problem.prior_of_others
    found = _found(results, baselines)
    scale = " Dashed: with the scale of the prior unknown; all else is beside the scale that was found." if wide else ""
    yield orders_figure(problem, results.posterior.best)
    yield ReportFigure(
        "coefficients",
        f"Coefficients as ratios to the {word}, those that the trial narrows most first.{scale}",
        lambda path: coefficients.draw(path, sample, prior, reference[:n], found, word, equations, wide=wide),
    )
    yield from _small(results, reference[:n], word)
    both = zip(problem.each_trial(results.prior_predictive), problem.each_trial(results.draws), strict=True)
    for k, ((name, part, before), (*_, after)) in enumerate(both):
        yield from fan_figure(name, part, before, after, is_first=k == 0)
    yield from map(disturbance_figure, results.forces)
    yield from _ill_conditioning(results, reference, word, found)
    names = [f"{sample.names[k]} (R-hat {sample.rhat[k]:.4f})" for k in checks.worst(sample)]
    yield ReportFigure(
        "ranks",
        f"The {len(names)} parameters that mix worst, {', '.join(names)}. Left, the mean of the walkers of each "
        "ensemble against its steps. Right, where the draws of each ensemble rank among all, 1 if ensembles agree. "
        f"In all, {100 * checks.outside(sample):.2g} % of the bars of {len(sample.names)} parameters and "
        f"{len(sample.chain)} ensembles are outside the grey band; chance alone makes up to 1 %.",
        partial(checks.draw_ranks, posterior=sample, equations=equations),
    )
    if results.residuals:
        orange = "A channel that does not fit would be orange."
        if results.criticism.suspects:
            orange = f"Orange: what does not fit, {listed(list(results.criticism.suspects))}."
        yield ReportFigure(
            "criticism",
            "Quantile residuals at draws from the posterior, standard normal and independent if the model is right. "
            "Left, against time at one draw, diamonds where they are beyond the axis. Middle, correlation of readings "
            "so many intervals apart. Right, histogram of the probability of what is below each reading. Between the "
            "dashed lines are 99 % of what a right model makes, of each bar by itself. " + orange,
            lambda path: checks.draw_criticism(path, results.criticism, results.residuals, results.times),
        )
    if results.derived.values:
        yield _derived(results.derived, word)
    if results.prescription:
        yield ReportFigure(
            "next",
            "What would be left, in per cent, of the sd of what is asked for after each way to go on, expected in the "
            "normal approximation: the way above is the best for all together.",
            lambda path: derived.draw_ways(path, results.prescription),
        )
    yield from (prediction_figure(unseen) for unseen in results.predictions if unseen.posterior.is_flown)
    if results.check is not None:
        yield ReportFigure(
            "cross_check",
            "Differences of all means, sds and correlations by the two samplers in Monte Carlo standard errors, and "
            "the normal curve that equal posteriors make. The dashed lines hold all of them in 99 of 100 comparisons "
            "of equal posteriors.",
            partial(checks.draw_cross_check, check=results.check.part(sample.names)),
        )


def _ill_conditioning(results, reference, word: str, found) -> Iterator[ReportFigure]:
    """If all others were known, the strongest pairs, a corner an axis, directions, and all correlations."""
    problem, sample, n = results.problem, results.summary, results.problem.n_coefficients
    equations, correlation = problem.equations, results.correlation
    names, prior = sample.names, results.prior_of_others
    sds = np.array([sample.sd, results.conditional_sd])[:, :n] / sample.prior_sd[:n]
    gains = np.maximum(sds[0] / sds[1], 1.0)
    largest = f"{names[np.argmax(gains)]} {cell(gains.max(), 2)} times"
    left_out = n - trade_offs.ROWS
    more = f" The {left_out} that gain least are left out." if left_out > 0 else ""
    yield ReportFigure(
        "ladder",
        "What each coefficient would be known to if all others were. The longer the bar, the more of what is not known "
        "of a coefficient is only its trade-off with all others together, of which pairs show a part: "
        f"{cell(np.median(gains), 2)} times in the median, {largest}. Gain: posterior sd over that with all others "
        f"known; R: multiple correlation with all others.{more}",
        partial(trade_offs.draw_known, names=labels(names[:n], equations), posterior=sds[0], conditional=sds[1]),
    )
    drawn: dict[str, Any] = {"posterior": sample, "prior": prior, "reference": reference[:n], "equations": equations}
    drawn |= {"found": found, "word": word}
    if pairs := [pair for pair in corner.strong_pairs(correlation) if pair[0] < n][: corner.PAIRS]:
        (i, j), *_ = pairs
        yield ReportFigure(
            "pairs",
            f"The strongest trade-offs, as ratios to the {word}: a narrow slanted shape is a pair of which the data "
            f"know one combination. Most of all {names[i]} with {names[j]}, correlation {correlation[i, j]:+.2f}. "
            "Solutions that fit equally well lie along it.",
            partial(corner.draw_pairs, pairs=pairs, **drawn),
        )
    axes = np.array([equations.term(name).axis for name in names[:n]])
    for axis in dict.fromkeys(axes.tolist()):
        members = np.flatnonzero(axes == axis)
        chosen = members[corner.trading(correlation[np.ix_(members, members)])]
        if len(chosen):
            yield ReportFigure(
                f"corner_{axis}",
                f"Coefficients of the axis {axis} that trade off with each other, as ratios to the {word}: "
                f"{len(chosen)} of {len(members)}. Below the diagonal their joint marginals, above it their "
                "correlations; over each its mean and sd.",
                partial(corner.draw, chosen=chosen, **drawn),
            )
    yield _directions(results, found)
    yield ReportFigure(
        "correlation",
        f"Posterior correlations of all that has one of {trade_offs.STRONG:g} and more, within an axis in the order in "
        f"which they belong together, with numbers from {trade_offs.NUMBERS:g}. Coefficients are ratios to the {word}.",
        partial(trade_offs.draw_correlation, names=names, correlation=correlation, equations=equations),
    )


def _directions(results, found) -> ReportFigure:
    """Each direction of the spectrum, with what the posterior knows along it and what solutions do."""
    spectrum, sample = results.spectrum, results.summary
    before, coordinates = results.null_sds, spectrum.coordinates

    def along(values):
        return (values - sample.mean) / spectrum.prior_sd @ coordinates.T / before

    n_all, n_stiff, n_null = len(spectrum.names), spectrum.n_informed, spectrum.n_null
    fits = [one.fits[:, None].repeat(n_all, axis=1) for one in found]
    distances = [replace(one, values=along(one.values), good=good) for one, good in zip(found, fits, strict=True)]
    points = " Points: how far solutions are from the posterior mean; null directions let them go anywhere."
    return ReportFigure(
        "directions",
        f"All combinations of parameters from the best to the least known: of {n_all} directions {n_stiff} are stiff, "
        f"{n_all - n_stiff - n_null} sloppy and {n_null} null. At the line the data said nothing of a direction. "
        f"Right, what it is made of.{points * bool(found)}",
        partial(trade_offs.draw_directions, spectrum=spectrum, equations=results.problem.equations,
                sds=along(sample.draws).std(axis=0, ddof=1), found=distances),
    )  # fmt: skip


def _found(results, baselines: list[dict]) -> list[Found]:
    """The solutions of the baselines, searches first; what one does not find is at its prior mean."""
    sample, found = results.summary, []
    order = sorted(zip(results.estimates, baselines, strict=False), key=lambda one: one[0].method != "SQP")
    for (estimate, numbers), (marker, colour) in zip(order, MARKS, strict=False):
        fits = np.array(numbers["chi_square_per_reading"]) < FITS
        values = np.tile(sample.prior_mean, (len(fits), 1))
        inside = np.array([[name not in names for name in sample.names] for names in numbers["at_bounds"]])
        _, places, columns = np.intersect1d(sample.names, estimate.names, return_indices=True)
        values[:, places] = estimate.solutions[:, columns]
        method = estimate.method if estimate.method != "SQP" else f"SQP, {counted(len(values), 'start')}"
        of_several = "all fit" if fits.all() else f"{fits.sum()} fit" if fits.any() else "none fits"
        of_one = "fits" if fits.all() else "does not fit"
        label = f"{method}: {of_several if len(fits) > 1 else of_one}"
        found.append(Found(label, values, fits, inside & fits[:, None], marker, colour))
    return found


def _derived(boats: Derived, word: str) -> ReportFigure:
    """What follows from the coefficients."""
    parts = [
        f"What follows from the coefficients, of {len(boats.posterior)} boats drawn from the posterior, beside as many "
        f"from the prior. Above, a row a quantity, each on its own scale from 5 to 95 % of the prior; black: the "
        f"{word}. A narrow blue bar in a wide grey one is a quantity that the trial determines, even where it does "
        "not determine the coefficients. "
    ]
    if boats.spiral is not None:
        parts.append(
            "The spiral curve is the rudder that holds each rate of turn, as far as 95 % of the boats turn so fast; "
            "where it runs back, a straight course is not stable. "
        )
    if boats.roots:
        parts.append("Roots of small motions, to the left of the dotted line if the boat is stable.")
    return ReportFigure("derived", "".join(parts).strip(), partial(derived.draw, boats=boats, word=word))


def orders_figure(problem: AnyProblem, parameters: np.ndarray) -> ReportFigure:
    """The orders of each trial."""
    trials = {name: (trial.manoeuvre, problem.vehicle.actuators) for name, trial, _ in problem.each_trial(parameters)}
    some = f" of the first {track.MOST_ORDERS} of {len(trials)} trials" if len(trials) > track.MOST_ORDERS else ""
    synthetic = all(trial.record.truth is not None for _, trial, _ in problem.each_trial(parameters))
    source = "as the actuators follow them" if synthetic else "as the log has them"
    return ReportFigure("orders", f"The orders{some}, {source}.", partial(track.draw_orders, trials=trials))


def _small(results, reference: np.ndarray, word: str) -> Iterator[ReportFigure]:
    """Of the first screen: how much narrower the coefficients became, and the strongest trade-off of two."""
    sample, prior, n = results.summary, results.prior_of_others, len(reference)
    best, least = coefficients.BEST, coefficients.LEAST
    which = f" The {best} that narrow most and {least} that narrow least." if n > best + least else ""
    yield ReportFigure(
        "forest_small",
        f"90 % of the prior (grey) and of the posterior (blue).{which}",
        lambda path: coefficients.draw_small(path, sample, prior, reference, results.problem.equations, word),
    )
    if n < 2:
        return
    correlation = np.triu(results.correlation[:n, :n], 1)
    pair = divmod(int(np.argmax(np.abs(correlation))), n)
    both = zip(corner.edge(prior, *pair), pair, strict=True)
    edge = np.transpose([coefficients.ratios(side, reference, prior)[:, k] for side, k in both])
    draws = coefficients.ratios(sample.draws, reference, prior)[:, pair]
    names = labels([sample.names[k] for k in pair], results.problem.equations)
    yield ReportFigure(
        "pair_small",
        f"The strongest pair, correlation {correlation[pair]:+.2f}. Dashed: 90 % of the prior, if it is near.",
        partial(corner.draw_small, draws=draws, prior=edge, names=names, word=word),
    )


def fan_figure(
    name: str, problem: Any, before: np.ndarray, after: np.ndarray, *, is_first: bool = False
) -> Iterator[ReportFigure]:
    """A trial by draws from before and after it; no figure if most draws of the prior do not complete it.

    `is_first`: whether its track is on the first screen too.
    """
    prior, posterior = problem.predicted(before), problem.predicted(after)
    flown = np.isfinite(prior).all(axis=1)
    if 2 * np.count_nonzero(flown) < len(prior):
        return
    lost = len(prior) - np.count_nonzero(flown)
    failed = f" {lost} of {len(prior)} draws of the prior do not complete the trial and are left out." if lost else ""
    tracks = [problem.motion(draws[:TRACKS]) for draws in (before[flown], after)]
    channels = problem.record.channels
    ends = np.cumsum([len(channel.times) for channel in channels]) - 1
    bands = (np.quantile(draws[:, ends], [0.05, 0.95], axis=0) for draws in (prior[flown], posterior))
    sizes = [0.5 * np.ptp(band, axis=0) for band in bands]
    words = [_shrinks(*track.axis_label(channel), *pair) for channel, *pair in zip(channels, *sizes, strict=True)]
    yield ReportFigure(
        f"fan_{name}" if name else "fan",
        f"The trial {f'{name} ' if name else ''}before (grey) and after it (blue): "
        f"{TRACKS} tracks each, and bands of every channel. The boat at the last reading, half of the 90 % band: "
        f"{', '.join(words)}.{failed}",
        partial(track.draw_fan, channels=channels, prior=prior[flown], posterior=posterior, tracks=tracks),
    )
    if is_first:
        caption = f"Tracks before (grey) and after the trial{f' {name}' if name else ''} (blue)."
        yield ReportFigure("fan_small", caption, partial(track.draw_small_fan, tracks=tracks))


def _shrinks(label: str, factor: float, wide: float, narrow: float) -> str:
    """How a band shrinks, of an axis with a label such as ``north (m)`` and the factor from SI to its unit."""
    name, _, unit = label.partition(" (")
    before, after = (rounded(factor * width, factor * width) for width in (wide, narrow))
    return f"{name} {before} before and {after} {unit.rstrip(')')} after"


def disturbance_figure(forces: InferredForces) -> ReportFigure:
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
        partial(track.draw_disturbance, forces=forces),
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
        lambda path: track.draw_unseen(path, trial.problem.record.channels, unseen.predictions, trial.warm_up_s),
    )
