"""What is handed in beside the assignment: chapters and a report, as the students' page asks."""

import ast
from collections import defaultdict
from pathlib import Path

import nbformat
import pytest

from labkit.course.authoring.notebook import notebook_text
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Limits
from labkit.course.grading.extraction.extract import extract
from labkit.course.grading.judging.grade import grade_submission
from labkit.course.grading.sandbox.host import open_sandbox

NOTEBOOKS = Path(__file__).parents[4] / "notebooks"
CHAPTERS = {path.name: path.read_bytes() for path in sorted(NOTEBOOKS.glob("0*.ipynb"))}
REPORT = (NOTEBOOKS / "report_template.ipynb").read_bytes()


def sources(text):
    """The code cells of a notebook."""
    cells = nbformat.reads(text, as_version=4).cells
    return [cell.source for cell in cells if cell.cell_type == "code"]


@pytest.mark.slow
def test_chapters_and_report_beside_the_solved_assignment_change_nothing():
    """Buys that who hands in what the page asks for gets the points of the assignment alone."""
    assignment = load_assignment()
    functions = {question.id: question.function for question in assignment.questions}
    solved = notebook_text(solutions=True).encode()
    below = {f"notebooks/{name}": data for name, data in CHAPTERS.items()}
    with open_sandbox("auto", Limits(seconds=5.0)) as sandbox:
        for others in ({}, CHAPTERS, below, {"my_report.ipynb": REPORT}):
            for name in ("0.ipynb", "assignment.ipynb", "zoe.ipynb"):
                files = dict(sorted({name: solved, **others}.items()))
                found = extract(files, functions)
                verdict = grade_submission(found.cells, sandbox, assignment, "ada")
                assert verdict.score == 100.0, (name, list(others))
                assert found.notes == ()


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
