"""The pictures of the manual and the README: python tests/support/pictures.py [--run FOLDER] [NAME ..]

Writes `bayesub/manual/pictures/NAME.png`, by default all. Those of a report are of the run in FOLDER, a finished
quickstart; without --run it is run. The first screens of pages need a browser.
"""

import argparse
import contextlib
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))  # where `support` is, for what is started as a script
from support import browsing, toys

import bayesub as bs
from bayesub.inference.baselines.gauss_newton import gauss_newton
from bayesub.inference.sampling.sampler import learn_coordinates
from bayesub.report.plots import style

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "bayesub" / "manual" / "pictures"
FROM_RUN = ("ladder", "pairs", "directions")  # figures of the report
SCREENS = {"report": 730, "design": 920}  # heights in pixels of what is shown of a page


class Sheet(toys.Banana):
    """A bent sheet of which no polynomial has the shape: ``x1 + exp(0.8 x0)`` is read as 2 within `width`."""

    def residuals(self, parameters):
        self.costs.simulations += len(parameters)
        with np.errstate(over="ignore"):
            bend = parameters[:, 1] + np.exp(0.8 * parameters[:, 0]) - 2.0
        return np.stack([bend / self.width, 0.0 * bend], axis=1)

    def slopes(self, parameters):
        self.path.append(parameters)
        return np.array([[0.8 * np.exp(0.8 * parameters[0]), 1.0], [0.0, 0.0]]) / self.width


def draw_sampler(file):
    """The four steps of the sampler with two parameters, by the code that does them."""
    toy, rng = Sheet(width=0.25, reach=2.0), np.random.default_rng(4)
    paths = []
    for start in toy.prior.mean + toy.prior.sd * rng.uniform(-1.6, 1.6, (4, 2)):
        toy.path = []
        end = gauss_newton(toy, start)
        paths.append(np.array([start, *toy.path, end.values]))
    geometry, surrogate, y = learn_coordinates(toy, rng)
    exact, learnt = geometry.log_prob(toy, y), surrogate.log_prob(y)
    posterior = bs.sample(toy, rng=rng)
    draws, walker = posterior.chain.reshape(-1, 2)[::7], posterior.chain[0, -9:, 0]
    x, z = np.meshgrid(np.linspace(-3.2, 2.6, 301), np.linspace(-5.5, 4.2, 301))
    grid = np.stack([x.ravel(), z.ravel()], axis=1)
    density = (toy.log_likelihood(grid) + toy.prior.log_density(grid)).reshape(x.shape)
    levels = density.max() - np.array([4.61, 2.3, 0.69])  # 99, 90 and 50 % of a normal
    with style.figure(file, 9.0, 7.4) as figure:
        (mode, straight), (learning, sampling) = figure.subplots(2, 2)
        for axes in (mode, sampling):
            axes.contourf(x, z, density, [*levels, density.max() + 1.0], colors=["#CFE3F1", "#8FBFE0", style.POSTERIOR])
            axes.set(xlabel="a coefficient", ylabel="another", xlim=(-3.2, 2.6), ylim=(-5.0, 3.0))
        for path in paths:
            mode.plot(*path.T, "-o", color=style.SQP, ms=3, lw=1)
            mode.plot(*path[0], "s", color=style.SQP, ms=6)
        mode.plot(*paths[0][-1], "*", color=style.TRUTH, ms=13)
        mode.set_title("1. The mode: searches from several starts (squares)\nend at the same place (star)")
        bent = geometry.bent(y)
        straight.plot(*bent.T, ".", color=style.WEAK, ms=3, label="whitened at the mode: bent")
        straight.plot(*y.T, ".", color=style.POSTERIOR, ms=3, label="straightened: a round normal")
        straight.set(xlabel="stiff coordinate", ylabel="sloppy coordinate", ylim=(-3.2, 4.2))
        straight.set_title("2. Coordinates: the same draws,\nbefore and after straightening")
        straight.legend(markerscale=3, loc="upper left")
        low = np.percentile(exact, 0.5) - exact.max()
        learning.plot([low, 0.0], [low, 0.0], color=style.TRUTH, lw=1)
        learning.plot(exact - exact.max(), learnt - exact.max(), ".", color=style.POSTERIOR, ms=3)
        ends = (low, 0.2)
        learning.set(xlabel="log density by simulation", ylabel="log density by polynomials", xlim=ends, ylim=ends)
        learning.set_title("3. A surrogate: polynomials give the density\nof a simulation at a fraction of its cost")
        sampling.plot(*draws.T, ".", color="#4D4D4D", ms=1)
        sampling.plot(*walker.T, "-o", color=style.SQP, ms=4, lw=1)
        sampling.set_title(
            "4. Sampling: each step of a walker (line) crosses\nthe sheet, and a simulation accepts or rejects it"
        )


def draw_card(file):
    """The card of a vehicle."""
    command("check", "suboff", "--card", file)


def design_in(folder):
    """A design of a minute or two less than the usual, and its page."""
    command(
        "design", "auv690", "--subproblem", "horizontal", "--family", "standard", "--judgements", "120", "-o", folder
    )
    return folder / "design.html"


def command(*words):
    """Run bayesub."""
    subprocess.run([sys.executable, "-m", "bayesub", *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def first_screen(page, file, browser):
    """A page as it opens, in few colours."""
    with browsing.opened(browser, page, {"width": 1280, "height": SCREENS[file.stem]}) as opened:
        opened.screenshot(path=file)
    Image.open(file).convert("RGB").quantize(200, dither=Image.Dither.NONE).save(file, optimize=True)


def make(folder, names, run=None):
    """Write the pictures of these names into a folder."""
    with contextlib.ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        if run is None and {"report", *FROM_RUN} & set(names):
            run = scratch / "quickstart"
            command("run", ROOT / "studies" / "quickstart.toml", "-o", run)
        browser = stack.enter_context(browsing.started()) if SCREENS.keys() & set(names) else None
        for name in names:
            file = folder / f"{name}.png"
            if name in FROM_RUN:
                shutil.copy(run / file.name, file)
            elif name in DRAWN:
                DRAWN[name](file)
            else:
                first_screen(run / "report.html" if name == "report" else design_in(scratch / name), file, browser)


DRAWN = {"sampler": draw_sampler, "card": draw_card}
NAMES = (*DRAWN, *FROM_RUN, *SCREENS)

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    given = parser.parse_args()
    make(FOLDER, given.names or NAMES, given.run)
