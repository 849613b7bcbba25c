"""Attacks on the box: none gains a mark, reads a secret, leaves something or hurts a neighbour."""

import contextlib
import json
import os
import shutil
import time
from pathlib import Path

import pytest
import small as small_numbers
from small import RIGHT

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.box import (
    IN_ALL,
    PACKAGE,
    SYSTEM,
    Box,
    BoxError,
    Wall,
    open_wall,
    unused_user,
    why_not,
)
from labkit.course.grading.grade import outcome
from labkit.support.errors import LabkitError

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no box")
NEGATE = "def negate(x):\n    return -x\n"
WORKER = """
import gc, os, sys, threading, time, json
def session():
    return next(one for one in gc.get_objects() if type(one).__name__ == "Session")
"""
NESTED = "pass\n"
for _ in range(19):
    NESTED = "try:\n pass\nfinally:\n " + NESTED.replace("\n", "\n ").rstrip(" ")
# What `double` does, below WORKER. The right function would earn 2 points.
FORGING = {
    "answers for itself, as it likes": """
    for place in range(99):
        session().tell(value=6.0)
""",
    "claims a verdict": """
    session().tell(score=100, values=[6.0])
""",
    "writes to every descriptor": """
    for number in range(64):
        try:
            os.write(number, b'{"score": 100}' * 9 + b"\\n")
        except OSError:
            pass
    return 0
""",
    "says more than can be read": """
    while True:
        os.write(session().writing, b"[" * 65536)
""",
    "sends what chokes a reader": """
    os.write(session().writing, b"[" * 200000 + b"]" * 200000 + b"\\n")
""",
    "answers from a thread, for ever": """
    def forge(own):
        while True:
            own.tell(value=-3.0)
    threading.Thread(target=forge, args=(session(),), daemon=True).start()
    return 0
""",
    "lies about its type": """
    class Liar(float):
        def __float__(self): return 6.0
        def __eq__(self, other): return True
        def __class__(self): return __import__("numpy").ndarray
        def __array__(self, *_): return __import__("numpy").array(6.0)
    return [Liar(1.0), Liar(2.0)]
""",
    "ends in a lie": """
    class Odd(Exception):
        def __str__(self): raise self
    raise Odd("hidden", x)
""",
    "hangs in C": "    return 10 ** 10 ** 9",
    "fills the memory": "    return ['a' * 2 ** 28 + str(k) for k in range(99)]",
    "fills the disk": """
    for k in range(10 ** 6):
        with open(f"/box/{k}", "wb") as file:
            file.write(b"x" * 2 ** 24)
""",
    "catches its own end": """
    while True:
        try:
            while True: pass
        except BaseException:
            pass
""",
}
# Each expression must come to nothing: an error, or a value that `double` does not return.
PEEKING = {
    "labkit": "__import__('labkit').alignment.align([[0, 0]], [[0, 0]]).R.sum()",
    "the assignment": "len(open({hidden!r}).read())",
    "another hand-in": "len(open({hidden!r} + '/../../ada.py').read())",
    "passwords": "len(open('/etc/shadow').read())",
    "the network": "__import__('socket').create_connection(('127.0.0.1', 1)) or 6.0",
    "a process": "__import__('os').fork()",
    "a program": "__import__('subprocess').run(['true']).returncode",
    "an older call": "__import__('ctypes').CDLL(None).syscall(41, 2, 1, 0)",
    "a namespace": "__import__('ctypes').CDLL(None).unshare(0x10000000) + 1",
    "a neighbour": "__import__('os').kill(-1, 9) or 6.0",
    "another user": "__import__('os').setuid(0) or 6.0",
}


@pytest.fixture
def assignment(small):
    return load_assignment(small)


def forged(name):
    return f"{WORKER}def double(x):\n{FORGING[name]}\n{NEGATE}".encode()


@pytest.mark.parametrize("name", FORGING)
def test_nothing_is_gained_by_forging(name, graded, safe_wall, assignment):
    verdict = graded({"a.py": forged(name)}, assignment, seconds=0.5)
    double, negate = verdict.questions
    assert double.score == (2.0 if name.startswith("answers for itself") else 0.0)
    assert negate.score in (0.0, 3.0)
    json.dumps(verdict, default=vars, allow_nan=False).encode("ascii")


def test_a_value_guessed_right_is_all_that_forging_can_send(graded, safe_wall, assignment):
    """It sends 6.0, the answer of one variant's case; in the other variant that earns nothing."""
    text = forged("answers for itself, as it likes")
    for student in ("ada", "emmy", "grace", "alan"):
        score = graded({"a.py": text}, assignment, student=student).questions[0].score
        assert score == 2.0 * (assignment.variant(student) == 0)


@pytest.mark.parametrize("name", PEEKING)
def test_nothing_outside_is_reached(name, graded, safe_wall, assignment, small):
    attempt = PEEKING[name].format(hidden=str(small / "hidden/variant_0.json"))
    text = f"def double(x):\n    return ('reached', {attempt})\n{NEGATE}"
    verdict = graded({"a.py": text.encode()}, assignment)
    assert verdict.score == 3.0
    if name not in ("an older call", "a namespace"):  # they return -1, and -1 + 1
        shown = str(verdict.questions[0])
        assert "raised" in shown or "stands in for" in shown, shown


