"""Two samplers of one posterior side by side."""

import numpy as np

from bayesub.model.equations import EquationSet
from bayesub.plots import style
from bayesub.plots.coefficients import labels

_A_ROW = 30  # coefficients that can be read side by side


def draw(path, check, equations: EquationSet) -> None:
    """Means and sds by both samplers, and the differences of all moments in Monte Carlo standard errors.

    Means and sds are standardised by those of the ensemble sampler, so that it stands at 0 with a bar of +-1. Many
    coefficients take several rows of both panels. `equations` are those of the coefficients.
    """
    n = len(check.names)
    rows = np.array_split(np.arange(n), -(-n // _A_ROW))
    with style.figure(path, max(7.0, 0.36 * len(rows[0]) + 1.5), 6.4 * len(rows)) as figure:
        axes = figure.subplots(2 * len(rows), 1, height_ratios=(1.0, 1.2) * len(rows))
        for columns, moments, differences in zip(rows, axes[::2], axes[1::2], strict=True):
            _draw_moments(moments, check, columns)
            _draw_differences(differences, check, columns)
            for axis in (moments, differences):
                names = labels([check.names[k] for k in columns], equations)
                axis.set_xticks(columns, names, rotation=60, ha="right", rotation_mode="anchor")
                axis.set_xlim(columns[0] - 0.7, columns[0] + len(rows[0]) - 0.3)
                axis.grid(axis="x", visible=False)


def _draw_moments(axis, check, columns):
    (mean, other_mean), (sd, other_sd) = check.means[:, columns], check.sds[:, columns]
    zero, one = np.zeros(len(columns)), np.ones(len(columns))
    axis.errorbar(columns - 0.15, zero, one, fmt="o", ms=3.5, color=style.POSTERIOR, label="emcee")
    shift, spread = (other_mean - mean) / sd, other_sd / sd
    axis.errorbar(columns + 0.15, shift, spread, fmt="s", ms=3.5, color=style.SQP, label="NUTS")
    axis.set_ylabel("mean ± sd\n(posterior sd from the mean)")
    axis.set_ylim(-1.6, 1.6)
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8)


def _draw_differences(axis, check, columns):
    axis.axhspan(-check.threshold, check.threshold, color=style.PRIOR, alpha=0.35, lw=0)
    for place, label in zip(np.triu_indices(len(check.names), 1), ("correlations", None), strict=True):
        members = np.isin(place, columns)
        axis.plot(place[members], check.correlation_z[members], ".", ms=3, color=style.READINGS, label=label)
    axis.plot(columns - 0.15, check.mean_z[columns], "o", ms=4, color=style.POSTERIOR, label="mean")
    axis.plot(columns + 0.15, check.sd_z[columns], "D", ms=4, color=style.SQP, label="sd")
    axis.set_ylabel("emcee - NUTS\n(Monte Carlo standard errors)")
    axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8)
