"""The exercises of the chapters: stubs, solutions and known mistakes, each told from the others."""

from __future__ import annotations

import ast
import inspect
from copy import deepcopy
from pathlib import Path

import nbformat
import pytest
from IPython.core.inputtransformer2 import TransformerManager
from solutions import strip_notebook

from labkit.course.exercises import check, exercises
from tests.course.exercises.answers import RIGHT, WRONG

FOLDER = Path(__file__).parents[3] / "notebooks"
CHAPTERS = {path.name: nbformat.read(path, 4) for path in sorted(FOLDER.glob("[01]*.ipynb"))}
HANDED_OUT = {name: strip_notebook(deepcopy(each), name)[0] for name, each in CHAPTERS.items()}
EXERCISES = exercises()


def parse(source: str) -> ast.Module:
    return ast.parse(TransformerManager().transform_cell(source))


def functions(notebook: nbformat.NotebookNode, tag: str) -> dict[str, ast.FunctionDef]:
    """The functions of the cells with a tag and of nbgrader's answers; of several the last one."""
    tagged = [
        cell
        for cell in notebook.cells
        if cell.cell_type == "code"
        and (
            tag in cell.metadata.get("tags", [])
            or cell.metadata.get("nbgrader", {}).get("solution")
        )
    ]
    nodes = [node for cell in tagged for node in parse(cell.source).body]
    return {node.name: node for node in nodes if isinstance(node, ast.FunctionDef)}


def imports(notebook: nbformat.NotebookNode) -> dict[str, object]:
    """What the chapter's import cell brings; a solution may use nothing else."""
    first = next(cell for cell in notebook.cells if cell.cell_type == "code")
    kept = [n for n in parse(first.source).body if isinstance(n, ast.Import | ast.ImportFrom)]
    return run(ast.Module(kept, []), {})


def run(tree: ast.Module, names: dict[str, object]) -> dict[str, object]:
    exec(compile(tree, "a cell", "exec"), names)
    return names


STUBS = {
    name: (chapter, node)
    for chapter, notebook in HANDED_OUT.items()
    for name, node in functions(notebook, "stub").items()
}


def checked(name, function):
    """The feedback on a function, under the name that the exercise asks for."""

    def named(*arguments):
        return function(*arguments)

    named.__name__ = name
    return check(named)


def test_each_stub_has_its_exercise_and_each_exercise_its_stub():
    assert sorted(STUBS) == sorted(EXERCISES)


@pytest.mark.parametrize("name", STUBS)
def test_the_stub_does_not_pass_and_the_solution_in_the_notebook_does(name):
    chapter, node = STUBS[name]
    names = imports(CHAPTERS[chapter])
    feedback = check(run(ast.Module([node], []), dict(names))[name])
    assert not feedback.passed
    if "raise NotImplementedError" in ast.unparse(node):
        assert repr(feedback).startswith("○")
    else:  # a bug to be found, which has its name
        assert feedback.verdict.misconception
    solutions = list(functions(CHAPTERS[chapter], "solution").values())
    assert repr(check(run(ast.Module(solutions, []), names)[name])).startswith("✓")


@pytest.mark.parametrize("name", EXERCISES)
def test_each_known_mistake_is_called_by_its_own_name(name):
    """A mistake that passes, or that another one cannot be told from, is no mistake."""
    for mistake in EXERCISES[name].known:
        for function in EXERCISES[name].ways(mistake):
            verdict = checked(name, function).verdict
            assert (verdict.passed, verdict.misconception) == (False, mistake.id)


def test_wrong_answers_get_the_name_that_is_theirs_and_do_not_pass():
    """Each written in another way than the mistake that it is known by."""
    told = [(name, word, checked(name, function).verdict) for name, word, function in WRONG]
    assert [(name, word) for name, word, one in told if one.passed] == []
    named = [(name, word, one) for name, word, one in told if word]
    assert [(name, word) for name, word, one in named if word not in one.message] == []


@pytest.mark.parametrize("name", EXERCISES)
def test_a_function_that_keeps_its_defaults_does_not_pass(name):
    """Each argument with a default takes two values, or nobody would notice one left unused."""
    entry = EXERCISES[name]
    given = entry.visible() if callable(entry.visible) else entry.visible
    signature = inspect.signature(entry.right)
    calls = [signature.bind(*arguments).arguments for arguments in given.values()]
    for parameter in signature.parameters.values():
        if parameter.default is not parameter.empty:
            values = {call.get(parameter.name, parameter.default) for call in calls}
            assert len(values) >= 2, parameter


@pytest.mark.parametrize("name", EXERCISES)
def test_right_answers_in_other_styles_pass(name):
    for function in (function for other, function in RIGHT if other == name):
        feedback = checked(name, function)
        assert feedback.passed, repr(feedback)
