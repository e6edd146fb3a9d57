"""Two samplers of one posterior side by side."""

import numpy as np

from bayesub.plots import style

_BINS = np.linspace(-5.0, 5.0, 41)
_KINDS = (("mean_z", "means"), ("sd_z", "sds"), ("correlation_z", "correlations"))


def draw(path, check) -> None:
    """Differences of all means, sds and correlations in Monte Carlo standard errors, beside the normal curve.

    Equal posteriors make differences that are normal; the dashed lines hold all of them in 99 of 100 comparisons.
    """
    with style.figure(path, 6.6, 2.3) as figure:
        panels = figure.subplots(1, len(_KINDS), sharex=True)
        fine = np.linspace(_BINS[0], _BINS[-1], 200)
        curve = np.exp(-0.5 * fine**2) / np.sqrt(2.0 * np.pi)
        for panel, (key, word) in zip(panels, _KINDS, strict=True):
            values = np.clip(getattr(check, key), _BINS[0], _BINS[-1])
            panel.hist(values, _BINS, density=True, color=style.POSTERIOR)
            panel.plot(fine, curve, color=style.TRUTH, lw=1.0)
            for edge in (-check.threshold, check.threshold):
                panel.axvline(edge, color=style.SQP, lw=1.0, ls="--")
            largest = np.abs(getattr(check, key)).max(initial=0.0)
            panel.set_title(f"{len(values)} {word}, largest {largest:.1f}", fontsize=8.5)
            panel.set_yticks([])
        panels[1].set_xlabel("emcee - NUTS (Monte Carlo standard errors)")
