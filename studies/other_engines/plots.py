"""What engines cost on the same problems."""

from bayesub.report.plots import style
from other_engines.samplers import OURS, rivals
from sampler.plots import AT_LEAST

_COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR, style.TRUTH)
_LABELS = ("seconds", "simulations, with Jacobians at their price")
_GAP = 0.18  # between rows of a problem


def draw(path, problems: dict) -> None:
    """Simulations and seconds to the target by problem and engine; arrows have not reached it with so much.

    Parameters
    ----------
    problems : problem -> what :func:`other_engines.samplers.compared` returns
    """
    found = {problem: {OURS: results[OURS]} | rivals(results) for problem, results in problems.items()}
    names = list(dict.fromkeys(name for engines in found.values() for name in engines))
    with style.figure(path, 9.0, 1.8 + 0.6 * len(found)) as figure:
        for panel, number in zip(figure.subplots(1, 2, sharey=True), (1, 0), strict=True):
            for row, engines in enumerate(found.values()):
                for place, (name, colour) in enumerate(zip(names, _COLOURS, strict=False)):
                    if name in engines:
                        _mark(panel, engines[name], number, row + _GAP * (place - 1.5), colour)
            panel.set_xscale("log")
            panel.set_xlabel(_LABELS[number])
            panel.set_yticks(range(len(found)), [f"{p} ({r['n_params']})" for p, r in problems.items()])
        panel.invert_yaxis()
        marks = [panel.plot([], [], "o", color=c, label=name)[0] for name, c in zip(names, _COLOURS, strict=False)]
        look = {"ls": "", "marker": AT_LEAST, "ms": 9, "color": "#777777"}
        marks += panel.plot([], [], **look, label="stopped there, not converged")
        figure.legend(handles=marks, loc="outside upper center", ncols=5)


def _mark(panel, cost, number, height, colour):
    if cost["to_target"] is not None:
        panel.plot(cost["to_target"][number], height, "o", color=colour)
    else:
        spent = (cost["seconds"], cost["work"])[number]
        panel.plot(spent, height, marker=AT_LEAST, ms=9, color=colour)
