"""Trials in study files: simulated and measured, or read from a log; and logs that the posterior is to predict."""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.toml_files import Positive, Section
from bayesub.model.vehicles import Vehicle
from bayesub.problem.nuisance import BODY, INITIAL, PROPELLER
from bayesub.problem.priors import Prior
from bayesub.sensors import observe, unread
from bayesub.study.schema.disturbance_section import TrueDisturbanceSection, true_parameters
from bayesub.study.schema.prior_section import PriorOfOne
from bayesub.study.schema.sensor_section import FAULTS, PRESETS, SensorSection

if TYPE_CHECKING:
    from bayesub.problem.joint import JointProblem
    from bayesub.problem.trial_problem import TrialProblem
    from bayesub.problem.unseen import UnseenTrial
    from bayesub.study.schema.trial_log import Trial


class TruthSection(Section):
    """What only the simulated trial knows; biases are with the sensors."""

    current_mps: tuple[float, float] = (0.0, 0.0)  # constant, to the north and to the east
    # What is wrong with the log of the actuators: nuisance parameter, such as ``delay_rudder_s`` -> value
    actuators: dict[str, float] = pydantic.Field(default_factory=dict)
    disturbance: TrueDisturbanceSection | None = None  # forces that the equations leave out


class TrialKeys(Section):
    """The source of the readings of a trial: a manoeuvre to simulate, or a log, to which the other keys belong."""

    manoeuvre: str | None = None  # built-in name or path, to be simulated
    data: str | None = None  # path of a log
    subproblem: Literal["horizontal", "vertical"] | None = None  # plane that it keeps to
    clock_offset_s: float | None = None  # how far the clock of its readings is ahead of that of its controls
    max_control_gap_s: Positive | None = None  # longest time between two cells of a control
    ignore: tuple[str, ...] | None = None  # columns that are not used
    prescribed: tuple[Literal["pitch", "yaw"], ...] | None = None  # angles that the boat follows as the log has them
    window_s: tuple[float, float] | None = None  # first and last time of the part that is used
    interval_s: Positive | None = None  # at most one reading of each channel is used in this time
    trust_log: bool | None = None  # whether it is fitted although its columns contradict each other
    nuisance: dict[str, PriorOfOne] = pydantic.Field(default_factory=dict)
    truth: TruthSection = TruthSection()

    SOURCES: ClassVar[tuple[str, ...]] = ("manoeuvre", "data")
    OF_DATA: ClassVar = (
        "subproblem", "clock_offset_s", "max_control_gap_s", "ignore", "prescribed", "window_s", "interval_s",
        "trust_log",
    )  # fmt: skip

    def _check(self):
        given = [key for key in self.SOURCES if getattr(self, key) is not None]
        if len(given) != 1:
            text = f"give one of {', '.join(self.SOURCES)}; found {' and '.join(given) or 'none'}"
            raise InputError(text, "conflict" if given else "missing")
        if self.data is None:
            for key in self.OF_DATA:
                if getattr(self, key) is not None and given == ["trials"]:
                    raise InputError(f"{key} is of one log; write it in each of [[trials]] that has 'data'", "conflict")
                if getattr(self, key) is not None:
                    raise InputError(f"{key} is for 'data'; leave it out", "conflict")
        has_truth = any(self.truth.current_mps) or self.truth.actuators or self.truth.disturbance is not None
        if self.manoeuvre is None and has_truth:
            text = f"truth is what a simulated trial knows, and contradicts '{given[0]}'; leave it out"
            raise InputError(text, "conflict")

    def build(
        self,
        vehicle: Vehicle,
        sections: Sequence[SensorSection],
        nuisance: dict[str, PriorOfOne],
        path: Callable[[str], str],
    ) -> "Trial":
        """Read the log of the trial; one that is to be simulated is not flown yet, and its record unread.

        Nuisance parameters are those of the study and of the trial, `sections` its instruments, and `path` gives the
        path of a file that the study names. InputError for a file that does not fit and faults of instruments of a log.
        """
        from bayesub.model.manoeuvres import load_manoeuvre
        from bayesub.study.schema.trial_log import Trial, read_trial

        if self.data is None:
            source = str(self.manoeuvre)
            manoeuvre = load_manoeuvre(path(source), vehicle)
            if source.lower().endswith(".csv"):  # which has no other name than its file's
                manoeuvre = replace(manoeuvre, name=Path(source).stem)
            record = unread([section.build() for section in sections], manoeuvre.duration)
            return Trial(manoeuvre, record, {name: unfixed(name, one) for name, one in nuisance.items()})
        for k, section in enumerate(sections):
            for fault in (f"sensors.{k}.{key}" for key in FAULTS if getattr(section, key, None)):
                what = f"{fault}: is of simulated readings, and contradicts 'data'; leave it out"
                remedy = "an unknown bias is for [nuisance], outliers are for [noise]"
                raise InputError(f"{what} ({remedy})", "conflict", fault)
        ahead = self.clock_offset_s or 0.0
        built = [sensor for section in sections for sensor in section.build()]
        known = {name: one.value for name, one in nuisance.items() if one.value is not None and name in INITIAL}
        trial = read_trial(
            path(self.data),
            vehicle,
            [replace(sensor, clock_offset_s=sensor.clock_offset_s + ahead) for sensor in built],
            name=Path(self.data).stem,
            nuisance={name: known[name] if name in known else unfixed(name, one) for name, one in nuisance.items()},
            subproblem=self.subproblem,
            max_control_gap_s=self.max_control_gap_s,
            ignore=self.ignore or (),
            prescribed=self.prescribed or (),
            window_s=self.window_s,
        )
        return trial if self.interval_s is None else replace(trial, record=trial.record.thinned(self.interval_s))

    def flown(
        self, trial: "Trial", vehicle: Vehicle, sections: Sequence[SensorSection], step: float, rng: np.random.Generator
    ) -> "Trial":
        """The trial of :meth:`build`, simulated and measured; that of a log is as it was.

        The step is that of the fit, s; the truth is flown at a tenth of it. `rng` is that of the noise. Raises
        InputError for a boat that does not complete the manoeuvre.
        """
        if self.data is not None:
            return trial
        from bayesub.model.simulate import simulate
        from bayesub.model.simulator import true_step

        actuators = self.truth.actuators
        truth = simulate(vehicle, trial.manoeuvre, dt=true_step(step, trial.manoeuvre), actuators=actuators)
        sensors = [section.build() for section in sections]
        parameters = dict(actuators)
        if self.truth.disturbance is not None:
            truth, disturbance = self.truth.disturbance.flown(truth, rng)
            parameters |= true_parameters(disturbance, vehicle)
        record = observe(truth, sensors, rng, current_mps=self.truth.current_mps)
        record = replace(record, nuisances=record.nuisances | parameters)
        return replace(trial, record=record, truth=truth)


