"""Which coefficients does a manoeuvre leave uncertain although they are unique, and why?

Question: chapter 6 of the thesis finds null spaces, section 7.8 ill-conditioning beside them. Which is which, how good
would sensors have to be, and what makes the difference: coefficients that do little, or errors that cancel?
Claim: null directions stay flat whatever the sensors, sloppy ones do not. Most coefficients would be known to 5 % if
they were alone, but fewer than half of those are in company: the others imitate them, so that a set whose force errors
are ten times their sum and more fits the horizontal track. The rest do too little. Xuu, the drag, is the best known and
known to 1 % everywhere.
Cost: about two minutes.

Readings are noise-free with the noise of the sensors as their weight, so nothing depends on a draw. A boat of length l
at speed u has its position read to 0.5 m * l / 102.26 m and its attitude to 0.1 degrees, once every l / u / 13.63: what
0.5 m, 0.1 degrees and 1 s are to suboff. The prior is 25 % about the truth.
"""

from itertools import product

import numpy as np

import bayesub as bs
from bayesub import identifiability
from bayesub.identifiability.profile import LEVEL_95
from bayesub.model.coefficients import ADDED_MASSES, NAMES
from bayesub.model.linear_form import linear_systems
from bayesub.plots import cancellation as cancellation_plot
from bayesub.plots import collinearity as collinearity_plot
from bayesub.plots import contribution as contribution_plot
from bayesub.plots import profile as profile_plot
from bayesub.plots import spectrum as spectrum_plot
from bayesub.report.markdown import table
from bayesub.thesis.cases import published

VEHICLES = ("suboff", "auv690", "npsauv")
MANOEUVRES = ("horizontal", "vertical", "coupled")
SUBOFF_LENGTH, SUBOFF_TIME = 102.2606, 102.2606 / 7.5  # m, and s to travel it
POSITION_SD, ATTITUDE_SD, INTERVAL = 0.5, 0.1, 1.0  # m, deg, s, on suboff
PRIOR_SD = 0.25
KNOWN = 0.05  # relative sd that counts as known
COST_INTERVAL = 0.1  # s, of the thesis's cost function
SQP_ITERATIONS = (50, 100, 200)
N_GRID = 17
SEED = 28
# A null profile rises by the square of what round-off moves the readings: 1e4 roundings of 1e-16 of 1 km over 0.5 m are
# 1e-9 sd at most, so 1e-18 a reading and 1e-14 over a few thousand.
FLAT = 1e-12
CANCELS = 10.0  # an order of magnitude; the thesis has 42 between its largest term and the sum


def run(folder, *, quick, progress):
    """Tables and figures of every vehicle and manoeuvre."""
    thesis = published()
    pairs = [("suboff", "horizontal")] if quick else list(product(VEHICLES, MANOEUVRES))
    progress.stage("ill-conditioning")
    cases = {}
    for n, pair in enumerate(pairs):
        progress.update(n / len(pairs), " ".join(pair))
        cases[" ".join(pair)] = Case(*pair, converged=max(thesis["sqp"]["horizontal"]["mean_converged_cost"]))
    progress.update(1.0, "figures")
    draw(folder, cases)
    (folder / "ill_conditioning.md").write_text(tables(cases, thesis["error_cancellation"]))
    for title, case in cases.items():
        check(title, case)
    return {title: case.numbers() for title, case in cases.items()}


