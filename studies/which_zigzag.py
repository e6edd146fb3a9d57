"""Which zig-zag of a real tanker should be run next, and is what it promises kept?

Question: the four zig-zags 10/10 and 20/10 of KVLCC2 have been run (study `kvlcc2`), and turning circles with 35
degrees of rudder are to be predicted. Each of the basin's nine other zig-zags is flown by the posterior mode, without
noise and before its test is looked at, and fitted together with the four: what the intervals of advance and tactical
diameter would then be is its promise. Then the test is fitted in its place.
Claim: the zig-zag that promises most is one of the three that narrow the intervals most when they are run, and the
intervals that the tests leave are within a fifth of the promised ones for nine in ten of the measures.
Cost: two minutes, of normal approximations at posterior modes. The data are not ours to give: the environment variable
BAYESUB_KVLCC2 names a folder with HSVA_CPMC_KVLCC2_Z_*.dat and MARIN_FREE_KVLCC2_*.dat; without it the study is
skipped, and with --quick too.

Intervals are of what the coefficients leave open. What is of a single run, its rudder zero and unmodelled forces, no
further test can narrow.
"""

import os
from dataclasses import replace
from functools import partial
from operator import itemgetter
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

import bayesub as bs
from bayesub.logs import log_files
from bayesub.model.closed_loop import zigzag
from bayesub.model.manoeuvre_files import ZigzagFile
from bayesub.model.manoeuvres import of_inputs
from bayesub.report.markdown import columns
from bayesub.report.plots import style
from kvlcc2 import circles, fits, predictions
from kvlcc2.drawings import title
from kvlcc2.trials import CIRCLES, COLUMNS, FITTED, ROW_S, ZIGZAGS, Tanker, file_of

SEED = 1
MOST_EXECUTES, START_S = 100, 1.0  # as many as the basin has room for; when the rudder is put
CLOSE, SHARE, FIRST = 0.2, 0.9, 3
WAYS = ("promised", "reached")
MEASURES = [(side, key) for key in circles.MEASURES for side in CIRCLES]
FIGURES = {
    "which_zigzag": "Intervals of 90 % of MARIN's turning circles after one more zig-zag, over those of before: as "
    "promised (rings), and as its test leaves them (dots). Left of the line the circle is known better; mean of both "
    "sides. Zig-zags are in the order of what they promise. Right: how far the predicted circles are off the tests.",
}
ANSWER = """
After zig-zags 10/10 and 20/10 of the tanker, {best/words; s} promises to narrow the 90 % intervals of turning circles
most, to {best/promised; percent; .0f} % of those of before; when its test is fitted they are {best/reached; percent;
.0f} %. Of {kept/n; .0f} intervals that the nine tests leave, {kept/close; .0f} are within a fifth of the promised ones,
and the order of the nine is the promised one with a rank correlation of {kept/rank_correlation; .2f}.
"""


class ToStarboard(ZigzagFile):
    """A zig-zag that begins to starboard, whither a negative rudder turns the tanker."""

    def steer(self, flight):
        """Put the rudder over to either side."""
        angles = np.radians([-self.angle_deg, self.reversal_deg])
        yaw, first = log_files.STATES.index("psi"), round(self.start_s / flight.sample)
        zigzag(flight, "rudder_deg", angles[0], yaw, angles[1], self.executes, first)


