"""Predictions of unseen manoeuvres: errors by coefficient set and manoeuvre (thesis Figures 73 to 88, 113 to 126)."""

import numpy as np
from matplotlib.colors import LogNorm

from bayesub.report.plots import style

KINDS = {  # key -> label and colour, from the most to the least accurate
    "simulation": ("simulation accuracy: 0.1 s, controls held", style.TRUTH),
    "best": ("best set of SQP", style.LINEAR),
    "middle": ("middle set", style.WEAK),
    "worst": ("worst set", style.SQP),
    "random": ("mean of random ±10 % sets", style.NULL),
    "posterior": ("posterior, one draw a manoeuvre", style.POSTERIOR),
}
_LINES = {"random": "--", "middle": "-.", "best": ":"}  # for those who cannot tell the colours


def draw_surface(path, errors) -> None:
    """Heat map of the largest position error (n_sets, n_manoeuvres), both sorted by their medians.

    errors : m, not a number where the simulation failed
    """
    by_set = np.argsort(np.nanmedian(errors, axis=1))
    by_manoeuvre = np.argsort(np.nanmedian(errors, axis=0))
    with style.figure(path, 6.5, 3.8) as figure:
        axis = figure.subplots()
        image = axis.imshow(
            errors[by_set][:, by_manoeuvre], aspect="auto", origin="lower", cmap="cividis", norm=LogNorm()
        )
        axis.set(xlabel="unseen manoeuvre, easiest first", ylabel="identified set, best first")
        axis.grid(visible=False)
        figure.colorbar(image, ax=axis, label="largest position error (m)")


def draw_sorted(path, errors: dict[str, np.ndarray]) -> None:
    """For each vehicle the median and range of errors by set, and by manoeuvre (thesis Figures 76 to 78)."""
    with style.figure(path, 9.0, 3.2) as figure:
        sides = ((1, "identified set, best first"), (0, "unseen manoeuvre, easiest first"))
        for axis, (along, label) in zip(figure.subplots(1, 2, sharey=True), sides, strict=True):
            for vehicle, values in errors.items():
                colour = style.VEHICLES[vehicle]
                low, middle, high = np.nanquantile(values, [0.05, 0.5, 0.95], axis=along)
                order = np.argsort(middle)
                axis.fill_between(np.arange(len(order)) + 1, low[order], high[order], color=colour, alpha=0.2, lw=0)
                axis.semilogy(np.arange(len(order)) + 1, middle[order], color=colour, label=vehicle)
            axis.set_xlabel(label)
        figure.axes[0].set_ylabel("largest position error (m)\nmedian and 90 %")
        figure.axes[0].legend(fontsize=8)


def draw_distributions(path, errors: dict[str, dict[str, np.ndarray]], scales: dict[str, float]) -> None:
    """Cumulative distributions over the manoeuvres of the largest position error, a panel a vehicle, on one axis.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    errors
        Vehicle -> kind -> (n_manoeuvres,) m, not a number where the simulation failed.
    scales
        Vehicle -> what makes its lengths those of a boat as long as suboff.
    """
    with style.figure(path, 9.5, 3.5) as figure:
        panels = figure.subplots(1, len(errors), sharey=True, sharex=True, squeeze=False)[0]
        for axis, (vehicle, kinds) in zip(panels, errors.items(), strict=True):
            for key, (label, colour) in KINDS.items():
                if key in kinds:
                    values = scales[vehicle] * np.sort(kinds[key][np.isfinite(kinds[key])])
                    share = np.arange(1, len(values) + 1) / len(kinds[key])
                    axis.semilogx(values, share, color=colour, label=label, ls=_LINES.get(key, "-"))
            axis.set(title=vehicle, xlabel="largest position error (m, as long as suboff)")
        panels[0].set_ylabel("share of the manoeuvres")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, fontsize=8)


def draw_calibration(path, levels, shares: dict[str, np.ndarray], chance: dict[str, np.ndarray]) -> None:
    """How often central posterior predictive bands of a nominal level hold the truth, a panel a vehicle.

    Parameters
    ----------
    path
        One or several, as :func:`bayesub.report.plots.style.figure` takes them.
    levels
        (n_levels,).
    shares
        Vehicle -> (n_levels,).
    chance
        Vehicle -> (n_levels, 2), 5 and 95 % of the shares if the posterior is right; of a vehicle it may be missing.
    """
    with style.figure(path, 2.5 * len(shares) + 0.5, 3.3) as figure:
        panels = figure.subplots(1, len(shares), squeeze=False, sharey=True)[0]
        for axis, (vehicle, share) in zip(panels, shares.items(), strict=True):
            colour = style.VEHICLES[vehicle]
            if vehicle in chance:
                axis.fill_between(levels, *chance[vehicle].T, color=colour, alpha=0.2, lw=0, label="90 % by chance")
            axis.plot([0, 1], [0, 1], color=style.TRUTH, lw=0.8, ls="--", label="calibrated")
            axis.plot(levels, share, "o-", ms=4, color=colour, label="found")
            axis.set(title=vehicle, xlabel="nominal probability of the band", aspect="equal", xlim=(0, 1), ylim=(0, 1))
            axis.legend(fontsize=8, loc="lower right")
        panels[0].set_ylabel("share of true values inside")
