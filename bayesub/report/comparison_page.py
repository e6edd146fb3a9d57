"""The page that sets several posteriors side by side."""

from collections.abc import Mapping

import numpy as np

from bayesub.findings.comparison import Comparison
from bayesub.findings.unseen import POSTERIOR
from bayesub.findings.verdicts import STATUS
from bayesub.io.words import cell, listed, uncertain, with_unit
from bayesub.report.page import ReportFigure, Sheet, Table, Verdict
from bayesub.report.plots import coefficients, motion

MOST = len(coefficients.RUNS)  # runs that can be distinguished
FURTHEST = 5  # parameters that are named of a pair
_PRIOR_90 = 1.645  # sds of a normal prior from its mean


def figures(comparison: Comparison) -> list[ReportFigure]:
    """The figures of the page."""
    labels = [run.label for run in comparison.runs]
    rows = [(name, _ratios(comparison, places)) for name, places in comparison.parameters.items()]
    pictures = [
        ReportFigure(
            "coefficients",
            "Left: 50 and 90 % of each posterior as ratios to the vehicle file of the first run that has the "
            "parameter; of what is zero there, one plus the distance to the prior mean in prior sds. Grey: 90 % of "
            "the prior, as a normal one. Right: posterior over prior sd, 1 where the data said nothing.",
            lambda path: coefficients.draw_runs(path, rows, labels),
            title="Coefficients",
        )
    ]
    flown = [
        (run.label, colour, run.prediction)
        for run, colour in zip(comparison.runs, coefficients.RUNS, strict=False)
        if run.prediction is not None and run.prediction.motions[POSTERIOR].is_flown
    ]
    if flown:
        trials = [trial for *_, trial in flown]
        drawn = [
            motion.Drawn(label, colour, trial.motions[POSTERIOR], (0.9,), turn=(place, len(flown)))
            for place, (label, colour, trial) in enumerate(flown)
        ]
        orders = trials[0].readings.trial.problem.manoeuvre, trials[0].vehicle.actuators
        pictures += [
            ReportFigure(
                "track",
                "Median tracks, and where the boat is at each time with 90 % probability, by each posterior. All lines "
                "but the first are dashed, so that each is seen where they are the same.",
                lambda path: motion.draw_track(path, drawn),
                title=f"Where the boat is on {comparison.manoeuvre}",
            ),
            ReportFigure(
                "states",
                f"Medians and 90 % bands by each posterior, on the right less the median of {drawn[0].label}. Below: "
                "the orders.",
                lambda path: motion.draw_states(path, drawn, drawn[0].label, trials[0].states, *orders),
                title=f"Every state on {comparison.manoeuvre}",
            ),
        ]
    return pictures


def _ratios(comparison: Comparison, places: Mapping[str, int]) -> dict[str, dict]:
    """Label -> quantiles of posterior and prior as ratios, and the contraction."""
    by_label = {run.label: run for run in comparison.runs}
    first = by_label[next(iter(places))]
    k = places[first.label]
    reference = first.reference(first.posterior.names[k])
    centre, sd = first.posterior.prior_mean[k], first.posterior.prior_sd[k]

    def ratios(values):
        values = np.asarray(values)
        return np.sort(values / reference if reference else 1.0 + (values - centre) / sd).tolist()

    result: dict[str, dict] = {}
    for label, at in places.items():
        posterior = by_label[label].posterior
        prior = posterior.prior_mean[at] + posterior.prior_sd[at] * np.array([-_PRIOR_90, _PRIOR_90])
        result[label] = {"ratios": ratios(by_label[label].quantiles[:, at]), "prior_ratios": ratios(prior)}
        result[label]["contraction"] = float(posterior.contraction[at])
    return result


