"""Does a known disturbance make the coefficients unique, and how well?

Question: thesis chapter 10 expects that disturbances make coefficients unique, "but would produce ill-conditioning".
The coupled trial of each boat is flown with a known push: forces and moments of a thruster on all axes that go on and
off. How many directions stay null, how is the spectrum, and how many coefficients become known on a tracking range?
Claim: unique yes, ill-conditioned no. A push of 1 % of the hull's forces leaves no null direction, and condition
numbers are at least ten times smaller than those of the unique directions were, because it moves the boat in ways that
its planes do not. Coefficients become known to a tracking range only as the push grows: with a fifth of the forces at
least five more, with 1 % none or one.
Cost: a minute.

The push is known exactly, as that of a calibrated thruster. Null directions are those of the equations along the motion
(`uniqueness`); coefficients count as known at 10 % with a 25 % prior.
"""

from dataclasses import replace
from functools import partial

import numpy as np

import bayesub as bs
from bayesub.model.coefficients import NAMES
from bayesub.model.disturbance import ForceHistory, hull_force_rms
from bayesub.model.equations import AXES
from bayesub.model.linear_form import linear_systems
from bayesub.model.simulator import Simulator
from bayesub.report.markdown import columns
from bayesub.report.plots import style
from thesis import cases

PUSHES = (0.0, 0.01, 0.05, 0.2)  # of the rms of the hull's force, axis by axis
PERIOD = 4.0  # ship lengths travelled, of on and off
PRIOR_SD, KNOWN, ROUND_OFF = 0.25, 0.1, 1e-11
READ = ("x", "y", "z", "phi", "theta", "psi")
FIGURES = {
    "push": "Singular values of the equations along the coupled trial, all axes, of columns scaled to unit length: "
    "without a push some are zero (drawn at the bottom) and others small; a push lifts all of them.",
}
ANSWER = """
Unique yes, ill-conditioned no. Without a push {*/0/n_null; min; .0f} to {*/0/n_null; max; .0f} directions are null and
the condition number of the others is {*/0/condition; min; .0e} to {*/0/condition; max; .0e}; with one of 1 % none is,
and it is {*/0.01/condition; min; .0e} to {*/0.01/condition; max; .0e}. The count of known coefficients of suboff goes
from {suboff/0/known; .0f} to {suboff/0.01/known; .0f}, and to {suboff/0.2/known; .0f} with a push of a fifth.
"""


def compute(run):
    """Null directions, condition, spectra and counts by vehicle and push."""
    vehicles = ("npsauv",) if run.quick else cases.VEHICLES
    return {v: run.parts(v, {f"{push:g}": partial(pushed, v, push) for push in PUSHES}) for v in vehicles}


def pushed(vehicle, share):
    """One vehicle under a push."""
    boat = bs.load_vehicle(vehicle)
    flown, interval = bs.load_manoeuvre("coupled", boat), cases.time_scale(boat)
    simulator = Simulator(boat, flown, np.arange(interval, flown.duration, interval))
    if share:
        simulator = simulator.disturbed(history(boat, simulator, share))
    trajectory = simulator.trajectory(boat.xi)
    names = [name for name, value in zip(NAMES, boat.xi, strict=True) if value]
    spectra = [
        np.linalg.svd(system.matrix / np.linalg.norm(system.matrix, axis=0), compute_uv=False)
        for system in linear_systems(trajectory, free=names).values()
    ]
    values = [s / s[0] for s in spectra]
    unique = [s[s > ROUND_OFF] for s in values]
    track = cases.tracking_range(boat)
    sds = np.repeat([track.position_sd_m, np.radians(track.attitude_sd_deg)], 3)
    scales = PRIOR_SD * np.abs(boat.xi[boat.equations.columns(names)])
    rates = simulator.sensitivities(boat.xi, names, READ) / sds[:, None] * scales
    s, vt = np.linalg.svd(rates.reshape(-1, len(names)), full_matrices=False)[1:]
    left = np.sqrt(np.sum((vt / np.sqrt(1.0 + s[:, None] ** 2)) ** 2, axis=0))
    return {
        "n_null": int(sum(len(v) - len(u) for v, u in zip(values, unique, strict=True))),
        "condition": float(max(1.0 / u[-1] for u in unique)),
        "spectrum": np.sort(np.concatenate(values))[::-1].tolist(),
        "known": int(np.count_nonzero(PRIOR_SD * left <= KNOWN)),
        "n_coefficients": len(names),
    }


def history(boat, simulator, share):
    """Forces (N, N m) of a share of the hull's on each axis, on and off, each axis a little later than the last."""
    hull, step = hull_force_rms([replace(simulator, dt=simulator.step)]), simulator.step
    times = np.arange(0.0, simulator.manoeuvre.duration + step, step)
    period = PERIOD * boat.length_m / boat.speed_mps
    phases = times[:, None] / period + np.arange(len(AXES)) / len(AXES)
    smooth = np.tanh(8.0 * np.sin(2.0 * np.pi * phases))
    return ForceHistory(times, AXES, share * hull * smooth)


def draw(run, numbers):
    """Spectra and the table."""
    colours = (style.TRUTH, style.POSTERIOR, style.LINEAR, style.SQP)
    with style.figure(run.figure("push"), 3.2 * len(numbers) + 0.3, 3.5) as figure:
        panels = figure.subplots(1, len(numbers), squeeze=False, sharey=True)[0]
        for panel, (vehicle, found) in zip(panels, numbers.items(), strict=True):
            for (push, r), colour, marker in zip(found.items(), colours, "os^D", strict=True):
                label = f"push of {100 * float(push):g} %" if float(push) else "no push"
                values = np.maximum(r["spectrum"], 1e-13)
                panel.semilogy(1 + np.arange(len(values)), values, marker, ms=3, mew=0, color=colour, label=label)
            panel.set_title(vehicle, fontsize=9)
            panel.set_xlabel("direction, all axes")
        panels[0].set_ylabel("singular value")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)
    rows = [{"vehicle": v, "push": push} | r for v, found in numbers.items() for push, r in found.items()]
    cells = {
        "vehicle": lambda r: r["vehicle"],
        "push": lambda r: f"{100 * float(r['push']):g} %",
        "null directions": lambda r: r["n_null"],
        "condition of the others": lambda r: f"{r['condition']:.1e}",
        "known to 10 %": lambda r: f"{r['known']} of {r['n_coefficients']}",
    }
    run.page(columns(rows, cells))


def claims(numbers):
    """Unique, not ill-conditioned, and known only under a large push."""
    for vehicle, found in numbers.items():
        still, one = found["0"], found["0.01"]
        yield still["n_null"] > 0, f"{vehicle}: nothing is null without a push"
        for push, r in found.items():
            yield not float(push) or r["n_null"] == 0, f"{vehicle}: {r['n_null']} null with a push of {push}"
        text = f"{vehicle}: condition {one['condition']:.1e} with a push of 1 %, without {still['condition']:.1e}"
        yield 10.0 * one["condition"] < still["condition"], text
        for push, least, most in (("0.01", 0, 1), ("0.2", 5, np.inf)):
            gained = found[push]["known"] - still["known"]
            yield least <= gained <= most, f"{vehicle}: a push of {push} makes {gained} more known"
