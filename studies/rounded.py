"""When must a likelihood know that readings are rounded, and do its intervals then hold the truth?

Question: three treatments of the same readings are compared: the exact probability of a rounding interval, normal noise
with a twelfth of the squared step added, and linear least squares on the equations of motion.
Claim: with the probability of the interval, 95 % intervals hold the truth as often as they say within the error of
fifty trials, in twelve cases and for steps of 0.1 to 30 standard deviations. Coefficient by coefficient, normal noise
does as well for the thesis's and Autosub's sensors at a reading a second. It fails where readings are so frequent that
successive ones are rounded alike, so that their errors do not average out: at steps of thirty standard deviations four
times a second it holds the truth two times in three, and is eleven times wider than need be in some direction as well.
Least squares fails everywhere, because errors stand in its matrix.
Cost: about a quarter of an hour; a killed run continues with --resume after the last part.

In every trial the truth is a draw from the prior (25 % about the vehicle), so that Bayesian intervals ought to hold it
as often as they say, in directions that the data do not see as well. Posteriors are Laplace approximations, and
searches begin at the truth: the question is what the likelihoods say and not whether a search finds it. How often a
search from the centre of the prior ends elsewhere is counted apart. Linear least squares is given the true values of
the added masses that reduce the rank.

The thesis rounds exact velocities and accelerations, which have no likelihood. Here they have noise of a tenth of the
step first: little enough that nine readings in ten are what exact values would give.
"""

from functools import partial
from itertools import product

import numpy as np

import bayesub as bs
from bayesub.model.simulator import choose_step
from rounded import plots, readings, tables
from rounded.readings import FITS
from thesis import cases
from thesis.coverage import standard_errors_off
from thesis.prior_trials import PriorTrials

SEED = 960
MANOEUVRES = ("horizontal", "random:0")
PRESETS = {
    "thesis_rounding": bs.sensors.thesis_rounding(velocity_sd_mps=1e-3, acceleration_sd_mps2=1e-4),
    "autosub": bs.sensors.autosub(),
}
PRIOR = bs.priors.relative_normal(0.25)
N_TRIALS = 50
N_FROM_CENTRE = 10  # trials of each case whose search is repeated from the centre of the prior

# The controlled experiment on suboff's horizontal spiral: one noise, and steps that are multiples of it.
SDS = {"u_mps": 1e-3, "v_mps": 1e-3, "r_degps": 1e-2}
RATIOS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
INTERVALS = (0.25, 1.0, 3.0, 10.0)  # s
N_GRID_TRIALS = 40
SAMPLED = ((10.0, 1.0), (30.0, 10.0))  # ratio, interval
DETERMINED = 0.5  # a coefficient is determined if the finest readings halve its prior sd
STEP = "step of {:g} sd every {:g} s"
FIGURES = {
    "when_rounding_matters": "Coverage, joint error and width by the step of rounding in noise standard deviations: "
    "normal noise of variance sd^2 + step^2 / 12 (dashed) is as good as the exact likelihood until the step is ten "
    "sds and more.",
    "cases": "Coverage of 95 % intervals, error in stated sds, and width, a dot a coefficient, by case and treatment; "
    "bars are medians.",
}
ANSWER = """
With the thesis's rounding 95 % intervals hold the truth {cases/*, horizontal,
thesis_rounding/fits/rounded/mean_coverage_95/0; min; percent; .0f} to {cases/*, horizontal,
thesis_rounding/fits/rounded/mean_coverage_95/0; max; percent; .0f} % of the time on the spiral, with linear least
squares {cases/*, horizontal, thesis_rounding/fits/linear/mean_coverage_95/0; min; percent; .0f} to {cases/*,
horizontal, thesis_rounding/fits/linear/mean_coverage_95/0; max; percent; .0f} %. Normal noise in place of the exact
likelihood fails where the step is ten noise standard deviations or more and neighbours are rounded alike.
"""


