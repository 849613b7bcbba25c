"""A seccomp filter as classic BPF, assembled for this machine and this process.

The program reads the number of a system call, compares it with one rule after the other
and returns "allow" or an error number; a call without a rule gets EPERM. Offsets are those
of ``struct seccomp_data`` (linux/seccomp.h): number, architecture, then six arguments of
eight bytes, low half first on both machines.

Listed is what student code may call; whatever is not named here is refused. It is enough for
Python, numpy and threads on files that are open or in reach. Not listed, on purpose: other
processes (fork, exec, ptrace, signals to others), sockets, mounts, namespaces, metadata (chmod,
utime, xattr), directories, links, memory that no limit counts (memfd, shm), priorities, keys,
io_uring, bpf, and what one box could tell another by: locks, the machine's load and free space,
other processes' numbers, which pages of a file are in memory.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Sequence
from typing import NamedTuple

ENOENT, ENOSYS = 2, 38


class Machine(NamedTuple):
    """A processor as the kernel's audit numbers name it, and which column below is its own."""

    audit: int
    column: int


MACHINES = {
    "x86_64": Machine(0xC000003E, 0),
    "aarch64": Machine(0xC00000B7, 1),
}

# name: (number on x86_64, number on aarch64); -1: the machine has no such call.
FREE = {
    # reading and writing what is open
    "read": (0, 63), "write": (1, 64), "readv": (19, 65), "writev": (20, 66),
    "pread64": (17, 67), "pwrite64": (18, 68), "lseek": (8, 62), "close": (3, 57),
    "dup": (32, 23), "dup2": (33, -1), "dup3": (292, 24),
    "pipe": (22, -1), "pipe2": (293, 59), "fstat": (5, 80),
    "ftruncate": (77, 46), "fsync": (74, 82), "fdatasync": (75, 83),
    "poll": (7, -1), "ppoll": (271, 73), "select": (23, -1), "pselect6": (270, 72),
    "epoll_create1": (291, 20), "epoll_ctl": (233, 21), "epoll_wait": (232, -1),
    "epoll_pwait": (281, 22), "eventfd2": (290, 19), "getdents64": (217, 61),
    # files by name, where the jail lets them be found
    "open": (2, -1), "openat": (257, 56), "unlink": (87, -1), "unlinkat": (263, 35),
    "rename": (82, -1), "renameat": (264, 38), "renameat2": (316, 276), "getcwd": (79, 17),
    "umask": (95, 166),
    # memory
    "mprotect": (10, 226), "munmap": (11, 215), "mremap": (25, 216),
    "brk": (12, 214), "membarrier": (324, 283),
    # signals to oneself, threads, time
    "rt_sigaction": (13, 134), "rt_sigprocmask": (14, 135), "rt_sigreturn": (15, 139),
    "rt_sigpending": (127, 136), "rt_sigtimedwait": (128, 137), "rt_sigsuspend": (130, 133),
    "sigaltstack": (131, 132), "pause": (34, -1), "futex": (202, 98),
    "set_robust_list": (273, 99), "rseq": (334, 293),
    "set_tid_address": (218, 96), "sched_yield": (24, 124),
    "nanosleep": (35, 101), "clock_nanosleep": (230, 115), "clock_gettime": (228, 113),
    "clock_getres": (229, 114), "gettimeofday": (96, 169), "time": (201, -1),
    "times": (100, 153), "getrusage": (98, 165), "getitimer": (36, 102),
    "setitimer": (38, 103), "alarm": (37, -1), "restart_syscall": (219, 128),
    "getrandom": (318, 278), "uname": (63, 160), "getcpu": (309, 168),
    "exit": (60, 93), "exit_group": (231, 94),
    # who am I
    "getpid": (39, 172), "gettid": (186, 178), "getppid": (110, 173), "getpgrp": (111, -1),
    "getuid": (102, 174), "geteuid": (107, 175),
    "getgid": (104, 176), "getegid": (108, 177), "getgroups": (115, 158),
    "getresuid": (118, 148), "getresgid": (120, 150), "getrlimit": (97, 163),
}  # fmt: skip

# Questions about a path: harmless where the jail has its own root, telling where it has not.
PATHS = {
    "stat": (4, -1), "lstat": (6, -1), "newfstatat": (262, 79), "statx": (332, 291),
    "access": (21, -1), "faccessat": (269, 48), "faccessat2": (439, 439),
    "readlink": (89, -1), "readlinkat": (267, 78),
}  # fmt: skip

CONDITIONAL = {
    "clone": (56, 220), "clone3": (435, 435), "kill": (62, 129), "tgkill": (234, 131),
    "prlimit64": (302, 261), "fcntl": (72, 25), "ioctl": (16, 29), "prctl": (157, 167),
    "mmap": (9, 222), "close_range": (436, 436), "madvise": (28, 233),
    "sched_getaffinity": (204, 123), "getpgid": (121, 155), "getsid": (124, 156),
    "getpriority": (140, 141),
}  # fmt: skip


LOAD, AND, JUMP_IF_EQUAL, RETURN = 0x20, 0x54, 0x15, 0x06
ALLOW, REFUSE, KILL = 0x7FFF0000, 0x00050000, 0x80000000
EPERM = 1
NUMBER, ARCHITECTURE = 0, 4
WHOLE = 0xFFFFFFFF
ONESELF = 0xA5C3960F  # no process has this number, no rule this value

