"""Files, cells and calls: who is blamed for what, and that the rest goes on."""

import textwrap
import time

import numpy as np
import pytest
from small import FILES, FUNCTIONS

from labkit.course.grading.contract import Call, Limits, OutcomeStatus, SourceCell
from labkit.course.grading.extraction.extract import extract
from labkit.course.grading.sandbox.host import open_sandbox, session
from labkit.errors import InvalidParameterError

RETURNED, RAISED, TIMEOUT, KILLED, TOO_LARGE, NOT_DATA, NOT_DEFINED, SOURCE_FAILED = OutcomeStatus
ONE = "def one(x):\n    return x + 1"
TWO = "def two(x):\n    return x + 2"


def cells(*sources):
    """Cells in order: text is shared, (question, text) belongs to a question."""
    given = [(None, one) if isinstance(one, str) else one for one in sources]
    return [
        SourceCell(source=textwrap.dedent(text), question=question, label=f"cell {place}")
        for place, (question, text) in enumerate(given, start=1)
    ]


def call(function, *arguments, id=None, **keywords):
    return Call(
        id=id or function,
        question=function,
        function=function,
        arguments=arguments or (1.0,),
        keywords=keywords,
    )


def test_values_go_in_and_come_out(sandbox):
    source = """
        def everything(points, pair, gate, /, *, limits):
            assert type(points).__name__ == "ndarray" and type(pair) is tuple
            points[0] = -1.0
            return {"points": points, "same": (pair, gate, limits), "none": None}
    """
    points = np.arange(6.0).reshape(3, 2)
    asked = [
        call("everything", points, (1, "a"), 0.5, id=name, limits={"most": np.array([True])})
        for name in ("first", "second")
    ]
    for outcome in sandbox.run(cells(source), asked):
        assert outcome.status is RETURNED, outcome
        assert outcome.value["points"].tolist() == [[-1.0, -1.0], [2.0, 3.0], [4.0, 5.0]]
        assert outcome.value["same"][:2] == ((1, "a"), 0.5)
        assert outcome.value["same"][2]["most"].tolist() == [True]
    assert points[0].tolist() == [0.0, 1.0], "the grader's own array was changed"


def test_nothing_to_run_is_no_mistake(slot):
    assert slot.run([], []) == []
    (outcome,) = slot.run([], [call("one")])
    assert (outcome.status, outcome.message) == (NOT_DEFINED, "`one` is not defined")


def test_two_calls_of_one_id_are_the_caller_s_mistake(slot):
    with pytest.raises(InvalidParameterError, match="different ids, got 'one' twice"):
        slot.run([], [call("one"), call("one")])


def test_submissions_share_nothing(sandbox):
    sandbox.run(cells("import numpy\nnumpy.left = 1\nopen('left', 'w').close()"), [call("one")])
    look = "import os, numpy\ndef one(x):\n    return hasattr(numpy, 'left'), os.listdir('.')"
    (outcome,) = sandbox.run(cells(look), [call("one")])
    assert outcome.value == (False, ())


def test_an_error_says_where_in_the_student_s_code(slot):
    source = """
        def helper(x):
            return {}[x]
        def one(x):
            return sorted([x], key=helper)
    """
    (outcome,) = slot.run(cells("", source), [call("one")])
    assert outcome.status is RAISED
    assert outcome.message == "KeyError: 1.0 (line 3 of cell 2)"
    assert outcome.error == "KeyError"
    assert outcome.unrevealing_message == "it raised KeyError"


def test_a_script_is_imported_when_a_cell_asks_for_it(sandbox):
    script = SourceCell(
        source="from . import b\ndef f(x):\n    return b.one / x",
        question=None, label="lab/a.py", modules=("lab.a", "a"),
    )  # fmt: skip
    other = SourceCell(source="one = 1", question=None, label="lab/b.py", modules=("lab.b", "b"))
    outcomes = sandbox.run([script, other, *cells("from lab.a import f")], [call("f", 2)])
    assert outcomes[0].value == 0.5
    (outcome,) = sandbox.run([script, other, *cells("from a import f")], [call("f", 2)])
    assert "attempted relative import" in sandbox.faults[0].message
    assert "line 1 of lab/a.py" in sandbox.faults[0].message
    assert outcome.status is OutcomeStatus.SOURCE_FAILED


