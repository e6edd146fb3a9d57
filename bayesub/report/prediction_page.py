"""The page of a prediction: the bands of a motion in words, numbers, figures and tables; of a log, its scores."""

from bayesub.findings.predicted_trial import PredictedTrial
from bayesub.findings.unseen import POSTERIOR, PRIOR, SQP
from bayesub.findings.verdicts import STATUS, in_words
from bayesub.io.words import cell, with_unit
from bayesub.report.page import ReportFigure, Sheet, Table, Verdict
from bayesub.report.plots import motion, style, track

_GREY = "#808080"


def figures(prediction: PredictedTrial) -> list[ReportFigure]:
    """The figures of the page; of a posterior that does not complete the motion none."""
    if not prediction.motions[POSTERIOR].is_flown:
        return []
    flown = {by: one for by, one in prediction.motions.items() if one.is_flown}
    drawn = [
        motion.Drawn(by, colour, flown[by], bands, is_framed=False, turn=(0, 1) if bands else (1, 2))
        for by, colour, bands in ((PRIOR, _GREY, (0.9,)), (SQP, style.SQP, ()))
        if by in flown
    ]
    drawn.append(motion.Drawn(POSTERIOR, style.POSTERIOR, flown[POSTERIOR]))
    lines, dashes = (" Orange: SQP.", " Orange, dashed: SQP.") if SQP in flown else ("", "")
    words = "Blue: 50 and 90 % of the posterior, and its median. Grey: 90 % of the prior, and its median."
    problem, warm_up = prediction.readings.trial.problem, prediction.readings.trial.warm_up_s
    pictures = [
        ReportFigure(
            "track",
            f"Track, starting at the dot. {words} Within a band is the boat at each time with that probability."
            f"{dashes}",
            lambda path: motion.draw_track(path, drawn),
            title="Where the boat is",
        ),
        ReportFigure(
            "states",
            f"States over the ground against time, and these less the median of the posterior. {words}{dashes} "
            "Below: the orders.",
            lambda path: motion.draw_states(
                path, drawn, POSTERIOR, prediction.states, problem.manoeuvre, prediction.vehicle.actuators, warm_up
            ),
            title="Every state",
        ),
    ]
    if prediction.readings.predictions and prediction.readings.posterior.is_flown:
        pictures.append(
            ReportFigure(
                "readings",
                "Readings (black) and the bands that are to hold 50 and 90 % of them, on the right less the mean "
                f"prediction. Green: the middle of the prior.{lines}",
                lambda path: track.draw_unseen(path, problem.record.channels, prediction.readings.predictions, warm_up),
                title="Readings that were held back",
            )
        )
    return pictures


def sheet(prediction: PredictedTrial, **about) -> Sheet:
    """The page; `about` are commit and seed."""
    numbers = prediction.numbers
    sentences = numbers["sentences"]
    verdicts = [Verdict(numbers["motion"]["is_flown"], "Motion.", sentences["motion"])]
    if prediction.held:
        verdicts.append(Verdict(False, "TOO NARROW.", sentences["held"]))
    if STATUS[prediction.verdict]:
        doubt = in_words(prediction.verdict, prediction.shortcomings)
        verdicts.insert(0, Verdict(False, "The bands may be wrong.", f"They are of a run that is {doubt}."))
    for log in numbers["predictions"]:
        word = "Predicts." if log["predicts"] else "DOES NOT PREDICT."
        verdicts.insert(0, Verdict(log["predicts"], word, sentences["prediction"]))
    pictures = figures(prediction)
    parts: list[ReportFigure | Table] = [*pictures[2:], *pictures[:2]]
    if pictures:
        parts.append(_states_table(numbers["motion"]["states"]))
    parts[1:1] = [_scores_table(log) for log in numbers["predictions"] if log["channels"]]
    draws = ", ".join(f"{by} {n}" for by, n in numbers["motion"]["draws"].items() if by in (POSTERIOR, PRIOR))
    facts = {"Vehicle": prediction.vehicle.name, "Water": prediction.water, "Draws": draws}
    last = f"{numbers['motion']['last_s']:.4g} s"
    question = f"What does the posterior of {prediction.run} say of {prediction.name}, {last}?"
    return Sheet(f"{prediction.name}: {prediction.vehicle.name} predicted", question, verdicts, facts, parts, **about)


def _states_table(states: dict) -> Table:
    first = next(iter(states.values()))
    heads = ["state", "median at the end", "half of 90 % band there", "at its widest"]
    heads += ["prior: there", "prior: widest"] if PRIOR in first else []
    heads += ["SQP: largest distance to the median"] if SQP in first else []
    rows = []
    for column, by in states.items():
        row = [with_unit(column), cell(by[POSTERIOR]["median_at_end"], 4)]
        whose = [by[who] for who in (POSTERIOR, PRIOR) if who in by]
        row += [cell(one[key]) for one in whose for key in ("half_width_at_end", "half_width")]
        rows.append(row + ([cell(by[SQP]["off"])] if SQP in by else []))
    return Table("How well each state is known", heads, rows)


def _scores_table(log: dict) -> Table:
    """A row by whom: coverage, and the score of each channel."""
    channels = log["channels"]
    heads = ["by", *(f"within {share} bands" for share in log["coverage"])]
    heads += [f"CRPS, {with_unit(channel['column'])}" for channel in channels.values()]
    heads += [f"rms, {with_unit(channel['column'])}" for channel in channels.values()]
    rows = []
    for by, coverage in log["coverage_by"].items():
        scores = [cell(channel[key].get(by)) for key in ("crps", "rms") for channel in channels.values()]
        rows.append([by, *(f"{100 * share:.0f} %" for share in coverage.values()), *scores])
    text = "Share of the readings within their bands, continuous ranked probability score (CRPS, less is better) and "
    text += "root mean square of readings less mean prediction (rms). Bands of a point (mode, SQP, prior mean) are of "
    text += "the noise, and of what the warm-up leaves open."
    return Table("Coverage and scores", heads, rows, text=text)
