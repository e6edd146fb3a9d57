"""Posteriors on disk, as ArviZ reads them: the one module that knows ArviZ and its file format.

One chain a parameter and ensemble: the draws of an ensemble are laid out walker after walker, so that ArviZ's
autocorrelations see the steps of a walker in order. Both ArviZ 0.23 (Python 3.11) and 1.x read the file.
"""

import hashlib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from bayesub.inference.sampling.posterior import DIAGNOSTICS, Criteria, Posterior
from bayesub.io.atomic import replacing, writing
from bayesub.io.errors import InputError

DIGEST = "sha256"  # the attribute with the digest of what the rest says
SEAL = b"bayesub sha256 "  # after the file as HDF5 has it, with the digest of its bytes, which are checked before HDF5
_CRITERIA = ("rhat", "ess", "taus", "false_alarms")
# Attributes of a posterior that are attributes of its file, and their types.
_NUMBERS: dict[str, type] = dict.fromkeys(("n_warmup", "thin", "evaluations", "jacobians"), int) | dict.fromkeys(
    ("acceptance", "seconds", "jacobian_price", "simulation_seconds"), float
)


def to_datasets(posterior: Posterior) -> dict[str, xr.Dataset]:
    """The groups ``posterior``, ``sample_stats`` and ``convergence``, the first two with dimensions chain and draw."""
    judged = posterior.thinned()
    chain, log_prob = judged.chain, judged.log_prob
    n_ensembles, n_kept, n_walkers, _ = chain.shape
    steps = posterior.n_steps - 1 - judged.thin * np.arange(n_kept)[::-1]
    walker, step = np.meshgrid(np.arange(n_walkers), steps, indexing="ij")

    def flat(steps):
        return ("chain", "draw"), np.ascontiguousarray(np.swapaxes(steps, 1, 2)).reshape(n_ensembles, -1)

    coordinates = {"chain": np.arange(n_ensembles), "draw": np.arange(walker.size)}
    draws = xr.Dataset({name: flat(chain[..., k]) for k, name in enumerate(posterior.names)}, coords=coordinates)
    draws.attrs = {
        **{name: getattr(judged, name) for name in _NUMBERS},
        "n_steps": posterior.n_steps,
        "n_walkers": n_walkers,
        "layout": "walker after walker within a chain, which is one independent ensemble",
        **{f"failures_{word}": count for word, count in posterior.failures.items()},
        **{f"criterion_{key}": getattr(posterior.criteria, key) for key in _CRITERIA},
    }
    stats = xr.Dataset({"lp": flat(log_prob)}, coords=coordinates)
    stats["walker"] = ("draw", walker.ravel())
    stats["step"] = ("draw", step.ravel())
    by_parameter: dict[str, Any] = {
        key: ("parameter", getattr(posterior, key)) for key in ("prior_mean", "prior_sd", *DIAGNOSTICS[1:])
    }
    by_parameter["tau"] = ("ensemble", "parameter"), posterior.tau
    summary = xr.Dataset(by_parameter, coords={"parameter": list(posterior.names)})
    return {"posterior": draws, "sample_stats": stats, "convergence": summary}


def to_arviz(posterior: Posterior) -> Any:
    """The posterior as ArviZ's own container: InferenceData before ArviZ 1, an xarray DataTree from it on."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # ArviZ announces its successor once a day
        import arviz as az

    datasets: Any = to_datasets(posterior)
    return az.InferenceData(**datasets) if az.__version__.startswith("0.") else xr.DataTree.from_dict(datasets)


def save(posterior: Posterior, path: Path) -> None:
    """Write ``posterior.nc``: the draws that convergence was judged by, and what they said."""
    datasets = to_datasets(posterior)
    datasets["posterior"].attrs[DIGEST] = _digest(datasets)
    content = bytes(xr.DataTree.from_dict(datasets).to_netcdf(engine="h5netcdf"))
    with writing(path), replacing(path) as partial:  # from memory: HDF5 does not survive a disk that is full
        partial.write_bytes(content + SEAL + hashlib.sha256(content).digest())


def _digest(datasets: dict[str, xr.Dataset]) -> str:
    """The SHA-256 of all that a file says, but for what it says of itself."""
    found = hashlib.sha256()
    for group, dataset in datasets.items():
        attrs = {key: np.asarray(value).item() for key, value in dataset.attrs.items() if key != DIGEST}
        found.update(f"{group} {sorted(attrs.items())}".encode())
        for name in sorted(map(str, dataset.variables)):
            values = dataset[name].values
            content = values.tobytes() if values.dtype.kind in "iuf" else str(values.tolist()).encode()
            found.update(f"{name} {values.shape}".encode() + content)
    return found.hexdigest()


def _check_bytes(path: Path) -> None:
    """ValueError for a file with a seal that was damaged, which may hang HDF5; others may be copies without one."""
    with path.open("rb") as file:
        content = file.read()
    content, seal, digest = content[: -len(SEAL) - 32], content[-len(SEAL) - 32 : -32], content[-32:]
    if seal == SEAL and hashlib.sha256(content).digest() != digest:
        raise ValueError("its bytes are not those that were written")


def load(path: Path) -> Posterior:
    """Read ``posterior.nc``; InputError if it is missing, damaged, was changed, or is not one of ours."""
    try:
        _check_bytes(path)
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            datasets = {g: tree[g].to_dataset().load() for g in ("posterior", "sample_stats", "convergence")}
        posterior = _read(*datasets.values())
        digest = datasets["posterior"].attrs.get(DIGEST)  # older files have none
        is_changed = digest is not None and digest != _digest(datasets)
    except (OSError, LookupError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise InputError(f"{path}: is not a readable posterior ({error})", "format") from None
    if not (np.isfinite(posterior.chain).all() and np.isfinite(posterior.log_prob).all()):
        raise InputError(
            f"{path}: is damaged: there are draws that are not numbers; run it again with --force", "format"
        )
    if is_changed:
        raise InputError(f"{path}: is damaged or was changed since it was written; run it again with --force", "format")
    return posterior


def _read(draws: xr.Dataset, stats: xr.Dataset, summary: xr.Dataset) -> Posterior:
    """The posterior of the groups of a file."""
    names = tuple(str(name) for name in summary["parameter"].values)
    attrs = draws.attrs
    n_walkers = int(attrs["n_walkers"])

    def ensembles(array):
        return np.swapaxes(array.values.reshape(array.sizes["chain"], n_walkers, -1), 1, 2)

    limits: dict[str, Any] = {key: float(attrs[f"criterion_{key}"]) for key in _CRITERIA}
    posterior = Posterior(
        names=names,
        chain=np.stack([ensembles(draws[name]) for name in names], axis=-1),
        log_prob=ensembles(stats["lp"]),
        prior_mean=summary["prior_mean"].values,
        prior_sd=summary["prior_sd"].values,
        failures={k.removeprefix("failures_"): int(v) for k, v in attrs.items() if k.startswith("failures_")},
        criteria=Criteria(**limits),
        **{name: kind(attrs[name]) for name, kind in _NUMBERS.items()},
    )
    # What has been computed once takes the place of cached properties.
    known = {key: summary[key].values for key in DIAGNOSTICS if key in summary}  # files before 0.3 lack the last
    vars(posterior).update(known, n_steps=int(attrs["n_steps"]))
    return posterior
