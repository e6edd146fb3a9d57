"""Checkpoints: a folder of blocks, each written once and never touched again.

``start.block`` holds what the run began with: settings, geometry, and the state of the walkers (in two copies, as
nothing could be continued without it). Each numbered block holds the steps since the one before and the state after
them. A block appears whole or not at all and begins with its own checksum, so a kill costs the block in hand. If one is
damaged later, those before it are used, and what follows is computed again, to the same bits.
"""

import hashlib
import io
import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from bayesub.io.atomic import locked, reason, replacing, writing
from bayesub.io.errors import InputError, Remark

_START = ("start.block", "start-copy.block")
_COUNTS = ("accepted", "proposed", "thin", "begun")
_ARRAYS = ("coords", "log_prob", "wide")
_DIGEST = hashlib.sha256().digest_size


@dataclass
class Spent:
    """What the steps so far have cost: attributes of the same names of :class:`bayesub.Posterior`."""

    evaluations: int = 0
    seconds: float = 0.0
    failures: dict[str, int] = field(default_factory=dict)
    jacobians: int = 0
    jacobian_price: float = float("nan")
    simulation_seconds: float = 0.0


@dataclass
class State:
    """Everything that the next step depends on, and what the steps so far have cost."""

    coords: np.ndarray  # (n_all_walkers, n_params) sampling coordinates y
    log_prob: np.ndarray  # (n_all_walkers,) log densities in y
    random_state: Any  # of emcee's generator
    spent: Spent  # so far
    accepted: int = 0  # of the proposals of steps that were kept at first
    proposed: int = 0
    thin: int = 1  # steps from one kept step to the next
    begun: int = 0  # steps when the moves became those of now
    wide: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))  # parameters drawn anew from their prior


@dataclass
class Block:
    """Kept steps and the state after them."""

    chain: np.ndarray  # (n_steps, n_all_walkers, n_params) parameters
    log_prob: np.ndarray  # (n_steps, n_all_walkers) log densities in the sampling coordinates
    state: State  # after the last of these steps


class Checkpoint:
    """A folder that is locked by this process; made by :func:`opened`."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.n_blocks = self.n_steps = 0

    def begin(self, settings: dict, geometry: dict[str, np.ndarray], state: State) -> None:
        """Keep what the run begins with."""
        for name in _START:
            self._write(name, {"settings": settings}, {"geometry_" + key: a for key, a in geometry.items()}, state)

    def append(self, block: Block) -> None:
        """Keep a further block; InputError if the disk is full, and then the earlier ones are intact."""
        self._write(
            self._name(self.n_blocks + 1), {}, {"chain": block.chain, "chain_log_prob": block.log_prob}, block.state
        )
        self.n_blocks += 1
        self.n_steps += len(block.chain)

    def load(self, settings: dict) -> tuple[dict[str, np.ndarray], State, list[Block]] | None:
        """Geometry, first state and blocks of the run that is kept here; None if there is none.

        InputError if it was begun with other settings, named in the message.
        """
        present = [name for name in _START if (self.folder / name).exists()]
        start = next((content for content in map(self._read, present) if content is not None), None)
        if start is None:
            if present:
                self._warn("its start is damaged: begun afresh")
            return None
        notes, arrays = start
        for key in settings | notes["settings"]:
            before, now = notes["settings"].get(key, "another"), settings.get(key, "none")  # where one has no such key
            if before != now:
                fault = f"{self.folder}: cannot be resumed: {key} was {before} and is now {now}"
                raise InputError(f"{fault}; remove it to start afresh", "state", key)
        geometry = {key.removeprefix("geometry_"): a for key, a in arrays.items() if key.startswith("geometry_")}
        blocks = list(self._blocks())
        self.n_blocks, self.n_steps = len(blocks), sum(len(block.chain) for block in blocks)
        return geometry, _state(notes, arrays), blocks

    def _blocks(self) -> Iterator[Block]:
        """The blocks up to the first that is missing or damaged; those after it are removed."""
        existing = sorted(self.folder.glob("[0-9]*.block"))
        for k, path in enumerate(existing, start=1):
            content = self._read(path.name) if path.name == self._name(k) else None
            if content is None:
                self._warn(f"{self._name(k)} is damaged or missing: continued from block {k - 1}")
                for later in existing[k - 1 :]:
                    later.unlink()
                return
            notes, arrays = content
            yield Block(arrays["chain"], arrays["chain_log_prob"], _state(notes, arrays))

    def _name(self, k: int) -> str:
        return f"{k:06d}.block"

    def _write(self, name, notes, arrays, state):
        generator, keys, position, has_gauss, gauss = state.random_state
        counts = {name: getattr(state, name) for name in _COUNTS}
        notes |= {"random": [generator, position, has_gauss, gauss]} | counts | vars(state.spent)
        content = io.BytesIO()
        arrays |= {name: getattr(state, name) for name in _ARRAYS}
        np.savez(content, notes=json.dumps(notes), random_keys=keys, **arrays)
        try:
            with replacing(self.folder / name) as partial, partial.open("wb") as file:
                file.write(hashlib.sha256(content.getbuffer()).digest())
                file.write(content.getbuffer())
        except OSError as error:
            fault = f"{self.folder}: checkpoint cannot be written: {reason(error)}"
            text = f"{fault}; the {self.n_steps} steps before are safe and a resumed run continues from them"
            raise InputError(text, "file", "checkpoint") from None

    def _read(self, name):
        """Notes and arrays of a block, or None if its checksum is not that of its content."""
        try:
            content = (self.folder / name).read_bytes()
        except OSError as error:
            raise InputError(f"{self.folder / name}: cannot be read: {reason(error)}", "file", "checkpoint") from None
        if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
            return None
        with np.load(io.BytesIO(content[_DIGEST:])) as file:
            arrays = dict(file)
        return json.loads(str(arrays.pop("notes"))), arrays

    def _warn(self, sentence):
        warnings.warn(f"{self.folder}: {sentence}", Remark, stacklevel=2)


def _state(notes, arrays) -> State:
    generator, position, has_gauss, gauss = notes["random"]
    random_state = generator, arrays["random_keys"], position, has_gauss, gauss
    spent = Spent(**{part.name: notes[part.name] for part in fields(Spent)})
    numbers = {name: arrays[name] for name in _ARRAYS} | {name: notes[name] for name in _COUNTS}
    return State(random_state=random_state, spent=spent, **numbers)


@contextmanager
def opened(path: str | Path | None) -> Iterator[Checkpoint | None]:
    """The checkpoint in a folder, made if need be and locked until the block ends; None for no path."""
    if path is None:
        yield None
        return
    folder = Path(path)
    if folder.is_file():
        message = f"{folder}: is a file, not the folder of a checkpoint; remove it or choose another"
        raise InputError(message, "file", "checkpoint")
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        yield Checkpoint(folder)
