"""``labkit report``: a notebook or Markdown as a page of HTML and a PDF.

nbclient runs the notebook, nbconvert writes it, and Chromium or one of its kin prints it.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import warnings
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from labkit.support import extras
from labkit.support.errors import LabkitError, WriteError
from labkit.support.files import atomic_write, refuse_unwritable

HELP = "write a report as HTML and PDF"
DESCRIPTION = """\
Run a report from its first cell to its last, and write it as one page of HTML and as a PDF:
text, tables, figures and formulas, without the code. REPORT is a notebook (.ipynb) or
Markdown (.md). Its pictures lie in its folder or below; they go into the page. MathJax draws
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
    """Add the arguments of the command."""
    parser.add_argument("report", metavar="REPORT", help="a notebook or Markdown")
    parser.add_argument("--out", metavar="NAME", help="NAME.html and NAME.pdf (as REPORT's name)")
    parser.add_argument("--html-only", action="store_true", help="no PDF, which needs Chromium")
    parser.add_argument("--as-is", action="store_true", help="do not run the notebook first")


def run(args: argparse.Namespace) -> int:
    """Write the files."""
    source = Path(args.report)
    if os.path.isdir(source):
        raise LabkitError(f"{source}: is a directory; name a notebook or Markdown in it")
    stem = Path(args.out) if args.out else source.with_suffix("")
    if args.out and os.path.isdir(stem):
        raise WriteError(f"cannot write {stem}: it is a directory; name a file in it")
    page, pdf = stem.with_name(stem.name + ".html"), stem.with_name(stem.name + ".pdf")
    for path in [page] if args.html_only else [page, pdf]:
        refuse_unwritable(path)
    html = render(read_report(source, run=not args.as_is), source.resolve().parent)
    with atomic_write(page) as file:
        file.write(html)
    print(f"{page}")
    if not args.html_only:
        with atomic_write(pdf, "wb") as file:
            file.write(printed(page))
        print(f"{pdf}")
    return 0


def read_report(path: str | Path, *, run: bool = True) -> Any:
    """Read a notebook, and run it in its folder, so that no number is older than its code.

    A ``.md`` becomes a notebook of one cell of text.

    Raises
    ------
    LabkitError
        For another file, a cell that fails (with its number and its error), or a kernel that is
        not installed or dies.
    """
    nbformat, source = need("nbformat"), Path(path)
    if source.suffix not in (".ipynb", ".md"):
        raise LabkitError(f"{path}: a report is a notebook (.ipynb) or Markdown (.md)")
    try:
        text = source.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise LabkitError(f"{path}: cannot be read: {reason}") from error
    if source.suffix == ".md":
        return nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(text)])
    try:
        notebook = nbformat.reads(text, as_version=4)
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise LabkitError(f"{path}: is no notebook: {error}") from error
    if run:
        _execute(notebook, source)
    return notebook


def _execute(notebook: Any, source: Path) -> None:
    """Run a notebook in its file's folder; its outputs replace those that it had."""
    reached = [0]
    client = need("nbclient").NotebookClient(
        notebook,
        timeout=TIMEOUT,
        resources={"metadata": {"path": str(source.resolve().parent)}},
        on_cell_start=lambda cell, cell_index: reached.append(cell_index + 1),
    )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the kernel's own machinery
            client.execute(stderr=subprocess.DEVNULL)
    except Exception as error:  # of the cell, or of a kernel that dies, hangs or is not there
        problem = getattr(error, "ename", type(error).__name__)
        message = getattr(error, "evalue", None) or str(error).strip().partition("\n")[0]
        raise LabkitError(f"{source}: cell {reached[-1]}: {problem}: {message}") from error


def render(notebook: Any, folder: str | Path = ".") -> str:
    """Write a notebook as nbconvert's page of HTML, without code, with its pictures in `folder`."""
    exporter = need("nbconvert").HTMLExporter(
        exclude_input=True, exclude_output_prompt=True, embed_images=True
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
