"""What a solution is, and how it is taken out of a notebook.

Three marks, the first two those of nbgrader and nbconvert:

- in a code cell, all from a line ``### BEGIN SOLUTION`` to the line ``### END SOLUTION``;
- a whole cell with the tag ``solution``;
- a Markdown cell that nbgrader's metadata call a solution (an answer marked by hand).

Cells with the tag ``remove-cell`` go as well: they assert what the text claims, and would tell.
A directive ``{solution}``, or a box titled "Solution", in a cell without the tag is refused.

The first leaves nbgrader's stub behind and keeps the cell's metadata, so that what comes
out is what ``nbgrader generate_assignment`` would hand out; but a cell that was folded to hide
its solution is open, as there is something to write. The answers to the checks of
understanding are no solutions: they are there to be opened. nbgrader's hidden tests go as well.
"""

from __future__ import annotations

import re

from nbformat import NotebookNode

BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"
TAG = "solution"
CLAIMS = "remove-cell"
FOLDED = "hide-input"
CODE_STUB = ("# YOUR CODE HERE", "raise NotImplementedError()")
TEXT_STUB = "YOUR ANSWER HERE"

_REGION = re.compile(rf"(?m)^([ \t]*){BEGIN}\n((?:.*\n)*?)[ \t]*{END}$")
HIDDEN_TESTS = re.compile(r"(?ms)^### BEGIN HIDDEN TESTS\n.*?^### END HIDDEN TESTS\n?")
_UNTAGGED = re.compile(r"(?im)^.*(?::::|```)\{(?:solution|(?:dropdown|admonition)\} *solution).*$")


class SolutionMarkError(ValueError):
    """A mark that is not understood: stripping on would hand out a solution, or lose a text."""


def strip_notebook(notebook: NotebookNode, name: str) -> tuple[NotebookNode, list[str]]:
    r"""Take the solutions and all outputs out of a notebook (of format 4), in place.

    `name` is what messages call it. Returns the notebook and each text that was taken out; a mark
    without its partner or its tag raises `SolutionMarkError`.

    Examples
    --------
    >>> from nbformat.v4 import new_code_cell, new_notebook
    >>> code = "def f(x):\n    ### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION"
    >>> left, taken = strip_notebook(new_notebook(cells=[new_code_cell(code)]), "a.ipynb")
    >>> print(left.cells[0].source)
    def f(x):
        # YOUR CODE HERE
        raise NotImplementedError()
    >>> taken
    ['    return 2 * x\n']
    """
    taken: list[str] = []
    for number, cell in enumerate(notebook.cells, start=1):
        place = f"{name}, cell {number}"
        if TAG in cell.metadata.get("tags", []):
            taken.append(cell.source)
        elif cell.cell_type == "code":
            cell.source, regions = _strip_code(cell.source, place)
            taken += regions
            if regions:
                _unfold(cell)
                # its checks fail until they are answered, so the book does not run it
                notebook.metadata.setdefault("mystnb", {})["execution_mode"] = "off"
        elif cell.metadata.get("nbgrader", {}).get("solution", False):
            taken.append(cell.source)
            cell.source = TEXT_STUB
        else:
            refuse_untagged(cell.source, place)
    notebook.cells = [
        cell
        for cell in notebook.cells
        if cell.source.strip() and not {TAG, CLAIMS} & set(cell.metadata.get("tags", []))
    ]
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    notebook.metadata.pop("widgets", None)  # what JupyterLab saved of them
    return notebook, taken


def refuse_untagged(markdown: str, name: str) -> None:
    """Raise where a page, or a cell without the tag, holds a solution."""
    if directive := _UNTAGGED.search(markdown):
        raise SolutionMarkError(
            f"{name}: {directive[0].strip()!r} needs a cell of a notebook, with the tag `{TAG}`"
        )


def _strip_code(source: str, place: str) -> tuple[str, list[str]]:
    """Put a stub for each marked region, and take out nbgrader's hidden tests."""
    source = HIDDEN_TESTS.sub("", source).rstrip("\n")
    taken = [solution for _, solution in _REGION.findall(source)]

    def stub(region: re.Match[str]) -> str:
        return "\n".join(region[1] + line for line in CODE_STUB)

    stripped = _REGION.sub(stub, source)
    for part in (stripped, *taken):
        if mark := re.search(f"{BEGIN}|{END}", part):
            raise SolutionMarkError(f"{place}: {mark[0]!r} stands without its partner")
    return stripped, taken


def _unfold(cell: NotebookNode) -> None:
    """Show a cell's code, in the page and in JupyterLab."""
    if "tags" in cell.metadata:
        cell.metadata.tags = [tag for tag in cell.metadata.tags if tag != FOLDED]
    cell.metadata.get("jupyter", {}).pop("source_hidden", None)
