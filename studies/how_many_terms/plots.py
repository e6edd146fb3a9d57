"""Evidence and errors of prediction of smaller and smaller sets of terms, by noise."""

import numpy as np

from bayesub.report.plots import style

_COLOURS = (style.POSTERIOR, style.LINEAR, style.WEAK, style.SQP)
_SETS = {"best": ("o", "highest evidence"), "needed": ("s", "fewest that fit as well")}  # key -> marker, words
_DEEPEST = 60.0  # nats


def draw(path, coupled: dict, less: float) -> None:
    """Log evidence and rms position error by the number of terms, with the two sets that are named.

    Parameters
    ----------
    coupled : noise -> sizes, log_evidence, errors_m, best and needed (of each record, the first is drawn)
    less : log evidence that a set may lack to fit as well as the best
    """
    with style.figure(path, 7.5, 3.7) as figure:
        evidence, errors = figure.subplots(1, 2)
        for (name, result), colour in zip(coupled.items(), _COLOURS, strict=False):
            sizes = np.array(result["sizes"])
            for panel, values in ((evidence, result["log_evidence"]), (errors, result["errors_m"])):
                panel.plot(sizes, values, color=colour, label=name)
                for key, (marker, _) in _SETS.items():
                    size = result[key][0]
                    value = values[int(np.flatnonzero(sizes == size)[0])]
                    panel.plot(size, value, marker, color=colour, mec="black", ms=6)
        evidence.axhline(-less, color=style.TRUTH, ls="--", lw=0.8, label=f"{less:g} nats below the highest")
        evidence.set_ylim(-_DEEPEST, 0.05 * _DEEPEST)
        evidence.set_ylabel("log evidence below the highest")
        errors.set_yscale("log")
        errors.set_ylabel("rms position error (m)")
        for panel, title in ((evidence, "the trial itself"), (errors, "manoeuvres that were not fitted")):
            panel.set_title(title, fontsize=9)
        for marker, word in _SETS.values():
            evidence.plot([], [], marker, color="white", mec="black", ms=6, label=word)
        for panel in (evidence, errors):
            panel.invert_xaxis()
            panel.set_xlabel("terms that are left")
        handles, words = evidence.get_legend_handles_labels()
        words = [f"noise: {word}" if word in coupled else word for word in words]
        figure.legend(handles, words, loc="outside upper center", ncols=4, fontsize=8)
