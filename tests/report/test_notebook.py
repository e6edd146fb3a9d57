"""How objects show themselves in a notebook: what is said is theirs, whatever their names, and pictures are PNG."""

import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib import image
from support.refusals import refused
from support.toys import Linear

import bayesub as bs
from bayesub.inference.baselines import Estimate
from bayesub.inference.identifiability import fisher
from bayesub.problem.priors import Normal

pytestmark = pytest.mark.rendered


class Cells(HTMLParser):
    """The cells of the first table, row by row; an error for a tag that is not closed."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.open, self.texts = [], [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):  # noqa: ARG002
        if tag != "br":
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


def shown(one):
    cells = Cells(one._repr_html_())
    assert len({len(row) for row in cells.rows}) == 1
    return cells.rows, " ".join(cells.texts)


def pixels(one):
    picture = one.plot()
    found = image.imread(io.BytesIO(picture._repr_png_()))
    assert found.shape[1] > 500
    assert found[..., :3].std() > 0.02  # not a white sheet
    return picture


@pytest.fixture
def posterior(rng):
    """Draws of which the first is known, the second not."""
    sd = np.array([0.001, 0.5])
    chain = np.array([1.0, -3.0]) + sd * rng.standard_normal((4, 300, 8, 2))
    prior_sd = np.array([0.1, 0.5])
    return bs.Posterior(("Xuu", "bias_<b>_deg"), chain, np.zeros((4, 300, 8)), np.array([1.0, -3.0]), prior_sd,
                        100, 0.4, 1000, 2.0, {"diverged": 0})  # fmt: skip


def test_a_posterior(posterior):
    rows, text = shown(posterior)
    assert "Converged." in text
    assert "4 ensembles, 8 walkers, 300 steps" in text
    assert [row[0] for row in rows] == ["parameter", "Xuu", "bias_<b>_deg"]
    for row, k in zip(rows[1:], range(2), strict=True):
        assert float(row[1]) == pytest.approx(posterior.mean[k], abs=0.06 * posterior.sd[k])
        assert float(row[2]) == pytest.approx(posterior.sd[k], rel=0.05)
        low, high = map(float, row[3].split(" to "))
        assert (low, high) == pytest.approx(posterior.quantiles([0.05, 0.95])[:, k], abs=0.06 * posterior.sd[k])
        assert float(row[4]) == pytest.approx(posterior.contraction[k], rel=0.05)
    short = replace(posterior, chain=posterior.chain[:1], log_prob=posterior.log_prob[:1])
    assert "NOT CONVERGED: only 1 independent ensembles" in shown(short)[1]
    assert pixels(posterior) != pixels(replace(posterior, chain=posterior.chain + 0.3))


def test_a_spectrum(rng):
    prior = Normal(np.ones(12), np.full(12, 0.1))
    matrix = rng.standard_normal((20, 12)) * np.geomspace(1e3, 1e-2, 12)
    matrix[:, 4] = 2.0 * matrix[:, 1]
    problem = Linear(matrix, matrix @ prior.mean, prior)
    spectrum = fisher(problem, prior.mean, [{"c1": 1.0, "c4": -0.5}])
    rows, text = shown(spectrum)
    assert f"Of 12 directions the data determine {spectrum.n_informed} better than the prior, " in text
    assert [row[1] for row in rows[1:]].count("null") == 1
    assert [row[0] for row in rows[1:]] == ["1", "2", "3", "9", "10", "11", "12"]
    assert rows[-1][2] == "0"
    assert {part.split()[1] for part in rows[-1][3].split(", ")[:2]} == {"c1", "c4"}
    pixels(spectrum)


def test_an_estimate():
    solutions = np.array([[2.0, -0.01], [2.2, -0.02]])
    estimate = Estimate("SQP", ("a", "b"), solutions, np.array([1.5, 2.5]), ("converged", "max_steps"),
                        np.diag([0.01, 1e-8]), 120, 0.5)  # fmt: skip
    rows, text = shown(estimate)
    assert rows == [["parameter", "best", "sd"], ["a", "2.00", "0.10"], ["b", "-0.01000", "0.00010"]]
    assert "2 starts, 120 simulations, 0.5 s; least cost 1.5: converged" in text
    rows, _ = shown(replace(estimate, covariance=None, solutions=np.array([[np.nan, 0.0]])))
    assert [row[1:] for row in rows[1:]] == [["nan", ""], ["0", ""]]
    pixels(estimate)


def test_a_vehicle_and_its_flight(suboff, spiral_track):
    rows, text = shown(suboff)
    assert "length 102.261 m" in text
    assert len(rows) == 1 + len(suboff.equations.names)
    named = {re.search(r"(\w+)$", row[0])[1]: row for row in rows[1:]}
    assert named["Yuv"][1] == f"{suboff.xi[suboff.equations.index['Yuv']]:.4g}"
    rows, text = shown(spiral_track)
    assert "suboff on horizontal (horizontal)" in text
    assert "of 1: 1 ok" in text
    (yaw,) = [row for row in rows if row[0] == "yaw_deg"]
    assert float(yaw[2]) == pytest.approx(np.degrees(spiral_track.states[0, -1, 5]), rel=1e-3)
    pixels(spiral_track)


def test_a_picture_is_saved_or_refused_in_a_line(posterior, tmp_path):
    picture = posterior.plot()
    picture.save(tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes() == picture.png
    assert "bytes" in repr(picture)
    with refused("file"):
        picture.save(tmp_path / "nowhere" / "p.png")


def test_every_class_of_the_issue_shows_itself():
    for one in (bs.Posterior, bs.identifiability.Spectrum, bs.Trajectory, Estimate, bs.Vehicle):
        assert {"_repr_html_", "plot"} <= set(dir(one))
