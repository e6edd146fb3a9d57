"""Does a mission of a real torpedo AUV under autopilot say enough about its coefficients to predict others?

Question: an Iver2 with a water-quality nose, at the surface of Biscayne Bay on 2021-01-30. Two minutes of a
mission are fitted: 1 Hz, commands of the fins in counts, fixes and speed of a satellite receiver, a compass. The way
back of the same mission and parts of three later ones are predicted from the fins and the first 20 s.
Claim: with start, current, compass zero and clocks inferred the heading of the way back is missed by more than 45
degrees. With the fins' zero inferred it is followed within 35, in bands that are too narrow. With a yaw moment that
varies besides, the errors of all four parts are as large as the posterior says, some 30 degrees to either side after
two minutes, more than half of which is the fins' zero. An autopilot answers that moment with the rudder: four in five
logs of missions show it, and none of a run by hand.
Cost: two hours, most of them for the posterior. The logs are not ours to give: the environment variable BAYESUB_IVER2
names a clone of gregorymurad/marineRobotics, or its folder Logs; without it the study is skipped, and with --quick too.
"""

import csv
import os
import shutil
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import tomlkit

import bayesub as bs
from bayesub.findings import feedback, unseen
from bayesub.inference.checks.prediction import laplace, predict
from bayesub.report.markdown import columns
from bayesub.report.plots import style
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

FOLDER = Path(__file__).parent / "iver2"
MISSIONS = ("130339", "135713", "140634", "143547")  # when each began
NAMES = {"same": "way back of the mission fitted", **{name: f"mission at {name[:2]}:{name[2:4]}" for name in MISSIONS}}
AMIDSHIPS, COUNT_DEG = 128, 0.16  # of the fins: counts, and what a count is taken for
COUNT_RPM = 20.0  # the same of the motor
KNOTS = 1852.0 / 3600.0
NORMAL_90 = 1.645  # standard deviations of half of a 90 % interval
# What a study infers besides coefficients, start and current, each with all before it: and what it does not infer yet.
WITHOUT = {
    "compass zero and clocks": ("bias_rudder_deg", "noise", "disturbance"),
    "fins' zero": ("noise", "disturbance"),
    "slow errors of the sensors": ("disturbance",),
}
ALL = "yaw moment that varies"
N_DRAWS, MAX_STEPS, SEED = 400, 45_000, 1
FIGURES = {
    "headings": "Headings that were not fitted: measured (dots), posterior mean and 90 % band. Grey: the first 20 s, "
    "which say start, current and compass zero.",
    "steps": "What each thing inferred does for the way back: error of the heading, and share of all readings in the "
    "90 % bands, which should be 90 %. The fins' zero makes the prediction, the yaw moment makes its bands honest.",
}
ANSWER = """
Without the fins' zero the heading of the way back is missed by
{steps/compass zero and clocks/heading_deg; .0f} degrees (root mean square), with it by
{steps/slow errors of the sensors/heading_deg; .0f}, but the 90 % bands hold
{steps/slow errors of the sensors/coverage; percent; .0f} % of its readings. With a yaw moment that varies the bands are
{predictions/same/channels/heading/half_width; .0f} degrees to either side and the errors as large as they say, there
and in three later missions. A count of the fins' zero, {count_deg; .2f} degrees, turns that heading by
{by_count_deg; .0f} degrees, and the log says the zero to {zero/sd; .1f} degrees: that is
{zero_share; percent; .0f} % of the bands. A run by hand, with steps of the rudder, would say more.
"""


def compute(run):
    """Errors of the predictions, with and without what is inferred besides."""
    folder = os.environ.get("BAYESUB_IVER2")
    files = {name: next(Path(folder).rglob(f"20210130_{name}_*.csv"), None) for name in MISSIONS if folder}
    if not folder or None in files.values():
        return {"skipped": "BAYESUB_IVER2 does not name a folder with the files 20210130_*_IVER2-218.csv"}
    if run.quick:
        return {"skipped": "there is no small version: a short search ends far from the mode"}
    with tempfile.TemporaryDirectory() as scratch:
        for name in ("study.toml", "vehicle.toml"):
            shutil.copy(FOLDER / name, scratch)
        for name, file in files.items():
            write(read(file), Path(scratch) / f"{name}.csv")
        return answered(run, Path(scratch), Path(folder))


