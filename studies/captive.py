"""Do captive model tests see what free flight cannot, and which of them are worth their hour?

Question: thesis chapter 10 holds the equations responsible, not the coefficients: in free flight sway and yaw go
together in a narrow band, in a tank with a rotating arm and a planar motion mechanism they do not. Is every coefficient
unique there, how well are they known for each hour, and what do ten runs add to a free trial?
Claim: of the 101 coefficients the forces of a usual tank determine 92, with condition numbers of ten at most; the other
nine multiply two rates of rotation and need a hexapod or a rotary balance. Ten runs that are chosen for a free trial
make more coefficients known to 5 % together with it than sixty at random without it. Where they are the prior of a free
trial, 90 % intervals hold 87 to 93 % of the coefficients of boats of the prior.
Cost: a quarter of an hour on two cores.

Forces at a prescribed motion are linear in the coefficients: the posterior of a table of runs is exact, without a
simulation. The balance errs by one per cent of the largest force of an axis, a tank makes ten runs an hour, the free
trial is the coupled manoeuvre on a tracking range, the prior is normal with 25 %.
"""

import tempfile
from dataclasses import replace
from functools import partial
from operator import itemgetter
from pathlib import Path

import numpy as np

import bayesub as bs
from bayesub.design.captive import known_by
from bayesub.inference.baselines import gauss_newton
from bayesub.report.markdown import columns, named
from captive import plots
from captive.runs import PER_HOUR, TEXTBOOK, TWO, Knowledge, Tank, catalogue, choose, write
from thesis import cases
from thesis.coverage import RepeatedTrials

SHARE, PRIOR_SD, SEED = 0.05, 0.25, 110
N_CHOSEN, N_FIRST, N_RANDOM, N_ORDERS, N_BOATS = 20, 10, 60, 20, 30
# Quick: half a minute, for posteriors of trials in six degrees of freedom.
QUICK = {"n_chosen": 2, "n_orders": 2, "n_boats": 1}
FULL = {"n_chosen": N_CHOSEN, "n_orders": N_ORDERS, "n_boats": N_BOATS}
PAIRS = (("Yrdot", "Nvdot"), ("Zqdot", "Mwdot"), ("Ypdot", "Kvdot"), ("Krdot", "Npdot"))  # of a symmetric added mass
ALL = (*TEXTBOOK, TWO)
ROUND_OFF = 1e-10  # of the largest singular value, of what is not unique
FIGURES = {
    "captive": "Coefficients known to 5 % against the hours of a tank: runs at random (median and range of twenty "
    "orders), the best ones one after the other, and the best ones after a free trial, whose count is that at zero "
    "hours. What flight does not see, a few runs bring.",
    "spectra": "Singular values of the equations of the worst axis, of columns scaled to unit length: forces of all "
    "runs of a tank, and those of the free trial's motion, if it were known exactly. The tank's span one decade.",
}
ANSWER = """
A usual tank determines {suboff/ranks/usual; .0f} of {suboff/ranks/of; .0f} coefficients of suboff, one that turns the
model about two axes at once all of them, with condition numbers of {*/condition/captive; min; .0f} to
{*/condition/captive; max; .0f}, against {*/condition/free; min; .0e} to {*/condition/free; max; .0e} of the coupled
manoeuvre along the directions that are unique there. A free trial alone makes
{suboff/known/after a free trial/0; .0f} of {suboff/n_coefficients; .0f} known to 5 %, ten chosen runs with it
{suboff/known/after a free trial/10; .0f}, sixty at random without it {suboff/random/60; .0f}.
"""


def compute(run):
    """Ranks, counts by hour, chosen runs, ties, and boats of the prior, by vehicle."""
    vehicles = ("npsauv",) if run.quick else cases.VEHICLES
    effort = QUICK if run.quick else FULL
    found = {}
    for vehicle in vehicles:
        run.progress.stage(f"{vehicle}: runs")
        found[vehicle] = run.part(
            f"runs_{vehicle}", partial(of_vehicle, vehicle, effort["n_chosen"], effort["n_orders"])
        )
        run.progress.stage(f"{vehicle}: boats")
        first = found[vehicle]["chosen"]["after a free trial"][:N_FIRST]
        boats = run.repeat(f"boats_{vehicle}", partial(of_boat, vehicle, first), effort["n_boats"])
        trials = RepeatedTrials(*(np.array([boat[key] for boat in boats]) for key in ("errors", "covariance")))
        share, error = trials.mean_coverage(0.9)
        known = np.mean([boat["known"] for boat in boats])
        stopped = [boat["status"] for boat in boats if not boat["status"].startswith("converged")]
        found[vehicle]["boats"] = {
            "n": len(boats),
            "coverage": share,
            "error": error,
            "known": float(known),
            "stopped": stopped,
        }
    return found


def free_names(boat):
    """The coefficients that are not zero."""
    return [name for name, value in zip(boat.equations.names, boat.xi, strict=True) if value]


