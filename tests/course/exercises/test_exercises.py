"""The exercises of the chapters: stubs, solutions and known mistakes, each told from the others."""

from __future__ import annotations

import ast
import itertools
import re
from pathlib import Path

import nbformat
import pytest
from IPython.core.inputtransformer2 import TransformerManager

from labkit.course.exercises import Case, check, exercises
from labkit.course.exercises.exercise import Exercise
from labkit.errors import InvalidParameterError

FOLDER = Path(__file__).parents[3] / "notebooks"
CHAPTERS = {path.name: nbformat.read(path, 4) for path in sorted(FOLDER.glob("[01]*.ipynb"))}
EXERCISES = exercises()


def parse(source: str) -> ast.Module:
    return ast.parse(TransformerManager().transform_cell(source))


def functions(notebook: nbformat.NotebookNode, tag: str) -> dict[str, ast.FunctionDef]:
    """The functions that are defined in the cells with a tag; of several the last one."""
    tagged = [
        cell
        for cell in notebook.cells
        if cell.cell_type == "code" and tag in cell.metadata.get("tags", [])
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
    for chapter, notebook in CHAPTERS.items()
    for name, node in functions(notebook, "stub").items()
}
MISTAKES = [
    (each.name, says)
    for each in EXERCISES.values()
    for says in dict.fromkeys(says for case in each.cases() for says in case.mistakes)
]


def answering(name: str, answers: list[object]):
    """A function of that name whose calls return these answers, one after the other."""
    remaining = iter(answers)

    def answer(*arguments: object) -> object:
        return next(remaining)

    answer.__name__ = name
    return answer


def test_each_stub_has_its_cases_and_each_case_its_stub():
    assert sorted(STUBS) == sorted(EXERCISES)


@pytest.mark.parametrize("name", STUBS)
def test_the_stub_says_what_to_write_and_does_not_pass(name):
    chapter, node = STUBS[name]
    assert ast.get_docstring(node)
    stub = run(ast.Module([node], []), imports(CHAPTERS[chapter]))[name]
    feedback = check(stub)
    assert not feedback.passed
    if "raise NotImplementedError" in ast.unparse(node):
        assert repr(feedback).startswith("○")
    else:  # a bug to be found, which has its name
        assert feedback.verdict.misconception


@pytest.mark.parametrize("name", STUBS)
def test_the_solution_in_the_notebook_passes(name):
    chapter, _ = STUBS[name]
    notebook = CHAPTERS[chapter]
    solutions = list(functions(notebook, "solution").values())
    names = run(ast.Module(solutions, []), imports(notebook))
    assert repr(check(names[name])).startswith("✓")


@pytest.mark.parametrize("name", EXERCISES)
def test_every_exercise_knows_a_mistake(name):
    assert [each for each, _ in MISTAKES if each == name]


@pytest.mark.parametrize(("name", "says"), MISTAKES)
def test_a_known_mistake_is_called_by_its_name(name, says):
    cases = EXERCISES[name].cases()
    feedback = check(answering(name, [case.mistakes.get(says, case.right) for case in cases]))
    assert not feedback.passed
    assert feedback.verdict.misconception == says


@pytest.mark.parametrize("name", EXERCISES)
def test_the_cases_are_the_same_each_time(name):
    first, second = (list(EXERCISES[name].cases()) for _ in range(2))
    assert check(answering(name, [case.right for case in first])).passed
    assert len(first) == len(second)


TIME = re.compile(
    r"\*\*Time\.\*\* (\d+) min to read and try, (\d+) min of exercises\. Core path: (\d+) min"
)
HEAD = re.compile(r" .+ · [★☆]{3} · (\d+) min( · deeper)?")


def exercise_heads(cells: list[nbformat.NotebookNode]) -> list[str]:
    text = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return re.findall(r"(?m)^:+\{exercise\}(.*)$", text)


@pytest.mark.parametrize("chapter", CHAPTERS)
def test_an_exercise_with_a_stub_has_a_name_stars_and_minutes(chapter):
    cells = CHAPTERS[chapter].cells
    stubs = [i for i, cell in enumerate(cells) if "stub" in cell.metadata.get("tags", [])]
    heads = [exercise_heads(cells[:i])[-1] for i in stubs]
    assert [head for head in heads if not HEAD.fullmatch(head)] == []


OPENINGS = {
    name: "\n".join(cell.source for cell in notebook.cells[:6])  # a picture may come first
    for name, notebook in CHAPTERS.items()
}
TIMED = [name for name, text in OPENINGS.items() if TIME.search(text)]


@pytest.mark.parametrize("chapter", TIMED)
def test_the_minutes_of_a_chapter_are_the_sum_of_its_exercises(chapter):
    cells = CHAPTERS[chapter].cells
    reading, practice, core = map(int, TIME.search(OPENINGS[chapter]).groups())
    heads = [HEAD.fullmatch(head) for head in exercise_heads(cells)]
    assert sum(int(head[1]) for head in heads) == practice
    assert sum(int(head[1]) for head in heads if not head[2]) < core <= reading + practice


def test_the_first_page_says_the_core_minutes_of_each_chapter():
    page = (FOLDER.parent / "book" / "intro.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"notebooks/(\w+)\) \|.*\| (\d+)\smin \|", page))
    headers = {name: TIME.search(OPENINGS[name])[3] for name in TIMED}
    assert told == {name.removesuffix(".ipynb"): minutes for name, minutes in headers.items()}


# What is said of an answer


def one_case(right: object, **more: object) -> Exercise:
    return Exercise("f", "F", lambda: iter([Case("one", (1.0,), right, **more)]))


@pytest.mark.parametrize(
    ("right", "answer", "says"),
    [
        (2.0, lambda x: None, "for one it returns nothing; is the `return` missing?"),
        (2.0, lambda x: "two", "for one it returns a str, where numbers are expected."),
        (2.0, lambda x: [2.0, 2.0], "for one the result has shape (2,), expected ()."),
        (2.0, lambda x: 2.5, "for one the result is off by 0.5."),
        (2.0, lambda x: float("nan"), "for one the result holds NaN or infinity; look for"),
        ((1.0, 2.0), lambda x: 2.0, "for one it should return 2 values, as a tuple."),
        ((1.0, 2.0), lambda x: (1, 2.25), "for one the result is off by up to 0.25."),
        (2.0, lambda x: x.nothing, "for one it raises AttributeError: 'float' object has no"),
    ],
)
def test_a_wrong_answer_is_told_apart(monkeypatch, right, answer, says):
    monkeypatch.setitem(exercises(), "f", one_case(right))
    answer.__name__ = "f"
    feedback = check(answer)
    assert not feedback.passed
    assert feedback.verdict.cases[0].reason.startswith(says)


def test_a_function_may_change_its_arguments(monkeypatch):
    case = Case("a list", ([1, 2],), 2.0)
    monkeypatch.setitem(exercises(), "f", Exercise("f", "F", lambda: itertools.repeat(case, 2)))

    def f(numbers):
        return numbers.pop()

    assert check(f).passed


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (3, "`function` must be the function itself, as in check(turn_about), got int"),
        (len, "no exercise asks for a function named 'len'; leave the name as its stub has it"),
    ],
)
def test_what_is_no_exercise_is_refused(function, message):
    with pytest.raises(InvalidParameterError) as error:
        check(function)
    assert str(error.value) == message
