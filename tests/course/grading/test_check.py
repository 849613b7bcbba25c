"""`check` in a notebook: the verdict on the visible cases, shown inline."""

import html
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import labkit
from labkit.correspondences import overlap
from labkit.course.authoring import solution as right
from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.check import check, score
from labkit.errors import InvalidParameterError, LabkitError


def transposed(theta):
    return right.rotation(theta).T


def test_a_right_function_passes():
    feedback = check("rotation", right.rotation)
    assert feedback.passed
    assert repr(feedback) == "✓ Rotation: All cases pass."
    assert "<ul" not in feedback._repr_html_()


def test_a_warning_is_shown_and_costs_nothing_in_nbgrader(capsys):
    def warning(theta):
        print("RuntimeWarning: divide by zero", file=sys.stderr)
        return right.rotation(theta)

    assert check("rotation", warning).passed
    shown = capsys.readouterr()
    assert "RuntimeWarning" in shown.out
    assert shown.err == "", "nbgrader gives no point to a cell that writes to stderr"


def test_a_wrong_one_is_told_its_mistake():
    feedback = check("rotation", transposed)
    assert not feedback.passed
    assert feedback.verdict.misconception == "transposed"
    lines = repr(feedback).splitlines()
    assert lines[0].startswith("✗ Rotation: This looks like a known mistake: R is transposed")
    assert lines[1:] == [
        "  - A quarter turn: the rotation is off by 180°.",
        "  - A turn to the right: the rotation is off by 57°.",
    ]


def test_html_says_the_same_and_escapes_what_a_student_writes():
    def shouting(theta):
        raise ValueError("<script>alert(1)</script>")

    page = check("rotation", shouting)._repr_html_()
    assert "<script>" not in page
    text = html.unescape(re.sub(r"<[^>]+>", " ", page.replace("&lt;script", "script")))
    assert "it raised ValueError" in text
    assert f"(line {shouting.__code__.co_firstlineno + 1} of its cell)" in text


def test_only_visible_cases_are_asked_and_in_copies():
    seen = []

    def spoiling(source, target):
        seen.append(source.copy())
        answer = right.align(source, target)
        source[:] = 0.0
        return answer

    assert check("align", spoiling).passed
    assert check("align", spoiling).passed
    assert len(seen) == 2 * len(load_assignment().visible["align"])
    assert np.array_equal(seen[0], seen[2])


def test_no_expected_value_is_shown():
    """The verdict on zeros must not spell out the answers."""
    for question in load_assignment().questions:
        text = repr(check(question.id, lambda *_: 0.123456789))
        for case in load_assignment().visible[question.id]:
            for value in np.ravel(np.asarray(case.expected[0], dtype=object)):
                if isinstance(value, float) and value not in (0.0, 1.0) and value == value:
                    assert f"{value:.4f}" not in text


@pytest.mark.parametrize(
    ("returns", "reason"),
    [
        (object, "it returned an object; return numbers, arrays or tuples."),
        (lambda: (x for x in "ab"), "it returned a generator; return"),
        (lambda: 1j * np.eye(2), "it returned complex numbers; return real ones (`.real`?)."),
        (lambda: np.array([object()]), "are its rows of different length?\n"),
        (lambda: np.zeros(3_000_000), "far more data"),
        (lambda: None, "In every case it returned None (is a `return` missing?), not a square"),
    ],
)
def test_what_is_no_data_is_explained(returns, reason):
    shown = repr(check("rotation", lambda theta: returns()))
    assert reason in f"{shown}\n"
    assert shown.count("\n") == 0, "it is said once"


def test_the_callers_own_mistakes_are_named():
    with pytest.raises(InvalidParameterError, match="`question` must be one of rotation, compose"):
        check("rotate", transposed)
    with pytest.raises(InvalidParameterError, match=r'check\("rotation", rotation\), got ndarray'):
        check("rotation", right.rotation(0.3))


class Mute(Exception):
    def __str__(self):
        raise KeyError("nothing to say")


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (SystemExit(3), "it raised SystemExit: 3"),
        (SystemExit, "it raised SystemExit: "),
        (Mute(), "it raised Mute: "),
    ],
)
def test_what_a_function_raises_is_a_verdict(error, reason):
    def raising(theta):
        raise error

    told = f"{reason} (line {raising.__code__.co_firstlineno + 1} of its cell)."
    assert told in repr(check("rotation", raising))
    assert score("rotation", raising) == 0.0


def test_the_students_own_interrupt_ends_the_check():
    def interrupted(theta):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check("rotation", interrupted)


@pytest.mark.parametrize("ask", [check, score])
@pytest.mark.parametrize(
    ("question", "function"),
    [("rotation", labkit.se2.rotation), ("icp", labkit.icp), ("overlap", overlap)],
)
def test_labkits_own_function_is_no_answer(ask, question, function):
    """An import after the student's cell replaces it in the notebook; it does not in grading."""
    with pytest.raises(
        InvalidParameterError,
        match=rf"must be your own, got the one that was imported from labkit\.\w+, which .* "
        rf"defines your `{question}` again",
    ):
        ask(question, function)


def test_the_score_asks_the_hidden_cases_too():
    assert score("rotation", right.rotation) == 3.0
    assert score("rotation", transposed, "ada") == 1.5

    def by_heart(theta):
        known = {0.0, round(np.pi / 2, 12), -0.5}
        return right.rotation(theta) if theta in known else np.eye(2)

    assert check("rotation", by_heart).passed
    assert score("rotation", by_heart) == 0.0


def test_it_works_without_the_hidden_cases(tmp_path):
    """The students' edition: a copy of the package without `hidden/` and authoring."""
    package = Path(labkit.__file__).parent
    edition = tmp_path / "labkit"
    for path in package.rglob("*"):
        inside = path.relative_to(package)
        kept = path.suffix in {".py", ".json", ".js", ".css", ".html"} and path.is_file()
        if kept and "hidden" not in inside.parts and inside.parts[:2] != ("course", "authoring"):
            (edition / inside).parent.mkdir(parents=True, exist_ok=True)
            (edition / inside).write_bytes(path.read_bytes())
    program = (
        "import labkit, math\n"
        "from labkit.course.grading.check import check, score\n"
        "print(labkit.__file__)\n"
        "turn = lambda a: [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]\n"
        "print(check('rotation', turn))\n"
        "try:\n    score('rotation', turn)\n"
        "except labkit.LabkitError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    where, verdict, refusal = done.stdout.splitlines()
    assert Path(where).parent == edition
    assert verdict == "✓ Rotation: All cases pass."
    assert "holds no hidden cases: this is the students' edition" in refusal


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("questions.json", None, "cannot read .*questions.json: No such file"),
        ("visible.json", None, "cannot read .*visible.json"),
        ("visible.json", "{", "visible.json is no file of an assignment"),
        ("visible.json", "[1]", "visible.json is no file of an assignment"),
        ("questions.json", '{"format": 99}', "has format 99, this labkit reads 1"),
    ],
)
def test_a_broken_assignment_is_named(tmp_path, file, content, message):
    for name in ("questions.json", "visible.json"):
        (tmp_path / name).write_bytes((FOLDER / name).read_bytes())
    if content is None:
        (tmp_path / file).unlink()
    else:
        (tmp_path / file).write_text(content, encoding="utf-8")
    with pytest.raises(LabkitError, match=message):
        load_assignment(tmp_path, hidden=False)
