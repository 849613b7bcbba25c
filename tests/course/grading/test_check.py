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
    assert repr(feedback) == "✓ Rotation: All visible cases pass; grading tries others."
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


def test_an_unnamed_case_shows_what_went_in_what_came_out_and_what_should():
    shown = repr(check("distance_gate", lambda distances, gate: distances < 100.0))
    assert "it keeps 2 pairs that should go. For distances = [3.5, 1.7, 0.4, 2.2], max_d" in shown
    assert "= 2: at [0] got True, expected False." in shown
    assert "For" not in repr(check("distance_gate", lambda distances, gate: distances > gate))


def namespace(source):
    names = {"np": np, "labkit": labkit, "overlap": overlap}
    exec(source, names)
    return names


def test_a_function_that_fails_by_an_earlier_one_says_which():
    """Also where that one is called by a helper; never where the earlier one is right."""
    source = (
        "def rotation(a):\n    return np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])\n"
        "def turned(a, p):\n    return rotation(a) @ p\n"
        "def integrate(increments, start):\n"
        "    poses = [np.array(start, dtype=float)]\n"
        "    for one in increments:\n"
        "        poses.append(poses[-1] + np.append(turned(poses[-1][2], one[:2]), one[2]))\n"
        "    return np.array(poses)\n"
    )
    cause = "It uses your `rotation`, which fails its own check: mend that first."
    assert cause in repr(check("integrate", namespace(source)["integrate"]))
    right = source.replace("np.sin(a)], [-np", "-np.sin(a)], [np").replace("one[2]))", "0.0))")
    assert "It uses your" not in repr(check("integrate", namespace(right)["integrate"]))


@pytest.mark.parametrize(
    "body",
    ["return labkit.align(p, q)", "import labkit.se2 as s\n    return s", "return overlap(p, q)"],
)
def test_a_function_that_uses_labkit_is_refused(body):
    names = namespace(f"def helper(p, q):\n    {body}\ndef align(p, q):\n    return helper(p, q)\n")
    with pytest.raises(InvalidParameterError, match=r"from labkit.*, which the grading does"):
        check("align", names["align"])


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
        match=rf"must be your own, got one that takes it from labkit\.\w+, which .* "
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
    assert verdict == "✓ Rotation: All visible cases pass; grading tries others."
    assert "holds no hidden cases: this is the students' edition" in refusal


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("questions.json", None, "cannot read .*questions.json: No such file"),
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
