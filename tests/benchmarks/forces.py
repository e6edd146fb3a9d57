"""What inferring unmodelled forces costs by the number of knots: ``python tests/benchmarks/forces.py``.

The log of a boat that another simulator flies (`studies/disturbed/strangers.py`) is fitted with forces on three axes,
first one of 176 s with 60, 120 and 240 knots an axis, and then one of two hours of zig-zags with a knot in 5 s. Run it
on a machine that does nothing else; the last row takes long.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))

import bayesub as bs  # noqa: E402
from bayesub.inference.sampling import sampler  # noqa: E402
from disturbed import strangers  # noqa: E402
from disturbed.trials import cost, read_log  # noqa: E402

SEED = 41
LONG_S, KNOT_S = 7200.0, 5.0  # of forces with the default knots, twice as many as correlation times
LONG_WALKERS = 8  # of an ensemble; how many steps there are is what convergence wants, not how many draws
STEP_S = 0.2  # of the long one, in which errors of any step are larger than a tenth of the noise
ZIGZAG = tuple((10.0 + 20.0 * k, 20.0 * (-1.0) ** k) for k in range(round(LONG_S / 20.0)))  # s, degrees
COLUMNS = {
    "knots": "{n_knots}",
    "parameters": "{n_params}",
    "s to learn": "{learning:.1f}",
    "s in all": "{seconds:.1f}",
    "simulations": "{simulations}",
    "Jacobians": "{jacobians}",
    "an effective sample": "{work_per_effective_sample:.1f}",
    "converged": "{converged}",
}


def measured(log: str, duration_s: float, n_knots: int, max_steps: int) -> dict:
    """What sampling the boat of a log with so many knots an axis takes."""
    step = "" if duration_s < LONG_S else f"dt_s = {STEP_S}\n"
    study = step + strangers.STUDY + f"knot_interval_s = {duration_s / (n_knots - 1):.9g}\n"
    problem, learning = read_log(log, study).problem, []
    learn = sampler.learn_coordinates

    def timed(*arguments, **options):
        began = time.perf_counter()
        learned = learn(*arguments, **options)
        learning.append(time.perf_counter() - began)
        return learned

    sampler.learn_coordinates = timed
    try:
        walkers = None if duration_s < LONG_S else LONG_WALKERS
        posterior = bs.sample(problem, rng=np.random.default_rng(SEED), n_walkers=walkers, max_steps=max_steps)
    finally:
        sampler.learn_coordinates = learn
    return {"n_knots": n_knots, "learning": learning[0]} | cost(posterior)


def main() -> None:
    """Print seconds and simulations by the number of knots. Simulations an effective sample count Jacobians too."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--knots", type=int, nargs="*", default=[60, 120, 240], help="an axis, for the log of 176 s")
    parser.add_argument("--no-long", action="store_true", help="without the log of two hours")
    parser.add_argument("--steps", type=int, default=20_000, help="of each ensemble at most")
    given = parser.parse_args()
    cases = [(strangers.STAIRS, strangers.DURATION_S, strangers.TIME_S, n) for n in given.knots]
    if not given.no_long:
        cases.append((ZIGZAG, LONG_S, 2.0 * KNOT_S, round(LONG_S / KNOT_S)))
    print(" | ".join(COLUMNS))
    for demands, duration_s, time_s, n_knots in cases:
        _, log, _ = strangers.boat_and_log(np.random.default_rng(SEED), demands, duration_s, time_s)
        row = measured(log, duration_s, n_knots, given.steps)
        cells = (form.format(**row) for form in COLUMNS.values())
        print(" | ".join(cell.rjust(len(title)) for title, cell in zip(COLUMNS, cells, strict=True)), flush=True)


if __name__ == "__main__":
    main()
