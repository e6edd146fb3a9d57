"""The report of a run: numbers, figures, and one self-contained page that says in words what they show."""

import base64
import json
from importlib import resources
from pathlib import Path

import jinja2
import numpy as np

from bayesub import identifiability
from bayesub.checks.fit import criticise
from bayesub.io.atomic import write_text, writing
from bayesub.model import coefficients
from bayesub.model.linear_form import linear_systems, stacked
from bayesub.plots import coefficients as coefficient_plot
from bayesub.plots import cross_check as cross_check_plot
from bayesub.plots import fit as criticism_plot
from bayesub.plots import posterior as posterior_plots
from bayesub.plots import spectrum as spectrum_plot
from bayesub.plots import track as track_plot
from bayesub.problem.problem import Problem
from bayesub.report import findings, remedies
from bayesub.sampling import Posterior

PREDICTIVE_DRAWS = 100
FITS = 1.5  # chi-square per reading
ON_BASELINES = {
    "SQP": "Orange: SQP solutions{fit}. ",
    "linear least squares": "Green: linear least squares on noise-free velocities and accelerations, left at the guess "
    "along null directions. ",
}


def write_report(
    folder, problem: Problem, estimates, spectrum, posterior: Posterior, *, study=None, seconds=None, check=None
) -> None:
    """Write ``numbers.json``, the figures (PNG and PDF) and ``report.html`` into `folder`.

    Parameters
    ----------
    estimates : list of :class:`bayesub.baselines.Estimate`
    spectrum : from :func:`bayesub.identifiability.fisher`
    study : the study that asked, for its name and question, or None
    seconds : stage -> wall time, for the table of costs, or None
    check : from :func:`bayesub.cross_check`, or None
    """
    folder = Path(folder)
    fit = _criticised(problem, posterior)
    numbers = _numbers(problem, estimates, spectrum, posterior, fit[0])
    numbers["name"] = study.name if study else problem.vehicle.name
    numbers["question"] = study.question if study else ""
    numbers["seconds"] = seconds or {}
    if check is not None:
        numbers["cross_check"] = check.to_json()
        numbers["verdict"]["cross_check"] = check.sentence
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        figures = _draw(folder, problem, estimates, spectrum, posterior, fit, check, numbers)
        write_text(folder / "numbers.json", json.dumps(numbers, indent=1))
        write_text(folder / "report.html", _page(numbers, figures))


def _numbers(problem, estimates, spectrum, posterior, criticism) -> dict:
    free = problem.names[: problem.n_coefficients]
    flown = [p.trajectory(best) for _, p, best in problem.each_trial(posterior.best)]
    systems = stacked([linear_systems(trajectory, free=free) for trajectory in flown])
    ranks = identifiability.rank(systems, prefer=coefficients.ADDED_MASSES)
    numbers = findings.collect(problem, estimates, spectrum, posterior, ranks)
    numbers["criticism"] = criticism.to_json()
    numbers["verdict"] = {"fit": remedies.sentence(criticism, problem)} | numbers["verdict"]
    return numbers


def _criticised(problem, posterior):
    """The checks of the residuals at draws from the posterior, those residuals, and their times, by channel."""
    rng = np.random.default_rng(1)  # so that a report that is written again says the same
    draws = posterior.draws[rng.choice(len(posterior.draws), PREDICTIVE_DRAWS)]
    residuals = problem.quantile_residuals(draws, rng)
    times = {name: problem.channels[name][0].times for name in residuals}
    return criticise(residuals, times), residuals, times


