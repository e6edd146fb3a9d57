"""Tables of the study of rounded readings (:mod:`rounded.readings`), Markdown."""

from collections.abc import Iterator
from operator import itemgetter

import numpy as np

from bayesub.report import markdown
from rounded.plots import WORDS

_CAPTION = """\
Coverage of the truth, mean over coefficients ± standard error (range over coefficients); error: root mean
square in stated standard deviations; joint: median over trials of the squared error in all directions of the
posterior; width: median sd of a coefficient, relative to the rounding-aware one. Missed: searches of the rounding
interval that miss their tolerance, and are counted all the same.
"""


def tables(numbers: dict) -> Iterator[str]:
    """The lines of the page: the cases, the controlled experiment and the check by sampling."""
    yield _CAPTION
    yield from _cases(numbers["cases"])
    yield "\nSearches that meet their tolerance; that end as well from the centre of the prior.\n"
    cells = {
        "case": itemgetter("name"),
        "converged": lambda case: f"{case['converged']:.0%}",
        "same from the centre": lambda case: f"{case['found_from_centre']:.0%}",
    }
    yield from markdown.columns(markdown.named(numbers["cases"]), cells)
    yield "\nControlled experiment: suboff, horizontal, u and v (1 mm/s) and r (0.01 deg/s).\n"
    yield from _grid(numbers["grid"])
    yield "\nLaplace approximation against sampling, one trial of each.\n"
    yield from _sampled(numbers["sampled"])


def _percent(mean_and_error) -> str:
    return "{:.1%} ± {:.1%}".format(*mean_and_error)


def _cases(cases: dict) -> list[str]:
    cells = {
        "case": itemgetter("name"),
        "readings, coefficients, trials": itemgetter("counts"),
        "missed": itemgetter("missed"),
        "treatment": lambda r: WORDS[r["fit"]],
        "95 % intervals": lambda r: (
            f"{_percent(r['mean_coverage_95'])} ({min(r['coverage_95']):.0%} to {max(r['coverage_95']):.0%})"
        ),
        "50 % intervals": lambda r: _percent(r["mean_coverage_50"]),
        "bias, largest (sd)": lambda r: f"{max(map(abs, r['bias_in_sd'])):.2f}",
        "error: median, largest (sd)": lambda r: f"{np.median(r['rms_in_sd']):.2f}, {max(r['rms_in_sd']):.2f}",
        "joint": lambda r: f"{r['joint']:.3g}",
        "width": lambda r: f"{r['width']:.3g}",
    }
    lines = markdown.columns(_fits(cases), cells)
    for fit, word in WORDS.items():
        pairs = np.array([case["fits"][fit]["mean_coverage_95"] for case in cases.values()])
        pooled = pairs[:, 0].mean(), np.linalg.norm(pairs[:, 1]) / len(pairs)
        lines.append(markdown.row(("all", "", "", word, _percent(pooled), *[""] * 5)))
    return lines


def _fits(cases: dict) -> Iterator[dict]:
    """Each treatment of each case, of which only the first has the name of the case."""
    for name, case in cases.items():
        rounded = case["fits"]["rounded"]
        sds = dict(zip(rounded["names"], rounded["sd_over_truth"], strict=True))
        counts = f"{case['n_readings']}, {case['n_params']}, {case['n_trials']}"
        heading = {"name": name, "counts": counts, "missed": f"{1 - case['converged']:.0%}"}
        for fit, result in case["fits"].items():
            pairs = zip(result["names"], result["sd_over_truth"], strict=True)
            yield (
                result
                | heading
                | {"fit": fit, "width": np.median([sd / sds[coefficient] for coefficient, sd in pairs])}
            )
            heading = {"name": "", "counts": "", "missed": ""}


def _grid(grid: list[dict]) -> list[str]:
    cells = {
        "step / sd": lambda r: f"{r['ratio']:g}",
        "interval (s)": lambda r: f"{r['interval_s']:g}",
        "readings": itemgetter("n_readings"),
        "95 % intervals, rounded": lambda r: _percent(r["rounded"]["mean_coverage_95"]),
        "95 % intervals, normal": lambda r: _percent(r["normal"]["mean_coverage_95"]),
        "error (sd), rounded": lambda r: f"{r['rounded']['rms_in_sd']:.3g}",
        "error (sd), normal": lambda r: f"{r['normal']['rms_in_sd']:.3g}",
        "joint, rounded": lambda r: f"{r['rounded']['joint']:.3g}",
        "joint, normal": lambda r: f"{r['normal']['joint']:.3g}",
        "width, normal / rounded: median coefficient": lambda r: f"{r['width_ratio']:.3g}",
        "widest direction": lambda r: f"{r['largest_width_ratio']:.3g}",
    }
    return markdown.columns(grid, cells)


def _sampled(sampled: dict) -> list[str]:
    cells = {
        "case": lambda r: f"{r['name']}{', NOT CONVERGED' if r['shortcomings'] else ''}",
        "mode less mean, largest (sd)": lambda r: f"{np.abs(r['shift_in_sd']).max():.2f}",
        "sd over sampled: median (range)": lambda r: (
            f"{np.median(r['sd_ratio']):.2f} ({min(r['sd_ratio']):.2f} to {max(r['sd_ratio']):.2f})"
        ),
        "sampling (s)": lambda r: f"{r['seconds']:.0f}",
    }
    return markdown.columns(markdown.named(sampled), cells)
