"""An assignment of two small questions, and what a class might hand in for it."""

import csv
import json
from dataclasses import asdict
from pathlib import Path

from labkit.grading.questions import FORMAT, Answer, Misconception, Question

DOUBLE = Question(
    id="double", title="Double it", chapter="chapter 1", points=2.0, function="double",
    signature="(x)", task="Double a number.", docstring="Twice x.", answer=Answer.NUMBER,
    misconceptions=(
        Misconception(id="square", says="this is x squared", chapter="chapter 1"),
    ),
)  # fmt: skip
NEGATE = Question(
    id="negate", title="Negate it", chapter="chapter 2", points=3.0, function="negate",
    signature="(x)", task="Change the sign.", docstring="Minus x.", answer=Answer.NUMBER,
)  # fmt: skip

RIGHT = "def double(x):\n    return 2 * x\n\ndef negate(x):\n    return -x\n"
SQUARED = "def double(x):\n    return x * x\n\ndef negate(x):\n    return -x\n"
HANGS = "def double(x):\n    while True:\n        pass\n\ndef negate(x):\n    return -x\n"
SCORES = {RIGHT: 5.0, SQUARED: 3.5, HANGS: 3.0}


def case(name, x, right, square=None):
    mistaken = {} if square is None else {"square": [square]}
    return {
        "id": name, "about": "a number", "arguments": [x], "expected": [right],
        "tolerance": 1e-9, "mistaken": mistaken,
    }  # fmt: skip


def write_assignment(folder):
    """Write the files of the assignment, its hidden cases among them."""
    (folder / "hidden").mkdir(parents=True)
    questions = [{**asdict(one), "answer": one.answer.value} for one in (DOUBLE, NEGATE)]
    write(folder / "questions.json", title="Small numbers", questions=questions)
    visible = {"double": [case("1", 1.5, 3.0, 2.25)], "negate": [case("1", 1.5, -1.5)]}
    write(folder / "visible.json", cases=visible)
    numbers = (3.0, 4.0, 5.0, 2.0)  # the square of two is right
    hidden = {
        "double": [case(f"h{x:g}", x, 2.0 * x, x * x) for x in numbers],
        "negate": [case("h", 3.0, -3.0)],
    }
    write(folder / "hidden/cases.json", cases=hidden)
    return folder


def write(path, **content):
    path.write_text(json.dumps({"format": FORMAT, **content}), encoding="utf-8")


def hand_in(folder, count):
    """A class of `count` students; what the scores must be, by student."""
    folder.mkdir(parents=True, exist_ok=True)
    expected = {}
    for number in range(count):
        source = SQUARED if number % 5 == 3 else RIGHT
        student = f"student{number:05}"
        (folder / f"{student}.py").write_text(f"{source}# {student}\n", encoding="utf-8")
        expected[student] = SCORES[source]
    return expected


def scores(folder="grades"):
    """The scores of a class by student; -1 where there is none."""
    with Path(folder, "scores.csv").open(encoding="utf-8") as file:
        return {row["student"]: float(row["score"] or -1) for row in csv.DictReader(file)}
