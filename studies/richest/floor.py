"""Why coefficients stay unknown: null directions, too little effect, or others that imitate them."""

import numpy as np
from scipy import stats

from bayesub.design.information import Information
from bayesub.design.judge import Judge
from bayesub.design.limits import N_DRAWS, Range
from bayesub.inference.identifiability import null_space, rank
from bayesub.model.linear_form import linear_systems
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.simulate import simulate
from bayesub.model.trajectory import Trajectory
from richest.appraisal import SHARE, SHARES, Appraiser, appraiser_of
from thesis.mechanisms import PAIRS, motions
from thesis.uniqueness import uniqueness

REASONS = ("known", "imitated", "little", "null")
SHARPER = {"today": 1.0, "twice as long": 2.0, "ten times as long": 10.0, "sensors ten times better": 100.0}
SHARPER |= {"sensors a hundred times better": 1e4}
N_JUDGED = 12  # boats of the prior
N_POINTS = 400  # of a motion in a figure


def null_part(appraiser: Appraiser, manoeuvre: Manoeuvre) -> tuple[np.ndarray, int]:
    """(n,) length of the part of each coefficient in the null space, in prior sds, and the number of null directions.

    A coefficient that plays no part in a manoeuvre is wholly in the null space.
    """
    judge = appraiser.exact
    problem = judge.problem(manoeuvre, appraiser.step)
    null = null_space(problem, problem.prior.mean)
    basis = null.basis(problem.prior.sd)
    part = np.ones(len(judge.names))
    part[[judge.names.index(name) for name in problem.names]] = np.linalg.norm(basis, axis=0)
    return part, len(basis) + len(judge.names) - len(problem.names)


def reasons(information: Information, null: np.ndarray) -> dict[str, list[str]]:
    """Reason -> coefficients: known, or not because of a null direction, of little effect, or of others alike.

    Parameters
    ----------
    information : Information
    null : (n,) array
        Of :func:`null_part`.
    """
    relative_prior = information.prior_sd / np.abs(information.values)
    with np.errstate(divide="ignore"):
        alone = relative_prior / np.sqrt(1.0 + np.diag(information.gram))
    known = information.relative_sd <= SHARE
    of_null = ~known & (relative_prior * null > SHARE)
    little = ~known & ~of_null & (alone > SHARE)
    members = dict(zip(REASONS, (known, ~(known | of_null | little), little, of_null), strict=True))
    return {reason: [information.names[k] for k in np.flatnonzero(some)] for reason, some in members.items()}


def sharper(information: Information, null: np.ndarray) -> dict[str, int]:
    """How many coefficients are known if the information were so many times as large, and without bound."""
    counts = {}
    for name, factor in SHARPER.items():
        gram = factor * information.gram
        larger = Information(information.names, information.values, information.prior_sd, information.precision, gram)
        counts[name] = larger.n_known(SHARE)
    limit = information.prior_sd / np.abs(information.values) * null
    return counts | {"no error": int(np.count_nonzero(limit <= SHARE))}


def coupling(track: Trajectory) -> dict[str, float]:
    """Pair of motions -> correlation about zero over the manoeuvre."""
    pairs = {pair: motions(track, pair) for pair in PAIRS}
    return {pair: float(a @ b / np.sqrt(max((a @ a) * (b @ b), 1e-300))) for pair, (a, b) in pairs.items()}


def summary(vehicle: str, spec: dict) -> dict:
    """All that is asked of a manoeuvre that is looked at closely, as JSON types, and ``arrays`` as lists.

    Parameters
    ----------
    vehicle : str
    spec : dict
        Of :meth:`richest.appraisal.Appraiser.manoeuvre`.
    """
    appraiser = appraiser_of(vehicle)
    manoeuvre = appraiser.manoeuvre(spec)
    information, margins = appraiser.exact_information(manoeuvre), appraiser.range.margins(manoeuvre)
    null, n_null = null_part(appraiser, manoeuvre)
    track = simulate(appraiser.boat, manoeuvre)
    ranks = uniqueness(track)
    return {
        "duration_s": round(manoeuvre.duration, 1),
        "margins": {m.key: [round(m.limit, 3), float(f"{m.reached[0]:.4g}")] for m in margins},
        "within": appraiser.range.penalty(margins) == 0.0,
        "n_null": n_null,
        "null_by_axis": {axis: [r["motion"], r["terms"]] for axis, r in ranks.items()},
        "condition": {axis: float(f"{r['condition']:.4g}") for axis, r in ranks.items()},
        "coupling": {pair: round(value, 4) for pair, value in coupling(track).items()},
        "sensors": {
            sensors: {
                "n_known": {str(share): result.n_known(share) for share in SHARES},
                "n_sharper": result.n_sharper,
                "d": round(float(result.d_optimality), 4),
                "reasons": reasons(result, null),
                "sharper": sharper(result, null),
            }
            for sensors, result in information.items()
        },
        "arrays": {key: array.tolist() for key, array in _arrays(track, manoeuvre, information).items()},
    }


