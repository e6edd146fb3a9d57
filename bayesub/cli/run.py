"""The command `run`: a study, or every study of a folder; and how `run` and `report` end: a dozen aligned lines."""

import json
import re
import shlex
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from bayesub.cli.arguments import PATH, dask_option, pdf_option, verbose_option
from bayesub.findings.verdicts import STATUS, in_words, worst
from bayesub.io.errors import InputError
from bayesub.io.terminal import INTERRUPTED, Bars, aligned, complain, console, duration, say, say_rows, width
from bayesub.io.words import counted
from bayesub.study.run.result import SUGGESTED

if TYPE_CHECKING:
    from bayesub.study.run.result import StudyResult

_GAP = 16  # of the words of a row, from the beginning of a line
_BAD_LINES = 4  # that what is wrong takes, in all


@click.command(epilog="Example: bayesub run studies/quickstart.toml -o runs/quickstart")
@click.argument("source", type=PATH, metavar="STUDY|FOLDER")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Run folder, runs/NAME if left out; of many runs, runs.")
@click.option("--quick", is_flag=True, help="The small version of the study's [quick] table.")
@click.option("--resume", is_flag=True, help="Continue an interrupted run, bit for bit; of many runs this is the rule.")
@click.option("--force", is_flag=True, help="Replace an existing run; of many, also the full version by the small one.")
@click.option(
    "--keep-stale",
    is_flag=True,
    help="Of many runs, leave those that are done, though bayesub or the study has changed since; with --resume, "
    "continue a run that other sources or versions began.",
)
@click.option("--cross-check", is_flag=True, help="Sample with NUTS too and compare; works with --resume.")
@click.option("--leave-out", is_flag=True, help="Fit all trials but one, each in turn, and predict it; resumable.")
@pdf_option
@dask_option
@verbose_option
@click.option("--json", "as_json", is_flag=True, help="Only the results, as JSON.")
def run(source: Path, output: Path | None, as_json: bool, dask: str, verbose: bool, **options: bool) -> None:
    """Run a STUDY: TOML (simulate, fit, sample, report) or Python script (compute, draw, judge its claims).

    Given a FOLDER, run every study in it, each into a folder of its own under DIR. Those that are done and not stale
    are skipped, those that were interrupted are continued, and one that fails does not stop the others. A run is stale
    if the sources of bayesub, the versions of its libraries, the study or a file that it names have changed since; it
    is run again. DIR/index.html lists the runs.

    The last line is the verdict, which has an exit status of its own (bayesub manual commands): 0 only if the posterior
    has converged and fits, agrees with its cross-check, its prior and the logs that it predicts, or if the claims hold.
    Of a FOLDER it is the gravest.
    """
    from bayesub.study.run.run import RunInterrupted, executor_of, read
    from bayesub.study.run.run import run as run_study

    if options["force"] and (options["resume"] or options["keep_stale"]):
        raise InputError("--force excludes --resume and --keep-stale", "conflict", "--force")
    if (source / "config.toml").exists():
        remedy = f"continue it with: bayesub run STUDY -o {shlex.quote(str(source))} --resume"
        raise InputError(f"{source}: is a run folder, not a folder of studies; {remedy}", "conflict", "STUDY")
    console.quiet = as_json
    try:
        with executor_of(dask) as executor:
            if source.is_dir():
                results = _run_folder(source, output or Path("runs"), options, executor, verbose)
            else:
                study = read(source, quick=options["quick"])
                given = {key: value for key, value in options.items() if key != "quick"}
                with Bars() as bars:
                    folder = output or Path("runs") / study.name
                    results = [run_study(study, folder, **given, progress=bars, executor=executor)]
                tell(results[0], verbose=verbose)
    except RunInterrupted as error:
        kept = ("quick", "cross_check", "leave_out", "pdf", "keep_stale")
        words = [f"--{key.replace('_', '-')}" for key in kept if options[key]] + (["--dask", dask] if dask else [])
        place = str((output or Path("runs")) if source.is_dir() else error)
        interrupted(["bayesub", "run", str(source), "-o", place, *words, *([] if source.is_dir() else ["--resume"])])
    if as_json:
        found = [result.to_json() | {"glance": result.numbers.get("glance")} for result in results]
        click.echo(json.dumps(found, indent=2))
    end(worst(result.verdict for result in results))


def interrupted(again: list[str]) -> NoReturn:
    """End a command that Ctrl-C has stopped, with the words of the one that continues it."""
    complain(f"interrupted; what is done is saved, continue with: {shlex.join(again)}", INTERRUPTED)


def _run_folder(source: Path, output: Path, options: dict[str, bool], executor, verbose: bool) -> list["StudyResult"]:
    """Run the studies of a folder, each into a folder of its own under `output`, and list them on a page there."""
    from bayesub.study.run import runs
    from bayesub.study.run.run import run_unless_done

    folders, results = runs.folders(runs.studies_in(source), output), []
    for n, (file, folder) in enumerate(folders.items(), start=1):
        say(f"{n} of {len(folders)}: {file}")
        with Bars() as bars:
            result, sentence = run_unless_done(file, folder, options, bars, executor)
        say(sentence) if sentence else tell(result, verbose=verbose)
        results.append(result)
        if output.is_dir():
            runs.write_index(output, results)
    rows = [(one.verdict.upper(), one.name, duration(one.seconds), one.folder) for one in results]
    say_rows([("verdict", "study", "time", "folder"), *rows], indent="")
    if (output / runs.INDEX).exists():
        say(f"index: {output / runs.INDEX}")
    return results


def tell(result: "StudyResult", *, verbose: bool = False) -> None:
    """Say what came of a run; the verdict comes last."""
    numbers = result.numbers if isinstance(result.numbers, dict) else {}  # of a script they may be anything
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
    text = counted(glance["n_null"], "combination") if glance["n_null"] else "none"
    text += f", {glance['n_faint']} more nearly" if glance["n_faint"] else ""
    text += "; hold " if glance["hold"] else ""
    yield "not unique", text + _first(glance["hold"], len(glance["hold"]), used=len(text))
    if good:
        pairs = (f"{'/'.join(row['pair'])} {row['correlation']:+.2f}" for row in glance["pairs"])
        yield "trade-offs", _first(pairs, glance["n_pairs"], "above 0.7") or "none above 0.7"


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
    yield "", f"{glance['n_sharper']} of the others better than before, {glance['n_untouched']} by the prior alone"


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
