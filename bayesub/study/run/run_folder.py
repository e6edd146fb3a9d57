"""Run folders: made, held, resumed or refused, and what they keep of their study."""

import json
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

import tomli_w

from bayesub.io import toml_files
from bayesub.io.atomic import LEDGER, LOCK, PARTIAL, entered, locked, remove, replacing, write_text, writing
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, Progress
from bayesub.study.provenance import CODE, code_change, study_change

if TYPE_CHECKING:
    from bayesub.campaign.executors import Executor

CONFIG = "config.toml"
SECONDS = "seconds.json"
CROSS_CHECK = "cross_check.json"
TRACEBACK = "traceback.txt"  # of a study of several that failed by what is no bad input
LEFT_OUT = "left_out"  # folder of the fits without one of the trials
STOPPING = (  # may change before a run is resumed
    *(f"sampler.{key}" for key in ("max_steps", "max_misfit", "rhat", "ess", "taus", "look")),
    *(f"design.{key}" for key in ("minutes", "judgements")),
)
_OLD = {"versions", "commit", "quick_run"}  # keys of a run of 0.1
_BEFORE_LEDGERS = "config.toml *.json *.jsonl *.nc *.npz *.png *.pdf report.* record*.csv check_*.csv inputs/* chain/*"
_BEFORE_LEDGERS += " left_out/* design.html prediction.html comparison.html states.csv readings.csv coefficients.csv"
_BEFORE_LEDGERS += " distances.csv manoeuvre*.csv"  # files of a run of before there were ledgers
_SAVE_S = 10.0  # of work on a run, which a kill may leave uncounted


def saved_config(folder: Path) -> dict | None:
    """The configuration of the run in a folder; None if it holds no run: other programs have files of that name too."""
    file = folder / CONFIG
    config = toml_files.read_toml_table(file) if file.exists() else {}
    return config if {"sources_sha256", "script_sha256"} & config.keys() or config.keys() >= _OLD else None


def config_of_run(folder: Path) -> dict:
    """The configuration of the run in a folder; InputError if it holds none."""
    if (config := saved_config(folder)) is None:
        raise InputError(f"{folder}: is not a run folder, there is no {CONFIG} of a run", "state", CONFIG)
    return config


@contextmanager
def open_folder(
    folder: Path,
    config: dict,
    copies: dict[str, Path] | None = None,
    *,
    read: Iterable[Path] = (),
    resume: bool = False,
    force: bool = False,
    keep_stale: bool = False,
) -> Iterator[dict]:
    """Make the run folder and hold it for this process; gives the content of its ``config.toml``.

    ``config.toml``, what the result depends on, and copies of the study's files (place in it -> file) are in it first.

    With `resume` a run of the same study (but for its stopping rule) by the same sources and versions is continued,
    with `force` an existing run is replaced, which is otherwise refused: its files are removed, and others stay. With
    `keep_stale` a run is resumed although sources or versions differ; ``config.toml`` keeps the first: it is stale.

    InputError for a run that cannot be resumed, with the first difference, is copied or `read`, and a folder in use.
    """
    saved = saved_config(folder)
    lost = {(folder / name).resolve() for name in (_written(folder, saved) if saved and not resume else ())}
    if lost.intersection(path.resolve() for path in (*read, *(copies or {}).values())):
        raise InputError(f"{folder}: is what is read; choose another with -o", "conflict", "-o")
    if resume:
        config = _resumed(folder, saved, config, keep_stale)
    elif saved is not None and not force:
        raise InputError(f"{folder}: already holds a run; {_remedy(saved, config)}", "state")
    with writing(folder):
        names = [path.name for path in folder.iterdir()] if saved is None and folder.exists() else []
        # A run that was stopped before it began leaves traces.
        if any(name not in (LOCK, LEDGER, TRACEBACK) and not name.endswith(PARTIAL) for name in names):
            raise InputError(f"{folder}: already holds other files; choose another -o", "state")
        folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        with writing(folder):
            ours = [] if saved is None else _written(folder, saved)
            if force:
                remove(folder, ours)
                ours = []
            (folder / LEDGER).unlink(missing_ok=True)  # it may be a link
            (folder / LEDGER).write_text("".join(f"{name}\n" for name in ours), encoding="utf-8")
            write_text(folder / CONFIG, tomli_w.dumps(config))
            for place, original in (copies or {}).items():
                (folder / place).parent.mkdir(exist_ok=True)
                with replacing(folder / place) as partial:
                    shutil.copyfile(original, partial)
        yield config


