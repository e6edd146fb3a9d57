"""What an answer rests on: how far the coefficients move with scales, zeros and clocks that the study holds.

With the prior as readings of its own (coordinates t, standard normal), residuals e and their Jacobian A, a fault f that
the log has and the model has not is taken for ``(A'A)^-1 A'F f`` of the parameters, to first order. What that leaves of
F, ``G = F - A (A'A)^-1 A'F``, is all that the log tells of f: ``-G'e / G'G``, to ``1 / |G|`` (score test of Rao 1948).
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.findings.verdicts import CONTRADICTION, contradicted
from bayesub.inference.identifiability.linear_model import LinearModel
from bayesub.io.errors import InputError
from bayesub.io.words import rounded, with_unit
from bayesub.logs.log_files import HEADERS
from bayesub.problem.distributions import WHITE
from bayesub.problem.forward_model import ForwardModel
from bayesub.problem.nuisance import PROPELLER, Nuisance, find
from bayesub.problem.trial_problem import TrialProblem

SIZES = {"scale": 0.01, "actuator": 0.05, "clock": 0.1, "zero": 1.0}  # s, deg; how far off each may well be
ALL_CLOCKS = "clock_offset_s"  # of all readings together, the key of a trial
LISTED, QUOTED = 3, 6  # coefficients of a fault, and faults in the sentence
WORTH = 1.0  # standard deviations, from which a sentence speaks of a change
_NOTHING = 1e-6  # of G, round-off
_WIDER = 2.0  # sd of a prior that is proposed, over the size that was found
_NEARLY = 3.0  # nats, by which another fault may explain the log less well than the best, and is named too


def numbers(problem: AnyProblem, best: np.ndarray, mean: np.ndarray, sd: np.ndarray) -> list[dict]:
    """Of each scale, zero and clock of logs that is not inferred what it moves, as JSON types, the worst first.

    `best` (n_params,): where it is linearised; `mean`, `sd` (n_coefficients,): of the posterior.

    Returns for each: "name" of the nuisance parameter, "held" and "size" in its unit; "estimate", its value by the log,
    "estimate_sd", its standard deviation, and "off", by how many of these it is from where it is held, or None; and
    "moves", rows of "name", "change", "relative" and "sds" of coefficients for that size. Of simulated trials, whose
    sensors are as they are said to be, there are none.
    """
    trials = [(trial, values) for _, trial, values in problem.each_trial(best)]
    if any(trial.record.truth is not None for trial, _ in trials):
        return []
    residuals, first = problem.residuals(best[None])[0], 0
    sizes: dict[str, tuple[float, float]] = {}
    columns: dict[str, np.ndarray] = {}
    for trial, values in trials:
        faults = _faults(trial)
        of_all = _with(trial, faults).jacobian_of_others(np.append(values, [fault.value for fault in faults]))
        for fault, column in zip(faults, of_all[:, of_all.shape[1] - len(faults) :].T, strict=True):
            for name in (fault.name, ALL_CLOCKS) if fault.mount else (fault.name,):
                size, _ = sizes.setdefault(name, (_size(fault, trial), fault.value * (name == fault.name)))
                columns.setdefault(name, np.zeros(len(residuals)))[first : first + trial.n_rows] += size * column
        first += trial.n_rows
    return _moved(problem, best, residuals, columns, sizes, mean, sd)


def _moved(problem, best, residuals, columns, sizes, mean, sd) -> list[dict]:
    """The rows of columns (n_rows,) by name, each for a fault of its size, with where it is held."""
    t = problem.prior.standard(best)
    model = LinearModel(problem, t, residuals)
    t, n = t[model.others], len(model.others)
    matrix = np.vstack([model.jacobian, np.eye(n)])
    effects = model.out(np.reshape(list(columns.values()), (-1, len(residuals)))).T
    effects = np.vstack([effects, np.zeros((n, len(columns)))])
    if not (np.isfinite(matrix).all() and np.isfinite(effects).all()):
        return []
    answers = np.linalg.lstsq(matrix, effects)[0]
    rest = effects - matrix @ answers
    scores = -rest.T @ np.concatenate([model.residuals, t])
    changes = (model.prior.chain(np.eye(n), t) @ answers)[: problem.n_coefficients].T
    lengths, rows = np.linalg.norm(rest, axis=0), []
    for k, (name, (size, held)) in enumerate(sizes.items()):
        change, length, off = changes[k], float(lengths[k]), float(scores[k] / max(lengths[k], _NOTHING))
        found: dict[str, float | None] = dict.fromkeys(("estimate", "estimate_sd", "off"))
        if length > _NOTHING:
            found = {"estimate": held + size * off / length, "estimate_sd": size / length, "off": off}
        moves = [
            {"name": problem.names[j], "change": float(change[j]), "relative": float(change[j] / abs(mean[j]))}
            | {"sds": float(change[j] / sd[j])}
            for j in np.argsort(-np.abs(change / sd), kind="stable")[:LISTED]
        ]
        rows.append({"name": name, "held": held, "size": size, **found, "moves": moves})
    return sorted(rows, key=lambda row: -abs(row["moves"][0]["sds"]))


def _faults(trial: TrialProblem) -> list[Nuisance]:
    """The scales, zeros and clocks that a trial holds and could infer."""
    channels, actuators = trial.record.channels, trial.vehicle.actuators.parameters
    names = [PROPELLER, *(name for name, (_, kind) in actuators.items() if kind == "scale" or name.endswith("_deg"))]
    for channel in channels:
        names += [f"scale_{channel.name}", f"bias_{HEADERS[channel.quantity]}", f"clock_{channel.instrument}_s"]
    faults = []
    for name in dict.fromkeys(names):
        with suppress(InputError):  # has no part in this trial
            faults.append(find(name, trial.vehicle, trial.manoeuvre, channels, trial.noises))
    return [fault for fault in faults if fault.name not in trial.forward.nuisances.names]


def _with(trial: TrialProblem, faults: Sequence[Nuisance]) -> TrialProblem:
    """The trial with faults as parameters after its own."""
    own, step = trial.forward.nuisances.parameters, trial.forward.simulator.step
    given = trial.vehicle, trial.manoeuvre, trial.record, [*own, *faults], step, trial.forward.disturbances
    priors = trial.nuisance_priors | dict.fromkeys((fault.name for fault in faults), WHITE)
    return trial.view(forward=ForwardModel(*given), nuisance_priors=priors)


def _size(fault: Nuisance, trial: TrialProblem) -> float:
    """How far off a fault may well be, in its unit; a zero of a sensor by its noise."""
    if fault.attribute == "bias":
        return float(trial.channels[fault.channel][0].total_sd / fault.factor)
    of_actuator = "actuator" if fault.name.startswith("scale_") else "zero"
    return SIZES["clock" if fault.mount is not None else fault.attribute or of_actuator]


def sentences(rows: Sequence[dict]) -> dict[str, str]:
    """What contradicts the log and what the answer rests on, of rows of :func:`numbers`; only what there is to say."""
    found = {"contradiction": _contradiction(rows), "rests_on": _heavy(rows)}
    return {topic: text for topic, text in found.items() if text}


def _contradiction(rows) -> str:
    if not contradicted(rows):
        return ""
    rows = sorted((row for row in rows if row["off"]), key=lambda row: -abs(row["off"]))
    least = rows[0]["off"] ** 2 - 2.0 * _NEARLY
    likely = ", or ".join(_instead(row) for row in rows if row["off"] ** 2 >= least)
    remedy = f"Correct the column, or give {_remedy(rows[0])}."
    return f"The log contradicts a value that is held: it fits if {likely}. {remedy}"


def _instead(row) -> str:
    value = f"{rounded(row['estimate'], row['estimate_sd'])} ± {row['estimate_sd']:.2g}"
    off = f"({abs(row['off']):.2g} standard deviations)"
    if row["name"] == ALL_CLOCKS:
        return f"all readings were taken {value} s earlier than the study has it {off}"
    return f"{row['name']} is {value} and not {row['held']:g} {off}"


def _heavy(rows) -> str:
    if not (heavy := [row for row in rows if abs(row["moves"][0]["sds"]) >= WORTH]):
        return ""
    texts = []
    for row in heavy[:QUOTED]:
        move = row["moves"][0]
        known = f"; the log determines it to {_amount(row['name'], row['estimate_sd'])}" if row["estimate_sd"] else ""
        change = f"{100.0 * abs(move['relative']):.2g} % ({abs(move['sds']):.2g} standard deviations{known})"
        texts.append(f"{_amount(row['name'], row['size'])} in {row['name']} changes {move['name']} by {change}")
    more = f", and {len(heavy) - QUOTED} more" if len(heavy) > QUOTED else ""
    text = f"The answer depends on scales, zeros and clocks that are held. An error of {', '.join(texts)}{more}."
    return f"{text} If one may be that far off, give {_remedy(heavy[0])}."


def _remedy(row) -> str:
    far = abs(row["off"] or 0.0) >= CONTRADICTION
    if row["name"] == ALL_CLOCKS:
        more = f"{row['estimate']:.2g} s more {ALL_CLOCKS}" if far else f"another {ALL_CLOCKS}"
        return f"the trial {more}, or each clock a prior in [nuisance] (a delay of all controls looks the same)"
    sd = max(row["size"], _WIDER * abs(row["estimate"] - row["held"])) if far else row["size"]
    return f"it a prior in [nuisance], such as {row['name']} = {{ mean = {row['held']:g}, sd = {sd:.2g} }}"


def _amount(name: str, value: float) -> str:
    """An amount with its unit; of a scale in per cent."""
    if name.startswith("scale_"):
        return f"{100.0 * value:.2g} %"
    return f"{value:.2g} {with_unit(name).partition('(')[2].rstrip(')')}"