def test_an_error_s_own_name_and_text_stay_out_of_a_hidden_case(slot):
    source = "def one(x):\n    raise type(f'Hidden{x}', (Exception,), {})(f'{x}')"
    (outcome,) = slot.run(cells(source), [call("one", 17.25)])
    assert "17.25" in outcome.message
    assert outcome.unrevealing_message == "it raised an error"


def test_what_is_printed_is_kept_and_cut(slot):
    source = "def one(x):\n    print('é' * 10)\n    print('a' * 10**6)\n    return x"
    before = "print('not mine')"
    (outcome,) = slot.run(cells(before, source), [call("one")])
    assert outcome.output.startswith("é" * 10 + "\naaaa")
    assert len(outcome.output) == slot.limits.output_chars


def test_a_cell_that_fails_costs_its_question_alone(sandbox):
    broken = ("one", "def one(x):\n    return x +")
    one, two = sandbox.run(cells(broken, ("two", TWO)), [call("one"), call("two")])
    assert one.status is SOURCE_FAILED
    assert one.message.startswith("SyntaxError: invalid syntax")
    assert one.message.endswith("(line 2 of cell 1)")
    assert (one.error, two.value) == ("SyntaxError", 3.0)


def test_a_definition_counts_though_its_cell_fails_later(slot):
    (outcome,) = slot.run(cells(("one", ONE + "\nassert one(1) == 3")), [call("one")])
    assert outcome.value == 2.0


def test_a_file_that_fails_as_a_whole_says_why(slot):
    (outcome,) = slot.run(cells("import torch\n" + ONE), [call("one")])
    assert outcome.status is SOURCE_FAILED
    assert outcome.message == "ModuleNotFoundError: No module named 'torch' (line 1 of cell 1)"


def test_a_name_that_is_missing_is_not_blamed_on_another_s_cell(slot):
    written = cells(("one", ONE), ("two", "1 / 0"), ("three", "pass"))
    one, three = slot.run(written, [call("one"), call("three")])
    assert (one.status, three.status) == (RETURNED, NOT_DEFINED)


@pytest.mark.parametrize(
    ("end", "status", "message"),
    [
        ("while True: pass", TIMEOUT, "cell 2: it took longer than 0.6 s"),
        ("import os; os._exit(3)", KILLED, "cell 2: the program ended itself"),
    ],
)
def test_a_cell_that_hangs_or_dies_costs_its_question_alone(sandbox, end, status, message):
    written = cells(
        "import numpy as np\nstep = 2",
        ("one", f"def one(x):\n    return x + step\n{end}"),
        ("two", "def two(x):\n    return one(x) + 1"),
    )
    one, two = sandbox.run(written, [call("one"), call("two")])
    assert (one.status, one.message) == (status, message)
    assert two.value == 4.0, "another question may use what the cell defines"


def test_a_shared_cell_that_hangs_keeps_its_definitions(slot):
    one, two = slot.run(cells(ONE + "\nwhile True: pass", TWO), [call("one"), call("two")])
    assert (one.value, two.value) == (2.0, 3.0)


def test_a_cell_whose_definitions_hang_too_is_left_out(slot):
    hanging = "class Body:\n    while True: pass\ndef one(x): return x"
    one, two = slot.run(cells(hanging, TWO), [call("one"), call("two")])
    assert one.status is TIMEOUT
    assert two.value == 3.0


@pytest.mark.parametrize(
    ("body", "status", "message"),
    [
        ("while x > 1: pass", TIMEOUT, "it took longer than 0.6 s"),
        ("if x > 1: __import__('os')._exit(0)", KILLED, "the program ended itself"),
    ],
)
def test_what_was_answered_before_a_hang_or_crash_counts(sandbox, body, status, message):
    source = f"def two(x):\n    {body}\n    return x"
    asked = [call("two", float(x), id=str(x)) for x in (0, 1, 2, 3)]
    *good, ending, rest, last = sandbox.run(cells(ONE, source), [*asked, call("one")])
    assert [outcome.value for outcome in good] == [0.0, 1.0]
    assert (ending.status, ending.message) == (rest.status, rest.message) == (status, message)
    assert last.value == 2.0


def test_a_crash_is_named_by_its_signal(slot):
    source = "import ctypes\ndef one(x):\n    ctypes.string_at(0)"
    (outcome,) = slot.run(cells(source), [call("one")])
    assert (outcome.status, outcome.message) == (KILLED, "the program crashed (SIGSEGV)")


