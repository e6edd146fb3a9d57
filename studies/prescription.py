"""Does what a report prescribes keep what it promises?

Question: after a run, bayesub says what the trial again, one more instrument, another manoeuvre or a value from a
towing tank would leave of the sds of what is asked for, by exact Jacobians at the posterior mean. Boats of the prior
are flown, fitted, prescribed for, flown again as prescribed, and fitted with both trials. Are the promises kept? And
does a trial that is designed to tell two sets of equations apart, one without the drag of sway, tell them apart?
Claim: for nine boats in ten the sds that are reached are within 10 % of the promised ones, in the mean over the five
coefficients asked for, whichever way is gone; and nine single sds in ten are within 20 %. The share of boats that a
trial tells from boats of the other equations is the promised power or more, less 10 % at most, and the designed trial
tells more of them than a zig-zag.
Cost: ten minutes on two cores.
"""

from dataclasses import replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import bayesub as bs
from bayesub.design.information import distance
from bayesub.design.judge import Judge
from bayesub.design.knowledge import KnownBefore
from bayesub.design.limits import N_DRAWS, Range, usual_limits
from bayesub.design.plan import N_JUDGED, Plan, best, families, with_manoeuvre
from bayesub.design.prescription import AGAIN, TANK_SD, further_instruments, prescribe
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem import priors
from bayesub.report import markdown
from bayesub.report.plots import style
from bayesub.sensors import flat
from bayesub.sensors.sensor import channel_name

VEHICLE, PLANE, PRIOR_SD, SEED = "suboff", "horizontal", 0.25, 43
PRIOR = priors.relative_normal(PRIOR_SD)
SENSORS = (bs.sensors.Track(0.5, 0.1, interval_s=1.0, channels=("x", "y", "yaw")),)
STEP_S, FINER = 0.5, 10  # of the fits, and steps of the truth in one of them
N_BOATS = 20
KEPT, SINGLE, SHARE = 0.10, 0.20, 0.9  # how far a mean, and a single sd, may be off; for how many
WAYS = {"again": "trial again", "instrument": "the same with", "manoeuvre": "another manoeuvre", "tank": "from a tank"}
LABELS = WAYS | {"instrument": "the same with an instrument", "tank": "a value from a tank"}
# Of telling boats apart, those of the vehicle from those that lack a term; one in a hundred of the latter is mistaken.
LACKS, ZIGZAG, N_APART, FALSE = "Xvv", "zigzag_20_20", 200, 0.01
FIGURES = {
    "prescription": "Sds that are reached over those that are promised, a dot a coefficient of a boat, by the way that "
    "is gone. Grey: within ten per cent. Bars: the mean of the five of each boat, from 5 to 95 % of the boats.",
}
ANSWER = """
The trial again reaches {ways/again/mean; .2f} of the promised sd in the median boat, another manoeuvre
{ways/manoeuvre/mean; .2f}; another manoeuvre leaves {ways/manoeuvre/left; percent; .0f} % of the sds of now, the trial
again {ways/again/left; percent; .0f} %, an instrument {ways/instrument/left; percent; .0f} %.
"""


def compute(run):
    """Promised and reached sds of each boat, by way."""
    n = 1 if run.quick else N_BOATS
    ways = ("again", "tank") if run.quick else tuple(WAYS)
    rows = run.repeat("boats", partial(boat, ways), n)
    numbers = {}
    for way in ways:
        ratios = np.array([row[way]["ratios"] for row in rows])
        means = np.exp(np.log(ratios).mean(axis=1))
        numbers[way] = {
            "mean": float(np.median(means)),
            "means": means.tolist(),
            "ratios": ratios.tolist(),
            "boats_kept": float(np.mean(np.abs(means - 1.0) <= KEPT)),
            "sds_kept": float(np.mean(np.abs(ratios - 1.0) <= SINGLE)),
            "left": float(np.median([row[way]["left"] for row in rows])),
        }
    converged = float(np.mean([one["converged"] for row in rows for one in row.values()]))
    result = {"n_boats": n, "ways": numbers, "converged": converged}
    return result if run.quick else result | {"apart": told_apart(run)}


