"""Verdicts: right within the tolerance, wrong with a reason that reveals nothing hidden."""

from dataclasses import replace

import numpy as np
import pytest

from labkit.course.assignment import load_assignment
from labkit.grading.judge.compare import assess, find_fault, is_right, recognise
from labkit.grading.judge.kinds import read
from labkit.grading.judge.verdict import Outcome, Status
from labkit.grading.questions import Answer, Case

ASSIGNMENT = load_assignment()
YES_OR_NO = (Answer.FLAG, Answer.MASK)
MEASURED = [one for one in ASSIGNMENT.questions if one.answer not in YES_OR_NO]


def returned(case, value):
    return Outcome(value=value)


def first(question, hidden):
    cases = ASSIGNMENT.cases(question)
    return next(case for case in cases if case.hidden is hidden)


@pytest.mark.parametrize("question", MEASURED, ids=lambda one: one.id)
def test_an_answer_passes_up_to_the_tolerance_and_no_farther(question):
    for case in ASSIGNMENT.cases(question.id):
        right = case.expected[0]
        if isinstance(right, float) and np.isnan(right):
            continue
        for share, passes in ((0.9, True), (1.1, False)):
            off = shifted(right, share * case.tolerance)
            assert is_right(question, case, off) == passes, case.about


@pytest.mark.parametrize("kind", YES_OR_NO)
def test_yes_for_no_is_called_so(kind):
    for question in (one for one in ASSIGNMENT.questions if one.answer is kind):
        cases = ASSIGNMENT.cases(question.id)
        outcomes = [Outcome(value=case.expected[0] ^ True) for case in cases]
        assert "True and False are swapped" in assess(question, cases, outcomes).message


MOTIONS = {  # what became of R and t
    "the rotation is transposed": lambda R, t: (R.T, t),
    "the translation has the wrong sign": lambda R, t: (R, -t),
    "the translation is left out": lambda R, t: (R, np.zeros(2)),
    "the translation is in the other frame": lambda R, t: (R, R.T @ t),
}


@pytest.mark.parametrize("words", MOTIONS)
def test_a_motion_of_which_one_part_is_wrong_is_told_which(words):
    question = ASSIGNMENT.question("align")
    cases = ASSIGNMENT.cases("align")
    outcomes = [Outcome(value=MOTIONS[words](*case.expected[0])) for case in cases]

    verdict = assess(question, cases, outcomes)

    assert words in verdict.message
    assert all(case.reason for case in verdict.cases)


def test_matches_may_come_as_columns():
    question = ASSIGNMENT.question("nearest_neighbors")
    case = first("nearest_neighbors", hidden=False)
    columns = tuple(np.reshape(part, (-1, 1)) for part in case.expected[0])

    assert is_right(question, case, columns)


def test_an_index_of_a_point_just_as_near_is_as_right():
    question = ASSIGNMENT.question("nearest_neighbors")
    target = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 2.0]])
    second = (np.array([1]), np.array([1.0]))
    near = first("nearest_neighbors", hidden=False)
    case = replace(near, arguments=(np.zeros((1, 2)), target), expected=(second,), mistaken={})

    right = [is_right(question, case, (np.array([k]), second[1])) for k in (0, 1, 2, -1, 0.5)]

    assert right == [True, True, False, False, False]


def shifted(value, by):
    if isinstance(value, tuple):
        return (value[0], value[1] + by)
    return value + by


ODD = [None, "text", np.nan, (), np.zeros((0, 2)), np.empty((2**40, 0, 3)), 1e300, -1, {"R": 1}]
HUGE = [np.full((3, 3), np.inf), np.full((3, 3), 1.7e308), (np.eye(2), np.full(2, 1e308))]


@pytest.mark.parametrize("question", ASSIGNMENT.questions, ids=lambda one: one.id)
@pytest.mark.parametrize("value", [*ODD, *HUGE], ids=lambda value: repr(value).replace("\n", ""))
def test_nonsense_is_wrong_and_never_a_traceback(question, value):
    for case in ASSIGNMENT.cases(question.id):
        text = find_fault(question, case, returned(case, value))
        if repr(value) == repr(case.expected[0]) == "nan":
            assert text == ""  # the answer where no pair is kept
            continue
        assert text.endswith((".", "?"))
        assert len(text) < 800


