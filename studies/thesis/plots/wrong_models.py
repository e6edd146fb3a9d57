"""What the criticism of a run finds in records of wrong models, and what it proposes."""

import numpy as np

from bayesub.report.plots import style


def draw_warnings(path, kinds: dict, right, nominal: float, interval: float) -> None:
    """Shares of the records that are called into question, and coverage: a row a kind of record, right models above.

    Parameters
    ----------
    path : one file or several
    kinds : kind -> warned, coverage, coverage_error
    right : names of the kinds whose model is right
    nominal : share of right models that is called into question by chance
    interval : nominal coverage
    """
    names = sorted(kinds, key=lambda name: name not in right)
    with style.figure(path, 8.0, 0.24 * len(names) + 1.1) as figure:
        warned, held = figure.subplots(1, 2, sharey=True)
        for word, colour, some in (("model right", style.POSTERIOR, True), ("model wrong", style.SQP, False)):
            rows = np.array([k for k, name in enumerate(names) if (name in right) == some])
            results = [kinds[names[k]] for k in rows]
            warned.plot([100 * r["warned"] for r in results], rows, "o", color=colour, ms=6, label=word, clip_on=False)
            shares, errors = (100 * np.array([r[key] for r in results]) for key in ("coverage", "coverage_error"))
            held.errorbar(shares, rows, xerr=2 * errors, fmt="o", color=colour, ms=5, lw=1.2)
        warned.axvline(100 * nominal, color=style.TRUTH, lw=0.8, ls="--")
        held.axvline(100 * interval, color=style.TRUTH, lw=0.8, ls="--", label="nominal")
        warned.set_yticks(range(len(names)), names)
        warned.set(xlim=(-3, 103), ylim=(len(names) - 0.5, -0.5), xlabel="records called into question (%)")
        held.set(xlim=(0, 100), xlabel=f"{100 * interval:g} % intervals that hold the truth (%)")
        for panel in (warned, held):
            panel.axhline(len(right) - 0.5, color=style.TRUTH, lw=0.5, ls=":")
        handles, words = (a + b for a, b in zip(*(p.get_legend_handles_labels() for p in (warned, held)), strict=True))
        figure.legend(handles, words, loc="outside upper center", ncols=3, fontsize=8)


def draw_proposals(path, results: dict, proposals) -> None:
    """How many records of each kind get each proposal first: a table a case, where the right cell has a frame.

    Parameters
    ----------
    path : one file or several
    results : "case: kind" -> n_records, first (proposal -> count), right (proposals)
    proposals : those that there are
    """
    cases: dict[str, dict[str, dict]] = {}
    for name, result in results.items():
        case, _, kind = name.partition(": ")
        cases.setdefault(case, {})[kind] = result
    longest = max(map(len, cases.values()))
    with style.figure(path, 4.6 * len(cases), 0.29 * longest + 1.5) as figure:
        for panel, (case, kinds) in zip(figure.subplots(1, len(cases), squeeze=False)[0], cases.items(), strict=True):
            shares = np.array([[r["first"].get(p, 0) / r["n_records"] for p in proposals] for r in kinds.values()])
            panel.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
            for (row, column), share in np.ndenumerate(shares):
                result = list(kinds.values())[row]
                if share:
                    text = result["first"][proposals[column]]
                    look = {"ha": "center", "va": "center", "color": "white" if share > 0.5 else style.TRUTH}
                    panel.text(column, row, text, fontsize=8, **look)
                if proposals[column] in result["right"]:
                    edges = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) - 0.5 + [column, row]
                    panel.plot(*edges.T, color=style.SQP, lw=1.6, clip_on=False)
            panel.set_yticks(range(len(kinds)), list(kinds), fontsize=8)
            panel.set_xticks(range(len(proposals)), proposals, rotation=40, ha="right", rotation_mode="anchor")
            panel.set(title=case, xlabel="proposed first")
            panel.title.set_fontsize(9)
            panel.tick_params(length=0, axis="both", labelsize=8)
            panel.grid(visible=False)
            panel.spines[:].set_visible(False)
