"""`check` in a notebook: the verdict on the visible cases, shown inline."""

import functools
import sys
import time

import numpy as np
import pytest

import labkit
from labkit.correspondences import overlap
from labkit.course.assignment import FOLDER, load_assignment
from labkit.course.exercises import check, checking, score
from labkit.course.exercises.checking import exercises
from labkit.grading.questions import read_assignment
from labkit.support.errors import InvalidParameterError, LabkitError
from tests.course.authoring.right_answers import solution as right


def named(name, function):
    """The function under the name that its stub has."""
    function.__name__ = name
    return function


def transposed(theta):
    return right.rotation(theta).T


def test_a_right_function_passes():
    feedback = check(named("rotation", right.rotation))
    assert feedback.passed
    assert repr(feedback) == "✓ Rotation: All visible cases pass; grading tries others."
    assert "<ul" not in feedback._repr_html_()


@pytest.mark.parametrize(
    "definition",
    [
        "wrap = lambda angle: np.arctan2(np.sin(angle), np.cos(angle))",
        "wrap = functools.partial(lambda turn, angle: np.angle(np.exp(1j * angle)), 2 * np.pi)",
        "wrap = np.vectorize(lambda angle: float(np.angle(np.exp(1j * angle))))",
        "wrap = type('Wrap', (), {'__call__': lambda self, a: np.angle(np.exp(1j * a))})()",
    ],
)
def test_whatever_the_grader_calls_is_checked_under_its_name(definition):
    """Law 3."""
    space = {"np": np, "functools": functools, "check": check, "score": score}
    exec(definition, space)

    assert eval("check(wrap).passed", space)
    assert eval("score(wrap)", space) == load_assignment().question("wrap").points


def test_a_warning_is_shown_and_costs_nothing_in_nbgrader(capsys):
    def warning(theta):
        print("RuntimeWarning: divide by zero", file=sys.stderr)
        return right.rotation(theta)

    assert check(named("rotation", warning)).passed
    shown = capsys.readouterr()
    assert "RuntimeWarning" in shown.out
    assert shown.err == "", "nbgrader gives no point to a cell that writes to stderr"


def test_a_wrong_one_is_told_its_mistake():
    feedback = check(named("rotation", transposed))
    assert not feedback.passed
    lines = repr(feedback).splitlines()
    assert "are as if this were so: the answer is transposed. See chapter" in lines[0]
    assert [line.partition(" For theta")[0] for line in lines[1:]] == [
        "  - A quarter turn: the rotation is off by 180°.",
        "  - A turn to the right: the rotation is off by 57°.",
    ]


RIVALS = {  # wrong functions, and the words of a known mistake that they are not
    "wrap": ("np.pi - (np.pi - angle) % np.pi", "lost its sign"),
    "distance_gate": ("distances <= max_distance * np.median(distances)", "squared gate"),
    "huber_weights": ("np.clip(2.0 - residuals / delta, 0.0, 1.0)", "that is a gate"),
    "has_converged": (
        "(np.hypot(*dT[:2, 2]) < eps_t and dT[1, 0] < eps_psi) or abs(cost_change) < eps_cost "
        "or iteration >= k_max",
        "rotation is not looked at",
    ),
    "is_plausible": (
        "bool(increment[0]**2 + increment[1]**2 <= max_shift and abs(increment[2]) <= max_turn "
        "and inlier_ratio >= min_ratio and rmse <= max_rmse)",
        "not looked at",
    ),
}


@pytest.mark.parametrize("name", RIVALS)
def test_no_mistake_is_named_that_a_visible_case_can_tell_apart(name):
    """A wrong name is worse than none."""
    expression, words = RIVALS[name]
    signature = load_assignment().question(name).signature.strip("()")

    feedback = check(named(name, eval(f"lambda {signature}: {expression}", {"np": np})))

    assert not feedback.passed
    assert words not in repr(feedback)


@pytest.mark.parametrize(
    ("old", "parameters", "is_named"),
    [
        ("icp_by_hand", "source, target, T_init, rounds=15, gate=0.3", True),
        ("my_loop", "source, target, T_init, gate, rounds", True),
        ("icp_by_hand", "source, target, T_init, rounds=15", False),
    ],
)
def test_a_stub_whose_function_stands_under_another_name_says_so(old, parameters, is_named):
    stub = "def gated_icp(source, target, T_init, gate=0.3, rounds=15): raise NotImplementedError"
    space = {"check": check}

    exec(f"{stub}\ndef {old}({parameters}): return T_init\nfeedback = check(gated_icp)", space)

    assert (f"Your `{old}` has its parameters" in repr(space["feedback"])) is is_named


