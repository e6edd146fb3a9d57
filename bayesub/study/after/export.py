"""What a finished run is written as for others: a vehicle file, draws, tables, the coefficients of other simulators."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from bayesub.findings import simulator_conventions
from bayesub.io.atomic import replacing, write_csv, write_text, writing
from bayesub.io.errors import InputError, check_known
from bayesub.report import parameter_tables
from bayesub.study.after.finished_run import FinishedRun, finished_run
from bayesub.study.after.knowledge import known, vehicle_file


@dataclass(frozen=True)
class Format:
    """A way to write a posterior."""

    suffix: str  # of the files that are written so
    meaning: str  # in words
    write: Callable[[FinishedRun, Path], None]  # writes the posterior of a run to a path


def _text(made: Callable[[FinishedRun, Path], str]) -> Callable[[FinishedRun, Path], None]:
    return lambda run, path: write_text(path, made(run, path))


def _table(made) -> Callable[[FinishedRun, Path], None]:
    """The writer of a table of all parameters, histories of forces left out."""

    def text(run, _):
        others = np.arange(len(run.posterior.names))
        if run.study.disturbance is not None:
            others = run.setup().problem.others
        return made(run.posterior.part(others), run.vehicle.equations)

    return _text(text)


def _simulator(made) -> Callable[[FinishedRun, Path], None]:
    """The writer of the coefficients that another simulator takes."""
    return _text(lambda run, _: made(run.vehicle, known(run), f"study '{run.study.name}'"))


def draws(run: FinishedRun) -> pd.DataFrame:
    """A row for each draw: its chain, which is an independent ensemble, its walker, log density and parameters."""
    posterior = run.posterior
    n_chains, n_kept, n_walkers, _ = posterior.chain.shape
    chain, _, walker = np.indices((n_chains, n_kept, n_walkers)).reshape(3, -1)
    places = {"chain": chain, "walker": walker, "log_prob": posterior.log_prob.ravel()}
    parameters = dict(zip(posterior.names, posterior.draws.T, strict=True))
    return pd.DataFrame(places | parameters)


def _parquet(run: FinishedRun, path: Path) -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        text = "Parquet needs pyarrow: pip install 'bayesub[parquet]', or choose CSV or NetCDF"
        raise InputError(text, "install", "pyarrow") from None
    with replacing(path) as partial, partial.open("wb") as file:
        draws(run).to_parquet(file, engine="pyarrow", index=False)


FORMATS = {
    "vehicle": Format(".toml", "vehicle file with sds and correlations, a prior", _text(vehicle_file)),
    "csv": Format(".csv", "draws", lambda run, path: write_csv(path, draws(run), digits=None)),
    "netcdf": Format(".nc", "draws and diagnostics, as ArviZ reads them", lambda run, path: run.posterior.save(path)),
    "parquet": Format(".parquet", "draws", _parquet),
    "latex": Format(".tex", "table", _table(parameter_tables.latex)),
    "markdown": Format(".md", "table", _table(parameter_tables.markdown)),
    "mss": Format(".m", "coefficients as Fossen's MSS names them", _simulator(simulator_conventions.mss)),
    "mss-json": Format(".json", "the same as JSON", _simulator(simulator_conventions.mss_json)),
    "pvs": Format(".py", "what PythonVehicleSimulator takes", _simulator(simulator_conventions.pvs)),
}


def format_of(path: Path, kind: str | None) -> str:
    """The name of the format that is wanted, or of the suffix of the file; InputError if there is no such format."""
    if kind is not None:
        check_known(kind, FORMATS, f"no format '{kind}'", hint=f"choose one of {', '.join(FORMATS)}", key="--as")
        return kind
    suffixes = {one.suffix: name for name, one in FORMATS.items()}
    hint = f"end the name with one of {', '.join(suffixes)}, or give --as"
    what = f"{path}: no format is known by the suffix '{path.suffix}'"
    check_known(path.suffix.lower(), suffixes, what, hint=hint, key="--as")
    return suffixes[path.suffix.lower()]


def export(folder: str | Path, path: str | Path, kind: str | None = None) -> FinishedRun:
    """Write the posterior of a finished run of a study in TOML to a file, which is replaced if there is one.

    Parameters
    ----------
    folder : str or Path
        The run folder.
    path : str or Path
        The file.
    kind : str or None
        "vehicle", "csv", "netcdf", "parquet", "latex", "markdown", "mss", "mss-json" or "pvs"
        (:data:`FORMATS`); by default that of the suffix.

    Returns
    -------
    FinishedRun
        With the vehicle, the study and the posterior, and what is wrong with the run (``doubt``).

    Raises
    ------
    InputError
        For a folder that holds no finished run, a format that is none, and a file that cannot be written.
    """
    folder, path = Path(folder), Path(path)
    chosen = FORMATS[format_of(path, kind)]
    if folder.resolve() in path.resolve().parents:
        text = f"{path}: is in the folder of the run, whose files are its own; choose another -o"
        raise InputError(text, "conflict", "-o")
    run = finished_run(folder)
    with writing(path):
        chosen.write(run, path)
    return run
