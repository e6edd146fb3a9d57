"""What a posterior says of unmodelled forces: their histories beside the forces of the hull, in numbers and words."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayesub.findings.missing_terms import FALSE_ALARMS, FollowedRegressor, find_followed, scores
from bayesub.findings.set_up import AnyProblem
from bayesub.io import templates
from bayesub.logs.log_files import ANGLES, positions
from bayesub.model.disturbance import CURRENTS, DISTURBED, hull_forces, unit
from bayesub.model.equations import AXES
from bayesub.problem.distributions import Prior
from bayesub.problem.disturbances import force_scales
from bayesub.sensors.current import seen

MOTIONS = dict(zip(AXES, ("surge", "sway", "heave", "roll", "pitch", "yaw"), strict=True))
MOTIONS |= {axis: f"current to the {axis}" for axis in CURRENTS}
UNSEEN = 0.9  # posterior sd over prior sd
_DRAWS = 1000  # of the histories
_SCORED = 200  # of the scores, each with some tens of simulations
_LARGER = 0.95  # of random histories are less uneven than one that is said to be largest somewhere
_PRIOR_DRAWS = 1000
_QUANTILES = {"q5": 0.05, "median": 0.5, "q95": 0.95}


@dataclass(frozen=True)
class InferredForces:
    """The histories of one trial."""

    trial: str  # its name; "" for the only one
    times: np.ndarray  # (n_knots,), s
    axes: tuple[str, ...]
    draws: np.ndarray  # (n_draws, n_axes, n_knots), N, N m, and m/s of a current
    # (n_axes, n_knots, n_knots) of the process at the posterior mean, N and N m; a random history is a factor times a
    # standard normal one
    factors: np.ndarray
    truth: np.ndarray | None  # (n_axes, n_knots), the forces that a simulated boat felt, linear between the same knots
    fine_times: np.ndarray  # (n_fine,), s
    # (n_axes, n_fine), along the posterior mean of the motion: forces of the hull, N and N m; for a current the
    # velocity of the boat in the water to the same side, m/s
    hull: np.ndarray
    turning: np.ndarray  # (n_fine,), whether the boat turns faster than half of the time

    def unevenness(self, axis: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Rms while turning over rms elsewhere, of draws (n_draws,) from the posterior and of random histories (n,)."""
        n = len(self.times)
        random = rng.standard_normal((_PRIOR_DRAWS, n)) @ self.factors[axis].T
        share = self.turning.reshape(n - 1, -1).mean(axis=1)  # of each interval
        return tuple(
            np.sqrt((squares(lines) @ share / share.sum()) / (squares(lines) @ (1.0 - share) / (1.0 - share).sum()))
            for lines in (self.draws[:, axis], random)
        )


def squares(lines: np.ndarray) -> np.ndarray:
    """(.., n_knots - 1) mean squares of lines between values (.., n_knots)."""
    first, second = lines[..., :-1], lines[..., 1:]
    return (first**2 + first * second + second**2) / 3.0


def rms(lines: np.ndarray) -> np.ndarray:
    """(..) root mean squares over time of broken lines (.., n_knots)."""
    return np.sqrt(squares(lines).mean(axis=-1))


def inferred_forces(problem: AnyProblem, draws: np.ndarray) -> Iterator[InferredForces]:
    """The histories of each trial that has them, of draws (n_draws, n_params) from a posterior."""
    draws = _spread(draws, _DRAWS)
    for name, trial, values in problem.each_trial(draws):
        for history in trial.histories:
            knots, mean = history.disturbances.knots, values.mean(axis=0)[None]
            motion = trial.forward.trajectory(*trial.arguments(mean)).resampled(knots.fine_times)
            members = [DISTURBED.index(axis) for axis in knots.axes]
            turn = np.linalg.norm(motion.states[0][:, positions("p", "q", "r")], axis=1)
            true = trial.record.forces
            yield InferredForces(
                trial=name,
                times=knots.times,
                axes=knots.axes,
                draws=trial.forces(values),
                factors=history.disturbances.factor(mean[:, history.process]),
                truth=None if true is None else knots.projected(true).T,
                fine_times=knots.fine_times,
                hull=np.hstack([hull_forces(motion), _velocity(motion.states[0])])[:, members].T,
                turning=turn > np.median(turn),
            )


def _velocity(states) -> np.ndarray:
    """(n, 2) velocities to the north and to the east of states (n, 12), m/s."""
    attitude, velocity = states[:, positions(*ANGLES)], states[:, positions("u", "v", "w")]
    parts = np.stack([seen(name, attitude) for name in "uvw"], axis=-1)  # the rotation matrix, of which these are rows
    return np.einsum("nik,nk->ni", parts, velocity)


def _spread(draws, n) -> np.ndarray:
    """At most n of the draws, evenly from the whole of the chain."""
    return draws[np.linspace(0, len(draws) - 1, min(n, len(draws))).astype(int)]


def numbers(problem: AnyProblem, draws: np.ndarray, forces: list[InferredForces]) -> dict:
    """Everything that a report says of unmodelled forces, as JSON types; empty for a problem without any.

    `draws` (n_draws, n_params): from its posterior; `forces`: of each trial.
    """
    if not forces:
        return {}
    (first, *_) = problem.histories
    unknown = first.disturbances.unknown
    scales = dict(zip(unknown.axes, force_scales(problem.vehicle, unknown.axes).tolist(), strict=True))
    all_scores = scores(problem, _spread(draws, _SCORED))
    times = {
        name.replace("_disturbance", ""): _of_process(problem, draws, name, time, 1.0)
        for name, time in unknown.times.items()
    }
    sds = {a: _of_process(problem, draws, f"sd_disturbance_{a}", unknown.sds[a], scales[a]) for a in unknown.axes}
    return {
        "kind": unknown.kind,
        "knot_interval_s": first.disturbances.knots.interval,
        **times,
        "sds": [{"axis": a, f"sd_{_suffix(a)}": sds[a]} for a in unknown.axes],
        "trials": [{"name": one.trial, "axes": _axes(one)} for one in forces],
        "regressors_tried": len(all_scores.candidates),
        "false_alarms": FALSE_ALARMS,
        "followed": [_followed(problem, one) for one in find_followed(all_scores)],
        "p_value": all_scores.p_value(),
    }


