"""The report of a run: numbers, figures, and one self-contained page that says in words what they show."""

import base64
import json
from pathlib import Path

import jinja2
import numpy as np

from bayesub import coefficients, identifiability
from bayesub.errors import InputError
from bayesub.inputs import DATA
from bayesub.plots import coefficients as coefficient_plot
from bayesub.plots import posterior as posterior_plots
from bayesub.plots import spectrum as spectrum_plot
from bayesub.plots import track as track_plot
from bayesub.problem import Problem, linear_systems
from bayesub.sampling import Posterior

KNOWN = 0.05  # posterior sd relative to the posterior mean
UNTOUCHED = 0.9  # posterior sd relative to the prior sd
STRONG = 0.9  # correlation
PREDICTIVE_DRAWS = 100


def write_report(folder, problem: Problem, estimates, spectrum, posterior: Posterior, *, study=None, seconds=None) -> None:
    """Write ``numbers.json``, the figures (PNG and PDF) and ``report.html`` into `folder`.

    Parameters
    ----------
    estimates : list of :class:`bayesub.baselines.Estimate`
    spectrum : from :func:`bayesub.identifiability.fisher`
    study : the study that asked, for its name and question, or None
    seconds : stage -> wall time, for the table of costs, or None
    """
    folder = Path(folder)
    trajectory = problem.trajectory(posterior.best)
    ranks = identifiability.rank(linear_systems(trajectory, free=problem.names), prefer=coefficients.ADDED_MASSES)
    numbers = collect(problem, estimates, spectrum, posterior, ranks)
    numbers["name"] = study.name if study else problem.vehicle.name
    numbers["question"] = study.question if study else ""
    numbers["seconds"] = seconds or {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        figures = _draw(folder, problem, estimates, spectrum, posterior, numbers)
        (folder / "numbers.json").write_text(json.dumps(numbers, indent=1), encoding="utf-8")
        (folder / "report.html").write_text(_page(numbers, figures), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder}: report cannot be written: {(error.strerror or str(error)).lower()}") from None


def collect(problem, estimates, spectrum, posterior, ranks) -> dict:
    """Every figure that the report quotes, as JSON types."""
    truth, synthetic = reference(problem)
    q5, q50, q95 = posterior.quantiles([0.05, 0.5, 0.95])
    columns = {
        "name": posterior.names,
        "reference": truth,
        "prior_mean": posterior.prior_mean,
        "prior_sd": posterior.prior_sd,
        "mean": posterior.mean,
        "sd": posterior.sd,
        "q5": q5,
        "median": q50,
        "q95": q95,
        "contraction": posterior.contraction,
        "relative_sd": posterior.sd / np.abs(posterior.mean),
        "rhat": posterior.rhat,
        "bulk_ess": posterior.bulk_ess,
        "tail_ess": posterior.tail_ess,
        "tau_steps": posterior.tau.max(axis=0),
    }
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*map(_plain, columns.values()), strict=True)]
    n_null = sum(axis.columns - axis.rank for axis in ranks.values())
    numbers = {
        "vehicle": problem.vehicle.name,
        "manoeuvre": problem.manoeuvre.name,
        "reference_is_truth": synthetic,
        "n_readings": problem.record.n_readings,
        "step_s": problem.simulator.step,
        "convergence": {
            "converged": posterior.converged,
            "shortcomings": list(posterior.shortcomings),
            "criteria": vars(posterior.criteria),
            "max_rhat": float(posterior.rhat.max()),
            "min_bulk_ess": float(posterior.bulk_ess.min()),
            "min_tail_ess": float(posterior.tail_ess.min()),
            "max_tau_steps": float(posterior.tau.max()),
            "min_length_in_taus": float(posterior.n_steps / posterior.tau.max()),
            "n_ensembles": len(posterior.chain),
            "n_walkers": posterior.chain.shape[2],
            "n_warmup_steps": posterior.n_warmup,
            "n_kept_steps": posterior.n_steps,
            "acceptance": posterior.acceptance,
        },
        "cost": {
            "evaluations": posterior.evaluations,
            "sampling_seconds": posterior.seconds,
            "evaluations_per_second": posterior.evaluations / posterior.seconds,
            "evaluations_per_effective_sample": posterior.evaluations / float(posterior.bulk_ess.min()),
            "failed_simulations": posterior.failures,
        },
        "parameters": rows,
        "spectrum": {
            "singular_values": spectrum.singular_values.tolist(),
            "n_null": n_null,
            "n_sharpened": int(np.count_nonzero(spectrum.singular_values[: len(posterior.names) - n_null] > 1.0)),
        },
        "ranks": {
            axis: {
                "columns": r.columns,
                "rank": r.rank,
                "condition": r.condition,
                "singular_values": r.singular_values.tolist(),
                "threshold": r.threshold,
                "null_vectors": list(r.null_vectors),
                "pivots": list(r.pivots),
            }
            for axis, r in ranks.items()
        },
        "null_contraction": _null_contraction(spectrum, posterior, n_null).tolist(),
        "trade_offs": _trade_offs(posterior),
        "baselines": [_baseline(problem, estimate, truth) for estimate in estimates],
        "chi_square_per_reading": float(np.mean(problem.residuals(posterior.best[None]) ** 2)),
    }
    numbers["verdict"] = verdict(numbers)
    return numbers


