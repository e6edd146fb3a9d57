"""Do the sets that SQP identifies lie in the posterior, and what does the posterior add to them?

Question: the thesis draws 50 identified sets of each vehicle and manoeuvre beside each other (chapter 7) and cannot say
which of them is right. What does the posterior of the same trial say of them, coefficient by coefficient and together?
Claim: from noisy readings nine searches of ten and more end in sets that fit as well as the posterior does. From the
exact track they do in the vertical plane; on the horizontal spiral fewer than half do, because the thesis's rule stops
them while the track is off by more than the noise would hide, and on the coupled one it depends on the boat. Either way
at least four fifths of the variance of the sets is along directions that the data do not see. Their scatter is no
standard error: it differs from the posterior standard deviation by a factor that differs two-fold and more from one
coefficient to another. What is known is the drag Xuu, always best and to 2 % of the prior's standard deviation or 0.5 %
of its value, and combinations of the others; the median coefficient keeps two fifths of its prior uncertainty and more.
A posterior that has not converged is marked and counts for none of this.
Cost: about a quarter of an hour on one core. A killed run continues with --resume: posteriors and searches are kept.

The trials are :func:`bayesub.thesis.cases.trial`: position noise of 0.5 m on a boat of suboff's length, in proportion
to length, and attitude noise of 0.1 degrees, sampled every second on suboff, in proportion to length over speed; the
prior is normal, 25 % about a guess 15 % off. SQP follows the thesis's rules (studies/baselines.py) on the exact track,
and on the noisy readings of the trial, weighted by their noise; the added masses that reduce the rank are known. A set
is inside where it lies within the 95 % of posterior draws that are nearest to their mean by Mahalanobis distance, that
fit best by chi-square, or that have the highest posterior density. Directions are those of the Fisher information at
the truth in prior standard deviations: null by the equations, sloppy where the singular value is not above one, the
others stiff.
"""

from itertools import product

import numpy as np
from scipy import linalg

import bayesub as bs
from bayesub import identifiability
from bayesub.model.coefficients import ADDED_MASSES
from bayesub.model.linear_form import linear_systems
from bayesub.plots import posterior as posterior_plot
from bayesub.plots import style
from bayesub.report.markdown import table
from bayesub.study.script import resumed
from bayesub.thesis import cases
from bayesub.thesis.cases import MANOEUVRES, SEED, VEHICLES
from bayesub.thesis.plots import posteriors as plots

N_SETS, MAX_ITERATIONS, MAX_STEPS = 50, 500, 20_000
QUICK = (5, 60, 400)
N_DRAWS = 4000  # of the posterior, whose fit is computed
REGION = 0.95
KNOWN = 0.1  # posterior sd over prior sd
TRADE_OFF = 0.9  # correlation
MOST, UNSEEN, DRAG, KEPT = 0.9, 0.8, 0.02, 0.4  # of the claim
CORNER = 8  # coefficients at most
SETS = {  # group of sets -> label, marker, colour
    "starts": ("starts of SQP", "o", "#909090"),
    "exact": ("SQP, exact track", "o", style.SQP),
    "noisy": ("SQP, noisy track", "s", style.NULL),
}
MEASURES = {
    "distance": "Mahalanobis distance\nover its 95 % limit",
    "chi_square": "excess chi-square\nover its 95 % limit",
    "density": "loss of log density\nover its 95 % limit",
}


def run(folder, *, quick, progress):
    """Every case; a posterior that has been sampled and searches that are done are read back."""
    pairs = [("npsauv", "horizontal")] if quick else list(product(VEHICLES, MANOEUVRES))
    numbers, pictures = {}, {}
    for pair in pairs:
        progress.stage(" ".join(pair))
        case = Case(folder, *pair, QUICK if quick else (N_SETS, MAX_ITERATIONS, MAX_STEPS), progress)
        numbers[" ".join(pair)] = case.numbers()
        pictures[case.title] = case.pictures()
        draw_case(folder, case, ("png",) if quick else ("png", "pdf"))
    draw(folder, numbers, pictures, ("png",) if quick else ("png", "pdf"))
    (folder / "posteriors.md").write_text("\n".join(tables(numbers)) + "\n")
    for name, case in numbers.items():
        if case["converged"]:
            check(name, case)
    return numbers


