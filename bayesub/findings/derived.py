"""Quantities that follow from the coefficients, of boats drawn from the prior and from the posterior, side by side."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bayesub.findings.set_up import AnyProblem
from bayesub.io.words import listed, rounded, with_unit
from bayesub.model.boats import Boats
from bayesub.model.linear_motion import PLANES, roots
from bayesub.model.quantities import QUANTITIES, Quantity, absence
from bayesub.model.standard_manoeuvres import RUDDER, spiral_curve
from bayesub.problem.distributions import Prior

N_DRAWS = 400  # from the prior, and from the posterior
QUANTILES = {"q5": 0.05, "q25": 0.25, "median": 0.5, "q75": 0.75, "q95": 0.95}
SAME = 1e-9  # of its size, the spread of a quantity that does not follow from what is inferred
HELD, CONFINED = "it depends on no inferred parameter", "the trials were confined to the other plane"
HEADLINES = ("tactical_diameter_m", "zigzag_overshoot_deg", "dive_depth_m")
STABILITIES = {"straight_line_stability": "on a straight course", "vertical_stability": "in the vertical plane"}


@dataclass(frozen=True)
class Derived:
    """Boats of a prior and of a posterior, and what is measured of them."""

    reference: Boats  # the boat that ratios of coefficients refer to
    prior: Boats  # draws
    posterior: Boats  # draws
    quantities: tuple[Quantity, ...]  # the built-in ones, and after them those of a study
    planes: dict[str, str]  # plane, or "" of quantities without one -> why nothing is measured there, or an empty text

    @cached_property
    def absent(self) -> dict[str, str]:
        """Quantity that the boat does not have -> why."""
        reasons = {q.name: q.reason(self.reference.vehicle) or self.planes[q.subproblem] for q in self.quantities}
        return {name: reason for name, reason in reasons.items() if reason}

    @cached_property
    def values(self) -> dict[str, dict[str, np.ndarray]]:
        """Quantity -> values (n,) of the reference, the prior and the posterior, of those that are not absent."""
        present = [quantity for quantity in self.quantities if quantity.name not in self.absent]
        return {quantity.name: {name: quantity.of(boats) for name, boats in self._boats} for quantity in present}

    @cached_property
    def spiral(self) -> tuple[np.ndarray, dict[str, np.ndarray]] | None:
        """Rates of turn (m,), rad/s, and the rudder (n, m), rad, of reference, prior and posterior; None without."""
        if self.planes["horizontal"] or absence(self.reference.vehicle, RUDDER):
            return None
        curves = {name: boats.once(spiral_curve) for name, boats in self._boats}
        return curves["posterior"][0], {name: rudder for name, (_, rudder) in curves.items()}

    @cached_property
    def roots(self) -> dict[str, dict[str, np.ndarray]]:
        """Plane -> roots (n, k), 1/s, of reference, prior and posterior, where anything that is inferred has a part."""
        return {
            plane: {name: boats.once(roots, plane) for name, boats in self._boats}
            for plane in PLANES
            if plane in self.planes and not self.planes[plane]
        }

    @property
    def _boats(self) -> Iterator[tuple[str, Boats]]:
        return zip(("reference", "prior", "posterior"), (self.reference, self.prior, self.posterior), strict=True)


def derive(
    problem: AnyProblem,
    draws: np.ndarray,
    rng: np.random.Generator,
    quantities: Sequence[Quantity] = (),
    known: Prior | None = None,
) -> Derived:
    """The boats of a problem's prior and of its posterior, from which quantities follow.

    Of several trials the boat is the same. What is inferred of its body and of its actuators counts, but for lags,
    which are those of its file; an order is what a log would have. Sensors, water and starts are left out.

    `draws` (n, n_params): from the posterior; `rng`: of the draws from the prior, and of the choice among those of the
    posterior; `quantities`: besides the built-in ones; `known`: the prior as it was known before.
    """
    flown = {trial.simulator.subproblem for _, trial, _ in problem.each_trial(draws[:1])}
    chosen = draws[rng.choice(len(draws), N_DRAWS)]
    samples = problem.reference[None], (known or problem.prior).sample(rng, N_DRAWS), chosen
    reference, prior, posterior = (_boats(problem, some, in_six=None in flown) for some in samples)
    names = set(problem.names[: problem.n_coefficients])
    if prior.body_changes is not None:
        changes = zip(prior.vehicle.rigid_body, prior.body_changes.T, strict=True)
        names |= {key for key, change in changes if change.any()}
    planes = {"": ""}
    for plane in prior.vehicle.equations.subproblems:
        confined = "" if flown & {None, plane} else CONFINED
        planes[plane] = confined or ("" if names - prior.vehicle.idle(plane) or prior.varied(plane) else HELD)
    return Derived(reference, prior, posterior, (*QUANTITIES.values(), *quantities), planes)


def _boats(problem, parameters, *, in_six) -> Boats:
    """The boats of parameters (n, n_params)."""
    _, trial, values = next(iter(problem.each_trial(parameters)))
    xi, nuisances = trial.arguments(values)
    vehicle, unknown = trial.forward.vehicle, trial.forward.nuisances
    body, amounts = unknown.body(nuisances), unknown.amounts(nuisances)
    changes = None if body is None else body - vehicle.restricted(trial.simulator.subproblem).body
    kinds = vehicle.actuators.parameters
    of_actuators = {} if amounts is None else dict(zip(unknown.varied, amounts.T, strict=True))
    of_actuators = {name: amount for name, amount in of_actuators.items() if kinds[name][1] != "lag"}
    return Boats(vehicle, xi, changes, in_six, of_actuators)


def numbers(derived: Derived) -> dict:
    """Everything that a report says of derived quantities, as JSON types."""
    rows, same = [], {}
    for quantity in derived.quantities:
        if quantity.name in derived.absent:
            continue
        values = derived.values[quantity.name]
        intervals = {name: _interval(values[name]) for name in ("prior", "posterior")}
        before, after = intervals["prior"], intervals["posterior"]
        width = None if before["q5"] is None else before["q95"] - before["q5"] or None  # none if it has no spread
        spreads = [np.ptp(some[np.isfinite(some)]) for some in values.values() if np.isfinite(some).any()]
        (reference,) = values["reference"].tolist()
        if spreads and max(spreads) <= SAME * abs(reference) and intervals["posterior"]["share"] == 1.0:
            same[quantity.name] = f"{HELD}: {reference:.4g}"
            continue
        rows.append(
            {
                **{key: getattr(quantity, key) for key in ("name", "unit", "meaning", "none")},
                "label": label(quantity),
                "reference": reference if np.isfinite(reference) else None,
                **intervals,
                "width_ratio": None if width is None or after["q5"] is None else (after["q95"] - after["q5"]) / width,
            }
        )
    reasons, labels = derived.absent | same, {quantity.name: label(quantity) for quantity in derived.quantities}
    absent = [{"name": name, "label": labels[name], "reason": reason} for name, reason in reasons.items()]
    found = {"n_draws": len(derived.posterior), "quantities": rows, "absent": absent}
    found["stable"] = {
        name: {which: float(np.mean(derived.values[name][which] < 0.0)) for which in ("prior", "posterior")}
        for name in STABILITIES
        if name in derived.values
    }
    if derived.spiral is not None:
        rates, rudder = derived.spiral
        found["spiral"] = {"rate_degps": significant(np.degrees(rates))} | {
            name: {key: significant(_quantile(np.degrees(some), q)) for key, q in QUANTILES.items() if key in _BAND}
            for name, some in rudder.items()
            if name != "reference"
        }
    return found


_BAND = ("q5", "median", "q95")
_ALL = 0.995  # share of the boats that have a quantity, from which the others are not spoken of


def label(quantity: Quantity) -> str:
    """The name of a quantity in words, with its unit."""
    words = with_unit(quantity.name)
    return words if not quantity.unit or "(" in words else f"{words} ({quantity.unit})"


def _interval(values) -> dict:
    """Quantiles of the values (n,) that exist, None without any, and the share of those that do."""
    finite = values[np.isfinite(values)]
    quantiles = np.quantile(finite, list(QUANTILES.values())).tolist() if finite.size else [None] * len(QUANTILES)
    return dict(zip(QUANTILES, quantiles, strict=True)) | {"share": finite.size / len(values)}


def _quantile(values, probability) -> np.ndarray:
    """(m,) quantiles of the finite among values (n, m); not a number of columns without any."""
    quantiles = np.full(values.shape[1], np.nan)
    whole = np.isfinite(values).any(axis=0)
    quantiles[whole] = np.nanquantile(values[:, whole], probability, axis=0)
    return quantiles


def significant(values: Any, digits: int = 5) -> Any:
    """Values (..) as nested lists of numbers of so many significant digits; None for what is not finite."""
    if np.ndim(values):
        return [significant(value, digits) for value in values]
    return float(f"{values:.{digits}g}") if np.isfinite(values) else None


def in_words(low: float, high: float) -> tuple[str, str]:
    """The ends of an interval, to two digits of its width."""
    return rounded(low, high - low), rounded(high, high - low)


def headlines(found: dict) -> Iterator[dict]:
    """Rows ``name, label, unit, posterior, prior`` (5 and 95 % as words), ``of`` (whom), of headline quantities."""
    rows = {row["name"]: row for row in found["quantities"] if row["width_ratio"] is not None}
    for row in (rows[name] for name in HEADLINES if name in rows):
        ends = {which: in_words(row[which]["q5"], row[which]["q95"]) for which in ("posterior", "prior")}
        of = {which: share for which in ("posterior", "prior") if (share := row[which]["share"]) < _ALL}
        words = listed([f"{100 * share:.2g} % of the {which}" for which, share in of.items()])
        of_which = f"of {words}, which {'have' if len(of) > 1 else 'has'} one" if of else ""
        named = {"name": row["name"], "label": row["label"].partition(" (")[0], "unit": row["unit"]}
        yield named | ends | {"of": of_which}


def sentence(found: dict) -> str:
    """The headline manoeuvring quantities in words; empty if the inferred parameters determine none."""
    parts = [
        f"{row['label']} {' to '.join(row['posterior'])} {row['unit']} (before {' to '.join(row['prior'])})"
        f"{f' {of}' if (of := row['of']) else ''}"
        for row in headlines(found)
    ]
    text = f"With 90 % probability: {'; '.join(parts)}." if parts else ""
    stable = []
    for name in (row["name"] for row in found["quantities"] if row["name"] in STABILITIES):
        after, before = (100.0 * found["stable"][name][which] for which in ("posterior", "prior"))
        stable.append(f"{STABILITIES[name]} with probability {after:.3g} % (before {before:.3g} %)")
    return f"{text} Stable {listed(stable)}.".strip() if stable else text
