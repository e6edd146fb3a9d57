"""Drawings within a page: smaller than matplotlib's, references are met, nothing is named twice, the smaller wins."""

import re

import numpy as np
import pytest

from bayesub.report.page import Drawings, smaller
from bayesub.report.plots import style

pytestmark = pytest.mark.rendered


def pictures(folder, n_points):
    """PNG and SVG of a figure with so many markers, a formula and a clipped line."""
    files = [folder / f"{n_points}.png", folder / f"{n_points}.svg"]
    x = np.linspace(0.0, 1.0, n_points)
    with style.figure(files, 4.0, 3.0) as figure:
        axis = figure.subplots()
        axis.plot(x, np.sin(40.0 * x), "o", ms=3)
        axis.plot([0.0, 1.0], [-2.0, 2.0], "--")
        axis.set(xlabel=r"$N'_{\dot v}$", ylabel="residual <&> (m)", ylim=(-1.0, 1.0))
    return [file.read_bytes() for file in files]


@pytest.fixture
def few(tmp_path):
    return pictures(tmp_path, 10)


def test_a_drawing_is_a_fraction_of_matplotlibs_and_has_its_box(few):
    drawing = Drawings().inline(few[1].decode())
    assert len(drawing.content) < 0.5 * len(few[1])
    assert drawing.box == "0 0 288 216"
    assert drawing.width == 384  # four inches
    assert "style=" not in drawing.content
    assert "xlink" not in drawing.content


def test_names_are_met_and_are_those_of_one_drawing(few):
    """The same figure twice on a page: each has its own clips and markers, both have the glyphs of the sheet."""
    sheet = Drawings()
    contents = [sheet.inline(few[1].decode()).content for _ in range(2)]
    page = sheet.common + contents[0] + contents[1]
    names = re.findall(r' id="([^"]+)"', page)
    assert len(names) == len(set(names)) > 20
    assert set(re.findall(r"#([\w-]+)[\")]", page)) <= set(names)
    classes = set(re.findall(r'class="(s\d+)"', "".join(contents)))
    assert classes == set(re.findall(r"\.(s\d+)\{", sheet.common))
    assert sheet.common.count("<path") > 15  # letters
    assert not Drawings().common


def test_the_smaller_picture_is_chosen(few, tmp_path):
    assert smaller(*few) == few[1]
    many = pictures(tmp_path, 3000)
    assert smaller(*many) == many[0]
    sheet = Drawings()
    assert sheet.place("What.", many[0])["drawing"] is None
    assert sheet.place("What.", few[1])["data"] == ""


def test_a_figure_is_drawn_twice_alike(tmp_path, few):
    (tmp_path / "again").mkdir()
    assert pictures(tmp_path / "again", 10)[1] == few[1]


def test_places_are_right_to_half_a_tenth_of_a_point(few):
    """The markers, in matplotlib's digits and in those of the page."""
    exact = re.findall(r'<use xlink:href="#m[^"]*" x="([^"]+)" y="([^"]+)" style="fill: #1f77b4', few[1].decode())
    content = Drawings().inline(few[1].decode()).content
    short = re.findall(r'<use href="#d1-\d+" x="([^"]+)" y="([^"]+)"', content)
    found = [
        point for point in short if np.abs(np.array(exact, float) - np.array(point, float)).max(axis=1).min() < 0.0501
    ]
    assert len(exact) == 10
    assert len(found) >= 10