class Case:
    """One vehicle on one manoeuvre: posterior, SQP's sets, and the one seen with the eyes of the other."""

    def __init__(self, folder, vehicle, manoeuvre, effort, progress):
        n_sets, max_iterations, max_steps = effort
        self.name = f"{vehicle}_{manoeuvre}"
        self.problem = problem = cases.trial(vehicle, manoeuvre)
        file = folder / f"posterior_{self.name}.nc"
        self.posterior = cases.sampled(problem, file, max_steps=max_steps, progress=progress.update)
        self.title = f"{vehicle} {manoeuvre}" + ("" if self.posterior.converged else " (not converged)")
        found = resumed(folder / f"sets_{self.name}.json", lambda: searches(problem, n_sets, max_iterations))
        self.sets = {key: np.array(values) for key, values in found.items()} | {"truth": problem.reference[None]}
        self.spectrum = spectrum(problem)
        rows = np.random.default_rng(SEED).choice(len(self.posterior.draws), N_DRAWS)
        self.places = places(problem, self.posterior.draws[rows], self.sets)
        t = {key: problem.prior.standard(values) for key, values in self.sets.items()}
        self.along = {key: (values @ self.spectrum.directions.T).std(axis=0) for key, values in t.items()}
        draws = problem.prior.standard(self.posterior.draws)
        self.along["posterior"] = (draws @ self.spectrum.directions.T).std(axis=0)

    def numbers(self):
        """What is worth keeping, as JSON types."""
        posterior, channels = self.posterior, self.problem.record.channels
        off = self.problem.prior.standard(self.problem.reference)
        furthest = int(np.argmax(np.abs(off)))
        return {
            "names": list(posterior.names),
            "position_sd_m": float(channels[0].sd),
            "attitude_sd_deg": float(np.degrees(channels[-1].sd)),
            "n_readings": self.problem.record.n_readings,
            "converged": posterior.converged,
            "shortcomings": list(posterior.shortcomings),
            "rhat": float(posterior.rhat.max()),
            "ess": float(min(posterior.bulk_ess.min(), posterior.tail_ess.min())),
            "evaluations": posterior.evaluations,
            "seconds": posterior.seconds,
            "contraction": posterior.contraction.tolist(),
            "n_null": self.spectrum.n_null,
            "n_stiff": self.spectrum.n_informed,
            "furthest_from_prior": (posterior.names[furthest], float(off[furthest])),
            "inside": {g: {m: int(np.sum(v <= 1.0)) for m, v in found.items()} for g, found in self.places.items()},
            "places": {g: {m: v.tolist() for m, v in found.items()} for g, found in self.places.items()},
            "scatter": {group: shares(self.spectrum, self.along[group]) for group in SETS},
            "scatter_over_posterior": {group: self.relative(group) for group in ("exact", "noisy")},
            "scatter_sd": {group: float(np.linalg.norm(self.along[group])) for group in (*SETS, "posterior")},
            "trade_offs": [
                (posterior.names[i], posterior.names[j], float(posterior.correlation[i, j]))
                for i, j in strongest(posterior)[:10]
            ],
            "n_trade_offs": int(np.sum(np.abs(np.triu(posterior.correlation, 1)) > TRADE_OFF)),
        }

    def relative(self, group):
        """Scatter of the sets over posterior sd of each coefficient that SQP identifies: least, median, largest."""
        sets = self.sets[group]
        ratios = (sets.std(axis=0) / self.posterior.sd)[np.ptp(sets, axis=0) > 0.0]
        return [float(f(ratios)) for f in (np.min, np.median, np.max)]

    def pictures(self):
        """What figures of all cases need."""
        null = np.arange(self.problem.n_params) >= self.problem.n_params - self.spectrum.n_null
        return {
            "contraction": dict(zip(self.posterior.names, self.posterior.contraction, strict=True)),
            "correlation": (self.posterior.names, self.posterior.correlation),
            "scatter": (self.spectrum.singular_values, null, self.along),
            "places": self.places,
        }


def searches(problem, n_sets, max_iterations):
    """Starts and ends (n_sets, n_params) of SQP on the exact track, and its ends on the readings of the trial.

    The coefficients that SQP is told are at the truth.
    """
    boat, flown = problem.vehicle, problem.manoeuvre
    vehicle, manoeuvre = boat.name, flown.name
    exact, found = cases.identified(vehicle, manoeuvre, n_sets, max_iterations)
    prior, dt = bs.priors.relative_normal(0.25, boat.xi), problem.simulator.step
    noisy = bs.Problem(boat, flown, problem.record, free=exact.names, prior=prior, dt=dt)
    again = cases.identify(noisy, cases.streams(vehicle, manoeuvre)[0], n_sets, max_iterations)
    sets = {"starts": found.starts, "exact": found.solutions, "noisy": again.solutions}
    return {key: exact.coefficient_sets(values)[:, problem.columns].tolist() for key, values in sets.items()}


