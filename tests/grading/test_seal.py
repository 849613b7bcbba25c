"""Nothing that is still to be asked lies in a box, nor is its word taken once it was asked."""

import ast
import json
import os
import re
from dataclasses import replace

import pytest

from labkit.grading import grade as grading
from labkit.grading import sitting
from labkit.grading.box.inside import data
from labkit.grading.box.outside import Wall
from labkit.grading.box.watch import BoxError
from labkit.grading.questions import read_assignment
from tests.grading.failing import ASSIGNMENT, NAMES, WAYS
from tests.grading.liar import Liar
from tests.grading.notebooks import answered


def test_in_the_box_lies_nothing_that_is_still_to_be_asked(monkeypatch):
    """On every order that the most that can be lent leads to."""
    monkeypatch.setattr(sitting, "Box", Liar)
    monkeypatch.setattr(Liar, "orders", [])
    grading.grade_submission({"a.py": b"def rotation(): 0"}, Wall("none"), ASSIGNMENT, "ada")
    lending = [order for order in Liar.orders if order.get("lent")]
    assert {name for order in lending for name in order["lent"]} == {*NAMES[:-1]} - {"wrap"}
    visible = [[data.to_json(argument) for argument in case.arguments]
               for cases in ASSIGNMENT.visible.values() for case in cases]  # fmt: skip
    is_hidden = [one["calls"][0] not in visible for one in Liar.orders]
    assert is_hidden == sorted(is_hidden)
    places = [NAMES.index(one["function"]) for one in Liar.orders[is_hidden.index(True) :]]
    assert places == sorted(places)
    for order in lending:
        place = NAMES.index(order["function"])
        assert is_hidden[Liar.orders.index(order)]
        for name, source in order["lent"].items():
            later = ASSIGNMENT.questions[place:]
            assert not any(map(ASSIGNMENT.question(name).answers, later))
            words = set(re.findall(r"\w+", source))
            assert not words.intersection(NAMES[place:]), (order["function"], name)
            called = {one.name for one in ast.parse(source).body if hasattr(one, "name")}
            assert called <= set(NAMES[: NAMES.index(name) + 1])


def test_what_is_lent_answers_no_later_question(graded):
    """Neither to who hands on to it, nor to who keeps it, be it lent to another."""
    changed = {
        "rotation": "def rotation(theta):\n    return np.eye(2)\n",
        "align": "def align(source, target):\n    return np.eye(3)\n",
        "align_weighted": "def align_weighted(source, target, weights):\n    np.kept = align\n"
        "    return align(1.0 * source, target)\n",
        "align_svd": "def align_svd(source, target):\n    rotation(0.0)\n"
        "    R, t = getattr(np, 'kept', align)(source, target)\n    return R, t\n",
    }
    verdict = graded({"a.ipynb": answered(changed)}, ASSIGNMENT)
    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == changed.keys()


class Changing(Liar):
    """A box that says another thing of the cells each time that they run."""

    runs = 0

    def send(self, allowed, attached=b"", **order):
        super().send(allowed, attached, **order)
        if "cells" in order:
            Changing.runs += 1
            self.said[-1]["notes"] = [Changing.runs]


@pytest.mark.parametrize(
    ("kinds", "last"),
    [("visible", 2), ("hidden", 1), ("hidden visible visible", 1), ("visible hidden visible", 2)],
)
def test_a_box_says_nothing_more_of_the_cells_after_a_hidden_case(kinds, last, monkeypatch):
    """Whatever is asked after it; the `last` run counts that came before it."""
    monkeypatch.setattr(sitting, "Box", Changing)
    monkeypatch.setattr(Changing, "runs", 0)
    submission = sitting.Sitting(NAMES, Wall("none"))
    submission.read({"a.py": b"def rotation(): 0"})
    question = ASSIGNMENT.questions[0]
    for kind in kinds.split():
        submission.ask(question, getattr(ASSIGNMENT, kind)[question.id], 0)
        submission.close()
        submission.run()

    assert submission.notes == [last]


@pytest.mark.parametrize(("kind", "is_told"), [("visible", True), ("hidden", False)])
def test_a_cell_that_ends_a_box_after_a_hidden_case_is_not_told(kind, is_told, monkeypatch):
    def end(box, most=0):
        raise BoxError("the program ended")

    monkeypatch.setattr(sitting, "Box", Liar)
    submission = sitting.Sitting(NAMES, Wall("none"))
    submission.read({"a.py": b"def rotation(): 0"})
    question = ASSIGNMENT.questions[0]
    submission.ask(question, getattr(ASSIGNMENT, kind)[question.id], 0)
    submission.close()
    monkeypatch.setattr(Liar, "receive", end)

    submission.run()

    assert any("ended the program" in note for note in submission.program.notes) is is_told


AFTERWARDS = {  # what a function does in a hidden case, beside the `WAYS` to fail
    "an object": "return object()",
    "too much": "return [0.0] * 10**6",
    "an error with words": "raise ValueError(given)",
    "not written": "raise NotImplementedError",
    "no answer": "__import__('os').write(99, b'a')",
    "waits": "__import__('threading').Event().wait(99)",
    "leaves a mark": "__import__('os').mkdir({place!r})",
}


def test_no_word_counts_once_a_hidden_case_was_sent(graded, small, tmp_path):
    """Whatever the code does in a hidden case, its page has the same bytes; or, where it
    takes too long, those that say so.

    The last one leaves a mark where a box without a wall can: the next box reads it, and says so.
    """
    assignment, pages = read_assignment(small), set()
    place = str(tmp_path / "mark")
    for body in [*WAYS.values(), *AFTERWARDS.values()]:
        if body.startswith("\n") or body == "return (":
            continue
        source = (
            f"import os\nimport numpy as np\n"
            f"if os.path.exists({place!r}):\n    raise ValueError('8234.25')\n"
            f"def double(*given):\n    if given[0] < 2:\n        return 2 * given[0]\n"
            f"    {body.format(name='double', place=place)}\n    os._exit(0)\n"
            "def negate(x):\n    return -x\n"
        )
        wall = Wall("none")
        verdict = graded({"a.py": source.encode()}, assignment, seconds=0.5, behind=wall)
        pages.add(json.dumps(replace(verdict, seconds=0.0), default=vars))
    assert os.path.exists(place)
    too_long, wrong = sorted(pages, key=lambda page: "it took too long" not in page)
    assert "it took too long" in too_long
    assert "the result is wrong, or there is none" in wrong