# A thread has the process's descriptors: what it holds open is counted with theirs.
CLONE_THREAD, CLONE_NEW_ANY = 0x00010400, 0x7E020080
ANONYMOUS = 0x20  # a mapped file would stay on the disk, removed, closed and uncounted
CLOSE_ON_EXEC = 4  # for close_range; not: a table of descriptors of its own
AT_EMPTY_PATH = 0x1000
# Terminal size and kind, bytes waiting, close-on-exec, non-blocking; not: owner and signal.
IOCTLS = (0x5401, 0x5413, 0x541B, 0x5421, 0x5450, 0x5451)
# Duplicate and flags; not F_SETOWN and F_SETSIG, which send signals to others, and no locks: on
# a device that the whole machine shares a lock is a letter to whoever looks at it.
FCNTLS = (0, 1, 2, 3, 4, 1030)
# Advice on one's own memory; not to merge equal pages of all programs, or to throw out shared ones.
ADVICE = (0, 1, 2, 3, 4, 8, 14, 15, 16, 17)
# Names of threads and of memory areas.
PRCTLS = (15, 16, 0x53564D41)

Instruction = tuple[int, int, int, int]


class Condition(NamedTuple):
    """The low (or high) half of an argument, masked, must be one of `values`."""

    argument: int
    values: Sequence[int]
    mask: int = WHOLE
    high: bool = False


def program(machine: str, pid: int, own_root: bool) -> bytes:
    """Give the filter; assembled once, and then only signed with the process's number.

    Parameters
    ----------
    machine : str
        As `os.uname` names it; a key of `MACHINES`.
    pid : int
        The process that may signal itself, as it sees its own number.
    own_root : bool
        Whether the jail has a root directory of its own. Without one, questions about a
        path ("does it exist?") answer ENOENT, since Landlock does not hold them back.

    Returns
    -------
    bytes
        Instructions of eight bytes each.

    Raises
    ------
    KeyError
        If the machine is not known.
    """
    return assembled(machine, own_root).replace(struct.pack("<I", ONESELF), struct.pack("<I", pid))


@functools.cache
def assembled(machine: str, own_root: bool) -> bytes:
    """Assemble the filter with `ONESELF` in the place of the process's number."""
    here = MACHINES[machine]
    code: list[Instruction] = [
        (LOAD, 0, 0, ARCHITECTURE),
        (JUMP_IF_EQUAL, 1, 0, here.audit),
        (RETURN, 0, 0, KILL),
        (LOAD, 0, 0, NUMBER),
    ]
    for numbers in FREE.values():
        code += rule(here, numbers)
    for name, numbers in PATHS.items():
        if own_root:
            code += rule(here, numbers)
        elif name in ("newfstatat", "statx"):
            flags = 3 if name == "newfstatat" else 2
            empty = Condition(flags, (AT_EMPTY_PATH,), mask=AT_EMPTY_PATH)
            code += rule(here, numbers, empty, otherwise=ENOENT)
        else:
            code += rule(here, numbers, answer=REFUSE | ENOENT)
    thread = Condition(0, (CLONE_THREAD,), mask=CLONE_THREAD | CLONE_NEW_ANY)
    oneself = Condition(0, (ONESELF,))
    asks = (Condition(0, (0, ONESELF)), Condition(2, (0,)), Condition(2, (0,), high=True))
    code += rule(here, CONDITIONAL["clone"], thread)
    code += rule(here, CONDITIONAL["clone3"], answer=REFUSE | ENOSYS)
    code += rule(here, CONDITIONAL["kill"], oneself)
    code += rule(here, CONDITIONAL["tgkill"], oneself)
    code += rule(here, CONDITIONAL["prlimit64"], *asks)
    code += rule(here, CONDITIONAL["fcntl"], Condition(1, FCNTLS))
    code += rule(here, CONDITIONAL["ioctl"], Condition(1, IOCTLS))
    code += rule(here, CONDITIONAL["prctl"], Condition(0, PRCTLS))
    code += rule(here, CONDITIONAL["mmap"], Condition(3, (ANONYMOUS,), mask=ANONYMOUS))
    code += rule(here, CONDITIONAL["close_range"], Condition(2, (0, CLOSE_ON_EXEC)))
    code += rule(here, CONDITIONAL["madvise"], Condition(2, ADVICE))
    for name in ("sched_getaffinity", "getpgid", "getsid"):  # of others: whether they live
        code += rule(here, CONDITIONAL[name], Condition(0, (0, ONESELF)))
    code += rule(here, CONDITIONAL["getpriority"], Condition(1, (0, ONESELF)))
    code.append((RETURN, 0, 0, REFUSE | EPERM))
    return b"".join(struct.pack("<HBBI", *instruction) for instruction in code)


def rule(
    machine: Machine,
    numbers: tuple[int, int],
    *conditions: Condition,
    answer: int = ALLOW,
    otherwise: int = EPERM,
) -> list[Instruction]:
    """If the call is this one: `answer` where all conditions hold, `otherwise` where not."""
    number = numbers[machine.column]
    if number < 0:
        return []
    body: list[Instruction] = []
    for condition in conditions:
        body.append((LOAD, 0, 0, 16 + 8 * condition.argument + 4 * condition.high))
        body.append((AND, 0, 0, condition.mask))
        for place, value in enumerate(condition.values):
            skip = len(condition.values) - place
            body.append((JUMP_IF_EQUAL, skip, 0, value))
        body.append((RETURN, 0, 0, REFUSE | otherwise))
    body.append((RETURN, 0, 0, answer))
    return [(JUMP_IF_EQUAL, 0, len(body), number), *body]
