"""How vehicles, trajectories, spectra, estimates and posteriors look in a notebook, by the names of their classes."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from bayesub.findings.vehicle_card import check
from bayesub.inference.baselines import Estimate
from bayesub.inference.identifiability import Spectrum
from bayesub.inference.sampling import Posterior
from bayesub.io import templates
from bayesub.io.notebook import Display
from bayesub.io.words import counted, rounded
from bayesub.logs.log_files import HEADERS, STATES
from bayesub.report import page
from bayesub.report.plots import cards, coefficients, style, track, trade_offs

ENTRIES = 5  # of a direction
DIRECTIONS = 3  # of the stiffest and of the sloppiest
ROWS = 60  # that can be read below each other
_LEFT, _RIGHT, _BOTTOM, _TOP, _ROW = 1.6, 0.1, 0.5, 0.35, 0.22  # inches, of a figure of rows


def vehicle(shown: Any) -> str:
    """Its coefficients, folded."""
    terms = shown.equations.terms
    rows = [
        (Markup("{} <code>{}</code>").format(page.symbol(term.label), term.name), f"{value:.4g}",
         f"{sd:.2g}" if np.isfinite(sd) else "", f"{term.scale} {term.regressor}", term.meaning)
        for term, value, sd in zip(terms, shown.xi, shown.sd, strict=True)
    ]  # fmt: skip
    facts = f"length {shown.length_m:g} m, mass {shown.rigid_body['mass']:.4g} kg, {shown.speed_mps:g} m/s at "
    facts += f"{shown.depth_m:g} m depth, water {shown.water_density_kgm3:g} kg/m³; "
    facts += f"equations '{shown.equations.name}' with {len(terms)} terms"
    heads = ("coefficient", "value", "sd", "multiplies", "what it is")
    return _page(shown.name, (shown.description, facts), heads, rows, f"{len(terms)} coefficients")


def trajectory(shown: Any) -> str:
    """The ends and limits of each state."""
    simulator = shown.simulator
    plane = simulator.subproblem or "six degrees of freedom"
    words, counts = np.unique(shown.status, return_counts=True)
    flown = ", ".join(f"{count} {word}" for word, count in zip(words, counts, strict=True))
    begin, *_, end = times = shown.times
    facts = f"{len(times)} times from {begin:g} to {end:g} s; of {len(shown.status)}: {flown}"
    rows = []
    for name, values in zip(STATES, shown.states[0].T, strict=True):
        header = HEADERS[name]
        values = np.degrees(values) if "deg" in header else values
        seen = values[np.isfinite(values)]
        rows.append((header, *(f"{x:.4g}" for x in (seen[0], seen[-1], seen.min(), seen.max()))))
    heads = ("state" if len(shown.status) == 1 else "state of the first", "start", "end", "least", "most")
    return _page(f"{simulator.vehicle.name} on {simulator.manoeuvre.name} ({plane})", (facts,), heads, rows)


def directions(shown: Spectrum) -> str:
    """The stiffest, sloppiest and null directions."""
    n = len(shown.names)
    last = n - shown.n_null
    facts = f"Of {n} directions the data determine {shown.n_informed} better than the prior, leave "
    facts += f"{last - shown.n_informed} to the prior, and {shown.n_null} are null."
    rows = []
    for i in sorted({*range(min(DIRECTIONS, last)), *range(max(0, last - DIRECTIONS), n)}):
        entries = list(shown.direction(i).items())[:ENTRIES]
        value = "0" if i >= last else f"{shown.singular_values[i]:.3g}"
        kind = "null" if i >= last else "stiff" if shown.singular_values[i] > 1.0 else "sloppy"
        rows.append((f"{i + 1}", kind, value, ", ".join(f"{x:+.2f} {name}" for name, x in entries)))
    heads = ("direction", "kind", "prior sd over data sd", "largest entries, prior sds")
    return _page("Spectrum", (facts,), heads, rows)


def estimate(shown: Estimate) -> str:
    """The best solution."""
    sds = np.full(len(shown.names), np.nan) if shown.covariance is None else np.sqrt(np.diag(shown.covariance))
    facts = f"{counted(len(shown.solutions), 'start')}, {shown.evaluations} simulations, {shown.seconds:.3g} s; "
    facts += f"least cost {shown.costs[0]:.6g}: {shown.statuses[0]}"
    rows = [(name, *_with_sd(value, sd)) for name, value, sd in zip(shown.names, shown.values, sds, strict=True)]
    return _page(shown.method, (facts,), ("parameter", "best", "sd"), rows)


def intervals(shown: Posterior) -> str:
    """Every parameter, and whether the posterior has converged."""
    verdict = "Converged." if shown.converged else "NOT CONVERGED: " + "; ".join(shown.shortcomings)
    q5, q95 = shown.quantiles([0.05, 0.95])
    columns = (shown.mean, shown.sd, q5, q95, shown.contraction, shown.rhat, shown.bulk_ess)
    rows = []
    for name, mean, sd, low, high, contraction, rhat, ess in zip(shown.names, *columns, strict=True):
        interval = " to ".join(_with_sd(x, sd)[0] for x in (low, high))
        rows.append((name, *_with_sd(mean, sd), interval, f"{contraction:.2g}", f"{rhat:.3f}", f"{ess:.0f}"))
    heads = ("parameter", "mean", "sd", "90 % interval", "posterior over prior sd", "R-hat", "bulk ESS")
    facts = f"{len(shown.chain)} ensembles, {shown.chain.shape[2]} walkers, {shown.n_steps} steps"
    return _page("Posterior", (verdict, facts), heads, rows)


def _with_sd(value, sd) -> tuple[str, str]:
    """A value to the second digit of its sd, and the sd; of a value without, four digits."""
    return rounded(value, sd), rounded(sd, sd) if sd > 0.0 else ""


def _page(title: str, facts: Iterable[str], heads: Sequence[str], rows: Iterable[Sequence], folded: str = "") -> str:
    """HTML of a title, sentences and a table, which is folded under a heading if there is one."""
    values = {"title": title, "sentences": facts, "heads": heads, "rows": rows, "folded": folded}
    return templates.fill("bayesub.report", "display.html", **values).rstrip("\n")


def _draw_intervals(path: style.Paths, posterior: Posterior) -> None:
    """90 and 50 % intervals of the parameters, in standard deviations of the prior from its mean."""
    quantiles = (posterior.quantiles(coefficients.QUANTILES) - posterior.prior_mean) / posterior.prior_sd
    with _figure_of_rows(path, posterior.names) as axis:
        n = len(axis.get_yticks())
        axis.axvspan(-1.645, 1.645, color="0.92", zorder=0, label="prior, ± 1.645 sd")
        for low, high, width in ((0, 4, 1.5), (1, 3, 4.5)):
            axis.hlines(range(n), quantiles[low, :n], quantiles[high, :n], color=style.POSTERIOR, lw=width)
        axis.plot(quantiles[2, :n], range(n), "o", ms=4, mfc="white", color=style.POSTERIOR, label="posterior")
        axis.set_xlabel("standard deviations of the prior, from its mean")


def _draw_estimate(path: style.Paths, estimate: Estimate) -> None:
    """The solutions from all starts over the best one, with its sds if it has any, of what is not zero there."""
    kept = np.flatnonzero(np.isfinite(estimate.values) & (estimate.values != 0.0))
    ratios = estimate.solutions[:, kept] / estimate.values[kept]
    with _figure_of_rows(path, [estimate.names[k] for k in kept]) as axis:
        n = len(axis.get_yticks())
        axis.axvline(1.0, color="0.7", lw=0.8)
        for solution in ratios[:0:-1]:
            axis.plot(solution[:n], range(n), "o", ms=4, mfc="none", color=style.SQP)
        if estimate.covariance is not None:
            sds = np.sqrt(np.diag(estimate.covariance))[kept] / np.abs(estimate.values[kept])
            axis.hlines(range(n), 1.0 - sds[:n], 1.0 + sds[:n], color=style.SQP, lw=1.0)
        axis.plot(ratios[0, :n], range(n), "o", ms=4.5, color=style.SQP, label=f"best of {len(ratios)}")
        axis.set_xlabel("solution over the best one")


@contextmanager
def _figure_of_rows(path, names) -> Iterator[Axes]:
    """The axes of a figure with a row for each of the first names, with a legend above if something has a label."""
    names = names[:ROWS]
    height = _BOTTOM + _TOP + _ROW * max(len(names), 2)
    with style.figure(path, 6.5, height, (_LEFT, _RIGHT, _BOTTOM, _TOP)) as figure:
        axis = figure.subplots()
        axis.set_yticks(range(len(names)), [style.plain(name) for name in names])
        axis.set_ylim(len(names) - 0.4, -0.6)
        yield axis
        if axis.get_legend_handles_labels()[0]:
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, borderaxespad=0.1)


DISPLAYS = {
    "Vehicle": Display(vehicle, lambda shown, path: cards.draw(check(shown), path)),
    "Trajectory": Display(trajectory, lambda shown, path: track.draw_simulated(path, shown)),
    "Spectrum": Display(directions, lambda shown, path: trade_offs.draw_directions(path, shown)),
    "Estimate": Display(estimate, lambda shown, path: _draw_estimate(path, shown)),
    "Posterior": Display(intervals, lambda shown, path: _draw_intervals(path, shown)),
}
