"""The promises of the grading as laws: each test makes its cases from the assignment.

1. No clock decides a mark.
2. A mistake costs its own points, and none of its callers'.
3. Whatever loses hidden points fails a visible case (`tests/course/authoring`).
4. An honest style costs nothing (`test_styles.py`).
5. What a person wrote stays (`classroom`).
6. Hostile files cost nobody else time or points.

And nothing that is still to be asked lies in a box, nor is its word taken once it was asked.
"""

import ast
import io
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from labkit.course.assignment import load_assignment
from labkit.grading import grade as grading
from labkit.grading import sitting
from labkit.grading.box.inside import data
from labkit.grading.box.inside.reading import read_program
from labkit.grading.box.outside import Box, Wall
from labkit.grading.box.watch import BoxError, MachineError
from labkit.grading.command import JOBS
from labkit.grading.questions import read_assignment
from tests.grading.notebooks import HANDED_OUT, RIGHT, answered, cell, notebook
from tests.grading.small import HANGS, SQUARED, hand_in, scores
from tests.grading.small import RIGHT as RIGHT_NUMBERS

ASSIGNMENT = load_assignment()
ORDERS = []
NAMES = [one.function for one in ASSIGNMENT.questions]


# How a function fails: its body, or with a leading line break what stands before its definition.
WAYS = {
    "endless loop": "while True:\n        pass",
    "endless recursion": "return {name}(*given)",
    "exit": "__import__('os')._exit(0)",
    "segmentation fault": "__import__('ctypes').string_at(0)",
    "too much memory": "held = [bytes(2**27) for _ in range(99)]",
    "exception at its definition": "\n1 / 0\n",
    "syntax error in its own cell": "return (",
    "None": "return None",
    "wrong answer": "return np.full(7, 0.125)",
}


def failing(name, way):
    """The cell of a function that fails in some way."""
    before, body = (WAYS[way], "pass") if WAYS[way].startswith("\n") else ("", WAYS[way])
    return f"{before}def {name}(*given):\n    {body.format(name=name)}\n"


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


class Liar:
    """A box whose answers are all wrong, and which claims to call every function."""

    def __init__(self, wall, seconds):
        self.said = []

    def send(self, allowed, attached=b"", **order):
        calls = [name for name in NAMES if name != "wrap"]
        told = {"states": [0, 1], "calls": calls}
        if "sizes" in order:
            self.said.append(read_program({"a.py": attached}, NAMES)._asdict())
        elif "cells" in order:
            self.said += [{}, {"notes": [], "faults": {}, "answers": dict.fromkeys(NAMES, told)}]
        else:
            ORDERS.append(order)
            self.said += [{"value": None}] * len(order["calls"])

    def receive(self, most=0):
        return self.said.pop(0)

    def processor_time(self):
        return 0.0

    def allow(self, seconds):
        pass

    def close(self):
        pass


def test_in_the_box_lies_nothing_that_is_still_to_be_asked(monkeypatch):
    """On every order that the most that can be lent leads to."""
    monkeypatch.setattr(sitting, "Box", Liar)
    ORDERS.clear()
    grading.grade_submission({"a.py": b"def rotation(): 0"}, Wall("none"), ASSIGNMENT, "ada")
    lent = [order for order in ORDERS if order.get("replacements")]
    assert {name for order in lent for name in order["replacements"]} == {*NAMES[:-1]} - {"wrap"}
    visible = [[data.to_json(argument) for argument in case.arguments]
               for cases in ASSIGNMENT.visible.values() for case in cases]  # fmt: skip
    is_hidden = [one["calls"][0] not in visible for one in ORDERS]
    assert is_hidden == sorted(is_hidden)
    places = [NAMES.index(one["function"]) for one in ORDERS[is_hidden.index(True) :]]
    assert places == sorted(places)
    for order in lent:
        place = NAMES.index(order["function"])
        assert is_hidden[ORDERS.index(order)]
        for name, source in order["replacements"].items():
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


