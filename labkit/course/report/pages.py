"""From a notebook, or a page of Markdown, to one file of HTML that needs no network."""

from __future__ import annotations

import base64
import copy
import html
import mimetypes
import os
import re
import subprocess
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from labkit import extras
from labkit.errors import LabkitError

TIMEOUT = 300  # seconds for one cell
PLACE = "labkit_place"  # in a cell's metadata: the file and the cell, for a message
PREFERRED = ("image/svg+xml", "image/png", "image/jpeg")  # sharp before small
STYLE = Path(__file__).with_name("page.css")


class ReportError(LabkitError):
    """A report that cannot be made; the message says why and what to do."""


need = partial(extras.need, purpose="a report", extra="report")


def read_report(path: str | Path, *, run: bool = True) -> Any:
    """A report as a notebook, freshly run.

    Parameters
    ----------
    path : path-like
        An ``.ipynb``, or a ``.md``, which becomes a notebook of one cell of text.
    run : bool
        Run the notebook from the first cell to the last, in its folder, so that no number
        in the report is older than the code beside it.

    Returns
    -------
    nbformat.NotebookNode

    Raises
    ------
    ReportError
        For a file that is neither, a cell that fails (with its number and its error), or a
        kernel that is not installed or dies.
    """
    nbformat = need("nbformat")
    source = Path(path)
    if source.suffix not in (".ipynb", ".md"):
        raise ReportError(f"{path}: a report is a notebook (.ipynb) or Markdown (.md)")
    try:
        text = source.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise ReportError(f"{path}: cannot be read: {reason}") from error
    if source.suffix == ".md":
        cell = nbformat.v4.new_markdown_cell(_without_front_matter(text))
        cell.metadata[PLACE] = str(path)
        return nbformat.v4.new_notebook(cells=[cell])
    try:
        notebook = nbformat.reads(text, as_version=4)
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise ReportError(f"{path}: is no notebook: {error}") from error
    for number, cell in enumerate(notebook.cells, start=1):
        cell.metadata[PLACE] = f"{path}: cell {number}"
    if run:
        _execute(notebook, source)
    return notebook


def _execute(notebook: Any, source: Path) -> None:
    """Run a notebook in its file's folder; its outputs replace those that it had."""
    nbclient = need("nbclient")
    places = [str(source)]  # of what was started; the last one is where it ended

    def begin(cell: Any, cell_index: int) -> None:
        places.append(cell.metadata[PLACE])

    client = nbclient.NotebookClient(
        notebook,
        timeout=TIMEOUT,
        resources={"metadata": {"path": str(source.resolve().parent)}},
        on_cell_start=begin,
    )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the kernel's own machinery
            client.execute(stderr=subprocess.DEVNULL)
    except nbclient.exceptions.CellExecutionError as error:
        raise ReportError(f"{places[-1]}: {error.ename}: {error.evalue}") from error
    except nbclient.exceptions.CellTimeoutError as error:
        raise ReportError(f"{places[-1]}: ran for more than {TIMEOUT} s") from error
    except nbclient.exceptions.DeadKernelError as error:
        raise ReportError(
            f"{places[-1]}: the kernel died while it ran; look for a call that ends Python, "
            "or for more memory than there is"
        ) from error
    except need("jupyter_client.kernelspec").NoSuchKernel as error:
        raise ReportError(
            f"{source}: asks for the kernel {error.name!r}, which is not installed here; choose "
            "another in JupyterLab (Kernel, Change Kernel) and save, or do not run it: `--as-is`"
        ) from error


def render(notebook: Any, folder: str | Path = ".") -> str:
    """A notebook as one page of HTML: text, tables, figures and formulas, without its code.

    Parameters
    ----------
    notebook : nbformat.NotebookNode
        From `read_report`.
    folder : path-like
        Where the pictures lie that its text names; they go into the page.

    Returns
    -------
    str
        Nothing in it asks the network.

    Raises
    ------
    ReportError
        For a formula that cannot be read, or a picture that cannot go into the page: with
        its file and its cell.
    """
    jinja2, nbconvert = need("jinja2"), need("nbconvert")
    renderer = need("nbconvert.filters.markdown_mistune")

    class Writer(renderer.IPythonRenderer):  # type: ignore[misc, name-defined]
        """Writes formulas as MathML, which needs no script, and pictures into the page."""

        def inline_math(self, body: str) -> str:
            return _mathml(body, "inline")

        def block_math(self, body: str) -> str:
            return _mathml(body, "block")

        def latex_environment(self, name: str, body: str) -> str:
            return _mathml(rf"\begin{{{name}}}{body}\end{{{name}}}", "block")

        def _src_to_base64(self, src: str) -> str:
            return embedded(src, folder, self.attachments)

        _embed_image_or_attachment = _src_to_base64

    @jinja2.pass_context  # type: ignore[untyped-decorator]
    def to_html(context: Any, text: str) -> str:
        attachments = context["cell"].get("attachments", {})
        settings = {"escape": False, "embed_images": True, "attachments": attachments}
        writer = Writer(**settings, exclude_anchor_links=True)
        with _at(context["cell"]):
            return str(renderer.MarkdownWithMath(renderer=writer).render(text))

    notebook = copy.deepcopy(notebook)
    for cell in notebook.cells:
        words = cell.metadata.get("mystnb", {}).get("image", {}).get("alt")
        for output in cell.get("outputs", []):
            if words and "image/png" in output.get("data", {}):
                output.metadata.setdefault("image/png", {})["alt"] = words
            if "data" in output:
                output["data"] = _formulas_as_text(output.data)
            if "text/html" in output.get("data", {}):
                with _at(cell):
                    output.data["text/html"] = embed_in_html(output.data["text/html"], folder)
    exporter = nbconvert.HTMLExporter(template_name="basic", exclude_input=True)
    exporter.exclude_output_prompt = True
    exporter.register_filter("markdown2html", to_html)
    body, _ = exporter.from_notebook_node(notebook)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(_title(notebook))}</title>\n"
        f"<style>\n{STYLE.read_text('utf-8')}</style>\n</head>\n<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


