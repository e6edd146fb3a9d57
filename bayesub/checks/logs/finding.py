"""One disagreement among the columns of a log."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One disagreement among the columns of a log.

    Attributes
    ----------
    columns : tuple of str
        Headers of the columns that are wrong.
    message : str
        What they hold, with the number that shows it.
    remedy : str
        What to change in the file or in the study.
    misread : bool
        Whether the whole column holds something else than its name says, and not only some of its cells.
    """

    columns: tuple[str, ...]
    message: str
    remedy: str
    misread: bool = False

    def line(self) -> str:
        """The finding in one line."""
        return f"{', '.join(self.columns)}: {self.message}; {self.remedy}"

    def to_json(self) -> dict:
        """The finding as JSON types."""
        return {"columns": list(self.columns), "message": self.message, "remedy": self.remedy}
