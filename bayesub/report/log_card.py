"""The card of a log: which of its columns disagree with each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesub.checks import logs
from bayesub.io import log_files


@dataclass(frozen=True)
class LogCard:
    """Which columns of a log disagree.

    Attributes
    ----------
    findings : tuple of Finding
        One for each disagreement.
    """

    findings: tuple[logs.Finding, ...]

    def lines(self) -> list[str]:
        """The card in words, a line a finding."""
        return [finding.line() for finding in self.findings] or ["no column contradicts another"]

    def to_json(self) -> dict:
        """The findings."""
        return {"findings": [finding.to_json() for finding in self.findings]}


def check(log: dict[str, np.ndarray], headers: Sequence[str], controls: Sequence[str] = ()) -> LogCard:
    """The card of a log.

    Parameters
    ----------
    log : dict of str to ndarray of shape (n,)
        Of :func:`bayesub.io.log_files.read_log`; times need not ascend.
    headers : sequence of str
        The columns of its file in their order.
    controls : sequence of str
        Columns of a vehicle's own.
    """
    names = {log_files.short_name(header): header for header in headers}
    return LogCard(tuple(logs.findings(log, names, tuple(controls))))
