"""Every kind of figure is drawn once for PNG and PDF, and its axes say quantity and unit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.path import Path as MatplotlibPath
from PIL import Image
from support.layout import WrittenTexts

from bayesub.findings.data_card import DataCard
from bayesub.inference.identifiability.fisher import Spectrum
from bayesub.inference.sampling.posterior import Posterior
from bayesub.model.coefficients import EQUATIONS
from bayesub.model.equations import load_equations
from bayesub.problem.distributions import CorrelatedNormal, Normal
from bayesub.report.plots import (
    cards,
    checks,
    coefficients,
    corner,
    style,
    track,
    trade_offs,
)
from bayesub.sensors import Track, observe
from calibration import plots as calibration
from ill_conditioning.plots import cancellation, collinearity, contribution, profile, spectra

pytestmark = pytest.mark.rendered
NAMES = ("Xuu", "Yuv", "Nuv", "yaw0_deg")
N = 3  # coefficients among them
TIMES = np.arange(40.0)
RNG = np.random.default_rng(0)


def a_posterior() -> Posterior:
    chain = np.array([1.0, 1.0, -1.0, 0.0]) + 0.1 * RNG.standard_normal((4, 60, 8, len(NAMES)))
    mean, sd = chain.mean(axis=(0, 1, 2)), np.full(len(NAMES), 0.2)
    return Posterior(NAMES, chain, np.zeros(chain.shape[:3]), mean, sd, 10, 0.5, 100, 1.0, {})


POSTERIOR = a_posterior()
REFERENCE = np.array([1.0, 1.0, -1.0, 0.0])
PRIOR = Normal(REFERENCE, np.full(len(NAMES), 0.2))
SPECTRUM = Spectrum(NAMES, np.array([1e3, 2.0, 0.1, 1e-13]), np.eye(4), PRIOR.sd, 1, REFERENCE)
GOOD = np.array([[True] * 4, [False] * 4])
SQP = coefficients.Found("SQP, 2 starts: 1 fit", np.tile(REFERENCE, (2, 1)), GOOD[:, 0], GOOD)


def draw_calibration(path):
    points = np.linspace(0.0, 1.0, 22)[1:-1]
    calibration.draw_ecdf(path, {"Xuu": points, "log likelihood": points}, (points - 0.2, points + 0.2), EQUATIONS)


def draw_cancellation(path):
    errors = RNG.standard_normal((len(TIMES), 3))
    parts = {"names": ("Xuu", "Xvr", "Xrr"), "errors": errors, "total": errors.sum(axis=1), "ratio": 3.0}
    errors = {"X": SimpleNamespace(axis="X", largest={"Xuu": 4e3, "Xvr": 2e3}, **parts)}
    cancellation.draw(path, TIMES, errors, EQUATIONS)


def draw_coefficients(path):
    coefficients.draw(path, POSTERIOR, PRIOR, REFERENCE[:N], [SQP], "truth", EQUATIONS)


def draw_correlation_of_regressors(path):
    yaw = SimpleNamespace(axis="N", names=("Nuv", "Nur"), correlation=np.eye(2))
    collinearity.draw_correlation(path, {"N": yaw}, EQUATIONS)


def draw_scatter_of_regressors(path):
    system = SimpleNamespace(names=("Nuv", "Nur"), matrix=RNG.standard_normal((50, 2)))
    collinearity.draw_scatter(path, {"suboff": system}, [("Nuv", "Nur")], EQUATIONS)


def draw_contribution(path):
    costs = SimpleNamespace(names=NAMES[:N], fractions=(0.5, 1.0), costs=10.0 ** RNG.uniform(0, 4, (2, N)))
    contribution.draw(path, {"suboff": costs}, {"suboff": 1e-3}, EQUATIONS)


def draw_cross_check(path):
    size = (2, N)
    z = {"mean_z": np.ones(N), "sd_z": -np.ones(N), "correlation_z": np.zeros(N), "threshold": 3.9}
    check = SimpleNamespace(names=NAMES[:N], means=np.zeros(size), sds=np.ones(size), **z)
    checks.draw_cross_check(path, check)


def draw_data_card(path):
    channel = SimpleNamespace(
        name="x", times=TIMES, interval_s=1.0, gaps=((3.0, 6.0),), outliers=TIMES[[8]], n_directions=2,
        contraction=np.array([0.1, 0.5, 1.0, 1.0]),
    )  # fmt: skip
    informed = {"n_directions": 2, "contraction": channel.contraction}
    shape = {
        "equations": EQUATIONS,
        "names": NAMES,
        "n_coefficients": N,
        "channels": (channel,),
        "durations": {"": 40.0},
    }
    cards.draw(DataCard(title="A $study$", zeros=[], advice="", **shape, **informed), path)


def draw_fit(path):
    residuals = {"x": RNG.standard_normal((3, len(TIMES)))}
    check = SimpleNamespace(failed=False, n_readings=len(TIMES), correlations=np.full(8, 0.1))
    checks.draw_criticism(path, SimpleNamespace(checks={"x": check}), residuals, {"x": TIMES})


def draw_correlation(path):
    trade_offs.draw_correlation(path, POSTERIOR.names, POSTERIOR.correlation, EQUATIONS)


def draw_corner(path):
    corner.draw(path, POSTERIOR, PRIOR, REFERENCE[:N], EQUATIONS, chosen=np.arange(N), found=[SQP])


def draw_pairs(path):
    corner.draw_pairs(path, POSTERIOR, PRIOR, REFERENCE[:N], EQUATIONS, [(0, 1), (1, 3)], [SQP])


def draw_ladder(path):
    trade_offs.draw_known(path, NAMES[:N], np.full(N, 0.5), np.array([1e-3, 0.1, 0.5]))


def draw_ladder_of_directions(path):
    trade_offs.draw_directions(path, SPECTRUM, EQUATIONS, sds=np.full(len(NAMES), 0.5), found=[SQP])


def draw_spectrum(path):
    trade_offs.draw_directions(path, SPECTRUM)


def draw_profile(path):
    change = np.linspace(-0.5, 0.5, 11)
    cost = {"cost": 100.0 * change**2, "laplace": 90.0 * change**2}
    profile.draw(path, {"track": SimpleNamespace(name="Xuu", value=1.0, grid=1.0 + change, **cost)}, EQUATIONS)


def draw_ranks(path):
    checks.draw_ranks(path, POSTERIOR, EQUATIONS)


def draw_spectra(path):
    spectra.draw_cases(path, {"one": SPECTRUM, "another": SPECTRUM}, 2)


FIGURES = {
    draw_calibration: ("rank of the truth among posterior draws, as a fraction", "ECDF minus uniform"),
    draw_cancellation: ("time (s)", "error of X (kN)"),
    draw_coefficients: ("ratio to truth",),
    draw_correlation_of_regressors: ("cosine of two regressors",),
    draw_scatter_of_regressors: ("$uv$ over its largest", "$ur$ over its largest"),
    draw_contribution: (r"cost (m$^2$ + deg$^2$)",),
    draw_cross_check: ("emcee - NUTS (Monte Carlo standard errors)",),
    draw_data_card: ("time from the first control (s)", "posterior / prior sd"),
    draw_fit: ("time (s)", "lag (readings)"),
    draw_correlation: ("posterior correlation",),
    draw_profile: ("change of the coefficient (%)", "rise of $-2\\log$ likelihood"),
    draw_ranks: ("step after warm-up", "rank over number of draws"),
    draw_ladder: ("standard deviation, in those of the prior",),
    draw_ladder_of_directions: ("posterior sd, distance of solutions, in prior sds", "direction"),
    draw_pairs: ("$X'_{uu}$", "yaw0 (deg)"),
    draw_spectrum: ("posterior sd, in prior sds", "direction"),
    draw_spectra: ("direction", "singular value\n(prior sd / data sd)"),
    draw_corner: (),
}


def test_labels_and_borders_are_those_of_the_set():
    """Of names that do not begin with their axis, too; what is no coefficient is told by name and unit."""
    remus = load_equations("remus")
    assert coefficients.labels(["Yuv", "yaw0_deg"], EQUATIONS) == ["$Y'_{uv}$", "yaw0 (deg)"]
    assert coefficients.labels(["Yuv", "yaw0_deg"], remus) == ["$Y_{uv}$", "yaw0 (deg)"]
    assert coefficients.borders(NAMES, EQUATIONS) == [1, 2, 3]
    named = {"a": "X", "b": "X", "c": "Y"}
    terms = tuple(replace(remus.terms[k], name=name, axis=axis) for k, (name, axis) in enumerate(named.items()))
    assert coefficients.borders(tuple(named), replace(remus, terms=terms)) == [2]


def test_a_regressor_without_a_subscript_is_written_as_in_its_file():
    term = replace(EQUATIONS.term("Nuv"), label="$C_1$")
    some = replace(EQUATIONS, terms=(term, EQUATIONS.term("Nur")))
    assert collinearity._regressor("Nuv", some) == "u*v"
    assert collinearity._regressor("Nur", some) == "$ur$"


def words(drawing: Figure) -> set[str]:
    """All labels of axes and of the figure."""
    labels = {text for axis in drawing.axes for text in (axis.get_xlabel(), axis.get_ylabel())}
    return labels | {drawing.get_supxlabel(), drawing.get_supylabel()}


def check(drawings, folder, expected):
    """One figure is made, in both formats, with the labels."""
    (drawing,) = drawings
    assert set(expected) <= words(drawing)
    assert (folder / "figure.pdf").read_bytes().startswith(b"%PDF")
    picture = Image.open(folder / "figure.png")
    assert picture.mode == "P"
    assert picture.size == pytest.approx(150 * drawing.get_size_inches(), abs=1)
    assert len(picture.convert("RGB").getcolors(1 << 24)) > 2


@pytest.mark.parametrize("draw", FIGURES, ids=lambda draw: draw.__name__)
def test_a_figure_is_drawn_once_for_both_formats_and_labelled(draw, tmp_path, drawings, monkeypatch):
    texts = WrittenTexts(monkeypatch)
    draw([tmp_path / "figure.png", tmp_path / "figure.pdf"])
    check(drawings, tmp_path, FIGURES[draw])
    assert texts.unreadable() == []


@pytest.mark.slow
def test_tracks(tmp_path, drawings, spiral_track):
    sensor = Track(0.5, 0.1, interval_s=20.0, channels=("x", "y", "yaw"))
    record = observe(spiral_track, sensor, np.random.default_rng(0))
    states = np.repeat(spiral_track.states[:, ::10], 3, axis=0)
    readings = np.concatenate([channel.values for channel in record.channels])
    paths = [tmp_path / "figure.png", tmp_path / "figure.pdf"]
    after = np.repeat(readings[None], 4, axis=0)
    before = readings * RNG.uniform(0.5, 1.5, (20, 1))
    track.draw_fan(paths, record.channels, before, after, (1.1 * states, states))
    check(drawings, tmp_path, ("east (m)", "north (m)", "yaw (deg)", "time (s)"))
    drawings.clear()
    straight = states.copy()
    straight[..., 1] = 0.0
    track.draw_fan(paths, record.channels, before, after, (straight, straight))
    check(drawings, tmp_path, ("north (m)", "depth (m)", "yaw (deg)", "time (s)"))
    drawings.clear()
    simulator = spiral_track.simulator
    trials = {str(k): (simulator.manoeuvre, simulator.vehicle.actuators) for k in range(track.MOST_ORDERS + 2)}
    track.draw_orders(paths, trials)
    assert len(drawings[0].axes) == track.MOST_ORDERS
    check(drawings, tmp_path, ("plane (deg)", "time (s)"))
    drawings.clear()
    track.draw_simulated(paths, spiral_track)
    check(drawings, tmp_path, ("east (m)", "north (m)", "depth (m)", "angle (deg)", "speed (m/s)", "plane (deg)"))


@pytest.mark.parametrize("n", [1, 2])
def test_actuators_of_any_boat_are_drawn(n, tmp_path, drawings, spiral_track):
    """Also fewer than three: angles in degrees, a force as a part of its largest; those that rest are not drawn."""
    columns = ("fin_1_deg", "fin_2_deg", "thruster_n")[-n - 1 :]
    histories = (np.sin(spiral_track.times), np.zeros(len(spiral_track.times)), -5.0 * np.sin(spiral_track.times))
    log = dict(zip(columns, histories[-n - 1 :], strict=True))
    actuators = SimpleNamespace(columns=columns, shorts=columns)
    manoeuvre = SimpleNamespace(logged=str)
    boat = SimpleNamespace(name="boat", actuators=actuators)
    simulator = SimpleNamespace(vehicle=boat, manoeuvre=manoeuvre, forces=None)
    parts = {"times": spiral_track.times, "states": spiral_track.states}
    track.draw_simulated(tmp_path / "figure.png", SimpleNamespace(simulator=simulator, log=log, **parts))
    (drawing,) = drawings
    (planes,) = (axis for axis in drawing.axes if axis.get_ylabel() == "plane (deg)")
    words = [text.get_text() for text in planes.get_legend().get_texts()]
    assert words == (["fin 1"] if n == 2 else []) + ["thruster (N) / 5"]
    (right,) = (axis for axis in drawing.axes if axis.get_ylabel() == "of the largest")
    assert np.abs(right.lines[0].get_ydata()).max() == pytest.approx(1.0)


def test_a_palette_keeps_common_colours_and_gradients():
    """A white page with a blue half and a gradient of a thousand colours that are rare."""
    pixels = np.full((400, 500, 3), 255, dtype=np.uint8)
    pixels[:200, :250] = (0, 114, 178)
    ramp = np.linspace(0, 255, 500)
    pixels[-2] = np.stack([ramp, ramp[::-1], np.full(500, 80.0)], axis=1)
    pixels[-1] = np.stack([ramp, 0.5 * ramp, np.full(500, 160.0)], axis=1)
    result = np.asarray(style.quantise(Image.fromarray(pixels)).convert("RGB")).astype(int)
    np.testing.assert_array_equal(result[:-2], pixels[:-2])
    assert np.abs(result[-2:] - pixels[-2:]).max() <= 12


def test_a_saved_figure_has_the_colours_of_its_colour_bar(tmp_path):
    """Of a map of correlations, every cell and every level of the bar keep their colour in the palette of the file."""
    values = np.linspace(-1.0, 1.0, len(NAMES) ** 2).reshape(len(NAMES), -1)
    trade_offs.draw_correlation(tmp_path / "map.png", NAMES, values, EQUATIONS)
    picture = np.asarray(Image.open(tmp_path / "map.png").convert("RGB"))
    shown = np.unique(picture.reshape(-1, 3), axis=0).astype(int)
    levels = np.rint(255 * colormaps["RdBu_r"](np.linspace(0.0, 1.0, 256))[:, :3]).astype(int)
    assert np.abs(levels[:, None] - shown).max(axis=2).min(axis=1).max() <= 12
    values = values[~np.eye(len(NAMES), dtype=bool)]
    cells = np.rint(255 * colormaps["RdBu_r"](0.5 + 0.5 * values)[:, :3]).astype(int)
    assert np.abs(cells[:, None] - shown).max(axis=2).min(axis=1).max() <= 12


def test_the_edge_of_a_prior_with_correlations_slants_with_it():
    """90 % of the draws are within, and none of the boundary is further along one axis than without them."""
    prior = CorrelatedNormal(
        np.array([1.0, 2.0, -1.0]), np.linalg.cholesky([[0.04, 0.0, 0.0396], [0, 1, 0], [0.0396, 0, 0.04]])
    )
    x, y = (side[:, k] for side, k in zip(corner.edge(prior, 0, 2), (0, 2), strict=True))
    inside = MatplotlibPath(np.stack([x, y], axis=1)).contains_points(prior.sample(RNG, 20_000)[:, [0, 2]])
    assert inside.mean() == pytest.approx(0.9, abs=0.01)
    assert np.ptp((x - 1.0) - (y + 1.0)) < 0.2 * np.ptp(x)