def of_vehicle(vehicle, n_chosen, n_orders):
    """What captive runs say of one vehicle, without and with a free trial."""
    boat = bs.load_vehicle(vehicle)
    tank, names = Tank(boat, catalogue()), free_names(boat)
    scales = np.abs(boat.xi[boat.equations.columns(names)])
    rows = [tank.rows(k, names, scales) for k in range(len(tank.runs))]
    prior = Knowledge(PRIOR_SD**2 * np.eye(len(names)))
    trial = cases.trial(vehicle, "coupled", free=names)
    jacobian = trial.jacobian(boat.xi[trial.columns])
    flown = np.zeros((len(jacobian), len(names)))  # none of coefficients that play no part in the trial
    flown[:, [names.index(name) for name in trial.names]] = jacobian
    free = prior.after(np.linalg.qr(flown * scales, mode="r"))
    chosen, known = {}, {}
    for label, begin in (("best first", prior), ("after a free trial", free)):
        chosen[label], states = choose(begin, rows, n_chosen, SHARE)
        known[label] = {str(k): state.known(SHARE) for k, state in enumerate(states)}
    orders, counts = np.random.default_rng(SEED), []
    for _ in range(n_orders):
        state, one = prior, [prior.known(SHARE)]
        for k in orders.permutation(len(rows))[:N_RANDOM]:
            state = state.after(rows[k])
            one.append(state.known(SHARE))
        counts.append(one)
    low, middle, high = np.quantile(counts, [0.0, 0.5, 1.0], axis=0).tolist()
    return {
        "n_coefficients": len(names),
        "n_runs": len(rows),
        "ranks": {"usual": rank(tank.spectra(TEXTBOOK)), "all": rank(tank.spectra(ALL)), "of": len(boat.xi)},
        "condition": {"captive": condition(tank.spectra(ALL)), "free": condition(in_flight(trial, boat))},
        "spectra": {"captive": worst(tank.spectra(ALL)), "free": worst(in_flight(trial, boat))},
        "chosen": chosen,
        "words": {label: [tank.runs[k].words for k in some] for label, some in chosen.items()},
        "known": known,
        "random": {str(k): value for k, value in enumerate(middle)},
        "random_range": [low, high],
        "pairs": {f"{a}, {b}": tied(boat, names, scales, free, (a, b)) for a, b in PAIRS if {a, b} <= set(names)},
    }


def in_flight(trial, boat):
    """Axis -> singular values of the equations along the motion of the free trial, of columns of unit length."""
    systems = trial.linear_systems(boat.xi[trial.columns])
    return {
        axis: np.linalg.svd(s.matrix / np.linalg.norm(s.matrix, axis=0), compute_uv=False)
        for axis, s in systems.items()
    }


def rank(spectra):
    """How many coefficients of all axes the forces determine."""
    return int(sum(np.count_nonzero(s > ROUND_OFF * s[0]) for s in spectra.values()))


def condition(spectra):
    """The largest condition number of an axis, of the directions that are unique."""
    return float(max(s[0] / s[s > ROUND_OFF * s[0]].min() for s in spectra.values()))


def worst(spectra):
    """The singular values of the axis with the largest condition number."""
    return max(spectra.values(), key=lambda s: s[0] / s[-1]).tolist()


def tied(boat, names, scales, free, pair):
    """How far apart two added masses of the file are, and what a free trial leaves of their sds if they are equal."""
    first, second = (boat.xi[boat.equations.index[name]] for name in pair)
    row = np.zeros((1, len(names)))
    for name, sign in zip(pair, (1.0, -1.0), strict=True):
        row[0, names.index(name)] = sign * scales[names.index(name)] / (1e-6 * scales[names.index(pair[0])])
    with_tie, places = free.after(row), [names.index(name) for name in pair]
    return {
        "apart": float(abs(first - second) / max(abs(first), abs(second))),
        "sd": float(free.sds[places].max()),
        "sd_tied": float(with_tie.sds[places].max()),
        "known": with_tie.known(SHARE) - free.known(SHARE),
    }


def of_boat(vehicle, chosen, k):
    """A boat of the prior in the tank, by a table in CSV, and then on a free trial: errors, covariance, and counts."""
    boat, rng = bs.load_vehicle(vehicle), np.random.default_rng([SEED, cases.VEHICLES.index(vehicle), k])
    runs, names = catalogue(), free_names(boat)
    tank, places = Tank(boat, runs), boat.equations.columns(names)
    flown, status = bs.load_manoeuvre("coupled", boat), "none"
    while status != "ok":
        true = boat.xi.copy()
        true[places] *= 1.0 + PRIOR_SD * rng.standard_normal(len(names))
        one = replace(boat, xi=true)
        status = bs.simulate(one, flown).status[0]
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "captive.csv"
        write(table, tank, chosen, [tank.measure(j, true, rng) for j in chosen])
        known, _, _ = known_by(boat, table)
    prior = as_prior(boat, known)
    problem = cases.posed(one, flown, cases.tracking_range(boat), rng, model=boat, free=names, prior=prior)
    mode = gauss_newton(problem)  # from the posterior of the table
    scale = np.abs(true[problem.columns])
    relative = mode.covariance / np.outer(scale, scale)
    return {
        "errors": ((mode.values - true[problem.columns]) / scale).tolist(),
        "covariance": relative.tolist(),
        "known": Knowledge(relative).known(SHARE),
        "status": mode.statuses[0],
    }


