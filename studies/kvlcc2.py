"""Does a posterior of four zig-zags of a real tanker model predict its other trials, and those of another basin?

Question: the trials of KVLCC2 for the workshop SIMMAN of 2008, free-running models of 7 m. HSVA's zig-zags 10/10 and
20/10 to both sides are fitted; its nine others and MARIN's six trials are predicted from rudder and first seconds.
Claim: the posterior mean follows seven of the nine headings and most of MARIN's better than the published coefficients
do, and its 90 % bands hold 80 to 97 % of the readings. The two that it does not follow are those with 5 and 10 degrees
of rudder and one degree of heading: there a tenth of a degree of rudder turns the heading by more than ten, and the
rudder zero of a run is that uncertain. With a zero of its own each of the nine is followed to ten degrees.
Cost: a quarter of an hour, most of it for the posterior. The data are not ours to give: the environment variable
BAYESUB_KVLCC2 names a folder with HSVA_CPMC_KVLCC2_Z_*.dat and MARIN_FREE_KVLCC2_*.dat; without it the study is
skipped, and with --quick too.
"""

import os
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

import bayesub as bs
from bayesub.logs import log_files
from bayesub.model.linear_form import stacked
from bayesub.report.markdown import columns
from bayesub.report.plots import style
from bayesub.study.schema.trial_log import read_trial
from thesis.measured_motion import Motion

FOLDER = Path(__file__).parent
FITTED = ("10_10_P", "10_10_S", "20_10_P", "20_10_S")
ZIGZAGS = ("05_01", "10_01", "10_05", "15_01", "15_05", "20_05", "25_05", "30_05", "35_05")
MARIN = ("zz_-10_m", "zz_10_m", "zz_-20_m", "zz_20_m", "tc_-35_m", "tc_35_m")
SCALE = 45.714  # of MARIN's numbers, which are of the ship
HELD = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", "Y0", "N0")  # added masses; what the rudder zero does as well
SDS = {"x_m": 0.1, "y_m": 0.1, "yaw_deg": 0.5, "u_mps": 0.01, "v_mps": 0.01, "r_degps": 0.05}
# Sds of unmodelled forces, non-dimensional: 2 % of the resistance, and of force and moment of the rudder hard over.
FORCES = {"X": 3.8e-5, "Y": 3.3e-5, "N": 1.6e-5}
ROW_S, READING_S, STEP_S = 0.2, 4.0, 0.2  # rows of the logs; readings: neighbours of less are correlated; time step
ZERO = bs.priors.normal(0.0, 0.5)  # of the rudder, degrees
SMOOTH_S = 2.2  # window of the differences that linear least squares takes
N_DRAWS, N_STARTS, MAX_STEPS, SEED = 400, 3, 6000, 1
LEVELS = (50, 90)
METHODS = ("posterior", "literature", "SQP", "linear least squares")
FIGURES = {
    "errors": "Heading error of each run by method: the posterior mean beside published coefficients, SQP and linear "
    "least squares; bars are the posterior mean with a rudder zero of the run's own. The two runs that nobody "
    "follows without are those with one degree of heading.",
    "headings": "Headings of the runs, and the bands of the posterior.",
}
ANSWER = """
The posterior of four zig-zags follows the heading of unseen zig-zags with five degrees between reversals to
{runs/*_05/errors/posterior/heading_deg; median; .1f} degrees, published coefficients to
{runs/*_05/errors/literature/heading_deg; median; .1f} (medians). On the run 10/1 a tenth of a degree of rudder
turns the heading by {runs/10_01/best_zero/by_tenth_deg; .0f} degrees; with a rudder zero of its own the posterior
mean follows it to {runs/10_01/best_zero/heading_deg; .1f}.
"""


def compute(run):
    """Errors and bands of all predictions."""
    folder = os.environ.get("BAYESUB_KVLCC2")
    if not folder or not list(Path(folder).glob("HSVA_CPMC_KVLCC2_Z_*.dat")):
        return {"skipped": "BAYESUB_KVLCC2 does not name a folder with the files HSVA_CPMC_KVLCC2_Z_*.dat"}
    if run.quick:
        return {"skipped": "there is no small version: the posterior is of four whole trials"}
    tanker = Tanker(Path(folder))
    numbers = {"estimates": run.part("estimates", partial(estimates, run, tanker))}
    posterior = sampled(run, tanker)
    run.progress.stage("predict")
    numbers["posterior"] = {
        "shortcomings": list(posterior.shortcomings),
        "seconds": posterior.seconds,
        "rudder_zero_deg": summary(posterior, "bias_rudder_deg"),
    }
    arrays, numbers["runs"] = {}, {}
    for name in (*FITTED, *ZIGZAGS, *MARIN):
        numbers["runs"][name] = predicted(tanker, name, posterior, numbers["estimates"], arrays)
        run.progress.update(len(numbers["runs"]), len(FITTED + ZIGZAGS + MARIN), "runs", name)
    run.save_arrays("bands", **arrays)
    return numbers


