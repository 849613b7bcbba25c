"""A whole submission: calls built, variants chosen, hidden things kept hidden."""

import io
import json
from collections import Counter
from pathlib import Path

import pytest

from labkit.course.authoring import solution
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Outcome, OutcomeStatus, SourceCell
from labkit.course.grading.judging.grade import grade_submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.sandbox.inside.data import plain, receive
from labkit.errors import InvalidParameterError, LabkitError

ASSIGNMENT = load_assignment()
RIGHT = Path(solution.__file__).read_text("utf-8")


class InProcess:
    """A sandbox that is none: it runs the cells here, and remembers what it was asked."""

    mode = "none"
    safe = False
    faults = ()

    def __init__(self):
        self.runs = []

    def run(self, cells, calls):
        self.runs.append(calls)
        names = {}
        for cell in cells:
            exec(cell.source, names)
        return [self.call(names, call) for call in calls]

    def call(self, names, call):
        if call.function not in names:
            return Outcome(id=call.id, status=OutcomeStatus.NOT_DEFINED)
        try:
            value = plain(names[call.function](*call.arguments), 1 << 20)
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            name = type(error).__name__
            return Outcome(id=call.id, status=OutcomeStatus.RAISED, message=text, error=name)
        return Outcome(id=call.id, status=OutcomeStatus.RETURNED, value=value)


def graded(source, student="ada", **options):
    box = InProcess()
    cells = [SourceCell(source=source, question=None, label="cell 1")]
    return grade_submission(cells, box, ASSIGNMENT, student, **options), box


def test_a_right_submission_gets_all_points():
    verdict, box = graded(RIGHT, submission="ada.py", notes=["read as a script"])
    assert verdict.score == verdict.points == ASSIGNMENT.points == 100.0
    assert [one.question for one in verdict.questions] == [one.id for one in ASSIGNMENT.questions]
    assert (verdict.mode, verdict.submission, verdict.notes) == (
        "none", "ada.py", ("read as a script",),
    )  # fmt: skip
    assert len(box.runs) == 1


def test_nothing_in_a_call_tells_its_purpose():
    _, box = graded(RIGHT)
    (calls,) = box.runs
    assert [call.id for call in calls] == [str(number) for number in range(len(calls))]
    known = {"rotation", "transposed", "hidden", "visible"}
    for call in calls:
        own = {"id", "question", "function", "arguments", "keywords"}
        assert vars(call).keys() - {"frame"} == own
        assert receive(io.BytesIO(call.frame).read, 1 << 24)[0].keys() == own - {"question"}, (
            "what a box is sent"
        )
        assert not known & set(map(str, call.keywords))


def test_students_are_spread_evenly_and_always_alike():
    count = Counter(ASSIGNMENT.variant(f"student{number}") for number in range(800))
    assert len(count) == len(ASSIGNMENT.variants) == 8
    assert min(count.values()) > 60
    assert ASSIGNMENT.variant("ada") == ASSIGNMENT.variant("ada")
    assert ASSIGNMENT.variant("\udcff") in range(8)  # a file name that is no UTF-8


def test_one_question_alone_can_be_graded():
    verdict, box = graded(RIGHT, questions=["overlap", "icp"])
    assert [one.question for one in verdict.questions] == ["overlap", "icp"]
    assert verdict.points == 20.0
    asked = {call.question for call in box.runs[0]}
    assert asked == {"overlap", "icp"} | ASSIGNMENT.below("icp"), "what it builds on is asked, too"
    with pytest.raises(InvalidParameterError, match=r"`question` must be one of .*, got 'loop'"):
        graded(RIGHT, questions=["loop"])


def as_json(verdict):
    return json.dumps(verdict.fields, ensure_ascii=False, default=vars)


def test_a_hidden_input_never_reaches_the_verdict():
    """The submission remembers what it was given, and shouts it in every later call."""
    source = (
        "seen = []\n"
        "def rotation(theta):\n"
        "    seen.append(theta)\n"
        "    raise ValueError(str(seen))\n"
        "def align(source, target):\n"
        "    raise KeyError(str(seen))\n"
    )
    verdict, _ = graded(source)
    text = as_json(verdict)
    for case in ASSIGNMENT.cases("rotation", "ada"):
        if isinstance(case.arguments[0], float):  # 1 and -1 stand in every text
            assert (str(case.arguments[0]) in text) == (not case.hidden)
    assert "it raised ValueError: [0.0]" in text
    assert "it raised KeyError: '[" in text


