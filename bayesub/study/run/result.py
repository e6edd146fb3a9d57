"""The result of a run: the object that a run returns and its folder keeps."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from bayesub.findings.verdicts import STATUS, verdict_on
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.study.sources import file_digest

RESULT, NUMBERS = "outcome.json", "numbers.json"
SUGGESTED = "suggested.toml"  # the study with what its residuals ask for
AGAIN = "run the study again with --force"  # the remedy for a run that is not whole any more
_OF_OLD = "converged"  # verdict of version 0.2, which did not look at the fit


@dataclass(frozen=True)
class StudyResult:
    """The result of a run."""

    name: str  # of the study
    question: str  # of the study
    # a key of :data:`bayesub.findings.verdicts.STATUS`: "converged and fits" or what is wrong, of a study in TOML;
    # "claim holds", "claim failed" or "skipped" (what it needs is not there), of a script; "failed" or "not finished"
    verdict: str
    folder: str  # the run folder
    seconds: float = 0.0  # of work, over all sessions of the run
    text: str = ""  # what the verdict means, the claims that failed, or why the run did or was skipped
    sentences: dict[str, str] = field(default_factory=dict)  # what the posterior says, by topic; empty for a script
    shortcomings: tuple[str, ...] = ()  # what is missing for convergence, or of a script the claims that failed
    # name of each file in the folder that the result is of -> its SHA-256; empty for a script
    files_sha256: dict[str, str] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Whether the posterior converged, agrees and predicts, as far as asked, or the claim holds or is skipped."""
        return self.status == 0

    @property
    def status(self) -> int:
        """Exit status of the command that says it."""
        return STATUS[self.verdict]

    @property
    def report(self) -> Path | None:
        """The page of a study in TOML; None if there is none."""
        page = Path(self.folder) / "report.html"
        return page if page.exists() else None

    @property
    def numbers(self) -> dict[str, Any]:
        """The content of ``numbers.json`` in the run folder; empty if there is none."""
        file = Path(self.folder) / NUMBERS
        return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}

    def to_json(self) -> dict[str, Any]:
        """The result as JSON types."""
        return asdict(self) | {"good": self.good, "status": self.status}

    def save(self) -> None:
        """Write ``outcome.json`` into the run folder: the last file of a run that came to its end."""
        write_text(Path(self.folder) / RESULT, json.dumps(self.to_json(), indent=1))


def load_result(folder: Path) -> StudyResult | None:
    """The result of the run in a folder, as it was saved; None if the run has not come to its end.

    InputError for a damaged file, and for a file that is not any more what the result is of.
    """
    if not (folder / RESULT).exists():
        return None
    try:
        content = json.loads((folder / RESULT).read_text(encoding="utf-8"))
        result = StudyResult(**{key: value for key, value in content.items() if key not in ("good", "status")})
        if result.verdict == _OF_OLD:
            result = replace(result, verdict=verdict_on(json.loads((folder / NUMBERS).read_text(encoding="utf-8"))))
        STATUS[result.verdict]
        result = replace(result, folder=str(folder), shortcomings=tuple(result.shortcomings))
        digests = dict(result.files_sha256)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        text = f"{folder}: {RESULT} is damaged ({type(error).__name__}: {error}); run the study with --resume"
        raise InputError(text, "format", RESULT) from None
    for name, digest in digests.items():
        if (folder / name).exists() and file_digest(folder / name) != digest:
            text = f"{folder}: {name} is damaged or was changed since the run; {AGAIN}"
            raise InputError(text, "format", name)
    return result
