"""Confine a process before it runs a student's code: resources, its user, system calls."""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import signal
import struct
import sys

from labkit.grading.box.inside.limits import FILE_BYTES, MEMORY

# Constants of libseccomp: what becomes of a system call, and how its argument is compared.
ALLOW = 0x7FFF0000
FAIL = 0x00050000
NOT_EQUAL = 1
MASKED_EQUAL = 7
# Network, new programs, other processes, memory that outlives the process, doors into the kernel.
REFUSED = """
    socket execve execveat fork vfork ptrace process_vm_readv process_vm_writev setns unshare mount
    bpf perf_event_open userfaultfd add_key request_key keyctl shmget msgget semget mq_open
    io_uring_setup pidfd_open pidfd_getfd memfd_create memfd_secret bind connect listen accept
    accept4 sendmsg sendmmsg
"""
# Where a box shares the file system with others: all that leaves something there.
MAKING = """
    mkdir mkdirat mknod mknodat symlink symlinkat link linkat rename renameat renameat2 creat
    openat2 truncate chmod fchmodat utime utimes utimensat futimesat inotify_init inotify_init1
    fanotify_init
"""
SOME = (  # by the value of an argument: its place, the comparison, and its two numbers
    ("clone", 0, MASKED_EQUAL, 0x00010000, 0),  # all but threads
    ("sendto", 4, NOT_EQUAL, 0, 0),  # to an address
    ("prctl", 0, MASKED_EQUAL, 0xFFFFFFFF, 1),  # to live on when the grader dies
)
MAKING_SOME = tuple(
    (name, place, MASKED_EQUAL, flag, flag)
    for name, place in (("open", 1), ("openat", 2))
    for flag in (os.O_CREAT, os.O_TRUNC)
)


def confine(*, seconds: float, user: int, wall: str) -> None:
    """Give up, for good: time, memory, one's user for another, and system calls behind a wall."""
    limits = {"CPU": int(seconds) + 1, "NOFILE": 128, "CORE": 0, "AS": MEMORY}
    limits["FSIZE"] = FILE_BYTES if wall == "bubblewrap" else 0
    for kind, limit in limits.items():
        if kind != "AS" or sys.platform == "linux":  # macOS cannot limit it
            resource.setrlimit(getattr(resource, f"RLIMIT_{kind}"), (limit, limit))
    if user:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL, 0, 0, 0)  # it dies when the grader does
    if wall != "none":
        _refuse(ctypes.CDLL("libseccomp.so.2"), shares_files=wall == "user")


def _refuse(library: ctypes.CDLL, *, shares_files: bool) -> None:
    """Have system calls refused; raise where this system does not take the filter."""
    library.seccomp_init.restype = ctypes.c_void_p
    rules = ctypes.c_void_p(library.seccomp_init(ALLOW))
    names = (REFUSED + MAKING * shares_files).split()
    conditional = SOME + MAKING_SOME * shares_files
    for name, *values in [*((name,) for name in names), ("clone3",), *conditional]:
        number = library.seccomp_syscall_resolve_name(str(name).encode())
        if number < -1:  # this processor has no such call
            continue
        error = errno.ENOSYS if name == "clone3" else errno.EPERM  # libc then takes clone
        condition = struct.pack("IiQQ", *(values or (0, 0, 0, 0)))
        if library.seccomp_rule_add_array(rules, FAIL | error, number, len(values) // 4, condition):
            raise OSError(errno.ENOSYS, f"libseccomp cannot refuse {name}")
    if library.seccomp_load(rules):
        raise OSError(errno.ENOSYS, "this system filters no system calls")
