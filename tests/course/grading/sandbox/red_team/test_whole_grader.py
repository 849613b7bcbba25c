"""Attacks on comparisons and frames, graded as answers to the lab's own assignment."""

import tomllib
from pathlib import Path

import pytest

from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Limits, SourceCell
from labkit.course.grading.judging.grade import grade_submission
from labkit.course.grading.sandbox.host import open_sandbox

ATTACKS = [
    pytest.param(attack["cell"], id=f"{family}: {attack['name']}")
    for family in ("comparison", "forging")
    for attack in tomllib.loads(
        (Path(__file__).parent / "attacks" / f"{family}.toml").read_text("utf-8")
    )["attack"]
    if "TIMEOUT" not in attack["ends"]
]


@pytest.fixture(scope="module")
def slot():
    with open_sandbox("auto", Limits(seconds=5.0, memory=256 << 20)) as strongest:
        yield strongest


@pytest.fixture(scope="module")
def assignment():
    return load_assignment()


@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_earns_nothing(slot, assignment, bait, attack):
    """The function of some questions is the attack; its arguments do not matter."""
    asked = assignment.questions[::6]
    names = [question.function for question in asked]
    aliases = "\n".join(f"def {name}(*a, **k):\n    return attacked(a)" for name in names)
    cells = [SourceCell(source=f"{bait.aim(attack)}\n{aliases}", question=None, label="cell 1")]
    ids = [question.id for question in asked]
    verdict = grade_submission(cells, slot, assignment, "mallory", questions=ids)
    assert len(verdict.questions) == len(ids) >= 2
    assert verdict.score == 0.0, [q.question for q in verdict.questions if q.score]
    assert bait.secret not in repr(verdict)
