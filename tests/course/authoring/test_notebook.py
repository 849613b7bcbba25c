"""The handed-out notebook: as generated, valid, without solutions; and with them, right."""

import doctest
import json

import nbformat
import pytest

from labkit.course.authoring.write import HANDED_OUT, notebook_text

STUB = "    # YOUR CODE HERE\n    raise NotImplementedError"


def code(notebook, kind):
    """The code cells of one kind, by nbgrader's id: "solution" or "grade"."""
    cells = (cell for cell in notebook.cells if cell.cell_type == "code")
    marks = ((cell.metadata.get("nbgrader", {}), cell) for cell in cells)
    return {mark["grade_id"]: cell.source for mark, cell in marks if mark.get(kind)}


@pytest.fixture(scope="module")
def solved():
    return nbformat.reads(notebook_text(solutions=True), as_version=4)


@pytest.fixture(scope="module")
def handed_out():
    return nbformat.read(HANDED_OUT, as_version=4)


def test_the_committed_notebook_is_the_generated_one():
    assert HANDED_OUT.read_text("utf-8") == notebook_text()


def test_nbgraders_metadata_is_complete(handed_out, solved, assignment):
    for notebook in (handed_out, solved):
        nbformat.validate(notebook)
        marks = [
            cell.metadata["nbgrader"] for cell in notebook.cells if "nbgrader" in cell.metadata
        ]
        cells = 3 * len(assignment.questions) + 2  # and two answers in words
        assert len({mark["grade_id"] for mark in marks}) == len(marks) == cells
        for mark in marks:
            assert mark["schema_version"] == 3
            assert {"grade", "locked", "solution", "task"} <= mark.keys()
            assert mark["locked"] != mark["solution"]
            assert ("points" in mark) == mark["grade"]
        assert sum(mark.get("points", 0) for mark in marks) == assignment.points


def test_a_stub_is_the_solution_without_its_body(handed_out, solved):
    """And no line of a solution that is longer than a name stands elsewhere."""
    text, stubs = HANDED_OUT.read_text("utf-8"), code(handed_out, "solution")
    assert "SOLUTION" not in text
    assert "HIDDEN" not in text
    for name, source in code(solved, "solution").items():
        head, _, rest = source.partition("    ### BEGIN SOLUTION\n")
        body, _, after = rest.partition("    ### END SOLUTION")
        assert (stubs[name], after) == (head + STUB, "")
        lines = [line.strip() for line in body.splitlines() if len(line.strip()) > 12]
        assert lines
        assert not [line for line in lines if json.dumps(line)[1:-1] in text]


def test_the_solutions_pass_their_own_checks_from_top_to_bottom(solved, assignment):
    """Each where it stands: none calls a function of a later cell. So do the stubs' examples."""
    names, points = {}, 0.0
    exec(solved.cells[1].source, names)
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    for cell in solved.cells:
        mark = cell.metadata.get("nbgrader", {}) if cell.cell_type == "code" else {}
        if mark.get("solution"):
            exec(cell.source, names)
            name = cell.source.partition("(")[0].removeprefix("def ")
            assert ">>> " in names[name].__doc__
            runner.run(parser.get_doctest(names[name].__doc__, dict(names), name, None, 0))
        if mark.get("grade"):
            first, begin, load, score, end = cell.source.splitlines()
            assert (begin, end) == ("### BEGIN HIDDEN TESTS", "### END HIDDEN TESTS")
            assert eval(first, names).passed
            exec(load, names)
            assert eval(score, names) == mark["points"]
            points += mark["points"]
    assert points == assignment.points
    assert runner.summarize(verbose=False).failed == 0


def test_the_last_cells_run_what_the_student_wrote(solved, handed_out):
    """An empty notebook is told what is missing; a solved one drives, here over a few scans."""
    for notebook, ready in ((handed_out, False), (solved, True)):
        names = {}
        for cell in notebook.cells:
            mark = cell.metadata.get("nbgrader", {})
            if cell.cell_type == "code" and (mark.get("solution") or not mark):
                source = cell.source.replace("%matplotlib inline", "").replace("200, 3", "8, 6")
                exec(source, names)
        assert names["missing"] == [] if ready else "icp" in names["missing"]
    assert len(names["path"]) == len(names["wheel_path"]) == 8
    assert len(names["figure"].axes) == 2