def test_the_visible_cases_are_asked_before_any_hidden_one():
    """What is shown of them (shapes, error texts, sizes) can then hold nothing of a hidden one."""
    _, box = graded(RIGHT)
    visible = [(one.id, case) for one in ASSIGNMENT.questions for case in ASSIGNMENT.cases(one.id)]
    (calls,) = box.runs
    assert len(calls) > len(visible)
    for call, (question, case) in zip(calls, visible, strict=False):
        assert (call.question, call.arguments) == (question, case.arguments)


def test_an_unwritten_submission_is_said_to_be():
    source = "def rotation(theta):\n    raise NotImplementedError\n"
    verdict, _ = graded(source)
    assert verdict.questions[0].message == "`rotation` is not written yet."
    assert verdict.questions[1].message.startswith("There is no function `compose`")
    assert not any(case.reason for case in verdict.questions[0].cases), "it is said once"
    assert not any(case.reason for case in verdict.questions[1].cases)


def test_stubs_on_top_of_stubs_are_said_to_be_unwritten_and_no_more():
    stubs = "".join(f"{one.stub}\n\n" for one in ASSIGNMENT.questions)
    verdict, _ = graded(f"import numpy as np\n{stubs}")
    for one in verdict.questions:
        assert one.message.endswith("is not written yet.")
        assert not one.replaced


def test_hidden_calls_come_in_an_order_that_changes_with_the_code():
    """Constants by turn, learnt from hand-in to hand-in, are worth nothing then."""
    orders = set()
    for name in "abc":
        (calls,) = graded(f"{RIGHT}\n# {name}")[1].runs
        orders.add(repr([call.arguments for call in calls if call.question == "has_converged"]))
    assert len(orders) == 3
    again = graded(f"{RIGHT}\n# c")[1].runs[0]
    assert repr([call.arguments for call in again if call.question == "has_converged"]) in orders


def test_a_verdict_goes_to_json_and_back():
    verdict, _ = graded("def rotation(theta):\n    return theta\n")
    assert SubmissionVerdict.from_fields(json.loads(as_json(verdict))) == verdict
    again, _ = graded("def rotation(theta):\n    return theta\n")
    fields, same = json.loads(as_json(verdict)), json.loads(as_json(again))
    assert fields.pop("seconds") >= 0.0
    assert same.pop("seconds") >= 0.0
    assert fields == same


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ([], "this is no stored verdict"),
        ({}, "this is no stored verdict"),
        ({"format": 2}, "this is no stored verdict"),
        ({"format": 7}, "the verdict has format 7, this labkit reads 2"),
    ],
)
def test_what_is_no_verdict_is_refused(fields, message):
    with pytest.raises(LabkitError, match=message):
        SubmissionVerdict.from_fields(fields)


def test_a_slip_costs_its_own_points_alone():
    """Later questions are graded once more with the right function, and their texts say so."""
    slip = RIGHT.replace(
        "np.cos(theta), np.sin(theta)", "np.cos(theta / 57.3), np.sin(theta / 57.3)"
    )
    assert slip != RIGHT
    verdict, box = graded(slip)
    by_id = {one.question: one for one in verdict.questions}
    assert verdict.score == verdict.points - by_id["rotation"].points + by_id["rotation"].score
    assert by_id["align"].replaced == ("rotation",)
    assert "graded with the right `rotation` in place of yours" in by_id["align"].message
    assert len(box.runs) > 1
    assert not {call.question for calls in box.runs[1:] for call in calls} & {"rotation"}


def test_no_stand_in_answers_the_question_that_it_is_graded_for():
    """What is put into the box beside an answer is of earlier questions, in all that it holds."""
    for id in ASSIGNMENT.right:
        assert id not in ASSIGNMENT.below(id)
    for question in ASSIGNMENT.questions:
        for id in ASSIGNMENT.below(question.id):
            assert f"def {question.function}(" not in ASSIGNMENT.right[id]
