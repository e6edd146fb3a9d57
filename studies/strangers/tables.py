"""Numbers of many boats together, as table, and what they must be."""

from collections.abc import Iterator

import numpy as np

from bayesub.report.markdown import columns, named

LEVEL = "90%"
WANTED = (0.85, 0.95)
ENOUGH = 100  # coefficient trials of which a share is judged
PATH_PERCENT = 1.0


def summary(boats: list[dict], title: str, equations: str, removed: tuple[str, ...]) -> dict:
    """Shares and errors of a row, as JSON types; the error of a share is that of the mean over boats."""
    shares = {level: [float(np.mean(boat["held"][level])) for boat in boats] for level in boats[0]["held"]}
    paths = {key: [boat[key] for boat in boats] for key in ("path_percent", "guess_path_percent")}
    searched = [boat["followed"] for boat in boats if "followed" in boat]
    trials: dict[str, list[bool]] = {}
    for boat in boats:
        for name, held in zip(boat["names"], boat["held"][LEVEL], strict=True):
            trials.setdefault(name, []).append(held)
    return {
        "title": title,
        "equations": equations,
        "removed": list(removed),
        "n_boats": len(boats),
        "n_coefficients": len(boats[0]["names"]),
        "n_trials": sum(len(boat["names"]) for boat in boats),
        "n_readings": boats[0]["n_readings"],
        "step_s": [min(boat["step_s"] for boat in boats), max(boat["step_s"] for boat in boats)],
        "coverage": {level: float(np.mean(np.concatenate([b["held"][level] for b in boats]))) for level in shares},
        "coverage_error": float(np.std(shares[LEVEL], ddof=1) / np.sqrt(len(boats))) if len(boats) > 1 else None,
        "coverage_by_coefficient": {name: float(np.mean(held)) for name, held in trials.items()},
        "sd": float(np.median(np.concatenate([boat["sd"] for boat in boats]))),
        "called_wrong": sum(not boat["fits"] for boat in boats),
        "chi_square": float(np.median([boat["chi_square"] for boat in boats])),
        "size": float(np.median([boat["size"] for boat in boats])) if removed else None,
        "n_searched": len(searched),
        "n_named": sum(any(set(names) & set(removed) for names in found) for found in searched),
        "n_named_any": sum(bool(found) for found in searched),
        "first_named": [found[0] if found else [] for found in searched],
        "path_percent": quartiles(paths["path_percent"]),
        "guess_path_percent": quartiles(paths["guess_path_percent"]),
        "paths_percent": paths["path_percent"],
        "not_completed": sum(value is None for value in paths["path_percent"]),
        "n_not_converged": sum(not boat["converged"] for boat in boats),
        "boats_drawn_again": sum(boat["boats_drawn_again"] for boat in boats),
        "seconds": float(sum(boat["seconds"] for boat in boats)),
    }


def quartiles(values: list[float | None]) -> dict[str, float | None]:
    """Median and largest; a run that was not completed counts as far off."""
    ordered = sorted(np.inf if value is None else value for value in values)
    numbers = {"median": float(np.median(ordered)), "largest": float(ordered[-1])}
    return {key: value if np.isfinite(value) else None for key, value in numbers.items()}


def page(rows: dict[str, dict]) -> Iterator[str]:
    """A row for each simulator, with the terms of its equations and without some of them."""
    yield "Boats whose parameters have an sd of a fifth about the published ones; the prior is as wide. Share of"
    yield "coefficients in their 50 and 90 % intervals, with the standard error over boats; median posterior sd over"
    yield "prior sd; boats of which the model check says that the equations do not fit, and the median of their largest"
    yield "chi-square per reading of a channel, at the posterior mean; boats whose unmodelled forces name a missing"
    yield "term (where none is missing, any); largest distance from the true track of a run that was not fitted, % of its"  # noqa: E501
    yield "path, median (largest), of the posterior mean and of the guess. Without terms the posterior is the normal"
    yield "approximation about its mode.\n"
    cells = {
        "simulator": lambda r: r["title"],
        "terms": lambda r: f"{r['equations']}" + (f" without {', '.join(r['removed'])}" if r["removed"] else ""),
        "boats": lambda r: str(r["n_boats"]),
        "coefficients": lambda r: f"{r['n_trials']}",
        "50 %": lambda r: f"{r['coverage']['50%']:.0%}",
        "90 %": lambda r: f"{r['coverage'][LEVEL]:.1%} ± {r['coverage_error'] or 0.0:.1%}",
        "sd": lambda r: f"{r['sd']:.2f}",
        "called wrong": lambda r: f"{r['called_wrong']} of {r['n_boats']}",
        "chi-square": lambda r: f"{r['chi_square']:.3g}",
        "term named": lambda r: f"{r['n_named' if r['removed'] else 'n_named_any']} of {r['n_searched']}",
        "path error": lambda r: spread(r["path_percent"]),
        "of the guess": lambda r: spread(r["guess_path_percent"]),
        "not converged": lambda r: str(r["n_not_converged"]),
        "drawn again": lambda r: str(r["boats_drawn_again"]),
    }
    yield from columns(named(rows), cells)
    yield "\nWhere terms are left out, they move the readings by so many sds of their noise (root mean square, all else"
    yield "the same), and unmodelled forces follow these terms first, boat by boat:\n"
    for row in rows.values():
        if row["removed"]:
            firsts = "; ".join(" = ".join(names) or "none" for names in row["first_named"])
            yield f"- {row['title']}, without {', '.join(row['removed'])}: {row['size']:.3g} sds. {firsts}."


def spread(errors: dict[str, float | None]) -> str:
    """Median and largest in a cell."""
    return "{} ({})".format(*("–" if errors[key] is None else f"{errors[key]:.2g}" for key in ("median", "largest")))


def claims(rows: dict[str, dict]) -> Iterator[tuple[bool, str]]:
    """Honest intervals and close predictions where the equations agree; where they do not, the check says so."""
    for name, row in rows.items():
        if not row["removed"]:
            share, path = row["coverage"][LEVEL], row["path_percent"]["median"]
            if row["n_trials"] >= ENOUGH:
                yield WANTED[0] <= share <= WANTED[1], f"{name}: 90 % intervals hold {share:.1%} of the coefficients"
            yield path is not None and path <= PATH_PERCENT, f"{name}: an unseen run is missed by {path} % of its path"
        elif row["removed"] and row["chi_square"] > LARGE:
            yield row["called_wrong"] == row["n_boats"], f"{name}: {row['called_wrong']} boats are called wrong"


LARGE = 1.5  # chi-square per reading of the worst channel, from which a difference exceeds the noise