@contextmanager
def _at(cell: Any) -> Iterator[None]:
    """Put a cell's place before the message of what cannot be rendered in it."""
    try:
        yield
    except ReportError as error:
        raise ReportError(f"{cell.metadata.get(PLACE, 'the notebook')}: {error}") from error


def _formulas_as_text(data: Any) -> Any:
    """An output's LaTeX as Markdown, whose formulas become MathML; better kinds stay."""
    if "text/latex" not in data or {"text/html", "text/markdown", "image/svg+xml"} & set(data):
        return data
    line = " ".join(data["text/latex"].split())  # a list or a heading in Markdown starts a line
    text = re.sub(r"(?<!\\)\\[()]", "$", re.sub(r"(?<!\\)\\[\[\]]", "$$", line))
    return {"text/markdown": text}


def _title(notebook: Any) -> str:
    """The first heading of its text; a ``#`` in code is a comment."""
    texts = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    code = re.compile(r"^(```|~~~).*?^\1", re.MULTILINE | re.DOTALL)
    heading = re.search(r"^# (.+)$", code.sub("", "\n".join(texts)), re.MULTILINE)
    return heading[1] if heading else "Report"


def _mathml(formula: str, display: str) -> str:
    """A formula of LaTeX as MathML."""
    try:
        return str(need("latex2mathml.converter").convert(formula, display=display))
    except Exception as error:  # its errors have no common base, and some are of Python itself
        problem = f"{type(error).__name__} {error}".strip()
        raise ReportError(
            f"the formula ${formula}$ cannot be read ({problem}): "
            "look for a missing brace, bracket, index or \\end"
        ) from error


def _without_front_matter(text: str) -> str:
    return re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)


def embedded(address: str, folder: str | Path, attachments: Mapping[str, Mapping[str, str]]) -> str:
    """A picture's address as a data URL, which holds the picture itself.

    Parameters
    ----------
    address : str
        As the text has it: a path in the folder, ``attachment:name``, or a data URL.
    folder : path-like
        Where the report lies.
    attachments : mapping
        What was pasted into the cell: base64 by kind ("image/png") by name.

    Raises
    ------
    ReportError
        For a picture that is not there, or would have to come from the network.
    """
    if address.startswith("data:"):
        return address
    name = unquote(address)
    if name.startswith("attachment:"):
        return _attached(name.removeprefix("attachment:"), attachments)
    if re.match(r"[A-Za-z][\w+.-]+:|//", name):
        raise ReportError(
            f"the picture {name!r} lies on the network; save it beside the report and name the file"
        )
    base = os.path.abspath(folder)
    path = Path(os.path.abspath(os.path.join(base, name)))
    if not path.is_relative_to(base):
        raise ReportError(f"the picture {name!r} lies outside of {base}; copy it beside the report")
    kind = mimetypes.guess_type(path.name, strict=False)[0] or ""
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # a name may hold a NUL
        reason = getattr(error, "strerror", None) or error
        raise ReportError(f"the picture {name!r} cannot be read: {reason} ({path})") from error
    if not kind.startswith("image/"):
        raise ReportError(f"{name!r} is no picture that a page can show; use .png, .jpg or .svg")
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def embed_in_html(text: str, folder: str | Path) -> str:
    """HTML that a cell displays, with the pictures that it names as data URLs."""

    def replace(found: re.Match[str]) -> str:
        start, quote, address = found.groups()
        return f"{start}{quote}{embedded(html.unescape(address), folder, {})}{quote}"

    return re.sub(r"""(<img\b[^>]*?\ssrc=)(["'])(.*?)\2""", replace, text, flags=re.I | re.S)


def _attached(name: str, attachments: Mapping[str, Mapping[str, str]]) -> str:
    pictures = attachments.get(name)
    if not pictures:
        known = ", ".join(sorted(attachments)) or "nothing"
        raise ReportError(
            f"the picture {name!r} is not attached to the cell, which has {known}; paste it again"
        )
    kind = next((each for each in PREFERRED if each in pictures), next(iter(pictures)))
    return f"data:{kind};base64,{pictures[kind]}"