def reference(problem) -> tuple[np.ndarray, bool]:
    """The values that ratios refer to (n_params,), and whether they are the truth behind a synthetic record."""
    truth = problem.record.truth
    return (problem.vehicle.xi if truth is None else truth)[problem.columns], truth is not None


def _null_contraction(spectrum, posterior, n_null):
    """Posterior sd over prior sd along each of the last `n_null` directions of the spectrum."""
    standardised = (posterior.draws - posterior.prior_mean) / posterior.prior_sd
    return np.std(standardised @ spectrum.directions[len(spectrum.names) - n_null :].T, axis=0)


def _trade_offs(posterior) -> list[dict]:
    """Pairs of coefficients by the size of their posterior correlation, strongest first."""
    rows, columns = np.triu_indices(len(posterior.names), 1)
    values = posterior.correlation[rows, columns]
    order = np.argsort(-np.abs(values))[:20]
    names = posterior.names
    return [{"pair": [names[rows[k]], names[columns[k]]], "correlation": float(values[k])} for k in order]


def _baseline(problem, estimate, truth) -> dict:
    place = [estimate.names.index(name) for name in problem.names]
    solutions = estimate.solutions[:, place]
    error = np.abs(solutions / truth - 1.0)
    start = np.abs(problem.prior.mean / truth - 1.0)
    return {
        "method": estimate.method,
        "costs": estimate.costs.tolist(),
        "statuses": sorted(set(estimate.statuses)),
        "n_starts": len(solutions),
        "evaluations": estimate.evaluations,
        "seconds": estimate.seconds,
        "further_than_guess": np.count_nonzero(error > start, axis=1).tolist(),
        "n_params": len(truth),
        "chi_square_per_reading": [float(np.mean(r**2)) for r in problem.residuals(solutions)],
        "ratios": (solutions / truth).tolist(),
    }


def verdict(numbers: dict) -> dict:
    """The report in sentences: what is known, what is not, what trades off, and what was done about it."""
    rows = {row["name"]: row for row in numbers["parameters"]}
    by_precision = sorted(rows.values(), key=lambda row: row["relative_sd"])
    known = [f"{row['name']} ({100 * row['relative_sd']:.2g} %)" for row in by_precision if row["relative_sd"] < KNOWN]
    sharper = [
        row["name"]
        for row in sorted(rows.values(), key=lambda row: row["contraction"])
        if row["relative_sd"] >= KNOWN and row["contraction"] < UNTOUCHED
    ]
    untouched = [row["name"] for row in rows.values() if row["contraction"] >= UNTOUCHED]
    pivots = [name for axis in numbers["ranks"].values() for name in axis["pivots"]]
    null = [
        f"{axis}: {_combination(vector)}" for axis, r in numbers["ranks"].items() for vector in r["null_vectors"]
    ]
    strong = [t for t in numbers["trade_offs"] if abs(t["correlation"]) >= STRONG]
    pairs = [f"{t['pair'][0]} with {t['pair'][1]} ({t['correlation']:+.2f})" for t in strong[:8]]
    n_sharpened, n = numbers["spectrum"]["n_sharpened"], len(rows)
    sentences = {
        "known": f"Known to better than {100 * KNOWN:.0f} %: {_listed(known)}." if known else
        f"No coefficient is known to better than {100 * KNOWN:.0f} %.",
        "sharper": f"Sharper than the prior, but not known: {_listed(sharper)}." if sharper else "",
        "untouched": f"Left where the prior put them (posterior sd at least {100 * UNTOUCHED:.0f} % of the prior's): "
        f"{_listed(untouched)}." if untouched else "Every coefficient is sharper than its prior.",
        "directions": f"Of {n} directions in coefficient space the data sharpen {n_sharpened}, leave "
        f"{n - n_sharpened - len(null)} to the prior, and {len(null)} cannot be told by any record of this manoeuvre.",
        "null": f"The motion is exactly the same along {_listed(null, '; ')}. Holding {_listed(pivots)} fixed makes the rest "
        "unique." if null else "No direction leaves the motion exactly the same.",
        "trade_offs": f"Strongest trade-offs: {_listed(pairs)}." if pairs else
        f"No pair of coefficients is correlated by more than {STRONG:g}.",
    }  # fmt: skip
    for baseline in numbers["baselines"]:
        if baseline["method"] == "SQP":
            worse = baseline["further_than_guess"]
            sentences["sqp"] = (
                f"SQP from {baseline['n_starts']} starts fits the track as well as the posterior does (chi-square per reading "
                f"{min(baseline['chi_square_per_reading']):.3f} to {max(baseline['chi_square_per_reading']):.3f}), while "
                f"{_range(worse)} of {n} coefficients end further from the {_word(numbers)} than the guess was."
            )
    return sentences


