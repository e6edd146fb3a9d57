"""What came of a run, as `run` and `report` end: a dozen aligned lines, or every sentence before them."""

import re
import shlex
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bayesub.findings.verdicts import STATUS, in_words
from bayesub.io.terminal import aligned, duration, say, say_rows, width
from bayesub.io.words import counted
from bayesub.study.run.result import SUGGESTED

if TYPE_CHECKING:
    from bayesub.study.run.result import StudyResult

_GAP = 16  # of the words of a row, from the beginning of a line
_BAD_LINES = 4  # that what is wrong takes, in all


def tell(result: "StudyResult", *, verbose: bool = False) -> None:
    """Say what came of a run; the verdict comes last."""
    numbers = result.numbers
    for topic, sentence in result.sentences.items() if verbose else ():
        label = topic.replace("_", " ")
        if "\n" in sentence:  # lines to paste begin a line
            say(f"{label}:\n{sentence}")
        else:
            say_rows([(f"{label:<12}", sentence)], indent="")
    if "glance" in numbers:
        flown = f"{numbers['vehicle']}, {numbers['manoeuvre']}, {numbers['n_readings']} readings"
        taken = f"  {duration(result.seconds)}"
        say(f"{f'{result.name}  {flown}':<{width() - len(taken)}}{taken}")
        say_rows((f"{label:<12}", words) for label, words in _rows(numbers["glance"], good=result.good))
    else:
        for shortcoming in result.shortcomings:
            say(f"{result.verdict}: {shortcoming}")
    place = ("report", result.report) if result.report else ("figures and numbers", result.folder)
    say(f"  {place[0]:<12}  {place[1]}")
    if "glance" in numbers:
        say(f"  {'next':<12}  {_next(result, numbers['glance'])}")
    reasons = [result.text] if result.text else []
    say(in_words(result.verdict, reasons), style="bold green" if result.good else "bold red")


def end(verdict: str) -> None:
    """End the command with the status of a verdict, if it is not a good one."""
    if STATUS[verdict]:
        raise click.exceptions.Exit(STATUS[verdict])


def _rows(glance: Mapping[str, Any], *, good: bool) -> Iterator[tuple[str, str]]:
    """Label and words of each line; of an answer that is not to be used, what is wrong in place of the answer."""
    marks = glance["marks"]
    bad = [mark for mark in marks if mark["good"] is False]
    words = {True: "{word}", None: "{topic} {word}"}  # of those that are passed, and of those that were not tried
    others = [("{word} ({text})" if m["topic"] == "sampling" else words[m["good"]], m) for m in marks if m not in bad]
    yield "checks", ", ".join(form.format(**mark) for form, mark in others)
    for mark in bad:
        text = re.sub(r" \([^()]*\)", "", mark["text"])  # numbers in brackets are in the report
        room = (width() - _GAP) * max(1, _BAD_LINES // len(bad)) - 10
        yield mark["topic"], textwrap.shorten(text, room, placeholder=" ..")
    if good:
        yield from _answer(glance)
    else:
        yield "answer", "not to be used; --verbose shows it all the same"
    yield "not unique", _not_unique(glance)
    if good:
        pairs = (f"{'/'.join(row['pair'])} {row['correlation']:+.2f}" for row in glance["pairs"])
        yield "trade-offs", _first(pairs, glance["n_pairs"], "above 0.7") or "none above 0.7"


def _not_unique(glance: Mapping[str, Any]) -> str:
    """How many combinations are not, and what to hold."""
    text = counted(glance["n_null"], "combination") if glance["n_null"] else "none"
    text += f", {glance['n_faint']} more nearly" if glance["n_faint"] else ""
    text += "; hold " if glance["hold"] else ""
    return text + _first(glance["hold"], len(glance["hold"]), used=len(text))


def _answer(glance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What is known of boat and coefficients."""
    boat = [(row["label"], f"{' .. '.join(row['posterior'])} {row['unit']}", row["prior"]) for row in glance["boat"]]
    lines = aligned([(label, now, f"(before {' .. '.join(before)})") for label, now, before in boat], indent="")
    for row in glance["stable"]:
        lines.append(f"stable {row['where']}: {100 * row['posterior']:.3g} % (before {100 * row['prior']:.3g} %)")
    yield from zip(["boat", *[""] * len(lines)], lines, strict=False)
    known = glance["known"]
    count = f"{len(known)} of {glance['n_coefficients']} to 5 %{': ' if known else ''}"
    words = (f"{row['name']} {row['percent']:.2g} %" for row in known)
    yield "coefficients", count + _first(words, len(known), used=len(count))
    yield "", f"{glance['n_sharper']} better than before, {glance['n_untouched']} by the prior alone"


def _first(words: Iterable[str], n: int, what: str = "", used: int = 0) -> str:
    """As many of the words as have room in a line of which some is used, and how many of `n` more there are."""
    words = list(words)
    for k in range(len(words), -1, -1):
        more = [f"{n - k} {'more ' if k else ''}{what}".rstrip()] if n > k else []
        text = ", ".join([*words[:k], *more])
        if len(text) <= width() - _GAP - used or k <= 1:
            break
    return text


def _next(result: "StudyResult", glance: Mapping[str, Any]) -> str:
    """The command that helps on."""
    folder = shlex.quote(result.folder)
    if result.good and "zigzag_overshoot_deg" in (row["name"] for row in glance["boat"]):
        return f"bayesub predict {folder} zigzag_20_20 -o {folder}_predicted"
    if result.good:
        return f"bayesub export {folder} -o known.toml"
    if (file := Path(result.folder) / SUGGESTED).exists():
        return f"bayesub run {shlex.quote(str(file))} -o {folder}_again"
    return "bayesub manual troubleshooting"
