"""When must a likelihood know that readings are rounded, and do its intervals then hold the truth?

Question: three treatments of the same readings are compared: the exact probability of a rounding interval, normal noise
with a twelfth of the squared step added, and linear least squares on the equations of motion.
Claim: with the probability of the interval, 95 % intervals hold the truth as often as they say within the error of
fifty trials, in twelve cases and for steps of 0.1 to 30 standard deviations. Coefficient by coefficient, normal noise
does as well for the thesis's and Autosub's sensors at a reading a second. It fails where readings are so frequent that
successive ones are rounded alike, so that their errors do not average out: at steps of thirty standard deviations four
times a second it holds the truth two times in three, and is eleven times wider than need be in some direction as well.
Least squares fails everywhere, because errors stand in its matrix.
Cost: about a quarter of an hour; finished parts are read back from their files.

In every trial the truth is a draw from the prior (25 % about the vehicle), so that Bayesian intervals ought to hold it
as often as they say, in directions that the data do not see as well. Posteriors are Laplace approximations, and
searches begin at the truth: the question is what the likelihoods say and not whether a search finds it. How often a
search from the centre of the prior ends elsewhere is counted apart. Linear least squares is told the true values of
the added masses that reduce the rank.

The thesis rounds exact velocities and accelerations, which have no likelihood. Here they have noise of a tenth of the
step first: little enough that nine readings in ten are what exact values would give.
"""

from itertools import product

import numpy as np
from scipy import linalg

import bayesub as bs
from bayesub.baselines import gauss_newton, linear_least_squares
from bayesub.checks.coverage import RepeatedTrials
from bayesub.model.coefficients import NAMES
from bayesub.model.linear_form import linear_systems
from bayesub.model.measured_motion import recorded
from bayesub.report.markdown import table
from bayesub.study.script import resumed
from bayesub.thesis.cases import published
from bayesub.thesis.plots import intervals as plots

SEED = 960
VEHICLES = ("suboff", "auv690", "npsauv")
MANOEUVRES = ("horizontal", "random:0")
PRESETS = {
    "thesis_rounding": lambda: bs.sensors.thesis_rounding(velocity_sd_mps=1e-3, acceleration_sd_mps2=1e-4),
    "autosub": bs.sensors.autosub,
}
PRIOR = bs.priors.relative_normal(0.25)
N_TRIALS = 50
N_FROM_CENTRE = 10  # trials of each case whose search is repeated from the centre of the prior
FITS = ("rounded", "normal", "linear")
SAMPLED = ("suboff", "horizontal")

# The controlled experiment: one noise, and steps that are multiples of it.
GRID_VEHICLE, GRID_MANOEUVRE = "suboff", "horizontal"
GRID_SDS = {"u_mps": 1e-3, "v_mps": 1e-3, "r_degps": 1e-2}
RATIOS = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
INTERVALS = (0.25, 1.0, 3.0, 10.0)  # s
N_GRID_TRIALS = 40
GRID_SAMPLED = ((10.0, 1.0), (30.0, 10.0))  # ratio, interval
DETERMINED = 0.5  # a coefficient is determined if the finest readings halve its prior sd


