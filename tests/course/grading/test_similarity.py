"""Copies are found through renaming and reformatting; what everybody writes is not a copy.

However many copied: that many have it makes a copy no less of one.
"""

import random

import pytest

from labkit.course.grading.extraction.passages import passages, runs
from labkit.course.grading.similarity import Group, all_passages, groups_alike

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
    return passages(sources)


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


def class_of(count):
    """Students who each wrote a program of their own."""
    return {f"own {seed}": marks(STUB, program(seed)) for seed in range(count)}


def edited(text, seed):
    """A copy in which a few lines were written anew."""
    rng, lines = random.Random(seed), text.splitlines(keepends=True)
    for line in rng.sample(range(1, len(lines)), 2):
        lines[line] = (
            f"    x = abs(x) {rng.choice('+-*/')} {rng.choice(['y', '1', '[y]'])} if y else x\n"
        )
    return "".join(lines)


def test_a_copy_is_found_among_others():
    found = class_of(40)
    found["copy"] = marks(program(7).replace("x", "angle"), STUB, "print('mine')")
    (group,) = groups_alike(found)
    assert group.students == ("copy", "own 7")
    assert group.share > 0.9


@pytest.mark.parametrize("copies", [2, 3, 4, 5, 16, 40])
def test_the_more_copy_the_more_are_listed(copies):
    same = {f"same {k}": marks(program(99)) for k in range(copies)}
    (group,) = groups_alike(class_of(16) | same)
    assert (group.students, group.share) == (tuple(sorted(same)), 1.0)
    assert len(group.pairs) == copies - 1


@pytest.mark.parametrize("copies", [2, 4, 8, 12])
def test_many_near_copies_are_one_group(copies):
    one = "".join(program(seed) for seed in (97, 98, 99))
    near = {f"near {k}": marks(edited(one, k)) for k in range(copies)}
    (group,) = groups_alike(class_of(8) | near)
    assert group.students == tuple(sorted(near))
    assert 0.8 <= group.share < 1.0


def test_two_groups_stay_two():
    copies = {f"{seed} {k}": marks(program(seed)) for seed in (98, 99) for k in range(5)}
    groups = groups_alike(class_of(10) | copies)
    assert [group.students for group in groups] == [
        tuple(f"{seed} {k}" for k in range(5)) for seed in (98, 99)
    ]


def test_what_a_class_shares_is_no_copy():
    """Neither what was handed out, nor what each wrote of his own accord next to the rest."""
    handed_out = all_passages([STUB, OURS])
    assert groups_alike({str(k): marks(STUB, OURS) for k in range(40)}, handed_out) == []
    found = {str(seed): marks(STUB, OURS, program(seed)) for seed in range(40)}
    assert groups_alike(found) == []
    obvious = {f"obvious {k}": marks(STUB, OURS) for k in range(10)}
    assert groups_alike(found | obvious) == []


def test_a_whole_submission_is_no_chance_even_of_what_others_wrote():
    parts = [program(seed) for seed in range(90, 94)]
    found = {str(k): marks(*(parts[:k] + parts[k + 1 :]), program(k)) for k in range(4)}
    found |= {str(k): marks(parts[k % 4], program(k)) for k in range(4, 30)}
    assert groups_alike(found) == []
    same = dict.fromkeys(("ada", "emmy"), marks(*parts))
    (group,) = groups_alike(found | same)
    assert group == Group(students=("ada", "emmy"), pairs=(("ada", "emmy", 1.0),))


def test_the_order_of_the_class_makes_no_difference():
    found = class_of(12) | {f"near {k}": marks(edited(program(99), k)) for k in range(6)}
    assert groups_alike(dict(reversed(found.items()))) == groups_alike(found) != []


def test_nothing_handed_in_is_no_copy():
    assert groups_alike({}) == groups_alike({str(k): () for k in range(9)}) == []


def test_what_is_half_a_copy_is_named_with_its_share():
    ours, theirs = ([program(seed + k) for k in range(6)] for seed in (100, 200))
    others = {str(seed): marks(program(seed)) for seed in range(10, 30)}
    found = {"a": marks(*ours), "b": marks(*ours[:3], *theirs[3:]), "c": marks(*theirs[:3])}
    (group,) = groups_alike(found | others)
    assert group.students == ("a", "b")
    assert 0.4 < group.share < 0.6


@pytest.mark.parametrize("text", ["", "x", "def f(:", "'", "\0", "\tx\n  y"])
def test_any_text_has_a_fingerprint(text):
    assert isinstance(marks(text), tuple)


def test_a_program_counts_up_to_where_it_is_no_python():
    """Python 3.11 tries again at each blank before a mark that is none: minutes for a long line."""
    whole = "def f(a, b):\n    return a + b * (a - b) / (a + b)\n"
    assert runs(f"{whole}x = ({' ' * 40_000}'\n{whole}") == runs(f"{whole}x = (")