def told_apart(run):
    """Trial -> promised power, and that measured with flown boats of either kind."""
    (design,) = run.repeat("apart_design", apart_design, 1)
    rows = run.repeat("apart", partial(differences, design), N_APART)
    numbers = {"lacks": LACKS, "n_boats": N_APART, "trials": {}}
    for trial, promised in design["promised"].items():
        own, others = (np.array([row[trial][kind] for row in rows]) for kind in ("boat", "rival"))
        measured = float(np.mean(own > np.quantile(others, 1.0 - FALSE)))
        numbers["trials"][trial] = promised | {"measured": measured}
    return numbers


def judges_apart():
    """The judge of manoeuvres of the vehicle that tells it from the rival, and the vehicles by kind."""
    vehicle = bs.load_vehicle(VEHICLE)
    xi = vehicle.xi.copy()
    xi[vehicle.equations.columns([LACKS])] = 0.0
    vehicles = {"boat": vehicle, "rival": replace(vehicle, xi=xi)}
    judge, rival = (Judge(one, flat(SENSORS), free_of(one), PRIOR, subproblem=PLANE) for one in vehicles.values())
    step = judge.accurate_step(bs.load_manoeuvre(ZIGZAG, vehicle))
    return replace(judge, step_s=step, rival=replace(rival, step_s=step)), vehicles


def free_of(vehicle):
    """The coefficients of the plane that a vehicle has."""
    return tuple(name for name in HORIZONTAL if vehicle.xi[vehicle.equations.columns([name])[0]] != 0.0)


def apart_design(_):
    """Kind and numbers of the manoeuvre that tells most, and what it and the zig-zag promise."""
    judge, vehicles = judges_apart()
    vehicle, limits = vehicles["boat"], usual_limits(vehicles["boat"])
    kinds = families(vehicle, limits, (), PLANE)
    rng = np.random.default_rng([SEED, 1])
    sets = np.array([of_prior(vehicle, judge.names, None, rng) for _ in range(N_DRAWS)])
    # Power is that of the boats of the prior on average: the goal is averaged over some.
    judge = replace(judge, draws=sets[:4])
    with TemporaryDirectory() as costs:
        plan = Plan(judge, Range(vehicle, limits, sets, PLANE, judge.step_s), kinds, distance, 1, SEED, Path(costs))
        *_, (_, searches) = plan.stages((N_JUDGED, 0))
    kind = best(searches)
    (designed,) = plan.cost(kind).manoeuvres(searches[kind].numbers)
    zigzag, promised = bs.load_manoeuvre(ZIGZAG, vehicle), {}
    for name, manoeuvre in (("zig-zag", zigzag), ("designed", designed)):
        told = replace(judge, draws=sets).information(manoeuvre)
        promised[name] = {
            "sds": float(np.median([np.sqrt(one.apart) for one in told])),
            "promised": float(np.mean([one.power for one in told])),
        }
    return {"kind": kind, "numbers": searches[kind].numbers.tolist(), "promised": promised}


def differences(design, k):
    """Trial -> kind of boat -> by how much worse the rival's equations fit its record, as minus twice log densities."""
    _, vehicles = judges_apart()
    rng = np.random.default_rng([SEED, 2, k])
    vehicle = vehicles["boat"]
    family = families(vehicle, usual_limits(vehicle), (), PLANE)[design["kind"]]
    manoeuvres = {"zig-zag": bs.load_manoeuvre(ZIGZAG, vehicle), "designed": family.manoeuvre(design["numbers"])}
    result = {}
    for trial, manoeuvre in manoeuvres.items():
        flown, result[trial] = replace(manoeuvre, subproblem=PLANE), {}
        for kind, true in vehicles.items():
            xi = of_prior(true, free_of(true), flown, rng)
            motion = bs.simulate(replace(true, xi=xi), flown, dt=STEP_S / FINER)
            record, costs = bs.observe(motion, SENSORS, rng), {}
            for fitted, own in vehicles.items():
                problem = bs.Problem(own, flown, record, free=free_of(own), prior=PRIOR, dt=STEP_S)
                costs[fitted] = float(bs.baselines.posterior_mode(problem, rng=rng).costs[0])
            result[trial][kind] = costs["rival"] - costs["boat"]
    return result


