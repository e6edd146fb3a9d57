"""The page of a prediction: the bands of a motion in words, numbers, figures and tables; of a log, its scores."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.logs.log_files import HEADERS, STATES, si_factor
from bayesub.model.vehicles import Vehicle
from bayesub.plots import motion as plots
from bayesub.plots import prediction as plot_of_readings
from bayesub.plots import style
from bayesub.problem.nuisance import CURRENTS, MOVING
from bayesub.report import predicted_motion, unseen
from bayesub.report.predicted_motion import PredictedMotion
from bayesub.report.report_figure import ReportFigure
from bayesub.report.sheet import Sheet, Table, Verdict, cell
from bayesub.report.unseen import POSTERIOR, PRIOR, SQP, TrialPrediction

MANY = 8  # names that are listed
_GREY = "#808080"


@dataclass(frozen=True)
class PredictedTrial:
    """A manoeuvre or a log as a run predicts it.

    Attributes
    ----------
    run : str
        Name of the study.
    vehicle : Vehicle
    motions : dict of str to PredictedMotion
        By whom; the posterior first.
    readings : TrialPrediction
        The trial; of a manoeuvre without predictions.
    held : tuple of str
        Coefficients that act and that the run does not infer.
    shortcomings : tuple of str
        Why the posterior has not converged; empty if it has.
    current_mps : (float, float) or None
        North and east, if it was given.
    """

    run: str
    vehicle: Vehicle
    motions: dict[str, PredictedMotion]
    readings: TrialPrediction
    held: tuple[str, ...] = ()
    shortcomings: tuple[str, ...] = ()
    current_mps: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Of the trial."""
        return self.readings.trial.name

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Short names of those that move, in their order."""
        manoeuvre = self.readings.trial.problem.manoeuvre
        moving = MOVING.get(self.vehicle.equations.subproblem(manoeuvre.subproblem), STATES)
        return tuple(name for name in STATES if name in moving)

    @cached_property
    def numbers(self) -> dict:
        """Everything there is to say, as JSON types."""
        motion = predicted_motion.numbers(self.motions, self.states, POSTERIOR, (POSTERIOR, PRIOR))
        result = {
            "run": self.run,
            "vehicle": self.vehicle.name,
            "name": self.name,
            "converged": not self.shortcomings,
            "shortcomings": list(self.shortcomings),
            "held": list(self.held),
            "motion": motion,
            "predictions": [],
        }
        if self.current_mps is not None:
            result["current_mps"] = list(self.current_mps)
        if self.readings.predictions:
            (log,) = unseen.numbers([self.readings])
            flown = {by: one for by, one in self.readings.predictions.items() if one.is_flown}
            log["coverage_by"] = {by: unseen.by_percent(one.coverage) for by, one in flown.items()}
            if POSTERIOR in flown:
                own = flown.pop(POSTERIOR).crps
                log["crps_over"] = {by: unseen.mean_ratio(own, one.crps) for by, one in flown.items()}
            result["predictions"] = [log]
        result["sentences"] = self._sentences(result)
        return result

    def _sentences(self, numbers: dict) -> dict[str, str]:
        """What is to be said, by topic."""
        sentences = {"motion": _of_motion(numbers["motion"], self.name)}
        if self.held:
            listed = ", ".join(self.held[:MANY]) + (" .." if len(self.held) > MANY else "")
            sentences["held"] = (
                f"{len(self.held)} coefficients that act on this motion are not inferred by the run and stand at the "
                f"values of the vehicle file, as if they were known: {listed}. The bands are too narrow by what these "
                "are uncertain."
            )
        for log in numbers["predictions"]:
            ratio = log.get("crps_over", {}).get(SQP)
            also = "" if ratio is None else f" Its score is {cell(ratio, 2)} of SQP's."
            sentences["prediction"] = log["sentence"] + also
        return sentences

    @property
    def _water(self) -> str:
        """What is said of the current."""
        if not set(CURRENTS).isdisjoint(self.readings.trial.problem.names):
            return "a current that the warm-up tells"
        if self.current_mps is None:
            return "no steady current"
        north, east = self.current_mps
        return f"a known current of {north:g} m/s to the north and {east:g} m/s to the east"

    def figures(self) -> list[ReportFigure]:
        """The figures of the page; of a posterior that does not complete the motion none."""
        if not self.motions[POSTERIOR].is_flown:
            return []
        trial = self.readings.trial
        flown = {by: one for by, one in self.motions.items() if one.is_flown}
        looks = {PRIOR: (_GREY, (0.9,)), SQP: (style.SQP, ())}
        others = [(by, look) for by, look in looks.items() if by in flown]
        drawn = [
            plots.Drawn(by, colour, flown[by], bands, is_framed=False, turn=(0, 1) if bands else (1, 2))
            for by, (colour, bands) in others
        ]
        drawn.append(plots.Drawn(POSTERIOR, style.POSTERIOR, flown[POSTERIOR]))
        lines, dashes = (" Orange: SQP.", " Orange, dashed: SQP.") if SQP in flown else ("", "")
        words = "Blue: 50 and 90 % of the posterior, and its median. Grey: 90 % of the prior, and its median."
        problem, warm_up = trial.problem, trial.warm_up_s
        pictures = [
            ReportFigure(
                "track",
                f"Track, starting at the dot. {words} Within a band is the boat at each time with that probability."
                f"{dashes}",
                lambda path: plots.draw_track(path, drawn),
                title="Where the boat is",
            ),
            ReportFigure(
                "states",
                f"States over the ground against time, and these less the median of the posterior. {words}{dashes} "
                "Below: the orders.",
                lambda path: plots.draw_states(
                    path, drawn, POSTERIOR, self.states, problem.manoeuvre, self.vehicle.actuators, warm_up
                ),
                title="Every state",
            ),
        ]
        if self.readings.predictions and self.readings.posterior.is_flown:
            channels = problem.record.channels
            predictions = self.readings.predictions
            pictures.append(
                ReportFigure(
                    "readings",
                    "Readings (black) and the bands that are to hold 50 and 90 % of them, on the right less the mean "
                    f"prediction. Green: the middle of the prior.{lines}",
                    lambda path: plot_of_readings.draw(path, channels, predictions, warm_up),
                    title="Readings that were held back",
                )
            )
        return pictures

    def sheet(self, **about) -> Sheet:
        """The page; `about` are commit and seed."""
        numbers = self.numbers
        sentences = numbers["sentences"]
        verdicts = [Verdict(numbers["motion"]["is_flown"], "Motion.", sentences["motion"])]
        if self.held:
            verdicts.append(Verdict(False, "TOO NARROW.", sentences["held"]))
        if self.shortcomings:
            verdicts.insert(0, Verdict(False, "NOT CONVERGED.", f"The bands may be wrong: {self.shortcomings[0]}"))
        for log in numbers["predictions"]:
            word = "Predicts." if log["predicts"] else "DOES NOT PREDICT."
            verdicts.insert(0, Verdict(log["predicts"], word, sentences["prediction"]))
        figures = self.figures()
        parts: list[ReportFigure | Table] = [*figures[2:], *figures[:2]]
        if figures:
            parts.append(_states_table(numbers["motion"]["states"]))
        for log in numbers["predictions"]:
            if log["channels"]:
                parts.insert(1, _scores_table(log))
        draws = numbers["motion"]["draws"]
        facts = {
            "Vehicle": self.vehicle.name,
            "Water": self._water,
            "Draws": ", ".join(f"{by} {n}" for by, n in draws.items() if by in (POSTERIOR, PRIOR)),
        }
        question = f"What does the posterior of {self.run} say of {self.name}, {numbers['motion']['last_s']:.4g} s?"
        return Sheet(f"{self.name}: {self.vehicle.name} predicted", question, verdicts, facts, parts, **about)


def _of_motion(motion: dict, name: str) -> str:
    if not motion["is_flown"]:
        return f"With most draws of the posterior the boat does not complete {name}."
    distance, states = motion["distance_m"], motion["states"]

    def other(values, key, unit):
        return f" (prior: {cell(values[PRIOR][key], 2)}{unit})" if PRIOR in values else ""

    text = (
        f"After {motion['last_s']:.4g} s the boat is within {cell(distance[POSTERIOR]['at_end'], 2)} m of where it is "
        f"expected with 90 % probability{other(distance, 'at_end', ' m')}"
    )
    for column, word in ((HEADERS["psi"], "heading"), (HEADERS["theta"], "pitch")):
        if column in states:
            half = states[column]
            text += (
                f", its {word} known to within {cell(half[POSTERIOR]['half_width_at_end'], 2)} deg"
                f"{other(half, 'half_width_at_end', ' deg')}"
            )
    if SQP in next(iter(states.values())):
        off = max(states[HEADERS[name]][SQP]["off"] for name in "xyz" if HEADERS[name] in states)
        text += f"; SQP is off the median by up to {cell(off, 2)} m"
    return text + "."


def _states_table(states: dict) -> Table:
    first = next(iter(states.values()))
    heads = ["state", "median at the end", "half of 90 % band there", "at its widest"]
    heads += ["prior: there", "prior: widest"] if PRIOR in first else []
    heads += ["SQP: largest distance to the median"] if SQP in first else []
    rows = []
    for column, by in states.items():
        row = [style.with_unit(column)]
        row += [cell(by[POSTERIOR]["median_at_end"], 4)]
        row += [cell(by[POSTERIOR][key]) for key in ("half_width_at_end", "half_width")]
        row += [cell(by[PRIOR][key]) for key in ("half_width_at_end", "half_width")] if PRIOR in by else []
        row += [cell(by[SQP]["off"])] if SQP in by else []
        rows.append(row)
    return Table("How well each state is known", heads, rows)


def _scores_table(log: dict) -> Table:
    """A row by whom: coverage, and the score of each channel."""
    channels = log["channels"]
    heads = ["by", *(f"within {share} bands" for share in log["coverage"])]
    heads += [f"CRPS, {style.with_unit(channel['column'])}" for channel in channels.values()]
    heads += [f"rms, {style.with_unit(channel['column'])}" for channel in channels.values()]
    rows = []
    for by, coverage in log["coverage_by"].items():
        shares = [f"{100 * share:.0f} %" for share in coverage.values()]
        scores = [cell(channel[key].get(by)) for key in ("crps", "rms") for channel in channels.values()]
        rows.append([by, *shares, *scores])
    return Table(
        "Coverage and scores",
        heads,
        rows,
        text="Share of the readings within their bands, continuous ranked probability score (CRPS, less is better) and "
        "root mean square of readings less mean prediction (rms). Bands of a point (mode, SQP, prior mean) are of the "
        "noise, and of what the warm-up leaves open.",
    )


def readings_table(prediction: TrialPrediction) -> Mapping[str, np.ndarray]:
    """Column -> (n_readings,) of the readings and their bands, channel after channel, for a CSV."""
    posterior = prediction.posterior
    channels = prediction.trial.problem.record.channels
    lengths = [len(channel.times) for channel in channels]
    factors = np.repeat([1.0 / si_factor(channel.quantity) for channel in channels], lengths)
    columns = {"column": np.repeat([HEADERS[channel.quantity] for channel in channels], lengths)}
    columns |= {
        "time_s": posterior.times,
        "judged": posterior.judged.astype(int),
        "reading": posterior.readings * factors,
    }
    if posterior.is_flown:
        columns["mean"] = posterior.mean * factors
        columns |= {name: end * factors for name, end in predicted_motion.quantiles(posterior.bands).items()}
    return columns
