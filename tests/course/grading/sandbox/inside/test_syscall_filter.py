"""The filter, run by an interpreter of its instructions; its numbers, held to libseccomp's."""

import ctypes
import ctypes.util
import errno
import struct

import pytest

from labkit.course.grading.sandbox.inside import syscall_filter as bpf
from labkit.course.grading.sandbox.inside.syscall_filter import CONDITIONAL, FREE, MACHINES, PATHS

PID = 4711
ONESELF = struct.pack("<I", bpf.ONESELF)
ALLOWED = 0


def run(code, machine, number, arguments=(), audit=None):
    """The verdict of a program on one system call: 0, an errno, or -1 for the end."""
    words = [value & (2**64 - 1) for value in (*arguments, *(0,) * 6)][:6]
    audit = MACHINES[machine].audit if audit is None else audit
    data = struct.pack("<IIQ6Q", number, audit, 0, *words)
    instructions = list(struct.iter_unpack("<HBBI", code))
    place, held = 0, 0
    while True:
        kind, if_so, if_not, value = instructions[place]
        place += 1
        if kind == bpf.LOAD:
            (held,) = struct.unpack_from("<I", data, value)
        elif kind == bpf.AND:
            held &= value
        elif kind == bpf.JUMP_IF_EQUAL:
            place += if_so if held == value else if_not
        elif kind == bpf.RETURN:
            return {bpf.ALLOW: ALLOWED, bpf.KILL: -1}.get(value, value & 0xFFFF)
        else:
            raise AssertionError(f"instruction {kind:#x}")


@pytest.fixture(params=MACHINES)
def machine(request):
    return request.param


@pytest.fixture
def ask(machine):
    """Ask the filter of a jail with its own root about a call by name."""
    code = bpf.program(machine, PID, own_root=True)
    known = FREE | PATHS | CONDITIONAL

    def asked(name, *arguments):
        return run(code, machine, known[name][MACHINES[machine].column], arguments)

    return asked


def test_every_number_is_answered_as_listed(machine):
    code = bpf.program(machine, PID, own_root=True)
    column = MACHINES[machine].column
    free = {numbers[column] for numbers in (FREE | PATHS).values()}
    judged = {numbers[column] for numbers in CONDITIONAL.values()}
    for number in set(range(600)) - judged:
        assert run(code, machine, number) == (ALLOWED if number in free else errno.EPERM), number


def test_another_architecture_ends_the_process(machine):
    code = bpf.program(machine, PID, own_root=True)
    i386, arm = 0x40000003, 0x40000028
    for audit in (i386, arm, 0):
        assert run(code, machine, 1, audit=audit) == -1


def test_the_x32_numbers_of_free_calls_are_refused():
    code = bpf.program("x86_64", PID, own_root=True)
    for number, _ in FREE.values():
        assert run(code, "x86_64", 0x40000000 | number) == errno.EPERM


THREAD = 0x3D0F00  # what glibc gives for a thread


def test_threads_and_no_processes(ask):
    assert ask("clone", THREAD) == ALLOWED
    for flags in (17, 0x4111, 0x01200011, THREAD & ~0x10000):  # fork, vfork, glibc's fork
        assert ask("clone", flags) == errno.EPERM
    for namespace in (0x10000000, 0x20000, 0x20000000, 0x40000000, 0x8000000, 0x4000000, 0x80):
        assert ask("clone", THREAD | namespace) == errno.EPERM
    assert ask("clone", THREAD & ~0x400) == errno.EPERM  # with descriptors of its own
    assert ask("clone3") == errno.ENOSYS


def test_no_file_stays_on_the_disk_uncounted(ask):
    """The watch over the disk sees names and descriptors, and those of one table."""
    for flags in (0x22, 0x21, 0x20022):  # private, shared, a stack: all of them anonymous
        assert ask("mmap", 0, 4096, 3, flags, -1) == ALLOWED
    for flags in (1, 2, 0x12):
        assert ask("mmap", 0, 4096, 3, flags, 5) == errno.EPERM
    assert ask("close_range", 3, 9, 0) == ask("close_range", 3, 9, 4) == ALLOWED
    for flags in (2, 6):
        assert ask("close_range", 3, 9, flags) == errno.EPERM


def test_signals_to_oneself_alone(ask):
    for call in ("kill", "tgkill"):
        assert ask(call, PID, PID, 9) == ALLOWED
        for other in (0, 1, -1, -PID, PID + 1):
            assert ask(call, other, other, 9) == errno.EPERM


