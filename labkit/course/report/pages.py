"""``labkit report``: a notebook or Markdown as a page of HTML and a PDF.

nbclient runs the notebook, nbconvert writes it, and Chromium or one of its kin prints it.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import warnings
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from labkit.support import extras
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write, refuse_unwritable

HELP = "write a report as HTML and PDF"
DESCRIPTION = """\
Run a report from its first cell to its last, and write it as one page of HTML and as a PDF
beside it: text, tables, figures and formulas, without the code. REPORT is a notebook (.ipynb)
or Markdown (.md). Its pictures lie in its folder or below; they go into the page. MathJax draws
the formulas, from the network.
notebooks/report_template.ipynb is one to start from."""
TIMEOUT = 300  # seconds for one cell
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
PAPER = "<style>@page { size: A4; margin: 18mm } @media print { body { zoom: 0.8 } }</style>"
PATIENCE = 120  # seconds for the browser

need = partial(extras.need, purpose="a report", extra="report")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument of the command."""
    parser.add_argument("report", metavar="REPORT", help="a notebook or Markdown")


def run(args: argparse.Namespace) -> int:
    """Write the files."""
    source = Path(args.report)
    if source.suffix not in (".ipynb", ".md"):
        raise LabkitError(f"{source}: a report is a notebook (.ipynb) or Markdown (.md)")
    page, pdf = source.with_suffix(".html"), source.with_suffix(".pdf")
    for path in (page, pdf):
        refuse_unwritable(path)
    html = render(read_report(source), source.resolve().parent)
    with atomic_write(page) as file:
        file.write(html)
    print(f"{page}")
    with atomic_write(pdf, "wb") as file:
        file.write(printed(page))
    print(f"{pdf}")
    return 0


def read_report(source: Path) -> Any:
    """Read a notebook, and run it in its folder, so that no number is older than its code.

    A ``.md`` becomes a notebook of one cell of text.

    Raises
    ------
    LabkitError
        For a damaged file, a cell that fails (with its number and its error), or a kernel that is
        not installed or dies.
    """
    nbformat, client = need("nbformat"), need("nbclient")
    try:
        text = source.read_text("utf-8-sig")
        if source.suffix == ".md":
            return nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(text)])
        notebook = nbformat.reads(text, as_version=4)
    except Exception as error:  # whatever a damaged file makes the reader raise
        reason = getattr(error, "strerror", None) or f"it is damaged: {error}"
        raise LabkitError(f"{source}: cannot be read: {reason}") from error
    reached = [0]
    runner = client.NotebookClient(
        notebook,
        timeout=TIMEOUT,
        resources={"metadata": {"path": str(source.resolve().parent)}},
        on_cell_start=lambda cell, cell_index: reached.append(cell_index + 1),
    )
    try:
        with warnings.catch_warnings(action="ignore"):  # of the kernel's own machinery
            runner.execute(stderr=subprocess.DEVNULL)
    except Exception as error:  # of the cell, or of a kernel that dies, hangs or is not there
        problem = getattr(error, "ename", type(error).__name__)
        message = getattr(error, "evalue", None) or str(error).strip().partition("\n")[0]
        raise LabkitError(f"{source}: cell {reached[-1]}: {problem}: {message}") from error
    return notebook


def render(notebook: Any, folder: Path) -> str:
    """Write a notebook as nbconvert's page of HTML, without code, with its pictures in `folder`."""
    exporter = need("nbconvert").HTMLExporter(
        exclude_input=True,
        exclude_input_prompt=True,  # also the room for it beside the text
        exclude_output_prompt=True,
        embed_images=True,
    )
    body, _ = exporter.from_notebook_node(
        notebook, resources={"metadata": {"path": str(folder), "name": "Report"}}
    )
    return str(body) + PAPER


def printed(page: Path) -> bytes:
    """The PDF that a browser prints of a page.

    Raises
    ------
    LabkitError
        If there is no browser: with the one to install. If it prints nothing: with its words.
    """
    browser = find_browser()
    with TemporaryDirectory() as name:
        pdf = Path(name, "page.pdf")
        command = [browser, *QUIET, DRAWN, f"--user-data-dir={name}", "--no-pdf-header-footer"]
        command += [f"--print-to-pdf={pdf}", page.resolve().as_uri()]
        told = subprocess.run(command, capture_output=True, check=False, timeout=PATIENCE).stderr
        if not pdf.is_file():
            raise LabkitError(f"{browser} printed nothing: {told.decode(errors='replace')[-300:]}")
        return pdf.read_bytes()


def find_browser() -> str:
    """Path of the first of `BROWSERS` that is installed; raise `LabkitError` where none is."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise LabkitError(NO_BROWSER)
    return found
