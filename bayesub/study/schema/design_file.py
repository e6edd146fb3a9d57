"""What a design knows of a trial that has not been flown: sensors, prior and what else is unknown, from a file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pydantic

from bayesub.design.families import Family
from bayesub.design.judge import Judge
from bayesub.io import toml_files
from bayesub.io.errors import InputError, error_source
from bayesub.io.toml_files import Section
from bayesub.logs.log_files import STATES
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulator import Simulator
from bayesub.model.vehicles import Vehicle
from bayesub.problem import priors
from bayesub.problem.nuisance import MOVING
from bayesub.sensors import Sensor, flat, unread
from bayesub.sensors.sensor import QUANTITIES
from bayesub.study.schema.disturbance_section import DisturbanceSection
from bayesub.study.schema.prior_section import NoiseSection, PriorOfOne, PriorSection, noise_models
from bayesub.study.schema.sensor_section import SensorSection
from bayesub.study.schema.study_file import FreeSection
from bayesub.study.schema.trial_section import unfixed

PRIOR_SD = 0.25
USUAL = {  # default sensors of a trial: a Doppler log, gyros, attitude and depth, once a second
    "sensors": [
        {"kind": "dvl", "sd_mps": 0.005},
        {"kind": "ins", "sd_degps": 0.01, "channels": ["p", "q", "r"]},
        {"kind": "ins", "sd_deg": 0.05, "channels": ["roll", "pitch"]},
        {"kind": "pressure", "sd_m": 0.05},
    ]
}


class DesignFile(Section):
    """Sensors of a trial that is to be designed, and what is known before; sections as in a study."""

    sensors: tuple[SensorSection, ...] = pydantic.Field(min_length=1)
    free: FreeSection | None = None  # the coefficients to infer; by default all that have a value
    prior: PriorSection | None = None  # by default normal, with a quarter of the value
    nuisance: dict[str, PriorOfOne] = pydantic.Field(default_factory=dict)
    noise: dict[str, NoiseSection] = pydantic.Field(default_factory=dict)
    disturbance: DisturbanceSection | None = None  # unmodelled forces, whose histories are integrated out

    def _check(self):
        if self.prior is not None and self.prior.centre == "perturbed":
            raise InputError("prior.centre 'perturbed' is a guess about a simulated truth; leave it out", "conflict")
        for name, one in self.nuisance.items():
            unfixed(name, one)

    def instruments(self) -> tuple[Sensor, ...]:
        """The sensors."""
        return tuple(flat([section.build() for section in self.sensors]))

    def judge(
        self, vehicle: Vehicle, family: Family, typical: Manoeuvre, source: Path | None, free: tuple[str, ...] = ()
    ) -> Judge:
        """The judge of manoeuvres of a vehicle; InputErrors begin with the file.

        `family`: of the trial, for its sub-problem and duration; `typical`: of which shares of the forces of the hull
        are taken, and the step; `source`: the file, from whose folder paths count; `free`: what to infer, unless said.
        """
        with error_source("" if source is None else str(source)):
            folder = Path() if source is None else source.parent
            prior: priors.CoefficientPrior = priors.relative_normal(PRIOR_SD)
            fixed: dict[str, float] = {}
            if self.prior is not None:
                prior, fixed = self.prior.build(vehicle.xi, vehicle, lambda name: str(folder / name))
                prior.check(vehicle.equations.names)
            names = free or vehicle.equations.active(subproblem=family.subproblem)
            if self.free is not None:
                names = self.free.names(vehicle.equations)
            sensors = self.instruments()
            channels = unread(sensors, family.duration).channels
            (noise,) = noise_models(self.noise, [channels])
            disturbance = None
            if self.disturbance is not None:
                simulator = Simulator(vehicle, typical, np.zeros(1), subproblem=family.subproblem)
                disturbance = self.disturbance.build([simulator])
            judge = Judge(
                with_fixed(vehicle, fixed),
                sensors,
                tuple(name for name in names if name not in fixed),
                prior,
                nuisance={name: one.build() for name, one in self.nuisance.items()},
                noise=noise,
                disturbance=disturbance,
                subproblem=family.subproblem,
            )
            length_time = vehicle.length_m / vehicle.speed_mps
            judge.problem(typical, min(0.1 * family.duration, length_time))  # which says what does not fit together
            return judge


def usual_sensors(vehicle: Vehicle, subproblem: str | None) -> DesignFile:
    """The default sensors of a trial, with what moves on the vehicle."""
    moving = MOVING.get(vehicle.equations.subproblem(subproblem), STATES)
    content = []
    for section in USUAL["sensors"]:
        channels = DesignFile.model_validate({"sensors": [section]}).instruments()
        changing = [c.column.rpartition("_")[0] for c in channels if QUANTITIES[c.quantity].changes(moving)]
        if changing:
            content.append(section | {"channels": changing})
    return DesignFile.model_validate({"sensors": content})


def with_fixed(vehicle: Vehicle, values: dict[str, float]) -> Vehicle:
    """A vehicle with other values of some coefficients."""
    xi = vehicle.xi.copy()
    xi[vehicle.equations.columns(values)] = list(values.values())
    return replace(vehicle, xi=xi)


def read_design(path: Path) -> DesignFile:
    """Read a file of sensors; InputError with file, key and remedy."""
    return toml_files.read_toml(path, DesignFile)
