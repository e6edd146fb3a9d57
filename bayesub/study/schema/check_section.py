"""Logs in study files that are not fitted: the posterior is to predict them."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pydantic

from bayesub.io.errors import InputError
from bayesub.io.toml_files import Positive
from bayesub.problem.nuisance import BODY, INITIAL
from bayesub.study.schema.prior_section import PriorOfOne
from bayesub.study.schema.sensor_section import AnySensorSection
from bayesub.study.schema.trial_section import TrialKeys

if TYPE_CHECKING:
    from bayesub.problem.trial_problem import TrialProblem
    from bayesub.problem.unseen import UnseenTrial

WARM_UP_LENGTHS = 4.0  # ship lengths travelled at the trial speed
WARM_UP_READINGS = 8  # of each channel, in the median, in a warm-up
JUDGED_READINGS = 10  # at least, after it
LONGEST_WARM_UP = 0.5  # of the time of the readings


class CheckSection(TrialKeys):
    """A log that is not fitted, or a manoeuvre to be simulated; with all keys of a trial.

    Attributes
    ----------
    name : str
        Unique in the study; by default that of the file.
    sensors : tuple of SensorSection or None
        If they are not those of the study.
    warm_up_s : float or None
        Time from its start in which its readings say what the fit does not know of this log: start, current, biases of
        sensors. By default :data:`WARM_UP_LENGTHS` ship lengths travelled, longer if they have few readings.
    """

    name: str = pydantic.Field(default="", pattern=r"^[A-Za-z0-9_-]*$")
    sensors: tuple[AnySensorSection, ...] | None = None
    warm_up_s: Positive | None = None

    @pydantic.model_validator(mode="before")
    @classmethod
    def _named_after_its_file(cls, content):
        if not isinstance(content, dict) or content.get("name"):
            return content
        source = content.get("data") or content.get("manoeuvre")
        return content | {"name": re.sub(r"[^A-Za-z0-9_-]", "_", Path(str(source)).stem)} if source else content

    @pydantic.model_validator(mode="after")
    def _not_of_the_body(self):
        for name in self.nuisance:
            if name in BODY:
                raise InputError(
                    f"nuisance '{name}' is of the body, the same in all logs; give it in [nuisance]", "conflict"
                )
        return self

    def nuisances(self, of_study: dict[str, PriorOfOne]) -> dict[str, PriorOfOne]:
        """What is unknown in this log: its own, and those of the study but for the start of the fitted log."""
        return {name: prior for name, prior in of_study.items() if name not in INITIAL} | self.nuisance

    def posed(self, problem: "TrialProblem", fitted) -> "UnseenTrial":
        """The log as a trial that the fitted ones shall predict.

        Raises
        ------
        InputError
            For a log that is too short.
        """
        from bayesub.problem.unseen import UnseenTrial

        unseen = UnseenTrial(self.name, problem, 0.0)
        if not len(unseen.own(fitted)):
            return unseen
        return UnseenTrial(self.name, problem, warm_up(problem, self.warm_up_s))


def warm_up(problem: "TrialProblem", warm_up_s: float | None = None) -> float:
    """Length of the warm-up of a log, s.

    Parameters
    ----------
    problem : TrialProblem
        Of the log.
    warm_up_s : float or None
        If it is given.

    Raises
    ------
    InputError
        For a log of which too little is left.
    """
    if warm_up_s is None:
        channels = problem.record.channels
        lengths = WARM_UP_LENGTHS * problem.vehicle.length_m / problem.vehicle.speed_mps
        dense = np.median([channel.times[:WARM_UP_READINGS][-1] for channel in channels])
        warm_up_s = float(max(lengths, dense))
    last, n_left = problem.times.max(), np.count_nonzero(problem.times > warm_up_s)
    if n_left < JUDGED_READINGS or warm_up_s > LONGEST_WARM_UP * last:
        raise InputError(
            f"is too short to be predicted: of {last:.4g} s the warm-up takes {warm_up_s:.4g} s, which leaves {n_left} "
            "readings; give a longer log or a shorter warm_up_s",
            "data",
            "warm_up_s",
        )
    return warm_up_s


def check_names(names: Iterable[str], trials: Iterable[str]) -> None:
    """Raise ValueError for a name that two checks have, or a check and a trial."""
    names, trials = list(names), list(trials)
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two checks are named '{name}'; give each its own name", "conflict")
        if name in trials:
            raise InputError(f"a check and a trial are named '{name}'; give the check another name", "conflict")