def test_what_one_question_leaves_behind_does_not_count_against_another(slot):
    source = """
        import os, threading, time
        def one(x):
            threading.Timer(0.05, os._exit, [0]).start()
            return x
        def two(x):
            time.sleep(0.2)
            return x + 2
    """
    one, two = slot.run(cells(source), [call("one"), call("two")])
    assert (one.value, two.value) == (1.0, 3.0)


def test_memory_is_limited_and_what_is_allowed_is_there(open_slot):
    source = "def one(x):\n    return len(bytearray(int(x)))"
    with open_slot(Limits(memory=200 << 20)) as slot:
        little, much = slot.run(
            cells(source), [call("one", 150e6, id="little"), call("one", 250e6, id="much")]
        )
    assert little.value == 150_000_000
    assert (much.status, much.error) == (RAISED, "MemoryError")


def test_the_submission_as_a_whole_has_its_time(open_slot):
    hanging = [(f"q{i}", f"def q{i}(x):\n    while True: pass") for i in range(4)]
    with open_slot(Limits(seconds=0.5, total_seconds=1.2)) as slot:
        start = time.monotonic()
        outcomes = slot.run(cells(*hanging), [call(f"q{i}") for i in range(4)])
    assert [outcome.status for outcome in outcomes] == [TIMEOUT] * 4
    assert outcomes[-1].message == "the submission as a whole took longer than 1.2 s"
    assert time.monotonic() - start < 10.0


def test_results_are_limited_by_the_question(open_slot):
    source = "import numpy as np\ndef one(n):\n    return np.zeros(int(n))"
    with open_slot(Limits(result_bytes=10_000)) as slot:
        first, second, third = slot.run(
            cells(source), [call("one", n, id=str(n)) for n in (600.0, 700.0, 10.0)]
        )
    assert (first.status, second.status, third.status) == (RETURNED, TOO_LARGE, RETURNED)
    assert second.message == "returned more data than an answer to this question can need"


@pytest.mark.parametrize(("size", "status"), [(3_000_000, RETURNED), (20_000_000, SOURCE_FAILED)])
def test_a_submission_may_be_long_and_not_absurd(slot, size, status):
    (outcome,) = slot.run(cells(f"{ONE}\n{'#' * size}"), [call("one")])
    assert outcome.status is status
    if status is SOURCE_FAILED:
        assert outcome.message == "the submission holds more than 16 million characters of code"


def test_plots_widgets_bars_and_prompts_do_no_harm(slot):
    source = """
        import matplotlib.pyplot as plt
        import ipywidgets as widgets
        from IPython.display import display, HTML
        from mpl_toolkits.mplot3d import Axes3D
        from tqdm.auto import tqdm
        from numba import njit
        import labkit
        from labkit.course.grading import check
        fig, ax = plt.subplots(figsize=(3, 3))
        fig, ((a, b), (c, d)) = plt.subplots(2, 2)
        line, = ax.plot([1, 2], [3, 4], "o")
        ax.set(title="scan", xlabel=f"{1} m")
        plt.rcParams["figure.dpi"] = 100
        with plt.style.context("ggplot"):
            plt.show()
        get_ipython().run_line_magic("matplotlib", "inline")
        display(HTML("<b>hello</b>"))
        class Panel(widgets.VBox):
            pass
        @widgets.interact(x=(0, 1))
        def show(x):
            ax.clear()
        @njit(cache=True)
        def slow(x):
            return sum(i for i in tqdm(range(int(x) + 3)))
        check("one", slow)
        labkit.plotting.plot_scan(labkit.Scan([[0, 0]]))
        def one(x):
            return slow(x)
        try:
            answer = input("ready?")
        except EOFError:
            answer = "no"
        def two(x):
            return answer
    """
    one, two = slot.run(cells(source), [call("one"), call("two")])
    assert (one.value, two.value) == (6, "no"), one


def test_labkit_itself_does_not_answer(slot):
    source = "import labkit\none = labkit.wrap\ndef two(x):\n    return labkit.se2.wrap(x)"
    for outcome in slot.run(cells(source), [call("one"), call("two")]):
        assert outcome.status is NOT_DATA
        assert "stands in for labkit." in outcome.message


