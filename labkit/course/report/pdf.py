"""A page of HTML as a PDF, printed by Chromium."""

from __future__ import annotations

import io
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from labkit.course.report.pages import ReportError, need
from labkit.files import atomic_write

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHANNELS: tuple[dict[str, str], ...] = ({}, {"channel": "chrome"}, {"channel": "msedge"})
NO_BROWSER = (
    "a PDF needs Chromium or Chrome, and none was found. Install one (Debian and Ubuntu: "
    "`sudo apt install chromium`; elsewhere: `python -m playwright install chromium`), "
    "or open the HTML in any browser and print it to a file"
)
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync"]
MARGIN = dict.fromkeys(("top", "right", "bottom", "left"), "18mm")
FORMULAS = "() => new Promise(done => window.MathJax?.Hub ? MathJax.Hub.Queue(done) : done())"


def write_pdf(html: str, path: str | Path) -> int:
    """Print a page from `render` to a file; return the number of its pages of A4.

    Raises
    ------
    ReportError
        If there is no browser: with the one to install.
    WriteError
        If `path` cannot be written.
    """
    with ThreadPoolExecutor(1) as own:  # a notebook's thread has a loop that playwright refuses
        content = own.submit(_print, html).result()
    with atomic_write(path, "wb") as file:
        file.write(content)
    return len(need("pypdf").PdfReader(io.BytesIO(content)).pages)


def _print(html: str) -> bytes:
    with need("playwright.sync_api").sync_playwright() as driver:
        browser = launch(driver)
        try:
            page = browser.new_page()
            page.emulate_media(media="print")
            page.set_content(html, wait_until="networkidle")
            page.evaluate(FORMULAS)
            content: bytes = page.pdf(format="A4", margin=MARGIN, scale=0.8)
        finally:
            browser.close()
    return content


def launch(driver: Any) -> Any:
    """Start the browser on the path, else one that playwright has, else the system's own."""
    problem = need("playwright.sync_api").Error
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    for choice in [{"executable_path": found}] if found else CHANNELS:
        try:
            return driver.chromium.launch(args=QUIET, **choice)
        except problem:
            continue
    raise ReportError(NO_BROWSER)
