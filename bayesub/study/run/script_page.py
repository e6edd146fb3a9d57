"""The page of a script: what its docstring, its captions and its answer say, with the figures in the folder."""

import re
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import translate
from pathlib import Path
from types import ModuleType

from bayesub.findings.equation_card import glossary
from bayesub.io.atomic import write_text
from bayesub.io.errors import InputError
from bayesub.io.terminal import SILENT, duration
from bayesub.model.equations import load_equations
from bayesub.report import markdown
from bayesub.report.markdown import StudyPage
from bayesub.study.run.run_folder import TimedProgress

PARTS = ("Question", "Claim", "Cost")  # of a docstring, each beginning a line


def write(
    folder: Path, config: dict, module: ModuleType, numbers: dict, tables: Iterable[str], failed: Sequence[str]
) -> None:
    """Write ``<name>.md``, the page of a run, into its folder.

    ``FIGURES`` of the script is name or pattern -> caption, in the order of the page, ``GLOSSARY`` the equation set
    whose coefficients the page explains, and ``ANSWER`` the answer in a sentence or two, with places for numbers as
    :func:`bayesub.report.markdown.fill` takes them. Tables are lines of Markdown; `failed`: the claims that failed.
    """
    first, parts, rest = docstring_parts(module.__doc__ or "")
    equations = getattr(module, "GLOSSARY", None)
    files = [file.name for file in sorted(folder.glob("*.png"))]
    seconds = TimedProgress(folder, SILENT).before
    page = StudyPage(
        name=config["name"],
        question=first,
        background=parts["Question"],
        claim=parts["Claim"],
        verdict=f"The claim fails: {'; '.join(failed)}." if failed else "The claim holds of these numbers.",
        answer=answer(getattr(module, "ANSWER", ""), numbers, quick=bool(config.get("quick_run"))),
        pictures=captioned(files, getattr(module, "FIGURES", {})),
        tables=tables,
        method=rest,
        coefficients=glossary(load_equations(equations)) if equations else (),
        cost=parts["Cost"] + (f" This run took {duration(seconds)}." if 0.0 < seconds < 1e9 else ""),
        code=code(config),
    )
    write_text(folder / f"{config['name']}.md", page.text())


def answer(text: str, numbers: dict, *, quick: bool) -> str:
    """The answer with its numbers; of a small version, which may lack some, that it is left to the full one."""
    try:
        return markdown.fill(" ".join(text.split()), numbers)
    except KeyError as error:
        if quick:
            return "Only the full version of the study has all numbers of the answer."
        raise InputError(f"ANSWER: the numbers of the run have no {error}", "unknown", str(error.args[0])) from None


def docstring_parts(docstring: str) -> tuple[str, dict[str, str], str]:
    """The first line of a docstring, its parts by name, and the rest, each paragraph in one line."""
    first, _, body = docstring.strip().partition("\n")
    parts, rest = dict.fromkeys(PARTS, ""), []
    for paragraph in re.split(r"\n\s*\n", body.strip()):
        beginnings = re.split(rf"^({'|'.join(PARTS)}): ", paragraph, flags=re.MULTILINE)
        if words := " ".join(beginnings[0].split()):
            rest.append(words)
        for name, text in zip(beginnings[1::2], beginnings[2::2], strict=True):
            sentence = " ".join(text.split())
            parts[name] = sentence[:1].upper() + sentence[1:]
    return first, parts, "\n\n".join(rest)


def captioned(files: list[str], captions: Mapping[str, str]) -> dict[str, str]:
    """File -> caption of the first pattern that fits its name, in the order of the patterns; then those without.

    What a star of the pattern stands for takes the place of ``{}`` in the caption.
    """
    left, result = dict.fromkeys(files), {}
    for pattern, caption in captions.items():
        expression = re.compile(translate(f"{pattern}.png").replace(".*", "(.*)"))
        for file, match in [(file, match) for file in left if (match := expression.match(file))]:
            words = iter(group.replace("_", " ") for group in match.groups())
            result[file] = re.sub(r"\{\}", lambda braces, words=words: next(words, braces[0]), caption)
            del left[file]
    return result | {file: f"{file.rpartition('.')[0].replace('_', ' ').capitalize()}." for file in left}


def code(config: dict) -> str:
    """The digests of script and sources that made a run, and their versions."""
    digests = {"script_sha256": "script", "sources_sha256": "sources of bayesub"}
    words = [f"{what} {config[key][:12]}" for key, what in digests.items() if key in config]
    if config.get("commit", "unknown") != "unknown":
        words.append(f"commit {config['commit']}")
    words += [f"{name} {version}" for name, version in config.get("versions", {}).items()]
    small = " This is the small version of the study (--quick)." if config.get("quick_run") else ""
    return f"Made by {', '.join(words)}.{small}" if words else small.strip()