def run(folder, *, quick, progress):
    """Twelve cases, the controlled experiment, and the Laplace approximation against sampling."""
    held = published()["rank"]["fixed_added_mass"]
    pairs = list(product(VEHICLES[2:] if quick else VEHICLES, MANOEUVRES[:1] if quick else MANOEUVRES, PRESETS))
    n_trials, n_grid_trials = (6, 3) if quick else (N_TRIALS, N_GRID_TRIALS)
    progress.stage("cases")
    cases = {}
    for n, (vehicle, manoeuvre, preset) in enumerate(pairs):
        place = (VEHICLES.index(vehicle), MANOEUVRES.index(manoeuvre), list(PRESETS).index(preset))
        rng = np.random.default_rng([SEED, *place])
        case = Case(vehicle, manoeuvre, PRESETS[preset]())
        known = held["horizontal" if manoeuvre == "horizontal" else "coupled"]
        file = folder / f"{vehicle}_{manoeuvre.replace(':', '')}_{preset}.json"
        cases[f"{vehicle}, {manoeuvre}, {preset}"] = resumed(file, lambda: case.compare(rng, n_trials, known))  # noqa: B023
        progress.update((n + 1) / len(pairs), f"{vehicle}, {manoeuvre}, {preset}")
    progress.stage("steps and intervals")
    cells = list(product(RATIOS[::5], INTERVALS[3:]) if quick else product(RATIOS, INTERVALS))
    grid, chosen = [], determined()
    for n, (ratio, interval) in enumerate(cells):
        file = folder / f"step_{ratio:g}_interval_{interval:g}.json"
        grid.append(resumed(file, lambda: cell(ratio, interval, chosen, n_grid_trials)))  # noqa: B023
        progress.update((n + 1) / len(cells), f"step of {ratio:g} sd every {interval:g} s")
    progress.stage("sampling")
    wanted = {} if quick else {f"{', '.join(SAMPLED)}, {p}": Case(*SAMPLED, PRESETS[p]()) for p in PRESETS}
    wanted |= {} if quick else {f"step of {r:g} sd every {i:g} s": grid_case(r, i) for r, i in GRID_SAMPLED}
    sampled = {}
    for n, (name, case) in enumerate(wanted.items()):
        file = folder / f"sampled_{n}.json"
        sampled[name] = resumed(file, lambda: case.sampled(np.random.default_rng([SEED, n])))  # noqa: B023
        progress.update((n + 1) / len(wanted), name)

    for suffix in ("png", "pdf"):
        plots.draw_cases(folder / f"cases.{suffix}", cases)
        plots.draw_grid(folder / f"when_rounding_matters.{suffix}", grid)
    names = np.array(grid_case(RATIOS[0], INTERVALS[0]).problem.names)[chosen].tolist()
    numbers = {"cases": cases, "grid": grid, "determined": names, "sampled": sampled}
    (folder / "rounded.md").write_text(tables(numbers))
    check(numbers)
    return numbers


