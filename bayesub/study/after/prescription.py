"""What to measure or fly next, by the posterior of a run in a folder: its prescription, and a manoeuvre besides."""

from pathlib import Path

import numpy as np

from bayesub.design.knowledge import KnownBefore
from bayesub.design.limits import N_DRAWS, Range, load_limits, usual_limits
from bayesub.design.plan import families, with_manoeuvre
from bayesub.design.prescription import Prescription
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.study.after.finished_run import FinishedRun
from bayesub.study.run.prescribed import prescription


def prescribe(
    run: FinishedRun,
    wanted: tuple[str, ...] = (),
    limits: Path | None = None,
    *,
    seed: int = 0,
    progress: Progress = SILENT,
) -> tuple[Prescription, Manoeuvre | None]:
    """What to do after a run for names that are `wanted`, and the manoeuvre; None if no control may move.

    `limits` is a file of ``bayesub new limits``. InputError for a run that has not converged, names that it does not
    know, and quantities that depend on more than coefficients.
    """
    run.refuse_unconverged()
    run.refuse_quantities(wanted)
    found = prescription(run.setup(), run.posterior, wanted)
    judge, plane, vehicle = found.judge, found.again.subproblem, run.vehicle
    within = usual_limits(vehicle) if limits is None else load_limits(limits)
    try:
        kinds = families(vehicle, within, (), plane)
    except InputError as error:
        if limits is not None:
            raise
        progress.remark(f"no other manoeuvre is looked for: {error}")
        return found, None
    sets = KnownBefore.by(run.posterior, vehicle).sets(judge.vehicle, N_DRAWS, np.random.default_rng(seed))
    flights = Range(judge.vehicle, within, sets, plane, judge.step_s)
    flights.allow(next(iter(kinds.values())).straight())
    return with_manoeuvre(found, kinds, flights, seed, progress)
