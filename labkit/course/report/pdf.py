"""A page of HTML as a PDF, printed by Chromium or one of its kin."""

from __future__ import annotations

import io
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from labkit.course.report.pages import ReportError, need
from labkit.files import atomic_write

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
NO_BROWSER = (
    "a PDF needs Chromium, Chrome or Edge, and none was found. Install one (Debian and Ubuntu: "
    "`sudo apt install chromium`), or open the HTML in any browser and print it to a file"
)
QUIET = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking")
DRAWN = "--virtual-time-budget=20000"  # ms that a page has for what it loads and draws
PAPER = "<style>@page { size: A4; margin: 18mm } body { zoom: 0.8 }</style>"
PATIENCE = 120  # seconds for the browser


def write_pdf(html: str, path: str | Path) -> int:
    """Print a page from `render` to a file; return the number of its pages of A4.

    Raises
    ------
    ReportError
        If there is no browser: with the one to install. If it prints nothing: with its words.
    WriteError
        If `path` cannot be written.
    """
    browser = find_browser()
    with TemporaryDirectory() as name:
        page, pdf = Path(name, "page.html"), Path(name, "page.pdf")
        page.write_text(html + PAPER, "utf-8")
        command = [browser, *QUIET, DRAWN, f"--user-data-dir={name}", "--no-pdf-header-footer"]
        command += [f"--print-to-pdf={pdf}", page.as_uri()]
        told = subprocess.run(command, capture_output=True, check=False, timeout=PATIENCE).stderr
        if not pdf.is_file():
            raise ReportError(f"{browser} printed nothing: {told.decode(errors='replace')[-300:]}")
        content = pdf.read_bytes()
    with atomic_write(path, "wb") as file:
        file.write(content)
    return len(need("pypdf").PdfReader(io.BytesIO(content)).pages)


def find_browser() -> str:
    """Path of the first of `BROWSERS` that is installed; raise `ReportError` where none is."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise ReportError(NO_BROWSER)
    return found
