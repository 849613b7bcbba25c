"""Limits of a box hold whatever the code does, and what it used is counted to its end."""

import contextlib
import errno
import os
import sys
import time
from pathlib import Path

import pytest

from labkit.grading.box import outside, watch
from labkit.grading.box.inside import data
from labkit.grading.box.inside.limits import MAX_LINE, Time, waiting_time
from labkit.grading.box.outside import Box, Wall, find_unused_user
from labkit.grading.box.watch import BoxError, BoxTimeout, Usage, read_usage

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="boxes are Linux's")
LIMITS = """
import os, resource
def limits():
    kinds = [resource.RLIMIT_NOFILE, resource.RLIMIT_CORE, resource.RLIMIT_CPU, resource.RLIMIT_AS,
             resource.RLIMIT_FSIZE]
    return [resource.getrlimit(kind) for kind in kinds]
def groups():
    return os.getgroups()
"""
NAMESPACES = ("ipc", "mnt", "net", "pid", "uts")
DOORS = """ptrace process_vm_readv process_vm_writev setns unshare bpf perf_event_open userfaultfd
    add_key keyctl shmget msgget semget mq_open io_uring_setup pidfd_open pidfd_getfd memfd_create
    socket bind connect listen accept accept4 sendmsg sendmmsg execve execveat"""
CALLED = f"""
import ctypes
def errors():
    library, system = ctypes.CDLL("libseccomp.so.2"), ctypes.CDLL(None, use_errno=True)
    errors = {{}}
    for name in {DOORS.split()}:
        number = library.seccomp_syscall_resolve_name(name.encode())
        if number >= 0:
            system.syscall(number, *[ctypes.c_long(-1)] * 6)
            errors[name] = ctypes.get_errno()
    return errors
"""
FLOODS = f"""
import gc, os
own = next(one for one in gc.get_objects() if type(one).__name__ == "Session")
os.write(own.writing, b" " * {2 * MAX_LINE})
while True:
    pass
"""


def told(box, cells, *functions):
    """Run cells in a box; the answers of functions without arguments."""
    box.send(60.0, cells=[(cells, "a")], scripts={}, functions=functions)
    while "answers" not in box.receive():
        pass
    for name in functions:
        box.send(60.0, function=name, state=0, lent={}, in_form=[], calls=[[]])
        yield data.from_json(box.receive()["value"])


@pytest.mark.parametrize("has_wall", [True, False])
def test_every_limit_of_a_box_is_set_for_good(has_wall, wall):
    """Soft and hard: what is soft alone could be raised again."""
    wall = wall if has_wall else Wall("none")
    own_groups = os.getgroups()
    if os.geteuid() == 0:
        os.setgroups([7])
    try:
        with contextlib.closing(Box(wall, seconds=7.0)) as box:
            (files, core, processor, memory, file), groups = told(box, LIMITS, "limits", "groups")
    finally:
        if os.geteuid() == 0:
            os.setgroups(own_groups)

    assert core == (0, 0)
    assert processor == (8, 8)
    assert files[0] == files[1] <= 256
    assert memory[0] == memory[1] <= 2 << 30
    assert file[0] == file[1] == (16 << 20 if wall.mode == "bubblewrap" else 0)
    assert groups == () or os.geteuid() or wall.mode == "none"


WRITES = """
def too_much():
    try:
        with open("written", "wb", buffering=0) as file:
            file.write(bytes(1 << 24))
            file.write(bytes(1 << 24))
    except OSError as error:
        return error.errno
def too_many():
    try:
        for number in range(9):
            with open(f"written{number}", "wb", buffering=0) as file:
                file.write(bytes(1 << 23))
                file.write(bytes((1 << 23) - 1))
    except OSError as error:
        return error.errno
"""


def test_who_writes_too_much_is_told_and_goes_on(wall):
    """The system's signal for it would end the box."""
    if wall.mode != "bubblewrap":
        pytest.skip("elsewhere a box makes no file")
    with contextlib.closing(Box(wall)) as box:
        assert [*told(box, WRITES, "too_much", "too_many")] == [errno.EFBIG, errno.ENOSPC]


STARTS = """
import subprocess
started = subprocess.Popen(["sleep", "infinity"])
def pid():
    return started.pid
"""


def test_what_code_without_a_wall_started_ends_with_its_box():
    """Where nothing refuses a new process."""

    def state():
        with contextlib.suppress(OSError):
            return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        return "gone"

    with contextlib.closing(Box(Wall("none"))) as box:
        (pid,) = told(box, STARTS, "pid")
        assert state() not in ("gone", "Z")

    while state() not in ("gone", "Z"):
        time.sleep(0.05)


def test_a_box_shares_no_namespace_with_the_grader(wall):
    """A second wall behind the filter of calls, of which either holds alone."""
    if wall.mode != "bubblewrap":
        pytest.skip("only bubblewrap has namespaces of its own")
    with contextlib.closing(Box(wall)) as box:
        links = [Path(f"/proc/{box._pid}/ns/{name}").readlink() for name in NAMESPACES]

    shared = [Path(f"/proc/self/ns/{name}").readlink() for name in NAMESPACES]
    assert not {*links} & {*shared}


