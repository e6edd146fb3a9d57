"""Trials in study files: simulated and measured, or read from a log."""

from pathlib import Path
from typing import ClassVar, Literal

import pydantic

from bayesub.io import toml_files
from bayesub.io.errors import InputError, nearest
from bayesub.io.toml_files import Positive, Section
from bayesub.model.manoeuvres import load_manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.nuisance import BODY, INITIAL
from bayesub.sensors import observe
from bayesub.study.prior_section import PriorOfOne
from bayesub.study.sensor_section import FAULTS, PRESETS, AnySensorSection
from bayesub.study.trial_log import Trial, read_trial


class TruthSection(Section):
    """What only the simulated trial knows; biases are with the sensors."""

    current_mps: tuple[float, float] = (0.0, 0.0)


class TrialKeys(Section):
    """What says where the readings of a trial come from: a `manoeuvre` to simulate, or the log `data`, a path."""

    manoeuvre: str | None = None
    data: str | None = None
    subproblem: Literal["horizontal", "vertical"] | None = None
    clock_offset_s: float | None = None
    max_control_gap_s: Positive | None = None
    ignore: tuple[str, ...] | None = None
    nuisance: dict[str, PriorOfOne] = pydantic.Field(default_factory=dict)
    truth: TruthSection = TruthSection()

    SOURCES: ClassVar = ("manoeuvre", "data")
    OF_DATA: ClassVar = ("subproblem", "clock_offset_s", "max_control_gap_s", "ignore")

    @pydantic.model_validator(mode="after")
    def _one_source(self):
        given = [key for key in self.SOURCES if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of {', '.join(self.SOURCES)}; found {' and '.join(given) or 'none'}")
        if self.data is None:
            for key in self.OF_DATA:
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} is for 'data'; leave it out")
        if self.manoeuvre is None and any(self.truth.current_mps):
            raise ValueError(f"truth is what a simulated trial knows, and contradicts '{given[0]}'; leave it out")
        return self

    def build(self, vehicle: Vehicle, sections, nuisance: dict[str, PriorOfOne], dt: float | None, rng) -> Trial:
        """Simulate and measure the trial with random numbers from `rng`, or read its log."""
        sensors = [section.build() for section in sections]
        if self.data is None:
            varying = {name: _varying(name, one) for name, one in nuisance.items()}
            manoeuvre = load_manoeuvre(self.manoeuvre, vehicle)
            truth = simulate(vehicle, manoeuvre, dt=dt)
            record = observe(truth, sensors, rng, current_mps=self.truth.current_mps)
            return Trial(manoeuvre, record, varying, truth)
        for k, section in enumerate(sections):
            for key in FAULTS:
                if getattr(section, key, None):
                    raise InputError(
                        f"sensors.{k}.{key}: is of simulated readings, and contradicts 'data'; leave it out (an "
                        "unknown bias is for [nuisance], outliers are for [noise])"
                    )
        known = {name: one.value for name, one in nuisance.items() if one.value is not None and name in INITIAL}
        return read_trial(
            self.data,
            vehicle,
            sensors,
            nuisance={name: _varying(name, one) for name, one in nuisance.items() if name not in known},
            known=known,
            subproblem=self.subproblem,
            clock_offset_s=self.clock_offset_s or 0.0,
            max_control_gap_s=self.max_control_gap_s,
            ignore=self.ignore or (),
        )

    def located(self, folder: Path) -> "TrialKeys":
        """The same with the paths of files, which are relative to `folder`, made absolute."""
        if self.data is not None:
            return self.model_copy(update={"data": toml_files.absolute(self.data, folder)})
        if self.manoeuvre is not None:
            return self.model_copy(update={"manoeuvre": toml_files.located(self.manoeuvre, folder)})
        return self


class TrialSection(TrialKeys):
    """One of several trials of a study, with its own nuisance parameters, and sensors if they differ."""

    name: str = pydantic.Field(pattern=r"^[A-Za-z0-9_-]+$")
    sensors: tuple[AnySensorSection, ...] | None = None

    @pydantic.model_validator(mode="after")
    def _not_of_the_body(self):
        for name in self.nuisance:
            if name in BODY:
                raise ValueError(f"nuisance '{name}' is of the body, the same in all trials; give it in [nuisance]")
        return self


class InstrumentsFile(Section):
    """The instruments of a boat, and the current in which it flies, for ``bayesub simulate --sensors``."""

    sensors: tuple[AnySensorSection, ...] = pydantic.Field(min_length=1)
    truth: TruthSection = TruthSection()


def read_instruments(name: str | Path) -> InstrumentsFile:
    """The instruments of a file, or of a preset (:mod:`bayesub.sensors.presets`) with its own defaults."""
    if name in PRESETS:
        return InstrumentsFile.model_validate({"sensors": [{"kind": name}]})
    if not Path(name).suffix:
        raise InputError(
            f"no instruments '{name}'{nearest(str(name), PRESETS)}; expected {', '.join(PRESETS)} or a file"
        )
    return toml_files.read_toml(Path(name), InstrumentsFile)


def _varying(name: str, section: PriorOfOne) -> priors.Prior:
    if section.value is not None:
        raise InputError(f"nuisance.{name}: a value leaves nothing to infer; give a prior or leave the parameter out")
    return section.build()