def answered(run, scratch, folder):
    """The numbers, with the logs of the missions in a folder."""
    setup = posed(scratch)
    posterior = sampled(run, setup.problem)
    run.progress.stage("predict")
    rng = np.random.default_rng(SEED)
    found = [unseen.predicted_trial(trial, setup.problem, posterior, [], rng) for trial in setup.unseen]
    headings = {}
    for one in found:
        prediction, part = one.posterior, one.posterior.slices["heading"]
        rows = [
            prediction.times[part],
            prediction.readings[part],
            prediction.mean[part],
            *prediction.bands[0.9][:, part],
        ]
        headings[one.trial.name] = np.degrees(np.stack([np.radians(rows[0]), *rows[1:]])).astype(np.float32)
    run.save_arrays("bands", **headings)
    predictions = {row.pop("name"): row for row in unseen.numbers(found)}
    makes = {name: partial(lesser, scratch, drop, posterior) for name, drop in WITHOUT.items()}
    steps = run.parts("studies that infer less", makes)
    turned = by_count(setup, posterior)
    same, zero = predictions["same"], summary(posterior, "bias_rudder_deg")
    steps[ALL] = {"heading_deg": same["channels"]["heading"]["rms"]["posterior"], "coverage": same["coverage"]["90 %"]}
    return {
        "shortcomings": list(posterior.shortcomings),
        "seconds": posterior.seconds,
        "parameters": {
            name: summary(posterior, name) for name in posterior.names if not name.startswith("disturbance_")
        },
        "zero": zero,
        "steps": steps,
        "predictions": predictions,
        "count_deg": COUNT_DEG,
        "by_count_deg": turned,
        "zero_share": NORMAL_90 * turned * zero["sd"] / COUNT_DEG / same["channels"]["heading"]["half_width"],
        "autopilot": autopilots(folder),
    }


def read(file):
    """Column -> values (n,) of a log of the boat; seconds are counted from its first row."""
    with file.open(encoding="latin-1", newline="") as stream:
        rows = list(csv.DictReader(stream))
    clock = np.array([[float(part) for part in row["Time"].split(":")[-2:]] for row in rows])
    seconds = np.unwrap(clock @ [60.0, 1.0], period=3600.0)  # minutes and seconds, as a spreadsheet left them
    ours = {"rudder_command_deg": "Fin Yaw T", "rpm": "Motor Speed CMD", "latitude_deg": "Latitude"}
    ours |= {"longitude_deg": "Longitude", "heading_deg": "C True Heading", "speed_over_ground_mps": "GPS Speed (Kn)"}
    log = {column: np.array([float(row[name] or "nan") for row in rows]) for column, name in ours.items()}
    log["rudder_command_deg"] = -COUNT_DEG * (log["rudder_command_deg"] - AMIDSHIPS)  # more counts turn to starboard
    log["rpm"] = COUNT_RPM * (log["rpm"] - AMIDSHIPS)
    log["speed_over_ground_mps"] *= KNOTS
    later = np.diff(seconds, prepend=-np.inf) > 0.0
    return {"time_s": seconds[later] - seconds[0]} | {column: values[later] for column, values in log.items()}


def write(log, path):
    """The log as a CSV."""
    np.savetxt(path, np.column_stack(list(log.values())), delimiter=",", comments="", fmt="%.9g", header=",".join(log))


def posed(scratch, drop=()):
    """The study, prepared; without some nuisance parameters and sections, and then with the first check only."""
    document = tomlkit.parse((scratch / "study.toml").read_text(encoding="utf-8"))
    for name in drop:
        del (document if name in document else document["nuisance"])[name]
        del document["check"][1:]
    path = scratch / f"posed_{len(drop)}.toml"  # several are posed at once
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    return prepare(load_study(path))


def sampled(run, problem):
    """The posterior, kept in the run folder."""
    file = run.folder / "posterior.nc"
    if not file.exists():
        run.progress.stage("sample the posterior")
        options = {"max_steps": MAX_STEPS, "checkpoint": run.folder / "chain", "progress": run.progress}
        bs.sample(problem, rng=np.random.default_rng(SEED), **options).save(file)
    return bs.Posterior.load(file)


