"""The words of the command line: sentences, progress bars, exit status."""

import contextlib
import io
import math
import sys
import textwrap
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NoReturn, Protocol

import rich.progress
from rich.console import Console
from rich.progress import BarColumn, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.segment import Segment
from rich.table import Column
from rich.text import Text

from bayesub.io.errors import printable

BAD_INPUT, INTERRUPTED = 2, 130  # the others are those of verdicts
_SAY_S = 60.0  # between two lines of a stage where there are no bars
LONG_S = 5.0  # of a stage of a command that is mostly soon over, from which it has a line


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


def say(sentence: str, style: str = "") -> None:
    """A sentence on standard output, whose lines are never broken; `style` is a colour where there are colours."""
    console.print(sentence, soft_wrap=True, style=style)


def width() -> int:
    """Characters of a line of text."""
    return min(console.width, 100)


def aligned(rows: Iterable[Sequence[str]], indent: str = "  ") -> list[str]:
    """Rows of equally many cells as lines whose columns are aligned, the last cell wrapped with a hanging indent."""
    texts = [[printable(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*(row[:-1] for row in texts), strict=True)]
    lines = []
    for *cells, last in texts:
        head = indent + "".join(f"{cell:<{size}}  " for cell, size in zip(cells, widths, strict=True))
        hang = " " * len(head) if cells else f"{indent}  "
        wrapper = textwrap.TextWrapper(max(width(), len(head) + 20), head, hang, break_long_words=False)
        wrapper.break_on_hyphens = False
        lines += [line.rstrip() for line in wrapper.wrap(last) or [head]]
    return lines


def say_rows(rows: Iterable[Sequence[str]], indent: str = "  ") -> None:
    """Print :func:`aligned` rows."""
    for line in aligned(rows, indent):
        say(line)


class Ended(SystemExit):
    """The end of a command by its own decision, and not by that of code which a study brings."""


def complain(sentence: str, status: int) -> NoReturn:
    """One line on standard error, and the end."""
    with contextlib.suppress(OSError):  # a full one
        print(f"bayesub: {printable(sentence)}", file=sys.stderr, flush=True)
    raise Ended(status)


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

    Speed is in units a second, and what is left in seconds.
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
        """Say how far the stage is: units done of its total, which may change.

        A unit is such as "starts" or "steps", empty for a mere fraction; a note such as the present R-hat.
        """

    def remark(self, sentence: str) -> None:
        """Say a sentence that stays on the screen; a command in it has an indented line of its own."""


class _Silent(Progress):
    """Progress that is not shown."""


SILENT: Progress = _Silent()  # type: ignore[abstract]  # its methods do nothing


class _Tail(rich.progress.ProgressColumn):
    """Count, pace, time left and note of a task, as far as there is room in the line."""

    max_refresh = 0.5

    def render(self, task: rich.progress.Task) -> Text:
        """The words, empty of a task that has not counted yet."""
        count, note = task.fields["count"], task.fields["note"]
        words = (count, pace(task.speed, task.time_remaining) if count else "", note)
        return Text(", ".join(filter(None, words)), no_wrap=True, overflow="ellipsis")


class Bars:
    """The stage at work as a bar with its pace and the time left, and a line with its time for each that has ended.

    Where the output is no terminal a long stage has a line a minute. A stage that took less than `least_s` has none.
    """

    def __init__(self, least_s: float = 0.0):
        self.least = least_s
        self.bars = rich.progress.Progress(
            SpinnerColumn(table_column=Column(no_wrap=True)),
            TextColumn("{task.description}", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=12, table_column=Column(no_wrap=True)),
            TaskProgressColumn(show_speed=False, table_column=Column(no_wrap=True)),
            TimeElapsedColumn(table_column=Column(no_wrap=True)),
            _Tail(),
            console=console,
            transient=True,
            disable=console.quiet or not console.is_terminal,
        )
        self.name = ""  # of the stage at work
        self.began = self.said = 0.0
        self.words = self.so_far = ("", "")  # how much is done, of how much if it is not yet all, and the note
        self.ended = threading.Event()

    def __enter__(self):
        self.bars.start()
        if self.bars.disable and self.least < math.inf:
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(self, kind, *_):
        if kind is None:
            self._end()
        self.ended.set()
        self.bars.stop()

    def _watch(self):
        while not self.ended.wait(0.1 * _SAY_S):
            if self.name and time.perf_counter() - self.said > _SAY_S:
                self.said = time.perf_counter()
                self._say(*self.so_far, state=" so far")

    def _end(self):
        if self.name and time.perf_counter() - self.began >= self.least:
            self._say(*self.words)
        for task in self.bars.task_ids:
            self.bars.remove_task(task)
        self.name = ""

    def _say(self, *words: str, state: str = ""):
        seconds = time.perf_counter() - self.began
        taken = f"{seconds:.1f} s" if seconds < 9.95 else duration(seconds)
        say(f"  {self.name:<28} {taken:>11}{state}  {', '.join(filter(None, words))}".rstrip())

    def stage(self, name: str) -> None:
        """Say how long the stage before took, and begin one of this name."""
        self._end()
        self.began = self.said = time.perf_counter()
        self.name, self.words, self.so_far = name, ("", ""), ("", "")
        self.bars.add_task(name, total=None, count="", note="")

    def update(self, done: float, total: float, unit: str = "", note: str = "") -> None:
        """Fill the bar of the stage so far."""
        if not self.name:
            self.stage(unit)
        count = f"{done:g} of {total:g} {unit}" if unit else ""
        self.words = (f"{done:g} {unit.removesuffix('s') if done == 1 else unit}" if unit else "", note)
        self.so_far = (count, note)
        for task in self.bars.task_ids:
            self.bars.update(task, completed=done, total=total, count=count, note=note)

    def remark(self, sentence: str) -> None:
        """Print the sentence above the bars, wrapped but for lines that are indented."""
        for line in sentence.split("\n"):
            say(line) if line.startswith(" ") else say_rows([(line,)], indent="")
