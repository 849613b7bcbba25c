"""Attacks on the box: none gains a mark, reads a secret, leaves something or hurts a neighbour."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from labkit.course.assignment import FOLDER
from labkit.grading.box.inside import data
from labkit.grading.box.outside import (
    PACKAGE,
    SYSTEM,
    Box,
    Wall,
    find_unused_user,
    open_wall,
    why_not,
)
from labkit.grading.judge.verdict import read_outcome
from labkit.grading.questions import read_assignment
from labkit.support.errors import LabkitError
from tests.grading.small import RIGHT

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
# By the rows of SECURITY.md: each expression must fail, or come to what `is_nothing`.
MARK = f"labkit-red-team-{os.getpid()}"
PEEKING = {
    "files": """
__import__("labkit").alignment.align([[0, 0]], [[0, 0]]).R.sum()
open({hidden!r}).read()
open({hidden!r} + "/../../ada.py").read()
open("/etc/shadow").read()
os.mkdir({place!r})
os.symlink("4711", {place!r})
os.link("/etc/passwd", {place!r})
os.mknod({place!r})
os.mkfifo({place!r})
os.rename("/box/" + {mark!r}, {place!r})
os.open({place!r}, os.O_CREAT | os.O_RDONLY)
os.open({open!r}, os.O_WRONLY | os.O_TRUNC)
os.memfd_create("a")
os.open("/dev/shm/" + {mark!r}, os.O_CREAT | os.O_WRONLY)
""",
    "other processes": """
os.kill(-1, 9)
os.kill({grader}, 0)
os.setuid(0)
open("/proc/{grader}/environ").read()
os.pidfd_open({grader}) + 1
""",
    "network, new processes": """
socket.create_connection(("127.0.0.1", 1))
socket.socketpair(type=socket.SOCK_DGRAM)[0].sendto(b"a", {place!r})
socket.socketpair(type=socket.SOCK_DGRAM)[0].connect({place!r})
socket.socketpair(type=socket.SOCK_DGRAM)[0].bind({place!r})
socket.socketpair()[0].sendmsg([b"a"], [])
os.fork()
subprocess.run(["true"])
libc.syscall(41, 2, 1, 0) + 1
libc.unshare(0x10000000) + 1
libc.prctl(1, 0, 0, 0, 0) + 1
libc.prctl(ctypes.c_ulong((1 << 32) + 1), 0, 0, 0, 0) + 1
""",
    "time, memory": """
len([bytes(2**27) for _ in range(99)])
open("/box/a", "wb").write(bytes(2**24 + 2**20))
os.sched_setaffinity({grader}, [0]) or True
""",
    "user": "os.getuid() == {user} == 0",
}
HOLES = """
import ctypes, os, socket, subprocess
libc = ctypes.CDLL(None)
def holes(trials):
    found = []
    for trial in trials:
        try:
            if eval(trial):
                found.append(trial)
        except BaseException:
            pass
    return found
