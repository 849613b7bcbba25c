"""The promises of the grading as laws: each test makes its cases from the assignment."""

import ast
import os
import re
from concurrent.futures import ThreadPoolExecutor

import pytest

from labkit.course.grading import grade
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.box import Wall
from labkit.course.grading.reading import read_program
from notebooks import answered

ASSIGNMENT = load_assignment()
ORDERS = []
NAMES = [one.function for one in ASSIGNMENT.questions]


# How a function fails: its body, or with a leading line break what stands before its definition.
WAYS = {
    "endless loop": "while True:\n        pass",
    "endless recursion": "return {name}(*given)",
    "exit": "__import__('os')._exit(0)",
    "segmentation fault": "__import__('ctypes').string_at(0)",
    "too much memory": "held = [bytes(2**27) for _ in range(99)]",
    "exception at its definition": "\n1 / 0\n",
    "syntax error in its own cell": "return (",
    "None": "return None",
    "wrong answer": "return np.full(7, 0.125)",
}


def failing(name, way):
    """The cell of a function that fails in some way."""
    before, body = (WAYS[way], "pass") if WAYS[way].startswith("\n") else ("", WAYS[way])
    return f"{before}def {name}(*given):\n    {body.format(name=name)}\n"


def test_a_mistake_costs_its_own_points_and_no_others(wall):
    """Law 1: each function fails once in each way, nine of 19 at a time, boxes side by side."""

    def grade_all(shift):
        ways = {NAMES[(shift + 2 * place) % len(NAMES)]: way for place, way in enumerate(WAYS)}
        cells = {name: failing(name, way) for name, way in ways.items()}
        program = read_program({"a.ipynb": answered(cells, closing=False)}, NAMES)
        timed = wall._replace(seconds=1.0)
        return ways, grade.grade_submission(program, timed, ASSIGNMENT, f"student {shift}")

    with ThreadPoolExecutor((os.cpu_count() or 1) + 2) as executor:
        for ways, verdict in executor.map(grade_all, range(len(NAMES))):
            for one in verdict.questions:
                way = ways.get(one.question)
                assert one.score == (0.0 if way else one.points), (one.question, way, ways, one)


class Liar:
    """A box whose answers are all wrong, and which claims to call every function."""

    def __init__(self, wall):
        self.said = []

    def send(self, allowed, **order):
        ORDERS.append(order)
        told = {"states": ["last", "first", "end"], "calls": NAMES, "hands_on": ""}
        cells = [{} for _ in order.get("cells", ())]
        answers = [*cells, {"answers": dict.fromkeys(NAMES, told)}]
        self.said += answers if "cells" in order else [{"value": None}] * len(order["calls"])

    def receive(self):
        return self.said.pop(0)

    def used(self):
        return 0.0, 0.0

    def spent(self):
        return 0.0

    def close(self):
        pass


def test_in_the_box_lies_nothing_that_is_still_to_be_asked(monkeypatch):
    """Law 3, on every order that the most that can be lent leads to."""
    monkeypatch.setattr(grade, "Box", Liar)
    program = read_program({"a.py": b"def rotation(): 0"}, NAMES)
    grade.grade_submission(program, Wall("none"), ASSIGNMENT, "ada")
    lent = [order for order in ORDERS if order.get("right")]
    assert {name for order in lent for name in order["right"]} == set(NAMES[:-1])
    last = max(place for place, order in enumerate(ORDERS) if not order.get("right"))
    assert ORDERS.index(lent[0]) > last, "all are asked alone before anything is lent"
    for order in lent:
        place = NAMES.index(order["function"])
        for name, source in order["right"].items():
            words = set(re.findall(r"\w+", source))
            assert not words.intersection(NAMES[place:]), (order["function"], name)
            called = {one.name for one in ast.parse(source).body if hasattr(one, "name")}
            assert called <= set(NAMES[: NAMES.index(name) + 1])


@pytest.mark.parametrize(
    "body",
    [
        "    return align(source, target)",
        "    R, t = align(source, target)\n    return R, t",
        "    'It does it.'\n    found = align(source, target)\n    R, t = found\n    return (R, t)",
        "    return helper(source, target)",
    ],
)
def test_handing_on_is_no_answer(body, graded):
    """Law 3: with a wrong `align`, the right one is lent to nobody who only hands on to it."""
    helper = "def helper(p, q):\n    return align(p, q)\n\n\n"
    changed = {
        "align": "def align(source, target):\n    return np.eye(3)\n",
        "align_svd": f"{helper}def align_svd(source, target):\n{body}\n",
    }
    verdict = graded({"a.ipynb": answered(changed)}, ASSIGNMENT)
    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {"align", "align_svd"}
