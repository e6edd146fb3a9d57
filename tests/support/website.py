"""The site of README, manual, studies and reports: python tests/support/website.py DIR [--reports RUNS]

It is laid out by Zensical, for any static host, and loads nothing from elsewhere. With --reports it shows the reports
of the runs in that folder beside those in `figures`. A site in DIR is replaced, other files are not.

Its folders are those of the repository, so that links between pages stay right. Formulas become MathML, which browsers
draw without a script.
"""

import argparse
import html
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import tomli_w

sys.path.insert(0, str(Path(__file__).parents[2] / "studies"))  # for what is started as a script

from bayesub.cli.learn import FOLDER, KINDS, Page, pages
from bayesub.io.atomic import writing
from bayesub.io.errors import InputError
from bayesub.study.run import runs
from bayesub.study.run.result import load_result
from bayesub.study.run.run_folder import saved_config
from thesis.page import cards

ROOT = Path(__file__).parents[2]
HOME, STUDIES, REPORTS = "README.md", "figures/README.md", "reports/README.md"
OTHERS = ("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE")
REPORT = "report.html"
CONFIG, STYLE = (Path(__file__).with_suffix(suffix) for suffix in (".toml", ".css"))
MARK = "sitemap.xml"  # the file that every site has
LEFT_OUT = shutil.ignore_patterns(".*", "*.npz", "*.nc", "*.jsonl", "chain*", "inputs")  # draws
WIDE = "---\nhide: [navigation, toc]\n---\n"
HEAD = "# Reports to look at\n\nPages that `bayesub run` has written, as they are: choose a picture.\n"
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def write(site: Path, pages: Mapping[str, Page], reports: Path | None) -> int:
    """Write the site into the folder `site`, in place of a site there; gives its number of pages.

    `reports`: a folder of runs whose reports it shows beside those in ``figures``.
    """
    if missing := [name for name in ("zensical", "latex2mathml") if not find_spec(name)]:
        raise InputError(f"the site needs {' and '.join(missing)}: pip install 'bayesub[site]'", "install", missing[0])
    if site.exists() and not (site / MARK).is_file() and (not site.is_dir() or any(site.iterdir())):
        raise InputError(f"{site}: holds something else than a site; name a new folder", "file")
    with tempfile.TemporaryDirectory() as scratch:
        docs = Path(scratch) / "docs"
        _stage(docs, pages)
        found = {file.parent for folder in (ROOT / "figures", reports) if folder for file in folder.rglob(REPORT)}
        _show_reports(docs / REPORTS, found)
        _show_home(docs)
        built = _lay_out(docs, pages)
        written = list(built.rglob("*.html"))
        for page in written:
            page.write_text(FORMULA.sub(_drawn, page.read_text(encoding="utf-8")), encoding="utf-8")
        with writing(site):
            shutil.rmtree(site, ignore_errors=True)
            shutil.copytree(built, site)
    return len(written)


def _place(page: Page) -> str:
    """Where the site has a page of the manual."""
    return page.path.relative_to(ROOT).with_suffix(".md").as_posix()


def _stage(docs: Path, pages: Mapping[str, Page]) -> None:
    """Copy what the site shows, pages without their comments."""
    shutil.copytree(ROOT / "figures", docs / "figures", ignore=LEFT_OUT)
    shutil.copytree(FOLDER, docs / FOLDER.relative_to(ROOT), ignore=LEFT_OUT)
    for file in (*(ROOT / name for name in OTHERS), STYLE):
        shutil.copy(file, docs / file.name)
    named = re.compile(rf"page `({'|'.join(pages)})`")
    for page in pages.values():
        text = page.text if page.path.suffix == ".md" else f"# {page.topic.title()}\n\n```bibtex\n{page.text}```\n"
        (docs / _place(page)).write_text(named.sub(r"page [`\1`](\1.md)", text), encoding="utf-8")


def _show_reports(page: Path, found: set[Path]) -> None:
    """Copy the reports of run folders, and write the page that leads to them; of two with one name the newer."""
    shown = {}
    for run in sorted(found, key=lambda run: (run / REPORT).stat().st_mtime):
        study, result = runs.entry(run), load_result(run)
        name = (saved_config(run) or {}).get("name", study.name)
        (page.parent / name).mkdir(parents=True, exist_ok=True)
        shutil.copy(run / REPORT, page.parent / name)
        if study.picture:
            shutil.copy(run / Path(study.picture).name, page.parent / name)
        question = f"{study.question} **{result.verdict if result else ''}**".removesuffix(" ****")
        picture = study.picture and f"{name}/{Path(study.picture).name}"
        shown[name] = runs.Entry(name, question, f"{name}/{REPORT}", picture)
    page.write_text("\n".join([WIDE + HEAD, *cards(shown.values())]) + "\n", encoding="utf-8")


def _show_home(docs: Path) -> None:
    """Write the README as the landing page; where it leads to a study that is an example, it leads to its report."""

    def shown(study: re.Match[str]) -> str:
        report = f"reports/{study[1]}/{REPORT}"
        return f"({report if (docs / report).exists() else REPORTS})"

    text = re.sub(r"\(studies/examples/(\w+)\.toml\)", shown, Page("home", "", "", ROOT / HOME).text)
    (docs / HOME).write_text(WIDE + text, encoding="utf-8")


def _lay_out(docs: Path, pages: Mapping[str, Page]) -> Path:
    """Let Zensical make a site of a folder; gives the folder of the site."""
    config = tomllib.loads(CONFIG.read_text(encoding="utf-8"))
    manual = [
        {title.partition(":")[0]: [_place(page) for page in pages.values() if page.kind == kind]}
        for kind, title in KINDS.items()
    ]
    config["project"]["nav"] = [{"Home": HOME}, *manual, {"Reports": REPORTS}, {"Studies": STUDIES}]
    file = docs.parent / "zensical.toml"
    file.write_text(tomli_w.dumps(config), encoding="utf-8")
    done = subprocess.run([sys.executable, "-m", "zensical", "build", "-f", file], capture_output=True, text=True)
    if done.returncode:
        raise InputError(f"Zensical ends with: {' '.join((done.stdout + done.stderr).split())}", "file")
    return docs.parent / "site"


def _drawn(formula: re.Match[str]) -> str:
    """LaTeX of a page as MathML."""
    from latex2mathml import converter

    drawn = converter.convert(html.unescape(formula[2]), display="block" if formula[1] == "div" else "inline")
    return re.sub(r"<mi>([a-z]{2,})</mi>", r'<mo lspace="0.1em" rspace="0.17em">\1</mo>', drawn)  # sin, cos


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("site", type=Path, metavar="DIR")
    parser.add_argument("--reports", type=Path, metavar="RUNS")
    given = parser.parse_args()
    try:
        n_pages = write(given.site, pages(), given.reports)
    except InputError as error:
        sys.exit(str(error))
    print(f"{given.site}: {n_pages} pages; python3 -m http.server -d {given.site} shows them at http://localhost:8000")
