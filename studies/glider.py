"""What does the log of a real glider say of its drag, lift, mass, volume and compressibility?

Question: the flight model of Merckelbach et al. (2019) is calibrated with the depths of a dive, or with the
speed too that an acoustic profiler measures. Which of its parameters does a glider without a profiler know?
Claim: parasite drag, and of mass and volume their difference alone, to ten grams of 70 kg. The optimum of depths
without inertia is that of gliderflight's least squares. Bands of 90 % hold 80 to 97 % of the depths of unseen dives.
Cost: two minutes; the package gliderflight is compared with where it is installed.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import minimize

import bayesub as bs
from bayesub.kernels import workspace
from bayesub.study.schema.trial_log import read_trial
from glider import plots
from glider.flight import LOG, SOUND_MPS, find_casts, mean_density, peer, shown, sparse

SEED, N_DRAWS = 36, 400
STEP_S = 1.0
START_SD_MPS = 0.01  # of the speed at the start of a cast
PITCH_SD_DEG = 0.1  # what is white in its residuals from a smooth line
QUICK_DIVES = 8
AREA = 0.1 / 1.5**2  # reference area of the authors over the square of the length of the vehicle
LEVELS = (0.5, 0.9)
INERTIAS = (0.5, 0.25)  # shares of mass and added mass from which a flight without inertia is extrapolated
NOISE = {"depth": (0.15, 60.0), "u": (0.01, 60.0)}  # guesses of sd (m, m/s) and correlation time, s
SHARED = {  # mean and sd of the prior; the volume is that of the hull with half of the ballast
    "weighed_mass_kg": (70.0, 0.5),
    "volume_cm3": (70e6 / 1004.0, 700.0),
    "compressibility_per_bar": (5e-5, 5e-5),
}
COEFFICIENTS = {"Xuu": (-0.006667, 0.00133), "Zuw": (-0.3415, 0.0667), "Xww": (-0.1318, 0.0673)}
LIFTED = (("Zuw", "Xww", -0.99),)  # both have the lift slope in them: the induced drag is known to a tenth
FITS = {  # channels, free coefficients and shared parameters of each fit
    "depths": (("depth",), tuple(COEFFICIENTS), SHARED),
    "depths and speeds": (("depth", "u"), tuple(COEFFICIENTS), SHARED),
    "depths, known lift": (("depth",), ("Xuu",), SHARED),
}
FIGURES = {
    "glider": "Left, mass against volume: only their difference is known. Middle, posterior over prior sd from depths "
    "and from depths and speeds. Right, speeds in an unseen descent with their bands, beside a profiler and "
    "gliderflight.",
}
GLOSSARY = "glider"
ANSWER = """
From depths alone parasite drag CD0 is {fits/depths/parameters/CD0/mean; .4f} +- {fits/depths/parameters/CD0/sd;
.4f}, and of mass and volume only the difference is known, to {fits/depths/parameters/excess_g/sd; .1f} g. Bands of
90 % hold {fits/depths/prediction/coverage/depth/0.9; percent; .0f} % of the depths of unseen dives.
"""


def compute(run):
    """Posteriors of the even dives and what they predict of the odd ones, beside gliderflight."""
    rng = np.random.default_rng(SEED)
    casts = find_casts()
    dives = sorted({cast["dive"] for cast in casts})[: QUICK_DIVES + 1 if run.quick else None]
    fitted = [cast for cast in casts if cast["dive"] in dives[::2]]
    unseen = [cast for cast in casts if cast["dive"] in dives[1::2]]
    if run.quick:
        fitted = [cast for cast in fitted if cast["dive"] > 0]
    run.progress.stage("noise")
    noise, optimum = calibrated(fitted, rng)
    numbers = {"fitted": len(fitted), "unseen": len(unseen), "noise": noise, "drag and mass": optimum, "fits": {}}
    numbers["gliderflight"] = peer(run, fitted, unseen)
    numbers["fits"] = run.parts("fit", {fit: partial(fit_and_predict, fit, fitted, unseen, noise) for fit in FITS})
    return numbers


def posed(casts, fit, noise, glider, step=STEP_S):
    """The joint problem of casts."""
    channels, free, shared = fit
    sensors = {"depth": bs.sensors.Sensor("depth_m", sd=1.0), "u": bs.sensors.Sensor("u_mps", sd=1.0)}
    prior = bs.priors.Given(
        bs.priors.relative_normal(0.2),
        {name: bs.priors.normal(*COEFFICIENTS[name]) for name in COEFFICIENTS},
        LIFTED,
    )
    problems = {}
    for cast in casts:
        start = dict(cast["start"])
        speed = {"u0_mps": (start.pop("u0_mps"), START_SD_MPS)}
        read = [c for c in channels if c == "depth" or cast["down"]]
        trial = read_trial(
            LOG,
            glider,
            [bs.sensors.Sensor("pitch_deg", sd=PITCH_SD_DEG), *(sensors[c] for c in read)],
            nuisance={parameter: bs.priors.normal(*about) for parameter, about in (shared | speed).items()} | start,
            subproblem="vertical",
            prescribed=["pitch"],
            window_s=cast["window"],
            ignore=() if "u" in read else ["u_mps"],
            name=name_of(cast),
        )
        record = bs.Record(tuple(thinned(channel) for channel in trial.record.channels))
        problems[trial.manoeuvre.name] = bs.Problem(
            glider,
            trial.manoeuvre,
            record,
            free=free,
            prior=prior,
            nuisance=trial.nuisance,
            noise={c: bs.likelihoods.AR1(*noise[c]) for c in read},
            dt=step,
        )
    return bs.JointProblem(problems)


def name_of(cast):
    """Such as dive_3_down."""
    return f"dive_{cast['dive']}_{'down' if cast['down'] else 'up'}"


def thinned(channel):
    """The channel with one reading in ten seconds."""
    rows = sparse(channel.times)
    return replace(channel, times=channel.times[rows], values=channel.values[rows])


def file(fit):
    """Name of the files of a fit."""
    return fit.replace(",", "").replace(" ", "_")


def calibrated(casts, rng):
    """Sds and correlation times that make the residuals of the best fits most likely, and the fit of drag and mass."""
    glider, noise = bs.load_vehicle(LOG), dict(NOISE)
    for _ in range(2):
        problem = posed(casts, FITS["depths and speeds"], noise, glider)
        mode = bs.baselines.posterior_mode(problem, rng=rng)
        noise = {channel: most_likely(problem, mode.values, channel, noise[channel]) for channel in noise}
    drags = {share: drag_and_mass(casts, noise, share) for share in (1.0, *INERTIAS)}
    (_, half), (_, quarter) = ((share, drags[share]["CD0"][0]) for share in INERTIAS)
    density = mean_density(casts)
    in_situ = glider.water_density_kgm3 / density  # gliderflight has the drag of the water of the place
    return noise, drags[1.0] | {"CD0_without_inertia": (2.0 * quarter - half) * in_situ}


def drag_and_mass(casts, noise, inertia):
    """Mean and sd of drag and mass from depths, all else as in the vehicle file, with a share of the inertia."""
    glider = bs.load_vehicle(LOG)
    body, xi = glider.body.copy(), glider.xi.copy()
    body[workspace.MASS] *= inertia
    xi[glider.equations.columns(["Xudot", "Xwq", "Zuq", "Zwdot"])] *= inertia
    lighter = replace(glider, body=body, xi=xi)
    missing = glider.body[workspace.MASS] - body[workspace.MASS]
    shared = {"weighed_mass_kg": (SHARED["weighed_mass_kg"][0] - missing, SHARED["weighed_mass_kg"][1])}
    problem = posed(casts, (("depth",), ("Xuu",), shared), noise, lighter, step=STEP_S * inertia)
    mode = bs.baselines.gauss_newton(problem)
    jacobian = problem.jacobian(mode.values)
    sds = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + np.diag(problem.prior.sd**-2.0))))
    drag, mass = (problem.names.index(name) for name in ("Xuu", "weighed_mass_kg"))
    return {
        "CD0": [-float(mode.values[drag]) / AREA, float(sds[drag]) / AREA],
        "mass_kg": [float(mode.values[mass] + missing), float(sds[mass])],
    }


def most_likely(problem, parameters, channel, guess):
    """Sd and correlation time of a channel, over all casts."""
    errors = []
    for _, one, values in problem.each_trial(parameters):
        if channel in one.rows:
            rows = one.rows[channel]
            times = next(c.times for c in one.record.channels if c.name == channel)
            errors.append((one.predicted(values)[:, rows], one.readings[rows], times))

    def cost(logarithms):
        noise = bs.likelihoods.AR1(*np.exp(logarithms))
        return -sum(noise.log_density(*parts)[0] for parts in errors)

    return [float(value) for value in np.exp(minimize(cost, np.log(guess), method="Nelder-Mead").x)]


def fit_and_predict(fit, fitted, unseen, noise):
    """Posterior of one fit, its trade-offs, its predictions of unseen casts, and the arrays that are drawn."""
    rng = np.random.default_rng([SEED, list(FITS).index(fit)])
    glider = bs.load_vehicle(LOG)
    problem = posed(fitted, FITS[fit], noise, glider)
    sampling = {"n_ensembles": 4, "max_steps": 20_000}
    posterior = bs.sample(problem, rng=rng, **sampling)
    draws = posterior.draws[rng.choice(len(posterior.draws), N_DRAWS, replace=len(posterior.draws) < N_DRAWS)]
    named = dict(zip(problem.names, draws.T, strict=True))
    density = mean_density(fitted)
    values = physical(named, density)
    before = physical(dict(zip(problem.names, problem.prior.sample(rng, 4000).T, strict=True)), density)
    shared = [k for k, name in enumerate(problem.names) if "[" not in name]
    scaled = posterior.draws[:, shared] / problem.prior.sd[shared]
    sizes, directions = np.linalg.eigh(np.cov(scaled.T))
    prediction, speeds = predicted(fit, named, unseen, noise, glider, rng)
    numbers = {
        "converged": posterior.converged,
        "seconds": posterior.seconds,
        "n_params": problem.n_params,
        "n_readings": len(problem.readings),
        "mean_density_kgm3": density,
        "parameters": {
            name: {"mean": float(np.mean(of)), "sd": float(np.std(of)), "prior_sd": float(np.std(before[name]))}
            for name, of in values.items()
        },
        "mass_volume_correlation": float(np.corrcoef(values["mass_kg"], values["volume_cm3"])[0, 1]),
        "directions": [
            {"sd": float(np.sqrt(size)), **{problem.names[k]: float(v) for k, v in zip(shared, way, strict=True)}}
            for size, way in zip(sizes[::-1], directions.T[::-1], strict=True)
        ],
        "prediction": prediction,
    }
    arrays = {"draws": values, "speeds": speeds}
    return numbers, {f"{kind} {name}": of for kind, group in arrays.items() for name, of in group.items()}


def physical(named, density):
    """The parameters of the authors, from those of the equations."""
    held = {name: np.full(len(named["Xuu"]), mean) for name, (mean, _) in COEFFICIENTS.items()}
    named = held | named
    drag = -named["Xuu"] / AREA
    lift = -named["Zuw"] / AREA - drag
    mass, volume = named["weighed_mass_kg"], named["volume_cm3"]
    return {
        "CD0": drag,
        "lift_slope": lift,
        "CD1": lift - named["Xww"] / AREA,
        "mass_kg": mass,
        "volume_cm3": volume,
        "excess_g": 1e3 * (mass - density * volume * 1e-6),
        "compressibility_1e-5_per_bar": 1e5 * named["compressibility_per_bar"],
    }


def predicted(fit, named, casts, noise, glider, rng):
    """Depths and speeds of unseen casts: shares of readings in bands, errors of the mean; arrays of the cast drawn."""
    problem = posed(casts, (tuple(noise), *FITS[fit][1:]), noise, glider)
    inside = {channel: {level: [] for level in LEVELS} for channel in noise}
    errors, speeds = {"u": [], "rate": []}, {}
    for cast, (_, one, _) in zip(casts, problem.each_trial(problem.prior.mean), strict=True):
        parameters = one.prior.sample(rng, N_DRAWS)  # of the start
        for k, name in enumerate(one.names):
            if name in named:
                parameters[:, k] = named[name]
        readings = one.predicted(parameters)
        arrays = {}
        for channel in one.record.channels:
            rows = one.rows[channel.name]
            model = bs.likelihoods.AR1(*noise[channel.name])
            noisy = np.array([model.sample(row, channel.times, rng) for row in readings[:, rows]])
            for level in LEVELS:
                low, high = np.quantile(noisy, [0.5 - level / 2.0, 0.5 + level / 2.0], axis=0)
                inside[channel.name][level].append((one.readings[rows] >= low) & (one.readings[rows] <= high))
            middle = readings[:, rows].mean(axis=0)
            if channel.name == "u":
                errors["u"].append(middle - one.readings[rows])
                arrays |= {"times": channel.times, "speed": one.readings[rows], "noisy": noisy, "middle": middle}
            else:
                travelled = (middle[-1] - middle[0]) - (one.readings[rows][-1] - one.readings[rows][0])
                errors["rate"].append(travelled / (channel.times[-1] - channel.times[0]))
        if cast == shown(casts):
            speeds = arrays
    sound = [e for e in errors["u"] if abs(e.mean()) < SOUND_MPS]
    numbers = {
        "coverage": {c: {str(level): share(of) for level, of in levels.items()} for c, levels in inside.items()},
        "coverage_of_sound_speeds": {
            str(level): share(
                [hits for hits, e in zip(inside["u"][level], errors["u"], strict=True) if abs(e.mean()) < SOUND_MPS]
            )
            for level in LEVELS
        },
        "speed_bias_mps": float(np.concatenate(sound).mean()),
        "speed_rms_mps": float(np.sqrt(np.mean(np.concatenate(sound) ** 2))),
        "speed_bias_of_casts_mps": [float(e.mean()) for e in errors["u"]],
        "depth_rate_rms_mps": float(np.sqrt(np.mean(np.square(errors["rate"])))),
    }
    return numbers, speeds


def share(hits):
    """Of readings inside."""
    return float(np.mean(np.concatenate(hits)))


def draw(run, numbers):
    """The figure and the page."""
    run.page(tables(numbers))
    drawn = list(FITS)[:2]
    arrays = {fit: run.load_arrays(f"fit_{file(fit)}") for fit in drawn}
    draws, speeds = ({fit: of_kind(kind, arrays[fit]) for fit in drawn} for kind in ("draws", "speeds"))
    peers = {}
    if numbers["gliderflight"]:
        peers = {fit: run.load_arrays(f"gliderflight_{file(fit)}") for fit in drawn}
    plots.draw(run.figure("glider"), {fit: numbers["fits"][fit] for fit in drawn}, draws, speeds, peers)


def of_kind(kind, arrays):
    """Those of the arrays of a fit that are draws, or speeds."""
    return {name.removeprefix(f"{kind} "): of for name, of in arrays.items() if name.startswith(f"{kind} ")}


def tables(numbers):
    """Parameters by fit, gliderflight's, and predictions."""
    fits = numbers["fits"]
    yield "Posterior mean and sd, and the sd of the prior:\n"
    yield "| parameter | prior sd | " + " | ".join(fits) + " |"
    yield "|---|---|" + "---|" * len(fits)
    for name, first in next(iter(fits.values()))["parameters"].items():
        cells = (f"{r['parameters'][name]['mean']:.5g} +- {r['parameters'][name]['sd']:.2g}" for r in fits.values())
        yield f"| {name} | {first['prior_sd']:.2g} | " + " | ".join(cells) + " |"
    optimum = numbers["drag and mass"]
    alone = ", ".join(f"{key} {optimum[key][0]:.5g} +- {optimum[key][1]:.2g}" for key in ("CD0", "mass_kg"))
    without = optimum["CD0_without_inertia"]
    yield f"\nDrag and mass alone, from depths: {alone}; without inertia and in water of the place CD0 {without:.5g}"
    if numbers["gliderflight"]:
        yield "\ngliderflight on the same casts:\n"
        keys = list(next(iter(numbers["gliderflight"].values())))
        yield "| calibration | " + " | ".join(keys) + " |"
        yield "|---|" + "---|" * len(keys)
        for kind, values in numbers["gliderflight"].items():
            yield f"| {kind} | " + " | ".join(f"{values[key]:.5g}" for key in keys) + " |"
    yield "\nUnseen dives: share of readings in the bands of 50 % and 90 %, and errors of the posterior mean:\n"
    yield "| fit | depths | speeds | speeds of a sound profiler | bias (m/s) | rms (m/s) | depth rate, rms (m/s) |"
    yield "|---|---|---|---|---|---|---|"
    for fit, result in fits.items():
        r = result["prediction"]
        bands = [r["coverage"]["depth"], r["coverage"]["u"], r["coverage_of_sound_speeds"]]
        cells = [", ".join(f"{of[str(level)]:.0%}" for level in LEVELS) for of in bands]
        cells += [f"{r[key]:.2g}" for key in ("speed_bias_mps", "speed_rms_mps", "depth_rate_rms_mps")]
        yield f"| {fit} | " + " | ".join(cells) + " |"