def _suffix(axis) -> str:
    return unit(axis).replace(" ", "").replace("m/s", "mps").lower()


def _quantiles(values) -> dict[str, float]:
    return dict(zip(_QUANTILES, np.quantile(values, list(_QUANTILES.values())).tolist(), strict=True))


def _of_process(problem, draws, name, given, scale) -> dict:
    """Quantiles of the posterior of a number of the process and of its prior, or its value if it is known."""
    if not isinstance(given, Prior):
        return {"value": scale * given}
    prior = {f"prior_{key}": scale * float(given.quantiles(p)[0]) for key, p in _QUANTILES.items()}
    return _quantiles(scale * draws[:, problem.names.index(name)]) | prior


def _axes(forces: InferredForces) -> list[dict]:
    rng, rows = np.random.default_rng(0), []
    of_hull = np.sqrt(np.mean(forces.hull**2, axis=1))
    prior = np.mean(np.sum(forces.factors**2, axis=2), axis=1)
    contractions = np.sqrt(np.mean(forces.draws.var(axis=0), axis=1) / prior)  # one if readings say nothing of them
    columns = zip(forces.axes, of_hull.tolist(), contractions.tolist(), strict=True)
    for k, (axis, hull, contraction) in enumerate(columns):
        sizes, suffix = rms(forces.draws[:, k]), _suffix(axis)
        row: dict = {"axis": axis, f"rms_{suffix}": _quantiles(sizes)}
        row[f"{'boat' if axis in CURRENTS else 'hull'}_rms_{suffix}"] = hull
        row["share"] = _quantiles(sizes / hull) if hull > 0.0 and axis in AXES else None
        row["posterior_over_prior_sd"] = contraction
        row["turning_over_elsewhere"], row["largest"] = None, None
        if 0 < np.count_nonzero(forces.turning) < len(forces.turning):
            own, random = forces.unevenness(k, rng)
            row["turning_over_elsewhere"] = _quantiles(own)
            row["largest"] = _place(row["turning_over_elsewhere"], np.quantile(random, [1.0 - _LARGER, _LARGER]))
        if forces.truth is not None:
            row[f"true_rms_{suffix}"] = float(rms(forces.truth[k]))
        rows.append(row)
    return rows


def _place(ratio, chance) -> str | None:
    """Where a history is largest, if the posterior knows and random histories rarely are so uneven."""
    if ratio["q5"] > 1.0 and ratio["median"] > chance[1]:
        return "in the turns"
    return "out of the turns" if ratio["q95"] < 1.0 and ratio["median"] < chance[0] else None


def _followed(problem, one: FollowedRegressor) -> dict:
    first = one.candidates[0]
    terms = []
    for candidate, factor, sd in zip(one.candidates, one.factors, one.sds, strict=True):
        entry: dict = {"regressor": candidate.regressor, "name": None}
        if candidate.term is not None:
            name, k = candidate.term.name, problem.equations.index[candidate.term.name]
            free = name in problem.names
            entry |= {"name": name, "free": free, "change": factor, "change_sd": sd, "unit": candidate.term.unit}
            entry |= {} if free else {"held_at": float(problem.xi[k])}
        terms.append(entry)
    return {"axis": first.axis, "terms": terms, f"rms_{_suffix(first.axis)}": one.rms, "p_value": one.p_value}


def sentences(numbers: dict) -> dict[str, str]:
    """The sentences of :func:`numbers`, by topic; without numbers there is none."""
    if not numbers:
        return {}
    terms = " ".join(_followed_sentence(one) for one in numbers["followed"])
    if numbers["regressors_tried"] and not terms:
        terms = f"No history follows a regressor of the equations ({numbers['regressors_tried']} tried, "
        terms += f"{100 * numbers['false_alarms']:g} % false alarms in all)."
    values = {"numbers": numbers, "motions": MOTIONS, "unseen": UNSEEN, "unit": unit, "suffix": _suffix}
    text = templates.fill("bayesub.findings", "disturbance.txt", **values)
    return {"disturbance": " ".join(text.split()), "missing_terms": terms}


def _followed_sentence(one) -> str:
    axis, (first, *others) = one["axis"], one["terms"]
    motion = MOTIONS[axis]
    regressors = ", ".join(term["regressor"] for term in others)
    alike = f" (or {regressors}, which this motion cannot distinguish)" if others else ""
    size = f"{one[f'rms_{_suffix(axis)}']:.2g} {unit(axis)} rms"
    text = f"{motion[0].upper()}{motion[1:]} follows {first['regressor']}{alike}, p = {one['p_value']:.1g}: "
    if first["name"] is None:
        return f"{text}the equations have no such term on {axis}; it would be {size}."
    unit_text = f" {first['unit']}" if first["unit"] else ""
    text += f"as if {first['name']} were off by {first['change']:.2g} ± {first['change_sd']:.1g}{unit_text} ({size}). "
    if first["free"]:
        return f"{text}{first['name']} is free, so that its prior is too narrow or a term like it is wrong."
    share = f", {abs(100 * first['change'] / first['held_at']):.2g} % of it" if first["held_at"] else ""
    return f"{text}It is held at {first['held_at']:.3g}{share}: a missing or wrongly held term."