def _written(folder: Path, config: dict) -> list[str]:
    """What this software wrote into a run folder, by its ledger; by their names in a run of before there was one."""
    if (folder / LEDGER).is_file():
        return [name for name in entered(folder) if name != LOCK]  # which this process holds
    patterns = [*_BEFORE_LEDGERS.split(), f"{config.get('name', 'report')}.md"]
    files = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()]
    return [name for name in files if any(fnmatchcase(name, pattern) for pattern in patterns)]


def _resumed(folder: Path, saved: dict | None, config: dict, keep_stale: bool) -> dict:
    """The configuration of a run that is resumed; InputError if it cannot be."""
    if saved is None:
        raise InputError(f"{folder}: holds no run to resume; leave out --resume", "state", "--resume")
    if change := study_change(saved, config, ignored=STOPPING):
        raise InputError(f"{folder}: cannot be resumed: {change}; use --force to start afresh", "state", "--resume")
    change = code_change(saved, config)
    if change and not keep_stale:
        what = f"{folder}: cannot be resumed: {change}; use --force to start afresh"
        raise InputError(f"{what}, or --keep-stale to go on all the same", "state", "--keep-stale")
    others = {key: value for key, value in config.items() if key not in CODE}
    return others | {key: saved[key] for key in CODE if key in saved}


def _remedy(saved: dict, config: dict) -> str:
    """The remedy for a run that is in the way."""
    if change := study_change(saved, config, ignored=STOPPING):
        return f"of another study ({change}); use --force to replace it, or another -o"
    if change := code_change(saved, config):
        return f"which is stale: {change}; use --force to run it again, or another -o"
    return "use --resume to continue it or --force to replace it"


class TimedProgress:
    """Progress that counts the seconds of work on a run, over all its sessions, and keeps them in its folder."""

    def __init__(self, folder: Path, progress: Progress):
        self.file, self.progress = folder / SECONDS, progress
        self.before = 0.0
        with suppress(OSError, ValueError, TypeError, KeyError):
            self.before = float(json.loads(self.file.read_text(encoding="utf-8"))["seconds"])
        self.began = self.saved = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Seconds of work so far."""
        return self.before + time.perf_counter() - self.began

    def save(self) -> None:
        """Write the seconds into the run folder."""
        self.saved = time.perf_counter()
        write_text(self.file, json.dumps({"seconds": round(self.seconds, 3)}))

    def stage(self, name: str) -> None:
        """Save the seconds, and pass the name of the stage on."""
        self.save()
        self.progress.stage(name)

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """Pass the numbers on; the seconds are saved now and then."""
        if time.perf_counter() - self.saved > _SAVE_S:
            self.save()
        self.progress.update(done, total, unit, note)

    def remark(self, sentence: str) -> None:
        """Pass the sentence on."""
        self.progress.remark(sentence)


@dataclass(frozen=True)
class RunContext:
    """What a run works with, whatever it asks: where it writes, to whom it reports, and who works for it."""

    folder: Path  # the run folder, opened
    pdf: bool = False  # whether every figure is drawn as PDF too
    progress: Progress = SILENT  # to report to; of a run that is not only drawn again it is a :class:`TimedProgress`
    executor: "Executor | None" = None  # what does independent parts; None for processes of this machine
    commit: str = "unknown"  # of the sources that make the run, for the foot of its page

    @property
    def formats(self) -> tuple[str, ...]:
        """Suffixes of figures."""
        return (".png", ".pdf") if self.pdf else (".png",)
