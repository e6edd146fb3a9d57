"""Which manoeuvre tells most of the coefficients, how far can one get, and what is in the way?

Question: the thesis ends on it. Every manoeuvre that it tried was ill-conditioned, to try them all is impossible, and a
condition number might judge one without identifying (chapter 10). Here exact sensitivities judge ten thousand random
manoeuvres of each of four vehicles, the built-in ones, and those that a search finds within limits: how many
coefficients will be known to 10 %, by tracks, by rounded readings of an ADCP and an INS (thesis section 9.6), and by a
Doppler log with gyros?
Claim: no manoeuvre tells all of them. Null directions stay whatever is flown, and hide at most a tenth; most of the
rest are imitated by others, and fewer do too little. The best manoeuvre of a search tells more than any random one
within the limits, and than the standard one. Condition numbers of the equations rank manoeuvres, but worse than the
expected information does. Posteriors of boats of the prior are as wide as expected and hold the truth as often as they
say.
Cost: an hour on two cores; a killed run continues with --resume.

The prior is normal with 25 %. Limits: depth within 0.9 lengths, pitch under 30 and roll under 45 degrees, speed above a
tenth, planes within their own limits, propeller between half and the whole of its speed; flown by the vehicle itself.
"""

from functools import partial

import numpy as np

from richest import appraisal, floor, plots, proof, tables, worth
from richest.options import OPTIONS

SEED = 22
VEHICLES = ("suboff", "auv690", "npsauv", "remus100")
SENSORS = ("track", "rounded", "log")
KINDS = ("steps", "curves")  # of searches
N_RANDOM, CHUNK = 10_000, 100
N_JUDGEMENTS = {"suboff": 4000, "auv690": 1500, "npsauv": 2000, "remus100": 2000}  # of a search
N_OPTION = 2000  # judgements of the search of an option
N_CONDITIONS = 300  # random manoeuvres whose condition numbers are computed
PROOF = ("auv690", "track")
N_BOATS, N_SAMPLED, N_SEARCHES, N_UNSEEN, MAX_STEPS = 20, 2, 50, 50, 3000
QUICK = {"random": 30, "judgements": 40, "option": 75, "conditions": 8}
QUICK_PROOF = {"n_boats": 1, "n_sampled": 0, "n_searches": 1, "n_unseen": 2, "max_steps": 0}
FIGURES = {
    "richest": "How many coefficients will be known to 10 % after one trial: random manoeuvres within the limits "
    "(light blue) and beyond (grey), the built-in coupled one, the best built-in one, and the best that a search finds "
    "within the limits. The dotted line is what sensors without error would tell on it.",
    "floor": "Why coefficients stay unknown on the coupled and on the best manoeuvre, and how many would be known on "
    "the best one with more information of the same kind: a longer trial, or better sensors.",
    "spectra": "Singular values: data against prior, direction by direction, for the worst, middle and best random "
    "manoeuvre within the limits, the coupled and the best one.",
    "coupling": "Sway follows yaw and heave follows pitch whatever is flown, less so on the best manoeuvres (thesis "
    "Figure 68).",
    "manoeuvre": "The best manoeuvre for a Doppler log and gyros: orders, depth and attitude.",
    "options": "What the thesis leaves untried, each with a search of its own; what sensors bring to the best "
    "manoeuvre; and values from a towing tank, the one that tells most of the others first.",
    "proof": "Boats of the prior on the coupled and the best manoeuvre: posterior against expected sd of each "
    "coefficient, coverage, and how many coefficients are found within 10 % of the truth.",
}
ANSWER = """
No manoeuvre tells all, and none is well-conditioned. For suboff a track makes
{vehicles/suboff/manoeuvres/track optimised/sensors/track/n_known/0.1; .0f} of
{vehicles/suboff/n_coefficients; .0f} coefficients known to 10 % at best (coupled:
{vehicles/suboff/manoeuvres/standard coupled/sensors/track/n_known/0.1; .0f}), a Doppler log with gyros
{vehicles/suboff/manoeuvres/log optimised/sensors/log/n_known/0.1; .0f}
({vehicles/suboff/manoeuvres/standard coupled/sensors/log/n_known/0.1; .0f}), and rounded readings of ADCP and INS
{vehicles/suboff/manoeuvres/rounded optimised/sensors/rounded/n_known/0.1; .0f}
({vehicles/suboff/manoeuvres/standard coupled/sensors/rounded/n_known/0.1; .0f}). Null directions keep
{vehicles/suboff/manoeuvres/log optimised/sensors/log/reasons/null; .0f} from being known whatever is flown; the other
unknown ones are imitated by others, or do too little.
"""
GLOSSARY = "booth"


