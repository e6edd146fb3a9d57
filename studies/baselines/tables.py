"""Tables of the deterministic methods beside the thesis's, from the numbers of :mod:`thesis.optimisers`."""

from collections.abc import Iterator
from itertools import combinations
from operator import itemgetter

import numpy as np

from baselines.smoothing import NOISE, SHARE
from bayesub.report.markdown import columns, named
from thesis.cases import VEHICLES, published
from thesis.counterparts import comparison
from thesis.optimisers import LOST, mean_with_error, shares_further

N_LINKS = 4
_METHODS = ("smoothing", "best fit")
_KINDS = {
    "trust_region": "trust region",
    "trust_region_bounded": "trust region, bounds 75 %",
    "sqp_exact": "SQP, exact gradients to the end",
    "sqp_forward": "SQP, forward differences to the end",
}


def page(cases: dict) -> Iterator[str]:
    """Markdown, with the thesis's figure and the ratio of ours to it where it has one."""
    yield "SQP (thesis Tables 10-27; means over the starts; `ours / thesis = ratio`). Further than they began: of the"
    yield "coefficients by their medians over the starts, and of those of a search, mean with its 95 % interval.\n"
    yield from sqp_table(cases)
    yield "\nCoefficients whose errors go together from search to search, as section 7.6.2 found of some of Z:"
    yield f"the {N_LINKS} strongest correlations on an axis other than X, and those of Zuw. Zuu is zero in all boats.\n"
    yield from columns(named(cases), {"case": itemgetter("name"), "strongest": strongest, "of Zuw": of_zuw})
    yield "\nOther searches: starts that find every coefficient to 1e-6; smallest error, smallest cost.\n"
    yield from columns(
        named(cases),
        {"case": itemgetter("name")} | {word: lambda case, k=kind: _ends(case, k) for kind, word in _KINDS.items()},
    )
    yield "\nLinear fits without noise (thesis Tables 34-39, Figures 89-96).\n"
    yield from linear_table(cases)
    yield "\nNoise: coefficients lost (standard error above 10 %).\n"
    yield from noise_table(cases)
    yield "\nRegression on smoothed motion (extended Kalman smoother; the noise of the process is a share of"
    yield f"{SHARE:g} of the hull's forces), and the best fit with the prior of the guess, of the same tracks with"
    yield f"noise of {100 * NOISE:g} cm and {NOISE:g} degrees: coefficients that end further from the truth than the"
    yield f"guess, that are off by more than {LOST:.0%}, and 90 % intervals that hold the truth.\n"
    yield from smoothing_table(cases)


def _ends(case, kind) -> str:
    search = case["searches"][kind]
    errors, costs = np.array(search["largest_error"]), np.array(search["costs"])
    return f"{np.sum(errors < 1e-6)} of {len(costs)}; {errors.min():.0e}, {costs.min():.0e}"


def strongest(case: dict) -> str:
    """The pairs of one axis, but for drag, whose errors are most correlated over the searches."""
    return _pairs(case, lambda first, second: first[0] == second[0] != "X", N_LINKS)


def of_zuw(case: dict) -> str:
    """The coefficients of heave whose errors are most correlated with that of Zuw."""
    return _pairs(case, lambda first, second: "Zuw" in (first, second) and first[0] == second[0], 3)


def _pairs(case, counts, most) -> str:
    names, links = case["names"], np.corrcoef(np.array(case["sqp"]["ratios"]).T)
    pairs = [(a, b) for a, b in combinations(range(len(names)), 2) if counts(names[a], names[b])]
    ordered = sorted(pairs, key=lambda pair: -abs(links[pair]))[:most]
    return ", ".join(f"{names[a]} with {names[b]} {links[a, b]:.2f}" for a, b in ordered)