SECRET = "3.14159 is the first input"


NOTHING_TOLD = "the result is wrong, or there is none."


@pytest.mark.parametrize(
    ("status", "of_visible", "of_hidden"),
    [
        (Status.TOO_LONG, "took too long; does a loop have no end?", "took too long;"),
        (Status.KILLED, "the program ended in it", NOTHING_TOLD),
        (Status.NO_ANSWER, f"it {SECRET}", NOTHING_TOLD),
        (Status.NOT_DEFINED, "there is no function `align`", "there is no function `align`"),
        (Status.NOT_WRITTEN, "not written yet", NOTHING_TOLD),
        ("IndexError", f"it raised {SECRET}.", NOTHING_TOLD),
        ("Own", f"it raised {SECRET}.", NOTHING_TOLD),
        ("EOFError", "; nobody types while grading, so take", NOTHING_TOLD),
        ("FileNotFoundError", "; no file is there while grading", NOTHING_TOLD),
        ("ModuleNotFoundError", "; that package is not installed", NOTHING_TOLD),
    ],
)
def test_a_call_without_an_answer_is_explained(status, of_visible, of_hidden):
    """The student's own text is shown of a visible case alone: it may hold the arguments."""
    outcome = Outcome(status=Status.RAISED, error=status, message=SECRET)
    if isinstance(status, Status):
        outcome = Outcome(status=status, message=SECRET)

    visible, hidden = (
        find_fault(ASSIGNMENT.question("align"), first("align", is_hidden), outcome)
        for is_hidden in (False, True)
    )

    assert of_visible in visible
    assert of_hidden in hidden
    assert SECRET not in hidden


@pytest.mark.parametrize("question", ASSIGNMENT.questions, ids=lambda one: one.id)
def test_of_a_hidden_case_only_that_it_is_wrong_is_told(question):
    """Who returns zeros would read the answer off a difference, who returns shapes off a length."""
    nonsense = [None, "text", 1234.0, np.zeros((3, 3)), np.ones((5, 6, 7)), np.full(77, np.nan)]
    for case in ASSIGNMENT.cases(question.id):
        if case.hidden:
            told = {find_fault(question, case, returned(case, value)) for value in nonsense}
            assert told == {"the result is wrong, or there is none."}


def test_how_a_hidden_case_ended_is_told_no_more_than_its_result():
    """A status that tells a wrong value from none could be made to spell out an input, too."""
    question, cases = ASSIGNMENT.question("align"), ASSIGNMENT.cases("align")

    verdict = assess(question, cases, [returned(case, None) for case in cases])

    assert {case.status for case in verdict.cases if case.hidden} == {Status.NO_RESULT}
    assert {case.status for case in verdict.cases if not case.hidden} == {Status.RETURNED}


TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHIFT = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.4], [0.0, 0.0, 0.0]])
TEXTS = [  # the question, how its right answer is changed, what is said of that
    ("align", lambda T: T @ TURN, "rotation is off by 90°"),
    ("align", lambda T: T + SHIFT, "the rotation is right. The translation is off by 0.5 m. For"),
    ("align", lambda T: T @ np.diag([1.0, -1.0, 1.0]), "determinant is −1"),
    ("align", lambda T: 2 * T - np.diag([0, 0, 1]), "columns are not orthonormal"),
    ("align", lambda T: T + 1.0, "last row"),
    ("huber_weights", lambda w: -w, "5 of 5 numbers lie outside [0, 1]."),
    ("huber_weights", lambda w: w * np.nan, "look for a division by zero"),
    ("huber_weights", lambda w: np.append(w, 1.0), "too long by 1"),
    ("integrate", lambda p: p + np.array([0, 0, 2 * np.pi]), "wrap them"),
    ("integrate", lambda p: p + np.array([0, 0, np.pi / 6]), "headings by up to 30°"),
    ("integrate", lambda p: p + np.array([0, 0, np.pi]), "headings by up to 180°"),
    ("distance_gate", lambda kept: kept | True, "it keeps 2 pairs that should go."),
    ("distance_gate", lambda kept: kept & False, "it rejects 3 pairs that should stay."),
    ("overlap", lambda kept: kept * 7.0, "other numbers than True and False"),
    ("nearest_neighbors", lambda m: (m[0] + 1, m[1]), "3 of 6 numbers are off, by up to 1"),
    ("invert", lambda T: T[:2, :2], "shape (2, 2), expected (3, 3)"),
]


