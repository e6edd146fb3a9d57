"""The page of a designed trial, with its numbers and figures."""

import base64
import json
import re
from importlib import metadata, resources
from pathlib import Path

from bayesub.io import templates
from bayesub.io.atomic import write_text, writing
from bayesub.report import design_figures, design_numbers
from bayesub.report.designed_trial import DesignedTrial
from bayesub.report.findings import combination


def write(folder: Path, design: DesignedTrial) -> dict:
    """Write ``design.json``, the figures and ``design.html`` into a folder; gives the numbers."""
    content = design_numbers.numbers(design)
    with writing(folder):
        pictures = {}
        for figure in design_figures.figures(design):
            file = folder / f"{figure.name}.png"
            figure.draw([file])
            pictures[figure.name] = {
                "caption": figure.caption,
                "title": figure.title,
                "data": base64.b64encode(file.read_bytes()).decode("ascii"),
            }
        page = templates.fill(
            "bayesub.report",
            "design.html",
            numbers=content,
            pictures=pictures,
            out_of_reach=[combination(vector) for vector in content["out_of_reach"]],
            searched=design_numbers.searched(design),
            style=_style(),
            version=metadata.version("bayesub"),
        )
        write_text(folder / "design.json", json.dumps(content, indent=1))
        write_text(folder / "design.html", page)
    return content


def _style() -> str:
    """The style sheet, that of a report."""
    text = (resources.files("bayesub.report") / "report.html").read_text(encoding="utf-8")
    return re.search(r"<style>(.*?)</style>", text, re.DOTALL)[1]