def boat(ways, k):
    """Way -> promised and reached sds, of a boat."""
    rng = np.random.default_rng([SEED, k])
    vehicle = bs.load_vehicle(VEHICLE)
    free = free_of(vehicle)
    spiral = replace(bs.load_manoeuvre(PLANE, vehicle), subproblem=PLANE)
    truth = of_prior(vehicle, free, spiral, rng)
    pose = partial(posed, vehicle, truth, free)
    first = pose(spiral, SENSORS, rng)
    posterior = bs.sample(first, rng=rng)
    known = KnownBefore.by(posterior, vehicle)
    judge = Judge(known.vehicle(vehicle), flat(SENSORS), known.names, PRIOR, subproblem=PLANE, step_s=STEP_S)
    judge = known.judge(judge)
    found, limits = prescribe(judge, spiral), usual_limits(vehicle)
    trials = {AGAIN: (spiral, SENSORS)}
    if "manoeuvre" in ways:
        flights = Range(judge.vehicle, limits, known.sets(judge.vehicle, N_DRAWS, rng), PLANE, STEP_S)
        found, manoeuvre = with_manoeuvre(found, families(vehicle, limits, (), PLANE), flights, k)
        trials["another manoeuvre"] = replace(manoeuvre, subproblem=PLANE), SENSORS
    for name, sensors in further_instruments(judge).items():
        channels = {channel_name(sensor.quantity) for sensor in sensors}
        kept = [sensor for sensor in flat(SENSORS) if channel_name(sensor.quantity) not in channels]
        trials[f"the same with {name}"] = spiral, (*kept, *sensors)
    result = {}
    for words, promised in found.after.items():
        kind = next(kind for kind, beginning in WAYS.items() if beginning in words)
        if kind not in ways:
            continue
        if kind == "tank":
            problem = measured_too(first, words.split()[0], truth, rng)
        else:
            trial = trials[words.split(" (")[0]]
            problem = bs.JointProblem({"first": first, "second": pose(*trial, rng)})
        after = bs.sample(problem, rng=rng)
        places = [after.names.index(one.name) for one in found.asked]
        result[kind] = {
            "way": words,
            "asked": [one.name for one in found.asked],
            "ratios": (after.sd[places] / promised).tolist(),
            "left": float(np.exp(np.mean(np.log(promised / found.before)))),
            "converged": posterior.converged and after.converged,
        }
    return result


def of_prior(vehicle, free, manoeuvre, rng):
    """Coefficients (n_terms,) of a boat of the prior that completes a manoeuvre, if one is given."""
    columns = vehicle.equations.columns(free)
    while True:
        xi = vehicle.xi.copy()
        (xi[columns],) = PRIOR.on(columns, xi, vehicle.equations).sample(rng, 1)
        if manoeuvre is None or bs.simulate(replace(vehicle, xi=xi), manoeuvre).status[0] == "ok":
            return xi


def posed(vehicle, truth, free, manoeuvre, sensors, rng):
    """The problem of the record that a boat leaves, which is flown with a finer step."""
    motion = bs.simulate(replace(vehicle, xi=truth), manoeuvre, dt=STEP_S / FINER)
    return bs.Problem(vehicle, manoeuvre, bs.observe(motion, sensors, rng), free=free, prior=PRIOR, dt=STEP_S)