@pytest.mark.parametrize(("question", "change", "text"), TEXTS)
def test_the_texts_say_how_far_off(question, change, text):
    case = first(question, hidden=False)
    asked, right = ASSIGNMENT.question(question), case.expected[0]
    value = change(read(asked.answer, right) if asked.answer is Answer.TRANSFORM else right)
    assert text in find_fault(asked, case, returned(case, value))


def test_a_number_where_nothing_is_left_is_told_that_there_is_none():
    none_kept = ASSIGNMENT.visible["inlier_rmse"][1]
    text = find_fault(ASSIGNMENT.question("inlier_rmse"), none_kept, returned(none_kept, 0.0))
    assert "when no pair is kept, return NaN" in text


def test_a_half_turn_may_be_pi_or_minus_pi_and_nothing_else():
    """Single precision has neither, so what it rounds to counts; −π itself is outside (−π, π]."""
    question, half_turn = ASSIGNMENT.question("wrap"), ASSIGNMENT.visible["wrap"][-1]
    beside = [-np.pi, -np.pi + 1e-7, -np.pi - 1e-7, np.pi - 1e-7, 1e-7, -np.pi + 0.01, 3 * np.pi]

    right = [is_right(question, half_turn, angle) for angle in beside]

    assert right == [False, True, True, True, False, False, False]


def test_of_several_results_the_wrong_one_is_told_by_its_place():
    question = replace(ASSIGNMENT.question("fitness"), answer=Answer.NUMBERS)
    wanted = (np.array([1.0, 2.0, 3.0]), 4.0, np.array([5.0, 6.0]))
    case = replace(first("fitness", False), expected=(wanted,), mistaken={})
    places = {0: "result 1 at [0]", 2: "result 1 at [2]", 3: "result 2", 5: "result 3 at [1]"}

    for entry, place in places.items():
        wrong = np.arange(1.0, 7.0)
        wrong[entry] += 1.0
        text = find_fault(question, case, returned(case, (wrong[:3], wrong[3], wrong[4:])))

        assert f" in {place} got {wrong[entry]:g}, expected {wrong[entry] - 1:g}." in text


@pytest.mark.parametrize("count", [1, 2])
def test_a_group_of_cases_gives_its_points_if_all_pass(count):
    """A condition that seldom decides costs as much as one that often does."""
    question = ASSIGNMENT.question("has_converged")
    cases = ASSIGNMENT.cases(question.id)
    wrong = [case for case in cases if case.group == "the budget"][:count]
    values = [case.expected[0] ^ (case in wrong) for case in cases]

    verdict = assess(question, cases, [returned(*pair) for pair in zip(cases, values, strict=True)])

    assert verdict.score == 0.8 * question.points
    assert verdict.message == (
        f"{len(cases) - count} of {len(cases)} cases pass. Points are for groups of hidden ones: "
        f"4 of 5; not yet for the budget."
    )


CONSTANTS = [True, False, 0.0, 1.0, float("nan")]
ONES_OR_ARGUMENT = [lambda first: first, np.ones_like, np.zeros_like, lambda first: first > -1]


@pytest.mark.parametrize("question", ASSIGNMENT.questions, ids=lambda one: one.id)
def test_a_line_without_an_idea_earns_nothing(question):
    """A constant, the first argument, ones in its shape."""
    cases = ASSIGNMENT.hidden[question.id]
    answers = [[returned(case, constant) for case in cases] for constant in CONSTANTS]
    for answer in ONES_OR_ARGUMENT:
        answers.append([returned(case, answer(np.asarray(case.arguments[0]))) for case in cases])

    scores = [assess(question, cases, outcomes).score for outcomes in answers]

    assert scores == [0.0] * len(answers)


