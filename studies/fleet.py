"""What do five sister boats say of the sixth?

Question: boats of one class differ by what yards make of one drawing. Ten minutes of a spiral, tracked to half a metre,
leave most coefficients of a boat to the prior. Do the logs of five sisters, who had a Doppler log and a gyro too, tell
what the next one is like? Is a boat found out that is not of the class? And is a boat's posterior right after its next
log, as ``bayesub update`` fits it?
Claim: with the class inferred from five sisters (its mean, and its spread by axis), 90 % intervals of the coefficients
of the next ones, from ten minutes each, hold 87 to 93 % of them, and the median sd is at most nine tenths of what the
boat's own log leaves: not less, for what one boat's trial does not show five sisters hardly show either. The inferred
spreads hold the truth. Of sisters one in a hundred is taken for a stranger; of boats that differ by three times the
spread of the class nine in ten are. Of 100 boats with a second log, the ranks of every coefficient are uniform: none
leaves a band that one study in a hundred leaves by chance.
Cost: twenty minutes of one core.
Quick: half a minute, because eight posteriors are sampled; of one boat nothing is claimed but that it converges.
"""

import time
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import stats

import bayesub as bs
from bayesub.inference.sampling import search_from
from bayesub.model.coefficients import HORIZONTAL
from bayesub.problem import priors
from bayesub.report import markdown
from bayesub.report.plots import style
from bayesub.study.after.update import LOOK, N_WALKERS
from thesis import calibration

VEHICLE, PLANE, SEED, STEP_S, FINER = "suboff", "horizontal", 45, 0.5, 10
# Relative sds: of the mean of a class, of its boats about it, and of a boat of which no sister is known; and of
# strangers, in sds of boats.
WIDE, SPREAD, STRANGE = 0.25, 0.10, 3.0
ALONE = float(np.hypot(WIDE, SPREAD))
SENSORS = (bs.sensors.Track(0.5, 0.1, interval_s=1.0, channels=("x", "y", "yaw")),)
RICH = (
    *SENSORS,
    bs.sensors.DVL(sd_mps=0.005, interval_s=1.0, channels=("u_ground", "v_ground")),
    bs.sensors.INS(sd_degps=0.01, interval_s=1.0, channels=("r",)),
)
MANOEUVRES = ("horizontal", "zigzag_20_20", "turning_circle", "zigzag_10_10", "horizontal")  # of the first boats
N_SISTERS, N_STRANGERS, N_CLASSES = 4, 2, 5  # of each class: boats after the first, others; and classes
LOG_SPREAD = (np.log(0.1), 1.0)  # mean and sd of the prior of the log of the spread of an axis
N_UPDATED, LOGS = 100, ("horizontal", "zigzag_20_20")  # boats with a second log, and what they fly
FALSE_ALARMS, HELD, GAIN = 0.01, (0.87, 0.93), 0.9
N_DRAWS, N_STEPS = 400, 2000  # of the class, and steps of its sampler
FIGURES = {
    "fleet": "Sd of each coefficient of the next boat over its value, median over boats, from its own ten minutes "
    "(grey) and with the class inferred from five sisters (blue).",
}
ANSWER = """
With the class inferred from five sisters, 90 % intervals of the next boats hold {pooled/held; percent; .0f} % of their
coefficients, and the median sd is {gain; .2f} times that of the boat's own log. Of the strangers
{strangers/found; percent; .0f} % are found out, and of the sisters {sisters/found; percent; .0f} %.
After a second log 90 % intervals hold {updates/quantities/[A-Z]*/coverage/90 %; mean; percent; .0f} % of the
coefficients of {updates/n; .0f} boats.
"""


def compute(run):
    """Of each class its spreads, its next boats, alone and with their sisters, and its strangers."""
    work = (
        partial(of_class, MANOEUVRES[:2], 1, 1) if run.quick else partial(of_class, MANOEUVRES, N_SISTERS, N_STRANGERS)
    )
    classes = run.repeat("classes", work, 1 if run.quick else N_CLASSES)
    boats = [boat for one in classes for boat in one["boats"]]
    numbers = {
        key: {
            "held": float(np.mean([boat[key]["held"] for boat in boats])),
            "sd": float(np.median([boat[key]["sds"] for boat in boats])),
            "sds": np.median([boat[key]["sds"] for boat in boats], axis=0).tolist(),
            "known": float(np.mean(np.array([boat[key]["sds"] for boat in boats]) < 0.1)),
        }
        for key in ("alone", "pooled")
    }
    logs = run.repeat("updates", updated, 2 if run.quick else N_UPDATED)
    ranks = {name: [log["ranks"][name] for log in logs] for name in logs[0]["ranks"]}
    found = {key: [p < FALSE_ALARMS for one in classes for p in one[key]] for key in ("sisters", "strangers")}
    return numbers | {
        "names": classes[0]["names"],
        "gain": numbers["pooled"]["sd"] / numbers["alone"]["sd"],
        "n_boats": len(boats),
        "converged": float(np.mean([one["converged"] for one in classes])),
        "updates": {
            "n": len(logs),
            "converged": float(np.mean([log["converged"] for log in logs])),
            "seconds": float(np.median([log["seconds"] for log in logs])),
        }
        | calibration.uniformity(ranks, FALSE_ALARMS, np.random.default_rng(SEED)),
        "spreads": {axis: [one["spreads"][axis] for one in classes] for axis in classes[0]["spreads"]},
        **{key: {"n": len(flags), "found": float(np.mean(flags))} for key, flags in found.items()},
    }


