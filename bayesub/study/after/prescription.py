"""What to measure or fly next, by the posterior of a run.

The posterior is the prior of what comes next, and each way is judged by exact Jacobians at its mean, in the normal
approximation: the last trial again, as it was or with one more instrument, another manoeuvre within limits, and a
coefficient from a towing tank. All errors of a further trial count as independent of those of the run.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bayesub.design.information import Information
from bayesub.design.plan import Plan, best, of_time
from bayesub.design.worth import further_sensors
from bayesub.findings.designed_trial import TANK_SD, Asked, further_instruments
from bayesub.io import toml_files
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.quantities import QUANTITIES
from bayesub.sensors import flat
from bayesub.sensors.sensor import channel_name
from bayesub.study.after.design import Request, goal_of, pose
from bayesub.study.after.finished_run import finished_run
from bayesub.study.schema.prior_section import noise_models

N_ASKED = 5  # coefficients, if none are named: those that the trial would see most of
SEARCH_S = 10.0  # of the search for a manoeuvre


@dataclass(frozen=True)
class Prescription:
    """Ways to know better what was asked for, the best first."""

    asked: tuple[Asked, ...]  # the n coefficients and quantities
    before: np.ndarray  # (n,) sds by the run, each in its unit
    after: dict[str, np.ndarray]  # what to do -> (n,) expected sds
    manoeuvre: Manoeuvre  # the one to fly

    def to_json(self) -> dict:
        """As JSON types, by quantity."""
        content = {}
        for k, (one, sd) in enumerate(zip(self.asked, self.before.tolist(), strict=True)):
            after = {way: float(sds[k]) for way, sds in self.after.items()}
            content[one.name] = {"value": one.value, "unit": one.unit, "sd": sd, "after": after}
        return content


def prescribe(
    folder: Path,
    wanted: tuple[str, ...] = (),
    limits: Path | None = None,
    *,
    seed: int = 0,
    progress: Progress = SILENT,
) -> Prescription:
    """Judge what to do after the run in a folder for the coefficients and quantities that are `wanted`.

    By default these are those of ``[[derived]]`` in its study, or else the five coefficients that a repetition of its
    last trial would see most of; `limits` is a file of ``bayesub new limits``. InputError for a folder that is no run
    of a study, a run that has not converged, and names that it does not know.
    """
    run = finished_run(folder)
    study, setup = run.study, run.setup()
    name, trial = list(setup.trials.items())[-1]
    vehicle = str(study.path(study.vehicle)) if toml_files.is_path(study.vehicle) else study.vehicle
    plane = trial.manoeuvre.subproblem
    question = pose(Request(vehicle, ("A",), limits=limits, after=Path(folder), seed=seed, subproblem=plane))
    (sections,) = (sections for one, _, sections in study.each_trial() if one == name)
    intervals = {c.name: float(np.median(np.diff(c.times))) for c in trial.record.channels if len(c.times) > 1}
    sensors = [
        replace(sensor, interval_s=intervals.get(channel_name(sensor.quantity), sensor.interval_s))
        for sensor in flat([section.build() for section in sections])
    ]
    (noise,) = noise_models(study.noise, [trial.record.channels])
    given = {"sensors": tuple(sensors), "nuisance": trial.nuisance, "noise": noise}
    judge = replace(question.judge, disturbance=setup.disturbance, **given)
    (again,), empty = judge.information(trial.manoeuvre), judge.empty()
    derived = tuple(section.name for section in study.derived if section.name in QUANTITIES)
    seen = np.argsort(-np.diag(again.gram) * np.diag(empty.covariance))[:N_ASKED]
    most = tuple(judge.names[k] for k in seen)
    goal, asked, _ = goal_of(wanted or derived or most, judge, question.range, question.families)
    asked = asked or goal_of(most, judge, question.range, question.families)[1]

    def least(ways: dict[str, Information]) -> dict[str, Information]:
        way = min(ways, key=lambda way: goal(ways[way]))
        return {way: ways[way]}

    instruments = further_sensors(judge, trial.manoeuvre, further_instruments(judge))
    tank = {
        f"{name} from a tank, to {100 * TANK_SD:g} %": replace(
            empty, gram=empty.with_known([k], TANK_SD).precision - empty.precision
        )
        for k, name in enumerate(judge.names)
    }
    with TemporaryDirectory() as costs:
        plan = Plan(judge, question.range, question.families, goal, 1, seed, Path(costs))
        budget = of_time(SEARCH_S, SEARCH_S, plan.pace(), len(plan.families))
        *_, (_, searches) = plan.stages((budget[0], 0), progress)
    kind = best(searches)
    (manoeuvre,) = plan.cost(kind).manoeuvres(searches[kind].numbers)
    ways = {
        "the last trial again": again,
        **least({f"the same with {name}": information for name, information in instruments.items()}),
        f"another manoeuvre ({kind})": judge.information(manoeuvre)[0],
        **least(tank),
    }
    after = {
        way: np.array([ways[way].sd_of(one.gradient) for one in asked])
        for way in sorted(ways, key=lambda way: goal(ways[way]))
    }
    return Prescription(asked, np.array([empty.prior_sd_of(one.gradient) for one in asked]), after, manoeuvre)
