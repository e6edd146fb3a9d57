"""The coefficient picture of the thesis (Figures 33 to 59): a column a coefficient, its ratio to the truth upwards."""

from functools import partial

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.plots import style

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of intervals


def labels(names, equations: EquationSet) -> list[str]:
    """LaTeX labels of the coefficients of a set; other parameters by name and unit."""
    return [equations.label(name) if name in equations.index else style.with_unit(name) for name in names]


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
    names = posterior.names[:n]
    columns = np.arange(n)
    ratio = partial(ratios, reference=reference, prior=prior)
    with style.figure(path, max(6.0, 0.42 * n + 1.0), 4.6, (0.7, 0.1, 0.7, 0.4)) as figure:
        axis = figure.subplots()
        lowest, highest = intervals(axis, columns, posterior.quantiles(QUANTILES), prior, reference)
        for estimate in estimates:
            place = np.array([estimate.names.index(name) for name in names])
            if estimate.method == "SQP":
                offsets = np.linspace(-0.25, 0.25, len(estimate.solutions)) if len(estimate.solutions) > 1 else [0.3]
                for j, (offset, solution) in enumerate(zip(offsets, estimate.solutions[:, place], strict=True)):
                    label = f"SQP from {len(estimate.solutions)} starts" if j == 0 else None
                    axis.plot(columns + offset, ratio(solution), "o", ms=3, color=style.SQP, label=label)
            else:
                values = ratio(estimate.values[place])
                axis.plot(columns + 0.36, values, "x", ms=4.5, color=style.LINEAR, label=f"{estimate.method}, no noise")
        names_below = {"rotation": 60, "ha": "right", "rotation_mode": "anchor", "fontsize": style.NAMES}
        axis.set_xticks(columns, starred(names, reference, equations), **names_below)
        axis.set_xlim(-0.7, n - 0.3)
        axis.set_ylim(max(lowest - 0.1, -1.5), min(highest + 0.1, 4.0))
        star = "" if np.all(reference) else "\n* zero there: 1 + value / prior sd"
        axis.set_ylabel(f"ratio to {reference_word}{star}")
        axis.grid(axis="x", visible=False)
        for k in borders(names, equations):
            axis.axvline(k - 0.5, color=style.TRUTH, lw=0.5, ls=":")
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5 if n > 20 else 3, fontsize=8)


def intervals(axis, columns, quantiles, prior, reference) -> tuple[float, float]:
    """Draw prior band and posterior intervals; the lowest and highest ratio of them.

    Parameters
    ----------
    axis : to draw on
    columns : (n,) positions of the parameters, and where they are drawn
    quantiles : (5, n_params) of the posterior, those of QUANTILES
    prior : of all parameters
    reference : as :func:`draw`
    """

    def ratio(values):
        return np.sort(ratios(values, reference, prior)[:, columns], axis=0)

    bottom, top = ratio([prior.quantiles(p) for p in (0.025, 0.975)])
    axis.bar(columns, top - bottom, 0.8, bottom, color=style.PRIOR, alpha=0.55, label="prior, 95 %")
    axis.axhline(1.0, color=style.TRUTH, lw=0.8)
    low, q1, median, q3, high = ratio(quantiles)
    axis.vlines(columns, low, high, color=style.POSTERIOR, lw=1.5, label="posterior, 90 %")
    axis.vlines(columns, q1, q3, color=style.POSTERIOR, lw=5.0, label="posterior, 50 %")
    axis.plot(columns, median, "_", color="white", ms=7)
    return min(bottom.min(), low.min()), max(top.max(), high.max())
