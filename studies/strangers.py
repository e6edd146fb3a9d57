"""Does a fit find the coefficients of boats that five simulators of others fly, from their logs alone?

Question: the logs are of programs that share no code with bayesub, each with its own step, integrator, axes, signs and
units: the Mariner and the NPS AUV II of the MSS toolbox, the REMUS 100 of PythonVehicleSimulator, the hydrodynamics
of gz-sim and the MMG standard method. Each is written out again here from its publication. A map converts a log; the
truth is in a file that the fit does not read.
Claim: 90 % intervals hold 85 to 95 % of the coefficients that have a counterpart, and a run that was not fitted is
predicted within one per cent of its path (median boat). Where the equations of the fit lack a term of the simulator,
and what is left exceeds the noise, the model check says so for every boat. Whether unmodelled forces then name the
term is in the table, boat by boat.
Cost: six minutes on two cores, some of it to compile five sets of equations.
"""

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import bayesub as bs
from strangers import gazebo, mariner, mmg, npsauv, plots, remus, tables, trials

# Name -> simulator, whether the fit lacks terms of it, boats: 100 coefficients and more where the equations agree.
ROWS = {
    "Mariner": (mariner, False, 3),
    "NPS AUV": (npsauv, False, 6),
    "REMUS": (remus, False, 9),
    "gz-sim": (gazebo, False, 9),
    "MMG": (mmg, False, 5),
    "Mariner, terms missing": (mariner, True, 2),
    "NPS AUV, terms missing": (npsauv, True, 1),
    "REMUS, term missing": (remus, True, 1),
    "gz-sim, terms missing": (gazebo, True, 1),
    "MMG, terms missing": (mmg, True, 1),
}
# Quick: half a minute on a busy machine, because a boat of each of two simulators is sampled; their equations are built
# in, so that nothing is compiled.
QUICK = ("Mariner", "NPS AUV")
N_SEARCHED = 1  # boats of each simulator whose equations agree, in which a missing term is looked for all the same
CRITERIA = bs.Criteria(rhat=1.05, ess=400.0, taus=10.0)
OPTIONS, QUICK_OPTIONS = {"criteria": CRITERIA, "max_steps": 4000}, {"criteria": CRITERIA, "max_steps": 200}
SEED = 42
FIGURES = {
    "strangers": "Left, how many coefficients the 90 % intervals hold, with two standard errors over boats; grey: 85 "
    "to 95 %. Right, largest distance from the track of a run that was not fitted, a line for each boat and a dot for "
    "the median. Orange: fits without terms that the simulator has.",
}
ANSWER = """
Of boats of five simulators that share no code with bayesub 90 % intervals hold
{rows/Mariner/coverage/90%; percent; .0f} % (Mariner), {rows/NPS AUV/coverage/90%; percent; .0f} % (NPS AUV),
{rows/REMUS/coverage/90%; percent; .0f} % (REMUS 100), {rows/gz-sim/coverage/90%; percent; .0f} % (gz-sim) and
{rows/MMG/coverage/90%; percent; .0f} % (MMG) of the coefficients that have a counterpart.
"""


def compute(run):
    """Coverage, verdicts of the model check, and errors of predictions, by simulator."""
    rows = {}
    for name in QUICK if run.quick else ROWS:
        run.progress.stage(name)
        module, lacking, n_boats = ROWS[name]
        file = name.replace(", ", "_").replace(" ", "_")
        boats = run.repeat(file, partial(boat, name, run.quick), 1 if run.quick else n_boats)
        rows[name] = tables.summary(boats, module.TITLE, module.EQUATIONS, module.REMOVED if lacking else ())
    return {"rows": rows}


def boat(name, quick, k):
    """A boat of a simulator from its logs to what the truth says of the fit."""
    module, lacking, _ = ROWS[name]
    rng = np.random.default_rng([SEED, list(ROWS).index(name), k])
    with TemporaryDirectory() as folder:
        place = Path(folder)
        trials.write(module, place, rng, lacking=lacking)
        fit = trials.fit(module, place / "logs", rng, lacking=lacking, **(QUICK_OPTIONS if quick else OPTIONS))
        result = trials.judge(module, place / "truth", fit)
    if (lacking or k < N_SEARCHED) and not quick:
        result["followed"] = trials.followed(fit.problem, fit.posterior, rng)
    return result


def draw(run, numbers):
    """One figure and the table."""
    run.page(tables.page(numbers["rows"]))
    plots.draw(run.figure("strangers"), numbers["rows"])


def claims(numbers):
    """Honest intervals, close predictions, and missing terms named."""
    yield from tables.claims(numbers["rows"])