def _word(numbers) -> str:
    return "truth" if numbers["reference_is_truth"] else "vehicle file"


def _range(values) -> str:
    return f"{min(values)}" if min(values) == max(values) else f"{min(values)} to {max(values)}"


def _listed(items, separator=", ") -> str:
    return separator.join(items)


def _combination(vector: dict[str, float]) -> str:
    return " ".join(f"{value:+.2g} {name}" for name, value in vector.items())


def _draw(folder, problem, estimates, spectrum, posterior, numbers) -> list[dict]:
    truth, synthetic = reference(problem)
    word = "truth" if synthetic else "vehicle file"
    rng = np.random.default_rng(0)  # which draws are shown; nothing that is quoted depends on it
    draws = posterior.draws[rng.choice(len(posterior.draws), PREDICTIVE_DRAWS)]
    predicted = problem.trajectory(draws).states
    true_states = problem.trajectory(truth).states[0] if synthetic else None
    times = problem.simulator.times
    n_null = numbers["spectrum"]["n_null"]
    figures = [
        (
            "coefficients",
            lambda path: coefficient_plot.draw(path, posterior, truth, estimates, word),
            f"Coefficients as ratios to the {word}, one column each. Grey: prior. Blue: posterior. Orange: SQP solutions, all "
            "of which fit the track. Green: linear least squares on noise-free velocities and accelerations, at its guess "
            "along the null directions. A blue bar as long as the grey one means that the data said nothing.",
        ),
        (
            "track",
            lambda path: track_plot.draw(path, problem.record, times, predicted, true_states),
            f"The trial and {PREDICTIVE_DRAWS} draws from the posterior, too close to tell apart on the left. On the right the "
            "readings minus the posterior mean: pure noise if the model fits. The blue band, the posterior's own "
            "uncertainty of the track, is far thinner than the noise, whatever the coefficients do.",
        ),
        (
            "spectrum",
            lambda path: spectrum_plot.draw(path, spectrum, n_null),
            "Singular values of the Jacobian in prior standard deviations. Above one the data are sharper than the prior; the "
            "last group, below the gap, are the null directions of the equations of motion, and only the prior speaks there.",
        ),
        (
            "correlation",
            lambda path: posterior_plots.draw_correlation(path, posterior),
            "Posterior correlations. Dark off-diagonal cells are coefficients that trade off: the data know a combination of "
            "them better than each.",
        ),
        (
            "corner",
            lambda path: posterior_plots.draw_corner(path, posterior, truth, rng),
            f"Joint marginals (50 % and 90 %) of the best and the worst known coefficients, as ratios to the {word} (orange). "
            "Ticked labels are the best known; dashed lines are the prior.",
        ),
    ]
    drawn = []
    for name, draw, caption in figures:
        for suffix in (".pdf", ".png"):
            draw(folder / f"{name}{suffix}")
        drawn.append({"name": name, "caption": caption, "image": (folder / f"{name}.png").read_bytes()})
    return drawn


def _page(numbers, figures) -> str:
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string((DATA / "report.html").read_text(encoding="utf-8"))
    pictures = {
        f["name"]: {"caption": f["caption"], "data": base64.b64encode(f["image"]).decode("ascii")} for f in figures
    }
    return template.render(numbers=numbers, pictures=pictures, word=_word(numbers), combination=_combination)


def _plain(values) -> list:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


