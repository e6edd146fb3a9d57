"""Two samplers of one posterior side by side."""

import numpy as np

from bayesub.plots import style
from bayesub.plots.coefficients import labels


def draw(path, check) -> None:
    """Means and sds by both samplers, and the differences of all moments in Monte Carlo standard errors.

    Means and sds are standardised by those of the ensemble sampler, so that it stands at 0 with a bar of +-1.
    """
    n = len(check.names)
    columns = np.arange(n)
    (mean, other_mean), (sd, other_sd) = check.means, check.sds
    with style.figure(path, max(7.0, 0.36 * n + 1.5), 6.4) as figure:
        moments, differences = figure.subplots(2, 1, height_ratios=(1.0, 1.2))
        moments.errorbar(columns - 0.15, np.zeros(n), np.ones(n), fmt="o", ms=3.5, color=style.POSTERIOR, label="emcee")
        shift, spread = (other_mean - mean) / sd, other_sd / sd
        moments.errorbar(columns + 0.15, shift, spread, fmt="s", ms=3.5, color=style.SQP, label="NUTS")
        moments.set_ylabel("mean ± sd\n(posterior sd from the mean)")
        moments.set_ylim(-1.6, 1.6)
        moments.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8)

        differences.axhspan(-check.threshold, check.threshold, color=style.PRIOR, alpha=0.35, lw=0)
        pairs = np.stack(np.triu_indices(n, 1))
        for place, label in zip(pairs, ("correlations", None), strict=True):
            differences.plot(place, check.correlation_z, ".", ms=3, color=style.READINGS, label=label)
        differences.plot(columns - 0.15, check.mean_z, "o", ms=4, color=style.POSTERIOR, label="mean")
        differences.plot(columns + 0.15, check.sd_z, "D", ms=4, color=style.SQP, label="sd")
        differences.set_ylabel("emcee - NUTS\n(Monte Carlo standard errors)")
        differences.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8)
        for axis in (moments, differences):
            axis.set_xticks(columns, labels(check.names), rotation=60, ha="right", rotation_mode="anchor")
            axis.set_xlim(-0.7, n - 0.3)
            axis.grid(axis="x", visible=False)