class Case:
    """One vehicle on one manoeuvre: everything that is asked of it."""

    def __init__(self, vehicle, manoeuvre, converged):
        self.boat = bs.load_vehicle(vehicle)
        self.flown = bs.load_manoeuvre(manoeuvre, self.boat)
        self.size = self.boat.length_m / SUBOFF_LENGTH
        self.time = self.boat.length_m / self.boat.speed_mps / SUBOFF_TIME
        self.truth = bs.simulate(self.boat, self.flown)
        used = [name for system in linear_systems(self.truth).values() for name in system.names]
        self.problem = self.noise_free(used, POSITION_SD * self.size, ATTITUDE_SD, INTERVAL)
        self.names, self.values = self.problem.names, self.problem.prior.mean
        self.systems = linear_systems(self.truth, free=self.names)
        self.ranks = identifiability.rank(self.systems, prefer=ADDED_MASSES)
        self.null = [vector for axis in self.ranks.values() for vector in axis.null_vectors]
        self.spectrum = identifiability.fisher(self.problem, self.values, self.null)
        self.sharper = self.spectrum.sharper_sensors(KNOWN)
        self.collinearity = {
            axis: identifiability.collinearity(system, self.ranks[axis].null_vectors)
            for axis, system in self.systems.items()
        }
        self.contribution, self.accuracy = self.contributions()
        self.sqp_cost, self.cancellation = self.cancellations(converged)
        self.profiles = self.profile()

    def noise_free(self, free, position_sd, attitude_sd, interval, dt=None):
        """A problem whose readings are what the true coefficients give."""
        interval = self.flown.duration / round(self.flown.duration / (interval * self.time))
        track = bs.sensors.Track(position_sd, attitude_sd, interval)
        record = bs.observe(self.truth, track, np.random.default_rng(0))
        prior, dt = bs.priors.relative_normal(PRIOR_SD), dt or self.truth.simulator.step
        problem = bs.Problem(self.boat, self.flown, record, free=free, prior=prior, dt=dt)
        problem.readings = problem.predicted(problem.prior.mean)[0]
        return problem

    def contributions(self):
        """Cost in m^2 + deg^2 (model section 10) of one changed coefficient at a time, and of the time step."""
        problem = self.noise_free(self.names, 1.0, 1.0, COST_INTERVAL)
        fine = self.noise_free(self.names, 1.0, 1.0, COST_INTERVAL, dt=self.truth.simulator.step / 10)
        accuracy = np.sum(((problem.readings - fine.readings) / problem.sds) ** 2)
        return identifiability.contribution(problem, self.values), float(accuracy)

    def cancellations(self, converged):
        """Force errors of a set that SQP stopped at, the rank-reducing added masses known, and its cost.

        The search is given more iterations until its cost is that of the thesis's converged sets (in m^2 scaled to
        suboff), because on noise-free readings it would in the end find the truth.
        """
        pivots = {name for axis in self.ranks.values() for name in axis.pivots}
        problem = self.noise_free([n for n in self.names if n not in pivots], self.size, 1.0, INTERVAL)
        for n_iterations in SQP_ITERATIONS:
            rng = np.random.default_rng(SEED)
            found = bs.baselines.sqp(problem, rng=rng, n_starts=1, max_iterations=n_iterations)
            cost = found.costs[0] * INTERVAL / COST_INTERVAL
            if cost < converged:
                break
        changes = dict(zip(problem.names, found.values - problem.prior.mean, strict=True))
        return float(cost), {a: identifiability.cancellation(s, changes) for a, s in self.systems.items()}

    def profile(self):
        """Profile likelihoods of the coefficients with the extreme verdicts."""
        s = self.spectrum
        relative = s.cramer_rao_sd / np.abs(self.values)
        unique = np.isfinite(relative)
        chosen = {
            "best known": np.argmin(relative),
            "most imitated": np.argmax(np.where(unique, s.cramer_rao_sd / s.alone_sd, 0.0)),
            "worst known": np.argmax(np.where(unique, relative, 0.0)),
        }
        if s.n_null:
            chosen["null direction"] = np.argmax(s.null_part)
        steps = np.linspace(-1.0, 1.0, N_GRID)
        profiles = {}
        for title, k in chosen.items():
            reach = min(4.0 * s.cramer_rao_sd[k], 0.75 * abs(self.values[k]))
            grid = self.values[k] + reach * steps
            profiles[title] = identifiability.profile(self.problem, self.values, self.names[k], grid, null=self.null)
        return profiles

    def relative(self, sd):
        return sd / np.abs(self.values)

    def numbers(self):
        """What is worth keeping, as JSON types; null stands for infinite."""
        s = self.spectrum
        columns = {
            "alone": self.relative(s.alone_sd),
            "cramer_rao": self.relative(s.cramer_rao_sd),
            "null_held": self.relative(s.held_sd),
            "posterior": self.relative(s.posterior_sd),
            "null_part": s.null_part,
            "sharper_sensors": self.sharper,
            "cost_at_25_percent": self.contribution.costs[0],
            "cost_at_99_percent": self.contribution.costs[1],
        }
        return {
            "n_params": len(self.names),
            "n_null": s.n_null,
            "n_sharpened": s.n_informed,
            "singular_values": s.singular_values.tolist(),
            "coefficients": {
                name: {key: finite(column[k]) for key, column in columns.items()} for k, name in enumerate(self.names)
            },
            "condition_index": {axis: float(c.condition_indices[-1]) for axis, c in self.collinearity.items()},
            "vif": {n: finite(v) for c in self.collinearity.values() for n, v in zip(c.names, c.vif, strict=True)},
            "simulator_cost": self.accuracy,
            "sqp_cost": self.sqp_cost,
            "largest_force_errors": {axis: c.largest for axis, c in self.cancellation.items()},
            "largest_sum": {axis: float(np.abs(c.total).max()) for axis, c in self.cancellation.items()},
            "profiles": {
                title: {"name": p.name, "grid": p.grid.tolist(), "cost": [finite(c) for c in p.cost]}
                for title, p in self.profiles.items()
            },
        }