"""


def forged(name):
    return f"{WORKER}def double(x):\n{FORGING[name]}\n{NEGATE}".encode()


@pytest.mark.parametrize("name", FORGING)
def test_nothing_is_gained_by_forging(name, graded, safe_wall, small):
    files, asked = {"a.py": forged(name)}, read_assignment(small)
    verdict = graded(files, asked, seconds=0.5, behind=safe_wall)
    double, negate = verdict.questions
    assert double.score == (0.5 if name.startswith("answers for itself") else 0.0)
    assert negate.score in (0.0, 3.0)
    json.dumps(verdict, default=vars, allow_nan=False).encode("ascii")


def test_a_value_guessed_right_is_all_that_forging_can_send(graded, small):
    """It sends 6.0, the answer of one case of four."""
    files = {"a.py": forged("answers for itself, as it likes")}

    verdict = graded(files, read_assignment(small))

    assert verdict.questions[0].score == 0.5


def test_each_wall_holds_what_is_said_of_it(safe_wall, small, tmp_path):
    """Every row of the table in SECURITY.md, attacked behind every wall."""
    text = (Path(__file__).parents[2] / "SECURITY.md").read_text("utf-8")
    rows = {line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| ")}
    assert rows - {"", "needs"} == set(PEEKING)
    shared = Path(tempfile.gettempdir(), MARK)
    shared.touch(mode=0o666)
    shared.chmod(0o666)
    known = {
        "hidden": str(small / "hidden"), "place": f"{shared}-made", "open": str(shared),
        "mark": MARK, "grader": os.getpid(), "user": os.getuid(),
    }  # fmt: skip
    trials = [line for row in PEEKING.values() for line in row.format(**known).split("\n") if line]
    try:
        with contextlib.closing(Box(safe_wall)) as box:
            box.send(60.0, cells=[(HOLES, "a")], scripts={}, functions=["holes"])
            while "answers" not in box.receive():
                pass
            calls = [[data.to_json(tuple(trials))]]
            box.send(
                60.0,
                seconds=30.0,
                function="holes",
                state=0,
                lent={},
                in_form=[],
                calls=calls,
            )
            assert data.from_json(box.receive()["value"]) == ()
        assert not list(shared.parent.glob(f"{MARK}-*"))
    finally:
        shared.unlink()


@pytest.mark.parametrize("by_kill", [False, True], ids=["at its end", "after kill -9"])
def test_nothing_is_left_of_a_box(by_kill, safe_wall, tmp_path):
    """No process runs on, and nothing lies in the temporary folder."""

    def running():
        found = 0
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            with contextlib.suppress(OSError):
                found += own in path.read_bytes()
        return found

    own = b'"seconds": %a, ' % (180.0 + os.getpid() / 1e7)
    grader = (
        "import sys\nfrom labkit.grading.box.outside import Box, Wall\n"
        f"box = Box(Wall({safe_wall.mode!r}), 180.0 + {os.getpid()} / 1e7)\n"
        "code = 'import ctypes, os, threading, time\\nctypes.CDLL(None).prctl(1, 0, 0, 0, 0)\\n'\n"
        "code += 'threading.Thread(target=threading.Event().wait, args=(99,)).start()\\n'\n"
        "box.send(60.0, cells=[(code, 'a'), ('while 1: pass', 'b')], scripts={}, functions=[])\n"
        "box.receive(), box.receive()\n"
        "print(flush=True)\nsys.stdin.read()\nbox.close()\n"
    )
    told = {"TMPDIR": str(tmp_path), "stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    command, env = [sys.executable, "-c", grader], os.environ | {"TMPDIR": told.pop("TMPDIR")}
    with subprocess.Popen(command, env=env, **told) as run:
        assert run.stdout.readline()
        assert running()
        run.kill() if by_kill else run.stdin.close()
    while running():
        time.sleep(0.05)
    assert not list(tmp_path.iterdir())


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
def test_a_hostile_cell_costs_itself_alone(code, graded, small):
    cells = [{"cell_type": "code", "source": one} for one in (code, RIGHT)]
    files = {f"{k}.ipynb": json.dumps({"cells": cells}).encode() for k in range(2)}
    verdict = graded(files, read_assignment(small), seconds=1.0)
    assert verdict.score == 5.0, verdict.notes


def test_what_the_box_says_is_checked_word_by_word():
    array = {"dtype": "int64", "shape": [1], "data": [1]}
    values = ([1], 1 << 64, array | {"dtype": "object"}, array | {"shape": [9]},
              array | {"data": [1e99]}, array | {"shape": ["9"]})  # fmt: skip
    for said in (
        {},
        {"values": 3},
        {"status": "killed"},
        {"status": "x"},
        *({"value": value} for value in values),
    ):
        with pytest.raises(ValueError, match=r".+"):
            read_outcome(said)
    told = read_outcome({"status": "raised", "error": "a b", "message": "\x1b[2J\u202e" * 999})
    assert told.error == "Exception"
    assert told.message.isprintable()
    assert len(told.message) == 600


def test_a_wall_with_a_hole_is_refused(tmp_path):
    (tmp_path / "secret").touch()
    reason = why_not(Wall(mode="none", hidden=(str(tmp_path),)))
    for hole in (f"it can read {tmp_path}", "it can open sockets", "it can start processes"):
        assert hole in reason


def test_the_wall_holds_where_labkit_and_cases_lie_among_what_a_box_sees(monkeypatch, tmp_path):
    """As in a container, where pip installs into Python's own folder."""
    if not shutil.which("bwrap"):
        pytest.skip("bubblewrap is not installed")
    cases = tmp_path / "cases"
    cases.mkdir(mode=0o755)
    (cases / "hidden.json").touch()
    tmp_path.chmod(0o755)
    seen = (*SYSTEM, str(PACKAGE.parent), str(tmp_path))
    monkeypatch.setattr("labkit.grading.box.outside.SYSTEM", seen)
    hidden = (str(FOLDER), str(PACKAGE / "icp.py"), str(cases))
    assert why_not(Wall(mode="bubblewrap", hidden=hidden)) == ""


def test_where_no_wall_holds_the_message_says_what_to_do(monkeypatch):
    monkeypatch.setattr("labkit.grading.box.outside.why_not", lambda wall: "not here")
    with pytest.raises(LabkitError, match=r"bubblewrap: not here; user: not here.*--no-isolation"):
        open_wall(("/nowhere",))
    assert open_wall(isolation=False).mode == "none"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_a_box_takes_a_user_that_nobody_is(monkeypatch):
    import pwd  # noqa: PLC0415

    assert find_unused_user() != find_unused_user()
    monkeypatch.setattr(
        "labkit.grading.box.outside.USERS", iter([0, pwd.getpwnam("nobody").pw_uid, 7777])
    )
    assert find_unused_user() == 7777
    running = [sys.executable, "-c", "import os; os.setuid(7777); print(flush=True); input()"]
    with subprocess.Popen(running, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline()
        monkeypatch.setattr("labkit.grading.box.outside.USERS", iter([7777, 8888]))
        assert find_unused_user() == 8888
        process.communicate(b"\n")