def spectrum(problem):
    """Fisher information of a trial at the truth, its null directions kept apart."""
    truth = bs.simulate(problem.vehicle, problem.manoeuvre, dt=problem.simulator.step)
    ranks = identifiability.rank(linear_systems(truth, free=problem.names), prefer=ADDED_MASSES)
    null = [vector for axis in ranks.values() for vector in axis.null_vectors]
    return identifiability.fisher(problem, problem.reference, null)


def places(problem, draws, sets):
    """How far out each group of sets (n, n_params) lies, group -> measure -> (n,), over the 95 % limit of the draws."""
    t = {key: problem.prior.standard(values) for key, values in ({"draws": draws} | sets).items()}
    found = {key: {"distance": mahalanobis(t["draws"], values)} for key, values in t.items()}
    for key, values in ({"draws": draws} | sets).items():
        fit = problem.misfit(values)[1]
        found[key] |= {"chi_square": fit, "density": fit + np.sum(t[key] ** 2, axis=1)}
    for measure in ("chi_square", "density"):
        best = min(values[measure].min() for values in found.values())
        for values in found.values():
            values[measure] = values[measure] - best
    limits = {measure: np.quantile(values, REGION) for measure, values in found.pop("draws").items()}
    return {g: {m: v / limits[m] for m, v in values.items()} for g, values in found.items()}


def mahalanobis(draws, points):
    """(n,) distances of points (n, n_params) from the mean of draws (n_draws, n_params) by their covariance."""
    root = linalg.cholesky(np.cov(draws.T), lower=True)
    return np.linalg.norm(linalg.solve_triangular(root, (points - draws.mean(axis=0)).T, lower=True), axis=0)


def shares(spectrum, along):
    """Shares of the variance of standard deviations along the directions (n_params,) by kind of direction."""
    n = len(spectrum.names) - spectrum.n_null
    bounds = {"stiff": (0, spectrum.n_informed), "sloppy": (spectrum.n_informed, n), "null": (n, len(spectrum.names))}
    return {kind: float(np.sum(along[a:b] ** 2) / np.sum(along**2)) for kind, (a, b) in bounds.items()}


def strongest(posterior):
    """Positions (n_pairs, 2) of the coefficients of each pair, the most correlated first."""
    pairs = np.transpose(np.triu_indices(len(posterior.correlation), 1))
    return pairs[np.argsort(-np.abs(posterior.correlation[tuple(pairs.T)]))]


def trading(posterior):
    """Positions of at most eight coefficients: those of the strongest correlations."""
    chosen = {}
    for pair in strongest(posterior).tolist():
        if len(chosen | dict.fromkeys(pair)) > CORNER:
            break
        chosen |= dict.fromkeys(pair)
    return np.sort(list(chosen))


def draw_case(folder, case, suffixes):
    """Coefficients and strongest trade-offs of one case."""
    problem, posterior = case.problem, case.posterior
    groups = [(SETS[key][0], case.sets[key], *SETS[key][1:]) for key in ("exact", "noisy")]
    for suffix in suffixes:
        file = folder / f"coefficients_{case.name}.{suffix}"
        plots.draw_coefficients(file, posterior, problem.prior, problem.reference, groups)
    chosen = trading(posterior)
    file = folder / f"trade_offs_{case.name}.png"
    posterior_plot.draw_corner(
        file, posterior, problem.prior, problem.reference, chosen=chosen, sets=case.sets["exact"]
    )


def draw(folder, numbers, pictures, suffixes):
    """The figures of all cases."""
    groups = SETS | {"posterior": ("posterior", "x", style.POSTERIOR)}
    marks = {"exact": ("SQP, exact track", "o", True), "noisy": ("SQP, noisy track", "s", False)}
    marks["truth"] = ("truth", "D", False)
    for suffix in suffixes:
        plots.draw_contraction(folder / f"contraction.{suffix}", {c: p["contraction"] for c, p in pictures.items()})
        plots.draw_scatter(folder / f"scatter.{suffix}", {c: p["scatter"] for c, p in pictures.items()}, groups)
        places = {c: p["places"] for c, p in pictures.items()}
        plots.draw_distances(folder / f"distances.{suffix}", places, marks, MEASURES)
        for vehicle in dict.fromkeys(name.split()[0] for name in numbers):
            own = {c: p["correlation"] for c, p in pictures.items() if c.startswith(vehicle)}
            plots.draw_correlations(folder / f"correlations_{vehicle}.{suffix}", own)


