"""What do coefficients make of forces with memory?

Question: the equations are quasi-steady, which thesis section 3.5 calls "not strictly true": a force follows the motion
with a lag. Boats whose damping in sway (Yuv and Nuv) lags by a time that is exponentially distributed are flown on the
horizontal spiral, tracked, and fitted by equations without memory. Where does the memory go, and is it noticed?
Claim: in part into the added masses, and it hides. A lag of a thirtieth of a ship length travelled does no harm. One of
0.3 makes 90 % intervals hold less than 80 % of the coefficients while the check of the fit calls fewer than one record
in five wrong; one of a ship length is noticed in nine records of ten.
Cost: three minutes.

A force that lags by T is to first order in T the force less T times its rate: an added mass of -T Yuv u more. The
memory is flown as a force from outside that follows the motion, which is repeated until both agree.
"""

from functools import partial

import numpy as np
from scipy import signal

import bayesub as bs
from bayesub.inference.baselines import gauss_newton
from bayesub.model.coefficients import HORIZONTAL, INDEX, columns
from bayesub.model.disturbance import ForceHistory
from bayesub.model.simulator import Simulator
from bayesub.problem import priors
from bayesub.problem.problem import Problem
from bayesub.report.markdown import columns as rows_of
from bayesub.report.plots import style
from bayesub.sensors import observe
from thesis import cases
from thesis.wrong_models import warnings

VEHICLE, SEED, PRIOR_SD = "suboff", 35, 0.25
LAGS = (0.0, 0.03, 0.1, 0.3, 1.0, 3.0)  # ship lengths travelled
N_RECORDS, QUICK_RECORDS = 40, 4
STEP_LENGTHS = 0.005  # of the truth
ROUNDS, AGREE = 40, 1e-9  # of motion and memory, and the relative change of the force at which they agree
ADDED = ("Yvdot", "Nvdot")
FIGURES = {
    "memory": "Left: how often 90 % intervals hold the truth, of added masses and of the other coefficients, and how "
    "often the check of the fit calls a record wrong, against the lag. Right: by how much Yvdot is off (mean, of its "
    "value), and what a lag is worth to first order: part of a memory becomes added mass.",
}
ANSWER = """
In part into the added masses, and a memory of a third of a length hides: 90 % intervals of the coefficients other than
added masses hold {0/coverage_others; percent; .0f} % without memory, {0.03/coverage_others; percent; .0f} % with a lag
of 0.03 ship lengths and {0.3/coverage_others; percent; .0f} % with one of 0.3, where {0.3/warned; percent; .0f} % of
the records are called wrong. Of one of a length {1/warned; percent; .0f} % are.
"""


def compute(run):
    """Coverage, warnings and added masses, lag by lag."""
    n = QUICK_RECORDS if run.quick else N_RECORDS
    return run.parts("lag", {f"{lag:g}": partial(of_lag, lag, n) for lag in LAGS})


def of_lag(lag, n):
    """Records of boats with one lag."""
    boat, flown = bs.load_vehicle(VEHICLE), bs.load_manoeuvre("horizontal", bs.load_vehicle(VEHICLE))
    motion, rounds = remembered(boat, flown, lag)
    rng = np.random.default_rng(SEED)  # one noise and prior for all lags, so that these differ in nothing else
    problems = [problem_of(boat, flown, motion, rng) for _ in range(n)]
    errors, inside = [], []
    for problem in problems:
        mode = gauss_newton(problem)
        sds = np.sqrt(np.diag(mode.covariance))
        off = mode.values - boat.xi[problem.columns]
        errors.append(off / np.abs(boat.xi[problem.columns]))
        inside.append(np.abs(off) <= 1.6449 * sds)
    names = problems[0].names
    added = np.isin(names, ADDED)
    judged = warnings(problems, rng, 0.9)
    return {
        "rounds": rounds,
        "coverage_others": float(np.mean(np.array(inside)[:, ~added])),
        "coverage_added": float(np.mean(np.array(inside)[:, added])),
        "warned": judged["warned"],
        "added_mass_off": float(np.mean([one[names.index("Yvdot")] for one in errors])),
        "first_order": first_order(boat, lag),
    }