def sheet(comparison: Comparison, **about) -> Sheet:
    """The page; `about` are commit and seed."""
    numbers, labels = comparison.numbers, [run.label for run in comparison.runs]
    in_doubt = [f"{label} {run['verdict'].upper()}" for label, run in numbers["runs"].items() if STATUS[run["verdict"]]]
    verdicts = [Verdict(True, "Compared.", " ".join(numbers["sentences"].values()))]
    if in_doubt:
        verdicts.insert(0, Verdict(False, "IN DOUBT:", f"{', '.join(in_doubt)}. Statements about it may be wrong."))
    coefficients, *others = figures(comparison)
    rows = [[key, *values.values()] for key, values in comparison.differences.items()]
    what = "What differs between the studies and the code"
    differences = [Table(what, ["setting", *labels], rows, labels)] if rows else []
    runs, rows = numbers["runs"], []
    for key in dict.fromkeys(key for run in comparison.runs for key in run.about):
        values = ("" if run.get(key) is None else run[key] for run in runs.values())
        rows.append([key, *(cell(value, 4) if isinstance(value, float) else str(value) for value in values)])
    rows.append(["parameters of the boat", *(str(run["n_parameters"]) for run in runs.values())])
    parts: list[ReportFigure | Table] = [Table("Runs", ["run", *runs], rows, list(runs)), *differences, coefficients]
    parts += [_distances_table(comparison), *others]
    if others:
        parts.append(_predictions_table(comparison))
    rows = []
    for name, label, one in ((name, *item) for name, of in numbers["parameters"].items() for item in of.items()):
        sd = one["conditional_sd"]  # None of a run of an older version
        known = "" if sd is None else cell(sd / one["prior_sd"], 2)
        rows.append([name, label, uncertain(one["mean"], one["sd"]), f"{one['contraction']:.2f}", known])
    heads = ["parameter", "run", "mean ± sd", "posterior / prior sd", "the same if all others were known"]
    parts.append(Table("Every parameter", heads, rows, ["run"]))
    question = "What do these posteriors say of the same coefficients, and of the same manoeuvre?"
    facts = {"Differences": "" if differences else "None between the studies and the code."}
    return Sheet(f"{listed(labels)} compared", question, verdicts, facts, parts, **about)


def _distances_table(comparison: Comparison) -> Table:
    rows = []
    for pair in comparison.numbers["pairs"]:
        ordered = sorted(pair["wasserstein"].items(), key=lambda item: -item[1])[:FURTHEST]
        far = ", ".join(f"{name} {cell(distance, 2)}" for name, distance in ordered)
        distances = (cell(pair[key], 2) for key in ("hellinger", "by_chance"))
        rows.append([pair["first"], pair["second"], str(pair["n_shared"]), *distances, far])
    return Table(
        "Distances between the posteriors",
        ["run", "beside", "shared parameters", "Hellinger distance", "by chance", "furthest apart (pooled sds)"],
        rows,
        ["beside", "furthest apart (pooled sds)"],
        "Hellinger distance of the normal approximations of all shared parameters together, 0 the same and 1 apart; by "
        "chance it is about that of the halves of a run. For each parameter the Wasserstein distance, by how much one "
        "distribution is to be moved on average to become the other, in pooled posterior sds.",
    )


def _predictions_table(comparison: Comparison) -> Table:
    flown = {label: p for label, p in comparison.numbers["predictions"].items() if p.get("is_flown")}
    rows = []
    for label, predicted in flown.items():
        distance = predicted["distance_m"][POSTERIOR]
        rows += [[label, "place (m)", "", cell(distance["at_end"]), cell(distance["largest"])]]
        for column, by in predicted["states"].items():
            values = by[POSTERIOR]
            halves_of = [cell(values[key]) for key in ("half_width_at_end", "half_width")]
            rows.append([label, with_unit(column), cell(values["median_at_end"], 4), *halves_of])
    heads = ["run", "state", "median at the end", "half of 90 % band there", "at its widest"]
    return Table(f"Predictions of {comparison.manoeuvre}", heads, rows, ["state"])
