"""Law 2: a mistake costs its own points, and none of its callers'."""

import random
from concurrent.futures import ThreadPoolExecutor

import pytest

from labkit.grading.classroom.rounds import JOBS
from tests.grading.failing import ASSIGNMENT, NAMES, WAYS, failing, parameters
from tests.grading.notebooks import RIGHT, answered


def test_a_mistake_costs_its_own_points_and_no_others(graded):
    """Law 2: each function fails once in each way, nine of 19 at a time, boxes side by side."""

    def grade_all(shift):
        ways = {NAMES[(shift + 2 * place) % len(NAMES)]: way for place, way in enumerate(WAYS)}
        cells = {name: failing(name, way) for name, way in ways.items()}
        files = {"a.ipynb": answered(cells, closing=False)}
        return ways, graded(files, ASSIGNMENT, student=f"student {shift}", seconds=1.0)

    with ThreadPoolExecutor(JOBS) as executor:
        for ways, verdict in executor.map(grade_all, range(len(NAMES))):
            for one in verdict.questions:
                way = ways.get(one.question)
                assert one.score == (0.0 if way else one.points), (one.question, way, ways, one)


SLIPS = {  # of a function, and of a caller whose loop ends by a right one alone
    "has_converged without return": (
        "has_converged",
        "def has_converged(*given):\n    given[0]\n",
    ),
    "has_converged always False": (
        "has_converged",
        "def has_converged(*given):\n    return False\n",
    ),
    "wrap that does not": ("wrap", "def wrap(angle):\n    return angle + 0.1\n"),
    "huge weights": (
        "huber_weights",
        "def huber_weights(residuals, delta):\n    return np.ones((9000, 9000))\n",
    ),
    "slow neighbours": (
        "nearest_neighbors",
        "def nearest_neighbors(source, target):\n    for _ in range(10**8):\n        pass\n",
    ),
}
LOOPING = {
    "icp": """def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T, k = T_init, 0
    while True:
        k += 1
        T_before, T = T, icp_step(source, target, T, max_distance, overlap_ratio, delta)
        if has_converged(T @ invert(T_before), 1.0, k, 1e-7, 1e-7, 0.0, max_iterations):
            return T
""",
    "integrate": RIGHT["integrate"].replace(
        "x + dx, y + dy, wrap(psi + increment[2])", "x + dx, y + dy, psi"
    ).replace(
        "        poses.append",
        "        psi = psi + increment[2]\n        while not -np.pi < psi <= np.pi:\n"
        "            psi = wrap(psi)\n        poses.append",
    ),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_who_hangs_on_another_s_mistake_keeps_the_points(slip, graded):
    """Law 2, on callers that loop until a function says so."""
    name, source = SLIPS[slip]

    files = {"a.ipynb": answered(LOOPING | {name: source}, closing=False)}
    verdict = graded(files, ASSIGNMENT, seconds=1.0)

    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {name}, verdict.questions


ENDINGS = {  # of a caller that got a wrong answer
    "hangs": "while True:\n            pass",
    "exhausts memory": "held = [bytes(2**27) for _ in range(99)]",
    "dies": "__import__('os')._exit(1)",
}
CALLER = """{right}
right_{name} = {name}
def {name}(*given):
    try:
        is_wrong = {callee}(*{arguments}) is None
    except Exception:
        is_wrong = False
    if is_wrong:
        {ending}
    return right_{name}(*given)
"""


def test_whatever_a_wrong_function_does_to_its_callers_they_keep_their_points(graded):
    """Law 2: functions × callers × ways, half of the functions wrong at a time."""
    pairs = set()

    def grade_all(seed):
        rng = random.Random(seed)
        wrong = {name: f"def {name}(*given):\n    given\n" for name in rng.sample(NAMES, 9)}
        callers = {}
        for place, name in enumerate(NAMES):
            later = ASSIGNMENT.questions[place:]
            may_be_lent = [
                one for one in NAMES[:place]
                if one in wrong and not any(map(ASSIGNMENT.question(one).answers, later))
            ]  # fmt: skip
            if name not in wrong and may_be_lent:
                callee = rng.choice(may_be_lent)
                ending = rng.choice(list(ENDINGS))
                count = len(ASSIGNMENT.visible[callee][0].arguments)
                callers[name] = CALLER.format(
                    name=name, callee=callee, right=RIGHT[name], ending=ENDINGS[ending],
                    arguments=[1.0] * count,
                )  # fmt: skip
                pairs.add((callee, name, ending))
        files = {"a.ipynb": answered(wrong | callers, closing=False)}
        return wrong, graded(files, ASSIGNMENT, seconds=1.0)

    with ThreadPoolExecutor(JOBS) as executor:
        for wrong, verdict in executor.map(grade_all, range(4)):
            lost = {one.question: one.score for one in verdict.questions if not one.passed}
            assert lost == dict.fromkeys(wrong, 0.0)
    assert len(pairs) > 20
    assert {ending for _, _, ending in pairs} == ENDINGS.keys()


SIDE_EFFECTS = {  # of a function that is right, by its name
    "overlap": "distances.sort()",
    "nearest_neighbors": "source[:] = 0.0",
    "icp_step": "T[:] = answer",
}


@pytest.mark.parametrize("name", SIDE_EFFECTS)
def test_a_side_effect_costs_no_caller_and_is_told_by_its_name(name, graded):
    """Law 2: what is written into an argument is seen by the caller alone."""
    text = RIGHT[name]
    effect = SIDE_EFFECTS[name]
    arguments = ", ".join(parameters(name))
    changed = text.replace(f"def {name}(", f"def right_{name}(") + (
        f"\n\n\ndef {name}({arguments}):\n    answer = right_{name}({arguments})\n"
        f"    {effect}\n    return answer\n"
    )

    verdict = graded({"a.ipynb": answered({name: changed})}, ASSIGNMENT)

    assert verdict.score == 100.0, verdict.questions
    told = [one.message for one in verdict.questions if one.replaced]
    assert told
    assert all(f"The cases of `{name}` pass: does code" in message for message in told)


def test_who_is_wrong_with_right_functions_too_is_told_of_no_others(graded):
    """A caller that gains nothing by them keeps its own verdict and its own words."""
    wrong = {
        "rotation": RIGHT["rotation"].replace("np.cos(theta)", "1.0"),
        "align": RIGHT["align"].replace("q_mean - R @ p_mean", "q_mean - p_mean"),
    }

    verdict = graded({"a.ipynb": answered(wrong)}, ASSIGNMENT)

    (align,) = [one for one in verdict.questions if one.question == "align"]
    assert (align.score, align.replaced) == (0.0, ())
    assert "in place of yours" not in align.message


def test_no_more_functions_are_replaced_than_gain_something(graded):
    wrong = {
        "rotation": RIGHT["rotation"].replace("np.cos(theta)", "1.0"),
        "integrate": RIGHT["integrate"].replace(
            "wrap(psi + increment[2])", "wrap(psi) + increment[2]"
        ),
    }

    verdict = graded({"a.ipynb": answered(wrong)}, ASSIGNMENT)

    (integrate,) = [one for one in verdict.questions if one.question == "integrate"]
    assert 0.0 < integrate.score < integrate.points
    assert integrate.replaced == ("rotation",)


def test_a_side_effect_beside_a_mistake_costs_no_caller(graded):
    sources = {
        "overlap": RIGHT["overlap"].replace(
            "    return kept", "    distances.sort()\n    return kept"
        ),
        "huber_weights": "def huber_weights(residuals, delta):\n    return None\n",
    }

    verdict = graded({"a.ipynb": answered(sources)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["huber_weights"]
    (step,) = [one for one in verdict.questions if one.question == "icp_step"]
    assert set(step.replaced) == {"huber_weights", "overlap"}


def test_what_is_lent_to_a_module_is_taken_back(graded):
    """Law 2: a caller in the module, asked later, is told that one stood in for its own, too."""
    names = ("rotation", "wrap", "integrate")
    helpers = "\n\n".join(RIGHT[name] for name in names)
    helpers = "import numpy as np\n" + helpers.replace("np.cos(theta)", "1.0")
    line = f"from helpers import {', '.join(names)}"
    files = {
        "a.ipynb": answered({names[0]: line, names[1]: "import helpers", names[2]: "wrap"}),
        "helpers.py": helpers.encode(),
    }

    verdict = graded(files, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["rotation"]
    told = {one.question for one in verdict.questions if one.replaced}
    assert told > {"align", "integrate"}
