"""The coefficient picture of the thesis (Figures 33 to 59), lying on its side: a row a coefficient."""

import numpy as np

from bayesub.io.words import counted, with_unit
from bayesub.model.equations import EquationSet
from bayesub.plots import style

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of intervals
PRIOR_EDGES = (0.05, 0.95)  # of the band of the prior
ROWS = 45  # that can be read below each other
VISIBLE = 0.015  # of the axis; of boxes that are narrower the median is drawn and not left white
PRIOR_PROBABILITIES = np.linspace(0.001, 0.999, 400)


def labels(names, equations: EquationSet) -> list[str]:
    """LaTeX labels of the coefficients of a set; other parameters by name and unit."""
    return [equations.label(name) if name in equations.index else with_unit(name) for name in names]


def borders(names, equations: EquationSet) -> list[int]:
    """Positions at which the coefficients of another axis, or other parameters, begin."""
    axes = [equations.term(name).axis if name in equations.index else name[0] for name in names]
    return [k for k in range(1, len(axes)) if axes[k] != axes[k - 1]]


def ratios(values, reference, prior) -> np.ndarray:
    """Values (.., n or more) as ratios to a reference (n,); where that is zero, one plus the value in prior sds."""
    n = len(reference)
    values = np.asarray(values)[..., :n]
    absent = reference == 0.0
    return np.where(absent, 1.0 + values / prior.sd[:n], values / np.where(absent, 1.0, reference))


def prior_density(quantiles) -> tuple[np.ndarray, np.ndarray]:
    """Places and density of a prior from its quantiles at PRIOR_PROBABILITIES."""
    quantiles = np.sort(quantiles)
    return 0.5 * (quantiles[1:] + quantiles[:-1]), np.diff(PRIOR_PROBABILITIES) / np.diff(quantiles)


def starred(names, reference, equations: EquationSet) -> list[str]:
    """Labels of coefficients (n,), with a star where the reference (n,) is zero."""
    stars = ("*" if zero else "" for zero in reference == 0.0)
    return [label + star for label, star in zip(labels(names, equations), stars, strict=True)]