def finite(value):
    return float(value) if np.isfinite(value) else None


def check(title, case):
    """The claims, one by one."""
    s, profiles = case.spectrum, case.profiles
    best = case.names[np.argmin(case.relative(s.posterior_sd))]
    assert best == "Xuu", f"{title}: the best known coefficient is {best}, not Xuu"
    assert case.relative(s.posterior_sd)[case.names.index("Xuu")] < 0.01, f"{title}: Xuu is not known to 1 %"

    # Null and sloppy are two verdicts: the one is flat to round-off, the other rises above it.
    rise = {name: np.nanmax(p.cost) for name, p in profiles.items()}
    assert rise["best known"] > LEVEL_95, f"{title}: the profile of Xuu does not reach the 95 % level"
    assert rise["worst known"] > FLAT, f"{title}: {profiles['worst known'].name} is flat but not null"
    if s.n_null:
        name = profiles["null direction"].name
        assert rise["null direction"] < FLAT, f"{title}: {name} is null but costs {rise['null direction']:.1e}"
        assert np.all(np.isinf(s.cramer_rao_sd) == (s.null_part > 0)), f"{title}: a null coefficient has a finite bound"
    null, sloppy = s.singular_values[len(s.names) - s.n_null :], s.singular_values[len(s.names) - s.n_null - 1]
    assert np.all(null < 1e-3 * sloppy), f"{title}: no gap between null {null} and sloppy {sloppy:.1e}"

    # Company, more than little contribution, is the reason.
    alone, company = (np.mean(case.relative(sd) < KNOWN) for sd in (s.alone_sd, s.posterior_sd))
    assert alone > 0.5, f"{title}: only {alone:.0%} of the coefficients would be known alone"
    assert company < 0.5 * alone, f"{title}: {company:.0%} are known in company, of {alone:.0%} alone"
    if title == "suboff horizontal":
        for axis, c in case.cancellation.items():
            assert c.ratio > CANCELS, f"{title}: the largest error of {axis} is only {c.ratio:.1f} times the sum"


def draw(folder, cases):
    """All figures; those of suboff's horizontal manoeuvre as PDF too."""
    n_columns = min(len(cases), len(MANOEUVRES))
    spectrum_plot.draw_cases(folder / "spectra.png", {t: c.spectrum for t, c in cases.items()}, n_columns)
    for manoeuvre in MANOEUVRES:
        alike = {t.split()[0]: c for t, c in cases.items() if t.endswith(manoeuvre)}
        if alike:
            contribution_plot.draw(
                folder / f"contribution_{manoeuvre}.png",
                {t: c.contribution for t, c in alike.items()},
                {t: c.accuracy for t, c in alike.items()},
                NAMES,
            )
    surge = {t: linear_systems(c.truth)["X"] for t, c in cases.items() if t.endswith("horizontal")}
    collinearity_plot.draw_scatter(folder / "regressors.png", surge, [("Xvr", "Xrr"), ("Xvr", "Xvv")])
    for title, case in cases.items():
        stem = title.replace(" ", "_")
        for kind in (".png", ".pdf") if title == "suboff horizontal" else (".png",):
            spectrum_plot.draw_directions(folder / f"directions_{stem}{kind}", case.spectrum)
            profile_plot.draw(folder / f"profiles_{stem}{kind}", case.profiles)
        collinearity_plot.draw_correlation(folder / f"correlation_{stem}.png", case.collinearity)
        cancellation_plot.draw(folder / f"cancellation_{stem}.png", case.truth.times, case.cancellation)


