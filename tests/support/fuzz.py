"""Drive bayesub with changed files, thousands if asked: BAYESUB_FUZZ=5000 pytest -s -n 0 tests/cli/test_hostile.py

Every file goes through `bayesub check`; what that accepts is flown. A file may be refused, in one line that names it
and says why, or accepted, and then every number that comes of it is finite or the boat fails in words. Anything else is
a defect: another exception, a refusal of several lines, a number that is not finite, more than ten seconds or two
gigabytes.
"""

import contextlib
import faulthandler
import io
import json
import resource
import traceback
import warnings
from pathlib import Path

import numpy as np
from support import mutations

import bayesub as bs
from bayesub.cli import app
from bayesub.io.errors import InputError
from bayesub.logs import log_files
from bayesub.model.equations import load_equations
from bayesub.model.equations.generate import source
from bayesub.study.before import check
from bayesub.study.run.prepare import prepare
from bayesub.study.schema.study_file import load_study

SECONDS, BYTES, LONGEST = 10.0, 2 << 30, 600
SENSORS = [bs.sensors.Track(0.5, 0.5, channels=("x", "y", "yaw")), bs.sensors.Sensor("u_mps", sd=0.01)]


class Defect(Exception):
    """What must not happen."""


def bayesub(*arguments) -> tuple[int, str]:
    """Exit status and output of the command line, in this process; InputError passes."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), warnings.catch_warnings():
        warnings.simplefilter("error")
        status = app.app.main([str(a) for a in arguments], prog_name="bayesub", standalone_mode=False)
    return status or 0, out.getvalue()


def finite_track(path: Path, columns: tuple[str, ...]) -> None:
    """The track of a boat with actuators of these columns, which did not fail, is finite throughout."""
    log = log_files.read_log(path, columns)
    if not all(np.isfinite(column).all() for column in log.values()):
        raise Defect("a track that is 'ok' is not finite")


def flown_by_its_actuators(path: Path) -> None:
    """Fly a vehicle file on a history of what its actuators do."""
    columns = bs.load_vehicle(path).actuators.columns
    history = path.parent / "history.csv"
    history.write_text(mutations.history(columns=[column for column in columns if column != "rpm"]))
    flown(path.parent, path, history)


def flown(folder: Path, vehicle, manoeuvre, *options) -> None:
    status, out = bayesub("simulate", vehicle, manoeuvre, "-o", folder / "track.csv", *options)
    if status and not ("diverged" in out or "left_envelope" in out):
        raise Defect(f"status {status} without a word: {out}")
    if not status:
        finite_track(folder / "track.csv", bs.load_vehicle(vehicle).actuators.columns)


def drive(kind: str, path: Path) -> None:
    """Take a file of a kind through the command line; InputError if it is refused."""
    folder = path.parent
    if kind in ("equations", "boat of a set"):
        drive_set(kind, path)
        return
    if kind in mutations.BESIDE:
        name, text = mutations.BESIDE[kind]
        (folder / name).write_bytes(path.read_bytes())
        path, kind = folder / "study.toml", "study"
        path.write_text(text)
    try:
        text = bayesub("check", path, "--json")[1]
    except InputError as error:
        if not any(name in str(error) for name in (path.name, *(beside for beside, _ in mutations.BESIDE.values()))):
            raise Defect(f"a refusal that names no file: {error}") from None
        raise
    json.loads(text, parse_constant=_refuse_constant)
    if kind == "vehicle":
        flown_by_its_actuators(path)
    elif kind in ("manoeuvre", "history"):
        flown(folder, "auv690", path)
    elif kind == "disturbance":
        flown(folder, "auv690", "horizontal", "--disturbance", path)
    elif kind == "geometry":
        made = folder / "made.toml"
        made.unlink(missing_ok=True)
        bayesub("new", "vehicle", "made", "--geometry", path, "-o", made)
        bayesub("check", made, "--json")
    elif kind == "log":
        record = bs.Record.load(path, SENSORS)
        if not all(np.isfinite(channel.values).all() for channel in record.channels):
            raise Defect("a reading is not finite")
    elif kind == "study":
        problem = prepare(load_study(path)).problem
        found = problem.log_prob(problem.prior.mean[None])[0]
        if not (np.isfinite(found) or (found == -np.inf and "at the prior means" in text)):
            raise Defect(f"the log posterior at the prior mean is {found}")


def drive_set(kind: str, path: Path) -> None:
    """An equation set: its kernels are Python and its regressors finite. A boat of a set that is compiled: it flies."""
    try:
        if kind == "boat of a set":
            return flown_by_its_actuators(path)
        equations = load_equations(path)
    except InputError as error:
        if path.name not in str(error):
            raise Defect(f"a refusal that names no file: {error}") from None
        raise
    if "terms" in check._KINDS:  # what `bayesub check` knows
        bayesub("check", path, "--json")
    for subproblem in equations.subproblems:
        compile(source(equations, subproblem), path.name, "exec")
    rng = np.random.default_rng(1)
    states, rates = rng.standard_normal((9, 12)), rng.standard_normal((9, 6))
    hull = np.array([[-1.0, 1.0], [0.2, 0.3], [0.2, 0.3]])
    controls = rng.standard_normal((9, len(equations.controls) + 1))
    blocks = equations.regressors(states, rates, controls, equations.constants(1.0, hull))
    if not all(np.isfinite(block).all() for block in blocks.values()):
        raise Defect("a regressor is not finite")
    return None


def _refuse_constant(name):
    raise Defect(f"JSON holds {name}")


def verdict(kind: str, path: Path) -> tuple[str, str]:
    """What became of a file: "refused", "accepted" or the name of a defect, and what was said."""
    try:
        drive(kind, path)
    except InputError as error:
        said = str(error)
        if len(said.splitlines()) != 1 or not said.isprintable() or len(said) > LONGEST:
            return "unclear", ascii(said[:LONGEST])
        return "refused", said
    except Defect as defect:
        return "absurd", str(defect)
    except BaseException:
        return "traceback", traceback.format_exc()
    return "accepted", ""


@contextlib.contextmanager
def limited(folder: Path):
    """Memory is limited, once what is compiled is loaded; what is given begins the time of a file anew."""
    for kind, _, text in mutations.corpus():
        if kind in ("vehicle", "boat of a set"):
            (folder / "good_boat.toml").write_text(text)
            flown_by_its_actuators(folder / "good_boat.toml")
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + BYTES, before[1]))
    try:
        yield lambda: faulthandler.dump_traceback_later(SECONDS, exit=True)
    finally:
        faulthandler.cancel_dump_traceback_later()
        resource.setrlimit(resource.RLIMIT_AS, before)


def files(n: int, seed: int):
    """Kind, suffix, name of the change and content of `n` changed files."""
    good = mutations.corpus()
    for k in range(n):
        rng = np.random.default_rng([seed, k])
        kind, suffix, text = good[k % len(good)]
        data, change = mutations.mutated(text, rng)
        yield kind, suffix, change, data