def tables(numbers):
    """Markdown."""
    yield "Posteriors. Stiff, sloppy and null directions of the Fisher information at the truth.\n"
    header = (
        "case",
        "noise (m, deg)",
        "coefficients",
        "stiff, sloppy, null",
        f"posterior sd below {KNOWN:.0%} of the prior's",
    )
    header += ("median", "R-hat", "least ESS", "simulations", "seconds")
    lines = []
    for name, case in numbers.items():
        contraction, n = np.array(case["contraction"]), len(case["names"])
        kinds = f"{case['n_stiff']}, {n - case['n_stiff'] - case['n_null']}, {case['n_null']}"
        lines.append(
            (
                marked(name, case),
                f"{case['position_sd_m']:.2g}, {case['attitude_sd_deg']:.2g}",
                n,
                kinds,
                np.sum(contraction < KNOWN),
                f"{np.median(contraction):.2f}",
                f"{case['rhat']:.4f}",
                f"{case['ess']:.0f}",
                case["evaluations"],
                f"{case['seconds']:.0f}",
            )
        )
    yield from table(header, lines)
    yield "\nSets of SQP inside the 95 % region of the posterior, by distance, by chi-square, by density.\n"
    header = ("case", "sets", "exact track", "noisy track", "truth", "truth furthest from the guess, prior sd")
    lines = []
    for name, case in numbers.items():
        counts = [", ".join(str(case["inside"][g][m]) for m in MEASURES) for g in ("exact", "noisy", "truth")]
        furthest, off = case["furthest_from_prior"]
        n_sets = len(case["places"]["exact"]["distance"])
        lines.append((marked(name, case), n_sets, *counts, f"{furthest} {off:+.1f}"))
    yield from table(header, lines)
    yield "\nShares of the scatter's variance along stiff, sloppy and null directions, and its size in prior sd.\n"
    header = ("case", *(label for label, _, _ in SETS.values()))
    lines = []
    for name, case in numbers.items():
        cells = []
        for group in SETS:
            parts = ", ".join(f"{share:.2g}" for share in case["scatter"][group].values())
            cells.append(f"{parts}; {case['scatter_sd'][group]:.2g}")
        lines.append((marked(name, case), *cells, f"{case['scatter_sd']['posterior']:.2g}"))
    yield from table((*header, "posterior, size"), lines)
    yield "\nScatter of the sets over posterior sd of each identified coefficient: least, median, largest.\n"
    lines = [
        (
            marked(name, case),
            *(", ".join(f"{ratio:.2g}" for ratio in found) for found in case["scatter_over_posterior"].values()),
        )
        for name, case in numbers.items()
    ]
    yield from table(("case", "exact track", "noisy track"), lines)
    yield f"\nTrade-offs: pairs of values correlated above {TRADE_OFF:g}, and the strongest.\n"
    lines = [
        (
            marked(name, case),
            case["n_trade_offs"],
            "; ".join(f"{a} {b} {correlation:+.3f}" for a, b, correlation in case["trade_offs"][:3]),
        )
        for name, case in numbers.items()
    ]
    yield from table(("case", "pairs", "strongest"), lines)


def marked(name, case):
    """The name of a case, which says so if its posterior has not converged."""
    return name if case["converged"] else f"{name}, NOT CONVERGED"


def check(name, case):
    """The claim, of one case whose posterior has converged."""
    n, inside = len(case["places"]["exact"]["distance"]), case["inside"]
    noisy, exact = (inside[group]["chi_square"] for group in ("noisy", "exact"))
    assert noisy >= MOST * n, f"{name}: {noisy} of {n} sets from noisy readings fit as well as the posterior"
    limits = {"vertical": (MOST * n, n), "horizontal": (0, 0.5 * n), "coupled": (0, n)}
    low, high = limits[name.split()[1]]
    assert low <= exact <= high, f"{name}: {exact} of {n} sets from the exact track fit as well as the posterior"
    for group in ("exact", "noisy"):
        stiff = case["scatter"][group]["stiff"]
        assert stiff < 1.0 - UNSEEN, f"{name}: {stiff:.0%} of the scatter ({group}) is along what the data see"
        least, _, largest = case["scatter_over_posterior"][group]
        assert largest > 2.0 * least, f"{name}: all coefficients scatter {least:.2g} to {largest:.2g} posterior sd"
    contraction = dict(zip(case["names"], case["contraction"], strict=True))
    best = min(contraction, key=contraction.get)
    assert best == "Xuu", f"{name}: {best} is the best known coefficient"
    assert contraction["Xuu"] < DRAG, f"{name}: Xuu keeps {contraction['Xuu']:.1%} of its prior sd"
    median = np.median(case["contraction"])
    assert median > KEPT, f"{name}: the median coefficient keeps {median:.0%} of its prior sd"
