"""The one error that users see: a sentence that names the file, the key and the remedy."""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

LONGEST = 600  # characters of a message; what a file contains may be longer


class InputError(ValueError):
    """Bad input. The message is one line, complete in itself; the command line prints it and exits with status 2.

    What cannot be printed is written as in a Python string, and of a message that is too long the middle is left out.
    """

    def __init__(self, message: str):
        line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in message)
        super().__init__(line if len(line) <= LONGEST else f"{line[: LONGEST - 100]} .. {line[-96:]}")


@contextmanager
def error_source(source: str) -> Iterator[None]:
    """An InputError inside the block begins with its source, a file or a trial, unless it names it already."""
    try:
        yield
    except InputError as error:
        if source in str(error):
            raise
        raise InputError(f"{source}: {error}") from None


def nearest(name: str, valid: Iterable[str]) -> str:
    """``": did you mean 'Yuv'?"`` for a mistyped name, or the empty string."""
    close = difflib.get_close_matches(name, list(valid), n=1)
    return f": did you mean '{close[0]}'?" if close else ""
