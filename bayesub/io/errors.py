"""The one error that users see: a sentence that names the file, the key and the remedy."""

import difflib
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager

LONGEST = 600  # characters of a message; what a file contains may be longer
_END = 96  # characters at the end of a message that is too long; the remedy stands there


def printable(text: str) -> str:
    r"""A text as one line: line breaks, controls of the terminal and of direction as in a Python string, ``\\x1b``."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def one_line(text: str) -> str:
    """A :func:`printable` text of at most :data:`LONGEST` characters: a longer one loses its middle."""
    line = printable(text)
    return line if len(line) <= LONGEST else f"{line[: LONGEST - _END - 4]} .. {line[-_END:]}"


KINDS = {
    "missing": "something that is needed is not given",
    "unknown": "there is no key, name, column or option of that name",
    "value": "a value is of the wrong type, not finite, or outside of what can be",
    "unit": "a unit is unknown, or a number is beyond what its unit allows",
    "conflict": "two things that are given contradict one another, or do not go together",
    "file": "a file or folder is not there, cannot be read or cannot be written",
    "format": "a file is not of the form that it should have",
    "data": "readings cannot be used: too few, in no order, not numbers, without motion",
    "limit": "more is asked for than can be done",
    "model": "a boat, an equation set or a simulation cannot be as it is described",
    "state": "a run folder, a result or a service is not in the state that is needed",
    "install": "a package or program that is needed is not installed",
}


class Remark(UserWarning):
    """A warning that users see: a sentence of ours."""


class InputError(ValueError):
    """Bad input. The message is one line, complete in itself; the command line prints it and exits with status 2.

    Programs and tests read its kind, one of :data:`KINDS`, and the key, column, option, name or argument it is about.
    """

    def __init__(self, message: str, kind: str = "value", key: str = ""):
        super().__init__(one_line(message))
        self.kind, self.key = kind, key

    def within(self, source: str) -> "InputError":
        """The same error with its source, a file or a trial, at the beginning of the message."""
        message = str(self)
        return self if message.startswith(source) else InputError(f"{source}: {message}", self.kind, self.key)


@contextmanager
def error_source(source: str) -> Iterator[None]:
    """An InputError inside the block begins with `source`, a file or a trial; an empty source changes nothing."""
    try:
        yield
    except InputError as error:
        raise error.within(source) from None


def check_known(name: str, valid: Collection[str], message: str, *, hint: str = "", key: str = "") -> None:
    """InputError with a message, the nearest valid name and a hint for a name that is not among the valid ones.

    It is about the `key`, by default about the name.
    """
    if name not in valid:
        raise InputError(f"{message}{nearest(str(name), valid, hint)}", "unknown", key or str(name))


def nearest(name: str, valid: Iterable[str], hint: str = "") -> str:
    """``": did you mean 'Yuv'?"`` for a mistyped name, or the empty string; with a hint behind it."""
    names = list(valid) if len(name) <= LONGEST else []
    lower = {one.lower(): one for one in names}
    close = difflib.get_close_matches(name[:LONGEST], names, n=1)
    if close := close or [lower[one] for one in difflib.get_close_matches(name.lower()[:LONGEST], lower, n=1)]:
        return f": did you mean '{close[0]}'?" + (f" {hint[:1].upper()}{hint[1:]}" if hint else "")
    return f"; {hint}" if hint else ""