def test_no_call_leads_to_other_processes_the_network_or_the_kernel(wall):
    """The filter answers before the kernel looks at the arguments, which are all wrong."""
    if wall.mode == "none":
        pytest.skip("without a wall no call is refused")
    with contextlib.closing(Box(wall)) as box:
        (errors,) = told(box, CALLED, "errors")

    assert errors == dict.fromkeys(errors, errno.EPERM)
    assert len(errors) > 20


def test_what_no_exception_reaches_ends_the_box_by_itself(wall):
    """Long before its order is over: a loop in C hears of no limit of a cell."""
    with contextlib.closing(Box(wall)) as box:
        cells = [("sum(range(10**12))", "a")]
        box.send(60.0, seconds=0.2, cells=cells, scripts={}, functions=[])
        assert box.receive() == {"cell": 0}

        with pytest.raises(BoxError, match="the program ended"):
            box.receive()


def test_a_line_that_does_not_end_ends_the_box(wall):
    with contextlib.closing(Box(wall)) as box:
        box.send(60.0, cells=[(FLOODS, "a")], scripts={}, functions=[])
        assert box.receive() == {"cell": 0}

        with pytest.raises(BoxError, match="too much output"):
            box.receive()


SAYS = """
import gc, os
own = next(one for one in gc.get_objects() if type(one).__name__ == "Session")
os.write(own.writing, {line!r})
"""


@pytest.mark.parametrize(
    "line", [b"[1]\n", b"1\n", b"null\n", b"{\n", b"\xff\n", b"[" * 9999 + b"\n"]
)
def test_a_line_that_is_no_object_ends_the_box(line, wall):
    with contextlib.closing(Box(wall)) as box:
        box.send(60.0, cells=[(SAYS.format(line=line), "a")], scripts={}, functions=[])
        assert box.receive() == {"cell": 0}

        with pytest.raises(BoxError, match="invalid answer"):
            box.receive()


def test_what_a_box_used_counts_when_it_is_gone(wall, monkeypatch):
    """Or a program that ends each of its boxes would have time without an end."""
    with contextlib.closing(Box(wall._replace(seconds=60.0))) as box:
        box.send(1.0, cells=[("while True:\n    pass", "a")], scripts={}, functions=[])
        box.receive()
        with pytest.raises(BoxTimeout):
            box.receive()
    monkeypatch.setattr(outside, "read_usage", lambda pid: None)

    assert box.processor_time() > 1.0


def test_usage_is_what_the_system_counts_whatever_a_process_calls_itself():
    """Of both kinds of processor time; the oracle is `os.times`."""
    name = Path("/proc/self/comm")
    before = name.read_text()
    end = time.process_time() + 0.3
    while time.process_time() < end:
        os.listdir("/proc")
    try:
        name.write_text("a) R 1 (b")
        usage = read_usage(os.getpid())
    finally:
        name.write_text(before)

    user, system, *_ = os.times()
    assert usage.used == pytest.approx(user + system, abs=0.1)
    assert 0.0 <= usage.waited < 1e5
    assert usage.threads >= 1


def test_all_times_of_a_process_are_in_seconds(tmp_path, monkeypatch):
    """Linux counts work in ticks, and each thread's wait for a processor in nanoseconds."""
    monkeypatch.setattr(watch, "Path", lambda path: tmp_path / path.lstrip("/"))
    ticks = os.sysconf("SC_CLK_TCK")
    for thread in "78":
        (tmp_path / "proc/7/task" / thread).mkdir(parents=True)
        (tmp_path / "proc/7/task" / thread / "schedstat").write_text("0 750000000 9\n")
    (tmp_path / "proc/7/stat").write_text(f"7 (a) D {'0 ' * 10}{ticks} {2 * ticks} 0 0 0 0 2 0\n")

    assert read_usage(7) == Usage(used=3.0, waited=1.5, is_at_disk=True, threads=2)


def test_the_user_of_a_box_has_no_process(monkeypatch):
    """This process has one, and no account here."""
    monkeypatch.setattr("pwd.getpwall", list)
    monkeypatch.setattr(outside, "USERS", iter([os.getuid(), 70_001]))  # beyond all graders'

    assert find_unused_user() == 70_001


@pytest.mark.parametrize("call", [0.1, 0.5, 3.0, 600.0])
def test_all_time_follows_from_that_of_a_call(call):
    """The box ends a call by itself before the grader does, and what defines nothing gets less."""
    budget = Time(call)

    assert call < waiting_time(call) < 2.0 * call + 1.0
    assert budget.experiment() < call < min(budget.importing, budget.patient_call, budget.cells)
    assert budget.cells < budget.left


def test_experiments_run_out_of_time_one_by_one():
    budget = Time(1.0)
    granted = []

    while limit := budget.experiment():
        granted.append(limit)
        budget.experiments -= limit

    assert granted == sorted(granted, reverse=True)
    assert 2.0 < sum(granted) < 5.0


def test_a_box_that_does_nothing_costs_its_start():
    budget = Time(1.0)

    for _ in range(200):
        budget.charge_box(0.0)

    assert budget.is_over