def summary(posterior, name):
    """Mean and sd of a parameter."""
    k = posterior.names.index(name)
    return {"mean": float(posterior.mean[k]), "sd": float(posterior.sd[k])}


def lesser(scratch, drop, posterior):
    """Error and coverage of the way back by a study that infers less: normal draws about its nearest mode."""
    setup, rng = posed(scratch, drop), np.random.default_rng(SEED)
    problem, (trial,) = setup.problem, setup.unseen
    known = dict(zip(posterior.names, posterior.best, strict=True))
    start = np.array([known.get(name, value) for name, value in zip(problem.names, problem.prior.mean, strict=True)])
    draws = laplace(problem, rng, N_DRAWS, start)
    ((_, parameters),) = unseen.transfer(trial, problem, [("", draws)], rng)
    found = predict(trial.problem, parameters, rng, warm_up=trial.warm_up_s)
    return {"heading_deg": float(np.degrees(found.rms["heading"])), "coverage": found.coverage[0.9]}


def by_count(setup, posterior):
    """How far a count of the fins' zero turns the heading of the way back, deg rms, start and all else held."""
    problem = setup.unseen[0].problem
    known = dict(zip(posterior.names, posterior.mean, strict=True))
    values = np.array(
        [
            known.get(n, v) if n in posterior.names[: problem.n_coefficients] or n == "bias_rudder_deg" else v
            for n, v in zip(problem.names, problem.prior.mean, strict=True)
        ]
    )
    other = values.copy()
    other[problem.names.index("bias_rudder_deg")] += COUNT_DEG
    one, two = problem.predicted(np.stack([values, other]))[:, problem.rows["heading"]]
    return float(np.degrees(np.sqrt(np.mean((one - two) ** 2))))


def autopilots(folder):
    """In how many logs with a hundred rows under way the rudder answers the heading: missions, and runs by hand."""
    counts = {kind: {"logs": 0, "answer": 0} for kind in ("missions", "by hand")}
    seen = set()
    for file in sorted(folder.rglob("*.csv")):
        try:
            log = read(file)
        except (KeyError, ValueError):  # without a column, or with a cell that is no number
            continue
        way = np.flatnonzero(log["speed_over_ground_mps"] > 0.5)
        digest = log["heading_deg"].tobytes()
        if len(way) < 100 or digest in seen or not np.ptp(log["rudder_command_deg"][way]):
            continue
        seen.add(digest)
        part = slice(way[0], way[-1])
        kind = counts["by hand" if file.name.startswith("ManualLog") else "missions"]
        kind["logs"] += 1
        heading = np.unwrap(log["heading_deg"][part], period=360.0)
        kind["answer"] += feedback.answer(log["rudder_command_deg"][part], heading)[0] > 0.0
    return counts


def draw(run, numbers):
    """The headings with their bands, what each thing inferred does, and the tables."""
    run.page(tables(numbers))
    draw_headings(run.figure("headings"), run.load_arrays("bands"), numbers)
    draw_steps(run.figure("steps"), numbers["steps"])


def draw_headings(paths, arrays, numbers):
    """Four parts of missions, measured and predicted."""
    with style.figure(paths, 8.3, 5.4) as fig:
        for k, (name, row) in enumerate(numbers["predictions"].items()):
            axes = fig.add_subplot(2, 2, k + 1)
            times, readings, mean, low, high = arrays[name]
            axes.axvspan(0.0, row["first_s"], color=style.PRIOR, alpha=0.3, lw=0)
            axes.fill_between(times, low, high, color=style.POSTERIOR, alpha=0.2, lw=0, label="90 % band")
            axes.plot(times, mean, color=style.POSTERIOR, lw=1.4, label="posterior mean")
            axes.plot(times, readings, ".", color=style.TRUTH, ms=3, label="measured")
            axes.set_title(NAMES[name], fontsize=9)
            axes.set_xlim(0.0, times[-1])
            if k > 1:
                axes.set_xlabel("time (s)")
            if k % 2 == 0:
                axes.set_ylabel("heading (deg)")
        fig.legend(*axes.get_legend_handles_labels(), ncols=3, loc="outside lower center")


