"""Checkpoints: the chain so far and the state of the random numbers, in one HDF5 file that is replaced whole."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from bayesub.errors import InputError


@dataclass
class Progress:
    """Everything that the next step depends on.

    coords : (n_steps, n_all_walkers, n_params) sampling coordinates, log_prob : (n_steps, n_all_walkers),
    accepted : number of accepted proposals, random_state : of emcee's generator
    """

    coords: np.ndarray
    log_prob: np.ndarray
    accepted: int
    random_state: tuple


def save(path: Path, progress: Progress, fingerprint: str) -> None:
    """Write beside `path` and rename, so that a kill leaves the previous file; InputError if the disk is full."""
    partial = path.with_suffix(".partial")
    try:
        with h5py.File(partial, "w") as file:
            file["coords"] = progress.coords
            file["log_prob"] = progress.log_prob
            name, keys, position, has_gauss, gauss = progress.random_state
            file["random_keys"] = keys
            file.attrs.update(
                generator=name,
                position=position,
                has_gauss=has_gauss,
                gauss=gauss,
                accepted=progress.accepted,
                fingerprint=fingerprint,
            )
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: checkpoint cannot be written: {error}; the previous one is intact") from None


def load(path: Path, fingerprint: str) -> Progress:
    """Read a checkpoint; InputError if it is unreadable or belongs to another problem, seed or library version."""
    try:
        with h5py.File(path, "r") as file:
            attrs = dict(file.attrs)
            random_state = (
                attrs["generator"],
                file["random_keys"][:],
                int(attrs["position"]),
                int(attrs["has_gauss"]),
                float(attrs["gauss"]),
            )
            coords, log_prob = file["coords"][:], file["log_prob"][:]
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: is not a readable checkpoint ({error}); remove it to start afresh") from None
    if attrs["fingerprint"] != fingerprint:
        raise InputError(f"{path}: was made by another problem, seed or library version; remove it to start afresh")
    return Progress(coords, log_prob, int(attrs["accepted"]), random_state)
