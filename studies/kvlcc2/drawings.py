"""Figures and tables of the tanker."""

from collections.abc import Iterator

import numpy as np

from bayesub.report.markdown import columns
from bayesub.report.plots import style
from kvlcc2 import circles
from kvlcc2.predictions import N_DRAWS
from kvlcc2.trials import CIRCLES, FITTED, MARIN, UNSEEN, ZIGZAGS

METHODS = ("posterior", "literature", "SQP", "linear least squares", "smoothed regression")
LOOKS = dict(
    zip(
        METHODS,
        (("o", style.POSTERIOR), ("s", style.SQP), ("^", style.WEAK), ("x", style.LINEAR), ("D", style.TRUTH)),
        strict=True,
    )
)
RIVALS = METHODS[2:]
SHOWN = ("05_01", "15_05", "25_05", "35_05", "zz_-20_m", "tc_35_m")


def title(name: str) -> str:
    """A run in words."""
    if name in MARIN:
        kind, angle, _ = name.split("_")
        return f"MARIN, {'turning circle' if kind == 'tc' else 'zig-zag'} {angle}°"
    angle, heading, *side = name.split("_")
    return f"zig-zag {int(angle)}/{int(heading)}{f' {side[0]}' if side else ''}"


def draw_errors(paths: list, numbers: dict) -> None:
    """Errors of heading and track of each method on each unseen run."""
    words = {"heading_deg": "heading (deg)", "track_m": "track (m)"}
    with style.figure(paths, 8.3, 5.6) as fig:
        for n, (key, word) in enumerate(words.items()):
            axes = fig.add_subplot(2, 1, n + 1)
            for method, (marker, colour) in LOOKS.items():
                values = [numbers["runs"][name]["errors"][method][key] for name in UNSEEN]
                values = [np.nan if value is None else value for value in values]
                axes.plot(range(len(UNSEEN)), values, marker, color=colour, ms=5, label=method)
            axes.set_yscale("log")
            axes.set_ylabel(f"{word}, rms")
            axes.axvline(len(ZIGZAGS) - 0.5, color=style.TRUTH, lw=0.5, ls=":")
            labels = [title(name).replace("turning circle", "circle") for name in UNSEEN] if n else []
            axes.set_xticks(range(len(UNSEEN)), labels or [""] * len(UNSEEN), rotation=60, ha="right")
        fig.legend(*axes.get_legend_handles_labels(), ncols=5, loc="outside upper center", fontsize=8)


def draw_circles(paths: list, numbers: dict) -> None:
    """Advance and diameter by each method in per cent of the test."""
    rows = [(side, key) for key in circles.MEASURES for side in CIRCLES]
    with style.figure(paths, 8.3, 3.4) as fig:
        axes = fig.add_subplot()
        for m, (method, (marker, colour)) in enumerate(LOOKS.items()):
            for place, (side, key) in enumerate(rows):
                content = numbers["circles"][side][key]
                one, height = content["methods"][method], place + 0.13 * (m - 2)
                if one["value"] is None:
                    continue
                value, *ends = (100.0 * (one[k] / content["test"] - 1.0) for k in ("value", "low", "high") if k in one)
                axes.plot(value, height, marker, color=colour, ms=5, label=method if place == 0 else None)
                if ends:
                    axes.plot(ends, [height, height], color=colour, lw=1.2)
        for place, (side, key) in enumerate(rows):
            test, predicted = numbers["circles"][side][key]["published"].values()
            word = "as published" if place == 0 else None
            axes.plot(
                100.0 * (predicted / test - 1.0), place + 0.39, "*", color=style.PRIOR, mec=style.TRUTH, label=word
            )
        axes.axvline(0.0, color=style.TRUTH, lw=0.8)
        axes.set_xlim(-50.0, 40.0)
        axes.set_yticks(range(len(rows)), [f"{key.removesuffix('_m')}, {side}" for side, key in rows])
        axes.invert_yaxis()
        axes.set_xlabel("error of the prediction (%)")
        fig.legend(*axes.get_legend_handles_labels(), ncols=6, loc="outside upper center", fontsize=8)