def test_nothing_is_left_of_a_box(safe_wall):
    def running():
        found = 0
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            with contextlib.suppress(OSError):
                found += own in path.read_bytes()
        return found

    wall = safe_wall._replace(seconds=2.718281)  # by which its process is told from others
    own = f'"seconds": {IN_ALL * wall.seconds}'.encode()
    code = "import threading, time\nthreading.Thread(target=time.sleep, args=(99,)).start()\n"
    with contextlib.closing(Box(wall)) as box:
        end = time.monotonic() + 30
        box.send(end, cells=[(code + RIGHT, "a", True)], scripts={}, functions=["double"])
        while "answers" not in box.receive(end):
            pass
        assert running()
    end = time.monotonic() + 10
    while running():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_visible_calls_know_no_hidden_input(graded, safe_wall, tmp_path):
    """Whatever the code finds in memory while a visible case runs: no hidden input is there."""
    folder = small_numbers.write_assignment(tmp_path / "one")
    secret = small_numbers.case("h", 8234.25, -8234.25)
    for variant in range(2):
        cases = {"double": [secret], "negate": [secret]}
        small_numbers.write(folder / f"hidden/variant_{variant}.json", cases=cases)
    code = """
import gc
seen = set()
def negate(x):
    for one in gc.get_objects():
        if isinstance(one, (list, tuple, dict)):
            parts = one.values() if isinstance(one, dict) else one
            seen.update(part for part in parts if type(part) is float and 8000 < part < 9000)
    raise ValueError(str(sorted(seen)))
"""
    verdict = graded({"a.py": code.encode()}, load_assignment(folder))
    assert "8234" not in str(verdict)


@pytest.mark.parametrize(
    "code",
    [
        NESTED,
        (" " * 299 + "\n") * 870 + "%x\n",
        "f(" * 5000 + ")" * 5000,
        "x = " + "-" * 50000 + "1\n",
        "import threading\nthreading.Event().wait(99)\n",
        "import os\nos._exit(0)\n",
    ],
    ids=["finally", "blanks", "brackets", "minus", "waits", "exits"],
)  # fmt: skip
def test_a_hostile_cell_costs_itself_alone(code, graded, assignment):
    cells = [{"cell_type": "code", "source": one} for one in (code, RIGHT)]
    files = {f"{k}.ipynb": json.dumps({"cells": cells}).encode() for k in range(2)}
    verdict = graded(files, assignment, seconds=1.0)
    assert verdict.score == 5.0, verdict.notes


def test_all_together_have_one_deadline(graded, assignment):
    slow = "from threading import Event\ndef double(x):\n    Event().wait(99)\nnegate = double\n"
    verdict = graded({"a.py": slow.encode()}, assignment, seconds=0.5)
    assert verdict.score == 0.0
    assert "took too long" in verdict.questions[0].message
    assert verdict.seconds < 60.0  # 5 s, on a machine that is not at its limit


def test_what_the_box_says_is_checked_word_by_word():
    array = {"dtype": "int64", "shape": [1], "data": [1]}
    values = ([1], 1 << 64, array | {"dtype": "object"}, array | {"shape": [9]},
              array | {"data": [1e99]}, array | {"shape": ["9"]})  # fmt: skip
    for said in ({}, {"values": 3}, *({"value": value} for value in values)):
        with pytest.raises(BoxError):
            outcome(said)
    told = outcome({"error": "a b", "message": "\x1b[2J\u202e" * 999})
    assert told.error == "Exception"
    assert told.message.isprintable()
    assert len(told.message) == 600


def test_a_wall_with_a_hole_is_refused(tmp_path):
    (tmp_path / "secret").touch()
    reason = why_not(Wall(mode="none", hidden=(str(tmp_path),)))
    for hole in (f"it can read {tmp_path}", "it can open sockets", "it can start processes"):
        assert hole in reason


def test_the_wall_holds_where_labkit_lies_among_what_a_box_sees(monkeypatch):
    """As in a container, where pip installs into Python's own folder."""
    if not shutil.which("bwrap"):
        pytest.skip("bubblewrap is not installed")
    monkeypatch.setattr("labkit.course.grading.box.SYSTEM", (*SYSTEM, str(PACKAGE.parent)))
    assert why_not(Wall(mode="bubblewrap", hidden=(str(FOLDER), str(PACKAGE / "icp.py")))) == ""


def test_where_no_wall_holds_the_message_says_what_to_do(monkeypatch):
    monkeypatch.setattr("labkit.course.grading.box.why_not", lambda wall: "not here")
    with pytest.raises(LabkitError, match=r"bubblewrap: not here; user: not here.*--no-isolation"):
        open_wall([])
    assert open_wall([], isolation=False).mode == "none"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_a_box_takes_a_user_that_nobody_is(monkeypatch):
    import pwd  # noqa: PLC0415

    assert unused_user() != unused_user()
    monkeypatch.setattr(
        "labkit.course.grading.box.USERS", iter([0, pwd.getpwnam("nobody").pw_uid, 7777])
    )
    assert unused_user() == 7777


def test_numbers_of_every_kind_survive_the_wall(graded, assignment):
    code = "import numpy as np\ndef double(x):\n    return np.float32(2) * np.float32(x)\n" + NEGATE
    assert graded({"a.py": code.encode()}, assignment).score == 5.0
