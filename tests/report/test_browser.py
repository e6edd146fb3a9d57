"""The page of a report in a real browser: no error, no request, what hovers, sorts, opens and zooms, who can use it.

Skipped, with the reason, where there is neither Chromium or Chrome on the path nor that of ``playwright install``.
"""

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.browsing import PHONE, WIDE, asked_for, opened, violations
from support.laplace import posterior_of, spiral_problem

import bayesub as bs
from bayesub.findings import derived
from bayesub.inference import identifiability
from bayesub.inference.baselines import sqp
from bayesub.report import report
from bayesub.report.page import Drawings
from bayesub.report.plots import style

pytestmark = pytest.mark.browser

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install -e '.[dev]'")


@pytest.fixture(scope="module")
def run(spiral_track, tmp_path_factory):
    """A folder with a report, and its numbers."""
    folder = tmp_path_factory.mktemp("run")
    problem = spiral_problem(spiral_track)
    posterior = posterior_of(problem, np.random.default_rng(1))
    estimates = [sqp(problem.naive(), rng=np.random.default_rng(3), n_starts=2)]
    spectrum = identifiability.fisher(problem, posterior.best)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "N_DRAWS", 16)
        return folder, bs.write_report(folder, problem, estimates, spectrum, posterior)


@pytest.fixture(scope="module")
def run_of_two(suboff, tmp_path_factory):
    """A folder with a report of two trials, of 600 s and 400 s, and the problem of each."""
    folder = tmp_path_factory.mktemp("two")
    given = {"free": ("Xuu", "Yuv", "Nuv", "Nur"), "prior": bs.priors.relative_normal(0.25), "dt": 1.0}
    sensor = bs.sensors.Track(0.5, 0.1, interval_s=2.0, channels=("x", "y", "yaw"))
    trials = {}
    for seed, name in enumerate(("horizontal", "zigzag_20_20")):
        manoeuvre = bs.load_manoeuvre(name, suboff)
        record = bs.observe(bs.simulate(suboff, manoeuvre, dt=0.5), sensor, np.random.default_rng(seed))
        trials[name] = bs.Problem(suboff, manoeuvre, record, **given)
    joint = bs.JointProblem(trials)
    posterior = posterior_of(joint, np.random.default_rng(1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derived, "N_DRAWS", 16)
        bs.write_report(folder, joint, [], identifiability.fisher(joint, posterior.best), posterior)
    return folder, trials


@pytest.fixture(scope="module")
def shared(browser, run):
    with opened(browser, run[0] / "report.html") as page:
        yield page


@pytest.fixture
def page(shared):
    """The page as it is when it is opened."""
    shared.reload()
    return shared


def column(page, table, k):
    """The texts of a column of what is shown."""
    rows = page.locator(f"{table} tbody tr:visible td:nth-child({k})")
    return [text.replace("\u2212", "-") for text in rows.all_inner_texts()]


def beside(page, axis):
    """The range of the x axis that the label of a chart tells."""
    label = page.locator(".chart[aria-label^='" + axis + "']").get_attribute("aria-label")
    return [float(part) for part in re.search(r"from (\S+) to (\S+);", label).groups()]


def test_a_page_loads_without_complaint_and_asks_for_nothing(browser, run):
    for viewport in (WIDE, PHONE):
        with opened(browser, run[0] / "report.html", viewport) as page:
            assert page.locator("figure.live").count() == 3
            assert page.complaints == []
            assert asked_for(page) == [(run[0] / "report.html").as_uri()]
    assert (run[0] / "report.html").stat().st_size < 3e6


def test_the_page_may_ask_for_nothing_and_who_asks_is_seen(page, browser, tmp_path):
    """An image and a call are refused by the page's own policy; the same on a page without one are counted."""
    ask = """() => new Promise((done) => {
        const refused = [];
        document.addEventListener("securitypolicyviolation", (event) => refused.push(event.violatedDirective));
        new Image().src = "https://example.org/a.png";
        fetch("https://example.org/").catch(() => setTimeout(() => done(refused.sort()), 200));
    })"""
    assert page.evaluate(ask) == ["connect-src", "img-src"]
    (tmp_path / "plain.html").write_text("<title>plain</title>")
    with opened(browser, tmp_path / "plain.html") as plain:
        assert plain.evaluate(ask) == []
        assert sum("example.org" in url for url in plain.requests) == 2


def test_the_table_of_coefficients_sorts_shows_a_group_of_columns_and_is_searched(page, run):
    """What the trial narrows most comes first; the search of the page hides the other rows."""
    contraction = {row["name"]: f"{row['contraction']:.3f}" for row in run[1]["parameters"] + run[1]["nuisance"]}
    table = "#coefficients-table"
    names = [text.split()[0] for text in column(page, table, 1)]
    assert names[0] == min(run[1]["parameters"], key=lambda row: row["contraction"])["name"]
    assert sorted(names) == sorted(contraction)
    assert page.locator(f"{table} td.interval svg").count() == len(names)
    head = page.get_by_role("group", name="Coefficients, table").get_by_role("button", name="posterior / prior sd")
    for sign, word in ((1, "ascending"), (-1, "descending")):
        head.click()
        found = [float(text) for text in column(page, table, 3)]
        assert found == sorted(map(float, contraction.values()), reverse=sign < 0)
        assert page.locator(f"{table} th[aria-sort={word}]").count() == 1
    for group, shown in (("sampling", "R-hat"), ("si", "in SI units"), ("value", "5 %")):
        page.locator(f"input[name=show][value={group}]").check()
        heads = page.locator(f"{table} th:visible").all_inner_texts()
        assert [text.startswith(shown) for text in heads].count(True) == 1
        assert len(heads) < 9
    page.locator("nav input[type=search]").fill("nuv")
    assert [text.split()[0] for text in column(page, table, 1)] == ["Nuv"]
    page.locator("nav input[type=search]").fill("")
    assert len(column(page, table, 1)) == len(names)


def test_a_click_on_a_correlation_opens_the_pair_and_hovering_names_it(page, run):
    pairs = {frozenset(t["pair"]): t["correlation"] for t in run[1]["trade_offs"]}
    canvas = page.locator("#figure-correlation .map canvas")
    canvas.scroll_into_view_if_needed()
    names, strong, grid = page.evaluate(
        "[content.pairs.names, content.pairs.strong, document.querySelector('#figure-correlation .map canvas').grid]"
    )
    for first, second in [sorted(pair) for pair in list(pairs)[1:3]]:
        row, place = (strong.index(names.index(name)) for name in (first, second))
        at = {k: grid["margin"] + (n + 0.5) * grid["step"] for k, n in (("x", place), ("y", row))}
        words = f"{first} with {second}: correlation {pairs[frozenset((first, second))]:+.2f}".replace("-", "\u2212")
        canvas.hover(position=at)
        assert page.locator(".tip").inner_text() == words
        canvas.click(position=at)
        assert page.locator(".pair .titled span").inner_text() == words
        chosen = page.locator("#figure-correlation select").evaluate_all(
            "all => all.map(one => one.selectedOptions[0].text)"
        )
        assert chosen == [first, second]
    before = page.locator(".pair .titled span").inner_text()
    canvas.click(position=dict.fromkeys("xy", grid["margin"] + 0.5 * grid["step"]))
    assert page.locator(".pair .titled span").inner_text() == before  # a parameter with itself is no pair
    canvas.focus()
    page.keyboard.press("ArrowUp")
    moved = page.locator("#figure-correlation output").inner_text()
    assert moved
    page.keyboard.press("Enter")
    assert page.locator(".pair .titled span").inner_text() == moved != before
    page.locator("#figure-correlation select").first.select_option(names[strong[-1]])
    page.locator("#figure-correlation select").last.select_option(names[strong[0]])
    canvas.focus()
    page.keyboard.press("ArrowUp")  # the frame has moved to the pair that was chosen from the lists
    assert (
        page.locator("#figure-correlation output")
        .inner_text()
        .startswith(f"{names[strong[-2]]} with {names[strong[0]]}")
    )


def test_residuals_and_tracks_zoom_by_mouse_keys_and_buttons(page):
    page.get_by_text("Track and residuals, to zoom").click()
    whole = beside(page, "north (m)")
    box = page.locator(".chart[aria-label^='north (m)'] .u-over")
    box.scroll_into_view_if_needed()
    edges = box.bounding_box()
    page.mouse.move(edges["x"] + 0.25 * edges["width"], edges["y"] + 20)
    page.mouse.down()
    page.mouse.move(edges["x"] + 0.5 * edges["width"], edges["y"] + 25, steps=5)
    page.mouse.up()
    zoomed = beside(page, "north (m)")
    at = [whole[0] + share * (whole[1] - whole[0]) for share in (0.25, 0.5)]
    assert zoomed == pytest.approx(at, abs=0.02 * (whole[1] - whole[0]))
    assert beside(page, "yaw (deg)") == zoomed  # the channels of a trial share their time
    page.get_by_role("button", name="north (m), reading minus posterior mean: show all").click()
    assert beside(page, "yaw (deg)") == whole
    track = beside(page, "Track")
    page.locator(".chart[aria-label^='Track']").focus()
    page.keyboard.press("+")
    low, high = beside(page, "Track")
    assert high - low == pytest.approx(0.5 * (track[1] - track[0]), rel=1e-3)
    page.keyboard.press("0")
    assert beside(page, "Track") == track
    for width in (700, WIDE["width"]):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_function("width => document.querySelector('.chart').clientWidth < width", arg=width)
        page.wait_for_timeout(200)
    assert beside(page, "Track") == track  # both axes at one scale, whatever the sizes between


def test_track_and_residuals_of_each_of_several_trials_are_found_and_zoom_by_themselves(browser, run_of_two):
    folder, trials = run_of_two
    with opened(browser, folder / "report.html") as page:
        for name, trial in trials.items():
            page.get_by_text(f"Track and residuals: {name}, to zoom").click()
            page.get_by_role("group", name=f"Track from above, {name}").scroll_into_view_if_needed()
            playwright.expect(page.get_by_role("group", name=f"Track from above, {name}")).to_be_in_viewport()
            ends = [share * trial.record.channels[0].times[-1] for share in (-0.02, 1.02)]
            assert beside(page, f"yaw (deg), reading minus posterior mean, {name}") == pytest.approx(ends, rel=1e-4)
        first, second = (f"north (m), reading minus posterior mean, {name}" for name in trials)
        whole = [beside(page, one) for one in (first, second)]
        page.get_by_role("button", name=f"{second}: zoom in").click()
        assert beside(page, first) == whole[0]
        assert np.ptp(beside(page, second)) == pytest.approx(0.5 * np.ptp(whole[1]), rel=1e-3)
        assert page.complaints == []
        assert violations(page) == []


@pytest.mark.parametrize(("viewport", "scheme"), [(WIDE, "light"), (PHONE, "dark")])
def test_everybody_can_use_it_says_axe(browser, run, viewport, scheme):
    with opened(browser, run[0] / "report.html", viewport, color_scheme=scheme) as page:
        assert violations(page) == []
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        assert violations(page) == []
        if scheme == "dark":
            return
        page.evaluate("document.querySelector('select').parentElement.replaceWith(document.querySelector('select'))")
        assert [rule for rule, _ in violations(page)] == ["select-name"]  # a label that is missing is found


def test_a_phone_scrolls_one_way(browser, run):
    with opened(browser, run[0] / "report.html", PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]


def test_without_script_and_on_paper_the_figures_stand(browser, run):
    def shown(page):
        figures = page.locator("#figure-coefficients, #figure-correlation")
        cards, widgets = figures.locator("> .card"), figures.locator("> .widget")
        return cards.filter(visible=True).count(), widgets.filter(visible=True).count()

    with opened(browser, run[0] / "report.html", java_script_enabled=False) as page:
        assert shown(page) == (2, 0)
        assert page.get_by_text("to zoom").filter(visible=True).count() == 0
    with opened(browser, run[0] / "report.html") as page:
        assert shown(page) == (0, 2)
        page.emulate_media(media="print")
        assert shown(page) == (2, 0)


def test_a_widget_that_fails_leaves_its_figure(browser, run, tmp_path):
    text = (run[0] / "report.html").read_text()
    head, content = text.split('<script type="application/json" id="content">')
    content, tail = content.split("</script>", 1)
    broken = json.dumps(json.loads(content) | {"pairs": {}}).replace("<", "\\u003c")
    (tmp_path / "report.html").write_text(f'{head}<script type="application/json" id="content">{broken}</script>{tail}')
    with opened(browser, tmp_path / "report.html") as page:
        assert page.locator("#figure-correlation > .card").is_visible()
        assert page.locator("figure.live").count() == 2
        assert len(page.complaints) == 1


def test_the_answer_and_three_pictures_are_on_the_first_screen_and_all_on_eight(browser, run):
    """At 1280 x 800, and on the first two and a half of a phone."""
    with opened(browser, run[0] / "report.html", {"width": 1280, "height": 800}) as page:
        assert page.locator(".three figure").count() == 3
        assert page.locator(".three").bounding_box()["y"] + page.locator(".three").bounding_box()["height"] < 800
        assert page.evaluate("document.documentElement.scrollHeight") <= 8 * 800
    with opened(browser, run[0] / "report.html", {"width": 390, "height": 844}) as page:
        assert page.locator(".answer").bounding_box()["y"] < 844
        assert page.locator("#boat").bounding_box()["y"] < 2.5 * 844


def test_a_drawing_looks_as_matplotlib_drew_it(browser, tmp_path):
    """Pixel by pixel, to the rounding of places; a drawing without its glyphs does not."""
    with style.figure(tmp_path / "whole.svg", 4.0, 3.0) as figure:
        axis = figure.subplots()
        axis.plot(np.linspace(0.0, 6.0, 40), np.sin(np.linspace(0.0, 6.0, 40)), "o--", color=style.SQP)
        axis.fill_between([0.0, 6.0], -0.5, 0.5, color=style.PRIOR, alpha=0.5)
        axis.set(xlabel=r"$N'_{\dot v}$ (m)", ylim=(-0.8, 0.9), title="residual of 12,345 readings")
    sheet = Drawings()
    drawing = sheet.inline((tmp_path / "whole.svg").read_text())
    own = f'<svg class="drawing" viewBox="{drawing.box}" width="{drawing.width}">{drawing.content}</svg>'
    shared = str(sheet.common)
    bare = re.sub("<defs>.*</defs>", "", shared)
    rules = (Path(report.__file__).parent / "style.css").read_text()
    seen = {}
    for name, body in (
        ("whole", f'<img src="whole.svg" width={drawing.width} style="display: block">'),
        ("own", shared + own),
        ("bare", bare + own),
    ):
        (tmp_path / f"{name}.html").write_text(
            f"<!doctype html><style>{rules} body {{ padding: 0; margin: 0 }}</style><body>{body}"
        )
        with opened(browser, tmp_path / f"{name}.html", {"width": drawing.width, "height": 288}) as page:
            picture = Image.open(io.BytesIO(page.screenshot())).convert("L")
            seen[name] = np.asarray(picture, dtype=float)
    assert np.ptp(seen["whole"]) > 200
    off = {name: np.mean(np.abs(seen[name] - seen["whole"]) > 64) for name in ("own", "bare")}
    assert off["own"] < 1e-3
    assert off["bare"] > 0.01
