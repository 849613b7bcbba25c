"""An instructor's commands: two small questions with a secret, from their text to a verdict."""

import json
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import labkit
from labkit.course.authoring import __main__ as command
from labkit.course.authoring.entries import question
from labkit.course.authoring.write import write_assignment
from labkit.course.exercises.checking import judge_function
from labkit.course.exercises.entries import ENTRIES
from labkit.grading.questions import Answer, cases_beside, read_assignment


def whole(low, high):
    return lambda rng: (np.sort(rng.integers(low, high, 4)) + 0.3 * np.arange(4),)


def asked():
    """Two questions as an author writes them; mistakes hang on the draw, and on a rounding."""
    for name in ("double", "double_sum"):
        ENTRIES.pop(name, None)

    @question(
        "Double it", points=2, answer=Answer.VECTOR, chapter="chapter 1", task="Double it.",
        oracle=lambda x: x + x, visible={"four numbers": (np.array([1.0, 2.5, 13.0, 24.5]),)},
        hidden={"small ones": whole(1, 9), "large ones": whole(20, 90), "odd": whole(1, 2)},
        mistakes={
            "cut_off": ("Beyond 10 it stays.", lambda x: np.where(x < 10, 2 * x, x)),
            "if_even": ("Odd ones count, too.", lambda x: x if round(x[0]) % 2 else 2 * x),
            "by_luck": ("It is drawn.", lambda x: 2 * x + np.sin(1e12 * x)),
        },
    )  # fmt: skip
    def double(x):
        """Twice x."""
        return 2 * x

    @question(
        "Double the sum", points=3, answer=Answer.NUMBER, chapter="chapter 2", task="Double, add.",
        oracle=lambda x: 2 * x.sum(), visible={"four numbers": (np.array([1.0, 2.5, 3.0, 4.5]),)},
        hidden={"small ones": whole(1, 9)},
        mistakes={"not_doubled": ("It is not doubled.", {"double(x)": "x"})},
    )  # fmt: skip
    def double_sum(x):
        """Twice the sum of x."""
        return double(x).sum()

    double_sum.__globals__["double"] = double
    return ENTRIES["double"], ENTRIES["double_sum"]


@pytest.fixture
def run(tmp_path, monkeypatch):
    """The author's command on the two questions, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "umask", lambda mask: None)

    def run(*arguments):
        small = {"questions": asked()}
        monkeypatch.setattr(command, "write_assignment", partial(write_assignment, **small))
        return command.main(list(arguments))

    yield run
    for name in ("double", "double_sum"):
        ENTRIES.pop(name, None)
    globals().pop("double", None)


def test_a_secret_draws_cases_of_its_own(run, capsys):
    read = {}
    for secret in ("a", "b"):
        Path(secret).write_text(secret * 32)
        assert run("--secret", secret, "--notebook", "own.ipynb") == 0
        read[secret] = read_assignment(cases_beside(secret))
    assert "wrote own.ipynb" in capsys.readouterr().out

    one, other = (each.hidden["double"] for each in read.values())

    assert not read["a"].public
    assert repr([case.arguments for case in one]) != repr([case.arguments for case in other])
    assert all("by_luck" not in case.mistaken for case in (*one, *other))
    assert all("cut_off" in case.mistaken for case in (*one, *other))


def test_what_was_written_grades(run):
    assert (
        run("--secret", "course.secret", "--notebook", "own.ipynb", "--solutions", "all.ipynb") == 0
    )
    assignment = read_assignment(cases_beside("course.secret"))
    names = {"np": np}
    exec(assignment.source_to_lend("double_sum"), names)
    scores = {
        "right": names["double_sum"],
        "not doubled": np.sum,
        "doubled twice": lambda x: 4 * x.sum(),
        "nonsense": lambda x: 7.0,
    }
    cases = assignment.cases("double_sum")
    told = {
        name: judge_function(assignment.question("double_sum"), cases, function)
        for name, function in scores.items()
    }
    assert {name: one.score for name, one in told.items()} == {
        "right": 3.0, "not doubled": 0.0, "doubled twice": 0.0, "nonsense": 0.0,
    }  # fmt: skip
    assert "twice as large as it should be" in told["doubled twice"].message
    for path, has_answers in (("own.ipynb", False), ("all.ipynb", True)):
        text = Path(path).read_text("utf-8")
        assert ("return 2 * x" in text) == has_answers
        cells = json.loads(text)["cells"]
        assert "| **together** | **5** |" in "".join("".join(cell["source"]) for cell in cells)


def test_the_students_notebook_keeps_what_stands_around_the_questions(run):
    run("--secret", "course.secret", "--notebook", "own.ipynb")
    first = json.loads(Path("own.ipynb").read_text("utf-8"))
    first["cells"].insert(0, {"cell_type": "markdown", "id": "a", "metadata": {}, "source": ["Hi"]})
    first["cells"].append({"cell_type": "markdown", "id": "z", "metadata": {}, "source": ["Bye"]})
    Path("own.ipynb").write_text(json.dumps(first), "utf-8")
    run("--secret", "course.secret", "--notebook", "own.ipynb")
    assert json.loads(Path("own.ipynb").read_text("utf-8"))["cells"] == first["cells"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--notebook", "nowhere/a.ipynb"), "cannot write nowhere/a.ipynb"),
        (("--secret", "short"), "short holds 3 bytes, a secret needs 16"),
        (("--secret", "s", "--notebook", "short"), "short is no notebook"),
    ],
)
def test_what_an_author_gets_wrong_is_said_in_one_line(run, capsys, arguments, message):
    Path("short").write_text("abc")
    assert run(*arguments) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1


def test_the_command_needs_no_more_than_the_package_does(tmp_path):
    """As from a wheel: a copy of labkit alone, in an empty folder, without nbformat."""
    shutil.copytree(Path(labkit.__file__).parent, tmp_path / "labkit")
    block = "import sys; sys.modules |= dict.fromkeys(['nbformat', 'nbconvert', 'IPython']);"
    code = f"{block} from labkit.course.authoring.__main__ import main; main(['--help'])"
    command, env = [sys.executable, "-P", "-c", code], os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        command, cwd=tmp_path, env=env, check=False, capture_output=True, text=True
    )
    assert "--secret FILE" in done.stdout, done.stderr