BINDINGS = {  # how a caller reaches another function: what stands above it, and how it calls
    "name": ("", "{name}"),
    "alias": ("use_{name} = {name}", "use_{name}"),
    "default": ("def use_{name}(*given, own={name}):\n    return own(*given)", "use_{name}"),
    "dict": ("tools_{name} = {{'own': {name}}}", "tools_{name}['own']"),
    "partial": ("import functools\nuse_{name} = functools.partial({name})", "use_{name}"),
    "method": ("class Use_{name}:\n    run = staticmethod({name})", "Use_{name}().run"),
    "closure": ("use_{name} = (lambda own: lambda *given: own(*given))({name})", "use_{name}"),
    "keywords": ("", "(lambda *given: {name}(**dict(zip({parameters}, given))))"),
    "another file": ("import helpers", "helpers.{name}"),
    "name of another file": ("from helpers import {name} as use_{name}", "use_{name}"),
}
CALLEES = ("rotation", "nearest_neighbors", "huber_weights")
WRONG = {
    "returns nothing": "def {name}({parameters}):\n    None\n",
    "returns one number": "def {name}({parameters}):\n    return 0.125\n",
    "is no function": "class Own:\n    def __call__(self, {parameters}):\n        pass\n"
    "{name} = Own()\n",
    "cannot be parsed": "def {name}(:\n",
}


def parameters(name):
    return ASSIGNMENT.question(name).signature.strip("()").split(", ")


def bind(source, binding):
    """The source of a caller that reaches other functions in some way."""
    for name in CALLEES:
        above, call = (
            part.format(name=name, parameters=parameters(name)) for part in BINDINGS[binding]
        )
        if f"{name}(" in source:
            source = above + "\n" + source.replace(f"{name}(", f"{call}(")
    return source


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("binding", BINDINGS)
def test_however_a_wrong_function_is_bound_its_callers_keep_their_points(binding, wrong, graded):
    """Law 2: ways to bind × ways to be wrong, for three functions that others call."""
    if "file" in binding and wrong == "cannot be parsed":
        pytest.skip("a file without the function cannot be asked for it")
    sources = {
        name: WRONG[wrong].format(name=name, parameters=", ".join(parameters(name)))
        for name in CALLEES
    }
    helpers = "\n".join(["import numpy as np", *sources.values()]).encode()
    callers = {name: bind(RIGHT[name], binding) for name in RIGHT if name not in CALLEES}
    files = {"a.ipynb": answered(sources | callers, closing=False), "helpers.py": helpers}

    verdict = graded(files, ASSIGNMENT)

    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {*CALLEES}, [one for one in verdict.questions if not one.passed]


OTHERWISE = {  # where a function is defined that is then assigned to its name, and how it is called
    "first name": ("def search(source, target):\n    pass\n", "search"),
    "static method": (
        "class Tools:\n    @staticmethod\n    def search(source, target):\n        pass\n",
        "Tools.search",
    ),
    "method": (
        "class Tools:\n    def search(self, source, target):\n        pass\n",
        "Tools().search",
    ),
}


@pytest.mark.parametrize("place", OTHERWISE)
def test_where_a_wrong_function_is_defined_is_all_one_to_its_callers(place, graded):
    """Law 2: they call it there, and not by the name that is asked for."""
    definition, call = OTHERWISE[place]
    changed = {
        "nearest_neighbors": f"{definition}nearest_neighbors = {call}\n",
        "icp_step": RIGHT["icp_step"].replace("nearest_neighbors(", f"{call}("),
    }

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["nearest_neighbors"]


NAMESAKE = """class Pose:
    def __init__(self, T):
        self.T = T
    def invert(self):
        return Pose(np.linalg.inv(self.T))
def invert(T_a_b):
    return 7.0
"""


def test_a_method_with_the_name_of_a_question_stays_the_student_s_own(graded):
    """Law 2: a wrong function of that name is another one."""
    last = "(invert(T_before), Pose(T_before).invert().T)[1]"
    changed = {"invert": NAMESAKE, "icp": RIGHT["icp"].replace("invert(T_before)", last)}

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["invert"]


