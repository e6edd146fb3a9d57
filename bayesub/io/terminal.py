"""What the command line says, and how: sentences, progress bars, exit status."""

import sys
from typing import NoReturn, Protocol

import rich.progress
from rich.console import Console
from rich.progress import (
    BarColumn,
    SpinnerColumn,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130

console = Console(highlight=False, markup=False)


def say(sentence: str) -> None:
    """One line on standard output, never broken."""
    console.print(sentence, soft_wrap=True)


def complain(sentence: str, status: int) -> NoReturn:
    """One line on standard error, and the end."""
    print(f"bayesub: {sentence}", file=sys.stderr)
    sys.exit(status)


def duration(seconds: float) -> str:
    """A time in words, such as 7 s, 2 min 05 s or 1 h 03 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


class Progress(Protocol):
    """What work that takes time reports to."""

    def stage(self, name: str) -> None:
        """A stage begins, and the one before is done."""

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """So many of `total` units of the stage are done; the note says what else there is to know."""


class Silent:
    """Progress that nobody sees."""

    def stage(self, name: str) -> None:
        """As :meth:`Progress.stage`."""

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """As :meth:`Progress.update`."""


SILENT = Silent()


class Bars:
    """One progress bar a stage, with its pace and the time left; nothing when the output is not a terminal."""

    def __init__(self):
        self.bars = rich.progress.Progress(
            SpinnerColumn(),
            TextColumn("{task.description:32}"),
            BarColumn(bar_width=24),
            TaskProgressColumn(show_speed=False),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
            console=console,
            disable=console.quiet or not console.is_terminal,
        )
        self.task = None

    def __enter__(self):
        self.bars.start()
        return self

    def __exit__(self, *_):
        self._end()
        self.bars.stop()

    def _end(self):
        if self.task is not None:
            total = self.bars.tasks[self.task].total
            self.bars.update(self.task, completed=total, total=total)
            self.bars.stop_task(self.task)

    def stage(self, name: str) -> None:
        """As :meth:`Progress.stage`."""
        self._end()
        self.task = self.bars.add_task(name, total=1.0, count="", note="")

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """As :meth:`Progress.update`."""
        count = f"{done:g} of {total:g} {unit}" if unit else ""
        self.bars.update(self.task, completed=done, total=total, count=count, note=note)