def _draw(folder, problem, estimates, spectrum, posterior, fit, check, numbers) -> list[dict]:
    truth, synthetic = findings.reference(problem)
    word = "truth" if synthetic else "vehicle file"
    rng = np.random.default_rng(0)  # which draws are shown; nothing that is quoted depends on it
    draws = posterior.draws[rng.choice(len(posterior.draws), PREDICTIVE_DRAWS)]
    n = problem.n_coefficients
    n_null = numbers["spectrum"]["n_null"]
    figures = [
        (
            "coefficients",
            lambda path: coefficient_plot.draw(path, posterior, problem.prior, truth[:n], estimates, word),
            f"Coefficients as ratios to the {word}, one column each. Grey: prior. Blue: posterior. "
            + "".join(ON_BASELINES.get(b["method"], "").format(fit=_fit(b)) for b in numbers["baselines"])
            + "A blue bar as long as the grey one means that the data said nothing.",
        ),
        *[_track(*of_trial, synthetic) for of_trial in problem.each_trial(draws)],
        (
            "spectrum",
            lambda path: spectrum_plot.draw(path, spectrum),
            "Singular values of the Jacobian in prior standard deviations. Above one the data are sharper than the "
            "prior; the last group, below the gap, are the null directions of the equations of motion, where only the "
            "prior speaks.",
        ),
        (
            "correlation",
            lambda path: posterior_plots.draw_correlation(path, posterior),
            "Posterior correlations. Dark off-diagonal cells are coefficients that trade off: the data know a "
            "combination of them better than each.",
        ),
        (
            "corner",
            lambda path: posterior_plots.draw_corner(path, posterior, problem.prior, truth[:n]),
            "Joint marginals (50 % and 90 %) of the best known coefficients (blue labels) and the worst known "
            f"(yellow), as ratios to the {word} (orange lines). Dashed curves are the prior.",
        ),
    ]
    if fit[1]:
        figures.append(
            (
                "criticism",
                lambda path: criticism_plot.draw(path, *fit),
                "Quantile residuals at draws from the posterior, standard normal and independent if the model is "
                "right. Left, against time at one draw, diamonds where they are beyond the axis. Middle, correlation "
                "of readings so many intervals apart. Right, histogram of the probability of what is below each "
                "reading. Between the dashed lines are 99 % of what a right model makes, of each bar by itself. "
                "Orange: a channel that does not fit.",
            )
        )
    if n < problem.n_params:
        figures.append(
            (
                "nuisance",
                lambda path: posterior_plots.draw_nuisance(path, posterior, problem.prior, truth),
                "What else the readings depend on. Blue: posterior. Dashed: prior. Orange: the truth behind a "
                "synthetic record or the value of the vehicle, manoeuvre and noise model.",
            )
        )
    if check is not None:
        figures.append(
            (
                "cross_check",
                lambda path: cross_check_plot.draw(path, check),
                "Above, mean and sd of each coefficient by the two samplers. Below, the differences of means, sds and "
                "correlations in Monte Carlo standard errors of both; a correlation shows at both of its coefficients. "
                "The grey band holds all of them in 99 of 100 comparisons of equal posteriors.",
            )
        )
    drawn = []
    for name, draw, caption in figures:
        for suffix in (".png",):
            draw(folder / f"{name}{suffix}")
        drawn.append({"name": name, "caption": caption, "image": (folder / f"{name}.png").read_bytes()})
    return drawn


def _track(name, problem, draws, synthetic):
    """File, drawing and caption of the track of a trial of name "" or several."""
    predicted, tracks, truth = problem.predicted(draws), problem.motion(draws[:20]), problem.reference
    true_motion = (problem.predicted(truth)[0], problem.motion(truth)[0]) if synthetic else None
    return (
        f"track_{name}" if name else "track",
        lambda path: track_plot.draw(path, problem.record, predicted, tracks, true_motion),
        f"The trial {f'{name} ' if name else ''}and {PREDICTIVE_DRAWS} draws from the posterior, too close to tell "
        "apart on the left. On the right the readings minus the posterior mean: pure noise if the model fits. The "
        "blue band is the posterior's own uncertainty of the track, far thinner than the noise, whatever the "
        "coefficients do.",
    )


def _fit(baseline) -> str:
    """Whether all solutions of a baseline fit the readings, as the end of a phrase."""
    fits = baseline["chi_square_per_reading"]
    if max(fits) < FITS:
        return ", all of which fit the track"
    return f", which do not all fit the track (chi-square per reading {min(fits):.3g} to {max(fits):.3g})"


def _page(numbers, figures) -> str:
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string((resources.files("bayesub.report") / "report.html").read_text(encoding="utf-8"))
    pictures = {
        f["name"]: {"caption": f["caption"], "data": base64.b64encode(f["image"]).decode("ascii")} for f in figures
    }
    return template.render(
        numbers=numbers, pictures=pictures, word=findings.reference_word(numbers), combination=findings.combination
    )