def test_what_a_student_may_import_is_there(patient_sandbox):
    source = """
        import asyncio, bisect, cmath, collections.abc, concurrent.futures, csv, dataclasses
        import datetime, decimal, enum, fractions, functools, heapq, json, logging, math
        import multiprocessing, pickle, random, re, statistics, string, tempfile, typing
        import xml.etree.ElementTree, zipfile, zlib, hashlib, struct, array, mmap, ctypes
        import urllib.request, subprocess, unittest.mock, graphlib, tomllib, colorsys
        import numpy as np, numpy.linalg as la, numpy.testing as npt
        from numpy.polynomial import Polynomial
        from dataclasses import dataclass
        @dataclass(frozen=True)
        class Pose:
            x: float
        def one(x):
            npt.assert_allclose(la.norm([3.0, 4.0]), 5.0)
            with tempfile.TemporaryFile() as file:
                np.save(file, np.arange(3.0))
                file.seek(0)
                return Pose(x).x + np.load(file).sum() + statistics.mean([1, 2, 3])
    """
    (outcome,) = patient_sandbox.run(cells(source), [call("one")])
    assert outcome.value == 6.0, outcome


def test_scipy_is_there(slot):
    pytest.importorskip("scipy")
    source = """
        from scipy.spatial import cKDTree, KDTree
        from scipy.spatial.transform import Rotation
        from scipy.optimize import least_squares, minimize, linear_sum_assignment
        from scipy.linalg import polar, svd
        def one(x):
            d, i = KDTree([[0.0, 0.0], [1.0, 0.0]]).query([x, 0.0])
            return float(i) + least_squares(lambda z: z - 2.0, 0.0).x[0]
    """
    (outcome,) = slot.run(cells(source), [call("one")])
    assert outcome.value == pytest.approx(3.0), outcome


def test_graded_again_a_submission_draws_the_same(sandbox, slot):
    source = """
        import random, numpy as np
        def one(x):
            return random.random(), np.random.rand(), hash("a")
    """
    (first,) = sandbox.run(cells(source), [call("one")])
    (again,) = slot.run(cells(source), [call("one")])
    assert first.value == again.value


def test_scipy_is_there_for_those_who_name_it_whoever_came_before(safe_mode):
    pytest.importorskip("scipy")
    named = "from scipy.spatial import cKDTree\ndef one(x):\n    return cKDTree([[x]]).n"
    hidden = "def one(x):\n    return __import__('sci' + 'py').__name__"
    with open_sandbox(safe_mode) as fresh:
        found = [fresh.run(cells(text), [call("one")])[0] for text in (hidden, named) * 2]
    assert [outcome.value for outcome in found] == [None, 1, None, 1]
    assert found[0].error == found[2].error == "ModuleNotFoundError"
    assert found[0].message == found[2].message, "the order of submissions shows"


def test_all_of_numpy_can_be_imported_at_once(slot):
    (outcome,) = slot.run(
        cells(
            "from numpy import *\nimport numpy.matlib\ndef one(x):\n    return linalg.det(eye(2))"
        ),
        [call("one")],
    )
    assert outcome.value == 1.0, outcome


DOUBLE = Call(id="1", question="q", function="double", arguments=(21,))


def test_what_a_box_finds_is_what_anybody_finds_and_it_goes_on_with_it(slot):
    found = slot.extract(FILES, FUNCTIONS)
    assert found == extract(FILES, FUNCTIONS)
    assert len(found.notes) == len(found.unread) == 1
    (outcome,) = slot.run(found.cells, [DOUBLE])
    assert outcome.value == 42


def test_a_box_that_read_and_is_not_asked_is_ended_with_the_next(slot):
    for _ in range(2):
        assert slot.extract(FILES, FUNCTIONS).cells
    assert slot.run((), [DOUBLE])[0].status is OutcomeStatus.NOT_DEFINED


LONG = {"a.ipynb": b'{"cells": [' + b'"", ' * 12_000_000 + b"1]}"}


@pytest.mark.parametrize(
    ("limits", "patience", "says"),
    [
        (Limits(), 0.001, "it took longer than 0.001 s"),
        (Limits(memory=64 << 20), 120.0, "could not be read: the program ended itself"),
    ],
    ids=["time", "memory"],
)
def test_files_that_take_too_much_are_named_and_the_next_are_read(
    open_slot, monkeypatch, limits, patience, says
):
    with open_slot(limits) as slot:
        with monkeypatch.context() as hasty:
            hasty.setattr(session, "PATIENCE", patience)
            found = slot.extract(LONG, FUNCTIONS)
        assert found.cells == ()
        assert says in found.unread[0]
        assert slot.extract(FILES, FUNCTIONS).cells