class Planned(Tanker):
    """The tanker, the further zig-zags of which are flown by a mode, as long as in the basin."""

    def __init__(self, folder: Path, mode: bs.baselines.Estimate):
        super().__init__(folder)
        known = dict(zip(mode.names, mode.solutions[0], strict=True))
        xi = [known.get(name, held) for name, held in zip(self.boat.equations.names, self.boat.xi, strict=True)]
        self.ship = replace(self.boat, xi=np.array(xi))

    def log(self, name: str) -> dict[str, np.ndarray]:
        """The log of a zig-zag that has been run, or the flight of one that is ordered."""
        log = super().log(name)
        return log if name in FITTED else self.flown(name, len(log["time_s"]))

    def flown(self, name: str, n_rows: int) -> dict[str, np.ndarray]:
        """Column -> values of a zig-zag by its name, such as 20_05 of 20 degrees of rudder at 5 of heading."""
        angle, heading = map(float, name.split("_"))
        order = {"angle_deg": angle, "reversal_deg": heading, "executes": MOST_EXECUTES, "start_s": START_S}
        times = ROW_S * np.arange(n_rows)
        order |= {
            "kind": "zigzag",
            "plane": "rudder",
            "subproblem": "horizontal",
            "name": name,
            "duration_s": times[-1],
        }
        file, ship = ToStarboard(**order), self.ship
        clock = file.times(ship)
        angles = file.responses(ship, file.orders(ship))
        still = np.zeros(len(clock))
        ordered = of_inputs(name, clock, angles, still, file.initial_state(ship), ship, subproblem="horizontal")
        flight = bs.simulate(ship, ordered).resampled(times)
        x, y, yaw, u, v, r = flight.outputs(("x", "y", "psi", "u", "v", "r"))[0].T
        values = (times, x, y, np.degrees(yaw), u, v, np.degrees(r), np.degrees(flight.controls[:, 0]))
        return dict(zip(COLUMNS, values, strict=True))


def compute(run):
    """Circles as predicted before, and after each zig-zag: as promised, and as it was."""
    folder = os.environ.get("BAYESUB_KVLCC2", "")
    missing = [name for name in (*FITTED, *ZIGZAGS, *CIRCLES.values()) if not file_of(Path(folder), name).exists()]
    if not folder or missing:
        which = "".join(f": {file_of(Path(folder), name).name} is missing" for name in missing[:1])
        return {"skipped": f"BAYESUB_KVLCC2 does not name a folder with the files of HSVA and MARIN{which}"}
    if run.quick:
        return {"skipped": "there is no small version: the posteriors are of whole trials"}
    tanker = Tanker(Path(folder))
    run.progress.stage("fit the four")
    mode = fits.mode(tanker, FITTED)
    ways = dict(zip(WAYS, (Planned(Path(folder), mode), tanker), strict=True))
    numbers = {"before": circles_of(tanker, mode), "after": {}}
    for name in ZIGZAGS:
        run.progress.stage(title(name))
        numbers["after"][name] = {
            way: run.part(f"{way}_{name}", partial(after, tanker, ship, [name])) for way, ship in ways.items()
        }
    run.progress.stage("fit all thirteen")
    numbers["all"] = run.part("all", partial(after, tanker, tanker, ZIGZAGS))
    return numbers | judged(numbers)


def after(tanker, ship, names):
    """Circles by the four zig-zags and further ones of a ship, which has run them or is to run them."""
    return circles_of(tanker, fits.mode(ship, [*FITTED, *names]))


def circles_of(tanker, mode):
    """Side -> measure -> test, and value and ends of the interval as the coefficients of a mode predict them."""
    known = {"mode": predictions.Known.of_estimate(mode.to_json(), np.random.default_rng(SEED))}
    result = {}
    for side, name in CIRCLES.items():
        found = predictions.of_circle(tanker, name, side, known, SEED)
        result[side] = {key: content["methods"]["mode"] | {"test": content["test"]} for key, content in found.items()}
    return result | {"status": mode.statuses[0]}


def left(numbers, after, measures=MEASURES):
    """Widths of the intervals of measures, over those of before."""
    widths = [
        [one[side][key]["high"] - one[side][key]["low"] for side, key in measures] for one in (after, numbers["before"])
    ]
    return np.divide(*widths)


def judged(numbers):
    """The zig-zag that promises most, how the promises are kept, and what all nine leave together."""
    shares = {way: {name: left(numbers, numbers["after"][name][way]) for name in ZIGZAGS} for way in WAYS}
    promised, reached = ({name: float(np.mean(values)) for name, values in shares[way].items()} for way in WAYS)
    best = min(promised, key=promised.get)
    kept = np.concatenate([shares["reached"][name] / shares["promised"][name] for name in ZIGZAGS])
    return {
        "best": {
            "words": title(best),
            "promised": promised[best],
            "reached": reached[best],
            "place": sorted(reached, key=reached.get).index(best) + 1,
            "error": off(numbers["after"][best]["reached"]),
        },
        "kept": {
            "n": kept.size,
            "close": int(np.sum(np.abs(kept - 1.0) < CLOSE)),
            "rank_correlation": float(spearmanr(list(promised.values()), list(reached.values())).statistic),
        },
        "together": {"reached": float(np.mean(left(numbers, numbers["all"]))), "error": off(numbers["all"])},
        "now": {"error": off(numbers["before"])},
    }


