"""``labkit report``: a notebook or Markdown as a page of HTML and a PDF."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from labkit.course.report import ReportError, read_report, render, write_pdf
from labkit.errors import WriteError
from labkit.files import atomic_write, refuse_unwritable

HELP = "write a report as HTML and PDF"
DESCRIPTION = """\
Run a report from its first cell to its last, and write it as one page of HTML and as a PDF:
text, tables, figures and formulas, without the code. REPORT is a notebook (.ipynb) or
Markdown (.md). Its pictures lie in its folder or below; they go into the page.
notebooks/report_template.ipynb is one to start from."""
PAGES = 2  # what the lesson allows


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("report", metavar="REPORT", help="a notebook or Markdown")
    parser.add_argument("--out", metavar="NAME", help="NAME.html and NAME.pdf (as REPORT's name)")
    parser.add_argument("--html-only", action="store_true", help="no PDF, which needs Chromium")
    parser.add_argument("--as-is", action="store_true", help="do not run the notebook first")


def run(args: argparse.Namespace) -> int:
    """Write the files; status 1 where there are more pages than two."""
    source = Path(args.report)
    if os.path.isdir(source):
        raise ReportError(f"{source}: is a directory; name a notebook or Markdown in it")
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
    if args.html_only:
        return 0
    count = write_pdf(html, pdf)
    print(f"{pdf}: {count} page{'' if count == 1 else 's'}")
    if count > PAGES:
        print(f"That is more than {PAGES} pages: leave out what your reader would not miss.")
        return 1
    return 0