def test_who_shares_a_word_with_an_experiment_does_not_hang_on_what_that_mentions(graded):
    """Law 2: the inverse reads `R.T`, and `T` is an array of an experiment."""
    changed = {"has_converged": "def has_converged(*given):\n    while True:\n        pass\n"}
    experiment = "T = np.eye(3) if callable(has_converged) else None"
    files = {"a.ipynb": answered(changed, before=(experiment,), closing=False)}

    verdict = graded(files, ASSIGNMENT, seconds=1.0)

    assert [one.question for one in verdict.questions if not one.passed] == ["has_converged"]


def test_a_package_s_function_that_is_taken_for_an_answer_stays_what_it_is(graded):
    """Law 2: a right one acts in place of the answer, and not where the package's is called."""
    changed = {
        "rotation": "from numpy import eye\nrotation = eye\n",
        "icp_step": RIGHT["icp_step"].replace("np.eye(3)", "eye(3)"),
    }

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["rotation"]


FORMS = {  # accepted forms of answers: from the usual one, and back from this form alone
    "rows": ("rotation", "value.tolist()", "np.array(value[0] + value[1]).reshape(2, 2)"),
    "tuples": ("rotation", "tuple(map(tuple, value))",
               "np.reshape((*value[0], *value[1]), (2, 2))"),
    "matrix": ("align_weighted", "np.block([[value[0], value[1][:, None]], [0, 0, 1]])",
               "(value[:2, :2], value[:2, 2])"),
    "dict": ("align_weighted", "{'R': value[0], 't': value[1]}", "(value['R'], value['t'])"),
    "column": ("align_weighted", "(value[0], value[1][:, None])", "(value[0], value[1][:, 0])"),
    "pair": ("icp_step", "[value[:2, :2], value[:2, 2]]",
             "np.block([[value.pop(0), value.pop(0)[:, None]], [0, 0, 1]])"),
    "lists": ("nearest_neighbors", "[part.tolist() for part in value]",
              "tuple(np.array(part + []) for part in value)"),
    "one array": ("nearest_neighbors", "np.array(value)",
                  "(value[0].astype(int), value[1, :])"),
    "ones": ("distance_gate", "value.astype(int)", "np.array([False, True])[value * 1]"),
    "list": ("huber_weights", "value.tolist()", "np.array(value + [])"),
}  # fmt: skip
IN_FORM = """right_{name} = {name}
def {name}(*given):
    value = right_{name}(*given)
    value = (value[0], value[1] + 1) if isinstance(value, tuple) else 1 - value
    return {form}
def use_{name}(*given):
    value = {name}(*given)
    return {back}
"""


@pytest.mark.parametrize("form", FORMS)
def test_a_right_function_answers_its_callers_in_the_form_of_the_wrong_one(form, graded):
    """Law 2: whoever takes another accepted form from a wrong function keeps the points."""
    name, there, back = FORMS[form]
    wrong = IN_FORM.format(name=name, form=there, back=back)
    callers = {
        other: source.replace(f"{name}(", f"use_{name}(")
        for other, source in RIGHT.items()
        if other != name
    }
    files = {"a.ipynb": answered(callers | {name: RIGHT[name] + wrong}, closing=False)}

    verdict = graded(files, ASSIGNMENT)

    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {name}, [one for one in verdict.questions if not one.passed]


WAITS = "import threading\ndef double(x):\n    threading.Event().wait(99)\nnegate = double\n"
DRAWS = "import random\nimport numpy as np\ndef double(x):\n    return np.random.rand()\n"
DRAWS += "def negate(x):\n    return random.random()\n"
WORKS = "def double(x):\n    return sum(2 * x for _ in range(300_000)) / 300_000\nnegate = double\n"


def test_a_verdict_is_the_same_beside_a_load(graded, small):
    """Law 1, on what never ends, what waits, and what takes some of its time."""
    assignment = read_assignment(small)
    hands_in = [text.encode() for text in (SQUARED, HANGS, WAITS, WORKS, DRAWS)]

    def verdicts():
        found = [graded({"a.py": text}, assignment, seconds=0.5) for text in hands_in]
        return [replace(one, seconds=0.0) for one in found]

    alone, computes = verdicts(), [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(computes) for _ in range(4 * (os.cpu_count() or 1))]
    try:
        assert verdicts() == alone
    finally:
        for one in busy:
            one.kill()
            one.wait()


