"""Copies are found through renaming and reformatting; what everybody writes is not a copy."""

import random

import pytest

from labkit.grading.contract import SourceCell
from labkit.grading.similarity import near_identical, passages

OURS = """
def icp(source, target, steps):
    T = eye(3)
    for k in range(steps):
        moved = source @ T[:2, :2].T + T[:2, 2]
        pairs = nearest(moved, target)
        kept = [p for p in pairs if p.distance <= 0.5 and p.index > 0]
        if len(kept) < 3:
            return None, k
        T = align(kept) @ T
    return T, steps - 1
"""
STUB = (
    "def other(a, b):\n    raise NotImplementedError('write this, then run the cell again', a, b)\n"
)


def marks(*sources):
    return passages(SourceCell(source=text, question=None, label="cell") for text in sources)


def program(seed):
    """A program of its own: random statements."""
    rng = random.Random(seed)
    operators = ["+", "-", "*", "/", "%", "@", "<<", ">>", "|", "&"]
    lines = [
        f"    x = {' '.join(f'x {rng.choice(operators)}' for _ in range(rng.randint(2, 9)))} y"
        for _ in range(30)
    ]
    return "def f(x, y):\n" + "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("moved", "p").replace("kept", "good").replace("icp", "match"),
        lambda text: text.replace("    ", "  ").replace(" + ", "+"),
        lambda text: text.replace("T = eye(3)", "T = eye(3)  # the identity\n"),
    ],
)
def test_renaming_formatting_and_comments_change_nothing(change):
    assert marks(change(OURS)) == marks(OURS) != ()


def test_a_copy_is_found_among_others():
    found = {str(seed): marks(STUB, program(seed)) for seed in range(40)}
    found["copy"] = marks(program(7).replace("x", "angle"), STUB, "print('mine')")
    (pair,) = near_identical(found)
    assert pair.students == ("7", "copy")
    assert pair.share > 0.9


def test_what_a_class_shares_is_no_copy():
    assert near_identical({str(seed): marks(STUB, OURS) for seed in range(40)}) == []


def test_half_a_copy_is_half_alike():
    lines = program(1).splitlines(keepends=True)
    half = "".join(lines[:16] + program(2).splitlines(keepends=True)[16:])
    others = {str(seed): marks(program(seed)) for seed in range(10, 30)}
    pairs = near_identical({"a": marks(program(1)), "b": marks(half), **others}, share=0.3)
    assert [pair.students for pair in pairs] == [("a", "b")]
    assert 0.3 < pairs[0].share < 0.7


@pytest.mark.parametrize("text", ["", "x", "def f(:", "'", "\0", "\tx\n  y"])
def test_any_text_has_a_fingerprint(text):
    assert isinstance(marks(text), tuple)