def measured_too(problem, name, truth, rng):
    """The problem with a value from a towing tank, which the prior of the coefficient takes in."""
    vehicle, k = problem.vehicle, problem.equations.index[name]
    sds = np.array([PRIOR_SD * abs(vehicle.xi[k]), TANK_SD * abs(truth[k])])
    values = np.array([vehicle.xi[k], truth[k] + sds[1] * rng.standard_normal()])
    weights = sds**-2
    both = priors.normal(float(weights @ values / weights.sum()), float(weights.sum() ** -0.5))
    return bs.Problem(
        vehicle,
        problem.manoeuvre,
        problem.record,
        free=problem.names,
        prior=priors.Given(PRIOR, {name: both}),
        dt=STEP_S,
    )


def draw(run, numbers):
    """A dot a coefficient of a boat, and a table with a row a way."""
    ways = list(numbers["ways"])
    rng = np.random.default_rng(0)
    with style.figure(run.figure("prescription"), 7.2, 0.9 + 0.62 * len(ways)) as figure:
        axis = figure.subplots()
        axis.axvspan(1.0 - KEPT, 1.0 + KEPT, color="0.9", zorder=0)
        for row, way in enumerate(ways):
            ratios, means = np.array(numbers["ways"][way]["ratios"]), np.array(numbers["ways"][way]["means"])
            heights = row + 0.15 + 0.2 * rng.random(ratios.size)
            axis.plot(ratios.ravel(), heights, "o", ms=3, color=style.POSTERIOR, alpha=0.5, lw=0)
            axis.plot(np.quantile(means, [0.05, 0.95]), [row - 0.1] * 2, color=style.SQP, lw=3)
            axis.plot([np.median(means)], [row - 0.1], "|", color="black", ms=12)
        axis.set_yticks(range(len(ways)), [LABELS[way] for way in ways])
        axis.set(xlabel="sd that is reached over the sd that was promised", ylim=(len(ways) - 0.5, -0.5))
    cells = {
        "way": lambda r: LABELS[r["name"]],
        "reached over promised": lambda r: f"{r['mean']:.2f}",
        f"boats within {KEPT:.0%}": lambda r: f"{r['boats_kept']:.0%}",
        f"sds within {SINGLE:.0%}": lambda r: f"{r['sds_kept']:.0%}",
        "sds left, of now": lambda r: f"{r['left']:.0%}",
    }
    caption = f"{numbers['n_boats']} boats; of each the five coefficients that the trial sees most of.\n"
    lines = [caption, *markdown.columns(markdown.named(numbers["ways"]), cells)]
    if "apart" in numbers:
        told = numbers["apart"]
        of_trials = {
            "trial": itemgetter("name"),
            "distance (sds)": lambda r: f"{r['sds']:.2g}",
            "promised power": lambda r: f"{r['promised']:.0%}",
            "told apart": lambda r: f"{r['measured']:.0%}",
        }
        text = f"""
{told["n_boats"]} boats of each kind, with {told["lacks"]} and without, are flown and fitted with either equations. A
boat is told apart where the wrong equations fit worse than they do for 99 in a hundred boats of theirs.
"""
        lines += [text, *markdown.columns(markdown.named(told["trials"]), of_trials)]
    run.page(lines)


def claims(numbers):
    """Promises are kept, and all are sampled until they converge."""
    yield numbers["converged"] == 1.0, f"{1.0 - numbers['converged']:.0%} of the posteriors have not converged"
    for trial, row in numbers.get("apart", {"trials": {}})["trials"].items():
        yield (
            row["measured"] >= row["promised"] - KEPT,
            f"{trial}: tells {row['measured']:.0%} apart, promised {row['promised']:.0%}",
        )
    if "apart" in numbers:
        zigzag, designed = (numbers["apart"]["trials"][name]["measured"] for name in ("zig-zag", "designed"))
        yield designed > zigzag, f"the designed trial tells {designed:.0%} apart, a zig-zag {zigzag:.0%}"
    for way, row in numbers["ways"].items():
        yield (
            row["boats_kept"] >= SHARE,
            f"{LABELS[way]}: within {KEPT:.0%} for {row['boats_kept']:.0%} of the boats only",
        )
        yield row["sds_kept"] >= SHARE, f"{LABELS[way]}: within {SINGLE:.0%} for {row['sds_kept']:.0%} of the sds only"