def compute(run):
    """Random manoeuvres, searches, a closer look at some, and the proof."""
    vehicles = VEHICLES[3:] if run.quick else VEHICLES
    numbers, arrays = {"vehicles": {}}, {}
    for vehicle in vehicles:
        run.progress.stage(vehicle)
        numbers["vehicles"][vehicle], closer = of_vehicle(run, vehicle, motion=vehicle == vehicles[0])
        arrays |= {f"{vehicle}/{key}": array for key, array in closer.items()}
    run.save_arrays("richest", **arrays)
    run.progress.stage("options")
    vehicle = vehicles[0]
    best = numbers["vehicles"][vehicle]["searches"]["log"]
    numbers["worth"] = run.part("worth", partial(worth.worth, vehicle, "log", best))
    names = list(OPTIONS)[: 2 if run.quick else None]
    work = partial(worth.option, names, SEED, QUICK["option"] if run.quick else N_OPTION)
    numbers["options"] = run.repeat("options", work, len(names))
    run.progress.stage("proof")
    vehicle, sensors = ("remus100", "track") if run.quick else PROOF
    numbers["proof"] = prove(run, vehicle, sensors, numbers["vehicles"][vehicle]["searches"][sensors])
    return numbers


def of_vehicle(run, vehicle, *, motion):
    """The numbers of one vehicle, and arrays for its figures."""
    n_random, chunk = (QUICK["random"], QUICK["random"]) if run.quick else (N_RANDOM, CHUNK)
    work = partial(appraisal.random_chunk, vehicle, SEED, chunk)
    results = appraisal.joined(run.repeat(f"random_{vehicle}", work, n_random // chunk))
    searches = search_all(run, vehicle, results)
    specs = {f"standard {name}": {"name": name} for name in appraisal.appraiser_of(vehicle).standard()}
    for sensors in SENSORS:
        numbers = appraisal.ranked(results, sensors)
        specs |= {f"{sensors} {rank}": {"seed": (SEED, number)} for rank, number in numbers.items()}
        specs[f"{sensors} optimised"] = searches[sensors]
    looks = run.repeat(f"closer_{vehicle}", partial(closer_look, vehicle, list(specs.values())), len(specs))
    looks = dict(zip(specs, looks, strict=True))
    for name, look in looks.items():
        own = name.split()[0]  # the sensors for which a manoeuvre was chosen
        look["sensors"] = {own: look["sensors"][own]} if own in SENSORS else look["sensors"]
        floor.count_reasons(look, names=name == "standard coupled" or name.endswith("optimised"))
    arrays = {f"{name}/{key}": np.float32(a) for name, look in looks.items() for key, a in look.pop("arrays").items()}
    pairs = {s: {"coupled": specs["standard coupled"], "optimised": specs[f"{s} optimised"]} for s in SENSORS}
    boats = run.part(f"boats_{vehicle}", partial(floor.other_boats, vehicle, pairs, SEED))
    n = len(appraisal.appraiser_of(vehicle).exact.names)
    histograms = {
        s: [np.bincount(results[s]["n"][part], minlength=n + 1).tolist() for part in parts(results)] for s in SENSORS
    }
    every = np.linspace(0, n_random - 1, QUICK["conditions"] if run.quick else N_CONDITIONS).astype(int).tolist()
    conditions = run.part(f"conditions_{vehicle}", partial(floor.conditions, vehicle, SEED, every))
    closer = plots.chosen(arrays, motion=motion)
    return {
        "n_coefficients": n,
        "n_random": n_random,
        "n_within": int(np.count_nonzero(results["penalty"] == 0.0)),
        "histograms": histograms,
        "most": {
            s: {name: int(np.flatnonzero(h).max(initial=0)) for name, h in zip(("within", "beyond"), both, strict=True)}
            for s, both in histograms.items()
        },
        "searches": searches,
        "manoeuvres": looks,
        "boats": boats,
        "correlations": floor.correlations(conditions, results, every),
    }, closer


def parts(results):
    """Masks (n_random,) of random manoeuvres within the limits and beyond."""
    within = results["penalty"] == 0.0
    return within, ~within


def closer_look(vehicle, specs, k):
    """The summary of one manoeuvre."""
    return floor.summary(vehicle, specs[k])


def search_all(run, vehicle, results):
    """Sensors -> the best result of the searches of several families."""
    pairs = [(sensors, kind) for sensors in SENSORS for kind in KINDS]
    starts = [appraisal.ranked(results, sensors)["best"] for sensors, _ in pairs]
    n_judgements = QUICK["judgements"] if run.quick else N_JUDGEMENTS[vehicle]
    ends = run.repeat(
        f"searches_{vehicle}", partial(search_one, run.folder, vehicle, pairs, starts, n_judgements), len(pairs)
    )
    searches = {}
    for sensors in SENSORS:
        some = [result for (name, _), result in zip(pairs, ends, strict=True) if name == sensors]
        searches[sensors] = min(some, key=lambda r: r["cost"]) | {"costs": {r["kind"]: r["cost"] for r in some}}
    return searches


def search_one(folder, vehicle, pairs, starts, n_judgements, k):
    """One search, which begins at the best random manoeuvre that keeps the limits."""
    seed = (SEED, 1, VEHICLES.index(vehicle), k)
    saved = folder / f"costs_{vehicle}_{'_'.join(pairs[k])}.txt" if folder.is_dir() else None  # on this machine
    return appraisal.optimised(vehicle, *pairs[k], seed, n_judgements, (SEED, starts[k]), saved)


def prove(run, vehicle, sensors, best):
    """Results of trials of boats of the prior, on the best manoeuvre and on the standard one."""
    sizes = {"n_boats": N_BOATS, "n_sampled": N_SAMPLED, "n_searches": N_SEARCHES, "n_unseen": N_UNSEEN}
    sizes = QUICK_PROOF if run.quick else sizes | {"max_steps": MAX_STEPS}
    specs = {"best": best, "standard": {"name": appraisal.TYPICAL}}
    work = partial(proof.boat_results, vehicle, sensors, specs, SEED, sizes)
    boats = run.repeat("proof", work, sizes["n_boats"])
    return {"vehicle": vehicle, "sensors": sensors, "boats": len(boats)} | {
        name: proof.summary([boat[name] for boat in boats]) for name in specs
    }


def draw(run, numbers):
    """Counts, spectra, why coefficients stay unknown, the coupling of motions, the best manoeuvre, and the proof."""
    run.page(tables.page(numbers))
    plots.draw_counts(run.figure("richest"), numbers["vehicles"])
    plots.draw_reasons(run.figure("floor"), numbers["vehicles"])
    plots.draw_options(run.figure("options"), numbers["options"], numbers["worth"])
    plots.draw_proof(run.figure("proof"), numbers["proof"])
    arrays, vehicle = run.load_arrays("richest"), next(iter(numbers["vehicles"]))
    plots.draw_spectra(run.figure("spectra"), numbers["vehicles"], arrays)
    plots.draw_coupling(run.figure("coupling"), vehicle, numbers["vehicles"][vehicle], arrays)
    plots.draw_manoeuvre(run.figure("manoeuvre"), vehicle, arrays)


def claims(numbers):
    """What the docstring says."""
    yield from tables.claims(numbers)
