"""What an input file is, and the card of an equation set, a vehicle or the data of a study.

What validates a file is imported when one of its kind turns up: a mistake in a file that need not fly shows at once.
"""

import math
import pkgutil
import re
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from bayesub.io import toml_files
from bayesub.io.atomic import reason
from bayesub.io.errors import InputError, check_known, error_source, one_line
from bayesub.io.terminal import SILENT, Progress

if TYPE_CHECKING:
    import numpy as np

    from bayesub.findings.data_card import DataCard
    from bayesub.findings.equation_card import EquationCard
    from bayesub.findings.log_card import LogCard
    from bayesub.findings.vehicle_card import VehicleCard
    from bayesub.model.vehicles import Vehicle
    from bayesub.study.run.prepare import Setup

    Card = DataCard | EquationCard | LogCard | VehicleCard


# Rows of a log that are examined at a time, those of before that are with them, and readings of them for the whole.
MOST, SHARED, THIN = 500_000, 100, 2000
Examined: TypeAlias = "tuple[str, Card | None]"  # in words; and what `check` reports, in lines and as JSON


def draw_card(cards: "Iterable[Card | None]", path: Path) -> None:
    """Draw the card of the one vehicle or study among those of files; InputError if there is none, or more."""
    from bayesub.report.plots import cards as drawn  # here, since it imports matplotlib

    chosen = [card for card in cards if isinstance(card, drawn.VehicleCard | drawn.DataCard)]
    if len(chosen) != 1:
        text = f"--card draws one vehicle or study, found {len(chosen)} among the files"
        raise InputError(text, "conflict", "--card")
    with drawing(path):
        drawn.draw(chosen[0], path)


