"""What does rounding velocities to 1 cm/s and accelerations to 1 mm/s^2 do to coefficients from linear least squares?

Question: the thesis's section 9.6 finds coefficients up to 250 times too large and tracks reproduced. Is that noise?
Claim: it is bias. Rounding errors stand in the matrix as well as in the load, so that the mean error over 100 random
manoeuvres is many standard errors from zero, and classical 95 % intervals miss the truth far more often than 5 % of the
time. With the exact matrix and the same rounded load the bias is gone. Total least squares is no remedy: columns share
the velocities they are made of, and it takes their errors for independent.
Cost: two minutes.
"""

from functools import partial
from itertools import product
from operator import itemgetter

import numpy as np

import bayesub as bs
from bayesub.report import markdown
from rounding import plots, regression
from thesis import cases

N_MANOEUVRES, QUICK_MANOEUVRES = 100, 8
VELOCITY_RESOLUTION, ACCELERATION_RESOLUTION = 0.01, 0.001  # m/s, m/s^2 (thesis section 9.6)
# Each vehicle with these resolutions and with those that have the same relation to its speed and length as on suboff.
CASES = {
    f"{vehicle}, scaled" if scaled else vehicle: (vehicle, scaled)
    for vehicle, scaled in product(cases.VEHICLES, (False, True))
    if not (vehicle == "suboff" and scaled)
}
FIGURES = {
    "coverage": "Above, how often classical 95 % intervals hold the truth, coefficients in order, a column a case. "
    "Below, their bias over their scatter. Dashed: the same with an exact matrix.",
    "ratios_*": "{}: ratio to the truth of every coefficient, a dot a manoeuvre; marks at the edge are beyond it "
    "(thesis Figures 97 and 98).",
    "tracks": "How well the sets reproduce the manoeuvres from which they were identified (thesis Figure 99).",
}
ANSWER = """
Classical 95 % intervals hold the truth {*/fits/rounded/coverage; each median; min; percent; .0f} to
{*/fits/rounded/coverage; each median; max; percent; .0f} % of the time (the median coefficient's, by case). With an
exact matrix and the same rounded load it is {*/fits/rounded load only/coverage; each median; min; percent; .0f} to
{*/fits/rounded load only/coverage; each median; max; percent; .0f} %: rounding of the matrix is what biases.
"""


def compute(run):
    """Errors, standard errors and coverage of every coefficient, for each vehicle and pair of resolutions."""
    numbers, errors = {}, {}
    n = QUICK_MANOEUVRES if run.quick else N_MANOEUVRES
    boats = {case: bs.load_vehicle(vehicle) for case, (vehicle, _) in list(CASES.items())[: 1 if run.quick else None]}
    steps = {case: resolutions(boat, CASES[case][1]) for case, boat in boats.items()}
    parts = run.parts("trials", {case: partial(manoeuvres, boat, n, steps[case]) for case, boat in boats.items()})
    for case, boat in boats.items():
        trials = parts[case]["trials"]
        numbers[case] = {
            "velocity_resolution_mps": steps[case][0],
            "acceleration_resolution_mps2": steps[case][1],
        } | regression.summary(trials, boat.xi)
        errors[case] = regression.errors(trials, boat.xi)["rounded"].astype(np.float32)
    run.save_arrays("errors", **errors)
    return numbers


def resolutions(boat, scaled):
    """Resolutions of velocity and acceleration."""
    if not scaled:
        return VELOCITY_RESOLUTION, ACCELERATION_RESOLUTION
    suboff = bs.load_vehicle("suboff")
    ratio = boat.speed_mps / suboff.speed_mps
    return VELOCITY_RESOLUTION * ratio, ACCELERATION_RESOLUTION * (ratio**2 * suboff.length_m / boat.length_m)


def manoeuvres(boat, n, resolution):
    """The trials of a case."""
    return {"trials": list(regression.trials(boat, n, resolution, cases.held("coupled")))}


def file_of(case):
    """The name of a case in names of files."""
    return case.replace(", ", "_")