class Case:
    """A vehicle on a manoeuvre with sensors: what trials of it share."""

    def __init__(self, vehicle, manoeuvre, sensors):
        self.boat, self.sensors = bs.load_vehicle(vehicle), sensors
        self.manoeuvre = bs.load_manoeuvre(manoeuvre, self.boat)
        flown = bs.simulate(self.boat, self.manoeuvre)
        self.step = flown.simulator.step
        self.problem = self._problem(bs.observe(flown, sensors, None), NAMES)

    def _problem(self, record, names):
        return bs.Problem(self.boat, self.manoeuvre, record, free=names, prior=PRIOR, dt=self.step)

    def trial(self, rng):
        """A truth from the prior (n_params,) whose boat completes the manoeuvre, and the problem of its record."""
        while True:
            (truth,) = self.problem.prior.sample(rng, 1)
            flown = self.problem.trajectory(truth)
            if flown.status[0] == "ok":
                return truth, self._problem(bs.observe(flown, self.sensors, rng), self.problem.names)

    def linear(self, truth, problem, held):
        """Linear least squares on the readings of a trial, and where its coefficients stand among the free ones."""
        xi = problem.coefficient_sets(truth)[0]
        systems = linear_systems(recorded(problem.record, problem.simulator, xi), free=problem.names)
        found = linear_least_squares(systems, dict(zip(NAMES, xi, strict=True)), held=held)
        return found, np.array([problem.names.index(name) for name in found.names])

    def compare(self, rng, n_trials, held):
        """The three treatments of `n_trials` records."""
        errors, covariances = {fit: [] for fit in FITS}, {fit: [] for fit in FITS}
        same, statuses = [], []
        for n in range(n_trials):
            truth, problem = self.trial(rng)
            found = gauss_newton(problem, truth)
            linear, place = self.linear(truth, problem, held)
            for fit, estimate, columns in (
                ("rounded", found, slice(None)),
                ("normal", gauss_newton(problem.naive(), truth), slice(None)),
                ("linear", linear, place),
            ):
                errors[fit].append(estimate.values - truth[columns])
                covariances[fit].append(estimate.covariance)
            statuses.append(found.statuses[0] == "converged")
            if n < N_FROM_CENTRE:
                same.append(gauss_newton(problem).costs[0] < found.costs[0] + 0.1)
        names = dict.fromkeys(FITS[:2], self.problem.names) | {"linear": linear.names}
        return {
            "n_readings": problem.record.n_readings,
            "n_params": problem.n_params,
            "n_trials": n_trials,
            "converged": float(np.mean(statuses)),
            "found_from_centre": float(np.mean(same)),
            "fits": {
                fit: self.summary(names[fit], RepeatedTrials(np.array(errors[fit]), np.array(covariances[fit])))
                for fit in FITS
            },
        }

    def summary(self, names, trials):
        """Of each coefficient: bias, width and coverage; of all together: mean coverage and joint error."""
        scale = np.abs(self.boat.xi[bs.coefficients.columns(names)])
        squares = trials.standardised**2
        per_coefficient = {
            "coverage_95": trials.coverage(0.95),
            "coverage_50": trials.coverage(0.5),
            "bias_in_sd": trials.standardised.mean(axis=0),
            "rms_in_sd": np.sqrt(squares.mean(axis=0)),
            "bias_over_truth": trials.errors.mean(axis=0) / scale,
            "sd_over_truth": np.median(trials.sds, axis=0) / scale,
        }
        return {
            "names": list(names),
            **{key: [float(f"{v:.4g}") for v in values] for key, values in per_coefficient.items()},
            "mean_coverage_95": trials.mean_coverage(0.95),
            "mean_coverage_50": trials.mean_coverage(0.5),
            "joint": float(np.median(trials.joint)),
        }

    def sampled(self, rng):
        """Mean and sd of the rounding-aware posterior of one trial, by sampling and by the Laplace approximation."""
        truth, problem = self.trial(rng)
        laplace, posterior = gauss_newton(problem, truth), bs.sample(problem, rng=rng)
        sds = np.sqrt(np.diag(laplace.covariance))
        return {
            "names": list(problem.names),
            "shift_in_sd": ((laplace.values - posterior.mean) / posterior.sd).tolist(),
            "sd_ratio": (sds / posterior.sd).tolist(),
            "shortcomings": list(posterior.shortcomings),
            "seconds": posterior.seconds,
        }


def grid_case(ratio, interval):
    """Velocities and turn rate, rounded to `ratio` standard deviations every `interval` seconds."""
    sensors = [bs.sensors.Sensor(column, sd, ratio * sd, interval) for column, sd in GRID_SDS.items()]
    return Case(GRID_VEHICLE, GRID_MANOEUVRE, sensors)


def determined():
    """Which coefficients the finest readings of the controlled experiment determine, (n_params,) true or false."""
    problem = grid_case(RATIOS[0], INTERVALS[0]).problem
    found = gauss_newton(problem, problem.prior.mean)
    return np.sqrt(np.diag(found.covariance)) < DETERMINED * problem.prior.sd