def test_html_says_the_same_and_escapes_what_a_student_writes():
    def shouting(theta):
        raise ValueError("<script>alert(1)</script>")

    page = check(named("rotation", shouting))._repr_html_()
    assert "&lt;script&gt;" in page
    assert "<script>" not in page
    assert f"(line {shouting.__code__.co_firstlineno + 1} of its cell)" in page


def test_only_visible_cases_are_asked_and_in_copies():
    seen = []

    def spoiling(source, target):
        seen.append(source.copy())
        answer = right.align(source, target)
        source[:] = 0.0
        return answer

    assert check(named("align", spoiling)).passed
    assert check(named("align", spoiling)).passed
    count = len(load_assignment().visible["align"])
    assert len(seen) == 2 * count
    assert np.array_equal(seen[0], seen[count])


def test_a_case_shows_what_went_in_what_came_out_and_what_should():
    shown = repr(check(named("distance_gate", lambda distances, gate: distances < 3.0)))
    assert "it keeps 1 pair that should go. For distances = [3.5, 1.7, 0.4, 2.2], max_d" in shown
    assert "= 2: at [3] got True, expected False." in shown


def namespace(source):
    names = {"np": np, "labkit": labkit, "overlap": overlap}
    exec(source, names)
    return names


def test_a_function_that_fails_by_an_earlier_one_says_which():
    """Also where that one is called by a helper; never where the earlier one is right."""
    source = (
        "def rotation(a):\n    return np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])\n"
        "def turned(a, p):\n    return rotation(a) @ p\n"
        "def integrate(increments, start):\n"
        "    poses = [np.array(start, dtype=float)]\n"
        "    for one in increments:\n"
        "        poses.append(poses[-1] + np.append(turned(poses[-1][2], one[:2]), one[2]))\n"
        "    return np.array(poses)\n"
    )
    cause = "It uses your `rotation`, which fails its own check: mend that first."
    assert cause in repr(check(named("integrate", namespace(source)["integrate"])))
    right = source.replace("np.sin(a)], [-np", "-np.sin(a)], [np").replace("one[2]))", "0.0))")
    assert "It uses your" not in repr(check(named("integrate", namespace(right)["integrate"])))


@pytest.mark.parametrize("ask", [check, score])
@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("align", "return labkit.align(p, q)"),
        ("align", "from labkit.se2 import wrap\n    return wrap(0.0)"),
        ("align", "return overlap(np.array([1.0]), 0.5)"),
        ("rotation", None),
    ],
)
def test_labkits_own_functions_are_no_answer(ask, name, body):
    """Be it in a helper, or by an import after the student's cell, which replaces it."""
    source = f"def helper(p, q):\n    {body}\ndef align(p, q):\n    return helper(p, q)\n"
    function = namespace(source)[name] if body else labkit.se2.rotation
    with pytest.raises(
        InvalidParameterError,
        match=r"calls labkit's `(align|wrap|overlap|rotation)`, which is not available",
    ):
        ask(named(name, function))


@pytest.mark.parametrize(
    ("returns", "reason"),
    [
        (object, "it returned an object; return numbers, arrays or tuples."),
        (lambda: (x for x in "ab"), "it returned a generator; return"),
        (lambda: 1j * np.eye(2), "it returned complex numbers; return real ones (`.real`?)."),
        (lambda: np.array([object()]), "are its rows of different length?\n"),
        (lambda: np.zeros(3_000_000), "more data than an answer"),
        (lambda: None, "No case passes: it returned None (is a `return` missing?), not a square"),
    ],
)
def test_what_is_no_data_is_explained(returns, reason):
    shown = repr(check(named("rotation", lambda theta: returns())))
    assert reason in f"{shown}\n"
    assert shown.count("\n") == 0, "it is said once"


def test_the_callers_own_mistakes_are_named():
    with pytest.raises(InvalidParameterError, match="asks for a function named 'rotate'"):
        check(named("rotate", lambda theta: theta))
    with pytest.raises(InvalidParameterError, match=r"check\(rotation\), got ndarray"):
        check(right.rotation(0.3))


class Mute(Exception):
    def __str__(self):
        raise KeyError("nothing to say")


@pytest.mark.parametrize(
    ("error", "reason"),
    [(SystemExit(3), "it raised SystemExit: 3 (line"), (Mute(), "Mute (line")],
)
def test_what_a_function_raises_is_a_verdict(error, reason):
    def raising(theta):
        raise error

    assert reason in repr(check(named("rotation", raising)))
    assert score(named("rotation", raising)) == 0.0


