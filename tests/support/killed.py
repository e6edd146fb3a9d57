"""Lives that are ended from outside: run, prediction, design and campaign, each into a folder, from where it left off.

A fork server imports this module with BAYESUB_WARM=1; it then loads and compiles all, and every life is a copy of it.
"""

import os
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

os.environ.setdefault("NUMBA_THREADING_LAYER", "workqueue")  # that of GNU may not be copied

from support import pieces, small_study

import bayesub as bs
from bayesub.campaign.campaign import Lines, complete
from bayesub.campaign.executors import Serial
from bayesub.findings import derived
from bayesub.inference.sampling import sampler
from bayesub.report import page, report
from bayesub.study.after import design, predict

NAMES = {str(k): k for k in range(12)}


def run(place: Path, folder: Path) -> None:
    """`bayesub run`, with `--resume` if there is something to resume."""
    figures = report.figures
    report.figures = lambda *given: (replace(f, draw=small_study.leave_empty) for f in figures(*given))
    derived.N_DRAWS, sampler.BLOCK_SECONDS = 16, 0.02  # blocks of a chain end often
    bs.run(place / "tiny.toml", folder, resume=(folder / "config.toml").exists())


def predicted(place: Path, folder: Path) -> None:
    """`bayesub predict --force`, of the run in the place."""
    draw_all = page.draw_all
    page.draw_all = lambda parts, *rest, **options: draw_all(
        [replace(part, draw=small_study.leave_empty) for part in parts], *rest, **options
    )
    predict.predict_by_run(predict.Request(place / "run", "zigzag_10_10", draws=200), folder, force=True)


def designed(_: Path, folder: Path) -> None:
    """`bayesub design`, with `--resume` if there is something to resume."""
    page.draw_all = lambda *_, **__: {}
    request = design.Request("auv690", subproblem="horizontal", families=("standard",), judgements=60)
    design.design(request, folder, resume=(folder / "config.toml").exists(), executor=Serial())


def campaign(_: Path, folder: Path) -> None:
    """Pieces of work that take a while, kept line by line."""
    folder.mkdir(exist_ok=True)
    store = Lines(folder / "campaign.jsonl", NAMES)
    complete(Serial(), partial(pieces.slow, 0.05), NAMES, store, failures=folder / "failures.txt")


KINDS = {"run": run, "predict": predicted, "design": designed, "campaign": campaign}


def make(place: Path) -> None:
    """The study and, in the folder `run`, its run."""
    small_study.write(place / "tiny.toml", **small_study.TINY | {"name": "tiny"})
    small_study.run(place / "tiny.toml", place / "run")


if os.environ.get("BAYESUB_WARM"):
    with tempfile.TemporaryDirectory() as name:
        make(Path(name))
