"""Simulations an effective sample, by problem and sampler."""

from bayesub.report.plots import style

AT_LEAST = "$\\rightarrow$"  # the marker of what has not got there
_COLOURS = (style.POSTERIOR, style.SQP, style.LINEAR)


def draw(path, problems: dict, samplers, goals: dict[str, float]) -> None:
    """Simulations an effective sample by problem and sampler; arrows have not converged and cost at least that.

    Parameters
    ----------
    problems : problem -> n_params, and sampler -> converged, per_sample
    samplers : their names
    goals : problem -> most that ours may cost, a bar across its row
    """
    with style.figure(path, 9.0, 1.6 + 0.22 * len(problems)) as figure:
        panel = figure.subplots()
        for name, colour in zip(samplers, _COLOURS, strict=True):
            for row, result in enumerate(problems.values()):
                if name in result:
                    marker = "o" if result[name]["converged"] else AT_LEAST
                    panel.plot(
                        result[name]["per_sample"], row, marker=marker, ms=8 if marker == AT_LEAST else 6, color=colour
                    )
        (bars,) = panel.plot([goals[problem] for problem in problems], range(len(problems)), "|", color="0.3", ms=11)
        bars.set_label("at most, by the claim")
        panel.set_xscale("log")
        names = [f"{problem} ({result['n_params']})" for problem, result in problems.items()]
        panel.set_yticks(range(len(problems)), names, fontsize=8)
        panel.invert_yaxis()
        panel.set_xlabel(
            "simulations an effective sample of the worst known coefficient; arrows: not converged, at least that"
        )
        marks = [panel.plot([], [], "o", color=c, label=name)[0] for name, c in zip(samplers, _COLOURS, strict=True)]
        figure.legend(handles=[*marks, bars], loc="outside upper center", ncols=4, fontsize=8)