def draw_headings(paths: list, arrays: dict) -> None:
    """Headings of some runs, measured and predicted."""
    with style.figure(paths, 8.3, 4.4) as fig:
        for k, name in enumerate(SHOWN):
            axes = fig.add_subplot(2, 3, k + 1)
            times, (readings, low, high, ours, theirs, *_) = arrays[f"{name} times"], arrays[f"{name} headings"]
            axes.fill_between(times, low, high, color=style.POSTERIOR, alpha=0.2, lw=0, label="90 % band")
            axes.plot(times, theirs, "--", color=style.SQP, lw=1.2, label="literature")
            axes.plot(times, ours, color=style.POSTERIOR, lw=1.4, label="posterior")
            axes.plot(times, readings, ".", color=style.TRUTH, ms=3, label="measured")
            axes.set_title(title(name), fontsize=9)
            if k >= 3:
                axes.set_xlabel("time (s)")
            if k % 3 == 0:
                axes.set_ylabel("heading (deg)")
        fig.legend(*axes.get_legend_handles_labels(), ncols=4, loc="outside lower center")


def page(numbers: dict) -> Iterator[str]:
    """Tables of the runs, of the circles, and of what the circles are."""
    yield "Fits of the four zig-zags. Errors of predictions: heading (deg, rms) / track (m, rms); a dash where a flight"
    yield "leaves the range of the equations. The posterior predicts by the mean of its coefficients; beside it is the"
    yield "mean of its flights. Share of the readings in its bands of 50 and 90 %, and in those of 90 % by the"
    yield "covariance of a regression. The rudder zero with which the mean of the coefficients follows the run best,"
    yield "the heading error with it, and how far a tenth of a degree turns the heading.\n"
    rows = [numbers["runs"][name] | {"name": name} for name in numbers["runs"]]
    cells = {"run": lambda r: title(r["name"]) + (", fitted" if r["name"] in FITTED else "")}
    shown = ("posterior", "posterior, mean of flights", *METHODS[1:])
    cells |= {key: lambda r, key=key: pair(r["errors"][key]) for key in shown}
    cells |= {f"{level} % band": lambda r, n=level: f"{r['coverage']['posterior'][n]:.0%}" for level in ("50", "90")}
    cells |= {f"90 %, {key}": lambda r, key=key: held(r, key) for key in RIVALS[1:]}
    cells |= {
        "best zero": lambda r: "{zero_deg:.2f}°: {heading_deg:.1f}°, {by_tenth_deg:.1f}°".format(**r["best_zero"])
    }
    yield from columns(rows, cells)
    yield from wins(numbers["runs"])
    yield "\nFits of all zig-zags of HSVA but the one that is predicted, where it is one, by posterior mode: heading"
    yield "(deg, rms) / track (m, rms).\n"
    rows = [numbers["by_others"][name] | {"name": name} for name in UNSEEN]
    cells = {"run": lambda r: title(r["name"])}
    yield from columns(rows, cells | {key: lambda r, key=key: pair(r["errors"][key]) for key in METHODS})
    yield from wins(numbers["by_others"])
    yield "\nTurning circles of MARIN, fits of all thirteen zig-zags: m, and per cent of the test."
    yield "As published: per cent of the test as it stands there.\n"
    yield from columns(
        list(circle_rows(numbers)),
        {"measure": lambda r: r["measure"], "test": lambda r: r["test"]}
        | {key: lambda r, key=key: r[key] for key in ("as published", *METHODS)},
    )
    yield "\nEach zig-zag of HSVA by the posterior mode of the other twelve, by how far coefficients may leave the form"
    yield "of the published model, and by the noise of the readings over that of the sensors: errors of heading (deg,"
    yield "rms) and track (m, rms), geometric means over the zig-zags, and the share of all readings in 90 % bands.\n"
    cells = {"form, noise": lambda r: r[0], "heading": lambda r: f"{typical(r[1], 'heading_deg'):.2f}"}
    cells |= {"track": lambda r: f"{typical(r[1], 'track_m'):.2f}"}
    cells |= {"90 % band": lambda r: f"{np.mean([one['coverage'] for one in r[1].values()]):.0%}"}
    yield from columns(list(numbers["left_out"].items()), cells)
    yield "\nTurning circles by the posterior mode of all thirteen and its normal approximation, by form.\n"
    cells = {"form": lambda r: r[0]}
    for key in circles.MEASURES:
        for side in CIRCLES:
            word = f"{key.removesuffix('_m')}, {side}"
            cells[word] = lambda r, side=side, key=key: _cell(
                r[1][side][key]["methods"]["posterior"], r[1][side][key]["test"]
            )
    yield from columns(list(numbers["forms"].items()), cells)
    yield "\nThe tests by definition: where the rudder counts as put, and which way is ahead.\n"
    cells = {key: lambda r, key=key: r[key] for key in ("circle", "from", "axes")}
    cells |= {key: lambda r, key=key: f"{r[key]:.2f}" for key in circles.MEASURES}
    yield from columns(list(circles.table(numbers["definitions"])), cells)


