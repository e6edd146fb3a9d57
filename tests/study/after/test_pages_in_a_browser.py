"""The pages of a prediction and of a comparison in a real browser, on a screen, a phone and paper."""

import shutil
import sys

import pytest
from support import small_study
from support.browsing import PAPER, PHONE, WIDE, asked_for, opened, violations

from bayesub.cli import app

pytestmark = pytest.mark.browser

MOST = 7  # runs that are compared
LEGIBLE = 576  # pixels of a figure, 36 rem


def command(*arguments):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["bayesub", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            app.main()
    assert not stop.value.code


@pytest.fixture(scope="module")
def prediction(finished, tmp_path_factory):
    """The page of a log whose readings were held back."""
    folder = tmp_path_factory.mktemp("prediction")
    track = small_study.track(attitude_sd_deg=0.2, interval_s=1.0)
    sensors = small_study.write_sensors(folder / "sensors.toml", track)
    given = ("zigzag_20_20", "--sensors", sensors, "--seed", 3, "--sample", 0.5)
    command("simulate", "auv690", *given, "-o", folder / "log.csv")
    command("predict", finished(), folder / "log.csv", "-o", folder / "p", "--draws", 60)
    return folder / "p" / "prediction.html"


@pytest.fixture(scope="module")
def comparison(finished, tmp_path_factory):
    """The page of as many runs as can be compared, with long names."""
    folder = tmp_path_factory.mktemp("comparison")
    runs = [shutil.copytree(finished(), folder / f"a_run_of_a_long_name_{k}") for k in range(MOST)]
    command("compare", *runs, "-o", folder / "c", "--draws", 60)
    return folder / "c" / "comparison.html"


@pytest.fixture(params=["prediction", "comparison"])
def file(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize(("viewport", "scheme"), [(WIDE, "light"), (PHONE, "dark")])
def test_it_loads_without_complaint_and_request_and_everybody_can_use_it(browser, file, viewport, scheme):
    with opened(browser, file, viewport, color_scheme=scheme) as page:
        assert page.complaints == []
        assert asked_for(page) == [file.as_uri()]
        assert violations(page) == []
    assert file.stat().st_size < 3e6


def test_a_phone_scrolls_one_way_and_figures_are_as_wide_as_they_need(browser, file):
    with opened(browser, file, PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
        widths = page.locator(".card > *").evaluate_all(
            "all => all.map(one => one.clientWidth || one.width.baseVal.value)"
        )
        assert widths
        assert min(widths) >= LEGIBLE


def test_nothing_is_cut_off_on_paper(browser, file):
    with opened(browser, file, PAPER) as page:
        page.emulate_media(media="print")
        assert page.evaluate("document.documentElement.scrollWidth") == PAPER["width"]
        assert page.locator("input:visible").count() == 0


def test_tables_sort_by_numbers(browser, prediction):
    with opened(browser, prediction) as page:
        table = page.get_by_role("group", name="Coverage and scores, table")
        table.get_by_role("button", name="CRPS, x (m)").click()
        found = [float(text) for text in table.locator("tbody tr td:nth-child(4)").all_inner_texts()]
        assert len(found) > 2
        assert found == sorted(found)