SLOW = """import time
def double(x):
    end = time.process_time() + {seconds}
    while x > 2.5 and time.process_time() < end:
        pass
    return 2 * x
def negate(x):
    return -x
"""


def test_what_is_slow_is_asked_again_with_more_time(graded, small):
    """Law 1: visible cases pass, and a hidden one takes three times as long as a call may."""
    source = SLOW.format(seconds=1.5)

    verdict = graded({"a.py": source.encode()}, read_assignment(small), seconds=0.5)

    assert verdict.score == 5.0, verdict.questions


def test_what_takes_too_long_is_told_so_and_not_called_wrong(graded, small):
    """Law 1."""
    source = SLOW.format(seconds=99.0)

    double, negate = graded(
        {"a.py": source.encode()}, read_assignment(small), seconds=0.5
    ).questions

    slow = [case for case in double.cases if not case.passed]
    assert {case.status for case in slow} == {"too long"}
    is_first = ["it took too long" in case.reason for case in slow]
    assert is_first == [True, *[False] * len(slow[1:])]
    assert all("it was not tried" in case.reason for case in slow[1:])
    assert negate.passed


LOOPS = {  # each answer right, and as slow as plain loops are
    "nearest_neighbors": """def nearest_neighbors(source, target):
    indices, distances = [], []
    for p in source:
        gaps = []
        for q in target:
            gaps.append(np.linalg.norm(np.array(p) - np.array(q)))
        indices.append(int(np.argmin(gaps)))
        distances.append(min(gaps))
    return np.array(indices), np.array(distances)
""",
    "icp": """def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T = T_init
    for _ in range(max_iterations):
        T = icp_step(source, target, T, max_distance, overlap_ratio, delta)
    return T
""",
}  # fmt: skip


def test_a_program_of_plain_loops_earns_all_points_each_time(graded):
    """Law 1, idle and beside a load."""
    files = {"a.ipynb": answered(LOOPS, closing=False)}

    with ThreadPoolExecutor(8) as executor:
        verdicts = list(executor.map(lambda _: graded(files, ASSIGNMENT), range(8)))

    assert [one.score for one in verdicts] == [100.0] * 8


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows knows no SIGSTOP")
def test_a_grader_that_is_stopped_takes_no_points(options, tmp_path):
    """Law 1: stopped twice, while boxes are at work, for longer than a box may sleep."""
    hand_in(tmp_path / "class", 0)
    for number in range(24):
        (tmp_path / "class" / f"s{number}.py").write_text(SLOW.format(seconds=0.4))
    start = (
        f"import sys\nfrom labkit.cli import main\n"
        f"sys.modules['labkit.cli.main'].FOLDER = {options[2] + '.cases'!r}\n"
        f"main({[*options, 'class']})"
    )

    with subprocess.Popen([sys.executable, "-c", start], cwd=tmp_path) as run:
        for count in (2, 12):
            while len(list((tmp_path / "grades").glob("verdicts/*"))) < count:
                assert run.poll() is None
                time.sleep(0.02)
            run.send_signal(signal.SIGSTOP)
            time.sleep(8.0)
            run.send_signal(signal.SIGCONT)

    assert scores(tmp_path / "grades") == {f"s{number}": 5.0 for number in range(24)}


def test_a_machine_s_failure_is_tried_again_told_and_not_stored(
    grade, tmp_path, monkeypatch, capsys
):
    """Law 1."""
    hand_in(tmp_path / "class", 2)
    tries = []

    def busy(box):
        tries.append(box)
        raise MachineError("this machine was too busy")

    monkeypatch.setattr(Box, "receive", busy)
    monkeypatch.setattr("labkit.grading.command.open_wall", lambda *_, **__: Wall("none"))
    assert grade("class") == 1
    assert len(tries) == 4
    says = "student00001 was not graded: MachineError: the box did not start: this"
    assert says in capsys.readouterr().err
    assert not list((tmp_path / "grades/verdicts").iterdir())


