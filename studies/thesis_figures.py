"""What do the manoeuvres and the boats of all studies look like, drawn as the thesis draws its own?

Question: which rudder and planes move in every study, where do the boats go, and what do the thesis's figures of added
mass and of a turning circle show with public boats (Figures 4, 5, 8, 14-19, 71, 72)?
Claim: in ship lengths the circles of the AUVs and the submarine differ by less than a factor of two and a half, and an
ellipsoid of the length of an AUV has half the surge added mass of a long ovoid.
Cost: seconds.
"""

import numpy as np
from scipy import optimize

import bayesub as bs
from bayesub.io import toml_files
from bayesub.model import added_mass, manoeuvre_files
from bayesub.report.markdown import table
from thesis.cases import MANOEUVRES, VEHICLES, time_scale, unseen
from thesis_figures import plots

N_RANDOM, N_QUICK = 100, 12
RUDDER_DEG, EVERY_S = 15.0, 5.0
RATIOS = np.linspace(1.0, 10.0, 37)  # length over diameter
FIGURES = {
    "manoeuvres": "What every study flies: ordered and reached angles, tracks from above, depths; on the right the "
    "first 200 s of a random manoeuvre and a hundred of them from above. Lengths are ship lengths.",
    "circles": "Turning circles at 15 degrees of rudder, in ship lengths.",
    "added_mass": "Left: the surge added mass of an ellipsoid falls with slenderness, that of a long ovoid does not. "
    "Right: the roll added inertia of a cylinder with four fins, which the thesis had no formula for, stays that of a "
    "cruciform plate up to a cylinder of 0.4 of the fins' radius.",
}
ANSWER = """
At 15 degrees of rudder the circles have diameters of {circles/suboff/diameter_lengths; .1f} (suboff),
{circles/auv690/diameter_lengths; .1f} (auv690) and {circles/npsauv/diameter_lengths; .1f} (npsauv) ship lengths.
suboff turns as wide as auv690 with {rudder_alike_deg; .1f} degrees (the thesis: 12 for 15).
"""
RADII = np.linspace(0.01, 0.95, 48)  # of a cylinder, over that of its fins


def compute(run):
    """Orders, planes and tracks of the manoeuvres, hundred random tracks, circles, and added masses."""
    boats = {vehicle: bs.load_vehicle(vehicle) for vehicle in VEHICLES}
    suboff = boats["suboff"]
    arrays = {}
    run.progress.stage("flights")
    for name in (*MANOEUVRES, "random:1"):
        flown = bs.load_manoeuvre(name, suboff)
        for column, (times, values) in orders(name, suboff).items():
            arrays[f"{name}/order/{column}"] = np.column_stack([times, np.degrees(values)])
        step = slice(None, None, 20)
        arrays[f"{name}/planes"] = np.column_stack([flown.times, np.degrees(flown.controls)])[step].astype(float)
        for vehicle, boat in boats.items() if name in MANOEUVRES else ():
            arrays[f"{name}/{vehicle}"] = track(boat, bs.load_manoeuvre(name, boat))
    for n, simulator in enumerate(unseen(suboff, N_QUICK if run.quick else N_RANDOM)):
        arrays[f"tracks/{n}"] = simulator.run(suboff.xi)[0][0, ::12, :2] / suboff.length_m
    numbers = {}
    for vehicle, boat in boats.items():
        arrays[f"circle/{vehicle}"], diameter = turning_circle(boat)
        numbers[vehicle] = {"diameter_lengths": diameter}
    run.save_arrays("histories", **{key: values.astype(np.float16) for key, values in arrays.items()})
    wanted = numbers["auv690"]["diameter_lengths"]
    alike = optimize.brentq(lambda deg: turning_circle(suboff, deg)[1] - wanted, 5.0, RUDDER_DEG, xtol=0.01)
    return {
        "rudder_alike_deg": float(alike),
        "circles": numbers,
        "added_mass": mass_of_bodies(),
        "added_inertia": inertia_of_sections(),
    }