def cell(ratio, interval, chosen, n_trials):
    """Both posteriors for one step and sampling interval: coverage, errors and widths of the `chosen` coefficients."""
    case = grid_case(ratio, interval)
    rng = np.random.default_rng([SEED, RATIOS.index(ratio), INTERVALS.index(interval)])
    errors, covariances = {fit: [] for fit in FITS[:2]}, {fit: [] for fit in FITS[:2]}
    for _ in range(n_trials):
        truth, problem = case.trial(rng)
        for fit, found in (("rounded", gauss_newton(problem, truth)), ("normal", gauss_newton(problem.naive(), truth))):
            errors[fit].append(found.values - truth)
            covariances[fit].append(found.covariance)
    result = {"ratio": ratio, "interval_s": interval, "n_readings": problem.record.n_readings, "n_trials": n_trials}
    widths = {}
    for fit in FITS[:2]:
        everything = RepeatedTrials(np.array(errors[fit]), np.array(covariances[fit]))
        some = RepeatedTrials(everything.errors[:, chosen], everything.covariances[:, chosen][:, :, chosen])
        widths[fit] = np.median(some.sds, axis=0)
        result[fit] = {
            "mean_coverage_95": some.mean_coverage(0.95),
            "rms_in_sd": float(np.sqrt(np.mean(some.standardised**2))),
            "joint": float(np.median(everything.joint)),
            "sd_over_prior": float(np.median(widths[fit] / case.problem.prior.sd[chosen])),
        }
    return result | {
        "width_ratio": float(np.median(widths["normal"] / widths["rounded"])),
        "largest_width_ratio": widest(covariances),
    }


def widest(covariances):
    """Median over trials of the ratio of the sds of both treatments in the direction in which it is largest."""
    pairs = zip(covariances["normal"], covariances["rounded"], strict=True)
    return float(np.median([np.sqrt(largest_ratio(*pair)) for pair in pairs]))


def largest_ratio(covariance, other):
    """The largest ratio of the variances of two covariances (n, n) over all directions."""
    scale = np.sqrt(np.outer(np.diag(other), np.diag(other)))
    return float(linalg.eigh(covariance / scale, other / scale, eigvals_only=True)[-1])


def check(numbers):
    """The claims. Means over coefficients are judged by their spread over the trials, four standard errors at most."""
    for name, case in numbers["cases"].items():
        for probability, key in ((0.95, "mean_coverage_95"), (0.5, "mean_coverage_50")):
            pairs = {fit: case["fits"][fit][key] for fit in FITS}
            off = deviation(pairs["rounded"], probability, case["n_params"] * case["n_trials"])
            assert abs(off) < 4, f"{name}: coverage of {probability:.0%} intervals is {off:.1f} standard errors off"
            change = pairs["normal"][0] - pairs["rounded"][0]
            assert abs(change) < 4 * max(pairs["rounded"][1], 1e-2), f"{name}: normal noise changes coverage"
            short = deviation(pairs["linear"], probability, case["n_params"] * case["n_trials"])
            assert short < -4, f"{name}: intervals of least squares hold the truth"
    n = len(numbers["determined"])
    for c in numbers["grid"]:
        place = f"step of {c['ratio']:g} sd every {c['interval_s']:g} s"
        off, naive = (deviation(c[fit]["mean_coverage_95"], 0.95, n * c["n_trials"]) for fit in FITS[:2])
        assert abs(off) < 4, f"{place}: coverage is {off:.1f} standard errors off"
        if c["ratio"] <= 1:
            assert c["largest_width_ratio"] < 1.01, f"{place}: fine rounding widens intervals"
        if c["ratio"] >= 10 and c["interval_s"] == INTERVALS[0]:
            assert naive < -4, f"{place}: normal noise holds the truth"


def deviation(pair, probability, n):
    """Mean coverage less what is claimed in standard errors, which are at least those of `n` independent intervals."""
    mean, error = pair
    return (mean - probability) / max(error, np.sqrt(probability * (1 - probability) / n))


