"""The page of a designed trial, with its numbers and figures."""

import json
from importlib import metadata
from pathlib import Path

from bayesub.findings import design_numbers
from bayesub.findings.designed_trial import DesignedTrial
from bayesub.findings.run_numbers import combination
from bayesub.io import templates
from bayesub.io.atomic import write_text, writing
from bayesub.report import design_figures, drawings


def write(folder: Path, design: DesignedTrial) -> dict:
    """Write ``design.json``, the figures and ``design.html`` into a folder; gives the numbers."""
    content = design_numbers.numbers(design)
    with writing(folder):
        pictures, sheet = {}, drawings.Sheet()
        for figure in design_figures.figures(design):
            image = drawings.drawn(figure, folder)
            pictures[figure.name] = {"title": figure.title} | sheet.placed(figure.caption, image)
        page = templates.fill(
            "bayesub.report",
            "design.html",
            numbers=content,
            pictures=pictures,
            glyphs=sheet.shared,
            out_of_reach=[combination(vector) for vector in content["out_of_reach"]],
            searched=design_numbers.searched(design),
            version=metadata.version("bayesub"),
        )
        write_text(folder / "design.json", json.dumps(content, indent=1))
        write_text(folder / "design.html", page)
    return content