def orders(name, boat):
    """Ordered angles by control: times (s) and angles (rad)."""
    if name.startswith("random"):
        content = toml_files.read_toml_table(toml_files.find("random", "manoeuvres")) | {"seed": int(name[7:])}
        file = toml_files.validate(content, manoeuvre_files.RandomFile, name)
    else:
        file = manoeuvre_files.read_manoeuvre(toml_files.find(name, "manoeuvres"))
    return file.orders(boat)


def track(boat, flown):
    """Track (n_times, 3) in ship lengths, as often as suboff's every five seconds."""
    states = bs.simulate(boat, flown, sample=EVERY_S * time_scale(boat)).states[0]
    return states[:, :3] / boat.length_m


def turning_circle(boat, rudder_deg=RUDDER_DEG):
    """Track (n_times, 2) of a circle at a rudder angle, and its diameter at the end, in ship lengths."""
    flown = bs.load_manoeuvre("turning_circle", boat)
    scale = np.radians(rudder_deg) / np.abs(flown.controls[:, 0]).max()
    slower = bs.Manoeuvre(**{**vars(flown), "name": "circle", "controls": flown.controls * scale})
    u, v, _, _, _, r = bs.simulate(boat, slower, sample=slower.duration).states[0, -1, 6:]
    return track(boat, slower)[:, :2], float(2.0 * np.hypot(u, v) / abs(r) / boat.length_m)


def mass_of_bodies():
    """Surge added mass over that of a sphere of the same diameter's displacement, by length over diameter."""
    ellipsoids = [float(added_mass.ellipsoid(ratio, 1.0, 1.0)[0][0] * ratio) for ratio in RATIOS]
    ovoid = added_mass.long_ovoid(1.0) / (4.0 / 3.0 * np.pi)
    return {"ratio": RATIOS.tolist(), "ellipsoid": ellipsoids, "long ovoid": [ovoid] * len(RATIOS)}


def inertia_of_sections():
    """Roll added moments of inertia over the fourth power of the radius of the fins, by radius of the cylinder."""
    return {
        "ratio": RADII.tolist(),
        "flat plate": [np.pi / 8.0] * len(RADII),
        "cruciform": [2.0 / np.pi] * len(RADII),
        "cylinder, two fins": [float(added_mass.section_roll(r, 1.0, 1.0)) for r in RADII],
        "cylinder, four fins": [float(added_mass.cruciform_roll(r, 1.0)) for r in RADII],
    }


def draw(run, numbers):
    """The sheet of manoeuvres, circles, and added masses."""
    lines = [(vehicle, f"{r['diameter_lengths']:.2g}") for vehicle, r in numbers["circles"].items()]
    run.page(table(("vehicle", f"diameter at {RUDDER_DEG:g} degrees of rudder (ship lengths)"), lines))
    alike = numbers["rudder_alike_deg"]
    text = "the thesis's submarine 1 turns as wide as Autosub at 15 degrees with 12 (section 3.6.3)"
    run.page(
        ["", f"suboff turns as wide as auv690 at {RUDDER_DEG:g} degrees with {alike:.1f} degrees of rudder; {text}."]
    )
    arrays = run.load_arrays("histories")
    plots.draw_manoeuvres(run.figure("manoeuvres"), arrays, EVERY_S)
    circles = {vehicle: arrays[f"circle/{vehicle}"] for vehicle in numbers["circles"]}
    plots.draw_circles(run.figure("circles"), circles)
    plots.draw_added_mass(run.figure("added_mass"), numbers["added_mass"], numbers["added_inertia"])


def claims(numbers):
    """Circles alike, and the ellipsoid's added mass."""
    diameters = [r["diameter_lengths"] for r in numbers["circles"].values()]
    spread = max(diameters) / min(diameters)
    yield spread < 2.5, f"the diameters of the circles differ by a factor of {spread:.2g}"
    masses = numbers["added_mass"]
    share = np.interp(7.8, masses["ratio"], masses["ellipsoid"]) / masses["long ovoid"][0]
    yield 0.4 < share < 0.6, f"the ellipsoid of Autosub's shape has {share:.2g} of the ovoid's added mass"
