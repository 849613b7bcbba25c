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
FOOTER = (
    '<div style="font: 7pt sans-serif; width: 100%; text-align: center; color: #555">'
    '<span class="pageNumber"></span> / <span class="totalPages"></span></div>'
)
WIDTH = 658  # pixels between the margins of A4 in the style's `@page`
TOO_WIDE = """() => {
    const range = document.createRange();
    const wide = new Set();
    for (const each of document.querySelectorAll("main *")) {
        range.selectNodeContents(each);
        const right = Math.max(...[each, range].map(it => it.getBoundingClientRect().right));
        if (right > innerWidth + 1) wide.add(each.closest("math, table, pre, p, li") ?? each);
    }
    return [...wide].filter(each => ![...wide].some(it => it !== each && each.contains(it)))
        .map(each => (each.textContent.trim() || each.tagName).replace(/\\s+/g, " ").slice(0, 40));
}"""
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync"]


def write_pdf(html: str, path: str | Path) -> tuple[int, list[str]]:
    """Print a page, from `render`, to a file.

    The page is the reader's own report, so it runs without a sandbox, which root and most
    containers do not offer; it is kept from the network.

    Parameters
    ----------
    html : str
        The page.
    path : path-like
        The PDF to write, whole or not at all.

    Returns
    -------
    int
        How many pages of A4 it has.
    list of str
        What is cut off at the right for being wider than the page: how the text of each begins.

    Raises
    ------
    ReportError
        Where there is no browser: with what to install.
    WriteError
        Where `path` cannot be written.
    """
    with ThreadPoolExecutor(1) as own:  # a notebook's thread has a loop that playwright refuses
        content, cut = own.submit(_print, html).result()
    with atomic_write(path, "wb") as file:
        file.write(content)
    return page_count(content), cut


def page_count(pdf: bytes) -> int:
    """How many pages a PDF has."""
    return len(need("pypdf").PdfReader(io.BytesIO(pdf)).pages)


def _print(html: str) -> tuple[bytes, list[str]]:
    with need("playwright.sync_api").sync_playwright() as driver:
        browser = launch(driver)
        try:
            page = browser.new_page(offline=True, java_script_enabled=False)
            page.set_viewport_size({"width": WIDTH, "height": WIDTH})
            page.emulate_media(media="print")
            page.set_content(html, wait_until="load")
            cut: list[str] = page.evaluate(TOO_WIDE)
            content: bytes = page.pdf(
                prefer_css_page_size=True,
                display_header_footer=True,
                header_template="<span></span>",
                footer_template=FOOTER,
            )
        finally:
            browser.close()
    return content, cut


def launch(driver: Any) -> Any:
    """The browser that is on the path, else one that playwright has, else the system's own."""
    problem = need("playwright.sync_api").Error
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    for choice in [{"executable_path": found}] if found else CHANNELS:
        try:
            return driver.chromium.launch(args=QUIET, **choice)
        except problem:
            continue
    raise ReportError(NO_BROWSER)
