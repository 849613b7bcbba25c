"""What is handed in beside the assignment: chapters and a report, as the students' page asks."""

import ast
from collections import defaultdict
from pathlib import Path

import nbformat

from labkit.authoring.notebook import notebook_text

NOTEBOOKS = Path(__file__).parents[3] / "notebooks"
CHAPTERS = {path.name: path.read_bytes() for path in sorted(NOTEBOOKS.glob("0*.ipynb"))}


def sources(text):
    """The code cells of a notebook."""
    cells = nbformat.reads(text, as_version=4).cells
    return [cell.source for cell in cells if cell.cell_type == "code"]


def test_functions_of_one_name_have_the_same_parameters():
    """Chapter 9 once asked for a `best_translation` of four parameters, the assignment of three."""
    texts = [data.decode() for data in CHAPTERS.values()] + [notebook_text()]
    parameters = defaultdict(set)
    for source in (source for text in texts for source in sources(text)):
        if "### BEGIN SOLUTION" in source or "# YOUR CODE HERE" in source:
            for node in ast.parse(source).body:
                if isinstance(node, ast.FunctionDef):
                    parameters[node.name].add(ast.unparse(node.args))
    assert len(parameters) > 17
    assert {name: kinds for name, kinds in parameters.items() if len(kinds) > 1} == {}