def as_prior(boat, known):
    """The posterior of a table as the prior of a trial, with its correlations."""
    places = boat.equations.columns(known.names)
    xi, sd, correlation = boat.xi.copy(), np.full(len(boat.xi), np.nan), np.eye(len(boat.xi))
    xi[places], sd[places], correlation[np.ix_(places, places)] = known.mean, known.sd, known.correlation
    return bs.priors.from_vehicle(replace(boat, xi=xi, sd=sd, correlation=correlation))


def draw(run, numbers):
    """Counts by hour, and spectra."""
    plots.draw_known(run.figure("captive"), numbers, PER_HOUR)
    plots.draw_spectra(run.figure("spectra"), {vehicle: r["spectra"] for vehicle, r in numbers.items()})
    run.page(tables(numbers))


def tables(numbers):
    """Ranks and counts, chosen runs, ties, and coverage."""
    cells = {
        "vehicle": itemgetter("name"),
        "unique by a usual tank": lambda r: f"{r['ranks']['usual']} of {r['ranks']['of']}",
        "with two rotations at once": lambda r: f"{r['ranks']['all']}",
        "condition, tank": lambda r: f"{r['condition']['captive']:.2g}",
        "condition, free trial": lambda r: f"{r['condition']['free']:.1e}",
        "known to 5 %, free trial": lambda r: f"{r['known']['after a free trial']['0']} of {r['n_coefficients']}",
        "and ten runs": lambda r: r["known"]["after a free trial"].get(str(N_FIRST), ""),
        "ten runs alone": lambda r: r["known"]["best first"].get(str(N_FIRST), ""),
        "sixty at random": lambda r: f"{r['random'][str(N_RANDOM)]:.0f}",
    }
    yield from columns(named(numbers), cells)
    yield "\nThe ten runs that are best after a free trial, one after the other:\n"
    rows = [
        {"number": k + 1} | {vehicle: r["words"]["after a free trial"][k] for vehicle, r in numbers.items()}
        for k in range(min(N_FIRST, *(len(r["words"]["after a free trial"]) for r in numbers.values()), N_FIRST))
    ]
    yield from columns(rows, {key: itemgetter(key) for key in rows[0]})
    yield "\nAdded masses that are equal for a body in an ideal fluid: how far apart those of the file are, and their"
    yield "sds (of the value) after a free trial, without and with the equality:\n"
    rows = [
        {"vehicle": vehicle, "pair": pair} | one for vehicle, r in numbers.items() for pair, one in r["pairs"].items()
    ]
    cells = {
        "vehicle": itemgetter("vehicle"),
        "pair": itemgetter("pair"),
        "apart": lambda r: f"{r['apart']:.0%}",
        "sd": lambda r: f"{r['sd']:.1%}",
        "sd if equal": lambda r: f"{r['sd_tied']:.1%}",
        "more known to 5 %": itemgetter("known"),
    }
    yield from columns(rows, cells)
    yield "\nBoats of the prior: ten runs in the tank as the prior of a free trial:\n"
    cells = {
        "vehicle": itemgetter("name"),
        "boats": lambda r: r["boats"]["n"],
        "in 90 % intervals": lambda r: _share(r["boats"]["coverage"], r["boats"]["error"]),
        "known to 5 %": lambda r: f"{r['boats']['known']:.1f}",
    }
    yield from columns(named(numbers), cells)


def _share(coverage, error):
    return f"{coverage:.1%}" + (f" ± {error:.1%}" if error is not None else "")


def claims(numbers):
    """Unique, well-conditioned, worth their hours, and honest."""
    for vehicle, r in numbers.items():
        ranks = r["ranks"]
        yield ranks["usual"] == ranks["of"] - 9, f"{vehicle}: a usual tank determines {ranks['usual']} of {ranks['of']}"
        yield ranks["all"] == ranks["of"], f"{vehicle}: all runs determine {ranks['all']} of {ranks['of']}"
        condition = r["condition"]["captive"]
        yield condition < 15.0, f"{vehicle}: the condition number of the tank is {condition:.2g}"
        together, alone = r["known"]["after a free trial"].get(str(N_FIRST)), r["random"][str(N_RANDOM)]
        yield (
            together is None or together > alone,
            f"{vehicle}: ten with a trial {together}, sixty at random {alone:.0f}",
        )
        boats = r["boats"]
        yield not boats["stopped"], f"{vehicle}: {len(boats['stopped'])} searches: {next(iter(boats['stopped']), '')}"
        inside = abs(boats["coverage"] - 0.9) <= max(0.03, 3.0 * (boats["error"] or 0.0))
        yield boats["n"] < N_BOATS or inside, f"{vehicle}: 90 % intervals hold {boats['coverage']:.1%}"