def sqp_table(cases: dict) -> list[str]:
    """Tables 10 to 27."""
    tables = published()["sqp"]

    def theirs(case, key):
        vehicle, manoeuvre = case["name"].split()
        return tables[manoeuvre].get(key, [None] * len(VEHICLES))[VEHICLES.index(vehicle)]

    def mean(key, title, factor=1.0):
        return lambda case: comparison(factor * np.mean(case["sqp"][key]), theirs(case, title))

    def per_coefficient(case):
        ours = np.mean(case["sqp"]["efforts"]) / len(case["names"])
        return comparison(ours, theirs(case, "mean_cost_evaluations") / theirs(case, "m"))

    def further(case):
        of_a_search, error = mean_with_error(shares_further(case["sqp"]))
        return f"{case['sqp']['share_further']:.0%}; {of_a_search:.0%} ± {error:.0%}"

    def drag(case):
        error = case["sqp"]["Xuu_error"]
        return "not free" if error is None else f"{error:.1e}"

    return columns(
        named(cases),
        {
            "case": itemgetter("name"),
            "m": lambda case: comparison(len(case["names"]), theirs(case, "m")),
            "initial cost": lambda case: f"{np.mean(case['sqp']['initial_costs']):.2e}",
            "converged cost": mean("costs", "mean_converged_cost"),
            "largest position error (mm)": mean("position_m", "mean_max_position_error_mm", 1e3),
            "evaluations": mean("efforts", "mean_cost_evaluations"),
            "per m": per_coefficient,
            "seconds a start": mean("seconds", "mean_seconds"),
            "coefficients further than they began": further,
            "error of Xuu": drag,
        },
    )


def linear_table(cases: dict) -> list[str]:
    """Tables 34 to 39."""

    def error(method):
        def cell(case):
            pairs = list(zip(case["names"], case["errors"][method], strict=True))
            lost = dict.fromkeys(name[0] for name, value in pairs if value is None)
            values = [value for _, value in pairs if value is not None]
            worst = f"{max(values):.0e}" if values else "none"
            return worst + (f"; no solution for {', '.join(lost)}" if lost else "")

        return cell

    def seconds(method):
        def cell(case):
            by_axis = case["linear"]["seconds"][method].values()
            return f"{max(by_axis):.2g}, {sum(by_axis):.2g}"

        return cell

    return columns(
        named(cases),
        {
            "case": itemgetter("name"),
            "LP: largest relative error": error("LP"),
            "LLS: largest relative error": error("LLS"),
            "LP: seconds an axis at most, all axes": seconds("LP"),
            "LLS: seconds": seconds("LLS"),
        },
    )


def noise_table(cases: dict) -> list[str]:
    """How much noise of the track, and of velocities, each coefficient survives."""

    def lost(key, level):
        def cell(case):
            levels = np.array(list(case["lost_at"][key].values()))
            return f"{np.sum(levels < level)} of {len(levels)}"

        return cell

    def quantiles(key, unit):
        def cell(case):
            levels = case["lost_at"][key]
            first, values = min(levels, key=levels.get), np.array(list(levels.values()))
            everything = f", {values.max():.2g} m" if key == "track_m" else ""
            return f"{1e3 * values.min():.2g} {unit} ({first}), {1e3 * np.median(values):.2g} {unit}{everything}"

        return cell

    return columns(
        named(cases),
        {
            "case": itemgetter("name"),
            "lost at 1 mm and 0.001 deg": lost("track_m", 1e-3),
            "errors above 10 % in one such fit": lambda c: np.sum(np.array(c["noisy_track"]["errors"]) > LOST),
            "lost first, half, all": quantiles("track_m", "mm"),
            "lost at 1 cm/s by linear least squares": lost("velocity_mps", 1e-2),
            "lost first, half": quantiles("velocity_mps", "mm/s"),
        },
    )


def smoothing_table(cases: dict) -> list[str]:
    """Shares of the coefficients by regression on smoothed motion, and by the best fit, means over the records."""
    words = {"further": "further than the guess", "off": "off by more than 10 %", "held": "90 % intervals that hold"}

    def mean(method, key):
        return lambda case: f"{np.mean(case['smoothed'][method][key]):.0%}"

    titles = {f"{method}: {word}": mean(method, key) for method in _METHODS for key, word in words.items()}
    return columns(named(cases), {"case": itemgetter("name")} | titles)