class Ending(Liar):
    """A box that every cell ends at once."""

    count = 0

    def __init__(self, wall, seconds):
        super().__init__(wall, seconds)
        Ending.count += 1

    def send(self, allowed, attached=b"", **order):
        if "sizes" in order:
            self.said = [read_program({"a.ipynb": attached}, NAMES)._asdict()]

    def receive(self, most=0):
        if not self.said:
            raise BoxError("the program ended")
        return self.said.pop()


def test_who_ends_every_box_gets_no_box_for_ever(monkeypatch):
    """Law 6: 900 cells that end the program once held a class for a quarter of an hour."""
    monkeypatch.setattr(sitting, "Box", Ending)
    files = {"a.ipynb": notebook([cell("import os\nos._exit(0)")] * 900)}

    verdict, _ = grading.grade_submission(files, Wall("none"), ASSIGNMENT, "ada")

    assert verdict.score == 0.0
    assert 50 < Ending.count < 150


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


def zipped(name, data):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return buffer.getvalue()


def zipped_all(files):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files:
            archive.writestr(name, data)
    return buffer.getvalue()


CELL = {"cell_type": "code", "source": "def double(x): return 2 * x"}
THREADS = (
    "import threading\nthreading.stack_size(32768)\n"
    "for _ in range(8000):\n    threading.Thread(target=threading.Event().wait).start()\n"
)
SPEAKING = (
    "import gc, os, threading\n"
    "own = next(one for one in gc.get_objects() if type(one).__name__ == 'Session')\n"
    "def say():\n    while True:\n        os.write(own.writing, {words})\n"
    "threading.Thread(target=say, daemon=True).start()\n"
)
HOSTILE = {  # each once held up its neighbours
    "flood.py": SPEAKING.format(words="b'{\"cell\": 0}\\n'") + RIGHT_NUMBERS,
    "drip.py": SPEAKING.format(words="b' '") + RIGHT_NUMBERS,
    "answers.py": SPEAKING.format(words="b'{\"answers\": {}}\\n'") + RIGHT_NUMBERS,
    "brackets.zip": zipped("a.ipynb", b'{"cells": [' + b"[[[[[1]]]]]," * (2 << 20) + b"1]}"),
    "deep.zip": zipped("a.ipynb", b"[" * (20 << 20)),
    "notebooks.zip": zipped_all(
        (f"{k}.ipynb", json.dumps({"cells": [CELL] * 999})) for k in range(300)
    ),
    "threads.py": THREADS + RIGHT_NUMBERS,
    "cells.zip": zipped("a.ipynb", json.dumps({"cells": [{"cell_type": "code"}] * 900_000})),
}


def test_who_takes_long_is_graded_when_all_others_have_their_results(grade, tmp_path, monkeypatch):
    """Law 6; on a slow machine honest ones may take long, too."""
    expected = hand_in(tmp_path / "class", 3)
    source = HANGS.replace("return -x", "while True:\n        pass")
    (tmp_path / "class/hangs.py").write_text(source, encoding="utf-8")
    found_before = {}

    def note(submission, *arguments, in_full, real=grading.grade_one):
        if in_full:
            found_before[submission.student] = scores()
        return real(submission, *arguments, in_full=in_full)

    monkeypatch.setattr("labkit.grading.command.grade_one", note)

    assert grade("class") == 0

    others = {
        student: points for student, points in expected.items() if student not in found_before
    }
    assert found_before["hangs"] == others
    assert scores() == {**expected, "hangs": 0.0}


def test_beside_hostile_hand_ins_honest_ones_keep_their_marks(grade, tmp_path):
    """Law 6."""
    expected = hand_in(tmp_path / "class", 8)
    for name, content in HOSTILE.items():
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / "class" / name).write_bytes(data)
    assert grade("class") == 0
    found = scores()
    assert {student: found[student] for student in expected} == expected
    assert len(found) == 8 + len(HOSTILE)