def tables(cases, thesis):
    """Every table, in Markdown."""
    parts = [
        "Directions in prior standard deviations: sharpened (data sharper than the prior), left to the prior, and null "
        "by the equations. Coefficients known to 5 %: alone with all others given, and in company with the prior.",
        joined(
            "case | free | sharpened | left to the prior | null | sloppiest data sd (prior sd) | "
            "known alone | known in company | largest condition index | cost of SQP set",
            [summary(title, case) for title, case in cases.items()],
        ),
        "Largest force errors of a set that SQP stopped at, in N or N m (thesis Table 28: "
        f"Xvv {thesis['Xvv']}, Xvr and Xrr {thesis['Xvr_or_Xrr_a']} and {thesis['Xvr_or_Xrr_b']}, "
        f"sum {thesis['total_X']} N on its submarine 1).",
        joined("case | axis | three largest terms | largest sum | ratio", cancellation_rows(cases)),
        "Collinearity of the regressors, null directions apart (Belsley): coefficients that get more than half of "
        "their variance from the worst dependency.",
        joined(
            "case | axis | columns | null | largest condition index | involved | largest finite VIF", belsley(cases)
        ),
    ]
    for title, case in cases.items():
        parts += [
            f"{title}: relative standard deviations in %, by the posterior's. Alone: all others known. Data: "
            "Cramer-Rao bound without a prior. Null held: the same with the null directions held. Sensors: factor by "
            f"which all noise must fall for {100 * KNOWN:g} %. At 25 and 99 %: cost in m^2 + deg^2; the simulator has "
            f"{case.accuracy:.2g}.",
            joined(
                "coefficient | alone | data | null held | with prior | null part | sensors | at 25 % | at 99 %",
                coefficient_rows(case),
            ),
        ]
    return "\n\n".join(parts) + "\n"


def joined(header, rows):
    """A table in one text."""
    return "\n".join(table(header.split(" | "), rows))


def summary(title, case):
    s, n = case.spectrum, len(case.names)
    worst = max(c.condition_indices[-1] for c in case.collinearity.values())
    counts = (n, s.n_informed, n - s.n_informed - s.n_null, s.n_null)
    known = (np.count_nonzero(case.relative(sd) < KNOWN) for sd in (s.alone_sd, s.posterior_sd))
    sloppiest = 1.0 / s.singular_values[n - s.n_null - 1]
    return [title, *map(str, counts), f"{sloppiest:.2g}", *map(str, known), f"{worst:.2g}", f"{case.sqp_cost:.2g}"]


def cancellation_rows(cases):
    for title, case in cases.items():
        for axis, c in case.cancellation.items():
            terms = ", ".join(f"{name} {size:.3g}" for name, size in list(c.largest.items())[:3])
            yield [title, axis, terms, f"{np.abs(c.total).max():.3g}", f"{c.ratio:.2g}"]


def belsley(cases):
    for title, case in cases.items():
        for axis, c in case.collinearity.items():
            n_null = len(c.names) - len(c.condition_indices)
            finite_vif = c.vif[np.isfinite(c.vif)]
            vif = f"{finite_vif.max():.2g}" if finite_vif.size else "none"
            involved = ", ".join(c.involved(-1))
            yield [
                title,
                axis,
                f"{len(c.names)}",
                f"{n_null}",
                f"{c.condition_indices[-1]:.2g}",
                involved,
                vif,
            ]


def coefficient_rows(case):
    s = case.spectrum
    for k in np.argsort(case.relative(s.posterior_sd)):
        percent = [100 * case.relative(sd)[k] for sd in (s.alone_sd, s.cramer_rao_sd, s.held_sd, s.posterior_sd)]
        sharper = case.sharper[k]
        sensors = "never" if np.isinf(sharper) else f"{sharper:.2g}"
        if np.isfinite(sharper) and s.null_part[k] > 0.0:
            sensors += " and the prior"
        cells = ["infinite" if np.isinf(value) else f"{value:.2g}" for value in percent]
        costs = [f"{cost:.2g}" for cost in case.contribution.costs[:, k]]
        yield [case.names[k], *cells, f"{s.null_part[k]:.2g}", sensors, *costs]
