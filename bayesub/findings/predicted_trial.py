"""A manoeuvre or a log as a run predicts it: the bands of a motion, and of a log its scores, in numbers and words."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesub.findings import predicted_motion, unseen
from bayesub.findings.predicted_motion import PredictedMotion
from bayesub.findings.unseen import POSTERIOR, PRIOR, SQP, TrialPrediction
from bayesub.io.words import cell
from bayesub.logs.log_files import HEADERS, STATES, si_factor
from bayesub.model.vehicles import Vehicle
from bayesub.problem.nuisance import CURRENTS, MOVING

MANY = 8  # names that are listed


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
                scores = flown.pop(POSTERIOR).crps
                log["crps_over"] = {by: unseen.mean_ratio(scores, one.crps) for by, one in flown.items()}
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
    def water(self) -> str:
        """What is said of the current."""
        if not set(CURRENTS).isdisjoint(self.readings.trial.problem.names):
            return "a current that the warm-up tells"
        if self.current_mps is None:
            return "no steady current"
        north, east = self.current_mps
        return f"a known current of {north:g} m/s to the north and {east:g} m/s to the east"


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