def draw(run, numbers):
    """Coefficients of each case, coverage and bias, tracks, and a table with a row a case."""
    plots.draw_coverage(run.figure("coverage"), numbers)
    plots.draw_tracks(run.figure("tracks"), numbers)
    cells = {
        "case": itemgetter("name"),
        "resolution": lambda r: (
            f"{100 * r['velocity_resolution_mps']:.3g} cm/s, {1000 * r['acceleration_resolution_mps2']:.3g} mm/s^2"
        ),
        "manoeuvres": itemgetter("n_manoeuvres"),
        "coefficients": lambda r: len(r["names"]),
        "biased": lambda r: n_biased(r, "rounded"),
        "biased, exact matrix": lambda r: n_biased(r, "rounded load only"),
        "biased, TLS": lambda r: n_biased(r, "total least squares"),
        "coverage: median (range)": lambda r: "{1:.0%} ({0:.0%} to {2:.0%})".format(*coverage(r, "rounded")),
        "coverage, exact matrix": lambda r: f"{coverage(r, 'rounded load only')[1]:.0%}",
        "ratios": lambda r: f"{r['ratios'][0]:.3g} to {r['ratios'][1]:.3g}",
        "track error, median (m)": track_error,
    }
    caption = (
        "Linear least squares on rounded data. Biased: mean error over the manoeuvres beyond four standard errors of\n"
        "that mean. Coverage: how often the classical 95 % interval of a coefficient holds the truth. Manoeuvres are\n"
        "left out whose rounded regressors depend on each other, so that none is unique (three of npsauv).\n"
    )
    run.page([caption, *markdown.columns(markdown.named(numbers), cells), *beyond(numbers)])
    for case, errors in run.load_arrays("errors").items():
        plots.draw_ratios(run.figure(f"ratios_{file_of(case)}"), numbers[case]["names"], numbers[case]["truth"], errors)


def beyond(numbers):
    """Coefficients whose ratios leave the range that the thesis prints for those that leave its plots."""
    low, high = cases.published()["rounding"]["ratios"]
    yield f"\nCoefficients with a ratio below {low:g} or above {high:g}, the ends of the thesis's range: the truth over"
    yield "the median size on its axis, and least and largest ratio. On suboff most are terms of the roll rate.\n"
    lines = []
    for case, result in numbers.items():
        names, truth = result["names"], np.array(result["truth"])
        extremes = np.array(result["fits"]["rounded"]["error_quartiles"])[[0, -1]]
        for k in np.flatnonzero(truth):
            ratios = np.sort(1.0 + extremes[:, k] / truth[k])
            if ratios[0] < low or ratios[1] > high:
                axis = [abs(t) for n, t in zip(names, truth, strict=True) if n[0] == names[k][0] and t != 0]
                lines.append((case, names[k], abs(truth[k]) / np.median(axis), *ratios))
    cells = [(case, name, f"{size:.2g}", f"{least:.3g}", f"{most:.3g}") for case, name, size, least, most in lines]
    yield from markdown.table(("case", "coefficient", "truth over its axis", "least", "largest"), cells)


def n_biased(result, fit):
    """Number of coefficients whose mean error is beyond four standard errors."""
    return np.sum(regression.biased(result["fits"][fit]))


def coverage(result, fit):
    """Least, median and largest coverage of a coefficient."""
    return np.quantile(result["fits"][fit]["coverage"], [0, 0.5, 1])


def track_error(result):
    """Median over the manoeuvres, and how many simulations failed."""
    errors = [error for error in result["position_m"] if error is not None]
    return f"{np.median(errors):.3g} ({len(result['position_m']) - len(errors)} failed)"


def claims(numbers):
    """Intervals miss the truth, and more coefficients are biased than with the exact matrix."""
    for case, result in numbers.items():
        yield coverage(result, "rounded")[1] < 0.5, f"{case}: half the 95 % intervals hold the truth"
        biased, control = (n_biased(result, fit) / len(result["names"]) for fit in ("rounded", "rounded load only"))
        sentence = f"{case}: {biased:.0%} of the coefficients are biased, {control:.0%} with the exact matrix"
        yield bool(biased > control), sentence
