"""Pages in a real browser: that of the machine or of ``playwright install``, without network."""

import shutil
from contextlib import contextmanager

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
WIDE, PHONE = {"width": 1200, "height": 900}, {"width": 400, "height": 800}
PAPER = {"width": 718, "height": 1047}  # of A4 less margins of 10 mm, at 96 pixels an inch


@contextmanager
def started():
    """A browser; skips, with the reason, where there is none."""
    name = "playwright.sync_api"
    playwright = pytest.importorskip(name, reason="playwright is not installed: pip install -e '.[dev]'")
    path = next(filter(None, map(shutil.which, NAMES)), None)
    with playwright.sync_playwright() as driver:
        try:
            browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        except playwright.Error as error:
            pytest.skip(f"no browser: {str(error).splitlines()[0]} (playwright install chromium)")
        yield browser
        browser.close()


@contextmanager
def opened(browser, file, viewport=WIDE, **options):
    """A page in a browser without network, with what it asks for and what it complains of."""
    context = browser.new_context(viewport=viewport, offline=True, **options)
    page = context.new_page()
    page.set_default_timeout(60_000)
    page.requests, page.complaints = [], []
    page.on("request", lambda request: page.requests.append(request.url))
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto(file.as_uri())
    yield page
    context.close()


def asked_for(page):
    """What a page has asked for, besides what is in it."""
    return [url for url in page.requests if not url.startswith("data:")]


def violations(page):
    """Rules of axe that a page breaks, and where."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    found = axe.Axe().run(page).response["violations"]
    return [(rule["id"], node["html"][:120]) for rule in found for node in rule["nodes"]]