def tables(numbers):
    """The cases, the controlled experiment and the check by sampling in Markdown."""
    lines = [
        "Coverage of the truth, mean over coefficients ± standard error (range over coefficients); error: root mean",
        "square in stated standard deviations; joint: median over trials of the squared error in all directions of the",
        "posterior; width: median sd of a coefficient, relative to the rounding-aware one.\n",
        *case_table(numbers["cases"]),
        "\nSearches that meet their tolerance; that end as well from the centre of the prior.\n",
        *table(
            ("case", "converged", "same from the centre"),
            [(name, f"{c['converged']:.0%}", f"{c['found_from_centre']:.0%}") for name, c in numbers["cases"].items()],
        ),
        f"\nControlled experiment: {GRID_VEHICLE}, {GRID_MANOEUVRE}, u and v (1 mm/s) and r (0.01 deg/s).\n",
        *grid_table(numbers["grid"]),
        "\nLaplace approximation against sampling, one trial of each.\n",
        *sampled_table(numbers["sampled"]),
    ]
    return "\n".join(lines) + "\n"


def percent(pair):
    """A mean and its standard error."""
    return f"{pair[0]:.1%} ± {pair[1]:.1%}"


def case_table(cases):
    lines = []
    for name, case in cases.items():
        aware = dict(zip(case["fits"]["rounded"]["names"], case["fits"]["rounded"]["sd_over_truth"], strict=True))
        for fit, r in case["fits"].items():
            width = np.median([sd / aware[k] for k, sd in zip(r["names"], r["sd_over_truth"], strict=True)])
            first = (name, f"{case['n_readings']}, {case['n_params']}, {case['n_trials']}")
            lines.append(
                (
                    *(first if fit == "rounded" else ("", "")),
                    plots.WORDS[fit],
                    f"{percent(r['mean_coverage_95'])} ({min(r['coverage_95']):.0%} to {max(r['coverage_95']):.0%})",
                    percent(r["mean_coverage_50"]),
                    f"{max(map(abs, r['bias_in_sd'])):.2f}",
                    f"{np.median(r['rms_in_sd']):.2f}, {max(r['rms_in_sd']):.2f}",
                    f"{r['joint']:.3g}",
                    f"{width:.3g}",
                )
            )
    for fit in FITS:
        pairs = np.array([case["fits"][fit]["mean_coverage_95"] for case in cases.values()])
        pooled = pairs[:, 0].mean(), np.linalg.norm(pairs[:, 1]) / len(pairs)
        lines.append(("all", "", plots.WORDS[fit], percent(pooled), *[""] * 5))
    header = ("case", "readings, coefficients, trials", "treatment", "95 % intervals", "50 % intervals")
    return table((*header, "bias, largest (sd)", "error: median, largest (sd)", "joint", "width"), lines)


def grid_table(grid):
    lines = []
    for r in grid:
        pairs = [(percent(r[fit]["mean_coverage_95"]), r[fit]["rms_in_sd"], r[fit]["joint"]) for fit in FITS[:2]]
        cells = [a if isinstance(a, str) else f"{a:.3g}" for both in zip(*pairs, strict=True) for a in both]
        widths = (f"{r[key]:.3g}" for key in ("width_ratio", "largest_width_ratio"))
        lines.append((f"{r['ratio']:g}", f"{r['interval_s']:g}", r["n_readings"], *cells, *widths))
    header = ("step / sd", "interval (s)", "readings", "95 % intervals, rounded", "normal")
    header += ("error (sd), rounded", "normal", "joint, rounded", "normal")
    return table((*header, "width, normal / rounded: median coefficient", "widest direction"), lines)


def sampled_table(sampled):
    lines = []
    for name, r in sampled.items():
        ratio = np.array(r["sd_ratio"])
        lines.append(
            (
                f"{name}{', NOT CONVERGED' if r['shortcomings'] else ''}",
                f"{np.abs(r['shift_in_sd']).max():.2f}",
                f"{np.median(ratio):.2f} ({ratio.min():.2f} to {ratio.max():.2f})",
                f"{r['seconds']:.0f}",
            )
        )
    header = ("case", "mode less mean, largest (sd)", "sd over sampled: median (range)", "sampling (s)")
    return table(header, lines)
