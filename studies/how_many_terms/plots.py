"""Evidence and errors of prediction of smaller and smaller sets of terms, by noise."""

import numpy as np

from bayesub.report.plots import style

_COLOURS = (style.POSTERIOR, style.LINEAR, style.WEAK, style.SQP)
_DEEPEST = 60.0  # nats


def draw(path, coupled: dict, less: float) -> None:
    """Log evidence and rms position error by the number of terms.

    Parameters
    ----------
    coupled : noise -> sizes, log_evidence, errors_m, best and needed (of each record, the first is drawn)
    less : log evidence that a set may lack to fit as well as the best
    """
    with style.figure(path, 7.5, 3.2) as figure:
        evidence, errors = figure.subplots(1, 2)
        for (name, result), colour in zip(coupled.items(), _COLOURS, strict=False):
            sizes = np.array(result["sizes"])
            for panel, values in ((evidence, result["log_evidence"]), (errors, result["errors_m"])):
                panel.plot(sizes, values, color=colour, label=name)
                for size, marker in ((result["best"][0], "o"), (result["needed"][0], "s")):
                    value = values[int(np.flatnonzero(sizes == size)[0])]
                    panel.plot(size, value, marker, color=colour, mec="black", ms=6)
        evidence.axhline(-less, color=style.TRUTH, ls="--", lw=0.8)
        evidence.set_ylim(-_DEEPEST, 0.05 * _DEEPEST)
        evidence.set_ylabel("log evidence below the highest")
        errors.set_yscale("log")
        errors.set_ylabel("rms position error, unseen manoeuvres (m)")
        for panel in (evidence, errors):
            panel.invert_xaxis()
            panel.set_xlabel("terms that are left")
        figure.legend(*evidence.get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)