def claims(numbers):
    """What a glider without a profiler knows, and that predictions hold."""
    for fit, result in numbers["fits"].items():
        known = {name: of["sd"] / of["prior_sd"] for name, of in result["parameters"].items()}
        yield result["converged"], f"{fit}: not converged"
        yield known["mass_kg"] > 0.5 and known["volume_cm3"] > 0.5, f"{fit}: mass or volume is known by itself"
        excess = result["parameters"]["excess_g"]["sd"]
        yield excess < 10.0, f"{fit}: mass less displaced mass is known to {excess:.2g} g only"
        shares = result["prediction"]["coverage"]["depth"]
        yield 0.8 <= shares["0.9"] <= 0.97, f"{fit}: bands of 90 % hold {shares['0.9']:.0%} of the unseen depths"
    if numbers["gliderflight"]:
        optimum, theirs = numbers["drag and mass"], numbers["gliderflight"]["depths, rates by lines"]
        ours, sd = optimum["CD0_without_inertia"], optimum["CD0"][1]
        yield abs(ours - theirs["CD0"]) < 3.0 * sd, f"CD0: {ours:.4f} +- {sd:.4f}, gliderflight {theirs['CD0']:.4f}"
        (mass, sd), other = optimum["mass_kg"], theirs["mass_kg"]
        yield abs(mass - other) < 3.0 * sd, f"mass: {mass:.4f} +- {sd:.4f} kg, gliderflight {other:.4f}"