def other_boats(vehicle: str, specs: dict[str, dict[str, dict]], seed: int) -> dict:
    """What boats of the prior make of manoeuvres that were chosen for the vehicle itself.

    Parameters
    ----------
    vehicle : str
    specs : dict
        Set of sensors -> name -> manoeuvre.
    seed : int

    Returns
    -------
    dict
        Set of sensors -> name -> share of the boats that keep the limits, and mean, least and largest number of known
        coefficients.
    """
    appraiser = appraiser_of(vehicle)
    boat, columns = appraiser.boat, appraiser.exact.columns
    prior = appraiser.exact.prior.on(columns, boat.xi, boat.equations)
    draws = np.repeat(boat.xi[None], N_DRAWS, axis=0)
    draws[:, columns] = prior.sample(np.random.default_rng([seed, 4]), N_DRAWS)
    flights, results = Range(boat, appraiser.limits, draws, None, appraiser.step), {}
    for sensors, by_name in specs.items():
        results[sensors] = {}
        for name, spec in by_name.items():
            manoeuvre = appraiser.manoeuvre(spec)
            beyond = np.max([margin.excess[1:] for margin in flights.margins(manoeuvre)], axis=0)
            judge = Judge(boat, appraiser.sensors[sensors], step_s=appraiser.step, draws=draws[:N_JUDGED])
            known = [information.n_known(SHARE) for information in judge.information(manoeuvre)]
            within, mean = float(np.mean(beyond <= 0.0)), round(float(np.mean(known)), 2)
            results[sensors][name] = {"within": within, "mean": mean, "least": min(known), "most": max(known)}
    return results


def count_reasons(look: dict, *, names: bool) -> None:
    """Replace lists of coefficients in a summary by their numbers; if asked for, keep those of null directions."""
    for result in look["sensors"].values():
        lists = result["reasons"]
        result["reasons"] = {reason: len(some) for reason, some in lists.items()}
        if names:
            result |= {"null": lists["null"], "little": lists["little"]}


def _arrays(track: Trajectory, manoeuvre: Manoeuvre, information: dict[str, Information]) -> dict[str, np.ndarray]:
    """Motion, orders, singular values and expected sds, for figures."""
    every = np.linspace(0, len(track.times) - 1, N_POINTS).astype(int)
    times = track.times[every]
    orders = [np.interp(times, manoeuvre.times, row) for row in (*manoeuvre.controls.T, manoeuvre.rpm)]
    arrays = {"times": times, "states": track.states[0, every], "orders": np.array(orders)}
    for sensors, result in information.items():
        arrays |= {f"spectrum {sensors}": result.singular_values, f"relative sd {sensors}": result.relative_sd}
    return {key: array.astype(np.float32) for key, array in arrays.items()}


def conditions(vehicle: str, seed: int, numbers: list[int]) -> list[dict]:
    """Axis -> condition number of its linear form, for some random manoeuvres; nothing of one that is not completed."""
    appraiser, results = appraiser_of(vehicle), []
    for number in numbers:
        track = simulate(appraiser.boat, appraiser.random((seed, number))[1])
        ranks = rank(linear_systems(track)) if track.status[0] == "ok" else {}
        results.append({axis: float(f"{r.condition:.4g}") for axis, r in ranks.items()})
    return results


def correlations(conditions: list[dict], results: dict, numbers: list[int]) -> dict[str, dict]:
    """How well condition numbers rank random manoeuvres.

    Parameters
    ----------
    conditions : list of dict
        Of :func:`conditions`.
    results : dict
        Of :func:`richest.appraisal.joined`.
    numbers : list of int
        Of the manoeuvres.

    Returns
    -------
    dict
        Set of sensors -> Spearman's correlations with the smooth count of known coefficients, of the mean and of the
        largest logarithm of the condition numbers, and of the D-optimality.
    """
    flown = [k for k, by_axis in enumerate(conditions) if by_axis]
    chosen = np.array(numbers)[flown]
    logs = [np.log(list(conditions[k].values())) for k in flown]
    mean, largest = [np.mean(row) for row in logs], [np.max(row) for row in logs]
    correlations = {}
    for sensors, values in results.items():
        if sensors != "penalty":
            known = -values["cost"][chosen]
            merits = {"mean": mean, "largest": largest, "d": values["d"][chosen]}
            correlations[sensors] = {key: round(float(stats.spearmanr(m, known)[0]), 3) for key, m in merits.items()}
    return correlations