def draw(path, posterior, prior, reference, estimates, reference_word: str, equations: EquationSet) -> None:
    """Prior band, posterior intervals and the solutions of the baselines.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.plots.style.figure` takes them.
    posterior
        With n_params parameters.
    prior
        Of the same parameters.
    reference
        (n_coefficients,) values that count as one, of the first n_coefficients parameters of the posterior.
    estimates
        List of Estimates; their coefficients may stand in another order.
    reference_word
        What the reference values are.
    equations
        Whose coefficients they are.
    """
    n = len(reference)
    n_panels = -(-n // ROWS)
    length = -(-n // n_panels)
    places = [[estimate.names.index(name) for name in posterior.names[:n]] for estimate in estimates]
    values = [
        ratios(estimate.solutions[:, place], reference, prior)
        for estimate, place in zip(estimates, places, strict=True)
    ]
    quantiles = posterior.quantiles(QUANTILES)
    low, high = limits(quantiles, prior, reference, values)
    with style.figure(path, 7.4 * n_panels, 0.235 * length + 1.25) as figure:
        panels = figure.subplots(1, n_panels, squeeze=False, sharex=True)[0]
        for panel, rows in zip(panels, np.array_split(np.arange(n), n_panels), strict=True):
            intervals(panel, rows, quantiles, prior, reference, lying=True)
            for estimate, some in zip(estimates, values, strict=True):
                _draw_estimate(panel, rows, estimate, some[:, rows], (low, high))
            _name_rows(panel, rows, posterior, reference, equations)
            star = "" if np.all(reference) else "; * zero there: 1 + value / prior sd"
            panel.set(xlim=(low, high), ylim=(rows[0] + length - 0.4, rows[0] - 0.6))
            panel.set_xlabel(f"ratio to {reference_word}{star}")
            panel.grid(axis="y", visible=False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8.5)


def limits(quantiles, prior, reference, values) -> tuple[float, float]:
    """Limits of the ratios: all of the prior, the posterior and values, unless they are far off."""
    edges = [ratios(some, reference, prior) for some in ([prior.quantiles(p) for p in PRIOR_EDGES], quantiles)]
    everything = np.concatenate([np.ravel(some) for some in (*edges, *values)])
    everything = everything[np.isfinite(everything)]
    return max(everything.min() - 0.1, -1.5), min(everything.max() + 0.1, 4.0)


def _draw_estimate(panel, rows, estimate, values, limits) -> None:
    """The solutions (n_solutions, n_rows) of a baseline; triangles point to those beyond the limits."""
    search = estimate.method == "SQP"
    n, low, high = len(values), *limits
    colour, marker, size = (style.SQP, "o", 3.4) if search else (style.LINEAR, "X", 5.0)
    word = f"SQP from {counted(n, 'start')}" if search else f"{estimate.method}, no noise"
    shifts = np.linspace(-0.25, 0.25, n) if n > 1 else np.array([0.3])
    y = rows + shifts[:, None]
    inside = (values >= low) & (values <= high)
    panel.plot(values[inside], y[inside], marker, ms=size, mew=0, color=colour, label=word, zorder=3)
    for beyond, edge, arrow in ((values < low, low, "<"), (values > high, high, ">")):
        if beyond.any():
            look = {"ms": 5, "mew": 0, "color": colour, "clip_on": False, "zorder": 3}
            panel.plot(np.full(beyond.sum(), edge), y[beyond], arrow, **look)


def _name_rows(panel, rows, posterior, reference, equations) -> None:
    """Name and symbol of each coefficient at the left, its relative posterior sd at the right, axes apart."""
    names = posterior.names[rows[0] : rows[-1] + 1]
    symbols = starred(names, reference[rows], equations)
    panel.set_yticks(rows, [f"{name}   {symbol}" for name, symbol in zip(names, symbols, strict=True)])
    relative = posterior.sd[rows] / np.abs(posterior.mean[rows])
    right = panel.secondary_yaxis("right")
    right.set_yticks(rows, [f"{100 * value:.2g} %" if value < 1.0 else "> 100 %" for value in relative], fontsize=8)
    right.tick_params(length=0)
    right.spines[:].set_visible(False)
    right.set_ylabel("posterior sd over mean", fontsize=8)
    for k in borders(names, equations):
        panel.axhline(rows[0] + k - 0.5, color=style.TRUTH, lw=0.5, ls=":")


def intervals(axis, columns, quantiles, prior, reference, *, lying: bool = False) -> tuple[float, float]:
    """Draw prior band and posterior intervals; the lowest and highest ratio of them.

    Parameters
    ----------
    axis
        To draw on.
    columns
        (n,) positions of the parameters, and where they are drawn.
    quantiles
        (5, n_params) of the posterior, those of QUANTILES.
    prior
        Of all parameters.
    reference
        As :func:`draw`.
    lying
        Whether ratios go to the right and not upwards.
    """

    def ratio(values):
        return np.sort(ratios(values, reference, prior)[:, columns], axis=0)

    bottom, top = ratio([prior.quantiles(p) for p in PRIOR_EDGES])
    low, q1, median, q3, high = ratio(quantiles)
    bars, lines, mark = (axis.barh, axis.hlines, "|") if lying else (axis.bar, axis.vlines, "_")
    bars(columns, top - bottom, 0.8, bottom, color=style.PRIOR, alpha=0.55, label="prior, 90 %")
    (axis.axvline if lying else axis.axhline)(1.0, color=style.TRUTH, lw=0.8)
    lines(columns, low, high, color=style.POSTERIOR, lw=1.5, label="posterior, 90 %")
    lines(columns, q1, q3, color=style.POSTERIOR, lw=5.0, label="posterior, 50 %")
    ends = min(bottom.min(), low.min()), max(top.max(), high.max())
    wide = q3 - q1 > VISIBLE * (ends[1] - ends[0])
    for some, look in ((wide, {"color": "white"}), (~wide, {"color": style.POSTERIOR, "mew": 2.0})):
        places = median[some], np.asarray(columns)[some]
        axis.plot(*(places if lying else places[::-1]), mark, ms=7, **look)
    return ends