def off(content):
    """Mean size of the errors of circles, of the tests."""
    found = [content[side][key] for side, key in MEASURES]
    return float(np.mean([abs(one["value"] / one["test"] - 1.0) for one in found]))


def draw(run, numbers):
    """What each zig-zag promises and leaves."""
    order = sorted(ZIGZAGS, key=lambda name: -np.mean(left(numbers, numbers["after"][name]["promised"])))
    looks = dict(zip(WAYS, ({"mfc": "none", "ms": 8}, {"ms": 5}), strict=True))
    with style.figure(run.figure("which_zigzag"), 8.3, 3.6) as figure:
        panels = figure.subplots(1, 3, sharey=True)
        for panel, key in zip(panels, circles.MEASURES, strict=False):
            for way, look in looks.items():
                shares = [share(numbers, name, way, key) for name in order]
                panel.plot(100.0 * np.array(shares), range(len(order)), "o", color=style.POSTERIOR, label=way, **look)
            panel.axvline(100.0, color=style.TRUTH, lw=0.8)
            panel.set_xlabel(f"interval of {key.removesuffix('_m')} (% of before)")
        after = [100.0 * off(numbers["after"][name]["reached"]) for name in order]
        panels[2].plot(after, range(len(order)), "D", color=style.READINGS, ms=5)
        for key, words, line in (("now", "the four", "-"), ("together", "all thirteen", "--")):
            panels[2].axvline(
                100.0 * numbers[key]["error"], color=style.TRUTH, lw=0.8, ls=line, label=f"error by {words}"
            )
        panels[2].set_xlabel("mean error of the circles (%)")
        panels[0].set_yticks(range(len(order)), [title(name) for name in order])
        panels[1].sharex(panels[0])
        lines = [*panels[0].get_lines()[: len(looks)], *panels[2].get_lines()[1:]]
        figure.legend(handles=lines, loc="outside upper center", ncols=4, fontsize=8)
    run.page(table(numbers, order[::-1]))


def share(numbers, name, way, key):
    """The interval of a measure after a zig-zag, over that of before, mean of both sides."""
    return float(np.mean(left(numbers, numbers["after"][name][way], [(side, key) for side in CIRCLES])))


def table(numbers, order):
    """A row a zig-zag, in the order of what they promise."""
    yield "Intervals of 90 % of advance and tactical diameter of MARIN's circles with 35 degrees of rudder, means of"
    yield "both sides, in per cent of those that the four zig-zags leave: as promised -> as the test leaves them. Mean"
    now, together = numbers["now"]["error"], numbers["together"]["error"]
    yield f"errors of the circles: {now:.1%} by the four, {together:.1%} by all.\n"

    def shares(name, key):
        return " -> ".join(f"{share(numbers, name, way, key):.0%}" for way in WAYS)

    cells = {"one more": title}
    cells |= {key.removesuffix("_m"): partial(shares, key=key) for key in circles.MEASURES}
    cells |= {"error of the circles": lambda name: f"{off(numbers['after'][name]['reached']):.1%}"}
    yield from columns(order, cells)


def claims(numbers):
    """The best promise is kept, and most others."""
    if "skipped" in numbers:
        return
    fits_of = [numbers["before"], numbers["all"], *(one for both in numbers["after"].values() for one in both.values())]
    unfinished = [status for status in map(itemgetter("status"), fits_of) if not status.startswith("converged")]
    yield not unfinished, f"a search has {next(iter(unfinished), 'converged')}"
    best, kept = numbers["best"], numbers["kept"]
    yield best["place"] <= FIRST, f"{best['words']}, which promises most, is number {best['place']} of those run"
    yield kept["close"] >= SHARE * kept["n"], f"{kept['close']} of {kept['n']} intervals are within {CLOSE:.0%}"