def test_limits_may_be_asked_and_not_set(ask):
    assert ask("prlimit64", 0, 7, 0, 0x7FFF) == ALLOWED
    assert ask("prlimit64", PID, 7, 0, 0x7FFF) == ALLOWED
    assert ask("prlimit64", PID + 1, 7, 0, 0x7FFF) == errno.EPERM
    for pointer in (0x1000, 0x7FFF_0000_0000):
        assert ask("prlimit64", 0, 7, pointer, 0) == errno.EPERM


def test_descriptors_cannot_be_made_to_signal_others(ask):
    for command in (0, 1, 2, 3, 4, 1030):
        assert ask("fcntl", 3, command) == ALLOWED
    for command in (8, 10, 15, 1024, 1026, 1031, 1033):  # owner, signal, lease, notify, pipe, seal
        assert ask("fcntl", 3, command) == errno.EPERM
    assert ask("ioctl", 1, 0x5413) == ALLOWED
    for command in (0x8901, 0x5452, 0x5412):  # owner, asynchronous, typing into a terminal
        assert ask("ioctl", 1, command) == errno.EPERM


def test_nothing_is_told_to_another_box(ask):
    for command in (5, 6, 7, 36, 37, 38):  # record locks, of a process and of a description
        assert ask("fcntl", 3, command) == errno.EPERM
    for name in ("sched_getaffinity", "getpgid", "getsid"):
        assert ask(name, 0) == ask(name, PID) == ALLOWED
        assert ask(name, PID + 1) == ask(name, 1) == errno.EPERM
    assert ask("getpriority", 0, 0) == ask("getpriority", 0, PID) == ALLOWED
    assert ask("getpriority", 0, PID + 1) == ask("getpriority", 2, 1000) == errno.EPERM
    for advice in (4, 8, 14):  # what allocators say
        assert ask("madvise", 0, 4096, advice) == ALLOWED
    for advice in (12, 13, 20, 21, 100):  # merge pages, throw them out, poison them
        assert ask("madvise", 0, 4096, advice) == errno.EPERM


def test_a_jail_without_its_own_root_answers_no_question_about_paths(machine):
    code = bpf.program(machine, PID, own_root=False)
    column = MACHINES[machine].column
    for name, numbers in PATHS.items():
        if numbers[column] >= 0:
            assert run(code, machine, numbers[column]) == errno.ENOENT, name
    assert run(code, machine, PATHS["newfstatat"][column], (3, 0, 0, 0x1000)) == ALLOWED
    assert run(code, machine, PATHS["statx"][column], (3, 0, 0x1000)) == ALLOWED
    assert run(code, machine, FREE["openat"][column]) == ALLOWED  # Landlock's business


def test_the_numbers_are_those_of_libseccomp(machine):
    name = ctypes.util.find_library("seccomp")
    if name is None:
        pytest.skip("libseccomp is not installed; `apt-get install libseccomp2`")
    resolve = ctypes.CDLL(name).seccomp_syscall_resolve_name_arch
    resolve.argtypes = [ctypes.c_uint32, ctypes.c_char_p]
    here = MACHINES[machine]
    for call, numbers in (FREE | PATHS | CONDITIONAL).items():
        found = resolve(here.audit, call.encode())
        assert numbers[here.column] == max(found, -1), call


def test_the_process_s_number_stands_where_it_belongs_and_nowhere_else(machine):
    for own_root in (True, False):
        code = bpf.assembled(machine, own_root)
        places = [at for at in range(0, len(code), 4) if code[at : at + 4] == ONESELF]
        assert len(places) == code.count(ONESELF) == 7  # kill, tgkill, prlimit, and four questions
        assert bpf.program(machine, PID, own_root).count(ONESELF) == 0


def test_no_call_is_listed_twice():
    for column in range(2):
        numbers = [call[column] for call in (FREE | PATHS | CONDITIONAL).values()]
        known = [number for number in numbers if number >= 0]
        assert len(known) == len(set(known))


def test_what_a_box_must_never_have_is_not_listed():
    doors = {
        "execve", "fork", "vfork", "socket", "socketpair", "connect", "sendmsg", "ptrace",
        "mount", "unshare", "setns", "chroot", "pivot_root", "chmod", "utimensat", "setxattr",
        "mkdir", "link", "symlink", "mknod", "memfd_create", "io_uring_setup", "bpf",
        "setpriority", "sched_setaffinity", "tkill", "pidfd_open", "keyctl", "userfaultfd",
        "flock", "fstatfs", "sysinfo", "mincore", "get_robust_list", "capget",
    }  # fmt: skip
    assert not doors & (FREE | PATHS | CONDITIONAL).keys()