def planar():
    """The vehicle, the names of its coefficients in the plane, where they stand, and their sizes."""
    vehicle = bs.load_vehicle(VEHICLE)
    names = [name for name in HORIZONTAL if vehicle.xi[vehicle.equations.columns([name])[0]] != 0.0]
    columns = vehicle.equations.columns(names)
    return vehicle, names, columns, np.abs(vehicle.xi[columns])


def updated(k):
    """Ranks of the truth of a boat of which no sister is known after its second log, fitted together with its first.

    As ``bayesub update`` does it: search and learning begin at the posterior of the first log.
    """
    rng = np.random.default_rng([SEED, k, N_UPDATED])
    vehicle, names, columns, sizes = planar()
    flown = {name: replace(bs.load_manoeuvre(name, vehicle), subproblem=PLANE) for name in LOGS}
    motions = {}
    while not motions or any(motion.status[0] != "ok" for motion in motions.values()):
        xi = vehicle.xi.copy()
        xi[columns] += ALONE * sizes * rng.standard_normal(len(names))
        boat = replace(vehicle, xi=xi)
        motions = {name: bs.simulate(boat, manoeuvre, dt=STEP_S / FINER) for name, manoeuvre in flown.items()}
    records = {name: bs.observe(motion, SENSORS, rng) for name, motion in motions.items()}
    given = {"free": names, "prior": priors.relative_normal(ALONE), "dt": STEP_S}
    problems = {name: bs.Problem(vehicle, flown[name], records[name], **given) for name in LOGS}
    before = bs.sample(problems[LOGS[0]], rng=rng)
    began, joint, search = time.perf_counter(), bs.JointProblem(problems), partial(search_from, before)
    posterior = bs.sample(joint, rng=rng, n_walkers=N_WALKERS, search=search, criteria=bs.Criteria(look=LOOK))
    seconds = time.perf_counter() - began
    truth = xi[vehicle.equations.columns(joint.names)]
    ranks = calibration.posterior_ranks(joint, in_parts(posterior, calibration.N_DRAWS), truth, rng)
    return {"ranks": ranks, "converged": posterior.converged, "seconds": seconds}