class Tanker:
    """The boat, and the problems that its trials pose."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.boat = bs.load_vehicle(FOLDER / "kvlcc2" / "vehicle.toml")
        self.free = [name for name in self.boat.equations.names if name not in HELD]
        self.prior = bs.priors.from_vehicle(self.boat)
        self.forces = bs.UnknownDisturbance(("X", "Y", "N"), FORCES, 60.0, "matern_3_2", 30.0)

    def log(self, name: str) -> dict[str, np.ndarray]:
        """Column -> values every 0.2 s, of the model; velocities over the ground in earth axes are turned to u, v."""
        tank, scale = ("MARIN_FREE_KVLCC2_", SCALE) if name in MARIN else ("HSVA_CPMC_KVLCC2_Z_", 1.0)
        text = (self.folder / f"{tank}{name}.dat").read_text(encoding="latin-1")
        rows = np.array([line.split() for line in text.splitlines() if _is_row(line)], dtype=float).T
        if name in MARIN:  # stamps of three digits; 50 Hz of the model
            _, x, y, _, psi, dx, dy, _, r, rudder, _ = rows
            times = 0.02 * np.arange(len(x))
        else:
            times, x, y, psi, dx, dy, r, _, rudder, *_ = rows
        cos, sin = np.cos(np.radians(psi)), np.sin(np.radians(psi))
        speed = np.sqrt(scale)
        log = {"time_s": times, "x_m": x / scale, "y_m": y / scale, "yaw_deg": psi, "rudder_deg": rudder}
        log |= {"u_mps": (dx * cos + dy * sin) / speed, "v_mps": (dy * cos - dx * sin) / speed, "r_degps": r * speed}
        every = round(ROW_S / np.median(np.diff(times)))
        return {column: values[::every] for column, values in log.items()}

    def trial(self, name: str):
        """The log as a trial, with one reading in four seconds."""
        sensors = [bs.sensors.Sensor(column, sd=sd) for column, sd in SDS.items()]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{name}.csv"
            log = self.log(name)
            rows = np.column_stack(list(log.values()))
            np.savetxt(path, rows, delimiter=",", comments="", fmt="%.6g", header=",".join(log))
            trial = read_trial(path, self.boat, sensors, subproblem="horizontal", nuisance={})
        every = round(READING_S / ROW_S)
        thinned = [replace(c, times=c.times[::every], values=c.values[::every]) for c in trial.record.channels]
        return replace(trial, record=bs.Record(tuple(thinned)))

    def problem(self, name: str, disturbance=None) -> bs.Problem:
        """A trial with unknown start and rudder zero, and with unmodelled forces or without."""
        trial = self.trial(name)
        nuisance = trial.nuisance | {"bias_rudder_deg": ZERO}
        options = {"free": self.free, "prior": self.prior, "nuisance": nuisance, "dt": STEP_S}
        return bs.Problem(self.boat, trial.manoeuvre, trial.record, disturbance=disturbance, **options)

    def joint(self, disturbance=None) -> bs.JointProblem:
        """The four trials that are fitted."""
        return bs.JointProblem({f"HSVA_CPMC_KVLCC2_Z_{name}": self.problem(name, disturbance) for name in FITTED})


def _is_row(line):
    try:
        return len([float(cell) for cell in line.split()]) > 10
    except ValueError:
        return False


def sampled(run, tanker):
    """The posterior of the four trials, kept in the run folder."""
    file = run.folder / "posterior.nc"
    if not file.exists():
        run.progress.stage("sample the posterior")
        options = {"max_steps": MAX_STEPS, "checkpoint": run.folder / "chain", "progress": run.progress}
        bs.sample(tanker.joint(tanker.forces), rng=np.random.default_rng(SEED), **options).save(file)
    return bs.Posterior.load(file)


def summary(posterior, name):
    """Mean and sd of a parameter."""
    k = posterior.names.index(name)
    return {"mean": float(posterior.mean[k]), "sd": float(posterior.sd[k])}


def estimates(run, tanker):
    """Coefficients by SQP on the track, and by least squares on differenced velocities, as practitioners do."""
    run.progress.stage("SQP")
    plain = tanker.joint().naive()
    sqp = bs.baselines.sqp(plain, rng=np.random.default_rng(SEED), n_starts=N_STARTS, progress=run.progress)
    motions = [differenced(tanker, name) for name in FITTED]
    systems = stacked([bs.linear_systems(m, free=tanker.free) for m in motions], tanker.boat.equations.names)
    guess = dict(zip(tanker.boat.equations.names, tanker.boat.xi, strict=True))
    linear = bs.baselines.linear_least_squares(systems, {name: guess[name] for name in tanker.free})
    methods = {"SQP": sqp, "linear least squares": linear}
    return {key: dict(zip(e.names, e.values.tolist(), strict=True)) for key, e in methods.items()}


def differenced(tanker, name):
    """Velocities, and accelerations by quadratics through two seconds of them."""
    log, problem = tanker.log(name), tanker.problem(name)
    velocities = np.stack([log["u_mps"], log["v_mps"], np.radians(log["r_degps"])])
    window = round(SMOOTH_S / ROW_S)
    smooth = savgol_filter(velocities, window, 2)
    rates = savgol_filter(velocities, window, 2, deriv=1, delta=ROW_S)
    simulator = problem.simulator.at(log["time_s"])
    states, accelerations = np.zeros((1, len(log["time_s"]), 12)), np.zeros((1, len(log["time_s"]), 6))
    places = log_files.positions("u", "v", "r")
    states[0][:, places] = smooth.T
    accelerations[0][:, [0, 1, 5]] = rates.T
    controls = np.radians(log["rudder_deg"])[:, None]
    return Motion(log["time_s"], states, accelerations, controls, simulator, tanker.boat.xi[None])


def predicted(tanker, name, posterior, coefficients, arrays):
    """Errors of each method on a run, coverage of the bands, and the rudder zero that the run itself would have."""
    problem = tanker.problem(name, tanker.forces)
    rng = np.random.default_rng(SEED)
    places = {k: posterior.names.index(n) for k, n in enumerate(problem.names) if n in posterior.names}
    draws = posterior.draws[rng.choice(len(posterior.draws), N_DRAWS)]
    middle = problem.prior.mean.copy()
    middle[[n.startswith("disturbance_") for n in problem.names]] = 0.0
    members = {
        "literature": middle,
        **{key: with_values(problem, middle, values) for key, values in coefficients.items()},
    }
    flown = np.array(problem.prior.sample(rng, N_DRAWS))  # the start and the forces are of this run
    members["posterior"] = middle.copy()
    for k, place in places.items():
        flown[:, k] = draws[:, place]
        members["posterior"][k] = posterior.mean[place]
    rows, readings = problem.rows, problem.readings
    tracks = problem.predicted(np.stack([members[key] for key in METHODS]))
    flights = problem.predicted(flown)
    flights = flights[np.isfinite(flights).all(axis=1)]
    noisy = flights + problem.sds * rng.standard_normal(flights.shape)
    bands = {level: np.percentile(noisy, [50 - level / 2, 50 + level / 2], axis=0) for level in LEVELS}
    inside = {level: (low <= readings) & (readings <= high) for level, (low, high) in bands.items()}
    yaw = rows["yaw"]
    arrays[f"{name} times"] = problem.channels["yaw"][0].times
    headings = np.stack([readings[yaw], *bands[90][:, yaw], *tracks[:, yaw]])
    arrays[f"{name} headings"] = np.degrees(headings).astype(np.float32)
    zero = best_zero(problem, members["posterior"])
    return {
        "duration_s": float(problem.duration),
        "errors": {key: errors(problem, track) for key, track in zip(METHODS, tracks, strict=True)},
        "coverage": {str(level): float(part.mean()) for level, part in inside.items()},
        "coverage_heading": {str(level): float(part[yaw].mean()) for level, part in inside.items()},
        "failed": N_DRAWS - len(flights),
        "best_zero": zero,
    }


def with_values(problem, values, coefficients):
    """Parameters with these coefficients."""
    return np.array([coefficients.get(name, value) for name, value in zip(problem.names, values, strict=True)])


def errors(problem, track):
    """Root mean squares of heading and position, and the error of the first two overshoots; None if it ended early."""
    if not np.isfinite(track).all():
        return {"heading_deg": None, "track_m": None, "overshoot_deg": None}
    rows, off = problem.rows, track - problem.readings
    heading = np.degrees(np.sqrt(np.mean(off[rows["yaw"]] ** 2)))
    position = np.sqrt(np.mean(off[rows["x"]] ** 2 + off[rows["y"]] ** 2))
    times = problem.channels["yaw"][0].times
    theirs, ours = (overshoots(problem, times, angles[rows["yaw"]]) for angles in (problem.readings, track))
    overshoot = float(np.mean(np.abs(ours - theirs))) if len(ours) else None
    return {"heading_deg": float(heading), "track_m": float(position), "overshoot_deg": overshoot}


def overshoots(problem, times, yaw):
    """(2,) how far the heading goes on after the first two reversals of the rudder, deg; empty of a turning circle."""
    history = problem.manoeuvre
    rudder = history.controls[:, 0]
    put = np.abs(rudder) > 0.5 * np.abs(rudder).max()
    sides = np.sign(rudder[put])
    reversals = history.times[put][np.flatnonzero(np.diff(sides)) + 1]
    ends = [*reversals[1:], times[-1]]  # one more than there are reversals in a turning circle
    angles = np.degrees(np.unwrap(yaw))
    result = []
    for begin, end in zip(reversals[:2], ends, strict=False):
        after = (times >= begin) & (times <= end)
        start = np.interp(begin, times, angles)
        way = np.sign(start - np.interp(max(begin - 8.0, 0.0), times, angles))
        if after.any():
            result.append(max(0.0, np.max(way * (angles[after] - start))))
    return np.array(result)


def best_zero(problem, values):
    """The rudder zero with which the posterior mean follows a run best, and what a tenth of a degree does."""
    k, yaw = problem.names.index("bias_rudder_deg"), problem.rows["yaw"]
    zeros = np.linspace(-3.0, 3.0, 241)
    batch = np.repeat(values[None], len(zeros), axis=0)
    batch[:, k] = zeros
    off = problem.predicted(batch)[:, yaw] - problem.readings[yaw]
    rms = np.degrees(np.sqrt(np.mean(off**2, axis=1)))
    best = int(np.nanargmin(rms))
    moved = np.degrees(np.sqrt(np.mean((off[best] - off[best - 4 if best > 120 else best + 4]) ** 2)))
    return {"zero_deg": float(zeros[best]), "heading_deg": float(rms[best]), "by_tenth_deg": float(moved)}


def better(numbers, names):
    """The runs whose heading the posterior mean follows better than the literature."""
    pairs = {n: [numbers["runs"][n]["errors"][key]["heading_deg"] for key in METHODS[:2]] for n in names}
    return [n for n, (ours, theirs) in pairs.items() if ours is not None and (theirs is None or ours < theirs)]


def coverage(numbers, names, level=90):
    """Share of the readings of runs inside their bands."""
    return float(np.mean([numbers["runs"][n]["coverage"][str(level)] for n in names]))


def draw(run, numbers):
    """Headings with their bands; errors of all methods; the table."""
    run.page(tables(numbers))
    draw_errors(run.figure("errors"), numbers)
    draw_headings(run.figure("headings"), run.load_arrays("bands"))


def draw_headings(paths, arrays):
    """Nine zig-zags and the turning circles, measured and predicted."""
    names = (*ZIGZAGS, "zz_-20_m", "tc_-35_m", "tc_35_m")
    with style.figure(paths, 8.3, 8.6) as fig:
        for k, name in enumerate(names):
            axes = fig.add_subplot(4, 3, k + 1)
            times, headings = arrays[f"{name} times"], arrays[f"{name} headings"]
            readings, low, high, ours, theirs, *_ = headings
            axes.fill_between(times, low, high, color=style.POSTERIOR, alpha=0.2, lw=0, label="90 % band")
            axes.plot(times, theirs, "--", color=style.SQP, lw=1.2, label="literature")
            axes.plot(times, ours, color=style.POSTERIOR, lw=1.4, label="posterior mean")
            axes.plot(times, readings, ".", color=style.TRUTH, ms=3, label="measured")
            if not name.startswith("tc"):
                axes.set_ylim(-130.0, 130.0)
            axes.set_title(title(name), fontsize=9)
            if k >= len(names) - 3:
                axes.set_xlabel("time (s)")
            if k % 3 == 0:
                axes.set_ylabel("heading (deg)")
        fig.legend(*axes.get_legend_handles_labels(), ncols=4, loc="outside lower center")


def title(name):
    """A run in words."""
    if name in MARIN:
        kind, angle, _ = name.split("_")
        return f"MARIN, {'turning circle' if kind == 'tc' else 'zig-zag'} {angle}°"
    angle, heading, *side = name.split("_")
    return f"zig-zag {int(angle)}/{int(heading)}{f' {side[0]}' if side else ''}"


def draw_errors(paths, numbers):
    """Heading errors of each method on each run."""
    names = (*FITTED, *ZIGZAGS, *MARIN)
    looks = dict(
        zip(METHODS, (("o", style.POSTERIOR), ("s", style.SQP), ("^", style.WEAK), ("x", style.LINEAR)), strict=True)
    )
    with style.figure(paths, 8.3, 4.2) as fig:
        axes = fig.add_subplot()
        for method, (marker, colour) in looks.items():
            values = [numbers["runs"][n]["errors"][method]["heading_deg"] for n in names]
            axes.plot(
                range(len(names)), [np.nan if v is None else v for v in values], marker, color=colour, label=method
            )
        values = [numbers["runs"][n]["best_zero"]["heading_deg"] for n in names]
        axes.plot(
            range(len(names)), values, "_", color=style.TRUTH, ms=12, label="posterior, best rudder zero of the run"
        )
        axes.set_yscale("log")
        axes.set_ylabel("heading error, rms (deg)")
        axes.set_xticks(
            range(len(names)), [title(n).replace("turning circle", "circle") for n in names], rotation=60, ha="right"
        )
        axes.axvspan(-0.5, len(FITTED) - 0.5, color=style.PRIOR, alpha=0.3, lw=0)
        edges = np.cumsum([0, len(FITTED), len(ZIGZAGS), len(MARIN)]) - 0.5
        axes.set_xlim(edges[0], edges[-1])
        for start, end, word in zip(edges[:-1], edges[1:], ("fitted", "predicted", "predicted, MARIN"), strict=True):
            axes.axvline(end, color=style.TRUTH, lw=0.5, ls=":")
            look = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom", "fontsize": 8}
            axes.text(0.5 * (start + end), 1.0, word, **look)
        axes.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.05))


def tables(numbers):
    """Every run: errors by method, coverage, and its own rudder zero."""
    yield "Errors of predictions with the rudder of the log: heading (deg, rms) / track (m, rms) / first two overshoots"
    yield "(deg); a dash where a flight leaves the range of the equations. Share of the readings in the bands. The"
    yield "rudder zero with which the posterior mean follows the run best, the heading error with it, and how far a"
    yield "tenth of a degree turns the heading. Sds of readings and forces, and the prior of what is not the same to"
    yield "both sides, were chosen while these predictions were looked at.\n"
    rows = [numbers["runs"][name] | {"name": name} for name in numbers["runs"]]
    cells = {"run": lambda r: title(r["name"]) + (", fitted" if r["name"] in FITTED else "")}
    cells |= {key: lambda r, key=key: triple(r["errors"][key]) for key in METHODS}
    cells |= {f"{level} % band": lambda r, level=level: f"{r['coverage'][str(level)]:.0%}" for level in LEVELS}
    cell = "{zero_deg:.2f}°: {heading_deg:.1f}°, {by_tenth_deg:.1f}°"
    cells |= {"best zero": lambda r: cell.format(**r["best_zero"])}
    yield from columns(rows, cells)
    for names, basin in ((ZIGZAGS, "HSVA"), (MARIN, "MARIN")):
        shares = " and ".join(f"{coverage(numbers, names, level):.0%}" for level in LEVELS)
        n = len(better(numbers, names))
        yield f"\n{basin}: in {n} of {len(names)} trials the posterior mean follows the heading better than the"
        yield f"literature; bands of 50 and 90 % hold {shares} of the readings."


def triple(error):
    """Three errors in a cell."""
    return " / ".join(
        "–" if error[key] is None else f"{error[key]:.1f}" for key in ("heading_deg", "track_m", "overshoot_deg")
    )


def claims(numbers):
    """Better than the literature where prediction is possible, with honest bands."""
    if "skipped" in numbers:
        return
    wins = better(numbers, ZIGZAGS)
    yield len(wins) >= 7, f"the literature predicts the heading of {len(ZIGZAGS) - len(wins)} of 9 runs better"
    share = coverage(numbers, ZIGZAGS)
    yield 0.80 <= share <= 0.97, f"the 90 % bands hold {share:.0%} of the readings"
    yield len(better(numbers, MARIN)) >= 4, "the literature predicts most of MARIN's trials better"
    for name in set(ZIGZAGS) - set(wins):
        zero = numbers["runs"][name]["best_zero"]
        yield (
            zero["by_tenth_deg"] > 5.0,
            f"{name}: a tenth of a degree of rudder moves the heading by {zero['by_tenth_deg']:.1f}",
        )
    worst = max(numbers["runs"][name]["best_zero"]["heading_deg"] for name in ZIGZAGS)
    yield worst < 10.0, f"with its own rudder zero a run is {worst:.1f} degrees off"
