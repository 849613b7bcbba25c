"""A notebook, or a page of Markdown, as HTML: run by nbclient, written by nbconvert."""

from __future__ import annotations

import base64
import html
import io
import re
import subprocess
import warnings
from functools import partial
from pathlib import Path
from typing import Any

from labkit import extras
from labkit.errors import LabkitError

TIMEOUT = 300  # seconds for one cell
# Code as it is, or a formula: in lines of its own, or in a line, where no blank touches its marks.
FORMULA = re.compile(r"(?s)`[^`]*`|(?<![\\$])(\$\$)(.+?)\$\$|(?<![\\$])\$(?! )([^$`\n]+?)(?<! )\$")


class ReportError(LabkitError):
    """A report that cannot be made; the message says why and what to do."""


need = partial(extras.need, purpose="a report", extra="report")


def read_report(path: str | Path, *, run: bool = True) -> Any:
    """Read a notebook, and run it in its folder, so that no number is older than its code.

    A ``.md`` becomes a notebook of one cell of text.

    Raises
    ------
    ReportError
        For another file, a cell that fails (with its number and its error), or a kernel that is
        not installed or dies.
    """
    nbformat, source = need("nbformat"), Path(path)
    if source.suffix not in (".ipynb", ".md"):
        raise ReportError(f"{path}: a report is a notebook (.ipynb) or Markdown (.md)")
    try:
        text = source.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise ReportError(f"{path}: cannot be read: {reason}") from error
    if source.suffix == ".md":
        return nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(text)])
    try:
        notebook = nbformat.reads(text, as_version=4)
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise ReportError(f"{path}: is no notebook: {error}") from error
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
        raise ReportError(f"{source}: cell {reached[-1]}: {problem}: {message}") from error


def render(notebook: Any, folder: str | Path = ".") -> str:
    """Write a notebook as one page of HTML: text, tables, figures and formulas, no code.

    Pictures in `folder` that its text names go into the page. So do its formulas, as matplotlib
    draws them; one that matplotlib does not know is left to MathJax, from the network.
    """
    exporter = need("nbconvert").HTMLExporter(
        exclude_input=True, exclude_output_prompt=True, embed_images=True
    )
    markdown = need("jinja2").pass_context(
        lambda context, text: exporter.markdown2html(context, FORMULA.sub(_drawn, text))
    )
    exporter.register_filter("markdown2html", markdown)
    body, _ = exporter.from_notebook_node(
        notebook, resources={"metadata": {"path": str(folder), "name": "Report"}}
    )
    return str(body)


def _drawn(formula: re.Match[str]) -> str:
    """The picture of a formula; what is code, or no formula of matplotlib's, as it is."""
    block, tex = formula[1], formula[2] or formula[3]
    if not tex:
        return formula[0]
    picture, known = io.BytesIO(), re.sub(r"\\[lr]([Vv]ert)", r"\\\1", tex.strip())
    font = need("matplotlib.font_manager").FontProperties(size=11, math_fontfamily="stix")
    draw = need("matplotlib.mathtext").math_to_image
    try:
        depth = draw(f"${known}$", picture, prop=font, format="svg")
    except ValueError:
        return formula[0]
    data = base64.b64encode(picture.getvalue()).decode("ascii")
    style = "display: block; margin: 1em auto" if block else f"vertical-align: -{depth:.2f}pt"
    return f'<img alt="{html.escape(tex)}" style="{style}" src="data:image/svg+xml;base64,{data}">'
