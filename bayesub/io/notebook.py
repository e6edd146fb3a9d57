"""Objects that show themselves in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayesub.report.notebook import Picture


class Displayed:
    """What Jupyter shows as a table, and what draws itself.

    How each class looks is in :mod:`bayesub.report.notebook`, which is imported when something is shown.
    """

    def _repr_html_(self) -> str:
        from bayesub.report import notebook

        return notebook.html(self)

    def plot(self) -> Picture:
        """Draw it: a picture that Jupyter shows, and whose method `save` writes it to a PNG file."""
        from bayesub.report import notebook

        return notebook.picture(self)