def remembered(boat, flown, lag):
    """The motion with memory, and in how many rounds motion and force agree."""
    step = STEP_LENGTHS * boat.length_m / boat.speed_mps
    times = np.arange(0.0, flown.duration + step, step)
    simulator = Simulator(boat, flown, np.minimum(times, flown.duration), dt=step)
    trajectory = simulator.trajectory(boat.xi)
    if not lag:
        return trajectory, 0
    slopes = boat.dimensional_factors[columns(("Yuv", "Nuv"))] * boat.xi[columns(("Yuv", "Nuv"))]
    decay = np.exp(-step / (lag * boat.length_m / boat.speed_mps))
    memory = np.zeros((len(times), 2))
    for k in range(ROUNDS):
        u, v = trajectory.states[0, :, 6], trajectory.states[0, :, 7]
        force = (u * v)[:, None] * slopes
        middle = np.vstack([force[:1], 0.5 * (force[1:] + force[:-1])])
        late = signal.lfilter([1.0 - decay], [1.0, -decay], middle, axis=0)
        new = late - force
        change = np.abs(new - memory).max(axis=0) / np.abs(force).max(axis=0)
        memory = new
        trajectory = simulator.disturbed(ForceHistory(times, ("Y", "N"), memory)).trajectory(boat.xi)
        if change.max() < AGREE:
            return trajectory, k + 1
    raise RuntimeError(f"motion and memory with a lag of {lag:g} do not agree after {ROUNDS} rounds")


def problem_of(boat, flown, motion, rng):
    """A noisy track, as equations without memory fit it."""
    record = observe(motion, cases.tracking_range(boat), rng)
    free = [name for name in HORIZONTAL if boat.xi[INDEX[name]]]
    sds = PRIOR_SD * np.abs(boat.xi[columns(free)])
    centres = boat.xi[columns(free)] + sds * rng.standard_normal(len(free))
    given = {name: priors.normal(centre, sd) for name, centre, sd in zip(free, centres, sds, strict=True)}
    prior = priors.Given(priors.relative_normal(PRIOR_SD), given)
    return Problem(boat, flown, record, free=free, prior=prior)


def first_order(boat, lag):
    """What a lag changes Yvdot by, of its value: minus the lag times Yuv in the same non-dimensional form."""
    return float(-lag * boat.xi[INDEX["Yuv"]] / abs(boat.xi[INDEX["Yvdot"]]))


def draw(run, numbers):
    """Coverage and added mass by lag."""
    lags = [max(float(key), 0.01) for key in numbers]
    with style.figure(run.figure("memory"), 8.6, 3.5) as figure:
        left, right = figure.subplots(1, 2)
        looks = {
            "coverage_others": ("in 90 % intervals, others", style.POSTERIOR, "o"),
            "coverage_added": ("in 90 % intervals, Yvdot and Nvdot", style.WEAK, "s"),
            "warned": ("records called wrong", style.SQP, "^"),
        }
        for key, (label, colour, marker) in looks.items():
            values = [100.0 * r[key] for r in numbers.values()]
            left.semilogx(lags, values, marker, ls="-", lw=1.0, ms=5, mew=0, color=colour, label=label)
        left.axhline(90.0, color=style.TRUTH, lw=0.8, ls="--")
        left.set(xlabel="lag (ship lengths; none is drawn at 0.01)", ylabel="share (%)", ylim=(-3, 103))
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=3, fontsize=8)
        right.loglog(lags[1:], [abs(r["added_mass_off"]) for r in list(numbers.values())[1:]], "s", color=style.WEAK)
        right.loglog(lags[1:], [r["first_order"] for r in list(numbers.values())[1:]], color=style.TRUTH, lw=1.0)
        right.set(xlabel="lag (ship lengths)", ylabel="error of Yvdot (of its value)")
        right.annotate("to first order", (0.3, 0.55), (-6, 4), textcoords="offset points", ha="right", fontsize=8)
    rows = [{"lag": key} | r for key, r in numbers.items()]
    cells = {
        "lag (ship lengths)": lambda r: r["lag"],
        "others in 90 % intervals": lambda r: f"{r['coverage_others']:.0%}",
        "Yvdot, Nvdot in 90 % intervals": lambda r: f"{r['coverage_added']:.0%}",
        "records called wrong": lambda r: f"{r['warned']:.0%}",
        "Yvdot off": lambda r: f"{r['added_mass_off']:.0%}",
        "to first order": lambda r: f"{r['first_order']:.0%}",
    }
    run.page(rows_of(rows, cells))


def claims(numbers):
    """A short memory does no harm, a middle one is not noticed, a long one is."""
    held = {lag: r["coverage_others"] for lag, r in numbers.items()}
    yield abs(held["0.03"] - held["0"]) < 0.05, f"lag 0.03: {held['0.03']:.0%} held, without memory {held['0']:.0%}"
    yield held["0.3"] < 0.8, f"lag 0.3: intervals hold {held['0.3']:.0%}"
    yield numbers["0.3"]["warned"] < 0.2, f"lag 0.3: {numbers['0.3']['warned']:.0%} of the records are called wrong"
    for lag in ("1", "3"):
        yield numbers[lag]["warned"] >= 0.9, f"lag {lag}: {numbers[lag]['warned']:.0%} of the records are called wrong"