def draw_steps(paths, steps):
    """Errors and coverage, a row for each thing that is inferred besides."""
    with style.figure(paths, 8.3, 2.6) as fig:
        left, right = fig.subplots(1, 2, sharey=True)
        places = np.arange(len(steps))[::-1]
        left.plot([row["heading_deg"] for row in steps.values()], places, "o", color=style.POSTERIOR)
        left.set_xlabel("heading error, rms (deg)")
        left.set_xlim(left=0.0)
        left.set_yticks(places, [f"{'+ ' * (k > 0)}{name}" for k, name in enumerate(steps)])
        right.plot([100.0 * row["coverage"] for row in steps.values()], places, "s", color=style.POSTERIOR)
        right.axvline(90.0, color=style.TRUTH, lw=0.8, ls=":")
        right.set_xlim(0.0, 100.0)
        right.set_xlabel("readings in 90 % bands (%)")


def tables(numbers):
    """Each prediction, what each thing inferred does, and the parameters."""
    yield "Predictions by the posterior: error of the heading (deg, rms), mean half-width of its 90 % band, error of"
    yield "the track (m, rms of x and of y), and share of all readings in the bands."
    yield "Sds and correlation times were chosen while the way back was looked at, and not the later missions."
    yield f"The posterior: {'; '.join(numbers['shortcomings']) or 'converged'}.\n"
    rows = [row | {"name": name} for name, row in numbers["predictions"].items()]
    cells = {"log": lambda row: NAMES[row["name"]]}
    cells["heading"] = lambda row: f"{row['channels']['heading']['rms']['posterior']:.0f}°"
    cells["band"] = lambda row: f"±{row['channels']['heading']['half_width']:.0f}°"
    cells["x, y"] = lambda row: " / ".join(f"{row['channels'][c]['rms']['posterior']:.0f}" for c in "xy")
    cells["50 % band"] = lambda row: f"{row['coverage']['50 %']:.0%}"
    cells["90 % band"] = lambda row: f"{row['coverage']['90 %']:.0%}"
    cells["predicted"] = lambda row: "yes" if row["predicts"] else "no"
    yield from columns(rows, cells)
    yield "\nThe way back by studies that infer more and more besides coefficients, start and current.\n"
    rows = [{"name": name} | row for name, row in numbers["steps"].items()]
    cells = {"inferred, with all above": lambda row: row["name"], "heading": lambda row: f"{row['heading_deg']:.0f}°"}
    yield from columns(rows, cells | {"90 % band": lambda row: f"{row['coverage']:.0%}"})
    yield "\nParameters (mean, standard deviation).\n"
    rows = [{"name": name} | row for name, row in numbers["parameters"].items()]
    cells = {"parameter": lambda row: row["name"], "mean": lambda row: f"{row['mean']:.3g}"}
    yield from columns(rows, cells | {"sd": lambda row: f"{row['sd']:.2g}"})
    missions, by_hand = (numbers["autopilot"][kind] for kind in ("missions", "by hand"))
    yield f"\nThe rudder answers the heading in {missions['answer']} of {missions['logs']} logs of missions in the"
    yield f"folder, and in {by_hand['answer']} of {by_hand['logs']} logs of runs by hand."


def claims(numbers):
    """The zero makes the prediction, the moment its bands, and autopilots are recognised."""
    if "skipped" in numbers:
        return
    steps, autopilot = numbers["steps"], numbers["autopilot"]
    first = steps[next(iter(WITHOUT))]["heading_deg"]
    yield first > 45.0, f"without the fins' zero the heading is off by {first:.0f} degrees"
    worst = max(row["heading_deg"] for row in list(steps.values())[1:])
    yield worst < 35.0, f"with the fins' zero the heading is off by {worst:.0f} degrees"
    narrow = max(row["coverage"] for name, row in steps.items() if name != ALL)
    yield narrow < 0.75, f"without the yaw moment 90 % bands hold {narrow:.0%}"
    for name, row in numbers["predictions"].items():
        yield row["predicts"], f"the {NAMES[name]} is not predicted"
    yield numbers["zero_share"] > 0.5, f"the fins' zero is {numbers['zero_share']:.0%} of the bands"
    missions, by_hand = autopilot["missions"], autopilot["by hand"]
    yield missions["answer"] >= 0.8 * missions["logs"], "autopilots are not recognised"
    yield not by_hand["answer"], "a run by hand is taken for an autopilot's"
