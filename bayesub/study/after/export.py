"""What a finished run is written as for others: a vehicle file, draws, tables, the coefficients of other simulators."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from bayesub.findings.simulator_conventions import Boat, losses, standard, written
from bayesub.io.arguments import checked
from bayesub.io.atomic import replacing, write_csv, write_text, writing
from bayesub.io.errors import InputError, check_known
from bayesub.kernels import workspace
from bayesub.model.manoeuvres import Manoeuvre
from bayesub.model.vehicles import Vehicle
from bayesub.problem.nuisance import BODY, Nuisances, find, of_boat, of_instrument
from bayesub.report import parameter_tables
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.after.knowledge import Knowledge, coefficients, known, prior_of, vehicle_file
from bayesub.study.run.run_folder import saved_config

_TOLD = BODY.keys() - {*workspace.THRUST}  # parameters of the body that files for simulators have


@dataclass(frozen=True)
class Format:
    """A way to write a posterior."""

    suffix: str  # of the files that are written so
    meaning: str  # in words
    write: Callable[[FinishedRun, Path], None] | None = None  # of a run to a path; None of coefficients for a simulator


def _table(made) -> Callable[[FinishedRun, Path], None]:
    """The writer of a table of all parameters, histories of forces left out."""

    def write(run, path):
        is_plain, n = run.study.disturbance is None, len(run.posterior.names)
        others = np.arange(n) if is_plain else run.setup().problem.others
        write_text(path, made(run.posterior.part(others), run.vehicle.equations))

    return write


def _write_simulator(kind: str, run: FinishedRun, path: Path, fleet: int, seed: int) -> None:
    """Write the coefficients for a simulator: the means, or so many draws, each with what terms that it lacks cost."""
    places, xi, mean = coefficients(run), run.vehicle.xi.copy(), known(run)
    fixed = prior_of(run)[1]
    xi[run.vehicle.equations.columns(fixed)] = list(fixed.values())
    draws = run.posterior.draws
    plain = replace(run.vehicle, xi=xi)
    if fleet > len(draws):
        raise InputError(f"--fleet: the posterior has {len(draws)} draws; ask for so many at most", "limit", "--fleet")
    manoeuvres = standard(plain) or [trial.manoeuvre for trial in run.setup().trials.values()]
    vehicle = _with_body(plain, manoeuvres[0], run.posterior.names, draws.mean(axis=0))
    lost = losses(kind, Boat(vehicle, mean), manoeuvres)
    others = f"; inferred besides, and not in this file: {', '.join(untold(run))}" if untold(run) else ""
    boats = [(path, vehicle, mean, f"posterior means{others}")]
    if fleet:
        rows = np.random.default_rng(seed).choice(len(draws), fleet, replace=False).tolist()
        names, sd, boats = tuple(run.posterior.names[k] for k in places), np.full(len(places), np.nan), []
        for k, row in enumerate(rows, start=1):
            file = path.with_stem(f"{path.stem}_{k:0{len(str(fleet))}d}")
            what = f"draw {row} of the posterior, {k} of {fleet} by the seed {seed}{others}"
            drawn = _with_body(plain, manoeuvres[0], run.posterior.names, draws[row])
            boats.append((file, drawn, Knowledge(names, draws[row, places], sd, np.eye(len(names))), what))
    for file, drawn, one, what in boats:
        write_text(file, written(kind, Boat(drawn, one, lost), f"study '{run.study.name}': {what}", manoeuvres))


def _with_body(vehicle: Vehicle, manoeuvre: Manoeuvre, names: Sequence[str], values: np.ndarray) -> Vehicle:
    """A vehicle with what parameters (n_params,) say of mass, inertia and centres; of any manoeuvre that it flies."""
    told, whole = [k for k, name in enumerate(names) if name in _TOLD], replace(manoeuvre, subproblem=None)
    unknown = Nuisances(tuple(find(names[k], vehicle, whole, (), ()) for k in told), vehicle, whole)
    body = unknown.body(values[None, told])
    return vehicle if body is None else replace(vehicle, body=body[0])


def untold(run: FinishedRun) -> list[str]:
    """What a run has inferred of its boat and a file for a simulator has not, as of actuators and of thrust."""
    of_run = [name for name in run.posterior.names if of_boat(name, run.vehicle) and name not in _TOLD]
    return [name for name in of_run if not of_instrument(name, run.vehicle)]


def draws(run: FinishedRun) -> pd.DataFrame:
    """A row for each draw: its chain, which is an independent ensemble, its walker, log density and parameters."""
    posterior = run.posterior
    n_chains, n_kept, n_walkers, _ = posterior.chain.shape
    chain, _, walker = np.indices((n_chains, n_kept, n_walkers)).reshape(3, -1)
    places = {"chain": chain, "walker": walker, "log_prob": posterior.log_prob.ravel()}
    return pd.DataFrame(places | dict(zip(posterior.names, posterior.draws.T, strict=True)))


def _parquet(run: FinishedRun, path: Path) -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        text = "Parquet needs pyarrow: pip install 'bayesub[parquet]', or choose CSV or NetCDF"
        raise InputError(text, "install", "pyarrow") from None
    with replacing(path) as partial, partial.open("wb") as file:
        draws(run).to_parquet(file, engine="pyarrow", index=False)


FORMATS = {
    "vehicle": Format(
        ".toml",
        "vehicle file with sds and correlations, a prior",
        lambda run, path: write_text(path, vehicle_file(run, path)),
    ),
    "csv": Format(".csv", "draws", lambda run, path: write_csv(path, draws(run), digits=None)),
    "netcdf": Format(".nc", "draws and diagnostics, as ArviZ reads them", lambda run, path: run.posterior.save(path)),
    "parquet": Format(".parquet", "draws", _parquet),
    "latex": Format(".tex", "table", _table(parameter_tables.latex)),
    "markdown": Format(".md", "table", _table(parameter_tables.markdown)),
    "mss": Format(".m", "coefficients as Fossen's MSS names them"),
    "mss-json": Format(".json", "the same as JSON"),
    "pvs": Format(".py", "what PythonVehicleSimulator takes"),
    "gazebo": Format(".sdf", "a model of Gazebo with the plugin Hydrodynamics"),
    "stonefish": Format(".xml", "mass, inertia and centres for Stonefish, which takes no coefficients"),
    "holoocean": Format(".json", "an agent of HoloOcean with what its torpedo takes"),
}


def format_of(path: Path, kind: str | None) -> str:
    """The name of the format that is wanted, or of the suffix of the file; InputError if there is no such format."""
    if kind is not None:
        check_known(kind, FORMATS, f"no format '{kind}'", hint=f"choose one of {', '.join(FORMATS)}", key="--as")
        return kind
    suffixes = {one.suffix: "" for one in FORMATS.values()}  # of two formats with one suffix the first counts
    suffixes |= {one.suffix: name for name, one in reversed(FORMATS.items())}
    hint = f"end the name with one of {', '.join(suffixes)}, or give --as"
    what = f"{path}: no format is known by the suffix '{path.suffix}'"
    check_known(path.suffix.lower(), suffixes, what, hint=hint, key="--as")
    return suffixes[path.suffix.lower()]


@checked
def export(
    folder: str | Path, path: str | Path, kind: str | None = None, *, fleet: int = 0, seed: int = 0
) -> FinishedRun:
    """Write the posterior of a finished run of a study in TOML to a file, which is replaced if there is one.

    InputError for a folder that holds no finished run, a format that is none, a boat that a simulator cannot have, a
    fleet of another format or of more than there are draws, and a file that cannot be written. What is wrong with the
    run, which is returned, is its ``doubt``.

    Parameters
    ----------
    folder : the run folder
    path : the file
    kind : "vehicle", "csv", "netcdf", "parquet", "latex", "markdown", "mss", "mss-json", "pvs", "gazebo", "stonefish"
        or "holoocean" (:data:`FORMATS`); by default that of the suffix.
    fleet : how many draws of the posterior are written for a simulator, each into a file with its number behind the
        name, in place of the means
    seed : which draws these are
    """
    folder, path = Path(folder), Path(path)
    name = format_of(path, kind)
    write = FORMATS[name].write
    if not isinstance(fleet, (int, np.integer)) or fleet < 0:
        raise InputError(f"--fleet: must be a whole number and not negative, found {fleet!r}", "value", "--fleet")
    if fleet and write is not None:
        text = f"--fleet: is of coefficients for a simulator, and the format is '{name}'; choose --as gazebo or another"
        raise InputError(text, "conflict", "--fleet")
    if folder.resolve() in path.resolve().parents or saved_config(path.resolve().parent) is not None:
        text = f"{path}: is in the folder of a run, whose files are its own; choose another -o"
        raise InputError(text, "conflict", "-o")
    run = finished_run(folder)
    with writing(path):
        if write is None:
            _write_simulator(name, run, path, fleet, seed)
        else:
            write(run, path)
    return run
