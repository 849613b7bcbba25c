"""Law 4: of cells that fail, hang or say the same again, what is right counts."""

import pytest

from labkit.grading.questions import read_assignment
from tests.grading.failing import ASSIGNMENT, NAMES
from tests.grading.notebooks import HANDED_OUT, cell, notebook
from tests.grading.small import RIGHT as RIGHT_NUMBERS


def test_what_is_handed_out_and_not_touched_is_called_not_written(graded):
    files = {"a.ipynb": HANDED_OUT.read_bytes()}

    verdict = graded(files, ASSIGNMENT)

    assert verdict.score == 0.0
    assert {one.message for one in verdict.questions} == {
        f"`{name}` is not written yet." for name in NAMES
    }


def test_of_two_states_the_better_counts(graded, small):
    """A later cell makes what an answer uses worse, and it is not defined again."""
    cells = ["def power(x):\n    return x * x\n", "def double(x):\n    return power(x)\n",
             "def negate(x):\n    return -x\n", "def power(x):\n    return 0.0\n"]  # fmt: skip
    for order in (cells, [cells[3], *cells[1:3], cells[0]]):
        verdict = graded(
            {"a.ipynb": notebook([cell(one) for one in order])}, read_assignment(small)
        )

        assert verdict.score == 3.5, verdict.questions


def test_experiments_without_an_end_cost_no_answer_and_end_no_box(graded, small):
    """Law 4: they share the time of two cells, and those beyond are left out, constants never."""
    cells = ["while True:\n    pass"] * 60
    cells += ["TWO = 2", RIGHT_NUMBERS.replace("2 * x", "TWO * x")]

    verdict = graded(
        {"a.ipynb": notebook([cell(one) for one in cells])}, read_assignment(small), seconds=0.5
    )  # fmt: skip

    assert verdict.score == 5.0
    assert not any("ended the program" in note for note in verdict.notes), verdict.notes


SLOW_IMPORT = """import time
end = time.process_time() + 0.8
while time.process_time() < end:
    pass
TWO = 2
"""


def test_an_import_has_more_time_than_another_statement(graded, small):
    """Law 4: some packages are large."""
    source = "import slow\n" + RIGHT_NUMBERS.replace("2 * x", "slow.TWO * x")
    files = {"a.py": source.encode(), "slow.py": SLOW_IMPORT.encode()}

    verdict = graded(files, read_assignment(small), seconds=0.5)

    assert verdict.score == 5.0, verdict.notes


def test_a_cell_that_fails_twice_is_told_by_its_first_reason(graded, small):
    source = "1 / 0\nnowhere\n" + RIGHT_NUMBERS

    verdict = graded({"a.py": source.encode()}, read_assignment(small))

    assert verdict.score == 5.0
    assert [note.partition(": ")[2] for note in verdict.notes] == [
        "ZeroDivisionError: division by zero (line 1 of a.py)"
    ]


HIDING = {  # cells after the first of two answers that uses Python's `sum`
    "a number with the name of a function": "sum = 3",
    "labkit's function of that name": "from labkit import double",
}


@pytest.mark.parametrize("later", HIDING)
def test_what_a_later_cell_hides_an_earlier_answer_keeps(later, graded, small):
    """Law 4: and each call finds the names of its own function's cell."""
    cells = ["def double(x):\n    return sum([x, x])\n", HIDING[later],
             "def negate(x):\n    return -x\n"]  # fmt: skip

    verdict = graded(
        {"a.ipynb": notebook([cell(one) for one in cells])}, read_assignment(small), seconds=0.5
    )  # fmt: skip

    assert verdict.score == 5.0, verdict.questions