class TrialSection(TrialKeys):
    """One of several trials of a study, with its own name, nuisance parameters and perhaps sensors."""

    name: str = pydantic.Field(pattern=r"^[A-Za-z0-9_-]+$")
    sensors: tuple[SensorSection, ...] | None = None

    PLURAL: ClassVar = "trials"

    def _check(self):
        super()._check()
        for name in self.nuisance:
            if name in BODY or name == PROPELLER:
                text = f"nuisance '{name}' is of the body, the same in all {self.PLURAL}; give it in [nuisance]"
                raise InputError(text, "conflict")


class InstrumentsFile(Section):
    """The instruments of a boat and the current in which it flies, for ``bayesub simulate --sensors``."""

    sensors: tuple[SensorSection, ...] = pydantic.Field(min_length=1)
    truth: TruthSection = TruthSection()


def read_instruments(name: str | Path) -> InstrumentsFile:
    """The instruments of a file, or of a preset (:mod:`bayesub.sensors.instruments`) with its own defaults."""
    if name in PRESETS:
        return InstrumentsFile.model_validate({"sensors": [{"kind": name}]})
    if not Path(name).suffix:
        check_known(str(name), PRESETS, f"no instruments '{name}'", hint=f"expected {', '.join(PRESETS)} or a file")
    return toml_files.read_toml(Path(name), InstrumentsFile)


def unfixed(name: str, section: PriorOfOne) -> Prior:
    """The prior of a nuisance parameter; InputError for a value."""
    if section.value is not None:
        text = f"nuisance.{name}: is a fixed value, which is not inferred; give a prior or leave it out"
        raise InputError(text, "conflict", f"nuisance.{name}")
    return section.build()


class CheckSection(TrialSection):
    """A log that is not fitted, or a manoeuvre to be simulated; with all keys of a trial."""

    name: str = pydantic.Field(
        default="", pattern=r"^[A-Za-z0-9_-]*$"
    )  # unique in the study; that of the file if empty
    # Time from its start in which its readings say what the fit does not know of this log: start, current, biases of
    # sensors. By default four ship lengths travelled, longer if they have few readings
    warm_up_s: Positive | None = None

    PLURAL: ClassVar = "logs"

    @pydantic.model_validator(mode="before")
    @classmethod
    def _named_after_its_file(cls, content):
        if not isinstance(content, dict) or content.get("name"):
            return content
        source = content.get("data") or content.get("manoeuvre")
        return content | {"name": re.sub(r"[^A-Za-z0-9_-]", "_", Path(str(source)).stem)} if source else content

    def nuisances(self, of_study: dict[str, PriorOfOne]) -> dict[str, PriorOfOne]:
        """What is unknown in this log: its own, and those of the study but for the start of the fitted log."""
        return {name: prior for name, prior in of_study.items() if name not in INITIAL} | self.nuisance

    def posed(self, problem: "TrialProblem", fitted: "TrialProblem | JointProblem") -> "UnseenTrial":
        """The log as a trial that the fitted ones shall predict; InputError for a log that is too short."""
        from bayesub.problem.unseen import UnseenTrial, warm_up

        unseen = UnseenTrial(self.name, problem, 0.0)
        is_needed = len(unseen.own(fitted)) > 0
        length = warm_up(problem, self.warm_up_s) if is_needed or self.warm_up_s else 0.0
        return replace(unseen, warm_up_s=length * is_needed)