def in_parts(posterior, n):
    """The same with the way of each walker cut into parts that count as walkers, so that there are `n` or more."""
    n_ensembles, n_steps, n_walkers = posterior.log_prob.shape
    n_parts = -(-n // (n_ensembles * n_walkers))
    length = n_steps // n_parts

    def cut(steps):
        parts = steps[:, : n_parts * length].reshape(n_ensembles, n_parts, length, n_walkers, *steps.shape[3:])
        return np.swapaxes(parts, 1, 2).reshape(n_ensembles, length, n_parts * n_walkers, *steps.shape[3:])

    return replace(posterior, chain=cut(posterior.chain), log_prob=cut(posterior.log_prob))


def of_class(manoeuvres, n_sisters, n_strangers, k):
    """A class of boats: its spreads as inferred from the first logs, and what these say of the boats after them."""
    rng = np.random.default_rng([SEED, k])
    vehicle, names, columns, sizes = planar()
    middle = vehicle.xi[columns] + WIDE * sizes * rng.standard_normal(len(names))

    def logged(spread, sensors, name=PLANE):
        """Coefficients (n,) of a boat that comes to the end, and its record."""
        flown = replace(bs.load_manoeuvre(name, vehicle), subproblem=PLANE)
        while True:
            xi = vehicle.xi.copy()
            xi[columns] = middle + spread * sizes * rng.standard_normal(len(names))
            motion = bs.simulate(replace(vehicle, xi=xi), flown, dt=STEP_S / FINER)
            if motion.status[0] == "ok":
                return xi[columns], (flown, bs.observe(motion, sensors, rng))

    def sampled(trial, prior):
        problem = bs.Problem(vehicle, *trial, free=names, prior=prior, dt=STEP_S)
        posterior = bs.sample(problem, rng=rng)
        order = [posterior.names.index(name) for name in names]
        return posterior, (posterior.draws[:, order] - vehicle.xi[columns]) / sizes

    n_known = len(manoeuvres)
    kits = [(RICH, name) for name in manoeuvres] + [(SENSORS,)] * n_sisters
    truths, records = zip(*(logged(SPREAD, *kit) for kit in kits), strict=True)
    alone = [sampled(record, priors.relative_normal(ALONE)) for record in records]
    axes = np.array([name[0] for name in names])
    told = [likelihood(draws) for _, draws in alone]
    spreads, mean, covariance = inferred_class(told[:n_known], axes, rng)
    result = {"names": names, "boats": [], "converged": all(posterior.converged for posterior, _ in alone)}
    of_axes = {axis: spreads[:, axes == axis][:, 0] for axis in "XYN"}
    result["spreads"] = {axis: np.quantile(draws, [0.05, 0.5, 0.95]).tolist() for axis, draws in of_axes.items()}
    known = prior_of(names, vehicle.xi[columns] + sizes * mean, covariance * np.outer(sizes, sizes))
    for k_boat in range(n_known, n_known + n_sisters):
        posterior, pooled = sampled(records[k_boat], known)
        true = (truths[k_boat] - vehicle.xi[columns]) / sizes
        result["boats"].append({"alone": judged(alone[k_boat][1], true), "pooled": judged(pooled, true)})
        result["converged"] &= posterior.converged
    others = [sampled(logged(STRANGE * SPREAD, SENSORS)[1], priors.relative_normal(ALONE)) for _ in range(n_strangers)]
    strange = [likelihood(draws) for _, draws in others]
    for key, boats in (("sisters", told[n_known:]), ("strangers", strange)):
        result[key] = [tail(boat, mean, covariance) for boat in boats]
    return result


def likelihood(draws):
    """What a log says by itself, as precision and shift, in values of the vehicle: posterior over prior, as normal."""
    precision = np.linalg.inv(np.cov(draws.T))
    return precision - np.eye(len(precision)) / ALONE**2, precision @ draws.mean(axis=0)


def inferred_class(told, axes, rng):
    """Draws (n, n_coefficients) of the spreads of a class, and mean and covariance of its next boat.

    Boats and mean are normal given the spreads, and integrated out in closed form.
    """
    kinds = [axes == axis for axis in "XYN"]

    def given(log_spreads):
        """Log density of the spreads, and mean and covariance of the mean of the class."""
        variances = np.sum([np.exp(2.0 * one) * kind for one, kind in zip(log_spreads, kinds, strict=True)], axis=0)
        density = -0.5 * np.sum(((log_spreads - LOG_SPREAD[0]) / LOG_SPREAD[1]) ** 2)
        precision, shift = np.eye(len(axes)) / WIDE**2, np.zeros(len(axes))
        for own, moved in told:
            inner = own + np.diag(1.0 / variances)
            density += 0.5 * moved @ np.linalg.solve(inner, moved)
            density -= 0.5 * (np.linalg.slogdet(inner)[1] + np.log(variances).sum())
            precision += np.diag(1.0 / variances) - np.linalg.inv(inner) / np.outer(variances, variances)
            shift += np.linalg.solve(inner, moved) / variances
        covariance = np.linalg.inv(precision)
        density += 0.5 * (shift @ covariance @ shift + np.linalg.slogdet(covariance)[1])
        return density, covariance @ shift, covariance, variances

    at = np.full(len(kinds), LOG_SPREAD[0])
    here, draws = given(at), []
    for step in range(N_STEPS):
        proposed = at + 0.4 * rng.standard_normal(len(kinds))
        there = given(proposed)
        if np.log(rng.random()) < there[0] - here[0]:
            at, here = proposed, there
        if step >= N_STEPS // 5 and step % (N_STEPS // N_DRAWS) == 0:
            draws.append(here[1:])
    means, covariances, variances = (np.array(each) for each in zip(*draws, strict=True))
    spread_of_means = np.cov(means.T)
    return (
        np.sqrt(variances),
        means.mean(axis=0),
        covariances.mean(axis=0) + spread_of_means + np.diag(variances.mean(axis=0)),
    )


def prior_of(names, mean, covariance):
    """The normal prior of a mean and a covariance."""
    sds = np.sqrt(np.diag(covariance))
    one_each = {name: priors.normal(float(m), float(s)) for name, m, s in zip(names, mean, sds, strict=True)}
    matrix = covariance / np.outer(sds, sds)
    pairs = [(names[i], names[j], float(matrix[i, j])) for i in range(len(names)) for j in range(i)]
    return priors.Given(priors.relative_normal(ALONE), one_each, tuple(pairs))


def judged(draws, true):
    """Share of 90 % intervals that hold the truth, and the sds, in values of the vehicle."""
    lower, upper = np.quantile(draws, [0.05, 0.95], axis=0)
    return {"held": float(np.mean((lower < true) & (true < upper))), "sds": draws.std(axis=0).tolist()}


def tail(told, mean, covariance):
    """Probability that a boat of the class is farther from its mean than this one, where the log says something."""
    own, shift = told
    lower = np.linalg.cholesky(covariance)
    values, vectors = np.linalg.eigh(lower.T @ own @ lower)
    seen = values > 1.0
    # In these coordinates the boat is standard normal and the log reads each with the variance 1 / value.
    reading = (vectors.T @ lower.T @ (shift - own @ mean))[seen] / values[seen]
    return float(stats.chi2.sf(np.sum(reading**2 / (1.0 + 1.0 / values[seen])), seen.sum()))


def held_by(intervals):
    """Share of the 90 % intervals of the spread that hold it."""
    return float(np.mean([lower < SPREAD < upper for lower, _, upper in intervals]))


def draw(run, numbers):
    """A row a coefficient, and a table."""
    names, alone, pooled = numbers["names"], numbers["alone"]["sds"], numbers["pooled"]["sds"]
    with style.figure(run.figure("fleet"), 7.2, 3.2) as figure:
        axis = figure.subplots()
        places = np.arange(len(names))
        axis.plot(places, alone, "o", ms=5, color=style.PRIOR, label="its own ten minutes")
        axis.plot(places, pooled, "o", ms=5, color=style.POSTERIOR, label="and five sisters")
        axis.set_yscale("log")
        axis.set_xticks(places, names, rotation=90)
        axis.set(ylabel="sd over the value")
        axis.legend(loc="lower right")
    rows = [
        {"name": label, **numbers[key]}
        for key, label in (("alone", "its own ten minutes"), ("pooled", "and five sisters"))
    ]
    cells = {
        "known of the next boat by": lambda r: r["name"],
        "90 % intervals hold": lambda r: f"{r['held']:.0%}",
        "median sd over value": lambda r: f"{r['sd']:.1%}",
        "known to 10 %": lambda r: f"{r['known']:.0%}",
    }
    of_axes = [
        {"name": axis, "held": held_by(each), "median": np.median(each, axis=0)[1]}
        for axis, each in numbers["spreads"].items()
    ]
    spread_cells = {
        "axis": lambda r: r["name"],
        "inferred spread (median)": lambda r: f"{r['median']:.1%}",
        "90 % intervals hold the truth": lambda r: f"{r['held']:.0%}",
    }
    text = f"""
{numbers["n_boats"]} boats after five of their class.
"""
    strangers = f"""
Farther from the class than one sister in a hundred: {numbers["sisters"]["found"]:.0%} of
{numbers["sisters"]["n"]} sisters, {numbers["strangers"]["found"]:.0%} of {numbers["strangers"]["n"]} boats that differ
by three times as much.
"""
    updates = numbers["updates"]
    held = [row["coverage"]["90 %"] for name, row in updates["quantities"].items() if name in names]
    logs = f"""
After a second log, fitted together with the first, 90 % intervals hold {np.mean(held):.0%} of the coefficients of
{updates["n"]} boats ({min(held):.0%} to {max(held):.0%} of one); ranks of {len(outside(updates))} of
{len(updates["quantities"])} quantities leave their band. From both logs to the posterior took
{updates["seconds"]:.1f} s (median; one core, beside others).
"""
    run.page([text, *markdown.columns(rows, cells), "", *markdown.columns(of_axes, spread_cells), strangers, logs])


def outside(updates):
    """The quantities whose ranks leave the band."""
    return [name for name, row in updates["quantities"].items() if not row["inside"]]


def claims(numbers):
    """Intervals are honest, pooling gains, and strangers are found out."""
    yield numbers["converged"] == 1.0, f"{1.0 - numbers['converged']:.0%} of the classes have not converged"
    updates = numbers["updates"]
    yield updates["converged"] == 1.0, f"{1.0 - updates['converged']:.0%} of the updates have not converged"
    if numbers["n_boats"] < N_SISTERS:
        return
    yield not outside(updates), f"after a second log the ranks of {', '.join(outside(updates))} are not uniform"
    held = numbers["pooled"]["held"]
    yield HELD[0] <= held <= HELD[1], f"90 % intervals hold {held:.0%}"
    yield numbers["gain"] <= GAIN, f"the median sd is {numbers['gain']:.2f} times that of the boat's own log"
    for axis, each in numbers["spreads"].items():
        yield held_by(each) >= 0.6, f"{axis}: the spread is held for {held_by(each):.0%} of the classes"
    sisters, strangers = (numbers[key]["found"] for key in ("sisters", "strangers"))
    yield sisters <= 0.1, f"{sisters:.0%} of the sisters are taken for strangers"
    yield strangers >= 0.9, f"{strangers:.0%} of the strangers are found out"