@pytest.mark.parametrize("question", ASSIGNMENT.questions, ids=lambda one: one.id)
def test_the_examples_learnt_by_heart_are_worth_nothing(question):
    """Their answers are handed out, right and wrong ones; beyond them, an error or a constant."""
    cases = ASSIGNMENT.cases(question.id)
    tables = [{case.id: case.expected[0] for case in cases if not case.hidden}]
    for known in question.misconceptions:
        told = [case for case in cases if not case.hidden and known.id in case.mistaken]
        tables.append({case.id: case.mistaken[known.id][0] for case in told})
    constant = cases[-1].expected[0]
    by_constant = assess(question, cases, [returned(case, constant) for case in cases])
    for table in tables:
        raised = [
            returned(case, table[case.id]) if case.id in table else Outcome(status=Status.RAISED)
            for case in cases
        ]
        assert assess(question, cases, raised).score == 0.0
        filled = [returned(case, table.get(case.id, constant)) for case in cases]
        assert assess(question, cases, filled).score <= by_constant.score


@pytest.mark.parametrize(("function", "named"), [("align", "align"), ("icp", "nearest_neighbors")])
def test_a_stub_is_named_also_where_it_is_called(function, named):
    question, cases = ASSIGNMENT.question(function), ASSIGNMENT.visible[function]
    called = "" if function == named else named
    outcomes = [Outcome(status=Status.NOT_WRITTEN, unwritten=called)] * len(cases)
    assert assess(question, cases, outcomes).message == f"`{named}` is not written yet."


def test_answers_of_two_mistakes_name_neither():
    question = ASSIGNMENT.question("rotation")
    cases = ASSIGNMENT.cases("rotation")
    mixed = [
        returned(case, case.mistaken["reflection" if number % 2 else "no_minus"][0])
        for number, case in enumerate(cases)
    ]
    assert recognise(question, cases, mixed) is None


def test_a_mistake_at_half_a_turn_may_be_pi_or_minus_pi():
    """What is left of a path that is turned backwards is right there, and it is still named."""
    question = ASSIGNMENT.question("integrate")
    cases = ASSIGNMENT.cases("integrate")
    known = "turned_backwards"

    verdict = assess(question, cases, [returned(case, case.mistaken[known][0]) for case in cases])

    assert any(case.passed for case in verdict.cases)
    assert verdict.misconception == known


def test_a_mistake_in_the_form_of_the_answer_is_known_by_its_form():
    question = ASSIGNMENT.question("distance_gate")
    case = Case(
        id="1", hidden=False, about="a form", arguments=(), expected=(np.array([True, False]),),
        tolerance=1e-6, mistaken={"squared_gate": ("text",), "strict": (np.array([False, False]),)},
    )  # fmt: skip
    assert recognise(question, [case], [returned(case, "other text")]).id == "squared_gate"
    assert recognise(question, [case], [returned(case, np.array([0, 0]))]).id == "strict"
    case = replace(case, mistaken={"squared_gate": (np.ones((2, 2)),)})
    assert recognise(question, [case], [returned(case, np.ones((2, 2)))]).id == "squared_gate"
    assert recognise(question, [case], [returned(case, np.eye(2))]) is None


def test_any_of_the_nearest_target_points_is_right():
    """Two target points are equally near: either index is right, a third one is not."""
    assignment = load_assignment()
    question = assignment.question("nearest_neighbors")
    source, target = np.array([[1.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0], [9.0, 9.0]])
    tie = replace(
        assignment.cases(question.id)[0],
        arguments=(source, target),
        expected=((np.array([0]), np.array([1.0])),),
    )
    for index, right in ((0, True), (1, True), (2, False), (7, False), (0.5, False)):
        assert is_right(question, tie, (np.array([index]), np.array([1.0]))) is right
