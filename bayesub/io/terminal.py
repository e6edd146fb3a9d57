"""What the command line says, and how: sentences, progress bars, exit status."""

import re
import sys
import time
from typing import NoReturn

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

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


def pace(elapsed: float, text: str) -> str:
    """Rate and time remaining of a stage after `elapsed` s, if `text` counts its items, as "3 of 5 starts" does.

    The time remaining is that of a constant pace.
    """
    counted = re.match(r"(\d+) of (\d+)\b", text)
    done, n_items = map(int, counted.groups()) if counted else (0, 0)
    if not (0 < done < n_items and elapsed > 0.0):
        return ""
    rate = done / elapsed
    told = f"{rate:.3g}/s" if rate >= 1.0 else f"{60.0 * rate:.3g}/min"
    return f"{told}, {duration((n_items - done) / rate)} left"


class Bars:
    """One progress bar a stage; nothing when the output is not a terminal."""

    def __init__(self):
        self.bars = Progress(
            SpinnerColumn(),
            TextColumn("{task.description:32}"),
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[text]}"),
            TextColumn("{task.fields[pace]}"),
            console=console,
            disable=console.quiet or not console.is_terminal,
        )
        self.task, self.began = None, 0.0

    def __enter__(self):
        self.bars.start()
        return self

    def __exit__(self, *_):
        self._end()
        self.bars.stop()

    def _end(self):
        if self.task is not None:
            self.bars.update(self.task, completed=1.0, pace="")
            self.bars.stop_task(self.task)

    def stage(self, name: str) -> None:
        """A stage begins, and the one before is done."""
        self._end()
        self.task = self.bars.add_task(name, total=1.0, text="", pace="")
        self.began = time.perf_counter()

    def update(self, fraction: float, text: str) -> None:
        """A `fraction` of the stage is done; `text` says what of it."""
        self.bars.update(self.task, completed=fraction, text=text, pace=pace(time.perf_counter() - self.began, text))
