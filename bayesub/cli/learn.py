"""The commands to learn from: `manual`, its pages at the terminal, `list`, what is built in, and `completion`."""

import io
import json
import re
import sys
import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import click
from click import shell_completion

from bayesub.io import toml_files
from bayesub.io.errors import InputError, check_known
from bayesub.io.terminal import aligned, say, say_rows

FOLDER = Path(str(resources.files("bayesub"))) / "manual"
KINDS = {"tutorial": "First hour", "recipe": "Recipes: how to do one thing"}
KINDS |= {"reference": "Reference: what there is, complete", "explanation": "Explanation: why it is so"}
LISTED = ("equations", "vehicles", "manoeuvres", "logs", "studies")
WIDTH = 100

_HEAD = re.compile(r"^(?:<!--|%) *(\w+): *(.+?) *(?:-->)?$")
_MATHS = re.compile(r"```.*?```|`[^`]*`|^\$\$\n(.*?)^\$\$$|\$(\S[^$\n]*?)\$", re.DOTALL | re.MULTILINE)
_SIGNS = {"times": "×", "cdot": "·", "int": "∫", "sum": "Σ", "le": "≤", "ne": "≠", "mid": "|", "sqrt": "√", "_": "_"}
_SIGNS |= {"partial": "∂", "dot": "\u0307", "ddot": "\u0308", ",": " ", ";": " ", "quad": " "}
_COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)


@dataclass(frozen=True)
class Page:
    """A page of the manual. Its first line is a comment that says its kind and what it is about."""

    topic: str  # name of the file without its suffix
    kind: str  # a key of KINDS
    summary: str
    path: Path

    @property
    def text(self) -> str:
        """What a reader sees: the file without its comments."""
        text = self.path.read_text(encoding="utf-8")
        return _COMMENT.sub("", text) if self.path.suffix == ".md" else text


def pages() -> dict[str, Page]:
    """The pages by topic, kind after kind, each kind in alphabetical order."""
    read = []
    for path in sorted(path for path in FOLDER.iterdir() if path.suffix in (".md", ".bib")):
        with path.open(encoding="utf-8") as file:
            ((kind, summary),) = _HEAD.findall(file.readline())
        read.append(Page(path.stem, kind, summary, path))
    return {page.topic: page for kind in KINDS for page in read if page.kind == kind}


def _completed(words: Callable[[], Iterable[str]]) -> Callable[..., list[str]]:
    return lambda _ctx, _param, incomplete: [word for word in words() if word.startswith(incomplete)]


@click.command(epilog="Example: bayesub manual own-log")
@click.argument("topic", default="", metavar="[TOPIC]", shell_complete=_completed(pages))
@click.option("--path", "show_path", is_flag=True, help="Print where the page is instead; without TOPIC, the folder.")
def manual(topic: str, show_path: bool) -> None:
    """List the pages of the manual, or show the page TOPIC in the pager; the beginning of its name is enough.

    If the output is not a terminal the page is printed as Markdown.
    """
    by_topic = pages()
    begun = [name for name in by_topic if name.startswith(topic)]
    topic = begun[0] if topic and topic not in by_topic and len(begun) == 1 else topic
    if topic:
        hint = f"the {len(by_topic)} pages are listed by bayesub manual"
        check_known(topic, by_topic, f"the manual has no page '{topic}'", hint=hint)
    if show_path:
        click.echo(by_topic[topic].path if topic else FOLDER)
    elif not topic:
        click.echo("\n".join(_listed(by_topic)))
    elif sys.stdout.isatty():
        click.echo_via_pager(_rendered(by_topic[topic]))
    else:
        click.echo(_in_letters(by_topic[topic].text.strip()))


def _listed(by_topic: dict[str, Page]) -> list[str]:
    """The list of pages, a line each, grouped by kind."""
    lines: list[str] = []
    for kind, title in KINDS.items():
        lines += [title, *aligned((page.topic, page.summary) for page in by_topic.values() if page.kind == kind), ""]
    return [*lines, "bayesub manual TOPIC shows a page."]


def _rendered(page: Page) -> str:
    """The page for a terminal: Markdown laid out and coloured, any other file as it is."""
    if page.path.suffix != ".md":
        return page.text
    from rich.console import Console
    from rich.markdown import Markdown

    paper = io.StringIO()
    console = Console(file=paper, force_terminal=True)
    console.width = min(console.width, WIDTH)
    console.print(Markdown(_in_letters(page.text), hyperlinks=False))
    return paper.getvalue()


def _in_letters(text: str) -> str:
    """A page with its formulas of LaTeX in letters, for readers without a browser; those on their own lines as code."""
    return _MATHS.sub(lambda maths: _displayed(maths[1]) if maths[1] else _formula(maths[2] or "") or maths[0], text)


