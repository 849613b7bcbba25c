"""What a verdict says of itself."""

import pytest

from labkit.grading.judge.verdict import Status, short
from tests.grading.verdicts import case, question, submission

CASES = case("1", 1.0), case("2", 0.0)


@pytest.mark.parametrize("value", [0.0, 0.07, 2.5, 7.0, 10.0, 60.0, 100.0, 1 / 3])
def test_a_score_is_written_as_people_do_and_reads_back(value):
    text = short(value)

    assert float(text) == round(value, 2)
    assert not text.endswith((".", ".0", "00.0")) or text in ("100", "0")


def test_a_question_is_passed_with_all_its_points_and_no_fewer():
    assert question("a", 2.0, 2.0).passed
    assert not question("a", 2.0, 1.99).passed


def test_a_function_is_written_once_one_case_does_not_find_its_stub():
    stub = [type(one)(**vars(one) | {"status": Status.NOT_WRITTEN}) for one in CASES]

    assert not question("a", 1.0, 0.0, *stub).is_written
    assert question("a", 1.0, 0.0, stub[0], CASES[1]).is_written


def test_all_remarks_reach_the_student_first_what_people_changed():
    said = submission(
        "ada", question("a", 1.0, 1.0), notes=("n",), unread=("u",), adjustments=("a",)
    )  # fmt: skip

    assert said.remarks == ("a", "u", "n")
