"""Who outlives whom: slots end with what they started, and survive what they lose."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from labkit.course.grading.contract import Call, Limits, SourceCell
from labkit.course.grading.sandbox.host import SandboxError, launch, open_sandbox
from labkit.course.grading.sandbox.host.launch import SlotUser, processes_of

CELL = SourceCell(source="def f(x):\n    return 2 * x", question="q", label="cell 1")
CALL = Call(id="1", question="q", function="f", arguments=(21,))
BY_ROOT = pytest.mark.skipif(
    sys.platform != "linux" or os.geteuid() != 0, reason="only root gives each slot its own user"
)
PATIENCE = 20.0  # s, for a machine that has much else to do

GRADER = """
import sys, threading, time
from labkit.course.grading.contract import Call, Limits, SourceCell
from labkit.course.grading.sandbox.host import open_sandbox
slot = open_sandbox(sys.argv[1], Limits(seconds=600.0, total_seconds=600.0))
print(slot._starter.process.pid, flush=True)
cell = SourceCell(source="def f(x):\\n    while True: pass", question="q", label="cell 1")
slot.run([cell], [Call(id="1", question="q", function="f", arguments=(1,))])
"""


def descendants(pid):
    """A process and all below it, as /proc tells."""
    found = [pid]
    for task in found:
        for file in Path(f"/proc/{task}/task").glob("*/children"):
            with contextlib.suppress(OSError):
                found += map(int, file.read_text().split())
    return found


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def alive(pids):
    def running(pid):
        try:
            return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
        except OSError:
            return False

    return [pid for pid in pids if running(pid)]


def test_a_grader_that_is_killed_leaves_nothing_behind(safe_mode, tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", GRADER, safe_mode],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    ) as grader:
        zygote = int(grader.stdout.readline())
        idle = 3 if safe_mode == "bubblewrap" else 1
        assert wait_for(lambda: len(descendants(zygote)) > idle), "the submission did not start"
        family = descendants(zygote)
        assert len(os.listdir(tmp_path)) == (safe_mode != "bubblewrap")
        grader.send_signal(signal.SIGKILL)
    assert wait_for(lambda: not alive(family)), f"still running: {alive(family)}"
    assert os.listdir(tmp_path) == []


def test_a_slot_ends_what_it_started(safe_mode):
    slot = open_sandbox(safe_mode)
    family = descendants(slot._starter.process.pid)
    assert alive(family)
    slot.close()
    slot.close()
    assert wait_for(lambda: not alive(family)), f"still running: {alive(family)}"


def test_where_memory_runs_out_boxes_go_first(safe_mode):
    """All of a slot's boxes together may ask for more than the machine has."""
    with open_sandbox(safe_mode) as sandbox:
        pids = descendants(sandbox._starter.process.pid)
        scores = [int(Path(f"/proc/{pid}/oom_score_adj").read_text("ascii")) for pid in pids]
    assert max(scores) == 1000
    assert int(Path("/proc/self/oom_score_adj").read_text("ascii")) < 1000


def test_a_lost_zygote_is_started_again(safe_mode):
    with open_sandbox(safe_mode) as slot:
        for pid in reversed(descendants(slot._starter.process.pid)):
            os.kill(pid, signal.SIGKILL)
        assert slot.run([CELL], [CALL])[0].value == 42


def test_a_zygote_that_is_long_gone_is_started_again_at_once(safe_mode):
    with open_sandbox(safe_mode) as slot:
        family = descendants(slot._starter.process.pid)
        for pid in reversed(family):
            os.kill(pid, signal.SIGKILL)
        assert wait_for(lambda: not alive(family))
        start = time.monotonic()
        assert slot.run([CELL], [CALL])[0].value == 42
        assert time.monotonic() - start < PATIENCE, "it waited for a process that is gone"


def test_a_zygote_that_cannot_start_again_is_an_error(monkeypatch, open_slot):
    with open_slot() as slot:
        for pid in reversed(descendants(slot._starter.process.pid)):
            os.kill(pid, signal.SIGKILL)
        slot._starter.process.wait()
        monkeypatch.setattr(launch, "BOOTSTRAP", "raise SystemExit('no')")
        start = time.monotonic()
        with pytest.raises(SandboxError, match=f"mode {slot.mode} does not work here: no"):
            slot.run([CELL], [CALL])
        assert time.monotonic() - start < PATIENCE  # its own ends of the sockets are closed, too


@BY_ROOT
def test_slots_side_by_side_do_not_share_a_user(open_slot):
    with open_slot() as one, open_slot() as two:
        assert one._starter.user.uid != two._starter.user.uid
        with ThreadPoolExecutor(2) as pool:
            outcomes = pool.map(lambda slot: slot.run([CELL], [CALL])[0], (one, two))
            assert [outcome.value for outcome in outcomes] == [42, 42]


@BY_ROOT
def test_a_user_is_free_again_once_its_slot_is_closed():
    first, second = SlotUser(), SlotUser()
    assert first.uid != second.uid
    left = subprocess.Popen(["sleep", "1000"], user=first.uid)
    assert left.pid in processes_of(first.uid)
    first.close()
    assert left.wait(PATIENCE) == -signal.SIGKILL
    third = SlotUser()
    assert third.uid == first.uid
    second.close()
    third.close()


def test_a_hundred_submissions_leave_no_descriptor_and_no_file(slot, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    slot.run([CELL], [CALL])
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(100):
        assert slot.run([CELL], [CALL])[0].value == 42
    assert len(os.listdir("/proc/self/fd")) == before
    assert os.listdir(tmp_path) == []
    assert len(descendants(slot._starter.process.pid)) <= 3


def test_a_slow_submission_is_ended_and_the_slot_is_ready_at_once(open_slot):
    with open_slot(Limits(seconds=0.3)) as slot:
        hang = SourceCell(source="def f(x):\n    while True: pass", question="q", label="cell 1")
        start = time.monotonic()
        slot.run([hang], [CALL])
        assert slot.run([CELL], [CALL])[0].value == 42
        assert time.monotonic() - start < PATIENCE


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a way to leave a process behind")
def test_without_isolation_a_survivor_that_talks_on_does_not_hold_the_grader():
    """It has left the group that is killed, and its end of the pipe with it; for three seconds."""
    source = (
        "import os, signal\n"
        "def f():\n"
        "    if os.fork() == 0:\n"
        "        os.setsid()\n"
        "        signal.alarm(3)\n"
        "        while True:\n"
        "            for number in range(3, 9):\n"
        "                try:\n"
        "                    os.write(number, bytes(65536))\n"
        "                except OSError:\n"
        "                    pass\n"
        "    return 1\n"
    )
    cells = [SourceCell(source=source, question="q", label="cell 1")]
    calls = [Call(id="1", question="q", function="f")]
    with open_sandbox("none", Limits(seconds=2.0)) as sandbox:
        start = time.monotonic()
        sandbox.run(cells, calls)
        assert time.monotonic() - start < 2.5