def _displayed(formulas: str) -> str:
    lines = [line for line in formulas.replace("\\\\", "").splitlines() if "{align*}" not in line]
    rows = [[_formula(cell.replace("&", "")).strip() for cell in line.split("&&")] for line in lines]
    return "\n".join(f"    {'   '.join(row[:-1]):<80}  {row[-1]}" if row[1:] else f"    {row[0]}" for row in rows)


def _formula(latex: str) -> str:
    r"""A formula in letters of Unicode: ``\dot x = \sin\psi^2`` becomes ẋ = sin ψ²."""
    from bayesub.io.words import powers

    text = re.sub(r"\\(?:mathbf|text|operatorname)\{([^}]*)\}", r"\1", latex)
    text = re.sub(r"\\(d?dot)\{?\s*(\\?[A-Za-z]+?)(?![A-Za-z])\}?", r"\2\\\1", text)
    text = re.sub(" +", " ", re.sub(r"\\([A-Za-z]+|[,;_])( ?)", _sign, text))
    return powers(re.sub(r"[_^]\{(.*?)\}", lambda part: part[0][0] + part[1], text).replace("{", "(").replace("}", ")"))


def _sign(command: re.Match[str]) -> str:
    name, space = command.groups()
    case = "CAPITAL" if name[0].isupper() else "SMALL"
    try:
        return (_SIGNS.get(name) or unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")) + space
    except KeyError:  # a function
        return f"{name} "


@click.command("list", epilog="Example: bayesub list vehicles")
@click.argument("what", default="", metavar=f"[{'|'.join(LISTED)}]", shell_complete=_completed(lambda: LISTED))
@click.option("--json", "as_json", is_flag=True, help="Names and descriptions as JSON, kind by kind.")
def list_(what: str, as_json: bool) -> None:
    """List what is built in, the studies of the folder `studies`, and which of their runs in `figures` are current."""
    if what:
        check_known(what, LISTED, f"cannot list '{what}'", hint=f"expected {', '.join(LISTED)}")
    listings, kinds = {"equations": _equations, "logs": _logs}, [what] if what else LISTED
    entries = {k: listings[k]() if k in listings else _built_in(k) for k in kinds if k != "studies"}
    entries |= _studies_and_runs() if "studies" in kinds else {}
    if as_json:
        click.echo(json.dumps(entries, indent=2))
        return
    for n, (kind, texts) in enumerate(item for item in entries.items() if item[1]):
        say("\n" * (n > 0) + kind.capitalize())
        say_rows(texts.items())


def _built_in(kind: str) -> dict[str, str]:
    """Name -> description of what is built in."""
    files = toml_files.built_in(kind)
    return {name: toml_files.read_toml_table(path).get("description", "") for name, path in files.items()}


def _equations() -> dict[str, str]:
    """Name -> what each built-in equation set has, and its title."""
    from bayesub.model.equations import load_equations

    texts = {}
    for name in toml_files.built_in("equations"):
        equations = load_equations(name)
        controls = ", ".join(control.column for control in equations.controls) or "no controls"
        freedom = f"{equations.degrees_of_freedom} degrees of freedom"
        texts[name] = f"{len(equations.terms)} terms, {freedom}, {controls}: {equations.title}"
    return texts


def _logs() -> dict[str, str]:
    """Name -> title of each built-in log."""
    folders = toml_files.built_in("logs")
    return {name: toml_files.read_line(folder / "README.md").removeprefix("# ") for name, folder in folders.items()}


def _studies_and_runs() -> dict[str, dict[str, str]]:
    """File -> question of the studies in the folder `studies`; folder -> state of their runs in `figures`.

    Of a study that cannot be read it is why not; a run is ``current``, or ``stale`` and why.
    """
    from bayesub.study.run import runs

    studies = runs.study_files(Path("studies"))
    questions, by_stem = {str(path): _question(path) for path in studies}, {path.stem: path for path in studies}
    folders = [file.parent for file in sorted(Path("figures").glob("*/config.toml"))]
    flaws = {str(folder): "; ".join(runs.flaws(folder, by_stem.get(folder.name)).values()) for folder in folders}
    states = {folder: f"stale: {why}" if why else "current" for folder, why in flaws.items()}
    return {"studies": questions} | ({"runs": states} if states else {})


def _question(path: Path) -> str:
    from bayesub.study.run import script

    try:
        if path.suffix == ".py":
            return script.question(path)
        return str(toml_files.read_toml_table(path).get("question", ""))
    except InputError as error:
        return f"cannot be read: {str(error).removeprefix(f'{path}: ')}"


@click.command(epilog="Example: bayesub completion bash >> ~/.bashrc")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print what makes a SHELL complete commands, options, files and the names of what is built in.

    For bash and zsh append it to ~/.bashrc or ~/.zshrc, for fish write it to ~/.config/fish/completions/bayesub.fish.
    """
    make = shell_completion.get_completion_class(shell)
    assert make is not None  # the shells of the argument are those that click knows
    click.echo(make(context.find_root().command, {}, "bayesub", "_BAYESUB_COMPLETE").source())