ENDLESS = {
    "a plain loop": "while True: pass",
    "what catches errors": "while True:\n        try: sum(range(99))\n        except Exception: 0",
    "a recursion that begins anew": "f = lambda: f()\n    while True:\n        try: f()\n"
    "        except RecursionError: pass",
    "a call that takes long": "while True: np.linalg.svd(np.ones((60, 60)))",
}


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of hypothesis
@pytest.mark.parametrize("loop", ENDLESS.values(), ids=ENDLESS)
@pytest.mark.parametrize("name", ["rotation", "motion_between"])
def test_an_endless_loop_ends_with_a_word(monkeypatch, name, loop):
    """The law: every endless loop in Python ends when the time is over, and nothing comes later."""
    monkeypatch.setattr(checking, "SECONDS", 0.3)
    function = namespace(f"def {name}(*arguments):\n    {loop}\n")[name]
    assert "it took too long; does a loop have no end?" in repr(check(function))
    time.sleep(0.01)
    assert check(named("rotation", right.rotation)).passed


def test_the_time_of_a_compiler_is_not_counted(monkeypatch):
    monkeypatch.setattr(checking, "SECONDS", 0.05)
    names = {"__name__": "numba.core.slow", "time": time, "right": right.rotation}
    source = "def rotation(a):\n    end = time.time() + 0.1\n    while time.time() < end: pass\n"
    exec(source + "    return right(a)\n", names)
    assert check(names["rotation"]).passed


@pytest.mark.parametrize(
    ("name", "body", "hint"),
    [
        ("motion_between", "return a @ np.zeros((7, 2))", "does not multiply (N, 2) points"),
        ("mutual_pairs", "return p[np.array([0.5])]", "are indices and distances exchanged?"),
        ("align_in_space", "return np.eye(3)", "it returned R alone, expected (R, t)"),
        ("icp_by_hand", "return np.eye(2)", "it returned R alone, expected (R, t)"),
        (
            "truncated_square",
            "return np.minimum(a, b) ** 2, 0.5 * a",
            "in result 2 at [0] got 0, expected 1",
        ),
    ],
)
def test_the_usual_slips_are_told_what_they_are(name, body, hint):
    source = f"def {name}(a, b=0, *rest):\n    p = a\n    {body}\n"
    assert hint in repr(check(namespace(source)[name]))


def test_the_students_own_interrupt_ends_the_check():
    def interrupted(theta):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check(named("rotation", interrupted))


def test_the_score_asks_the_hidden_cases_too():
    assert score(named("rotation", right.rotation)) == 3.0
    assert score(named("rotation", transposed)) == 0.0

    def by_heart(theta):
        known = {0.0, round(np.pi / 2, 12), -0.5}
        return right.rotation(theta) if theta in known else np.eye(2)

    assert check(named("rotation", by_heart)).passed
    assert score(named("rotation", by_heart)) == 0.0


def test_the_students_edition_has_no_hidden_cases(tmp_path):
    for name in ("questions.json", "visible.json"):
        (tmp_path / name).write_bytes((FOLDER / name).read_bytes())
    assert read_assignment(tmp_path, hidden=False).cases("rotation")
    with pytest.raises(LabkitError, match="holds no hidden cases: this is the students' edition"):
        read_assignment(tmp_path)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("questions.json", None, "cannot read .*questions.json: No such file"),
        ("visible.json", "[1]", "visible.json: it has format None"),
        ("questions.json", '{"format": 99}', "has format 99, this labkit reads 5"),
    ],
)
def test_a_broken_assignment_is_named(tmp_path, file, content, message):
    for name in ("questions.json", "visible.json"):
        (tmp_path / name).write_bytes((FOLDER / name).read_bytes())
    (tmp_path / file).unlink()
    if content:
        (tmp_path / file).write_text(content, encoding="utf-8")
    with pytest.raises(LabkitError, match=message):
        read_assignment(tmp_path, hidden=False)


def test_an_exercise_that_writes_into_what_it_is_given_is_told_so():
    def icp_by_hand(source, target, T_init, rounds=15):
        T_init[:] = exercises()["icp_by_hand"].right(source, target, T_init, rounds)
        return T_init

    feedback = check(icp_by_hand)
    assert not feedback.passed
    assert "changed an argument in place: T_init; work on a copy" in repr(feedback)