def typical(runs: dict, key: str) -> float:
    """Geometric mean of an error over runs; infinite where a flight ended early."""
    return float(np.exp(np.mean([np.inf if run[key] is None else np.log(run[key]) for run in runs.values()])))


def held(run: dict, method: str) -> str:
    """Share of the readings in the 90 % bands, with the share of draws that left the range of the equations."""
    if method not in run["coverage"]:
        return "–"
    failed = run["failed"][method]
    return f"{run['coverage'][method]['90']:.0%}" + (f", {failed} of {N_DRAWS} draws lost" if failed else "")


def pair(error: dict) -> str:
    """Two errors in a cell."""
    return " / ".join("–" if error[key] is None else f"{error[key]:.1f}" for key in ("heading_deg", "track_m"))


def circle_rows(numbers: dict) -> Iterator[dict]:
    """A row for each measure of each circle."""
    for key in circles.MEASURES:
        for side in CIRCLES:
            content = numbers["circles"][side][key]
            test, predicted = content["published"].values()
            row = {"measure": f"{key.removesuffix('_m')}, {side}", "test": f"{content['test']:.2f}"}
            row["as published"] = f"{predicted:.2f} ({predicted / test - 1.0:+.1%} of {test:.2f})"
            yield row | {method: _cell(one, content["test"]) for method, one in content["methods"].items()}


def _cell(one, test):
    if one["value"] is None:
        return "–"
    interval = f" ({one['low']:.2f} to {one['high']:.2f})" if "low" in one else ""
    return f"{one['value']:.2f}{interval}, {one['value'] / test - 1.0:+.1%}"


def wins(runs: dict) -> Iterator[str]:
    """On how many unseen runs the posterior is at least as good as its rivals."""
    for key, word in (("heading_deg", "heading"), ("track_m", "track")):
        yield f"\n{word.capitalize()}: the posterior is at least as good as the best of {', '.join(RIVALS)} in"
        yield f"{len(at_least_as_good(runs, key))} of {len(UNSEEN)} unseen runs."


def at_least_as_good(predicted: dict, key: str) -> list[str]:
    """The unseen runs on which the posterior's error is no larger than that of any rival."""
    runs = {name: predicted[name]["errors"] for name in UNSEEN}
    best = {name: min((e[m][key] for m in RIVALS if e[m][key] is not None), default=np.inf) for name, e in runs.items()}
    return [name for name, e in runs.items() if e["posterior"][key] is not None and e["posterior"][key] <= best[name]]
