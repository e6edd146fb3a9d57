"""The words of the command line: sentences, progress bars, exit status."""

import contextlib
import io
import sys
from collections.abc import Iterator
from typing import Any, NoReturn, Protocol

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.segment import Segment
from rich.text import Text

from bayesub.io.errors import printable

BAD_INPUT, INTERRUPTED = 2, 130  # the others are those of verdicts


class _Console(Console):
    """A console on which no text that is shown moves the cursor, sets colours or turns the direction."""

    def render(self, *given: Any, **options: Any) -> Iterator[Segment]:
        """Segments of a renderable, whose texts are printable line by line."""
        for segment in super().render(*given, **options):
            text = segment.text if segment.control else "\n".join(map(printable, segment.text.split("\n")))
            yield segment._replace(text=text)


console = _Console(highlight=False, markup=False)


def accept_all_letters() -> None:
    """Have what a terminal's encoding lacks written as in a Python string, in place of an error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def say(sentence: str) -> None:
    """A sentence on standard output, whose lines are never broken."""
    console.print(sentence, soft_wrap=True)


def complain(sentence: str, status: int) -> NoReturn:
    """One line on standard error, and the end."""
    with contextlib.suppress(OSError):  # a full one
        print(f"bayesub: {printable(sentence)}", file=sys.stderr, flush=True)
    sys.exit(status)


def duration(seconds: float) -> str:
    """A time in words, such as 7 s, 2 min 05 s or 1 h 03 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def pace(speed: float | None, left: float | None) -> str:
    """The pace of work in words, such as ``12.3/s, 2 min 05 s left``; empty as long as it is not known.

    Parameters
    ----------
    speed : float or None
        Units a second.
    left : float or None
        Seconds until the work is done.
    """
    if not speed or not left:
        return ""
    units = f"{speed:.3g}/s" if speed >= 1.0 else f"{60.0 * speed:.3g}/min"
    return f"{units}, {duration(left)} left"


class Progress(Protocol):
    """What work that takes time reports to."""

    def stage(self, name: str) -> None:
        """Say that a stage begins, and that the one before is done."""

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """Say how far the stage is.

        Parameters
        ----------
        done : float
            Units that are done.
        total : float
            Units of the stage; it may change.
        unit : str
            Such as "starts" or "steps"; empty for a mere fraction.
        note : str
            Whatever else there is to know, such as the present R-hat.
        """

    def remark(self, sentence: str) -> None:
        """Say a sentence that stays on the screen."""


class _Silent:
    def stage(self, name: str) -> None: ...

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None: ...

    def remark(self, sentence: str) -> None: ...


SILENT: Progress = _Silent()  # not shown


class PaceColumn(rich.progress.ProgressColumn):
    """Pace and time left of a task that is counted in units."""

    max_refresh = 0.5

    def render(self, task: rich.progress.Task) -> Text:
        """The words of :func:`pace`; empty for a task that is done."""
        counted = task.fields.get("count") and not task.finished
        return Text(pace(task.speed, task.time_remaining) if counted else "")


class Bars:
    """One progress bar for each stage, with its pace and the time left; nothing if the output is no terminal."""

    def __init__(self):
        self.bars = rich.progress.Progress(
            SpinnerColumn(),
            TextColumn("{task.description:32}"),
            BarColumn(bar_width=24),
            TaskProgressColumn(show_speed=False),
            TextColumn("{task.fields[count]}"),
            TimeElapsedColumn(),
            PaceColumn(),
            TextColumn("{task.fields[note]}"),
            console=console,
            disable=console.quiet or not console.is_terminal,
        )
        self.task: rich.progress.TaskID | None = None

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
        """Fill the bar of the stage before, and begin one of this name."""
        self._end()
        self.task = self.bars.add_task(name, total=1.0, count="", note="")

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """Fill the bar of the stage so far."""
        task = self.bars.add_task(unit, total=1.0, count="", note="") if self.task is None else self.task
        count = f"{done:g} of {total:g} {unit}" if unit else ""
        self.bars.update(task, completed=done, total=total, count=count, note=note)
        self.task = task

    def remark(self, sentence: str) -> None:
        """Print the sentence above the bars."""
        say(sentence)