@contextmanager
def drawing(path: Path) -> Iterator[None]:
    """A place or format that cannot be drawn to is an InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be drawn: {reason(error)}", "file") from None
    except ValueError as error:
        raise InputError(one_line(f"{path}: cannot be drawn: {error}"), "file") from None


def examine(path: Path, vehicles: "Sequence[Vehicle]" = (), progress: Progress = SILENT) -> Examined:
    """What a file is, and its card, which not all kinds of files have; a log may be of the last of the vehicles."""
    if path.suffix == ".py":
        from bayesub.study.run import script

        return f"study script: {script.question(path, functions=script.FUNCTIONS)}", None
    if path.name.lower().endswith((".csv", ".csv.gz")):
        return _log(path, vehicles, progress)
    if path.suffix.lower() not in (".toml", "") and path.is_file():
        hint = "bayesub convert makes logs of what vehicles write"
        raise InputError(f"{path}: is no log (.csv), TOML file or script (.py); {hint}", "format")
    keys = toml_files.read_toml_table(path)
    for key, describe in _KINDS.items():
        if key in keys:
            return describe(path)
    from bayesub.design.limits import Limits

    if keys.keys() & Limits.model_fields.keys():
        return _limits(path)
    text = f"{path}: is neither a vehicle (no 'coefficients'), an equation set (no 'terms'), a geometry (no 'hull'), a "
    text += "map of a log (no 'columns'), a manoeuvre (no 'kind'), a study (no 'vehicle'), instruments (no "
    text += "'sensors'), a disturbance (no 'disturbance'), limits (none of their keys) nor an autopilot (no "
    text += "'interval_s')"
    raise InputError(text, "format")


def _vehicle(path: Path) -> Examined:
    import numpy as np

    from bayesub.model.equations.files import DEFAULT
    from bayesub.model.vehicles import load_vehicle

    boat = load_vehicle(path)
    from bayesub.findings import vehicle_card

    used, n_sds = int((boat.xi != 0).sum()), int(np.isfinite(boat.sd).sum())
    size, n = f"{boat.length_m:g} m at {boat.speed_mps:g} m/s", len(boat.xi)
    text = f"vehicle '{boat.name}', {size}, {used} of {n} coefficients"
    text += "" if boat.equations.name == DEFAULT else f" of the equations '{boat.equations.name}'"
    text += " not zero" + (f", {n_sds} with a standard deviation" if n_sds else "")
    return text, vehicle_card.check(boat)


def _equations(path: Path) -> Examined:
    from bayesub.findings.equation_card import EquationCard
    from bayesub.model.equations import load_equations

    equations = load_equations(path)
    freedom = f"{equations.degrees_of_freedom} degrees of freedom"
    text = f"equations '{equations.name}', {len(equations.terms)} terms, {freedom}: {equations.title}"
    return text, EquationCard(equations)


def _study(path: Path) -> Examined:
    from bayesub.study.schema.study_file import load_study

    study = load_study(path)
    import numpy as np

    from bayesub.findings import data_card
    from bayesub.study.run.infer import refuse_unreachable
    from bayesub.study.run.prepare import prepare

    for one in (study, load_study(path, quick=True)):
        refuse_unreachable(one)
    setup = prepare(study)
    cost, problem = _cost(setup), setup.problem
    if not np.isfinite(problem.predicted(problem.prior.mean)).all():  # the boat of the prior means fails
        return cost, None
    with error_source(str(path)):
        return cost, data_card.check(problem, f"{setup.study.name}: {setup.vehicle.name}")


def _instruments(path: Path) -> Examined:
    from bayesub.sensors import flat
    from bayesub.study.schema.trial_section import read_instruments

    if toml_files.read_toml_table(path).keys() & {"free", "prior", "nuisance", "noise", "disturbance"}:
        from bayesub.study.schema.design_file import read_design as read_instruments
    channels = flat([section.build() for section in read_instruments(path).sensors])
    return f"instruments that read {', '.join(sensor.column for sensor in channels)}", None


def _limits(path: Path) -> Examined:
    from bayesub.design.limits import Limits, load_limits
    from bayesub.logs.log_map import OWN

    limits = load_limits(path)
    for name in (name for name in limits.of_controls if not name.removesuffix("ps").endswith(OWN)):
        check_known(name, Limits.model_fields, f"{path}: unknown key '{name}'", key=name)
    values = limits.model_dump(exclude_none=True)
    return f"limits of a trial: {', '.join(f'{key} {value:g}' for key, value in values.items())}", None


def _plain(loader: str, words: Callable[[Any], str]) -> Callable[[Path], Examined]:
    """The description of a file without a card, by what the function of a module reads from it."""
    return lambda path: (words(pkgutil.resolve_name(f"bayesub.{loader}")(path)), None)


# Key that only files of a kind have -> what a file of that kind is; a study has sensors and a
# disturbance too, and comes before them.
_KINDS: dict[str, Callable[[Path], Examined]] = {
    "coefficients": _vehicle,
    "terms": _equations,
    **dict.fromkeys(("vehicle", "manoeuvre", "data", "trials"), _study),
    "hull": _plain(
        "model.hulls:load_hull",
        lambda hull: f"geometry of a hull of {hull.file.hull.length_m:g} m that displaces {hull.mass_kg:.4g} kg",
    ),
    "columns": _plain(
        "logs.log_map:read_map", lambda m: f"map of logs{f' of kind {m.kind}' * bool(m.kind)} to {', '.join(m.columns)}"
    ),
    "kind": _plain(
        "model.manoeuvre_files:read_manoeuvre", lambda m: f"manoeuvre '{m.name}' of kind {m.kind}, {m.duration_s:g} s"
    ),
    "sensors": _instruments,
    "disturbance": _plain(
        "study.schema.disturbance_section:read_disturbance",
        lambda file: f"disturbance on {' '.join(file.axes)}, correlation time {file.correlation_time_s:g} s",
    ),
    "interval_s": _plain(
        "model.autopilot:load_autopilot", lambda a: f"autopilot '{a.name}', which orders {', '.join(a.steered)}"
    ),
}


_OF_BOATS = re.compile(r"_command_\w+$|_(counts|percent|us)$|^(thrust_n|torque_nm)$")


def _log(path: Path, vehicles: "Sequence[Vehicle]", progress: Progress) -> Examined:
    import numpy as np

    from bayesub.findings import log_card
    from bayesub.logs import log_files

    # Without the boat too, what only a boat gives a meaning: commands, counts and the like, thrust and torque.
    header = [name.strip().strip('"') for name in toml_files.read_line(path).split(",")]
    if "u_prime" in header:
        text = f"{path}: is a table of captive tests; bayesub new vehicle NAME --from BOAT --captive {path} reads it"
        raise InputError(text, "format", "u_prime")
    own = (column for vehicle in vehicles for column in vehicle.actuators.log_columns)
    controls = (*own, *(name for name in header if _OF_BOATS.search(name)))
    headers, boat = log_files.headers(path, controls), vehicles[-1] if vehicles else None
    n, ends, log, cards, thin = 0, list[float](), dict[str, np.ndarray](), list[log_card.LogCard](), list[dict]()
    for part in log_files.read_parts(path, controls, ascending=False, most=MOST, progress=progress):
        n, ends = n + len(part["time"]), [*ends[:1], *part["time"][[0, -1]]]
        log = {name: np.append(log.get(name, values[:0])[-SHARED:], values) for name, values in part.items()}
        cards.append(log_card.check(log, headers, controls, boat))
        thin.append(_thinned(part))
    if len(cards) > 1:  # what a column holds is seen from first to last only: a boat may drift throughout a part
        log = {name: np.concatenate([part[name] for part in thin]) for name in log}
        parts, whole = log_card.joined(cards).findings, log_card.check(log, headers, controls, boat).findings
        of_parts = (finding for finding in parts if not finding.misread or finding.kind == "mixed")
        cards = [log_card.LogCard((*of_parts, *(one for one in whole if one.misread and one.kind != "mixed")))]
    if boat and not any(finding.misread for finding in cards[0].findings):  # whose remedies say more
        boat.check_log(log, str(path))
    return f"log of {n} rows from {ends[0]:g} to {ends[-1]:g} s with {', '.join(headers)}", cards[0]


def _thinned(log: "dict[str, np.ndarray]") -> "dict[str, np.ndarray]":
    """Rows of a part of a log (n,): THIN readings of each column, and the largest and smallest."""
    import numpy as np

    kept = np.zeros(len(log["time"]), dtype=bool)
    for values in log.values():
        filled = np.flatnonzero(np.isfinite(values))
        ends = [filled[values[filled].argmin()], filled[values[filled].argmax()]] if len(filled) else []
        kept[[*filled[:: 1 + len(filled) // THIN], *ends]] = True
    return {name: values[kept] for name, values in log.items()}


def _cost(setup: "Setup") -> str:
    """Time a batch, and count on what the sampler usually needs."""
    import numpy as np

    problem = setup.problem
    batch = np.repeat(problem.prior.mean[None], 64, axis=0)
    problem.log_prob(batch)  # compiles
    began = time.perf_counter()
    for _ in range(4):
        problem.log_prob(batch)
    rate = 4 * len(batch) / (time.perf_counter() - began)
    each = problem.each_trial(problem.prior.mean)
    trials = "; ".join(_trial(name, p, setup.trials[name], centre) for name, p, centre in each)
    unseen = "".join(
        f"to predict '{one.name}': {int((one.problem.times > one.warm_up_s).sum())} readings after a warm-up of "
        f"{one.warm_up_s:.4g} s{_failure(one.problem, one.problem.prior.mean)}; "
        for one in setup.unseen
    )
    text = f"study '{setup.study.name}': {setup.vehicle.name}, {trials}; {unseen}{_disturbance(problem)}"
    return f"{text}{rate:.0f} log posteriors a second, so a million take {1e6 / rate:.0f} s"


def _trial(name: str, problem, trial, centre) -> str:
    """A trial of a study in words, and whether it is possible at the prior means (n_params,)."""
    n_others = problem.n_params - problem.n_coefficients
    unknown = f"{problem.n_coefficients} free coefficients" + (f" and {n_others} other parameters" if n_others else "")
    forces = None if trial.truth is None else trial.truth.simulator.forces
    truth = "" if forces is None else f", truth disturbed on {' '.join(forces.axes)}"
    left_out = f" ({trial.n_left_out} outside the controls left out)" if trial.n_left_out else ""
    text = f"{f'{name}: ' if name else ''}{trial.manoeuvre.name}, {unknown}, {len(problem.readings)} readings{left_out}"
    return f"{text}, step {problem.simulator.step:g} s{truth}{_failure(problem, centre)}"


def _disturbance(problem) -> str:
    """The unmodelled forces that a study infers: sds in units of force and as shares, time and knots; or nothing."""
    from bayesub.model.disturbance import hull_force_rms
    from bayesub.study.schema.disturbance_section import central, in_words

    trials = [p for _, p, _ in problem.each_trial(problem.prior.mean)]
    if trials[0].forward.disturbances is None:
        return ""
    try:
        rms = hull_force_rms([p.simulator for p in trials])
    except InputError:  # the boat of the file fails, and there is no share
        rms = None
    knots = ", ".join(str(len(p.forward.disturbances.knots.times)) for p in trials)
    process, inferred = central(trials[0].forward.disturbances.unknown, trials[0].vehicle)
    return f"disturbance {in_words(process, rms, inferred)}, {knots} knots; "


def _failure(problem, centre) -> str:
    if math.isfinite(problem.log_likelihood(centre)[0]):
        return ""
    status = problem.trajectory(centre).status[0]
    why = "the readings are impossible" if status == "ok" else f"the boat {status.replace('_', ' ')}"
    return f", and at the prior means {why}"
