"""What came of a run: the object that a run returns and its folder keeps."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.study.provenance import file_digest

if TYPE_CHECKING:
    from bayesub.inference.sampling import CrossCheck, Posterior

RESULT = "outcome.json"
CONVERGED, NOT_CONVERGED, NOT_CONFIRMED = "converged", "not converged", "not confirmed"
CLAIM_HOLDS, CLAIM_FAILED = "claim holds", "claim failed"
DOES_NOT_PREDICT = "does not predict"
FAILED, NOT_FINISHED, SKIPPED = "failed", "not finished", "skipped"
GOOD = (CONVERGED, CLAIM_HOLDS, SKIPPED)


@dataclass(frozen=True)
class StudyResult:
    """The result of a run.

    Attributes
    ----------
    name : str
        Of the study.
    question : str
        Of the study.
    verdict : str
        "converged", "not converged", "not confirmed" (the cross-check does not agree) or "does not predict" (a log that
        was not fitted) of a study in TOML; "claim holds", "claim failed" or "skipped" (what it needs is not there) of
        a script; "failed" or "not finished".
    folder : str
        The run folder.
    seconds : float
        Of work, over all sessions of the run.
    text : str
        The claim that failed, or why the run did or was skipped.
    sentences : dict of str to str
        What the posterior says, by topic; empty for a script.
    shortcomings : tuple of str
        What is missing for convergence.
    files_sha256 : dict of str to str
        Name of each file in the folder that the result is of -> its SHA-256; empty for a script.
    """

    name: str
    question: str
    verdict: str
    folder: str
    seconds: float = 0.0
    text: str = ""
    sentences: dict[str, str] = field(default_factory=dict)
    shortcomings: tuple[str, ...] = ()
    files_sha256: dict[str, str] = field(default_factory=dict)

    @property
    def good(self) -> bool:
        """Whether the posterior converged, agrees and predicts, as far as asked, or the claim holds or is skipped."""
        return self.verdict in GOOD

    @property
    def report(self) -> Path | None:
        """The page of a study in TOML; None if there is none."""
        page = Path(self.folder) / "report.html"
        return page if page.exists() else None

    def to_json(self) -> dict[str, Any]:
        """The result as JSON types."""
        return asdict(self) | {"good": self.good}

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
        content.pop("good")
        result = StudyResult(**content)
        result = replace(result, folder=str(folder), shortcomings=tuple(result.shortcomings))
        digests = dict(result.files_sha256)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        text = f"{folder}: {RESULT} is damaged ({type(error).__name__}: {error}); run the study with --resume"
        raise InputError(text, "format", RESULT) from None
    for name, digest in digests.items():
        if (folder / name).exists() and file_digest(folder / name) != digest:
            text = f"{folder}: {name} is damaged or was changed since the run; run the study again"
            raise InputError(text, "format", name)
    return result


def verdict_on(posterior: "Posterior", check: "CrossCheck | None" = None, *, predictions_hold: bool = True) -> str:
    """The verdict on a posterior, on its cross-check, if there was one, and on its predictions."""
    if not posterior.converged:
        return NOT_CONVERGED
    if check is not None and check.verdict != "agree":
        return NOT_CONFIRMED
    return CONVERGED if predictions_hold else DOES_NOT_PREDICT
