"""One disagreement among the columns of a log."""

from dataclasses import dataclass

KINDS = {
    "sign": "positive is the other way",
    "unit": "the unit is another than the name says",
    "name": "a column holds what belongs under another name",
    "axes": "velocities are along other axes than the name says",
    "origin": "an angle is counted from another direction",
    "wrap": "readings are averaged across the wrap of an angle",
    "stuck": "one value is repeated while it should change",
    "order": "rows are not in the order of time",
    "clock": "the clock was set, forwards or back",
    "stamp": "stamps are repeated, or have too few digits",
}


@dataclass(frozen=True)
class Finding:
    """One disagreement among the columns of a log.

    Attributes
    ----------
    kind : str
        What is wrong, one of :data:`KINDS`.
    columns : tuple of str
        Headers of the columns that are wrong.
    message : str
        What they hold, with the number that shows it.
    remedy : str
        What to change in the file or in the study.
    misread : bool
        Whether the whole column holds something else than its name says, and not only some of its cells.
    """

    kind: str
    columns: tuple[str, ...]
    message: str
    remedy: str
    misread: bool = False

    def line(self) -> str:
        """The finding in one line."""
        return f"{', '.join(self.columns)}: {self.message}; {self.remedy}"

    def to_json(self) -> dict:
        """The finding as JSON types."""
        return {"kind": self.kind, "columns": list(self.columns), "message": self.message, "remedy": self.remedy}