def compute(run):
    """Twelve cases, the controlled experiment, and the Laplace approximation against sampling."""
    vehicles, manoeuvres = (cases.VEHICLES[2:], MANOEUVRES[:1]) if run.quick else (cases.VEHICLES, MANOEUVRES)
    n_trials, n_grid_trials = (6, 3) if run.quick else (N_TRIALS, N_GRID_TRIALS)
    places = list(product(vehicles, manoeuvres, PRESETS))
    cells = list(product(RATIOS[::5], INTERVALS[3:]) if run.quick else product(RATIOS, INTERVALS))
    sampled = {} if run.quick else {f"suboff, horizontal, {p}": ("suboff", "horizontal", s) for p, s in PRESETS.items()}
    sampled |= {} if run.quick else {STEP.format(*cell): ("suboff", "horizontal", steps(*cell)) for cell in SAMPLED}
    finest = all_free("suboff", "horizontal", steps(RATIOS[0], INTERVALS[0])).problem
    chosen = readings.determined(finest, DETERMINED)
    return {
        "cases": run.parts("cases", {", ".join(p): partial(compare, *p, n_trials) for p in places}),
        "grid": list(
            run.parts("grid", {STEP.format(*c): partial(widths, *c, n_grid_trials, chosen) for c in cells}).values()
        ),
        "determined": np.array(finest.names)[chosen].tolist(),
        "sampled": run.parts("sampled", {n: partial(sample, k, *p) for k, (n, p) in enumerate(sampled.items())}),
    }


def all_free(vehicle, manoeuvre, sensors):
    """Trials in which every coefficient is free.

    Truth and model have the same step: rounded accelerations ask for one of less than a millisecond.
    """
    boat = bs.load_vehicle(vehicle)
    flown = bs.load_manoeuvre(manoeuvre, boat)
    dt = choose_step(boat, flown, flown.subproblem)
    return PriorTrials(vehicle, manoeuvre, sensors, free=bs.coefficients.NAMES, prior=PRIOR, dt=dt)


def steps(ratio, interval):
    """Velocities and turn rate, rounded to `ratio` standard deviations every `interval` seconds."""
    return [bs.sensors.Sensor(column, sd, ratio * sd, interval) for column, sd in SDS.items()]


def compare(vehicle, manoeuvre, preset, n_trials):
    """The three treatments in one of the twelve cases."""
    place = (cases.VEHICLES.index(vehicle), MANOEUVRES.index(manoeuvre), list(PRESETS).index(preset))
    held = cases.held("horizontal" if manoeuvre == "horizontal" else "coupled")
    trials = all_free(vehicle, manoeuvre, PRESETS[preset])
    return readings.compare(trials, np.random.default_rng([SEED, *place]), n_trials, N_FROM_CENTRE, held)


def widths(ratio, interval, n_trials, chosen):
    """Rounding interval and normal noise in one cell of the controlled experiment."""
    rng = np.random.default_rng([SEED, RATIOS.index(ratio), INTERVALS.index(interval)])
    trials = all_free("suboff", "horizontal", steps(ratio, interval))
    return {"ratio": ratio, "interval_s": interval} | readings.compare_widths(trials, rng, n_trials, chosen)


def sample(number, *place):
    """The Laplace approximation against sampling."""
    return readings.compare_with_sampling(all_free(*place), np.random.default_rng([SEED, number]))


def draw(run, numbers):
    """Intervals of the cases and of the controlled experiment, and a table of each."""
    plots.draw_cases(run.figure("cases"), numbers["cases"])
    plots.draw_grid(run.figure("when_rounding_matters"), numbers["grid"])
    run.page(tables.tables(numbers))


def claims(numbers):
    """Means over coefficients are judged by their spread over the trials, four standard errors at most."""
    for name, case in numbers["cases"].items():
        n = case["n_params"] * case["n_trials"]
        for probability, key in ((0.95, "mean_coverage_95"), (0.5, "mean_coverage_50")):
            pairs = {fit: case["fits"][fit][key] for fit in FITS}
            off = standard_errors_off(pairs["rounded"], probability, n)
            yield abs(off) < 4, f"{name}: coverage of {probability:.0%} intervals is {off:.1f} standard errors off"
            change = pairs["normal"][0] - pairs["rounded"][0]
            yield abs(change) < 4 * max(pairs["rounded"][1], 1e-2), f"{name}: normal noise changes coverage"
            short = standard_errors_off(pairs["linear"], probability, n)
            yield short < -4, f"{name}: intervals of least squares hold the truth"
    for cell in numbers["grid"]:
        place = STEP.format(cell["ratio"], cell["interval_s"])
        n = len(numbers["determined"]) * cell["n_trials"]
        off, naive = (standard_errors_off(cell[fit]["mean_coverage_95"], 0.95, n) for fit in FITS[:2])
        yield abs(off) < 4, f"{place}: coverage is {off:.1f} standard errors off"
        if cell["ratio"] <= 1:
            yield cell["largest_width_ratio"] < 1.01, f"{place}: fine rounding widens intervals"
        if cell["ratio"] >= 10 and cell["interval_s"] == INTERVALS[0]:
            yield naive < -4, f"{place}: normal noise holds the truth"
